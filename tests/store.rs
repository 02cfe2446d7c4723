//! `run.store`, `run.precision`, and reports that list nothing: a file with a part of the displacements says the same of that part, and refuses the rest.

use std::path::Path;
use std::process::{Command, Output};

use crate::common::{problem, root};
use signorini::event::{Observer, Sample, Switch};
use signorini::scenario::Scene;
use signorini::simulate::simulate;
use signorini::store::{Stored, read_state};
use tempfile::TempDir;

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_signorini")).args(arguments).output().unwrap()
}

fn expect(code: i32, arguments: &[&str]) -> String {
    let output = run(arguments);
    let text = String::from_utf8_lossy(&output.stderr).into_owned()
        + &String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
    text
}

/// A scenario for a short time, with more lines in `[run]`.
fn scene(name: &str, until: &str, more: &str) -> String {
    let text = std::fs::read_to_string(root().join("scenarios").join(name)).unwrap();
    let folder = root().join("scenarios");
    // files are named relative to the scene
    let names = ["file = \"", "mass_matrix = \"", "stiffness_matrix = \""];
    let far = |text: String, key: &&str| text.replace(*key, &format!("{key}{}/", folder.display()));
    let text = names.iter().fold(text, far);
    let (head, _) = text.split_once("[run]").unwrap();
    format!("{head}[run]\nuntil = {until}\nsamples = 60\n{more}\n")
}

/// Write a scene, run it, read its file.
fn stored(folder: &TempDir, name: &str, text: &str) -> Stored {
    let path = folder.path().join(format!("{name}.toml"));
    std::fs::write(&path, text).unwrap();
    let file = path.with_extension("h5");
    expect(0, &["run", path.to_str().unwrap(), "-o", file.to_str().unwrap(), "-q", "--force"]);
    Stored::read(&file).unwrap()
}

/// What the files say of contact point `i`.
fn motion(s: &Stored, i: usize) -> Vec<[u64; 3]> {
    let numbers = |r: usize| {
        [s.contact_displacement(r, i), s.contact_velocity(r, i), s.pressure[(r, i)]]
            .map(f64::to_bits)
    };
    (0..s.t.len()).map(numbers).collect()
}

/// Nodes and points of quadrature, matrices, a mesh with oblique contact, a scheme of steps: what is kept of the contact is the same to the last bit.
#[test]
fn the_contact_alone_is_stored_as_with_the_body() {
    let folder = TempDir::new().unwrap();
    let penalty = |text: String| {
        text.replace("[contact]\n", "[contact]\nmethod = \"penalty\"\nstiffness = 100.0\n")
    };
    let steps = |text: String| text.replace("[contact]\n", "[contact]\nmethod = \"moreau-jean\"\n");
    let same = |text: String| text;
    type Change<'c> = &'c dyn Fn(String) -> String;
    let cases: [(&str, &str, Change); 6] = [
        ("plate-half.toml", "3.36", &same),
        ("plate-half.toml", "1.0", &penalty),
        ("bouncing-bar.toml", "4.0", &steps),
        ("two-mass-stop.toml", "8.0", &same),
        ("half-disc.toml", "1e-4", &same),
        ("bracket.toml", "0.3", &same),
    ];
    for (k, (name, until, change)) in cases.iter().enumerate() {
        let all = stored(&folder, &format!("{k}-all"), &change(scene(name, until, "")));
        let text = change(scene(name, until, "store = \"contact\""));
        let part = stored(&folder, &format!("{k}-part"), &text);
        assert!(part.n_kept() < all.n_kept() || name.starts_with("two-mass"), "{name}");
        assert_eq!(part.n_displacements(), all.n_displacements(), "{name}");
        assert_eq!((&part.t, &part.switch_t, &part.energy), (&all.t, &all.switch_t, &all.energy));
        assert!(!part.t.is_empty() && !part.gap.is_empty(), "{name}");
        for i in 0..part.gap.len() {
            assert!(motion(&part, i).iter().flatten().all(|x| f64::from_bits(*x).is_finite()));
            assert_eq!(motion(&part, i), motion(&all, i), "{name}, contact point {i}");
        }
    }
}

