//! Forced responses: branches that do not depend on the instant at which their states are taken, first orbits where the linear response is far from any, and ranges that are
//! covered to their end.

use crate::common::{json, root, run, scene};
use serde_json::Value;
use signorini::contact::State;
use signorini::event::Silent;
use signorini::orbit::Propagator;
use signorini::orbit::settle::{Settled, ladder, settle};
use signorini::problem::Problem;
use signorini::simulate::simulate;

/// The response of a scene, with the phase of its load changed.
fn response(scene: &str, load: &str, phase: f64, words: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(root().join("scenarios").join(scene)).unwrap();
    assert!(text.contains(load));
    let text = text.replace(load, &format!("{load}\nphase = {phase}"));
    let meshes = root().join("scenarios/meshes").display().to_string();
    let text = text.replace("meshes/", &format!("{meshes}/"));
    let (file, out) = (folder.path().join("scene.toml"), folder.path().join("out.h5"));
    std::fs::write(&file, text).unwrap();
    let [file, out] = [&file, &out].map(|p| p.to_str().unwrap());
    json(&[&["response", file, "-o", out], words].concat())
}

fn points(response: &Value) -> &[Value] {
    response["points"].as_array().unwrap()
}

/// Frequencies of the folds.
fn folds(response: &Value) -> Vec<f64> {
    let is_fold = |p: &&Value| p["special"] == "fold";
    points(response).iter().filter(is_fold).map(|p| p["omega"].as_f64().unwrap()).collect()
}

/// The origin of time of the load is nobody's business: the same fold, the same orbits at both ends of the range, about as many points.
#[test]
fn a_branch_does_not_know_the_phase_of_its_load() {
    let words = ["--ratios", "0.02", "--range", "1.5,1.8"];
    let all: Vec<Value> = [0.0, 1.3, 2.6]
        .map(|phase| response("half-plate-response.toml", "kind = \"mode\"", phase, &words))
        .into();
    let end = |r: &Value, key: &str| points(r).last().unwrap()[key].as_f64().unwrap();
    for r in &all {
        assert_eq!(end(r, "omega"), 1.8);
        assert!((folds(r)[0] / folds(&all[0])[0] - 1.0).abs() < 1e-8, "{:?}", folds(r));
        assert!((end(r, "energy") / end(&all[0], "energy") - 1.0).abs() < 1e-8);
        let share = points(r).len() as f64 / points(&all[0]).len() as f64;
        assert!((0.8..1.25).contains(&share), "{share}");
    }
}

/// A bar whose linear response is fifty gaps high.
const CLOSE: &str = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [5]\nyoung = 1.0\ndensity = 1.0\n\
    [[support]]\nedge = 'left'\nfix = ['x']\n[contact]\nedge = 'right'\ngap = 0.02\n[damping]\nratio = 0.05\nmode = 1\n\
    [[load]]\nkind = 'mode'\nmode = 1\namplitude = 0.5\nomega = OMEGA\n[run]\nperiods = 200\nintegrator = 'dop853'\nrtol = 1e-10\n";

/// What the ladder finds is what the bar comes to from rest by another integrator, where that is an orbit of the loads' own period; else Newton's method finds the unstable one
/// beside the orbit of several periods that the bar comes to.
#[test]
fn first_orbits_are_found_where_the_linear_response_is_far() {
    let (mut attracting, mut beside) = (0, 0);
    for omega in [0.9, 1.1, 1.3, 1.7, 1.9, 2.3] {
        let scene = scene(&CLOSE.replace("OMEGA", &omega.to_string()));
        let problem = Problem::new(&scene, None).unwrap();
        let n = problem.system.n_o();
        let mut body = Propagator::new(problem.system.clone()).unwrap();
        let orbit = ladder(&mut body, &[], omega).unwrap().unwrap();
        assert!(orbit.flaws().is_empty() && orbit.closure.periods() == 1);
        if !orbit.stability.as_ref().unwrap().is_stable() {
            let settled = settle(&mut body, &vec![0.0; 2 * n], omega).unwrap();
            let Settled::Orbit(longer) = settled.to else { panic!("{omega}: {settled:?}") };
            assert!(longer.closure.periods() > 1, "{omega}");
            beside += 1;
            continue;
        }
        let end = simulate(&scene, &problem, false, &mut Silent).unwrap();
        let State { u, v, .. } = end.last;
        let size = orbit.state.u.iter().chain(&orbit.state.v).fold(0.0f64, |m, x| m.max(x.abs()));
        let off = (u.iter().zip(&orbit.state.u)).chain(v.iter().zip(&orbit.state.v));
        let off = off.fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / size;
        assert!(off < 1e-6, "{omega}: {off:e}");
        attracting += 1;
    }
    println!("{attracting} attracting, {beside} beside others");
    assert!(attracting >= 3);
}

