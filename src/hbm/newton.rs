//! Newton's method on the balance, condensed on the interface.
//!
//! With `N(y)` the projections and `N′` their derivative, a Newton step on `D q + Q N(Q̂ᵀq) = f` is
//!
//! ```text
//! (I + N′ Ĝ) n = N + N′ (ĉ − y),    Ĝ_k = Q̂ᵀ D_k⁻¹ Q,    ĉ_k = Q̂ᵀ D_k⁻¹ f_k,    q_k = D_k⁻¹ (f_k − Q n_k)
//! ```
//!
//! (Woodbury): exact, with `r` unknowns a function. At an exact resonance `ω_i = kω` of the open body `D_k` is singular; there the
//! whole system is solved.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::HbmError;
use super::balance::{Balance, Crossing, Quadrature, project_in};
use super::reduction::Reduction;
use super::series::{Basis, Series};
use crate::contact::ActiveSet;
use crate::continuation::norm;

/// Limits and choices of a solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How projections are computed.
    pub quadrature: Quadrature,
    /// Most Newton steps.
    pub iterations: usize,
    /// Residual over the size of its terms.
    pub tolerance: f64,
    /// Solve the whole system even where it could be condensed (for tests).
    pub full: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            quadrature: Quadrature::EventResolved,
            iterations: 25,
            tolerance: 1e-12,
            full: false,
        }
    }
}

/// A converged series.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Frequency.
    pub omega: f64,
    /// Modal coordinates of the open phase.
    pub q: Series,
    /// Residual over the size of its terms.
    pub residual: f64,
    /// Newton steps.
    pub iterations: usize,
    /// Switches on the interval of the balance.
    pub crossings: Vec<Crossing>,
    /// Active sets between them.
    pub sets: Vec<ActiveSet>,
    /// Touches that may be crossings, and were taken for none.
    pub undecided: usize,
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// The iteration did not converge.
    NotConverged {
        /// Least residual.
        residual: f64,
        /// Newton steps.
        iterations: usize,
    },
    /// It converged to a motion without contact.
    NoContact,
    /// It converged along active sets that are not those of the contact conditions.
    Inadmissible {
        /// Phase angle at which they are not.
        theta: f64,
    },
    /// There was nothing to start from.
    NoStart,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Failure::NotConverged { residual, iterations } => {
                write!(f, "not converged: residual {residual:.1e} after {iterations} steps")
            }
            Failure::NoContact => write!(f, "a motion without contact"),
            Failure::Inadmissible { theta } => {
                write!(f, "the active sets violate the contact conditions at phase {theta:.6}")
            }
            Failure::NoStart => write!(f, "no solution with fewer harmonics to start from"),
        }
    }
}

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
    /// `Ĝ_k`: for cosine functions alone `r_in × r`; with damping the four parts of the pair (cos, sin).
    g: Vec<[Mat<f64>; 2]>,
    /// Nearest to resonance: least `|D|` over the size of its terms.
    nearness: f64,
}

/// Below this nearness the whole system is solved.
const RESONANCE: f64 = 1e-9;

