//! The peak of a forced response: the orbit whose largest contact displacement does not change with the frequency.
//!
//! `A(ω)` along a branch has its derivative `dA/dω` with every orbit ([`super::sensitivity`]); its zero is found between two frequencies by regula falsi, each orbit by Newton's
//! method from the last one moved along its own derivative.

use super::chain::Propagator;
use super::credentials::{Orbit, examine};
use super::parameter::Parameter;
use super::search::{Effort, Verdict, find};
use super::sensitivity::{Differentiable, Sensitivity};
use super::shooting::{Closure, Settings};
use super::{OrbitError, tolerate};
use crate::contact::State;

/// An orbit of a response with what changes with the frequency.
#[derive(Debug, Clone)]
pub struct Height {
    /// The orbit.
    pub orbit: Orbit,
    /// `A`, of one contact point: the largest of all.
    pub amplitude: f64,
    /// `dA/dω`
    pub slope: f64,
    /// Of the state by the frequency: `u_O`, `u̇_O`.
    change: [Vec<f64>; 2],
}

/// Steps of the search.
const STEPS: usize = 40;
/// The frequency of a peak is known to this part of itself.
const KNOWN: f64 = 1e-12;

impl Height {
    /// Of an orbit of a forced response.
    pub fn of(body: &mut Propagator, orbit: &Orbit) -> Result<Option<Height>, OrbitError> {
        let mut by = Parameter::frequency(&body.system, orbit.omega());
        let Some(mut along) = Differentiable::amplitude_of(body, orbit)? else { return Ok(None) };
        let amplitude = along.peaks[0].value.abs();
        let Sensitivity { peaks, change, .. } = along.by(&mut by)?;
        let orbit = Orbit { stability: None, ..orbit.clone() };
        Ok(Some(Height { orbit, amplitude, slope: peaks[0], change }))
    }

    /// The orbit at another frequency nearby.
    fn at(&self, body: &mut Propagator, omega: f64) -> Result<Option<Height>, OrbitError> {
        match moved_along(body, &self.orbit, &self.change, omega - self.orbit.omega())? {
            Some(orbit) => Height::of(body, &orbit),
            None => Ok(None),
        }
    }
}

/// The orbit at another frequency nearby, by Newton's method from the one at hand, moved along its derivative by the frequency: that of `u_O` and of `u̇_O`.
pub(super) fn moved_along(
    body: &mut Propagator,
    orbit: &Orbit,
    [u, v]: &[Vec<f64>; 2],
    by: f64,
) -> Result<Option<Orbit>, OrbitError> {
    let moved = |x: &[f64], d: &[f64]| x.iter().zip(d).map(|(x, d)| x + by * d).collect();
    let state = State { u: moved(&orbit.state.u, u), v: moved(&orbit.state.v, v) };
    let z = body.frame(&state);
    let newton = Settings { iterations: 12, ..Settings::default() };
    let effort = Effort { newton, multipliers: false, rescue: false };
    let found = tolerate(find(body, orbit.closure, &z, orbit.omega() + by, &effort))?;
    Ok(found.as_ref().and_then(Verdict::orbit).cloned())
}

/// The peak between two frequencies `low < high` near an orbit of a branch: there the amplitude rises and falls. None where it does not, or where the branch cannot be followed by
/// its frequency.
pub fn peak(
    body: &mut Propagator,
    orbit: &Orbit,
    (low, high): (f64, f64),
) -> Result<Option<Height>, OrbitError> {
    let Some(start) = Height::of(body, orbit)? else { return Ok(None) };
    let (mut a, mut b) = match start.slope > 0.0 {
        true => {
            let Some(end) = start.at(body, high)? else { return Ok(None) };
            (start, end)
        }
        false => {
            let Some(end) = start.at(body, low)? else { return Ok(None) };
            (end, start)
        }
    };
    if !(a.slope > 0.0 && b.slope <= 0.0) {
        return Ok(None);
    }
    // Illinois: an end that stays counts half
    let (mut of_a, mut of_b, mut side) = (a.slope, b.slope, 0);
    for _ in 0..STEPS {
        let (x, y) = (a.orbit.omega(), b.orbit.omega());
        let omega = (x * of_b - y * of_a) / (of_b - of_a);
        let omega = if omega > x && omega < y { omega } else { 0.5 * (x + y) };
        let from = if omega - x < y - omega { &a } else { &b };
        let Some(middle) = from.at(body, omega)? else { return Ok(None) };
        let is_there =
            y - x <= KNOWN * omega || middle.slope.abs() * omega <= KNOWN * middle.amplitude;
        if is_there {
            return Ok(Some(middle));
        }
        if middle.slope > 0.0 {
            (a, of_a) = (middle.clone(), middle.slope);
            of_b *= if side == 1 { 0.5 } else { 1.0 };
            side = 1;
        } else {
            (b, of_b) = (middle.clone(), middle.slope);
            of_a *= if side == -1 { 0.5 } else { 1.0 };
            side = -1;
        }
    }
    Ok(Some(if a.slope < -b.slope { a } else { b }))
}

/// The peak of a response near the state of one of its orbits: [`peak`] from what is stored of it.
pub fn peak_near(
    body: &mut Propagator,
    state: &State,
    omega: f64,
    bounds: (f64, f64),
) -> Result<Option<Height>, OrbitError> {
    body.system.loads_mut().set_frequency(omega);
    let z = body.frame(state);
    let closure = Closure::FORCED;
    let Some(orbit) = tolerate(examine(body, closure, &z, closure.period(omega), 0, false))? else {
        return Ok(None);
    };
    peak(body, &orbit, bounds)
}
