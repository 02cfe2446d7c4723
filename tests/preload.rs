//! Motions around the equilibrium of a body that a preload holds together: closed forms, the motion in time, other starts.

use std::f64::consts::{PI, TAU};

use crate::common::{event_driven, json, problem, relative, shipped};

use signorini::contact::{Rayleigh, State};
use signorini::event::Report;
use signorini::hbm::amplitudes::{Amplitudes, follow};
use signorini::hbm::damped::DampedMode;
use signorini::hbm::newton::Settings;
use signorini::orbit::branch::mode_guess;
use signorini::orbit::search::{Effort, Verdict, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::PointRecord;
use signorini::scenario::Integrator;

/// Two masses, 1 and 2, on massless springs, 3 and 6, whose tips a bolt presses together (stiffness .5, force .2).
fn joint(initial: &str) -> String {
    let element = |name: &str, stiff: f64, heavy: f64, at: f64| {
        format!(
            "[[body]]\nname = '{name}'\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = {stiff:?}\ndensity = {heavy:?}\nmove = [{at:?}]\n"
        )
    };
    element("a", 3.0, 1.0, 0.0)
        + &element("b", 6.0, 2.0, 1.0)
        + "[[contact]]\nslave = 'a:right'\nmaster = 'b:left'\n[[spring]]\nedge = 'a:left'\nto = 'b:right'\nstiffness = 0.5\npreload = 0.2\n"
        + &format!("[initial]\nequilibrium = true\n{initial}\n[run]\nuntil = 1.0\n")
}

/// `T = (2/ω₁)(π − arccos(x_s/A)) + (2/ω₂) arccos((x_s − x_c)/B)` for `A = a x_s`.
fn period(a: f64) -> f64 {
    let (k1, k2, mass, rest) = (2.5f64, 0.5f64, 2.0 / 3.0, 0.08);
    let (w1, w2) = ((k1 / mass).sqrt(), (k2 / mass).sqrt());
    let centre = rest * (1.0 - k1 / k2);
    let far = a * rest;
    let b = ((rest - centre).powi(2) + k1 / k2 * (far * far - rest * rest)).sqrt();
    2.0 / w1 * (PI - (rest / far).acos()) + 2.0 / w2 * ((rest - centre) / b).acos()
}

fn run(p: &Problem, until: f64) -> Report {
    event_driven(&p.system, &p.initial, until, Integrator::Dop853)
}

/// An amplitude counts in first openings: a mode of the closed joint at −a of them comes back after the period of the closed form.
#[test]
fn a_mode_of_a_closed_joint_counts_in_first_openings() {
    for a in [1.2, 2.0, 5.0] {
        // the first mode is that of the joint, the rigid motion of both stands before it
        let p = problem(&joint(&format!("mode = 2\namplitude = {:?}", -a)));
        let rest = p.system.rest().unwrap();
        assert_eq!(rest.set.count_closed(), 1);
        let energy = p.system.energy_in(&p.system.phase(&rest.set), 0.0, &p.initial);
        assert!((energy - 0.5 * 2.5 * (a * 0.08f64).powi(2)).abs() < 1e-15, "{energy}");
        let report = run(&p, period(a));
        assert_eq!(report.switches.len(), 2);
        assert!(relative(&report.last.u, &p.initial.u) < 1e-12, "a = {a}");
        // on this side nothing opens
        let p = problem(&joint("mode = 2\namplitude = -0.999"));
        assert!(run(&p, 20.0).switches.is_empty());
    }
}

/// Orbits around the equilibrium: from the mode of the closed joint, with the energy and the amplitude beyond it, at the frequency of the closed form.
#[test]
fn orbits_are_told_around_the_equilibrium() {
    let a = 2.0;
    let text = joint("").replace(
        "[[contact]]",
        // the rigid motion is held, by next to nothing
        "[[spring]]\nedge = 'a:left'\ndirection = [1.0]\nstiffness = 1e-9\n[[contact]]",
    );
    let mut body = Propagator::new(problem(&text).system).unwrap();
    assert!((body.home.modes[1].omega - 1.936_491_673_104).abs() < 1e-8);
    let guess = mode_guess(&body, 2, -a).unwrap();
    let omega = TAU / period(a);
    let found = find(&mut body, Closure::Reversible, &guess, omega, &Effort::default()).unwrap();
    let Verdict::Orbit(orbit) = found else { panic!("{found}") };
    assert!((orbit.energy - 0.5 * 2.5 * (a * 0.08f64).powi(2)).abs() < 1e-8, "{}", orbit.energy);
    assert_eq!(orbit.switches.len(), 2);
    // at rest there is no orbit, and nothing is found there
    let still = vec![0.0; guess.len()];
    let found = find(&mut body, Closure::Reversible, &still, omega, &Effort::default()).unwrap();
    assert!(found.orbit().is_none(), "{found}");
}

/// The damped mode of the bolted joint: with more harmonics what the motion does in time, under `−αM u̇`, comes nearer to where it was.
#[test]
#[ignore = "a minute"]
fn the_damped_mode_of_a_lap_joint_comes_back_in_time() {
    let p = Problem::new(&shipped("lap-joint-mode.toml"), None).unwrap();
    let mode = DampedMode::new(p.system.clone(), 2).unwrap();
    // micro-slip has begun, and takes energy
    let grid = [5e-5, 6.3e-5, 8e-5, 1e-4, 1.26e-4, 1.6e-4, 2e-4, 2.5e-4];
    let mut missed = vec![];
    let mut told = vec![];
    for n_h in [3, 7] {
        let settings = Settings::default();
        let mut points = vec![];
        let plan = Amplitudes { grid: &grid, n_h, settings: &settings };
        follow(&mode, &plan, &[], |point| {
            points.push(point);
            std::ops::ControlFlow::Continue(())
        })
        .unwrap();
        let of = |p: &PointRecord| p.series.as_ref().and_then(|s| s.alpha).unwrap();
        let (first, last) = (&points[0], &points[points.len() - 1]);
        let alpha = of(last);
        told.push((last.omega, alpha / (2.0 * last.omega), of(first) / (2.0 * first.omega)));
        let last = last.orbit.clone().unwrap();
        let mut system = p.system.clone();
        system.damping = Some(Rayleigh { alpha: -alpha, beta: 0.01 });
        let part =
            |x: &[f64]| system.body.coordinates(&x[..system.body.nodal_dofs().n_o]).into_owned();
        let start = State { u: part(&last.u0), v: part(&last.v0) };
        let report = event_driven(&system, &start, last.period, Integrator::Dop853);
        assert!(report.switches.len() > 4, "{}", report.switches.len());
        // its own motion, beside the constant displacement under the bolts
        let size = grid[grid.len() - 1];
        let off = report.last.u.iter().zip(&start.u).map(|(a, b)| (a - b).abs());
        missed.push(off.fold(0.0, f64::max) / size);
    }
    println!("{missed:?} {told:?}");
    // a force of friction that is an unknown converges like 1/N_h
    assert!(missed[1] < 0.6 * missed[0] && missed[1] < 1e-2, "{missed:?}");
    // friction adds to the damping that was there
    assert!(told[1].1 > 1.5 * told[1].2, "{told:?}");
}

/// A joint at rest stays, and the search of near misses ends although nothing moves.
#[test]
fn a_joint_at_rest_stays_at_rest() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(crate::common::root().join("scenarios/lap-joint-mode.toml"));
    let still: String = text
        .unwrap()
        .lines()
        .filter(|l| !l.starts_with("velocity"))
        .map(|l| format!("{l}\n"))
        .collect();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("still.toml"), still).unwrap();
    let done = json(&["run", &path("still.toml"), "-q", "-o", &path("still.h5")]);
    assert!(done["status"] == "complete" && done["t_end"] == 30.0, "{}", done["verdict"]);
    let energies = ["energy_start", "energy_end"].map(|key| done[key].as_f64().unwrap());
    assert!((energies[1] / energies[0] - 1.0).abs() < 1e-9, "{energies:?}");
}

