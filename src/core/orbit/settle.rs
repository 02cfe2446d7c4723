//! What a forced body does in the long run: the period map, again and again, until it comes back; then Newton's method makes an orbit of it.
//!
//! Newton's method from a linear response finds nothing where that is many gaps high; a damped body finds its attractor by itself. The state of each period is compared
//! with those of the twelve periods before: at the first return within each of some distances Newton's method is tried on that many periods.

use super::chain::Propagator;
use super::credentials::Orbit;
use super::search::{Effort, find};
use super::section::later;
use super::shooting::{Closure, Settings};
use super::{OrbitError, tolerate};
use crate::continuation::norm;

/// Most periods that a body is given.
const MOST: usize = 400;
/// Returns after up to so many periods are looked for.
const LONGEST: usize = 12;
/// Distances of a return, over the size of the state, at which Newton's method is tried, each once.
const NEAR: [f64; 6] = [0.2, 0.03, 3e-3, 3e-4, 1e-5, 1e-7];
/// Newton's method may leave the return by so many times what the returns to come would add up to, and by at most so much.
const MOVED: (f64, f64) = (5.0, 0.5);

/// What came of settling.
#[derive(Debug)]
pub enum Settled {
    /// A stable orbit of one or several periods of the loads.
    Orbit(Box<Orbit>),
    /// The body does not come back within so many periods; the least distance of a return over the size of the state.
    Restless {
        /// Periods.
        periods: usize,
        /// Least distance.
        least: f64,
    },
    /// Its motion could not be followed.
    Broken,
}

/// Let a body settle under loads of frequency `omega` from the frame vector `z`.
pub fn settle(body: &mut Propagator, z: &[f64], omega: f64) -> Result<Settled, OrbitError> {
    let mut past = vec![z.to_vec()];
    // the next distance at which each number of periods is tried
    let mut next = [0; LONGEST + 1];
    let mut least = f64::INFINITY;
    for k in 1..=MOST {
        let Some(now) = tolerate(later(body, &past[k - 1], omega, 1.0))? else {
            return Ok(Settled::Broken);
        };
        let size = norm(&now).max(body.unit);
        let distance = |a: &[f64], b: &[f64]| {
            norm(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>()) / size
        };
        let returns: Vec<f64> =
            (1..=LONGEST.min(k)).map(|p| distance(&now, &past[k - p])).collect();
        past.push(now.clone());
        for (p, &d) in (1..).zip(&returns) {
            least = least.min(d);
            // a multiple of a shorter return is none of its own
            let is_multiple = (1..p).any(|q| p % q == 0 && returns[q - 1] <= 2.0 * d);
            if is_multiple || next[p] >= NEAR.len() || d >= NEAR[next[p]] {
                continue;
            }
            while next[p] < NEAR.len() && d < NEAR[next[p]] {
                next[p] += 1;
            }
            let before = (k > 2 * p).then(|| distance(&past[k - p], &past[k - 2 * p]));
            let ratio = before.map_or(0.0, |b| (d / b).min(0.99));
            let reach = (MOVED.0 * d / (1.0 - ratio)).min(MOVED.1);
            let closure = Closure::Forced(p);
            let newton = Settings { iterations: 12, ..Settings::default() };
            let effort = Effort { newton, rescue: false, ..Effort::default() };
            let verdict = find(body, closure, &now, omega, &effort)?;
            let Some(orbit) = verdict.orbit() else { continue };
            let is_stable = orbit.stability.as_ref().is_none_or(|s| s.is_stable());
            if is_stable && distance(&orbit.z, &now) <= reach {
                return Ok(Settled::Orbit(Box::new(orbit.clone())));
            }
        }
    }
    Ok(Settled::Restless { periods: MOST, least })
}

/// The orbit of the loads' own period that a body has, or comes to, at a frequency: where nothing touches the linear response itself; else what Newton's method makes
/// of the guesses; else what the body settles to, from the guesses and from rest. In words, why there is none.
pub fn ladder(
    body: &mut Propagator,
    guesses: &[Vec<f64>],
    omega: f64,
) -> Result<Result<Box<Orbit>, String>, OrbitError> {
    let closure = Closure::FORCED;
    body.system.loads_mut().set_frequency(omega);
    let linear = body.linear_response();
    // nothing of a linear response that touches is worth more than a few steps
    let newton = Settings { iterations: 8, ..Settings::default() };
    let quick = Effort { newton, rescue: false, ..Effort::default() };
    for guess in guesses.iter().chain([&linear]) {
        let verdict = find(body, closure, guess, omega, &quick)?;
        if let Some(orbit) = verdict.orbit() {
            return Ok(Ok(Box::new(orbit.clone())));
        }
    }
    let (rest, mut why) = (vec![0.0; linear.len()], vec![]);
    for state in guesses.iter().chain([&rest]) {
        match settle(body, state, omega)? {
            Settled::Orbit(orbit) if orbit.closure == closure => return Ok(Ok(orbit)),
            Settled::Orbit(orbit) => {
                let p = orbit.closure.periods();
                // beside a stable orbit of several periods there is an unstable one of one
                let verdict = find(body, closure, &orbit.z, omega, &Effort::default())?;
                if let Some(orbit) = verdict.orbit() {
                    return Ok(Ok(Box::new(orbit.clone())));
                }
                why.push(format!("the body settles to an orbit of {p} periods of the loads"));
            }
            Settled::Restless { periods, least } => why.push(format!(
                "the body does not come back within {periods} periods (nearest return {least:.1e} of its size)"
            )),
            Settled::Broken => why.push("the motion could not be followed".into()),
        }
    }
    // with all its means from the linear response, for the cause if for nothing else
    let verdict = find(body, closure, &linear, omega, &Effort::default())?;
    if let Some(orbit) = verdict.orbit() {
        return Ok(Ok(Box::new(orbit.clone())));
    }
    why.insert(0, verdict.to_string());
    why.dedup();
    Ok(Err(why.join("; ")))
}
