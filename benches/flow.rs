//! `cargo bench`: the parts that a run is made of.

use std::path::Path;

use divan::{Bencher, black_box};
use signorini::contact::{ActiveSet, Phase};
use signorini::event::Silent;
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
    let nbm = &problem.nbm;
    let start = ActiveSet::new(
        nbm.solve_lcp(&u, &ActiveSet::open(nbm.n_contact())).expect("solvable").active,
    );
    bencher.bench_local(|| nbm.solve_lcp(black_box(&u), &start));
}

/// A new phase: the interface work of a switch.
#[divan::bench(args = MESHES)]
fn new_phase(bencher: Bencher, mesh: [usize; 2]) {
    let (_, problem) = plate(mesh);
    let closed = ActiveSet::closed(problem.nbm.n_contact());
    bencher.bench_local(|| Phase::new(&problem.nbm, black_box(closed.clone())));
}

/// One right-hand side.
#[divan::bench(args = MESHES)]
fn acceleration(bencher: Bencher, mesh: [usize; 2]) {
    let (_, problem) = plate(mesh);
    let nbm = &problem.nbm;
    let phase = Phase::new(nbm, ActiveSet::open(nbm.n_contact())).expect("a phase");
    let mut scratch = nbm.scratch();
    let mut a = vec![0.0; nbm.n_o()];
    let state = &problem.initial;
    bencher.bench_local(|| {
        phase.acceleration(nbm, 0.0, black_box(&state.u), &state.v, &mut scratch, &mut a);
    });
}

/// One period, each integrator.
#[divan::bench(args = ["dopri5", "dop853"], sample_count = 10)]
fn one_period(bencher: Bencher, name: &str) {
    let (mut scene, problem) = plate([20, 10]);
    if let Some(run) = &mut scene.run {
        run.integrator = if name == "dopri5" { Integrator::Dopri5 } else { Integrator::Dop853 };
        run.samples = 1;
    }
    bencher.bench_local(|| simulate(&scene, &problem, false, &mut Silent));
}
