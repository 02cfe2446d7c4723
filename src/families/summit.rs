//! The peaks of a response that is followed: between the orbits of its branch, exactly.

use super::{FamilyError, state_of};
use crate::orbit::Propagator;
use crate::orbit::peak::peak_near;
use crate::records::{Peak, PointRecord, summits};

/// The peaks of a branch whose points come in the order of the walk: the orbits at which the largest contact displacement does not change with the frequency. Where that cannot be
/// solved (beside a jump, on a corner), the top of a parabola through three orbits.
pub(super) fn peaks(
    body: &mut Propagator,
    branch: usize,
    points: &[PointRecord],
) -> Result<Vec<Peak>, FamilyError> {
    let orbits: Vec<_> = points.iter().filter_map(|p| Some((p.omega, p.orbit.as_ref()?))).collect();
    let row = orbits.iter().map(|(omega, o)| [*omega, o.amplitude, o.energy]).collect();
    let mut found = vec![];
    for (rough, around) in summits(branch, row) {
        let [before, at, behind] = around.map(|k| orbits[k]);
        let bounds = (before.0.min(behind.0), before.0.max(behind.0));
        let state = state_of(&body.system, at.1);
        let exact = match bounds.0 < at.0 && at.0 < bounds.1 {
            true => peak_near(body, &state, at.0, bounds)?,
            false => None,
        };
        found.push(exact.map_or(rough, |top| Peak {
            branch,
            omega: top.orbit.omega(),
            amplitude: top.amplitude,
            energy: top.orbit.energy,
        }));
    }
    Ok(found)
}
