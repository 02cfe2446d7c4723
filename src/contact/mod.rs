//! Contact by the nodal boundary method: boundary stress, complementarity, active sets, phases (theory §2–5).

pub mod active;
pub mod boundary;
pub mod lcp;
pub mod nbm;
pub mod oracle;
pub mod phase;

pub use active::ActiveSet;
pub use lcp::LcpError;
pub use nbm::{ContactEdge, Rayleigh, Scratch, System};
pub use phase::{Monitor, MonitorKind, Phase};

use crate::fem::FemError;
use thiserror::Error;

/// What can go wrong in the contact operators.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum ContactError {
    /// `N_C` cannot be shown to be a P-matrix.
    #[error(
        "the contact conditions may have several solutions: N_C cannot be shown to be a P-matrix near \
         contact node {node} at ({:.6}, {:.6})", at[0], at[1]
    )]
    NotPMatrix {
        /// Mesh node.
        node: usize,
        /// Its position.
        at: [f64; 2],
    },
    /// The reduced mass of a phase is singular.
    #[error("the mass matrix of the phase {set:?} is singular")]
    SingularPhase {
        /// Active set.
        set: ActiveSet,
    },
    /// The pivoting failed.
    #[error(transparent)]
    Lcp(#[from] LcpError),
    /// A matrix could not be factorised.
    #[error(transparent)]
    Fem(#[from] FemError),
}
