//! The discretisations beside the paper's: nodal reactions, constant inertia, mass redistribution. Reference numbers: an independent prototype
//! (event-driven modal flow in another language, two resolutions of its search agreeing to 2e-15).

mod common;

use std::f64::consts::TAU;

use common::{problem, reference_problem, relative};
use signorini::contact::{ActiveSet, State, System};
use signorini::event::{self, Options, Report, Silent};
use signorini::flow::Tolerances;
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

const CONDENSED: &str = "method = \"mass-redistribution\"\n";
const OPTIMAL: &str = "method = \"mass-redistribution\"\nmass = \"optimal\"\n";
const REACTION: &str = "stress = \"reaction\"\ninertia = \"constant\"\n";
const CONSTANT: &str = "inertia = \"constant\"\n";

fn run(system: &System, initial: &State, until: f64, integrator: Integrator) -> Report {
    let options = Options { until, samples: 1, switch_limit: 40.0, verify_lcp: true };
    let mut flow = by_name(integrator, system, Tolerances { rtol: 1e-12, atol: 1e-15 });
    event::run(system, initial, &options, flow.as_mut(), &mut Silent).unwrap()
}

/// All nodal displacements at the end of a run, in the order of the mesh.
fn nodal(system: &System, report: &Report) -> Vec<f64> {
    let mut u = vec![0.0; system.n()];
    let phase = system.phase(&report.active);
    phase.expand_displacement(report.t_end, &report.last.u, &mut u);
    system.body.dofs.scatter(&u)
}

fn bar(method: &str, n: usize) -> Problem {
    problem(&format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\n{method}\
         [initial]\ndisplacement = [\"-x/0.36\"]\n"
    ))
}

fn half_plate(method: &str) -> Problem {
    let text = reference_problem("half-plate-10x3").text;
    let initial = reference_problem("half-plate-10x3").problem.initial;
    let text = text.replace("[contact]\n", &format!("[contact]\n{method}"));
    let text = text.replace("boundary_mass = \"consistent\"\n", "");
    Problem { initial, ..problem(&text) }
}

#[test]
fn bars_of_redistributed_mass_move_as_the_prototype_says() {
    for (method, first, middle) in [
        (CONDENSED, 1.360285192866, 1.386341511412),
        (CONSTANT, 1.360285192866, 1.386341511412),
        (OPTIMAL, 1.358167500158, 1.331314315950),
    ] {
        let p = bar(method, 20);
        for integrator in [Integrator::Modal, Integrator::Chebyshev] {
            let report = run(&p.system, &p.initial, 1.68, integrator);
            assert!(report.is_certified(), "{method}");
            let u = nodal(&p.system, &report);
            assert!((report.switches[0].t - first).abs() < 1e-9, "{method} {}", report.switches[0].t);
            assert!((u[10] - middle).abs() < 1e-9, "{method} {integrator:?}: {}", u[10]);
            assert!((u[20] - 1.0).abs() < 1e-12);
            assert!((report.energy_start - 3.665123456790).abs() < 1e-9);
            assert!((report.energy_end - report.energy_start).abs() < 1e-11);
        }
    }
}

#[test]
fn half_plates_of_redistributed_mass_move_as_the_prototype_says() {
    for (method, first, bottom, top, trace) in [
        (CONDENSED, 1.493684255923, -1.172505951446, -1.253621665829, 0.23520338594251),
        (OPTIMAL, 1.505928805705, -1.129906136234, -1.181078750218, 0.22886502640153),
    ] {
        let p = half_plate(method);
        let sum: f64 = p.system.mass().triplets().filter(|(i, j, _)| i == j).map(|e| e.2).sum();
        assert!((sum - trace).abs() < 1e-12, "{method}: trace {sum}");
        for integrator in [Integrator::Modal, Integrator::Chebyshev, Integrator::Dop853] {
            let report = run(&p.system, &p.initial, 3.36, integrator);
            let u = nodal(&p.system, &report);
            let at = |x, y| u[2 * p.system.body.mesh.nearest_node([x, y])];
            let found = [report.switches[0].t, at(1.0, 0.0), at(1.0, 0.3), report.energy_end];
            for (a, b) in found.iter().zip([first, bottom, top, 0.364761936665]) {
                assert!((a - b).abs() < 1e-9, "{method} {integrator:?}: {found:?}");
            }
            assert_eq!(report.switches.len(), 8, "{method}");
            assert!(report.switches.iter().all(|s| s.energy_jump.abs() < 1e-14));
            assert!(report.lcp_check.unwrap().enumeration.unwrap() < 1e-11);
        }
    }
}

