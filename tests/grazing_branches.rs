//! Branches of forced responses over grazings: where they are by the linear response, whether they turn there, and that no instant and no direction matters.

use crate::common::{json, root};
use nalgebra::{Complex, DMatrix, DVector, Matrix2, Vector2};
use signorini::contact::System;
use signorini::continuation::{Go, Options};
use signorini::orbit::along::{Start, arclength};
use signorini::orbit::settle::ladder;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::{PointKind, PointRecord};
use signorini::scenario::Scene;

/// Where the linear response of the two masses is as high as the gap, by solving 2 × 2 equations and halving.
fn grazes(mut low: f64, mut high: f64) -> f64 {
    let height = |w: f64| {
        let k = Matrix2::new(1.0, -1.0, -1.0, 2.0).map(|k| Complex::new(k, 0.06 * k * w));
        let z = k - Matrix2::identity().map(|m: f64| Complex::new(m * w * w, 0.0));
        let u =
            z.try_inverse().unwrap() * Vector2::new(Complex::new(0.0, 0.0), Complex::new(0.1, 0.0));
        u[0].norm() - 1.0
    };
    let side = height(low) > 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (height(middle) > 0.0) == side { low = middle } else { high = middle }
    }
    low
}

/// The two masses before a stop that pushes with `preload` as soon as it is touched; all points of the response from one end of the range to the other.
fn branch(preload: f64, upwards: bool) -> Vec<PointRecord> {
    let path = root().join("scenarios/two-mass-stop.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let text = text.replace("\"penalty\"", &format!("\"stop\"\npreload = {preload:e}"));
    let scene = Scene::parse(&text, &path).unwrap();
    let problem = Problem::new(&scene, None).unwrap();
    let mut body = Propagator::new(problem.system.clone()).unwrap();
    let (range, from) = ((0.5, 0.85), if upwards { 0.5 } else { 0.85 });
    let orbit = ladder(&mut body, &[], from).unwrap().unwrap();
    let options =
        Options { range, step: (0.02, 1e-9, 0.1), points: 600, locate: false, natural: false };
    let mut points = vec![];
    let start = Start::Orbit(orbit, if upwards { 1.0 } else { -1.0 });
    let end = arclength(&mut body, Closure::FORCED, start, &options, |p| {
        points.push(p);
        Go::Continue(())
    });
    let end = end.unwrap().unwrap();
    assert_eq!(end.to_string(), "end of the range", "{preload}");
    points
}

/// From both ends, over both grazings, whatever the force that jumps there.
#[test]
fn a_preloaded_stop_is_passed_both_ways() {
    let closed = [grazes(0.56, 0.6), grazes(0.64, 0.66)];
    for preload in [0.0, 0.01, 0.05, 0.1, 0.15, 0.25] {
        for upwards in [true, false] {
            let points = branch(preload, upwards);
            let mut found: Vec<f64> = points
                .iter()
                .filter(|p| matches!(p.special, PointKind::Grazing(_)))
                .map(|p| p.omega)
                .collect();
            found.sort_by(f64::total_cmp);
            assert_eq!(found.len(), 2, "{preload} {upwards}: {found:?}");
            for (found, closed) in found.iter().zip(closed) {
                assert!((found / closed - 1.0).abs() < 1e-10, "{preload}: {found} for {closed}");
            }
            // up, back and up again: two turns, at a fold or at a grazing
            let is_turn = |p: &&PointRecord| match &p.special {
                PointKind::Fold => true,
                PointKind::Grazing(grazing) => grazing.turns,
                _ => false,
            };
            let turns = points.iter().filter(is_turn).count();
            assert_eq!(turns, 2, "{preload} {upwards}");
        }
    }
}

