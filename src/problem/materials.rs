//! The materials that a scene names.

use crate::fem::{Material, StressState};
use crate::scenario::{BodyKind, MaterialTable, Scene, State};

/// The materials of a scene, in the order of the regions of its mesh; a body of given matrices has none.
pub fn materials(scene: &Scene) -> Vec<Material> {
    let body = &scene.body;
    let thickness = body.thickness.unwrap_or(1.0);
    let state = match body.state {
        Some(State::PlaneStrain) => StressState::PlaneStrain { thickness },
        Some(State::Axisymmetric) => StressState::Axisymmetric,
        None if scene.dim() == 3 => StressState::Solid,
        Some(State::PlaneStress) | None => StressState::PlaneStress { thickness },
    };
    let own = |young, density| match body.kind {
        BodyKind::Bar => Some(Material::bar(young, density, body.area.unwrap_or(1.0))),
        BodyKind::Plate => {
            Some(Material::plate(young, body.poisson.unwrap_or(0.0), density, thickness))
        }
        BodyKind::Mesh | BodyKind::Matrices => None,
    };
    let own = body.young.zip(body.density).and_then(|(young, density)| own(young, density));
    let of_table = |m: &MaterialTable| {
        let &MaterialTable { young, poisson, density, .. } = m;
        Material { young, poisson, density, state }
    };
    own.into_iter().chain(scene.materials.iter().map(of_table)).collect()
}
