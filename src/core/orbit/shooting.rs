//! Newton's method on the event-driven map.
//!
//! Reversible: `u̇_O(0) = 0`, unknown `u_O(0)`, residual `u̇_O(T/2)`. Full period: unknown `x(0)`, residual `x(T) − x(0)`; for an
//! autonomous system with the phase condition `ẋ(0)ᵀ δx = 0` in the sense of least squares. Viscous: unknown `(x(0), α)`, residual `x(T) − x(0)`
//! and the phase condition `q̇_k(0) = 0` of the pinned mode ([`super::viscous`]). The derivative has one saltation matrix
//! a switch. The map has corners where the sequence of switches changes, so every trial step of the line search reads the
//! sequence anew.

use std::f64::consts::TAU;

use faer::Mat;
use faer::linalg::solvers::{Solve, SolveLstsq};

use super::OrbitError;
use super::chain::Propagator;
use super::krylov;
use super::least::least_change;
use super::period_map::{Passage, integrate};
use super::pin::Pin;
use super::tangent::{By, Variation};
use super::walk::Walk;
use crate::contact::State;
use crate::continuation::norm;

/// When an orbit closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Closure {
    /// At rest at `t = 0` and `t = T/2` (undamped, no harmonic load).
    Reversible,
    /// `x(kT) = x(0)` under loads of period `T`; subharmonic for `k > 1`.
    Forced(usize),
    /// `x(T) = x(0)`, autonomous, with a phase condition.
    Autonomous,
    /// `x(T) = x(0)` of a body that friction on a moving surface keeps going, with a phase condition; the last unknown is `T`.
    Limit,
    /// `x(T) = x(0)` of a viscous body that is fed by `−αM u̇`, pinned to a mode; the last unknown is `α`.
    Viscous(Pin),
}

impl Closure {
    /// Orbits of the period of the loads.
    pub const FORCED: Closure = Closure::Forced(1);

    /// Whether loads keep the motion going.
    pub fn is_forced(self) -> bool {
        matches!(self, Closure::Forced(_))
    }

    /// How many multipliers +1 every orbit of the kind has: from time shift, and from its family.
    pub(crate) fn trivial(self) -> usize {
        match self {
            Closure::Forced(_) => 0,
            Closure::Viscous(_) | Closure::Limit => 1,
            _ => 2,
        }
    }

    /// Periods of the loads in one of the orbit.
    pub fn periods(self) -> usize {
        if let Closure::Forced(k) = self { k } else { 1 }
    }

    /// The period of an orbit under loads of the circular frequency `omega`.
    pub fn period(self, omega: f64) -> f64 {
        self.periods() as f64 * TAU / omega
    }

    /// Where the residual is evaluated.
    pub fn end(self, period: f64) -> f64 {
        if self == Closure::Reversible { 0.5 * period } else { period }
    }

    /// Number of unknowns in `z` for a body of `n` displacements.
    pub fn unknowns(self, n: usize) -> usize {
        match self {
            Closure::Reversible => n,
            Closure::Viscous(_) | Closure::Limit => 2 * n + 1,
            _ => 2 * n,
        }
    }

    /// The period of an orbit with these unknowns; one that the closure does not find itself is given.
    pub fn period_of(self, z: &[f64], given: f64) -> f64 {
        if self == Closure::Limit { z[z.len() - 1] } else { given }
    }

    /// Number of unknowns, and how many of them are the state.
    pub fn sizes(self, n: usize) -> (usize, usize) {
        let all = self.unknowns(n);
        (all, if matches!(self, Closure::Viscous(_) | Closure::Limit) { 2 * n } else { all })
    }

