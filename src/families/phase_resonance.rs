//! Tests of phase resonance: at one value of a number of the scene after the other the frequency of the loads is steered to where the displacement lags a quarter of a period
//! behind them ([`crate::orbit::phase_lag`]), as in a laboratory, with what its readings are off by.

use std::f64::consts::{FRAC_PI_2, TAU};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::parameters::{beside_frequency, systems};
use super::start::given;
use super::{FamilyError, uniform};
use crate::continuation::Go;
use crate::orbit::phase_lag::{self, Gains, Period, Steering};
use crate::orbit::quadrature::Quadrature;
use crate::orbit::values::Bodies;
use crate::orbit::{OrbitError, Propagator};
use crate::problem::Problem;
use crate::records::{PhaseResonance, Reading, Resonance, ResonanceRow, Test};
use crate::scenario::Scene;

/// Periods that a loop is given to come to rest.
const MOST: usize = 20_000;
/// It is at rest after so many periods near a quarter turn.
const HOLD: usize = 5;
/// What is left of a transient in the size of what is read, over the tolerance of the lag.
const SIZE: f64 = 10.0;
/// Where readings are off, after two windows whose means are near by so many standard deviations, each so many periods long at least, and so many times as long as the body takes to
/// settle; and a third one that is waited.
const DEVIATIONS: f64 = 2.5;
const WINDOW: usize = 16;
const LONG: f64 = 3.0;
/// Frequencies that are so many times higher or lower than the first one are none of a resonance nearby.
const AWAY: f64 = 5.0;

/// Told of what is known after each row.
pub type Take<'a> = &'a mut dyn FnMut(&PhaseResonance) -> Result<Go, FamilyError>;

/// What is missing of a test, from the scene's own state, or from rest. Whether it came to its end: an interruption (`take` says so, or `ends_now` within a row) leaves whole rows.
pub fn follow(
    (scene, problem): (&Scene, &Problem),
    found: &mut PhaseResonance,
    (take, ends_now): (Take, &dyn Fn() -> bool),
) -> Result<Go, FamilyError> {
    let key = &found.test.key;
    let value = scene.number(key).map_err(|e| OrbitError::Value(f64::NAN, e.to_string()))?;
    let mut make = systems(scene, key, value)?;
    let mut bodies = Bodies::new(&mut make, value, 1)?;
    let first = given(scene, &problem.initial, &bodies.frame).pop();
    let first = first.unwrap_or_else(|| vec![0.0; 2 * bodies.frame.n()]);
    let values = found.test.values();
    for (k, &value) in values.iter().enumerate().skip(found.rows.len()) {
        let locked = found.rows.iter().rev().find(|row| row.is_locked);
        let from = locked.map_or((&first, found.test.omega), |row| (&row.x, row.omega.mean));
        let z = bodies.in_body(value, from.0)?;
        let mut noise = Noise::new(&found.test, k);
        let asked = (&found.test, value);
        let row = lock(bodies.body(value)?, (&z, from.1), asked, (&mut noise, ends_now))?;
        let Some(mut row) = row else { return Ok(Go::Break(())) };
        if row.is_locked {
            if !found.test.by.is_empty() {
                let there = scene.with_number(key, value);
                let there = there.map_err(|e| OrbitError::Value(value, e.to_string()))?;
                differentiate(&there, bodies.body(value)?, &found.test.by, &mut row)?;
            }
            row.x = bodies.out_of_body(value, &row.x)?;
        }
        found.rows.push(row);
        if take(found)?.is_break() {
            return Ok(Go::Break(()));
        }
    }
    Ok(Go::Continue(()))
}

