//! Whether linear elements are too stiff for the modes of a body, without another solution.
//!
//! ```text
//! η = 1 − φᵀK_iφ / φᵀKφ = Σ_e r_eᵀ H_e⁻¹ r_e / φᵀKφ        the share of incompatible modes in the stiffness
//! ω √(1 − η)                                                the frequency without it
//! ```
//!
//! of elements of four or eight corners: `r_e`, `H_e` of [`crate::fem::Shape::energy_and_relief`]. Of beams of one to four elements through the thickness the lower frequency is right to a percent.
//! Of linear triangles and tetrahedra it is what functions of their edges take off, which they lack ([`crate::fem::Edges`]): a part of it.

use super::{ContactError, System, phase_modes};
use crate::fem::{Body, Edges, Shape};
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
    let all_are = |family: Family| {
        let suits = |kind: crate::mesh::ElementKind| {
            kind.family() == family && kind.basis() == Basis::Linear && kind.dim() > 1
        };
        body.mesh.elements().all(|e| suits(e.kind))
    };
    let (cubes, simplices) = (all_are(Family::Cube), all_are(Family::Simplex));
    if !(cubes || simplices)
        || materials.is_empty()
        || materials.iter().any(crate::fem::Material::is_radial)
        || system.n_o() > MOST
        || system.impact().is_some()
    {
        return Ok(vec![]);
    }
    let rigid = body.rigid_motions(false).len();
    let modes = phase_modes(system, &system.open_phase(), (rigid + MODES).min(system.n_o()))?;
    let phase = system.open_phase();
    let edges = simplices.then(|| Edges::new(body));
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
        let [energy, relief] = match &edges {
            Some(edges) => edges.relief(&field, *omega),
            None => incompatible(body, &field),
        };
        if energy > 0.0 {
            all.push((*omega, relief / energy));
        }
    }
    Ok(all)
}

/// Energy of a field, twice, and what incompatible modes take off it.
fn incompatible(body: &Body, field: &[f64]) -> [f64; 2] {
    let dim = body.mesh.dim();
    let mut sum = [0.0; 2];
    for e in body.mesh.elements() {
        let x = body.mesh.corners(e);
        let shape = Shape { kind: e.kind, x: &x };
        let own: Vec<f64> =
            e.nodes.iter().flat_map(|n| field[dim * n..dim * (n + 1)].to_vec()).collect();
        let [energy, relief] = shape.energy_and_relief(&body.materials()[e.region], &own);
        sum[0] += energy;
        sum[1] += relief;
    }
    sum
}
