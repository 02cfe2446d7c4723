//! A solution of the harmonic balance: a series that converged and obeys the contact conditions over its whole period; or why there is none.

use std::f64::consts::TAU;

use super::HbmError;
use super::balance::{Balance, Quadrature};
use super::crossing::{Crossing, spans};
use super::interface::Interface;
use super::rubbing::remembered;
use super::series::{Basis, Series};
use crate::contact::{State, States};
use crate::orbit::Chain;
use crate::records::GapReason;

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
    /// Active sets between them; private, so that [`Solution::examine`] alone makes a solution.
    sets: Vec<States>,
    /// What springs of sliders remember between them: entry of `u_O`, and its value.
    memory: Vec<Vec<(usize, f64)>>,
    /// Touches that may be crossings, and were taken for none.
    pub undecided: usize,
}

/// What an iteration ends with.
#[derive(Debug)]
pub(super) struct Ended {
    /// Frequency.
    pub omega: f64,
    /// The series, in the coordinates of its body.
    pub q: Series,
    /// Its projections.
    pub y: Series,
    /// Its interface terms.
    pub n: Series,
    /// Residual over the size of its terms.
    pub residual: f64,
    /// Newton steps.
    pub iterations: usize,
}

impl Solution {
    /// Ask of a converged series whether it is a solution of the contact problem: nothing else makes one, whatever found it.
    pub(super) fn examine(
        interface: &Interface,
        ended: Ended,
        balance: Balance,
        quadrature: Quadrature,
    ) -> Result<Result<Solution, GapReason>, HbmError> {
        let Ended { omega, q, y, n, residual, iterations } = ended;
        if let Some(failure) = flaw(interface, &y, omega, &balance, quadrature)? {
            return Ok(Err(failure));
        }
        let Balance { crossings, sets, undecided, paths, .. } = balance;
        let middles = spans(&crossings, q.basis).map(|(a, b)| 0.5 * (a + b));
        let memory = middles.map(|theta| remembered(&interface.rubs, &paths, theta)).collect();
        Ok(Ok(Solution { omega, q, n, residual, iterations, crossings, sets, memory, undecided }))
    }

    /// State at a phase angle, of the displacements `u` of the solution; `phase` is that between the switches.
    pub(super) fn state(&self, u: &Series, theta: f64, phase: usize) -> State {
        let (mut u, mut v) = u.at(theta);
        v.iter_mut().for_each(|v| *v *= self.omega);
        self.memory[phase].iter().for_each(|&(j, z)| u[j] = z);
        State { u, v }
    }

    /// Which phase between the switches a phase angle is in: at a switch the one behind it.
    pub(super) fn phase_at(&self, theta: f64) -> usize {
        self.crossings.partition_point(|c| c.theta <= theta)
    }

    /// Active sets between the switches, one more than these.
    pub fn sets(&self) -> &[States] {
        &self.sets
    }

    /// Active sets with the phase angles at which they begin and end.
    pub fn phases(&self) -> impl Iterator<Item = (&States, (f64, f64))> {
        self.sets.iter().zip(spans(&self.crossings, self.q.basis))
    }

    /// The phases of a whole period and the switches between them: times, points, and the states of the displacements `u` of the solution that the phases
    /// begin with.
    pub(super) fn chain(&self, u: &Series) -> (Chain, Vec<f64>, Vec<State>) {
        let mut chain = Chain { sets: self.sets.clone(), ..Chain::default() };
        let mut angles: Vec<f64> = self.crossings.iter().map(|c| c.theta).collect();
        chain.points.extend(self.crossings.iter().map(|c| c.point));
        let mut memories: Vec<usize> = (0..self.sets.len()).collect();
        // a cosine series is walked over half a period, and then back: its last phase is passed once
        if self.q.basis == Basis::Cosine {
            let last = self.crossings.len();
            chain.sets.extend(self.sets[..last].iter().rev().cloned());
            chain.points.extend(self.crossings.iter().rev().map(|c| c.point));
            angles.extend(self.crossings.iter().rev().map(|c| TAU - c.theta));
            memories.extend((0..last).rev());
        }
        let begins = std::iter::once(0.0).chain(angles.iter().copied());
        let states = begins.zip(memories).map(|(theta, k)| self.state(u, theta, k)).collect();
        (chain, angles.iter().map(|theta| theta / self.omega).collect(), states)
    }

    /// The switches of the contact over a whole period in their order: contact point, closes.
    pub fn sequence(&self) -> Vec<(usize, bool)> {
        let of_contact = |c: &&Crossing| c.from.touches() != c.to.touches();
        let crossings = || self.crossings.iter().filter(of_contact);
        let forth = crossings().map(|c| (c.point, c.to.touches()));
        let back = crossings().rev().map(|c| (c.point, c.from.touches()));
        // a cosine series is walked over half a period
        let mirrored = self.q.basis == Basis::Cosine;
        forth.chain(back.filter(|_| mirrored)).collect()
    }
}

/// Why a converged series is no solution of the contact problem, if so.
fn flaw(
    interface: &Interface,
    y: &Series,
    omega: f64,
    balance: &Balance,
    quadrature: Quadrature,
) -> Result<Option<GapReason>, HbmError> {
    let touches =
        !balance.crossings.is_empty() || balance.sets.iter().any(|s| s.count_closed() > 0);
    if !touches && interface.system.loads.harmonics.is_empty() {
        return Ok(Some(GapReason::NoContact));
    }
    if quadrature != Quadrature::EventResolved {
        return Ok(None);
    }
    let theta = inadmissible(interface, y, omega, balance)?;
    Ok(theta.map(|theta| GapReason::Inadmissible { theta }))
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
        let set = interface.contact_of(set);
        let there = interface.system.select(t, &u, &set)?;
        let found = interface.contact_of(&there.set);
        let mut decided = set.changes(&found).filter(|(c, ..)| !there.degenerate.contains(c));
        if decided.next().is_some() {
            return Ok(Some(theta));
        }
    }
    Ok(None)
}
