//! Harmonic balance of the viscous nonlinear mode against numbers of an independent program, and against orbits in time.

use crate::common::{Splitmix, bar, half_plate, problem};
use signorini::continuation::{Go, Options, Stop};
use signorini::hbm::modes::solve;
use signorini::hbm::newton::Settings;
use signorini::hbm::viscous::Fed;
use signorini::hbm::{Form, Reduction, Series, Viscous, viscous_branch, viscous_mode};
use signorini::orbit::search::{Effort, find};
use signorini::orbit::viscous::pinned_mode;
use signorini::orbit::{Closure, Pin, Propagator};
use signorini::records::PointKind;

const CONDENSED: &str = "method = \"mass-redistribution\"\n";

/// The body for harmonic balance and the one for shooting, with `β = 0.01`.
fn bodies(scene: &str) -> (Viscous, Propagator) {
    let shooter = Propagator::new(problem(scene).system).unwrap();
    let pin = Pin::new(&shooter, pinned_mode(&shooter).unwrap(), 0.01);
    (Viscous::new(problem(scene).system, pin).unwrap(), shooter)
}

/// Energy of a solution at `t = 0`.
fn energy(body: &Viscous, fed: &Fed) -> f64 {
    let reduction = body.reduction();
    let (q, dq) = fed.solution.q.at(0.0);
    let state = reduction.state(&q, &dq, fed.solution.omega);
    let (u, v) = state.full(&reduction.system).unwrap();
    reduction.system.elastic(0.0, &u) + reduction.system.kinetic(0.0, &v)
}

#[test]
fn series_have_the_numbers_of_the_prototype() {
    let tau = std::f64::consts::TAU;
    for (scene, n_h, omega, expected, alpha, first) in [
        (bar(20), 7, 1.86, 3.3927735297, 0.1036056818, 0.3966971463),
        (half_plate(10, 3, ""), 15, 1.80, 0.6581162488, 0.1465260926, 0.3920361382),
        (half_plate(10, 3, CONDENSED), 15, 1.80, 0.6698998816, 0.1076188049, 0.4008083270),
        (half_plate(20, 6, ""), 15, 1.80, 0.6988086031, 0.1203563100, 0.4001693433),
    ] {
        let (mut body, _) = bodies(&scene);
        let fed = body.from_mode(n_h, omega, &Settings::default()).unwrap().unwrap();
        let found = energy(&body, &fed);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        assert!((fed.alpha - alpha).abs() < 1e-9, "{} {alpha}", fed.alpha);
        let switch = fed.solution.crossings[0].theta / tau;
        assert!((switch - first).abs() < 1e-9, "{switch} {first}");
    }
}

/// The distance to the orbit falls like `N_h^-3`, and every series leads to the same orbit.
#[test]
fn series_converge_to_the_orbit_in_time() {
    let (mut body, mut shooter) = bodies(&half_plate(10, 3, ""));
    let closure = Closure::Viscous(body.pin);
    let mut distances = vec![];
    for n_h in [7, 15, 31, 63] {
        let fed = body.from_mode(n_h, 1.8, &Settings::default()).unwrap().unwrap();
        let (q, dq) = fed.solution.q.at(0.0);
        let state = body.reduction().state(&q, &dq, 1.8);
        let mut guess = shooter.frame(&state);
        guess.push(fed.alpha);
        let verdict = find(&mut shooter, closure, &guess, 1.8, &Effort::of(closure)).unwrap();
        let orbit = verdict.orbit().unwrap();
        assert!((orbit.energy / 0.6567459227 - 1.0).abs() < 1e-9);
        let n = 2 * shooter.n();
        distances.push(crate::common::relative(&guess[..n], &orbit.z[..n]));
    }
    println!("{distances:?}");
    // measured by the prototype: 5.1e-2, 3.9e-3, 1.8e-4, 2.6e-5
    for (found, expected) in distances.iter().zip([5.1e-2, 3.9e-3, 1.8e-4, 2.6e-5]) {
        assert!(*found < 2.0 * expected && *found > 0.5 * expected, "{found} {expected}");
    }
}

