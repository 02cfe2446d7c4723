//! One way through the house: a module uses only what stands before it.

mod common;

use std::path::Path;

/// The modules in the order of the data.
const ORDER: [&str; 15] = [
    "mesh",
    "scenario",
    "fem",
    "contact",
    "problem",
    "flow",
    "event",
    "simulate",
    "records",
    "continuation",
    "orbit",
    "hbm",
    "store",
    "report",
    "families",
];

fn files(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The modules that a path behind `crate::` begins with: one, or those of a list in braces.
fn first_names(path: &str) -> Vec<String> {
    let word = |text: &str| -> String {
        text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let Some(list) = path.strip_prefix('{') else { return vec![word(path)] };
    let mut depth = 0;
    let mut names = vec![word(list)];
    for (k, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => names.push(word(&list[k + 1..])),
            _ => {}
        }
    }
    names
}

#[test]
fn lists_in_braces_are_seen_through() {
    assert_eq!(first_names("orbit::chain;"), ["orbit"]);
    assert_eq!(first_names("{fem::{Body, Csr}, orbit::x, hbm};"), ["fem", "orbit", "hbm"]);
}

#[test]
fn no_module_uses_a_later_one() {
    let src = common::root().join("src");
    let mut all = vec![];
    files(&src, &mut all);
    let mut upward = vec![];
    for path in all {
        let relative = path.strip_prefix(&src).unwrap();
        let module = relative.iter().next().unwrap().to_string_lossy();
        let module = module.trim_end_matches(".rs");
        let Some(place) = ORDER.iter().position(|m| *m == module) else {
            assert!(["cli", "lib", "main"].contains(&module), "{module} has no place in the order");
            continue;
        };
        let text = std::fs::read_to_string(&path).unwrap();
        // tests inside a file may look further
        let code = text.split("#[cfg(test)]").next().unwrap();
        for name in code.split("crate::").skip(1).flat_map(first_names) {
            let other = ORDER.iter().position(|m| *m == name);
            if other.is_some_and(|other| other > place) {
                upward.push(format!("{} uses {name}", relative.display()));
            }
        }
    }
    assert!(upward.is_empty(), "{upward:#?}");
}

#[test]
fn main_is_thin() {
    let text = std::fs::read_to_string(common::root().join("src/main.rs")).unwrap();
    assert!(text.lines().count() <= 20);
}
