//! Continuous integration tells the truth: its exit code, its table of times, what it leaves out, and which slow tests it runs.

use std::path::Path;
use std::process::Command;

use crate::common::root;

/// What a script of steps prints, and its exit code.
fn steps(script: &str) -> (String, Option<i32>) {
    let text = format!("cd '{}'; source .ci/steps.sh\n{script}", root().display());
    let output = Command::new("bash").args(["-c", &text]).output().unwrap();
    (String::from_utf8(output.stdout).unwrap(), output.status.code())
}

#[test]
fn a_table_of_times_and_what_is_left_out_come_last() {
    let (said, code) = steps(
        "step one true\ntwo() { skipped 'a thing'; echo 'another (a test)' >> $SIGNORINI_SKIPPED; skipped 'a thing'; }\nstep two two",
    );
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(lines[lines.len() - 1], "skipped: a thing; another (a test)");
    let table = lines.iter().position(|l| *l == "=== times").unwrap();
    let names: Vec<&str> =
        lines[table + 1..lines.len() - 1].iter().map(|l| l.split(" s  ").nth(1).unwrap()).collect();
    assert_eq!(names, ["one", "two", "in all"]);
    assert!(steps("step one true").0.ends_with("skipped: nothing\n"));
}

/// A step that fails ends it with its code, at the command that failed, and the table says so.
#[test]
fn a_failure_is_one() {
    for (script, wanted) in [
        ("step one true; step two bash -c 'exit 7'; step three true", 7),
        ("two() { bash -c 'exit 7'; echo went on; }; step two two; step three true", 7),
        ("two() { false | cat; }; step two two; step three true", 1),
        ("two() { kill -TERM $$; sleep 5; }; step two two; step three true", 143),
    ] {
        let (said, code) = steps(script);
        assert_eq!(code, Some(wanted), "{script}: {said}");
        assert!(said.contains(&format!("two: FAILED ({wanted})\n")), "{script}: {said}");
        assert!(!said.contains("three") && !said.contains("went on"), "{script}: {said}");
        assert!(said.ends_with("skipped: nothing\n"), "{script}: {said}");
    }
}

/// A release says its version everywhere, once: in manifests, lock, citation and changelog; and refuses what is no later one.
#[test]
fn a_release_has_one_version() {
    let tree = tempfile::tempdir().unwrap();
    let files = [
        "Cargo.toml",
        "Cargo.lock",
        "CITATION.cff",
        ".zenodo.json",
        ".ci/conda/recipe.yaml",
        "CHANGELOG.md",
        "src/core/Cargo.toml",
        "src/c/Cargo.toml",
        "python/Cargo.toml",
    ];
    for name in files {
        let to = tree.path().join(name);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(root().join(name), to).unwrap();
    }
    let text = |name: &str| std::fs::read_to_string(tree.path().join(name)).unwrap();
    // right behind a release nothing is unreleased
    let (log, heading) = (tree.path().join("CHANGELOG.md"), "## Unreleased\n");
    let line = "- Something new, told in so many words that the text of a tag has more than a hundred letters in all.\n";
    let more = text("CHANGELOG.md").replacen(heading, &format!("{heading}\n{line}"), 1);
    std::fs::write(log, more).unwrap();
    let before = files.map(&text);
    let release = |version: &str| {
        let script = root().join(".ci/release.py");
        let mut command = Command::new("python3");
        command.arg(script).args([version, "--texts", "--date", "2030-01-02", "--tree"]);
        command.arg(tree.path()).output().unwrap()
    };
    for bad in ["0.0.9", env!("CARGO_PKG_VERSION"), "1.0", "v1.0.0"] {
        assert!(!release(bad).status.success(), "{bad}");
    }
    assert_eq!(files.map(&text), before);
    let output = release("97.1.4");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for (name, places) in [
        ("Cargo.toml", 2),
        ("Cargo.lock", 4),
        ("CITATION.cff", 1),
        (".zenodo.json", 1),
        (".ci/conda/recipe.yaml", 1),
        ("CHANGELOG.md", 1),
        ("src/core/Cargo.toml", 1),
        ("src/c/Cargo.toml", 1),
        ("python/Cargo.toml", 1),
    ] {
        assert_eq!(text(name).matches("97.1.4").count(), places, "{name}");
    }
    assert!(text("CITATION.cff").contains("date-released: 2030-01-02"));
    assert!(text("CHANGELOG.md").contains("## Unreleased\n\n## 97.1.4 - 2030-01-02\n"));
    let notes = text("target/release-notes/97.1.4.md");
    assert!(notes.starts_with("signorini 97.1.4\n\n") && notes.len() > 100, "{notes}");
    // nothing is unreleased any more
    assert!(!release("97.1.5").status.success());
}

