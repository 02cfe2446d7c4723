//! Whether elements of four or eight corners are too stiff for the modes of a body, without another solution.
//!
//! ```text
//! η = 1 − φᵀK_iφ / φᵀKφ = Σ_e r_eᵀ H_e⁻¹ r_e / φᵀKφ        the share of incompatible modes in the stiffness
//! ω √(1 − η)                                                the frequency without it
//! ```
//!
//! `r_e`, `H_e`: [`crate::fem::Shape::energy_and_relief`]. Of beams of one to four elements through the thickness the lower frequency is right to a percent.

use super::{ContactError, System, phase_modes};
use crate::fem::Shape;
use crate::mesh::{Basis, Family};

/// Bodies of more unknowns are not asked: three modes of them are no look by the way.
const MOST: usize = 40_000;
/// Modes that are asked for.
const MODES: usize = 3;
/// Shares of the stiffness below this are rigid motions.
const RIGID: f64 = 1e-9;

/// Circular frequency and `η` of the lowest modes of the open body; none of other bodies: rings, those with elements of other families or of second order.
pub fn relief(system: &System) -> Result<Vec<(f64, f64)>, ContactError> {
    let body = &system.body;
    let materials = body.materials();
    let suits = |kind: crate::mesh::ElementKind| {
        kind.family() == Family::Cube && kind.basis() == Basis::Linear && kind.dim() > 1
    };
    if materials.is_empty()
        || materials.iter().any(crate::fem::Material::is_radial)
        || body.mesh.elements().any(|e| !suits(e.kind))
        || system.n_o() > MOST
        || system.impact().is_some()
    {
        return Ok(vec![]);
    }
    let rigid = body.rigid_motions(false).len();
    let modes = phase_modes(system, &system.open_phase(), (rigid + MODES).min(system.n_o()))?;
    let dim = body.mesh.dim();
    let phase = system.open_phase();
    let highest = modes.omega.last().copied().unwrap_or(0.0);
    let mut u = vec![0.0; system.n()];
    let mut all = vec![];
    for (omega, shape) in modes.omega.iter().zip(&modes.shapes) {
        if *omega <= RIGID * highest {
            continue;
        }
        phase.expand(shape, &mut u);
        // of a reduced body that of its mesh
        let field = body.nodal_dofs().scatter(&body.nodal(&u));
        let mut sum = [0.0; 2];
        for e in body.mesh.elements() {
            let x = body.mesh.corners(e);
            let own: Vec<f64> =
                e.nodes.iter().flat_map(|n| field[dim * n..dim * (n + 1)].to_vec()).collect();
            let shape = Shape { kind: e.kind, x: &x };
            let [energy, relief] = shape.energy_and_relief(&materials[e.region], &own);
            sum[0] += energy;
            sum[1] += relief;
        }
        if sum[0] > 0.0 {
            all.push((*omega, sum[1] / sum[0]));
        }
    }
    Ok(all)
}
