//! `[reduction]`: fixed-interface modes of `u_O` in place of all displacements.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, positive};
use super::{BodyKind, Issue, Scene};

/// `[reduction]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reduction {
    /// How many.
    #[schemars(range(min = 1))]
    pub modes: Option<usize>,
    /// Or: all modes below this circular frequency.
    pub cutoff: Option<f64>,
}

impl Scene {
    pub(super) fn check_reduction(&self) -> Check {
        let Some(r) = &self.reduction else { return Ok(()) };
        if self.body.kind == BodyKind::Matrices {
            return Err(Issue::new(
                "reduction",
                "is for bodies of elements",
                "reduce the matrices themselves, or leave [reduction] out",
            ));
        }
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
