//! What the pressures of a group before an obstacle, or of a slave, come to: force and line of action.
//!
//! ```text
//! F = Σ_i A_i (−p_i n_i + τ_i t_i),   x = Σ_i A_i p_i x_i / Σ_i A_i p_i
//! ```
//!
//! the force on the body whose group it is; what it meets has the opposite one.

use super::system::System;
use crate::fem::largest;
use crate::mesh::Point;

/// A contact point as it adds to the force of its group.
#[derive(Debug, Clone, Copy)]
struct Share {
    group: usize,
    area: f64,
    normal: Point,
    tangent: Point,
    place: Point,
    /// Size of the terms of its force per displacement.
    stiffness: f64,
}

/// What is needed to add pressures up.
#[derive(Debug, Clone, Default)]
pub struct Resultants {
    /// Groups before obstacles, and slaves.
    pub names: Vec<String>,
    /// Components of a force.
    pub dim: usize,
    points: Vec<Share>,
}

impl Resultants {
    /// Of the contact of a body (of given matrices the sum over the contact displacements of each obstacle, along them); no groups where it has none, or where velocities jump and pressures are no whole.
    pub fn new(system: &System) -> Resultants {
        let dofs = system.body.nodal_dofs();
        if system.impact().is_some() {
            return Resultants::default();
        }
        let tangents = system.tangents().unwrap_or_default();
        let conditions = system.conditions();
        let share = |(i, c): (usize, &super::Constraint)| Share {
            group: c.group,
            area: c.area,
            normal: c.normal,
            tangent: tangents.get(i).and_then(|t| t.as_ref()).map_or([0.0; 3], |t| t.direction),
            place: c.position,
            stiffness: c.area * conditions.pressure_scale(conditions.points[i].0, 1.0, 0.0),
        };
        // rows of given matrices are no groups, and have directions of their own: their sum is what it is
        let last = system.facing().iter().map(|c| c.group).max();
        let names = match last.filter(|_| system.body.materials().is_empty()) {
            Some(0) => vec!["contact".into()],
            Some(last) => (0..=last).map(|k| format!("contact[{k}]")).collect(),
            None => dofs.facing.iter().map(|f| f.group.clone()).collect(),
        };
        Resultants {
            names,
            dim: system.body.mesh.dim(),
            points: system.facing().iter().enumerate().map(share).collect(),
        }
    }

    /// Force and place of each group at the displacements `u`, one behind the other; a group without pressure (below 1e-12 of the terms that make it up: at
    /// switches rounding errors are all that is left) has no place: not a number.
    pub fn of(&self, pressure: &[f64], traction: &[f64], u: &[f64]) -> [Vec<f64>; 2] {
        let size = largest(u);
        let (dim, count) = (self.dim, self.names.len());
        let (mut force, mut place) = (vec![0.0; dim * count], vec![0.0; dim * count]);
        let (mut sum, mut least) = (vec![0.0; count], vec![0.0; count]);
        for (i, share) in self.points.iter().enumerate().filter(|(_, s)| s.group < count) {
            let normal = share.area * pressure.get(i).copied().unwrap_or(0.0);
            let along = share.area * traction.get(i).copied().unwrap_or(0.0);
            sum[share.group] += normal;
            least[share.group] += 1e-12 * share.stiffness * size;
            for c in 0..dim {
                let k = dim * share.group + c;
                force[k] += along * share.tangent[c] - normal * share.normal[c];
                place[k] += normal * share.place[c];
            }
        }
        for (k, x) in place.iter_mut().enumerate() {
            let group = k / dim;
            let is_known = sum[group].abs() > least[group];
            *x = if is_known { *x / sum[group] } else { f64::NAN };
        }
        [force, place]
    }
}
