//! Newton's method on the balance: what all bodies have in common.
//!
//! With `N(y)` the projections and `N′` their derivative, a Newton step on `D q + Q N(Q̂ᵀq) = f` is
//!
//! ```text
//! (I + N′ Ĝ) n = N + N′ (ĉ − y),    q_k = D_k⁻¹ (f_k − Q n_k)
//! ```
//!
//! (Woodbury): exact, with `r` unknowns a function; `ĉ − Ĝ n` is what the open body answers ([`Receptance`]). Where forces of friction are unknowns, `N(y, n)`, the matrix has
//! `−∂N/∂n` and the right-hand side `−∂N/∂n n` besides.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::HbmError;
use super::balance::{Balance, Quadrature};
use super::interface::Interface;
use super::receptance::Receptance;
use super::rubbing::Along;
use super::series::Series;
use super::solution::{Ended, Solution};
use crate::continuation::norm;
use crate::records::GapReason;

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

/// Newton's method with steps that are shortened where the residual would grow. Returns the last iterate and the number of steps.
pub(super) fn damped<I>(
    start: I,
    settings: &Settings,
    size: impl Fn(&I) -> f64,
    step: impl Fn(&I) -> Vec<f64>,
    trial: impl Fn(&I, &[f64], f64) -> Result<I, HbmError>,
) -> (I, usize) {
    let mut at = start;
    let mut iterations = 0;
    while iterations < settings.iterations && size(&at) > 1e-15 && size(&at).is_finite() {
        let step = step(&at);
        if step.iter().any(|s| !s.is_finite()) {
            break;
        }
        iterations += 1;
        let now = size(&at);
        // far from the solution a whole step may raise the residual twofold: switches come and go there, and the residual has kinks
        let whole = |there: f64| there < 2.0 * now && now > 1e-6;
        let shorter = std::iter::successors(Some(1.0), |lambda| Some(0.5 * lambda));
        let next = shorter.take_while(|lambda| *lambda > 1e-2).find_map(|lambda| {
            let there = trial(&at, &step, lambda).ok()?;
            let good = size(&there) < now || (lambda == 1.0 && whole(size(&there)));
            good.then_some(there)
        });
        let Some(next) = next else { break };
        at = next;
        if size(&at) <= settings.tolerance && size(&at) > 0.1 * now {
            break;
        }
    }
    (at, iterations)
}

/// What the last iterate is.
pub(super) fn conclude(
    interface: &Interface,
    ended: Ended,
    balance: Balance,
    settings: &Settings,
) -> Result<Result<Solution, GapReason>, HbmError> {
    let Ended { residual, iterations, .. } = ended;
    if residual > settings.tolerance || residual.is_nan() {
        return Ok(Err(GapReason::NotConverged { residual, iterations }));
    }
    Solution::examine(interface, ended, balance, settings.quadrature)
}

/// `I + N′Ĝ − ∂N/∂n`
pub(super) fn jacobian(receptance: &Receptance, balance: &Balance) -> Mat<f64> {
    let a = receptance.jacobian(&balance.derivative);
    match &balance.by_n {
        Some(by_n) => a - by_n,
        None => a,
    }
}

/// The interface terms of the next iterate, `(I + N′Ĝ − ∂N/∂n) n = N + N′(ĉ − y) − ∂N/∂n n`; `last` are those of this one, of which a guess has none.
pub(super) fn condensed(
    receptance: &Receptance,
    (y, last): (&Series, Option<&Series>),
    balance: &Balance,
) -> Series {
    let a = jacobian(receptance, balance);
    let c = receptance.answer(None);
    let shift = Mat::from_fn(c.a.len(), 1, |i, _| c.a[i] - y.a[i]);
    let mut rhs = Mat::from_fn(a.nrows(), 1, |i, _| balance.n.a[i]) + &balance.derivative * shift;
    if let (Some(by_n), Some(last)) = (&balance.by_n, last) {
        rhs -= by_n * Mat::from_fn(last.a.len(), 1, |i, _| last.a[i]);
    }
    let solution = a.partial_piv_lu().solve(&rhs);
    let mut n = balance.n.clone();
    n.a.iter_mut().enumerate().for_each(|(i, n)| *n = solution[(i, 0)]);
    n
}

