//! Supports and obstacles that move.
//!
//! A support that moves as `a s(t)` acts on the free displacements by what it has in common with them:
//!
//! ```text
//! M ü + C u̇ + K u = f − (K_fp s + C_fp ṡ + M_fp s̈) a
//! ```
//!
//! A moving obstacle is seen from the obstacle: `u = ũ + n m(t)` with the normal `n` on all nodes, so that the gap of `ũ` is constant, the supports
//! along `n` move by `−m`, and the inertia of the moving frame acts on the body:
//!
//! ```text
//! M ũ¨ + C ũ˙ + K ũ = f + K_fp n m + M_fp n m̈ − M n m̈ + …
//! ```

use super::ProblemError;
use crate::contact::System;
use crate::fem::formats::DofName;
use crate::fem::{Body, ContactPoint, Course, Loads};
use crate::mesh::Point;
use crate::scenario::{BodyKind, Direction, Issue, Scene, Support};

/// The nodes that move with the supports on a group: all of it, or what of it supports hold that hold a part.
fn nodes(scene: &Scene, body: &Body, group: &str) -> Vec<usize> {
    let parts = scene.supports.iter().filter(|s| s.part().is_some_and(|(whole, _)| whole == group));
    let mut nodes: Vec<usize> = parts.flat_map(|s| body.mesh.group_nodes(s.group())).collect();
    if nodes.is_empty() || scene.supports.iter().any(|s| s.group() == group) {
        return body.mesh.group_nodes(group);
    }
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// The supports on a group move by a vector, as a nodal field.
pub(super) fn field(scene: &Scene, body: &Body, group: &str, by: &[f64]) -> Vec<f64> {
    let (mesh, dim) = (&body.mesh, body.mesh.dim());
    let mut field = vec![0.0; dim * mesh.n_nodes()];
    if scene.body.kind == BodyKind::Matrices {
        for (place, (k, name)) in scene.rows.held_rows().enumerate() {
            if scene.rows.is_support(k, group) {
                let along = usize::from(name.direction).checked_sub(1).and_then(|c| by.get(c));
                field[body.dofs.n_rows() + place] = along.copied().unwrap_or(0.0);
            }
        }
        return field;
    }
    for n in nodes(scene, body, group) {
        field[dim * n..dim * (n + 1)].copy_from_slice(&by[..dim]);
    }
    field
}

/// The load of a support that moves.
pub(super) fn base(
    scene: &Scene,
    system: &System,
    (i, amplitude): (usize, &[f64]),
    course: &Course,
    loads: &mut Loads,
) -> Result<(), ProblemError> {
    let body = &system.body;
    if scene.body.kind == BodyKind::Matrices {
        return base_of_rows(scene, system, (i, amplitude), course, loads);
    }
    let dim = body.mesh.dim();
    let group = scene.loads[i].group();
    for (c, _) in amplitude.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        let axis = Direction::AXES[c];
        let holds = |s: &Support| {
            let is_on_it = s.group() == group || s.part().is_some_and(|(whole, _)| whole == group);
            is_on_it && (s.fix.contains(&axis) || s.fix.contains(&Direction::Normal))
        };
        if !scene.supports.iter().any(holds) {
            let name = ["x", "y", "z"][c];
            let message =
                format!("moves the {name} displacement of \"{group}\", which no support holds");
            let help = format!(
                "add [[support]] with {} = \"{group}\", fix = [\"{name}\"], or give 0 for it",
                scene.body.kind.side_key()
            );
            return Err(scene
                .error(Issue::new(format!("load[{i}].amplitude"), message, help))
                .into());
        }
    }
    let field = field(scene, body, group, amplitude);
    // a support along the normal moves along it
    let size = amplitude.iter().fold(0.0f64, |m, a| m.hypot(*a));
    let slides = |n: usize| {
        let own = &field[dim * n..dim * (n + 1)];
        let free = body.dofs.directions(n).filter(|d| d.1.is_some());
        free.map(|(d, _)| own.iter().zip(d).map(|(w, d)| w * d).sum::<f64>())
            .any(|along| along.abs() > 1e-9 * size)
    };
    if nodes(scene, body, group).into_iter().any(slides) {
        let message = format!("moves \"{group}\" along a direction that no support holds");
        let help = "give a motion along the held directions";
        return Err(scene.error(Issue::new(format!("load[{i}].amplitude"), message, help)).into());
    }
    if body.moves_supports_at_contact(&field) {
        let message = "moves a support that the contact stress of an element reads";
        let help = "put a row of elements between the support and the contact edge, or move another support";
        return Err(scene.error(Issue::new(format!("load[{i}].edge"), message, help)).into());
    }
    carry(system, field, course, loads);
    Ok(())
}

