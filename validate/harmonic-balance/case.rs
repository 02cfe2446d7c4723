//! Harmonic balance: against the closed form of the bar, against true orbits, and sampled beside event-resolved.
//!
//! Bar, `L = c = EA = g = 1`, `T = 3.5`: Fourier coefficients of the end displacement, `t = 0` at mid-contact,
//! `c₀ = g − 2α(T−2)²/T`, `c_k = (2αT/(π²k²)) (cos(πk t_c/T) − cos πk)`, `α = g/(2(T−3))`, `t_c = 4 − T`. The error of a solution has two parts: the
//! mesh has its own orbits, and the series is cut off; both are shown.

use std::f64::consts::{PI, TAU};

use signorini::contact::State;
use signorini::continuation::Go;
use signorini::hbm::check::series_of_orbit;
use signorini::hbm::modes::solve;
use signorini::hbm::newton::Settings;
use signorini::hbm::response::{Summary, Track, Walk, sequential};
use signorini::hbm::{Basis, Form, Quadrature, Reduction, Series, Solution};
use signorini::orbit::search::{Effort as Search, find};
use signorini::orbit::{Closure, Propagator, branch};
use signorini::problem::Problem;

use super::{Case, Check, Effort, Outcome, scene};

pub const CASE: Case = Case {
    name: "harmonic-balance",
    title: "harmonic balance: closed form of the bar, orders against true orbits, sampling",
    source: "closed form (Lu and Legrand 2022); orders and failure rates of an independent prototype",
    only_by_name: false,
    run,
};

const T: f64 = 3.5;

/// Coefficients of the end displacement with `t = 0` at the far point.
fn closed_form(count: usize) -> Vec<f64> {
    let alpha = 1.0 / (2.0 * (T - 3.0));
    let t_c = 4.0 - T;
    (0..count)
        .map(|k| match k {
            0 => 1.0 - 2.0 * alpha * (T - 2.0).powi(2) / T,
            k => {
                let x = PI * k as f64;
                let c = 2.0 * alpha * T / (x * x) * ((x * t_c / T).cos() - x.cos());
                // half a period later
                if k % 2 == 1 { -c } else { c }
            }
        })
        .collect()
}

/// Cosine coefficients of the contact displacement along a solution.
fn end_coefficients(r: &Reduction, s: &Solution, count: usize) -> Result<Vec<f64>, String> {
    let system = &r.system;
    let samples = 4000;
    let mut c = vec![0.0; count];
    for k in 0..samples {
        let theta = PI * (k as f64 + 0.5) / samples as f64;
        let (q, dq) = s.q.at(theta);
        let u = r.state(&q, &dq, s.omega).u;
        let stress: f64 = system.conditions().n_o.row_dot(0, &u);
        let end = (-stress / system.conditions().n_c[(0, 0)]).min(system.conditions().gap[0]);
        for (j, c) in c.iter_mut().enumerate() {
            let weight = if j == 0 { 1.0 } else { 2.0 } / samples as f64;
            *c += weight * end * (j as f64 * theta).cos();
        }
    }
    Ok(c)
}

/// The solution next to the continuum's motion.
fn bar_solution(n: usize, n_h: usize) -> Result<(Reduction, Solution), String> {
    let problem = Problem::new(&scene(include_str!("bar.toml"), Some(&[n]))?, None)
        .map_err(|e| e.to_string())?;
    let r = Reduction::new(problem.system, Form::Acceleration).map_err(|e| e.to_string())?;
    // u(x, t) of the continuum, sampled over half a period
    let v = 1.0 / (2.0 * T - 6.0);
    let samples = 2000;
    let mut q = Series::zeros(Basis::Cosine, n_h, r.n());
    for k in 0..samples {
        let theta = PI * (k as f64 + 0.5) / samples as f64;
        let t = theta * T / TAU;
        let u: Vec<f64> = (1..n).map(|i| displacement(i as f64 / n as f64, t, v)).collect();
        let modal = r.modal(&u);
        for j in 0..=n_h {
            let weight = if j == 0 { 1.0 } else { 2.0 } / samples as f64 * (j as f64 * theta).cos();
            q.of_mut(j).iter_mut().zip(&modal).for_each(|(q, m)| *q += weight * m);
        }
    }
    let s = solve(&r, &q, TAU / T, &Settings::default()).map_err(|e| e.to_string())?;
    let s = s.map_err(|e| format!("{n} elements, N_h = {n_h}: {e}"))?;
    Ok((r, s))
}

/// The continuum's motion from the far point, `0 ≤ t ≤ T/2`: at rest with `u = −2Vx`, then behind the front that the free
/// end sends in the body moves with `2V`, until the front has come back from the support. (The end touches shortly before
/// `T/2`; a guess may leave that to the solver.)
fn displacement(x: f64, t: f64, v: f64) -> f64 {
    // velocity 2V in |t − (1 − x)| … (1 + x): the front passes x at 1 − x and, reflected at the support, at 1 + x
    let start = 1.0 - x;
    let stop = 1.0 + x;
    let moving = (t.min(stop) - start).max(0.0);
    -2.0 * v * x + 2.0 * v * moving
}

