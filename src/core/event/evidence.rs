//! What a run has seen of its own quality: counts and extremes. A checkpoint keeps them, the report tells them.

use super::proof::Proof;

/// Counts and extremes so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evidence {
    /// What is proved.
    pub proof: Proof,
    /// Largest displacement.
    pub largest_u: f64,
    /// Largest velocity at a switch of an impact law.
    pub largest_v: f64,
    /// Largest error of a gap behind a switch.
    pub gap_error: f64,
    /// Largest tension.
    pub max_tension: f64,
    /// Largest penetration of an obstacle that yields.
    pub entered: f64,
    /// Impulses of blows.
    pub blows: f64,
}
