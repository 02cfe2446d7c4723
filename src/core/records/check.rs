//! What a cross-check of a series in time found, as plain data.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use super::bits;

/// What came of a search for an orbit, in one word; the word is written by [`VerdictKind::name`] and read by [`VerdictKind::of_name`].
/// In the order of their words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum VerdictKind {
    /// An orbit with all its credentials, but another one than the series approximates: far from it, or of another sequence of switches.
    AnotherOrbit,
    /// The equations could not be evaluated.
    Failed,
    /// A solution of the shooting equations that is no orbit.
    Flawed,
    /// The family of the guess turns back before the frequency.
    Fold,
    /// The family of the guess ends at a grazing contact before the frequency.
    Grazing,
    /// A periodic motion that does not touch the obstacle.
    NoContact,
    /// Neither an orbit nor its family was found.
    NotFound,
    /// An orbit with all its credentials, and near the series where there is one.
    Orbit,
    /// A word of another version, or of a damaged file.
    Other(String),
}

impl VerdictKind {
    /// All that this version gives.
    pub const ALL: [VerdictKind; 8] = [
        VerdictKind::AnotherOrbit,
        VerdictKind::Failed,
        VerdictKind::Flawed,
        VerdictKind::Fold,
        VerdictKind::Grazing,
        VerdictKind::NoContact,
        VerdictKind::NotFound,
        VerdictKind::Orbit,
    ];

    /// The word.
    pub fn name(&self) -> &str {
        match self {
            VerdictKind::AnotherOrbit => "another orbit",
            VerdictKind::Failed => "failed",
            VerdictKind::Flawed => "flawed",
            VerdictKind::Fold => "fold",
            VerdictKind::Grazing => "grazing",
            VerdictKind::NoContact => "no contact",
            VerdictKind::NotFound => "not found",
            VerdictKind::Orbit => "orbit",
            VerdictKind::Other(word) => word,
        }
    }

    /// The verdict of a word.
    pub fn of_name(name: &str) -> VerdictKind {
        let known = VerdictKind::ALL.into_iter().find(|v| v.name() == name);
        known.unwrap_or_else(|| VerdictKind::Other(name.to_owned()))
    }
}

impl std::fmt::Display for VerdictKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl From<String> for VerdictKind {
    fn from(name: String) -> Self {
        VerdictKind::of_name(&name)
    }
}

impl From<VerdictKind> for String {
    fn from(verdict: VerdictKind) -> Self {
        verdict.name().to_owned()
    }
}

impl Ord for VerdictKind {
    fn cmp(&self, other: &Self) -> Ordering {
        self.name().cmp(other.name())
    }
}

impl PartialOrd for VerdictKind {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// One row of a cross-check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckRow {
    /// Frequency.
    #[serde(with = "bits::one")]
    pub omega: f64,
    /// Harmonics.
    pub n_h: usize,
    /// Energy of the series.
    #[serde(with = "bits::one")]
    pub energy: f64,
    /// Residual of the series in time.
    #[serde(with = "bits::one")]
    pub residual: f64,
    /// Return error of its initial state.
    #[serde(with = "bits::one")]
    pub return_error: f64,
    /// Verdict in one word.
    pub verdict: VerdictKind,
    /// Verdict in words.
    pub message: String,
    /// How far shooting moved the state, relative (NaN: no orbit).
    #[serde(with = "bits::one")]
    pub moved: f64,
    /// Energy of the orbit.
    #[serde(with = "bits::one")]
    pub orbit_energy: f64,
    /// Change of the contact time over the period.
    #[serde(with = "bits::one")]
    pub contact_change: f64,
    /// Whether the sequence of switches stayed.
    pub same_sequence: bool,
}

impl CheckRow {
    /// Whether shooting found the orbit that the series approximates.
    pub fn is_orbit(&self) -> bool {
        self.verdict == VerdictKind::Orbit
    }

    /// Whether shooting found any orbit, this one or another.
    pub fn has_orbit(&self) -> bool {
        self.is_orbit() || self.verdict == VerdictKind::AnotherOrbit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_verdict_is_read_as_it_was_written() {
        for verdict in VerdictKind::ALL.into_iter().chain([VerdictKind::Other("cusp".into())]) {
            assert_eq!(VerdictKind::of_name(verdict.name()), verdict);
            let json = serde_json::to_string(&verdict).unwrap();
            assert_eq!(json, format!("{:?}", verdict.name()));
            assert_eq!(serde_json::from_str::<VerdictKind>(&json).unwrap(), verdict);
        }
        assert!(VerdictKind::ALL.is_sorted());
    }
}
