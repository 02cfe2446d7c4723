//! The uniform bar in its first nonsmooth mode, `cT/L = 3.36` (`L = c = EA = g = 1`).
//!
//! Closed form, `V = g/(2T − 6)`: released at rest from `u = −2Vx`; the end touches at `t = T/2 − (4−T)/2 = 1.36` and leaves at 2;
//! at `T/2`, `u = 2Vx` for `x < T/2 − 1`, then `2V(T − 2 − x)`. The nodal boundary method converges to it at
//! first order with exactly two switches a period. Expected errors at `T/2` (root mean square over the interior nodes,
//! relative): an independent prototype.

use super::{Case, Check, Effort, Outcome, Trajectory, integrate, nodal_x, order, scene};
use signorini::problem::Problem;

pub const CASE: Case = Case {
    name: "bar",
    title: "uniform bar, first nonsmooth mode, against the mesh size",
    source: "closed form; agrees with Lu and Legrand, Nonlinear Dynamics 107 (2022)",
    only_by_name: false,
    run,
};

const T: f64 = 3.36;
const EXPECTED: [(usize, f64); 6] =
    [(10, 4.85e-2), (20, 1.92e-2), (40, 9.23e-3), (80, 4.45e-3), (160, 2.31e-3), (320, 1.14e-3)];

/// Displacement at `T/2`.
fn half_period(x: f64) -> f64 {
    let v = 1.0 / (2.0 * T - 6.0);
    if x < T / 2.0 - 1.0 { 2.0 * v * x } else { 2.0 * v * (T - 2.0 - x) }
}

/// Root mean square of the error at `T/2` over the interior nodes, relative.
pub fn error_at_half_period(problem: &Problem, trajectory: &Trajectory, n: usize) -> f64 {
    let u = trajectory.at(T / 2.0);
    let (mut distance, mut size) = (0.0, 0.0);
    for node in 1..n {
        let exact = half_period(node as f64 / n as f64);
        distance += (nodal_x(problem, u, node) - exact).powi(2);
        size += exact * exact;
    }
    f64::sqrt(distance / size)
}

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    let mut errors = vec![];
    let cases = if effort.short { &EXPECTED[..5] } else { &EXPECTED[..] };
    for &(n, expected) in cases {
        let scene = scene(include_str!("scene.toml"), Some(&[n]))?;
        let (problem, report, trajectory) = integrate(&scene)?;
        let error = error_at_half_period(&problem, &trajectory, n);
        errors.push(error);
        checks.push(Check::near(format!("{n} elements: error at T/2"), error, expected, 0.02));
        checks.push(Check::near(
            format!("{n} elements: switches"),
            report.switches.len() as f64,
            2.0,
            0.0,
        ));
        if let [close, open] = &report.switches[..] {
            // the first impact meets a straight wave front; the release follows a front that has
            // crossed the mesh and is spread over a width of the order of h^(2/3)
            let h = 1.0 / n as f64;
            checks.push(Check::at_most(
                format!("{n} elements: |t_close − 1.36|"),
                (close.t - 1.36).abs(),
                0.35 * h * h,
            ));
            checks.push(Check::at_most(
                format!("{n} elements: |t_open − 2|"),
                (open.t - 2.0).abs(),
                0.27 * h.powf(2.0 / 3.0),
            ));
        }
    }
    let orders = (errors.len() - 1) as f64;
    let mean = order(errors[0], errors[errors.len() - 1]) / orders;
    checks.push(Check::at_least("mean order of convergence", mean, 0.95));
    Ok(checks)
}
