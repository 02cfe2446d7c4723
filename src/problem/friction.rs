//! Friction of a scene: the tangent, the coefficient and the velocity of the surface at every contact point.

use std::collections::BTreeMap;

use super::given::given_tangents;
use super::{Notes, ProblemError};
use crate::contact::{Anchor, Constraint, System, Tangent};
use crate::fem::Body;
use crate::mesh::Point;
use crate::mesh::point::dot;
use crate::scenario::{BodyKind, Contact, Issue, Obstacle, Scene};

/// What of a surface's velocity may point along the normal, over its size.
const ACROSS: f64 = 1e-9;

/// Entries of a row of directions below this are rounding.
const ROUNDING: f64 = 1e-14;

/// One entry a contact point, those in front, then those behind; empty where the scene has no friction.
pub(super) fn tangents(scene: &Scene, body: &Body) -> Result<Vec<Option<Tangent>>, ProblemError> {
    let Some(contact) = scene.contact.as_ref().filter(|c| c.has_friction()) else {
        return Ok(vec![]);
    };
    let front = match scene.body.kind {
        BodyKind::Matrices => given_tangents(scene, contact, body)?,
        _ => of_elements(scene, contact, body)?,
    };
    // the obstacle behind faces the other way: its tangent is turned
    let behind = |t: &Tangent| Tangent {
        row: t.row.iter().map(|(j, w)| (*j, -w)).collect(),
        surface: -t.surface,
        direction: t.direction.map(|x| -x),
        ..t.clone()
    };
    let mut all = front.clone();
    for (i, tangent) in front.iter().enumerate() {
        let k = body.dofs.contact.get(i).map_or(0, |c| c.group);
        if contact.obstacles.get(k).is_some_and(|o| o.gap_behind.is_some()) {
            all.push(tangent.as_ref().map(behind));
        }
    }
    Ok(all)
}

/// Of bodies with elements. In the plane: the outward normal turned by +90°, where that displacement is free. In space: the direction of the surface's velocity.
fn of_elements(
    scene: &Scene,
    contact: &Contact,
    body: &Body,
) -> Result<Vec<Option<Tangent>>, ProblemError> {
    let dim = body.mesh.dim();
    let fail = |key: String, message: String, help: &str| {
        ProblemError::from(scene.error(Issue::new(key, message, help)))
    };
    if dim == 1 {
        let message = "a bar has no displacement along the obstacle".into();
        return Err(fail(contact.friction_key(), message, "remove friction, or take a plate"));
    }
    for (k, obstacle) in contact.obstacles.iter().enumerate() {
        let given = obstacle.surface.as_deref();
        if given.is_some_and(|v| v.len() != dim) {
            let message = format!("has another length than positions, {dim}");
            return Err(fail(contact.key(k, "surface"), message, "give a component an axis"));
        }
        let slides = given.is_some_and(|v| v.iter().any(|v| *v != 0.0));
        if dim == 3 && obstacle.coefficient().is_some() && !slides {
            let message = "in space a point that sticks may slip in any direction, which is not piecewise linear: friction there is that of a surface that slides faster than the body vibrates";
            let help = "give surface = [0, 0.5, 0], the velocity of the obstacle along itself, remove friction, or take a body in the plane";
            return Err(fail(contact.key(k, "friction"), message.into(), help));
        }
    }
    let tangent = |i: usize| -> Result<Option<Tangent>, ProblemError> {
        let point = &body.dofs.contact[i];
        let k = point.group;
        let obstacle: &Obstacle = &contact.obstacles[k];
        let Some(coefficient) = obstacle.coefficient() else { return Ok(None) };
        let given = obstacle.surface.as_deref().unwrap_or_default();
        let velocity: Point = std::array::from_fn(|c| given.get(c).copied().unwrap_or(0.0));
        let across = dot(&velocity, &point.direction);
        if across.abs() > ACROSS * dot(&velocity, &velocity).sqrt() {
            let place = super::places::place(body.mesh.nodes()[point.node], dim);
            let message = format!(
                "moves into the body, or off it, at {place}: by {across:e} along its normal"
            );
            let help = "give a velocity along the surface of the obstacle: one vector is that of a flat one; where bodies meet, of a flat slave";
            return Err(scene.error(Issue::new(contact.key(k, "surface"), message, help)).into());
        }
        let [nx, ny, _] = point.direction;
        let direction: Point = match dim {
            2 => [-ny, nx, 0.0],
            _ => velocity.map(|v| v / dot(&velocity, &velocity).sqrt()),
        };
        let surface = dot(&velocity, &direction);
        let only_slips = dim == 3;
        // in the plane the tangent is an axis of the node; in space what supports leave free of it
        let least = if only_slips { ACROSS } else { 0.5 };
        let along = |(row, place): (Point, Option<usize>)| {
            let c = dot(&row, &direction);
            let entry = place.filter(|i| *i < body.dofs.n_o && c.abs() > least)?;
            Some((entry, if only_slips { c } else { c.signum() }))
        };
        let axes: Vec<Point> = body.dofs.directions(point.node).map(|d| d.0).collect();
        let is_skew = |(k, a): (usize, &Point)| axes[..k].iter().any(|b| dot(a, b).abs() > ACROSS);
        // before two obstacles at once no displacement along one of them is left free by itself
        if axes.iter().enumerate().any(is_skew) {
            return Ok(None);
        }
        let anchor = anchor(body, scene, i);
        if anchor.is_some() {
            let row = vec![];
            return Ok(Some(Tangent { row, anchor, coefficient, surface, direction, only_slips }));
        }
        let mut row: Vec<(usize, f64)> =
            body.dofs.directions(point.node).filter_map(along).collect();
        if !row.is_empty() {
            against_masters(body, (i, &direction), &mut row);
        }
        let tangent = Tangent { row, anchor, coefficient, surface, direction, only_slips };
        Ok((!tangent.row.is_empty()).then_some(tangent))
    };
    (0..body.dofs.n_facing).map(tangent).collect()
}

