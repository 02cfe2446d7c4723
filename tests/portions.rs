//! Contact and supports on a part of an edge: `from`, `box`, `where`, and at chosen nodes.

use std::path::Path;

use crate::common::{json, run};
use nalgebra::DMatrix;
use serde_json::Value;
use signorini::fem::{Body, DofMap, MassForm, Material};
use signorini::mesh::structured;

fn scene(folder: &Path, contact: &str) -> String {
    let text = format!(
        "[body]\nkind = 'plate'\nsize = [1.0, 0.6]\nelements = [5, 6]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = 'left'\nfix = ['x', 'y']\n{contact}\n[initial]\nvelocity = ['0.1*x', '0.02*x']\n[run]\nuntil = 6.0\nsamples = 20\n"
    );
    let path = folder.join("s.toml");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn solved(folder: &Path, contact: &str) -> Value {
    let out = folder.join("s.h5").display().to_string();
    json(&["run", &scene(folder, contact), "-o", &out, "--force"])
}

fn places(said: &Value) -> Vec<f64> {
    said["final"]["u"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// The three keys choose the same sides, which move as under springs that the rest of the edge cannot reach.
#[test]
fn the_keys_choose_the_same_sides() {
    let folder = tempfile::tempdir().unwrap();
    let all: Vec<Value> = [
        "from = [0.5, 1.0]",
        "box = [[0.9, 0.3], [1.1, 0.7]]",
        "where = 'y > 0.3'",
        "where = '0.3 < y < 1 and x > 0.5'",
    ]
    .iter()
    .map(|key| {
        solved(
            folder.path(),
            &format!("[contact]\nedge = 'right'\n{key}\ngap = 0.01\nmethod = 'penalty'\n"),
        )
    })
    .collect();
    // an independent way to leave the lower half alone
    let far = "[contact]\nedge = 'right'\ngap = '0.01 + 1e3*(1 - signum(y - 0.2999))'\nmethod = 'penalty'\n";
    let whole = solved(folder.path(), far);
    for said in &all {
        assert_eq!(
            said["switches"].as_array().unwrap().len(),
            all[0]["switches"].as_array().unwrap().len()
        );
        assert_eq!(places(said), places(&all[0]));
        assert!(!said["switches"].as_array().unwrap().is_empty());
        assert!(said["n_contact"].as_u64() < whole["n_contact"].as_u64());
    }
    // of points that are no nodes, too
    assert!(all[0]["largest_pressure"]["largest"].as_f64().unwrap() > 0.0);
    let (a, b) = (places(&all[0]), places(&whole));
    let size = b.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9 * size), "{a:?} {b:?}");
}

/// Two parts of an edge with gaps and names of their own; nodes count once.
#[test]
fn an_edge_has_several_obstacles() {
    let folder = tempfile::tempdir().unwrap();
    let part = |key: &str, gap: f64| {
        format!("[[contact]]\nedge = 'right'\n{key}\ngap = {gap}\nmethod = 'mass-redistribution'\n")
    };
    let said = solved(
        folder.path(),
        &(part("from = [0.0, 0.34]", 0.01) + &part("where = 'y > 0.4'", 0.02)),
    );
    assert_eq!(said["n_contact"], 3 + 3);
    let names: Vec<&str> =
        said["forces"].as_array().unwrap().iter().map(|f| f["group"].as_str().unwrap()).collect();
    assert!(
        names.contains(&"right from 0 to 0.34") && names.contains(&"right where y > 0.4"),
        "{names:?}"
    );
}

#[test]
fn parts_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (key, at, words) in [
        ("from = [0.9, 0.1]", "contact.from", "no range"),
        ("from = [0.0, 0.01]", "contact.from", "of its 6"),
        ("box = [[0.0, 0.0], [0.5, 0.6]]", "contact.box", "the middle of no side"),
        ("box = [[0.5, 0.6], [0.0, 0.0]]", "contact.box", "is empty"),
        ("box = [[0.5], [1.0]]", "contact.box", "needs 2 numbers"),
        ("where = 'y'", "contact.where", "cannot read the condition"),
        ("where = 'z > 0'", "contact.where", "condition on z"),
        ("from = [0.0, 0.5]\nwhere = 'y > 0'", "contact.where", "stands beside from"),
    ] {
        let scene = scene(folder.path(), &format!("[contact]\nedge = 'right'\ngap = 0.1\n{key}\n"));
        let output = run(&["inspect", &scene]);
        let said = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
        assert_eq!(output.status.code(), Some(2), "{key}: {said}");
        assert!(said.contains(at) && said.contains(words), "{key}: {said}");
    }
}

/// A plate whose right edge has the nodes 35 to 41, 0.1 apart.
fn at(folder: &Path, keys: &str) -> Value {
    solved(folder, &format!("[contact]\nedge = 'right'\n{keys}\ngap = 0.01\n"))
}

