//! `[reduction]`: a problem in fewer coordinates of `u_O`.

use std::sync::Arc;

use super::{Problem, ProblemError};
use crate::contact::State;
use crate::fem::{FemError, Interface, Kept};
use crate::scenario::{Issue, RedistributedMass, ReductionKind, Scene};

/// The problem as the scene's `[reduction]` has it.
pub(super) fn reduced(scene: &Scene, problem: Problem) -> Result<Problem, ProblemError> {
    let Some(asked) = &scene.reduction else { return Ok(problem) };
    let Problem { system, initial, mut notes } = problem;
    if scene.contact.as_ref().is_some_and(|c| c.mass == Some(RedistributedMass::Optimal)) {
        let message = "is spread over the whole body, and [reduction] keeps modes of it only";
        let help = "give mass = \"condensed\", or leave [reduction] out";
        return Err(scene.error(Issue::new("contact.mass", message, help)).into());
    }
    if system.remembers() && asked.kind == ReductionKind::FreeInterface {
        let message = "is of an open body that its supports hold, and nothing holds what springs of sliders remember";
        let help = "give kind = \"fixed-interface\", or leave out the stiffness of the sliders";
        return Err(scene.error(Issue::new("reduction.kind", message, help)).into());
    }
    let kept = match (asked.modes, asked.cutoff) {
        (Some(count), _) => Kept::Modes(count),
        (_, cutoff) => Kept::Below(cutoff.unwrap_or(f64::INFINITY)),
    };
    let interface = match asked.kind {
        ReductionKind::FixedInterface => Interface::Fixed,
        ReductionKind::FreeInterface => Interface::Free,
    };
    let reduction = system.reduction(interface, kept).map_err(|e| match e {
        FemError::NotPositiveDefinite { .. } => {
            let message = match interface {
                Interface::Fixed => "needs a body that its supports and its interface hold",
                Interface::Free => "needs a body that its supports hold while its contact is held",
            };
            let help = "add a [[support]], or leave [reduction] out";
            scene.error(Issue::new("reduction", message, help)).into()
        }
        FemError::Singular { .. } if interface == Interface::Free => {
            let message = "does not know all displacements along which friction acts: too few modes, or a body that friction alone holds";
            let help = "give kind = \"fixed-interface\", more modes, or a [[support]]";
            scene.error(Issue::new("reduction.kind", message, help)).into()
        }
        other => ProblemError::Fem(other),
    })?;
    let reduction = Arc::new(reduction);
    notes.cut_off(&system.body, &reduction, [&initial.u, &initial.v]);
    let project = |x: &[f64]| reduction.project(x);
    let initial = State { u: project(&initial.u), v: project(&initial.v) };
    Ok(Problem { system: system.reduced(&reduction)?, initial, notes })
}
