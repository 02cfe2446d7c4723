//! How a periodic orbit changes with a number that the equations depend on.
//!
//! The orbit is a root of the residual `R(x, p)`; with the column `R_p` of [`super::parameter`] beside `R_x`, both exact,
//!
//! ```text
//! R_x x_p = −R_p
//! ```
//!
//! and any quantity `g(t, x(t), p)` at an instant of the orbit changes by `∂g/∂p + ∇g·δ(t)` with `δ(t)` the column carried to that instant from `x_p`. At the top of a curve in time
//! that instant need not be differentiated; where the largest value stands at a switch, it moves with the switch.

use std::f64::consts::PI;

use faer::Mat;
use nalgebra::Complex;

use super::OrbitError;
use super::chain::{Chain, Propagator};
use super::credentials::Orbit;
use super::floquet::{Multiplier, stability};
use super::parameter::{Kind, Parameter};
use super::period_map::integrate;
use super::phase_lag::loads;
use super::pin::Pin;
use super::shooting::{Closure, Image, correction, image};
use super::tangent::{By, Variation};
use super::walk::Walk;
use crate::contact::{Phase, State, System};
use crate::continuation::{dot, norm};
use crate::flow::spectrum::Spectrum;

/// What is largest over a period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Observable {
    /// A contact displacement in magnitude: of which point.
    Displacement(usize),
    /// The pressure at a contact point.
    Pressure(usize),
    /// The energy.
    Energy,
}

impl Observable {
    /// Its value in a state of a phase.
    fn of(self, system: &System, phase: &Phase, t: f64, [u, v]: [&[f64]; 2]) -> f64 {
        match self {
            Observable::Displacement(point) => {
                let mut full = vec![0.0; system.n()];
                phase.expand_displacement(t, u, &mut full);
                system.beside_rest(&system.at_points(&full))[point]
            }
            Observable::Pressure(point) => {
                let mut p = vec![0.0; system.n_contact()];
                phase.pressures(t, u, &mut p);
                p[point]
            }
            Observable::Energy => system.energy_of_phase(phase, t, [u, v]),
        }
    }
}

/// A largest value over the orbit, and where it stands.
#[derive(Debug, Clone, Copy)]
pub struct Peak {
    /// Of what.
    pub of: Observable,
    /// Its value.
    pub value: f64,
    /// When.
    pub t: f64,
    /// The phase.
    phase: usize,
    /// It stands at this switch, which ends or begins that phase.
    switch: Option<usize>,
}

/// An orbit with its motion in closed form, ready to be differentiated.
pub struct Differentiable<'a> {
    body: &'a mut Propagator,
    closure: Closure,
    /// The unknowns of the closure.
    z: Vec<f64>,
    period: f64,
    multipliers: Vec<Multiplier>,
    at: Image,
    /// Over the whole period.
    chain: Chain,
    times: Vec<f64>,
    /// Largest displacement, pressure and energy.
    pub peaks: Vec<Peak>,
}

/// Derivatives by one parameter.
#[derive(Debug, Clone)]
pub struct Sensitivity {
    /// The parameter's value.
    pub value: f64,
    /// Of all displacements at `t = 0`, and of all velocities.
    pub state: [Vec<f64>; 2],
    /// Of `u_O` and `u̇_O`, at fixed coordinates.
    pub change: [Vec<f64>; 2],
    /// Of the peaks, in their order.
    pub peaks: Vec<f64>,
    /// Of the period.
    pub period: f64,
    /// Of the feedback `α` of a viscous orbit.
    pub alpha: Option<f64>,
    /// Of the multipliers, in their order; empty where these are not known.
    pub multipliers: Vec<Multiplier>,
    /// Of the times of the switches.
    delays: Vec<f64>,
}

/// A parameter whose differences of two widths are further apart than this, over their size, does not enter smoothly.
const ROUGH: f64 = 1e-3;

/// States a period, and a phase, among which the largest values are looked for.
const LOOKS: (f64, usize) = (400.0, 24);

/// Values that differ by less than this, relative, are one.
const EVEN: f64 = 1e-11;

/// Half the width of differences in time, over the period.
const BRIEF: f64 = 5e-4;

