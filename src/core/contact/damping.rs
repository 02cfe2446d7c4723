//! Damping of the body.

/// Rayleigh damping `C = α M + β K`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rayleigh {
    /// Mass-proportional part.
    pub alpha: f64,
    /// Stiffness-proportional part.
    pub beta: f64,
}
