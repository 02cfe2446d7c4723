//! What must not change: units, the direction of time, symmetry, the ledger over long times.

use crate::common::{Collector, problem, reference_problem, relative, scene};
use signorini::contact::State;
use signorini::event::{self, Options, Report, Silent};
use signorini::flow::Tolerances;
use signorini::problem::Problem;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;
use signorini::simulate::simulate;

fn run_from(problem: &Problem, state: &State, until: f64, rtol: f64) -> Report {
    let options = Options { until, samples: 5, switch_limit: 40.0 };
    let mut flow =
        by_name(Integrator::Dop853, &problem.system, Tolerances { rtol, atol: 1e-3 * rtol });
    let report = event::run(&problem.system, state, &options, flow.as_mut(), &mut Silent).unwrap();
    assert!(report.outcome.is_complete() && report.proof.missed == 0);
    report
}

/// A steel plate of 20 mm with a gap of a micrometre, and the same thing in units of one.
#[test]
fn units_do_not_matter() {
    let text = |e: f64, rho: f64, l: f64, gap: f64, until: f64| {
        format!(
            "[body]\nkind = 'plate'\nsize = [{l:e}, {:e}]\nelements = [8, 4]\nyoung = {e:e}\npoisson = 0.3\n\
             density = {rho:e}\nthickness = {:e}\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
             [contact]\nedge = 'right'\ngap = {gap:e}\n[initial]\nmode = 2\namplitude = -1.4\n\
             [run]\nintegrator = 'dop853'\nuntil = {until:e}\nrtol = 1e-11\natol = 1e-14\n",
            0.5 * l,
            0.1 * l
        )
    };
    let (e, rho, l, gap) = (2.1e11, 7.8e3, 0.02, 1e-6);
    let time = l * f64::sqrt(rho / e);
    let unit = scene(&text(1.0, 1.0, 1.0, 1.0, 3.36));
    let metric = scene(&text(e, rho, l, gap, 3.36 * time));
    let run = |s| simulate(s, &Problem::new(s, None).unwrap(), false, &mut Silent).unwrap();
    let (a, b) = (run(&unit), run(&metric));
    let u: Vec<f64> = b.last.u.iter().map(|x| x / gap).collect();
    let v: Vec<f64> = b.last.v.iter().map(|x| x * time / gap).collect();
    let (eu, ev) = (relative(&u, &a.last.u), relative(&v, &a.last.v));
    println!("units: {eu:.1e} {ev:.1e}");
    assert!(eu < 1e-9 && ev < 1e-9, "{eu:e} {ev:e}");
    assert_eq!(a.switches.len(), b.switches.len());
    // the motion is symmetric: which node of a pair is told first is rounding
    for node in 0..5 {
        let of = |r: &Report, unit: f64| -> Vec<f64> {
            r.switches.iter().filter(|s| s.point == node).map(|s| s.t / unit).collect()
        };
        let (mine, other) = (of(&a, 1.0), of(&b, time));
        assert_eq!(mine.len(), other.len());
        assert!(mine.iter().zip(&other).all(|(s, r)| (s - r).abs() < 1e-9), "{mine:?} {other:?}");
    }
    // the work is the same too, but for a step that rounding may cost
    assert!(a.counters.steps.abs_diff(b.counters.steps) <= 2);
}

#[test]
fn time_runs_backwards_to_the_start() {
    for name in ["half-plate-10x3", "half-plate-10x3-lumped-boundary"] {
        let r = reference_problem(name);
        let forth = run_from(&r.problem, &r.problem.initial, r.until, 1e-12);
        let turned =
            State { u: forth.last.u.clone(), v: forth.last.v.iter().map(|v| -v).collect() };
        let back = run_from(&r.problem, &turned, r.until, 1e-12);
        let start = &r.problem.initial;
        let e = relative(&back.last.u, &start.u);
        let speed = back.last.v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        println!("{name}: back at the start to {e:.1e}, speed {speed:.1e}");
        assert!(e < 1e-9 && speed < 1e-8, "{e:e} {speed:e}");
        // what closing lost, opening gains
        assert!((back.energy_end - forth.energy_start).abs() < 1e-10);
        assert_eq!(forth.switches.len(), back.switches.len());
        for (a, b) in forth.switches.iter().zip(back.switches.iter().rev()) {
            assert!(a.point == b.point && (a.t + b.t - r.until).abs() < 1e-9);
        }
    }
}

