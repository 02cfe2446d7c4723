//! The documentation: every command in it works, every scene in it runs, every link leads somewhere.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{root, run};

fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            pages(&path, found);
        } else if path.extension().is_some_and(|e| e == "md") {
            found.push(path);
        }
    }
    found.sort();
}

fn all_pages() -> Vec<PathBuf> {
    let mut found = vec![];
    pages(&root().join("docs"), &mut found);
    found
}

/// Language and text of every fenced block.
fn blocks(text: &str) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = vec![];
    let mut open = false;
    for line in text.lines() {
        match line.strip_prefix("```") {
            Some(_) if open => open = false,
            Some(language) => {
                open = true;
                found.push((language.trim().to_owned(), String::new()));
            }
            None if open => {
                let text = &mut found.last_mut().unwrap().1;
                text.push_str(line);
                text.push('\n');
            }
            None => {}
        }
    }
    assert!(!open, "a fence is not closed");
    found
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, target).unwrap();
        }
    }
}

/// Blocks marked `sh` are carried out line by line, a page in a folder of its own with the scenes in it; a block of TOML that begins with `# file: NAME` is that file.
#[test]
fn commands_of_the_documentation_work() {
    let (mut ran, mut files) = (0, 0);
    for page in all_pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let blocks = blocks(&text);
        if !blocks.iter().any(|b| b.0 == "sh") {
            continue;
        }
        let place = tempfile::tempdir().unwrap();
        copy(&root().join("scenarios"), &place.path().join("scenarios"));
        for (language, text) in blocks {
            let name = text.lines().next().and_then(|l| l.strip_prefix("# file: "));
            if let (true, Some(name)) = (language == "toml", name) {
                std::fs::write(place.path().join(name.trim()), &text).unwrap();
                files += 1;
            }
            for line in text.lines().filter(|_| language == "sh") {
                let words: Vec<&str> = line.split_whitespace().collect();
                let words = words.split(|w| w.starts_with('#')).next().unwrap();
                assert_eq!(words.first(), Some(&"signorini"), "{}: {line}", page.display());
                let output = Command::new(env!("CARGO_BIN_EXE_signorini"))
                    .args(&words[1..])
                    .current_dir(place.path())
                    .output()
                    .unwrap();
                let said = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{}: {line}: {said}", page.display());
                ran += 1;
            }
        }
    }
    assert!(ran >= 20 && files >= 1, "{ran} commands, {files} files");
}

/// The page of commands is what the program says.
#[test]
fn the_page_of_commands_is_what_the_program_says() {
    let page = std::fs::read_to_string(root().join("docs/reference/commands.md")).unwrap();
    let said = String::from_utf8(run(&["man", "--markdown"]).stdout).unwrap();
    let at = page.lines().zip(said.lines()).find(|(a, b)| a != b);
    assert!(page == said, "make docs writes it anew; first difference: {at:?}");
}

/// The page of validation is made from an answer of the program that has all cases of today.
#[test]
fn the_page_of_validation_has_every_case() {
    let page = std::fs::read_to_string(root().join("docs/reference/validation.md")).unwrap();
    let cases = crate::common::json(&["validate", "--list"]);
    let text = |v: &serde_json::Value| v.as_str().unwrap().to_owned();
    let cases: Vec<_> =
        cases.as_array().unwrap().iter().filter(|c| c["only_by_name"] == false).collect();
    assert_eq!(page.lines().filter(|l| l.starts_with("## ")).count(), cases.len());
    for case in cases {
        let (name, title, source) =
            (text(&case["name"]), text(&case["title"]), text(&case["source"]));
        let part = page.split("\n## ").find(|p| p.starts_with(&format!("{name}\n")));
        let part = part.unwrap_or_else(|| panic!("make validation: {name} is missing"));
        // titles begin a sentence there
        let title: String = title.chars().skip(1).collect();
        let said = part.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains(&title) && said.contains(&source), "make validation: {name}");
        assert!(part.contains("| measured |") && !part.contains("not accepted"), "{name}");
    }
}

