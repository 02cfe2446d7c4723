//! All orbits of the *discrete* bar with one contact a period, without time stepping.
//!
//! Contact centred at `t = 0`: `q = q_c + Φ_c (a cos ω_c t)` for `|t| < s`, `q = Φ_f (b cos ω_f (t − T/2))` elsewhere. For a given `s`
//! continuity of `q` and `q̇` at `s` is a linear system for `(a, b)`; that the gap vanishes there is one equation for `s`. All its
//! roots are found by a fine scan, the inadmissible ones struck out, and shooting must find each of the others from a nearby
//! start. Multipliers: from matrix exponentials of the first-order system and saltation in nodal coordinates.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use signorini::contact::State;
use signorini::contact::{States, System};
use signorini::orbit::search::{Effort as Search, find};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;

use super::{Case, Check, Effort, Outcome, scene};

pub const CASE: Case = Case {
    name: "bar-orbits",
    title: "every orbit of a bar with one contact in T = 3.5, against piecewise closed forms",
    source: "derived: matching of two linear phases, one scalar equation for the contact time",
    only_by_name: false,
    run,
};

const T: f64 = 3.5;
const SCAN: usize = 12_000;

/// One phase: frequencies, shapes, equilibrium, matrices, the monitor.
struct Half {
    omega: DVector<f64>,
    shapes: DMatrix<f64>,
    rest: DVector<f64>,
    dynamics: DMatrix<f64>,
    /// Monitor: gradient and offset.
    row: DVector<f64>,
    offset: f64,
}

fn half(system: &System, active: bool) -> Result<Half, String> {
    let phase = system.phase(&States::of_contact([active]));
    let (k, m) = phase.matrices();
    let n = system.n_o();
    let dense = |a: &signorini::fem::Csr| {
        let mut d = DMatrix::zeros(n, n);
        a.triplets().for_each(|(i, j, v)| d[(i, j)] = v);
        d
    };
    let (k, m) = (dense(&k), dense(&m));
    // A*ᵀ K d*
    let mut d = vec![0.0; system.n()];
    phase.expand_displacement(0.0, &vec![0.0; n], &mut d);
    let mut kd = vec![0.0; system.n()];
    system.body.stiffness.mul(&d, &mut kd);
    let mut force = DVector::zeros(n);
    for j in 0..n {
        let mut unit = vec![0.0; n];
        unit[j] = 1.0;
        let mut full = vec![0.0; system.n()];
        phase.expand(&unit, &mut full);
        force[j] = -full.iter().zip(&kd).map(|(a, b)| a * b).sum::<f64>();
    }
    let chol = m.clone().cholesky().ok_or("mass matrix")?;
    let l = chol.l();
    let inverse = l.clone().try_inverse().ok_or("mass factor")?;
    let eigen = SymmetricEigen::new(&inverse * &k * inverse.transpose());
    let omega = eigen.eigenvalues.map(|x| x.max(0.0).sqrt());
    let shapes = inverse.transpose() * &eigen.eigenvectors;
    let rest = k.clone().lu().solve(&force).ok_or("stiffness matrix")?;
    let dynamics = -chol.solve(&k);
    let zero = vec![0.0; n];
    let offset = phase.monitor_values(0.0, &zero, &zero)[0];
    let mut row = DVector::zeros(n);
    for j in 0..n {
        let mut unit = zero.clone();
        unit[j] = 1.0;
        row[j] = phase.monitor_gradient_at(&unit, &zero)[0];
    }
    Ok(Half { omega, shapes, rest, dynamics, row, offset })
}

