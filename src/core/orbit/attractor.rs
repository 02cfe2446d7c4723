//! What a forced body does in the long run, whatever that is: an orbit, a quasi-periodic motion, chaos; with what is seen of it.
//!
//! Where nothing periodic attracts, the largest Lyapunov exponent tells what does: the mean logarithm by which a tangent of the motion grows in a period of the
//! loads, `λT = ⟨ln |DF(x_k) e_k|⟩` with `e_{k+1} = DF(x_k) e_k / |DF(x_k) e_k|`, over some hundred periods. Its standard error is that of the means of blocks
//! of periods, so long that they hang together no more.

use std::convert::Infallible;
use std::f64::consts::TAU;

use faer::Mat;

use super::chain::Propagator;
use super::credentials::Orbit;
use super::extremes::{Extremes, Watching};
use super::lyapunov::Carried;
use super::period_map::integrate_with;
use super::settle::{Settled, Settling, repeats, settle, settle_unless};
use super::{OrbitError, tolerate};
use crate::event::{Observer, Sample, Switch};
use crate::records::{AttractorKind, AttractorRecord, ExtremesRecord, largest, mean_with_error};

/// Periods over which an exponent is taken: those that are left out at first, blocks, periods of a block.
const EXPONENT: (usize, usize, usize) = (20, 10, 20);
/// All of them.
const PERIODS: usize = EXPONENT.0 + EXPONENT.1 * EXPONENT.2;
/// A motion is chaotic if its exponent is above this a period, and above so many standard errors.
const CHAOTIC: (f64, f64) = (0.01, 4.0);
/// What came back as near as this comes back for good, in the end.
const RETURNED: f64 = 1e-4;
/// What is clearly chaotic by its exponent, a period, is waited for so many periods more, all else as long as at first: a fall off a fold takes its time, and ends.
const AGAIN: usize = 80;
const CLEAR: f64 = 0.05;
/// Periods that are looked at of what is not periodic.
const LOOKED_AT: usize = 40;
/// Stored states a period.
pub(super) const STATES: usize = 128;
/// States besides in a window behind a switch: a blow on a stiff stop is over within two windows.
const BEHIND: usize = 8;
/// Lines of a spectrum: from 0 to so many times the frequency of the loads, and how many in one of it.
const LINES: (usize, usize) = (8, 12);

/// What a forced body does in the long run.
#[derive(Debug, Clone)]
pub struct Attractor {
    /// What is seen of it.
    pub seen: AttractorRecord,
    /// The orbit, if it is one.
    pub orbit: Option<Box<Orbit>>,
    /// A state of it at the beginning of a period of the loads: a frame vector.
    pub z: Vec<f64>,
}

/// What a body does under loads of frequency `omega` that moves from the frame vector `z`, once it has settled.
pub fn attractor(body: &mut Propagator, z: &[f64], omega: f64) -> Result<Attractor, OrbitError> {
    body.system.loads_mut().set_frequency(omega);
    let settling = settle(body, z, omega)?;
    of_settling(body, z, omega, settling)
}