impl Linear {
    pub fn new(reduction: &Reduction, basis: Basis, n_h: usize, omega: f64) -> Linear {
        let n = reduction.n();
        let mut f = Series::zeros(basis, n_h, n);
        f.of_mut(0).copy_from_slice(&reduction.open.constant);
        for (load, forces) in reduction.system.loads.harmonics.iter().zip(&reduction.open.harmonics)
        {
            let (sin, cos) = load.angle().sin_cos();
            let (sin, cos) = (load.size() * sin, load.size() * cos);
            if n_h >= 1 {
                f.of_mut(1).iter_mut().zip(forces).for_each(|(x, p)| *x += cos * p);
                if basis == Basis::Full {
                    f.of_mut(2).iter_mut().zip(forces).for_each(|(x, p)| *x -= sin * p);
                }
            }
        }
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
        let (r, r_in) = (reduction.q.ncols(), reduction.q_in.ncols());
        let g = d
            .iter()
            .map(|(re, im)| {
                // 1/(re + i im) = (re − i im)/|·|²
                let part = |values: &[f64]| {
                    Mat::from_fn(r_in, r, |a, b| {
                        (0..n)
                            .map(|i| {
                                let size = re[i] * re[i] + im[i] * im[i];
                                reduction.q_in[(i, a)] * values[i] / size * reduction.q[(i, b)]
                            })
                            .sum()
                    })
                };
                let second = if basis == Basis::Full { part(im) } else { Mat::zeros(0, 0) };
                [part(re), second]
            })
            .collect();
        Linear { d, f, g, nearness }
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
        let modes = x.n;
        for (k, (re, im)) in self.d.iter().enumerate() {
            let cosine = if x.basis == Basis::Cosine || k == 0 { k } else { 2 * k - 1 };
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
            let cosine = if x.basis == Basis::Cosine || k == 0 { k } else { 2 * k - 1 };
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

    /// `N′ Ĝ`: columns of `N′` taken together as `Ĝ` takes them.
    pub(super) fn times_g(
        &self,
        reduction: &Reduction,
        derivative: &Mat<f64>,
        basis: Basis,
        n_h: usize,
    ) -> Mat<f64> {
        let (r, r_in) = (reduction.q.ncols(), reduction.q_in.ncols());
        let count = basis.len(n_h);
        let mut out = Mat::<f64>::zeros(derivative.nrows(), count * r);
        let mut add = |function: usize, block: Mat<f64>| {
            let mut target = out.subcols_mut(function * r, r);
            target += block;
        };
        for (k, [re, im]) in self.g.iter().enumerate() {
            let columns = |function: usize| derivative.subcols(function * r_in, r_in);
            if basis == Basis::Cosine || k == 0 {
                add(k, columns(k) * re);
                continue;
            }
            let (c, s) = (2 * k - 1, 2 * k);
            // y_c = re n_c − im n_s,  y_s = re n_s + im n_c
            add(c, columns(c) * re + columns(s) * im);
            add(s, columns(s) * re - columns(c) * im);
        }
        out
    }

    /// `ĉ = Q̂ᵀ D⁻¹ f`.
    fn c_hat(&self, reduction: &Reduction) -> Series {
        let mut x = self.f.clone();
        self.divide(&mut x);
        project_in(reduction, &x)
    }
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
    let linear = Linear::new(reduction, guess.basis, guess.n_h, omega);
    let mut q = guess.clone();
    let evaluate = |q: &Series| -> Result<(Series, Balance, Series, f64), HbmError> {
        let y = project_in(reduction, q);
        let balance = Balance::new(reduction, q, &y, omega, settings.quadrature)?;
        let (r, size) = residual(reduction, &linear, q, &balance.n);
        Ok((y, balance, r, size))
    };
    let (mut y, mut balance, mut r, mut size) = evaluate(&q)?;
    let mut iterations = 0;
    while iterations < settings.iterations {
        if size <= 1e-15 || !size.is_finite() {
            break;
        }
        let step = if settings.full || linear.nearness < RESONANCE {
            full_step(reduction, &linear, &q, &balance, &r)
        } else {
            condensed_step(reduction, &linear, &q, &y, &balance)
        };
        if step.iter().any(|s| !s.is_finite()) {
            break;
        }
        iterations += 1;
        let mut best = None;
        // far from the solution a whole step may raise the residual twofold: switches come and go there, and the residual has kinks
        let mut lambda = 1.0;
        while lambda > 1e-2 {
            let mut trial = q.clone();
            trial.a.iter_mut().zip(&step).for_each(|(q, s)| *q += lambda * s);
            if let Ok(there) = evaluate(&trial)
                && (there.3 < size || (lambda == 1.0 && there.3 < 2.0 * size && size > 1e-6))
            {
                best = Some((trial, there));
                break;
            }
            lambda *= 0.5;
        }
        let Some((next, there)) = best else { break };
        let ended = there.3 <= settings.tolerance && there.3 > 0.1 * size;
        q = next;
        (y, balance, r, size) = there;
        if ended {
            break;
        }
    }
    if size > settings.tolerance || size.is_nan() {
        return Ok(Err(Failure::NotConverged { residual: size, iterations }));
    }
    if balance.crossings.is_empty() && reduction.basis == Basis::Cosine {
        return Ok(Err(Failure::NoContact));
    }
    if settings.quadrature == Quadrature::EventResolved
        && let Some(theta) = inadmissible(reduction, &q, omega, &balance)?
    {
        return Ok(Err(Failure::Inadmissible { theta }));
    }
    let Balance { crossings, sets, undecided, .. } = balance;
    Ok(Ok(Solution { omega, q, residual: size, iterations, crossings, sets, undecided }))
}

/// A phase angle at which the complementarity problem, solved anew, has another active set than the walk along the series; asked in the
/// middle of every phase.
pub(super) fn inadmissible(
    reduction: &Reduction,
    q: &Series,
    omega: f64,
    balance: &Balance,
) -> Result<Option<f64>, HbmError> {
    let bound = |j: usize| match j {
        0 => 0.0,
        j => balance.crossings.get(j - 1).map_or(q.basis.end(), |c| c.theta),
    };
    for (j, set) in balance.sets.iter().enumerate() {
        let (a, b) = (bound(j), bound(j + 1));
        // switches at one time have nothing between them
        if b - a <= 1e-9 {
            continue;
        }
        let theta = 0.5 * (a + b);
        let (x, dx) = q.at(theta);
        let state = reduction.state(&x, &dx, 1.0);
        let t = theta / omega;
        let there = reduction.system.select(t, &state.u, set)?;
        let differs =
            |c: usize| there.set.is_active(c) != set.is_active(c) && !there.degenerate.contains(&c);
        if (0..reduction.system.n_contact()).any(differs) {
            return Ok(Some(theta));
        }
    }
    Ok(None)
}

fn condensed_step(
    reduction: &Reduction,
    linear: &Linear,
    q: &Series,
    y: &Series,
    balance: &Balance,
) -> Vec<f64> {
    let (basis, n_h) = (q.basis, q.n_h);
    let mut a = linear.times_g(reduction, &balance.derivative, basis, n_h);
    let size = a.nrows();
    for i in 0..size {
        a[(i, i)] += 1.0;
    }
    let c = linear.c_hat(reduction);
    let shift = Mat::from_fn(c.a.len(), 1, |i, _| c.a[i] - y.a[i]);
    let rhs = Mat::from_fn(size, 1, |i, _| balance.n.a[i]) + &balance.derivative * shift;
    let solution = a.partial_piv_lu().solve(&rhs);
    let mut n = balance.n.clone();
    n.a.iter_mut().enumerate().for_each(|(i, n)| *n = solution[(i, 0)]);
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
        let cosine = if q.basis == Basis::Cosine || k == 0 { k } else { 2 * k - 1 };
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
    let linear = Linear::new(reduction, q.basis, q.n_h, omega);
    let y = project_in(reduction, q);
    let balance = Balance::new(reduction, q, &y, omega, quadrature)?;
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

/// The condensed residual `n − N(ĉ − Ĝ n)` with its Jacobian, for continuation in `(n, ω)`.
pub(super) fn condensed_residual(
    reduction: &Reduction,
    n: &Series,
    omega: f64,
) -> Result<(Vec<f64>, Mat<f64>, Series, Balance), HbmError> {
    let linear = Linear::new(reduction, n.basis, n.n_h, omega);
    let q = linear.solve(reduction, n);
    let y = project_in(reduction, &q);
    let balance = Balance::new(reduction, &q, &y, omega, Quadrature::EventResolved)?;
    let r = n.a.iter().zip(&balance.n.a).map(|(a, b)| a - b).collect();
    let mut j = linear.times_g(reduction, &balance.derivative, n.basis, n.n_h);
    for i in 0..j.nrows() {
        j[(i, i)] += 1.0;
    }
    Ok((r, j, q, balance))
}
