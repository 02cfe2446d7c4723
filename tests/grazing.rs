//! States on the switching surface that velocities cannot decide (theory: "across a switch").
//!
//! A state is put on the surface `p_i = w_i = 0`, `ṗ_i = ẇ_i = 0` of one node; the accelerations of the free and of the
//! contact phase then decide. All four combinations of signs occur on a plate.

use crate::common::{Collector, problem, random};
use signorini::contact::State;
use signorini::contact::{PointState, States, System};
use signorini::event::{self, GrazingKind, Options};
use signorini::flow::Tolerances;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

const PLATE: &str = "[body]\nkind = 'plate'\nsize = [1.0, 0.4]\nelements = [4, 2]\nyoung = 1.0\n\
    poisson = 0.3\ndensity = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
    [contact]\nedge = 'right'\ngap = 1.0\n";

/// A grazing state of node `i`, and the curvatures `s = ∇p_i·ü` in the free and in the contact phase.
fn grazing_state(system: &System, i: usize, seed: u64) -> (State, States, [f64; 2]) {
    let n = system.n_o();
    let (mut u, mut v) = (random(n, 2 * seed), random(n, 2 * seed + 1));
    let row: Vec<(usize, f64)> = system.conditions().n_o.row(i).collect();
    let norm: f64 = row.iter().map(|r| r.1 * r.1).sum();
    for _ in 0..3 {
        let q = system.conditions().n_o.row_dot(i, &u)
            + system.conditions().n_c[(i, i)] * system.conditions().gap[i];
        let rate = system.conditions().n_o.row_dot(i, &v);
        row.iter().for_each(|&(j, x)| {
            u[j] -= q * x / norm;
            v[j] -= rate * x / norm;
        });
    }
    let set = system.select(0.0, &u, &States::open(system.n_contact())).unwrap().set;
    let curvature = [false, true].map(|active| {
        let phase = system.phase(&set.with(i, PointState::of_contact(active)));
        let mut a = vec![0.0; n];
        phase.acceleration(0.0, &u, &v, &mut system.scratch(), &mut a);
        -system.conditions().n_o.row_dot(i, &a)
    });
    (State { u, v }, set, curvature)
}

fn run(system: &System, state: &State, until: f64) -> (event::Report, Collector) {
    run_with(system, state, until, Integrator::Dop853)
}

fn run_with(
    system: &System,
    state: &State,
    until: f64,
    integrator: Integrator,
) -> (event::Report, Collector) {
    let options = Options { until, samples: 200, switch_limit: 1e6 };
    let mut flow = by_name(integrator, system, Tolerances { rtol: 1e-11, atol: 1e-13 });
    let mut collector = Collector::default();
    let report = event::run(system, state, &options, flow.as_mut(), &mut collector).unwrap();
    assert!(report.outcome.is_complete(), "{}", report.outcome);
    assert_eq!(report.proof.missed, 0);
    (report, collector)
}

#[test]
fn accelerations_decide_where_velocities_cannot() {
    let problem = problem(PLATE);
    let system = &problem.system;
    let mut counts = [0; 4];
    for seed in 0..600 {
        let i = seed as usize % system.n_contact();
        let (state, start, [free, contact]) = grazing_state(system, i, seed);
        let (report, states) = run(system, &state, 1e-3);
        let first = &states.active[0];
        let kinds: Vec<GrazingKind> =
            report.grazings.iter().filter(|g| g.t == 0.0 && g.point == i).map(|g| g.kind).collect();
        match (free < 0.0, contact > 0.0) {
            (true, false) => {
                counts[0] += 1;
                assert!(!first.touches(i) && kinds.is_empty(), "seed {seed}");
            }
            (false, true) => {
                counts[1] += 1;
                assert!(first.touches(i) && kinds.is_empty(), "seed {seed}");
            }
            (true, true) => {
                counts[2] += 1;
                assert_eq!(
                    first.touches(i),
                    start.touches(i),
                    "seed {seed}: the present phase is kept"
                );
                assert_eq!(kinds, [GrazingKind::Ambiguous]);
            }
            (false, false) => {
                counts[3] += 1;
                assert_eq!(kinds, [GrazingKind::Held], "seed {seed}");
            }
        }
    }
    println!("free {}, contact {}, both {}, none {}", counts[0], counts[1], counts[2], counts[3]);
    assert!(counts.iter().all(|&c| c > 0), "{counts:?}");
}