/// What a body settled to that moved from the frame vector `z`.
pub(super) fn of_settling(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
    Settling { to, periods: maps }: Settling,
) -> Result<Attractor, OrbitError> {
    let found = |kind, exponent: (f64, f64), note: String| Found {
        kind,
        exponent,
        note,
        maps,
        is_told: false,
    };
    let repeats_as = |orbit: &Orbit, note: &str, is_told: bool| {
        let p = orbit.closure.periods();
        let exponent = orbit.stability.as_ref().map_or(f64::NAN, |s| s.largest.ln() / p as f64);
        let found = found(AttractorKind::Periodic(p), (exponent, 0.0), note.into());
        let found = Found { is_told, ..found };
        looked_at(body, &orbit.z, omega, p, found)
    };
    match to {
        Settled::Orbit(orbit) => {
            let seen = repeats_as(&orbit, "", true)?;
            Ok(Attractor { orbit: Some(orbit), ..seen })
        }
        Settled::Rest(orbit) => repeats_as(&orbit, "at rest", false),
        Settled::Restless { least, z } => {
            let told = format!("nearest return {least:.1e} of the size of the state");
            let Some((exponent, z)) = tolerate(exponent(body, &z, omega))? else {
                let why = "its exponent could not be computed".into();
                return looked_at(
                    body,
                    &z,
                    omega,
                    LOOKED_AT,
                    found(AttractorKind::Slow, (f64::NAN, f64::NAN), why),
                );
            };
            let kind = judged(exponent, least);
            // it may have settled in these periods
            let is_clear = kind == AttractorKind::Chaotic && exponent.0 > CLEAR;
            let wait = if is_clear { AGAIN } else { usize::MAX };
            let mut waited = 0;
            let long = |_: &Propagator, _: &[f64]| {
                waited += 1;
                (waited >= wait).then_some(())
            };
            if let Ok(again) = settle_unless(body, &z, omega, 0, long)? {
                let maps = maps + PERIODS + again.periods;
                if let Settled::Orbit(_) | Settled::Rest(_) | Settled::Unbounded = again.to {
                    let settling = Settling { to: again.to, periods: maps };
                    return of_settling(body, &z, omega, settling);
                }
            }
            looked_at(body, &z, omega, LOOKED_AT, found(kind, exponent, told))
        }
        Settled::Flawed { periods, z, flaws } => {
            let why = repeats(periods, &flaws);
            let found = found(AttractorKind::Lost, (f64::NAN, f64::NAN), why);
            looked_at(body, &z, omega, periods, found)
        }
        Settled::Unbounded => Ok(nothing(
            body,
            z,
            found(AttractorKind::Unbounded, (f64::NAN, f64::NAN), String::new()),
        )),
        Settled::Broken(why) => {
            Ok(nothing(body, z, found(AttractorKind::Lost, (f64::NAN, f64::NAN), why)))
        }
    }
}

/// What a body does in so many periods of loads of frequency `omega`, from the frame vector `z`, without waiting for it to settle.
pub fn dwell(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
    periods: usize,
) -> Result<Attractor, OrbitError> {
    body.system.loads_mut().set_frequency(omega);
    let found = Found {
        kind: AttractorKind::Transient,
        exponent: (f64::NAN, f64::NAN),
        note: String::new(),
        maps: periods,
        is_told: false,
    };
    looked_at(body, z, omega, periods, found)
}

/// What is known of an attractor before it is looked at.
struct Found {
    kind: AttractorKind,
    exponent: (f64, f64),
    note: String,
    maps: usize,
    /// An orbit goes with it, which knows what forces and probes come to.
    is_told: bool,
}

/// Of which kind a motion is that does not come back, by its exponent and its standard error, and by its nearest return.
fn judged((exponent, error): (f64, f64), least: f64) -> AttractorKind {
    let (large, errors) = CHAOTIC;
    if exponent > large && exponent > errors * error {
        AttractorKind::Chaotic
    } else if exponent.abs() <= large && least > RETURNED {
        AttractorKind::QuasiPeriodic
    } else {
        AttractorKind::Slow
    }
}

/// The largest Lyapunov exponent of a motion, a period of the loads, with its standard error; and the state at its end.
fn exponent(
    body: &Propagator,
    z: &[f64],
    omega: f64,
) -> Result<((f64, f64), Vec<f64>), OrbitError> {
    let (before, _, length) = EXPONENT;
    let period = TAU / omega;
    let mut z = z.to_vec();
    // no direction is preferred
    let mut e = Mat::from_fn(z.len(), 1, |i, _| (1.0 + i as f64).sqrt().fract() - 0.5);
    let mut growths = vec![];
    for _ in 0..PERIODS {
        let Carried { columns: next, z: there, .. } = Carried::over(body, &z, &e, period)?;
        let grown = next.norm_l2();
        growths.push((grown / e.norm_l2()).max(f64::MIN_POSITIVE).ln());
        if !(grown.is_finite() && grown > 0.0) {
            break;
        }
        e = Mat::from_fn(z.len(), 1, |i, _| next[(i, 0)] / grown);
        z = there;
    }
    let means: Vec<f64> = growths
        .get(before..)
        .unwrap_or_default()
        .chunks_exact(length)
        .map(|block| block.iter().sum::<f64>() / length as f64)
        .collect();
    Ok((mean_with_error(&means), z))
}

