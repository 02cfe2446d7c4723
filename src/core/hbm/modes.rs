//! The balance of a body that is known by all modes of its open phase, solved in their coordinates `q`.
//!
//! `D_k` is diagonal, so is `Ĝ_k = Q̂ᵀD_k⁻¹Q` a sum over modes, and a guess need not be a motion of the open body under any interface terms. At an exact resonance
//! `ω_i = kω` of the open body `D_k` is singular; there the whole system is solved.

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};

use super::HbmError;
use super::balance::{Balance, Quadrature};
use super::impedance::Impedance;
use super::newton::{Settings, conclude, condensed, damped, on_terms};
use super::receptance::{Receptance, Rigid, load_series};
use super::reduction::Reduction;
use super::rubbing::Along;
use super::series::Series;
use super::solution::{Ended, Solution};
use crate::continuation::{dot, norm};
use crate::records::GapReason;

/// The parts of the equations that do not depend on the motion.
pub(super) struct Linear {
    /// Harmonic by harmonic.
    d: Vec<Impedance>,
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
        let open = &reduction.open;
        // where their positions are unknowns, rigid motions are held by a spring that has no force in a solution
        let rigid: Vec<usize> = match reduction.has_unknown_forces() {
            true => reduction.rigid().collect(),
            false => vec![],
        };
        let held = (&rigid[..], reduction.stiffness_unit());
        let impedance = |k: usize| match k {
            0 => Impedance::at_rest(open, held),
            _ => Impedance::new(open, k as f64 * omega),
        };
        let d: Vec<_> = (0..=n_h).map(impedance).collect();
        let mut nearness = f64::INFINITY;
        for (k, d) in d.iter().enumerate() {
            let moving = open.modes[..open.frozen().start].iter().enumerate();
            for (i, m) in moving.filter(|(i, _)| k > 0 || !rigid.contains(i)) {
                let size = m.omega.powi(2) + (k as f64 * omega).powi(2);
                nearness = nearness.min(d.nearness(i, size));
            }
        }
        let g = d.iter().map(|d| d.receptance(&reduction.q)).collect();
        let mut of_f = f.clone();
        divide(&d, &mut of_f);
        let c = onto_columns(&reduction.q, &of_f);
        let mut receptance = Receptance::new(reduction, omega, g, c);
        receptance.rigid = Rigid::of(&reduction.q, &rigid, f.of(0));
        Linear { d, f, receptance, nearness }
    }

    /// `D⁻¹ (f − Q n)`, function by function.
    pub fn solve(&self, reduction: &Reduction, n: &Series) -> Series {
        let mut x = self.f.clone();
        push(reduction, n, &mut x);
        self.divide(&mut x);
        x
    }

    /// `x ← D⁻¹ x`.
    pub(super) fn divide(&self, x: &mut Series) {
        divide(&self.d, x);
    }

    /// What unit forces on each column of `Q` in `cos kθ` and in `sin kθ` give of the `sin kθ` of `rᵀq`.
    pub(super) fn sines_of(&self, k: usize, r: &[f64], reduction: &Reduction) -> Vec<(f64, f64)> {
        let row = self.d[k].row_of_answers(r, &reduction.q);
        row.into_iter().map(|x| (-x.im, x.re)).collect()
    }

    /// `D x`.
    fn multiply(&self, x: &Series) -> Series {
        let mut y = x.clone();
        by_harmonic(&self.d, &mut y, Impedance::multiply);
        y
    }
}

/// `x ← x − Q n`
pub(super) fn push(reduction: &Reduction, n: &Series, x: &mut Series) {
    for i in 0..n.basis.len(n.n_h) {
        for (c, &nc) in n.of(i).iter().enumerate() {
            let q = reduction.q.col_as_slice(c);
            x.of_mut(i).iter_mut().zip(q).for_each(|(x, q)| *x -= q * nc);
        }
    }
}