/// Make what a loop found exact, and differentiate it by numbers of the scene; in words, why not.
fn differentiate(
    scene: &Scene,
    body: &mut Propagator,
    keys: &[String],
    row: &mut ResonanceRow,
) -> Result<(), FamilyError> {
    row.by = vec![Resonance::NONE; keys.len()];
    let Some(exact) = Quadrature::near(body, &row.x, row.omega.mean)? else {
        row.note = "no derivatives: no orbit at phase resonance that has any is found near".into();
        return Ok(());
    };
    let exactly = |mean: f64| Reading { mean, error: 0.0 };
    let Resonance { omega, work, .. } = exact.readings;
    (row.omega, row.lag, row.work) = (exactly(omega), exactly(FRAC_PI_2), exactly(work));
    if body.system.rest().is_none() {
        row.amplitude = exactly(exact.readings.amplitude);
    }
    row.x.clone_from(&exact.orbit.z);
    if let Some(mut read) = phase_lag::period(body, &row.x, omega)? {
        read.refine(body, &row.x, omega)?;
        (row.force, row.energy, row.kinetic) = (exactly(read.force), read.energy, read.kinetic);
    }
    let parameters = beside_frequency(scene, &body.system, keys);
    let parameters = parameters.map_err(|e| OrbitError::Value(row.value, e.to_string()))?;
    for ((mut parameter, key), by) in parameters.into_iter().zip(keys).zip(&mut row.by) {
        match exact.by(body, &mut parameter) {
            Ok(found) => *by = found,
            Err(OrbitError::Parameter(why)) => row.note = format!("no derivative by {key}: {why}"),
            Err(e) => return Err(e.into()),
        }
    }
    Ok(())
}

/// What readings are off by: independent normal deviates, those of a row by themselves.
struct Noise {
    size: f64,
    generator: ChaCha8Rng,
}

impl Noise {
    fn new(test: &Test, row: usize) -> Noise {
        let mut generator = ChaCha8Rng::seed_from_u64(test.seed);
        generator.set_stream(row as u64);
        Noise { size: test.noise, generator }
    }

    /// The next deviate, after Box and Muller.
    fn next(&mut self) -> f64 {
        if self.size == 0.0 {
            return 0.0;
        }
        // in the middle of their cells: none is zero
        let mut middle = || uniform(&mut self.generator) + 0.5 / (1u64 << 53) as f64;
        let (r, turn) = (middle(), middle());
        self.size * (-2.0 * r.ln()).sqrt() * (TAU * turn).cos()
    }
}

/// Periods in which what is left of a transient shows: several times as many as the body takes to settle, as the gains of its loop tell it.
pub fn window(gains: Gains) -> usize {
    WINDOW.max((LONG / gains.decay()).ceil() as usize).min(MOST / 4)
}

/// What is known of the periods of a loop so far.
#[derive(Default)]
struct Log {
    /// `e`
    errors: Vec<f64>,
    omegas: Vec<f64>,
    /// `|p|`
    sizes: Vec<f64>,
}

/// When a loop is at rest.
struct Rest {
    /// Periods that are looked at at once.
    window: usize,
    /// The lag is as near as this to a quarter turn, of every period or, where readings are off, in the mean of a window.
    near: f64,
    /// A frequency moves by less.
    moves: f64,
    /// The size of what is read grows, or falls, by a smaller share: at a frequency that is right from the first period on the lag says nothing.
    grows: f64,
    is_off: bool,
}

impl Rest {
    fn new(test: &Test, gains: Gains) -> Rest {
        let Gains { proportional, integral } = gains;
        if test.noise == 0.0 {
            let moves = proportional.max(integral) * test.tolerance;
            // what is left of a transient falls by this share of itself in a period
            let grows = SIZE * test.tolerance * gains.decay();
            return Rest { window: HOLD, near: test.tolerance, moves, grows, is_off: false };
        }
        let window = window(gains);
        let near = test.tolerance.max(DEVIATIONS * test.noise / (window as f64).sqrt());
        Rest { window, near, moves: 2.0 * near * proportional, grows: 2.0 * near, is_off: true }
    }

