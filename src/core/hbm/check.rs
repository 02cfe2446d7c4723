//! A periodic series against the equations in time: is it a true motion, or how far from one?

use std::f64::consts::TAU;

use super::HbmError;
use super::play::{Jenkins, Walk};
use super::series::{Basis, Polynomial};
use crate::contact::{Phase, PointState, State, States, System};
use crate::continuation::norm;
use crate::orbit::period_map::integrate;
use crate::orbit::search::{Effort, Verdict, find};
use crate::orbit::{Closure, Orbit, OrbitError, Propagator};
use crate::records::VerdictKind;

/// A series `u_O(t) = Σ a_k cos kωt + b_k sin kωt` of another method.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Frequency.
    pub omega: f64,
    /// `a_0, a_1, b_1, a_2, b_2, …`, each of length `n_O`.
    pub coefficients: Vec<f64>,
    /// `α` of its feedback, if it is to be that of a viscous body.
    pub alpha: Option<f64>,
}

/// What the time domain says of a candidate.
#[derive(Debug, Clone)]
pub struct Checked {
    /// Energy at `t = 0`; of forced motions the largest of the samples.
    pub energy: f64,
    /// Root mean square over the period of `ü_O − ü_O(u, u̇)` over that of `ü_O`, in the norm of the open phase's mass.
    pub residual: f64,
    /// `‖x(T) − x(0)‖ / ‖x(0)‖` of its initial state.
    pub return_error: f64,
    /// What shooting from it found.
    pub verdict: Verdict,
    /// How the orbit that was found stands to the candidate.
    pub likeness: Likeness,
    /// Change of the contact time, over the period.
    pub contact_change: f64,
}

impl Checked {
    /// The verdict in a word: an orbit that the candidate does not approximate is another one.
    pub fn kind(&self) -> VerdictKind {
        match self.verdict.kind() {
            VerdictKind::Orbit if !self.likeness.is_near() => VerdictKind::AnotherOrbit,
            kind => kind,
        }
    }
}

/// An orbit nearer than this that has the switches of a series is the one that the series approximates.
pub const NEAR: f64 = 0.1;

/// How an orbit stands to a series from which it was shot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likeness {
    /// How far shooting moved the state, relative to the orbit.
    pub moved: f64,
    /// Whether nodes touch and leave in the same order.
    pub same_sequence: bool,
}

impl Likeness {
    /// No orbit was found.
    const NONE: Likeness = Likeness { moved: f64::NAN, same_sequence: false };

    /// Of an orbit to the state `z` that it was shot from (a frame vector), and to a sequence of switches: contact point, closes.
    pub fn new(orbit: &Orbit, z: &[f64], sequence: &[(usize, bool)]) -> Likeness {
        let found = orbit.closure.frame(&orbit.z);
        let d: Vec<f64> = found.iter().zip(z).map(|(a, b)| a - b).collect();
        // a series tells when a point slips less sharply than when it touches
        let of_contact = orbit.switches.iter().filter(|s| !s.kind.is_tangential());
        let of_orbit = of_contact.map(|s| (s.point, s.kind.arrives()));
        let same_sequence = of_orbit.eq(sequence.iter().copied());
        Likeness { moved: norm(&d) / norm(found), same_sequence }
    }

    /// Whether the series approximates the orbit.
    pub fn is_near(&self) -> bool {
        self.moved <= NEAR && self.same_sequence
    }
}

/// Times at which the residual is taken.
const SAMPLES: usize = 512;

impl Candidate {
    /// Displacements, velocities and accelerations at `t`.
    pub fn at(&self, n: usize, t: f64) -> [Vec<f64>; 3] {
        let [mut u, mut v, mut a] = [0; 3].map(|_| vec![0.0; n]);
        for (f, c) in self.coefficients.chunks_exact(n).enumerate() {
            let kw = f.div_ceil(2) as f64 * self.omega;
            let (sin, cos) = (kw * t).sin_cos();
            let is_sine = f > 0 && f % 2 == 0;
            let (x, dx) = if is_sine { (sin, kw * cos) } else { (cos, -kw * sin) };
            for i in 0..n {
                u[i] += x * c[i];
                v[i] += dx * c[i];
                a[i] -= kw * kw * x * c[i];
            }
        }
        [u, v, a]
    }

    /// The displacement over a row of `u_O`.
    fn along(&self, n: usize, of: impl Fn(&[f64]) -> f64) -> Polynomial {
        let parts: Vec<f64> = self.coefficients.chunks_exact(n).map(of).collect();
        Polynomial::new(Basis::Full, parts.len() / 2, &parts)
    }

    /// Whether it starts at rest and is symmetric in time: no sine parts.
    pub(crate) fn is_reversible(&self, n: usize) -> bool {
        let size = |f: usize| norm(&self.coefficients[f * n..(f + 1) * n]);
        let functions = self.coefficients.len() / n;
        let sines: f64 = (2..functions).step_by(2).map(size).sum();
        let all: f64 = (0..functions).map(size).sum();
        sines <= 1e-12 * all
    }
}