/// Supports move along a field.
fn carry(system: &System, field: Vec<f64>, course: &Course, loads: &mut Loads) {
    let forces = system.body.forces_of_field(&field);
    follow(system, &forces, -1.0, course, loads);
    loads.carried.push(&system.body, field, forces, course);
}

/// The load of supports of given matrices that move.
fn base_of_rows(
    scene: &Scene,
    system: &System,
    (i, amplitude): (usize, &[f64]),
    course: &Course,
    loads: &mut Loads,
) -> Result<(), ProblemError> {
    let group = scene.loads[i].group();
    let fail = |message: String, help: &str| {
        Err(scene.error(Issue::new(format!("load[{i}].amplitude"), message, help)).into())
    };
    for (c, _) in amplitude.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        let holds = |(k, name): (usize, &DofName)| {
            scene.rows.is_support(k, group) && usize::from(name.direction) == c + 1
        };
        if !scene.rows.held_rows().any(holds) {
            let axis = ["x", "y", "z"][c];
            let message =
                format!("moves along {axis}, and no support that moves holds a row there");
            return fail(message, &format!("add \"{axis}\" to fix, or give 0 for it"));
        }
    }
    let contact = scene.contact.as_ref();
    if contact.is_some_and(|c| !c.is_reaction() && !c.moves_contact()) {
        let message =
            "moves supports, whose displacements the contact stress of rows does not know"
                .to_owned();
        return fail(message, "give stress = \"reaction\", or method = \"mass-redistribution\"");
    }
    carry(system, field(scene, &system.body, group, amplitude), course, loads);
    Ok(())
}

/// `sign (K w s + C w ṡ + M w s̈)` of the forces `[K w, M w]`.
fn follow(system: &System, [k, m]: &[Vec<f64>; 2], sign: f64, course: &Course, loads: &mut Loads) {
    let (alpha, beta) = system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
    let of = |x: f64, y: f64| k.iter().zip(m).map(|(k, m)| sign * (x * k + y * m)).collect();
    loads.follow(of(1.0, 0.0), 0, course);
    loads.follow(of(beta, alpha), 1, course);
    loads.follow(of(0.0, 1.0), 2, course);
}

/// The direction along which obstacles move: that of all contact points.
fn direction(system: &System) -> Option<Point> {
    let first = system.body.dofs.contact.first()?.direction;
    let same = |c: &ContactPoint| (0..3).all(|k| (c.direction[k] - first[k]).abs() <= 1e-9);
    system.body.dofs.contact.iter().all(same).then_some(first)
}

/// The unit motion along a direction as a nodal field; what supports hold of it where `of_supports`.
fn along(system: &System, direction: Point, of_supports: bool) -> Vec<f64> {
    let (mesh, dofs) = (&system.body.mesh, &system.body.dofs);
    let dim = mesh.dim();
    let mut field = vec![0.0; dim * mesh.n_nodes()];
    for n in 0..mesh.n_nodes() {
        let own = &mut field[dim * n..dim * (n + 1)];
        if !of_supports {
            own.copy_from_slice(&direction[..dim]);
            continue;
        }
        for (held, _) in dofs.directions(n).filter(|d| d.1.is_none()) {
            let share: f64 = held.iter().zip(&direction).map(|(h, d)| h * d).sum();
            own.iter_mut().zip(&held).for_each(|(x, h)| *x += share * h);
        }
    }
    field
}

