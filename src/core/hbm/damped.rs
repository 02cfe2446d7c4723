//! Damped nonlinear modes by harmonic balance, amplitude by amplitude: the extended periodic motions of Krack (Int. J. Solids Struct. 60–61, 2015, 1) of bodies
//! with friction.
//!
//! ```text
//! M ü + (C − αM) u̇ + K u + n(u, u̇) = f,       q_j = A cos θ + (all other harmonics)
//! ```
//!
//! The feedback `−αM u̇` makes good what friction and damping take, so that the motion of frequency `ω` is periodic; `ζ = α/2ω` is the damping ratio of the mode at
//! its amplitude `A`, the first harmonic of a mode `q_j` of the open body, whose phase it fixes. With that one coordinate known, its two equations are those of `ω` and `α`,
//!
//! ```text
//! n = N(ĉ − Ĝ n + Q̂ᵀe_j A cos θ + B a, n),     (ω_j² − ω² + iω(2c_j − α)) A + Q_jᵀ n_1 = 0,     Bᵀn_0 = f_0
//! ```
//!
//! where `Ĝ` is without that coordinate, and not singular at the resonance; `a` are the mean positions of rigid motions `B` of the open body, which friction holds. At small
//! amplitudes everything that touches at rest sticks: the modes of that phase are where families begin, around the equilibrium under the constant loads.

use faer::{Mat, c64};

use super::balance::{Balance, Quadrature};
use super::impedance::Impedance;
use super::modes::{divide, onto_columns, push};
use super::newton::{Settings, conclude, condensed_residual, damped, floor_of, jacobian};
use super::receptance::{Receptance, Rigid, load_series};
use super::series::Series;
use super::solution::Ended;
use super::viscous::Fed;
use super::{Form, HbmError, Reduction};
use crate::contact::{PointState, States, System};
use crate::continuation::{dot, norm};
use crate::fem::largest;
use crate::flow::spectrum::Spectrum;
use crate::orbit::least_change;
use crate::records::GapReason;

/// A body prepared for its damped nonlinear mode.
pub struct DampedMode {
    reduction: Reduction,
    /// Coordinate whose first harmonic is the amplitude: that of the open body with the largest share in the mode.
    pinned: usize,
    /// Frequency and shape (in the coordinates of the open body, the pinned one at 1) where everything sticks that touches at rest.
    stuck: (f64, Vec<f64>),
    /// The equilibrium, in the same coordinates; zero where there is none.
    rest: Vec<f64>,
}

/// A mode at an amplitude.
pub(super) struct Found {
    /// The series with its feedback.
    pub fed: Fed,
    /// `(n, a, ω, α)`
    pub unknowns: Vec<f64>,
}

/// The equations at a point.
struct At {
    x: Vec<f64>,
    residual: Vec<f64>,
    receptance: Receptance,
    y: Series,
    balance: Balance,
    /// Residual over the size of its terms.
    size: f64,
    /// What rounding errors make of it.
    floor: f64,
}

/// Unknowns behind the interface terms, taken apart.
struct Unknowns<'x> {
    /// Mean positions of rigid motions.
    a: &'x [f64],
    omega: f64,
    alpha: f64,
}

/// The least change of the unknowns `x`, each over its own kind's size, that takes the residual to zero; equations over the size of their coefficients.
fn equilibrated(mut a: Mat<f64>, sizes: &[f64], residual: &[f64]) -> Result<Vec<f64>, HbmError> {
    for (c, size) in sizes.iter().enumerate() {
        (0..a.nrows()).for_each(|i| a[(i, c)] *= size);
    }
    let mut right = vec![];
    for (i, r) in residual.iter().enumerate() {
        let size = (0..a.ncols()).fold(f64::MIN_POSITIVE, |m, c| m.max(a[(i, c)].abs()));
        (0..a.ncols()).for_each(|c| a[(i, c)] /= size);
        right.push(-r / size);
    }
    let change = least_change(&a, &right)?;
    Ok(change.iter().zip(sizes).map(|(x, size)| x * size).collect())
}

