//! What a forced body does in the long run, as plain data.

use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};

use super::{ExtremesRecord, bits};

/// Of which kind a motion is that a body settles to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum AttractorKind {
    /// A stable orbit of so many periods of the loads.
    Periodic(usize),
    /// It does not come back, and motions beside it neither part nor meet.
    QuasiPeriodic,
    /// Motions beside it part from it exponentially.
    Chaotic,
    /// Still on its way when the patience was at its end.
    Slow,
    /// It grows without bound.
    Unbounded,
    /// The motion could not be followed.
    Lost,
    /// It was not waited for: so many periods at each frequency (`--dwell`).
    Transient,
}

impl AttractorKind {
    /// Its name, with the period number behind that of an orbit.
    pub fn word(self) -> &'static str {
        match self {
            AttractorKind::Periodic(_) => "periodic",
            AttractorKind::QuasiPeriodic => "quasi-periodic",
            AttractorKind::Chaotic => "chaotic",
            AttractorKind::Slow => "slow",
            AttractorKind::Unbounded => "unbounded",
            AttractorKind::Lost => "lost",
            AttractorKind::Transient => "transient",
        }
    }

    /// Periods of the loads in one of an orbit; 0 of what is none.
    pub fn periods(self) -> usize {
        if let AttractorKind::Periodic(p) = self { p } else { 0 }
    }

    /// The kind of a name and a period number.
    pub fn of_word(word: &str, periods: usize) -> Option<AttractorKind> {
        use AttractorKind::*;
        let all = [Periodic(periods), QuasiPeriodic, Chaotic, Slow, Unbounded, Lost, Transient];
        all.into_iter().find(|kind| kind.word() == word)
    }
}

impl Display for AttractorKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            AttractorKind::Periodic(p) => write!(f, "period {p}"),
            kind => f.write_str(kind.word()),
        }
    }
}

/// What a body does at a frequency of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttractorRecord {
    /// Of which kind it is.
    pub kind: AttractorKind,
    /// By how much motions beside it part in a period of the loads, as a logarithm (negative: they meet): of an orbit from its largest multiplier, else a mean
    /// along the motion. Not a number: not known.
    #[serde(with = "bits::one")]
    pub exponent: f64,
    /// Standard error of that mean; 0 of an orbit.
    #[serde(with = "bits::one")]
    pub exponent_error: f64,
    /// Largest displacement of each contact point towards its obstacle, along the normal.
    #[serde(with = "bits::many")]
    pub peak: Vec<f64>,
    /// Least displacement of each contact point.
    #[serde(with = "bits::many")]
    pub trough: Vec<f64>,
    /// Largest force of all contact points together.
    #[serde(with = "bits::one")]
    pub force: f64,
    /// Largest energy.
    #[serde(with = "bits::one")]
    pub energy: f64,
    /// Switches that were seen, a period of the loads.
    #[serde(with = "bits::one")]
    pub switches: f64,
    /// Displacements of all contact points at the beginning of each period of the loads, one period after the other: as many as an orbit has, 40 of what is none.
    #[serde(with = "bits::many")]
    pub sections: Vec<f64>,
    /// Least displacements of all contact points in each of these periods, of 128 states.
    #[serde(with = "bits::many")]
    pub least: Vec<f64>,
    /// Magnitudes of the harmonics of the contact point that moves most, at multiples of a twelfth of the frequency of the loads.
    #[serde(with = "bits::many")]
    pub spectrum: Vec<f64>,
    /// What forces and probes come to.
    #[serde(default, skip_serializing_if = "ExtremesRecord::is_empty")]
    pub extremes: ExtremesRecord,
    /// Periods of the loads that it took to find it.
    pub maps: usize,
    /// What there is to say besides: why the motion was lost, how near it came back.
    pub note: String,
}

impl AttractorRecord {
    /// Largest displacement of a contact point in magnitude.
    pub fn amplitude(&self) -> f64 {
        largest(&self.peak, &self.trough)
    }
}

/// The largest magnitude of displacements between peaks and troughs.
pub(crate) fn largest(peak: &[f64], trough: &[f64]) -> f64 {
    peak.iter().chain(trough).fold(f64::NAN, |most, u| most.max(u.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_found_by_its_word() {
        use AttractorKind::*;
        for kind in [Periodic(3), QuasiPeriodic, Chaotic, Slow, Unbounded, Lost, Transient] {
            assert_eq!(AttractorKind::of_word(kind.word(), kind.periods()), Some(kind));
        }
        assert_eq!(AttractorKind::of_word("steady", 1), None);
        assert_eq!(Periodic(2).to_string(), "period 2");
    }
}