/// An iterate on the interface.
struct Iterate {
    y: Series,
    n: Series,
    balance: Balance,
    /// Residual over the size of its terms.
    size: f64,
    /// What rounding errors make of it.
    floor: f64,
}

/// A residual of so many rounding errors of its terms is none: they grow with the highest natural frequency squared, and reach `1e-12` on meshes of ten thousand displacements.
const ROUNDING: f64 = 4.0;

/// Rounding errors of `N`: `ε ‖ |N′| |y| ‖`
fn rounding(derivative: &Mat<f64>, y: &Series) -> f64 {
    let mut sum = vec![0.0; derivative.nrows()];
    for (c, y) in y.a.iter().enumerate() {
        sum.iter_mut().zip(derivative.col_as_slice(c)).for_each(|(s, d)| *s += (d * y).abs());
    }
    f64::EPSILON * norm(&sum)
}

/// Newton's method on the interface terms, from projections that need not come from any: the first step is taken whole. `terms` is the size of the residual's terms; the series that ends
/// it is that of the projections.
pub(super) fn on_terms(
    interface: &Interface,
    receptance: &Receptance,
    guess: &Series,
    (omega, settings): (f64, &Settings),
    terms: impl Fn(&Series, &Series) -> f64,
    series_of: impl Fn(&Series, &Series) -> Series,
) -> Result<Result<Solution, GapReason>, HbmError> {
    let start = Along { interface, y: guess, n: None, omega };
    let balance = Balance::new(&start, settings.quadrature)?;
    let n = condensed(receptance, (guess, None), &balance);
    if n.a.iter().any(|n| !n.is_finite()) {
        return Ok(Err(GapReason::NotConverged { residual: f64::NAN, iterations: 1 }));
    }
    let evaluate = |n: Series| -> Result<Iterate, HbmError> {
        let at = (omega, settings.quadrature);
        let (r, y, balance) = condensed_residual(interface, receptance, &n, at)?;
        let terms = terms(&y, &n).max(f64::MIN_POSITIVE);
        let size = norm(&r) / terms;
        let floor = ROUNDING * rounding(&balance.derivative, &y) / terms;
        Ok(Iterate { y, n, balance, size, floor })
    };
    let step = |at: &Iterate| {
        let next = condensed(receptance, (&at.y, Some(&at.n)), &at.balance);
        next.a.iter().zip(&at.n.a).map(|(a, b)| a - b).collect()
    };
    let trial = |at: &Iterate, step: &[f64], lambda: f64| {
        let mut n = at.n.clone();
        n.a.iter_mut().zip(step).for_each(|(n, s)| *n += lambda * s);
        evaluate(n)
    };
    let (at, iterations) = damped(evaluate(n)?, settings, |at| at.size, step, trial);
    let Iterate { y, n, balance, size, floor } = at;
    let settings = Settings { tolerance: settings.tolerance.max(floor), ..*settings };
    let q = series_of(&y, &n);
    let ended = Ended { omega, q, y, n, residual: size, iterations: iterations + 1 };
    conclude(interface, ended, balance, &settings)
}

/// The condensed residual `n − N(ĉ − Ĝ n)`, the answer `ĉ − Ĝ n`, and the projections; its Jacobian is `I + N′Ĝ`.
pub(super) fn condensed_residual(
    interface: &Interface,
    receptance: &Receptance,
    n: &Series,
    (omega, quadrature): (f64, Quadrature),
) -> Result<(Vec<f64>, Series, Balance), HbmError> {
    let y = receptance.answer(Some(n));
    let balance = Balance::new(&Along { interface, y: &y, n: Some(n), omega }, quadrature)?;
    let r = n.a.iter().zip(&balance.n.a).map(|(a, b)| a - b).collect();
    Ok((r, y, balance))
}
