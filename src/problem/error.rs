//! Why a problem cannot be set up.

use thiserror::Error;

use crate::contact::ContactError;
use crate::fem::FemError;
use crate::scenario::SceneError;

/// Why a problem cannot be set up.
#[derive(Debug, Error)]
pub enum ProblemError {
    /// The scene asks for something that is not possible.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A mode that the states of a scene cannot be told by.
    #[error("mode {mode} {message}; {help}")]
    Mode {
        /// Its number, from 1.
        mode: usize,
        /// What is wrong with it.
        message: String,
        /// What would be accepted.
        help: String,
    },
    /// The operators failed.
    #[error("setting up the contact operators: {0}")]
    Contact(#[from] ContactError),
    /// Matrices failed.
    #[error("setting up the matrices: {0}")]
    Fem(#[from] FemError),
}
