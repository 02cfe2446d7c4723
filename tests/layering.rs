//! One way through the house: a module uses only what stands before it.

#[path = "layering/scanner.rs"]
mod scanner;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A crate: its folder, what of it belongs to others, and its modules in the order of the data.
struct Crate {
    folder: &'static str,
    without: &'static [&'static str],
    order: &'static [&'static str],
}

/// The numerics, and the program around them, which may use any of them.
const CRATES: [Crate; 2] = [
    Crate {
        folder: "src/core",
        without: &["src/core/examples"],
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
        without: &["src/core", "src/c"],
        order: &[
            "scenario", "matrices", "problem", "simulate", "records", "store", "report",
            "families", "compare", "study",
        ],
    },
];

/// What stands behind all modules: it may use any of them.
const LAST: [&str; 4] = ["build", "cli", "lib", "main"];

fn files(folder: &Path, without: &[PathBuf], found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if !without.contains(&path) {
                files(&path, without, found);
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

impl Crate {
    /// All its files: module path and text.
    fn sources(&self) -> Vec<(Vec<String>, String)> {
        let root = crate::common::root();
        let folder = root.join(self.folder);
        let mut all = vec![];
        let without: Vec<PathBuf> = self.without.iter().map(|w| root.join(w)).collect();
        files(&folder, &without, &mut all);
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

/// Modules with the paths that each names.
type Names = BTreeMap<Vec<String>, Vec<Vec<String>>>;

/// The module that a path leads to: the deepest on its way, or the one from which that hands the next name on.
fn defining<'m>(modules: &'m Names, path: &[String]) -> Option<&'m Vec<String>> {
    let deepest = |path: &[String]| {
        (1..=path.len()).rev().find_map(|n| modules.get_key_value(&path[..n])).map(|m| m.0)
    };
    let found = deepest(path)?;
    let Some(name) = path.get(found.len()) else { return Some(found) };
    let handed_on = modules[found].iter().find(|p| p.last() == Some(name) && p.len() > 1);
    handed_on.and_then(|p| deepest(p)).or(Some(found))
}

/// Files that use each other in a circle, whatever lies between.
fn circles(modules: &Names) -> Vec<Vec<String>> {
    let keys: Vec<&Vec<String>> = modules.keys().collect();
    let place = |m: &Vec<String>| keys.binary_search(&m).unwrap();
    let n = keys.len();
    let mut reaches = vec![vec![false; n]; n];
    for (k, paths) in modules.values().enumerate() {
        for other in paths.iter().filter_map(|p| defining(modules, p)) {
            reaches[k][place(other)] = true;
        }
    }
    for through in 0..n {
        let on = reaches[through].clone();
        for from in reaches.iter_mut().filter(|from| from[through]) {
            from.iter_mut().zip(&on).for_each(|(a, b)| *a |= b);
        }
    }
    let mut found: Vec<Vec<String>> = vec![];
    for k in 0..n {
        let together: Vec<usize> =
            (0..n).filter(|&j| j == k || reaches[k][j] && reaches[j][k]).collect();
        if together[0] == k && together.len() > 1 {
            found.push(together.iter().map(|&j| keys[j].join("::")).collect());
        }
    }
    found
}

/// Files that cannot be read one without the other are three at the most.
#[test]
fn no_knot_has_more_than_three_files() {
    for of in &CRATES {
        let names = |(module, text): (Vec<String>, String)| {
            let parts: Vec<&str> = module.iter().map(String::as_str).collect();
            let paths = scanner::named(&text, &parts).into_iter().map(|n| n.path).collect();
            (module, paths)
        };
        let modules: Names = of.sources().into_iter().map(names).collect();
        let all = circles(&modules);
        let knots: Vec<&Vec<String>> = all.iter().filter(|c| c.len() > 3).collect();
        assert!(knots.is_empty(), "{knots:#?}");
    }
    // they are seen where they are, through what a module hands on
    let path = |text: &str| text.split("::").map(String::from).collect::<Vec<String>>();
    let of = |list: &[(&str, &[&str])]| -> Names {
        list.iter().map(|(m, p)| (path(m), p.iter().map(|p| path(p)).collect())).collect()
    };
    let modules = of(&[
        ("a", &["a::b::X"]),
        ("a::b", &["c::Y"]),
        ("c", &["d::Z"]),
        ("d", &["a::X"]),
        ("e", &["a::X"]),
    ]);
    assert_eq!(circles(&modules), [["a::b", "c", "d"]]);
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
    let text = std::fs::read_to_string(crate::common::root().join("src/main.rs")).unwrap();
    assert!(text.lines().count() <= 20);
}
