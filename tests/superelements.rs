//! Contact of matrices by nodes and sets of their deck, and superelements in free-interface form, on CalculiX's block (`tests/reference/formats`).

use std::path::Path;

use nalgebra::{DMatrix, SymmetricEigen};
use serde_json::Value;
use signorini::fem::formats::read_matrix;

use crate::common::{json, root, run};

fn sample(name: &str) -> String {
    root().join("tests/reference/formats").join(name).display().to_string()
}

fn scene(folder: &Path, [k, m]: [&str; 2], rest: &str) -> String {
    let text =
        format!("[body]\nkind = 'matrices'\nstiffness_matrix = '{k}'\nmass_matrix = '{m}'\n{rest}");
    let path = folder.join("s.toml");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// A message without the lines and bars of its box.
fn flat(stderr: &[u8]) -> String {
    let text = String::from_utf8_lossy(stderr).replace('│', " ");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn block(folder: &Path, rest: &str) -> String {
    scene(folder, [&sample("block.sti"), &sample("block.mas")], rest)
}

const REST: &str = "[[load]]\nkind = 'force'\ndisplacement = '105.3'\namplitude = 40.0\nomega = 6.0e4\n[run]\nuntil = 8e-4\n";

/// Sets, numbers and rows are the same contact; a gap may be an expression of the places of the deck.
#[test]
fn nodes_and_sets_are_rows() {
    let folder = tempfile::tempdir().unwrap();
    let solved = |keys: &str| {
        let deck = format!("deck = '{}'\n", sample("block.inp"));
        let scene = block(folder.path(), &format!("{deck}[contact]\n{keys}\n{REST}"));
        let out = folder.path().join("s.h5").display().to_string();
        json(&["run", &scene, "-o", &out, "--force"])
    };
    let rows: Vec<String> = (101..=109).map(|n| format!("'{n}.3'")).collect();
    let by_rows = format!(
        "displacements = [{}]\ngap = 1e-4\nstress = 'reaction'\ninertia = 'constant'",
        rows.join(", ")
    );
    let by_rows = solved(&by_rows);
    let count = by_rows["switches"].as_array().unwrap().len();
    assert!(count > 10, "{count}");
    assert!(by_rows["switches"][0]["name"].as_str().unwrap().ends_with(".3"));
    let numbers: Vec<String> = (101..=109).map(|n| n.to_string()).collect();
    let numbers = format!("nodes = [{}]", numbers.join(", "));
    for nodes in ["nodes = 'TIP'", "nodes = 'tip'", numbers.as_str()] {
        let said = solved(&format!("{nodes}\ndirection = 'z'\ngap = 1e-4"));
        assert_eq!(said["switches"], by_rows["switches"], "{nodes}");
        assert_eq!(said["final"], by_rows["final"], "{nodes}");
    }
    // the deck's tip is at x = 30, z from 0 to 10
    let places = solved("nodes = 'TIP'\ndirection = 'z'\ngap = '1e-4*(1 + (z + y)*0.1)'");
    let text = std::fs::read_to_string(sample("block.inp")).unwrap();
    let gap = |n: i64| {
        let line = text.lines().find(|l| l.starts_with(&format!("{n}, "))).unwrap();
        let x: Vec<f64> = line.split(',').skip(1).map(|w| w.trim().parse().unwrap()).collect();
        1e-4 * (1.0 + (x[2] + x[1]) * 0.1)
    };
    let gaps: Vec<String> = (101..=109).map(|n| format!("{:.17e}", gap(n))).collect();
    let given = solved(&format!("nodes = 'TIP'\ndirection = 'z'\ngaps = [{}]", gaps.join(", ")));
    assert_eq!(places["switches"], given["switches"]);
    assert_ne!(places["switches"], by_rows["switches"]);
    // the other way these rows count the other way, in loads too: the same motion
    let back = solved("nodes = 'TIP'\ndirection = '-z'\ngap = 1e-4");
    let times = |said: &Value| -> Vec<f64> {
        said["switches"].as_array().unwrap().iter().map(|s| s["t"].as_f64().unwrap()).collect()
    };
    assert_eq!(times(&back).len(), times(&by_rows).len());
    assert!(times(&back).iter().zip(&times(&by_rows)).all(|(a, b)| (a - b).abs() < 1e-9 * b));
}

/// Gaps that a deck does not know the places of, or that are no numbers there.
#[test]
fn gaps_that_have_no_place_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (deck, gap, words) in [
        ("plate.inp", "1e-4 + 1e-5*y", "no node of row 101.3"),
        ("block.inp", "1e-4/(y - y)", "at 101.3"),
    ] {
        let text = format!(
            "deck = '{}'\n[contact]\nnodes = [101, 102]\ndirection = 'z'\ngap = '{gap}'\n",
            sample(deck)
        );
        let output = run(&["modes", &block(folder.path(), &text)]);
        let said = flat(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("contact.gap") && said.contains(words), "{said}");
    }
}

#[test]
fn what_is_no_node_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let deck = format!("deck = '{}'\n", sample("block.inp"));
    for (body, keys, at, words) in [
        ("", "nodes = 'TIP'\ndirection = 'z'", "contact.nodes", "no deck says"),
        (deck.as_str(), "nodes = 'TIPP'\ndirection = 'z'", "contact.nodes", "\"WALL\", \"TIP\""),
        ("", "nodes = [7]\ndirection = 'z'", "contact.nodes", "101 to 149"),
        ("", "nodes = [101]", "contact.direction", "is missing"),
        ("", "nodes = [101, 101]\ndirection = 'z'", "contact.nodes", "101 twice"),
        ("", "nodes = [101]\ndirection = 'n'", "contact.direction", "no axis"),
        ("", "direction = 'z'\ndisplacements = [2]", "contact.direction", "there are none"),
        ("", "nodes = [101]\ndirection = 'z'\ndisplacements = [2]", "contact.nodes", "beside"),
        (deck.as_str(), "nodes = 'WALL'\ndirection = 'z'", "contact.nodes", "no row is called"),
        ("deck = 'none.inp'\n", "nodes = [101]\ndirection = 'z'", "body.deck", "none.inp"),
    ] {
        let scene = block(folder.path(), &format!("{body}[contact]\n{keys}\ngap = 1e-4\n"));
        let output = run(&["modes", &scene]);
        let said = flat(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{keys}: {said}");
        assert!(said.contains(at) && said.contains(words), "{keys}: {said}");
    }
}

fn dense(path: &str) -> DMatrix<f64> {
    let a = read_matrix(&std::fs::read(path).unwrap(), None).unwrap().matrix;
    let mut d = DMatrix::zeros(a.n_rows(), a.n_cols());
    a.triplets().for_each(|(i, j, v)| d[(i, j)] = v);
    d
}

/// Frequencies, and shapes with unit mass, ascending.
fn modes(k: &DMatrix<f64>, m: &DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let l = m.clone().cholesky().unwrap().l();
    let half = l.solve_lower_triangular(k).unwrap();
    let a = l.solve_lower_triangular(&half.transpose()).unwrap();
    let eigen = SymmetricEigen::new(0.5 * (&a + a.transpose()));
    let mut order: Vec<usize> = (0..k.nrows()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let shapes = l.transpose().solve_upper_triangular(&eigen.eigenvectors).unwrap();
    let sorted = DMatrix::from_fn(k.nrows(), k.nrows(), |i, j| shapes[(i, order[j])]);
    (order.iter().map(|j| eigen.eigenvalues[*j].max(0.0).sqrt()).collect(), sorted)
}

fn part(a: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), columns.len(), |i, j| a[(rows[i], columns[j])])
}