/// The loads of an obstacle that moves, seen from the obstacle.
pub(super) fn obstacle(
    scene: &Scene,
    system: &System,
    loads: &mut Loads,
) -> Result<(), ProblemError> {
    let Some(motion) = scene.contact.as_ref().and_then(|c| c.motion) else { return Ok(()) };
    let body = &system.body;
    let Some(direction) = direction(system) else {
        let message =
            "moves along the direction of the contact, and the contact points have several";
        let help = "give plane = { normal = […], offset = … } in place of gap";
        return Err(scene.error(Issue::new("contact.motion", message, help)).into());
    };
    let field = along(system, direction, true);
    if body.moves_supports_at_contact(&field) {
        let message = "a support along the normal belongs to an element at the contact: the contact stress reads it";
        let help = "put a row of elements between the support and the contact edge";
        return Err(scene.error(Issue::new("contact.motion", message, help)).into());
    }
    let course = Course::Harmonic { omega: motion.omega, phase: motion.phase };
    let times = |by: f64| move |x: Vec<f64>| x.into_iter().map(|x| by * x).collect::<Vec<f64>>();
    // supports that stay where they are move by −n m in this frame
    let forces = body.forces_of_field(&field).map(times(motion.amplitude));
    follow(system, &forces, 1.0, &course, loads);
    if field.iter().any(|w| *w != 0.0) {
        let field = times(-motion.amplitude)(field);
        loads.carried.push(body, field, forces.map(times(-1.0)), &course);
    }
    // the inertia of the frame, on the mass of the method
    let inertia = times(motion.amplitude)(system.gravity(&direction[..body.mesh.dim()]));
    let alpha = system.damping.map_or(0.0, |d| d.alpha);
    let of = |x: f64| inertia.iter().map(|f| -x * f).collect();
    loads.follow(of(1.0), 2, &course);
    loads.follow(of(alpha), 1, &course);
    Ok(())
}

/// The nodal field that supports hold at `t = 0`, or its rate, in the frame at rest.
pub(super) fn held(scene: &Scene, system: &System, order: usize) -> Vec<f64> {
    let (mesh, carried) = (&system.body.mesh, &system.loads.carried);
    let mut field = vec![0.0; mesh.dim() * mesh.n_nodes()];
    carried.add_field(0.0, order as u32, &mut field);
    // those that stay where they are move in the obstacle's frame
    let motion = scene.contact.as_ref().and_then(|c| c.motion);
    if let Some((motion, direction)) = motion.zip(direction(system)) {
        let course = Course::Harmonic { omega: motion.omega, phase: motion.phase };
        let m = motion.amplitude * course.at(0.0, order as u32);
        let unit = along(system, direction, true);
        for (w, u) in field.iter_mut().zip(&unit) {
            *w += m * u;
            // what is left of two equal ones is rounding
            if w.abs() <= 1e-12 * (m * u).abs() {
                *w = 0.0;
            }
        }
    }
    field
}

/// What a state of the scene is, seen from the obstacle: displacements and velocities along the normal to take away at `t = 0`.
pub(super) fn frame(scene: &Scene, system: &System) -> Option<[Vec<f64>; 2]> {
    let carried = &system.loads.carried;
    if carried.moves_contact() {
        return Some([0, 1].map(|order| {
            let mut q = vec![0.0; system.n()];
            carried.add_contact(0.0, order, &mut q);
            q
        }));
    }
    let motion = scene.contact.as_ref()?.motion?;
    let unit = system.body.dofs.gather(&along(system, direction(system)?, false));
    let (sin, cos) = motion.phase.sin_cos();
    let of = |x: f64| unit.iter().map(|u| motion.amplitude * x * u).collect();
    Some([of(cos), of(-motion.omega * sin)])
}
