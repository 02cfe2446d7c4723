//! The balance of a body that is known by all modes of its open phase, solved in their coordinates `q`.
//!
//! `D_k` is diagonal, so is `Ĝ_k = Q̂ᵀD_k⁻¹Q` a sum over modes, and a guess need not be a motion of the open body under any interface terms. At an exact resonance
//! `ω_i = kω` of the open body `D_k` is singular; there the whole system is solved.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::HbmError;
use super::balance::{Balance, Quadrature};
use super::newton::{Failure, Settings, Solution, conclude, condensed, damped};
use super::receptance::{Receptance, load_series, weighted};
use super::reduction::Reduction;
use super::series::{Basis, Series};
use crate::continuation::{dot, norm};

/// `D_k` mode by mode: `ω_i² − k²ω²` and `kω · 2c_i`.
fn dynamic_stiffness(reduction: &Reduction, k: usize, omega: f64) -> (Vec<f64>, Vec<f64>) {
    let kw = k as f64 * omega;
    let modes = &reduction.open.modes;
    (
        modes.iter().map(|m| (m.omega - kw) * (m.omega + kw)).collect(),
        modes.iter().map(|m| 2.0 * m.c * kw).collect(),
    )
}

/// The parts of the equations that do not depend on the motion.
pub(super) struct Linear {
    /// Harmonic by harmonic: `ω_i² − k²ω²`, `2 c_i kω`.
    d: Vec<(Vec<f64>, Vec<f64>)>,
    /// `f_k`.
    f: Series,
    /// `Ĝ`, `ĉ`
    pub(super) receptance: Receptance,
    /// Nearest to resonance: least `|D|` over the size of its terms.
    nearness: f64,
}

/// Below this nearness the whole system is solved.
const RESONANCE: f64 = 1e-9;

impl Linear {
    pub fn new(reduction: &Reduction, n_h: usize, omega: f64) -> Linear {
        let f = load_series(reduction, n_h, &reduction.open.constant, &reduction.open.harmonics);
        let d: Vec<_> = (0..=n_h).map(|k| dynamic_stiffness(reduction, k, omega)).collect();
        let mut nearness = f64::INFINITY;
        for (k, (re, im)) in d.iter().enumerate() {
            for (i, m) in reduction.open.modes.iter().enumerate() {
                let size = m.omega.powi(2) + (k as f64 * omega).powi(2);
                // a rigid motion has no stiffness at k = 0: the whole system must be solved
                let near = if size > 0.0 { re[i].hypot(im[i]) / size } else { 0.0 };
                nearness = nearness.min(near);
            }
        }
        let g = d.iter().map(|(re, im)| {
            // 1/(re + i im) = (re − i im)/|·|²
            let inverse = |part: &[f64], sign: f64| -> Vec<f64> {
                let size = |i: usize| re[i] * re[i] + im[i] * im[i];
                part.iter().enumerate().map(|(i, x)| sign * x / size(i)).collect()
            };
            let q = reduction.q.as_ref();
            [weighted(q, &inverse(re, 1.0)), weighted(q, &inverse(im, -1.0))]
        });
        let g = g.collect();
        let mut of_f = f.clone();
        divide(&d, &mut of_f);
        let c = onto_columns(&reduction.q, &of_f);
        let receptance = Receptance::new(reduction, omega, g, c);
        Linear { d, f, receptance, nearness }
    }

    /// `D⁻¹ (f − Q n)`, function by function.
    pub fn solve(&self, reduction: &Reduction, n: &Series) -> Series {
        let mut x = self.f.clone();
        for i in 0..n.basis.len(n.n_h) {
            for (c, &nc) in n.of(i).iter().enumerate() {
                let q = reduction.q.col_as_slice(c);
                x.of_mut(i).iter_mut().zip(q).for_each(|(x, q)| *x -= q * nc);
            }
        }
        self.divide(&mut x);
        x
    }

    /// `x ← D⁻¹ x`.
    pub(super) fn divide(&self, x: &mut Series) {
        divide(&self.d, x);
    }