/// Extremes and histories of the contact points over a motion.
pub(super) struct Look<'a> {
    pub body: &'a Propagator,
    step: f64,
    /// Displacements of the contact points.
    moved: Extremes,
    /// Force of all contact points together, energy, kinetic energy.
    sums: Extremes,
    /// What is watched besides, where it is asked for.
    watching: Option<Watching<'a>>,
    /// Displacements at even steps of time.
    history: Vec<Vec<f64>>,
}

impl<'a> Look<'a> {
    /// At a motion over a time, of which so many states are stored.
    pub fn new(body: &'a Propagator, until: f64, states: usize) -> Look<'a> {
        let step = until / states as f64;
        let [moved, sums] = [0; 2].map(|_| Extremes::default());
        Look { body, step, moved, sums, watching: None, history: vec![] }
    }

    /// Largest force of all contact points together, energy and kinetic energy.
    pub fn sums(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| self.sums.largest.get(k).map_or(0.0, |x| x.max(0.0)))
    }

    /// Largest displacement of a contact point in magnitude.
    pub fn amplitude(&self) -> f64 {
        largest(&self.moved.largest, &self.moved.least)
    }
}

impl Observer for Look<'_> {
    type Error = Infallible;

    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        let system = &self.body.system;
        let u = system.at_points(s.u);
        let areas = system.constraints.iter().map(|c| c.area);
        let force = s.pressure.iter().zip(areas).map(|(p, a)| p * a).sum::<f64>();
        let energies = s.energies.map_or([f64::NAN; 2], |e| [e.total(), e.kinetic]);
        self.sums.note(s.t, vec![force, energies[0], energies[1]]);
        if let Some(watching) = &mut self.watching {
            watching.note(s);
        }
        let due = self.history.len() as f64 * self.step;
        if s.t >= due - 1e-9 * self.step {
            self.history.push(u.clone());
        }
        self.moved.note(s.t, u);
        Ok(())
    }

    fn switch(&mut self, s: &Switch) -> Result<(), Infallible> {
        // what comes is of another phase: forces and energies may jump
        self.sums.cut();
        if let Some(watching) = &mut self.watching {
            watching.switch(s.t, &s.before);
        }
        Ok(())
    }

    fn takes_accelerations(&self) -> bool {
        self.watching.as_ref().is_some_and(Watching::takes_accelerations)
    }

    fn looks_behind_switches(&self) -> usize {
        BEHIND
    }
}

/// What is seen of a motion over so many periods of the loads; it ends with the state behind them.
fn looked_at(
    body: &Propagator,
    z: &[f64],
    omega: f64,
    periods: usize,
    found: Found,
) -> Result<Attractor, OrbitError> {
    let n_c = body.system.n_contact();
    let until = periods as f64 * TAU / omega;
    let states = STATES * periods;
    let mut look = Look::new(body, until, states);
    look.watching = (!found.is_told).then(|| Watching::new(&body.system));
    let passage = match integrate_with(body, &body.state(z), until, states, &mut look) {
        Ok(passage) => passage,
        Err(e) if e.is_of_one_motion() => {
            let found = Found { kind: AttractorKind::Lost, note: e.to_string(), ..found };
            return Ok(nothing(body, z, found));
        }
        Err(e) => return Err(e),
    };
    let [force, energy, _] = look.sums();
    let Look {
        moved: Extremes { largest: peak, least: trough, .. }, watching, mut history, ..
    } = look;
    // the end of the last period is the beginning of the next
    history.truncate(states);
    let sections = history.iter().step_by(STATES).flatten().copied().collect();
    let least = history
        .chunks_exact(STATES)
        .flat_map(|period| {
            (0..n_c).map(|i| period.iter().map(|u| u[i]).fold(f64::INFINITY, f64::min))
        })
        .collect();
    let moved = |i: &usize| peak[*i] - trough[*i];
    let lead = (0..n_c).max_by(|a, b| moved(a).total_cmp(&moved(b)));
    let spectrum = lead
        .map_or(vec![], |i| spectrum(&history.iter().map(|u| u[i]).collect::<Vec<_>>(), periods));
    let Found { kind, exponent: (exponent, exponent_error), note, maps, .. } = found;
    let switches = passage.report.switches.len() as f64 / periods as f64;
    let z = match kind {
        AttractorKind::Periodic(_) => z.to_vec(),
        _ => body.frame(&passage.report.last),
    };
    let seen = AttractorRecord {
        kind,
        exponent,
        exponent_error,
        peak,
        trough,
        force,
        energy,
        switches,
        sections,
        least,
        spectrum,
        extremes: watching.map(Watching::seen).unwrap_or_default(),
        maps,
        note,
    };
    Ok(Attractor { seen, orbit: None, z })
}

