//! `signorini trust`: what it says of a mesh is what the meshes that it speaks of say themselves.

use std::path::Path;

use crate::common::cuboid::cuboid;
use crate::common::rectangle::{msh, rectangle};
use crate::common::{json, refused, run};
use serde_json::Value;
use signorini::mesh::{ElementKind, Mesh};

fn written(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// A scene of a mesh that was made by the generator of the tests, with a body of this state.
fn scene(folder: &Path, name: &str, mesh: &Mesh, rest: &str) -> String {
    written(folder, &format!("{name}.msh"), &msh(mesh, |_| 0));
    let state = if mesh.dim() == 2 { "state = 'plane strain'\n" } else { "" };
    let text = format!(
        "[body]\nkind = 'mesh'\nfile = '{name}.msh'\n{state}[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{rest}"
    );
    written(folder, &format!("{name}.toml"), &text)
}

fn figures<'v>(said: &'v Value, kind: &str) -> Vec<&'v Value> {
    said["figures"].as_array().unwrap().iter().filter(|f| f["kind"] == kind).collect()
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn beside(f: &Value) -> f64 {
    f["beside"][0].as_f64().unwrap()
}

const HELD: &str = "[[support]]\ngroup = 'left'\nfix = ['x', 'y']\n[contact]\ngroup = 'right'\ngap = 0.01\nmethod = 'mass-redistribution'\n";
const STRUCK: &str = "[initial]\nvelocity = ['0.1*x', '0']\n[run]\nuntil = 4.0\nsamples = 40\n";

/// Linear triangles: the mesh of second order beside them is the one that a generator which knows nothing of it makes, to the digits, in frequencies, force and switches.
#[test]
fn triangles_are_raised_to_the_mesh_of_second_order() {
    let folder = tempfile::tempdir().unwrap();
    let of = |kind, name: &str| {
        let mesh = rectangle(kind, [0.0, 1.0], 0.4, (6, 3), 0.0);
        scene(folder.path(), name, &mesh, &(HELD.to_owned() + STRUCK))
    };
    let (coarse, fine) = (of(ElementKind::Tri3, "t3"), of(ElementKind::Tri6, "t6"));
    let said = json(&["trust", &coarse]);
    assert_eq!(said["beside"][0]["replaced"], "raised");
    let own = numbers(&json(&["modes", &coarse])["open"]["omega"]);
    let other = numbers(&json(&["modes", &fine])["open"]["omega"]);
    for (k, f) in figures(&said, "frequency").iter().take(3).enumerate() {
        assert!((f["value"].as_f64().unwrap() / own[k] - 1.0).abs() < 1e-9, "{f}");
        assert!((beside(f) / other[k] - 1.0).abs() < 1e-9, "{f} {}", other[k]);
        let relative = f["relative"][0].as_f64().unwrap();
        assert!((relative - (own[k] / other[k] - 1.0)).abs() < 1e-9);
    }
    let out = |name: &str| folder.path().join(name).display().to_string();
    let [a, b] =
        [(&coarse, "a.h5"), (&fine, "b.h5")].map(|(s, o)| json(&["run", s, "-o", &out(o)]));
    let forces = figures(&said, "force");
    let force = |run: &Value| run["forces"][0]["maximum"].as_f64().unwrap();
    assert!((forces[0]["value"].as_f64().unwrap() / force(&a) - 1.0).abs() < 1e-9);
    assert!((beside(forces[0]) / force(&b) - 1.0).abs() < 1e-7, "{} {}", forces[0], force(&b));
    let impulse = figures(&said, "impulse")[0];
    let size =
        |run: &Value| numbers(&run["forces"][0]["impulse"]).iter().fold(0.0f64, |m, x| m.hypot(*x));
    assert!((beside(impulse) / size(&b) - 1.0).abs() < 1e-7);
    let switches = figures(&said, "switches");
    assert_eq!(beside(switches[0]), b["switches"].as_array().unwrap().len() as f64);
    assert!((beside(switches[1]) / b["switches"][0]["t"].as_f64().unwrap() - 1.0).abs() < 1e-8);
}