/// A held motion is the limit of motions that start beside the surface and cross it again and again.
#[test]
fn a_held_node_follows_the_limit_of_chattering_neighbours() {
    let problem = problem(PLATE);
    let system = &problem.system;
    let mut tested = 0;
    for seed in 0..2000 {
        let i = seed as usize % system.n_contact();
        let (state, _, [free, contact]) = grazing_state(system, i, seed);
        // a firm attraction from both sides holds long enough to be watched
        if !(free > 3.0 && contact < -3.0) {
            continue;
        }
        let until = 0.02;
        let (report, held) = run(system, &state, until);
        assert_eq!(report.grazings[0].kind, GrazingKind::Held);
        if report.phases > 1 {
            continue; // left the surface, or another node switched, too soon to compare
        }
        for (u, p) in held.u.iter().zip(&held.pressure) {
            let rest = system.conditions().n_o.row_dot(i, &u[..system.n_o()])
                + system.conditions().n_c[(i, i)] * system.conditions().gap[i];
            assert!(rest.abs() < 1e-11 && p[i] == 0.0, "{rest}");
        }
        let row: Vec<(usize, f64)> = system.conditions().n_o.row(i).collect();
        let norm: f64 = row.iter().map(|r| r.1 * r.1).sum();
        let mut distances = vec![];
        for epsilon in [1e-5, 1e-6] {
            let mut beside = state.clone();
            row.iter().for_each(|&(j, x)| beside.u[j] += epsilon * x / norm);
            let (chattering, _) = run(system, &beside, until);
            assert!(chattering.switches.len() > 2, "it must cross the surface more than once");
            let d = |a: &[f64], b: &[f64]| {
                a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            distances.push(d(&chattering.last.u, &report.last.u));
        }
        println!("seed {seed}: {distances:?}");
        assert!(
            distances[0] < 1e-4 && distances[1] < 0.5 * distances[0],
            "seed {seed}: {distances:?}"
        );
        tested += 1;
    }
    assert!(tested >= 3, "{tested}");
}

/// The exact flows hand held phases on and take over again when the node leaves the surface.
#[test]
fn exact_flows_pass_through_held_phases() {
    let problem = problem(PLATE);
    let system = &problem.system;
    let mut left = 0;
    for seed in 0..2000 {
        let i = seed as usize % system.n_contact();
        let (state, _, [free, contact]) = grazing_state(system, i, seed);
        if !(free > 0.5 && contact < -0.5) {
            continue;
        }
        let until = 0.3;
        let (stepped, _) = run(system, &state, until);
        for integrator in [Integrator::Modal, Integrator::Chebyshev, Integrator::Auto] {
            let (exact, _) = run_with(system, &state, until, integrator);
            assert_eq!(exact.switches.len(), stepped.switches.len(), "seed {seed}");
            assert!(exact.proof.uncertified >= 1 && !exact.is_certified());
            let e = crate::common::relative(&exact.last.u, &stepped.last.u);
            // one seed chatters: a hundred switches amplify what its flows round, 1e-10 to 1e-8 from one flow to the next
            let bound = if exact.switches.len() > 50 { 1e-7 } else { 1e-10 };
            assert!(e < bound, "seed {seed}, {integrator:?}: {e:e}");
        }
        left += usize::from(stepped.phases > 1);
    }
    assert!(left >= 5, "{left}");
}

/// A state with `p_i = w_i = 0`, `ṗ_i = ẇ_i = 0` at every contact node.
fn all_grazing(system: &System, seed: u64) -> State {
    let (n, n_c) = (system.n_o(), system.n_contact());
    let c = system.conditions();
    let rows = nalgebra::DMatrix::<f64>::from_fn(n_c, n, |i, j| {
        c.n_o.row(i).filter(|r| r.0 == j).map(|r| r.1).sum()
    });
    let gram = (&rows * rows.transpose()).try_inverse().unwrap();
    let onto = |x: Vec<f64>, constant: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let mut x = nalgebra::DVector::from_vec(x);
        for _ in 0..3 {
            let q = nalgebra::DVector::from_fn(n_c, |i, _| {
                c.n_o.row_dot(i, x.as_slice()) + constant(i)
            });
            x -= rows.transpose() * (&gram * q);
        }
        x.as_slice().to_vec()
    };
    let of_gap = |i: usize| c.n_c[(i, i)] * c.gap[i];
    State { u: onto(random(n, 2 * seed), &of_gap), v: onto(random(n, 2 * seed + 1), &|_| 0.0) }
}