/// Derivatives by switches that come as near to grazing as this, over the unit of length, are none.
const GRAZES: f64 = 1e-9;

impl<'a> Differentiable<'a> {
    /// An orbit of a body that is small enough for the modes of its phases.
    pub fn new(body: &'a mut Propagator, orbit: &Orbit) -> Result<Differentiable<'a>, OrbitError> {
        if body.is_large() {
            return Err(OrbitError::Large(body.n()));
        }
        if orbit.residual_positions().is_some_and(|k| k > 0) {
            let why =
                "the orbit is one of a family that friction holds: it has no derivative of its own";
            return Err(OrbitError::Parameter(why));
        }
        // what an impact law holds leaves the obstacle at rest
        if orbit.grazing < GRAZES && body.system.impact().is_none() {
            return Err(OrbitError::Parameter("the orbit grazes: it has no derivative"));
        }
        let closure = orbit.closure;
        let mut z = orbit.z.clone();
        if closure == Closure::Limit {
            z.resize(2 * body.n(), 0.0);
            z.push(orbit.period);
        }
        let at = image(body, closure, &z, orbit.period)?;
        let (chain, times) = match closure {
            Closure::Reversible => {
                let whole = integrate(body, &body.state(&z), orbit.period)?;
                (whole.chain, whole.times)
            }
            _ => (at.passage.chain.clone(), at.passage.times.clone()),
        };
        let multipliers = orbit.stability.as_ref().map_or(vec![], |s| s.multipliers.clone());
        let (period, peaks) = (orbit.period, vec![]);
        let mut new =
            Differentiable { body, closure, z, period, multipliers, at, chain, times, peaks };
        new.peaks = new.find_peaks()?;
        Ok(new)
    }

    /// The same where of the peaks the largest displacement alone is asked for, and no multipliers; none where the orbit has no derivative, or nothing moves.
    pub(super) fn amplitude_of(
        body: &'a mut Propagator,
        orbit: &Orbit,
    ) -> Result<Option<Differentiable<'a>>, OrbitError> {
        let orbit = Orbit { stability: None, ..orbit.clone() };
        let mut along = match Differentiable::new(body, &orbit) {
            Ok(along) => along,
            Err(OrbitError::Parameter(_)) => return Ok(None),
            Err(e) => return Err(e),
        };
        along.peaks.retain(|p| matches!(p.of, Observable::Displacement(_)));
        Ok((!along.peaks.is_empty()).then_some(along))
    }

    /// The body.
    pub fn system(&self) -> &System {
        &self.body.system
    }

    /// The motion up to an instant of a phase.
    fn walk_to(&self, phase: usize, t: f64) -> Result<(Chain, Walk), OrbitError> {
        let cut = Chain {
            sets: self.chain.sets[..=phase].to_vec(),
            points: self.chain.points[..phase].to_vec(),
            struck: self.chain.struck.iter().take(phase).cloned().collect(),
        };
        let walk = self.body.walk(&cut, self.closure.frame(&self.z), &self.times[..phase], t)?;
        Ok((cut, walk))
    }

