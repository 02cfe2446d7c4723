//! Derivatives of an orbit by a number of its scene, as plain data.

/// A largest value over the period.
#[derive(Debug, Clone, PartialEq)]
pub struct PeakRecord {
    /// `amplitude`, `pressure` or `energy`.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// When it is reached.
    pub t: f64,
    /// The mesh node of a contact point.
    pub node: Option<usize>,
}

/// Derivatives of an orbit by one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct SensitivityRecord {
    /// The key of the scene.
    pub key: String,
    /// The number that stands there.
    pub value: f64,
    /// Of the displacements at `t = 0`, in the order of an orbit's.
    pub u0: Vec<f64>,
    /// Of the velocities.
    pub v0: Vec<f64>,
    /// Of the largest values, in their order.
    pub peaks: Vec<f64>,
    /// Of the period.
    pub period: f64,
    /// Of the feedback of a viscous orbit.
    pub alpha: Option<f64>,
    /// Of the multipliers: real and imaginary part. Empty: not computed.
    pub multipliers: Vec<[f64; 2]>,
}