/// `x ← D⁻¹ x`
pub(super) fn divide(d: &[Impedance], x: &mut Series) {
    by_harmonic(d, x, Impedance::divide);
}

/// Let each harmonic's matrix act on its pair `a − ib`.
fn by_harmonic(d: &[Impedance], x: &mut Series, act: impl Fn(&Impedance, &mut [c64])) {
    for (k, d) in d.iter().enumerate() {
        let (cos, sin) = x.basis.places(k);
        let b = |i: usize| sin.map_or(0.0, |sin| x.of(sin)[i]);
        let mut pair: Vec<c64> = (0..x.n).map(|i| c64::new(x.of(cos)[i], -b(i))).collect();
        act(d, &mut pair);
        x.of_mut(cos).iter_mut().zip(&pair).for_each(|(x, z)| *x = z.re);
        if let Some(sin) = sin {
            x.of_mut(sin).iter_mut().zip(&pair).for_each(|(x, z)| *x = -z.im);
        }
    }
}

/// `Bᵀ x`, function by function.
pub(super) fn onto_columns(b: &Mat<f64>, x: &Series) -> Series {
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
    for i in 0..q.basis.len(q.n_h) {
        r.of_mut(i).iter_mut().zip(linear.f.of(i)).for_each(|(r, f)| *r -= f);
        for (c, &nc) in n.of(i).iter().enumerate() {
            let column = reduction.q.col_as_slice(c);
            r.of_mut(i).iter_mut().zip(column).for_each(|(r, q)| *r += q * nc);
        }
    }
    let size = norm(&r.a) / terms(reduction, linear, q, n).max(f64::MIN_POSITIVE);
    (r, size)
}

/// Size of the terms of the residual.
fn terms(reduction: &Reduction, linear: &Linear, q: &Series, n: &Series) -> f64 {
    norm(&linear.f.a).max(norm(&n.a)).max(reduction.stiffness_unit() * norm(&q.a))
}

/// Solve the balance at a frequency from a guess.
pub fn solve(
    reduction: &Reduction,
    guess: &Series,
    omega: f64,
    settings: &Settings,
) -> Result<Result<Solution, GapReason>, HbmError> {
    let linear = Linear::new(reduction, guess.n_h, omega);
    if reduction.has_unknown_forces() {
        if linear.nearness < RESONANCE {
            return Ok(Err(GapReason::NotConverged { residual: f64::NAN, iterations: 0 }));
        }
        let terms =
            |_: &Series, n: &Series| terms(reduction, &linear, &linear.solve(reduction, n), n);
        let (at, guess) = ((omega, settings), project_in(reduction, guess));
        let series_of = |_: &Series, n: &Series, a: &[f64]| {
            let mut q = linear.solve(reduction, n);
            reduction.rigid().zip(a).for_each(|(i, a)| q.of_mut(0)[i] += a);
            q
        };
        return on_terms(reduction, &linear.receptance, &guess, at, terms, series_of);
    }
    let evaluate = |q: Series| -> Result<Whole, HbmError> {
        let y = project_in(reduction, &q);
        let at = Along { interface: reduction, y: &y, n: None, omega };
        let balance = Balance::new(&at, settings.quadrature)?;
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
    let ended = Ended { omega, q, y, n, residual: size, iterations };
    conclude(reduction, ended, balance, settings)
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
    let n = condensed(&linear.receptance, (y, None), balance);
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
    for (k, d) in linear.d.iter().enumerate() {
        let (cos, sin) = q.basis.places(k);
        for (i, j, d) in d.entries() {
            a[(cos * n + i, cos * n + j)] += d.re;
            if let Some(sin) = sin {
                a[(sin * n + i, sin * n + j)] += d.re;
                a[(cos * n + i, sin * n + j)] += d.im;
                a[(sin * n + i, cos * n + j)] -= d.im;
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
    let balance = Balance::new(&Along { interface: reduction, y: &y, n: None, omega }, quadrature)?;
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
