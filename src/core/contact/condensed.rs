//! The condensed mass `M_0 = A_∅ᵀ diag(m) A_∅` of a body whose own mass is a diagonal, without forming it.
//!
//! `M_0` is full over all displacements that some contact displacement follows. Its inverse needs none of it: admissible accelerations of the open phase
//! satisfy `N_C a_C + N_O a_O = 0`, so that (with rows scaled to the order of one, `R = diag(N_C)⁻¹ [N_O, N_C]`)
//!
//! ```text
//! M_0⁻¹ = D⁻¹ − D⁻¹ R_Oᵀ Σ⁻¹ R_O D⁻¹,   Σ = R diag(m)⁻¹ Rᵀ,   D = diag(m_O)
//! ```
//!
//! with a sparse `Σ` of the size of the contact. What it does to a force is local: accelerations differ from `D⁻¹ f` next to the contact alone.

use std::sync::{Arc, OnceLock};

use nalgebra::DMatrix;

use super::ContactError;
use super::conditions::Conditions;
use super::expansion::{Expansion, Part};
use crate::fem::{Body, Csr, SolveScratch, SpdFactor};

/// The mass and what solves with it.
#[derive(Debug)]
pub(super) struct Condensed {
    /// `m` over `u`.
    masses: Vec<f64>,
    /// `D⁻¹`
    pub inverse: Vec<f64>,
    /// `R_O`
    rows: Csr,
    /// `Σ`, factorised.
    factor: SpdFactor,
    /// `A_∅`
    open: Expansion,
    /// `M_0` over `u`, where somebody asks for it.
    formed: OnceLock<Csr>,
}

impl Condensed {
    /// Of a body with a diagonal mass; none where it has another.
    pub fn new(
        body: &Body,
        conditions: &Arc<Conditions>,
    ) -> Result<Option<Condensed>, ContactError> {
        let Some(masses) = body.mass.as_diagonal() else { return Ok(None) };
        let (size, n_o) = (conditions.count(), body.dofs.n_o);
        // contact displacements without mass of their own
        if masses[n_o..].contains(&0.0) {
            return Ok(None);
        }
        if masses.iter().any(|m| m.is_nan() || *m <= 0.0) {
            SpdFactor::new(&body.mass, "mass matrix")?;
        }
        let mut entries = vec![];
        for i in 0..size {
            let scale = 1.0 / conditions.n_c[(i, i)];
            entries.extend(conditions.n_o.row(i).map(|(j, v)| (i, j, scale * v)));
            let of_c = conditions.n_c.row(i).map(|(j, v)| (i, n_o + j, scale * v));
            entries.extend(of_c);
        }
        let all = Csr::from_triplets(size, masses.len(), entries);
        let light = all.triplets().map(|(i, j, v)| (i, j, v / masses[j])).collect();
        let light = Csr::from_triplets(size, masses.len(), light);
        let factor = SpdFactor::new(&light.product(&all.transposed()), "mass of the contact")?;
        let rows = all.triplets().filter(|e| e.1 < n_o).collect();
        Ok(Some(Condensed {
            inverse: masses[..n_o].iter().map(|m| 1.0 / m).collect(),
            rows: Csr::from_triplets(size, n_o, rows),
            factor,
            open: Expansion::open(conditions),
            masses,
            formed: OnceLock::new(),
        }))
    }

    pub fn scratch(&self) -> SolveScratch {
        self.factor.scratch()
    }