#[test]
fn orbits_have_the_energies_of_the_prototype() {
    for (method, omega, energy) in [
        (CONDENSED, 1.80, 0.8715447210),
        (CONDENSED, 1.90, 3.8449299843),
        (CONDENSED, 2.00, 7.504983395),
        (OPTIMAL, 1.80, 1.2486616740),
        (OPTIMAL, 1.90, 3.4982230367),
    ] {
        let mut body = Propagator::new(half_plate(method).system).unwrap();
        let mut found = vec![];
        for amplitude in [-1.02, -1.05, -1.1, -1.2, -1.35, -1.5, -2.0, -3.0] {
            let z = signorini::orbit::branch::mode_guess(&body, 1, amplitude).unwrap();
            let verdict = find(&mut body, Closure::Reversible, &z, omega, &Effort::default());
            if let Some(orbit) = verdict.ok().as_ref().and_then(|v| v.orbit()) {
                let (u, v) = orbit.state.full(&body.system).unwrap();
                found.push(body.system.kinetic(&v) + body.system.elastic(&u));
            }
        }
        let nearest = found.iter().map(|e| (e - energy).abs()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-8, "{method} {omega}: {found:?}");
    }
}

#[test]
fn the_energy_stays_and_the_acceleration_does_not_jump() {
    for method in [CONDENSED, OPTIMAL, CONSTANT] {
        let p = half_plate(method);
        let unit = p.system.body.frequency_unit();
        let report = run(&p.system, &p.initial, 300.0 * TAU / unit, Integrator::Modal);
        assert!(report.outcome.is_complete() && report.missed == 0, "{method}");
        let change = (report.energy_end / report.energy_start - 1.0).abs();
        println!("{method}: {} switches, energy {change:.1e}", report.switches.len());
        assert!(change < 1e-10 && report.switches.len() > 500, "{method}: {change:e}");
    }
    let p = half_plate(CONDENSED);
    let (mut largest, mut jump) = (0.0f64, 0.0f64);
    let mut scratch = p.system.scratch();
    let all = run(&p.system, &p.initial, 30.0, Integrator::Modal);
    for s in &all.switches {
        let there = run(&p.system, &p.initial, s.t, Integrator::Modal).last;
        let mut acceleration = |set: &ActiveSet| {
            let mut a = vec![0.0; p.system.n_o()];
            let phase = p.system.phase(set);
            phase.acceleration(s.t, &there.u, &there.v, &mut scratch, &mut a);
            a
        };
        let (before, after) = (acceleration(&s.before), acceleration(&s.after));
        for (a, b) in before.iter().zip(&after) {
            largest = largest.max(a.abs());
            jump = jump.max((a - b).abs());
        }
    }
    assert!(jump < 1e-9 * largest, "{jump} of {largest}");
}

#[test]
fn one_method_has_two_names() {
    let (a, b) = (half_plate(CONDENSED), half_plate(REACTION));
    let run = |p: &Problem| run(&p.system, &p.initial, 10.0, Integrator::Modal);
    let (ra, rb) = (run(&a), run(&b));
    assert!(ra.last == rb.last && ra.switches == rb.switches);
    // on bars the stress of the field is the reaction
    let (a, b) = (bar(CONDENSED, 40), bar(CONSTANT, 40));
    let (ra, rb) = (run(&a), run(&b));
    assert_eq!(ra.switches.len(), rb.switches.len());
    assert!(relative(&ra.last.u, &rb.last.u) < 1e-11);
}
