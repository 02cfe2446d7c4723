//! Eigenvalues and eigenvectors of a phase that natural modes do not decouple:
//!
//! ```text
//! A = [0, S; −K̂ S⁻¹, −D]    over x = (S q, q̇),        A U = U Λ,      W = U⁻¹
//! ```
//!
//! Of complex pairs the ones with `Im λ ≥ 0` are kept. Where the damping is proportional to the mass, `D = αI`, an eigenproblem of half the size does: `K̂ φ = κ φ`, and
//! `λ² + αλ + κ = 0` for each of its eigenvalues, with
//!
//! ```text
//! U = (S φ, λ φ),      W = ψ (−λ′ S⁻¹, I)/(λ − λ′),      ψ the row of Φ⁻¹, λ′ the other root
//! ```

use faer::linalg::solvers::{DenseSolveCore, Eigen};
use faer::{Mat, MatRef};
use nalgebra::Complex;

use super::coupled::Operators;
use crate::fem::FemError;
use crate::fem::dense::product;

type C = Complex<f64>;

/// Largest condition number of an eigenvalue, `‖W_k‖ ‖U_k‖`: beyond it the eigenvectors are too nearly dependent to be computed with.
const CONDITION: f64 = 1e7;

/// The eigenvalues with `Im λ ≥ 0`.
pub(super) struct Eigenpairs {
    pub lambda: Vec<C>,
    /// `U`, `2n × p`.
    pub right: Mat<C>,
    /// `W`, `p × 2n`.
    pub left: Mat<C>,
    /// `‖U‖ ‖W‖` of all eigenvectors, the conjugate ones too.
    pub spread: f64,
}

/// The root of the sum of squares.
fn size(x: impl Iterator<Item = C>) -> f64 {
    x.map(|x| x.norm_sqr()).sum::<f64>().sqrt()
}

/// `A`
pub(super) fn companion(operators: &Operators, scale: &[f64]) -> Mat<f64> {
    let n = scale.len();
    let (k, d) = (&operators.stiffness, &operators.damping);
    Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) => 0.0,
        (true, false) if i == j - n => scale[i],
        (true, false) => 0.0,
        (false, true) => -k[(i - n, j)] / scale[j],
        (false, false) => -d[(i - n, j - n)],
    })
}

/// `α` of a damping `αI`.
fn of_mass(d: &Mat<f64>) -> Option<f64> {
    let n = d.nrows();
    let alpha = if n > 0 { d[(0, 0)] } else { 0.0 };
    let is_plain =
        |(i, j): (usize, usize)| if i == j { d[(i, j)] == alpha } else { d[(i, j)] == 0.0 };
    (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).all(is_plain).then_some(alpha)
}

/// Pairs that give the matrix back worse than this, over its size, are not those of the motions: of nearly dependent vectors digits are lost that no bound of a single one tells.
const OFF: f64 = 1e-10;

impl Eigenpairs {
    /// Those of a phase; `a` is its `A`.
    pub fn of(operators: &Operators, a: &Mat<f64>, scale: &[f64]) -> Result<Eigenpairs, FemError> {
        let n = scale.len();
        let pairs = match of_mass(&operators.damping) {
            Some(alpha) => Self::of_stiffness(&operators.stiffness, alpha, scale),
            None => Self::of_companion(a),
        };
        let pairs = pairs.ok_or(FemError::Eigen { size: 2 * n, wanted: 2 * n })?;
        for k in 0..pairs.lambda.len() {
            let right = size((0..2 * n).map(|i| pairs.right[(i, k)]));
            let condition = right * size((0..2 * n).map(|j| pairs.left[(k, j)]));
            // not a number where the eigenvectors are dependent
            if condition.is_nan() || condition > CONDITION {
                return Err(FemError::Dependent { size: n });
            }
        }
        match pairs.off(a) <= OFF * a.norm_l2() {
            true => Ok(pairs),
            false => Err(FemError::Dependent { size: n }),
        }
    }

    /// `‖A − Re(U Λ W)‖`, conjugates added.
    fn off(&self, a: &Mat<f64>) -> f64 {
        let (size, p) = self.right.shape();
        let twice = |k: usize| if self.lambda[k].im > 0.0 { 2.0 } else { 1.0 };
        let parts = [|x: C| x.re, |x: C| x.im];
        let turned = parts.map(|part| {
            Mat::from_fn(size, p, |i, k| part(self.right[(i, k)] * self.lambda[k] * twice(k)))
        });
        let left = parts.map(|part| Mat::from_fn(p, size, |k, j| part(self.left[(k, j)])));
        let [re, im] = [0, 1].map(|k| product(turned[k].as_ref(), left[k].as_ref()));
        (a - &re + &im).norm_l2()
    }