    /// The frame vector among the unknowns.
    pub fn frame<'z>(&self, z: &'z [f64]) -> &'z [f64] {
        match self {
            Closure::Viscous(_) | Closure::Limit => &z[..z.len() - 1],
            _ => z,
        }
    }

    /// Give the body what the unknowns say of it: the damping of a viscous orbit.
    pub(crate) fn adopt(self, body: &mut Propagator, z: &[f64]) -> Result<(), OrbitError> {
        if let Closure::Viscous(pin) = self {
            let alpha = z[z.len() - 1];
            pin.check(alpha)?;
            body.set_damping(Some(pin.damping(alpha)))?;
        }
        Ok(())
    }

    /// The residual at the end of a walk from `z`.
    pub fn residual(self, z: &[f64], z_end: &[f64]) -> Vec<f64> {
        match self {
            Closure::Reversible => z_end[z.len()..].to_vec(),
            Closure::Viscous(pin) => {
                let closes = z_end.iter().zip(z).map(|(e, s)| e - s);
                closes.chain([z[z_end.len() / 2 + pin.mode]]).collect()
            }
            _ => z_end.iter().zip(z).map(|(e, s)| e - s).collect(),
        }
    }

    /// A variation of which no more is wanted than the residual takes.
    pub(super) fn varied(self, variation: Variation<'_>) -> Variation<'_> {
        Variation { to_velocities: self == Closure::Reversible, ..variation }
    }

    /// Its derivative with respect to `z` from the columns that start as the unit vectors (viscous: and that of `α`).
    pub fn derivative(self, end: &Mat<f64>, unknowns: usize) -> Mat<f64> {
        match self {
            Closure::Reversible => {
                Mat::from_fn(unknowns, end.ncols(), |i, j| end[(unknowns + i, j)])
            }
            _ => Mat::from_fn(unknowns, end.ncols(), |i, j| match self {
                Closure::Viscous(pin) if i == end.nrows() => {
                    f64::from(u8::from(j == i / 2 + pin.mode))
                }
                _ => end[(i, j)] - f64::from(u8::from(i == j)),
            }),
        }
    }
}

/// Limits of a Newton iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Most Newton steps.
    pub iterations: usize,
    /// The residual, over the size of the state, that counts as an orbit.
    pub tolerance: f64,
    /// One of many starts: give up where little comes of it.
    pub scout: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { iterations: 40, tolerance: 1e-11, scout: false }
    }
}

/// Least share of a Newton step; of a scout's. Of eighteen starts that found an orbit (half plate, 10 × 3) one took a share below 0.05, and of
/// 209 each that found none spent half of its evaluations there.
const SHARE: [f64; 2] = [1e-3, 0.05];
/// A scout goes on while the residual falls below this part of what it was so many steps ago.
const SLOW: (f64, usize) = (0.8, 3);

/// Most pieces of the map that whole steps are followed through.
const CORNERS: usize = 3;

/// How Newton's method ended.
#[derive(Debug)]
pub struct Shot {
    /// Frame vector at `t = 0`: the best one.
    pub z: Vec<f64>,
    /// Residual over `‖z‖`.
    pub residual: f64,
    /// Newton steps.
    pub iterations: usize,
    /// Whether the tolerance was met.
    pub converged: bool,
    /// Sequence at `z`.
    pub passage: Passage,
}

/// The map at `z`.
pub(super) struct Image {
    /// The frame vector of [`Propagator::settled`], in place of that of `z`.
    settled: Option<Vec<f64>>,
    /// The motion.
    pub(super) passage: Passage,
    /// None for a large body, which has the modes of no phase.
    walk: Option<Walk>,
    /// The residual.
    pub r: Vec<f64>,
    /// Its norm over that of the state.
    pub size: f64,
    end: f64,
}

impl Image {
    /// The unknowns with what rests.
    fn resting(&self, mut z: Vec<f64>) -> Vec<f64> {
        if let Some(settled) = &self.settled {
            z[..settled.len()].copy_from_slice(settled);
        }
        z
    }

    /// The rate of the frame vector at the end; empty for a large body.
    pub(crate) fn rate_end(&self) -> &[f64] {
        self.walk.as_ref().map_or(&[], |w| &w.rate_end)
    }
}

/// Most tangent products of a Newton step.
const MOST_PRODUCTS: usize = 1500;

pub(super) fn image(
    body: &mut Propagator,
    closure: Closure,
    z: &[f64],
    period: f64,
) -> Result<Image, OrbitError> {
    closure.adopt(body, z)?;
    let end = closure.end(closure.period_of(z, period));
    let settled = body.settled(closure.frame(z))?;
    let frame = settled.as_deref().unwrap_or(closure.frame(z));
    let passage = integrate(body, &body.state(frame), end)?;
    let walk = match body.is_large() {
        true => None,
        false => Some(body.walk(&passage.chain, frame, &passage.times, end)?),
    };
    let mut r = match &walk {
        Some(walk) => closure.residual(frame, &walk.z_end),
        None => closure.residual(frame, &body.frame(&passage.report.last)),
    };
    if closure.is_forced() {
        body.drift.leave_out(&mut r);
    }
    let size = norm(&r) / norm(frame).max(least_size(body));
    Ok(Image { settled, passage, walk, r, size, end })
}

/// Size of a state against which a residual counts at least. Where gaps move the body may rest in them, and is not small by that.
fn least_size(body: &Propagator) -> f64 {
    let system = &body.system;
    if !system.loads.carried.moves_contact() {
        return f64::MIN_POSITIVE;
    }
    let u = vec![AT_REST * system.units.length; system.n_o()];
    norm(&body.frame(&State { v: vec![0.0; u.len()], u })).max(f64::MIN_POSITIVE)
}

