//! Newton's method on the balance: what all bodies have in common.
//!
//! With `N(y)` the projections and `N′` their derivative, a Newton step on `D q + Q N(Q̂ᵀq) = f` is
//!
//! ```text
//! (I + N′ Ĝ) n = N + N′ (ĉ − y),    q_k = D_k⁻¹ (f_k − Q n_k)
//! ```
//!
//! (Woodbury): exact, with `r` unknowns a function; `ĉ − Ĝ n` is what the open body answers ([`Receptance`]).

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::HbmError;
use super::balance::{Balance, Quadrature};
use super::interface::Interface;
use super::receptance::Receptance;
use super::series::Series;
use super::solution::{Ended, Solution};
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

/// The interface terms of the next iterate, `(I + N′Ĝ) n = N + N′(ĉ − y)`.
pub(super) fn condensed(receptance: &Receptance, y: &Series, balance: &Balance) -> Series {
    let a = receptance.jacobian(&balance.derivative);
    let c = receptance.answer(None);
    let shift = Mat::from_fn(c.a.len(), 1, |i, _| c.a[i] - y.a[i]);
    let rhs = Mat::from_fn(a.nrows(), 1, |i, _| balance.n.a[i]) + &balance.derivative * shift;
    let solution = a.partial_piv_lu().solve(&rhs);
    let mut n = balance.n.clone();
    n.a.iter_mut().enumerate().for_each(|(i, n)| *n = solution[(i, 0)]);
    n
}

/// The condensed residual `n − N(ĉ − Ĝ n)`, the answer `ĉ − Ĝ n`, and the projections; its Jacobian is `I + N′Ĝ`.
pub(super) fn condensed_residual(
    interface: &Interface,
    receptance: &Receptance,
    n: &Series,
    (omega, quadrature): (f64, Quadrature),
) -> Result<(Vec<f64>, Series, Balance), HbmError> {
    let y = receptance.answer(Some(n));
    let balance = Balance::new(interface, &y, omega, quadrature)?;
    let r = n.a.iter().zip(&balance.n.a).map(|(a, b)| a - b).collect();
    Ok((r, y, balance))
}