/// A crack has no gap: at every displacement its viscous mode has one frequency, which is found with it.
#[test]
fn the_mode_of_a_crack_is_asked_for_by_a_displacement() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("crack.h5").display().to_string();
    let scene =
        crate::common::root().join("scenarios/cracked-beam-mode.toml").display().to_string();
    let at = |size: &str| {
        json(&["orbit", &scene, "--viscous", "--displacement", size, "-q", "--force", "-o", &path])
    };
    let (one, two) = (at("-0.1"), at("-0.2"));
    for orbit in [&one, &two] {
        assert!((orbit["omega"].as_f64().unwrap() - 0.023_811_538_4).abs() < 1e-10, "{orbit}");
    }
    let ratio = two["energy"].as_f64().unwrap() / one["energy"].as_f64().unwrap();
    assert!((ratio - 4.0).abs() < 1e-7, "{ratio}");
    let refused = |arguments: &[&str]| {
        let done = crate::common::run(arguments);
        assert_eq!(done.status.code(), Some(2));
        String::from_utf8_lossy(&done.stderr).into_owned()
    };
    let said = refused(&["orbit", &scene, "--displacement", "0.1"]);
    assert!(said.contains("--viscous"), "{said}");
    let said = refused(&["orbit", &scene, "--viscous", "--displacement", "0"]);
    assert!(said.contains("a finite length that is not zero"), "{said}");
}

/// What does not go together with an equilibrium is said.
#[test]
fn other_starts_beside_an_equilibrium_are_refused() {
    let refused = |text: &str| {
        let scene = signorini::scenario::Scene::parse(text, std::path::Path::new("test.toml"));
        scene.map_or_else(
            |e| e.to_string(),
            |scene| Problem::new(&scene, None).unwrap_err().to_string(),
        )
    };
    for (initial, what) in [
        ("mode = 2\namplitude = -2.0\nvelocity = ['0.1']", "mixes several forms"),
        ("displacement = ['0.1*x']", "mixes several forms"),
        ("mode = 2", "initial.amplitude: is missing"),
        ("mode = 3\namplitude = -2.0", "mode 3 does not exist"),
        ("mode = 1\namplitude = -2.0", "opens and closes nothing"),
    ] {
        let said = refused(&joint(initial));
        assert!(said.contains(what), "{initial}: {said}");
    }
    let rough = joint("mode = 2\namplitude = -2.0")
        .replace(
            "kind = 'bar'\nsize = [1.0]\nelements = [1]",
            "kind = 'plate'\nsize = [1.0, 1.0]\npoisson = 0.3\nelements = [1, 1]",
        )
        .replace("master = 'b:left'\n", "master = 'b:left'\nfriction = 0.3\n")
        .replace("preload = 0.2\n", "direction = [1.0, 0.0]\npreload = 0.2\n")
        .replace("move = [0.0]", "move = [0.0, 0.0]")
        .replace("move = [1.0]", "move = [1.0, 0.0]");
    let said = refused(&rough);
    assert!(said.contains("with friction an equilibrium is one of a family"), "{said}");
}