/// The valve, whose linear response is many gaps high and whose shooting from there finds nothing: a stable orbit, and an unstable one beside a stable one of two periods.
#[test]
fn the_valve_has_an_orbit_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let scene = root().join("scenarios/valve.toml").display().to_string();
    for (omega, stable) in [("0.55", true), ("0.48", false)] {
        let out = folder.path().join(format!("{omega}.h5")).display().to_string();
        let orbit = json(&["orbit", &scene, "--omega", omega, "-o", &out]);
        assert_eq!(orbit["stable"], stable, "{omega}: {orbit}");
        assert!(orbit["residual"].as_f64().unwrap() < 1e-10);
    }
}

/// By harmonic balance both walks have a solution at every frequency: behind the fold of small motions the walk to lower frequencies goes on with what the other found.
#[test]
fn walks_of_series_leave_no_frequency_out() {
    let words = "--method hbm --harmonics 7 --range 1.2,2.1 --ratios 0.005,0.01,0.02";
    let words: Vec<&str> = words.split(' ').collect();
    let found = response("half-plate-response.toml", "kind = \"mode\"", 0.0, &words);
    assert_eq!(points(&found).len(), 3 * 2 * 181);
    assert!(points(&found).iter().all(|p| p["converged"] == true));
    let jumps = points(&found).iter().filter(|p| p["special"] == "jump");
    // one of each walk
    assert!(jumps.count() >= 6);
}

/// A corner of the blade sticks for a moment however lightly it touches: the branch turns back at the grazing, within a hundred-thousandth of the frequency, and goes on; behind
/// its lower fold contact ends at another one.
#[test]
#[ignore = "two minutes"]
fn a_corner_that_sticks_is_passed() {
    let r = response("blade.toml", "omega = 0.069", 0.0, &["--range", "0.066,0.074", "--quick"]);
    let grazes: Vec<&Value> =
        points(&r).iter().filter(|p| p["special"].as_str().unwrap().contains("grazes")).collect();
    let at: Vec<f64> = grazes.iter().map(|p| p["omega"].as_f64().unwrap()).collect();
    assert_eq!(at.len(), 2, "{at:?}");
    assert!(grazes[0]["special"].as_str().unwrap().ends_with("the frequency turns back"));
    // a load in one mode: linear until it touches, (1 - s)² + 4ξ²s = (1.6 · 2ξ)² at both
    let (xi, peak) = (0.02f64, 1.6);
    let b = 1.0 - 2.0 * xi * xi;
    let root = (b * b - 1.0 + (peak * 2.0 * xi).powi(2)).sqrt();
    let ratio = ((b + root) / (b - root)).sqrt();
    // the modes that are kept are not those of the open body
    assert!((at[1] / at[0] / ratio - 1.0).abs() < 1e-4, "{at:?} {ratio}");
    assert_eq!(folds(&r).len(), 3);
    assert!((folds(&r)[0] / at[0] - 1.0).abs() < 2e-5 && folds(&r)[0] < at[0]);
    assert_eq!(r["stops"][0]["end"], "range");
}

/// Small steps change nothing about where a branch goes: no grazing beyond the range is gone to.
#[test]
fn small_steps_stay_in_the_range() {
    let words = ["--ratios", "0.02", "--range", "1.4899,1.4902", "--step", "0.001"];
    let r = response("half-plate-response.toml", "kind = \"mode\"", 0.0, &words);
    assert!(points(&r).iter().all(|p| p["omega"].as_f64().unwrap() <= 1.4902 + 1e-12));
    assert_eq!(r["stops"][0]["stop"], "end of the range");
}

/// Behind a grazing lies a motion with other visits: a branch before springs, whose last touches come and go within a hundredth of its range, does not come back over one.
#[test]
fn behind_a_grazing_visits_are_others() {
    let folder = tempfile::tempdir().unwrap();
    let [file, out] = ["bar.toml", "out.h5"].map(|n| folder.path().join(n).display().to_string());
    let text = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [8]\nyoung = 1.0\ndensity = 1.0\n[[support]]\nedge = \"left\"\nfix = [\"x\"]\n\
                [contact]\nedge = \"right\"\ngap = 1.0\nmethod = \"penalty\"\nstiffness = 30.0\n[damping]\nratio = 0.0178\nmode = 1\n\
                [[load]]\nkind = \"mode\"\nmode = 1\npeak = 1.4855\nomega = 1.6\nphase = 4.77\n";
    std::fs::write(&file, text).unwrap();
    let r = json(&["response", &file, "--range", "1.3,2.1", "-o", &out]);
    assert_eq!(r["stops"][0]["stop"], "end of the range");
    let borders = points(&r).iter().filter(|p| p["special"].as_str().unwrap().contains("grazes"));
    let switches: Vec<i64> = borders.map(|p| p["switches"].as_i64().unwrap()).collect();
    // what a point on the border has, one visit less at every one
    assert!(switches.ends_with(&[4, 2, 0]), "{switches:?}");
    let specials: Vec<&str> = points(&r).iter().map(|p| p["special"].as_str().unwrap()).collect();
    assert!(specials.iter().filter(|s| s.ends_with("the frequency turns back")).count() == 1);
}