#[test]
fn the_ledger_closes_over_a_hundred_periods() {
    let r = reference_problem("half-plate-10x3");
    // twice the amplitude: the jumps at the switches take energy, and contact must go on to the end
    let doubled = r.problem.initial.u.iter().map(|x| 2.0 * x).collect();
    let start = State { u: doubled, v: r.problem.initial.v.clone() };
    let report = run_from(&r.problem, &start, 100.0 * r.until, 1e-10);
    println!(
        "100 periods: {} switches, drift {:.1e} inside phases, {:.1e} in all",
        report.switches.len(),
        report.energy_drift,
        report.energy_drift_total
    );
    assert!(report.switches.len() > 250);
    assert!(report.energy_drift < 1e-9 && report.energy_drift_total < 1e-9);
}

/// Half a plate on rollers moves as the whole one.
#[test]
fn half_a_plate_on_rollers_is_the_whole_plate() {
    let text = |h: f64, ny: usize, mode: usize, roller: &str| {
        format!(
            "[body]\nkind = 'plate'\nsize = [1.0, {h}]\nelements = [6, {ny}]\nyoung = 1.0\npoisson = 0.3\n\
             density = 1.0\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n{roller}\
             [contact]\nedge = 'right'\ngap = 1.0\n[initial]\nmode = {mode}\namplitude = -1.4\n"
        )
    };
    let whole = problem(&text(0.5, 4, 2, ""));
    let half = problem(&text(0.25, 2, 1, "[[support]]\nedge = 'bottom'\nfix = ['y']\n"));
    let a = run_from(&whole, &whole.initial, 3.0, 1e-11);
    let b = run_from(&half, &half.initial, 3.0, 1e-11);
    let full = |p: &Problem, r: &Report| {
        let mut u = vec![0.0; p.system.n()];
        u[..p.system.n_o()].copy_from_slice(&r.last.u);
        p.system.body.dofs.scatter(&u)
    };
    let (u, w) = (full(&whole, &a), full(&half, &b));
    let contact = |p: &Problem, n: usize| p.system.body.dofs.contact.iter().any(|c| c.node == n);
    for (n, p) in half.system.body.mesh.nodes().iter().enumerate() {
        let m = whole.system.body.mesh.nearest_node([p[0], p[1] + 0.25, 0.0]);
        if !contact(&half, n) {
            let d = (u[2 * m] - w[2 * n]).abs().max((u[2 * m + 1] - w[2 * n + 1]).abs());
            assert!(d < 1e-8, "{p:?}: {d:e}");
        }
    }
    assert_eq!(a.switches.len(), 2 * b.switches.len() - 2);
}

/// Contact on the left, below or above is contact on the right, turned.
#[test]
fn the_contact_edge_may_be_any() {
    let text = |size: &str, elements: &str, held: &str, edge: &str, u: &str| {
        format!(
            "[body]\nkind = 'plate'\nsize = {size}\nelements = {elements}\nyoung = 1.0\npoisson = 0.3\n\
             density = 1.0\n[[support]]\nedge = '{held}'\nfix = ['x', 'y']\n\
             [contact]\nedge = '{edge}'\ngap = 0.5\n[initial]\ndisplacement = {u}\n[run]\nuntil = 3.0\nrtol = 1e-10\nsamples = 20\n"
        )
    };
    let run = |t: &str| {
        let s = scene(t);
        let p = Problem::new(&s, None).unwrap();
        let mut c = Collector::default();
        let r = simulate(&s, &p, false, &mut c).unwrap();
        (r, c)
    };
    let (right, states) = run(&text("[1.0, 0.5]", "[6, 3]", "left", "right", "['-x', '0.1*y*x']"));
    assert!(right.switches.len() >= 8);
    for (size, elements, held, edge, u) in [
        ("[1.0, 0.5]", "[6, 3]", "right", "left", "['1 - x', '0.1*y*(1 - x)']"),
        ("[0.5, 1.0]", "[3, 6]", "bottom", "top", "['0.1*x*y', '-y']"),
        ("[0.5, 1.0]", "[3, 6]", "top", "bottom", "['0.1*x*(1 - y)', '1 - y']"),
    ] {
        let (other, c) = run(&text(size, elements, held, edge, u));
        assert_eq!(other.switches.len(), right.switches.len(), "{edge}");
        for (a, b) in right.switches.iter().zip(&other.switches) {
            assert!((a.t - b.t).abs() < 1e-8 && a.point == b.point, "{edge}: {} {}", a.t, b.t);
        }
        let n = states.pressure.len();
        for k in 0..n {
            for (p, q) in states.pressure[k].iter().zip(&c.pressure[k]) {
                assert!((p - q).abs() < 1e-6, "{edge}: {p} {q}");
            }
        }
    }
}
