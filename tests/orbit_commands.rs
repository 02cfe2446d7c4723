//! orbit, backbone, response, crosscheck from the command line: keys, exit codes, files, resumed runs.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::root;
use serde_json::Value;
use signorini::records::PointRecord;
use signorini::store::StoredFamily;
use tempfile::TempDir;

const SCENE: &str = "scenarios/half-plate-orbit.toml";
const RESPONSE: &str = "scenarios/half-plate-response.toml";

fn signorini(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_signorini"))
        .current_dir(root())
        .args(arguments)
        .output()
        .unwrap()
}

fn json(arguments: &[&str], code: i32) -> Value {
    let output = signorini(&[arguments, &["--json", "-q"]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{text}\n{error}");
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn path(folder: &TempDir, name: &str) -> (PathBuf, String) {
    let path = folder.path().join(name);
    let text = path.display().to_string();
    (path, text)
}

#[test]
fn an_orbit_has_its_keys_and_starts_the_next() {
    let folder = TempDir::new().unwrap();
    let (file, name) = path(&folder, "orbit.h5");
    let orbit = json(&["orbit", SCENE, "-o", &name], 0);
    for key in [
        "period",
        "omega",
        "energy",
        "residual",
        "newton_iterations",
        "contact_time",
        "multipliers",
        "stable",
    ] {
        assert!(!orbit[key].is_null(), "{key}");
    }
    assert_eq!(orbit["converged"], true);
    assert_eq!(orbit["admissible"], true);
    assert!((orbit["energy"].as_f64().unwrap() - 1.04367).abs() < 1e-5);
    assert_eq!(orbit["switches"].as_array().unwrap().len(), 8);
    assert!(orbit["residual"].as_f64().unwrap() < 1e-11);
    // what an engineer asks of it is that of its file
    let stored: ndarray::Array2<f64> = crate::common::hdf5_files()
        .open(&file)
        .unwrap()
        .dataset("forces/contact/force")
        .unwrap()
        .read_2d()
        .unwrap();
    let most = stored.rows().into_iter().map(|f| f.dot(&f).sqrt()).fold(0.0, f64::max);
    let told = &orbit["forces"][0];
    assert_eq!(told["kind"], "contact");
    assert!((told["maximum"].as_f64().unwrap() / most - 1.0).abs() < 1e-12);
    assert!(orbit["largest_pressure"]["largest"].as_f64().unwrap() > 0.0);
    // the file is a run over one period, and an initial state
    assert!(signorini::store::read_stored_orbit(&file).unwrap().is_some());
    let text = std::fs::read_to_string(root().join(SCENE)).unwrap();
    let from_file = text
        .replace("mode = 1\namplitude = -1.1", "file = \"orbit.h5\"")
        .replace("omega = 1.80", "omega = 1.801");
    std::fs::write(folder.path().join("next.toml"), from_file).unwrap();
    let next = json(
        &[
            "orbit",
            &folder.path().join("next.toml").display().to_string(),
            "-o",
            &path(&folder, "next.h5").1,
        ],
        0,
    );
    assert!(next["converged"] == true);
    // and pictures of it
    let plots = json(&["plot", &name, "--only", "portrait,multipliers,shapes"], 0);
    assert_eq!(plots["written"].as_array().unwrap().len(), 9);
}

#[test]
fn a_fold_is_a_verdict_and_exit_code_3() {
    let folder = TempDir::new().unwrap();
    // the eight-switch orbit just below the fold, then a frequency above it
    let found = json(&["orbit", SCENE, "--omega", "1.8695", "--all", "--amplitudes", "12"], 0);
    let orbits = found["orbits"].as_array().unwrap();
    let eight = orbits.iter().find(|o| {
        o["switches"].as_array().unwrap().len() == 8
            && (o["energy"].as_f64().unwrap() - 1.81).abs() < 0.01
    });
    assert!(eight.is_some() && orbits.len() >= 4, "{} orbits", orbits.len());
    let fold = json(
        &[
            "orbit",
            SCENE,
            "--omega",
            "1.87",
            "--amplitude",
            "-1.5",
            "-o",
            &path(&folder, "fold.h5").1,
        ],
        3,
    );
    assert_eq!(fold["verdict"], "fold");
    assert!((fold["fold"]["omega"].as_f64().unwrap() - 1.869_976_7).abs() < 1e-6, "{fold}");
    assert!(fold["fold"]["singular_value"].as_f64().unwrap() < 1e-8);
    let u0: Vec<f64> =
        eight.unwrap()["u0"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert_eq!(u0.len(), 66);
    let result = json(&["orbit", SCENE, "--omega", "2.3", "-o", &path(&folder, "none.h5").1], 3);
    assert_eq!(result["converged"], false);
    assert!(!result["verdict"].as_str().unwrap().is_empty());
    assert!(!folder.path().join("none.h5").exists());
}

fn points(file: &Path) -> Vec<signorini::records::PointRecord> {
    StoredFamily::read(file).unwrap().points
}

/// Killed in the middle, then gone on with: the same file as without the interruption.
#[test]
fn a_killed_backbone_resumes_to_the_identical_branch() {
    let folder = TempDir::new().unwrap();
    for follow in ["arclength", "sequential"] {
        let (whole, whole_name) = path(&folder, &format!("{follow}-whole.h5"));
        let (cut, cut_name) = path(&folder, &format!("{follow}-cut.h5"));
        let range = if follow == "sequential" { "1.78,1.84" } else { "1.7,1.9" };
        let base = ["backbone", SCENE, "--follow", follow, "--range", range, "--points", "60"];
        let json_whole = json(&[&base[..], &["-o", &whole_name]].concat(), 0);
        assert!(json_whole["points"].as_array().unwrap().len() >= 12);
        let mut child = Command::new(env!("CARGO_BIN_EXE_signorini"))
            .current_dir(root())
            .args([&base[..], &["-o", &cut_name, "-q"]].concat())
            .spawn()
            .unwrap();
        // as soon as a few points are on disk
        let journal = PathBuf::from(format!("{cut_name}.journal"));
        crate::common::wait_until("six lines in the journal", || {
            // a branch that is whole has no journal any more
            child.try_wait().unwrap().is_some()
                || std::fs::read_to_string(&journal).is_ok_and(|text| text.lines().count() >= 6)
        });
        child.kill().unwrap();
        child.wait().unwrap();
        // the HDF5 file may have been hit in the middle of a write; the journal never is
        let before = StoredFamily::recover(&cut).unwrap().0.points.len();
        json(&[&base[..], &["-o", &cut_name, "--resume"]].concat(), 0);
        assert!(before >= 4, "{before}");
        let (a, b) = (points(&whole), points(&cut));
        println!("{follow}: {before} of {} points before the kill", a.len());
        for branch in 0..2 {
            let of =
                |list: &[signorini::records::PointRecord]| -> Vec<signorini::records::PointRecord> {
                    list.iter().filter(|p| p.branch == branch).cloned().collect()
                };
            let (a, b) = (of(&a), of(&b));
            assert_eq!(a.len(), b.len(), "{follow}, branch {branch}");
            for (a, b) in a.iter().zip(&b) {
                assert_eq!((a.omega, &a.special), (b.omega, &b.special));
                assert_eq!(
                    a.orbit.as_ref().map(|o| (&o.u0, o.energy)),
                    b.orbit.as_ref().map(|o| (&o.u0, o.energy))
                );
            }
        }
        // another scene or other options are refused
        let other = ["backbone", SCENE, "--follow", "natural", "-o", &cut_name, "--resume"];
        let refused = json(&other, 2);
        assert!(refused["error"].as_str().unwrap().contains("other options"), "{refused}");
    }
}

#[test]
fn harmonic_balance_is_cross_checked() {
    let folder = TempDir::new().unwrap();
    let (file, name) = path(&folder, "hbm.h5");
    let range = ["--range", "1.74,1.80"];
    let hbm = json(
        &[&["backbone", SCENE, "--method", "hbm", "--harmonics", "3,7", "-o", &name], &range[..]]
            .concat(),
        0,
    );
    assert_eq!(hbm["branches"].as_array().unwrap().len(), 2);
    let stored = points(&file);
    assert!(stored.iter().filter(|p| p.series.is_some()).count() >= 20);
    shooting_gives_the_stability_of_the_orbit_alone(&folder, &stored);
    let (checked, checked_name) = path(&folder, "checked.h5");
    let result = json(&["crosscheck", &name, SCENE, "-o", &checked_name], 0);
    let summary = result["summary"].as_array().unwrap();
    assert_eq!(summary.len(), 2);
    assert!(
        summary
            .iter()
            .all(|s| s["points"].as_u64().unwrap() >= 10 && s["another_orbit"].as_u64() >= Some(1)),
        "{summary:?}"
    );
    let all = result["points"].as_array().unwrap();
    for p in all {
        let is_near = p["same_sequence"] == true && p["moved"].as_f64().unwrap() <= 0.1;
        assert_eq!(p["verdict"] == "orbit", is_near, "{p}");
        assert_eq!(p["verdict"] == "another orbit", !is_near && !p["moved"].is_null(), "{p}");
    }
    assert!(all.iter().all(|p| !p["message"].as_str().unwrap().is_empty()));
    let rows = signorini::store::read_crosscheck(&checked).unwrap().unwrap();
    assert_eq!(rows.len(), result["points"].as_array().unwrap().len());
    json(&["plot", &checked_name], 0);
    // resumed with nothing left to do
    json(
        &[
            &["backbone", SCENE, "--method", "hbm", "--harmonics", "3,7", "-o", &name, "--resume"],
            &range[..],
        ]
        .concat(),
        0,
    );
    assert_eq!(points(&file).len(), stored.len());
}

/// `--shoot`: multipliers where the cross-check of the same series says `orbit`, and only there.
fn shooting_gives_the_stability_of_the_orbit_alone(folder: &TempDir, plain: &[PointRecord]) {
    let (shot, name) = path(folder, "shot.h5");
    let wide = ["--range", "1.74,1.80", "--harmonics", "3,7,31", "--shoot"];
    json(&[&["backbone", SCENE, "--method", "hbm", "-o", &name], &wide[..]].concat(), 0);
    let checked = json(&["crosscheck", &name, SCENE, "-o", &path(folder, "all.h5").1], 0);
    let rows = checked["points"].as_array().unwrap();
    let (mut counts, mut along) = ([0, 0], 0);
    let shot = points(&shot);
    for p in shot.iter().filter(|p| p.orbit.is_some()) {
        let n_h = p.series.as_ref().unwrap().n_h;
        let same = |r: &&Value| {
            r["harmonics"] == n_h && (r["omega"].as_f64().unwrap() - p.omega).abs() < 1e-12
        };
        let verdict = &rows.iter().find(same).unwrap()["verdict"];
        let orbit = p.orbit.as_ref().unwrap();
        let known = !orbit.multipliers.is_empty() && orbit.multipliers_within.is_none();
        assert_eq!(known, *verdict == "orbit", "{} {n_h}: {verdict}, {}", p.omega, p.special);
        if *verdict == "another orbit" && p.special.word() != "jump" && p.special.word() != "start"
        {
            assert_eq!(p.special.to_string(), "no orbit near: another orbit");
        }
        // no orbit near: along the series, in reciprocal pairs; of no motion no stability is told
        if let Some(error) = orbit.multipliers_within {
            assert!(orbit.no_orbit_near && error > 0.0 && orbit.stable.is_none(), "{}", p.special);
            for m in &orbit.multipliers {
                let size = m[0] * m[0] + m[1] * m[1];
                let far = |v: &[f64; 2]| (v[0] - m[0] / size).hypot(v[1] + m[1] / size);
                let nearest = orbit.multipliers.iter().map(far).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-6 * (1.0 + 1.0 / size), "{} {m:?}: {nearest:e}", p.omega);
            }
            along += 1;
        }
        assert_eq!(known, !orbit.no_orbit_near, "{} {}", p.omega, p.special);
        counts[usize::from(known)] += 1;
    }
    assert!(along > 10, "{along}");
    println!("{counts:?}");
    assert!(counts[0] > 5 && counts[1] > 5, "{counts:?}");
    assert!(plain.iter().filter_map(|p| p.orbit.as_ref()).all(|o| o.stable.is_none()));
}

#[test]
fn a_response_has_a_branch_for_each_ratio() {
    let folder = TempDir::new().unwrap();
    let (file, name) = path(&folder, "response.h5");
    json(&["response", RESPONSE, "--ratios", "0.05", "--range", "1.6,1.85", "-o", &name], 0);
    let peak = points(&file)
        .iter()
        .filter_map(|p| p.orbit.as_ref().map(|o| (o.amplitude, p.omega)))
        .fold((0.0, 0.0), |m, p| if p.0 > m.0 { p } else { m });
    println!("5 %: peak at {}", peak.1);
    assert!((peak.1 - 1.751).abs() < 0.01);
    let conservative = json(&["response", SCENE, "-o", &path(&folder, "no.h5").1], 2);
    assert!(conservative["error"].as_str().unwrap().contains("harmonic load"));
}

/// Results of other programs, and matrices in place of a mesh.
#[test]
fn foreign_results_and_foreign_matrices() {
    let folder = TempDir::new().unwrap();
    let run = |results: &[&str], scene: &str, out: &str| {
        json(
            &[&["crosscheck"], results, &[scene, "--quick", "-o", &path(&folder, out).1]].concat(),
            0,
        )
    };
    let csv = run(&["validate/foreign/half-plate.csv"], SCENE, "a.h5");
    let mat = run(
        &["validate/foreign/half-plate.mat", "--omega", "w", "--coefficients", "Q"],
        SCENE,
        "b.h5",
    );
    let matrices =
        run(&["validate/foreign/half-plate.csv"], "validate/foreign/half-plate.toml", "c.h5");
    let (a, b, c) = (&csv["points"], &mat["points"], &matrices["points"]);
    assert!(a.as_array().unwrap().len() >= 5);
    for (k, p) in a.as_array().unwrap().iter().enumerate() {
        for other in [&b[k], &c[k]] {
            let (x, y) = (p["hbm_energy"].as_f64().unwrap(), other["hbm_energy"].as_f64().unwrap());
            assert!((x / y - 1.0).abs() < 1e-9, "{x} {y}");
            assert_eq!(p["verdict"], other["verdict"]);
        }
    }
    let wrong = signorini(&[
        "crosscheck",
        "validate/foreign/half-plate.mat",
        SCENE,
        "-o",
        &path(&folder, "d.h5").1,
    ]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("--coefficients"));
}

/// Forced series of two rods by another program, which knows the pair by its own means: with more harmonics they come to the orbits that are shot from them.
#[test]
fn foreign_series_of_two_rods_come_to_orbits() {
    let folder = TempDir::new().unwrap();
    let [csv, scene] = ["csv", "toml"].map(|end| format!("validate/foreign/two-rods.{end}"));
    let said = json(&["crosscheck", &csv, &scene, "-o", &path(&folder, "rods.h5").1], 0);
    let mut seen = 0;
    for p in said["points"].as_array().unwrap() {
        assert_eq!(
            (p["verdict"].as_str(), p["same_sequence"].as_bool()),
            (Some("orbit"), Some(true))
        );
        let within = if p["harmonics"] == 15 { 0.015 } else { 2e-4 };
        let moved = p["moved"].as_f64().unwrap();
        assert!(moved < within, "{p}");
        seen += 1;
    }
    assert_eq!(seen, 12);
}

/// A CSV whose columns are not what they should be is refused with its line; a point that is no motion does not take the others with it.
#[test]
fn foreign_csv_is_read_with_care() {
    let folder = TempDir::new().unwrap();
    let scene = root().join("validate/bar-orbits/scene.toml").display().to_string();
    let zeros = vec!["0"; 19].join(",");
    let header = format!(
        "point,omega,k,part,{}",
        (1..=19).map(|i| format!("u_{i}")).collect::<Vec<_>>().join(",")
    );
    let ramp: Vec<String> = (1..=19).map(|i| (-2.2 * f64::from(i) / 20.0).to_string()).collect();
    let good = format!("1,1.7952,1,cos,{}", ramp.join(","));
    let mean = format!("1,1.7952,0,cos,{zeros}");
    let write = |name: &str, lines: &[&str]| {
        let (file, text) = path(&folder, name);
        std::fs::write(file, lines.join("\n")).unwrap();
        text
    };
    for (lines, words) in [
        (vec![good.as_str(), good.as_str()], "header"),
        (vec![&header, &good, &good], "twice"),
        (vec![&header, &good, &good.replace("1,1.7952,1,cos", "1,1.8,2,cos")], "omega"),
        (vec![&header, &good.replace(",1,cos", ",1000000,cos")], "harmonics"),
        (vec![&header, "1,1.7952,1,cos,0"], "displacements"),
        // rows that are missing
        (vec![&header, &good], "no row k = 0, cos"),
        (vec![&header, &mean, &good.replace("cos", "sin")], "no row k = 1, cos"),
        (
            vec![
                &header,
                &mean,
                &good,
                &good.replace(",1,cos", ",2,cos"),
                &good.replace("cos", "sin"),
            ],
            "no row k = 2, sin",
        ),
    ] {
        let file = write("bad.csv", &lines);
        let output = signorini(&["crosscheck", &file, &scene, "-o", &path(&folder, "bad.h5").1]);
        assert_eq!(output.status.code(), Some(2), "{lines:?}");
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(error.contains(words), "{error}");
    }
    let rest = format!("2,1.7952,0,cos,{zeros}");
    let file = write("mixed.csv", &[&header, &mean, &good, &rest]);
    let result = json(&["crosscheck", &file, &scene, "-o", &path(&folder, "mixed.h5").1], 0);
    assert_eq!(result["points"].as_array().unwrap().len(), 2);
    // the same in another order, as a spreadsheet of another country writes it: mark, semicolons, CRLF
    let semicolons = |line: &str| line.replace(',', ";") + "\r";
    let file = write(
        "excel.csv",
        &[
            &format!("\u{feff}{}", semicolons(&header)),
            &semicolons(&good),
            &semicolons(&rest),
            &semicolons(&mean),
        ],
    );
    let other = json(&["crosscheck", &file, &scene, "-o", &path(&folder, "excel.h5").1], 0);
    assert_eq!(result["points"], other["points"]);
}

#[test]
fn misuse_is_explained() {
    for (arguments, words) in [
        (&["orbit", "scenarios/bar.toml"][..], "omega"),
        (&["backbone", "scenarios/oscillator.toml"], "range"),
        (&["orbit", SCENE, "--omega=-1"], "positive"),
        (&["backbone", SCENE, "--range", "2.0,1.0"], "lower one first"),
        (&["backbone", SCENE, "--method", "hbm", "--harmonics", "0"], "from 1"),
        (&["response", RESPONSE, "--ratios", "0"], "damping ratio"),
        (&["backbone", SCENE, "--method", "hbm", "--aft", "2"], "samples"),
        (&["backbone", SCENE, "--step=1e-12"], "more than a million frequencies"),
        (&["backbone", SCENE, "--step=1e-12", "--follow", "arclength", "--omega", "1.8"], "1e-6"),
        (
            &["backbone", SCENE, "--step=1e300", "--follow", "arclength", "--omega", "1.8"],
            "from 1e-6 to 1",
        ),
        (&["backbone", SCENE, "--range", "-1,2"], "two frequencies"),
        (&["backbone", SCENE, "--range", "1e-9,1e-8"], "natural periods"),
        (&["orbit", SCENE, "--omega", "1e-300"], "natural periods"),
        (&["orbit", SCENE, "--all", "--largest=-4"], "--largest"),
        (&["backbone", SCENE, "--method", "hbm", "--aft", "1000000000000"], "1000000"),
        (
            &["response", RESPONSE, "--method", "hbm", "--range", "1,1e15", "--step", "1e-4"],
            "natural frequencies of the body are below",
        ),
        (&["response", RESPONSE, "--step=1e-12"], "1e-4"),
        (&["backbone", SCENE, "--follow", "arclength", "--omega", "1.5"], "outside of the range"),
        (&["orbit", SCENE, "--all", "-o", "nowhere.h5"], "writes no file"),
        (&["orbit", SCENE, "--amplitude", "nan"], "finite"),
        (&["backbone", SCENE, "--points", "0"], "from 1"),
        (&["backbone", SCENE, "--harmonics", "3"], "--method hbm"),
    ] {
        let output = signorini(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(error.contains(words), "{arguments:?}: {error}");
    }
}

/// Mass redistribution: harmonic balance has a point at nearly every frequency, and an orbit stands behind each one.
#[test]
fn harmonic_balance_of_redistributed_mass_leads_to_orbits() {
    let folder = TempDir::new().unwrap();
    let scene = "scenarios/half-plate-redistribution.toml";
    let (series, checked) = (path(&folder, "hbm.h5").1, path(&folder, "checked.h5").1);
    let range = ["--range", "1.60,2.05", "--step", "0.01"];
    let hbm = ["backbone", scene, "--method", "hbm", "--harmonics", "7,15", "-o", &series];
    signorini(&[&hbm[..], &range[..]].concat());
    let result = json(&["crosscheck", &series, scene, "-o", &checked], 0);
    let points = result["points"].as_array().unwrap();
    for n_h in [7, 15] {
        let of: Vec<&Value> = points.iter().filter(|p| p["harmonics"] == n_h).collect();
        let count = |verdict: &str| of.iter().filter(|p| p["verdict"] == verdict).count();
        let (own, other) = (count("orbit"), count("another orbit"));
        println!(
            "N_h = {n_h}: {own} approximate an orbit, {other} lead to another, of {}",
            of.len()
        );
        let most = if n_h == 15 { of.len() / 2 } else { of.len() / 5 };
        assert!(of.len() >= 42 && own + other == of.len() && own > most, "{n_h}: {own}, {other}");
    }
}

/// A forced response of redistributed mass goes through first contact, folds and swaps of switches to the end of its range.
#[test]
fn a_response_of_redistributed_mass_passes_its_contacts() {
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(root().join(RESPONSE)).unwrap();
    let text = text.replace("[contact]\n", "[contact]\nmethod = \"mass-redistribution\"\n");
    let (file, scene) = path(&folder, "scene.toml");
    std::fs::write(file, text).unwrap();
    let (stored, output) = path(&folder, "response.h5");
    json(&["response", &scene, "--ratios", "0.02", "-o", &output], 0);
    let family = StoredFamily::read(&stored).unwrap();
    let orbits: Vec<_> = family.points.iter().filter_map(|p| p.orbit.as_ref()).collect();
    assert!(orbits.len() > 100, "{}", orbits.len());
    assert!(orbits.iter().all(|o| o.residual < 1e-10 && o.penetration < 1e-9 && o.tension < 1e-9));
    assert!(orbits.iter().any(|o| o.switches.len() >= 8 && o.stable == Some(false)));
    let (first, last) = (&family.points[0], &family.points[family.points.len() - 1]);
    assert!(first.orbit.as_ref().is_some_and(|o| o.switches.is_empty()));
    assert!(last.orbit.as_ref().is_some_and(|o| o.switches.is_empty()) && last.omega > first.omega);
}

#[test]
fn what_a_user_should_know_is_said() {
    let folder = TempDir::new().unwrap();
    let (_, orbit) = path(&folder, "o.h5");
    json(&["orbit", SCENE, "--omega", "1.8", "-o", &orbit], 0);
    // a file of ours, of another kind
    let output = signorini(&["crosscheck", &orbit, SCENE]);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2));
    assert!(error.contains("of an orbit") && !error.contains("--coefficients"), "{error}");
    // frequencies below the first mode, 1.5829
    let (_, low) = path(&folder, "low.h5");
    let range = ["--range", "1.56,1.7", "--step", "0.07"];
    let output = signorini(&[&["backbone", SCENE, "-o", &low][..], &range].concat());
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(error.contains("lowest natural frequency 1.5829"), "{error}");
    let (_, high) = path(&folder, "high.h5");
    let range = ["--range", "1.6,1.7", "--step", "0.05"];
    let output = signorini(&[&["backbone", SCENE, "-o", &high][..], &range].concat());
    assert!(!String::from_utf8_lossy(&output.stderr).contains("natural frequency"));
    // which viscosity, and what it does
    let (_, viscous) = path(&folder, "viscous.h5");
    let beta = ["--viscous", "--quick", "--beta", "0.05"];
    let words = [&["backbone", SCENE, "-o", &viscous][..], &beta, &range].concat();
    let output = signorini(&words);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("beta = 0.05"), "{said}");
    assert!(said.contains("WARNING: more than 50 %"), "{said}");
    let energy = |file: &str| -> String {
        let file = crate::common::hdf5_files().open(file).unwrap();
        let text = file.dataset("backbone/energy").unwrap().attr("description").unwrap();
        text.read_scalar::<hdf5::types::VarLenUnicode>().unwrap().to_string()
    };
    assert!(energy(&viscous).contains("at t = 0") && energy(&high).contains("largest"));
}

/// What a search and a run took is counted: a derivative a Newton step and those of the multipliers, rows of all products and right-hand sides.
#[test]
fn what_it_took_is_counted() {
    let folder = TempDir::new().unwrap();
    let said = json(&["orbit", SCENE, "-o", &path(&folder, "orbit.h5").1], 0);
    let spent = &said["spent"];
    let steps = said["newton_iterations"].as_u64().unwrap();
    let of = |name: &str| spent[name].as_u64().unwrap();
    assert!(steps > 0 && of("derivatives") >= steps, "{spent}");
    assert!(of("motions") > steps, "{spent}");
    let text = std::fs::read_to_string(root().join("scenarios/plate.toml")).unwrap();
    for integrator in ["dop853", "chebyshev"] {
        let (file, name) = path(&folder, &format!("{integrator}.toml"));
        let text = text.replace("\"dop853\"", &format!("\"{integrator}\""));
        std::fs::write(file, text).unwrap();
        let said = json(&["run", &name, "-o", &path(&folder, &format!("{integrator}.h5")).1], 0);
        let of = |name: &str| said[name].as_u64().unwrap();
        let products = of("products") + of("rhs_evaluations");
        assert!(products > 0);
        assert_eq!(of("rows"), products * of("n_o"), "{integrator}");
    }
}

/// Two masses before a stop: the first family ends where its amplitude goes beyond all bounds, and what lies behind is another one, found anew. Energies are those of harmonic
/// balance; a family that was interrupted behind its end goes on as if it had not been.
#[test]
fn behind_the_end_of_a_family_another_one_is_found() {
    let folder = TempDir::new().unwrap();
    for (name, entries) in [("M", [1.0, 0.0, 0.0, 1.0]), ("K", [1.0, -1.0, -1.0, 2.0])] {
        let lines = entries.map(|x: f64| format!("{x:?}\n")).concat();
        let text = format!("%%MatrixMarket matrix array real general\n2 2\n{lines}");
        std::fs::write(folder.path().join(format!("{name}.mtx")), text).unwrap();
    }
    let (file, scene) = path(&folder, "a.toml");
    let text = "[body]\nkind = 'matrices'\nmass_matrix = 'M.mtx'\nstiffness_matrix = 'K.mtx'\n\
                [contact]\ndisplacements = [0]\ngap = 1.0\nmethod = 'penalty'\nstiffness = 10.0\n";
    std::fs::write(file, text).unwrap();
    let family = |name: &str, more: &[&str]| -> Vec<PointRecord> {
        let (file, out) = path(&folder, name);
        let own = ["backbone", &scene, "--range", "0.78,0.9", "--step", "0.01", "-o", &out];
        json(&[&own[..], more].concat(), 0);
        StoredFamily::read(&file).unwrap().points
    };
    let shot = family("shot.h5", &[]);
    let series = family("series.h5", &["--method", "hbm", "--harmonics", "63"]);
    let found = |p: &&PointRecord| p.orbit.is_some();
    // the family of the first mode has the frequency 0.8137 in the limit of large amplitudes
    let gaps = shot.iter().filter(|p| !found(p)).count();
    assert!((1..=4).contains(&gaps), "{gaps}");
    let behind: Vec<&PointRecord> = shot.iter().filter(found).filter(|p| p.omega > 0.82).collect();
    assert!(behind.len() >= 5, "{}", behind.len());
    for p in behind {
        let same = series.iter().find(|s| (s.omega - p.omega).abs() < 1e-9).unwrap();
        let [own, other] = [p, same].map(|p| p.orbit.as_ref().unwrap().energy);
        assert!((own / other - 1.0).abs() < 1e-4, "{}: {own} {other}", p.omega);
    }
    // in two parts
    let (file, out) = path(&folder, "parts.h5");
    let own = ["backbone", &scene, "--step", "0.01", "-o", &out, "--range"];
    json(&[&own[..], &["0.78,0.84"]].concat(), 0);
    json(&[&own[..], &["0.78,0.9", "--resume"]].concat(), 0);
    let parts = StoredFamily::read(&file).unwrap().points;
    let energies = |all: &[PointRecord]| -> Vec<Option<f64>> {
        all.iter().map(|p| p.orbit.as_ref().map(|o| o.energy)).collect()
    };
    assert_eq!(energies(&parts), energies(&shot));
}
