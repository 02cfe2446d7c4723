//! One way through the house: a module uses only what stands before it.

mod common;
#[path = "layering/scanner.rs"]
mod scanner;

use std::path::{Path, PathBuf};

/// A crate: its folder, what of it belongs to others, and its modules in the order of the data.
struct Crate {
    folder: &'static str,
    without: &'static str,
    order: &'static [&'static str],
}

/// The numerics, and the program around them, which may use any of them.
const CRATES: [Crate; 2] = [
    Crate {
        folder: "src/core",
        without: "src/core/examples",
        order: &[
            "mesh",
            "fem",
            "contact",
            "flow",
            "event",
            "schemes",
            "records",
            "continuation",
            "orbit",
            "hbm",
            "model",
        ],
    },
    Crate {
        folder: "src",
        without: "src/core",
        order: &[
            "scenario", "matrices", "problem", "simulate", "records", "store", "report",
            "families", "compare", "study",
        ],
    },
];

/// What stands behind all modules: it may use any of them.
const LAST: [&str; 4] = ["build", "cli", "lib", "main"];

fn files(folder: &Path, without: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && path != without {
            files(&path, without, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

impl Crate {
    /// All its files: module path and text.
    fn sources(&self) -> Vec<(Vec<String>, String)> {
        let root = common::root();
        let folder = root.join(self.folder);
        let mut all = vec![];
        files(&folder, &root.join(self.without), &mut all);
        let source = |path: PathBuf| {
            let relative = path.strip_prefix(&folder).unwrap().with_extension("");
            let mut module: Vec<String> =
                relative.iter().map(|part| part.to_string_lossy().into_owned()).collect();
            module.pop_if(|last| last == "mod");
            (module, std::fs::read_to_string(&path).unwrap())
        };
        all.into_iter().map(source).collect()
    }

    fn place(&self, module: &str) -> Option<usize> {
        self.order.iter().position(|m| *m == module)
    }
}

#[test]
fn no_module_uses_a_later_one() {
    let mut upward = vec![];
    let mut uses = 0;
    for of in &CRATES {
        for (module, text) in of.sources() {
            let Some(own) = of.place(&module[0]) else {
                assert!(LAST.contains(&&*module[0]), "{} has no place in the order", module[0]);
                continue;
            };
            let parts: Vec<&str> = module.iter().map(String::as_str).collect();
            for named in scanner::named(&text, &parts) {
                let Some(first) = named.path.first() else { continue };
                let behind = of.place(first).is_some_and(|other| other > own);
                // with everything of the root in view any module can be named without its path
                if behind || first == "*" || LAST.contains(&first.as_str()) {
                    upward.push(format!("{}, line {}: {first}", module.join("::"), named.line));
                }
                uses += usize::from(first != &module[0]);
            }
        }
    }
    assert!(upward.is_empty(), "{upward:#?}");
    // the scanner sees what is there
    assert!(uses > 300, "{uses}");
}

/// What the root of a crate gave other names to, or what came from other files, could be used without being seen.
#[test]
fn the_root_declares_modules_and_nothing_else() {
    for (module, text) in CRATES.iter().flat_map(Crate::sources) {
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
