//! What a forced body does in the long run: the period map, again and again, until it comes back; then Newton's method makes an orbit of it.
//!
//! Newton's method from a linear response finds nothing where that is many gaps high; a damped body finds its attractor by itself. The state of each period is compared
//! with those of the twelve periods before: at the first return within each of some distances Newton's method is tried on that many periods.

use std::convert::Infallible;

use super::OrbitError;
use super::chain::Propagator;
use super::credentials::Orbit;
use super::search::{Effort, Verdict, find};
use super::section::later;
use super::shooting::{Closure, Settings};
use crate::continuation::norm;

/// Most periods that a body is given.
const MOST: usize = 400;
/// Returns after up to so many periods are looked for.
const LONGEST: usize = 12;
/// Distances of a return, over the size of the state, at which Newton's method is tried, each once.
const NEAR: [f64; 6] = [0.2, 0.03, 3e-3, 3e-4, 1e-5, 1e-7];
/// Newton's method may leave the return by so many times what the returns to come would add up to, and by at most so much.
const MOVED: (f64, f64) = (5.0, 0.5);

/// A motion that is so many times as large as the unit of the body, and as it was at first, grows without bound.
const UNBOUNDED: f64 = 1e6;
/// One that is so small, likewise, may have come to rest.
const QUIET: f64 = 1e-9;
/// Numbers of periods with which Newton's method is tried where patience is at its end, and for how many more periods the body must then come nearer.
const LAST: ([usize; 6], usize) = ([1, 2, 3, 4, 6, 8], 40);

/// An orbit that is back as near as this earlier than after all of its periods, over its size, has fewer.
const SHORTER: f64 = 1e-6;

/// What a body settled to.
#[derive(Debug)]
pub enum Settled {
    /// A stable orbit of one or several periods of the loads.
    Orbit(Box<Orbit>),
    /// It comes to rest: its loads do not move it.
    Rest(Box<Orbit>),
    /// The body does not come back within [`MOST`] periods: the least distance of a return over the size of the state, and the last state.
    Restless {
        /// Least distance.
        least: f64,
        /// Frame vector.
        z: Vec<f64>,
    },
    /// The body comes back after so many periods of the loads, and the motion is no orbit for what speaks against it.
    Flawed {
        /// Number of periods.
        periods: usize,
        /// Frame vector.
        z: Vec<f64>,
        /// What speaks against it.
        flaws: Vec<String>,
    },
    /// It grows without bound.
    Unbounded,
    /// Its motion could not be followed, and why.
    Broken(String),
}

/// What came of settling.
#[derive(Debug)]
pub struct Settling {
    /// What the body settled to.
    pub to: Settled,
    /// Periods of the loads that it was followed for.
    pub periods: usize,
}

/// The state a period of the loads later, or why it could not be followed.
pub(super) fn next(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
) -> Result<Result<Vec<f64>, String>, OrbitError> {
    match later(body, z, omega, 1.0) {
        Ok(z) => Ok(Ok(z)),
        Err(e) if e.is_of_one_motion() => Ok(Err(e.to_string())),
        Err(e) => Err(e),
    }
}

/// The distance of two frame vectors over the size of the first, wherever the body has walked to.
pub(super) fn distance(body: &Propagator, a: &[f64], b: &[f64]) -> f64 {
    body.drift.apart(a, b) / norm(a).max(body.unit)
}

/// What Newton's method finds from a state.
enum Near {
    /// A stable orbit, and how far it is from there.
    Stable(Box<Orbit>, f64),
    /// No motion.
    Rest(Box<Orbit>),
    /// A motion that repeats and is none.
    Flawed(Vec<String>),
    Nothing,
}