/// Depths of the touch and frequencies of the orbits right behind the lower grazing.
fn behind(preload: f64, deepest: f64) -> Vec<(f64, f64)> {
    let points = branch(preload, true);
    let at = points.iter().position(|p| matches!(p.special, PointKind::Grazing(_))).unwrap();
    let omega = points[at].omega;
    let orbits = points[at + 1..].iter().filter_map(|p| p.orbit.as_ref().map(|o| (o, p.omega)));
    let near = orbits.map(|(o, w)| (o.amplitude - 1.0, w / omega - 1.0));
    near.take_while(|(depth, _)| *depth < deepest).collect()
}

/// The normal forms: the frequency leaves a grazing like the square root of the depth where the force jumps, like the depth (and its power 3/2) where it does not.
#[test]
fn the_force_decides_on_the_root_of_the_depth() {
    for (preload, powers) in [(0.15, 0.4..0.6), (0.25, 0.4..0.6), (0.0, 0.9..1.5)] {
        let near = behind(preload, 1e-3);
        assert!(near.len() >= 2, "{preload}: {near:?}");
        let (first, last) = (near[0], near[near.len() - 1]);
        let slope = (last.1 / first.1).ln() / (last.0 / first.0).ln();
        assert!(powers.contains(&slope), "{preload}: {slope}, {near:?}");
    }
}

/// The grazings of a plate of four contact nodes are the same ones whatever instant its load begins at; the file has them in a table.
#[test]
fn grazings_do_not_know_the_phase_of_the_load() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(root().join("scenarios/half-plate-response.toml")).unwrap();
    let read = |phase: f64| {
        let [scene, out] = ["scene.toml", "out.h5"].map(|n| folder.path().join(n));
        let load = "kind = \"mode\"";
        let text = text.replace(load, &format!("{load}\nphase = {phase}"));
        std::fs::write(&scene, text).unwrap();
        let [scene, out] = [scene, out].map(|p| p.display().to_string());
        json(&[
            "response", &scene, "--ratios", "0.01", "--range", "1.5,1.7", "-o", &out, "--force",
        ]);
        let file = hdf5::File::open(&out).unwrap();
        let column = |name: &str| file.dataset(&format!("grazings/{name}")).unwrap();
        let omegas = column("omega").read_raw::<f64>().unwrap();
        (
            omegas,
            column("node").read_raw::<i64>().unwrap(),
            column("turns").read_raw::<i64>().unwrap(),
        )
    };
    let (omegas, nodes, turns) = read(0.0);
    println!("{omegas:?} {nodes:?} {turns:?}");
    assert!(omegas.len() >= 4 && turns.iter().sum::<i64>() <= 1);
    let (others, same, turned) = read(2.4);
    // which ones are met in a step may differ, those that are named are the same
    let mut common = 0;
    for ((omega, node), turn) in omegas.iter().zip(&nodes).zip(&turns) {
        let is_it = |k: &usize| same[*k] == *node && (others[*k] / omega - 1.0).abs() < 1e-4;
        if let Some(k) = (0..others.len()).find(is_it) {
            assert!(
                (others[k] / omega - 1.0).abs() < 1e-8,
                "node {node}: {omega} and {}",
                others[k]
            );
            assert_eq!(turned[k], *turn);
            common += 1;
        }
    }
    assert!(common >= 3, "{omegas:?} and {others:?}");
}

