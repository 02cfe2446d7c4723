//! Penalty and Nitsche's method. Reference numbers: an independent prototype (event-driven modal flow in another language, two resolutions of its
//! search agreeing to 2e-15).

mod common;

use common::{problem, reference_problem};
use signorini::contact::{State, System};
use signorini::event::{self, Options, Report, Silent};
use signorini::flow::Tolerances;
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

const PENALTY: &str = "method = \"penalty\"\n";
const NITSCHE: &str = "method = \"nitsche\"\n";
const NITSCHE_0: &str = "method = \"nitsche\"\ntheta = 0\ngamma = 5\n";

fn run(system: &System, initial: &State, until: f64, integrator: Integrator) -> Report {
    let options = Options { until, samples: 1, switch_limit: 40.0 };
    let mut flow = by_name(integrator, system, Tolerances { rtol: 1e-12, atol: 1e-15 });
    event::run(system, initial, &options, flow.as_mut(), &mut Silent).unwrap()
}

fn bar(method: &str, n: usize) -> Problem {
    problem(&format!(
        "[body]\nkind = \"bar\"\nsize = [1.0]\nelements = [{n}]\nyoung = 1.0\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"right\"\ngap = 1.0\n{method}\
         [initial]\ndisplacement = [\"-x/0.36\"]\n"
    ))
}

/// The half plate with the state of the reference file: all its displacements, those of the contact nodes too.
fn half_plate(method: &str) -> Problem {
    let reference = reference_problem("half-plate-10x3");
    let text = reference.text.replace("[contact]\n", &format!("[contact]\n{method}"));
    let text = text.replace("boundary_mass = \"consistent\"\n", "");
    let system = problem(&text).system;
    let paper = &reference.problem.system;
    let (u, v) = reference.problem.initial.full(paper).unwrap();
    let moved =
        |x: &[f64]| system.body.dofs.gather(&paper.body.dofs.scatter(x))[..system.n_o()].to_vec();
    let initial = State { u: moved(&u), v: moved(&v) };
    Problem { system, initial }
}

#[test]
fn bars_move_as_the_prototype_says() {
    for (method, first, middle, end, energies) in [
        (PENALTY, 1.364644931457, 1.388246841529, 1.115423195377, [3.858024691358; 2]),
        (NITSCHE, 1.360136650730, 1.386131698309, 0.963183180145, [3.761574074074; 2]),
        (
            NITSCHE_0,
            1.363152726435,
            1.389253922047,
            1.003517890458,
            [3.858024691358, 3.890351043302],
        ),
    ] {
        let p = bar(method, 20);
        let integrators = match method {
            NITSCHE_0 => vec![Integrator::Dop853, Integrator::Auto],
            _ => vec![Integrator::Modal, Integrator::Chebyshev, Integrator::Dop853],
        };
        for integrator in integrators {
            let report = run(&p.system, &p.initial, 1.68, integrator);
            let found = [
                report.switches[0].t,
                report.last.u[9],
                report.last.u[19],
                report.energy_start,
                report.energy_end,
            ];
            for (a, b) in found.iter().zip([first, middle, end, energies[0], energies[1]]) {
                assert!((a - b).abs() < 1e-9, "{method} {integrator:?}: {found:?}");
            }
            assert_eq!(report.switches.len(), 1);
            // what the forces without a potential do is in the ledger: nothing is left over
            assert!(report.energy_drift_total < 1e-10, "{method}: {:e}", report.energy_drift_total);
        }
    }
}

#[test]
fn half_plates_move_as_the_prototype_says() {
    for (method, first, bottom, top, energy, switches) in [
        (PENALTY, 1.483257770761, -1.150165470007, -1.250677761123, 0.364763641067, 12),
        (NITSCHE, 1.487476264986, -1.198409474280, -1.285195041308, 0.364763549720, 24),
    ] {
        let p = half_plate(method);
        for integrator in [Integrator::Modal, Integrator::Chebyshev, Integrator::Dop853] {
            let report = run(&p.system, &p.initial, 3.36, integrator);
            let u = p.system.body.dofs.scatter(&report.last.u);
            let at = |x, y| u[2 * p.system.body.mesh.nearest_node([x, y, 0.0])];
            let found = [report.switches[0].t, at(1.0, 0.0), at(1.0, 0.3), report.energy_end];
            for (a, b) in found.iter().zip([first, bottom, top, energy]) {
                assert!((a - b).abs() < 1e-9, "{method} {integrator:?}: {found:?}");
            }
            assert_eq!(report.switches.len(), switches, "{method}");
            assert!(report.switches.iter().all(|s| s.energy_jump.abs() < 1e-14));
        }
    }
}

#[test]
fn orbits_have_the_energies_of_the_prototype() {
    for (method, omega, energy) in [(PENALTY, 1.80, 1.5795871110), (NITSCHE, 1.80, 0.7846731695)] {
        let mut body = Propagator::new(half_plate(method).system).unwrap();
        let mut found = vec![];
        for amplitude in [-1.02, -1.05, -1.1, -1.2, -1.35, -1.5, -2.0, -3.0] {
            let z = signorini::orbit::branch::mode_guess(&body, 1, amplitude).unwrap();
            let verdict = find(&mut body, Closure::Reversible, &z, omega, &Effort::default());
            if let Some(orbit) = verdict.ok().as_ref().and_then(|v| v.orbit()) {
                let (u, v) = orbit.state.full(&body.system).unwrap();
                found.push((
                    body.system.kinetic(&v) + body.system.elastic(&u),
                    orbit.switches.len(),
                ));
            }
        }
        assert!(
            found.iter().any(|&(e, n)| (e - energy).abs() < 1e-8 && n == 12),
            "{method} {omega}: {found:?}"
        );
    }
}
