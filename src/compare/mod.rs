//! Contact methods side by side: the same scene with other methods, on other meshes, with other parameters.
//!
//! A [`Plan`] says which [`Variant`]s of the contact method stand beside each other, on which meshes, with which parameters; [`rows`] computes them one after the
//! other, motions ([`transient`]) against a [`mod@reference`] or orbits ([`orbits`]) at given frequencies, and hands on each [`Row`] as it is there. What the rows say
//! together (orders, limits) is in [`crate::records::Comparison`].

pub mod orbits;
mod plan;
pub mod reference;
pub mod transient;
mod variant;

use crate::continuation::Go;
use crate::problem::Problem;
use crate::records::{Compared, Comparison, Row};
use crate::scenario::{Scene, SceneError};

pub use plan::{Plan, Request};

pub(crate) use plan::Task;
pub use variant::Variant;

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
    #[error("the reference ({name}) could not be computed: {why}")]
    Reference {
        /// What it was to be.
        name: String,
        /// Why it is not there.
        why: String,
    },
}

/// All rows of a plan; those that are in `known` are not computed again.
pub fn rows(plan: &Plan, means: Means, known: &[Row], take: Take) -> Result<(), CompareError> {
    match plan.compared {
        Compared::Run => transient::rows(plan, means, known, take),
        Compared::Orbit | Compared::Viscous => orbits::rows(plan, means.set_up, known, take),
    }
}

/// A comparison without rows: what is said above them.
pub fn outline(plan: &Plan, footer: String) -> Comparison {
    let (reference, exact) = match plan.compared {
        Compared::Run => (plan.reference.to_string(), plan.reference.is_exact()),
        Compared::Orbit | Compared::Viscous => (orbits::title(plan), false),
    };
    let title = plan.scene.name();
    Comparison { compared: plan.compared, title, reference, exact, footer, rows: vec![] }
}
