//! The loads of a scene.

use super::ProblemError;
use super::damping::modal_damping;
use super::elements;
use super::modes::OpenModes;
use super::moving;
use super::notes::{self, Notes};
use super::places::placed;
use super::swinging;
use super::table::history;
use crate::contact::{System, grazing_scale};
use crate::fem::{Course, Loads, load};
use crate::scenario::{Amplitude, BodyKind, Issue, Load, LoadKind, Scene};

pub(super) fn loads(
    scene: &Scene,
    system: &System,
    modes: &OpenModes,
    notes: &mut Notes,
) -> Result<Loads, ProblemError> {
    let body = &system.body;
    let mut loads = Loads::default();
    for (i, l) in scene.loads.iter().enumerate() {
        let Load { kind, amplitude, .. } = l;
        let vector = match amplitude {
            Some(Amplitude::Scalar(a)) => vec![*a],
            Some(Amplitude::Vector(v)) => v.clone(),
            None => vec![peak_amplitude(scene, i, system, modes)?],
        };
        let course = course(scene, i)?;
        let mut node = 0;
        let force = match kind {
            LoadKind::Base => {
                moving::base(scene, system, (i, &vector), &course, &mut loads)?;
                continue;
            }
            LoadKind::Gravity => system.gravity(&vector),
            LoadKind::Traction => load::traction(body, l.group(), &vector),
            LoadKind::Point => {
                let placed = placed(scene, &body.mesh, &format!("load[{i}].at"), l.at.as_deref())?;
                node = placed.node;
                notes.places.push(placed);
                if body.dofs.contact.iter().any(|c| c.node == node) {
                    notes.warnings.push(format!(
                        "load[{i}] is a force at a contact node: its contact force and what moves there change with every refinement; let a traction act, or another node"
                    ));
                }
                load::point(body, node, &vector)
            }
            LoadKind::Force => on_rows(scene, i, system, &vector)?,
            LoadKind::Mode => {
                let key = format!("load[{i}].mode");
                let (_, shape) = modes.get(scene, &key, l.mode.unwrap_or(1), system)?;
                let mut force = vec![0.0; system.n()];
                system.mass().mul(&shape, &mut force);
                force.iter_mut().for_each(|f| *f *= vector[0]);
                force
            }
        };
        if matches!(course, Course::Measured(_))
            && !scene.run.as_ref().is_some_and(|r| r.quasistatic)
            && scene.contact.as_ref().is_some_and(|c| c.is_reaction())
            && force[system.n_o()..].iter().any(|f| *f != 0.0)
        {
            let message = "acts on contact displacements, whose pressures are nodal reactions: they would follow it at once";
            let help = "let it act elsewhere, or give method = \"nbm\" with the stress of the displacement field";
            return Err(scene.error(Issue::new(format!("load[{i}].table"), message, help)).into());
        }
        let of = |a: &[f64]| notes::of_components(system, (*kind, l.group(), node), a);
        if scene.body.kind != BodyKind::Matrices && of(&vector).is_some() {
            notes.held_load((i, *kind), (&vector, &force), |a| of(a).unwrap_or_default());
        }
        if let Course::Harmonic { omega, .. } = course {
            notes.unresolved(&format!("load[{i}].omega"), body, omega);
        }
        loads.follow(force, 0, &course);
    }
    elements::preload(scene, system, &mut loads)?;
    moving::obstacle(scene, system, &mut loads)?;
    swinging::gaps(scene, system, &mut loads)?;
    Ok(loads)
}

/// Forces on the rows of given matrices.
fn on_rows(
    scene: &Scene,
    i: usize,
    system: &System,
    vector: &[f64],
) -> Result<Vec<f64>, ProblemError> {
    let (n, dofs) = (system.n_displacements(), &system.body.dofs);
    let mut rows = vec![0.0; n];
    // forces along the axes of the files
    let mut add = |row: usize, force: f64| {
        scene.rows.terms(row).into_iter().for_each(|(j, w)| rows[j] += w * force);
    };
    match scene.loads[i].displacement {
        Some(row) if row < n => add(row, vector[0]),
        Some(row) => {
            let message = format!("{row} is no row of the matrices");
            let help = format!("give rows from 0 to {}", n - 1);
            let key = format!("load[{i}].displacement");
            return Err(scene.error(Issue::new(key, message, help)).into());
        }
        None if vector.len() == n => vector.iter().enumerate().for_each(|(row, f)| add(row, *f)),
        None => {
            let message = format!("{} numbers for {n} displacements", vector.len());
            let help = "give one number a row, or one number and displacement = 0";
            let key = format!("load[{i}].amplitude");
            return Err(scene.error(Issue::new(key, message, help)).into());
        }
    }
    let mut force = dofs.gather_forces(&rows);
    force.resize(system.n(), 0.0);
    Ok(force)
}

/// What a load does in time.
pub(super) fn course(scene: &Scene, i: usize) -> Result<Course, ProblemError> {
    let l = &scene.loads[i];
    Ok(match (&l.table, l.omega) {
        (Some(name), _) => Course::Measured(history(scene, i, name)?.into()),
        (None, Some(omega)) => Course::Harmonic { omega, phase: l.phase },
        (None, None) => Course::Constant,
    })
}

/// The amplitude `F` of a load `F M A*φ cos ωt` whose linear response at `ω`, `F / (2ξω²)`, is `peak` times the modal amplitude that
/// grazes the obstacle.
pub(super) fn peak_amplitude(
    scene: &Scene,
    i: usize,
    system: &System,
    modes: &OpenModes,
) -> Result<f64, ProblemError> {
    let l = &scene.loads[i];
    let mode = l.mode.unwrap_or(1);
    let (omega, shape) = modes.get(scene, &format!("load[{i}].mode"), mode, system)?;
    let damping = modal_damping(scene, system, mode, omega);
    let grazing = grazing_scale(system, &shape).ok_or_else(|| {
        let message = format!("mode {mode} never reaches the obstacle");
        let help = "choose a mode that moves the contact edge, or give amplitude";
        scene.error(Issue::new(format!("load[{i}].peak"), message, help))
    })?;
    if system.facing().iter().any(|c| c.gap <= 0.0) {
        let help = "give amplitude, or a positive gap";
        let message = "counts in grazing amplitudes, and the gap is not positive everywhere";
        return Err(scene.error(Issue::new(format!("load[{i}].peak"), message, help)).into());
    }
    Ok(l.peak.unwrap_or(0.0) * damping * omega * grazing)
}
