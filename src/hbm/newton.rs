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
use super::balance::{Balance, Crossing, Quadrature, spans};
use super::interface::Interface;
use super::receptance::Receptance;
use super::series::{Basis, Series};
use crate::contact::States;

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
    /// The series, in the coordinates of its body.
    pub q: Series,
    /// Its interface terms.
    pub n: Series,
    /// Residual over the size of its terms.
    pub residual: f64,
    /// Newton steps.
    pub iterations: usize,
    /// Switches on the interval of the balance.
    pub crossings: Vec<Crossing>,
    /// Active sets between them.
    pub sets: Vec<States>,
    /// Touches that may be crossings, and were taken for none.
    pub undecided: usize,
}

impl Solution {
    /// Active sets with the phase angles at which they begin and end.
    pub fn phases(&self) -> impl Iterator<Item = (&States, (f64, f64))> {
        self.sets.iter().zip(spans(&self.crossings, self.q.basis))
    }

    /// The switches over a whole period in their order: contact point, closes.
    pub fn sequence(&self) -> Vec<(usize, bool)> {
        let forth = self.crossings.iter().map(|c| (c.point, c.to.touches()));
        let back = self.crossings.iter().rev().map(|c| (c.point, c.from.touches()));
        // a cosine series is walked over half a period
        let mirrored = self.q.basis == Basis::Cosine;
        forth.chain(back.filter(|_| mirrored)).collect()
    }
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

/// What the last iterate `(q, y, n)` of frequency, residual and number of steps is.
pub(super) fn conclude(
    interface: &Interface,
    (q, y, n): (Series, Series, Series),
    balance: Balance,
    (omega, residual, iterations): (f64, f64, usize),
    settings: &Settings,
) -> Result<Result<Solution, Failure>, HbmError> {
    if residual > settings.tolerance || residual.is_nan() {
        return Ok(Err(Failure::NotConverged { residual, iterations }));
    }
    if let Some(failure) = flaw(interface, &y, omega, &balance, settings.quadrature)? {
        return Ok(Err(failure));
    }
    let Balance { crossings, sets, undecided, .. } = balance;
    Ok(Ok(Solution { omega, q, n, residual, iterations, crossings, sets, undecided }))
}

/// Why a converged series is no solution of the contact problem, if so: every solution is asked, whatever found it.
pub(super) fn flaw(
    interface: &Interface,
    y: &Series,
    omega: f64,
    balance: &Balance,
    quadrature: Quadrature,
) -> Result<Option<Failure>, HbmError> {
    let touches =
        !balance.crossings.is_empty() || balance.sets.iter().any(|s| s.count_closed() > 0);
    if !touches && interface.system.loads.harmonics.is_empty() {
        return Ok(Some(Failure::NoContact));
    }
    if quadrature != Quadrature::EventResolved {
        return Ok(None);
    }
    let theta = inadmissible(interface, y, omega, balance)?;
    Ok(theta.map(|theta| Failure::Inadmissible { theta }))
}

/// Over the size of its terms, so far a monitor may be on the wrong side of zero.
const VIOLATION: f64 = 1e-9;

/// A phase angle at which the contact conditions are violated: where a monitor of the present set is negative anywhere in its phase, or where the complementarity
/// problem, solved anew in the middle of the phase, has another active set than the walk along the series.
fn inadmissible(
    interface: &Interface,
    y: &Series,
    omega: f64,
    balance: &Balance,
) -> Result<Option<f64>, HbmError> {
    for (set, (a, b)) in balance.sets.iter().zip(spans(&balance.crossings, y.basis)) {
        // switches at one time have nothing between them
        if b - a <= 1e-9 {
            continue;
        }
        let op = interface.phase(set)?;
        for k in 0..op.monitors.len() {
            let monitor = interface.monitor(&op, k, y);
            let slack = VIOLATION * (monitor.size + op.units[k]);
            if let Some(theta) = monitor.below(a, b, slack) {
                return Ok(Some(theta));
            }
        }
        let theta = 0.5 * (a + b);
        let u = interface.representative(&y.at(theta).0);
        let t = theta / omega;
        let there = interface.system.select(t, &u, set)?;
        let mut decided = set.changes(&there.set).filter(|(c, ..)| !there.degenerate.contains(c));
        if decided.next().is_some() {
            return Ok(Some(theta));
        }
    }
    Ok(None)
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
