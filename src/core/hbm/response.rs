//! Families of harmonic-balance solutions: the ladder of harmonics at a frequency, and the family for [`crate::continuation`].

use std::convert::Infallible;

use faer::Mat;

use super::balance::{Balance, Quadrature};
use super::crossing::Crossing;
use super::newton::{Settings, condensed_residual, jacobian};
use super::receptance::Receptance;
use super::reduction::Reduction;
use super::series::{Basis, Series};
use super::solution::{Ended, Solution};
use super::{Balanced, HbmError, Interface};
use crate::contact::{Phase, States, System};
use crate::continuation::{Family, JUMP, Units, norm};
use crate::event::SwitchKind;
use crate::orbit::Highest;
use crate::records::{GapReason, crest};

/// What a solution is in the time domain: energy, amplitude, contact time, switches over a whole period.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Energy at the far point (`t = 0` of a reversible motion), or the largest over the period of a forced one.
    pub energy: f64,
    /// Largest contact displacement.
    pub amplitude: f64,
    /// The same from its mean.
    pub swing: f64,
    /// Time in contact.
    pub contact_time: f64,
    /// Switches over the period: time, contact point, what it does.
    pub switches: Vec<(f64, usize, SwitchKind)>,
}

/// States along a period at which extremes are looked for.
const SAMPLES: usize = 200;

impl Summary {
    /// Walk along a solution.
    pub fn new(body: &dyn Balanced, s: &Solution) -> Result<Summary, HbmError> {
        Ok(Summary::along(body.interface(), s, &body.displacements(s)?))
    }

    /// Walk along a solution whose displacements are known.
    pub(super) fn along(interface: &Interface, s: &Solution, series: &Series) -> Summary {
        let system = &interface.system;
        let (mut u, mut amplitude) = (vec![0.0; system.n()], 0.0f64);
        let end = s.q.basis.end();
        let mut phases = std::collections::HashMap::new();
        let mut last: Vec<(f64, Vec<f64>)> = vec![];
        let mut all: Vec<Vec<f64>> = vec![];
        for k in 0..=SAMPLES {
            let theta = end * k as f64 / SAMPLES as f64;
            let j = s.phase_at(theta);
            let set: &States = &s.sets()[j];
            if !phases.contains_key(set) {
                phases.insert(set.clone(), system.phase(set));
            }
            let phase = &phases[set];
            let state = s.state(series, theta, j);
            let t = theta / s.omega;
            phase.expand_displacement(t, &state.u, &mut u);
            all.push(system.beside_rest(&system.at_points(&u)));
            let moved: Vec<f64> = all[k].iter().map(|u| u.abs()).collect();
            amplitude = moved.iter().fold(amplitude, |m, u| m.max(*u));
            if let [(t0, a), (t1, b)] = &last[..] {
                // the top between the samples
                let tops = (0..moved.len()).map(|i| crest([*t0, *t1, t], [a[i], b[i], moved[i]]));
                amplitude = tops.fold(amplitude, f64::max);
                last.remove(0);
            }
            last.push((t, moved));
        }
        let energy = match s.q.basis {
            // the far point
            Basis::Cosine => {
                system.energy_in(&system.phase(&s.sets()[0]), 0.0, &s.state(series, 0.0, 0))
            }
            Basis::Full => largest_energy(system, s, series),
        };
        let tau = std::f64::consts::TAU;
        let forth =
            |c: &Crossing| (c.theta / s.omega, c.point, SwitchKind::of_states(c.from, c.to));
        let mut switches: Vec<(f64, usize, SwitchKind)> = s.crossings.iter().map(forth).collect();
        let mirrored = s.q.basis == Basis::Cosine;
        if mirrored {
            let back: Vec<_> = s
                .crossings
                .iter()
                .rev()
                .map(|c| ((tau - c.theta) / s.omega, c.point, SwitchKind::of_states(c.to, c.from)))
                .collect();
            switches.extend(back);
        }
        let mut contact_time = 0.0;
        for (set, (a, b)) in s.phases() {
            if set.count_closed() > 0 {
                contact_time += (b - a) / s.omega * if mirrored { 2.0 } else { 1.0 };
            }
        }
        Summary { energy, amplitude, swing: swing(&all[..SAMPLES]), contact_time, switches }
    }
}

