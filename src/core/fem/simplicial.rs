//! Factors of sparse symmetric matrices (faer's, in an order that keeps them sparse), and those that go column by column.

use faer::Par;
use faer::Side;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, Triplet};
use pulp::{Arch, Simd, WithSimd};

use super::sparse::Csr;

/// A matrix with what is known of its factor before that is computed, in an order that keeps it sparse.
#[derive(Debug)]
pub(super) struct Analysed {
    matrix: SparseColMat<usize, f64>,
    pub symbolic: SymbolicCholesky<usize>,
}

impl Analysed {
    /// `threshold`: when columns of one structure are taken together.
    pub fn new(a: &Csr, threshold: SupernodalThreshold) -> Option<Analysed> {
        let n = a.n_rows();
        let entries: Vec<_> = a.triplets().map(|(i, j, v)| Triplet::new(i, j, v)).collect();
        let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &entries).ok()?;
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: threshold,
            ..CholeskySymbolicParams::default()
        };
        let (side, order) = (Side::Lower, SymmetricOrdering::Amd);
        let symbolic =
            factorize_symbolic_cholesky(matrix.symbolic(), side, order, parameters).ok()?;
        Some(Analysed { matrix, symbolic })
    }

    /// The values of `L` of `A = L Lᵀ`; none where the matrix is not positive definite.
    pub fn llt(&self) -> Option<Vec<f64>> {
        let symbolic = &self.symbolic;
        let mut values = vec![0.0; symbolic.len_val()];
        let mut scratch = MemBuffer::new(
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
        );
        symbolic
            .factorize_numeric_llt::<f64>(
                &mut values,
                self.matrix.as_ref(),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut scratch),
                Default::default(),
            )
            .ok()?;
        Some(values)
    }
}

/// The pivots `D` of `A = L D Lᵀ` without exchanges for size, with the rows that they belong to; none where one of them is zero or no number.
pub(crate) fn ldl_pivots(
    a: &Csr,
    regularization: LdltRegularization<f64>,
) -> Option<Vec<(usize, f64)>> {
    let n = a.n_rows();
    let Analysed { matrix, symbolic } = Analysed::new(a, SupernodalThreshold::FORCE_SIMPLICIAL)?;
    let (SymbolicCholeskyRaw::Simplicial(columns), Some(order)) = (symbolic.raw(), symbolic.perm())
    else {
        return None;
    };
    let mut values = vec![0.0; symbolic.len_val()];
    let mut scratch = MemBuffer::new(
        symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default()),
    );
    symbolic
        .factorize_numeric_ldlt::<f64>(
            &mut values,
            matrix.as_ref(),
            Side::Lower,
            regularization,
            Par::Seq,
            MemStack::new(&mut scratch),
            Default::default(),
        )
        .ok()?;
    let (forward, _) = order.arrays();
    let pivots: Vec<(usize, f64)> =
        (0..n).map(|k| (forward[k], values[columns.col_ptr()[k]])).collect();
    pivots.iter().all(|p| !p.1.is_nan()).then_some(pivots)
}

/// `P A Pᵀ = L Lᵀ`, for several vectors side by side.
#[derive(Debug)]
pub(super) struct Lower {
    /// The row of `A` of each row of `L`.
    pub order: Vec<usize>,
    /// Where the columns of `L` begin, below the diagonal.
    start: Vec<usize>,
    rows: Vec<u32>,
    values: Vec<f64>,
    /// Reciprocals of the diagonal.
    inverse: Vec<f64>,
}

impl Lower {
    /// None where the matrix is not positive definite.
    pub fn new(a: &Csr) -> Option<Lower> {
        let n = a.n_rows();
        let analysed = Analysed::new(a, SupernodalThreshold::FORCE_SIMPLICIAL)?;
        let symbolic = &analysed.symbolic;
        let (SymbolicCholeskyRaw::Simplicial(columns), Some(order)) =
            (symbolic.raw(), symbolic.perm())
        else {
            return None;
        };
        let all = analysed.llt()?;
        let (forward, _) = order.arrays();
        let mut lower = Lower {
            order: forward.to_vec(),
            start: vec![0],
            rows: Vec::with_capacity(all.len() - n),
            values: Vec::with_capacity(all.len() - n),
            inverse: Vec::with_capacity(n),
        };
        for column in columns.col_ptr().windows(2) {
            // the diagonal comes first
            let below = column[0] + 1..column[1];
            lower.inverse.push(1.0 / all[column[0]]);
            lower.rows.extend(columns.row_idx()[below.clone()].iter().map(|i| *i as u32));
            lower.values.extend(&all[below]);
            lower.start.push(lower.rows.len());
        }
        lower.inverse.iter().all(|d| d.is_finite() && *d > 0.0).then_some(lower)
    }

    /// Rows.
    pub fn n(&self) -> usize {
        self.inverse.len()
    }

    /// `x ← (L Lᵀ)⁻¹ x` of `N` vectors: every entry of `L` is read once for all of them.
    pub fn solve<const N: usize>(&self, arch: Arch, x: &mut [[f64; N]]) {
        arch.dispatch(Solution { lower: self, x });
    }

    fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let own = self.start[j]..self.start[j + 1];
        self.rows[own.clone()].iter().map(|i| *i as usize).zip(self.values[own].iter().copied())
    }
}

struct Solution<'a, const N: usize> {
    lower: &'a Lower,
    x: &'a mut [[f64; N]],
}

impl<const N: usize> WithSimd for Solution<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Solution { lower, x } = self;
        for j in 0..lower.n() {
            let own = x[j].map(|x| x * lower.inverse[j]);
            x[j] = own;
            for (i, l) in lower.column(j) {
                let other = &mut x[i];
                (0..N).for_each(|v| other[v] -= l * own[v]);
            }
        }
        for j in (0..lower.n()).rev() {
            let mut own = x[j];
            for (i, l) in lower.column(j) {
                let other = x[i];
                (0..N).for_each(|v| own[v] -= l * other[v]);
            }
            x[j] = own.map(|x| x * lower.inverse[j]);
        }
    }
}