    /// The largest values over the orbit: of all states of a close sequence the largest, then the top of the curve around it.
    fn find_peaks(&self) -> Result<Vec<Peak>, OrbitError> {
        let system = &self.body.system;
        let frame = self.closure.frame(&self.z);
        let walk = self.body.walk(&self.chain, frame, &self.times, self.period)?;
        let points = system.n_contact();
        let mut best: Vec<Option<Peak>> = vec![None; 3];
        let all = (0..points).map(Observable::Displacement);
        let all: Vec<Observable> =
            all.chain((0..points).map(Observable::Pressure)).chain([Observable::Energy]).collect();
        for (j, set) in self.chain.sets.iter().enumerate() {
            let phase = system.phase(set);
            let span = walk.links[j].span;
            let looks = (LOOKS.0 * (span.1 - span.0) / self.period).ceil() as usize;
            let looks = looks.max(LOOKS.1);
            let time = |k: usize| match k {
                k if k == looks => span.1,
                k => span.0 + (span.1 - span.0) * k as f64 / looks as f64,
            };
            let states: Vec<[Vec<f64>; 2]> =
                (0..=looks).map(|k| <[Vec<f64>; 2]>::from(walk.links[j].state(time(k)))).collect();
            for &of in &all {
                let kind = match of {
                    Observable::Displacement(_) => 0,
                    Observable::Pressure(_) => 1,
                    Observable::Energy => 2,
                };
                let value = |t: f64, x: &[Vec<f64>; 2]| of.of(system, &phase, t, [&x[0], &x[1]]);
                let size = |x: f64| if kind == 0 { x.abs() } else { x };
                let values: Vec<f64> =
                    states.iter().enumerate().map(|(k, x)| size(value(time(k), x))).collect();
                // of values that rounding alone makes different the first one inside the phase
                let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let is_largest = |k: &usize| values[*k] >= largest - EVEN * largest.abs();
                let inside = (1..looks).find(is_largest);
                let Some(k) = inside.or((0..=looks).find(is_largest)) else { continue };
                let known = best[kind].map_or(f64::NEG_INFINITY, |p| {
                    let size = size(p.value);
                    // inside a phase it counts for more than at the end of another
                    let worth = if p.switch.is_some() && inside.is_some() { -EVEN } else { EVEN };
                    size + worth * size.abs()
                });
                // between two states a curve rises by less than it changes around them
                let around = [k.saturating_sub(1), (k + 1).min(looks)];
                let rise = around.map(|l| values[k] - values[l]).into_iter().fold(0.0, f64::max);
                if values[k] + rise <= known {
                    continue;
                }
                let at = |t: f64| size(value(t, &walk.links[j].state(t).into()));
                let t = top(around.map(time), &at);
                let state = walk.links[j].state(t).into();
                let value = value(t, &state);
                if size(value) > known {
                    let switch = match t {
                        t if t == span.1 => (j < self.chain.events()).then_some(j),
                        t if t == span.0 => j.checked_sub(1),
                        _ => None,
                    };
                    best[kind] = Some(Peak { of, value, t, phase: j, switch });
                }
            }
        }
        if let (Closure::Viscous(_), Some(energy)) = (self.closure, &mut best[2]) {
            // told where the pinned mode is at rest
            let state: [Vec<f64>; 2] = walk.links[0].state(0.0).into();
            let phase = system.phase(&self.chain.sets[0]);
            let value = energy.of.of(system, &phase, 0.0, [&state[0], &state[1]]);
            *energy = Peak { value, t: 0.0, phase: 0, switch: None, ..*energy };
        }
        // a motion that touches nothing has no pressure
        Ok(best.into_iter().flatten().filter(|p| p.value != 0.0).collect())
    }

    /// The derivative of the orbit by a parameter.
    pub fn by(&mut self, parameter: &mut Parameter) -> Result<Sensitivity, OrbitError> {
        let damping = match self.closure {
            Closure::Viscous(_) => Some(self.body.system.damping),
            _ => None,
        };
        let omega = self.closure.period(1.0) / self.period;
        parameter.adapt(damping, omega);
        let p = &*parameter;
        let state = self.body.state(self.closure.frame(&self.z));
        let set = &self.chain.sets[0];
        if p.roughness(set, 0.0, [&state.u, &state.v]) > ROUGH {
            return Err(OrbitError::Parameter("it does not enter the equations smoothly"));
        }
        if self.chain.sets.iter().any(|set| p.moves_surfaces(set)) {
            let why = "the speed of a surface to which points stick is none that is offered";
            return Err(OrbitError::Parameter(why));
        }
        let r = self.residual_by(p, &state)?;
        let n = self.body.n();
        let mut x = correction(self.body, self.closure, &self.z, &self.at, &r)?;
        let unknown = match self.closure {
            Closure::Viscous(_) | Closure::Limit => x.pop(),
            _ => None,
        };
        x.resize(2 * n, 0.0);
        let (alpha, period) = match (self.closure, p.kind) {
            (Closure::Limit, _) => (None, unknown.unwrap_or(0.0)),
            (_, Kind::Frequency) => (unknown, -self.period / omega),
            _ => (unknown, 0.0),
        };
        let change = self.change(&x);
        let state_by = self.state_by(p, &state, &change);
        let whole = (self.chain.events(), self.period);
        let delays = self.carried(p, whole, (&x, alpha))?.1;
        let peak = |peak: &Peak| self.peak_by(p, peak, (&x, alpha), &delays);
        let peaks = self.peaks.iter().map(peak).collect::<Result<_, _>>()?;
        let mut all = Sensitivity {
            value: p.value,
            state: state_by,
            change,
            peaks,
            period,
            alpha,
            multipliers: vec![],
            delays,
        };
        if !self.multipliers.is_empty() {
            all.multipliers = self.multipliers_by(p, &all)?;
        }
        Ok(all)
    }