/// Largest distance from its mean that a contact point has, of displacements at even steps of a period.
fn swing(all: &[Vec<f64>]) -> f64 {
    let points = all.first().map_or(0, Vec::len);
    let of = |i: usize| {
        let mean = all.iter().map(|u| u[i]).sum::<f64>() / all.len() as f64;
        all.iter().fold(0.0f64, |m, u| m.max((u[i] - mean).abs()))
    };
    (0..points).map(of).fold(0.0, f64::max)
}

/// The largest energy of a series, which jumps at its switches: states of every phase with both of its ends, and the maxima between them.
fn largest_energy(system: &System, s: &Solution, series: &Series) -> f64 {
    let of = |j: usize, phase: &Phase, theta: f64| {
        system.energy_in(phase, theta / s.omega, &s.state(series, theta, j))
    };
    let phases: Vec<(Phase, (f64, f64))> =
        s.phases().map(|(set, span)| (system.phase(set), span)).collect();
    let mut highest = Highest::default();
    for (j, (phase, (a, b))) in phases.iter().enumerate() {
        let steps = (SAMPLES as f64 * (b - a) / s.q.basis.end()).ceil().max(4.0) as usize;
        for k in 0..=steps {
            let theta = a + (b - a) * k as f64 / steps as f64;
            highest.note(theta, of(j, phase, theta));
        }
        highest.end_phase();
    }
    let energy = |theta: f64| {
        let j = phases.partition_point(|(_, (_, end))| *end < theta);
        let j = j.min(phases.len() - 1);
        of(j, &phases[j].0, theta)
    };
    highest.of(Some(&energy))
}

/// The modal displacement of a mode of the open phase (from 0) that grazes the obstacle.
pub(super) fn grazing_of_mode(reduction: &Reduction, mode: usize) -> Option<f64> {
    crate::contact::grazing_of(&reduction.system, reduction.open.shapes.col_as_slice(mode))
}

/// The start that the method knows: one harmonic, the first mode at `amplitude` times grazing.
pub fn mode_start(reduction: &Reduction, amplitude: f64) -> Option<Series> {
    let scale = grazing_of_mode(reduction, 0)?;
    let mut q = Series::zeros(reduction.basis, 1, reduction.n());
    // the far point at t = 0
    q.of_mut(1)[0] = -amplitude * scale;
    Some(q)
}

/// A body at rest.
pub(super) fn at_rest(body: &dyn Balanced, n_h: usize) -> Series {
    Series::zeros(body.interface().basis, n_h, body.components())
}

/// Raise the number of harmonics by one until `n_h`, from a solution with fewer.
pub fn ladder(
    body: &dyn Balanced,
    from: &Series,
    n_h: usize,
    omega: f64,
    settings: &Settings,
) -> Result<Result<Solution, GapReason>, HbmError> {
    let mut q = from.clone();
    let mut last = Err(GapReason::NoStart);
    for k in from.n_h + 1..=n_h {
        match body.solve(&q.with_harmonics(k), omega, settings)? {
            Ok(s) => {
                q = s.q.clone();
                last = Ok(s);
            }
            // a step that fails is skipped: the next number of harmonics may succeed
            Err(failure) => {
                q = q.with_harmonics(k);
                last = Err(failure);
            }
        }
    }
    Ok(last)
}

/// Harmonic balance as a family: `X = (n, ω)` with the interface projections as unknowns, one chart.
pub struct Harmonics<'a> {
    /// The body; its harmonic loads follow the frequency.
    pub body: &'a mut dyn Balanced,
    /// Number of harmonics.
    pub n_h: usize,
}