    /// Whether a loop is, by all periods so far.
    fn is_reached(&self, Log { errors, omegas, sizes }: &Log) -> bool {
        let last = |all: &[f64], count: usize| all.len().checked_sub(count);
        if !self.is_off {
            let Some(from) = last(errors, self.window) else { return false };
            let still = |pair: &[f64]| (pair[1] - pair[0]).abs() <= self.moves;
            let steady = |pair: &[f64]| (pair[1] - pair[0]).abs() <= self.grows * pair[1];
            return errors[from..].iter().all(|e| e.abs() <= self.near)
                && omegas[from..].windows(2).all(still)
                && sizes[from..].windows(2).all(steady);
        }
        let Some(from) = last(errors, 2 * self.window) else { return false };
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        let means = |all: &[f64]| [0, self.window].map(|k| mean(&all[from + k..][..self.window]));
        let ([before, now], [small, large]) = (means(omegas), means(sizes));
        errors[from..].chunks_exact(self.window).all(|window| mean(window).abs() <= self.near)
            && (now - before).abs() <= self.moves
            && (large - small).abs() <= self.grows * large
    }

    /// Periods that are waited behind that.
    fn wait(&self) -> usize {
        if self.is_off { self.window } else { 0 }
    }
}

/// Steer the frequency from a state and a frequency until the loop is at rest, and read what is then, at a value of the number of a test; none where it was interrupted.
fn lock(
    body: &mut Propagator,
    (first, omega): (&[f64], f64),
    (test, value): (&Test, f64),
    (noise, ends_now): (&mut Noise, &dyn Fn() -> bool),
) -> Result<Option<ResonanceRow>, FamilyError> {
    let [proportional, integral] = test.gains;
    let gains = Gains { proportional, integral };
    let rest = Rest::new(test, gains);
    let mut wait = None;
    let mut steering = Steering::new(omega, gains);
    let mut z = first.to_vec();
    let (mut log, mut measured) = (Log::default(), vec![]);
    let lost = |periods: usize, note: String| Ok(Some(ResonanceRow::lost(value, periods, note)));
    let mut all: Vec<Period> = vec![];
    while all.len() < test.average {
        if ends_now() {
            return Ok(None);
        }
        let (omega, k) = (steering.omega, log.errors.len());
        if !(omega > test.omega / AWAY && omega < test.omega * AWAY) {
            return lost(k, format!("the loop has left: omega = {omega:.4}"));
        }
        let Some(mut period) = phase_lag::period(body, &z, omega)? else {
            return lost(k, "the motion could not be followed".into());
        };
        // of many readings with their noise the mean is taken
        if wait == Some(0) && test.noise == 0.0 {
            period.refine(body, &z, omega)?;
        }
        if period.power.norm() == 0.0 {
            return lost(k, "the loads do not move the body".into());
        }
        let period = period.read([(); 4].map(|()| noise.next()));
        let (e, size) = (period.error(), period.power.norm());
        z.clone_from(&period.z);
        steering.steer(e);
        if wait == Some(0) {
            all.push(period);
            measured.push(omega);
            continue;
        }
        if k == MOST {
            return lost(k, format!("not locked: the lag is still {e:.1e} off; other --gains?"));
        }
        log.errors.push(e);
        log.omegas.push(omega);
        log.sizes.push(size);
        wait = match wait {
            Some(left) => Some(left - 1),
            None => rest.is_reached(&log).then(|| rest.wait()),
        };
    }
    let reading = |of: fn(&Period) -> f64| Reading::of(&all.iter().map(of).collect::<Vec<_>>());
    let [energy, kinetic] = [reading(|p| p.energy), reading(|p| p.kinetic)].map(|r| r.mean);
    Ok(Some(ResonanceRow {
        value,
        is_locked: true,
        periods: log.errors.len(),
        omega: Reading::of(&measured),
        lag: reading(Period::lag),
        amplitude: reading(|p| p.amplitude),
        force: reading(|p| p.force),
        work: reading(Period::work),
        energy,
        kinetic,
        x: z,
        by: vec![],
        note: String::new(),
    }))
}
