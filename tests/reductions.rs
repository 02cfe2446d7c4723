//! Reductions of `u_O`: with all modes they change nothing, linear motions are exact with few, what is left out is stated, and every command takes them.

use crate::common::{half_plate, json, run, scene};
use serde_json::Value;
use signorini::problem::Problem;

const LOADED: &str = "\n[damping]\nratio = 0.02\nmode = 1\n[[load]]\nkind = \"mode\"\nmode = 1\npeak = 3.0\nomega = 1.7\n[orbit]\nrange = [1.4, 1.75]\n";

const METHODS: [&str; 3] = [
    "stress = \"projection\"",
    "stress = \"reaction\"\ninertia = \"constant\"",
    "method = \"mass-redistribution\"",
];

/// What `signorini` says of a scene.
fn said(text: &str, words: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let [file, out] = ["scene.toml", "out.h5"].map(|name| folder.path().join(name));
    std::fs::write(&file, text).unwrap();
    let [file, out] = [&file, &out].map(|p| p.to_str().unwrap());
    json(&[&[words[0], file, "-o", out], &words[1..]].concat())
}

fn response(method: &str, reduction: &str) -> Value {
    let text = format!("{}{LOADED}{reduction}", half_plate(10, 3, method));
    said(&text, &["response"])
}

/// Frequencies of the points of a kind.
fn at(response: &Value, kind: &str) -> Vec<f64> {
    let points = response["points"].as_array().unwrap().iter();
    let of_kind = points.filter(|p| p["special"].as_str().unwrap().contains(kind));
    of_kind.map(|p| p["omega"].as_f64().unwrap()).collect()
}

fn reduction(kind: &str, modes: usize) -> String {
    format!("[reduction]\nkind = \"{kind}\"\nmodes = {modes}\n")
}

/// The largest relative difference.
fn off(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "{a:?} {b:?}");
    a.iter().zip(b).fold(0.0, |m, (a, b)| (a / b - 1.0).abs().max(m))
}

/// All modes: the same folds and grazings, whatever the discretisation. Few: the first grazing, the end of a linear motion in the mode that is loaded, is exact
/// with free-interface modes; the folds converge.
#[test]
#[ignore = "a minute and a half"]
fn the_response_of_a_reduced_body_converges() {
    for method in METHODS {
        let full = response(method, "");
        let (folds, grazings) = (at(&full, "fold"), at(&full, "grazes"));
        assert!(!folds.is_empty() && !grazings.is_empty(), "{method}");
        assert!(full.get("error_statement").is_none());
        let all = response(method, &reduction("free-interface", 1000));
        assert!(off(&at(&all, "fold"), &folds) < 1e-8, "{method}");
        assert!(off(&at(&all, "grazes"), &grazings) < 1e-8, "{method}");
        for (modes, bound) in [(4, 2e-3), (16, 3e-4)] {
            let few = response(method, &reduction("free-interface", modes));
            let first = at(&few, "grazes")[0] / grazings[0] - 1.0;
            assert!(first.abs() < 1e-9, "{method}, {modes} modes: {first:e}");
            let fold = (at(&few, "fold")[0] / folds[0] - 1.0).abs();
            assert!(fold > 1e-6 && fold < bound, "{method}, {modes} modes: {fold:e}");
        }
    }
}

/// The same before springs, whose branch has a grazing every hundredth of its range: where contact begins.
#[test]
fn a_reduced_body_meets_springs() {
    let near = |reduction: &str| {
        let spring = "method = \"penalty\"\nstiffness = 20.0";
        let text = format!("{}{LOADED}{reduction}", half_plate(10, 3, spring));
        said(&text, &["response", "--range", "1.47,1.494"])
    };
    let full = near("");
    let all = near(&reduction("free-interface", 1000));
    assert!(off(&at(&all, "grazes"), &at(&full, "grazes")) < 1e-8);
    let energy =
        |r: &Value| r["points"].as_array().unwrap().last().unwrap()["energy"].as_f64().unwrap();
    assert!((energy(&all) / energy(&full) - 1.0).abs() < 1e-8);
    let few = near(&reduction("free-interface", 8));
    assert!((at(&few, "grazes")[0] / at(&full, "grazes")[0] - 1.0).abs() < 1e-9);
    assert!((energy(&few) / energy(&full) - 1.0).abs() < 1e-2);
}

/// The statement holds: at its frequencies the energies of the full body differ from those of the reduced one by at most about twice what it says.
#[test]
fn the_error_of_a_reduction_is_stated() {
    for kind in ["free-interface", "fixed-interface"] {
        let few = response(METHODS[0], &reduction(kind, 8));
        let statement = &few["error_statement"];
        let list = |v: &Value| -> Vec<f64> {
            v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
        };
        let [variation] = &statement["variations"].as_array().unwrap()[..] else { panic!() };
        assert_eq!(variation["changed"], "more_modes");
        assert_eq!(variation["what"], "16 modes");
        let stated = list(&variation["relative"]).into_iter().map(f64::abs).fold(0.0, f64::max);
        let mut worst = 0.0f64;
        for (omega, energy) in list(&statement["omega"]).iter().zip(list(&statement["energy"])) {
            // the branch of small motions and that of large ones are told apart by the reduced orbit
            let text = format!("{}{LOADED}", half_plate(10, 3, METHODS[0]));
            let orbit = said(&text, &["orbit", "--omega", &omega.to_string()]);
            let off = (orbit["energy"].as_f64().unwrap() / energy - 1.0).abs();
            if off < 0.1 {
                worst = worst.max(off);
            }
        }
        println!("{kind}: stated {stated:e}, true {worst:e}");
        assert!(worst > 1e-6 && worst < 2.5 * stated, "{kind}: {worst:e}, stated {stated:e}");
    }
}

