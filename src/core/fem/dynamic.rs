//! Dynamic stiffness `D(ω) = K − ω²M + iω(αM + βK)` of a large body: one sparse factorisation a frequency, no modes.

use std::sync::OnceLock;

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMat, SymbolicSparseColMat, Triplet};
use faer::{Mat, MatRef, c64};

use super::FemError;
use super::sparse::Csr;

/// `K`, `M` and what damps on one pattern, whose order of elimination is found once.
#[derive(Debug)]
pub struct DynamicStiffness {
    pattern: SymbolicSparseColMat<usize>,
    /// Entries of `K`, `M`, of what stiffness-proportional damping is proportional to, and of dampers, in the order of the pattern.
    entries: Vec<[f64; 4]>,
    order: OnceLock<SymbolicLu<usize>>,
}

/// A factorised `D(ω)`.
#[derive(Debug)]
pub struct DynamicFactor(Lu<usize, c64>);

impl DynamicStiffness {
    /// Of symmetric matrices; `damps` is what stiffness-proportional damping is proportional to, where it is not `K`, `dampers` the matrix of viscous elements.
    pub fn new(
        (k, m): (&Csr, &Csr),
        damps: Option<&Csr>,
        dampers: Option<&Csr>,
    ) -> Result<DynamicStiffness, FemError> {
        let n = k.n_rows();
        let (damps, none) = (damps.unwrap_or(k), Csr::from_triplets(n, n, vec![]));
        let dampers = dampers.unwrap_or(&none);
        // all on one pattern
        let sum = |[of_k, of_m, of_c, of_w]: [c64; 4]| {
            let parts = [(k, of_k), (m, of_m), (damps, of_c), (dampers, of_w)];
            let entries = parts
                .iter()
                .flat_map(|&(a, c)| a.triplets().map(move |(i, j, v)| Triplet::new(i, j, c * v)));
            SparseColMat::<usize, c64>::try_new_from_triplets(n, n, &entries.collect::<Vec<_>>())
                .map_err(|_| FemError::Singular { what: "dynamic stiffness" })
        };
        let (zero, one, i) = (c64::new(0.0, 0.0), c64::new(1.0, 0.0), c64::new(0.0, 1.0));
        let (pattern, of_both) = sum([one, i, zero, zero])?.into_parts();
        let (_, of_damping) = sum([zero, zero, one, i])?.into_parts();
        let both = of_both.iter().zip(&of_damping);
        let entries = both.map(|(v, c)| [v.re, v.im, c.re, c.im]).collect();
        Ok(DynamicStiffness { pattern, entries, order: OnceLock::new() })
    }

    /// Factorise at a frequency, with the damping `αM + βK` beside that of the dampers.
    pub fn factor(&self, omega: f64, (alpha, beta): (f64, f64)) -> Result<DynamicFactor, FemError> {
        let failed = || FemError::Singular { what: "dynamic stiffness" };
        let value = |&[k, m, c, w]: &[f64; 4]| {
            c64::new(k - omega * omega * m, omega * (alpha * m + beta * c + w))
        };
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
