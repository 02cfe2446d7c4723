//! A Fourier series as plain data: `u_O(t) = Σ a_k cos kωt + b_k sin kωt`.

use serde::{Deserialize, Serialize};

use super::bits;

/// Where a function (harmonic, whether it is the sine) stands in `a_0, a_1, b_1, a_2, b_2, …`.
pub fn place_of_function((k, is_sine): (usize, bool)) -> usize {
    if k == 0 { 0 } else { 2 * k - 1 + usize::from(is_sine) }
}

/// One series.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SeriesRecord {
    /// Frequency.
    #[serde(with = "bits::one")]
    pub omega: f64,
    /// Number of harmonics.
    pub n_h: usize,
    /// `a_0, a_1, b_1, …`, each of length `n_O`.
    #[serde(with = "bits::many")]
    pub coefficients: Vec<f64>,
    /// `α` of the feedback, for a viscous nonlinear mode.
    #[serde(default, with = "bits::maybe", skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
}
