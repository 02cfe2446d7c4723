//! To which attractor of a forced body a motion comes.
//!
//! An attractor is known by the states that it has at the beginnings of the periods of the loads. One orbit of `p` periods has `p` of them, and a motion has come to it where it is near
//! one of them, near the next one a period later, and so on, and nearer after all. How near is near enough depends on how fast the orbit attracts:
//!
//! ```text
//! d < 0.02 min(1, 10 (1 − |μ|)) |x|        μ the largest multiplier
//! ```
//!
//! What is not periodic has a cloud of states. How far others of its states are from those that are kept says how near is near enough (those that follow them fall into the widest gaps of a torus, but
//! not into their middles), and a motion has come to it where it stays that near for long. Orbits that are not known are found as a body settles ([`super::settle`]).

use super::OrbitError;
use super::attractor::{Attractor, of_settling};
use super::chain::Propagator;
use super::settle::{distance, next, settle_unless};
use crate::records::{AttractorKind, AttractorRecord};

/// How near an orbit a motion has to be that comes to it, over the size of the state; of one that attracts slowly so many times the distance of its multiplier from the unit circle.
const NEAR: (f64, f64) = (0.02, 10.0);
/// How far from the unit circle multipliers are taken to be that are not known.
const UNKNOWN: f64 = 1e-3;
/// Nothing is recognised before so many periods.
const FIRST: usize = 6;
/// Where something is known, so many periods are waited before an orbit is looked for by Newton's method; twice as many each time, at most so many.
const PATIENCE: usize = 40;
const LONGEST: usize = 320;
/// So many periods are followed at the most.
const MOST: usize = 5000;
/// As near as this nothing needs to come nearer.
const THERE: f64 = 1e-6;
/// Orbits are the same if their states agree to this, over their size.
const SAME: f64 = 1e-6;
/// Of what is not periodic: states that are kept, and those by which its nearness is measured.
const CLOUD: (usize, usize) = (1000, 200);
/// A motion may be so many times as far from the cloud as those.
const FARTHER: f64 = 1.5;
/// For so many periods a motion is as near to what is not periodic as its own states are.
const STAYS: usize = 24;

/// An attractor by which motions are recognised.
#[derive(Debug, Clone)]
pub struct Known {
    kind: AttractorKind,
    /// Frame vectors at the beginnings of periods of the loads: all of an orbit, a cloud of anything else.
    states: Vec<Vec<f64>>,
    /// How near is near enough, over the size of the state.
    near: f64,
}

/// To what a motion comes.
#[derive(Debug)]
pub enum Destination {
    /// A known attractor, and the periods that it took to tell.
    Known(usize, usize),
    /// What it settled to by itself.
    Settled(Box<Attractor>),
    /// It is on its way after so many periods.
    Undecided(usize),
}

impl Known {
    /// An attractor, one of whose states is `z`; none where it is nothing that a motion can come to, or could not be followed.
    pub fn new(
        body: &mut Propagator,
        seen: &AttractorRecord,
        z: &[f64],
        omega: f64,
    ) -> Result<Option<Known>, OrbitError> {
        let kind = seen.kind;
        let (count, more) = match kind {
            AttractorKind::Periodic(p) => (p, 0),
            AttractorKind::Chaotic | AttractorKind::QuasiPeriodic => CLOUD,
            _ => return Ok(None),
        };
        let mut states = vec![z.to_vec()];
        while states.len() < count + more {
            match next(body, &states[states.len() - 1], omega)? {
                Ok(z) => states.push(z),
                Err(_) => return Ok(None),
            }
        }
        let others = states.split_off(count);
        let mut known = Known { kind, states, near: 0.0 };
        known.near = match kind {
            AttractorKind::Periodic(p) => {
                let (near, times) = NEAR;
                // of multipliers that are not known the nearest to the circle that orbits have
                let largest = match seen.exponent.is_finite() {
                    true => (p as f64 * seen.exponent).exp(),
                    false => 1.0 - UNKNOWN,
                };
                near * (times * (1.0 - largest)).clamp(0.0, 1.0)
            }
            _ => {
                let far = others.iter().map(|z| known.nearest(body, z).1);
                FARTHER * far.fold(0.0, f64::max)
            }
        };
        Ok(Some(known))
    }

    /// Its states at the beginnings of periods of the loads, one after the other: as many as an orbit has, or a cloud.
    pub fn states(&self) -> &[Vec<f64>] {
        &self.states
    }

    /// The state that is nearest to another one, and how far it is over the size of that.
    fn nearest(&self, body: &Propagator, z: &[f64]) -> (usize, f64) {
        let far = self.states.iter().map(|a| distance(body, z, a)).enumerate();
        far.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
    }

    /// Whether another attractor is this one.
    pub fn is(&self, body: &Propagator, other: &Known) -> bool {
        let near = match (self.kind, other.kind) {
            (AttractorKind::Periodic(p), AttractorKind::Periodic(q)) => {
                // those of orbits in their order, some of them first
                let from = |shift: usize| {
                    let pairs = other.states.iter().enumerate();
                    pairs.map(move |(j, z)| distance(body, z, &self.states[(j + shift) % p]))
                };
                return p == q && (0..p).any(|shift| from(shift).all(|d| d < SAME));
            }
            (AttractorKind::Periodic(_), _) | (_, AttractorKind::Periodic(_)) => return false,
            _ => self.near.max(other.near),
        };
        let own = other.states.iter().take(CLOUD.1);
        let far = own.filter(|z| self.nearest(body, z).1 > near).count();
        // one state in twenty may stand alone
        20 * far <= CLOUD.1
    }
}

