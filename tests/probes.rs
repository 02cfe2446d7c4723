//! `[[probe]]`: what it sees is what the whole motion says, whatever else the file keeps.

use std::path::Path;

use crate::common::{datasets, hdf5_files, json, run};
use ndarray::Array2;

fn written(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn table(file: &str, path: &str) -> Array2<f64> {
    hdf5_files().open(file).unwrap().dataset(path).unwrap().read_2d().unwrap()
}

fn column(file: &str, path: &str) -> Vec<f64> {
    hdf5_files().open(file).unwrap().dataset(path).unwrap().read_raw().unwrap()
}

const BODY: &str = "[body]\nkind = 'plate'\nsize = [1.0, 0.3]\nelements = [6, 2]\nyoung = 2.0\npoisson = 0.3\ndensity = 1.0\nthickness = 0.5\n\
[[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\ngap = 0.01\nmethod = 'mass-redistribution'\n\
[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.01, 0.004]\nomega = 1.3\n";

const PROBES: &str = "[[probe]]\nname = 'tip'\nnode = 20\nquantity = ['displacement', 'velocity', 'acceleration', 'stress', 'recovered-stress']\n\
[[probe]]\nname = 'middle'\nat = [0.25, 0.075]\nquantity = ['displacement', 'stress']\n\
[[probe]]\nname = 'face'\nedge = 'right'\n";

/// Displacement and velocity of a node are columns of the trajectory; at the centre of an element its mean, and the stress that is exported there; over an edge the trapezium rule;
/// the acceleration is what velocities change by.
#[test]
fn probes_see_the_motion_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let run_table = "[run]\nuntil = 6.0\nsamples = 3000\n";
    let scene = written(folder.path(), "s.toml", &(BODY.to_owned() + PROBES + run_table));
    let said = json(&["run", &scene, "-o", &at("s.h5")]);
    let file = at("s.h5");
    let (u, v, t) =
        (table(&file, "trajectory/u"), table(&file, "trajectory/v"), column(&file, "trajectory/t"));
    let map: Array2<i64> =
        hdf5_files().open(&file).unwrap().dataset("mesh/dof_map").unwrap().read_2d().unwrap();
    let nodes = table(&file, "mesh/nodes");
    let of = |x: &Array2<f64>, row: usize, node: usize, c: usize| {
        usize::try_from(map[(node, c)]).map_or(0.0, |k| x[(row, k)])
    };
    let [tip_u, tip_v, tip_a] = ["displacement", "velocity", "acceleration"]
        .map(|q| table(&file, &format!("probes/tip/{q}")));
    let middle = table(&file, "probes/middle/displacement");
    let face = table(&file, "probes/face/displacement");
    let square: Vec<usize> = (0..nodes.nrows())
        .filter(|&n| (nodes[(n, 0)] - 0.25).abs() < 0.09 && (nodes[(n, 1)] - 0.075).abs() < 0.08)
        .collect();
    assert_eq!(square.len(), 4);
    let right: Vec<(usize, f64)> = (0..nodes.nrows())
        .filter(|&n| (nodes[(n, 0)] - 1.0).abs() < 1e-12)
        .map(|n| (n, if (nodes[(n, 1)] - 0.15).abs() < 1e-9 { 0.5 } else { 0.25 }))
        .collect();
    let size = u.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for row in 0..t.len() {
        for c in 0..2 {
            assert_eq!(tip_u[(row, c)], of(&u, row, 20, c));
            assert_eq!(tip_v[(row, c)], of(&v, row, 20, c));
            let mean = square.iter().map(|&n| of(&u, row, n, c)).sum::<f64>() / 4.0;
            assert!((middle[(row, c)] - mean).abs() < 1e-14 * size);
            let along: f64 = right.iter().map(|&(n, w)| w * of(&u, row, n, c)).sum();
            assert!((face[(row, c)] - along).abs() < 1e-14 * size);
        }
    }
    // between states that no switch parts: central differences
    let switches: Vec<f64> = column(&file, "switches/t");
    let most = tip_a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let mut compared = 0;
    for row in 1..t.len() - 1 {
        let (before, after) = (t[row - 1], t[row + 1]);
        let is_even = (after - t[row] - (t[row] - before)).abs() < 1e-9;
        if !is_even || switches.iter().any(|s| (before..=after).contains(s)) {
            continue;
        }
        let slope = (tip_v[(row + 1, 1)] - tip_v[(row - 1, 1)]) / (after - before);
        assert!(
            (slope - tip_a[(row, 1)]).abs() < 2e-3 * most,
            "{row}: {slope} {}",
            tip_a[(row, 1)]
        );
        compared += 1;
    }
    assert!(compared > 2000, "{compared}");
    // the stress of the element's centre, as the fields have it
    json(&["export", &file, "--format", "vtkhdf", "-o", &at("s")]);
    let fields = datasets(Path::new(&at("s.vtkhdf")));
    let (_, bytes) = &fields["/VTKHDF/CellData/stress"];
    let stress: Vec<f64> = bytes
        .chunks_exact(8)
        .map(|b| f64::from_bits(u64::from_le_bytes(b.try_into().unwrap())))
        .collect();
    let of_nodes: Vec<f64> = fields["/VTKHDF/PointData/stress_recovered"]
        .1
        .chunks_exact(8)
        .map(|b| f64::from_bits(u64::from_le_bytes(b.try_into().unwrap())))
        .collect();
    let (seen, recovered) =
        (table(&file, "probes/middle/stress"), table(&file, "probes/tip/recovered-stress"));
    // the second element of the first row, whichever way elements are counted
    let elements: Array2<i64> =
        hdf5_files().open(&file).unwrap().dataset("mesh/elements").unwrap().read_2d().unwrap();
    let cell = (0..elements.nrows())
        .find(|&k| elements.row(k).iter().all(|n| square.contains(&(*n as usize))))
        .unwrap();
    for row in [0, 57, t.len() / 2, t.len() - 1] {
        let own = &stress[9 * (row * elements.nrows() + cell)..];
        for (component, place) in [(0, 0), (1, 4), (2, 8), (3, 1)] {
            assert!((seen[(row, component)] - own[place]).abs() < 1e-13, "{row} {component}");
            // and the recovered one of the node
            let at_node = of_nodes[9 * (row * nodes.nrows() + 20) + place];
            assert!((recovered[(row, component)] - at_node).abs() < 1e-13, "{row} {component}");
        }
    }
    let largest = tip_u
        .column(1)
        .iter()
        .copied()
        .fold(0.0f64, |m: f64, x: f64| if x.abs() > m.abs() { x } else { m });
    let told = said["probes"].as_array().unwrap().iter().find(|p| p["name"] == "tip").unwrap();
    assert_eq!(told["quantity"], "displacement");
    assert_eq!(told["largest"][1].as_f64().unwrap(), largest);
}