    /// `p` of [`super::phase_lag`], of a forced orbit.
    pub(super) fn power(&self) -> Result<Complex<f64>, OrbitError> {
        let frame = self.closure.frame(&self.z);
        let walk = self.body.walk(&self.chain, frame, &self.times, self.period)?;
        Ok(power(self.body, &self.chain, &walk))
    }

    /// Its derivative, where those of the orbit are known.
    pub(super) fn power_by(
        &self,
        p: &Parameter,
        along: &Sensitivity,
    ) -> Result<Complex<f64>, OrbitError> {
        let mut sum = Complex::default();
        self.beside(p, along, |weight, body, _, walk| {
            sum += power(body, &self.chain, walk) * weight;
            Ok(())
        })?;
        Ok(sum)
    }

    /// `R_p` at fixed unknowns.
    fn residual_by(&self, p: &Parameter, state: &State) -> Result<Vec<f64>, OrbitError> {
        let omega = self.closure.period(1.0) / self.period;
        let end = self.closure.end(self.period);
        let (chain, times) = (&self.at.passage.chain, &self.at.passage.times);
        let walk = self.body.walk(chain, self.closure.frame(&self.z), times, end)?;
        let by = Variation { by: Some(By::Parameter(p)), ..Variation::OF_MAP };
        let n = self.body.n();
        let nothing = Mat::<f64>::zeros(2 * n, 0);
        let column = self.body.tangent((chain, &walk), nothing.as_ref(), by)?.end;
        // the end of the time moves with the frequency
        let longer = if p.kind == Kind::Frequency { -end / omega } else { 0.0 };
        let column: Vec<f64> =
            (0..2 * n).map(|i| column[(i, 0)] + longer * walk.rate_end[i]).collect();
        let mut r = match self.closure {
            Closure::Reversible => column[n..].to_vec(),
            Closure::Viscous(pin) => {
                let turned = self.pinned_velocity(p, pin, state)?;
                column.into_iter().chain([turned]).collect()
            }
            _ => column,
        };
        if self.closure.is_forced() {
            self.body.drift.leave_out(&mut r);
        }
        Ok(r)
    }

    /// Changes of `u_O` and `u̇_O` of a change of the frame vector.
    fn change(&self, x: &[f64]) -> [Vec<f64>; 2] {
        let n = self.body.n();
        let modal: Vec<f64> = x
            .iter()
            .enumerate()
            .map(|(i, x)| if i < n { x / self.body.scale[i] } else { *x })
            .collect();
        let mut all = vec![0.0; 2 * n];
        self.body.home.state_of_modes(&modal, &mut all);
        let v = all.split_off(n);
        [all, v]
    }

    /// How the velocity of the pinned mode, which is zero, changes where the mode does.
    fn pinned_velocity(&self, p: &Parameter, pin: Pin, state: &State) -> Result<f64, OrbitError> {
        let own = |home: &Spectrum| -> Vec<f64> {
            (0..self.body.n()).map(|j| home.inverse[(pin.mode, j)]).collect()
        };
        let here = own(&self.body.home);
        let mut sum = 0.0;
        for neighbour in p.neighbours() {
            let home = Propagator::new(neighbour.system.clone())?.home;
            let row = own(&home);
            // a mode has no sign
            let sign = dot(&row, &here).signum();
            sum += neighbour.weight * sign * dot(&row, &state.v);
        }
        Ok(sum)
    }