/// What Newton's method finds from a state with `p` periods.
fn near(body: &mut Propagator, p: usize, z: &[f64], omega: f64) -> Result<Near, OrbitError> {
    let newton = Settings { iterations: 12, ..Settings::default() };
    let effort = Effort { newton, rescue: false, ..Effort::default() };
    let orbit = match find(body, Closure::Forced(p), z, omega, &effort)? {
        // beside a doubling a body that comes back every other period is near an orbit of one
        Verdict::Flawed { orbit, .. } if orbit.is_repeated() => return Ok(Near::Nothing),
        Verdict::Flawed { orbit, flaws } if orbit.is_at_rest && flaws.len() == 1 => {
            return Ok(Near::Rest(orbit));
        }
        Verdict::Flawed { flaws, .. } => return Ok(Near::Flawed(flaws)),
        Verdict::Orbit(orbit) => orbit,
        _ => return Ok(Near::Nothing),
    };
    if orbit.stability.as_ref().is_some_and(|s| !s.is_stable()) {
        return Ok(Near::Nothing);
    }
    let far = distance(body, z, &orbit.z);
    // one that comes back earlier is one of fewer periods, and no other
    for q in (1..p).filter(|q| p.is_multiple_of(*q)) {
        let Ok(early) = later(body, &orbit.z, omega, q as f64) else { return Ok(Near::Nothing) };
        if distance(body, &orbit.z, &early) < SHORTER {
            return Ok(match near(body, q, &orbit.z, omega)? {
                Near::Stable(orbit, _) => Near::Stable(orbit, far),
                other => other,
            });
        }
    }
    Ok(Near::Stable(orbit, far))
}

/// What a motion is that repeats and is no orbit.
pub(super) fn repeats(periods: usize, flaws: &[String]) -> String {
    let after = if periods == 1 { "a period".into() } else { format!("{periods} periods") };
    format!("the body comes back after {after} of the loads, but {}", flaws.join(", "))
}

/// Let a body settle under loads of frequency `omega` from the frame vector `z`.
pub fn settle(body: &mut Propagator, z: &[f64], omega: f64) -> Result<Settling, OrbitError> {
    match settle_unless(body, z, omega, 0, |_, _| None::<Infallible>)? {
        Ok(settling) => Ok(settling),
        Err((never, _)) => match never {},
    }
}

/// Let a body settle unless what it comes to is recognised: told of the state after each period, `known` says what it is. For the first `patience` periods nothing else is looked for.
/// What was recognised, and the periods that it took; or what the body settled to.
pub fn settle_unless<R>(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
    patience: usize,
    mut known: impl FnMut(&Propagator, &[f64]) -> Option<R>,
) -> Result<Result<Settling, (R, usize)>, OrbitError> {
    let mut past = vec![z.to_vec()];
    // the next distance at which each number of periods is tried
    let mut tries = [0; LONGEST + 1];
    let mut least = f64::INFINITY;
    let scale = norm(z).max(body.unit);
    let mut is_quiet = false;
    for k in 1..=MOST {
        let ended = |to| Ok(Ok(Settling { to, periods: k }));
        let now = match next(body, &past[k - 1], omega)? {
            Ok(now) => now,
            Err(why) => return ended(Settled::Broken(why)),
        };
        if norm(&now) > UNBOUNDED * scale {
            return ended(Settled::Unbounded);
        }
        let returns: Vec<f64> =
            (1..=LONGEST.min(k)).map(|p| distance(body, &now, &past[k - p])).collect();
        if let Some(recognised) = known(body, &now) {
            return Ok(Err((recognised, k)));
        }
        past.push(now.clone());
        if k <= patience {
            continue;
        }
        // where nothing is left of a motion Newton's method has nothing to be relative to
        if !is_quiet && norm(&now) <= QUIET * scale {
            is_quiet = true;
            if let Near::Rest(orbit) = near(body, 1, &vec![0.0; now.len()], omega)? {
                return ended(Settled::Rest(orbit));
            }
        }
        for (p, &d) in (1..).zip(&returns) {
            least = least.min(d);
            // a multiple of a shorter return is none of its own
            let is_multiple = (1..p).any(|q| p % q == 0 && returns[q - 1] <= 2.0 * d);
            if is_multiple || tries[p] >= NEAR.len() || d >= NEAR[tries[p]] {
                continue;
            }
            while tries[p] < NEAR.len() && d < NEAR[tries[p]] {
                tries[p] += 1;
            }
            let before = (k > 2 * p).then(|| distance(body, &past[k - p], &past[k - 2 * p]));
            let ratio = before.map_or(0.0, |b| (d / b).min(0.99));
            let reach = (MOVED.0 * d / (1.0 - ratio)).min(MOVED.1);
            match near(body, p, &now, omega)? {
                Near::Stable(orbit, moved) if moved <= reach => {
                    return ended(Settled::Orbit(orbit));
                }
                Near::Rest(orbit) if tries[p] == NEAR.len() => return ended(Settled::Rest(orbit)),
                Near::Flawed(flaws) if tries[p] == NEAR.len() => {
                    return ended(Settled::Flawed { periods: p, z: now, flaws });
                }
                _ => {}
            }
        }
    }
    let last = &past[MOST];
    let (to, more) = match approached(body, last, omega)? {
        Some(orbit) => (Settled::Orbit(orbit), LAST.1),
        None => (Settled::Restless { least, z: last.clone() }, 0),
    };
    Ok(Ok(Settling { to, periods: MOST + more }))
}

