//! Two bar elements, one degree of freedom: `u_C = min(g, u_1)`, both phases harmonic oscillators.
//!
//! With `E = ρ = A = h = 1`: open `M = 4/3`, `K = 1` (the second element moves along rigidly); closed `M = 2/3`,
//! `K = 2`, equilibrium `g/2`. The velocity is continuous at `u_1 = g`, so the motion is pieced together in closed form.

use super::{Case, Check, Effort, Outcome, integrate, scene};

pub const CASE: Case = Case {
    name: "oscillator",
    title: "two-element bar against the closed form of its one degree of freedom",
    source: "pencil and paper: matching of two harmonic oscillators",
    only_by_name: false,
    run,
};

const GAP: f64 = 0.5;

/// State `(u, v)` at `t` and the switching times before it, from rest at `u = −a`, `a > g`.
pub fn closed_form(a: f64, t: f64) -> ((f64, f64), Vec<f64>) {
    let (wf, wc) = (0.75f64.sqrt(), 3f64.sqrt());
    // free flight is symmetric about the far point; it lasts 2 t1, contact 2 t2
    let t1 = (-GAP / a).acos() / wf;
    let v = a * wf * (wf * t1).sin();
    let b = (GAP / 2.0).hypot(v / wc);
    let t2 = (GAP / 2.0 / b).acos() / wc;
    let period = 2.0 * (t1 + t2);
    let mut switches = vec![];
    let mut k = 0.0;
    while k * period <= t {
        switches.extend([k * period + t1, k * period + t1 + 2.0 * t2].iter().filter(|s| **s <= t));
        k += 1.0;
    }
    let phase = t % period;
    let state = if phase <= t1 || phase >= t1 + 2.0 * t2 {
        let s = if phase <= t1 { phase } else { phase - period };
        (-a * (wf * s).cos(), a * wf * (wf * s).sin())
    } else {
        let s = phase - t1 - t2;
        (GAP / 2.0 + b * (wc * s).cos(), -b * wc * (wc * s).sin())
    };
    (state, switches)
}

fn run(_: Effort) -> Outcome {
    let scene = scene(include_str!("scene.toml"), None)?;
    let (problem, report, trajectory) = integrate(&scene)?;
    let a = -problem.initial.u[0];
    let ((u, v), switches) = closed_form(a, report.t_end);
    let state = (report.last.u[0] - u).abs().max((report.last.v[0] - v).abs());
    let times = report.switches.iter().zip(&switches).map(|(s, t)| (s.t - t).abs());
    let worst_time = times.fold(0.0, f64::max);
    let worst_state = trajectory
        .t
        .iter()
        .zip(&trajectory.u)
        .map(|(&t, state)| (state[0] - closed_form(a, t).0.0).abs())
        .fold(0.0, f64::max);
    Ok(vec![
        Check::at_most("final state", state, 1e-10),
        Check::at_most("displacement at every stored state", worst_state, 1e-10),
        Check::near("switches", report.switches.len() as f64, switches.len() as f64, 0.0),
        Check::at_most("switching times", worst_time, 1e-10),
        Check::at_most("energy drift", report.energy_drift_total, 1e-11),
    ])
}
