//! The discretisations beside the paper's: nodal reactions, constant inertia, mass redistribution. Reference numbers: an independent prototype
//! (event-driven modal flow in another language, two resolutions of its search agreeing to 2e-15).

use std::f64::consts::TAU;

use crate::common::{bar_with as bar, observed, problem, reference_problem, relative};
use signorini::contact::{State, States, System};
use signorini::event::{Report, Silent, Verified};
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::Integrator;

const CONDENSED: &str = "method = \"mass-redistribution\"\n";
const OPTIMAL: &str = "method = \"mass-redistribution\"\nmass = \"optimal\"\n";
const REACTION: &str = "stress = \"reaction\"\ninertia = \"constant\"\n";
const CONSTANT: &str = "inertia = \"constant\"\n";

fn run(system: &System, initial: &State, until: f64, integrator: Integrator) -> Report {
    let mut observer = Silent;
    let mut verified = Verified::new(system, &mut observer);
    let mut report = observed(system, initial, until, integrator, &mut verified);
    report.lcp_check = Some(verified.check);
    report
}

/// All nodal displacements at the end of a run, in the order of the mesh.
fn nodal(system: &System, report: &Report) -> Vec<f64> {
    let mut u = vec![0.0; system.n()];
    let phase = system.phase(&report.active);
    phase.expand_displacement(report.t_end, &report.last.u, &mut u);
    system.body.dofs.scatter(&u)
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
            assert!(
                (report.switches[0].t - first).abs() < 1e-9,
                "{method} {}",
                report.switches[0].t
            );
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
            let at = |x, y| u[2 * p.system.body.mesh.nearest_node([x, y, 0.0])];
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
                found.push(body.system.kinetic(0.0, &v) + body.system.elastic(0.0, &u));
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
        assert!(report.outcome.is_complete() && report.proof.missed == 0, "{method}");
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
        let mut acceleration = |set: &States| {
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

/// Equilibrium under constant loads: a bar pulled onto its stop, and a free block that lies on the obstacle.
#[test]
fn a_start_in_equilibrium_stays_there() {
    // EA u'' = −ρA g: without the stop the end would go to 5 (pull) + 1 (weight); it stops at 1 with the pressure 5
    for method in ["", CONSTANT, CONDENSED] {
        let p = problem(&format!(
            "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [20]\nyoung = 1.0\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\n{method}\
             [[load]]\nkind = \"gravity\"\namplitude = 4.0\n[initial]\nequilibrium = true\n"
        ));
        let report = run(&p.system, &p.initial, 50.0, Integrator::Modal);
        let u = nodal(&p.system, &report);
        for (i, u) in u.iter().enumerate() {
            let x = i as f64 / 20.0;
            // u = −2x² + (1 + 2)x, but for the last element, whose weight the method of the paper gives to the obstacle
            let exact = -2.0 * x * x + 3.0 * x;
            assert!((u - exact).abs() < 0.02, "{method} {x}: {u} {exact}");
        }
        assert!(report.switches.is_empty() && report.grazings.is_empty(), "{method}");
        assert!(report.last.v.iter().all(|v| v.abs() < 1e-12), "{method}");
    }
    let block = problem(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [8, 4]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"bottom\"\ngap = 0.25\n\
         method = \"mass-redistribution\"\n[[load]]\nkind = \"gravity\"\namplitude = [0.0, -0.01]\n\
         [initial]\nequilibrium = true\nvelocity = [\"0\", \"0\"]\n",
    );
    let report = run(&block.system, &block.initial, 20.0, Integrator::Modal);
    let (u, v) = report.last.full(&block.system).unwrap();
    assert!(v.iter().all(|v| v.abs() < 1e-11) && report.switches.is_empty());
    // the obstacle bears the weight
    let phase = block.system.phase(&report.active);
    let mut pressure = vec![0.0; block.system.n_contact()];
    phase.pressures(0.0, &report.last.u, &mut pressure);
    let borne: f64 = block.system.constraints.iter().zip(&pressure).map(|(c, p)| c.area * p).sum();
    assert!((borne - 0.005).abs() < 1e-12, "{borne}");
    assert!(u[block.system.n_o()..].iter().all(|u| (u - 0.25).abs() < 1e-12));
}

/// Free fall deforms nothing: gravity acts on the mass of the method.
#[test]
fn free_fall_deforms_nothing() {
    for method in ["", CONSTANT, CONDENSED, OPTIMAL] {
        let p = problem(&format!(
            "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [12, 8]\nyoung = 1.0\npoisson = 0.3\ndensity = 2.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"bottom\"\ngap = 10.0\n{method}\
             [[load]]\nkind = \"gravity\"\namplitude = [0.0, -0.5]\n"
        ));
        let report = run(&p.system, &p.initial, 2.0, Integrator::Modal);
        for (k, u) in nodal(&p.system, &report).iter().enumerate() {
            let exact = if k % 2 == 1 { -1.0 } else { 0.0 };
            assert!((u - exact).abs() < 1e-10, "{method} {k}: {u}");
        }
    }
}

/// A harmonic traction on the contact edge enters the complementarity problem: exact flow and Runge–Kutta agree through its switches, and
/// the energy balances.
#[test]
fn loads_on_the_contact_edge_move_the_contact() {
    let p = problem(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [6, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\ngap = 0.05\n\
         method = \"mass-redistribution\"\n[damping]\nrayleigh = [0.05, 0.01]\n\
         [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = [0.02, 0.0]\n\
         [[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = [0.1, 0.0]\nomega = 1.1\nphase = 0.4\n",
    );
    let exact = run(&p.system, &p.initial, 30.0, Integrator::Modal);
    assert!(exact.is_certified() && exact.switches.len() > 20, "{} switches", exact.switches.len());
    assert!(exact.energy_drift_total < 1e-10, "{:e}", exact.energy_drift_total);
    let stepped = run(&p.system, &p.initial, 30.0, Integrator::Dop853);
    assert!(stepped.energy_drift_total < 1e-8, "{:e}", stepped.energy_drift_total);
    assert_eq!(exact.switches.len(), stepped.switches.len());
    assert!(relative(&exact.last.u, &stepped.last.u) < 1e-7);
    for (a, b) in exact.switches.iter().zip(&stepped.switches) {
        assert!(a.node == b.node && (a.t - b.t).abs() < 1e-7, "{} {}", a.t, b.t);
    }
    // the gaps are those of the complementarity problem by enumeration
    assert!(exact.lcp_check.unwrap().enumeration.unwrap() < 1e-11);
}

/// Where nothing holds the body against the constant loads there is no equilibrium, and the message says so.
#[test]
fn no_equilibrium_is_said() {
    let text = "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [6]\nyoung = 1.0\ndensity = 1.0\n\
         [contact]\nedge = \"right\"\ngap = 1.0\n[[load]]\nkind = \"gravity\"\namplitude = -1.0\n\
         [initial]\nequilibrium = true\n";
    let error = Problem::new(&crate::common::scene(text), None).unwrap_err().to_string();
    assert!(error.contains("initial.equilibrium") && error.contains("holds"), "{error}");
}

/// A body from matrices needs no boundary operator where the pressure is the nodal reaction: it moves as the mesh that the matrices came from.
#[test]
fn matrices_alone_are_enough_for_nodal_reactions() {
    let path = crate::common::root().join("validate/foreign/half-plate.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let kept: Vec<&str> = text.lines().filter(|l| !l.starts_with("n_")).collect();
    let text = kept.join("\n").replace("[contact]", "[contact]\nmethod = \"mass-redistribution\"");
    let scene = signorini::scenario::Scene::parse(&text, &path).unwrap();
    let given = Problem::new(&scene, None).unwrap();
    let meshed =
        Problem::new(&crate::common::shipped("half-plate-redistribution.toml"), None).unwrap();
    let run = |p: &Problem| {
        let z = Propagator::new(Problem::new(&scene, None).unwrap().system).unwrap();
        let start = z.state(&signorini::orbit::branch::mode_guess(&z, 1, -1.4).unwrap());
        run(&p.system, &start, 10.0, Integrator::Modal)
    };
    let (a, b) = (run(&given), run(&meshed));
    assert_eq!(a.switches.len(), b.switches.len());
    assert!(a.switches.len() >= 20 && relative(&a.last.u, &b.last.u) < 1e-8);
}