#[test]
fn the_derivative_is_that_of_the_residual() {
    for method in ["", CONDENSED] {
        let (mut body, _) = bodies(&half_plate(10, 3, method));
        let fed = body.from_mode(7, 1.8, &Settings::default()).unwrap().unwrap();
        let rng = Splitmix::new(7);
        let q = &fed.solution.q;
        let mut direction = Series::zeros(q.basis, q.n_h, q.n);
        let size = q.a.iter().map(|a| a * a).sum::<f64>().sqrt();
        for x in &mut direction.a {
            *x = size * (rng.below(2001) as f64 / 1000.0 - 1.0) / 30.0;
        }
        let at = |body: &mut Viscous, h: f64| {
            let mut there = q.clone();
            there.a.iter_mut().zip(&direction.a).for_each(|(x, d)| *x += h * d);
            body.directional((&there, fed.alpha + 0.3 * h), (&direction, 0.3), 1.8).unwrap()
        };
        let h = 1e-6;
        let (up, down, change) = (at(&mut body, h).0, at(&mut body, -h).0, at(&mut body, 0.0).1);
        let difference: Vec<f64> = up.iter().zip(&down).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        let e = crate::common::relative(&difference, &change);
        println!("{e:e}");
        assert!(e < 1e-8, "{e}");
    }
}

/// Through the 3:1 tongue with fifteen harmonics: the folds of the prototype.
#[test]
fn folds_of_the_tongue_are_those_of_the_prototype() {
    let (mut viscous, _) = bodies(&half_plate(10, 3, CONDENSED));
    let start = viscous.from_mode(15, 1.87, &Settings::default()).unwrap().unwrap();
    let mut body = viscous_mode::ViscousBody { viscous, shooter: None };
    let range = (1.86, 1.93);
    let options =
        Options { range, step: (0.005, 1e-8, 0.05), points: 600, locate: false, natural: false };
    let mut folds = vec![];
    let start = viscous_branch::Start::Solution(Box::new(start), 1.0);
    let stop = viscous_branch::arclength(&mut body, 15, start, &options, |p| {
        folds.extend((p.special == PointKind::Fold).then_some(p.omega));
        Go::Continue(())
    });
    assert_eq!(stop.unwrap(), Some(Stop::Range));
    assert_eq!(folds.len(), 2, "{folds:?}");
    for (found, expected) in folds.iter().zip([1.9205044090, 1.9151789798]) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
}

/// The damped body under a load on its mode, upper branch: from the viscous mode at the same frequency, a quarter of a period late.
#[test]
fn the_forced_series_has_the_numbers_of_the_prototype() {
    let load = "[damping]\nrayleigh = [0.0, 0.01]\n[[load]]\nkind = \"mode\"\nmode = 1\namplitude = 0.12\nomega = 1.7\n";
    let (mut body, _) = bodies(&half_plate(10, 3, ""));
    let free = body.from_mode(15, 1.7, &Settings::default()).unwrap().unwrap().solution.q;
    let system = problem(&half_plate(10, 3, load)).system;
    let reduction = Reduction::new(system, Form::Acceleration).unwrap();
    let mut found = vec![];
    for lag in [0.3, 0.6, 0.9, 1.2, 1.5] {
        // q(θ − lag), the far point of the free motion being its start
        let mut guess = free.clone();
        for k in 1..=free.n_h {
            let (sin, cos) = (k as f64 * (std::f64::consts::PI + lag)).sin_cos();
            for i in 0..free.n {
                let (a, b) = (free.of(2 * k - 1)[i], free.of(2 * k)[i]);
                guess.of_mut(2 * k - 1)[i] = a * cos - b * sin;
                guess.of_mut(2 * k)[i] = a * sin + b * cos;
            }
        }
        if let Ok(s) = solve(&reduction, &guess, 1.7, &Settings::default()).unwrap() {
            let amplitude = s.q.of(1)[0].hypot(s.q.of(2)[0]);
            let (q, dq) = s.q.at(0.0);
            let (u, v) = reduction.state(&q, &dq, 1.7).full(&reduction.system).unwrap();
            let energy = reduction.system.elastic(0.0, &u) + reduction.system.kinetic(0.0, &v);
            found.push((amplitude, energy, s.crossings.len()));
        }
    }
    let upper = found.iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    assert!((upper.0 / 0.5060802672 - 1.0).abs() < 1e-9, "{found:?}");
    assert!((upper.1 / 0.4428188364 - 1.0).abs() < 1e-9, "{found:?}");
    assert_eq!(upper.2, 8);
}
