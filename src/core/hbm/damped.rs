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
//! n = N(ĉ − Ĝ n + Q̂ᵀe_j A cos θ, n),     (ω_j² − ω² + iω(2c_j − α)) A + Q_jᵀ n_1 = 0
//! ```
//!
//! where `Ĝ` is without that coordinate, and not singular at the resonance. At small amplitudes everything sticks: the modes of the body that sticks are where families begin.

use faer::linalg::solvers::Solve;
use faer::{Mat, c64};

use super::balance::{Balance, Quadrature};
use super::impedance::Impedance;
use super::modes::{divide, onto_columns, push};
use super::newton::{Settings, conclude, condensed_residual, damped, jacobian};
use super::receptance::{Receptance, load_series};
use super::series::Series;
use super::solution::Ended;
use super::viscous::Fed;
use super::{Form, HbmError, Reduction};
use crate::contact::{PointState, System};
use crate::continuation::{dot, norm};
use crate::flow::spectrum::Spectrum;
use crate::orbit::least_change;
use crate::records::GapReason;

/// A body prepared for its damped nonlinear mode.
pub struct DampedMode {
    reduction: Reduction,
    /// Coordinate whose first harmonic is the amplitude: that of the open body with the largest share in the mode.
    pinned: usize,
    /// Frequency and shape (in the coordinates of the open body, the pinned one at 1) where everything sticks.
    stuck: (f64, Vec<f64>),
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
}

/// Stands for a stiffness that lets nothing move.
const HELD: f64 = 1e150;

impl DampedMode {
    /// Of the `mode`th mode (from 0) of the body that sticks everywhere.
    pub fn new(system: System, mode: usize) -> Result<DampedMode, HbmError> {
        let still = |i: usize| match system.tangent(i) {
            Some(_) => PointState::Stick,
            None => PointState::Closed,
        };
        let phase = system.phase(&(0..system.n_contact()).map(still).collect());
        let stuck = Spectrum::new(&system, &phase)?;
        let reduction = Reduction::new(system, Form::Force)?;
        if reduction.is_free() {
            return Err(HbmError::Floats);
        }
        if mode >= stuck.frozen().start {
            return Err(HbmError::NoMode(mode + 1, stuck.frozen().start));
        }
        let mut shape = reduction.modal(stuck.shapes.col_as_slice(mode));
        let share = |i: usize| shape[i].abs();
        let largest = (0..shape.len()).max_by(|a, b| share(*a).total_cmp(&share(*b)));
        let pinned = largest.unwrap_or_default();
        let scale = 1.0 / shape[pinned];
        shape.iter_mut().for_each(|q| *q *= scale);
        Ok(DampedMode { reduction, pinned, stuck: (stuck.modes[mode].omega, shape) })
    }

    /// The body.
    pub fn reduction(&self) -> &Reduction {
        &self.reduction
    }

    /// Frequency where everything sticks.
    pub fn stuck_frequency(&self) -> f64 {
        self.stuck.0
    }

    /// Largest displacement of the body where everything sticks and the pinned coordinate is 1.
    pub fn reach(&self) -> f64 {
        let rest = vec![0.0; self.reduction.n()];
        let u = self.reduction.state(&self.stuck.1, &rest, 1.0).u;
        u.iter().fold(0.0, |m, u| m.max(u.abs()))
    }