/// A diagonal mass has no elements of second order beside it that are better: these have a consistent one.
#[test]
fn lumped_triangles_are_raised_with_a_consistent_mass() {
    let folder = tempfile::tempdir().unwrap();
    let of = |kind, name: &str, mass: &str| {
        let mesh = rectangle(kind, [0.0, 1.0], 0.4, (6, 3), 0.0);
        let file = scene(folder.path(), name, &mesh, HELD);
        let text = std::fs::read_to_string(&file).unwrap();
        let text = text.replace("[body]\n", &format!("[body]\nmass = '{mass}'\n"));
        written(folder.path(), &format!("{name}.toml"), &text)
    };
    let fine = of(ElementKind::Tri6, "t6", "consistent");
    let other = numbers(&json(&["modes", &fine])["open"]["omega"]);
    for mass in ["lumped", "scaled-diagonal"] {
        let said = json(&["trust", &of(ElementKind::Tri3, "t3", mass)]);
        assert_eq!(said["beside"][0]["replaced"], "raised");
        for (k, f) in figures(&said, "frequency").iter().take(3).enumerate() {
            assert!((beside(f) / other[k] - 1.0).abs() < 1e-9, "{mass} {f} {}", other[k]);
        }
    }
}

/// The error that it predicts for slender cantilevers of linear elements against meshes that are so fine that their own error does not count.
#[test]
fn the_error_of_a_cantilever_is_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let held = "[[support]]\ngroup = 'left'\nfix = ['x', 'y']\n";
    let plane = |kind, cells, name: &str| {
        let mesh = rectangle(kind, [0.0, 10.0], 1.0, cells, 0.0);
        scene(folder.path(), name, &mesh, held)
    };
    let truth =
        numbers(&json(&["modes", &plane(ElementKind::Quad9, (80, 8), "fine")])["open"]["omega"]);
    for (name, kind, cells, range) in [
        ("t3", ElementKind::Tri3, (20, 2), 0.88..1.0),
        ("t3-fine", ElementKind::Tri3, (40, 4), 0.88..1.0),
        // 1 to 2 times the difference of halves
        ("q4", ElementKind::Quad4, (20, 2), 0.5..1.0),
    ] {
        let said = json(&["trust", &plane(kind, cells, name)]);
        for (k, f) in figures(&said, "frequency").iter().take(2).enumerate() {
            let error = f["value"].as_f64().unwrap() - truth[k];
            let predicted = f["value"].as_f64().unwrap() - beside(f);
            let share = predicted / error;
            assert!(range.contains(&share), "{name} {k}: {share}");
        }
        let words = said["words"].to_string();
        assert!(words.contains("frequencies are off by up to"), "{words}");
        // functions of the edges: a part of the error of a triangle's frequency
        if kind == ElementKind::Tri3 {
            for (k, mode) in said["relief"].as_array().unwrap().iter().take(2).enumerate() {
                let (omega, eta) =
                    (mode["omega"].as_f64().unwrap(), mode["share"].as_f64().unwrap());
                let share = (1.0 / (1.0 - eta).sqrt() - 1.0) / (omega / truth[k] - 1.0);
                eprintln!("{name}, mode {}: {share:.2} of {:.3}", k + 1, omega / truth[k] - 1.0);
                assert!((0.6..1.0).contains(&share), "{name} {k}: {share}");
            }
        }
    }
    // the share of incompatible modes, without another solution: within a percent
    let said = json(&["trust", &folder.path().join("q4.toml").display().to_string()]);
    let relief = said["relief"].as_array().unwrap();
    for (k, mode) in relief.iter().take(2).enumerate() {
        let (omega, eta) = (mode["omega"].as_f64().unwrap(), mode["share"].as_f64().unwrap());
        assert!(
            eta > 0.1 && (omega * (1.0 - eta).sqrt() / truth[k] - 1.0).abs() < 0.02,
            "{mode} {}",
            truth[k]
        );
    }
}

