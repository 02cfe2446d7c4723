//! Newton's method on the balance: what all bodies have in common.
//!
//! With `N(y)` the projections and `N′` their derivative, a Newton step on `D q + Q N(Q̂ᵀq) = f` is
//!
//! ```text
//! (I + N′ Ĝ) n = N + N′ (ĉ − y),    q_k = D_k⁻¹ (f_k − Q n_k)
//! ```
//!
//! (Woodbury): exact, with `r` unknowns a function; `ĉ − Ĝ n` is what the open body answers ([`Receptance`]). Where forces of friction are unknowns, `N(y, n)`, the matrix has
//! `−∂N/∂n` and the right-hand side `−∂N/∂n n` besides, and the positions of rigid motions are unknowns too.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::{Mat, Par};

use super::HbmError;
use super::balance::{Balance, Quadrature};
use super::interface::Interface;
use super::receptance::{Receptance, Rigid};
use super::rubbing::Along;
use super::series::Series;
use super::solution::{Ended, Solution};
use crate::continuation::norm;
use crate::orbit::least_change;
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

/// Where a residual was below this, the step behind it ends at rounding errors: it is quadratic there.
const LAST: f64 = 1e-7;

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
        let falls = size(&at) <= 0.1 * now && now > LAST;
        if size(&at) <= settings.tolerance && !falls {
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

/// `N + N′(ĉ − y) − ∂N/∂n n`
fn right(
    receptance: &Receptance,
    (y, last): (&Series, Option<&Series>),
    balance: &Balance,
) -> Mat<f64> {
    let column = |x: &[f64]| Mat::from_fn(x.len(), 1, |i, _| x[i]);
    let c = receptance.answer(None);
    let shift = Mat::from_fn(c.a.len(), 1, |i, _| c.a[i] - y.a[i]);
    let mut rhs = column(&balance.n.a) + &balance.derivative * shift;
    if let (Some(by_n), Some(last)) = (&balance.by_n, last) {
        rhs -= by_n * column(&last.a);
    }
    rhs
}

/// `I + N′Ĝ − ∂N/∂n`
pub(super) fn jacobian(receptance: &Receptance, balance: &Balance) -> Mat<f64> {
    let a = receptance.jacobian(&balance.derivative);
    match &balance.by_n {
        Some(by_n) => a - by_n,
        None => a,
    }
}

/// `A⁻¹ b`, in the place of both.
fn solved(mut a: Mat<f64>, mut b: Mat<f64>) -> Mat<f64> {
    let n = a.nrows();
    let (mut forth, mut back) = (vec![0usize; n], vec![0usize; n]);
    let of_factor = factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default());
    let of_solution = solve::solve_in_place_scratch::<usize, f64>(n, b.ncols(), Par::Seq);
    let mut memory = MemBuffer::new(of_factor.or(of_solution));
    let stack = MemStack::new(&mut memory);
    let (at, params) = (a.as_mut(), Default::default());
    let (_, rows) = factor::lu_in_place(at, &mut forth, &mut back, Par::Seq, stack, params);
    solve::solve_in_place(a.as_ref(), a.as_ref(), rows, b.as_mut(), Par::Seq, stack);
    b
}

/// The interface terms of the next iterate, `(I + N′Ĝ − ∂N/∂n) n = N + N′(ĉ − y) − ∂N/∂n n`; `last` are those of this one, of which a guess has none.
pub(super) fn condensed(
    receptance: &Receptance,
    (y, last): (&Series, Option<&Series>),
    balance: &Balance,
) -> Series {
    if balance.is_open {
        return balance.n.clone();
    }
    let a = jacobian(receptance, balance);
    let solution = solved(a, right(receptance, (y, last), balance));
    let mut n = balance.n.clone();
    n.a.iter_mut().enumerate().for_each(|(i, n)| *n = solution[(i, 0)]);
    n
}

/// The interface terms of the next iterate and the positions of rigid motions: of all that solve the linear system (friction holds families of positions) those that differ least from
/// the last ones.
///
/// ```text
/// [ I + N′Ĝ − ∂N/∂n   −N′B ] [n]   [ N + N′(ĉ − y) − ∂N/∂n n ]
/// [ Bᵀ                  0  ] [a] = [ f₀                      ]
/// ```
fn condensed_with(
    rigid: &Rigid,
    receptance: &Receptance,
    (y, last): (&Series, (&Series, &[f64])),
    balance: &Balance,
) -> Result<(Series, Vec<f64>), HbmError> {
    let core = jacobian(receptance, balance);
    let (size, (r, m)) = (core.nrows(), rigid.motions.shape());
    let mut a = Mat::<f64>::zeros(size + m, size + m);
    a.submatrix_mut(0, 0, size, size).copy_from(&core);
    let moved = balance.derivative.subcols(0, r) * &rigid.motions;
    a.submatrix_mut(0, size, size, m).copy_from(-moved);
    a.submatrix_mut(size, 0, m, r).copy_from(rigid.motions.transpose());
    let mut rhs = right(receptance, (y, Some(last.0)), balance).col_as_slice(0).to_vec();
    rhs.extend(&rigid.forces);
    let now: Vec<f64> = last.0.a.iter().chain(last.1).copied().collect();
    let residual = &a * Mat::from_fn(size + m, 1, |i, _| now[i]);
    rhs.iter_mut().zip(residual.col_as_slice(0)).for_each(|(b, r)| *b -= r);
    let change = least_change(&a, &rhs)?;
    let mut n = last.0.clone();
    n.a.iter_mut().zip(&change).for_each(|(n, d)| *n += d);
    Ok((n, last.1.iter().zip(&change[size..]).map(|(a, d)| a + d).collect()))
}

