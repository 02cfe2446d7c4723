//! What the computation of rows needs from outside, and why it may not be made.

use crate::continuation::Go;
use crate::problem::Problem;
use crate::records::Row;
use crate::scenario::{Scene, SceneError};

/// How problems are set up: files that scenes name, and what is too large, are the caller's matter.
pub type SetUp<'a> = &'a dyn Fn(&Scene) -> Result<Problem, String>;

/// What the computation of rows needs from outside.
#[derive(Clone, Copy)]
pub struct Means<'a> {
    /// How problems are set up.
    pub set_up: SetUp<'a>,
    /// Whether to end in the middle of a row, which is lost.
    pub stop: &'a dyn Fn() -> bool,
}

/// Takes each row as it is computed, with the share of the work that is done and what comes next; says whether to go on.
pub type Take<'t> = &'t mut dyn FnMut(Option<Row>, f64, &str) -> Go;

/// A comparison could not be made.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The reference.
    #[error(
        "the reference ({name}) could not be computed: {why}; give another one with --reference"
    )]
    Reference {
        /// What it was to be.
        name: String,
        /// Why it is not there.
        why: String,
    },
}
