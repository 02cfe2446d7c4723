//! An orbit as plain data.

use serde::{Deserialize, Serialize};

use super::{ExtremesRecord, bits};
use crate::event::SwitchKind;

fn one() -> usize {
    1
}

fn is_one(n: &usize) -> bool {
    *n <= 1
}

impl OrbitRecord {
    /// The largest modulus of a multiplier that does not belong to the family.
    pub fn largest_multiplier(&self) -> Option<f64> {
        let others = self.multipliers.iter().skip(self.trivial);
        others.map(|m| m[0].hypot(m[1])).reduce(f64::max)
    }

    /// Circular frequency; of a forced orbit that of the loads.
    pub fn omega(&self) -> f64 {
        self.periods.max(1) as f64 * std::f64::consts::TAU / self.period
    }
}

/// An orbit as it is stored.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OrbitRecord {
    /// Period.
    #[serde(with = "bits::one")]
    pub period: f64,
    /// Periods of the loads in it: more than one for a subharmonic orbit.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub periods: usize,
    /// Largest energy over the period; of a viscous orbit the energy at `t = 0`.
    #[serde(with = "bits::one")]
    pub energy: f64,
    /// Largest contact displacement.
    #[serde(with = "bits::one")]
    pub amplitude: f64,
    /// Return error.
    #[serde(with = "bits::one")]
    pub residual: f64,
    /// Time in contact.
    #[serde(with = "bits::one")]
    pub contact_time: f64,
    /// Distance from grazing.
    #[serde(with = "bits::one")]
    pub grazing: f64,
    /// Largest penetration over the unit of length.
    #[serde(with = "bits::one")]
    pub penetration: f64,
    /// Largest tension, likewise.
    #[serde(with = "bits::one")]
    pub tension: f64,
    /// Energy that is not accounted for, over the energy.
    #[serde(with = "bits::one")]
    pub balance: f64,
    /// All displacements at `t = 0`, `u_C` along the outward normal.
    #[serde(with = "bits::many")]
    pub u0: Vec<f64>,
    /// All velocities.
    #[serde(with = "bits::many")]
    pub v0: Vec<f64>,
    /// Multipliers: real and imaginary parts. Empty: not computed.
    #[serde(with = "bits::pairs")]
    pub multipliers: Vec<[f64; 2]>,
    /// A series of harmonic balance that was shot from, and that no orbit is near.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub no_orbit_near: bool,
    /// Of multipliers along a series of harmonic balance: how far those with half the harmonics are from them. None: they are those of an orbit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub multipliers_within: Option<f64>,
    /// How many of them belong to the family.
    pub trivial: usize,
    /// Whether it is stable, if that is known.
    pub stable: Option<bool>,
    /// Switches: time, mesh node, and of which kind.
    #[serde(with = "bits::switches")]
    pub switches: Vec<(f64, usize, SwitchKind)>,
    /// Energy jumps at the switches.
    #[serde(with = "bits::many")]
    pub jumps: Vec<f64>,
    /// What a viscous orbit has besides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viscous: Option<ViscousRecord>,
    /// What friction does, where there is any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<FrictionRecord>,
    /// What forces and probes come to over the period.
    #[serde(default, skip_serializing_if = "ExtremesRecord::is_empty")]
    pub extremes: ExtremesRecord,
}

/// What friction does in a period.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FrictionRecord {
    /// Work that it takes at all contact points.
    #[serde(with = "bits::one")]
    pub work: f64,
    /// Work of moving surfaces on the body.
    #[serde(with = "bits::one")]
    pub belt: f64,
    /// Parameters of the family of residual positions, if multipliers are known.
    pub family: Option<usize>,
    /// How far the body walks in a period, where only friction holds its place.
    #[serde(default)]
    pub drift: Option<f64>,
}

/// The feedback of a viscous orbit: `C = βK − αM`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ViscousRecord {
    /// `α`
    #[serde(with = "bits::one")]
    pub alpha: f64,
    /// `β`
    #[serde(with = "bits::one")]
    pub beta: f64,
    /// Energy that the viscosity takes and the feedback gives back a period.
    #[serde(with = "bits::one")]
    pub turned_over: f64,
    /// Multipliers of the damped body under `αM u̇(t)` as a prescribed load. Empty: not computed.
    #[serde(with = "bits::pairs")]
    pub under_load: Vec<[f64; 2]>,
}
