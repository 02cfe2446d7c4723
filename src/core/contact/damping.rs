//! Damping of the body: `C_α = α M_α + β K_α + WᵀW`.

use faer::Mat;

use crate::fem::dense::product;
use crate::fem::{Csr, Reduction};

/// Rayleigh damping `C = α M + β K`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rayleigh {
    /// Mass-proportional part.
    pub alpha: f64,
    /// Stiffness-proportional part.
    pub beta: f64,
}

/// Dampers `Σ c w wᵀ` on displacements of `u_O`: viscous elements, modal ratios `2ξ_kω_k (Mφ_k)(Mφ_k)ᵀ`, matrices of any kind. The same in every phase.
#[derive(Debug, Clone, PartialEq)]
pub struct Dampers {
    /// `W`: rows `√c w`.
    rows: Csr,
}

impl Dampers {
    /// Of the rows `√c w` over `u_O`.
    pub fn new(rows: Csr) -> Dampers {
        Dampers { rows }
    }

    /// These and others.
    pub fn beside(self, others: &Dampers) -> Dampers {
        let first = self.rows.n_rows();
        let more = others.rows.triplets().map(|(i, j, v)| (first + i, j, v));
        let all = self.rows.triplets().chain(more).collect();
        let count = first + others.rows.n_rows();
        Dampers { rows: Csr::from_triplets(count, self.rows.n_cols(), all) }
    }

    /// `W`
    pub fn rows(&self) -> &Csr {
        &self.rows
    }

    /// The force `b −= WᵀW v`.
    pub fn push(&self, v_o: &[f64], b: &mut [f64]) {
        for i in 0..self.rows.n_rows() {
            let rate = self.rows.row_dot(i, v_o);
            self.rows.add_row(i, -rate, b);
        }
    }

    /// `‖W v‖²`: what they take.
    pub fn power(&self, v_o: &[f64]) -> f64 {
        (0..self.rows.n_rows()).map(|i| self.rows.row_dot(i, v_o).powi(2)).sum()
    }

    /// `WᵀW`
    pub fn matrix(&self) -> Csr {
        self.rows.transposed().product(&self.rows)
    }

    /// `ΦᵀWᵀWΦ` of shapes over `u_O`.
    pub fn among(&self, shapes: &Mat<f64>) -> Mat<f64> {
        let (count, n) = (self.rows.n_rows(), shapes.ncols());
        let seen = Mat::from_fn(count, n, |i, j| self.rows.row_dot(i, shapes.col_as_slice(j)));
        product(seen.transpose(), seen.as_ref())
    }

    /// In the coordinates of a reduction.
    pub fn reduced(&self, reduction: &Reduction) -> Dampers {
        Dampers { rows: reduction.operator(&self.rows) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_power_and_matrix_are_one_damping() {
        let rows = Csr::from_triplets(2, 3, vec![(0, 0, 1.0), (0, 2, -2.0), (1, 1, 0.5)]);
        let more = Csr::from_triplets(1, 3, vec![(0, 0, 0.3)]);
        let dampers = Dampers::new(rows).beside(&Dampers::new(more));
        let v = [0.4, -0.7, 1.1];
        let mut b = [0.0; 3];
        dampers.push(&v, &mut b);
        let power: f64 = b.iter().zip(&v).map(|(b, v)| -b * v).sum();
        let closed = (0.4f64 - 2.2).powi(2) + (0.35f64).powi(2) + (0.12f64).powi(2);
        assert!((power - closed).abs() < 1e-15 && (dampers.power(&v) - closed).abs() < 1e-15);
        assert!((dampers.matrix().quadratic(&v) - closed).abs() < 1e-15);
        let shapes = Mat::from_fn(3, 1, |i, _| v[i]);
        assert!((dampers.among(&shapes)[(0, 0)] - closed).abs() < 1e-15);
    }
}