/// More grazing nodes than sets can be tried for: the iteration over them says that it did not try all, and a node that it changes without end is held, where
/// once the run ended.
#[test]
fn many_grazing_nodes_are_decided_or_held() {
    let text = PLATE.replace("elements = [4, 2]", "elements = [4, 10]");
    let problem = problem(&text);
    let system = &problem.system;
    assert!(system.n_contact() > 10);
    let (mut held, mut untried, mut ended) = (0, 0, 0);
    for seed in 0..300 {
        let state = all_grazing(system, seed);
        let options = Options { until: 1e-7, samples: 1, switch_limit: 1e6 };
        let tolerances = Tolerances { rtol: 1e-11, atol: 1e-13 };
        let mut flow = by_name(Integrator::Dop853, system, tolerances);
        let mut seen = Collector::default();
        let report = event::run(system, &state, &options, flow.as_mut(), &mut seen).unwrap();
        let first = report.grazings.iter().filter(|g| g.t == 0.0);
        let kinds: Vec<GrazingKind> = first.map(|g| g.kind).collect();
        held += usize::from(kinds.contains(&GrazingKind::Held));
        untried += usize::from(kinds.contains(&GrazingKind::Untried));
        ended += usize::from(!report.outcome.is_complete());
        assert!(!kinds.contains(&GrazingKind::Ambiguous), "{kinds:?}");
    }
    println!("{held} held, {untried} decided among many, {ended} ended");
    assert!(held > 0 && untried > 0, "{held} {untried} {ended}");
}

/// Rest on the surface under no force is an equilibrium: nothing happens, and nothing loops.
#[test]
fn rest_on_the_surface_stays_at_rest() {
    let text = PLATE.replace("gap = 1.0", "gap = 0.0");
    let problem = problem(&text);
    let (report, _) = run(&problem.system, &problem.initial, 5.0);
    assert_eq!((report.switches.len(), report.phases), (0, 1));
    assert!(report.last.u.iter().chain(&report.last.v).all(|&x| x == 0.0));
}

/// A start exactly on the surface is decided by the velocity.
#[test]
fn the_velocity_decides_the_first_active_set() {
    for (velocity, active) in [("0.1*x", true), ("-0.1*x", false)] {
        let text = PLATE.replace("gap = 1.0", "gap = 0.0");
        let text = format!("{text}[initial]\nvelocity = ['{velocity}', '0']\n");
        let problem = problem(&text);
        let (_, states) = run(&problem.system, &problem.initial, 1e-3);
        assert!(states.active[0].iter().all(|s| s.touches() == active), "{velocity}");
    }
}

/// A point that turns a hair before its obstacle is told by every integrator, at the instant and the distance that the closed form `cos t` has.
#[test]
fn near_misses_are_told_by_every_flow() {
    let text = "[body]\nkind = 'bar'\nsize = [1.0]\nelements = [1]\nyoung = 1.0\ndensity = 2.0\nmass = 'lumped'\n[[support]]\nedge = 'left'\nfix = ['x']\n\
                [contact]\nedge = 'right'\ngap = 1.0000000001\nmethod = 'penalty'\nstiffness = 30.0\n[initial]\ndisplacement = ['-x']\n";
    let problem = problem(text);
    let flows = [Integrator::Dop853, Integrator::Dopri5, Integrator::Modal, Integrator::Chebyshev];
    for integrator in flows {
        let (report, _) = run_with(&problem.system, &problem.initial, 18.0, integrator);
        assert!(report.switches.is_empty());
        let told: Vec<_> = report.grazings.iter().map(|g| (g.kind, g.t, g.distance)).collect();
        assert_eq!(told.len(), 3, "{integrator:?}: {told:?}");
        for (k, (kind, t, distance)) in told.into_iter().enumerate() {
            assert_eq!(kind, GrazingKind::NearMiss);
            // a minimum is where it is to half the digits
            let closed = std::f64::consts::PI * (2 * k + 1) as f64;
            assert!((t - closed).abs() < 1e-5, "{integrator:?}: {t}");
            // a step is wrong by its tolerance of 1e-11, and there are many
            assert!((distance - 1e-10).abs() < 5e-11, "{integrator:?}: {distance}");
        }
    }
}
