//! One way through the house: a module uses only what stands before it.

mod common;
#[path = "layering/scanner.rs"]
mod scanner;

use std::path::{Path, PathBuf};

/// The modules in the order of the data.
const ORDER: [&str; 19] = [
    "mesh",
    "scenario",
    "fem",
    "contact",
    "problem",
    "flow",
    "event",
    "stepping",
    "waves",
    "simulate",
    "records",
    "continuation",
    "orbit",
    "hbm",
    "store",
    "report",
    "families",
    "compare",
    "study",
];

/// What stands behind all modules: it may use any of them.
const LAST: [&str; 3] = ["cli", "lib", "main"];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// All files of the crate: module path and text.
fn sources() -> Vec<(Vec<String>, String)> {
    let src = common::root().join("src");
    let mut all = vec![];
    files(&src, &mut all);
    let source = |path: PathBuf| {
        let relative = path.strip_prefix(&src).unwrap().with_extension("");
        let mut module: Vec<String> =
            relative.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        module.pop_if(|last| last == "mod");
        (module, std::fs::read_to_string(&path).unwrap())
    };
    all.into_iter().map(source).collect()
}

fn place(module: &str) -> Option<usize> {
    ORDER.iter().position(|m| *m == module)
}

#[test]
fn no_module_uses_a_later_one() {
    let mut upward = vec![];
    let mut uses = 0;
    for (module, text) in sources() {
        let Some(own) = place(&module[0]) else {
            assert!(LAST.contains(&&*module[0]), "{} has no place in the order", module[0]);
            continue;
        };
        let parts: Vec<&str> = module.iter().map(String::as_str).collect();
        for named in scanner::named(&text, &parts) {
            let Some(first) = named.path.first() else { continue };
            let behind = place(first).is_some_and(|other| other > own);
            // with everything of the root in view any module can be named without its path
            if behind || first == "*" || LAST.contains(&first.as_str()) {
                upward.push(format!("{}, line {}: {first}", module.join("::"), named.line));
            }
            uses += usize::from(place(first).is_some_and(|other| other < own));
        }
    }
    assert!(upward.is_empty(), "{upward:#?}");
    // the scanner sees what is there
    assert!(uses > 300, "{uses}");
}

/// What the root of the crate gave other names to, or what came from other files, could be used without being seen.
#[test]
fn the_root_declares_modules_and_nothing_else() {
    for (module, text) in sources() {
        if module == ["lib"] {
            assert!(scanner::declares_modules_only(&text));
        }
        if !LAST.contains(&&*module[0]) {
            assert!(!scanner::takes_in_files(&text), "{}", module.join("::"));
        }
    }
}

#[test]
fn main_is_thin() {
    let text = std::fs::read_to_string(common::root().join("src/main.rs")).unwrap();
    assert!(text.lines().count() <= 20);
}
