//! The instant of the loads at which the states of a family of forced orbits are taken.
//!
//! A switch that passes this instant is a corner of the stroboscopic branch: its unknowns run through the boundary layer of the switch, of 82° and more in some
//! bodies, and no step passes it. The family of motions has no corner there: the same branch, seen at an instant that is far from all switches, is smooth. So the
//! section moves along with the branch. In the middle of the longest interval without a switch, rather to its end, where what the last switch set off has died
//! out, it stays until a switch comes near.
//!
//! A section `θ` is a fraction of the period of the loads; to take the state there is to count time from there: all angles of the loads grow by `2πθ`, whatever
//! the frequency, and the frequency moves no section.

use std::f64::consts::TAU;

use super::OrbitError;
use super::chain::Propagator;
use super::credentials::Orbit;
use super::period_map::integrate;
use crate::fem::load::Loads;

/// Where in the longest interval without a switch a section is put.
const PLACE: f64 = 0.8;
/// The section moves where the next switch is nearer than this part of that interval, or the last one is.
const NEXT: f64 = 0.1;
const LAST: f64 = 0.25;

/// The section of a family.
pub(super) struct Section {
    /// The loads as they are given.
    given: Loads,
    /// Periods of the loads in one of the orbits.
    periods: f64,
    /// In periods of the loads, from 0 to their number.
    at: f64,
}

impl Section {
    /// At the origin of time.
    pub fn new(body: &Propagator, periods: usize) -> Section {
        Section { given: Loads::clone(&body.system.loads), periods: periods as f64, at: 0.0 }
    }

    /// In periods of the loads.
    pub fn at(&self) -> f64 {
        self.at
    }

    /// Take the states of a body at another instant.
    pub fn set(&mut self, body: &mut Propagator, at: f64) {
        self.at = at;
        let mut loads = self.given.clone();
        loads.turn(TAU * at);
        *body.system.loads_mut() = loads;
    }

    /// A better section, if a switch of an orbit has come too near to this one: in periods of the loads.
    pub fn better(&self, orbit: &Orbit) -> Option<f64> {
        let whole = self.periods;
        // from this section on, over the orbit
        let mut times: Vec<f64> =
            orbit.switches.iter().map(|s| s.t / orbit.period * whole).collect();
        times.sort_by(f64::total_cmp);
        let (first, last) = (*times.first()?, *times.last()?);
        let ends = times[1..].iter().copied().chain([first + whole]);
        let (from, length) =
            times.iter().zip(ends).map(|(a, b)| (*a, b - a)).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_near = first < NEXT * length || whole - last < LAST * length;
        is_near.then(|| (self.at + from + PLACE * length).rem_euclid(whole))
    }

    /// From this section on to another one, in periods of the loads.
    pub fn until(&self, at: f64) -> f64 {
        (at - self.at).rem_euclid(self.periods)
    }
}

/// The state of a body a number of periods of the loads later, all as frame vectors.
pub fn later(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
    periods: f64,
) -> Result<Vec<f64>, OrbitError> {
    body.system.loads_mut().set_frequency(omega);
    let passage = integrate(body, &body.state(z), periods * TAU / omega)?;
    Ok(body.frame(&passage.report.last))
}

/// The state at the origin of time of an orbit that a family took at the section `at`.
pub fn at_origin(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
    (at, periods): (f64, usize),
) -> Result<Vec<f64>, OrbitError> {
    let mut section = Section::new(body, periods);
    section.set(body, at);
    let z = match section.until(0.0) {
        0.0 => Ok(z.to_vec()),
        left => later(body, z, omega, left),
    };
    section.set(body, 0.0);
    z
}