    /// What unit forces on mode `i` in `cos kθ` and in `sin kθ` give of its `sin kθ`: entries of `D_k⁻¹`.
    pub(super) fn sine_of(&self, k: usize, i: usize) -> (f64, f64) {
        let (re, im) = (self.d[k].0[i], self.d[k].1[i]);
        let size = re * re + im * im;
        (im / size, re / size)
    }

    /// `D x`.
    fn multiply(&self, x: &Series) -> Series {
        let mut y = x.clone();
        let modes = x.n;
        for (k, (re, im)) in self.d.iter().enumerate() {
            let (cosine, _) = x.basis.places(k);
            for i in 0..modes {
                let a = x.a[cosine * modes + i];
                if x.basis == Basis::Cosine || k == 0 {
                    y.a[cosine * modes + i] = re[i] * a;
                    continue;
                }
                let b = x.a[(cosine + 1) * modes + i];
                y.a[cosine * modes + i] = re[i] * a + im[i] * b;
                y.a[(cosine + 1) * modes + i] = re[i] * b - im[i] * a;
            }
        }
        y
    }
}

/// `x ← D⁻¹ x`
fn divide(d: &[(Vec<f64>, Vec<f64>)], x: &mut Series) {
    let modes = x.n;
    for (k, (re, im)) in d.iter().enumerate() {
        let (cosine, _) = x.basis.places(k);
        for i in 0..modes {
            let size = re[i] * re[i] + im[i] * im[i];
            let a = x.a[cosine * modes + i];
            if x.basis == Basis::Cosine || k == 0 {
                x.a[cosine * modes + i] = a * re[i] / size;
                continue;
            }
            // a cos + b sin: D (a, b) = (re a + im b, re b − im a)
            let b = x.a[(cosine + 1) * modes + i];
            x.a[cosine * modes + i] = (re[i] * a - im[i] * b) / size;
            x.a[(cosine + 1) * modes + i] = (re[i] * b + im[i] * a) / size;
        }
    }
}

/// `Bᵀ x`, function by function.
fn onto_columns(b: &Mat<f64>, x: &Series) -> Series {
    let mut y = Series::zeros(x.basis, x.n_h, b.ncols());
    for i in 0..x.basis.len(x.n_h) {
        for (c, y) in y.of_mut(i).iter_mut().enumerate() {
            *y = dot(b.col_as_slice(c), x.of(i));
        }
    }
    y
}

/// `y = Q̂ᵀ q`, function by function.
pub(super) fn project_in(reduction: &Reduction, q: &Series) -> Series {
    onto_columns(&reduction.q_in, q)
}

/// The residual `D q + Q n − f` and its size over that of its terms, in the norm of the modes' displacements.
pub(super) fn residual(
    reduction: &Reduction,
    linear: &Linear,
    q: &Series,
    n: &Series,
) -> (Series, f64) {
    let dq = linear.multiply(q);
    let mut r = dq.clone();
    let mut terms = norm(&linear.f.a);
    for i in 0..q.basis.len(q.n_h) {
        r.of_mut(i).iter_mut().zip(linear.f.of(i)).for_each(|(r, f)| *r -= f);
        for (c, &nc) in n.of(i).iter().enumerate() {
            let column = reduction.q.col_as_slice(c);
            r.of_mut(i).iter_mut().zip(column).for_each(|(r, q)| *r += q * nc);
        }
    }
    terms = terms.max(norm(&n.a)).max(reduction.stiffness_unit() * norm(&q.a));
    let size = norm(&r.a) / terms.max(f64::MIN_POSITIVE);
    (r, size)
}

