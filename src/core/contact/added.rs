//! What a phase adds to the open one along given directions, without a matrix of the whole body.
//!
//! Phases differ in what contact displacements follow, `A_α = A_∅ + Δ`, and in nothing else: with directions `L` over `u_O` and the rows and columns of `u_C` alone
//!
//! ```text
//! Lᵀ(K_α − K_∅)L = (ΔL)ᵀW + Wᵀ(ΔL) + (ΔL)ᵀK_CC(ΔL),   W = K_CO L + K_CC A_∅L
//! ```
//!
//! and the same with the mass, where it follows the phase (`M_α = A*ᵀMA*`).

use faer::Mat;

use super::expansion::{Expansion, Part};
use super::inertia::Inertia;
use super::phase::Phase;
use super::system::System;
use crate::fem::Csr;

/// A matrix of the body as contact displacements know it.
#[derive(Debug)]
struct Border {
    /// `W`
    w: Mat<f64>,
    /// `K_CC`, rows and columns counted from the first contact displacement.
    of_c: Csr,
}

impl Border {
    fn new(matrix: &Csr, directions: &Mat<f64>, open: &Mat<f64>) -> Border {
        let (n_o, size) = (directions.nrows(), open.nrows());
        let rows = || (0..size).flat_map(|i| matrix.row(n_o + i).map(move |(j, v)| (i, j, v)));
        let of_c = rows().filter(|e| e.1 >= n_o).map(|(i, j, v)| (i, j - n_o, v)).collect();
        let of_c = Csr::from_triplets(size, size, of_c);
        let mut w = Mat::zeros(size, directions.ncols());
        for c in 0..directions.ncols() {
            let (x, followed) = (directions.col_as_slice(c), open.col_as_slice(c));
            let target = w.col_as_slice_mut(c);
            rows().for_each(|(i, j, v)| target[i] += v * x.get(j).unwrap_or(&0.0));
            target.iter_mut().enumerate().for_each(|(i, t)| *t += of_c.row_dot(i, followed));
        }
        Border { w, of_c }
    }

    /// `ΔᵀW + WᵀΔ + ΔᵀK_CCΔ`
    fn added(&self, delta: &Mat<f64>) -> Mat<f64> {
        let half = delta.transpose() * &self.w;
        let through = Mat::from_fn(delta.nrows(), delta.ncols(), |i, c| {
            self.of_c.row_dot(i, delta.col_as_slice(c))
        });
        &half + half.transpose() + delta.transpose() * through
    }
}

/// `A x` of directions.
fn followed(expansion: &Expansion, directions: &Mat<f64>) -> Mat<f64> {
    let mut all = Mat::zeros(expansion.offset.len(), directions.ncols());
    for c in 0..directions.ncols() {
        let target = all.col_as_slice_mut(c);
        expansion.undriven(directions.col_as_slice(c), target, Part::Linear);
    }
    all
}

/// What the phases of a body add to its open one along directions.
#[derive(Debug)]
pub(crate) struct Added {
    /// `A_∅L`
    open: Mat<f64>,
    stiffness: Border,
    /// None: the mass is the same in every phase.
    mass: Option<Border>,
}

impl Added {
    /// Of a body whose contact displacements follow from conditions.
    pub fn new(system: &System, directions: &Mat<f64>) -> Option<Added> {
        let phase = system.open_phase();
        phase.data.expansion.solved().filter(|_| phase.is_of_the_body())?;
        let open = followed(&phase.data.expansion, directions);
        let border = |matrix: &Csr| Border::new(matrix, directions, &open);
        let mass = match system.inertia() {
            Inertia::Projected(_) => Some(border(&system.body.mass)),
            Inertia::Constant(_) => None,
        };
        Some(Added { stiffness: border(&system.body.stiffness), mass, open })
    }

    /// `Lᵀ(K_α − K_∅)L` and `Lᵀ(M_α − M_∅)L` of a phase; none where something else is added to the body.
    pub fn of(&self, phase: &Phase, directions: &Mat<f64>) -> Option<[Mat<f64>; 2]> {
        phase.data.expansion.solved().filter(|_| phase.is_of_the_body())?;
        let delta = followed(&phase.data.expansion, directions) - &self.open;
        let mass = match &self.mass {
            Some(mass) => mass.added(&delta),
            None => Mat::zeros(directions.ncols(), directions.ncols()),
        };
        Some([self.stiffness.added(&delta), mass])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Contacts, Gaps, MassChoice, States, Stress};
    use crate::fem::{Body, DofMap, Facing, Held, MassForm, Material};
    use crate::mesh::structured;

    /// What the matrices of both phases say themselves, for masses that follow the phase and such that do not, and contact points that know of each other or not.
    #[test]
    fn it_is_the_difference_of_the_matrices() {
        let choices = [
            (Stress::Projection, MassChoice::Paper),
            (Stress::NodalMean, MassChoice::Paper),
            (Stress::Reaction, MassChoice::Condensed),
        ];
        for (choice, form) in choices
            .into_iter()
            .flat_map(|c| [MassForm::Lumped, MassForm::Consistent].map(|form| (c, form)))
        {
            let mesh = structured::rectangle(1.0, 0.5, 5, 4);
            let held = [Held::along("left", 0), Held::along("left", 1)];
            let dofs = DofMap::new(&mesh, &held, &[Facing::surface("right")]).unwrap();
            let gaps = Gaps::front(vec![0.3; dofs.contact.len()]);
            let body = Body::assemble(mesh, dofs, &[Material::plate(2.0, 0.3, 1.5, 1.0)], form);
            let contacts = Contacts { gaps, lumped: form == MassForm::Lumped };
            let system = System::new(body, &contacts, choice).unwrap();
            let n = system.n_o();
            let wave = |i: usize, c: usize| (0.7 * (i as f64 + 1.0) * (c as f64 + 0.3)).sin();
            let directions = Mat::from_fn(n, 7, wave);
            let along = |a: &Csr| {
                let mut ax = Mat::<f64>::zeros(n, 7);
                (0..7).for_each(|c| a.mul(directions.col_as_slice(c), ax.col_as_slice_mut(c)));
                directions.transpose() * ax
            };
            let added = Added::new(&system, &directions).unwrap();
            let (k0, m0) = system.open_phase().matrices();
            for flags in [1u32, 6, 21, 31] {
                let set = States::of_contact((0..5).map(|i| flags >> i & 1 == 1));
                let phase = system.phase(&set);
                let (k, m) = phase.matrices();
                let found = added.of(&phase, &directions).unwrap();
                for (found, (a, b)) in found.iter().zip([(&k, &k0), (&m, &m0)]) {
                    let wanted = along(a) - along(b);
                    let size = along(a).norm_max();
                    let error = (found - wanted).norm_max();
                    assert!(error < 1e-13 * size, "{choice:?} {flags:05b}: {error:e} of {size:e}");
                }
            }
        }
    }
}