/// Stands for a stiffness that lets nothing move.
const HELD: f64 = 1e150;

impl DampedMode {
    /// Of the `mode`th mode (from 0) of the body that sticks wherever it touches at rest; everywhere, if there is no equilibrium.
    pub fn new(system: System, mode: usize) -> Result<DampedMode, HbmError> {
        let still = |i: usize| match system.tangent(i) {
            Some(_) => PointState::Stick,
            None => PointState::Closed,
        };
        let n_c = system.n_contact();
        let (set, rest) = match system.equilibrium() {
            Ok((set, u)) if set.count_closed() > 0 => {
                let of = |i: usize| if set.at(i).touches() { still(i) } else { set.at(i) };
                ((0..n_c).map(of).collect::<States>(), u)
            }
            _ => ((0..n_c).map(still).collect(), vec![0.0; system.n_o()]),
        };
        let stuck = Spectrum::new(&system, &system.phase(&set))?;
        let reduction = Reduction::new(system, Form::Force)?;
        let held = stuck.frozen().start;
        if stuck.modes[..held].iter().any(|m| m.omega == 0.0) {
            return Err(HbmError::Floats);
        }
        if mode >= held {
            return Err(HbmError::NoMode(mode + 1, held));
        }
        let mut shape = reduction.modal(stuck.shapes.col_as_slice(mode));
        let share = |i: usize| shape[i].abs();
        let elastic = (0..shape.len()).filter(|i| reduction.open.modes[*i].omega > 0.0);
        let largest = elastic.max_by(|a, b| share(*a).total_cmp(&share(*b)));
        let pinned = largest.unwrap_or_default();
        let scale = 1.0 / shape[pinned];
        shape.iter_mut().for_each(|q| *q *= scale);
        let rest = reduction.modal(&rest);
        Ok(DampedMode { reduction, pinned, stuck: (stuck.modes[mode].omega, shape), rest })
    }

    /// The body.
    pub fn reduction(&self) -> &Reduction {
        &self.reduction
    }

    /// Whether constant loads move the body from where it is undeformed: amplitudes then count from the mean of a motion, as friction holds the body at one of many places.
    pub fn is_preloaded(&self) -> bool {
        self.rest.iter().any(|q| *q != 0.0)
    }

    /// Frequency where everything sticks.
    pub fn stuck_frequency(&self) -> f64 {
        self.stuck.0
    }

    /// Largest displacement, beside that of the equilibrium, of the body where everything sticks and the pinned coordinate is 1.
    pub fn reach(&self) -> f64 {
        let rest = vec![0.0; self.reduction.n()];
        let u = self.reduction.state(&self.stuck.1, &rest, 1.0).u;
        largest(&u)
    }

    /// `D_k` of all coordinates; at `k = 1` the pinned one is held.
    fn impedances(&self, n_h: usize, omega: f64, alpha: f64) -> Vec<Impedance> {
        let rigid: Vec<usize> = self.reduction.rigid().collect();
        let spring = self.reduction.stiffness_unit();
        let of = |k: usize| {
            let kw = k as f64 * omega;
            let mut d = match k {
                0 => Impedance::at_rest(&self.reduction.open, (&rigid, spring)),
                _ => Impedance::new(&self.reduction.open, kw),
            };
            d.add(|i| match k == 1 && i == self.pinned {
                true => c64::new(HELD, 0.0),
                false => c64::new(0.0, -kw * alpha),
            });
            d
        };
        (0..=n_h).map(of).collect()
    }

