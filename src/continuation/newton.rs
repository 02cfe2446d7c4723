//! Newton's method on `R(X) = 0`, `cᵀX = γ`.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::Family;

/// Most iterations of a corrector.
const ITERATIONS: usize = 12;

/// A corrected point.
#[derive(Debug, Clone)]
pub struct Corrected {
    /// The point.
    pub x: Vec<f64>,
    /// Newton steps.
    pub iterations: usize,
    /// `‖R‖` there.
    pub residual: f64,
    /// `∂R/∂X` there, `n × (n + 1)`.
    pub jacobian: Mat<f64>,
}

/// `‖x‖₂`
pub(crate) fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// `aᵀb`
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `[J; cᵀ]⁻¹ rhs`
fn bordered(jacobian: &Mat<f64>, c: &[f64], rhs: &[f64]) -> Vec<f64> {
    let n = jacobian.nrows();
    let a = Mat::from_fn(n + 1, n + 1, |i, j| if i < n { jacobian[(i, j)] } else { c[j] });
    let b = Mat::from_fn(n + 1, 1, |i, _| rhs[i]);
    let solution = a.partial_piv_lu().solve(&b);
    (0..=n).map(|i| solution[(i, 0)]).collect()
}

/// Newton's method from `x`; none if it does not converge. A quadratic method that no longer halves its residual has ended.
pub fn correct<F: Family>(
    family: &mut F,
    x: &[f64],
    c: &[f64],
    gamma: f64,
) -> Result<Option<Corrected>, F::Error> {
    let mut x = x.to_vec();
    let mut last = f64::INFINITY;
    let scale = norm(c).max(f64::MIN_POSITIVE);
    for iterations in 0..=ITERATIONS {
        let (r, jacobian) = family.linearise(&x)?;
        let plane: f64 = c.iter().zip(&x).map(|(c, x)| c * x).sum::<f64>() - gamma;
        let residual = norm(&r);
        let rounding = family.rounding(&x);
        let on_plane = plane.abs() <= 1e-12 * scale * norm(&x).max(1.0);
        let stalled = residual <= 30.0 * rounding && residual > 0.25 * last;
        if on_plane && (residual <= rounding || stalled) {
            return Ok(Some(Corrected { x, iterations, residual, jacobian }));
        }
        if !residual.is_finite() || (iterations > 2 && residual > 10.0 * last) {
            return Ok(None);
        }
        last = residual;
        let rhs: Vec<f64> = r.iter().map(|r| -r).chain([-plane]).collect();
        let step = bordered(&jacobian, c, &rhs);
        if step.iter().any(|s| !s.is_finite()) {
            return Ok(None);
        }
        x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
    }
    Ok(None)
}

/// The unit tangent of the branch at `x` in the family's metric, on the side of `c`; and the sign of the determinant of
/// `[J; tᵀ]`, which changes at a simple branch point.
pub fn tangent<F: Family>(
    family: &mut F,
    x: &[f64],
    c: &[f64],
) -> Result<Option<(Vec<f64>, f64)>, F::Error> {
    let (_, jacobian) = family.linearise(x)?;
    Ok(tangent_of(family, x, &jacobian, c))
}

/// The same where the Jacobian is at hand.
pub(super) fn tangent_of<F: Family>(
    family: &F,
    x: &[f64],
    jacobian: &Mat<f64>,
    c: &[f64],
) -> Option<(Vec<f64>, f64)> {
    let n = jacobian.nrows();
    let mut rhs = vec![0.0; n + 1];
    rhs[n] = 1.0;
    let mut t = bordered(jacobian, c, &rhs);
    if t.iter().any(|t| !t.is_finite()) {
        return None;
    }
    let weights = family.weights(x);
    let length = t.iter().zip(&weights).map(|(t, w)| w * t * t).sum::<f64>().sqrt();
    t.iter_mut().for_each(|t| *t /= length);
    let a =
        Mat::from_fn(n + 1, n + 1, |i, j| if i < n { jacobian[(i, j)] } else { weights[j] * t[j] });
    Some((t, determinant_sign(&a)))
}

/// Sign of a determinant, from the factors.
fn determinant_sign(a: &Mat<f64>) -> f64 {
    let lu = a.partial_piv_lu();
    let diagonal = (0..a.nrows()).map(|i| lu.U()[(i, i)].signum()).product::<f64>();
    let swaps = lu.P().arrays().0;
    let mut seen = vec![false; swaps.len()];
    let mut sign = diagonal;
    for start in 0..swaps.len() {
        let mut length = 0;
        let mut i = start;
        while !seen[i] {
            seen[i] = true;
            i = swaps[i];
            length += 1;
        }
        if length > 0 && length % 2 == 0 {
            sign = -sign;
        }
    }
    sign
}

/// A solution near `x` with `λ` free: Newton steps across the null direction of the Jacobian. None if that does not converge.
pub fn approach<F: Family>(family: &mut F, x: &[f64]) -> Result<Option<Corrected>, F::Error> {
    let mut x = x.to_vec();
    let mut c = vec![0.0; x.len()];
    c[x.len() - 1] = 1.0;
    for _ in 0..ITERATIONS {
        let Some((t, _)) = tangent(family, &x, &c)? else { return Ok(None) };
        let (r, jacobian) = family.linearise(&x)?;
        let rhs: Vec<f64> = r.iter().map(|r| -r).chain([0.0]).collect();
        let step = bordered(&jacobian, &t, &rhs);
        let length = norm(&step);
        if !length.is_finite() || length > norm(&x) {
            return Ok(None);
        }
        x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
        if length <= 1e-7 * norm(&x) {
            let gamma = t.iter().zip(&x).map(|(t, x)| t * x).sum();
            return correct(family, &x, &t, gamma);
        }
        c = t;
    }
    Ok(None)
}

/// Smallest singular value of `∂R/∂x` over the largest: zero at a fold.
pub fn least_singular_value<F: Family>(family: &mut F, x: &[f64]) -> Result<Option<f64>, F::Error> {
    let (r, jacobian) = family.linearise(x)?;
    let square = jacobian.subcols(0, r.len());
    let values = square.singular_values().ok();
    Ok(values.and_then(|v| Some(v.last()? / v.first()?)))
}