/// An iterate on the interface.
struct Iterate {
    y: Series,
    n: Series,
    /// Positions of rigid motions.
    a: Vec<f64>,
    balance: Balance,
    /// Residual over the size of its terms.
    size: f64,
    /// What rounding errors make of it.
    floor: f64,
}

/// A residual of so many rounding errors of its terms is none: they grow with the highest natural frequency squared, and reach `1e-12` on meshes of ten thousand displacements.
const ROUNDING: f64 = 4.0;

/// Rounding errors of `N` at `y = ĉ − Ĝn`, over the size of the residual's terms: `ε ‖ |N′| (|ĉ| + |Ĝ| |n|) ‖`. Where surfaces touch they all but cancel.
pub(super) fn floor_of(receptance: &Receptance, balance: &Balance, n: &Series, terms: f64) -> f64 {
    if balance.is_open {
        return 0.0;
    }
    let mut sum = vec![0.0; balance.derivative.nrows()];
    for (k, size) in receptance.sizes(n).a.into_iter().enumerate() {
        let column = balance.derivative.col_as_slice(k);
        sum.iter_mut().zip(column).for_each(|(s, d)| *s += d.abs() * size);
    }
    ROUNDING * f64::EPSILON * norm(&sum) / terms.max(f64::MIN_POSITIVE)
}

/// Newton's method on the interface terms, from projections that need not come from any: the first step is taken whole. `terms` is the size of the residual's terms; the series that ends
/// it is that of the projections.
pub(super) fn on_terms(
    interface: &Interface,
    receptance: &Receptance,
    guess: &Series,
    (omega, settings): (f64, &Settings),
    terms: impl Fn(&Series, &Series) -> f64,
    series_of: impl Fn(&Series, &Series, &[f64]) -> Series,
) -> Result<Result<Solution, GapReason>, HbmError> {
    let start = Along { interface, y: guess, n: None, omega };
    let balance = Balance::new(&start, settings.quadrature)?;
    let next = |y: &Series, last: (&Series, &[f64]), balance: &Balance| match &receptance.rigid {
        Some(rigid) => condensed_with(rigid, receptance, (y, last), balance),
        None => Ok((condensed(receptance, (y, Some(last.0)), balance), vec![])),
    };
    let nothing = Series::zeros(guess.basis, guess.n_h, interface.rank());
    let still = vec![0.0; receptance.rigid.as_ref().map_or(0, |r| r.forces.len())];
    let (n, a) = next(guess, (&nothing, &still), &balance)?;
    if n.a.iter().any(|n| !n.is_finite()) {
        return Ok(Err(GapReason::NotConverged { residual: f64::NAN, iterations: 1 }));
    }
    let evaluate = |n: Series, a: Vec<f64>| -> Result<Iterate, HbmError> {
        let at = (omega, settings.quadrature);
        let (r, y, balance) = condensed_residual(interface, receptance, (&n, &a), at)?;
        let terms = terms(&y, &n).max(f64::MIN_POSITIVE);
        let size = norm(&r) / terms;
        let floor = floor_of(receptance, &balance, &n, terms);
        Ok(Iterate { y, n, a, balance, size, floor })
    };
    let step = |at: &Iterate| {
        let Ok((n, a)) = next(&at.y, (&at.n, &at.a), &at.balance) else { return vec![f64::NAN] };
        let change = |now: &[f64], last: &[f64]| -> Vec<f64> {
            now.iter().zip(last).map(|(a, b)| a - b).collect()
        };
        [change(&n.a, &at.n.a), change(&a, &at.a)].concat()
    };
    let trial = |at: &Iterate, step: &[f64], lambda: f64| {
        let (mut n, mut a) = (at.n.clone(), at.a.clone());
        n.a.iter_mut().chain(&mut a).zip(step).for_each(|(n, s)| *n += lambda * s);
        evaluate(n, a)
    };
    let (at, iterations) = damped(evaluate(n, a)?, settings, |at| at.size, step, trial);
    let Iterate { y, n, a, balance, size, floor } = at;
    let settings = Settings { tolerance: settings.tolerance.max(floor), ..*settings };
    let q = series_of(&y, &n, &a);
    let ended = Ended { omega, q, y, n, residual: size, iterations: iterations + 1 };
    conclude(interface, ended, balance, &settings)
}

/// The condensed residual `n − N(ĉ − Ĝ n)` (rigid motions at `a`: `N(ĉ − Ĝ n + B a)`, and `Bᵀn₀ − f₀`), the answer, and the projections; its Jacobian is `I + N′Ĝ`.
pub(super) fn condensed_residual(
    interface: &Interface,
    receptance: &Receptance,
    (n, a): (&Series, &[f64]),
    (omega, quadrature): (f64, Quadrature),
) -> Result<(Vec<f64>, Series, Balance), HbmError> {
    let mut y = receptance.answer(Some(n));
    if let Some(rigid) = &receptance.rigid {
        let moved = &rigid.motions * Mat::from_fn(a.len(), 1, |i, _| a[i]);
        y.of_mut(0).iter_mut().zip(moved.col_as_slice(0)).for_each(|(y, b)| *y += b);
    }
    let balance = Balance::new(&Along { interface, y: &y, n: Some(n), omega }, quadrature)?;
    let mut r: Vec<f64> = n.a.iter().zip(&balance.n.a).map(|(a, b)| a - b).collect();
    for (k, force) in receptance.rigid.iter().flat_map(|r| r.forces.iter().enumerate()) {
        let motions = receptance.rigid.iter().flat_map(|r| r.motions.col_as_slice(k));
        r.push(motions.zip(n.of(0)).map(|(b, n)| b * n).sum::<f64>() - force);
    }
    Ok((r, y, balance))
}
