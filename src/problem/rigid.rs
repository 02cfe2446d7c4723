//! Rigid motions: which of them are held, by supports or by the obstacle.

use nalgebra::{DMatrix, DVector};

use super::{Problem, ProblemError};
use crate::contact::oracle;
use crate::mesh::Element;
use crate::scenario::{BodyKind, Contact, Issue, Scene};

impl Problem {
    /// A motion that nothing opposes is an error; one that ends at the obstacle is not.
    pub(super) fn check_rigid_motion(&self, scene: &Scene) -> Result<(), ProblemError> {
        let system = &self.system;
        let body = &system.body;
        let free = body.rigid_motions(false);
        // what friction holds, or lets go, may move
        if free.is_empty() || system.tangents().is_some() {
            return Ok(());
        }
        if scene.contact.as_ref().is_some_and(Contact::has_pairs) {
            return match scene.body.kind {
                // their parts are not known: one may fly
                BodyKind::Matrices => Ok(()),
                _ => self.check_floating(scene, &free),
            };
        }
        let fail = |message: &str| {
            let name = scene.body.kind.side_key();
            let help = format!(
                "add a [[support]] that holds it, for example {name} = \"left\", fix = [\"x\", \"y\"]"
            );
            let key = if scene.supports.is_empty() { "body" } else { "support" };
            Err(scene.error(Issue::new(key, message, help)).into())
        };
        if system.n_contact() == 0 || !body.rigid_motions(true).is_empty() {
            return fail("the body can move rigidly");
        }
        match self.is_carried_to_the_obstacle(&free)? {
            Some(true) => Ok(()),
            Some(false) => fail(
                "the body can move rigidly, and neither a constant load nor the initial velocity carries it to \
                 the obstacle",
            ),
            None => fail(
                "the body can move rigidly, and whether the obstacle can bear the constant loads could not be decided: the \
                 interior-point method found neither pressures that do nor that there are none",
            ),
        }
    }

    /// Of several parts one may fly by itself, but for one that nothing meets, pushes or throws.
    fn check_floating(&self, scene: &Scene, free: &[Vec<f64>]) -> Result<(), ProblemError> {
        let system = &self.system;
        let (mesh, dofs) = (&system.body.mesh, &system.body.dofs);
        let part_of = mesh.parts();
        let dim = mesh.dim();
        let mut at_rest = vec![false; part_of.iter().max().map_or(0, |last| last + 1)];
        let largest = |field: &[f64]| field.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for motion in free {
            let size = largest(motion);
            for (n, x) in motion.chunks_exact(dim).enumerate() {
                at_rest[part_of[n]] |= largest(x) > 1e-8 * size;
            }
        }
        for (i, point) in dofs.contact.iter().enumerate() {
            let others = dofs.against(i).iter().map(|a| a.0);
            others.chain([point.node]).for_each(|n| at_rest[part_of[n]] = false);
        }
        let loads = &system.loads;
        let forces = loads.constant.iter().chain(loads.harmonics.iter().map(|h| &h.force));
        let fields = forces.chain(loads.measured.iter().map(|m| &m.force));
        for field in fields.chain([&self.initial.v, &self.initial.u]) {
            for n in 0..mesh.n_nodes() {
                let acts = |i: usize| field.get(i).is_some_and(|x| *x != 0.0);
                if dofs.directions(n).filter_map(|d| d.1).any(acts) {
                    at_rest[part_of[n]] = false;
                }
            }
        }
        let Some(part) = at_rest.iter().position(|rests| *rests) else { return Ok(()) };
        let of_part = |e: &Element| part_of[e.nodes[0]] == part;
        let region = mesh.elements().find(of_part).map(|e| e.region);
        let name = region.and_then(|r| scene.materials.get(r)?.group.clone());
        let what = name.map_or_else(|| "a part of the body".to_owned(), |n| format!("\"{n}\""));
        let message = format!(
            "{what} floats: no support or spring holds it, nothing meets it, no load or velocity moves it"
        );
        let help = "add a [[support]] or a [[spring]], or a [[contact]] with slave and master";
        let key = if scene.supports.is_empty() { "body" } else { "support" };
        Err(scene.error(Issue::new(key, message, help)).into())
    }

