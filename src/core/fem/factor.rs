//! Cholesky's factors of symmetric positive definite matrices.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky};
use faer::{Conj, MatMut, Par};

use super::components::Components;
use super::simplicial::Analysed;
use super::sparse::{Csr, LARGE};
use super::{DofMap, FemError};

/// Cholesky factorisation `A = L Lᵀ` of a symmetric positive definite sparse matrix, or its diagonal.
///
/// Solving takes no memory from the allocator: the caller brings a [`SolveScratch`].
#[derive(Debug)]
pub enum SpdFactor {
    /// A diagonal matrix: the reciprocals.
    Diagonal(Vec<f64>),
    /// A sparse factor (faer, fill-reducing order).
    Sparse {
        /// Structure.
        symbolic: Box<SymbolicCholesky<usize>>,
        /// Values of `L`.
        values: Vec<f64>,
    },
    /// A matrix that falls apart.
    Components(Box<Components>),
}

/// Work space of [`SpdFactor::solve`].
pub struct SolveScratch {
    of_factor: MemBuffer,
    /// Vectors side by side.
    lanes: Vec<f64>,
}

impl std::fmt::Debug for SolveScratch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("SolveScratch")
    }
}

impl SpdFactor {
    /// Factorise; fails with [`FemError::NotPositiveDefinite`].
    pub fn new(a: &Csr, what: &'static str) -> Result<Self, FemError> {
        let failed = || FemError::NotPositiveDefinite { what };
        if let Some(d) = a.as_diagonal() {
            if d.iter().any(|&x| x.is_nan() || x <= 0.0) {
                return Err(failed());
            }
            return Ok(SpdFactor::Diagonal(d.iter().map(|x| 1.0 / x).collect()));
        }
        let analysed = Analysed::new(a, SupernodalThreshold::default()).ok_or_else(failed)?;
        let values = analysed.llt().ok_or_else(failed)?;
        Ok(SpdFactor::Sparse { symbolic: Box::new(analysed.symbolic), values })
    }

    /// The same of a mass matrix over the displacements of a numbering, or the first of them: it may couple none but those along one axis.
    pub fn of_mass(a: &Csr, dofs: &DofMap) -> Result<Self, FemError> {
        let what = "mass matrix";
        let stays = a.n_rows() < LARGE || a.as_diagonal().is_some();
        let parts = if stays { None } else { Components::new(a, &dofs.node_of_entries()) };
        match parts {
            Some(parts) => Ok(SpdFactor::Components(Box::new(
                parts.ok_or(FemError::NotPositiveDefinite { what })?,
            ))),
            None => SpdFactor::new(a, what),
        }
    }

    /// Work space for up to two right-hand sides.
    pub fn scratch(&self) -> SolveScratch {
        self.scratch_of(2)
    }

    /// Work space for that many right-hand sides.
    pub(crate) fn scratch_of(&self, columns: usize) -> SolveScratch {
        let (of_factor, lanes) = match self {
            SpdFactor::Diagonal(_) => (StackReq::EMPTY, 0),
            SpdFactor::Sparse { symbolic, .. } => {
                (symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq), 0)
            }
            SpdFactor::Components(parts) => (StackReq::EMPTY, parts.room()),
        };
        SolveScratch { of_factor: MemBuffer::new(of_factor), lanes: vec![0.0; lanes] }
    }

    /// `x ← A⁻¹ x`; vectors one after the other, as many as the work space is for.
    pub fn solve(&self, x: &mut [f64], scratch: &mut SolveScratch) {
        match self {
            SpdFactor::Diagonal(inverse) => {
                for part in x.chunks_exact_mut(inverse.len()) {
                    part.iter_mut().zip(inverse).for_each(|(x, d)| *x *= d);
                }
            }
            SpdFactor::Sparse { symbolic, values } => {
                let n = symbolic.nrows();
                let columns = x.len() / n;
                LltRef::<usize, f64>::new(symbolic, values).solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(x, n, columns),
                    Par::Seq,
                    MemStack::new(&mut scratch.of_factor),
                );
            }
            SpdFactor::Components(parts) => parts.solve(x, &mut scratch.lanes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laplacian(n: usize) -> Csr {
        let off = (1..n).flat_map(|i| [(i, i - 1, -1.0), (i - 1, i, -1.0)]);
        Csr::from_triplets(n, n, (0..n).map(|i| (i, i, 2.0)).chain(off).collect())
    }

    #[test]
    fn factor_solves() {
        let a = laplacian(200);
        let f = SpdFactor::new(&a, "test").unwrap();
        let x0: Vec<f64> = (0..200).map(|i| (i as f64 * 0.37).sin()).collect();
        let mut x = vec![0.0; 200];
        a.mul(&x0, &mut x);
        f.solve(&mut x, &mut f.scratch());
        let worst = x.iter().zip(&x0).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-11, "{worst}");
    }

    #[test]
    fn indefinite_is_an_error() {
        let a = Csr::from_triplets(2, 2, vec![(0, 0, 1.0), (0, 1, 2.0), (1, 0, 2.0), (1, 1, 1.0)]);
        assert!(SpdFactor::new(&a, "test").is_err());
    }
}