    /// Displacements that contact displacements follow.
    pub fn support(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self.rows.triplets().map(|e| e.1).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// What the contact takes from accelerations `x = D⁻¹ f`, entry by entry: `D⁻¹ R_Oᵀ Σ⁻¹ R_O x`. Only those of [`Condensed::support`] are looked at.
    pub fn correct(&self, x: &[f64], scratch: &mut SolveScratch, mut take: impl FnMut(usize, f64)) {
        let size = self.rows.n_rows();
        if size == 0 {
            return;
        }
        let mut mu: Vec<f64> = (0..size).map(|i| self.rows.row_dot(i, x)).collect();
        self.factor.solve(&mut mu, scratch);
        for (i, mu) in mu.into_iter().enumerate() {
            self.rows.row(i).for_each(|(j, v)| take(j, self.inverse[j] * v * mu));
        }
    }

    /// `x ← M_0⁻¹ x`; of several vectors one after the other.
    pub fn solve(&self, x: &mut [f64], scratch: &mut SolveScratch) {
        for x in x.chunks_exact_mut(self.inverse.len()) {
            x.iter_mut().zip(&self.inverse).for_each(|(x, d)| *x *= d);
            let mut taken = vec![];
            self.correct(x, scratch, |j, v| taken.push((j, v)));
            taken.into_iter().for_each(|(j, v)| x[j] -= v);
        }
    }

    /// `A_∅ x_O`
    fn follow(&self, x: &[f64]) -> Vec<f64> {
        let n_o = self.inverse.len();
        let mut of_c = vec![0.0; self.masses.len() - n_o];
        self.open.undriven(&x[..n_o], &mut of_c, Part::Linear);
        of_c
    }

    /// `xᵀM_0 x` of a full vector, of which some displacements of `u_O` are at rest; its `u_C` do not count.
    pub fn quadratic(&self, rows: std::ops::Range<usize>, x: &[f64]) -> f64 {
        let n_o = self.inverse.len();
        let own = rows.map(|i| self.masses[i] * x[i] * x[i]).sum::<f64>();
        let of_c = self.follow(x);
        own + of_c.iter().zip(&self.masses[n_o..]).map(|(x, m)| m * x * x).sum::<f64>()
    }

    /// `y = M_0 x` of full vectors.
    pub fn mul(&self, x: &[f64], y: &mut [f64]) {
        let n_o = self.inverse.len();
        let (y_o, y_c) = y.split_at_mut(n_o);
        y_o.iter_mut().zip(&self.masses).zip(x).for_each(|((y, m), x)| *y = m * x);
        y_c.fill(0.0);
        let mut of_c = self.follow(x);
        of_c.iter_mut().zip(&self.masses[n_o..]).for_each(|(x, m)| *x *= m);
        self.open.push(&of_c, |j, v| y_o[j] += v);
    }

    /// What forces on `u_C` add to those on `u_O` in the open phase: `A_∅ᵀ f_C`.
    pub fn push(&self, f_c: &[f64], add: impl FnMut(usize, f64)) {
        self.open.push(f_c, add);
    }

    /// `[M_0, 0; 0, 0]` over `u`.
    pub fn formed(&self, body: &Body) -> &Csr {
        self.formed.get_or_init(|| {
            let reduced = body.mass.congruence(&self.open.a_star());
            let n = self.masses.len();
            Csr::from_triplets(n, n, reduced.triplets().collect())
        })
    }

    /// `N_O M_0⁻¹ N_Oᵀ`
    pub fn gram(&self, n_o: &Csr) -> DMatrix<f64> {
        let mut scratch = self.scratch();
        super::gram::gram_by(n_o, |x| self.solve(x, &mut scratch), |_, _| ())
    }

    /// Bounds of `√(N_O M_0⁻¹ N_Oᵀ)_kk`: of `D ≤ M_0` in place of it.
    pub(crate) fn row_norms(&self, n_o: &Csr) -> Vec<f64> {
        let of = |k: usize| n_o.row(k).map(|(j, v)| v * v * self.inverse[j]).sum::<f64>();
        (0..n_o.n_rows()).map(|k| of(k).sqrt()).collect()
    }

    /// A bound of `c` in `M_α ≤ c² M_0` for all phases, of an H-matrix `N_C`: `M_α = D + A_αᵀ M_C A_α`, `D ≤ M_0`, and entry by entry
    /// `|A_α| ≤ ⟨N_C⟩⁻¹ |N_O|`; the norm of `M_C^½ |A| D^{-½}` is not above the root of its largest row sum times its largest column sum.
    pub fn ratio(&self, conditions: &Conditions) -> f64 {
        let (size, n_o) = (conditions.count(), self.inverse.len());
        let Some(comparison) = conditions.follow_bounds() else { return f64::INFINITY };
        let roots: Vec<f64> = self.masses[n_o..].iter().map(|m| m.sqrt()).collect();
        // rows: M_C^½ ⟨N⟩⁻¹ |N_O| D^{-½} 1
        let sums = |i: usize| {
            conditions.n_o.row(i).map(|(j, v)| v.abs() * self.inverse[j].sqrt()).sum::<f64>()
        };
        let of_rows = comparison.solve((0..size).map(sums).collect());
        let largest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0f64, f64::max);
        let row = largest(&mut of_rows.iter().zip(&roots).map(|(x, r)| x * r));
        // columns: D^{-½} |N_O|ᵀ ⟨N⟩⁻ᵀ M_C^½ 1
        let weights = comparison.solve_transposed(roots);
        let mut columns = vec![0.0; n_o];
        for (i, j, v) in conditions.n_o.triplets() {
            columns[j] += v.abs() * weights[i];
        }
        let column = largest(&mut columns.iter().zip(&self.inverse).map(|(x, d)| x * d.sqrt()));
        (1.0 + row * column).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::inertia::{ConstantMass, Inertia};
    use crate::contact::{Contacts, Gaps, MassChoice, Stress, System};
    use crate::fem::{DofMap, Facing, Held, MassForm, Material};
    use crate::mesh::structured;

    /// Who asks whether contact displacements have inertia forms no matrix of the whole body: in space that took longer than all else before a run.
    #[test]
    fn to_ask_for_the_inertia_of_the_contact_forms_nothing() {
        let mesh = structured::rectangle(1.0, 0.5, 5, 4);
        let held = [Held::along("left", 0), Held::along("left", 1)];
        let dofs = DofMap::new(&mesh, &held, &[Facing::surface("right")]).unwrap();
        let gaps = Gaps::front(vec![0.3; dofs.contact.len()]);
        let material = Material::plate(2.0, 0.3, 1.5, 1.0);
        let body = Body::assemble(mesh, dofs, &[material], MassForm::Lumped);
        let contacts = Contacts { gaps, lumped: true };
        let choice = (Stress::Reaction, MassChoice::Condensed);
        let system = System::new(body, &contacts, choice).unwrap();
        let Inertia::Constant(c) = system.inertia() else { panic!("no constant mass") };
        let ConstantMass::Condensed { mass, .. } = &**c else { panic!("it is formed") };
        assert!(system.has_massless_contact() && mass.formed.get().is_none());
        // what is formed says the same
        let whole = system.mass();
        assert!((system.n_o()..system.n()).all(|i| whole.row(i).next().is_none()));
    }
}
