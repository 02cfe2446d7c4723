//! The viscous nonlinear mode on the command line: what it prints, what it keeps, what it refuses; reduced bodies.

use std::path::Path;

use crate::common::{datasets, hdf5_files, json, refused, run};
use serde_json::Value;
use signorini::records::{Changed, PointMethod};
use signorini::store::StoredFamily;
use tempfile::TempDir;

const PLATE: &str = "[body]\nkind = \"plate\"\nsize = [1.0, 0.3]\nelements = [12, 4]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
    [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[[support]]\nedge = \"bottom\"\nfix = [\"y\"]\n\
    [contact]\nedge = \"right\"\ngap = 1.0\n";

struct Folder(TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    fn scene(&self, name: &str, text: &str) -> String {
        std::fs::write(self.at(name), text).unwrap();
        self.at(name)
    }
}

#[test]
fn an_orbit_says_what_it_is() {
    let folder = Folder::new();
    let scene = folder.scene("a.toml", &format!("{PLATE}[orbit]\nbeta = 0.03\nomega = 1.8\n"));
    let file = folder.at("a.h5");
    let orbit = json(&["orbit", &scene, "--viscous", "-o", &file]);
    let number = |key: &str| orbit[key].as_f64().unwrap_or(f64::NAN);
    assert_eq!(number("beta"), 0.03);
    assert_eq!(number("energy"), number("energy_start"));
    assert!(number("alpha") > 0.0 && number("energy_turned_over") > 0.0);
    assert_eq!(orbit["trivial_multipliers"], 1);
    assert!(number("largest_multiplier_under_load") < 1.0);
    // the file keeps it
    let stored = hdf5_files().open(&file).unwrap().group("orbit").unwrap();
    let attribute = |name: &str| stored.attr(name).unwrap().read_scalar::<f64>().unwrap();
    assert_eq!(attribute("alpha"), number("alpha"));
    assert_eq!(attribute("energy_turned_over"), number("energy_turned_over"));
    assert!(stored.dataset("multipliers_under_load").unwrap().shape()[0] > 0);
    // the energy that is handed round is what the viscosity takes: the dissipation of the period, feedback apart
    let text = run(&["orbit", &scene, "--viscous", "-o", &file, "--force"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    for words in ["kept going by -alpha M", "self-excited", "conservative limit is not claimed"] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

/// Three elements before a soft obstacle: no state of the linear mode, nor a path of viscosities, leads to the orbit; its series does. It is the one that harmonic
/// balance comes to with more and more harmonics.
#[test]
fn a_series_leads_to_orbits_that_shooting_does_not_find() {
    let folder = Folder::new();
    let scene = folder.scene(
        "a.toml",
        "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [3]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x']\n\
         [contact]\nedge = 'right'\ngap = 1.0\nmethod = 'penalty'\nstiffness = 2.0\n[orbit]\nomega = 1.6\n",
    );
    let orbit = json(&["orbit", &scene, "--viscous", "-o", &folder.at("a.h5")]);
    let (energy, alpha) = (orbit["energy"].as_f64().unwrap(), orbit["alpha"].as_f64().unwrap());
    let near = ["--range", "1.6,1.605", "--step", "0.01"];
    let balance = ["backbone", &scene, "--viscous", "--method", "hbm", "--harmonics", "63"];
    let file = folder.at("b.h5");
    json(&[&balance[..], &near, &["-o", &file]].concat());
    let series = StoredFamily::read(Path::new(&file)).unwrap();
    let there = series.points[0].orbit.as_ref().unwrap();
    assert!((there.energy / energy - 1.0).abs() < 1e-4, "{} {energy}", there.energy);
    let fed = there.viscous.as_ref().unwrap().alpha;
    assert!((fed / alpha - 1.0).abs() < 1e-3, "{fed} {alpha}");
    // on a grid, and along the branch
    let files = [folder.at("c.h5"), folder.at("d.h5")];
    let grid = ["backbone", &scene, "--viscous", "--quick"];
    json(&[&grid[..], &near, &["-o", &files[0]]].concat());
    let along = ["--follow", "arclength", "--range", "1.59,1.61", "--points", "3"];
    json(&[&grid[..], &along, &["-o", &files[1]]].concat());
    for file in files {
        let family = StoredFamily::read(Path::new(&file)).unwrap();
        let first = family.points.iter().find(|p| p.omega == 1.6).unwrap();
        let there = first.orbit.as_ref().unwrap().energy;
        assert!((there / energy - 1.0).abs() < 1e-9, "{there} {energy}");
    }
}

/// Between two stops pressures on both sides cancel for every mode that bends: it is pinned to the first all the same.
#[test]
fn a_beam_between_two_stops_is_pinned_to_its_first_mode() {
    let folder = Folder::new();
    let scene = folder.scene(
        "a.toml",
        "[body]\nkind = 'plate'\nsize = [1.0, 0.1]\nelements = [10, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[contact]]\nedge = 'top'\nfrom = [0.85, 1.0]\ngap = 0.01\n\
         [[contact]]\nedge = 'bottom'\nfrom = [0.85, 1.0]\ngap = 0.01\n[orbit]\nomega = 0.12\n",
    );
    let modes = json(&["modes", &scene]);
    let first = modes["open"]["omega"][0].as_f64().unwrap();
    let omega = format!("{}", 1.06 * first);
    let file = folder.at("a.h5");
    let orbit = json(&["orbit", &scene, "--viscous", "--omega", &omega, "-o", &file]);
    // both stops are met, one after the other
    assert!(orbit["switches"].as_array().unwrap().len() >= 4, "{orbit}");
    let file = folder.at("b.h5");
    let range = format!("{omega},{}", 1.0601 * first);
    json(&["backbone", &scene, "--viscous", "--quick", "--range", &range, "-o", &file]);
    let family = StoredFamily::read(Path::new(&file)).unwrap();
    assert!(matches!(family.identity.method, PointMethod::Viscous { mode: 1, .. }));
}

#[test]
fn beta_is_what_the_mesh_resolves() {
    let folder = Folder::new();
    let scene = folder.scene("a.toml", &format!("{PLATE}[orbit]\nbeta = \"auto\"\n"));
    let orbit = json(&["orbit", &scene, "--viscous", "--omega", "1.7", "-o", &folder.at("a.h5")]);
    // (L/c)/min(10, n/2)², L/c a quarter period of the mode, n elements over it at the speed of pressure waves
    let first = json(&["modes", &scene])["open"]["omega"][0].as_f64().unwrap();
    let time = std::f64::consts::FRAC_PI_2 / first;
    let n = time * (1.0f64 / (1.0 - 0.09)).sqrt() * 12.0;
    let beta = time / (0.5 * n).min(10.0).powi(2);
    assert!((orbit["beta"].as_f64().unwrap() / beta - 1.0).abs() < 1e-12);
    let warned = run(&[
        "orbit",
        &scene,
        "--viscous",
        "--omega",
        "1.7",
        "--beta",
        "0.004",
        "-o",
        &folder.at("b.h5"),
    ]);
    let text = String::from_utf8_lossy(&warned.stderr).into_owned();
    assert!(text.contains("WARNING: beta = 0.004000 asks for fronts"), "{text}");
}

/// Of two bodies: coarser meshes of both, and the inertia of one side alone, whose number is that of another program.
#[test]
fn a_family_of_two_bodies_says_how_far_off_it_may_be() {
    let folder = Folder::new();
    let half = |name: &str, length: f64, elements: [usize; 2], far: &str, place: &str| {
        format!(
            "[[body]]\nname = '{name}'\nkind = 'plate'\nsize = [{length}, 0.3]\nelements = {elements:?}\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n{place}\n\
             [[support]]\nedge = '{name}:{far}'\nfix = ['x', 'y']\n[[support]]\nedge = '{name}:bottom'\nfix = ['y']\n"
        )
    };
    let text = |a, b, sides: &str| {
        half("a", 1.0, a, "left", "")
            + &half("b", 0.8, b, "right", "move = [2.0, 0.0]")
            + &format!(
                "[[contact]]\nslave = 'a:right'\nmaster = 'b:left'\ngap = 1.0\nsides = '{sides}'\n[orbit]\nbeta = 0.01\nomega = 1.65\n"
            )
    };
    let scene = folder.scene("a.toml", &text([10, 3], [8, 4], "both"));
    let file = folder.at("a.h5");
    let range = ["--range", "1.65,1.66", "--step", "0.01"];
    json(&[&["backbone", &scene, "--viscous", "-o", &file][..], &range].concat());
    let kept = StoredFamily::read(Path::new(&file)).unwrap().statement.unwrap();
    let at = kept.omega.iter().position(|w| (w - 1.65).abs() < 1e-9).unwrap();
    let of = |changed| kept.of(changed).unwrap();
    assert_eq!(of(Changed::HalfMesh).text, "mesh of 5x2+4x2 elements");
    assert_eq!(of(Changed::OtherContact).text, "sides = \"slave\"");
    assert!((kept.energy[at] - 0.7035221699).abs() < 1e-8, "{}", kept.energy[at]);
    let slave = of(Changed::OtherContact).energy[at];
    assert!((slave - 0.7574134974).abs() < 1e-8, "{slave}");
    let coarse = folder.scene("b.toml", &text([5, 2], [4, 2], "both"));
    let orbit = json(&["orbit", &coarse, "--viscous", "-o", &folder.at("b.h5")]);
    let half = of(Changed::HalfMesh).energy[at];
    assert!((orbit["energy"].as_f64().unwrap() / half - 1.0).abs() < 1e-9, "{half}");
}

#[test]
fn a_family_says_how_far_off_it_may_be() {
    let folder = Folder::new();
    let scene =
        folder.scene("a.toml", &format!("{PLATE}[orbit]\nbeta = 0.03\nrange = [1.62, 1.74]\n"));
    let (file, quick) = (folder.at("a.h5"), folder.at("quick.h5"));
    let family = json(&["backbone", &scene, "--viscous", "--step", "0.02", "-o", &file]);
    let statement = &family["error_statement"];
    let names: Vec<&str> = statement["variations"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v["changed"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["half_viscosity", "half_mesh", "quarter_mesh", "other_contact"]);
    let stored = StoredFamily::read(Path::new(&file)).unwrap();
    let kept = stored.statement.unwrap();
    assert_eq!(kept.omega.len(), 5);
    // the other contact on the same mesh is the family of that scene, at the same viscosity
    let other = PLATE.replace("gap = 1.0\n", "gap = 1.0\nmethod = \"mass-redistribution\"\n");
    let other = folder.scene("b.toml", &format!("{other}[orbit]\nbeta = 0.03\n"));
    let omega = kept.omega[2];
    let orbit = json(&[
        "orbit",
        &other,
        "--viscous",
        "--omega",
        &omega.to_string(),
        "-o",
        &folder.at("b.h5"),
    ]);
    let expected = kept.of(Changed::OtherContact).unwrap().energy[2];
    assert!((orbit["energy"].as_f64().unwrap() / expected - 1.0).abs() < 1e-9);
    // a half family gone on with, and the same family at once
    let left = ["backbone", &scene, "--viscous", "--quick", "--step", "0.02", "-o", &quick];
    let narrow = [&left[..], &["--range", "1.62,1.68"]].concat();
    assert_eq!(json(&narrow)["points"].as_array().unwrap().len(), 4);
    let wide = json(&[&left[..], &["--resume"]].concat());
    assert_eq!(wide["points"].as_array().unwrap().len(), 7);
    assert!(wide.get("error_statement").is_none());
    let (whole, resumed) = (datasets(Path::new(&file)), datasets(Path::new(&quick)));
    for (name, bytes) in &resumed {
        assert!(whole.get(name) == Some(bytes), "{name} differs");
    }
    // the statement is computed when it is asked for
    let late = json(&["backbone", &scene, "--viscous", "--step", "0.02", "-o", &quick, "--resume"]);
    assert_eq!(late["error_statement"], *statement);
}

#[test]
fn what_has_no_viscous_mode_is_refused() {
    let folder = Folder::new();
    let with = |more: &str| {
        folder.scene("a.toml", &format!("{PLATE}[orbit]\nomega = 1.8\nrange = [1.7, 1.8]\n{more}"))
    };
    let out = folder.at("a.h5");
    let orbit = |scene: &str| ["orbit", scene, "--viscous", "-o", &out].map(String::from);
    let check = |more: &str, words: &str| {
        let scene = with(more);
        let arguments = orbit(&scene);
        refused(&arguments.iter().map(String::as_str).collect::<Vec<_>>(), words);
    };
    check("[damping]\nratio = 0.01\nmode = 1\n", "no other damping");
    check(
        "[[load]]\nkind = \"mode\"\nmode = 1\namplitude = 0.1\nomega = 1.8\n",
        "own feedback keeps it going",
    );
    check("[reduction]\nmodes = 3\ncutoff = 4.0\n", "exactly one of modes, cutoff");
    let scene = with("");
    refused(&["orbit", &scene, "--viscous", "--beta", "-1", "-o", &out], "give a positive time");
    refused(&["orbit", &scene, "--beta", "0.1", "-o", &out], "--viscous");
    refused(&["orbit", &scene, "--viscous", "--all"], "does not go with --viscous");
    let balance = ["backbone", &scene, "--viscous", "--method", "hbm", "-o", &out];
    refused(&[&balance[..], &["--form", "acceleration"]].concat(), "leave --form out");
    let near = ["--method", "hbm", "--conservative-from", &scene];
    refused(&[&["backbone", &scene, "-o", &out], &near[..]].concat(), "a.toml");
    refused(&["backbone", &scene, "--conservative-from", &scene, "-o", &out], "a.toml");
    let beta = PLATE.to_owned() + "[orbit]\nbeta = \"large\"\n";
    refused(&["orbit", &folder.scene("b.toml", &beta), "--viscous", "-o", &out], "\"auto\"");
}

#[test]
fn conservative_orbits_are_looked_for_near_viscous_ones() {
    let folder = Folder::new();
    let scene =
        folder.scene("a.toml", &format!("{PLATE}[orbit]\nbeta = 0.01\nrange = [1.6, 1.8]\n"));
    let (viscous, near) = (folder.at("v.h5"), folder.at("c.h5"));
    json(&["backbone", &scene, "--viscous", "--quick", "--step", "0.02", "-o", &viscous]);
    let found = json(&["backbone", &scene, "--conservative-from", &viscous, "-o", &near]);
    let points = found["points"].as_array().unwrap();
    assert_eq!(points.len(), 11);
    let mut counts = [0; 2];
    for p in points {
        match p["converged"].as_bool().unwrap() {
            true => {
                counts[0] += 1;
                assert!(p["residual"].as_f64().unwrap() < 1e-9 && p["alpha"].is_null());
            }
            false => {
                counts[1] += 1;
                let special = p["special"].as_str().unwrap();
                assert!(special.starts_with("gap: none near: smallest defect"), "{special}");
            }
        }
    }
    assert!(counts[0] > 0 && counts[1] > 0, "{counts:?}");
}

/// Reduced bodies: files and JSON hold the displacements of the mesh, and with all modes kept nothing changes.
#[test]
fn a_reduced_body_is_told_on_its_mesh() {
    let folder = Folder::new();
    let more = "[initial]\nmode = 1\namplitude = -1.3\n[run]\nuntil = 3.0\nintegrator = \"modal\"\nsamples = 20\n";
    let full = folder.scene("full.toml", &format!("{PLATE}{more}"));
    let all = folder.scene("all.toml", &format!("{PLATE}{more}[reduction]\nmodes = 1000\n"));
    let some = folder.scene("some.toml", &format!("{PLATE}{more}[reduction]\nmodes = 30\n"));
    let read = |scene: &str, name: &str| {
        let file = folder.at(name);
        let summary = json(&["run", scene, "-o", &file]);
        let u: Vec<f64> =
            hdf5_files().open(&file).unwrap().dataset("trajectory/u").unwrap().read_raw().unwrap();
        (summary, u)
    };
    let (a, u) = read(&full, "full.h5");
    let (b, v) = read(&all, "all.h5");
    let (c, _) = read(&some, "some.h5");
    assert_eq!(u.len(), v.len());
    assert!(crate::common::relative(&v, &u) < 1e-9, "{}", crate::common::relative(&v, &u));
    assert_eq!(
        a["final"]["u"].as_array().unwrap().len(),
        b["final"]["u"].as_array().unwrap().len()
    );
    assert!(b["n_o"].as_u64() == a["n_o"].as_u64());
    // few modes: a smoother motion of the same body
    assert!(c["n_o"].as_u64() < a["n_o"].as_u64());
    assert_eq!(
        c["final"]["u"].as_array().unwrap().len(),
        a["final"]["u"].as_array().unwrap().len()
    );
    let (modes, fewer) = (json(&["modes", &full]), json(&["modes", &some]));
    let lowest = |m: &Value| m["open"]["omega"][0].as_f64().unwrap();
    // a Rayleigh quotient on fewer shapes
    let above = lowest(&fewer) / lowest(&modes) - 1.0;
    assert!(above > -1e-12 && above < 1e-3, "{above}");
    assert_eq!(
        fewer["open"]["shapes"][0].as_array().unwrap().len(),
        modes["open"]["shapes"][0].as_array().unwrap().len()
    );
}

/// Harmonic balance of viscous modes: from every series shooting finds an orbit, all numbers of harmonics the same; also from a CSV with a column of α.
#[test]
fn series_of_viscous_modes_are_cross_checked() {
    let folder = Folder::new();
    let scene = folder.scene("a.toml", &format!("{PLATE}[orbit]\nbeta = 0.02\n"));
    let (series, checked) = (folder.at("h.h5"), folder.at("c.h5"));
    let balance = ["backbone", &scene, "--viscous", "--method", "hbm", "--harmonics", "3,7,15"];
    let grid = ["--range", "1.62,1.82", "--step", "0.04", "-o", &series];
    let family = json(&[&balance[..], &grid[..]].concat());
    let points = family["points"].as_array().unwrap();
    assert_eq!(points.len(), 18);
    assert!(points.iter().all(|p| p["converged"] == true), "{family}");
    // the damping of the mode is told from seven harmonics on
    assert!(points.iter().all(|p| p["alpha"].is_null() == (p["branch"] == 0)));
    let report = json(&["crosscheck", &series, &scene, "-o", &checked]);
    let rows = report["points"].as_array().unwrap();
    let energy = |r: &Value| r["orbit_energy"].as_f64().unwrap();
    for three in rows.chunks(3) {
        // three harmonics lead to the orbit of all others, with other switches than their own
        let [first, more @ ..] = three else { panic!("{three:?}") };
        assert!(["orbit", "another orbit"].iter().any(|v| first["verdict"] == *v), "{first}");
        let is_near = first["same_sequence"] == true && first["moved"].as_f64() <= Some(0.1);
        assert_eq!(first["verdict"] == "orbit", is_near, "{first}");
        assert!(more.iter().all(|r| r["verdict"] == "orbit"), "{three:?}");
        let e = energy(&three[2]);
        assert!(three.iter().all(|r| (energy(r) / e - 1.0).abs() < 1e-6), "{three:?}");
        let moved = |k: usize| three[k]["moved"].as_f64().unwrap();
        assert!(moved(2) < 0.3 * moved(1) && moved(1) < 0.5 * moved(0), "{three:?}");
    }
    // the same numbers from another program
    let stored = StoredFamily::read(Path::new(&series)).unwrap();
    let s = stored.points.iter().filter_map(|p| p.series.as_ref()).find(|s| s.n_h == 7).unwrap();
    let n_o = s.coefficients.len() / 15;
    let names: Vec<String> = (1..=n_o).map(|i| format!("u_{i}")).collect();
    let mut csv = format!("point,omega,alpha,k,part,{}\n", names.join(","));
    for (f, row) in s.coefficients.chunks(n_o).enumerate() {
        let part = if f > 0 && f % 2 == 0 { "sin" } else { "cos" };
        let cells: Vec<String> = row.iter().map(|x| format!("{x:e}")).collect();
        let (k, alpha) = (f.div_ceil(2), s.alpha.unwrap());
        csv += &format!("1,{:e},{alpha:e},{k},{part},{}\n", s.omega, cells.join(","));
    }
    let csv = folder.scene("theirs.csv", &csv);
    let theirs = json(&["crosscheck", &csv, &scene, "-o", &folder.at("d.h5")]);
    let own = rows.iter().find(|r| r["harmonics"] == 7).unwrap();
    assert!((energy(&theirs["points"][0]) / energy(own) - 1.0).abs() < 1e-12);
    let sampled = ["--range", "1.62,1.82", "--aft", "64", "-o", &folder.at("f.h5")];
    refused(&[&balance[..], &sampled[..]].concat(), "leave it out");
    refused(
        &["crosscheck", &csv, &scene, "--beta", "0", "-o", &folder.at("e.h5")],
        "positive time",
    );
}