fn written(folder: &Path, name: &str, a: &DMatrix<f64>) -> String {
    let mut text = String::from("%%MatrixMarket matrix array real general\n");
    text += &format!("{} {}\n", a.nrows(), a.ncols());
    a.iter().for_each(|v| text += &format!("{v:.17e}\n"));
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// The block, the normals of its tip along z, and what Craig and Bampton make of it with so many fixed-interface modes: the normals first.
struct Reduced {
    k: DMatrix<f64>,
    m: DMatrix<f64>,
    tip: Vec<usize>,
    files: [String; 2],
}

fn craig_bampton(folder: &Path, count: usize) -> Reduced {
    let (k, m) = (dense(&sample("block.sti")), dense(&sample("block.mas")));
    let names = std::fs::read_to_string(sample("block.dof")).unwrap();
    let is_tip = |l: &&str| l.starts_with("10") && l.ends_with(".3");
    let places = names.split_whitespace().enumerate().filter(|(_, l)| is_tip(l));
    let tip: Vec<usize> = places.map(|(i, _)| i).collect();
    assert_eq!(tip.len(), 9);
    let others: Vec<usize> = (0..k.nrows()).filter(|i| !tip.contains(i)).collect();
    let held = part(&k, &others, &others);
    let (_, shapes) = modes(&held, &part(&m, &others, &others));
    let follow = -held.cholesky().unwrap().solve(&part(&k, &others, &tip));
    let mut t = DMatrix::zeros(k.nrows(), 9 + count);
    tip.iter().enumerate().for_each(|(j, &i)| t[(i, j)] = 1.0);
    for (a, &i) in others.iter().enumerate() {
        (0..9).for_each(|j| t[(i, j)] = follow[(a, j)]);
        (0..count).for_each(|j| t[(i, 9 + j)] = shapes[(a, j)]);
    }
    let reduced = |a: &DMatrix<f64>| {
        let a = t.transpose() * a * &t;
        0.5 * (&a + a.transpose())
    };
    let files = [written(folder, "K.mtx", &reduced(&k)), written(folder, "M.mtx", &reduced(&m))];
    Reduced { k, m, tip, files }
}

fn omega(said: &Value, which: &str) -> Vec<f64> {
    said[which]["omega"].as_array().unwrap().iter().map(|w| w.as_f64().unwrap()).collect()
}

/// Frequencies of the superelement with its contact open are its own, with its contact closed those of the whole body but for some that a residual flexibility of six modes does not know.
/// Its contact without mass, and nothing else, is refused.
#[test]
fn superelements_of_craig_and_bampton_are_brought_to_free_interface_form() {
    let folder = tempfile::tempdir().unwrap();
    let Reduced { k, m, tip, files } = craig_bampton(folder.path(), 6);
    let files = [files[0].as_str(), files[1].as_str()];
    let contact =
        "[contact]\ndisplacements = [0, 1, 2, 3, 4, 5, 6, 7, 8]\ngap = 1e-3\nstress = 'reaction'\n";
    let free = "[reduction]\nkind = 'free-interface'\nmodes = 6\n";
    let said =
        json(&["modes", &scene(folder.path(), files, &format!("{contact}{free}")), "--count", "4"]);
    let (own, _) = modes(&dense(files[0]), &dense(files[1]));
    for (a, b) in omega(&said, "open").iter().zip(&own) {
        assert!((a - b).abs() < 1e-8 * b, "{a} {b}");
    }
    let others: Vec<usize> = (0..k.nrows()).filter(|i| !tip.contains(i)).collect();
    let (whole, _) = modes(&part(&k, &others, &others), &part(&m, &others, &others));
    let errors: Vec<f64> =
        omega(&said, "closed").iter().zip(&whole).map(|(a, b)| a / b - 1.0).collect();
    for (error, most) in errors.iter().zip([1e-6, 1.2e-3, 1e-4, 3.1e-2]) {
        assert!(error.abs() < most, "{errors:?}");
    }
    // what is left out without it: the first frequency would be 12 % off, the second 240 %
    let output = run(&["modes", &scene(folder.path(), files, contact)]);
    let said = flat(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("stand still while they are open") && said.contains("free-interface"));
}

/// Statics of what stays are exact whatever the number of modes: pressed against the obstacle the superelement bears the forces of the whole body. Its energy closes in motion, and its rows keep their
/// names.
#[test]
fn a_pressed_superelement_bears_the_forces_of_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("s.h5").display().to_string();
    let rows: Vec<String> = (101..=109).map(|n| format!("'{n}.3'")).collect();
    let contact = format!(
        "[contact]\ndisplacements = [{}]\ngaps = {:?}\nmethod = 'mass-redistribution'\n",
        rows.join(", "),
        (0..9).map(|k| 1e-4 * f64::from(1 + 8 * (k % 4))).collect::<Vec<_>>()
    );
    let load = "[[load]]\nkind = 'force'\ndisplacement = '125.3'\namplitude = 400.0\n[[probe]]\nname = 'belly'\nnode = '125.3'\n";
    let run_of = |rest: &str| {
        let said = json(&["run", &block(folder.path(), rest), "-o", &out, "--force"]);
        (said, signorini::store::Stored::read(Path::new(&out)).unwrap())
    };
    let pressed = |reduction: &str| {
        let start = "[initial]\nequilibrium = true\n[run]\nuntil = 1e-6\nsamples = 1\n";
        let (_, stored) = run_of(&format!("{contact}{reduction}{load}{start}"));
        stored.pressure.row(0).to_vec()
    };
    let form = |modes: usize| format!("[reduction]\nkind = 'free-interface'\nmodes = {modes}\n");
    let whole = pressed("");
    let size = whole.iter().fold(0.0f64, |m, p| m.max(*p));
    assert!(size > 0.0 && whole.contains(&0.0), "{whole:?}");
    for modes in [3, 20] {
        let own = pressed(&form(modes));
        assert!(own.iter().zip(&whole).all(|(a, b)| (a - b).abs() < 1e-8 * size), "{own:?}");
    }
    let (said, stored) = run_of(&format!("{contact}{}{load}[run]\nuntil = 4e-4\n", form(20)));
    assert!(said["switches"].as_array().unwrap().len() > 4);
    assert!(said["switches"][0]["name"].as_str().unwrap().ends_with(".3"));
    assert_eq!((&said["n_dof"], stored.probes.len()), (&Value::from(30), 2));
    assert!(
        said["energy_drift_total"].as_f64().unwrap().abs() < 1e-9,
        "{}",
        said["energy_drift_total"]
    );
}