    fn evaluate(&self, x: &[f64], n_h: usize, amplitude: f64) -> Result<At, HbmError> {
        let reduction = &self.reduction;
        let r = reduction.rank();
        let (n, Unknowns { a, omega, alpha }) = self.apart(x, n_h);
        let receptance = self.receptance((n_h, amplitude), omega, alpha);
        let at = (omega, Quadrature::EventResolved);
        let (mut residual, y, balance) = condensed_residual(reduction, &receptance, (&n, a), at)?;
        // the two equations of the pinned coordinate
        let open = &reduction.open.modes[self.pinned];
        let row: Vec<f64> = (0..r).map(|c| reduction.q[(self.pinned, c)]).collect();
        residual.push((open.omega - omega) * (open.omega + omega) * amplitude + dot(&row, n.of(1)));
        // a − ib
        residual.push(omega * (2.0 * open.c - alpha) * amplitude - dot(&row, n.of(2)));
        let terms = norm(&n.a).max(omega * omega * amplitude);
        let is_motion = omega > 0.0;
        let size = norm(&residual) / terms.max(f64::MIN_POSITIVE);
        let size = if is_motion { size } else { f64::INFINITY };
        let floor = floor_of(&receptance, &balance, &n, terms);
        Ok(At { x: x.to_vec(), residual, receptance, y, balance, size, floor })
    }

