//! Damped nonlinear modes of bodies with friction, amplitude by amplitude.

use super::follow::Take;
use super::{FamilyError, ended};
use crate::hbm::amplitudes::{Amplitudes, follow};
use crate::hbm::damped::DampedMode;
use crate::records::{BranchEnd, EndReason, PointRecord};

/// The mode at each amplitude; `known` are the points of an earlier run.
pub fn series(
    mode: &DampedMode,
    plan: &Amplitudes,
    known: &[&PointRecord],
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    let (mut index, mut interrupted) = (known.len() as i64, false);
    follow(mode, plan, known, |point| {
        let go = take(PointRecord { index, ..point });
        index += 1;
        interrupted = go.is_break();
        go
    })?;
    if interrupted {
        return Ok(ended(0, EndReason::Interrupted, "interrupted", false));
    }
    let (low, high) = (plan.grid.first().unwrap_or(&0.0), plan.grid.last().unwrap_or(&0.0));
    let text = format!("{} amplitudes from {low:.3e} to {high:.3e}", plan.grid.len());
    Ok(ended(0, EndReason::Range, text, true))
}
