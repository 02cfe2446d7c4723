//! The factor of one Newton step serves the next ones: from one to the next the matrix changes little, and corrections with an older factor solve with the present
//! one, `x ← x + M⁻¹ (b − A x)`, at a cost that grows like its order squared.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::{Mat, Par};

/// Below this order a factor costs no more than what would be saved.
const LARGE: usize = 600;
/// Each correction must leave no more than this part of what there was; a matrix that has changed more is factored anew.
const SHRINKS: f64 = 0.3;
/// What is left of the first residual where corrections end: with a quadratic step behind it there is nothing to be had from more. So much is enough where rounding
/// errors leave no less.
const ENOUGH: (f64, f64) = (1e-6, 0.05);

/// `P A = L U`, both factors in one matrix.
pub(super) struct Factored {
    lu: Mat<f64>,
    forth: Vec<usize>,
    back: Vec<usize>,
}

impl Factored {
    /// In the place of the matrix.
    pub fn new(a: Mat<f64>) -> Factored {
        let n = a.nrows();
        let (mut lu, mut forth, mut back) = (a, vec![0usize; n], vec![0usize; n]);
        let size = factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default());
        let mut memory = MemBuffer::new(size);
        let (stack, params) = (MemStack::new(&mut memory), Default::default());
        factor::lu_in_place(lu.as_mut(), &mut forth, &mut back, Par::Seq, stack, params);
        Factored { lu, forth, back }
    }

    /// `A⁻¹ b`, in the place of `b`.
    pub fn solve(&self, mut b: Mat<f64>) -> Mat<f64> {
        let n = self.lu.nrows();
        let size = solve::solve_in_place_scratch::<usize, f64>(n, b.ncols(), Par::Seq);
        let mut memory = MemBuffer::new(size);
        let (stack, lu) = (MemStack::new(&mut memory), self.lu.as_ref());
        let rows = PermRef::new_checked(&self.forth, &self.back, n);
        solve::solve_in_place(lu, lu, rows, b.as_mut(), Par::Seq, stack);
        b
    }

    /// Whether it may serve other matrices of an order.
    pub fn is_worth_keeping(&self) -> bool {
        self.lu.nrows() >= LARGE
    }

    /// `x` of `A x = b`, of which residuals `b − A x` are given, from a guess; none where `A` is too far from what was factored.
    pub fn corrected(
        &self,
        mut x: Mat<f64>,
        residual: impl Fn(&Mat<f64>) -> Mat<f64>,
    ) -> Option<Mat<f64>> {
        if x.nrows() != self.lu.nrows() {
            return None;
        }
        let mut left = residual(&x);
        let first = left.norm_l2();
        let mut now = first;
        while now > ENOUGH.0 * first {
            let there = &x + self.solve(left);
            left = residual(&there);
            let next = left.norm_l2();
            if next.is_nan() || next > SHRINKS * now {
                return (now <= ENOUGH.1 * first).then_some(x);
            }
            (x, now) = (there, next);
        }
        Some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize, change: f64) -> Mat<f64> {
        Mat::from_fn(n, n, |i, j| {
            let of = |k: f64| (k * (1.3 * i as f64 - 0.7 * j as f64 * j as f64)).sin();
            let diagonal = if i == j { 3.0 } else { 0.0 };
            diagonal + (of(1.0) + change * of(0.37)) / (n as f64).sqrt()
        })
    }

    /// With the factor of a neighbour the solution is the matrix's own, and where the neighbour is too far it is said.
    #[test]
    fn an_older_factor_solves_with_the_present_matrix() {
        let n = 40;
        let old = Factored::new(matrix(n, 0.0));
        assert!(!old.is_worth_keeping());
        let exact = Mat::from_fn(n, 1, |i, _| (0.9 * i as f64).cos());
        for (change, is_near) in [(0.0, true), (1e-3, true), (0.1, true), (8.0, false)] {
            let a = matrix(n, change);
            let b = &a * &exact;
            let found = old.corrected(Mat::zeros(n, 1), |x| &b - &a * x);
            assert_eq!(found.is_some(), is_near, "{change}");
            if let Some(found) = found {
                assert!((found - &exact).norm_max() < 1e-5, "{change}");
            }
        }
        assert!(old.corrected(Mat::zeros(n + 1, 1), |x| x.clone()).is_none());
    }

    #[test]
    fn a_factor_solves_to_rounding() {
        let a = matrix(30, 0.4);
        let exact = Mat::from_fn(30, 2, |i, j| (i as f64 - 7.0 * j as f64).cos());
        let found = Factored::new(a.clone()).solve(&a * &exact);
        assert!((found - exact).norm_max() < 1e-13);
    }
}
