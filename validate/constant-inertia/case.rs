//! Constant inertia: the same mass in every phase keeps the energy, and costs no accuracy.
//!
//! Bars in the first nonsmooth mode ([`super::bar`]) against the closed form; expected errors: an independent prototype. And the plate of 2 × 10
//! elements without a gap, released from `u = (−x, 0)`: over 450 units of time its energy is that of the start, where the paper's mass
//! lets it grow without bound.

use super::bar::error_at_half_period;
use super::{Case, Check, Effort, Outcome, integrate, order, scene};
use signorini::problem::Problem;
use signorini::scenario::{Inertia, Scene};

pub const CASE: Case = Case {
    name: "constant-inertia",
    title: "constant inertia: accuracy on bars, energy of a plate that the paper's mass lets explode",
    source: "closed form of the bar; conservation",
    only_by_name: false,
    run,
};

const EXPECTED: [(usize, f64); 6] =
    [(10, 4.87e-2), (20, 1.91e-2), (40, 8.95e-3), (80, 3.84e-3), (160, 2.10e-3), (320, 1.09e-3)];

fn constant(scene: &mut Scene) {
    if let Some(contact) = &mut scene.contact {
        contact.inertia = Some(Inertia::Constant);
    }
}

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    let mut errors = vec![];
    for &(n, expected) in &EXPECTED[..if effort.short { 5 } else { 6 }] {
        let mut scene = scene(include_str!("../bar/scene.toml"), Some(&[n]))?;
        constant(&mut scene);
        let (problem, report, trajectory) = integrate(&scene)?;
        let error = error_at_half_period(&problem, &trajectory, n);
        errors.push(error);
        checks.push(Check::near(format!("bar, {n} elements: error at T/2"), error, expected, 0.02));
        let jumps = report.energy_jumps.abs() / report.energy_start;
        checks.push(Check::at_most(format!("bar, {n} elements: energy jumps"), jumps, 1e-13));
    }
    let orders = (errors.len() - 1) as f64;
    let mean = order(errors[0], errors[errors.len() - 1]) / orders;
    checks.push(Check::at_least("bar: mean order of convergence", mean, 0.95));

    let mut plate = scene(include_str!("plate.toml"), None)?;
    let ratio = Problem::new(&plate, None).map_err(|e| e.to_string())?.system.mass_ratio();
    let ratio = ratio.map_err(|e| e.to_string())?;
    checks.push(Check::near("plate 2 × 10: jump of the paper's mass, μ", ratio, 63.9, 1e-3));
    let (_, report, _) = integrate(&plate)?;
    let growth = report.energy_end / report.energy_start;
    checks.push(Check::at_least("plate 2 × 10, t = 450: energy, paper's mass", growth, 1e3));
    constant(&mut plate);
    let (_, report, _) = integrate(&plate)?;
    let change = (report.energy_end / report.energy_start - 1.0).abs();
    checks.push(Check::at_most("plate 2 × 10, t = 450: energy change, constant", change, 1e-7));
    Ok(checks)
}
