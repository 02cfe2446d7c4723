//! The shortest step of a linear system that may be singular.
//!
//! Friction holds a body wherever it comes to rest: an orbit with points that never slip, or of a body that friction alone keeps from sliding away, is a member of a family of
//! residual positions. Each is a multiplier +1, the derivative of `x(T) − x(0)` is singular along it, and of all members Newton's method goes to the one that
//! asks for the least change.

use faer::Mat;

use super::OrbitError;

/// Singular values below this, over the largest, are zero.
const CUT: f64 = 1e-9;

/// The shortest `x` that makes `‖A x − b‖` least.
pub fn least_change(a: &Mat<f64>, b: &[f64]) -> Result<Vec<f64>, OrbitError> {
    let failed = |_| OrbitError::Eigen("singular values");
    let svd = a.thin_svd().map_err(failed)?;
    let (u, s, v) = (svd.U(), svd.S().column_vector(), svd.V());
    let least = CUT * s.iter().fold(0.0f64, |m, s| m.max(*s));
    let mut x = vec![0.0; a.ncols()];
    for (k, &s) in s.iter().enumerate().filter(|(_, s)| **s > least) {
        let along: f64 = (0..a.nrows()).map(|i| u[(i, k)] * b[i]).sum::<f64>() / s;
        x.iter_mut().enumerate().for_each(|(j, x)| *x += along * v[(j, k)]);
    }
    Ok(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_all_solutions_the_shortest_is_taken() {
        // x + y = 2, and nothing about the third
        let a = Mat::from_fn(3, 3, |i, j| f64::from(u8::from(i == 0 && j < 2)));
        let x = least_change(&a, &[2.0, 0.0, 0.0]).unwrap();
        for (x, y) in x.iter().zip([1.0, 1.0, 0.0]) {
            assert!((x - y).abs() < 1e-14, "{x}");
        }
    }
}