/// Share of the gap below which a body rests.
const AT_REST: f64 = 1e-6;

/// `∂R/∂z` of the event-driven map; with `by_frequency` one more column for the frequency of the loads, the time of the end held.
pub(super) fn jacobian(
    body: &Propagator,
    closure: Closure,
    at: &Image,
    by_frequency: bool,
) -> Result<Mat<f64>, OrbitError> {
    let unknowns = closure.unknowns(body.n());
    let of_state = closure.sizes(body.n()).1;
    let Some(walk) = &at.walk else { return Err(OrbitError::Large(body.n())) };
    let by = match closure {
        Closure::Viscous(_) => Some(By::Feedback),
        Closure::Forced(_) if by_frequency => Some(By::Frequency),
        _ => None,
    };
    let variation = closure.varied(Variation { by, ..Variation::OF_MAP });
    let end = body.derivative((&at.passage.chain, walk), of_state, variation)?.end;
    let mut j =
        closure.derivative(&end, if closure == Closure::Limit { of_state } else { unknowns });
    if closure.is_forced() {
        (0..j.ncols()).for_each(|k| body.drift.leave_out(j.col_as_slice_mut(k)));
    }
    if closure == Closure::Limit {
        return Ok(Mat::from_fn(of_state, unknowns, |i, k| {
            if k < of_state { j[(i, k)] } else { walk.rate_end[i] }
        }));
    }
    Ok(match by_frequency && j.ncols() == unknowns {
        // without loads the motion up to a fixed time knows no frequency
        true => {
            Mat::from_fn(unknowns, unknowns + 1, |i, k| if k < unknowns { j[(i, k)] } else { 0.0 })
        }
        false => j,
    })
}

/// The derivative of the period map (or of the half-period residual) at a state, with the residual: for tests.
pub fn linearised(
    body: &mut Propagator,
    closure: Closure,
    z: &[f64],
    period: f64,
) -> Result<(Vec<f64>, Mat<f64>), OrbitError> {
    let at = image(body, closure, z, period)?;
    let j = jacobian(body, closure, &at, false)?;
    Ok((at.r, j))
}

fn newton_step(
    body: &Propagator,
    closure: Closure,
    z: &[f64],
    at: &Image,
) -> Result<Vec<f64>, OrbitError> {
    correction(body, closure, z, at, &at.r)
}

/// The change of the unknowns that takes a residual `r` away, to first order: `−(∂R/∂z)⁻¹ r`.
pub(super) fn correction(
    body: &Propagator,
    closure: Closure,
    z: &[f64],
    at: &Image,
    r: &[f64],
) -> Result<Vec<f64>, OrbitError> {
    if body.is_large() && closure == Closure::Reversible {
        // the last digits of the linear system matter near the solution only
        let accuracy = (0.1 * at.size).clamp(1e-6, 1e-2);
        let (_, tangent) = krylov::half_period(body, z, at.end)?;
        return Ok(tangent.step(r, accuracy, MOST_PRODUCTS).0);
    }
    let j = jacobian(body, closure, at, false)?;
    let n = j.nrows();
    if body.system.tangents().is_some() {
        return shortest_step(body, closure, z, (at, r), &j);
    }
    let b = |rows: usize| Mat::from_fn(rows, 1, |i, _| if i < n { -r[i] } else { 0.0 });
    let step = if closure == Closure::Autonomous {
        // the direction of the flow at t = 0: a shift in time is no news
        let rate = body.rate(z, &at.passage.chain)?;
        let length = norm(&rate).max(f64::MIN_POSITIVE);
        let a = Mat::from_fn(n + 1, n, |i, k| if i < n { j[(i, k)] } else { rate[k] / length });
        a.qr().solve_lstsq(b(n + 1))
    } else {
        j.partial_piv_lu().solve(b(n))
    };
    Ok((0..n).map(|i| step[(i, 0)]).collect())
}

/// The shortest Newton step, where friction may hold a family of residual positions; that of a limit cycle is across the flow at `t = 0`, a shift in time is no news.
fn shortest_step(
    body: &Propagator,
    closure: Closure,
    z: &[f64],
    (at, r): (&Image, &[f64]),
    j: &Mat<f64>,
) -> Result<Vec<f64>, OrbitError> {
    let mut wanted: Vec<f64> = r.iter().map(|r| -r).collect();
    if closure != Closure::Limit {
        return least_change(j, &wanted);
    }
    let rate = body.rate(closure.frame(z), &at.passage.chain)?;
    let speed = norm(&rate).max(f64::MIN_POSITIVE);
    // the unknown beside the state is `‖ż‖ δT`
    let n = rate.len();
    let a = Mat::from_fn(n + 1, n + 1, |i, k| match (i < n, k < n) {
        (true, true) => j[(i, k)],
        (true, false) => j[(i, k)] / speed,
        (false, true) => rate[k] / speed,
        (false, false) => 0.0,
    });
    wanted.push(0.0);
    let mut step = least_change(&a, &wanted)?;
    step[n] /= speed;
    Ok(step)
}

