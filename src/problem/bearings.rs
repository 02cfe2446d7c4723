//! What holds the body of a scene: supports with the loads that go straight into them, springs with their preloads.

use std::collections::BTreeMap;

use super::body::held;
use super::parts::parts;
use super::places::placed;
use super::{ProblemError, elements, loads, moving};
use crate::contact::{Bearings, System};
use crate::fem::{Body, Loads, load};
use crate::scenario::{Amplitude, BodyKind, LoadKind, RedistributedMass, Scene};

/// Supports of given matrices, one a direction, with the nodes of the rows that they hold.
fn supports_of_rows(scene: &Scene, body: &Body) -> Vec<(String, Vec<usize>)> {
    let mut all: BTreeMap<(usize, u8), (&str, Vec<usize>)> = BTreeMap::new();
    if scene.rows.superelement.is_some() {
        return vec![];
    }
    for (place, (k, name)) in scene.rows.held_rows().enumerate() {
        let of_axis = all.entry((k, name.direction)).or_insert((name.along(), vec![]));
        of_axis.1.push(body.dofs.n_rows() + place);
    }
    let named = |((k, _), (axis, nodes)): ((usize, u8), (&str, Vec<usize>))| {
        (format!("{} {axis}", scene.rows.supports[k].0), nodes)
    };
    all.into_iter().map(named).collect()
}

/// With what of the loads goes straight into supports.
pub(super) fn bearings(
    scene: &Scene,
    system: &System,
) -> Result<(Bearings, Option<Box<Loads>>), ProblemError> {
    let body = &system.body;
    let damping = system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
    // the frame of an obstacle that moves is none of inertia
    let moves = scene.contact.as_ref().is_some_and(|c| c.motion.is_some());
    let mut all = match scene.body.kind {
        BodyKind::Matrices => Bearings::of_rows(body, supports_of_rows(scene, body), damping),
        _ => {
            let held = if moves { vec![] } else { held(scene) };
            let parts = parts(scene, &body.mesh);
            Bearings::new(body, &held, damping, (&parts.of_node[..], parts.names.len()))
        }
    };
    all.pull(elements::pulls(scene, system)?);
    if system.has_massless_contact() && !all.is_empty() {
        let open = system.open_phase();
        let mass = scene.contact.as_ref().and_then(|c| c.mass);
        all = all.without_contact_mass(body, &open, mass != Some(RedistributedMass::Optimal));
    }
    if all.supports.is_empty() {
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
            LoadKind::Gravity => {
                let nodal = load::nodal_gravity(body, vector);
                borne.follow(all.share_of_weight(body, &nodal), 0, &course);
                continue;
            }
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