impl Harmonics<'_> {
    fn series(&self, x: &[f64]) -> Series {
        let interface = self.body.interface();
        let mut n = Series::zeros(interface.basis, self.n_h, interface.rank());
        n.a.copy_from_slice(&x[..x.len() - 1]);
        n
    }

    /// `X` of a solution.
    pub fn unknowns(s: &Solution) -> Vec<f64> {
        s.n.a.iter().copied().chain([s.omega]).collect()
    }

    /// The solution at `X`, or why it is none of the contact problem.
    pub fn solution(&mut self, x: &[f64]) -> Result<Result<Solution, GapReason>, HbmError> {
        let omega = x[x.len() - 1];
        let (r, balance, receptance) = self.at(x)?;
        let n = self.series(x);
        let y = receptance.answer(Some(&n));
        let q = self.body.series_of(&n, omega)?;
        let interface = self.body.interface();
        let residual = norm(&r) / norm(&n.a).max(f64::MIN_POSITIVE);
        let ended = Ended { omega, q, y, n: balance.n.clone(), residual, iterations: 0 };
        Solution::examine(interface, ended, balance, Quadrature::EventResolved)
    }

    /// The residual, the projections, and what the open body answers.
    fn at(&mut self, x: &[f64]) -> Result<(Vec<f64>, Balance, Receptance), HbmError> {
        let omega = x[x.len() - 1];
        self.body.set_frequency(omega);
        let receptance = self.body.receptance(self.n_h, omega)?;
        let (n, at) = (self.series(x), (omega, Quadrature::EventResolved));
        let interface = self.body.interface();
        let (r, _, balance) = condensed_residual(interface, &receptance, (&n, &[]), at)?;
        Ok((r, balance, receptance))
    }
}

impl Family for Harmonics<'_> {
    type Chart = ();
    type Border = Infallible;
    type Error = HbmError;

    fn residual(&mut self, x: &[f64]) -> Result<Vec<f64>, HbmError> {
        Ok(self.at(x)?.0)
    }

    fn linearise(&mut self, x: &[f64]) -> Result<(Vec<f64>, Mat<f64>), HbmError> {
        let omega = x[x.len() - 1];
        let h = 1e-6 * omega;
        let mut at = |s: f64| {
            let mut y = x.to_vec();
            y[x.len() - 1] += s;
            self.residual(&y)
        };
        let (up, down) = (at(h)?, at(-h)?);
        let (r, balance, receptance) = self.at(x)?;
        let j = jacobian(&receptance, &balance);
        let m = r.len();
        let whole =
            Mat::from_fn(
                m,
                m + 1,
                |i, c| {
                    if c < m { j[(i, c)] } else { (up[i] - down[i]) / (2.0 * h) }
                },
            );
        Ok((r, whole))
    }

    fn units(&self) -> Units {
        let interface = self.body.interface();
        let force = self.body.force_unit();
        let mut unknowns = vec![force; interface.basis.len(self.n_h) * interface.rank()];
        unknowns.push(interface.system.units.frequency);
        Units { unknowns, residual: force }
    }

    fn rounding(&self, x: &[f64]) -> f64 {
        1e-12 * norm(&x[..x.len() - 1]).max(self.body.force_unit())
    }

    fn weights(&self, x: &[f64]) -> Vec<f64> {
        let force_unit = self.body.force_unit();
        let size =
            x[..x.len() - 1].iter().map(|x| x * x).sum::<f64>().max(1e-2 * force_unit.powi(2));
        let last = x.len() - 1;
        (0..x.len())
            .map(|i| if i < last { 1.0 / size } else { 100.0 / (x[last] * x[last]) })
            .collect()
    }

    fn chart(&self) {}

    fn set_chart(&mut self, (): &()) {}
}

/// Where a point of a sequential continuation came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// From the points before it.
    Continued,
    /// From a solution with fewer harmonics at the same frequency.
    Ladder,
    /// From the first mode.
    Started,
}

/// One point of a sequential continuation.
#[derive(Debug)]
pub struct Point {
    /// Frequency.
    pub omega: f64,
    /// Number of harmonics.
    pub n_h: usize,
    /// The solution, or why there is none.
    pub solution: Result<Solution, GapReason>,
    /// Where it came from.
    pub origin: Origin,
    /// Far from what the points before it let expect.
    pub jumped: bool,
    /// With the lowest number of harmonics: the solution of one harmonic that the ladder at this frequency begins with.
    pub base: Option<Series>,
}

