//! Newton's method on `R(X) = 0`, `cᵀX = γ`.
//!
//! Unknowns are of several kinds (states, times, frequencies) and have units of their own, as the residual has ([`Units`]). Everything that is decided
//! here, pivots, ranks, lengths, tolerances, is decided in these units: a problem told in others takes the same steps.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};

use super::{Family, Units};

/// Most iterations of a corrector.
const ITERATIONS: usize = 12;

/// A diagonal entry below this, over the largest of all, is no pivot.
const PIVOT: f64 = 1e-8;

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
pub fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// `‖a − b‖₂`
pub(crate) fn apart(a: &[f64], b: &[f64]) -> f64 {
    norm(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
}

/// `aᵀb`
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Units {
    /// Numbers of unknowns: `X` over its units.
    fn of_unknowns(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.unknowns).map(|(x, u)| x / u).collect()
    }

    /// Numbers of a linear condition on unknowns.
    fn of_condition(&self, c: &[f64]) -> Vec<f64> {
        c.iter().zip(&self.unknowns).map(|(c, u)| c * u).collect()
    }

    /// Numbers of `∂R/∂X`.
    fn of_jacobian(&self, jacobian: &Mat<f64>) -> Mat<f64> {
        let (units, residual) = (&self.unknowns, self.residual);
        Mat::from_fn(jacobian.nrows(), jacobian.ncols(), |i, j| {
            jacobian[(i, j)] * (units[j] / residual)
        })
    }

    /// `[J; cᵀ]⁻¹ (r, p)`: unknowns of a residual and of the value of a condition.
    fn bordered(&self, jacobian: &Mat<f64>, c: &[f64], (r, p): (&[f64], f64)) -> Vec<f64> {
        let r: Vec<f64> = r.iter().map(|r| r / self.residual).collect();
        let y = Bordered::new(self.of_jacobian(jacobian), &self.of_condition(c)).solve(&r, p);
        y.iter().zip(&self.unknowns).map(|(y, unit)| y * unit).collect()
    }
}

/// `[J; cᵀ]`, factorised. Unknowns that stand in one equation alone, on the diagonal (of a mesh with damping most: nothing is left of them after a period), are taken
/// out of it first: `x_i = (r_i − J_ik x_k)/J_ii`.
struct Bordered {
    j: Mat<f64>,
    /// The unknowns that stand alone, their `J_ii` and what they have in `c`.
    alone: Vec<(usize, f64, f64)>,
    /// The others.
    kept: Vec<usize>,
    factors: PartialPivLu<f64>,
}

impl Bordered {
    fn new(j: Mat<f64>, c: &[f64]) -> Bordered {
        let n = j.nrows();
        let least = PIVOT * j.norm_max();
        let stands_alone = |k: usize| {
            k < n && j[(k, k)].abs() > least && (0..n).all(|i| i == k || j[(i, k)] == 0.0)
        };
        let (apart, kept): (Vec<usize>, Vec<usize>) = (0..=n).partition(|&k| stands_alone(k));
        let alone: Vec<(usize, f64, f64)> =
            apart.into_iter().map(|i| (i, j[(i, i)], c[i])).collect();
        let last = kept.len() - 1;
        let condition =
            |k: usize| c[k] - alone.iter().map(|&(i, pivot, c)| c / pivot * j[(i, k)]).sum::<f64>();
        let a = Mat::from_fn(last + 1, last + 1, |i, k| {
            if i < last { j[(kept[i], kept[k])] } else { condition(kept[k]) }
        });
        let factors = a.partial_piv_lu();
        Bordered { j, alone, kept, factors }
    }

    fn solve(&self, r: &[f64], p: f64) -> Vec<f64> {
        let last = self.kept.len() - 1;
        let p = p - self.alone.iter().map(|&(i, pivot, c)| c / pivot * r[i]).sum::<f64>();
        let b = Mat::from_fn(last + 1, 1, |i, _| if i < last { r[self.kept[i]] } else { p });
        let solution = self.factors.solve(&b);
        let mut x = vec![0.0; self.j.ncols()];
        self.kept.iter().enumerate().for_each(|(i, &k)| x[k] = solution[(i, 0)]);
        for &(i, pivot, _) in &self.alone {
            let others: f64 = self.kept.iter().map(|&k| self.j[(i, k)] * x[k]).sum();
            x[i] = (r[i] - others) / pivot;
        }
        x
    }

