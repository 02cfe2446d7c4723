//! An elastic bar bounces on a rigid floor under gravity, with period 16/3.
//!
//! Doyen, Ern and Piperno, SIAM J. Sci. Comput. 33 (2011), second one-dimensional benchmark: `L = 10`, `E = 900`, `ρ = A = 1`,
//! `g = 10`, dropped from `h₀ = 5`; `c = 30`, contact from 1 to 5/3 and from 11/3 to 13/3. Free flight with the vibration
//! that the first impact left (series `S2`), removed by the second. The largest error over all times is at the kinks of
//! the waves, which the mesh spreads over a width of the order of `h^(2/3)`.

use std::f64::consts::PI;

use super::{Case, Check, Effort, Outcome, integrate, nodal_x, order, scene};

pub const CASE: Case = Case {
    name: "bouncing-bar",
    title: "free bar bouncing under gravity, period 16/3",
    source: "Doyen, Ern, Piperno, SIAM J. Sci. Comput. 33 (2011), second 1-D benchmark",
    only_by_name: false,
    run,
};

const L: f64 = 10.0;
const C: f64 = 30.0;
const G: f64 = 10.0;
const H0: f64 = 5.0;
const TAU_W: f64 = L / C;
const TAU_F: f64 = 1.0;
const V_F: f64 = G * TAU_F;
/// Terms of the series of `S1`, whose remainder falls as `0.04/TERMS²`.
const TERMS: usize = 3000;

/// `Σ cos(nθ)/n² = π²/6 − πθ/2 + θ²/4` on `[0, 2π]`.
fn cosine_sum(theta: f64) -> f64 {
    let theta = theta.rem_euclid(2.0 * PI);
    PI * PI / 6.0 - PI * theta / 2.0 + theta * theta / 4.0
}

/// Height of the material point `x` above its place on the floor.
pub fn exact(x: f64, t: f64) -> f64 {
    let p = |t: f64| H0 - G * (t - TAU_F).powi(2) / 2.0;
    let s1 = |t: f64| -> f64 {
        let term = |n: usize| {
            let nu = (n as f64 - 0.5) * PI / L;
            -2.0 * G / (C * C * L * nu.powi(3)) * (nu * x).sin() * (1.0 - (C * nu * t).cos())
        };
        (1..=TERMS).map(term).sum()
    };
    // Σ b_n cos(λ_n x) cos(c λ_n t) with b_n = 4g/(c²λ_n²), λ_n = nπ/L, summed in closed form
    let s2 = |t: f64| {
        let (a, b) = (PI * x / L, PI * C * t / L);
        let sum = 0.5 * (cosine_sum(a - b) + cosine_sum(a + b));
        -2.0 * G * L * L / (3.0 * C * C) + 4.0 * G * L * L / (C * C * PI * PI) * sum
    };
    let h = |t: f64| -V_F * f64::min(x / C, TAU_W - (t - TAU_W).abs());
    let t1 = TAU_F;
    let (t2, t3) = (t1 + 2.0 * TAU_W, t1 + 2.0 * TAU_W + 2.0 * TAU_F);
    let t4 = t3 + 2.0 * TAU_W;
    if t < t1 {
        p(t + TAU_F)
    } else if t < t2 {
        h(t - t1) + s1(t - t1)
    } else if t < t3 {
        p(t - t2) + s2(t - t2)
    } else if t < t4 {
        h(t4 - t) + s1(t4 - t)
    } else {
        p(t - t4)
    }
}

fn run(_: Effort) -> Outcome {
    let mut checks = vec![];
    // the closed form itself against the values printed with it
    let printed = [
        (0.0, 2.0, 5.0 / 3.0),
        (0.0, 7.0 / 3.0, 40.0 / 9.0),
        (0.0, 8.0 / 3.0, 35.0 / 9.0),
        (5.0, 2.0, 35.0 / 18.0),
        (5.0, 8.0 / 3.0, 25.0 / 6.0),
        (10.0, 2.0, 25.0 / 9.0),
        (10.0, 8.0 / 3.0, 5.0),
    ];
    let series = printed.iter().map(|&(x, t, u)| (exact(x, t) - u).abs()).fold(0.0, f64::max);
    checks.push(Check::at_most("closed form: series against its printed values", series, 1e-7));
    // all are quick; from 200 elements on the exact flow goes by modes, the rigid one among them
    let meshes = [50, 100, 200, 400];
    let mut errors = vec![];
    for n in meshes {
        let mut scene = scene(include_str!("scene.toml"), Some(&[n]))?;
        if let Some(run) = &mut scene.run {
            run.samples = 4000; // the pressure jumps: its integral needs them
        }
        let (problem, report, trajectory) = integrate(&scene)?;
        let mut worst = 0.0f64;
        for (k, (&t, u)) in trajectory.t.iter().zip(&trajectory.u).enumerate() {
            if k % 40 == 0 {
                for x in [0.0, 5.0, 10.0] {
                    let node = (x / L * n as f64).round() as usize;
                    worst = worst.max((H0 + nodal_x(&problem, u, node) - exact(x, t)).abs());
                }
            }
        }
        let error = worst / H0;
        errors.push(error);
        let name = |what: &str| format!("{n} elements: {what}");
        checks.push(Check::at_most(
            name("largest error of u, over the height of fall"),
            error,
            1.8 / (n as f64).powf(2.0 / 3.0),
        ));
        let first = report.switches.first().map_or(f64::NAN, |s| (s.t - 1.0).abs());
        checks.push(Check::at_most(name("|first impact − 1|"), first, 1e-9));
        // energy with the potential of gravity: what the method loses at the impacts
        let loss = report.energy_jumps.abs() / 500.0;
        checks.push(Check::at_most(
            name("energy left at the switches, of 500"),
            loss,
            2.0 / n as f64,
        ));
        let pressure = trajectory.t.iter().zip(&trajectory.pressure);
        let impulse: f64 = pressure
            .clone()
            .zip(pressure.skip(1))
            .filter(|((_, _), (t, _))| **t < 2.5)
            .map(|((a, p), (b, q))| 0.5 * (b - a) * (p[0] + q[0]))
            .sum();
        checks.push(Check::near(
            name("impulse of the first impact"),
            impulse,
            800.0 / 3.0,
            3.0 / n as f64,
        ));
    }
    let mean = order(errors[0], errors[errors.len() - 1]) / (errors.len() - 1) as f64;
    checks.push(Check::at_least("mean order of convergence", mean, 0.5));
    Ok(checks)
}