/// No line and no cell of a table is too long to read: 120 letters, 100, apart from where links lead; pictures stand by themselves.
#[test]
fn lines_are_short() {
    let mut pages = all_pages();
    pages.extend(["README.md", "CONTRIBUTING.md"].map(|p| root().join(p)));
    let mut long = vec![];
    for page in pages {
        let text = std::fs::read_to_string(&page).unwrap();
        let mut is_code = false;
        for (k, line) in text.lines().enumerate() {
            is_code ^= line.trim_start().starts_with("```");
            if is_code || line.starts_with("![") {
                continue;
            }
            // [words](target): the words
            let mut shown = String::new();
            let mut rest = line;
            while let Some((before, after)) = rest.split_once("](") {
                shown += before;
                rest = after.split_once(')').map_or("", |(_, rest)| rest);
            }
            shown += rest;
            let is_long = match line.starts_with('|') {
                true => shown.split('|').any(|cell| cell.trim().chars().count() > 100),
                false => shown.chars().count() > 120,
            };
            if is_long {
                long.push(format!("{}:{}: {line}", page.display(), k + 1));
            }
        }
    }
    assert!(long.is_empty(), "{long:#?}");
}

/// Links to files, in the documentation and on the front pages, lead to files; of pages, to headings that are there.
#[test]
fn links_lead_somewhere() {
    let mut pages = all_pages();
    pages.extend(["README.md", "CONTRIBUTING.md", "python/README.md"].map(|p| root().join(p)));
    let heading = |line: &str| -> Option<String> {
        let text = line.trim_start_matches('#').strip_prefix(' ')?;
        let plain = text.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        Some(plain.collect::<String>().to_lowercase().replace(' ', "-"))
    };
    let headings = |page: &Path| -> BTreeSet<String> {
        let text = std::fs::read_to_string(page).unwrap();
        text.lines().filter(|l| l.starts_with('#')).filter_map(heading).collect()
    };
    let mut count = 0;
    for page in pages {
        let text = std::fs::read_to_string(&page).unwrap();
        for link in text.split("](").skip(1) {
            let Some((target, _)) = link.split_once(')') else { continue };
            if target.starts_with("http") || target.contains([' ', '\n', '|']) {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path = match file {
                "" => page.clone(),
                file => page.parent().unwrap().join(file),
            };
            assert!(path.exists(), "{}: {target}", page.display());
            let is_page = path.extension().is_some_and(|e| e == "md");
            if is_page && !anchor.is_empty() {
                assert!(headings(&path).contains(anchor), "{}: {target}", page.display());
            }
            count += 1;
        }
    }
    assert!(count > 40, "{count}");
}

/// All of the program's source.
fn code() -> String {
    fn texts(folder: &Path, found: &mut String) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                texts(&path, found);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push_str(&std::fs::read_to_string(path).unwrap());
            }
        }
    }
    let mut all = String::new();
    texts(&root().join("src"), &mut all);
    all
}

/// What the code cites as "theory §n" is a section of the page of theory, and the modules that the page names are there.
#[test]
fn the_theory_that_the_code_cites_is_there() {
    let page = std::fs::read_to_string(root().join("docs/theory.md")).unwrap();
    let code = code();
    let mut count = 0;
    for cited in code.split("theory §").skip(1) {
        let number: String = cited.chars().take_while(char::is_ascii_digit).collect();
        assert!(page.contains(&format!("\n## {number}. ")), "theory §{number}");
        count += 1;
    }
    assert!(count > 20, "{count}");
    for named in page.split("Modules ").skip(1).chain(page.split("Module ").skip(1)) {
        let sentence = named.split(&[';', '\n'][..]).next().unwrap();
        for module in sentence.split('`').skip(1).step_by(2) {
            let is_there = ["src/core", "src"].iter().any(|of| {
                let path = root().join(of).join(module.replace("::", "/"));
                path.is_dir() || path.with_extension("rs").exists()
            });
            assert!(is_there, "{module}");
        }
    }
}

/// Every equation of the page of theory has a number, in order, and a row that names the function which computes it; each such function is there.
#[test]
fn every_equation_has_its_function() {
    let page = std::fs::read_to_string(root().join("docs/theory.md")).unwrap();
    let (text, table) = page.split_once("\n## 13. Where each equation is\n").unwrap();
    let number = |line: &str| -> Option<usize> {
        let (_, last) = line.strip_suffix(')')?.rsplit_once('(')?;
        last.parse().ok().filter(|_| line.starts_with("    "))
    };
    let stated: Vec<usize> = text.lines().filter_map(number).collect();
    assert_eq!(stated, (1..=stated.len()).collect::<Vec<_>>());
    assert!(stated.len() >= 27);
    let mut found = BTreeSet::new();
    for row in table.lines().filter(|l| l.starts_with("| (")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [equation, _, file, function] = cells[..] else { panic!("{row}") };
        found.insert(equation.trim_matches(['(', ')']).parse::<usize>().unwrap());
        let code = std::fs::read_to_string(root().join(file.trim_matches('`'))).unwrap();
        let name = format!("fn {}", function.trim_matches('`'));
        assert!(code.contains(&format!("{name}(")) || code.contains(&format!("{name}<")), "{row}");
    }
    assert_eq!(found, stated.into_iter().collect());
}

