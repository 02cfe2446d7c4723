//! Displacements with inertia that reactions hold.
//!
//! ```text
//! M ü = f − K u − nᵀλ,      n_c ü = 0   ⇒   λ_c = D_cc⁻¹ n_c M⁻¹ (f − K u),    D = n M⁻¹nᵀ
//! ```

use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector};

use super::ContactError;
use super::gram::{Schur, gram_by};
use crate::fem::{Body, Csr, SpdFactor};

/// What unit forces along some rows do: `M⁻¹nᵀ`.
#[derive(Debug)]
pub(super) struct Columns {
    /// `n`: displacement of each point along a direction, rows over `u_O`.
    pub rows: Arc<Csr>,
    /// `M⁻¹nᵀ`, a column a row.
    pub columns: Csr,
    /// `D = n M⁻¹nᵀ`
    gram: DMatrix<f64>,
}

impl Columns {
    /// Along these rows, with what solves with the mass.
    pub fn new(rows: Arc<Csr>, solve: impl FnMut(&mut [f64])) -> Columns {
        let mut columns = vec![];
        let gram = gram_by(&rows, solve, |k, x| {
            let entries = x.iter().enumerate().filter(|(_, v)| **v != 0.0);
            columns.extend(entries.map(|(j, &v)| (k, j, v)));
        });
        let columns = Csr::from_triplets(rows.n_rows(), rows.n_cols(), columns);
        Columns { rows, columns, gram }
    }

    /// `n_k M⁻¹n_lᵀ`
    pub fn between(&self, k: usize, l: usize) -> f64 {
        self.gram[(k, l)]
    }

    /// `D` of some of the rows.
    pub fn block(&self, rows: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(rows.len(), rows.len(), |i, j| self.gram[(rows[i], rows[j])])
    }

    /// Its inverse; not numbers where there is none.
    pub(crate) fn inverse(&self, rows: &[usize]) -> DMatrix<f64> {
        let size = rows.len();
        let singular = || DMatrix::from_element(size, size, f64::NAN);
        self.block(rows).try_inverse().unwrap_or_else(singular)
    }
}

/// What a reaction at each contact point of a body does.
#[derive(Debug)]
pub(super) struct Reactions {
    /// Along the normals.
    pub along: Arc<Columns>,
    /// `K M⁻¹nᵀ`, a column a row.
    through: Csr,
}

impl Reactions {
    /// At the points whose normal displacements are these rows.
    pub fn new(body: &Body, normal: Arc<Csr>) -> Result<Reactions, ContactError> {
        let n_o = body.dofs.n_o;
        let factor = SpdFactor::of_mass(&body.mass.leading(n_o), &body.dofs)?;
        let mut scratch = factor.scratch();
        let along = Columns::new(normal, |x| factor.solve(x, &mut scratch));
        let through = along.columns.product(&body.stiffness.leading(n_o));
        Ok(Reactions { through, along: Arc::new(along) })
    }

    /// The pressures of some points that are held, over their areas: rows over `u_O`, and what a force adds.
    pub fn pressures(&self, points: &[usize], area: &[f64]) -> Pressures<'_> {
        let mut combine = self.along.inverse(points);
        for (i, &k) in points.iter().enumerate() {
            combine.row_mut(i).iter_mut().for_each(|x| *x /= area[k]);
        }
        Pressures { of: self, points: points.to_vec(), combine }
    }
}

/// `λ_c/area` of points that are held, as functions of the state.
pub(super) struct Pressures<'a> {
    of: &'a Reactions,
    points: Vec<usize>,
    /// `D_cc⁻¹`, row by row over the area.
    combine: DMatrix<f64>,
}

impl Pressures<'_> {
    /// The row over `u_O` of the `i`-th of them.
    pub fn row(&self, i: usize) -> Vec<f64> {
        let mut row = vec![0.0; self.of.along.rows.n_cols()];
        for (j, &k) in self.points.iter().enumerate() {
            self.of.through.add_row(k, -self.combine[(i, j)], &mut row);
        }
        row
    }

    /// What a force adds to each.
    pub(crate) fn of_force(&self, f: &[f64]) -> Vec<f64> {
        let columns = &self.of.along.columns;
        let along = self.points.iter().map(|&k| columns.row_dot(k, f));
        let along = DVector::from_iterator(self.points.len(), along);
        (&self.combine * along).as_slice().to_vec()
    }
}

/// Points that are held in a phase.
#[derive(Debug)]
pub(super) struct Holds {
    along: Arc<Columns>,
    points: Vec<usize>,
    /// Displacements of `u_O` that stand still, and where.
    at: Vec<(usize, f64)>,
    /// `D_cc`, factorised when a force first asks for an acceleration.
    schur: OnceLock<Option<Schur>>,
}

impl Holds {
    /// Hold some points at their gaps; none where there are no points.
    pub fn new(reactions: &Arc<Reactions>, points: Vec<usize>, gap: &[f64]) -> Option<Holds> {
        let held = |&k: &usize| {
            let entry = reactions.along.rows.row(k).next();
            entry.map_or((0, 0.0), |(j, sign)| (j, sign * gap[k]))
        };
        let at = points.iter().map(held).collect();
        Holds::along(&reactions.along, points, at)
    }

    /// Hold some points where they are.
    pub(crate) fn along(
        along: &Arc<Columns>,
        points: Vec<usize>,
        at: Vec<(usize, f64)>,
    ) -> Option<Holds> {
        let along = along.clone();
        (!points.is_empty()).then_some(Holds { along, points, at, schur: OnceLock::new() })
    }

    /// `a ← a − M⁻¹nᵀ D_cc⁻¹ n a`
    pub fn stop(&self, a: &mut [f64]) {
        let Columns { rows, columns, .. } = &*self.along;
        let schur = self.schur.get_or_init(|| Schur::dense(self.along.block(&self.points)));
        let Some(schur) = schur else { return a.fill(f64::NAN) };
        let along = self.points.iter().map(|&k| rows.row_dot(k, a));
        let mut mu = DVector::from_iterator(self.points.len(), along);
        schur.solve(&mut mu);
        for (&mu, &k) in mu.iter().zip(&self.points) {
            columns.add_row(k, -mu, a);
        }
    }

    /// Displacements of `u_O` that stand still, and where.
    pub fn places(&self) -> &[(usize, f64)] {
        &self.at
    }

    /// Displacements of `u_O` that stand still.
    pub fn displacements(&self) -> impl Iterator<Item = usize> + '_ {
        self.at.iter().map(|h| h.0)
    }

    /// A matrix over `u_O` in which held displacements know of no other.
    pub(crate) fn decoupled(&self, a: &Csr) -> Csr {
        let is_held = |i: usize| self.displacements().any(|h| h == i);
        let kept = a.triplets().filter(|&(i, j, _)| i == j || !(is_held(i) || is_held(j)));
        Csr::from_triplets(a.n_rows(), a.n_cols(), kept.collect())
    }

    /// The constant force on `u_O` beside the decoupled matrices: held displacements are at rest under it.
    pub(crate) fn decoupled_force(&self, stiffness: &Csr, force: &mut [f64]) {
        let mut d = vec![0.0; stiffness.n_cols()];
        self.at.iter().for_each(|&(j, x)| d[j] = x);
        for (i, f) in force.iter_mut().enumerate() {
            *f -= stiffness.row_dot(i, &d);
        }
        for &(j, x) in &self.at {
            let own = stiffness.row(j).find(|e| e.0 == j).map_or(0.0, |e| e.1);
            force[j] = own * x;
        }
    }
}