/// The table and the picture have what is told.
#[test]
fn trust_is_a_table_and_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = rectangle(ElementKind::Quad4, [0.0, 1.0], 0.4, (6, 3), 0.0);
    let scene = scene(folder.path(), "q4", &mesh, &(HELD.to_owned() + STRUCK));
    let stem = folder.path().join("margins").display().to_string();
    let said = json(&["trust", &scene, "-o", &stem]);
    let table = std::fs::read_to_string(format!("{stem}.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("kind,name,value,beside_1,off_1,beside_2,off_2"));
    let all = said["figures"].as_array().unwrap();
    assert_eq!(lines.clone().count(), all.len());
    for (line, f) in lines.zip(all) {
        let off = line.rsplit(',').nth(2).unwrap();
        assert_eq!(off.parse::<f64>().ok(), f["relative"][0].as_f64(), "{line} {f}");
    }
    let svg = std::fs::read_to_string(format!("{stem}.svg")).unwrap();
    assert!(svg.contains("frequency open 1") && svg.contains("elements of half the size"));
    assert_eq!(said["written"].as_array().unwrap().len(), 4);
    // what is not its own stays
    std::fs::write(format!("{stem}.csv"), "mine").unwrap();
    refused(&["trust", &scene, "-o", &stem], "was not made by signorini");
}

/// In space: linear tetrahedra beside Tet10, Hex8 beside twice as many along every edge; every command that runs such a body warns.
#[test]
fn bodies_in_space_are_raised_and_halved() {
    let folder = tempfile::tempdir().unwrap();
    let held = "[[support]]\ngroup = 'xmin'\nfix = ['x', 'y', 'z']\n";
    let of = |kind, cells, name: &str, rest: &str| {
        let mesh = cuboid(kind, [4.0, 0.5, 0.6], cells, 0.0);
        scene(folder.path(), name, &mesh, &(held.to_owned() + rest))
    };
    let tet = [
        of(ElementKind::Tet4, [8, 1, 1], "tet4", ""),
        of(ElementKind::Tet10, [8, 1, 1], "tet10", ""),
    ];
    let hex = [
        of(ElementKind::Hex8, [8, 1, 1], "hex8", ""),
        of(ElementKind::Hex8, [16, 2, 2], "fine", ""),
    ];
    for (scenes, kind) in [(tet, "raised"), (hex, "halved")] {
        let said = json(&["trust", &scenes[0]]);
        assert_eq!(said["beside"][0]["replaced"], kind);
        let other = numbers(&json(&["modes", &scenes[1]])["open"]["omega"]);
        for (k, f) in figures(&said, "frequency").iter().enumerate() {
            assert!((beside(f) / other[k] - 1.0).abs() < 1e-8, "{kind} {f} {}", other[k]);
        }
        if kind == "raised" {
            for (k, mode) in said["relief"].as_array().unwrap().iter().enumerate() {
                let (omega, eta) =
                    (mode["omega"].as_f64().unwrap(), mode["share"].as_f64().unwrap());
                let share = (1.0 / (1.0 - eta).sqrt() - 1.0) / (omega / other[k] - 1.0);
                eprintln!("Tet4, mode {}: {share:.2} of {:.3}", k + 1, omega / other[k] - 1.0);
                assert!((0.6..1.0).contains(&share), "{k}: {share}");
            }
        }
        let warning = json(&["modes", &scenes[0]])["warning"].as_str().map(str::to_owned);
        assert!(warning.is_some_and(|w| w.contains("stiff")), "{kind}");
    }
}

/// Where the contact conditions of second order do not do, halves stand in; without contact and run there are frequencies; bodies from matrices have no mesh to refine.
#[test]
fn what_cannot_be_raised_is_halved_and_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let rest = HELD.replace("'mass-redistribution'", "'penalty'") + STRUCK;
    let mesh = rectangle(ElementKind::Tri3, [0.0, 1.0], 0.4, (4, 2), 0.0);
    let said = json(&["trust", &scene(folder.path(), "a", &mesh, &rest)]);
    let kinds: Vec<&str> = said["beside"]
        .as_array()
        .unwrap()
        .iter()
        .map(|b| b["replaced"].as_str().unwrap())
        .collect();
    for (k, kind) in kinds.iter().enumerate() {
        let refused = &said["beside"][k]["refused"];
        assert!(
            refused.is_null() || kinds.get(k + 1) == Some(&"halved") || *kind == "other-contact",
            "{said}"
        );
    }
    let output = run(&["trust", "scenarios/matrices.toml"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() || !output.stderr.is_empty(), "{text}");
    assert!(!text.contains("half the size"), "{text}");
}

/// An orbit beside that on the finer mesh: what `orbit` says of both, the latter on the mesh that another generator makes.
#[test]
fn orbits_are_found_on_each_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let driven = "[damping]\nrayleigh = [0.1, 0.0]\n[[load]]\nkind = 'traction'\ngroup = 'right'\namplitude = [0.005, 0.0]\nomega = 1.5\n";
    let of = |kind, name: &str| {
        let mesh = rectangle(kind, [0.0, 1.0], 0.4, (5, 2), 0.0);
        scene(folder.path(), name, &mesh, &(HELD.to_owned() + driven))
    };
    let scenes = [of(ElementKind::Tri3, "t3"), of(ElementKind::Tri6, "t6")];
    let said = json(&["trust", &scenes[0], "--orbit"]);
    let file = folder.path().join("o.h5").display().to_string();
    let orbits = scenes.each_ref().map(|s| json(&["orbit", s, "-o", &file, "--force"]));
    assert!(orbits.iter().all(|o| o["switches"].as_array().unwrap().len() >= 2));
    let figure = |kind: &str, name: &str| {
        let found = figures(&said, kind).into_iter().find(|f| f["name"] == name);
        let f = found.unwrap_or_else(|| panic!("{kind} {name}: {said}"));
        [f["value"].as_f64().unwrap(), beside(f)]
    };
    for (kind, name, key) in [
        ("orbit", "time in contact", "contact_time"),
        ("orbit", "largest multiplier", "largest_multiplier"),
        ("orbit", "frequency", "omega"),
    ] {
        for (own, orbit) in figure(kind, name).iter().zip(&orbits) {
            let there = orbit[key].as_f64().unwrap_or_else(|| panic!("{key}: {orbit}"));
            assert!((own / there - 1.0).abs() < 1e-6, "{name}: {own} {there}");
        }
    }
    let counts = figure("switches", "number, orbit");
    for (count, orbit) in counts.iter().zip(&orbits) {
        assert_eq!(*count, orbit["switches"].as_array().unwrap().len() as f64);
    }
    assert!(figure("force", "contact \"right\", orbit").iter().all(|f| *f > 0.0));
    // of nodes that stand in another order, and of orbits that are not there, no order of convergence is known
    assert_eq!(said["beside"][0]["same_switches"], false);
}

/// What has no orbit says so: at once where nothing periodic can be there.
#[test]
fn orbits_that_are_not_there_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = rectangle(ElementKind::Tri3, [0.0, 1.0], 0.4, (3, 2), 0.0);
    let damped = HELD.to_owned() + "[damping]\nrayleigh = [0.1, 0.0]\n";
    let file = scene(folder.path(), "a", &mesh, &damped);
    refused(&["trust", &file, "--orbit", "--omega", "1.5"], "no periodic motion but rest");
    let file = scene(folder.path(), "b", &mesh, HELD);
    refused(&["trust", &file, "--orbit"], "--omega");
    refused(&["trust", &file, "--omega", "1.5"], "--orbit");
}
