//! Harmonic balance of the nodal boundary equations: the seed's own method (theory §9).
//!
//! In the modal coordinates of the open phase, `u_O = Φ q`, every phase differs from the open one on few directions only:
//!
//! ```text
//! q̈ + C₀ q̇ + Ω² q + Q n(θ) = f₀(θ),      θ = ωt,      n = P_α y + V_α ẏ + A_α ÿ − s_α(θ),     y = Q̂ᵀ q
//! ```
//!
//! with `Q` of `r ≤ 3 n_C` columns. In the *force form* (the seed's eq. 7) `n` holds `M_α − M₀`, `C_α − C₀`, `K_α − K₀`; in the *acceleration
//! form* the equation is first solved for `q̈` in every phase, `Q̂ = [Q, Ω²Q]` and there is no `A_α`.
//!
//! With `q = Σ_k a_k cos kθ + b_k sin kθ` the Galerkin equations are `D_k q_k + Q n_k = f_k`, `D_k = Ω² − k²ω² + ikωC₀`. Between two
//! switches the integrand of `n_k` is a trigonometric polynomial, so its integral is a closed form ([`balance`]); the switches are the roots of the monitors
//! along the series, all of them, by subdivision with proof ([`series`]). Newton's linear systems are condensed on `n`: `r (2N_h + 1)` unknowns whatever the
//! size of the body.
//!
//! What rubs is in [`rubbing`], the memory of a slider's spring in [`play`]. The contact ([`interface`]) asks of the open body only what it answers there, `y = ĉ − Ĝ n` ([`receptance`]): by all its modes ([`reduction`], [`modes`]), or,
//! where it is too large for them, by its dynamic stiffness ([`dynamic`]); [`balanced`] and [`newton`] are what both have in common, [`response`] and [`branch`] are families of
//! solutions, [`damped`] and [`amplitudes`] damped nonlinear modes, [`check`] holds series of any origin against the equations in time. [`viscous`] has the feedback of a viscous body as one more unknown, [`viscous_mode`] families of it frequency by frequency, [`viscous_branch`] along the branch.

#[doc(hidden)]
pub mod amplitudes;
pub(crate) mod balance;
pub(crate) mod balanced;
pub mod bem;
#[doc(hidden)]
pub mod branch;
#[doc(hidden)]
pub mod check;
mod crossing;
#[doc(hidden)]
pub mod damped;
pub(crate) mod dynamic;
mod extremes;
mod impedance;
pub(crate) mod interface;
pub mod modes;
mod multipliers;
#[doc(hidden)]
pub mod newton;
mod play;
pub(crate) mod receptance;
pub(crate) mod reduction;
#[doc(hidden)]
pub mod response;
mod rub;
mod rubbing;
pub mod series;
pub(crate) mod solution;
pub mod viscous;
#[doc(hidden)]
pub mod viscous_branch;
#[doc(hidden)]
pub mod viscous_mode;

pub use balance::{Balance, Quadrature};
pub use balanced::{Balanced, prepare};
pub use dynamic::Dynamic;
pub use interface::{Form, Interface};
pub use reduction::Reduction;
pub use series::{Basis, Series};
pub use solution::Solution;
pub use viscous::Viscous;

use crate::contact::{ContactError, System};
use crate::fem::FemError;

/// The equations could not be set up or evaluated.
#[derive(Debug, thiserror::Error)]
pub enum HbmError {
    /// A phase has no operators.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// The open phase has no modes.
    #[error(transparent)]
    Spectrum(#[from] FemError),
    /// A phase's mass matrix is singular on the interface.
    #[error(
        "the mass of a phase is singular on the contact interface: method = \"mass-redistribution\" needs none"
    )]
    Singular,
    /// The loads have no common period.
    #[error(
        "harmonic loads of different frequencies ({0} and {1}) have no common period: keep loads of one frequency, or integrate (signorini run)"
    )]
    Frequencies(f64, f64),
    /// A body that is too large for its modes can move rigidly.
    #[error(
        "the open body can move rigidly, and with {0} displacements its dynamic stiffness is factorised, which is singular at rest: support it"
    )]
    Free(usize),
    /// The open body can move rigidly.
    #[error(
        "nothing holds the body, even where all sticks that touches, and a rigid motion has no damped nonlinear mode: support it, or hold it by a [[spring]]"
    )]
    Floats,
    /// There is no such mode.
    #[error("mode {0} does not exist: the body that sticks has {1} modes")]
    NoMode(usize, usize),
    /// Velocities jump.
    #[error(
        "harmonic balance has no series for velocities that jump: shoot (--method shooting), or give another contact method"
    )]
    Impacts,
    /// Samples of a period know no friction.
    #[error(
        "samples of a period know nothing of friction: leave --samples out, and integrals go from switch to switch"
    )]
    Samples,
    /// More switches than a series of this length can have.
    #[error("more than {0} switches along one period: fewer harmonics, or more damping")]
    Switches(usize),
    /// An orbit could not be shot from a solution.
    #[error(transparent)]
    Shooting(#[from] crate::orbit::OrbitError),
}

/// Refuse loads that have no common period.
fn check_frequencies(system: &System) -> Result<(), HbmError> {
    if system.impact().is_some() {
        return Err(HbmError::Impacts);
    }
    let mut frequencies = system.loads.harmonics.iter().map(|h| h.omega);
    let Some(first) = frequencies.next() else { return Ok(()) };
    match frequencies.find(|w| *w != first) {
        Some(other) => Err(HbmError::Frequencies(first, other)),
        None => Ok(()),
    }
}
