//! Orbits at phase resonance: the displacement that the loads work on is in quadrature with them, and the frequency is what makes it so.
//!
//! ```text
//! R(x, ω, q) = 0 ,   e(x, ω, q) = arg p + π/2 = 0
//! ```
//!
//! with the period map closed by `R`, `p = f̂ᴴû` of [`super::phase_lag`], and any number `q` of the equations. Along the orbits at fixed `q` and at fixed `ω`, with exact
//! derivatives of both ([`super::sensitivity`]),
//!
//! ```text
//! ω ← ω − e/e_ω ,   dω/dq = −e_q/e_ω ,   dg/dq = g_q + g_ω dω/dq ,   e_q = Im p_q/p
//! ```
//!
//! of the amplitude or the work `W = −π Im p` in place of `g`. The loop of a laboratory comes to rest near such an orbit; Newton's method goes on from there.

use std::f64::consts::PI;

use nalgebra::Complex;

use super::chain::Propagator;
use super::credentials::Orbit;
use super::parameter::Parameter;
use super::peak::moved_along;
use super::phase_lag::error_of;
use super::search::{Effort, find};
use super::sensitivity::Differentiable;
use super::shooting::{Closure, Settings};
use super::{OrbitError, tolerate};
use crate::records::Resonance;

/// Most steps in the frequency.
const STEPS: usize = 12;
/// The lag of an orbit is known to so much of a radian, the frequency to such a part of itself.
const KNOWN: (f64, f64) = (1e-11, 1e-13);
/// No step goes farther than this part of the frequency.
const REACH: f64 = 0.02;

/// An orbit at phase resonance.
#[derive(Debug, Clone)]
pub struct Quadrature {
    /// The orbit.
    pub orbit: Orbit,
    /// What is read there.
    pub readings: Resonance,
    power: Complex<f64>,
    /// By the frequency.
    by_frequency: Along,
}

/// How the orbits of a body change along a number.
#[derive(Debug, Clone)]
struct Along {
    power: Complex<f64>,
    amplitude: f64,
    change: [Vec<f64>; 2],
}

impl Along {
    fn by(of: &mut Differentiable, by: &mut Parameter) -> Result<Along, OrbitError> {
        let all = of.by(by)?;
        Ok(Along { power: of.power_by(by, &all)?, amplitude: all.peaks[0], change: all.change })
    }
}

impl Quadrature {
    /// Of a body near the frame vector `z` and the frequency `omega`; none where Newton's method finds none, or the orbits there have no derivative.
    pub fn near(
        body: &mut Propagator,
        z: &[f64],
        omega: f64,
    ) -> Result<Option<Quadrature>, OrbitError> {
        tolerate(Quadrature::sought(body, z, omega)).map(Option::flatten)
    }

    fn sought(
        body: &mut Propagator,
        z: &[f64],
        omega: f64,
    ) -> Result<Option<Quadrature>, OrbitError> {
        body.system.loads_mut().set_frequency(omega);
        let newton = Settings { iterations: 12, ..Settings::default() };
        // multipliers tell a family that friction holds: its orbits have no derivative of their own
        let multipliers = body.system.tangents().is_some();
        let effort = Effort { newton, multipliers, rescue: false };
        let found = find(body, Closure::FORCED, z, omega, &effort)?;
        let Some(mut orbit) = found.orbit().cloned() else {
            return Ok(None);
        };
        if orbit.residual_positions().is_some_and(|k| k > 0) {
            return Ok(None);
        }
        for _ in 0..STEPS {
            let Some(here) = Quadrature::of(body, &orbit)? else { return Ok(None) };
            let omega = here.readings.omega;
            let step = -error_of(here.power) / turned(here.by_frequency.power, here.power);
            let (lag, part) = KNOWN;
            if error_of(here.power).abs() <= lag || step.abs() <= part * omega {
                return Ok(Some(here));
            }
            let is_near = step.abs() <= REACH * omega;
            if !is_near {
                return Ok(None);
            }
            match moved_along(body, &orbit, &here.by_frequency.change, step)? {
                Some(next) => orbit = next,
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    /// Of an orbit, whatever its lag.
    fn of(body: &mut Propagator, orbit: &Orbit) -> Result<Option<Quadrature>, OrbitError> {
        let omega = orbit.omega();
        body.system.loads_mut().set_frequency(omega);
        let mut frequency = Parameter::frequency(&body.system, omega);
        let Some(mut along) = Differentiable::amplitude_of(body, orbit)? else { return Ok(None) };
        let power = along.power()?;
        let amplitude = along.peaks[0].value.abs();
        let by_frequency = Along::by(&mut along, &mut frequency)?;
        let readings = Resonance { omega, amplitude, work: -PI * power.im };
        Ok(Some(Quadrature { orbit: orbit.clone(), readings, power, by_frequency }))
    }

    /// The derivatives of what is read by a number of the equations.
    pub fn by(
        &self,
        body: &mut Propagator,
        parameter: &mut Parameter,
    ) -> Result<Resonance, OrbitError> {
        body.system.loads_mut().set_frequency(self.readings.omega);
        let Some(mut along) = Differentiable::amplitude_of(body, &self.orbit)? else {
            return Ok(Resonance::NONE);
        };
        let by = Along::by(&mut along, parameter)?;
        let along = &self.by_frequency;
        let omega = -turned(by.power, self.power) / turned(along.power, self.power);
        Ok(Resonance {
            omega,
            amplitude: by.amplitude + along.amplitude * omega,
            work: -PI * (by.power.im + along.power.im * omega),
        })
    }
}

/// How a change turns a complex number.
fn turned(by: Complex<f64>, of: Complex<f64>) -> f64 {
    (by / of).im
}
