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
use crate::fem::{Course, Loads};
use crate::scenario::{Axis, Issue, Scene};

/// The load of a support that moves.
pub(super) fn base(
    scene: &Scene,
    system: &System,
    (i, amplitude): (usize, &[f64]),
    course: &Course,
    loads: &mut Loads,
) -> Result<(), ProblemError> {
    let body = &system.body;
    let (mesh, dim) = (&body.mesh, body.mesh.dim());
    let Some(edge) = scene.loads[i].edge else { return Ok(()) };
    let mut field = vec![0.0; dim * mesh.n_nodes()];
    for (c, a) in amplitude.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        let axis = [Axis::X, Axis::Y][c];
        if !scene.supports.iter().any(|s| s.edge == edge && s.fix.contains(&axis)) {
            let name = ["x", "y"][c];
            let message = format!(
                "moves the {name} displacement of \"{}\", which no support holds",
                edge.name()
            );
            let help = format!(
                "add [[support]] with edge = \"{}\", fix = [\"{name}\"], or give 0 for it",
                edge.name()
            );
            return Err(scene
                .error(Issue::new(format!("load[{i}].amplitude"), message, help))
                .into());
        }
        mesh.group_nodes(edge.name()).into_iter().for_each(|n| field[dim * n + c] = *a);
    }
    if body.moves_supports_at_contact(&field) {
        let message = "moves a support that the contact stress of an element reads";
        let help = "put a row of elements between the support and the contact edge, or move another support";
        return Err(scene.error(Issue::new(format!("load[{i}].edge"), message, help)).into());
    }
    let forces = body.forces_of_field(&field);
    follow(system, &forces, -1.0, course, loads);
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

/// The unit motion along the outward normal of the contact edge, as a nodal field; on prescribed displacements alone where `of_supports`.
fn along_normal(system: &System, of_supports: bool) -> Vec<f64> {
    let (mesh, dofs) = (&system.body.mesh, &system.body.dofs);
    let (dim, axis) = (mesh.dim(), dofs.contact_axis);
    let mut field = vec![0.0; dim * mesh.n_nodes()];
    for n in 0..mesh.n_nodes() {
        if !of_supports || dofs.of(n, axis).is_none() {
            field[dim * n + axis] = dofs.contact_sign;
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
    let field = along_normal(system, true);
    if body.moves_supports_at_contact(&field) {
        let message = "a support along the normal belongs to an element at the contact: the contact stress reads it";
        let help = "put a row of elements between the support and the contact edge";
        return Err(scene.error(Issue::new("contact.motion", message, help)).into());
    }
    let course = Course::Harmonic { omega: motion.omega, phase: motion.phase };
    let scaled = |x: Vec<f64>| x.into_iter().map(|x| motion.amplitude * x).collect::<Vec<f64>>();
    // supports that stay where they are move by −n m in this frame
    let forces = body.forces_of_field(&field).map(scaled);
    follow(system, &forces, 1.0, &course, loads);
    // the inertia of the frame, on the mass of the method
    let mut normal = vec![0.0; body.mesh.dim()];
    normal[body.dofs.contact_axis] = body.dofs.contact_sign;
    let inertia = scaled(system.gravity(&normal));
    let alpha = system.damping.map_or(0.0, |d| d.alpha);
    let of = |x: f64| inertia.iter().map(|f| -x * f).collect();
    loads.follow(of(1.0), 2, &course);
    loads.follow(of(alpha), 1, &course);
    Ok(())
}

/// What a state of the scene is, seen from the obstacle: displacements and velocities along the normal to take away at `t = 0`.
pub(super) fn frame(scene: &Scene, system: &System) -> Option<[Vec<f64>; 2]> {
    let motion = scene.contact.as_ref()?.motion?;
    let unit = system.body.dofs.gather(&along_normal(system, false));
    let (sin, cos) = motion.phase.sin_cos();
    let of = |x: f64| unit.iter().map(|u| motion.amplitude * x * u).collect();
    Some([of(cos), of(-motion.omega * sin)])
}
