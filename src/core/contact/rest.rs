//! The state that modes, amplitudes and energies are told around, where a scene asks for it: the static equilibrium under the constant loads.
//!
//! A preloaded joint is linear around the phase of its equilibrium until a first point opens, or closes. Modes are those of that phase, a displacement
//! counts from the equilibrium, an energy is what a motion has beyond it,
//!
//! ```text
//! E = H(u, v) − fᵀu − (H(u°, 0) − fᵀu°)
//! ```

use super::states::States;

/// The equilibrium of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// The active set.
    pub set: States,
    /// `u_O°`
    pub u: Vec<f64>,
    /// Displacements of the contact points there.
    pub(super) at_points: Vec<f64>,
    /// `H(u°, 0) − fᵀu°`
    pub(super) energy: f64,
}
