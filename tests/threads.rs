//! Results do not depend on the number of threads: every dataset of every command, row order included.

use std::path::Path;

use crate::common::{datasets, program, root};
use tempfile::TempDir;

/// The same command on 1, 2 and 5 threads.
fn same_on_any(name: &str, arguments: &[&str]) {
    let folder = TempDir::new().unwrap();
    let of = |threads: &str| {
        let file = folder.path().join(format!("{threads}.h5"));
        let output = program()
            .args(arguments)
            .args(["-q", "--threads", threads, "-o"])
            .arg(&file)
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{name}: {text}");
        datasets(&file)
    };
    let one = of("1");
    for threads in ["2", "5"] {
        let other = of(threads);
        assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>(), "{name}");
        for (dataset, values) in &one {
            assert!(values == &other[dataset], "{name}: {dataset} differs on {threads} threads");
        }
    }
}

const SCENE: &str = "scenarios/half-plate-orbit.toml";
const RESPONSE: &str = "scenarios/half-plate-response.toml";

#[test]
fn orbits_and_backbones() {
    same_on_any("orbit", &["orbit", SCENE, "--omega", "1.8"]);
    same_on_any("sequential", &["backbone", SCENE, "--range", "1.78,1.80"]);
    same_on_any(
        "arclength",
        &["backbone", SCENE, "--follow", "arclength", "--omega", "1.8", "--points", "12"],
    );
}

#[test]
fn every_orbit_that_is_found() {
    let json = |threads: &str| {
        let arguments = ["orbit", SCENE, "--omega", "1.8", "--all", "--amplitudes", "6", "--json"];
        let output = program().args(arguments).args(["--threads", threads]).output().unwrap();
        assert!(output.status.success());
        let mut json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        json["wall_s"] = 0.0.into();
        json
    };
    assert_eq!(json("1"), json("2"));
    assert_eq!(json("1"), json("5"));
}

#[test]
fn harmonic_balance_and_cross_check() {
    let hbm = ["--method", "hbm", "--harmonics", "1,3,7"];
    same_on_any("hbm", &[&["backbone", SCENE, "--range", "1.74,1.80"], &hbm[..]].concat());
    let arclength = ["--follow", "arclength", "--omega", "1.75", "--points", "10"];
    same_on_any("hbm arclength", &[&["backbone", SCENE], &hbm[..], &arclength].concat());
    let csv = "validate/foreign/half-plate.csv";
    same_on_any("crosscheck", &["crosscheck", csv, SCENE]);
}

#[test]
fn responses() {
    let base = ["response", RESPONSE, "--ratios", "0.05,0.08", "--range", "1.68,1.71"];
    same_on_any("response", &base);
    let hbm = ["--method", "hbm", "--harmonics", "3,5"];
    same_on_any("response, hbm", &[&base[..], &hbm].concat());
}

#[test]
fn bands_of_a_response() {
    let folder = TempDir::new().unwrap();
    let family = folder.path().join("family.h5");
    let scene = "scenarios/two-mass-stop.toml";
    let response = ["response", scene, "--method", "shooting", "--range", "0.6,0.7", "-q", "-o"];
    assert!(program().args(response).arg(&family).output().unwrap().status.success());
    let deviation = "contact.gap=2%,damping.rayleigh[1]=10%";
    same_on_any("bands", &["bands", family.to_str().unwrap(), "--deviation", deviation]);
}

/// A chaotic run: the last bit of an eigenvector decides about thousands of switches.
#[test]
fn a_long_run() {
    let folder = TempDir::new().unwrap();
    let source = std::fs::read_to_string(root().join("scenarios/plate.toml")).unwrap();
    let source = source.replace("elements = [20, 10]", "elements = [10, 5]");
    let (head, _) = source.split_once("[run]").unwrap();
    let scene = folder.path().join("long.toml");
    let text = format!("{head}[run]\nuntil = 1500.0\nintegrator = \"modal\"\n");
    std::fs::write(&scene, text).unwrap();
    same_on_any("run", &["run", Path::new(&scene).to_str().unwrap()]);
}
