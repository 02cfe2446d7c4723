//! What singles out some of the orbits of a family: a scalar that vanishes at folds, period doublings, Neimark–Sacker points.
//!
//! With the derivative `X` of the period map, `A = X − 1` at a fold, `X + 1` at a doubling and `X − e^{iθ}` where a pair of multipliers leaves the unit circle is singular. The scalar
//! `g` of
//!
//! ```text
//! [A  b; cᴴ 0] (v; g) = (0; 1)
//! ```
//!
//! is zero there, and smooth around; `b` and `c` are near the singular vectors of `A`. Source: Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, ch. 4.

use std::f64::consts::PI;

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};

use super::OrbitError;
use super::floquet::multipliers;
use crate::continuation::norm;
use crate::fem::dense::product;
use crate::records::CurveOf;

impl CurveOf {
    /// How many scalars vanish.
    pub(super) fn scalars(self) -> usize {
        if self == CurveOf::Torus { 2 } else { 1 }
    }

    /// Unknowns besides the orbit, its frequency and the parameter.
    pub(super) fn unknowns(self) -> usize {
        self.scalars() - 1
    }

    /// `A`; with a pair of multipliers `[Re A, −Im A; Im A, Re A]`.
    pub(super) fn matrix(self, x_less_one: &Mat<f64>, theta: f64) -> Mat<f64> {
        let n = x_less_one.nrows();
        let (re, im) = match self {
            CurveOf::Doubling => (2.0, 0.0),
            CurveOf::Torus => (1.0 - theta.cos(), -theta.sin()),
            _ => (0.0, 0.0),
        };
        let real = |i: usize, k: usize| x_less_one[(i, k)] + re * f64::from(u8::from(i == k));
        let imaginary = |i: usize, k: usize| im * f64::from(u8::from(i == k));
        let size = n * self.scalars();
        Mat::from_fn(size, size, |i, k| match (i / n, k / n) {
            (0, 0) | (1, 1) => real(i % n, k % n),
            (0, _) => -imaginary(i, k % n),
            _ => imaginary(i % n, k),
        })
    }
}

/// The angle of the multipliers nearest to the unit circle among the complex ones of `X − 1`, if there are such.
pub(super) fn angle(x_less_one: &Mat<f64>) -> Result<Option<f64>, OrbitError> {
    let n = x_less_one.nrows();
    let x = Mat::from_fn(n, n, |i, k| x_less_one[(i, k)] + f64::from(u8::from(i == k)));
    let all = multipliers(&x)?;
    let off = |m: &(f64, f64)| (m.0.hypot(m.1) - 1.0).abs();
    let pair = all.iter().filter(|m| m.1 > 0.0).min_by(|a, b| off(a).total_cmp(&off(b)));
    Ok(pair.map(|m| m.1.atan2(m.0)).filter(|theta| (0.0..PI).contains(theta)))
}

/// The singular vector of a matrix for its least singular value: what it takes to nothing, if it does so.
pub(super) fn null_vector(a: &Mat<f64>) -> Result<Vec<f64>, OrbitError> {
    let svd = a.svd().map_err(|_| OrbitError::Eigen("singular vectors of the monodromy matrix"))?;
    let (v, last) = (svd.V(), a.nrows() - 1);
    Ok((0..a.nrows()).map(|i| v[(i, last)]).collect())
}

/// `b` and `c`, of one column, or of two where `A` is complex.
#[derive(Debug, Clone)]
pub(super) struct Borders {
    b: Mat<f64>,
    c: Mat<f64>,
}

/// The columns of a vector: with `[Re, −Im; Im, Re]` of a complex one.
fn columns(v: &[f64], complex: bool) -> Mat<f64> {
    let n = v.len() / 2;
    match complex {
        false => Mat::from_fn(v.len(), 1, |i, _| v[i]),
        true => Mat::from_fn(2 * n, 2, |i, k| match (i < n, k) {
            (_, 0) => v[i],
            (true, _) => -v[i + n],
            (false, _) => v[i - n],
        }),
    }
}

impl Borders {
    /// The singular vectors of `A` for its least singular value.
    pub fn of(a: &Mat<f64>, of: CurveOf) -> Result<Borders, OrbitError> {
        let failed = |_| OrbitError::Eigen("singular vectors of the monodromy matrix");
        let svd = a.svd().map_err(failed)?;
        let last = a.nrows() - 1;
        let singular =
            |m: MatRef<f64>| -> Vec<f64> { (0..a.nrows()).map(|i| m[(i, last)]).collect() };
        let complex = of == CurveOf::Torus;
        Ok(Borders {
            b: columns(&singular(svd.U()), complex),
            c: columns(&singular(svd.V()), complex),
        })
    }