/// Where a contact point has no mass along its obstacle: which displacement that is; what it remembers stands before what springs of sliders do, the last entries of `u_O`.
pub(super) fn anchor(body: &Body, scene: &Scene, point: usize) -> Option<Anchor> {
    let all = &body.dofs.tangents;
    let place = all.iter().position(|t| t.1 == point)?;
    let elastic = scene.all_sliders().iter().filter(|s| s.stiffness.is_some()).count();
    let memory = body.dofs.n_o - elastic - all.len() + place;
    Some(Anchor { displacement: all[place].0, memory })
}

/// Where two surfaces meet, what slips is `t·(u_s − Σ_j P_ij u_m,j)`. On curved surfaces of different meshes `t` has a share of the order of `h/R` along the normals of
/// masters without inertia: it is left out.
fn against_masters(body: &Body, (point, t): (usize, &Point), row: &mut Vec<(usize, f64)>) {
    let dofs = &body.dofs;
    let mut all: BTreeMap<usize, f64> = row.iter().copied().collect();
    for (node, p) in dofs.against(point) {
        for c in (0..dofs.dim).filter(|&c| t[c] != 0.0) {
            for (entry, share) in dofs.terms(*node, c).filter(|e| e.0 < dofs.n_o) {
                *all.entry(entry).or_insert(0.0) -= p * t[c] * share;
            }
        }
    }
    *row = all.into_iter().filter(|e| e.1.abs() > ROUNDING).collect();
}

