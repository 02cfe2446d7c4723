//! The viscous nonlinear mode at a displacement, its frequency found with it.
//!
//! ```text
//! x(T) = x(0),    φ_kᵀM u̇(0) = 0,    q_k(0) = a,    unknown: x(0), α, ω
//! ```
//!
//! Where bodies touch without a gap (a crack, two blocks side by side) the equations are homogeneous: orbits of all amplitudes have one frequency, near the bilinear one
//! `2ω_oω_c/(ω_o + ω_c)`, and at any other frequency there is none.

use super::OrbitError;
use super::chain::Propagator;
use super::mapped::Mapped;
use super::pin::Pin;
use super::search::{Verdict, judge};
use super::shooting::Closure;
use crate::contact::phase_modes;
use crate::continuation::correct;
use crate::fem::largest;

/// A shape that moves the contact by less than this part of its largest displacement does not move it.
const STILL: f64 = 1e-9;

/// Frequencies to start from, over the bilinear one.
const NEAR: [f64; 5] = [1.0, 0.99, 1.01, 0.97, 1.03];

/// Frame vector of the pinned mode that moves one contact point by `displacement`, and none by more (negative: away from the obstacle).
fn displaced(body: &Propagator, pin: Pin, displacement: f64) -> Option<Vec<f64>> {
    let n = body.n();
    let shape = body.home.shapes.col_as_slice(pin.mode);
    let mut full = vec![0.0; body.system.n()];
    body.system.phase(&body.home_set).expand(shape, &mut full);
    let largest = largest(&full);
    let along = body.system.along_normals(&full).into_iter();
    let lead = along.fold(0.0f64, |m, u| if u.abs() > m.abs() { u } else { m });
    let mut z = vec![0.0; 2 * n];
    z[pin.mode] = displacement / lead * body.scale[pin.mode];
    (lead.abs() > STILL * largest).then_some(z)
}

/// `2ω_oω_c/(ω_o + ω_c)` of the pinned mode: half a period open, half a period closed.
pub fn bilinear(body: &Propagator, pin: Pin) -> Option<f64> {
    let system = &body.system;
    let closed = system.phase(&system.closed_states());
    let modes = phase_modes(system, &closed, pin.mode + 1).ok()?;
    let (open, closed) = (pin.omega, *modes.omega.get(pin.mode)?);
    Some(2.0 * open * closed / (open + closed))
}

/// The orbit whose pinned mode begins with a displacement of the contact, from frequencies near `omega`; none where Newton's method finds none, or the mode does not move the contact.
pub fn at_displacement(
    body: &mut Propagator,
    pin: Pin,
    displacement: f64,
    omega: f64,
) -> Result<Option<Verdict>, OrbitError> {
    let Some(mut guess) = displaced(body, pin, displacement) else { return Ok(None) };
    // what the viscosity takes of a motion of this frequency
    guess.push(pin.beta * omega * omega);
    let closure = Closure::Viscous(pin);
    let mut last = None;
    for share in NEAR {
        let x = [&guess[..], &[share * omega]].concat();
        let mut held = vec![0.0; x.len()];
        held[pin.mode] = 1.0;
        let found = correct(&mut Mapped::new(body, closure, 1.0), &x, &held, x[pin.mode])?;
        let Some(found) = found else { continue };
        let Some((&omega, z)) = found.x.split_last() else { continue };
        if omega <= 0.0 {
            continue;
        }
        let verdict = judge(body, closure, z, omega, found.iterations, true)?;
        if verdict.orbit().is_some() {
            return Ok(Some(verdict));
        }
        last = Some(verdict);
    }
    Ok(last)
}