/// Modal amplitudes for a half contact time `s`, and the gap there.
fn amplitudes(free: &Half, closed: &Half, s: f64) -> Option<(DVector<f64>, DVector<f64>, f64)> {
    let n = free.omega.len();
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    for j in 0..n {
        let (wc, wf) = (closed.omega[j], free.omega[j]);
        let (c, f) = (wc * s, wf * (s - T / 2.0));
        for i in 0..n {
            a[(i, j)] = closed.shapes[(i, j)] * c.cos();
            a[(i, n + j)] = -free.shapes[(i, j)] * f.cos();
            a[(n + i, j)] = -closed.shapes[(i, j)] * wc * c.sin();
            a[(n + i, n + j)] = free.shapes[(i, j)] * wf * f.sin();
        }
    }
    let mut b = DVector::zeros(2 * n);
    b.rows_mut(0, n).copy_from(&(&free.rest - &closed.rest));
    let x = a.lu().solve(&b)?;
    let (ac, bf) = (x.rows(0, n).into_owned(), x.rows(n, n).into_owned());
    let u = displacement(free, &bf, s - T / 2.0);
    let gap = free.row.dot(&u) + free.offset;
    Some((ac, bf, gap))
}

fn displacement(half: &Half, amplitude: &DVector<f64>, t: f64) -> DVector<f64> {
    let q = DVector::from_fn(amplitude.len(), |k, _| amplitude[k] * (half.omega[k] * t).cos());
    &half.rest + &half.shapes * q
}

/// Far-point states and contact times of all admissible orbits.
fn exact_orbits(free: &Half, closed: &Half) -> Vec<(DVector<f64>, f64)> {
    let gap = |s: f64| amplitudes(free, closed, s).map_or(f64::NAN, |x| x.2);
    let at = |k: usize| (k as f64 + 0.5) / SCAN as f64 * (T / 2.0);
    let mut found = vec![];
    let mut last = gap(at(0));
    for k in 1..SCAN {
        let now = gap(at(k));
        if last * now < 0.0 {
            let (mut low, mut high, mut value) = (at(k - 1), at(k), last);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let h = gap(middle);
                if h * value > 0.0 {
                    (low, value) = (middle, h);
                } else {
                    high = middle;
                }
            }
            let s = 0.5 * (low + high);
            // a pole changes sign too
            if let Some((a, b, h)) = amplitudes(free, closed, s)
                && h.abs() < 1e-6
                && is_admissible(free, closed, &a, &b, s)
            {
                found.push((displacement(free, &b, 0.0), 2.0 * s));
            }
        }
        last = now;
    }
    found
}

fn is_admissible(free: &Half, closed: &Half, a: &DVector<f64>, b: &DVector<f64>, s: f64) -> bool {
    let samples = 4000;
    (1..samples).all(|k| {
        let x = f64::from(k) / f64::from(samples);
        let pressure = closed.row.dot(&displacement(closed, a, x * s)) + closed.offset;
        let t = s + x * (T / 2.0 - s);
        let gap = free.row.dot(&displacement(free, b, t - T / 2.0)) + free.offset;
        pressure > -1e-9 && gap > -1e-9
    })
}

/// Multipliers of the orbit with far point `u` at `t = 0`: `E_f S_o E_c S_c E_f`.
fn multipliers(free: &Half, closed: &Half, u: &DVector<f64>, contact: f64) -> Vec<(f64, f64)> {
    let n = u.len();
    let exponential = |h: &Half, t: f64| {
        let mut a = DMatrix::zeros(2 * n, 2 * n);
        a.view_mut((0, n), (n, n)).fill_with_identity();
        a.view_mut((n, 0), (n, n)).copy_from(&h.dynamics);
        (a * t).exp()
    };
    let acceleration = |h: &Half, u: &DVector<f64>| &h.dynamics * (u - &h.rest);
    let flight = T / 2.0 - contact / 2.0;
    let e = exponential(free, flight);
    let mut x = DVector::zeros(2 * n);
    x.rows_mut(0, n).copy_from(u);
    let at_closing = &e * &x;
    let in_contact = exponential(closed, contact);
    let mut y = at_closing.clone();
    y.rows_mut(0, n).copy_from(&(at_closing.rows(0, n) - &closed.rest));
    let mut at_opening = &in_contact * y;
    let displaced = at_opening.rows(0, n) + &closed.rest;
    at_opening.rows_mut(0, n).copy_from(&displaced);
    let saltation = |x: &DVector<f64>, before: &Half, after: &Half| {
        let (u, v) = (x.rows(0, n).into_owned(), x.rows(n, n).into_owned());
        let jump = acceleration(after, &u) - acceleration(before, &u);
        let rate = before.row.dot(&v);
        let mut s = DMatrix::identity(2 * n, 2 * n);
        s.view_mut((n, 0), (n, n)).copy_from(&(jump * before.row.transpose() / rate));
        s
    };
    let close = saltation(&at_closing, free, closed);
    let open = saltation(&at_opening, closed, free);
    let m = &e * open * in_contact * close * &e;
    m.complex_eigenvalues().iter().map(|c| (c.re, c.im)).collect()
}