    /// The unknowns `(n, a, ω, α)`.
    fn apart<'x>(&self, x: &'x [f64], n_h: usize) -> (Series, Unknowns<'x>) {
        let mut n = Series::zeros(self.reduction.basis, n_h, self.reduction.rank());
        let (terms, others) = x.split_at(n.a.len());
        n.a.copy_from_slice(terms);
        let (a, last) = others.split_at(others.len() - 2);
        (n, Unknowns { a, omega: last[0], alpha: last[1] })
    }

    /// What answers to the terms: the constant forces, and the pinned coordinate as it is given.
    fn receptance(&self, (n_h, amplitude): (usize, f64), omega: f64, alpha: f64) -> Receptance {
        let reduction = &self.reduction;
        let d = self.impedances(n_h, omega, alpha);
        let g = d.iter().map(|d| d.receptance(&reduction.q)).collect();
        let mut q = load_series(reduction, n_h, &reduction.open.constant, &[]);
        divide(&d, &mut q);
        q.of_mut(1)[self.pinned] = amplitude;
        let mut receptance = Receptance::new(reduction, omega, g, onto_columns(&reduction.q, &q));
        let rigid: Vec<usize> = reduction.rigid().collect();
        receptance.rigid = Rigid::of(&reduction.q, &rigid, &reduction.open.constant);
        receptance
    }

    /// `∂R/∂(n, a, ω, α)`
    fn jacobian(&self, at: &At, n_h: usize, amplitude: f64) -> Result<Mat<f64>, HbmError> {
        let core = jacobian(&at.receptance, &at.balance);
        let (size, r) = (core.nrows(), self.reduction.rank());
        let m = at.x.len() - 2;
        let mut a = Mat::<f64>::zeros(m + 2, m + 2);
        a.submatrix_mut(0, 0, size, size).copy_from(&core);
        if let Some(rigid) = &at.receptance.rigid {
            // −N′B, and Bᵀ n₀
            let moved = at.balance.derivative.subcols(0, r) * &rigid.motions;
            a.submatrix_mut(0, size, size, m - size).copy_from(-moved);
            a.submatrix_mut(size, 0, m - size, r).copy_from(rigid.motions.transpose());
        }
        for c in 0..r {
            a[(m, r + c)] = self.reduction.q[(self.pinned, c)];
            a[(m + 1, 2 * r + c)] = -self.reduction.q[(self.pinned, c)];
        }
        let h = 1e-6 * at.x[m];
        for column in [m, m + 1] {
            let shifted = |s: f64| -> Result<Vec<f64>, HbmError> {
                let mut x = at.x.clone();
                x[column] += s;
                Ok(self.evaluate(&x, n_h, amplitude)?.residual)
            };
            let (up, down) = (shifted(h)?, shifted(-h)?);
            for i in 0..m + 2 {
                a[(i, column)] = (up[i] - down[i]) / (2.0 * h);
            }
        }
        Ok(a)
    }

    /// Sizes of the unknowns: of all terms, of all positions, of the frequency.
    fn sizes(&self, at: &At) -> Vec<f64> {
        let (terms, rigid) = (at.balance.n.a.len(), self.reduction.rigid().count());
        let omega = at.x[at.x.len() - 2];
        let of = |x: &[f64]| norm(x).max(f64::MIN_POSITIVE);
        let (n, a) = (of(&at.balance.n.a), of(&self.rest));
        let list = std::iter::repeat_n(n, terms).chain(std::iter::repeat_n(a, rigid));
        list.chain([omega, omega]).collect()
    }

    /// Terms, positions, `ω` and `α` of the body that sticks where it touches at rest.
    /// First without constant terms, which is farthest from slipping anywhere, then with those of the equilibrium.
    pub(super) fn starts(&self, n_h: usize, amplitude: f64) -> Result<[Vec<f64>; 2], HbmError> {
        let reduction = &self.reduction;
        let (omega, shape) = &self.stuck;
        let q = &reduction.q;
        let normal = q.transpose() * q;
        // Q n = f − (Ω² − ω²) q
        let terms = |omega: f64, of: &dyn Fn(usize) -> (f64, f64)| {
            let force = |i: usize| {
                let (natural, (constant, q)) = (reduction.open.modes[i].omega, of(i));
                constant - (natural - omega) * (natural + omega) * q
            };
            let force: Vec<f64> = (0..shape.len()).map(force).collect();
            let onto: Vec<f64> = (0..q.ncols()).map(|c| dot(q.col_as_slice(c), &force)).collect();
            least_change(&normal, &onto)
        };
        let mut n = Series::zeros(reduction.basis, n_h, reduction.rank());
        n.of_mut(1).copy_from_slice(&terms(*omega, &|i| (0.0, shape[i] * amplitude))?);
        let alpha = 2.0 * reduction.open.modes[self.pinned].c;
        let a: Vec<f64> = reduction.rigid().map(|i| self.rest[i]).collect();
        let unknowns =
            |n: &Series| n.a.iter().chain(&a).chain(&[*omega, alpha]).copied().collect::<Vec<_>>();
        let still = unknowns(&n);
        n.of_mut(0).copy_from_slice(&terms(0.0, &|i| (reduction.open.constant[i], self.rest[i]))?);
        Ok([still, unknowns(&n)])
    }

    /// The mode at an amplitude, from a guess.
    pub(super) fn solve(
        &self,
        guess: &[f64],
        (n_h, amplitude): (usize, f64),
        settings: &Settings,
    ) -> Result<Result<Found, GapReason>, HbmError> {
        let start = self.evaluate(guess, n_h, amplitude)?;
        let step = |at: &At| match self.jacobian(at, n_h, amplitude) {
            Ok(a) => {
                equilibrated(a, &self.sizes(at), &at.residual).unwrap_or_else(|_| vec![f64::NAN])
            }
            Err(_) => vec![f64::NAN],
        };
        let trial = |at: &At, step: &[f64], lambda: f64| {
            let x: Vec<f64> = at.x.iter().zip(step).map(|(x, s)| x + lambda * s).collect();
            self.evaluate(&x, n_h, amplitude)
        };
        let (at, iterations) = damped(start, settings, |at| at.size, step, trial);
        let At { x, y, balance, size, floor, .. } = at;
        let (n, Unknowns { a, omega, alpha }) = self.apart(&x, n_h);
        let settings = &Settings { tolerance: settings.tolerance.max(floor), ..*settings };
        let d = self.impedances(n_h, omega, alpha);
        let mut q = load_series(&self.reduction, n_h, &self.reduction.open.constant, &[]);
        push(&self.reduction, &n, &mut q);
        divide(&d, &mut q);
        q.of_mut(1)[self.pinned] = amplitude;
        q.of_mut(2)[self.pinned] = 0.0;
        self.reduction.rigid().zip(a).for_each(|(i, a)| q.of_mut(0)[i] += a);
        let ended = Ended { omega, q, y, n, residual: size, iterations };
        let found = conclude(&self.reduction, ended, balance, settings)?;
        Ok(found.map(|solution| Found { fed: Fed { solution, alpha }, unknowns: x }))
    }
}
