//! The limit cycle that a body comes to by itself, kept going by friction on a moving surface.
//!
//! The motion is followed from switch to switch. A state at a switch is compared with those at earlier switches between the same two phases: at the first return within each of
//! some distances Newton's method is tried on the time between them.

use std::collections::HashMap;
use std::f64::consts::TAU;

use super::OrbitError;
use super::chain::Propagator;
use super::credentials::Orbit;
use super::period_map::{Kept, Passage, integrate, integrate_with};
use super::search::{Effort, find};
use super::shooting::{Closure, Settings};
use crate::contact::{State, States};
use crate::continuation::apart;

/// The motion is followed in pieces of so many periods of the lowest mode, so many of them.
const PIECE: f64 = 10.0;
const PIECES: usize = 60;
/// A body that has not switched since this part of the time has come to an end of switching.
const QUIET: f64 = 0.5;
/// So many earlier switches of a kind are remembered.
const REMEMBERED: usize = 12;
/// Distances of a return, over how far the motion goes, at which Newton's method is tried, each once.
const NEAR: [f64; 4] = [0.1, 1e-2, 1e-3, 1e-5];
/// An orbit starts so much of its period behind a switch: not on it.
const BEHIND: f64 = 0.01;
/// Newton's method may leave the return by so much, over how far the motion goes.
const MOVED: f64 = 0.5;

/// A state at a switch.
struct Visit {
    t: f64,
    z: Vec<f64>,
}

/// A state that comes back: as a frame vector, the time until then, and how near, over how far the motion goes.
struct Return {
    z: Vec<f64>,
    after: f64,
    distance: f64,
}

/// The states at switches, by the phases that they part.
#[derive(Default)]
struct Memory {
    visits: HashMap<(States, States), Vec<Visit>>,
    first: Option<Vec<f64>>,
    /// How far states at switches are from the first.
    reach: f64,
}

impl Memory {
    /// Remember a state, and find where it was before: the nearest of the earlier ones, of nearly equal ones the latest.
    fn add(&mut self, between: (States, States), visit: Visit) -> Option<Return> {
        let first = self.first.get_or_insert_with(|| visit.z.clone());
        self.reach = self.reach.max(apart(first, &visit.z));
        let known = self.visits.entry(between).or_default();
        let distances = known.iter().rev().map(|old| (apart(&old.z, &visit.z), old.t));
        let nearest = distances.fold(None, |best: Option<(f64, f64)>, (d, t)| match best {
            Some((least, _)) if 2.0 * d >= least => best,
            _ => Some((d, t)),
        });
        let found = nearest.map(|(d, t)| Return {
            z: visit.z.clone(),
            after: visit.t - t,
            distance: d / self.reach.max(f64::MIN_POSITIVE),
        });
        known.push(visit);
        if known.len() > REMEMBERED {
            known.remove(0);
        }
        found
    }
}

/// The orbit that Newton's method makes of a return.
fn close(
    body: &mut Propagator,
    back: &Return,
    reach: f64,
) -> Result<Option<Box<Orbit>>, OrbitError> {
    let start = integrate(body, &body.state(&back.z), BEHIND * back.after)?.report.last;
    let z = body.frame(&start);
    let guess = [&z[..], &[back.after]].concat();
    let newton = Settings { iterations: 15, ..Settings::default() };
    let effort = Effort { newton, rescue: false, ..Effort::default() };
    let verdict = find(body, Closure::Limit, &guess, TAU / back.after, &effort)?;
    let Some(orbit) = verdict.orbit() else { return Ok(None) };
    let stays = apart(&body.frame(&orbit.state), &z) <= MOVED * reach;
    Ok(stays.then(|| Box::new(orbit.clone())))
}

/// The limit cycle that a body comes to from a state; in words, why there is none.
pub fn approach(
    body: &mut Propagator,
    from: &State,
) -> Result<Result<Box<Orbit>, String>, OrbitError> {
    let lowest = body.home.modes.iter().map(|m| m.omega).find(|w| *w > 0.0);
    let piece = PIECE * TAU / lowest.unwrap_or(body.system.units.frequency);
    let mut memory = Memory::default();
    let (mut state, mut begun) = (from.clone(), 0.0);
    let (mut tries, mut least, mut last) = (0, f64::INFINITY, None);
    for _ in 0..PIECES {
        let mut kept = Kept::new(body);
        let Passage { report, .. } = match integrate_with(body, &state, piece, 0, &mut kept) {
            Ok(passage) => passage,
            Err(e) if e.is_of_one_motion() => {
                return Ok(Err(format!("the motion could not be followed: {e}")));
            }
            Err(e) => return Err(e),
        };
        last = report.switches.last().map(|s| begun + s.t).or(last);
        let mut returns = vec![];
        for s in &report.switches {
            let Some(there) = kept.at(s.t) else { continue };
            let visit = Visit { t: begun + s.t, z: body.frame(there) };
            let between = (s.before.clone(), s.after.clone());
            returns.extend(memory.add(between, visit));
        }
        for back in returns {
            least = least.min(back.distance);
            if back.after <= 0.0 || tries >= NEAR.len() || back.distance >= NEAR[tries] {
                continue;
            }
            while tries < NEAR.len() && back.distance < NEAR[tries] {
                tries += 1;
            }
            if let Some(orbit) = close(body, &back, memory.reach)? {
                return Ok(Ok(orbit));
            }
        }
        (state, begun) = (report.last, begun + piece);
    }
    Ok(Err(match last {
        None => format!("nothing switches within {begun:.4}: the body slides steadily, or rests"),
        Some(t) if t < QUIET * begun => format!(
            "nothing switches from {t:.4} to {begun:.4}: the body slides steadily, or rests"
        ),
        Some(_) => format!(
            "the body does not come back within {begun:.4} (nearest return {least:.1e} of its motion)"
        ),
    }))
}
