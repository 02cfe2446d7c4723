//! All orbits of one frequency that a set of starts leads to.
//!
//! Most starts lead nowhere, so each is given up as soon as little comes of it ([`Settings::scout`]). They are independent of each other and go on all
//! threads, each with the modes of its own phases; what they found is put together in their order, so that results do not depend on the number of
//! threads. Orbits are neighbours of orbits: those that are found are starts again, pushed along a few modes.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::OrbitError;
use super::branch::mode_guess;
use super::chain::{Propagator, Spent};
use super::credentials::{Orbit, examine};
use super::search::{Effort, Verdict, find, same};
use super::shooting::{Closure, Settings};

/// How often the neighbours of what is new are looked at.
const ROUNDS: usize = 2;
/// Modes along which orbits are pushed, and how far, over grazing.
const PUSHED: std::ops::RangeInclusive<usize> = 1..=4;
const PUSHES: [f64; 2] = [-0.1, 0.1];

/// All different orbits of one frequency that shooting reached.
#[derive(Debug)]
pub struct Found {
    /// By energy.
    pub orbits: Vec<Orbit>,
    /// Number of starts.
    pub starts: usize,
    /// What all of them took.
    pub spent: Spent,
}

/// All different orbits of frequency `omega` that shooting reaches from `starts` and from the neighbours of what it found.
/// `tick` is told how many are done, and of how many.
pub fn all(
    body: &mut Propagator,
    closure: Closure,
    starts: &[Vec<f64>],
    omega: f64,
    effort: &Effort,
    tick: impl Fn(usize, usize) + Sync,
) -> Result<Found, OrbitError> {
    let newton = Settings { scout: true, ..effort.newton };
    let quick = Effort { multipliers: false, rescue: false, newton };
    let mut found: Vec<Orbit> = vec![];
    let (mut next, mut count) = (starts.to_vec(), 0);
    let mut spent = Spent::default();
    for _ in 0..=ROUNDS {
        let (known, done) = (found.len(), count);
        count += next.len();
        let shot = shoot_all(body, closure, &next, omega, &quick, |k| tick(done + k, count))?;
        spent = spent + shot.1;
        for orbit in shot.0 {
            let mut is_known = false;
            for known in &found {
                is_known = is_known || same(body, known, &orbit)?;
            }
            if !is_known {
                found.push(orbit);
            }
        }
        next = found[known..].iter().flat_map(|o| neighbours(body, &o.z)).collect();
    }
    found.sort_by(|a, b| a.energy.total_cmp(&b.energy));
    let mut credentials = |o: &Orbit| {
        examine(body, closure, &o.z, closure.period(omega), o.iterations, effort.multipliers)
    };
    let found: Result<_, _> = found.iter().map(&mut credentials).collect();
    Ok(Found { orbits: found?, starts: count, spent: spent + body.spent() })
}

/// The orbits that starts lead to, in their order, and what they took.
fn shoot_all(
    body: &Propagator,
    closure: Closure,
    starts: &[Vec<f64>],
    omega: f64,
    effort: &Effort,
    tick: impl Fn(usize) + Sync,
) -> Result<(Vec<Orbit>, Spent), OrbitError> {
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let (system, stop) = (&body.system, &body.stop);
    let worker = |_| -> Result<(Vec<(usize, Orbit)>, Spent), OrbitError> {
        let mut own = Propagator::new(system.clone())?;
        own.stop = stop.clone();
        let mut found = vec![];
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(start) = starts.get(k) else { return Ok((found, own.spent())) };
            if let Verdict::Orbit(orbit) = find(&mut own, closure, start, omega, effort)? {
                found.push((k, *orbit));
            }
            tick(done.fetch_add(1, Ordering::Relaxed) + 1);
        }
    };
    let workers = rayon::current_num_threads().min(starts.len());
    let shot: Result<Vec<_>, _> = (0..workers).into_par_iter().map(worker).collect();
    let (mut found, mut spent) = (vec![], Spent::default());
    for (orbits, own) in shot? {
        found.extend(orbits);
        spent = spent + own;
    }
    found.sort_by_key(|(k, _)| *k);
    Ok((found.into_iter().map(|(_, orbit)| orbit).collect(), spent))
}

/// A state pushed along a few modes.
fn neighbours(body: &Propagator, z: &[f64]) -> Vec<Vec<f64>> {
    let pushes = PUSHED.flat_map(|mode| PUSHES.map(|share| (mode, share)));
    let guesses = pushes.filter_map(|(mode, share)| mode_guess(body, mode, share));
    let pushed = |push: Vec<f64>| {
        let mut z = z.to_vec();
        z.iter_mut().zip(push).for_each(|(z, p)| *z += p);
        z
    };
    guesses.map(pushed).collect()
}

/// A set of starts for [`all`]: the first mode from grazing to `most` times grazing, alone and with each of the next modes that move the
/// contact edge at a few shares of its amplitude; between obstacles that face each other from both sides.
pub fn starts(body: &Propagator, most: f64, amplitudes: usize) -> Vec<Vec<f64>> {
    let mut list = of_first_mode(body, most, amplitudes);
    if is_between(body) {
        let mirrored: Vec<Vec<f64>> = list.iter().map(|z| z.iter().map(|z| -z).collect()).collect();
        list.extend(mirrored);
    }
    list
}

/// Whether obstacles face each other.
fn is_between(body: &Propagator) -> bool {
    let constraints = &body.system.constraints;
    let against =
        |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() < 0.0;
    constraints.iter().any(|c| against(&c.normal, &constraints[0].normal))
}

fn of_first_mode(body: &Propagator, most: f64, amplitudes: usize) -> Vec<Vec<f64>> {
    let mut list = vec![];
    for k in 0..amplitudes {
        let a = 1.03 * (most / 1.03).powf(k as f64 / (amplitudes.max(2) - 1) as f64);
        let Some(first) = mode_guess(body, 1, -a) else { continue };
        list.push(first.clone());
        for mode in 2..=4 {
            for share in [-0.3, -0.1, 0.1, 0.3] {
                if let Some(other) = mode_guess(body, mode, share) {
                    list.push(first.iter().zip(&other).map(|(a, b)| a + b).collect());
                }
            }
        }
    }
    list
}