/// Each hypothesis of the theorem of theory §12 is named by a line of code that stands for it, and no line names one that is not there.
#[test]
fn every_hypothesis_of_the_certificate_stands_in_the_code() {
    let number = |text: &str| text.chars().take_while(char::is_ascii_digit).collect::<String>();
    let page = std::fs::read_to_string(root().join("docs/theory.md")).unwrap();
    let section = page.split("\n## 12. ").nth(1).unwrap();
    let stated: BTreeSet<String> = section.split("\n- **H").skip(1).map(number).collect();
    let code = code();
    let cited: BTreeSet<String> = code.split("theory §12, H").skip(1).map(number).collect();
    assert_eq!(stated, cited);
    assert!(stated.len() >= 7, "{stated:?}");
}

/// The reader for MATLAB reads a run and a family in Octave, where there is one.
#[test]
fn the_matlab_reader_reads_in_octave() {
    if Command::new("octave-cli").arg("--version").output().is_err() {
        crate::common::unavailable("Octave", crate::common::Kind::System);
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("bar.h5");
    let scene = root().join("scenarios/bar.toml");
    assert!(run(&["run", scene.to_str().unwrap(), "-o", file.to_str().unwrap()]).status.success());
    let program = format!(
        "addpath('{}'); r = signorini_read('{}'); k = r.mesh.contact_dofs(1) + 1; \
         printf('%d %d %.17g %.17g\\n', size(r.trajectory.u), r.trajectory.t(end), max(r.trajectory.u(k,:)))",
        root().join("docs/tutorials").display(),
        file.display()
    );
    let output =
        Command::new("octave-cli").args(["--no-gui", "--eval", &program]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let said = String::from_utf8_lossy(&output.stderr);
    let numbers: Vec<f64> = text.split_whitespace().map(|x| x.parse().unwrap()).collect();
    let hdf = crate::common::hdf5_files().open(&file).unwrap();
    let u = hdf.dataset("trajectory/u").unwrap().read_2d::<f64>().unwrap();
    let t = hdf.dataset("trajectory/t").unwrap().read_1d::<f64>().unwrap();
    let (rows, columns) = u.dim();
    assert_eq!(numbers[..2], [columns as f64, rows as f64], "{text} {said}");
    let most = u.column(columns - 1).iter().fold(f64::MIN, |m, x| m.max(*x));
    assert_eq!(numbers[2..], [t[rows - 1], most], "{text} {said}");
}

/// The scene of the page of units has the mass and the frequency that one computes by hand.
#[test]
fn the_steel_cantilever_of_the_page_of_units() {
    let page = std::fs::read_to_string(root().join("docs/units.md")).unwrap();
    let in_words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let scene = page.split_once("```toml\n").unwrap().1.split_once("```").unwrap().0;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("steel.toml");
    std::fs::write(&path, scene).unwrap();
    let path = path.display().to_string();
    let said = crate::common::json(&["inspect", &path]);
    let mass = said["masses"][0]["mass"].as_f64().unwrap();
    assert!((mass / (100.0 * 10.0 * 5.0 * 7.85e-9) - 1.0).abs() < 1e-12, "{mass}");
    let (omega, beam) = (
        said["omega"][0].as_f64().unwrap(),
        3.51602 * (2.1e5f64 * 100.0 / 12.0 / 7.85e-9).sqrt() / 1e4,
    );
    assert!((omega / beam - 1.0).abs() < 2e-3, "{omega} {beam}");
    assert!(in_words.contains(&format!("says {omega:.0} rad/s")), "{omega}");
    let words = crate::common::run(&["inspect", &path]);
    let words = String::from_utf8_lossy(&words.stdout).into_owned();
    assert!(words.contains("mass        3.9250e-5") && words.contains("gaps from 0.05"), "{words}");
}

/// A reduced body weighs what it weighs.
#[test]
fn inspect_knows_the_masses_of_reduced_bodies() {
    let scene = root().join("scenarios/clatter.toml").display().to_string();
    let said = crate::common::json(&["inspect", &scene]);
    let masses: Vec<f64> =
        said["masses"].as_array().unwrap().iter().map(|m| m["mass"].as_f64().unwrap()).collect();
    assert!((masses[0] - 0.1).abs() < 1e-14 && (masses[1] - 0.12).abs() < 1e-14, "{masses:?}");
}
