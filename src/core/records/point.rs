//! A point of a family as plain data: its orbit or series, and where to go on from it.

use serde::{Deserialize, Serialize};

use super::{
    AttractorRecord, CheckRow, ExtremesRecord, OrbitRecord, PointKind, SeriesRecord, bits,
};
use crate::contact::States;

/// Where a continuation stood.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaceRecord {
    /// Unknowns, the parameter last.
    #[serde(with = "bits::many")]
    pub x: Vec<f64>,
    /// Tangent.
    #[serde(with = "bits::many")]
    pub tangent: Vec<f64>,
    /// Step.
    #[serde(with = "bits::one")]
    pub step: f64,
    /// Sign of the bordered determinant.
    #[serde(with = "bits::one")]
    pub orientation: f64,
    /// Signature.
    pub signature: Vec<i64>,
    /// States of the contact points in the phases of the chart.
    pub sets: Vec<States>,
    /// Contact point of each event.
    #[serde(alias = "nodes")]
    pub points: Vec<usize>,
    /// Harmonic balance: the solution of one harmonic that the ladder at this frequency began with.
    #[serde(with = "bits::many")]
    pub base: Vec<f64>,
    /// What the branch remembers of its way, where that decides how it goes on and ends; its family knows what it is.
    #[serde(default, with = "bits::many")]
    pub memory: Vec<f64>,
}

/// One row of `/backbone`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PointRecord {
    /// Frequency.
    #[serde(with = "bits::one")]
    pub omega: f64,
    /// Which branch (one for each damping ratio, number of harmonics, …).
    pub branch: usize,
    /// Place on the branch: the number of the frequency on a grid (falling where the branch is walked downwards), or the count from its
    /// start. With the branch it is the point's name: no two points of a file share both.
    pub index: i64,
    /// What it is.
    pub special: PointKind,
    /// The orbit; none: a point that was asked for and does not exist.
    pub orbit: Option<OrbitRecord>,
    /// Where to go on.
    pub place: Option<PlaceRecord>,
    /// The series, if harmonic balance made the point.
    pub series: Option<SeriesRecord>,
    /// What a cross-check found.
    pub check: Option<CheckRow>,
    /// What the body does there in a sweep.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attractor: Option<AttractorRecord>,
}

impl PointRecord {
    /// Largest energy of the motion; not a number where there is none.
    pub fn energy(&self) -> f64 {
        let seen = || self.attractor.as_ref().map_or(f64::NAN, |a| a.energy);
        self.orbit.as_ref().map_or_else(seen, |o| o.energy)
    }

    /// `ζ = α/2ω` of a motion that is kept going by a feedback that is known.
    pub fn damping_ratio(&self) -> Option<f64> {
        let alpha = self.orbit.as_ref()?.viscous.as_ref()?.alpha;
        Some(0.5 * alpha / self.omega).filter(|z| z.is_finite())
    }

    /// Largest contact displacement of the motion, likewise.
    pub fn amplitude(&self) -> f64 {
        let seen = || self.attractor.as_ref().map_or(f64::NAN, AttractorRecord::amplitude);
        self.orbit.as_ref().map_or_else(seen, |o| o.amplitude)
    }

    /// What forces and probes come to over the motion; nothing where nobody has looked.
    pub fn extremes(&self) -> Option<&ExtremesRecord> {
        let of_orbit = self.orbit.as_ref().map(|o| &o.extremes);
        let seen = self.attractor.as_ref().map(|a| &a.extremes);
        of_orbit.into_iter().chain(seen).find(|e| !e.is_empty())
    }

    /// Switches in a period of the motion, likewise.
    pub fn switches(&self) -> f64 {
        let seen = || self.attractor.as_ref().map_or(f64::NAN, |a| a.switches);
        self.orbit.as_ref().map_or_else(seen, |o| o.switches.len() as f64)
    }
}
