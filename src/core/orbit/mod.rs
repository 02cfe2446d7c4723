//! Periodic orbits of the nodal boundary equations: shooting, stability, families (theory §8).
//!
//! A state `x = (u_O, u̇_O)` is carried over one period by the event-driven integrator; a periodic orbit is a fixed point of that map.
//!
//! - [`chain`], [`walk`], [`tangent`] — a motion through a given sequence of active sets, its tangent, switch conditions as equations;
//! - [`period_map`] — the motion over a time from a state, with the sequence of active sets that the integrator finds;
//! - [`shooting`] — Newton on the event-driven map: reversible half period, full period;
//! - [`krylov`] — the same with tangent products for large bodies;
//! - `drift` — directions along which a body that friction alone holds may walk;
//! - `least` — the shortest step where friction holds a family of residual positions;
//! - [`cycle`] — the limit cycle that a body comes to by itself;
//! - [`nearest`] — the conservative orbit nearest to a viscous one;
//! - [`saltation`] — how a perturbation passes a switch;
//! - [`viscous`] — the viscous nonlinear mode: what is pinned, which viscosity, where to start;
//! - [`border`] — where a chart ends;
//! - [`segments`] — multi-segment shooting as a family for [`crate::continuation`]: charts are sequences of active sets;
//! - [`mapped`] — viscous orbits as a family, on the event-driven map itself;
//! - `touch` — minima of monitors along a motion;
//! - `grazing` — over a grazing of a branch, and where it is;
//! - [`floquet`] — monodromy matrix, multipliers, stability;
//! - [`parameter`], [`sensitivity`] — how an orbit changes with a number that the equations depend on;
//! - [`phase_lag`], [`quadrature`] — phase resonance: steered to, and as a condition on orbits;
//! - [`lyapunov`] — how fast the neighbours of a motion part from it;
//! - [`condition`], [`values`], [`curve`] — orbits that are singled out (folds, doublings, grazings, peaks) as curves over a number that the equations depend on;
//! - [`attractor`], [`settle`], [`basin`] — what a forced body does in the long run, and to which of several attractors a motion comes;
//! - [`torus`], [`rotation`] — motions of two frequencies: closed curves of the period map, how far they are gone around;
//! - `highest` — the largest energy of a motion; `extremes` — the largest and the least of forces and of what probes see;
//! - [`credentials`] — everything an orbit has to show before it is one;
//! - [`branch`] — families of orbits frequency by frequency, with all that a file keeps of them;
//! - [`along`] — families by arclength, through folds and corners;
//! - [`search`] — one orbit from a guess, with a verdict that names the cause of a failure; all orbits from a set of starts.

#[doc(hidden)]
pub mod along;
pub mod attractor;
#[doc(hidden)]
pub mod basin;
#[doc(hidden)]
pub mod border;
#[doc(hidden)]
pub mod branch;
#[doc(hidden)]
pub mod census;
pub mod chain;
pub mod condition;
pub mod credentials;
#[doc(hidden)]
pub mod curve;
#[doc(hidden)]
pub mod cycle;
pub mod displaced;
mod drift;
pub(crate) mod extremes;
pub mod floquet;
mod grazing;
mod highest;
#[doc(hidden)]
pub mod krylov;
mod least;
#[doc(hidden)]
pub mod lyapunov;
pub(crate) mod mapped;
#[doc(hidden)]
pub mod nearest;
#[doc(hidden)]
pub mod parameter;
#[doc(hidden)]
pub mod peak;
#[doc(hidden)]
pub mod period_map;
pub mod phase_lag;
pub(crate) mod pin;
#[doc(hidden)]
pub mod quadrature;
pub mod rotation;
pub(crate) mod saltation;
pub mod search;
#[doc(hidden)]
pub mod section;
#[doc(hidden)]
pub mod segments;
#[doc(hidden)]
pub mod sensitivity;
#[doc(hidden)]
pub mod settle;
pub mod shooting;
pub(crate) mod tangent;
#[doc(hidden)]
pub mod torus;
mod touch;
#[doc(hidden)]
pub mod values;
pub mod viscous;
mod visits;
pub(crate) mod walk;

