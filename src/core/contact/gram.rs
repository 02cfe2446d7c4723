//! Gram matrices `R M⁻¹ Rᵀ` of rows in the inverse of a mass, and factors of their blocks.

use nalgebra::{DMatrix, DVector, Dyn};

use super::coupling::Coupling;
use crate::fem::{Csr, SpdFactor};

/// `R M⁻¹ Rᵀ` of sparse rows; `each` is shown the columns `M⁻¹ Rᵀ` one after the other.
pub(super) fn gram(
    factor: &SpdFactor,
    rows: &Csr,
    each: impl FnMut(usize, &[f64]),
) -> DMatrix<f64> {
    let mut scratch = factor.scratch();
    gram_by(rows, |x| factor.solve(x, &mut scratch), each)
}

/// The same with what solves with `M`.
pub(super) fn gram_by(
    rows: &Csr,
    mut solve: impl FnMut(&mut [f64]),
    mut each: impl FnMut(usize, &[f64]),
) -> DMatrix<f64> {
    let size = rows.n_rows();
    let mut gram = DMatrix::<f64>::zeros(size, size);
    let mut x = vec![0.0; rows.n_cols()];
    for k in 0..size {
        x.fill(0.0);
        rows.row(k).for_each(|(j, v)| x[j] = v);
        solve(&mut x);
        for l in 0..size {
            gram[(l, k)] = rows.row_dot(l, &x);
        }
        each(k, &x);
    }
    gram
}

/// The factor of a small or full matrix, or of a large one with few entries.
#[derive(Debug)]
pub(super) enum Schur {
    Dense(nalgebra::Cholesky<f64, Dyn>),
    Sparse(SpdFactor),
}

impl Schur {
    /// Of a dense matrix; none where it is not positive definite.
    pub fn dense(matrix: DMatrix<f64>) -> Option<Schur> {
        matrix.cholesky().map(Schur::Dense)
    }

    /// Of a block of a matrix that may be sparse.
    pub fn of(gram: &Coupling, points: &[usize]) -> Option<Schur> {
        match gram.is_sparse() {
            true => SpdFactor::new(&gram.among(points), "reduced mass").ok().map(Schur::Sparse),
            false => {
                let entry = |a: usize, b: usize| gram[(points[a], points[b])];
                Schur::dense(DMatrix::from_fn(points.len(), points.len(), entry))
            }
        }
    }

    pub fn solve(&self, x: &mut DVector<f64>) {
        match self {
            Schur::Dense(factor) => {
                factor.solve_mut(x);
            }
            Schur::Sparse(factor) => factor.solve(x.as_mut_slice(), &mut factor.scratch()),
        }
    }
}
