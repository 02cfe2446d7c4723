//! `signorini benchmark`: what is built in, what other codes find, folders of one's own.

use std::collections::BTreeSet;
use std::path::Path;

use crate::common::{json, root, run};
use serde_json::Value;

fn text(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// All numbers are near those of their sources, and every folder with its files is built in.
#[test]
fn all_numbers_are_those_of_their_sources() {
    let answer = json(&["benchmark"]);
    let found = answer["benchmarks"].as_array().unwrap();
    for b in found {
        assert_eq!(b["passes"], true, "{b}");
        for q in b["quantities"].as_array().unwrap() {
            let within = q["within"].as_f64().unwrap();
            // a tolerance that anything passes says nothing
            assert!(within > 0.0 && within <= 0.1 && q["off"].as_f64().unwrap() <= within, "{q}");
        }
    }
    let folder = root().join("validate/benchmarks");
    let names = |path: &Path| -> BTreeSet<String> {
        let entries = std::fs::read_dir(path).unwrap().map(|e| e.unwrap().file_name());
        entries.map(|n| n.into_string().unwrap()).collect()
    };
    let ours: BTreeSet<String> =
        found.iter().map(|b| b["name"].as_str().unwrap().to_owned()).collect();
    let mut there = names(&folder);
    there.remove("results");
    assert_eq!(ours, there);
    let place = tempfile::tempdir().unwrap();
    let kept = place.path().display().to_string();
    json(&["benchmark", "elastic-stop-mode", "--keep", &kept]);
    let at = place.path().join("elastic-stop-mode");
    assert!(names(&at).is_superset(&names(&folder.join("elastic-stop-mode"))));
    // what is kept is a benchmark
    json(&["benchmark", &at.display().to_string()]);
}

/// The page has every benchmark and every quantity of today.
#[test]
fn the_page_has_every_benchmark() {
    let page = std::fs::read_to_string(root().join("docs/reference/benchmarks.md")).unwrap();
    let all = json(&["benchmark", "--list"]);
    let all = all.as_array().unwrap();
    assert_eq!(page.lines().filter(|l| l.starts_with("## ")).count(), all.len());
    for b in all {
        let part = page.split("\n## ").find(|p| p.starts_with(b["name"].as_str().unwrap()));
        let part = part.unwrap_or_else(|| panic!("make validation: {b} is missing"));
        let said = part.split_whitespace().collect::<Vec<_>>().join(" ");
        for name in b["quantities"].as_array().unwrap().iter().chain([&b["source"]]) {
            assert!(said.contains(name.as_str().unwrap()), "make validation: {name}");
        }
        assert!(!part.contains("missed"), "{part}");
    }
}

/// What other codes found, as it is kept beside, is read, and is near the references too.
#[test]
fn results_that_are_kept_are_read() {
    let path = "validate/benchmarks/results/scipy.toml";
    let answer =
        json(&["benchmark", "two-element-bar", "elastic-stop-mode", "den-hartog", "--with", path]);
    for q in answer["benchmarks"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|b| b["quantities"].as_array().unwrap())
    {
        let other = &q["others"][0];
        assert!(
            other["code"].as_str().unwrap().starts_with("SciPy")
                && other["off"].as_f64().unwrap() < 1e-11,
            "{q}"
        );
    }
}

/// The form, filled in, is what `--with` reads; names that no benchmark has are refused.
#[test]
fn what_another_code_finds_stands_beside() {
    let form = text(&run(&["benchmark", "den-hartog", "elastic-stop-mode", "--form"]));
    assert!(form.contains("[values.den-hartog]") && form.contains("# \"amplitude\" ="), "{form}");
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("other.toml");
    let path = file.display().to_string();
    let filled = form.replace("# \"amplitude\" = ", "\"amplitude\" = 1.05 #");
    std::fs::write(&file, &filled).unwrap();
    let answer = json(&["benchmark", "den-hartog", "elastic-stop-mode", "--with", &path]);
    let quantity = &answer["benchmarks"][0]["quantities"][0];
    let other = &quantity["others"][0];
    assert_eq!((&other["code"], &other["value"]), (&Value::from("name and version"), &1.05.into()));
    let exact: f64 = 1.0465523617493284;
    assert!((other["off"].as_f64().unwrap() - (1.05 - exact) / exact).abs() < 1e-12);
    assert_eq!(answer["benchmarks"][1]["quantities"][0]["others"].as_array().unwrap().len(), 0);
    let page = text(&run(&["benchmark", "den-hartog", "--markdown", "--with", &path]));
    assert!(page.contains("off by | name and version |") && page.contains("3.3e-3 |"), "{page}");
    for (old, new, said) in [
        ("\"amplitude\"", "\"amplitud\"", "no quantity \"amplitud\""),
        ("values.den-hartog", "values.den-hartig", "no such benchmark"),
        ("code =", "kode =", "kode"),
        ("\"amplitude\" = 1.05", "# ", "none is filled in"),
    ] {
        std::fs::write(&file, filled.replacen(old, new, 1)).unwrap();
        let output = run(&["benchmark", "den-hartog", "elastic-stop-mode", "--with", &path]);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output).contains(said), "{}", text(&output));
    }
}

/// A folder of one's own; a number that is missed is exit code 3, with what there is; what is no benchmark is exit code 2.
#[test]
fn a_folder_is_a_benchmark() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("mine");
    std::fs::create_dir(&folder).unwrap();
    let from = root().join("validate/benchmarks/elastic-stop-mode");
    for name in ["scene.toml", "one.mtx", "benchmark.toml"] {
        std::fs::copy(from.join(name), folder.join(name)).unwrap();
    }
    let name = folder.display().to_string();
    let answer = json(&["benchmark", &name]);
    assert_eq!(
        (&answer["benchmarks"][0]["name"], &answer["benchmarks"][0]["passes"]),
        (&"mine".into(), &true.into())
    );
    let definition = folder.join("benchmark.toml");
    let whole = std::fs::read_to_string(&definition).unwrap();
    for (old, new, code, said) in [
        ("1.97527527411", "1.98", 3, "amplitude away from the stop"),
        ("/amplitude", "/height", 3, "no number at /height"),
        ("/amplitude", "/switches", 3, "say which, /switches/0"),
        ("\"1.3\"", "\"0.9\"", 3, "amplitude away from the stop"),
        ("\"1.3\"", "\"1e-9\"", 2, "natural periods"),
        ("within = 1e-11", "within = \"near\"", 2, "within"),
        ("[\"orbit\"", "[\"orbits\"", 2, "orbits"),
    ] {
        assert!(whole.contains(old));
        std::fs::write(&definition, whole.replace(old, new)).unwrap();
        let output = run(&["benchmark", &name]);
        assert_eq!(output.status.code(), Some(code), "{}", text(&output));
        assert!(text(&output).contains(said), "{}", text(&output));
    }
    // nothing is left behind, whatever came of it
    let temporary = place.path().join("temporary");
    std::fs::create_dir(&temporary).unwrap();
    let mut command = crate::common::program();
    let output = command.args(["benchmark", &name]).env("TMPDIR", &temporary).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read_dir(&temporary).unwrap().count(), 0);
    let output = run(&["benchmark", "no-such-thing"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output).contains("two-element-bar"));
}
