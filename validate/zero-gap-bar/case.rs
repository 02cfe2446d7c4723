//! The bar without a gap, released from a uniform strain: period 3, contact from 1 to 2 (`L = c = 1`).
//!
//! The closed form is that of GetFEM's demonstration of one-dimensional dynamic contact. The nodal boundary method
//! starts with a strained end that must be free of stress: a kink that travels,
//! which the mesh's dispersion spreads over a width of the order of `h^(2/3)`: that is the rate of convergence.

use super::{Case, Check, Effort, Outcome, integrate, nodal_x, order, scene};

pub const CASE: Case = Case {
    name: "zero-gap-bar",
    title: "bar without a gap, period 3",
    source: "closed form of GetFEM's dynamic contact demonstration in one dimension",
    only_by_name: false,
    run,
};

/// The displacement away from the obstacle at `x = 0`.
pub fn exact(x: f64, t: f64) -> f64 {
    let t = t % 3.0;
    let s = t % 1.0;
    if t < 1.0 {
        f64::min((1.0 - x) / 2.0, (1.0 - s) / 2.0)
    } else if t < 2.0 {
        match (x >= s, s <= 1.0 - x) {
            (true, true) => -s / 2.0,
            (false, true) => -x / 2.0,
            (true, false) => (x - 1.0) / 2.0,
            (false, false) => (s - 1.0) / 2.0,
        }
    } else {
        f64::min(s / 2.0, (1.0 - x) / 2.0)
    }
}

fn run(effort: Effort) -> Outcome {
    let meshes: &[usize] = if effort.short { &[20, 40, 80] } else { &[20, 40, 80, 160] };
    let mut checks = vec![];
    let mut errors = vec![];
    for &n in meshes {
        let scene = scene(include_str!("scene.toml"), Some(&[n]))?;
        let (problem, report, trajectory) = integrate(&scene)?;
        let (mut distance, mut size) = (0.0, 0.0);
        for (&t, u) in trajectory.t.iter().zip(&trajectory.u) {
            for node in 0..=n {
                let e = exact(node as f64 / n as f64, t);
                distance += (nodal_x(&problem, u, node) - e).powi(2);
                size += e * e;
            }
        }
        let error = f64::sqrt(distance / size);
        errors.push(error);
        checks.push(Check::at_most(
            format!("{n} elements: displacement over a period, relative"),
            error,
            0.36 / (n as f64).powf(2.0 / 3.0),
        ));
        let first = report.switches.first().map_or(f64::NAN, |s| (s.t - 1.0).abs());
        checks.push(Check::at_most(format!("{n} elements: |t_close − 1|"), first, 1e-3 / n as f64));
        checks.push(Check::near(
            format!("{n} elements: switches"),
            report.switches.len() as f64,
            2.0,
            0.0,
        ));
    }
    let mean = order(errors[0], errors[errors.len() - 1]) / (errors.len() - 1) as f64;
    checks.push(Check::at_least("mean order of convergence", mean, 0.65));
    Ok(checks)
}