#[test]
fn forms_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let contact = "[contact]\ndisplacements = ['101.3', '102.3']\ngap = 1e-4\n";
    let by = "stress = 'reaction'\n";
    for (rest, at, words) in [
        (format!("{contact}{by}[reduction]\nmodes = 5\n"), "reduction.kind", "free-interface"),
        (
            format!("{contact}{by}[reduction]\nkind = 'free-interface'\ncutoff = 5.0\n"),
            "reduction.cutoff",
            "modes = 12",
        ),
        (
            format!("{contact}{by}[reduction]\nkind = 'free-interface'\nmodes = 80\n"),
            "reduction",
            "fewer modes",
        ),
        (
            format!("{contact}{by}[reduction]\nkind = 'free-interface'\nmodes = 900\n"),
            "reduction.modes",
            "81 rows",
        ),
        (
            format!(
                "{contact}method = 'penalty'\nstiffness = 1e5\n[reduction]\nkind = 'free-interface'\nmodes = 5\n"
            ),
            "contact.method",
            "has none there",
        ),
        (
            format!(
                "{contact}{by}inertia = 'paper'\n[reduction]\nkind = 'free-interface'\nmodes = 5\n"
            ),
            "contact.inertia",
            "constant",
        ),
    ] {
        let output = run(&["modes", &block(folder.path(), &rest)]);
        let said = flat(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{rest}: {said}");
        assert!(said.contains(at) && said.contains(words), "{rest}: {said}");
    }
}