/// A plate that is pulled by its contact edge: the nodes on both sides of its middle touch together.
const PULLED: &str = "[body]\nkind = 'plate'\nsize = [1.0, 0.5]\nelements = [10, 5]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
    [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\ngap = 0.3\nMETHOD\n[damping]\nratio = 0.02\nmode = 2\n\
    [[load]]\nkind = 'traction'\nedge = 'right'\namplitude = [0.02, 0.0]\nomega = 1.6\n[run]\nperiods = 1\n";

/// How far the linear response of a body comes to its obstacle at a frequency: the greatest of its contact displacements over their gaps, by the equations of the open body.
fn reach(system: &mut System, omega: f64) -> f64 {
    system.loads_mut().set_frequency(omega);
    let (phase, n) = (system.open_phase(), system.n_o());
    let (stiffness, mass) = phase.matrices();
    let damping = system.damping.unwrap();
    let mut z = DMatrix::<Complex<f64>>::zeros(n, n);
    let of_k = Complex::new(1.0, omega * damping.beta);
    let of_m = Complex::new(-omega * omega, omega * damping.alpha);
    stiffness.triplets().for_each(|(i, j, k)| z[(i, j)] += of_k * k);
    mass.triplets().for_each(|(i, j, m)| z[(i, j)] += of_m * m);
    let load = &system.loads.harmonics[0];
    let force = phase.reduce(&load.force).into_iter().map(|f| Complex::from(f * load.size()));
    let u = z.lu().solve(&DVector::from_iterator(n, force)).unwrap();
    // real and imaginary parts of what follows; the load itself moves the contact in its own phase
    let part = |of: &dyn Fn(&Complex<f64>) -> f64| -> Vec<f64> {
        let mut full = vec![0.0; system.n()];
        phase.expand(&u.iter().map(of).collect::<Vec<f64>>(), &mut full);
        full[n..].to_vec()
    };
    let mut own = vec![0.0; system.n()];
    phase.expand_displacement(0.0, &vec![0.0; n], &mut own);
    let (re, im) = (part(&|u| u.re), part(&|u| u.im));
    let gap = |i: usize| system.constraints[i].gap;
    let heights = (0..re.len()).map(|i| (re[i] + own[n + i]).hypot(im[i]) / gap(i));
    heights.fold(0.0, f64::max)
}

/// Contact begins and ends on the branch where the linear response reaches the gap, at two nodes together, and at no other place on it; where it ends the frequency turns back, or has
/// done so right before. Nothing of it is a fold where nothing touches.
#[test]
fn nodes_that_touch_together_are_told_together() {
    for (method, folds) in [("", 1), ("method = 'mass-redistribution'", 2)] {
        let folder = tempfile::tempdir().unwrap();
        let (file, out) = (folder.path().join("scene.toml"), folder.path().join("out.h5"));
        let text = PULLED.replace("METHOD", method);
        std::fs::write(&file, &text).unwrap();
        let [path, out] = [&file, &out].map(|p| p.to_str().unwrap());
        let found = json(&["response", path, "-o", out, "--range", "1.5,1.7"]);
        let points = found["points"].as_array().unwrap();
        let told: Vec<(f64, &str)> = points
            .iter()
            .map(|p| (p["omega"].as_f64().unwrap(), p["special"].as_str().unwrap()))
            .filter(|(_, special)| special.starts_with("border") || *special == "fold")
            .collect();
        let borders: Vec<_> = told.iter().filter(|t| t.1.starts_with("border")).collect();
        assert_eq!(borders.len(), 6, "{told:?}");
        assert_eq!(told.len() - borders.len(), folds, "{told:?}");
        for (pair, border) in
            ["62 63", "61 64", "60 65", "60 65", "61 64", "62 63"].iter().zip(&borders)
        {
            assert!(border.1.contains("together"), "{border:?}");
            assert!(pair.split(' ').all(|node| border.1.contains(node)), "{border:?}");
        }
        let scene = Scene::parse(&text, &file).unwrap();
        let mut system = Problem::new(&scene, None).unwrap().system.clone();
        for (mut low, mut high, border) in [(1.5, 1.58, borders[0]), (1.7, 1.6, borders[5])] {
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if reach(&mut system, middle) < 1.0 { low = middle } else { high = middle }
            }
            assert!((border.0 / low - 1.0).abs() < 1e-9, "{border:?} {low}");
        }
        let turns = borders[5].1.ends_with("turns back");
        assert_eq!(turns, folds == 1, "{told:?}");
    }
}

/// A plate whose corners move like its second mode, of a gap and with a phase of its load.
fn swinging(gap: &str, phase: f64) -> String {
    PULLED
        .replace("METHOD", "")
        .replace("[1.0, 0.5]", "[1.0, 0.35]")
        .replace("[10, 5]", "[8, 3]")
        .replace("gap = 0.3", &format!("gap = {gap}"))
        .replace(
            "kind = 'traction'\nedge = 'right'\namplitude = [0.02, 0.0]",
            &format!("kind = 'mode'\nmode = 2\npeak = 1.6\nphase = {phase:?}"),
        )
}