/// What rubs along a candidate. Sliders with springs are played; whether a point without one sticks is told by its velocity.
#[derive(Debug)]
pub struct Rubbing {
    /// Contact point, entry of `u_O` that its spring remembers by, what it does.
    springs: Vec<(usize, usize, Walk)>,
    /// Contact point, and the velocity below which it sticks.
    points: Vec<(usize, f64)>,
}

/// A point without a spring sticks where it moves by less of the largest velocity that it has: a series has no exact rest.
const STICKS: f64 = 0.05;

impl Rubbing {
    /// Of a body along a candidate.
    pub fn new(system: &System, candidate: &Candidate) -> Result<Rubbing, HbmError> {
        let mut rubbing = Rubbing { springs: vec![], points: vec![] };
        let points = system.tangents().into_iter().flatten().enumerate();
        for (point, tangent) in points.filter_map(|(i, t)| Some((i, t.as_ref()?))) {
            let w = candidate.along(system.n_o(), |u| tangent.along(u));
            match Jenkins::of(system, point) {
                Some((spring, memory)) => {
                    rubbing.springs.push((point, memory, spring.play(&w, TAU)?));
                }
                None => {
                    let at = |k: usize| w.at(TAU * k as f64 / SAMPLES as f64).1.abs();
                    let fastest = (0..SAMPLES).map(at).fold(0.0, f64::max);
                    rubbing.points.push((point, STICKS * fastest * candidate.omega));
                }
            }
        }
        Ok(rubbing)
    }

    /// Give a state, and the set in which what touches is known, what rubs.
    pub fn settle(
        &self,
        system: &System,
        theta: f64,
        (u, v): (&mut [f64], &[f64]),
        set: &mut States,
    ) {
        for (point, memory, walk) in &self.springs {
            let piece = walk.at(theta);
            u[*memory] = piece.memory.z;
            set.set(*point, piece.state);
        }
        for (point, slow) in &self.points {
            let tangent = system.tangent(*point).filter(|_| set.touches(*point));
            let Some(tangent) = tangent else { continue };
            let velocity = tangent.slip_velocity(v);
            let slips = velocity.abs() > *slow;
            set.set(*point, if slips { PointState::of_slip(velocity) } else { PointState::Stick });
        }
    }
}

/// Confront a candidate with the equations in time, and shoot from it.
pub fn check(
    body: &mut Propagator,
    closure: Closure,
    candidate: &Candidate,
    effort: &Effort,
) -> Result<Checked, HbmError> {
    let n = body.n();
    body.system.loads_mut().set_frequency(candidate.omega);
    let closure = match closure {
        Closure::Reversible if !candidate.is_reversible(n) => Closure::Autonomous,
        other => other,
    };
    let period = TAU / candidate.omega;
    let mut guess = match closure {
        Closure::Viscous(_) => vec![candidate.alpha.unwrap_or(0.0)],
        _ => vec![],
    };
    closure.adopt(body, &guess)?;
    let rubbing = Rubbing::new(&body.system, candidate)?;
    let Along { residual, contact_time, highest, sequence } =
        along(body, candidate, &rubbing, period)?;
    let [mut u, v, _] = candidate.at(n, 0.0);
    let mut open = States::open(body.system.n_contact());
    rubbing.settle(&body.system, 0.0, (&mut u, &v), &mut open);
    let state = State { u, v };
    let (full_u, full_v) = state.full(&body.system)?;
    // as of an orbit: of forced ones the largest
    let energy = match closure {
        Closure::Forced(_) => highest,
        _ => body.system.energy(0.0, &full_u, &full_v),
    };
    let z = body.frame(&state);
    let return_error = match integrate(body, &state, period) {
        Ok(passage) => {
            let end = body.frame(&passage.report.last);
            let d: Vec<f64> = end.iter().zip(&z).map(|(a, b)| a - b).collect();
            norm(&d) / norm(&z)
        }
        Err(OrbitError::Incomplete(_) | OrbitError::Held { .. }) => f64::NAN,
        Err(e) => return Err(e.into()),
    };
    guess.splice(0..0, z[..closure.sizes(n).1].iter().copied());
    let verdict = find(body, closure, &guess, candidate.omega, effort)?;
    let (mut likeness, mut contact_change) = (Likeness::NONE, f64::NAN);
    if let Some(orbit) = verdict.orbit() {
        likeness = Likeness::new(orbit, &z, &sequence);
        contact_change = (orbit.contact_time - contact_time) / period;
    }
    Ok(Checked { energy, residual, return_error, verdict, likeness, contact_change })
}