/// A group's nodes besides; other nodes are no numbers.
#[test]
fn groups_are_stored_besides() {
    let folder = TempDir::new().unwrap();
    let all = stored(&folder, "all", &scene("plate-half.toml", "1.0", ""));
    let text = scene("plate-half.toml", "1.0", "store = [\"top\"]");
    let part = stored(&folder, "part", &text);
    let nodes = problem(&text).system.body.mesh.clone();
    let (top, right) = (nodes.group_nodes("top"), nodes.group_nodes("right"));
    let last = all.t.len() - 1;
    let kept = |node: &usize| top.contains(node) || right.contains(node);
    for node in 0..nodes.n_nodes() {
        let (of_part, of_all) = (part.displacement(last, node), all.displacement(last, node));
        // held displacements are zero in every file
        let same = |c: usize| of_part[c] == of_all[c];
        let lacks = |c: usize| of_part[c].is_nan() || all.dof_map[(node, c)] < 0;
        assert!(if kept(&node) { same(0) && same(1) } else { lacks(0) && lacks(1) }, "node {node}");
    }
    assert!(part.whole().is_err() && all.whole().is_ok());
    // groups that have every node keep the whole body
    let text = scene("plate-half.toml", "1.0", "store = [\"top\", \"bottom\"]");
    let text = text.replace("elements = [20, 5]", "elements = [20, 1]");
    let every = stored(&folder, "every", &text);
    assert!(every.n_kept() == every.n_displacements() && every.whole().is_ok());
    let body = problem(&text).system.body.clone();
    let file = folder.path().join("every.h5");
    assert!(read_state(&file, &body.mesh, false).is_ok());
}

/// Single precision: seven digits of the states, all of times, energies and switches.
#[test]
fn states_in_single_precision() {
    let folder = TempDir::new().unwrap();
    let all = stored(&folder, "double", &scene("plate-half.toml", "3.36", ""));
    let short =
        stored(&folder, "single", &scene("plate-half.toml", "3.36", "precision = \"single\""));
    assert_eq!((&short.t, &short.switch_t, &short.energy), (&all.t, &all.switch_t, &all.energy));
    for row in 0..all.t.len() {
        let ((u, v), (us, vs)) = (all.state(row), short.state(row));
        let rounded = |x: &[f64]| x.iter().map(|&x| f64::from(x as f32)).collect::<Vec<f64>>();
        assert_eq!((rounded(&u), rounded(&v)), (us, vs), "row {row}");
    }
    // of the datasets: how often a file was flushed, and what that left between them, is a matter of time
    let size = |name: &str| -> u64 {
        let file = hdf5::File::open(folder.path().join(name)).unwrap();
        ["trajectory/u", "trajectory/v"]
            .map(|d| file.dataset(d).unwrap().storage_size())
            .iter()
            .sum()
    };
    assert!(10 * size("single.h5") < 7 * size("double.h5"));
}

/// What needs the whole body says that the file does not hold it, and what to do; what does not, works.
#[test]
fn what_needs_the_whole_body_refuses_a_part() {
    let folder = TempDir::new().unwrap();
    let text = scene("plate-half.toml", "1.0", "store = \"contact\"");
    stored(&folder, "part", &text);
    stored(&folder, "whole", &scene("plate-half.toml", "1.0", ""));
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (file, whole) = (at("part.h5"), at("whole.h5"));
    for refused in [
        &["view", &file, "-o", &at("part.html")][..],
        &["plot", &file, "--only", "shapes", "-o", &at("p")],
        &["plot", &file, "--at", "0.5", "-o", &at("p")],
        &["export", &file, "--format", "vtu", "-o", &at("v")],
        &["export", &file, "--format", "xdmf", "-o", &at("x")],
    ] {
        let said = expect(2, refused);
        assert!(said.contains("[run] store"), "{said}");
    }
    // a reference is looked at before anything is computed
    let scene_file = at("whole.toml");
    let compared = ["compare", &scene_file, "--methods", "nbm", "--reference", &file];
    let said = expect(2, &[&compared[..], &["-o", &at("compared")]].concat());
    assert!(said.contains("[run] store") && !folder.path().join("compared.csv").exists(), "{said}");
    let pictures = expect(0, &["plot", &file, "-o", &at("pictures")]);
    assert_eq!(pictures.matches(".svg").count(), 3, "{pictures}");
    for (name, of) in [("part", &file), ("whole", &whole)] {
        expect(0, &["export", of, "--format", "csv", "-o", &at(name)]);
    }
    // who follows the contact alone does not know what supports bear
    let table = |name: &str| -> Vec<String> {
        let text = std::fs::read_to_string(at(name)).unwrap();
        let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let of_line = |line: &str| {
            let cells = line.split(',').zip(&head).filter(|c| !c.1.starts_with("support_"));
            cells.map(|c| c.0).collect::<Vec<_>>().join(",")
        };
        text.lines().map(of_line).collect()
    };
    assert!(table("part.csv") == table("whole.csv"));
    assert!(expect(0, &["inspect", &file]).contains("displacements of each"));
    let body = problem(&text).system.body.clone();
    let refused = read_state(Path::new(&file), &body.mesh, false).unwrap_err();
    assert!(refused.to_string().contains("store = \"all\""), "{refused}");
    assert!(read_state(Path::new(&whole), &body.mesh, false).is_ok());
}

