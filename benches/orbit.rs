//! `cargo bench --bench orbit`: one orbit, one point of a family, one harmonic-balance solution, at 66 unknowns.

use std::path::Path;

use divan::{Bencher, black_box};
use signorini::contact::System;
use signorini::continuation::{Go, Options, Place, follow};
use signorini::hbm::modes::solve;
use signorini::hbm::newton::Settings;
use signorini::hbm::response::{ladder, mode_start};
use signorini::hbm::series::Series;
use signorini::hbm::{Form, Reduction, prepare};
use signorini::orbit::OrbitFamily;
use signorini::orbit::branch::mode_guess;
use signorini::orbit::search::{Effort, chain_of, find};
use signorini::orbit::{Closure, Propagator, Segments};
use signorini::problem::Problem;
use signorini::scenario::Scene;

fn main() {
    divan::main();
}

fn problem() -> Problem {
    let text = include_str!("../scenarios/half-plate-orbit.toml");
    let scene = Scene::parse(text, Path::new("half-plate-orbit.toml")).expect("a shipped scene");
    Problem::new(&scene, None).expect("a shipped scene")
}

/// From the first mode (eight Newton steps), phases known; with and without multipliers.
#[divan::bench(args = [false, true])]
fn one_orbit(bencher: Bencher, multipliers: bool) {
    let mut body = Propagator::new(problem().system).expect("modes");
    let guess = mode_guess(&body, 1, -1.1).expect("a mode");
    let effort = Effort { multipliers, ..Effort::default() };
    bencher.bench_local(|| find(&mut body, Closure::Reversible, black_box(&guess), 1.8, &effort));
}

/// The same with every phase met for the first time.
#[divan::bench]
fn one_orbit_cold(bencher: Bencher) {
    let effort = Effort { multipliers: false, ..Effort::default() };
    bencher.with_inputs(|| Propagator::new(problem().system).expect("modes")).bench_local_values(
        |mut body| {
            let guess = mode_guess(&body, 1, -1.1).expect("a mode");
            find(&mut body, Closure::Reversible, &guess, 1.8, &effort)
        },
    );
}

/// One step of pseudo-arclength, multipliers and credentials included.
#[divan::bench]
fn one_point_of_a_family(bencher: Bencher) {
    let mut body = Propagator::new(problem().system).expect("modes");
    let guess = mode_guess(&body, 1, -1.1).expect("a mode");
    let verdict =
        find(&mut body, Closure::Reversible, &guess, 1.8, &Effort::default()).expect("a map");
    let orbit = verdict.orbit().expect("an orbit").clone();
    let (chain, times) = chain_of(&body, &orbit).expect("a chain");
    let mut family = Segments::new(&mut body, Closure::Reversible, chain);
    let x = family.unknowns(&orbit.z, &times, 1.8);
    let place = Place::start(&mut family, x, 1.0, 0.01).expect("a map").expect("a tangent");
    let options = Options {
        range: (1.6, 2.0),
        step: (0.01, 1e-8, 0.05),
        points: 1,
        locate: false,
        natural: false,
    };
    let chain = family.chain.clone();
    bencher.bench_local(|| {
        // a fresh family: nothing is remembered of the last run
        let mut family = Segments::new(&mut body, Closure::Reversible, chain.clone());
        follow(&mut family, place.clone(), &options, |family, p| {
            black_box(family.orbit(&p.x).is_ok());
            Go::Continue(())
        })
    });
}

/// A solution from its neighbour with one harmonic less.
#[divan::bench(args = [7, 15, 31])]
fn harmonic_balance(bencher: Bencher, n_h: usize) {
    let r = Reduction::new(problem().system, Form::Force).expect("modes");
    let settings = Settings::default();
    let first = solve(&r, &mode_start(&r, 1.7).expect("a mode"), 1.8, &settings).expect("a map");
    let first = first.expect("one harmonic converges").q;
    let near = ladder(&r, &first, n_h - 1, 1.8, &settings)
        .expect("a map")
        .expect("the ladder converges")
        .q;
    bencher.bench_local(|| solve(&r, black_box(&near.with_harmonics(n_h)), 1.8, &settings));
}

/// Two masses and an elastic stop at the peak of their forced response: a point in time, by shooting from its neighbour.
#[divan::bench]
fn two_masses_in_time(bencher: Bencher) {
    let mut body = Propagator::new(two_masses()).expect("modes");
    let effort = Effort::default();
    let mut z = body.linear_response();
    for k in 0..=230 {
        let omega = 0.5 + 1e-3 * f64::from(k);
        let verdict = find(&mut body, Closure::FORCED, &z, omega, &effort).expect("a map");
        z = verdict.orbit().expect("an orbit").z.clone();
    }
    bencher.bench_local(|| find(&mut body, Closure::FORCED, black_box(&z), 0.7305, &effort));
}

/// The same by harmonic balance.
#[divan::bench(args = [7, 31])]
fn two_masses_by_series(bencher: Bencher, n_h: usize) {
    let mut body = prepare(two_masses(), Form::Acceleration).expect("modes");
    let mut q = Series::zeros(body.interface().basis, n_h, 2);
    for k in 0..=230 {
        let omega = 0.5 + 1e-3 * f64::from(k);
        body.set_frequency(omega);
        let found = body.solve(&q, omega, &Settings::default()).expect("phases");
        q = found.expect("a solution").q;
    }
    body.set_frequency(0.7305);
    bencher.bench_local(|| body.solve(black_box(&q), 0.7305, &Settings::default()));
}

fn two_masses() -> System {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/two-mass-stop.toml");
    let scene = Scene::read(Path::new(path)).expect("a shipped scene");
    let mut system = Problem::new(&scene, None).expect("a shipped scene").system;
    system.loads_mut().set_frequency(0.5);
    system
}