/// A file that keeps the contact alone, a reduced body, a run that was interrupted: the same probes.
#[test]
fn probes_are_kept_whatever_else_is() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let text = |more: &str, run: &str| {
        BODY.to_owned() + PROBES + more + &format!("[run]\nuntil = 3.0\nsamples = 30\n{run}")
    };
    let whole = written(folder.path(), "whole.toml", &text("", ""));
    let contact = written(folder.path(), "contact.toml", &text("", "store = 'contact'\n"));
    let modes = written(folder.path(), "modes.toml", &text("[reduction]\nmodes = 30\n", ""));
    for (scene, out, slack) in
        [(&whole, "a.h5", 0.0), (&contact, "b.h5", 1e-12), (&modes, "c.h5", 1e-7)]
    {
        json(&["run", scene, "-o", &at(out)]);
        for path in [
            "tip/displacement",
            "tip/stress",
            "tip/recovered-stress",
            "middle/displacement",
            "face/velocity",
        ] {
            let path = format!("probes/{path}");
            let (a, b) = (table(&at("a.h5"), &path), table(&at(out), &path));
            let size = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let off = a.iter().zip(&b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(off <= slack * size, "{out} {path}: {off:e} of {size:e}");
        }
    }
    let csv = run(&["export", &at("b.h5"), "-o", &at("b")]);
    assert!(csv.status.success());
    let head = std::fs::read_to_string(at("b.csv")).unwrap();
    let head = head.lines().next().unwrap();
    for name in
        ["displacement_x[tip]", "acceleration_y[tip]", "stress_xy[middle]", "velocity_y[face]"]
    {
        assert!(head.split(',').any(|c| c == name), "{head}");
    }
    let drawn = run(&["plot", &at("b.h5"), "--only", "probes,portraits,spectra", "-o", &at("b")]);
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    for name in ["probes", "portraits", "spectra"] {
        assert!(Path::new(&at(&format!("b-{name}.svg"))).exists());
    }
}

#[test]
fn probes_that_lie_nowhere_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (probe, key, words) in [
        ("name = 'a'\nat = [1.1, 0.1]", "probe[0].at", "lies in no element"),
        ("name = 'a'\nat = [1.0]", "probe[0].at", "needs 2 numbers"),
        ("name = 'a'\nnode = 21", "probe[0].node", "the nodes count"),
        ("name = 'a b'\nnode = 2", "probe[0].name", "no name"),
        ("name = 'a'", "probe[0]", "does not say where"),
        ("name = 'a'\nnode = 2\nedge = 'left'", "probe[0]", "says twice"),
        ("name = 'a'\nnode = 2\nquantity = []", "probe[0].quantity", "is empty"),
        ("name = 'a'\nnode = 2\nquantity = ['strain']", "quantity", "displacement"),
        (
            "name = 'a'\nnode = 2\n[[probe]]\nname = 'a'\nnode = 3",
            "probe[1].name",
            "is the name of another",
        ),
    ] {
        let text = format!("{BODY}[[probe]]\n{probe}\n[run]\nuntil = 1.0\n");
        let scene = written(folder.path(), "s.toml", &text);
        let output = run(&["inspect", &scene]);
        let said = String::from_utf8_lossy(&output.stderr).replace("\n", " ");
        assert_eq!(output.status.code(), Some(2), "{probe}");
        assert!(said.contains(key) && said.contains(words), "{probe}: {said}");
    }
}
