//! What a cross-check of a series in time found, as plain data.

use serde::{Deserialize, Serialize};

use super::bits;

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
    pub verdict: String,
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
