//! `[reduction]`: modes of `u_O` in place of all displacements.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, positive};
use super::{Issue, Scene};

/// Which modes a reduction keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ReductionKind {
    /// Of the body whose displacements at the contact are held, which stay coordinates of their own.
    #[default]
    FixedInterface,
    /// Of the open body, with the static compliance of contact and loads: converges faster, with fewer coordinates.
    FreeInterface,
}

/// `[reduction]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reduction {
    /// Which modes are kept.
    #[serde(default)]
    pub kind: ReductionKind,
    /// How many.
    #[schemars(range(min = 1))]
    pub modes: Option<usize>,
    /// Or: all modes below this circular frequency.
    pub cutoff: Option<f64>,
}

impl Scene {
    pub(super) fn check_reduction(&self) -> Check {
        let Some(r) = &self.reduction else { return Ok(()) };
        match (r.modes, r.cutoff) {
            (Some(0), None) => {
                Err(Issue::new("reduction.modes", "needs at least one", "modes = 60"))
            }
            (Some(_), None) => Ok(()),
            (None, Some(w)) => positive("reduction.cutoff", w),
            _ => Err(Issue::new(
                "reduction",
                "give exactly one of modes, cutoff",
                "modes = 60, or cutoff = 35.0",
            )),
        }
    }
}
