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
use super::branch::record;
use super::impedance::Impedance;
use super::modes::onto_columns;
use super::newton::{Settings, conclude, condensed_residual, jacobian};
use super::receptance::{Receptance, load_series};
use super::series::Series;
use super::solution::Ended;
use super::viscous::Fed;
use super::viscous_mode::LEAST_FOR_ALPHA;
use super::{Balanced, Form, HbmError, Reduction};
use crate::contact::{PointState, System};
use crate::continuation::{Go, dot, guesses, norm};
use crate::flow::spectrum::Spectrum;
use crate::orbit::least_change;
use crate::records::{GapReason, OrbitRecord, PlaceRecord, PointKind, PointRecord, ViscousRecord};

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
    fn impedance(&self, k: usize, omega: f64, alpha: f64) -> Impedance {
        let mut d = Impedance::new(&self.reduction.open, k as f64 * omega);
        let kw = k as f64 * omega;
        d.add(|i| match k == 1 && i == self.pinned {
            true => c64::new(HELD, 0.0),
            false => c64::new(0.0, -kw * alpha),
        });
        d
    }

    fn evaluate(&self, x: &[f64], n_h: usize, amplitude: f64) -> Result<At, HbmError> {
        let reduction = &self.reduction;
        let (r, m) = (reduction.rank(), x.len() - 2);
        let (omega, alpha) = (x[m], x[m + 1]);
        let mut n = Series::zeros(reduction.basis, n_h, r);
        n.a.copy_from_slice(&x[..m]);
        let (receptance, _) = self.linear(n_h, omega, alpha, amplitude);
        let at = (omega, Quadrature::EventResolved);
        let (mut residual, y, balance) = condensed_residual(reduction, &receptance, (&n, &[]), at)?;
        // the two equations of the pinned coordinate
        let open = &reduction.open.modes[self.pinned];
        let row: Vec<f64> = (0..r).map(|c| reduction.q[(self.pinned, c)]).collect();
        residual.push((open.omega - omega) * (open.omega + omega) * amplitude + dot(&row, n.of(1)));
        // a − ib
        residual.push(omega * (2.0 * open.c - alpha) * amplitude - dot(&row, n.of(2)));
        let terms = norm(&n.a).max(omega * omega * amplitude);
        let size = norm(&residual) / terms.max(f64::MIN_POSITIVE);
        Ok(At { x: x.to_vec(), residual, receptance, y, balance, size })
    }

    /// What answers to the terms, with the pinned coordinate among the loads; and the constant forces on all coordinates.
    fn linear(&self, n_h: usize, omega: f64, alpha: f64, amplitude: f64) -> (Receptance, Series) {
        let reduction = &self.reduction;
        let d: Vec<Impedance> = (0..=n_h).map(|k| self.impedance(k, omega, alpha)).collect();
        let g = d.iter().map(|d| d.receptance(&reduction.q)).collect();
        let mut f = load_series(reduction, n_h, &reduction.open.constant, &[]);
        super::modes::divide(&d, &mut f);
        f.of_mut(1)[self.pinned] = amplitude;
        let c = onto_columns(&reduction.q, &f);
        (Receptance::new(reduction, omega, g, c), f)
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
    fn start(&self, n_h: usize, amplitude: f64) -> Result<Vec<f64>, HbmError> {
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
    fn solve(
        &self,
        guess: &[f64],
        (n_h, amplitude): (usize, f64),
        settings: &Settings,
    ) -> Result<Result<Fed, GapReason>, HbmError> {
        let mut at = self.evaluate(guess, n_h, amplitude)?;
        let mut iterations = 0;
        while iterations < settings.iterations && at.size > 1e-15 && at.size.is_finite() {
            let a = self.jacobian(&at, n_h, amplitude)?;
            let right = Mat::from_fn(a.nrows(), 1, |i, _| -at.residual[i]);
            let step = a.partial_piv_lu().solve(right);
            iterations += 1;
            let shorter = std::iter::successors(Some(1.0), |lambda| Some(0.5 * lambda));
            let next = shorter.take_while(|lambda| *lambda > 1e-3).find_map(|lambda| {
                let x: Vec<f64> =
                    at.x.iter().enumerate().map(|(i, x)| x + lambda * step[(i, 0)]).collect();
                let is_frequency = x[x.len() - 2] > 0.0;
                let there = is_frequency.then(|| self.evaluate(&x, n_h, amplitude).ok())??;
                (there.size < (1.0 - 0.1 * lambda) * at.size).then_some(there)
            });
            let Some(next) = next else { break };
            at = next;
        }
        let At { x, receptance: _, y, balance, size, .. } = at;
        let m = x.len() - 2;
        let (omega, alpha) = (x[m], x[m + 1]);
        let (_, mut q) = self.linear(n_h, omega, alpha, amplitude);
        let d: Vec<Impedance> = (0..=n_h).map(|k| self.impedance(k, omega, alpha)).collect();
        let mut pushed = Series::zeros(q.basis, n_h, q.n);
        for f in 0..q.basis.len(n_h) {
            for (c, n) in x[f * self.reduction.rank()..][..self.reduction.rank()].iter().enumerate()
            {
                let column = self.reduction.q.col_as_slice(c);
                pushed.of_mut(f).iter_mut().zip(column).for_each(|(p, q)| *p += q * n);
            }
        }
        super::modes::divide(&d, &mut pushed);
        q.a.iter_mut().zip(&pushed.a).for_each(|(q, p)| *q -= p);
        let mut n = Series::zeros(q.basis, n_h, self.reduction.rank());
        n.a.copy_from_slice(&x[..m]);
        let ended = Ended { omega, q, y, n, residual: size, iterations };
        let found = conclude(&self.reduction, ended, balance, settings)?;
        Ok(found.map(|solution| Fed { solution, alpha }))
    }
}

/// A family: amplitudes, ascending.
pub struct Amplitudes<'a> {
    /// Largest displacements of the body where everything sticks.
    pub grid: &'a [f64],
    /// Number of harmonics.
    pub n_h: usize,
    /// Newton's settings.
    pub settings: &'a Settings,
}

