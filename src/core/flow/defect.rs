//! How far computed modes are from being those of a phase: what rounding has left (theory §12, H4).

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

use crate::fem::Csr;

/// What rounding has left of an eigensolution (theory §12, H4), estimated along some vectors.
#[derive(Debug, Clone, Copy)]
pub struct Defect {
    /// `‖KΦ − MΦΛ‖` in the norm of `M⁻¹`.
    pub residual: f64,
    /// `‖ΦᵀMΦ − I‖`
    pub orthogonality: f64,
}

impl Defect {
    /// Of `(K, M)` with the modes `Φ`, `inverse` is `ΦᵀM`; only the first `moving` coordinates are modes. Of a vector `z` of random signs `‖Az‖²` is `‖A‖²` (Frobenius) on the average: the largest of
    /// some, twice.
    pub fn of(
        k: &Csr,
        omega: &[f64],
        (shapes, inverse): (&Mat<f64>, &Mat<f64>),
        moving: usize,
    ) -> Defect {
        /// Vectors that are tried.
        const PROBES: u64 = 4;
        let n = omega.len();
        let mut defect = Defect { residual: 0.0, orthogonality: 0.0 };
        let mut bits = 0x9e37_79b9_7f4a_7c15u64;
        let norm = |x: &[f64]| 2.0 * dot(x, x).sqrt();
        for _ in 0..PROBES {
            let mut sign = || {
                // xorshift
                bits ^= bits << 13;
                bits ^= bits >> 7;
                bits ^= bits << 17;
                if bits >> 40 & 1 == 0 { 1.0 } else { -1.0 }
            };
            let z: Vec<f64> = (0..n).map(|_| sign()).collect();
            // Φz and ΦΛz; what ΦᵀM makes of both
            let scaled: Vec<f64> = z.iter().zip(omega).map(|(z, w)| z * w * w).collect();
            let (mut x, mut back) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
            product(shapes, &[z.clone(), scaled].concat(), &mut x);
            product(inverse, &x, &mut back);
            let rest: Vec<f64> = back.iter().zip(&z).map(|(b, z)| b - z).collect();
            defect.orthogonality = defect.orthogonality.max(norm(&rest));
            let mut kx = vec![0.0; n];
            k.mul(&x[..n], &mut kx);
            let projected = transposed(shapes, &kx);
            let both = projected.iter().zip(&back[n..]).take(moving);
            let rest: Vec<f64> = both.map(|(p, b)| p - b).collect();
            defect.residual = defect.residual.max(norm(&rest));
        }
        defect
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `Aᵀ x`
pub(super) fn transposed(a: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    (0..a.ncols()).map(|j| dot(a.col_as_slice(j), x)).collect()
}

/// `Y = A X` for the two columns of `X`, one after the other in memory.
pub(super) fn product(a: &Mat<f64>, x: &[f64], y: &mut [f64]) {
    let n = a.ncols();
    let x = MatRef::from_column_major_slice(x, n, 2);
    let y = MatMut::from_column_major_slice_mut(y, a.nrows(), 2);
    matmul(y, Accum::Replace, a.as_ref(), x, 1.0, Par::Seq);
}