/// Starts of the first mode, over grazing.
const STARTS: [f64; 10] = [1.02, 1.1, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 4.0, 6.0];

/// What sequential continuation knows of one number of harmonics: the last two solutions.
#[derive(Debug, Default, Clone)]
pub struct Track {
    known: Vec<(f64, Series)>,
}

impl Track {
    /// Add a solution.
    pub fn push(&mut self, omega: f64, q: Series) {
        self.known.push((omega, q));
        if self.known.len() > 2 {
            self.known.remove(0);
        }
    }

    /// Guesses at `omega`, best first.
    fn guesses(&self, omega: f64) -> Vec<Series> {
        let flat: Vec<(f64, Vec<f64>)> =
            self.known.iter().map(|(w, q)| (*w, q.a.clone())).collect();
        let Some((_, like)) = self.known.last() else { return vec![] };
        crate::continuation::guesses(&flat, omega)
            .into_iter()
            .map(|(_, a)| Series { a, ..like.clone() })
            .collect()
    }
}

/// A walk over frequencies.
pub struct Walk<'a> {
    /// Numbers of harmonics, ascending.
    pub harmonics: &'a [usize],
    /// Frequencies, in order.
    pub grid: &'a [f64],
    /// Newton's settings.
    pub settings: &'a Settings,
    /// A solution with so many harmonics at a frequency that is known from elsewhere.
    pub elsewhere: &'a dyn Fn(usize, f64) -> Option<Series>,
}

