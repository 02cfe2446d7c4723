//! The shortest step of a linear system that may be singular.
//!
//! Friction holds a body wherever it comes to rest: an orbit with points that never slip, or of a body that friction alone keeps from sliding away, is a member of a family of
//! residual positions. Each is a multiplier +1, the derivative of `x(T) − x(0)` is singular along it, and of all members Newton's method goes to the one that
//! asks for the least change.

use faer::linalg::solvers::Solve;
use faer::linalg::triangular_solve;
use faer::{Mat, MatRef, Par};

use super::OrbitError;

/// Singular values below this, over the largest, are zero.
const CUT: f64 = 1e-9;

/// The shortest `x` that makes `‖A x − b‖` least.
pub fn least_change(a: &Mat<f64>, b: &[f64]) -> Result<Vec<f64>, OrbitError> {
    match of_triangle(a, b).or_else(|| of_pivots(a, b)) {
        Some(x) => Ok(x),
        None => by_singular_values(a, b),
    }
}

/// The same from a triangle `Qᵀ A = [R₁₁ R₁₂; 0 0]` whose last columns alone depend on the others, as those of rigid motions do, if `R` is such.
fn of_triangle(a: &Mat<f64>, b: &[f64]) -> Option<Vec<f64>> {
    let qr = a.qr();
    shortest(qr.thin_R(), &qr.compute_thin_Q(), b)
}

/// The same with the columns in an order that leaves those that depend on others to the end.
fn of_pivots(a: &Mat<f64>, b: &[f64]) -> Option<Vec<f64>> {
    let qr = a.col_piv_qr();
    let y = shortest(qr.thin_R(), &qr.compute_thin_Q(), b)?;
    let (order, _) = qr.P().arrays();
    let mut x = vec![0.0; y.len()];
    order.iter().zip(y).for_each(|(&place, y)| x[place] = y);
    Some(x)
}

/// The shortest `x` for `A = QR`, if the columns of `R` that depend on others stand last, and no other nearly does.
fn shortest(r: MatRef<f64>, q: &Mat<f64>, b: &[f64]) -> Option<Vec<f64>> {
    let n = r.ncols();
    let size = |k: usize| r[(k, k)].abs();
    let most = (0..n).fold(0.0f64, |m, k| m.max(size(k)));
    let rank = (0..n).find(|k| size(*k) <= CUT * most).unwrap_or(n);
    // a small singular value may hide behind larger entries of R
    let is_regular = (0..rank).all(|k| size(k) > CUT.sqrt() * most);
    let is_zero = (rank..n).all(|j| (rank..n).all(|i| r[(i, j)].abs() <= CUT * most));
    if !is_regular || !is_zero {
        return None;
    }
    let solve = |mut x: Mat<f64>| {
        triangular_solve::solve_upper_triangular_in_place(
            r.submatrix(0, 0, rank, rank),
            x.as_mut(),
            Par::Seq,
        );
        x
    };
    let onto = q.transpose() * Mat::from_fn(b.len(), 1, |i, _| b[i]);
    let mut x = Mat::<f64>::zeros(n, 1);
    x.subrows_mut(0, rank).copy_from(solve(onto.subrows(0, rank).to_owned()));
    if rank < n {
        // less its part along what A does not see, [−R₁₁⁻¹R₁₂; 1]
        let above = solve(r.submatrix(0, rank, rank, n - rank).to_owned());
        let unseen = Mat::from_fn(n, n - rank, |i, j| match i < rank {
            true => -above[(i, j)],
            false => f64::from(u8::from(i - rank == j)),
        });
        let among = unseen.transpose() * &unseen;
        let share = among.partial_piv_lu().solve(unseen.transpose() * &x);
        x -= unseen * share;
    }
    Some(x.col_as_slice(0).to_vec())
}

fn by_singular_values(a: &Mat<f64>, b: &[f64]) -> Result<Vec<f64>, OrbitError> {
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

    #[test]
    fn both_ways_are_one() {
        let value = |i: usize, j: usize| ((7 * i + 3 * j * j + i * j) % 11) as f64 - 4.0;
        // the last two columns depend on the first ones, or none does
        let of_first =
            |i: usize, j: usize| value(i, 0) * j as f64 - value(i, 2) + 0.5 * value(i, 1);
        let b = [1.0, -2.0, 0.5, 3.0, 0.0, 1.5];
        for rank in [3, 5] {
            let a = Mat::from_fn(6, 5, |i, j| if j < rank { value(i, j) } else { of_first(i, j) });
            let quick = of_triangle(&a, &b).unwrap();
            let slow = by_singular_values(&a, &b).unwrap();
            for (x, y) in quick.iter().zip(&slow) {
                assert!((x - y).abs() < 1e-12, "{rank}: {x} {y}");
            }
        }
        // the second column is the first one
        let twice = Mat::from_fn(6, 5, |i, j| value(i, if j == 1 { 0 } else { j }));
        assert!(of_triangle(&twice, &b).is_none());
        let (quick, slow) =
            (of_pivots(&twice, &b).unwrap(), by_singular_values(&twice, &b).unwrap());
        for (x, y) in quick.iter().zip(&slow) {
            assert!((x - y).abs() < 1e-12, "{x} {y}");
        }
    }
}
