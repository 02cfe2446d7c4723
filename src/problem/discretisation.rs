//! Stress and mass of the contact method that a scene names.

use crate::contact::{MassChoice, Stress};
use crate::scenario::{ContactMethod, Inertia, RedistributedMass, Scene, StressKey};

/// Stress and mass of the contact method that a scene names.
pub(super) fn discretisation(scene: &Scene) -> (Stress, MassChoice) {
    let slides = scene.slides();
    let Some(c) = &scene.contact else {
        return match slides {
            true => (Stress::Reaction, MassChoice::Condensed),
            false => (Stress::Projection, MassChoice::Paper),
        };
    };
    // meshes have defaults of their own: those that work with every element
    let is_mesh = scene.body.kind.has_groups();
    let slides = slides || c.takes_forces() || scene.rows.superelement.is_some();
    let stress = match c.stress {
        _ if c.is_reaction() => Stress::Reaction,
        None if slides => Stress::Reaction,
        Some(StressKey::NodalMean) => Stress::NodalMean,
        None if is_mesh => Stress::NodalMean,
        _ => Stress::Projection,
    };
    let mass = match (c.method, c.inertia, c.mass) {
        (ContactMethod::MassRedistribution, _, Some(RedistributedMass::Optimal)) => {
            MassChoice::Optimal
        }
        (ContactMethod::MassRedistribution, ..) | (_, Some(Inertia::Constant), _) => {
            MassChoice::Condensed
        }
        (ContactMethod::NodalBoundary, None, _) if is_mesh || slides || c.has_friction() => {
            MassChoice::Condensed
        }
        _ => MassChoice::Paper,
    };
    (stress, mass)
}

/// Whether contact displacements lose their mass at the switches (the paper's nodal boundary method): every node that begins to touch is a corner of a branch then.
pub fn changes_mass_at_switches(scene: &Scene) -> bool {
    let is_nbm = scene.contact.as_ref().is_some_and(|c| c.method == ContactMethod::NodalBoundary);
    is_nbm && discretisation(scene).1 == MassChoice::Paper
}