    /// `[A b; cᵀ 0]` or its transpose, and the solution for `(0; 1)`.
    fn solve(&self, a: &Mat<f64>, transposed: bool) -> Mat<f64> {
        let (n, k) = (a.nrows(), self.b.ncols());
        let (right, below) = if transposed { (&self.c, &self.b) } else { (&self.b, &self.c) };
        let bordered = Mat::from_fn(n + k, n + k, |i, j| match (i < n, j < n) {
            (true, true) => {
                if transposed {
                    a[(j, i)]
                } else {
                    a[(i, j)]
                }
            }
            (true, false) => right[(i, j - n)],
            (false, true) => below[(j, i - n)],
            (false, false) => 0.0,
        });
        let unit = Mat::from_fn(n + k, k, |i, j| f64::from(u8::from(i == n + j)));
        bordered.partial_piv_lu().solve(&unit)
    }

    /// `g`: its real and imaginary part where `A` is complex.
    pub fn scalars(&self, a: &Mat<f64>) -> Vec<f64> {
        let n = a.nrows();
        let solution = self.solve(a, false);
        (0..self.b.ncols()).map(|i| solution[(n + i, 0)]).collect()
    }

    /// The borders for a matrix near the last one: `v` and `w` of the bordered systems, which have the sides of the last ones.
    pub fn renewed(&self, a: &Mat<f64>) -> Borders {
        let n = a.nrows();
        let complex = self.b.ncols() == 2;
        let vector = |transposed: bool, last: &Mat<f64>| {
            let solution = self.solve(a, transposed);
            let v: Vec<f64> = (0..n).map(|i| solution[(i, 0)]).collect();
            let length = norm(&v);
            let v: Vec<f64> = v.iter().map(|x| x / length).collect();
            let new = columns(&v, complex);
            let side = product(last.transpose(), new.as_ref())[(0, 0)];
            match complex || side > 0.0 {
                true => new,
                false => -new,
            }
        };
        Borders { c: vector(false, &self.c), b: vector(true, &self.b) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix with given real multipliers and a pair on a circle, in a basis that is not orthogonal.
    fn map(radius: f64, theta: f64) -> Mat<f64> {
        let (c, s) = (radius * theta.cos(), radius * theta.sin());
        let d = Mat::from_fn(4, 4, |i, k| match (i, k) {
            (0, 0) => 0.3,
            (1, 1) => -0.6,
            (2, 2) | (3, 3) => c,
            (2, 3) => -s,
            (3, 2) => s,
            _ => 0.0,
        });
        let t = Mat::from_fn(4, 4, |i, k| {
            f64::from(u8::from(i == k)) + 0.1 * ((3 * i + k) as f64).sin()
        });
        let inverse = t.partial_piv_lu().solve(&Mat::<f64>::identity(4, 4));
        let x = &t * &d * &inverse;
        Mat::from_fn(4, 4, |i, k| x[(i, k)] - f64::from(u8::from(i == k)))
    }

    #[test]
    fn scalars_vanish_on_the_unit_circle_and_only_there() {
        let on = map(1.0, 0.7);
        let theta = angle(&on).unwrap().unwrap();
        assert!((theta - 0.7).abs() < 1e-12);
        let torus = CurveOf::Torus;
        let borders = Borders::of(&torus.matrix(&on, theta), torus).unwrap();
        let g = borders.scalars(&torus.matrix(&on, theta));
        assert!(g[0].hypot(g[1]) < 1e-13, "{g:?}");
        // off the circle, or at another angle, by what is missing
        for (radius, theta) in [(1.01, 0.7), (1.0, 0.71)] {
            let g = borders.scalars(&torus.matrix(&map(radius, 0.7), theta));
            let off = g[0].hypot(g[1]);
            assert!(off > 2e-3 && off < 2e-2, "{off}");
        }
        let renewed = borders.renewed(&torus.matrix(&map(1.01, 0.7), 0.7));
        let g = renewed.scalars(&torus.matrix(&on, theta));
        assert!(g[0].hypot(g[1]) < 1e-13, "{g:?}");
    }
}