    /// Of all displacements and velocities at `t = 0`.
    fn state_by(&self, p: &Parameter, state: &State, change: &[Vec<f64>; 2]) -> [Vec<f64>; 2] {
        let set = &self.chain.sets[0];
        let phase = self.body.system.phase(set);
        let full = |system: &System, phase: &Phase, velocity: bool| {
            let mut x = vec![0.0; system.n()];
            match velocity {
                true => phase.expand_velocity(0.0, &state.v, &mut x),
                false => phase.expand_displacement(0.0, &state.u, &mut x),
            }
            x
        };
        [false, true].map(|velocity| {
            let mut of_state = vec![0.0; self.body.system.n()];
            phase.expand(&change[usize::from(velocity)], &mut of_state);
            let of_phase = p.differences(set, |system, phase| full(system, phase, velocity));
            of_state.iter().zip(&of_phase).map(|(a, b)| a + b).collect()
        })
    }

    /// The column of the orbit's change, carried to an instant of a phase, and by how much the switches on the way are later; with the motion.
    fn carried(
        &self,
        p: &Parameter,
        (phase, t): (usize, f64),
        (x, alpha): (&[f64], Option<f64>),
    ) -> Result<(Vec<f64>, Vec<f64>, Walk), OrbitError> {
        let (chain, walk) = self.walk_to(phase, t)?;
        let n = self.body.n();
        let start = Mat::from_fn(2 * n, 1, |i, _| x[i]);
        let along = |by: By<'_>| {
            let variation = Variation { by: Some(by), ..Variation::OF_MAP };
            self.body.tangent((&chain, &walk), start.as_ref(), variation)
        };
        let both = along(By::Parameter(p))?;
        let sum = |m: &Mat<f64>| (0..m.nrows()).map(|i| m[(i, 0)] + m[(i, 1)]).collect();
        let (mut end, mut delays): (Vec<f64>, Vec<f64>) = (sum(&both.end), sum(&both.delays));
        if let Some(alpha) = alpha {
            let fed = along(By::Feedback)?;
            end.iter_mut().enumerate().for_each(|(i, x)| *x += alpha * fed.end[(i, 1)]);
            delays.iter_mut().enumerate().for_each(|(j, x)| *x += alpha * fed.delays[(j, 1)]);
        }
        Ok((end, delays, walk))
    }

    /// Of a largest value.
    fn peak_by(
        &self,
        p: &Parameter,
        peak: &Peak,
        (x, alpha): (&[f64], Option<f64>),
        delays: &[f64],
    ) -> Result<f64, OrbitError> {
        let system = &self.body.system;
        let n = self.body.n();
        let (end, _, walk) = self.carried(p, (peak.phase, peak.t), (x, alpha))?;
        let (set, link) = (&self.chain.sets[peak.phase], &walk.links[peak.phase]);
        let phase = system.phase(set);
        let (u, v) = link.state(peak.t);
        let at = |u: &[f64], v: &[f64]| peak.of.of(system, &phase, peak.t, [u, v]);
        let along = |[du, dv]: [&[f64]; 2]| {
            // a difference of any width: displacements and pressures are affine, the energy is quadratic
            let width = (norm(&u) + norm(&v)) / (norm(du) + norm(dv)).max(f64::MIN_POSITIVE);
            let moved = |x: &[f64], d: &[f64], s: f64| -> Vec<f64> {
                x.iter().zip(d).map(|(x, d)| x + s * width * d).collect()
            };
            let side = |s: f64| at(&moved(&u, du, s), &moved(&v, dv, s));
            (side(1.0) - side(-1.0)) / (2.0 * width)
        };
        let [du, dv] = self.change(&end);
        let of_phase = p
            .differences(set, |system, phase| vec![peak.of.of(system, phase, peak.t, [&u, &v])])[0];
        let mut by = of_phase + along([&du, &dv]);
        if let Some(switch) = peak.switch {
            let delay = delays[switch];
            let mut a = vec![0.0; n];
            phase.acceleration(peak.t, &u, &v, &mut system.scratch(), &mut a);
            // what loads on u_C move at once
            let h = BRIEF * self.period;
            let side = |s: f64| {
                let there = |s: f64| peak.of.of(system, &phase, peak.t + s * h, [&u, &v]);
                there(s) - there(-s)
            };
            let at_once = (8.0 * side(1.0) - side(2.0)) / (12.0 * h);
            by += delay * (along([&v, &a]) + at_once);
        }
        Ok(if matches!(peak.of, Observable::Displacement(_)) {
            by * peak.value.signum()
        } else {
            by
        })
    }

    /// The motions of the neighbours along the tangent `(x_p, 1)` of the orbit, each with its weight in a difference: bodies, closures with their unknowns, walks.
    fn beside(
        &self,
        p: &Parameter,
        Sensitivity { change, alpha, period, delays, .. }: &Sensitivity,
        mut take: impl FnMut(f64, &Propagator, (Closure, &[f64]), &Walk) -> Result<(), OrbitError>,
    ) -> Result<(), OrbitError> {
        let state = self.body.state(self.closure.frame(&self.z));
        for neighbour in p.neighbours() {
            let s = neighbour.offset;
            let moved = |x: &[f64], d: &[f64]| x.iter().zip(d).map(|(x, d)| x + s * d).collect();
            let there = State { u: moved(&state.u, &change[0]), v: moved(&state.v, &change[1]) };
            let mut body = Propagator::new(neighbour.system.clone())?;
            let mut closure = self.closure;
            let mut z = body.frame(&there);
            if let Closure::Viscous(pin) = &mut closure {
                pin.beta += if p.kind == Kind::Viscosity { s } else { 0.0 };
                z.push(self.z[2 * self.body.n()] + s * alpha.unwrap_or(0.0));
            }
            if closure == Closure::Limit {
                z.push(self.period + s * period);
            }
            closure.adopt(&mut body, &z)?;
            let end = self.period + s * period;
            let times: Vec<f64> = moved(&self.times, delays);
            let walk = body.walk(&self.chain, closure.frame(&z), &times, end)?;
            take(neighbour.weight, &body, (closure, &z), &walk)?;
        }
        Ok(())
    }

    /// Of the multipliers: those of the neighbours, the nearest to each.
    fn multipliers_by(
        &self,
        p: &Parameter,
        along: &Sensitivity,
    ) -> Result<Vec<Multiplier>, OrbitError> {
        let mut sum = vec![(0.0, 0.0); self.multipliers.len()];
        self.beside(p, along, |weight, body, (closure, z), walk| {
            let found = stability(body, closure, z, (&self.chain, walk))?.multipliers;
            for (sum, m) in sum.iter_mut().zip(&self.multipliers) {
                let far = |x: &Multiplier| (x.0 - m.0).hypot(x.1 - m.1);
                let nearest = found.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
                let nearest = nearest.copied().unwrap_or((f64::NAN, f64::NAN));
                sum.0 += weight * nearest.0;
                sum.1 += weight * nearest.1;
            }
            Ok(())
        })?;
        Ok(sum)
    }
}

