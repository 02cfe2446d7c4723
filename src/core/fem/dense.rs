//! Products of dense matrices, on one thread: results must not depend on how many there are.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

/// `A B`
pub fn product(a: MatRef<f64>, b: MatRef<f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(c.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    c
}
