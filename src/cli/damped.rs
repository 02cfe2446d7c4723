//! The damped nonlinear mode behind `backbone --amplitudes`: what it asks for.

use signorini::problem::Problem;
use signorini::scenario::{Issue, Scene};

use super::CliError;
use super::balance::Choice;

/// The number of the mode, from 0; refusals where a body has none.
pub(crate) fn mode(scene: &Scene, problem: &Problem, choice: &Choice) -> Result<usize, CliError> {
    let system = &problem.system;
    let refuse = |key: &str, message: &str, help: &str| {
        Err(scene.error(Issue::new(key, message, help)).into())
    };
    if !choice.is_event_resolved() {
        let message = "--amplitudes goes with --method hbm alone, without --aft and --shoot";
        return Err(CliError::Input(message.into()));
    }
    if system.tangents().is_none() {
        let message = "has no friction: damped nonlinear modes from amplitude to amplitude are those of bodies that stick and slip";
        return refuse(
            "body",
            message,
            "give a [[slider]] or contact.friction, or leave --amplitudes out (--viscous is for contact)",
        );
    }
    if system.loads.is_driven() {
        let message = "a damped nonlinear mode has no load that changes in time: its own feedback keeps it going";
        return refuse("load", message, "remove the [[load]] with omega, or give its amplitude 0");
    }
    if !scene.dampers.is_empty() {
        let message = "couples the modes of the open body, whose damping is asked to be modal here";
        return refuse(
            "damper[0]",
            message,
            "give [damping] modal, ratio or rayleigh in its place",
        );
    }
    Ok(scene.orbit.as_ref().and_then(|o| o.mode).map_or(0, |mode| mode - 1))
}
