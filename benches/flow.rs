//! `cargo bench`: the parts that a run is made of.

use std::path::Path;

use divan::{Bencher, black_box};
use signorini::contact::States;
use signorini::event::{Silent, find};
use signorini::flow::{Chebyshev, Flow};
use signorini::problem::Problem;
use signorini::scenario::{Integrator, Scene};
use signorini::simulate::simulate;

fn main() {
    divan::main();
}

/// The plate of the demonstration with another mesh.
fn plate(elements: [usize; 2]) -> (Scene, Problem) {
    let text = include_str!("../scenarios/plate.toml");
    let mut scene = Scene::parse(text, Path::new("scenarios/plate.toml")).expect("a shipped scene");
    scene.body.elements = elements.to_vec();
    let problem = Problem::new(&scene, None).expect("a shipped scene");
    (scene, problem)
}

const MESHES: [[usize; 2]; 3] = [[10, 5], [20, 10], [40, 20]];

/// The complementarity problem, warm.
#[divan::bench(args = MESHES)]
fn lcp(bencher: Bencher, mesh: [usize; 2]) {
    let (_, problem) = plate(mesh);
    let u: Vec<f64> = problem.initial.u.iter().map(|x| -x).collect();
    let system = &problem.system;
    let open = States::open(system.n_contact());
    let start = system.select(0.0, &u, &open).expect("solvable").set;
    bencher.bench_local(|| system.select(0.0, black_box(&u), &start));
}

/// A new phase: the interface work of a switch.
#[divan::bench(args = MESHES)]
fn new_phase(bencher: Bencher, mesh: [usize; 2]) {
    let (_, problem) = plate(mesh);
    let closed = States::closed(problem.system.n_contact());
    bencher.bench_local(|| problem.system.phase(black_box(&closed)));
}

/// One right-hand side.
#[divan::bench(args = MESHES)]
fn acceleration(bencher: Bencher, mesh: [usize; 2]) {
    let (_, problem) = plate(mesh);
    let system = &problem.system;
    let phase = system.open_phase();
    let mut scratch = system.scratch();
    let mut a = vec![0.0; system.n_o()];
    let state = &problem.initial;
    bencher.bench_local(|| {
        phase.acceleration(0.0, black_box(&state.u), &state.v, &mut scratch, &mut a);
    });
}

/// One period, each integrator; `modal` pays for its eigensolutions here.
#[divan::bench(args = ["dopri5", "dop853", "modal", "chebyshev", "auto"], sample_count = 5)]
fn one_period(bencher: Bencher, name: &str) {
    let (mut scene, problem) = plate([20, 10]);
    if let Some(run) = &mut scene.run {
        run.integrator = by_name(name);
        run.samples = 1;
    }
    bencher.bench_local(|| simulate(&scene, &problem, false, &mut Silent));
}

fn by_name(name: &str) -> Integrator {
    match name {
        "dopri5" => Integrator::Dopri5,
        "modal" => Integrator::Modal,
        "chebyshev" => Integrator::Chebyshev,
        "auto" => Integrator::Auto,
        _ => Integrator::Dop853,
    }
}

/// The switch search: one window of the exact flow with all its monitors.
#[divan::bench(args = MESHES)]
fn search_a_window(bencher: Bencher, mesh: [usize; 2]) {
    let (_, problem) = plate(mesh);
    let system = &problem.system;
    let phase = system.open_phase();
    let mut flow = Chebyshev::new(system);
    let y: Vec<f64> = problem.initial.u.iter().chain(&problem.initial.v).copied().collect();
    flow.begin(&phase, 0.0, &y);
    flow.advance(&phase, 3.36).expect("a window");
    let slack = phase.monitor_rounding(1.0, 1.0);
    let window = flow.window();
    let mut least = vec![0.0; slack.len()];
    bencher.bench_local(|| {
        find::earliest(&flow, black_box(&slack), window, 1e-15, black_box(&mut least))
    });
}

/// Cost against the size of the mesh: one period without eigenvectors.
#[divan::bench(args = [[20, 10], [40, 20], [80, 40]], sample_count = 3)]
fn scaling(bencher: Bencher, mesh: [usize; 2]) {
    let (mut scene, problem) = plate(mesh);
    if let Some(run) = &mut scene.run {
        run.integrator = Integrator::Chebyshev;
        run.samples = 1;
    }
    bencher.bench_local(|| simulate(&scene, &problem, false, &mut Silent));
}