/// The wheel brings the licences of the project, as they are.
#[test]
fn the_wheel_has_the_licences() {
    let text = |name: &str| std::fs::read_to_string(root().join(name)).unwrap();
    for (own, copy) in [("LICENSE-MIT", "MIT.txt"), ("LICENSE-APACHE", "Apache-2.0.txt")] {
        assert_eq!(text(own), text(&format!("python/LICENSES/{copy}")));
    }
}

/// Every file with an ignored test is named there, run or with the reason why not.
#[test]
fn ignored_tests_are_accounted_for() {
    let script = std::fs::read_to_string(root().join(".ci/run")).unwrap();
    let mut found = vec![];
    for entry in std::fs::read_dir(root().join("tests")).unwrap() {
        let path = entry.unwrap().path();
        let is_source = path.extension().is_some_and(|e| e == "rs");
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        if is_source && std::fs::read_to_string(&path).unwrap().contains("\n#[ignore") {
            let is_named =
                [format!(" {name}::"), format!("`{name}` ")].iter().any(|n| script.contains(n));
            assert!(is_named, "tests/{name}.rs has an ignored test that .ci/run does not name");
            found.push(name);
        }
    }
    assert!(found.len() >= 4, "{found:?}");
}

/// What is missing is written down at home; where what is pinned must be there, it is a failure.
#[test]
fn what_is_missing_is_counted_or_fails() {
    let here = std::env::current_exe().unwrap();
    let place = tempfile::tempdir().unwrap();
    let list = place.path().join("skipped");
    let call = |strict: Option<&str>, kind: &str| {
        let mut command = Command::new(&here);
        command.args(["--exact", "ci::a_program_is_missing", "--nocapture"]);
        command.env("SIGNORINI_SKIPPED", &list).env("SIGNORINI_MISSING", kind);
        match strict {
            Some(value) => command.env("SIGNORINI_STRICT", value),
            None => command.env_remove("SIGNORINI_STRICT"),
        };
        let output = command.output().unwrap();
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let lines = |path: &Path| std::fs::read_to_string(path).unwrap_or_default().lines().count();
    for (strict, kind, passes) in [
        (None, "system", true),
        (None, "pinned", true),
        (Some("0"), "pinned", true),
        (Some("1"), "system", true),
        (Some("1"), "pinned", false),
    ] {
        let before = lines(&list);
        let (passed, said) = call(strict, kind);
        assert_eq!(passed, passes, "{strict:?} {kind}: {said}");
        assert_eq!(lines(&list), before + usize::from(passes), "{strict:?} {kind}");
        assert_eq!(
            said.contains("SKIPPED: a thing is not there: ci::a_program_is_missing"),
            passes
        );
    }
    assert!(
        std::fs::read_to_string(&list).unwrap().contains("a thing (ci::a_program_is_missing)\n")
    );
}

/// The other half of the test above, which calls it.
#[test]
fn a_program_is_missing() {
    match std::env::var("SIGNORINI_MISSING").as_deref() {
        Ok("pinned") => crate::common::unavailable("a thing", crate::common::Kind::Pinned),
        Ok(_) => crate::common::unavailable("a thing", crate::common::Kind::System),
        Err(_) => {}
    }
}