/// Solve the balance at a frequency from a guess.
pub fn solve(
    reduction: &Reduction,
    guess: &Series,
    omega: f64,
    settings: &Settings,
) -> Result<Result<Solution, Failure>, HbmError> {
    let linear = Linear::new(reduction, guess.n_h, omega);
    let evaluate = |q: Series| -> Result<Whole, HbmError> {
        let y = project_in(reduction, &q);
        let balance = Balance::new(reduction, &y, omega, settings.quadrature)?;
        let (r, size) = residual(reduction, &linear, &q, &balance.n);
        Ok(Whole { q, y, balance, r, size })
    };
    let step = |at: &Whole| match settings.full || linear.nearness < RESONANCE {
        true => full_step(reduction, &linear, &at.q, &at.balance, &at.r),
        false => condensed_step(reduction, &linear, &at.q, &at.y, &at.balance),
    };
    let trial = |at: &Whole, step: &[f64], lambda: f64| {
        let mut q = at.q.clone();
        q.a.iter_mut().zip(step).for_each(|(q, s)| *q += lambda * s);
        evaluate(q)
    };
    let start = evaluate(guess.clone())?;
    let (at, iterations) = damped(start, settings, |at| at.size, step, trial);
    let Whole { q, y, balance, size, .. } = at;
    let n = balance.n.clone();
    conclude(reduction, (q, y, n), balance, (omega, size, iterations), settings)
}

/// An iterate in modal coordinates.
struct Whole {
    q: Series,
    y: Series,
    balance: Balance,
    r: Series,
    size: f64,
}

fn condensed_step(
    reduction: &Reduction,
    linear: &Linear,
    q: &Series,
    y: &Series,
    balance: &Balance,
) -> Vec<f64> {
    let n = condensed(&linear.receptance, y, balance);
    let next = linear.solve(reduction, &n);
    next.a.iter().zip(&q.a).map(|(a, b)| a - b).collect()
}

/// The Newton step of the whole system.
fn full_step(
    reduction: &Reduction,
    linear: &Linear,
    q: &Series,
    balance: &Balance,
    r: &Series,
) -> Vec<f64> {
    let (n, count) = (q.n, q.basis.len(q.n_h));
    let (rank, r_in) = (reduction.q.ncols(), reduction.q_in.ncols());
    let mut a = Mat::<f64>::zeros(n * count, n * count);
    // Q N′ Q̂ᵀ
    for k in 0..count {
        for l in 0..count {
            let block = balance.derivative.submatrix(k * rank, l * r_in, rank, r_in);
            let full = &reduction.q * (block * reduction.q_in.transpose());
            a.submatrix_mut(k * n, l * n, n, n).copy_from(&full);
        }
    }
    for (k, (re, im)) in linear.d.iter().enumerate() {
        let (cosine, _) = q.basis.places(k);
        for i in 0..n {
            let c = cosine * n + i;
            a[(c, c)] += re[i];
            if q.basis == Basis::Full && k > 0 {
                let s = c + n;
                a[(s, s)] += re[i];
                a[(c, s)] += im[i];
                a[(s, c)] -= im[i];
            }
        }
    }
    let solution = a.partial_piv_lu().solve(Mat::from_fn(n * count, 1, |i, _| -r.a[i]));
    (0..n * count).map(|i| solution[(i, 0)]).collect()
}

/// Residual and full Jacobian at a series, for tests: `(D q + Q n − f, ∂/∂q)` applied to a direction.
pub fn directional(
    reduction: &Reduction,
    q: &Series,
    direction: &Series,
    omega: f64,
    quadrature: Quadrature,
) -> Result<(Vec<f64>, Vec<f64>), HbmError> {
    let linear = Linear::new(reduction, q.n_h, omega);
    let y = project_in(reduction, q);
    let balance = Balance::new(reduction, &y, omega, quadrature)?;
    let (r, _) = residual(reduction, &linear, q, &balance.n);
    let dy = project_in(reduction, direction);
    let dn = &balance.derivative * Mat::from_fn(dy.a.len(), 1, |i, _| dy.a[i]);
    let mut change = linear.multiply(direction);
    let rank = reduction.q.ncols();
    for i in 0..q.basis.len(q.n_h) {
        for c in 0..rank {
            let x = dn[(i * rank + c, 0)];
            let column = reduction.q.col_as_slice(c);
            change.of_mut(i).iter_mut().zip(column).for_each(|(r, q)| *r += q * x);
        }
    }
    Ok((r.a, change.a))
}