/// A Newton step, not much longer than the state: such a one leads anywhere.
fn bounded_step(
    body: &Propagator,
    closure: Closure,
    z: &[f64],
    at: &Image,
) -> Result<Vec<f64>, OrbitError> {
    let mut step = newton_step(body, closure, z, at)?;
    let size = norm(closure.frame(z)).max(least_size(body) / AT_REST);
    let mut excess = norm(closure.frame(&step)) / size;
    if closure == Closure::Limit {
        excess = excess.max((step[step.len() - 1] / z[z.len() - 1]).abs());
    }
    if excess > 0.5 {
        step.iter_mut().for_each(|s| *s *= 0.5 / excess);
    }
    Ok(step)
}

/// Whole steps from where one led over a corner of the map, each with the derivative of the piece that it starts from: the unknowns and the map there, where the residual is below
/// `size` at last. The solution of a map of linear pieces may lie on a piece that no shorter step leads to.
fn over_corners(
    body: &mut Propagator,
    closure: Closure,
    period: f64,
    (mut z, mut at): (Vec<f64>, Image),
    size: f64,
) -> Result<Option<(Vec<f64>, Image)>, OrbitError> {
    for _ in 0..CORNERS {
        z = at.resting(z);
        let step = bounded_step(body, closure, &z, &at)?;
        z.iter_mut().zip(&step).for_each(|(z, s)| *z += s);
        let Ok(there) = image(body, closure, &z, period) else { return Ok(None) };
        let is_same = there.passage.chain == at.passage.chain;
        at = there;
        if at.size < 0.9 * size {
            return Ok(Some((z, at)));
        }
        if is_same {
            break;
        }
    }
    Ok(None)
}

/// Newton's method from the frame vector `z`. Evaluations that fail along the line search count as no progress; one that fails
/// at the guess is an error.
pub fn shoot(
    body: &mut Propagator,
    closure: Closure,
    z: &[f64],
    period: f64,
    settings: &Settings,
) -> Result<Shot, OrbitError> {
    let mut z = z.to_vec();
    let mut at = image(body, closure, &z, period)?;
    z = at.resting(z);
    let shot = |z, at: Image, iterations| Shot {
        z,
        residual: at.size,
        iterations,
        converged: at.size <= settings.tolerance,
        passage: at.passage,
    };
    let mut sizes = vec![];
    for iteration in 0..settings.iterations {
        // nothing but contact shifts the frequency of a free motion
        let idle = at.passage.chain.events() == 0 && !closure.is_forced();
        let slow = iteration > SLOW.1 && at.size > SLOW.0 * sizes[iteration - SLOW.1];
        if at.size <= 1e-14 || settings.scout && (idle || slow) {
            return Ok(shot(z, at, iteration));
        }
        sizes.push(at.size);
        let step = bounded_step(body, closure, &z, &at)?;
        if step.iter().any(|s| !s.is_finite()) {
            return Ok(shot(z, at, iteration));
        }
        let mut best: Option<(Vec<f64>, Image)> = None;
        let mut lambda = 1.0;
        while lambda > SHARE[usize::from(settings.scout)] {
            let trial: Vec<f64> = z.iter().zip(&step).map(|(z, s)| z + lambda * s).collect();
            if let Ok(there) = image(body, closure, &trial, period) {
                if there.size < (1.0 - 0.1 * lambda) * at.size {
                    best = Some((trial, there));
                    break;
                }
                // others are rescued with their switching times as unknowns
                let is_whole = lambda == 1.0 && body.system.tangents().is_some();
                if is_whole && there.passage.chain != at.passage.chain {
                    best = over_corners(body, closure, period, (trial, there), at.size)?;
                }
                if best.is_some() {
                    break;
                }
            }
            lambda *= 0.5;
        }
        let Some((better, there)) = best else { return Ok(shot(z, at, iteration)) };
        // at the tolerance, go on only while it is worth it
        let ended = there.size <= settings.tolerance && there.size > 0.1 * at.size;
        (z, at) = (there.resting(better), there);
        if ended {
            return Ok(shot(z, at, iteration + 1));
        }
    }
    Ok(shot(z, at, settings.iterations))
}
