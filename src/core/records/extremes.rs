//! What forces and probes come to over a motion, as plain data.

use serde::{Deserialize, Serialize};

use super::bits;

/// The largest and the least of each number that is watched ([`crate::event::Watch::all`]); empty: nobody has looked.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ExtremesRecord {
    /// Largest; not a number where it is not known.
    #[serde(with = "bits::many")]
    pub largest: Vec<f64>,
    /// Least.
    #[serde(with = "bits::many")]
    pub least: Vec<f64>,
}

impl ExtremesRecord {
    /// Whether nobody has looked.
    pub fn is_empty(&self) -> bool {
        self.largest.is_empty()
    }
}