/// Most halvings of a step between amplitudes.
const HALVINGS: u32 = 6;

/// Follow a damped nonlinear mode; `known` are the points of an earlier part.
pub fn follow(
    mode: &DampedMode,
    plan: &Amplitudes,
    known: &[&PointRecord],
    mut take: impl FnMut(PointRecord) -> Go,
) -> Result<(), HbmError> {
    let reach = mode.reach();
    let mut track: Vec<(f64, Vec<f64>)> = vec![];
    for place in known.iter().filter_map(|p| p.place.as_ref()) {
        if let [n @ .., alpha, amplitude, omega] = &place.x[..] {
            let unknowns = n.iter().copied().chain([*omega, *alpha]).collect();
            track.push((amplitude.ln(), unknowns));
        }
    }
    for &size in &plan.grid[known.len().min(plan.grid.len())..] {
        let amplitude = size / reach;
        let found = reach_amplitude(mode, plan, &mut track, amplitude)?;
        let point = match found {
            Ok(fed) => {
                let s = &fed.solution;
                let x = s.n.a.iter().copied().chain([fed.alpha, amplitude, s.omega]).collect();
                let place = Some(PlaceRecord { x, ..PlaceRecord::default() });
                PointRecord { place, ..point(mode, &fed)? }
            }
            Err(failure) => PointRecord {
                omega: track.last().map_or(mode.stuck.0, |t| t.1[t.1.len() - 2]),
                special: PointKind::Gap(failure),
                ..PointRecord::default()
            },
        };
        if take(point).is_break() {
            return Ok(());
        }
    }
    Ok(())
}

/// The mode at an amplitude, by way of others where one step is too long.
fn reach_amplitude(
    mode: &DampedMode,
    plan: &Amplitudes,
    track: &mut Vec<(f64, Vec<f64>)>,
    amplitude: f64,
) -> Result<Result<Fed, GapReason>, HbmError> {
    let to = amplitude.ln();
    let mut halvings = 0;
    let mut last = Err(GapReason::NoStart);
    let mut there = to;
    while halvings <= HALVINGS {
        let size = there.exp();
        let mut starts: Vec<Vec<f64>> = guesses(track, there).into_iter().map(|g| g.1).collect();
        if track.is_empty() {
            starts.push(mode.start(plan.n_h, size)?);
        }
        for start in &starts {
            last = mode.solve(start, (plan.n_h, size), plan.settings)?;
            if last.is_ok() {
                break;
            }
        }
        match &last {
            Ok(fed) => {
                let s = &fed.solution;
                track.push((there, s.n.a.iter().copied().chain([s.omega, fed.alpha]).collect()));
                if there == to {
                    return Ok(last);
                }
                there = to;
            }
            Err(_) => {
                halvings += 1;
                let Some((from, _)) = track.last() else { return Ok(last) };
                there = 0.5 * (from + there);
            }
        }
    }
    Ok(last)
}

/// A solution as a point.
fn point(mode: &DampedMode, fed: &Fed) -> Result<PointRecord, HbmError> {
    let (reduction, s) = (&mode.reduction, &fed.solution);
    let u = reduction.displacements(s)?;
    let plain = record(reduction, s, &u)?;
    let told = s.q.n_h >= LEAST_FOR_ALPHA || reduction.system.facing().is_empty();
    let feedback = ViscousRecord {
        alpha: if told { fed.alpha } else { f64::NAN },
        beta: 0.0,
        turned_over: f64::NAN,
        under_load: vec![],
    };
    let orbit = OrbitRecord { viscous: Some(feedback), ..plain };
    super::branch::confirmed(None, (s, &u, Some(fed.alpha)), orbit, PointKind::Regular)
}
