//! Conservative orbits looked for near viscous ones: one attempt a point.

use super::follow::Take;
use super::{FamilyError, digest, ended};
use crate::contact::State;
use crate::orbit::Propagator;
use crate::orbit::branch::record;
use crate::orbit::nearest::nearest;
use crate::orbit::search::Verdict;
use crate::records::{BranchEnd, EndReason, GapReason, PointKind, PointRecord};

/// Look for the conservative orbit near each point of a viscous family, at its frequency; `known` are points of an earlier run.
pub fn orbits(
    body: &mut Propagator,
    from: &[PointRecord],
    known: &[&PointRecord],
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    for (k, viscous) in from.iter().enumerate() {
        let index = k as i64;
        if known.iter().any(|p| p.index == index) {
            continue;
        }
        let Some(orbit) = &viscous.orbit else { continue };
        let n_o = body.system.body.nodal_dofs().n_o;
        let u = body.system.body.coordinates(&orbit.u0[..n_o]).into_owned();
        let v = vec![0.0; u.len()];
        let z = body.frame(&State { u, v })[..body.n()].to_vec();
        let omega = viscous.omega;
        let verdict = nearest(body, &z, omega)?;
        let (special, orbit) = match &verdict {
            Verdict::Orbit(orbit) => (PointKind::Regular, Some(record(body, orbit)?)),
            Verdict::NotFound { residual, .. } => {
                (PointKind::Gap(GapReason::NoneNear { defect: *residual }), None)
            }
            other => (PointKind::Gap(GapReason::Verdict(other.kind())), None),
        };
        if take(PointRecord { omega, index, special, orbit, ..PointRecord::default() }).is_break() {
            return Ok(ended(0, EndReason::Interrupted, "interrupted", false));
        }
    }
    let text = format!("{} viscous orbits to start from", from.len());
    Ok(ended(0, EndReason::Range, text, true))
}

/// All numbers of the points, as one.
pub fn fingerprint(points: &[PointRecord]) -> u64 {
    let orbits = points.iter().filter_map(|p| p.orbit.as_ref());
    digest(points.len(), orbits.flat_map(|o| o.u0.iter().chain([&o.period])))
}
