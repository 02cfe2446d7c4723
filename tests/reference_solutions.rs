//! Independent solutions of the nodal boundary equations (exact modal flow by other software).

use crate::common::{Reference, reference_problem, relative};
use signorini::contact::States;
use signorini::contact::phase_modes;
use signorini::event::{self, Options, Report, Silent, Verified};
use signorini::flow::Tolerances;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

const NAMES: [&str; 3] = ["half-plate-10x3", "half-plate-10x3-lumped-boundary", "plate-8x4"];

fn run(r: &Reference, integrator: Integrator, rtol: f64) -> Report {
    let options = Options { until: r.until, samples: 10, switch_limit: 40.0 };
    let tolerances = Tolerances { rtol, atol: 1e-3 * rtol };
    let mut flow = by_name(integrator, &r.problem.system, tolerances);
    let initial = &r.problem.initial;
    let (system, mut silent) = (&r.problem.system, Silent);
    let mut verified = Verified::new(system, &mut silent);
    let mut report = event::run(system, initial, &options, flow.as_mut(), &mut verified).unwrap();
    report.lcp_check = Some(verified.check);
    assert!(report.outcome.is_complete());
    assert_eq!(report.proof.missed, 0);
    report
}

/// Relative error of the final state `(u_O, v_O)`, velocities over the first axial frequency.
fn error(r: &Reference, report: &Report) -> f64 {
    let n_o = r.problem.system.n_o();
    let omega = r.omega_open[0];
    let state = |u: &[f64], v: &[f64]| -> Vec<f64> {
        u.iter().copied().chain(v.iter().map(|v| v / omega)).collect()
    };
    relative(&state(&report.last.u, &report.last.v), &state(&r.u[..n_o], &r.v[..n_o]))
}

#[test]
fn dop853_meets_the_reference_solutions() {
    for name in NAMES {
        let r = reference_problem(name);
        let report = run(&r, Integrator::Dop853, 1e-10);
        let e = error(&r, &report);
        println!("{name}: error {e:.2e}, {:?}", report.counters);
        assert!(e < 1e-8, "{name}: {e}");

        // switches in the reference's order; nodes that switch together come one after the other
        let mut found = report.switches.iter();
        for expected in &r.switches {
            let mut jump = 0.0;
            let mut heights = vec![];
            for _ in &expected.y {
                let s = found.next().unwrap();
                assert!((s.t - expected.t).abs() < 1e-9, "{name}: {} {}", s.t, expected.t);
                assert_eq!(s.kind.name(), expected.kind);
                heights.push(r.problem.system.body.mesh.nodes()[s.node][1]);
                jump += s.energy_jump;
            }
            heights.sort_by(f64::total_cmp);
            assert_eq!(heights, expected.y);
            assert!((jump - expected.energy_jump).abs() < 1e-9, "{name}: {jump}");
        }
        assert!(found.next().is_none());
        assert!((report.energy_start - r.energy.0).abs() < 1e-12);
        assert!((report.energy_end - r.energy.1).abs() < 1e-9);
        let check = report.lcp_check.unwrap();
        assert!(check.enumeration.unwrap() < 1e-12 && check.interior_point < 1e-6, "{check:?}");
        assert_eq!(check.gave_up, 0);
    }
}

#[test]
fn errors_fall_with_the_tolerance_for_both_methods() {
    let r = reference_problem("half-plate-10x3");
    for (integrator, ladder) in
        [(Integrator::Dopri5, [1e-6, 1e-8, 1e-10]), (Integrator::Dop853, [1e-6, 1e-9, 1e-12])]
    {
        let errors = ladder.map(|rtol| error(&r, &run(&r, integrator, rtol)));
        println!("{integrator:?}: {errors:?}");
        assert!(errors[1] < 0.1 * errors[0] && errors[2] < 0.1 * errors[1], "{errors:?}");
        assert!(errors[2] < 300.0 * ladder[2], "{errors:?}");
    }
}

#[test]
fn frequencies_of_the_open_and_the_closed_body() {
    for name in NAMES {
        let r = reference_problem(name);
        let system = &r.problem.system;
        let n_c = system.n_contact();
        for (set, expected) in
            [(States::open(n_c), &r.omega_open), (States::closed(n_c), &r.omega_closed)]
        {
            let phase = system.phase(&set);
            let modes = phase_modes(system, &phase, expected.len()).unwrap();
            for (a, b) in modes.omega.iter().zip(expected) {
                assert!((a / b - 1.0).abs() < 1e-11, "{name}: {a} {b}");
            }
        }
    }
}

/// The exact flow meets them to rounding error.
#[test]
fn exact_flows_meet_the_reference_solutions() {
    for (name, integrator) in
        NAMES.iter().flat_map(|n| [Integrator::Modal, Integrator::Chebyshev].map(|i| (n, i)))
    {
        let r = reference_problem(name);
        let report = run(&r, integrator, 1e-10);
        let e = error(&r, &report);
        println!(
            "{name}: error {e:.2e}, {:?}, drift {:.1e}",
            report.counters, report.energy_drift_total
        );
        assert!(e < 1e-11, "{name}: {e}");
        let count: usize = r.switches.iter().map(|s| s.y.len()).sum();
        assert_eq!(report.switches.len(), count);
        for expected in &r.switches {
            let near = report.switches.iter().map(|s| (s.t - expected.t).abs());
            assert!(near.fold(f64::INFINITY, f64::min) < 1e-11);
        }
        assert!(report.energy_drift_total < 1e-11);
    }
}
