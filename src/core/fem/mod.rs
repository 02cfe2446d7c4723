//! Finite elements: `M ü + C u̇ + K u = f(t)` for a bar or a plate, sparse (theory §1).

pub(crate) mod body;
pub(crate) mod carried;
mod components;
pub(crate) mod dense;
pub(crate) mod discrete;
pub(crate) mod dofs;
pub(crate) mod dynamic;
mod edges;
pub mod eigen;
pub(crate) mod element;
mod factor;
mod finer;
pub mod formats;
pub(crate) mod frame;
mod half;
#[doc(hidden)]
pub mod interpolate;
pub(crate) mod kernel;
mod largest;
pub(crate) mod law;
pub mod load;
mod massless;
mod matrix_market;
mod moments;
mod normals;
mod order;
#[doc(hidden)]
pub mod pair;
pub(crate) mod pivots;
mod probe;
#[doc(hidden)]
pub mod recovery;
pub(crate) mod reduction;
pub mod shape;
mod simplicial;
pub(crate) mod sparse;
pub(crate) mod spline;
mod stencil;
#[doc(hidden)]
pub mod stress;
mod superelement;

pub use body::{Body, Origin};
pub use carried::Carried;
pub use components::Components;
pub(crate) use discrete::along;
pub use discrete::{Discrete, with_elements};
pub use dofs::{ContactRows, DofMap};
pub use dynamic::{DynamicFactor, DynamicStiffness};
pub use edges::Edges;
pub use eigen::Modes;
pub use element::{MassForm, Shape};
pub use factor::{SolveScratch, SpdFactor};
pub use finer::{Finer, finer};
pub use frame::{ContactPoint, Facing, Fix, FrameError, Held};
pub use kernel::Kernel;
pub(crate) use largest::largest;
pub use law::{Material, StressState};
pub use load::{Course, Harmonic, Loads, Measured};
pub use massless::{Massless, motions_without_mass, standing_beside};
pub use matrix_market::parse_matrix_market;
pub use moments::Moments;
pub use normals::normals_of;
pub(crate) use pivots::Pivots;
pub use probe::{Nowhere, Probe, Quantity, Spot};
pub use reduction::{Interface, Kept, Reduction};
pub use sparse::Csr;
pub(crate) use sparse::blocks;
pub use spline::Spline;
pub use superelement::{SuperelementError, free_interface_form};

use thiserror::Error;

/// What can go wrong between a mesh and its matrices.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum FemError {
    /// A matrix that must be positive definite is not.
    #[error(
        "the {what} is not positive definite: look at the units of its numbers, the orientation of its cells, and at what holds the body (signorini inspect)"
    )]
    NotPositiveDefinite {
        /// Which matrix.
        what: &'static str,
    },
    /// A matrix that is to be solved with is singular.
    #[error("the {what} is singular")]
    Singular {
        /// Which matrix.
        what: &'static str,
    },
    /// The eigenvalue iteration did not converge.
    #[error("the {wanted} lowest modes of a problem of size {size} did not converge")]
    Eigen {
        /// Number of unknowns.
        size: usize,
        /// Number of modes asked for.
        wanted: usize,
    },
    /// The complex modes of a phase do not span its motions.
    #[error(
        "a phase of the motion has no complete set of modes ({size} displacements): its eigenvectors are dependent, or points that slip leave it no stiffness; \
         the damping of Rayleigh instead of dampers or ratios of modes, or a spring that holds the body, gives it one"
    )]
    Dependent {
        /// Number of displacements.
        size: usize,
    },
}