/// The beam between two stops over its whole range, whatever the phase of the load: one fold, the turn at a grazing, behind it the motion that touches nothing.
#[test]
#[ignore = "four minutes"]
fn the_beam_is_followed_through_its_whole_range() {
    for phase in [0.0, 0.8, 1.57, 2.4] {
        let words = ["--range", "0.045,0.070"];
        let r = response("beam.toml", "omega = 0.052", phase, &words);
        let last = points(&r).last().unwrap();
        assert!((last["omega"].as_f64().unwrap() - 0.07).abs() < 1e-15, "{phase}: {last}");
        assert!((folds(&r)[0] - 0.069_486_57).abs() < 1e-8, "{phase}: {:?}", folds(&r));
        assert_eq!(r["stops"][0]["stop"], "end of the range", "{phase}");
        let turns = points(&r).iter().filter_map(|p| {
            let is_it = p["special"].as_str()?.ends_with("the frequency turns back");
            is_it.then(|| p["omega"].as_f64().unwrap())
        });
        // at the grazing itself, or at a fold within 1e-6 of it
        let at = turns.chain(folds(&r)[1..].to_vec()).last().unwrap();
        assert!((at / 0.059_284_92 - 1.0).abs() < 2e-6, "{phase}: {at}");
        // no piece of it is leapt over
        let all: Vec<f64> = points(&r).iter().map(|p| p["omega"].as_f64().unwrap()).collect();
        let widest = all.windows(2).map(|w| (w[1] / w[0] - 1.0).abs()).fold(0.0, f64::max);
        assert!(widest < 0.02, "{phase}: {widest}");
        println!("{phase}: {} points", points(&r).len());
    }
}

/// A load on a contact displacement, nodal reactions and the paper's mass: the body comes back to the last digit, and its energy does not. What is said is that, and what to do.
#[test]
fn a_motion_that_repeats_and_is_no_orbit_is_told_as_that() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let matrix = |entries: &[&str]| {
        let head = "%%MatrixMarket matrix coordinate real symmetric";
        format!("{head}\n4 4 {}\n{}\n", entries.len(), entries.join("\n"))
    };
    std::fs::write(path("M.mtx"), matrix(&["1 1 1", "2 2 1", "3 3 1", "4 4 0.5"])).unwrap();
    let chain = ["1 1 32", "2 1 -16", "2 2 32", "3 2 -16", "3 3 32", "4 3 -16", "4 4 16"];
    std::fs::write(path("K.mtx"), matrix(&chain)).unwrap();
    let scene = "[body]\nkind = \"matrices\"\nmass_matrix = \"M.mtx\"\nstiffness_matrix = \"K.mtx\"\n\
                 [contact]\ndisplacements = [3]\ngap = 1.0\nstress = \"reaction\"\n[damping]\nratio = 0.05\nmode = 1\n\
                 [[load]]\nkind = \"mode\"\nmode = 1\npeak = 2.0\nomega = 1.7\n[orbit]\nrange = [1.7, 1.9]\n";
    std::fs::write(path("scene.toml"), scene).unwrap();
    let output = run(&["response", &path("scene.toml"), "-o", &path("out.h5")]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    for word in ["comes back after a period of the loads", "energy balance", "mass-redistribution"]
    {
        assert!(said.contains(word), "{word}: {said}");
    }
    let constant = scene.replace("\"reaction\"", "\"reaction\"\ninertia = \"constant\"");
    std::fs::write(path("scene.toml"), constant).unwrap();
    let answer = json(&["response", &path("scene.toml"), "-o", &path("constant.h5")]);
    assert_eq!(answer["stops"][0]["end"], "range");
}

/// Where a branch stops because the motions ahead cannot be followed, their reason is told: here switches accumulate on a coarse mesh.
#[test]
fn what_stops_a_branch_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let [file, out] = ["scene.toml", "out.h5"].map(|n| folder.path().join(n).display().to_string());
    let text = "[body]\nkind = 'plate'\nsize = [1.5, 0.4]\nelements = [2, 1]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
                [contact]\nedge = 'right'\ngap = 0.4\n[damping]\nratio = 0.03\nmode = 1\n[[load]]\nkind = 'mode'\nmode = 1\npeak = 1.4\nomega = 0.3\n[run]\nperiods = 1\n";
    std::fs::write(&file, text).unwrap();
    let output = run(&["response", &file, "-o", &out, "--range", "0.25,0.3", "--points", "200"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("cannot be followed") && said.contains("accumulation"), "{said}");
}
