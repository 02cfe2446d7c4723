//! What holds the body of a scene: supports with the loads that go straight into them, springs with their preloads.

use super::body::held;
use super::parts::parts;
use super::places::placed;
use super::{ProblemError, elements, loads, moving};
use crate::contact::{Bearings, System};
use crate::fem::{Loads, load};
use crate::scenario::{Amplitude, BodyKind, LoadKind, Scene};

/// With what of the loads goes straight into supports.
pub(super) fn bearings(
    scene: &Scene,
    system: &System,
) -> Result<(Bearings, Option<Box<Loads>>), ProblemError> {
    let body = &system.body;
    let damping = system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
    // the frame of an obstacle that moves is none of inertia; bodies from matrices have no supports
    let moves = scene.contact.as_ref().is_some_and(|c| c.motion.is_some());
    let held = if moves || scene.body.kind == BodyKind::Matrices { vec![] } else { held(scene) };
    let parts = parts(scene, &body.mesh);
    let of_parts = (&parts.of_node[..], parts.names.len());
    let mut all = Bearings::new(body, &held, damping, of_parts);
    all.pull(elements::pulls(scene, system)?);
    if system.has_massless_contact() && !all.is_empty() {
        let open = system.open_phase();
        all = all.without_contact_mass(|row| open.reduce(row));
    }
    if held.is_empty() {
        return Ok((all, None));
    }
    let mut borne = Loads::default();
    for (i, l) in scene.loads.iter().enumerate() {
        let vector = &match &l.amplitude {
            Some(Amplitude::Vector(vector)) => vector.clone(),
            Some(Amplitude::Scalar(a)) => vec![*a],
            None => continue,
        };
        let course = loads::course(scene, i)?;
        let nodal = match l.kind {
            LoadKind::Gravity => load::nodal_gravity(body, vector),
            LoadKind::Traction => load::nodal_traction(body, l.group(), vector),
            LoadKind::Point => {
                let at = placed(scene, &body.mesh, &format!("load[{i}].at"), l.at.as_deref())?;
                load::nodal_point(body, at.node, vector)
            }
            LoadKind::Base => {
                let field = moving::field(scene, body, l.group(), vector);
                for (derivative, share) in (0..).zip(all.shares_of_motion(body, &field)) {
                    borne.follow(share, derivative, &course);
                }
                continue;
            }
            LoadKind::Force | LoadKind::Mode => continue,
        };
        borne.follow(all.share(&nodal), 0, &course);
    }
    Ok((all, Some(borne.into())))
}