    /// `D_k` of all coordinates; at `k = 1` the pinned one is held.
    fn impedances(&self, n_h: usize, omega: f64, alpha: f64) -> Vec<Impedance> {
        let of = |k: usize| {
            let kw = k as f64 * omega;
            let mut d = Impedance::new(&self.reduction.open, kw);
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
        let (r, m) = (reduction.rank(), x.len() - 2);
        let (omega, alpha) = (x[m], x[m + 1]);
        let n = self.terms(x, n_h);
        let receptance = self.receptance((n_h, amplitude), omega, alpha);
        let at = (omega, Quadrature::EventResolved);
        let (mut residual, y, balance) = condensed_residual(reduction, &receptance, (&n, &[]), at)?;
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
        Ok(At { x: x.to_vec(), residual, receptance, y, balance, size })
    }

    /// The terms among the unknowns.
    fn terms(&self, x: &[f64], n_h: usize) -> Series {
        let mut n = Series::zeros(self.reduction.basis, n_h, self.reduction.rank());
        n.a.copy_from_slice(&x[..x.len() - 2]);
        n
    }

    /// What answers to the terms: the constant forces, and the pinned coordinate as it is given.
    fn receptance(&self, (n_h, amplitude): (usize, f64), omega: f64, alpha: f64) -> Receptance {
        let reduction = &self.reduction;
        let d = self.impedances(n_h, omega, alpha);
        let g = d.iter().map(|d| d.receptance(&reduction.q)).collect();
        let mut q = load_series(reduction, n_h, &reduction.open.constant, &[]);
        divide(&d, &mut q);
        q.of_mut(1)[self.pinned] = amplitude;
        Receptance::new(reduction, omega, g, onto_columns(&reduction.q, &q))
    }

    /// `∂R/∂(n, ω, α)`
    fn jacobian(&self, at: &At, n_h: usize, amplitude: f64) -> Result<Mat<f64>, HbmError> {
        let core = jacobian(&at.receptance, &at.balance);
        let m = core.nrows();
        let r = self.reduction.rank();
        let mut a = Mat::<f64>::zeros(m + 2, m + 2);
        a.submatrix_mut(0, 0, m, m).copy_from(&core);
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

    /// Terms, `ω` and `α` of the body that sticks.
    pub(super) fn start(&self, n_h: usize, amplitude: f64) -> Result<Vec<f64>, HbmError> {
        let reduction = &self.reduction;
        let (omega, shape) = &self.stuck;
        // Q n = −(Ω² − ω²) q
        let q = &reduction.q;
        let force: Vec<f64> = (0..shape.len())
            .map(|i| {
                let natural = reduction.open.modes[i].omega;
                -(natural - omega) * (natural + omega) * shape[i] * amplitude
            })
            .collect();
        let normal = q.transpose() * q;
        let onto: Vec<f64> = (0..q.ncols()).map(|c| dot(q.col_as_slice(c), &force)).collect();
        let first = least_change(&normal, &onto)?;
        let mut n = Series::zeros(reduction.basis, n_h, reduction.rank());
        n.of_mut(1).copy_from_slice(&first);
        let alpha = 2.0 * reduction.open.modes[self.pinned].c;
        Ok(n.a.into_iter().chain([*omega, alpha]).collect())
    }

    /// The mode at an amplitude, from a guess.
    pub(super) fn solve(
        &self,
        guess: &[f64],
        (n_h, amplitude): (usize, f64),
        settings: &Settings,
    ) -> Result<Result<Fed, GapReason>, HbmError> {
        let start = self.evaluate(guess, n_h, amplitude)?;
        let step = |at: &At| match self.jacobian(at, n_h, amplitude) {
            Ok(a) => {
                let right = Mat::from_fn(a.nrows(), 1, |i, _| -at.residual[i]);
                a.partial_piv_lu().solve(right).col_as_slice(0).to_vec()
            }
            Err(_) => vec![f64::NAN],
        };
        let trial = |at: &At, step: &[f64], lambda: f64| {
            let x: Vec<f64> = at.x.iter().zip(step).map(|(x, s)| x + lambda * s).collect();
            self.evaluate(&x, n_h, amplitude)
        };
        let (at, iterations) = damped(start, settings, |at| at.size, step, trial);
        let At { x, y, balance, size, .. } = at;
        let (omega, alpha) = (x[x.len() - 2], x[x.len() - 1]);
        let n = self.terms(&x, n_h);
        let d = self.impedances(n_h, omega, alpha);
        let mut q = load_series(&self.reduction, n_h, &self.reduction.open.constant, &[]);
        push(&self.reduction, &n, &mut q);
        divide(&d, &mut q);
        q.of_mut(1)[self.pinned] = amplitude;
        q.of_mut(2)[self.pinned] = 0.0;
        let ended = Ended { omega, q, y, n, residual: size, iterations };
        let found = conclude(&self.reduction, ended, balance, settings)?;
        Ok(found.map(|solution| Fed { solution, alpha }))
    }
}
