//! Gram matrices `R M⁻¹ Rᵀ` of rows in the inverse of a mass, and factors of their blocks.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::coupling::Coupling;
use crate::fem::{Csr, SpdFactor, largest};

/// From so many rows on columns are solved for together, this many at once.
const TOGETHER: (usize, usize) = (128, 32);

/// Entries of a column below so many times its largest are nothing: they vanish with the distance from the contact.
const NOTHING: f64 = 1e-18;

/// Entries of some columns, while they are not too many.
struct Kept {
    count: AtomicUsize,
    limit: usize,
}

impl Kept {
    /// What is left of a column; none where there are too many.
    fn of(&self, k: usize, column: &[f64]) -> Vec<(usize, usize, f64)> {
        if self.are_too_many() {
            return vec![];
        }
        let largest = largest(column);
        let is_something = |e: &(usize, &f64)| e.1.abs() > NOTHING * largest;
        let entries = column.iter().enumerate().filter(is_something);
        let entries: Vec<_> = entries.map(|(j, &v)| (k, j, v)).collect();
        self.count.fetch_add(entries.len(), Ordering::Relaxed);
        entries
    }

    fn are_too_many(&self) -> bool {
        self.count.load(Ordering::Relaxed) > self.limit
    }
}

/// `R M⁻¹ Rᵀ` of sparse rows.
pub(super) fn gram(factor: &SpdFactor, rows: &Csr) -> DMatrix<f64> {
    gram_and_columns(factor, rows, 0).0
}

/// The same, and the columns of `M⁻¹ Rᵀ` as rows where these have no more than so many entries.
pub(super) fn gram_and_columns(
    factor: &SpdFactor,
    rows: &Csr,
    limit: usize,
) -> (DMatrix<f64>, Option<Csr>) {
    let (size, n) = (rows.n_rows(), rows.n_cols());
    let kept = Kept { count: AtomicUsize::new(0), limit };
    let columns = |entries: Vec<(usize, usize, f64)>| {
        (!kept.are_too_many()).then(|| Csr::from_triplets(size, n, entries))
    };
    if size < TOGETHER.0 {
        let (mut scratch, mut entries) = (factor.scratch(), vec![]);
        let solve = |x: &mut [f64]| factor.solve(x, &mut scratch);
        let gram = gram_by(rows, solve, |k, x| entries.extend(kept.of(k, x)));
        return (gram, columns(entries));
    }
    // what rows know of a column, in their own numbers
    let mut known: Vec<usize> = rows.triplets().map(|e| e.1).collect();
    known.sort_unstable();
    known.dedup();
    let mut place = vec![0; n];
    known.iter().enumerate().for_each(|(k, &j)| place[j] = k);
    let firsts: Vec<usize> = (0..size).step_by(TOGETHER.1).collect();
    let of_block = |&first: &usize| {
        let width = TOGETHER.1.min(size - first);
        let mut x = vec![0.0; n * width];
        for (k, column) in x.chunks_exact_mut(n).enumerate() {
            rows.row(first + k).for_each(|(j, v)| column[j] = v);
        }
        factor.solve(&mut x, &mut factor.scratch_of(width));
        let columns = x.chunks_exact(n).enumerate();
        let entries: Vec<_> = columns.flat_map(|(k, x)| kept.of(first + k, x)).collect();
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
        (block, entries)
    };
    let blocks: Vec<(Vec<f64>, Vec<_>)> = firsts.par_iter().map(of_block).collect();
    let gram = DMatrix::from_fn(size, size, |l, k| {
        let block = &blocks[k / TOGETHER.1].0;
        block[l * (block.len() / size) + k % TOGETHER.1]
    });
    (gram, columns(blocks.into_iter().flat_map(|b| b.1).collect()))
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