fn pressures(said: &Value) -> Vec<f64> {
    said["forces"].as_array().unwrap().iter().map(|f| f["maximum"].as_f64().unwrap()).collect()
}

/// The two nodes of one side move as the side does, with forces in place of pressures; fewer nodes push at themselves alone.
#[test]
fn chosen_nodes_are_contact_without_an_area() {
    let folder = tempfile::tempdir().unwrap();
    let by = "stress = 'reaction'\ninertia = 'constant'";
    let side = at(folder.path(), &format!("where = '0.2 < y < 0.3'\n{by}"));
    let nodes = at(folder.path(), "nodes = [38, 37]");
    assert_eq!((&side["n_contact"], &nodes["n_contact"]), (&Value::from(2), &Value::from(2)));
    let switches = |said: &Value| said["switches"].as_array().unwrap().clone();
    assert!(!switches(&side).is_empty());
    for (a, b) in switches(&side).iter().zip(&switches(&nodes)) {
        let [a, b] = [a, b].map(|s| s["t"].as_f64().unwrap());
        assert!((a - b).abs() < 1e-10, "{a} {b}");
    }
    let (a, b) = (places(&side), places(&nodes));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12), "{a:?} {b:?}");
    // resultants are forces in both
    let (a, b) = (pressures(&side), pressures(&nodes));
    assert!((a[0] - b[0]).abs() < 1e-10 * a[0] && a[0] > 0.0, "{a:?} {b:?}");
    assert_eq!(nodes["forces"][0]["group"], "right at 38, 37");
    let one = at(folder.path(), "nodes = [38]\nmethod = 'mass-redistribution'");
    assert_eq!(one["n_contact"], 1);
    assert!(one["switches"].as_array().unwrap().iter().all(|s| s["node"] == 38));
    // what is stored as pressure is the force: the side's is over 0.1 of length, half of it each
    let stored = |keys: &str| {
        at(folder.path(), keys);
        signorini::store::Stored::read(&folder.path().join("s.h5")).unwrap()
    };
    let (force, pressure) =
        (stored("nodes = [37, 38]"), stored(&format!("where = '0.2 < y < 0.3'\n{by}")));
    assert!(force.contact_area.iter().all(|a| *a == 1.0));
    let largest = |s: &signorini::store::Stored| s.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
    assert!((largest(&force) - 0.05 * largest(&pressure)).abs() < 1e-10 * largest(&force));
}

#[test]
fn nodes_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (keys, at, words) in [
        ("nodes = [22]", "contact.nodes", "no node 22"),
        ("nodes = []", "contact.nodes", "names no node"),
        ("nodes = [38, 38]", "contact.nodes", "38 twice"),
        ("nodes = 'TIP'", "contact.nodes", "numbers of nodes are wanted"),
        ("nodes = 3", "contact.nodes", "the name of a set"),
        ("nodes = [38]\nfrom = [0.0, 0.5]", "contact.nodes", "stands beside from"),
        ("nodes = [38]\nmethod = 'penalty'", "contact.nodes", "has no area"),
        ("nodes = [38]\nstress = 'projection'", "contact.nodes", "has no area"),
        ("nodes = [38]\ndirection = 'x'", "contact.direction", "belongs to body.kind"),
    ] {
        let scene =
            scene(folder.path(), &format!("[contact]\nedge = 'right'\ngap = 0.1\n{keys}\n"));
        let output = run(&["inspect", &scene]);
        let said = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
        assert_eq!(output.status.code(), Some(2), "{keys}: {said}");
        assert!(said.contains(at) && said.contains(words), "{keys}: {said}");
    }
}

/// Supports at all nodes of an edge, and on all of it, move as the edge does.
#[test]
fn parts_of_supports_move() {
    let folder = tempfile::tempdir().unwrap();
    let last = |key: &str| {
        let text = format!(
            "[body]\nkind = 'plate'\nsize = [1.0, 0.6]\nelements = [5, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\nedge = 'left'\n{key}\nfix = ['x', 'y']\n[[load]]\nkind = 'base'\nedge = 'left'\namplitude = [0.1, 0.0]\nomega = 1.3\n\
             phase = 1.5707963267948966\n[run]\nuntil = 4.0\nsamples = 8\n"
        );
        let (path, out) = (folder.path().join("s.toml"), folder.path().join("s.h5"));
        std::fs::write(&path, text).unwrap();
        json(&["run", path.to_str().unwrap(), "-o", out.to_str().unwrap(), "--force"])
    };
    let whole = last("");
    let (a, size) = (places(&whole), 0.1);
    assert!(a.iter().any(|x| x.abs() > 0.01));
    for key in ["nodes = [0, 1, 2]", "from = [0.0, 1.0]", "where = 'y > 0'"] {
        let b = places(&last(key));
        assert!(a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12 * size));
    }
}