    /// By an eigenproblem of the size of the state.
    fn of_companion(a: &Mat<f64>) -> Option<Eigenpairs> {
        let eigen = Eigen::new_from_real(a.as_ref()).ok()?;
        let (u, values) = (eigen.U(), eigen.S());
        let w = u.partial_piv_lu().inverse();
        let size = u.nrows();
        let kept: Vec<usize> = (0..size).filter(|&i| values[i].im >= 0.0).collect();
        Some(Eigenpairs {
            lambda: kept.iter().map(|&k| values[k]).collect(),
            right: Mat::from_fn(size, kept.len(), |i, c| u[(i, kept[c])]),
            left: Mat::from_fn(kept.len(), size, |c, j| w[(kept[c], j)]),
            spread: u.norm_l2() * w.norm_l2(),
        })
    }

    /// By one of the size of the stiffness.
    fn of_stiffness(k: &Mat<f64>, alpha: f64, scale: &[f64]) -> Option<Eigenpairs> {
        let n = scale.len();
        let eigen = Eigen::new_from_real(k.as_ref()).ok()?;
        let (phi, values): (MatRef<C>, _) = (eigen.U(), eigen.S());
        let psi = phi.partial_piv_lu().inverse();
        // an eigenvalue of A, its other root, and which of Φ it belongs to
        let mut roots: Vec<(C, C, usize)> = vec![];
        for k in 0..n {
            let kappa = values[k];
            // the larger root first: the other is what κ leaves of it
            let root = (C::from(0.25 * alpha * alpha) - kappa).sqrt();
            let sides = [root - 0.5 * alpha, -root - 0.5 * alpha];
            let larger = sides[usize::from(sides[1].norm_sqr() > sides[0].norm_sqr())];
            let smaller = kappa / larger;
            // of real κ the roots are a pair, which is rounded as one, or real
            let is_real = kappa.im == 0.0;
            let rest = if is_real && larger.im != 0.0 { larger.conj() } else { smaller };
            for (one, other) in [(larger, rest), (rest, larger)] {
                if one.im > 0.0 || is_real && one.im == 0.0 {
                    roots.push((one, other, k));
                }
            }
        }
        let mut pairs = Eigenpairs {
            lambda: roots.iter().map(|r| r.0).collect(),
            right: Mat::zeros(2 * n, roots.len()),
            left: Mat::zeros(roots.len(), 2 * n),
            spread: 0.0,
        };
        let (mut of_right, mut of_left) = (0.0, 0.0);
        for (c, &(one, other, k)) in roots.iter().enumerate() {
            let length = size((0..2 * n).map(|i| match i < n {
                true => phi[(i, k)] * scale[i],
                false => phi[(i - n, k)] * one,
            }));
            for i in 0..n {
                pairs.right[(i, c)] = phi[(i, k)] * (scale[i] / length);
                pairs.right[(n + i, c)] = phi[(i, k)] * one / length;
                let psi = psi[(k, i)] * length / (one - other);
                pairs.left[(c, i)] = -psi * other / scale[i];
                pairs.left[(c, n + i)] = psi;
            }
            let times = if one.im > 0.0 { 2.0 } else { 1.0 };
            of_right += times;
            of_left += times * (0..2 * n).map(|j| pairs.left[(c, j)].norm_sqr()).sum::<f64>();
        }
        pairs.spread = (of_right * of_left).sqrt();
        Some(pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `Re(Σ U λ W)` over the pairs, conjugates added.
    fn composed(pairs: &Eigenpairs, size: usize) -> Mat<f64> {
        Mat::from_fn(size, size, |i, j| {
            let of = |k: usize| {
                let l = pairs.lambda[k];
                let z = pairs.right[(i, k)] * l * pairs.left[(k, j)];
                if l.im > 0.0 { 2.0 * z.re } else { z.re }
            };
            (0..pairs.lambda.len()).map(of).sum()
        })
    }

    #[test]
    fn both_ways_give_the_matrix_back() {
        // unsymmetric, with a complex pair and an overdamped mode
        let n = 4;
        let k = Mat::from_fn(n, n, |i, j| match (i, j) {
            (0, 1) => 0.9,
            (1, 0) => -0.8,
            (2, 3) => 0.3,
            _ if i == j => [2.0, 2.1, 0.01, 5.0][i],
            _ => 0.05,
        });
        let scale = [1.4, 1.5, 0.3, 2.2];
        let operators = |alpha: f64| Operators {
            stiffness: k.clone(),
            damping: Mat::from_fn(n, n, |i, j| if i == j { alpha } else { 0.0 }),
            skew: None,
        };
        for alpha in [0.0, 0.4] {
            let operators = operators(alpha);
            let a = companion(&operators, &scale);
            let half = Eigenpairs::of(&operators, &a, &scale).unwrap();
            let whole = Eigenpairs::of_companion(&a).unwrap();
            for pairs in [&half, &whole] {
                assert!((composed(pairs, 2 * n) - &a).norm_l2() < 1e-13 * a.norm_l2());
            }
            assert_eq!(half.lambda.len(), whole.lambda.len());
        }
    }
}