/// Where nothing is seen.
fn nothing(body: &Propagator, z: &[f64], found: Found) -> Attractor {
    let n_c = body.system.n_contact();
    let Found { kind, exponent: (exponent, exponent_error), note, maps, .. } = found;
    let seen = AttractorRecord {
        kind,
        exponent,
        exponent_error,
        peak: vec![f64::NAN; n_c],
        trough: vec![f64::NAN; n_c],
        force: f64::NAN,
        energy: f64::NAN,
        switches: f64::NAN,
        sections: vec![],
        least: vec![],
        spectrum: vec![f64::NAN; LINES.0 * LINES.1 + 1],
        extremes: ExtremesRecord::default(),
        maps,
        note,
    };
    Attractor { seen, orbit: None, z: z.to_vec() }
}

/// Magnitudes of the harmonics of a displacement over so many periods of the loads, at multiples of `1 / LINES.1` of their frequency: exact for what repeats
/// after a divisor of that many periods, else of the whole history through a window of Hann.
fn spectrum(history: &[f64], periods: usize) -> Vec<f64> {
    let (harmonics, parts) = LINES;
    let count = history.len();
    let exact = parts % periods == 0;
    let weight = |k: usize| match exact {
        true => 1.0,
        false => 1.0 - (TAU * k as f64 / count as f64).cos(),
    };
    let mean = history.iter().sum::<f64>() / count as f64;
    let line = |j: usize| {
        // whole turns of this line in the history, if it is one of an orbit
        let turns = (j * periods) as f64 / parts as f64;
        if exact && turns.fract() != 0.0 {
            return 0.0;
        }
        let (mut re, mut im) = (0.0, 0.0);
        for (k, x) in history.iter().enumerate() {
            let (sin, cos) = (TAU * turns * k as f64 / count as f64).sin_cos();
            re += weight(k) * (x - mean) * cos;
            im += weight(k) * (x - mean) * sin;
        }
        2.0 * f64::hypot(re, im) / count as f64
    };
    let mut lines: Vec<f64> = (0..=harmonics * parts).map(line).collect();
    lines[0] = mean.abs();
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spectrum_has_the_magnitudes_of_its_harmonics() {
        let of = |periods: usize, parts: f64| -> Vec<f64> {
            let count = STATES * periods;
            (0..count)
                .map(|k| {
                    let t = TAU * k as f64 / STATES as f64;
                    0.25 - 3.0 * (t - 0.4).cos() + 0.5 * (t / parts + 1.0).sin()
                })
                .collect()
        };
        for (periods, parts) in [(2, 2.0), (12, 4.0)] {
            let lines = spectrum(&of(periods, parts), periods);
            let at = |x: f64| lines[(12.0 * x).round() as usize];
            assert!((at(0.0) - 0.25).abs() < 1e-12 && (at(1.0) - 3.0).abs() < 1e-12);
            assert!((at(1.0 / parts) - 0.5).abs() < 1e-12 && at(2.0) < 1e-12);
        }
        // five periods are no divisor of twelve: through the window, but the heights stay
        let lines = spectrum(&of(40, 4.0), 40);
        assert!((lines[12] - 3.0).abs() < 1e-9 && (lines[3] - 0.5).abs() < 1e-9);
    }

    #[test]
    fn kinds_are_told_by_the_exponent() {
        assert_eq!(judged((0.7, 0.05), 0.1), AttractorKind::Chaotic);
        assert_eq!(judged((0.7, 0.3), 0.1), AttractorKind::Slow);
        assert_eq!(judged((1e-3, 1e-4), 0.1), AttractorKind::QuasiPeriodic);
        assert_eq!(judged((-1e-3, 1e-4), 1e-6), AttractorKind::Slow);
    }
}
