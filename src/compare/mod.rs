//! Contact methods side by side: the same scene with other methods, on other meshes, with other parameters.
//!
//! A [`Plan`] says which [`Variant`]s of the contact method stand beside each other, on which meshes, with which parameters; [`rows`] computes them one after the
//! other, motions ([`transient`]) against a [`mod@reference`] or orbits ([`orbits`]) at given frequencies, and hands on each [`Row`] as it is there. What the rows say
//! together (orders, limits) is in [`crate::records::Comparison`].

mod means;
pub mod orbits;
mod plan;
pub mod reference;
pub mod transient;
pub mod trust;
mod variant;
mod watch;

use crate::records::{Compared, Comparison, Row};

pub use means::{CompareError, Means, SetUp, Take};
pub use plan::{Plan, Request};

pub(crate) use plan::Task;
pub use variant::Variant;

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