    /// Sign of the determinant, from the factors.
    fn sign(&self) -> f64 {
        let upper = self.factors.U();
        let diagonal = (0..upper.nrows()).map(|i| upper[(i, i)]);
        let pivots = self.alone.iter().map(|&(_, pivot, _)| pivot).chain(diagonal);
        let mut sign = pivots.map(f64::signum).product::<f64>();
        let swaps = self.factors.P().arrays().0;
        let mut seen = vec![false; swaps.len()];
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
    let units = family.units();
    let steepness = norm(&units.of_condition(c));
    for iterations in 0..=ITERATIONS {
        let (r, jacobian) = family.linearise(&x)?;
        let plane: f64 = c.iter().zip(&x).map(|(c, x)| c * x).sum::<f64>() - gamma;
        let residual = norm(&r);
        let rounding = family.rounding(&x);
        let on_plane = plane.abs() <= 1e-12 * steepness * norm(&units.of_unknowns(&x));
        let stalled = residual <= 30.0 * rounding && residual > 0.25 * last;
        if on_plane && (residual <= rounding || stalled) {
            return Ok(Some(Corrected { x, iterations, residual, jacobian }));
        }
        if !residual.is_finite() || (iterations > 2 && residual > 10.0 * last) {
            return Ok(None);
        }
        last = residual;
        let wanted: Vec<f64> = r.iter().map(|r| -r).collect();
        let step = units.bordered(&jacobian, c, (&wanted, -plane));
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
    let units = family.units();
    let mut t = units.bordered(jacobian, c, (&vec![0.0; n], 1.0));
    if t.iter().any(|t| !t.is_finite()) {
        return None;
    }
    let weights = family.weights(x);
    let length = t.iter().zip(&weights).map(|(t, w)| w * t * t).sum::<f64>().sqrt();
    t.iter_mut().for_each(|t| *t /= length);
    let along: Vec<f64> = weights.iter().zip(&t).map(|(w, t)| w * t).collect();
    let closed = Bordered::new(units.of_jacobian(jacobian), &units.of_condition(&along));
    Some((t, closed.sign()))
}

/// A solution near `x` with `λ` free: Newton steps across the null direction of the Jacobian. None if that does not converge.
pub(crate) fn approach<F: Family>(
    family: &mut F,
    x: &[f64],
) -> Result<Option<Corrected>, F::Error> {
    let mut x = x.to_vec();
    let mut c = vec![0.0; x.len()];
    c[x.len() - 1] = 1.0;
    let units = family.units();
    for _ in 0..ITERATIONS {
        let (r, jacobian) = family.linearise(&x)?;
        let Some((t, _)) = tangent_of(family, &x, &jacobian, &c) else { return Ok(None) };
        // steps across the branch: orthogonal to it in units
        c = t.iter().zip(&units.unknowns).map(|(t, u)| t / (u * u)).collect();
        let wanted: Vec<f64> = r.iter().map(|r| -r).collect();
        let step = units.bordered(&jacobian, &c, (&wanted, 0.0));
        let length = norm(&units.of_unknowns(&step));
        if !length.is_finite() || length > norm(&units.of_unknowns(&x)) {
            return Ok(None);
        }
        x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
        if length <= 1e-7 * norm(&units.of_unknowns(&x)) {
            let gamma = c.iter().zip(&x).map(|(c, x)| c * x).sum();
            return correct(family, &x, &c, gamma);
        }
    }
    Ok(None)
}

/// Smallest singular value of `∂R/∂x` in units over the largest: zero at a fold.
pub(crate) fn least_singular_value<F: Family>(
    family: &mut F,
    x: &[f64],
) -> Result<Option<f64>, F::Error> {
    let (r, jacobian) = family.linearise(x)?;
    let scaled = family.units().of_jacobian(&jacobian);
    let square = scaled.subcols(0, r.len());
    let values = square.singular_values().ok();
    Ok(values.and_then(|v| Some(v.last()? / v.first()?)))
}