/// How long a motion has been near an attractor.
#[derive(Debug, Clone, Copy, Default)]
struct Stay {
    /// Periods.
    length: usize,
    /// The state of the attractor that it is near now.
    at: usize,
    /// How far it was at first.
    first: f64,
}

impl Stay {
    /// A period later; whether it has come to stay.
    fn goes_on(&mut self, known: &Known, (at, far): (usize, f64)) -> bool {
        if far > known.near {
            *self = Stay::default();
            return false;
        }
        let AttractorKind::Periodic(p) = known.kind else {
            self.length += 1;
            return self.length >= STAYS;
        };
        if self.length == 0 || at != (self.at + 1) % p {
            *self = Stay { length: 1, at, first: far };
            return false;
        }
        *self = Stay { length: self.length + 1, at, ..*self };
        // at the state where it was first, or at that of a later turn
        self.length > p && (self.length - 1).is_multiple_of(p) && far < self.first.max(THERE)
    }
}

/// What a motion is near to, period by period.
struct Watch<'k> {
    known: Vec<&'k Known>,
    stays: Vec<Stay>,
    periods: usize,
}

impl<'k> Watch<'k> {
    fn new(known: impl IntoIterator<Item = &'k Known>) -> Watch<'k> {
        let known: Vec<&Known> = known.into_iter().collect();
        Watch { stays: vec![Stay::default(); known.len()], known, periods: 0 }
    }

    /// The state a period later; what the motion has come to, if that is told.
    fn see(&mut self, body: &Propagator, z: &[f64]) -> Option<usize> {
        self.periods += 1;
        let mut came = None;
        for (k, (stay, known)) in self.stays.iter_mut().zip(&self.known).enumerate() {
            let stays = stay.goes_on(known, known.nearest(body, z));
            came = came.or(stays.then_some(k));
        }
        came.filter(|_| self.periods >= FIRST)
    }
}

/// To what the motion from a state comes under loads of frequency `omega`.
///
/// Newton's method finds orbits near a motion that returns, and the motion need not come to them: what it finds is one more that is watched for, and the motion goes on. What
/// seems to be chaos may be a long way to an orbit: it is chaos if it still is after the periods of its cloud.
pub fn destination(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
    known: &[Known],
) -> Result<Destination, OrbitError> {
    body.system.loads_mut().set_frequency(omega);
    let mut found: Vec<(Known, Attractor)> = vec![];
    let (mut now, mut maps, mut was_restless) = (z.to_vec(), 0, false);
    let mut patience = if known.is_empty() { 0 } else { PATIENCE };
    while maps < MOST {
        let mut watch = Watch::new(known.iter().chain(found.iter().map(|f| &f.0)));
        let mut last = now.clone();
        let settled = settle_unless(body, &now, omega, patience, |body, z| {
            last = z.to_vec();
            watch.see(body, z)
        })?;
        let settling = match settled {
            Err((k, periods)) => {
                maps += periods;
                return Ok(came_to(k, known.len(), found, maps));
            }
            Ok(settling) => settling,
        };
        maps += settling.periods;
        now = last;
        patience = (2 * patience).clamp(PATIENCE, LONGEST);
        let mut attractor = of_settling(body, &now, omega, settling)?;
        attractor.seen.maps = maps;
        match attractor.seen.kind {
            AttractorKind::Periodic(_) => {
                let new = Known::new(body, &attractor.seen, &attractor.z, omega)?;
                let mut all = known.iter().chain(found.iter().map(|f| &f.0));
                match new {
                    None => return Ok(Destination::Settled(Box::new(attractor))),
                    Some(new) if !all.any(|a| a.is(body, &new)) => found.push((new, attractor)),
                    Some(_) => {}
                }
            }
            AttractorKind::Chaotic | AttractorKind::QuasiPeriodic if !was_restless => {
                was_restless = true;
                let mut watch = Watch::new(known.iter().chain(found.iter().map(|f| &f.0)));
                now.clone_from(&attractor.z);
                for _ in 0..CLOUD.0 + CLOUD.1 {
                    match next(body, &now, omega)? {
                        Ok(z) => now = z,
                        Err(_) => return Ok(Destination::Settled(Box::new(attractor))),
                    }
                    maps += 1;
                    if let Some(k) = watch.see(body, &now) {
                        return Ok(came_to(k, known.len(), found, maps));
                    }
                }
                patience = 0;
            }
            _ => return Ok(Destination::Settled(Box::new(attractor))),
        }
    }
    Ok(Destination::Undecided(maps))
}

/// One of the known attractors, or of those that were found on the way.
fn came_to(k: usize, known: usize, mut found: Vec<(Known, Attractor)>, maps: usize) -> Destination {
    match k.checked_sub(known) {
        None => Destination::Known(k, maps),
        Some(k) => {
            let mut attractor = found.swap_remove(k).1;
            attractor.seen.maps = maps;
            Destination::Settled(Box::new(attractor))
        }
    }
}
