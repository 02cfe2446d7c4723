//! `orbit --near-return`: which state of a run is a guess at an orbit.

use crate::common::{json, root, run};
use serde_json::Value;
use tempfile::TempDir;

fn scene(folder: &TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn integrate(scene: &str, file: &str) {
    let output = run(&["run", scene, "-q", "-o", file]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A forced run that has settled comes back after a period of its load; what it comes back to best, after dozens of them, is no period. Samples at any times.
#[test]
fn a_forced_run_comes_back_after_a_period_of_its_load() {
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(root().join("scenarios/half-plate-response.toml")).unwrap();
    let text = text.split("[run]").next().unwrap();
    let omega = 1.6;
    let text: String =
        text.lines()
            .map(|l| {
                if l.starts_with("omega") { format!("omega = {omega}\n") } else { format!("{l}\n") }
            })
            .collect();
    let text = format!("{text}[run]\nperiods = 60\nsamples = 1111\n");
    let forced = scene(&folder, "forced.toml", &text);
    let at = |name: &str| folder.path().join(name).display().to_string();
    let file = at("run.h5");
    integrate(&forced, &file);
    let orbit = |more: &[&str]| -> Value {
        let out = at("orbit.h5");
        json(&[&["orbit", &forced, "--near-return", &file, "--force", "-o", &out], more].concat())
    };
    let one = orbit(&[]);
    assert!((one["omega"].as_f64().unwrap() - omega).abs() < 1e-9, "{one}");
    let period = std::f64::consts::TAU / omega;
    assert!((one["period"].as_f64().unwrap() - period).abs() < 1e-9, "{one}");
    // after two periods it has come back to what comes back after one
    let out = at("two.h5");
    let two = run(&["orbit", &forced, "--near-return", &file, "--periods", "2", "-o", &out]);
    let said = String::from_utf8_lossy(&two.stderr).into_owned();
    assert!(said.contains("repeats after one period of the loads"), "{said}");
    // the orbit that plain shooting finds at this frequency
    let out = at("plain.h5");
    let plain = json(&["orbit", &forced, "-o", &out]);
    let [a, b] = [&one, &plain].map(|o| o["energy"].as_f64().unwrap());
    assert!((a - b).abs() < 1e-7 * b, "{a} {b}");
    // too short a run says so
    let short = text.replace("periods = 60", "periods = 1.5");
    let short = scene(&folder, "short.toml", &short);
    integrate(&short, &file.replace("run.h5", "short.h5"));
    let file = at("short.h5");
    let out = at("none.h5");
    let refused = run(&["orbit", &short, "--near-return", &file, "--periods", "2", "-o", &out]);
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("less than 2"), "{said}");
}

/// Files have displacements along the axes, bodies along their normals: on a plate whose contact group is inclined, a run along an orbit comes back to it. Its state at the
/// start is the orbit's own.
#[test]
fn an_inclined_group_has_its_own_directions() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    // a square of one element beside another, turned by 30 degrees: the right side is inclined
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let turned = |x: f64, y: f64| format!("{:.16} {:.16} 0", cos * x - sin * y, sin * x + cos * y);
    let mut mesh = String::from(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n1 1 \"left\"\n1 2 \"right\"\n2 3 \"all\"\n$EndPhysicalNames\n$Nodes\n6\n",
    );
    for (k, (x, y)) in [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (0.0, 0.4), (0.5, 0.4), (1.0, 0.4)]
        .into_iter()
        .enumerate()
    {
        mesh += &format!("{} {}\n", k + 1, turned(x, y));
    }
    mesh += "$EndNodes\n$Elements\n4\n1 1 2 1 1 1 4\n2 1 2 2 2 3 6\n3 3 2 3 3 1 2 5 4\n4 3 2 3 3 2 3 6 5\n$EndElements\n";
    std::fs::write(at("turned.msh"), mesh).unwrap();
    let text = "[body]\nkind = \"mesh\"\nfile = \"turned.msh\"\nstate = \"plane strain\"\n[[material]]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
        [[support]]\ngroup = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\ngroup = \"right\"\ngap = 1.0\nmethod = \"mass-redistribution\"\n";
    let text = format!("{text}[orbit]\nomega = 1.9\n[run]\nuntil = 12.0\nsamples = 400\n");
    let body = scene(&folder, "s.toml", &text);
    let first = run(&["orbit", &body, "-q", "-o", &at("orbit.h5")]);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let going = text.replace("[orbit]", "[initial]\nfile = \"orbit.h5\"\n[orbit]");
    let going = scene(&folder, "run.toml", &going);
    integrate(&going, &at("run.h5"));
    let words = ["orbit", &body, "--near-return", &at("run.h5"), "--omega", "1.9"];
    let again = json(&[&words[..], &["-o", &at("again.h5")]].concat());
    let energy = |o: &Value| o["energy"].as_f64().unwrap();
    let known = json(&["inspect", &at("orbit.h5")]);
    let known = known["energy"].as_f64().or(known["orbit"]["energy"].as_f64()).unwrap();
    assert!((energy(&again) - known).abs() < 1e-6 * known, "{again} {known}");
    // the guess was an orbit already
    assert!(again["newton_iterations"].as_u64().unwrap() <= 2, "{again}");
}