/// Supports on a part of an edge, and at chosen nodes: frequencies are those of the free plate's matrices without the rows and columns of what they hold.
#[test]
fn supports_hold_parts_and_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let text = |supports: &str| {
        format!(
            "[body]\nkind = 'plate'\nsize = [1.0, 0.6]\nelements = [5, 6]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\nmass = 'lumped'\n{supports}"
        )
    };
    let path = folder.path().join("s.toml");
    let mesh = structured::rectangle(1.0, 0.6, 5, 6);
    let dofs = DofMap::new(&mesh, &[], &[]).unwrap();
    let material = Material::plate(1.0, 0.3, 1.0, 1.0);
    let body = Body::assemble(mesh, dofs, &[material], MassForm::Lumped);
    let mesh = &body.mesh;
    let entry = |node: usize, c: usize| body.dofs.terms(node, c).next().unwrap().0;
    let at = |x: f64, low: f64, high: f64| -> Vec<usize> {
        let lies = |p: &[f64; 3]| (p[0] - x).abs() < 1e-9 && low < p[1] && p[1] < high;
        (0..mesh.n_nodes()).filter(|&n| lies(&mesh.nodes()[n])).collect()
    };
    let (lower, corner) = (at(0.0, -1.0, 0.31), at(1.0, 0.59, 1.0));
    let three = [at(0.0, -1.0, 0.01), at(0.0, 0.59, 1.0)].concat();
    assert_eq!((lower.len(), corner.len(), three.len()), (4, 1, 2));
    let both = |nodes: &[usize]| -> Vec<(usize, usize)> {
        nodes.iter().flat_map(|&n| [(n, 0), (n, 1)]).collect()
    };
    let part = |key: &str| format!("[[support]]\nedge = 'left'\n{key}\nfix = ['x', 'y']\n");
    let pinned = format!(
        "[[support]]\nedge = 'left'\nnodes = {three:?}\nfix = ['x']\n[[support]]\nedge = 'left'\nnodes = {three:?}\nfix = ['y']\n\
         [[support]]\nedge = 'right'\nnodes = {corner:?}\nfix = ['x']\n"
    );
    let of_pinned = [both(&three), vec![(corner[0], 0)]].concat();
    for (supports, held) in [
        (part("where = 'y < 0.3'"), both(&lower)),
        (part("box = [[0.0, 0.0], [0.0, 0.3]]"), both(&lower)),
        (part(&format!("nodes = {lower:?}")), both(&lower)),
        (pinned, of_pinned),
    ] {
        let held: Vec<usize> = held.into_iter().map(|(n, c)| entry(n, c)).collect();
        let left: Vec<usize> = (0..body.dofs.n()).filter(|i| !held.contains(i)).collect();
        let mass = |i: usize| *body.mass.entry(i, i).unwrap();
        let scaled = DMatrix::from_fn(left.len(), left.len(), |a, b| {
            let (i, j) = (left[a], left[b]);
            body.stiffness.entry(i, j).unwrap_or(&0.0) / (mass(i) * mass(j)).sqrt()
        });
        let mut wanted: Vec<f64> =
            scaled.symmetric_eigenvalues().iter().map(|l| l.max(0.0).sqrt()).collect();
        wanted.sort_by(f64::total_cmp);
        std::fs::write(&path, text(&supports)).unwrap();
        let said = json(&["modes", path.to_str().unwrap()]);
        let omega = said["open"]["omega"].as_array().unwrap();
        let found: Vec<f64> = omega.iter().map(|w| w.as_f64().unwrap()).collect();
        assert!(found.len() >= 5 && found[0] > 0.1, "{found:?}");
        for (f, w) in found.iter().zip(&wanted) {
            assert!((f - w).abs() < 1e-9 * wanted[4], "{supports}: {found:?} {wanted:?}");
        }
    }
    for (supports, words) in [
        (part("nodes = [3, 99]"), "\"left\" has no node 99"),
        (part("nodes = [3, 3]"), "names 3 twice"),
        (part("nodes = []"), "names no node"),
        (part("nodes = [0]\nwhere = 'y > 0.1'"), "stands beside nodes"),
        (part("where = 'y > 3'"), "the middle of no side"),
        (part("where = 'y'"), "cannot read the condition"),
    ] {
        std::fs::write(&path, text(&supports)).unwrap();
        let out = run(&["modes", path.to_str().unwrap()]);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(2), "{said}");
        let said = said.split_whitespace().filter(|w| *w != "│").collect::<Vec<_>>().join(" ");
        assert!(said.contains(words), "{words}: {said}");
    }
}
