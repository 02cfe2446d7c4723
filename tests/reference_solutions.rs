//! Independent solutions of the nodal boundary equations (exact modal flow by other software).

mod common;

use common::{reference_problem, relative};
use signorini::event::{self, Options, Silent};
use signorini::flow::{Tolerances, by_name};
use signorini::scenario::Integrator;

#[test]
fn dop853_meets_the_reference_solutions() {
    for name in ["half-plate-10x3", "half-plate-10x3-lumped-boundary", "plate-8x4"] {
        let r = reference_problem(name);
        let nbm = &r.problem.nbm;
        let options = Options { until: r.until, samples: 10, switch_limit: 40.0, verify_lcp: true };
        let tolerances = Tolerances { rtol: 1e-10, atol: 1e-13 };
        let mut flow = by_name(Integrator::Dop853, nbm, tolerances);
        let report =
            event::run(nbm, &r.problem.initial, &options, flow.as_mut(), &mut Silent).unwrap();
        assert!(report.outcome.is_complete());
        let n_o = nbm.n_o();
        let (e_u, e_v) =
            (relative(&report.last.u, &r.u[..n_o]), relative(&report.last.v, &r.v[..n_o]));
        println!("{name}: {e_u:.2e} {e_v:.2e} {:?}", report.counters);
        println!(
            "drift {:.2e} {:.2e} {:?}",
            report.energy_drift, report.energy_drift_total, report.lcp_check
        );
        for s in &report.switches {
            println!("{:.12} {} {:?} {:.6e}", s.t, s.node, s.kind, s.energy_jump);
        }
        println!("{:?}", report.grazings);
        assert!(e_u < 1e-8 && e_v < 1e-8);
    }
}