fn bar(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let exact = closed_form(9);
    let size = exact.iter().map(|c| c * c).sum::<f64>().sqrt();
    let error = |n: usize, n_h: usize| -> Result<f64, String> {
        let (r, s) = bar_solution(n, n_h)?;
        let c = end_coefficients(&r, &s, 9)?;
        Ok(c.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / size)
    };
    let meshes: &[usize] = if effort.short { &[10, 20] } else { &[10, 20, 40] };
    for &n in meshes {
        checks.push(Check::at_most(
            format!("bar, N_h = 7, {n} elements: coefficients c₀…c₈"),
            error(n, 7)?,
            0.2,
        ));
    }
    for n_h in [1, 3, 7] {
        checks.push(Check::at_most(
            format!("bar, 20 elements, N_h = {n_h}: coefficients"),
            error(20, n_h)?,
            0.6,
        ));
    }
    Ok(())
}

fn half_plate(form: Form) -> Result<Reduction, String> {
    let scene = scene(include_str!("../../scenarios/half-plate-orbit.toml"), None)?;
    let problem = Problem::new(&scene, None).map_err(|e| e.to_string())?;
    Reduction::new(problem.system, form).map_err(|e| e.to_string())
}

/// Distance to the orbit of energy 1.04367 at 1.80 against the number of harmonics.
fn orders(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let text = |e: signorini::orbit::OrbitError| e.to_string();
    let omega = 1.8;
    let mut body =
        Propagator::new(half_plate(Form::Force)?.system.clone()).map_err(|e| e.to_string())?;
    let guess = branch::mode_guess(&body, 1, -1.1).ok_or("no mode")?;
    let verdict =
        find(&mut body, Closure::Reversible, &guess, omega, &Search::default()).map_err(text)?;
    let orbit = verdict.orbit().ok_or_else(|| verdict.to_string())?.clone();
    let harmonics: &[usize] = if effort.short { &[31, 63] } else { &[31, 63, 127] };
    let most = harmonics[harmonics.len() - 1];
    let series = series_of_orbit(&body, &orbit.z, omega, most).map_err(text)?;
    for (form, name, order) in
        [(Form::Force, "force", 0.8), (Form::Acceleration, "acceleration", 1.8)]
    {
        let r = half_plate(form)?;
        let n = r.n();
        let mut distances = vec![];
        for &n_h in harmonics {
            let mut q = Series::zeros(Basis::Cosine, n_h, n);
            for k in 0..=n_h {
                let f = if k == 0 { 0 } else { 2 * k - 1 };
                q.of_mut(k).copy_from_slice(&r.modal(&series.coefficients[f * n..(f + 1) * n]));
            }
            let s = solve(&r, &q, omega, &Settings::default()).map_err(|e| e.to_string())?;
            let s = s.map_err(|e| format!("{name} form, N_h = {n_h}: {e}"))?;
            let (x, dx) = s.q.at(0.0);
            let State { u, v } = r.state(&x, &dx, omega);
            let z = body.frame(&State { u, v });
            let d: f64 = z.iter().zip(&orbit.z).map(|(a, b)| (a - b).powi(2)).sum();
            let size: f64 = orbit.z.iter().map(|z| z * z).sum();
            distances.push((d / size).sqrt());
            checks.push(Check::at_most(
                format!("{name} form, N_h = {n_h}: distance to the orbit"),
                distances[distances.len() - 1],
                0.3,
            ));
        }
        let last = distances.len() - 1;
        let ratio = harmonics[last] as f64 / harmonics[0] as f64;
        let measured = (distances[0] / distances[last]).ln() / ratio.ln();
        checks.push(Check::at_least(format!("{name} form: order in N_h"), measured, order));
    }
    Ok(())
}

/// Sampled Newton started *at* the event-resolved solutions.
fn sampling(effort: Effort, checks: &mut Vec<Check>) -> Result<(), String> {
    let mut r = half_plate(Form::Force)?;
    let last = if effort.short { 20 } else { 46 };
    let grid: Vec<f64> = (0..=last).map(|k| 1.70 + 0.005 * f64::from(k)).collect();
    let mut tracks = vec![Track::default(); 2];
    let mut solutions = vec![];
    let settings = Settings::default();
    let walk = Walk::new(&[7], &grid, &settings);
    sequential(&mut r, &walk, &mut tracks, |_, p| {
        solutions.extend(p.solution.ok());
        Go::Continue(())
    })
    .map_err(|e| e.to_string())?;
    checks.push(Check::at_least(
        "event-resolved, N_h = 7: points",
        solutions.len() as f64,
        0.9 * grid.len() as f64,
    ));
    for samples in [256, 1024] {
        let settings = Settings { quadrature: Quadrature::Sampled(samples), ..Settings::default() };
        let (mut failed, mut worst) = (0, 0.0f64);
        for s in &solutions {
            let energy = Summary::new(&r, s).map_err(|e| e.to_string())?.energy;
            match solve(&r, &s.q, s.omega, &settings).map_err(|e| e.to_string())? {
                Err(_) => failed += 1,
                Ok(found) => {
                    let other = Summary::new(&r, &found).map_err(|e| e.to_string())?.energy;
                    worst = worst.max((other / energy - 1.0).abs());
                }
            }
        }
        let share = f64::from(failed) / solutions.len() as f64;
        // the prototype saw 14–50 %
        checks.push(Check::at_least(format!("{samples} samples: share of failures"), share, 0.02));
        checks.push(Check::at_least(
            format!("{samples} samples: error of the energy where \"converged\""),
            worst,
            1e-6,
        ));
    }
    Ok(())
}

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    bar(effort, &mut checks)?;
    orders(effort, &mut checks)?;
    sampling(effort, &mut checks)?;
    Ok(checks)
}