fn run(effort: Effort) -> Outcome {
    let mut checks = vec![];
    let meshes: &[usize] = if effort.short { &[20] } else { &[20, 80] };
    for &n in meshes {
        let scene = scene(include_str!("scene.toml"), Some(&[n]))?;
        let problem = Problem::new(&scene, None).map_err(|e| e.to_string())?;
        let (free, closed) = (half(&problem.system, false)?, half(&problem.system, true)?);
        let exact = exact_orbits(&free, &closed);
        checks.push(Check::at_least(
            format!("{n} elements: admissible orbits"),
            exact.len() as f64,
            1.0,
        ));
        let mut body = Propagator::new(problem.system).map_err(|e| e.to_string())?;
        let mut found = 0;
        let (mut residual, mut distance, mut times, mut multiplier) =
            (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for (u, contact) in &exact {
            let state = State { u: u.as_slice().to_vec(), v: vec![0.0; u.len()] };
            let z = body.frame(&state)[..u.len()].to_vec();
            let size = z.iter().map(|z| z * z).sum::<f64>().sqrt();
            // a start one part in a thousand away
            let start: Vec<f64> = z
                .iter()
                .enumerate()
                .map(|(k, z)| z + 1e-3 * size * (1.0 + k as f64).powi(-2) * (k as f64).cos())
                .collect();
            let omega = std::f64::consts::TAU / T;
            let verdict = find(&mut body, Closure::Reversible, &start, omega, &Search::default());
            let verdict = verdict.map_err(|e| e.to_string())?;
            let Some(orbit) = verdict.orbit() else { continue };
            let d: f64 = orbit.z.iter().zip(&z).map(|(a, b)| (a - b).powi(2)).sum();
            if d.sqrt() / size > 1e-3 {
                continue;
            }
            found += 1;
            residual = residual.max(orbit.residual);
            distance = distance.max(d.sqrt() / size);
            times = times.max((orbit.contact_time - contact).abs());
            let reference = multipliers(&free, &closed, u, *contact);
            if let Some(s) = &orbit.stability {
                for m in &s.multipliers[s.trivial..] {
                    let nearest = reference
                        .iter()
                        .map(|r| (r.0 - m.0).hypot(r.1 - m.1))
                        .fold(f64::INFINITY, f64::min);
                    multiplier = multiplier.max(nearest / m.0.hypot(m.1).max(1.0));
                }
            }
        }
        let name = |what: &str| format!("{n} elements: {what}");
        checks.push(Check::near(
            name("found by shooting"),
            f64::from(found),
            exact.len() as f64,
            0.0,
        ));
        checks.push(Check::at_most(name("largest residual"), residual, 1e-11));
        checks.push(Check::at_most(name("far point against the closed form"), distance, 1e-10));
        checks.push(Check::at_most(name("contact time"), times, 1e-9));
        checks.push(Check::at_most(name("multipliers"), multiplier, 1e-7));
    }
    Ok(checks)
}