/// The stable orbit that a body approaches, however slowly: near a bifurcation multipliers are near the unit circle.
fn approached(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
) -> Result<Option<Box<Orbit>>, OrbitError> {
    let (numbers, more) = LAST;
    for p in numbers {
        let Near::Stable(orbit, far) = near(body, p, z, omega)? else { continue };
        let mut now = z.to_vec();
        for _ in 0..more / p * p {
            match next(body, &now, omega)? {
                Ok(z) => now = z,
                Err(_) => return Ok(None),
            }
        }
        if far <= MOVED.1 && distance(body, &now, &orbit.z) < far {
            return Ok(Some(orbit));
        }
    }
    Ok(None)
}

/// The mean of the states of an orbit at the beginnings of its periods of the loads; none where they could not be followed.
fn middle(
    body: &mut Propagator,
    orbit: &Orbit,
    omega: f64,
) -> Result<Option<Vec<f64>>, OrbitError> {
    let p = orbit.closure.periods();
    let (mut z, mut sum) = (orbit.z.clone(), orbit.z.clone());
    for _ in 1..p {
        match next(body, &z, omega)? {
            Ok(later) => z = later,
            Err(_) => return Ok(None),
        }
        sum.iter_mut().zip(&z).for_each(|(sum, z)| *sum += z);
    }
    sum.iter_mut().for_each(|sum| *sum /= p as f64);
    Ok(Some(sum))
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
        let Settling { to, periods } = settle(body, state, omega)?;
        match to {
            Settled::Orbit(orbit) if orbit.closure == closure => return Ok(Ok(orbit)),
            Settled::Orbit(orbit) => {
                let p = orbit.closure.periods();
                // beside a stable orbit of several periods there is an unstable one of one, near one of its states or in their middle
                for guess in [middle(body, &orbit, omega)?, Some(orbit.z.clone())] {
                    let Some(guess) = guess else { continue };
                    let verdict = find(body, closure, &guess, omega, &Effort::default())?;
                    if let Some(orbit) = verdict.orbit() {
                        return Ok(Ok(Box::new(orbit.clone())));
                    }
                }
                why.push(format!("the body settles to an orbit of {p} periods of the loads"));
            }
            Settled::Rest(_) => why.push("the body comes to rest".into()),
            Settled::Restless { least, z } => {
                if least >= NEAR[NEAR.len() - 1] {
                    why.push(format!(
                        "the body does not come back within {periods} periods (nearest return {least:.1e} of its size)"
                    ));
                    continue;
                }
                // it has come back, to an orbit that is unstable for what it never meets: a symmetric body that moves symmetrically
                let verdict = find(body, closure, &z, omega, &Effort::default())?;
                if let Some(orbit) = verdict.orbit() {
                    return Ok(Ok(Box::new(orbit.clone())));
                }
                why.push(format!(
                    "the body comes back (to {least:.1e} of its size), to no stable orbit of one period: {verdict}"
                ));
            }
            Settled::Flawed { periods, flaws, .. } => why.push(repeats(periods, &flaws)),
            Settled::Unbounded => why.push("the motion grows without bound".into()),
            Settled::Broken(reason) => {
                why.push(format!("the motion could not be followed: {reason}"));
            }
        }
    }
    // with all its means from the linear response, for the cause if for nothing else
    let verdict = find(body, closure, &linear, omega, &Effort::default())?;
    if let Some(orbit) = verdict.orbit() {
        return Ok(Ok(Box::new(orbit.clone())));
    }
    let said = verdict.to_string();
    why.insert(0, said.strip_prefix("not found: ").unwrap_or(&said).to_owned());
    why.dedup();
    Ok(Err(why.join("; ")))
}
