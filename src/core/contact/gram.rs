//! Gram matrices `R M⁻¹ Rᵀ` of rows in the inverse of a mass, and factors of their blocks.

use nalgebra::{DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::coupling::Coupling;
use crate::fem::{Csr, SpdFactor};

/// From so many rows on columns are solved for together, this many at once.
const TOGETHER: (usize, usize) = (128, 32);

/// `R M⁻¹ Rᵀ` of sparse rows.
pub(super) fn gram(factor: &SpdFactor, rows: &Csr) -> DMatrix<f64> {
    let (size, n) = (rows.n_rows(), rows.n_cols());
    if size < TOGETHER.0 {
        let mut scratch = factor.scratch();
        return gram_by(rows, |x| factor.solve(x, &mut scratch), |_, _| ());
    }
    // what rows know of a column, in their own numbers
    let mut known: Vec<usize> = rows.triplets().map(|e| e.1).collect();
    known.sort_unstable();
    known.dedup();
    let mut place = vec![0; n];
    known.iter().enumerate().for_each(|(k, &j)| place[j] = k);
    let firsts: Vec<usize> = (0..size).step_by(TOGETHER.1).collect();
    let of_block = |&first: &usize| -> Vec<f64> {
        let width = TOGETHER.1.min(size - first);
        let mut x = vec![0.0; n * width];
        for (k, column) in x.chunks_exact_mut(n).enumerate() {
            rows.row(first + k).for_each(|(j, v)| column[j] = v);
        }
        factor.solve(&mut x, &mut factor.scratch_of(width));
        let mut across = vec![0.0; known.len() * width];
        for (row, &j) in across.chunks_exact_mut(width).zip(&known) {
            row.iter_mut().enumerate().for_each(|(k, v)| *v = x[n * k + j]);
        }
        let mut block = vec![0.0; size * width];
        for (l, sums) in block.chunks_exact_mut(width).enumerate() {
            for (j, v) in rows.row(l) {
                let of_j = &across[width * place[j]..][..width];
                sums.iter_mut().zip(of_j).for_each(|(s, x)| *s += v * x);
            }
        }
        block
    };
    let blocks: Vec<Vec<f64>> = firsts.par_iter().map(of_block).collect();
    DMatrix::from_fn(size, size, |l, k| {
        let block = &blocks[k / TOGETHER.1];
        block[l * (block.len() / size) + k % TOGETHER.1]
    })
}

/// The same with what solves with `M`; `each` is shown the columns `M⁻¹ Rᵀ` one after the other.
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