/// What a candidate does over its period.
struct Along {
    residual: f64,
    contact_time: f64,
    /// Largest energy of the samples.
    highest: f64,
    /// Contact points that close and open, in their order.
    sequence: Vec<(usize, bool)>,
}

fn along(
    body: &Propagator,
    candidate: &Candidate,
    rubbing: &Rubbing,
    period: f64,
) -> Result<Along, HbmError> {
    let system = &body.system;
    let n = body.n();
    let mut scratch = system.scratch();
    let mut phases: std::collections::HashMap<States, Phase> = std::collections::HashMap::new();
    let (mut defect, mut size, mut contact_time, mut highest) = (0.0, 0.0, 0.0, 0.0f64);
    let mut set = States::open(system.n_contact());
    let mut last: Option<(f64, States)> = None;
    let mut sequence = vec![];
    let set_at = |t: f64, start: &States| -> Result<States, HbmError> {
        let [u, ..] = candidate.at(n, t);
        Ok(system.select(t, &u, start)?.set)
    };
    for k in 0..=SAMPLES {
        let t = period * k as f64 / SAMPLES as f64;
        let [mut u, v, a] = candidate.at(n, t);
        set = system.select(t, &u, &set)?.set;
        if let Some((before, previous)) = &last {
            refine(&set_at, (*before, previous.clone()), (t, set.clone()), 0, &mut sequence)?;
            // between two samples the trapezoidal rule of "any node touches"
            let touching = [previous, &set].iter().filter(|s| s.count_closed() > 0).count();
            contact_time += 0.5 * touching as f64 * (t - before);
        }
        last = Some((t, set.clone()));
        rubbing.settle(system, candidate.omega * t, (&mut u, &v), &mut set);
        if !phases.contains_key(&set) {
            phases.insert(set.clone(), system.phase(&set));
        }
        let mut true_a = vec![0.0; n];
        phases[&set].acceleration(t, &u, &v, &mut scratch, &mut true_a);
        let mut both: Vec<f64> = a.iter().zip(&true_a).map(|(a, b)| a - b).collect();
        both.extend(&a);
        let mut modal = vec![0.0; 2 * n];
        body.home.to_modes(&both, &mut modal);
        defect += modal[..n].iter().map(|x| x * x).sum::<f64>();
        size += modal[n..].iter().map(|x| x * x).sum::<f64>();
        highest = highest.max(system.energy_in(&phases[&set], t, &State { u, v }));
    }
    let sequence = sequence.into_iter().map(|(_, c, closes)| (c, closes)).collect();
    let residual = (defect / size.max(f64::MIN_POSITIVE)).sqrt();
    Ok(Along { residual, contact_time, highest, sequence })
}

/// The order of the switches between two times at which the sets are known, by halving where several nodes changed.
fn refine(
    set_at: &dyn Fn(f64, &States) -> Result<States, HbmError>,
    (a, before): (f64, States),
    (b, after): (f64, States),
    depth: u32,
    sequence: &mut Vec<(f64, usize, bool)>,
) -> Result<(), HbmError> {
    let of_contact = before.changes(&after).filter(|(_, from, to)| from.touches() != to.touches());
    let changes: Vec<(usize, bool)> = of_contact.map(|(i, _, to)| (i, to.touches())).collect();
    if changes.len() > 1 && depth < 40 {
        let middle = 0.5 * (a + b);
        let set = set_at(middle, &before)?;
        refine(set_at, (a, before), (middle, set.clone()), depth + 1, sequence)?;
        return refine(set_at, (middle, set), (b, after), depth + 1, sequence);
    }
    sequence.extend(changes.into_iter().map(|(i, closes)| (0.5 * (a + b), i, closes)));
    Ok(())
}

/// The series of an orbit: Fourier coefficients of its motion, by integration over evenly spaced states.
pub fn series_of_orbit(
    body: &Propagator,
    z: &[f64],
    omega: f64,
    n_h: usize,
) -> Result<Candidate, OrbitError> {
    let n = body.n();
    let period = TAU / omega;
    let samples = 64 * n_h.max(8);
    let passage = integrate(body, &body.state(z), period)?;
    let walk = body.walk(&passage.chain, z, &passage.times, period)?;
    let mut coefficients = vec![0.0; (2 * n_h + 1) * n];
    for k in 0..samples {
        let t = period * k as f64 / samples as f64;
        let u = walk.displacement(t);
        for (f, c) in coefficients.chunks_exact_mut(n).enumerate() {
            let angle = f.div_ceil(2) as f64 * omega * t;
            let x = if f > 0 && f % 2 == 0 { angle.sin() } else { angle.cos() };
            let weight = if f == 0 { 1.0 } else { 2.0 } / samples as f64;
            c.iter_mut().zip(&u).for_each(|(c, u)| *c += weight * x * u);
        }
    }
    Ok(Candidate { omega, coefficients, alpha: None })
}