    /// Whether no rigid motion escapes; none where that cannot be told. With the rigid motions `Φ` (mass-orthonormal) of the open body, the loads `b = Φᵀf₀` hold it at the
    /// obstacle if pressures can bear them: `b = Φ_Cᵀλ, λ ≥ 0` (otherwise, by Farkas' lemma, some motion that leaves the obstacle gains
    /// energy). Without loads it flies as it was thrown, `m = Φᵀ M u̇`, and must meet the obstacle somewhere: `(Φ_C m)_i > 0`.
    fn is_carried_to_the_obstacle(&self, free: &[Vec<f64>]) -> Result<Option<bool>, ProblemError> {
        let system = &self.system;
        let (n, n_c) = (system.n(), system.n_contact());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut momentum = vec![0.0; n];
        let mut motions: Vec<Vec<f64>> = vec![];
        for motion in free {
            let mut x = system.body.dofs.gather(motion);
            for _ in 0..2 {
                system.mass().mul(&x, &mut momentum);
                for other in &motions {
                    let c = dot(other, &momentum);
                    x.iter_mut().zip(other).for_each(|(x, o)| *x -= c * o);
                }
            }
            let norm = system.mass().quadratic(&x).sqrt();
            x.iter_mut().for_each(|x| *x /= norm);
            motions.push(x);
        }
        /// Sums below this share of their terms are rounding errors.
        const ROUNDING: f64 = 1e-10;
        let at_contact: Vec<Vec<f64>> = motions.iter().map(|m| system.along_normals(m)).collect();
        let contact = |z: &[f64]| -> Vec<f64> {
            (0..n_c).map(|i| at_contact.iter().zip(z).map(|(m, z)| z * m[i]).sum()).collect()
        };
        let load: Vec<f64> = motions.iter().map(|m| system.loads.constant_potential(m)).collect();
        let force = system.loads.constant.as_ref();
        let terms: f64 = force.map_or(0.0, |f| {
            motions.iter().map(|m| m.iter().zip(f).map(|(m, f)| (m * f).abs()).sum::<f64>()).sum()
        });
        if load.iter().any(|b| b.abs() > ROUNDING * terms) {
            let phi = DMatrix::from_fn(n_c, motions.len(), |i, k| at_contact[k][i]);
            let b = DVector::from_column_slice(&load);
            let q: Vec<f64> = (-(&phi * &b)).iter().copied().collect();
            let Some(pressure) = oracle::clarabel(&(&phi * phi.transpose()), &q) else {
                return Ok(None);
            };
            // the distance of b from the cone of what pressures bear
            let rest = phi.transpose() * DVector::from_vec(pressure) - &b;
            return Ok(verdict(rest.norm() / b.norm()));
        }
        let (_, v) = self.initial.full(system)?;
        system.mass().mul(&v, &mut momentum);
        let thrown: Vec<f64> = motions.iter().map(|m| dot(m, &momentum)).collect();
        let speed = contact(&thrown);
        let largest = v.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        Ok(Some(speed.iter().any(|s| *s > ROUNDING * largest)))
    }
}

/// Whether loads that the obstacle bears but for this share are borne: the interior-point method knows pressures to some 1e-8 of their size and has been seen
/// at 1e-6; between that and what no rounding explains nothing is said.
fn verdict(share: f64) -> Option<bool> {
    match share {
        s if s <= 1e-5 => Some(true),
        s if s >= 1e-3 => Some(false),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::verdict;

    #[test]
    fn what_cannot_be_told_is_neither_yes_nor_no() {
        assert_eq!(verdict(1e-9), Some(true));
        assert_eq!(verdict(0.1), Some(false));
        assert_eq!(verdict(1e-4), None);
        assert_eq!(verdict(f64::NAN), None);
    }
}
