//! Dynamic stiffness `D(ω) = K − ω²M + iω(αM + βK)` of a large body: one sparse factorisation a frequency, no modes.

use std::sync::OnceLock;

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMat, SymbolicSparseColMat, Triplet};
use faer::{Mat, MatRef, c64};

use super::FemError;
use super::sparse::Csr;

/// `K` and `M` on one pattern, whose order of elimination is found once.
#[derive(Debug)]
pub struct DynamicStiffness {
    pattern: SymbolicSparseColMat<usize>,
    /// Entries of `K` and `M` in the order of the pattern.
    entries: Vec<(f64, f64)>,
    order: OnceLock<SymbolicLu<usize>>,
}

/// A factorised `D(ω)`.
#[derive(Debug)]
pub struct DynamicFactor(Lu<usize, c64>);

impl DynamicStiffness {
    /// Of symmetric matrices.
    pub fn new(k: &Csr, m: &Csr) -> Result<DynamicStiffness, FemError> {
        let n = k.n_rows();
        let of_k = k.triplets().map(|(i, j, v)| Triplet::new(i, j, c64::new(v, 0.0)));
        let of_m = m.triplets().map(|(i, j, v)| Triplet::new(i, j, c64::new(0.0, v)));
        let both: Vec<_> = of_k.chain(of_m).collect();
        let both = SparseColMat::<usize, c64>::try_new_from_triplets(n, n, &both)
            .map_err(|_| FemError::Singular { what: "dynamic stiffness" })?;
        let (pattern, values) = both.into_parts();
        let entries = values.iter().map(|v| (v.re, v.im)).collect();
        Ok(DynamicStiffness { pattern, entries, order: OnceLock::new() })
    }

    /// Factorise at a frequency, with the damping `αM + βK`.
    pub fn factor(&self, omega: f64, (alpha, beta): (f64, f64)) -> Result<DynamicFactor, FemError> {
        let failed = || FemError::Singular { what: "dynamic stiffness" };
        let value =
            |&(k, m): &(f64, f64)| c64::new(k - omega * omega * m, omega * (alpha * m + beta * k));
        let values: Vec<c64> = self.entries.iter().map(value).collect();
        let d = faer::sparse::SparseColMatRef::new(self.pattern.as_ref(), &values);
        let order = match self.order.get() {
            Some(order) => order.clone(),
            None => {
                let new = SymbolicLu::try_new(self.pattern.as_ref()).map_err(|_| failed())?;
                self.order.get_or_init(|| new).clone()
            }
        };
        let lu = Lu::try_new_with_symbolic(order, d).map_err(|_| failed())?;
        Ok(DynamicFactor(lu))
    }
}

impl DynamicFactor {
    /// `D⁻¹ B`; fails where `D` is singular.
    pub fn solve(&self, b: MatRef<c64>) -> Result<Mat<c64>, FemError> {
        let x = self.0.solve(b);
        let finite = (0..x.ncols()).all(|j| x[(0, j)].re.is_finite() && x[(0, j)].im.is_finite());
        match finite {
            true => Ok(x),
            false => Err(FemError::Singular { what: "dynamic stiffness" }),
        }
    }
}