/// What friction does not go with, and what there is to say of it.
pub(super) fn check(scene: &Scene, system: &System, notes: &mut Notes) -> Result<(), ProblemError> {
    let fail = |key: String, message: &str, help: &str| {
        Err(scene.error(Issue::new(key, message, help)).into())
    };
    let facing = system.facing();
    let rubbing = |t: &[Option<Tangent>]| t.iter().take(facing.len()).flatten().count();
    let rubbing = system.tangents().map_or(0, rubbing);
    let asked = |c: &&Constraint| {
        let obstacle = scene.contact.as_ref().and_then(|all| all.obstacles.get(c.group));
        obstacle.is_some_and(|o| o.coefficient().is_some())
    };
    let wanted = facing.iter().filter(asked).count();
    if wanted > rubbing {
        notes.warnings.push(format!(
            "friction does not act at {} of {} contact points: supports or other obstacles hold them along the surface",
            wanted - rubbing,
            facing.len()
        ));
    }
    if system.tangents().is_none() {
        return Ok(());
    }
    let is_static = scene.run.as_ref().is_some_and(|r| r.quasistatic);
    if is_static && system.tangents().is_some_and(|t| t.iter().flatten().any(|t| t.only_slips)) {
        let message =
            "in space is that of a surface which slides: a run without inertia decides what sticks";
        let help = "remove quasistatic, or take a body in the plane";
        return fail(scene.friction_key(), message, help);
    }
    if system.creeps() {
        check_massless(scene, system)?;
    }
    let loads = &system.loads;
    if loads.carried.moves_supports() {
        let message = "the body is seen from what moves, and friction knows velocities along obstacles at rest or of constant velocity only";
        let moves = scene.contact.as_ref().is_some_and(|c| c.motion.is_some());
        let key = if moves { "contact.motion" } else { "support" };
        return fail(key.into(), message, "remove the motion, or friction and sliders");
    }
    if scene.body.damping_matrix.is_some() {
        let message =
            "is a matrix, and friction goes with damping in proportion to mass and stiffness";
        return fail(
            "body.damping_matrix".into(),
            message,
            "give [damping], or remove friction and sliders",
        );
    }
    if system.damping.is_none_or(|d| d.beta == 0.0)
        && system.tangents().is_some_and(|t| t.iter().flatten().any(|t| t.surface != 0.0))
    {
        notes.warnings.push(
            "the surface slides and nothing damps in proportion to the stiffness: unstable modes of sliding are the more the finer the mesh"
                .into(),
        );
    }
    Ok(())
}

/// Where displacements along obstacles have no mass, loads that change in time act on what these follow in the open body, `f_O + A_∅ᵀ f_C`: slips would follow their rates.
pub(super) fn move_loads(system: &mut System, notes: &mut Notes) {
    if !system.creeps() {
        return;
    }
    let (n, n_o) = (system.n(), system.n_o());
    let open = system.open_phase();
    let mut moved = 0;
    let mut condense = |force: &mut Vec<f64>| {
        if force[n_o..].iter().any(|f| *f != 0.0) {
            *force = open.reduce(force);
            force.resize(n, 0.0);
            moved += 1;
        }
    };
    let loads = system.loads_mut();
    loads.harmonics.iter_mut().for_each(|h| condense(&mut h.force));
    loads.measured.iter_mut().for_each(|m| condense(&mut m.force));
    if moved > 0 {
        notes.warnings.push(
            "a load that changes in time acts on contact nodes, which have no mass (tangent = \"massless\"): it acts on the displacements that these follow in the open body"
                .into(),
        );
    }
}

/// What displacements without mass along obstacles do not go with, and the bound of their coefficients.
fn check_massless(scene: &Scene, system: &System) -> Result<(), ProblemError> {
    let key = scene.contact.as_ref().map_or(String::new(), |c| c.key(0, "tangent"));
    let fail =
        |message: &str, help: &str| Err(scene.error(Issue::new(key.clone(), message, help)).into());
    let keep = "give tangent = \"inertia\"";
    if !system.friction_is_surely_unique()
        && let Some((bound, points)) = system.critical_friction()
    {
        let tangents = points.iter().filter_map(|i| Some((i, system.tangents()?[*i].as_ref()?)));
        let most = tangents.max_by(|a, b| a.1.coefficient.total_cmp(&b.1.coefficient));
        if let Some((point, tangent)) = most.filter(|(_, t)| t.coefficient >= bound) {
            let node = system.constraints[*point].node;
            let message = format!(
                "\"massless\" has one motion from every state below a friction of {bound:.4} on this mesh, and {} near node {node} is beyond: several would go on, or none",
                tangent.coefficient
            );
            let help = format!(
                "{keep}, which has one for every coefficient, or mesh with elements that are shorter along the normal"
            );
            return fail(&message, &help);
        }
    }
    Ok(())
}