/// Without damping the branch is followed with the times of the switches among its unknowns: its orbits are computed with more modes all the same.
#[test]
fn the_error_of_an_undamped_response_is_stated() {
    let text = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [6]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n[contact]\nedge = 'right'\ngap = 0.02\n\
                [[load]]\nkind = 'mode'\nmode = 1\nomega = 1.4\namplitude = 0.03\n[orbit]\nomega = 1.4\nrange = [1.4, 1.5]\n";
    let few =
        said(&format!("{text}[reduction]\nkind = 'fixed-interface'\nmodes = 2\n"), &["response"]);
    let statement = &few["error_statement"];
    let list = |v: &Value| -> Vec<f64> {
        v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
    };
    let [variation] = &statement["variations"].as_array().unwrap()[..] else {
        panic!("{statement}")
    };
    let stated = list(&variation["relative"]);
    println!("{statement}");
    assert!(stated.iter().any(|e| e.is_finite() && *e != 0.0), "{statement}");
    // one of them is the orbit that a body with so many modes has by itself
    let more = format!("{text}[reduction]\nkind = 'fixed-interface'\nmodes = 4\n");
    let all = list(&statement["omega"]).into_iter().zip(list(&statement["energy"])).zip(stated);
    let is_own = |((omega, energy), stated): ((f64, f64), f64)| {
        let orbit = said(&more, &["orbit", "--omega", &omega.to_string()]);
        let off = orbit["energy"].as_f64().unwrap() / (energy * (1.0 + stated)) - 1.0;
        println!("{omega}: {off:e}");
        off.abs() < 1e-6
    };
    assert!(all.filter(|(_, stated)| stated.is_finite()).any(is_own), "{statement}");
}

/// Harmonic balance of a reduced body, and its cross-check by shooting, in the coordinates of the reduction; a series of the full body is checked on the reduced one,
/// too.
#[test]
fn series_of_reduced_bodies_are_cross_checked() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let text = format!("{}{LOADED}", half_plate(10, 3, METHODS[0]));
    std::fs::write(at("full.toml"), &text).unwrap();
    std::fs::write(at("few.toml"), text + &reduction("free-interface", 12)).unwrap();
    let words = ["--method", "hbm", "--harmonics", "15", "--range", "1.4,1.5", "--step", "0.2"];
    let mut energies = vec![];
    for name in ["few", "full"] {
        let (scene, out) = (at(&format!("{name}.toml")), at(&format!("{name}.h5")));
        let found = json(&[&["response", &scene, "-o", &out], &words[..]].concat());
        let points = found["points"].as_array().unwrap();
        assert!(points.len() >= 8 && points.iter().all(|p| p["converged"] == true));
        energies.push(points.iter().map(|p| p["energy"].as_f64().unwrap()).collect::<Vec<f64>>());
        let file = at("check.h5");
        let checked = json(&["crosscheck", &out, &at("few.toml"), "-o", &file, "--force"]);
        let points = checked["points"].as_array().unwrap();
        assert!(points.iter().all(|p| p["verdict"] == "orbit"), "{name}: {checked}");
    }
    assert!(off(&energies[0], &energies[1]) < 2e-3);
}

/// Above 800 displacements what is forced is shot in a reduced body: it is said, it stands in the scene of the file, the file can be resumed, and an orbit too.
#[test]
fn large_forced_bodies_are_reduced_by_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let text = format!("{}{LOADED}", half_plate(60, 7, METHODS[0]));
    assert!(Problem::new(&scene(&text), None).unwrap().system.n_o() > 800);
    std::fs::write(at("large.toml"), text).unwrap();
    let (large, out) = (at("large.toml"), at("out.h5"));
    let words = ["response", &large, "--range", "1.4,1.45", "-o", &out];
    let first = run(&[&words[..], &["--points", "3"]].concat());
    let warning = String::from_utf8_lossy(&first.stderr).into_owned();
    assert!(warning.contains("reduced to 100 modes of the open body"), "{warning}");
    let whole = json(&[&words[..], &["--resume"]].concat());
    assert!(whole["resumed"].as_u64().unwrap() >= 1, "{whole}");
    assert_eq!(whole["error_statement"]["variations"][0]["what"], "200 modes");
    let stored = signorini::store::StoredFamily::read(out.as_ref()).unwrap();
    assert!(stored.scene.contains("kind = \"free-interface\""), "{}", stored.scene);
    let orbit = json(&["orbit", &large, "--omega", "1.45", "-o", &at("orbit.h5")]);
    let end = whole["points"].as_array().unwrap().last().unwrap()["energy"].as_f64().unwrap();
    assert!((orbit["energy"].as_f64().unwrap() / end - 1.0).abs() < 1e-8);
}
