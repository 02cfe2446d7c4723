//! `N_C` and its principal blocks: dense where the contact is small, sparse where each point knows a few neighbours only, so that neither a product nor
//! a factor of a large contact zone costs what a dense one does.

use std::ops::Index;
use std::sync::OnceLock;

use faer::linalg::solvers::SolveCore;
use faer::sparse::linalg::solvers::{Lu as SparseLu, SymbolicLu};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, MatMut};
use nalgebra::{DMatrix, DVectorViewMut, Dyn};

use super::lcp::LcpError;
use crate::fem::Csr;

/// A square matrix: by its rows, and dense besides where it is small or full.
#[derive(Debug, Clone)]
pub struct Coupling {
    rows: Csr,
    dense: Option<DMatrix<f64>>,
    columns: OnceLock<Csr>,
}

/// Smaller matrices, and those with more than one entry in so many, are dense.
const SMALLEST: usize = 48;
const SPARSE: usize = 8;

impl From<Csr> for Coupling {
    fn from(rows: Csr) -> Coupling {
        let size = rows.n_rows();
        let is_sparse = size >= SMALLEST && SPARSE * rows.n_entries() <= size * size;
        let dense = (!is_sparse).then(|| {
            let mut dense = DMatrix::zeros(size, size);
            rows.triplets().for_each(|(i, j, v)| dense[(i, j)] = v);
            dense
        });
        Coupling { rows, dense, columns: OnceLock::new() }
    }
}

impl From<DMatrix<f64>> for Coupling {
    fn from(dense: DMatrix<f64>) -> Coupling {
        let size = dense.nrows();
        let all = (0..size).flat_map(|i| (0..size).map(move |j| (i, j)));
        let entries = all.map(|(i, j)| (i, j, dense[(i, j)])).filter(|e| e.2 != 0.0);
        Coupling::from(Csr::from_triplets(size, size, entries.collect()))
    }
}

impl Index<(usize, usize)> for Coupling {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        match &self.dense {
            Some(dense) => &dense[(i, j)],
            None => self.rows.entry(i, j).unwrap_or(&0.0),
        }
    }
}

impl Coupling {
    /// Number of rows.
    pub fn size(&self) -> usize {
        self.rows.n_rows()
    }

    /// Large and mostly zero: each point knows a few neighbours only.
    pub(crate) fn is_sparse(&self) -> bool {
        self.dense.is_none()
    }

    /// As a dense matrix.
    pub fn dense(&self) -> DMatrix<f64> {
        match &self.dense {
            Some(dense) => dense.clone(),
            None => DMatrix::from_fn(self.size(), self.size(), |i, j| self[(i, j)]),
        }
    }

    /// By its rows.
    pub fn rows(&self) -> &Csr {
        &self.rows
    }

    /// The entries of a row with their columns.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.rows.row(i)
    }

    /// Whether every point knows itself only.
    pub(crate) fn is_diagonal(&self) -> bool {
        self.rows.triplets().all(|(i, j, _)| i == j)
    }

    /// `Σ_j N_ij x_j`
    pub fn row_dot(&self, i: usize, x: &[f64]) -> f64 {
        match &self.dense {
            Some(dense) => x.iter().enumerate().map(|(j, x)| dense[(i, j)] * x).sum(),
            None => self.rows.row_dot(i, x),
        }
    }

    /// `Σ_j |N_ij x_j|`
    pub(crate) fn row_size(&self, i: usize, x: &[f64]) -> f64 {
        self.rows.row(i).map(|(j, v)| (v * x[j]).abs()).sum()
    }

    /// The entries of a column with their rows.
    pub fn column(&self, k: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.columns.get_or_init(|| self.rows.transposed()).row(k)
    }

    /// The block of some points.
    pub fn among(&self, points: &[usize]) -> Csr {
        self.rows.among(points)
    }

    /// The factor of the block of some points.
    pub fn block(&self, points: &[usize]) -> Result<Block, LcpError> {
        let n = points.len();
        let dense = match &self.dense {
            None if n >= SMALLEST => return sparse(&self.among(points)),
            dense => dense.as_ref(),
        };
        let entry = |a: usize, b: usize| match dense {
            Some(dense) => dense[(points[a], points[b])],
            None => self[(points[a], points[b])],
        };
        let block = DMatrix::from_fn(n, n, entry);
        let is_diagonal = (0..n).all(|a| (0..n).all(|b| a == b || block[(a, b)] == 0.0));
        Ok(match is_diagonal {
            true => Block::Diagonal(block.diagonal().iter().map(|d| 1.0 / d).collect()),
            false => Block::Dense {
                lu: block.clone().lu(),
                block: block.into(),
                transposed: OnceLock::new(),
            },
        })
    }
}

