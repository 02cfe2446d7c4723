//! Motions of two frequencies: against an independent program, and against motions that settle by themselves.

use std::path::Path;

use tempfile::TempDir;

use signorini::orbit::Propagator;
use signorini::orbit::rotation::rotation_number;
use signorini::orbit::section::later;
use signorini::orbit::torus::{Given, Torus};
use signorini::problem::Problem;
use signorini::records::Tori;
use signorini::scenario::Scene;
use signorini::store::read_tori;

use crate::common::{json, refused, run};

/// Two unit masses in a chain of springs 1, the first before an elastic stop without a gap; it is driven.
fn masses(folder: &Path) -> String {
    let matrix = |name: &str, a: f64, b: f64| {
        let text =
            format!("%%MatrixMarket matrix array real general\n2 2\n{a:?}\n{b:?}\n{b:?}\n{a:?}\n");
        std::fs::write(folder.join(name), text).unwrap();
    };
    matrix("m.mtx", 1.0, 0.0);
    matrix("k.mtx", 2.0, -1.0);
    let text = "[body]\nkind = \"matrices\"\nmass_matrix = \"m.mtx\"\nstiffness_matrix = \"k.mtx\"\n\
                [contact]\nmethod = \"penalty\"\ndisplacements = [0]\ngap = 0.0\nstiffness = 10.0\n[damping]\nrayleigh = [0.04, 0.0]\n\
                [[load]]\nkind = \"force\"\ndisplacement = 0\namplitude = 1.0\nomega = 2.94\n";
    let path = folder.join("masses.toml");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn tori(folder: &TempDir, more: &[&str]) -> (Tori, serde_json::Value) {
    let scene = masses(folder.path());
    let file = folder.path().join("tori.h5");
    let own = ["tori", &scene, "-o", file.to_str().unwrap(), "--force"];
    let said = json(&[&own, more].concat());
    (read_tori(&file).unwrap().tori, said)
}

/// Where there is no curve, the command says that it found none.
#[test]
fn no_curve_is_no_success() {
    let folder = TempDir::new().unwrap();
    let (scene, file) = (masses(folder.path()), folder.path().join("a.h5"));
    let own = ["tori", &scene, "--omega", "2.9209", "--curves", "2", "--size", "100"];
    let output = run(&[&own[..], &["-o", file.to_str().unwrap()]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("no curve of size"), "{said}");
}

/// The family of a prototype in Python: where it begins, and its frequencies and rotation numbers.
#[test]
fn a_family_of_tori_is_that_of_an_independent_program() {
    let folder = TempDir::new().unwrap();
    let more = ["--omega", "2.9209", "--curves", "10", "--size", "0.01"];
    let (found, said) = tori(&folder, &more);
    assert_eq!(found.rows.len(), 10, "{}", found.end);
    // ω = 2.9209527708 + c a²
    let (small, _) = tori(&folder, &["--omega", "2.9209", "--curves", "2", "--size", "0.003"]);
    let [a, b] = &small.rows[..] else { panic!("{}", small.end) };
    let c = (b.omega - a.omega) / (b.size.powi(2) - a.size.powi(2));
    let begin = a.omega - c * a.size.powi(2);
    assert!((begin - 2.920_952_770_8).abs() < 1e-9, "{begin}");
    let body = Scene::read(Path::new(&masses(folder.path()))).unwrap();
    let mut body = Propagator::new(Problem::new(&body, None).unwrap().system).unwrap();
    for (omega, rho, within) in [
        (2.921_183_797, 0.380_537_247, 2e-9),
        (2.926_832_849, 0.380_181_941, 2e-9),
        // of a settled motion
        (2.93, 0.379_992_1, 2e-7),
    ] {
        let near = found
            .rows
            .iter()
            .min_by(|a, b| (a.omega - omega).abs().total_cmp(&(b.omega - omega).abs()));
        let near = near.unwrap();
        let from = Torus { omega: near.omega, rho: near.rho, states: near.states.clone() };
        let torus = from.corrected(&mut body, Given::Frequency(omega)).unwrap().unwrap();
        assert!((torus.rho - rho).abs() < within, "{omega}: {}", torus.rho);
        // what it is made of: a motion from one of its states stays on it
        let mut z = torus.states[0].clone();
        let mut states = vec![];
        for k in 0..400 {
            states.push(z.clone());
            let [there, _] = torus.at(std::f64::consts::TAU * torus.rho * f64::from(k));
            let off = z.iter().zip(&there).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 2e-7, "{omega}: {off} after {k}");
            z = later(&mut body, &z, omega, 1.0).unwrap();
        }
        let (mean, _) = rotation_number(&states).unwrap();
        assert!((mean - torus.rho).abs() < 1e-6, "{mean}");
    }
    assert!(found.rows.iter().all(|row| row.tail <= 1e-8));
    // nothing can be seen of the smallest ones; the larger ones attract
    assert!(found.rows.iter().all(|row| row.attraction.is_nan() || row.attracts()));
    assert!(found.rows[6..].iter().all(|row| row.attracts() && row.attraction > 0.9));
    assert_eq!(said["rotation_number"][3].as_f64(), Some(found.rows[3].rho));
}

/// Another size of steps, and a run that is gone on with, give the same family.
#[test]
fn tori_go_on_and_are_shown() {
    let folder = TempDir::new().unwrap();
    let (whole, _) = tori(&folder, &["--omega", "2.9209", "--curves", "6"]);
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (file, scene) = (at("tori.h5"), at("masses.toml"));
    let before = std::fs::read(&file).unwrap();
    let own = ["tori", &scene, "-o", &file, "--omega", "2.9209", "--resume"];
    json(&[&own[..], &["--curves", "6"]].concat());
    assert_eq!(std::fs::read(&file).unwrap(), before);
    refused(&[&own[..], &["--curves", "7"]].concat(), "another");
    json(&["plot", &file, "-o", &at("picture.png")]);
    assert!(folder.path().join("picture.png").exists());
    json(&["export", &file]);
    let table = std::fs::read_to_string(folder.path().join("tori.csv")).unwrap();
    assert_eq!(table.lines().count(), 7);
    assert_eq!(json(&["inspect", &file])["omega"].as_array().unwrap().len(), 6);
    // ρ over ω is one curve, whatever the steps
    let (fine, _) = tori(&folder, &["--omega", "2.9209", "--curves", "6", "--size", "0.03"]);
    for row in &fine.rows {
        let beside: Vec<_> = whole
            .rows
            .windows(2)
            .filter(|w| w[0].omega <= row.omega && row.omega <= w[1].omega)
            .collect();
        for w in beside {
            let share = (row.omega - w[0].omega) / (w[1].omega - w[0].omega);
            let rho = w[0].rho + share * (w[1].rho - w[0].rho);
            assert!((row.rho - rho).abs() < 1e-7, "{row:?}");
        }
    }
    // an orbit without a pair says so
    let (empty, other) = (at("none.h5"), at("other.h5"));
    let output = run(&["tori", &scene, "-o", &empty, "--omega", "0.01"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let none = read_tori(Path::new(&empty)).unwrap().tori;
    assert!(none.rows.is_empty() && said.contains(&none.end), "{said}");
    assert_eq!(output.status.code(), Some(3));
    for (more, why) in [
        (&["--omega", "-1"][..], "--omega"),
        (&["--omega", "2.92", "--size", "0"], "--size"),
        (&["--omega", "2.92", "--range", "3,4"], "--range"),
        (&["--omega", "2.92", "--curves", "0"], "--curves"),
    ] {
        refused(&[&["tori", &scene, "-o", &other][..], more].concat(), why);
    }
}