/// `p = f̂ᴴû` of a motion over a period of the loads.
fn power(body: &Propagator, chain: &Chain, walk: &Walk) -> Complex<f64> {
    let system = &body.system;
    let Some(omega) = system.loads.harmonics.first().map(|h| h.omega) else {
        return Complex::default();
    };
    let force = loads(system);
    let phases = walk.links.iter().zip(&chain.sets);
    let of_phase =
        phases.map(|(link, set)| link.harmonic(system, &system.phase(set), (&force, omega)));
    of_phase.sum::<Complex<f64>>() * (omega / PI)
}

/// Steps of the search for the top of a curve.
const STEPS: usize = 60;

/// The instant in a bracket at which a curve with one top is highest: an end, or where its slope vanishes, by bisection on differences of the curve that are symmetric about the instant.
fn top([a, b]: [f64; 2], f: &dyn Fn(f64) -> f64) -> f64 {
    // five values about the instant: the slope to the fourth power of the width
    let h = 1e-2 * (b - a);
    let slope = |t: f64| {
        let side = |s: f64| f(t + s * h) - f(t - s * h);
        8.0 * side(1.0) - side(2.0)
    };
    if slope(a) <= 0.0 {
        return a;
    }
    if slope(b) >= 0.0 {
        return b;
    }
    let (mut low, mut high) = (a, b);
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if slope(middle) > 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