/// What has no place in single precision is no infinity in the file.
#[test]
fn numbers_beyond_single_precision_are_told() {
    let folder = TempDir::new().unwrap();
    let text = scene("bar.toml", "3.36", "precision = \"single\"");
    let text = text.replace("gap = 1.0", "gap = 1e39").replace("*x\"", "*1e39*x\"");
    let file = folder.path().join("large.toml");
    std::fs::write(&file, text).unwrap();
    let out = folder.path().join("large.h5");
    let said = expect(2, &["run", file.to_str().unwrap(), "-o", out.to_str().unwrap(), "-q"]);
    assert!(said.contains("precision = \"double\""), "{said}");
}

/// A wrong word, an unknown edge, a group of a body that has none.
#[test]
fn a_wrong_store_is_refused_with_what_would_be_accepted() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("wrong.toml");
    for (name, store, said) in [
        ("plate-half.toml", "\"body\"", "expected one of `all`, `contact`, `a list of groups`"),
        ("plate-half.toml", "[\"front\"]", "\"left\", \"right\", \"bottom\", \"top\""),
        ("bouncing-bar.toml", "[\"top\"]", "\"left\", \"right\""),
        ("two-mass-stop.toml", "[\"left\"]", "\"all\" or \"contact\""),
        ("bracket.toml", "[\"front\"]", "run.store[0]"),
    ] {
        std::fs::write(&file, scene(name, "1.0", &format!("store = {store}"))).unwrap();
        let text = expect(2, &["run", file.to_str().unwrap(), "-o", "/dev/null"]);
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains(said) && words.contains("wrong.toml"), "{store}: {text}");
    }
}

/// Takes switches itself, or leaves them to the report.
struct Takes {
    takes: bool,
    told: Vec<Switch>,
}

impl Observer for Takes {
    type Error = std::convert::Infallible;
    fn sample(&mut self, _: &Sample) -> Result<(), Self::Error> {
        Ok(())
    }
    fn switch(&mut self, s: &Switch) -> Result<(), Self::Error> {
        self.told.push(s.clone());
        Ok(())
    }
    fn takes_events(&self) -> bool {
        self.takes
    }
}

/// A report counts what it does not list.
#[test]
fn a_report_counts_what_the_observer_takes() {
    let text = scene("plate-half.toml", "3.36", "");
    let (scene, body) = (Scene::parse(&text, Path::new("x.toml")).unwrap(), problem(&text));
    let of = |takes: bool| {
        let mut observer = Takes { takes, told: vec![] };
        (simulate(&scene, &body, false, &mut observer).unwrap(), observer.told)
    };
    let ((listed, told), (counted, told_too)) = (of(false), of(true));
    assert!(!told.is_empty() && told == told_too && listed.switches == told);
    assert!(counted.switches.is_empty() && counted.grazings.is_empty());
    assert_eq!(counted.log, listed.log);
    let closings = told.iter().filter(|s| s.kind.arrives()).count();
    let kinds = signorini::event::SwitchKind::ALL.map(|k| counted.log.of_kind(k));
    assert_eq!(kinds, [closings, told.len() - closings, 0, 0, 0, 0]);
    let [first, last] = counted.log.ends().unwrap();
    assert!(*first == told[0] && last == told.last().unwrap());
}