pub use chain::{Chain, LARGE, Propagator, Spent};
pub use credentials::Orbit;
pub use floquet::Stability;
pub use highest::Highest;
pub(crate) use least::least_change;
pub use pin::Pin;
pub use segments::Segments;
pub use shooting::Closure;

use crate::contact::ContactError;
use crate::continuation::{Family, Place, norm};
use crate::event::Outcome;
use crate::fem::FemError;

/// A family whose solutions are orbits.
pub trait OrbitFamily: Family<Chart = Chain, Error = OrbitError> {
    /// The orbit of a solution, with its credentials.
    fn orbit(&mut self, x: &[f64]) -> Result<Orbit, OrbitError>;
    /// The body.
    fn body(&self) -> &Propagator;
    /// The same place where the states of the family had better be taken from here on, if not where they are.
    fn moved(&mut self, _: &Place<Chain>) -> Result<Option<Place<Chain>>, OrbitError> {
        Ok(None)
    }
    /// The instant of the loads at which states are taken, in periods of the loads.
    fn section(&self) -> f64 {
        0.0
    }
    /// Take them at another one.
    fn set_section(&mut self, _: f64) {}
}

/// The period map could not be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum OrbitError {
    /// A phase has no operators.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// A phase has no modes.
    #[error(transparent)]
    Spectrum(#[from] FemError),
    /// The integration ended early.
    #[error("{0}")]
    Incomplete(Outcome),
    /// Whoever asked for orbits wants no more.
    #[error("asked to end")]
    Stopped,
    /// A node was held on the switching surface: the motion is not a chain of phases.
    #[error(
        "node {node} is held on the switching surface at t = {t:.9}: no orbit passes there; stress = \"reaction\" has no such states"
    )]
    Held {
        /// Time.
        t: f64,
        /// Mesh node.
        node: usize,
    },
    /// Only reversible orbits are shot without the modes of all phases.
    #[error(
        "a body of {0} displacements is too large for full-period shooting; shoot a reversible orbit (start at rest)"
    )]
    Large(usize),
    /// An orbit has no derivative by a parameter.
    #[error("{0}")]
    Parameter(&'static str),
    /// The feedback of a viscous orbit is beyond all that could be one.
    #[error(
        "alpha = {alpha:.3e} is beyond {most:.3e}, three times the frequency of the pinned mode: start from a smaller amplitude or another mode"
    )]
    Feedback {
        /// `α`
        alpha: f64,
        /// Its bound.
        most: f64,
    },
    /// There is no such body at a value of a parameter.
    #[error("at {0}: {1}")]
    Value(f64, String),
    /// An eigenvalue or singular value problem failed.
    #[error("the {0} could not be computed")]
    Eigen(&'static str),
}

impl OrbitError {
    /// The motion from one state could not be followed, or is none: what a search meets on its way, and goes around.
    pub fn is_of_one_motion(&self) -> bool {
        matches!(
            self,
            OrbitError::Incomplete(_)
                | OrbitError::Held { .. }
                | OrbitError::Feedback { .. }
                | OrbitError::Value(..)
                | OrbitError::Spectrum(FemError::Dependent { .. })
        )
    }
}

/// Size of the residual of an orbit that is rounding error, from its state as a frame vector.
fn rounding_of(z: &[f64]) -> f64 {
    2e-14 * norm(z).max(1e-300) * (1.0 + (z.len() as f64).sqrt() * 0.1)
}

/// Nothing, where an error is that of one motion.
fn tolerate<T>(result: Result<T, OrbitError>) -> Result<Option<T>, OrbitError> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(e) if e.is_of_one_motion() => Ok(None),
        Err(e) => Err(e),
    }
}
