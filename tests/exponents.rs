//! Lyapunov exponents: exact sums and pairs, multipliers of an orbit, an independent program's chaos.

use serde_json::Value;
use tempfile::TempDir;

use crate::common::{json, program, with_unit_matrix as written};

/// One displacement, M = K = B = 1, before an elastic stop without a gap, under `cos ωt`: Shaw and Holmes' setting with a stiff spring.
fn one_stop(omega: f64) -> String {
    format!(
        "[body]\nkind = \"matrices\"\nmass_matrix = \"one.mtx\"\nstiffness_matrix = \"one.mtx\"\n\
         [contact]\ndisplacements = [0]\ngap = 0.0\nmethod = \"penalty\"\nstiffness = 200.0\n[damping]\nrayleigh = [0.1, 0.0]\n\
         [[load]]\nkind = \"force\"\ndisplacement = 0\namplitude = 1.0\nomega = {omega:?}\n[run]\nperiods = 100\nintegrator = \"modal\"\n"
    )
}

/// The exponents of a scene, with the file.
fn exponents(text: &str, count: &str, periods: &str) -> (Value, TempDir) {
    let folder = TempDir::new().unwrap();
    let scene = written(folder.path(), text);
    let file = folder.path().join("run.h5").display().to_string();
    let said =
        json(&["run", &scene, "-o", &file, "--lyapunov", count, "--lyapunov-periods", periods]);
    (said["lyapunov"].clone(), folder)
}

fn numbers(said: &Value, key: &str) -> Vec<f64> {
    said[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Chaos of the oscillator at 2.75: exponent and dimension of an independent program (20,000 periods there: 0.13367 ± 0.0013, dimension 1.572).
#[test]
fn a_stop_without_a_gap_is_chaotic_as_elsewhere() {
    let (said, folder) = exponents(&one_stop(2.75), "2", "6000");
    let (of, errors) = (numbers(&said, "exponents"), numbers(&said, "bounds"));
    assert_eq!(said["verdict"], "chaotic");
    assert!((of[0] - 0.133_67).abs() < 4.0 * (errors[0] + 0.0013) && errors[0] < 0.01, "{said}");
    // volumes shrink by α, and the exponents lie in a pair about −α/2
    assert!((of[0] + of[1] + 0.1).abs() < 1e-12, "{said}");
    assert!((said["divergence"].as_f64().unwrap() + 0.1).abs() < 1e-13, "{said}");
    assert!((said["dimension"].as_f64().unwrap() - 1.572).abs() < 0.02, "{said}");
    let file = crate::common::hdf5_files().open(folder.path().join("run.h5")).unwrap();
    let growths = file.dataset("lyapunov/growths").unwrap();
    assert_eq!(growths.shape(), [6000, 2]);
    let growths: Vec<f64> = growths.read_raw().unwrap();
    let mean = growths.chunks_exact(2).map(|g| g[0]).sum::<f64>()
        / 6000.0
        / said["period"].as_f64().unwrap();
    assert!((mean - of[0]).abs() < 1e-13);
}

/// Where the motion is an orbit: the logarithms of its multipliers, and nothing that grows.
#[test]
fn exponents_of_an_orbit_are_its_multipliers() {
    let folder = TempDir::new().unwrap();
    let text = one_stop(2.2)
        .replace("periods = 100", "periods = 600")
        .replace("rayleigh = [0.1, 0.0]", "rayleigh = [0.1, 0.02]");
    let (said, _) = exponents(&text, "2", "400");
    assert_eq!(said["verdict"], "regular");
    let of = numbers(&said, "exponents");
    let scene = written(folder.path(), &text);
    let file = folder.path().join("orbit.h5").display().to_string();
    let orbit = json(&["orbit", &scene, "--omega", "2.2", "-o", &file]);
    let period = orbit["period"].as_f64().unwrap();
    let sizes: Vec<f64> = orbit["multipliers"]
        .as_array()
        .unwrap()
        .iter()
        .map(|m| m[0].as_f64().unwrap().hypot(m[1].as_f64().unwrap()).ln() / period)
        .collect();
    assert!((of[0] + of[1] - sizes[0] - sizes[1]).abs() < 1e-10, "{of:?} {sizes:?}");
    // directions of a complex pair go round: their means come near as one over the time
    assert!((of[0] - sizes[0]).abs() < 0.02, "{of:?} {sizes:?}");
    assert!((said["divergence"].as_f64().unwrap() - of[0] - of[1]).abs() < 1e-10);
}

/// A bar whose mass-proportional damping makes pairs about −α/2, with nodes that close and open.
#[test]
fn exponents_of_a_bar_lie_in_pairs() {
    let text = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [6]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
        [contact]\nedge = \"right\"\ngap = 0.1\nmethod = \"mass-redistribution\"\n[damping]\nrayleigh = [0.05, 0.0]\n\
        [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = 0.5\nomega = 2.3\n[run]\nperiods = 60\n";
    let (said, _) = exponents(text, "10", "400");
    let of = numbers(&said, "exponents");
    let sum: f64 = of.iter().sum();
    let m = of.len() as f64 / 2.0;
    assert!((sum + 0.05 * m).abs() < 1e-10, "{sum}");
    for (a, b) in of.iter().zip(of.iter().rev()) {
        assert!((a + b + 0.05).abs() < 2e-3, "{of:?}");
    }
}

#[test]
fn what_has_no_exponents_is_refused() {
    let folder = TempDir::new().unwrap();
    let scene = written(folder.path(), &one_stop(2.75));
    let file = folder.path().join("run.h5").display().to_string();
    for (more, word) in [
        (vec!["--lyapunov", "3"], "there are 2 exponents"),
        (vec!["--lyapunov-periods", "30"], "--lyapunov"),
    ] {
        let output = program().args(["run", &scene, "-o", &file]).args(&more).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(error.contains(word), "{error}");
    }
}