fn sparse(block: &Csr) -> Result<Block, LcpError> {
    let n = block.n_rows();
    if let Some(diagonal) = block.as_diagonal().filter(|_| block.n_entries() == n) {
        return Ok(Block::Diagonal(diagonal.iter().map(|d| 1.0 / d).collect()));
    }
    let entries: Vec<_> = block.triplets().map(|(i, j, v)| Triplet::new(i, j, v)).collect();
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &entries)
        .map_err(|_| LcpError::Singular)?;
    let order = SymbolicLu::try_new(matrix.symbolic()).map_err(|_| LcpError::Singular)?;
    let lu = SparseLu::try_new_with_symbolic(order, matrix.as_ref());
    Ok(Block::Sparse(lu.map_err(|_| LcpError::Singular)?.into()))
}

/// A principal block `N_ff` with its factor.
#[derive(Debug)]
pub enum Block {
    /// The inverse of a diagonal one.
    Diagonal(Vec<f64>),
    /// A small or full one.
    Dense {
        /// The block.
        block: Box<DMatrix<f64>>,
        /// Its factor.
        lu: nalgebra::LU<f64, Dyn, Dyn>,
        /// That of its transpose, once it is asked for.
        transposed: OnceLock<nalgebra::LU<f64, Dyn, Dyn>>,
    },
    /// A large one with few entries.
    Sparse(Box<SparseLu<usize, f64>>),
}

impl Block {
    /// `x ← N_ff⁻¹ x`
    pub fn solve(&self, x: &mut [f64]) -> Result<(), LcpError> {
        match self {
            _ if x.is_empty() => {}
            Block::Diagonal(inverse) => x.iter_mut().zip(inverse).for_each(|(x, d)| *x *= d),
            Block::Dense { lu, .. } => {
                if !lu.solve_mut(&mut DVectorViewMut::from_slice(x, x.len())) {
                    return Err(LcpError::Singular);
                }
            }
            Block::Sparse(lu) => {
                let n = x.len();
                lu.solve_in_place_with_conj(Conj::No, MatMut::from_column_major_slice_mut(x, n, 1));
            }
        }
        Ok(())
    }

    /// `x ← N_ff⁻ᵀ x`
    pub(crate) fn solve_transposed(&self, x: &mut [f64]) {
        match self {
            _ if x.is_empty() => {}
            Block::Diagonal(inverse) => x.iter_mut().zip(inverse).for_each(|(x, d)| *x *= d),
            Block::Dense { block, transposed, .. } => {
                let lu = transposed.get_or_init(|| block.transpose().lu());
                lu.solve_mut(&mut DVectorViewMut::from_slice(x, x.len()));
            }
            Block::Sparse(lu) => {
                let n = x.len();
                lu.solve_transpose_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(x, n, 1),
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sparse and dense blocks are the same, for any choice of points.
    #[test]
    fn sparse_blocks_are_the_dense_ones() {
        let size = 120;
        let n = DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
            0 => 4.0 + (i as f64).sin(),
            1 | 2 => 0.8 * (1.7 * i as f64 + 0.4 * j as f64).sin(),
            _ => 0.0,
        });
        let coupling = Coupling::from(n.clone());
        assert!(coupling.is_sparse() && !coupling.is_diagonal());
        assert!(!Coupling::from(n.view((0, 0), (20, 20)).into_owned()).is_sparse());
        let x: Vec<f64> = (0..size).map(|i| (0.9 * i as f64).cos()).collect();
        for i in 0..size {
            let row = |f: &dyn Fn(f64) -> f64| (0..size).map(|j| f(n[(i, j)] * x[j])).sum::<f64>();
            assert!((coupling.row_dot(i, &x) - row(&|v| v)).abs() < 1e-14);
            assert!((coupling.row_size(i, &x) - row(&f64::abs)).abs() < 1e-14);
        }
        for keep in [1, 2, 3, 5] {
            let points: Vec<usize> = (0..size).filter(|i| keep == 1 || i % keep != 0).collect();
            let block = coupling.block(&points).unwrap();
            assert!(matches!(block, Block::Sparse(_)), "{keep}");
            let dense =
                DMatrix::from_fn(points.len(), points.len(), |a, b| n[(points[a], points[b])]);
            let mut y = x[..points.len()].to_vec();
            block.solve(&mut y).unwrap();
            let back = &dense * nalgebra::DVector::from_column_slice(&y);
            assert!(back.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-13));
            let mut y = x[..points.len()].to_vec();
            block.solve_transposed(&mut y);
            let back = dense.transpose() * nalgebra::DVector::from_column_slice(&y);
            assert!(back.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-13));
        }
        // every third point knows no other
        let lone: Vec<usize> = (0..size).step_by(3).chain([]).collect();
        assert!(matches!(coupling.block(&lone).unwrap(), Block::Diagonal(_)));
    }
}