/// The special points of a response that are borders.
fn borders(text: &str, more: &[&str]) -> Vec<(f64, String)> {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("scene.toml"), folder.path().join("out.h5"));
    std::fs::write(&file, text).unwrap();
    let [path, out] = [&file, &out].map(|p| p.to_str().unwrap());
    let said = json(&[&["response", path, "-o", out], more].concat());
    let points = said["points"].as_array().unwrap();
    let told = points
        .iter()
        .map(|p| (p["omega"].as_f64().unwrap(), p["special"].as_str().unwrap().to_owned()));
    told.filter(|(_, special)| special.starts_with("border")).collect()
}

/// A second touch that is born behind the first, and dies, within a step each: where steps twenty-five times as short find them.
#[test]
fn touches_that_come_and_go_within_a_step_are_told() {
    let long = borders(&swinging("1.0", 0.0), &["--range", "1.45,1.56"]);
    assert_eq!(long.len(), 3, "{long:?}");
    let short = borders(&swinging("1.0", 1.0), &["--range", "1.526,1.5295", "--step", "0.002"]);
    assert_eq!(short.len(), 2, "{short:?}");
    for (a, b) in long[1..].iter().zip(&short) {
        assert!((a.0 / b.0 - 1.0).abs() < 1e-8, "{a:?} {b:?}");
        // they are touches, not moments at which a long one is interrupted
        assert!(
            [a, b].iter().all(|t| t.1.contains("together") && !t.1.contains("open")),
            "{a:?} {b:?}"
        );
    }
}

/// An obstacle a thousandth askew: its corners graze one after the other, and the branch turns back where the linear response leaves the nearer one, whatever instant its load begins at. The
/// step there comes from where both touch; what it lost is found from its other end.
#[test]
fn what_a_step_lost_is_found_from_behind() {
    let text = swinging("'1.0 + 0.003*y'", 0.0);
    let scene = Scene::parse(&text, "scene.toml".as_ref()).unwrap();
    let mut system = Problem::new(&scene, None).unwrap().system.clone();
    let (mut low, mut high) = (1.62, 1.59);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if reach(&mut system, middle) < 1.0 { low = middle } else { high = middle }
    }
    for phase in [0.0, 1.0, 2.4] {
        let told = borders(&swinging("'1.0 + 0.003*y'", phase), &["--range", "1.45,1.65"]);
        let last = told.last().unwrap();
        assert!((last.0 / low - 1.0).abs() < 1e-9, "{phase}: {told:?} {low}");
        assert!(last.1.contains("node 32 grazes") && last.1.ends_with("turns back"), "{last:?}");
    }
}

/// A plate in the shape of its mode, whose corners touch twice a period over a piece of the branch: the time between two touches shrinks to nothing, where the pressure of one long touch
/// vanishes at its ends as on every orbit. What is told to graze does.
#[test]
fn what_is_told_to_graze_does() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("scene.toml"), folder.path().join("out.h5"));
    std::fs::write(&file, swinging("1.0", 0.0)).unwrap();
    let [path, name] = [&file, &out].map(|p| p.to_str().unwrap());
    let said = json(&["response", path, "-o", name, "--range", "1.45,1.65"]);
    let stored = crate::common::hdf5_files().open(&out).unwrap();
    let distance = stored.dataset("backbone/grazing_distance").unwrap().read_raw::<f64>().unwrap();
    let points = said["points"].as_array().unwrap();
    assert_eq!(points.len(), distance.len());
    let mut told = 0;
    for (point, distance) in points.iter().zip(&distance) {
        let special = point["special"].as_str().unwrap();
        // an orbit is not told where its energy does not balance
        if special.contains("grazes") && distance.is_finite() {
            assert!(*distance < 1e-8, "{special} at {}: {distance}", point["omega"]);
            told += 1;
        }
    }
    assert!(told > 0);
}