impl<'a> Walk<'a> {
    /// One that knows nothing from elsewhere.
    pub fn new(harmonics: &'a [usize], grid: &'a [f64], settings: &'a Settings) -> Walk<'a> {
        Walk { harmonics, grid, settings, elsewhere: &|_, _| None }
    }
}

/// Sequential continuation for several numbers of harmonics at once, as the seed does: the secant, the previous point, then what is known from elsewhere, then the
/// ladder from the next lower number. `tracks` hold what is known before the first frequency, one for each of `1` and `harmonics`.
pub fn sequential(
    body: &mut dyn Balanced,
    walk: &Walk,
    tracks: &mut [Track],
    mut take: impl FnMut(&dyn Balanced, Point) -> crate::continuation::Go,
) -> Result<(), HbmError> {
    let Walk { harmonics, grid, settings, elsewhere } = *walk;
    for &omega in grid {
        body.set_frequency(omega);
        let mut below: Option<Series> = None;
        let mut base: Option<Series> = None;
        for (k, track) in tracks.iter_mut().enumerate() {
            let n_h = if k == 0 { 1 } else { harmonics[k - 1] };
            let guesses = track.guesses(omega);
            let others = (elsewhere(n_h, omega), below.as_ref());
            let mut found = attempt(body, &guesses, others, (n_h, omega), settings)?;
            if k == 0 && found.is_err() {
                found = started(body, omega, settings)?.map_or(found, Ok);
            }
            let (solution, origin, jumped) = match found {
                Ok((s, origin)) => {
                    track.push(omega, s.q.clone());
                    below = Some(s.q.clone());
                    let jumped = guesses.first().is_some_and(|e| is_far(&e.a, &s.q.a));
                    (Ok(s), origin, jumped)
                }
                Err(failure) => (Err(failure), Origin::Ladder, false),
            };
            if k == 0 {
                base.clone_from(&below);
                continue;
            }
            let point = Point { omega, n_h, solution, origin, jumped, base: base.take() };
            if take(body, point).is_break() {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// A solution of one harmonic where nothing is known: from rest (forced), or from the first mode.
fn started(
    body: &mut dyn Balanced,
    omega: f64,
    settings: &Settings,
) -> Result<Option<(Solution, Origin)>, HbmError> {
    let starts: Vec<Series> = match body.interface().basis {
        Basis::Full => vec![at_rest(body, 1)],
        Basis::Cosine => STARTS.iter().filter_map(|&a| body.mode_start(a)).collect(),
    };
    for start in starts {
        if let Ok(s) = body.solve(&start, omega, settings)? {
            return Ok(Some((s, Origin::Started)));
        }
    }
    let is_forced = body.interface().basis == Basis::Full;
    for from in WAYS_IN.into_iter().filter(|_| is_forced) {
        let found = walked_in(body, (omega, from), settings)?;
        body.set_frequency(omega);
        if let Some(s) = found {
            return Ok(Some((s, Origin::Started)));
        }
    }
    Ok(None)
}

/// Frequencies over that which is asked for from which forced bodies are followed: away from a resonance nothing touches or slips, or all does.
const WAYS_IN: [f64; 2] = [2.0, 0.5];

/// Steps on such a way.
const STEPS_IN: u32 = 24;

/// The solution of one harmonic at a frequency, by way of others.
fn walked_in(
    body: &mut dyn Balanced,
    (omega, from): (f64, f64),
    settings: &Settings,
) -> Result<Option<Solution>, HbmError> {
    let mut track = Track::default();
    for step in 0..=STEPS_IN {
        let there = omega * f64::powf(from, 1.0 - f64::from(step) / f64::from(STEPS_IN));
        body.set_frequency(there);
        let mut found = None;
        for guess in track.guesses(there).into_iter().chain([at_rest(body, 1)]) {
            if let Ok(s) = body.solve(&guess, there, settings)? {
                found = Some(s);
                break;
            }
        }
        match found {
            Some(s) if step == STEPS_IN => return Ok(Some(s)),
            Some(s) => track.push(there, s.q),
            None => {}
        }
    }
    Ok(None)
}

/// A solution of `n_h` harmonics from the first of the guesses that leads to one, else the one without contact, else the one that is known from elsewhere, else from the
/// one with fewer harmonics `below`.
fn attempt(
    body: &dyn Balanced,
    guesses: &[Series],
    (elsewhere, below): (Option<Series>, Option<&Series>),
    (n_h, omega): (usize, f64),
    settings: &Settings,
) -> Result<Result<(Solution, Origin), GapReason>, HbmError> {
    let mut failure = GapReason::NotConverged { residual: f64::NAN, iterations: 0 };
    for guess in guesses {
        match body.solve(guess, omega, settings)? {
            Ok(s) => return Ok(Ok((s, Origin::Continued))),
            Err(e) => failure = e,
        }
    }
    // behind its fold a forced response does not reach the obstacle any more
    if body.interface().basis == Basis::Full && !guesses.is_empty() {
        let at_once = Settings { iterations: 2, ..*settings };
        if let Ok(s) = body.solve(&at_rest(body, n_h), omega, &at_once)? {
            return Ok(Ok((s, Origin::Started)));
        }
    }
    if let Some(known) = elsewhere
        && let Ok(s) = body.solve(&known, omega, settings)?
    {
        return Ok(Ok((s, Origin::Started)));
    }
    if let Some(from) = below {
        let raised = match from.n_h == n_h {
            true => body.solve(from, omega, settings)?,
            false => ladder(body, from, n_h, omega, settings)?,
        };
        match raised {
            Ok(s) => return Ok(Ok((s, Origin::Ladder))),
            Err(e) => failure = e,
        }
    }
    // few harmonics may have no solution where many have one
    let is_first = below.is_none() && guesses.is_empty();
    if body.interface().basis == Basis::Full && is_first && n_h > 1 {
        match body.solve(&at_rest(body, n_h), omega, settings)? {
            Ok(s) => return Ok(Ok((s, Origin::Started))),
            Err(e) => failure = e,
        }
    }
    Ok(Err(failure))
}

/// Whether a solution is far from what the points before it let expect.
pub(super) fn is_far(expected: &[f64], found: &[f64]) -> bool {
    let d: f64 = expected.iter().zip(found).map(|(a, b)| (a - b).powi(2)).sum();
    d > JUMP * JUMP * found.iter().map(|x| x * x).sum::<f64>()
}
