//! The materials that a scene names.

use crate::fem::{Material, StressState};
use crate::scenario::{Body, BodyKind, MaterialTable, Scene, State};

/// The materials of a scene, in the order of the regions of its mesh: those of bars and plates, then the tables; a body of given matrices has none.
pub fn materials(scene: &Scene) -> Vec<Material> {
    let thickness = |b: &Body| b.thickness.unwrap_or(1.0);
    let state = |b: &Body| match b.state {
        Some(State::PlaneStrain) => StressState::PlaneStrain { thickness: thickness(b) },
        Some(State::Axisymmetric) => StressState::Axisymmetric,
        None if scene.dim() == 3 => StressState::Solid,
        Some(State::PlaneStress) | None => StressState::PlaneStress { thickness: thickness(b) },
    };
    let own = |b: &Body| {
        let (young, density) = b.young.zip(b.density)?;
        match b.kind {
            BodyKind::Bar => Some(Material::bar(young, density, b.area.unwrap_or(1.0))),
            BodyKind::Plate => {
                Some(Material::plate(young, b.poisson.unwrap_or(0.0), density, thickness(b)))
            }
            BodyKind::Mesh | BodyKind::Matrices | BodyKind::Parts => None,
        }
    };
    let of_table = |m: &MaterialTable| {
        let &MaterialTable { young, poisson, density, .. } = m;
        let owner = scene.owner(m).map_or(&scene.body, |o| o.0);
        Material { young, poisson, density, state: state(owner) }
    };
    let generated = scene.bodies().into_iter().filter_map(|(_, b)| own(b));
    generated.chain(scene.materials.iter().map(of_table)).collect()
}

/// Number of bodies that are generated: their materials come before those of the tables.
pub(super) fn generated(scene: &Scene) -> usize {
    scene.bodies().iter().filter(|(_, b)| is_generated(b)).count()
}

fn is_generated(body: &Body) -> bool {
    matches!(body.kind, BodyKind::Bar | BodyKind::Plate)
}

/// What a scene calls the body whose cells are in a region: `body`, or of several `body[k]`.
pub(super) fn body_key(scene: &Scene, region: usize) -> String {
    let bodies = scene.bodies();
    let table = region.checked_sub(generated(scene)).and_then(|i| scene.materials.get(i));
    let own = match table.and_then(|m| scene.owner(m)) {
        Some((owner, _)) => bodies.iter().find(|(_, b)| std::ptr::eq(*b, owner)),
        None => bodies.iter().filter(|(_, b)| is_generated(b)).nth(region),
    };
    own.map_or_else(|| "body".to_owned(), |(key, _)| key.clone())
}
