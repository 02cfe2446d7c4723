//! Phases that natural modes do not decouple: the exact flow by complex modes against Runge–Kutta on the same equations, which knows no modes.

use crate::common::{problem, relative};
use signorini::event::{self, Options, Report, Silent};
use signorini::flow::Tolerances;
use signorini::problem::Problem;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

fn run(p: &Problem, integrator: Integrator) -> Report {
    let options = Options { until: 6.0, samples: 7, switch_limit: 40.0 };
    let mut flow = by_name(integrator, &p.system, Tolerances { rtol: 1e-12, atol: 1e-15 });
    event::run(&p.system, &p.initial, &options, flow.as_mut(), &mut Silent).unwrap()
}

fn plate(contact: &str, rest: &str) -> Problem {
    problem(&format!(
        "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [6, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = \"left\"\nfix = [\"x\", \"y\"]\n[contact]\nedge = \"right\"\ngap = \"0.5 + 0.1*y\"\n{contact}\
         [initial]\ndisplacement = [\"-0.9*x + 0.1*x*y\", \"0.05*x*x\"]\n{rest}"
    ))
}

#[test]
fn complex_modes_are_the_motion() {
    let damping = "[damping]\nrayleigh = [0.03, 0.004]\n";
    let strong = "[damping]\nrayleigh = [0.0, 0.05]\n";
    let load = "[[load]]\nkind = \"traction\"\nedge = \"right\"\namplitude = [0.05, 0.02]\nomega = 2.3\nphase = 0.4\n\
                [[load]]\nkind = \"gravity\"\namplitude = [0.03, -0.02]\n";
    for (contact, rest) in [
        ("method = \"penalty\"\n", damping.to_owned()),
        ("method = \"penalty\"\ngap_behind = 0.6\n", [damping, load].concat()),
        ("method = \"nitsche\"\n", [damping, load].concat()),
        ("method = \"nitsche\"\n", strong.to_owned()),
        ("method = \"nitsche\"\ntheta = 0\ngamma = 5\n", String::new()),
        ("method = \"nitsche\"\ntheta = -1\n", [damping, load].concat()),
    ] {
        let p = plate(contact, &rest);
        let exact = run(&p, Integrator::Modal);
        let steps = run(&p, Integrator::Dop853);
        assert!(exact.outcome.is_complete(), "{contact}{rest}: {}", exact.outcome);
        assert_eq!(exact.switches.len(), steps.switches.len(), "{contact}{rest}");
        assert!(exact.switches.len() >= 4, "{contact}{rest}: {}", exact.switches.len());
        assert!(exact.is_certified(), "{contact}{rest}: not certified");
        let size = steps.last.u.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let off = exact.last.u.iter().zip(&steps.last.u).map(|(a, b)| (a - b).abs());
        let off = off.fold(0.0, f64::max) / size;
        let books = [
            (exact.energy_external, steps.energy_external),
            (exact.energy_dissipated, steps.energy_dissipated),
            (exact.energy_end, steps.energy_end),
        ];
        println!(
            "{contact}{rest}: {} switches, {off:.1e}, ledger {:.1e}, {:?}",
            exact.switches.len(),
            exact.energy_drift_total,
            books
        );
        assert!(off < 1e-9, "{contact}{rest}: {off:e}");
        // work and dissipation in closed form close the ledger
        assert!(
            exact.energy_drift_total < 1e-11,
            "{contact}{rest}: {:e}",
            exact.energy_drift_total
        );
        for (a, b) in books {
            assert!((a - b).abs() < 1e-9 * steps.energy_start, "{contact}{rest}: {books:?}");
        }
    }
}

/// A body that falls on its obstacle between rollers: where it is open a load pushes a rigid motion for good, and complex modes know no steady response to that.
#[test]
fn a_body_that_falls_moves_as_without_modes() {
    for contact in
        ["method = \"nitsche\"", "method = \"penalty\"", "method = \"mass-redistribution\""]
    {
        let p = problem(&format!(
            "[body]\nkind = \"plate\"\nsize = [1.0, 0.5]\nelements = [5, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
             [[support]]\nedge = \"left\"\nfix = [\"x\"]\n[contact]\nedge = \"bottom\"\ngap = 0.02\n{contact}\n[damping]\nrayleigh = [0.2, 0.03]\n\
             [[load]]\nkind = \"traction\"\nedge = \"top\"\namplitude = [0.0, -0.1]\n\
             [[load]]\nkind = \"traction\"\nedge = \"top\"\namplitude = [0.0, 0.04]\nomega = 2.3\n"
        ));
        let (exact, stepped) = (run(&p, Integrator::Modal), run(&p, Integrator::Dop853));
        assert!(exact.outcome.is_complete(), "{contact}: {}", exact.outcome);
        assert!(exact.switches.len() > 3, "{contact}");
        assert!(relative(&exact.last.u, &stepped.last.u) < 1e-8, "{contact}");
        for of in [|r: &Report| r.energy_external, |r: &Report| r.energy_dissipated] {
            assert!((of(&exact) / of(&stepped) - 1.0).abs() < 1e-8, "{contact}");
        }
        assert!(exact.energy_drift_total < 1e-10, "{contact}: {:e}", exact.energy_drift_total);
    }
}
