//! Monodromy matrix, Floquet multipliers, stability.
//!
//! `M = ∂x(T)/∂x(0)`: propagators of the phases and saltation matrices, in the frame of [`super::chain`], where a motion without switches
//! is a rotation. An autonomous orbit has the eigenvector `ẋ(0)` with multiplier +1; a conservative family has a
//! second one, in a Jordan block with the first, which a numerical eigensolution knows to half the digits only. So `ẋ(0)` is taken out
//! first, by an orthogonal similarity: what is left has a simple +1. A viscous orbit is fed by `−αM u̇`: its multipliers are those of
//! the self-excited system, with one +1, as those of a limit cycle; beside them stand those of the damped body under `αM u̇(t)` as a prescribed load.

use faer::Mat;

use super::OrbitError;
use super::chain::{Chain, Propagator};
use super::shooting::Closure;
use super::tangent::Variation;
use super::walk::Walk;
use crate::continuation::norm;

/// A multiplier: real and imaginary part.
pub type Multiplier = (f64, f64);

/// How an orbit stands to its neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Stability {
    /// All multipliers, largest first. Those that belong to every orbit of a conservative family come first of all and are
    /// counted by `trivial`.
    pub multipliers: Vec<Multiplier>,
    /// Number of multipliers +1 that come from time shift and family (0 for forced orbits).
    pub trivial: usize,
    /// Number of real multipliers above +1, of real ones below −1, of complex ones outside the unit circle.
    pub outside: [usize; 3],
    /// Largest modulus (trivial ones apart).
    pub largest: f64,
}

impl Stability {
    /// Real and imaginary parts of all multipliers, as files have them.
    pub fn pairs(&self) -> Vec<[f64; 2]> {
        self.multipliers.iter().map(|&(re, im)| [re, im]).collect()
    }

    /// No multiplier is outside the unit circle.
    pub fn is_stable(&self) -> bool {
        self.outside == [0; 3]
    }

    /// Through which bifurcation an unstable orbit lost its stability, by the largest multiplier.
    pub fn lost_by(&self) -> Option<&'static str> {
        let (re, im) = *self.multipliers[self.trivial..].first()?;
        if self.is_stable() {
            return None;
        }
        Some(match (im != 0.0, re > 0.0) {
            (true, _) => "Neimark-Sacker (complex pair)",
            (false, true) => "fold or branch point (+1)",
            (false, false) => "period doubling (-1)",
        })
    }
}

/// Multipliers further out than this are unstable.
const OUTSIDE: f64 = 1e-6;

/// The monodromy matrix in the frame, along the motion of a whole period.
pub fn monodromy(body: &Propagator, along: (&Chain, &Walk)) -> Result<Mat<f64>, OrbitError> {
    Ok(body.derivative(along, 2 * body.n(), Variation::OF_MAP)?.end)
}

/// Stability of an orbit that begins at `z`, from its monodromy matrix.
pub fn stability(
    body: &Propagator,
    closure: Closure,
    z: &[f64],
    along: (&Chain, &Walk),
) -> Result<Stability, OrbitError> {
    let m = monodromy(body, along)?;
    let autonomous = !closure.is_forced();
    let mut full = closure.frame(z).to_vec();
    full.resize(2 * body.n(), 0.0);
    let rate = if autonomous { Some(body.rate(&full, along.0)?) } else { None };
    let mut values = eigenvalues(&m, rate.as_deref())?;
    let mut trivial = vec![];
    if autonomous {
        let far = |v: &Multiplier| (v.0 - 1.0).hypot(v.1);
        let nearest =
            (0..values.len()).min_by(|&a, &b| far(&values[a]).total_cmp(&far(&values[b])));
        if closure.trivial() > 1 {
            trivial.extend(nearest.map(|k| values.swap_remove(k)));
        }
        trivial.insert(0, (1.0, 0.0));
    }
    Ok(Stability::of(trivial, values))
}

/// The multipliers of the damped body that `αM u̇(t)` of its orbit drives as a prescribed load: the same switches, `α = 0` in the variation.
pub(crate) fn stability_under_load(
    body: &Propagator,
    along: (&Chain, &Walk),
    alpha: f64,
) -> Result<Stability, OrbitError> {
    let released = Variation { released: alpha, ..Variation::OF_MAP };
    let m = body.derivative(along, 2 * body.n(), released)?.end;
    Ok(Stability::of(vec![], multipliers(&m)?))
}

/// All eigenvalues of a monodromy matrix.
pub fn multipliers(m: &Mat<f64>) -> Result<Vec<Multiplier>, OrbitError> {
    eigenvalues(m, None)
}

/// All eigenvalues of a monodromy matrix, without the +1 of an eigenvector if one is known.
fn eigenvalues(m: &Mat<f64>, known: Option<&[f64]>) -> Result<Vec<Multiplier>, OrbitError> {
    let alive = alive(m);
    let block = Mat::from_fn(alive.len(), alive.len(), |i, j| m[(alive[i], alive[j])]);
    let block = match known {
        None => block,
        Some(p) => deflate(&block, &alive.iter().map(|&i| p[i]).collect::<Vec<f64>>()),
    };
    let values = block.eigenvalues().map_err(|_| OrbitError::Eigen("Floquet multipliers"))?;
    let dead = std::iter::repeat_n((0.0, 0.0), m.nrows() - alive.len());
    Ok(values.iter().map(|v| (v.re, v.im)).chain(dead).collect())
}

/// The directions of which something is left after a period. A column of zeros is an eigenvalue zero, and its row adds nothing to the others: both are struck out,
/// until none is left.
fn alive(m: &Mat<f64>) -> Vec<usize> {
    let mut alive: Vec<usize> = (0..m.ncols()).collect();
    loop {
        let count = alive.len();
        let lives = |&j: &usize| alive.iter().any(|&i| m[(i, j)] != 0.0);
        alive = alive.iter().copied().filter(lives).collect();
        if alive.len() == count {
            return alive;
        }
    }
}

impl Stability {
    /// Of the multipliers that belong to every orbit of the kind, and all others.
    pub(crate) fn of(mut trivial: Vec<Multiplier>, mut values: Vec<Multiplier>) -> Stability {
        let size = |v: &Multiplier| v.0.hypot(v.1);
        // conjugates have one modulus: the order must not depend on rounding
        values.sort_by(|a, b| {
            (size(b), b.0, b.1)
                .partial_cmp(&(size(a), a.0, a.1))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let largest = values.first().map_or(0.0, size);
        let mut outside = [0; 3];
        for v in values.iter().filter(|v| size(v) > 1.0 + OUTSIDE) {
            let kind = match (v.1 != 0.0, v.0 > 0.0) {
                (true, _) => 2,
                (false, true) => 0,
                (false, false) => 1,
            };
            outside[kind] += 1;
        }
        let count = trivial.len();
        trivial.extend(values);
        Stability { multipliers: trivial, trivial: count, outside, largest }
    }
}

/// The block that is left of `M` when its eigenvector `p` (multiplier +1) is rotated to the first axis and struck out.
fn deflate(m: &Mat<f64>, p: &[f64]) -> Mat<f64> {
    let n = m.nrows();
    let length = norm(p);
    // Householder vector of p
    let mut w: Vec<f64> = p.iter().map(|x| x / length).collect();
    w[0] += if w[0] >= 0.0 { 1.0 } else { -1.0 };
    let scale = norm(&w);
    w.iter_mut().for_each(|x| *x /= scale);
    // H M H with H = I − 2 w wᵀ
    let mw: Vec<f64> = (0..n).map(|i| (0..n).map(|j| m[(i, j)] * w[j]).sum()).collect();
    let wm: Vec<f64> = (0..n).map(|j| (0..n).map(|i| w[i] * m[(i, j)]).sum()).collect();
    let wmw: f64 = w.iter().zip(&mw).map(|(a, b)| a * b).sum();
    Mat::from_fn(n - 1, n - 1, |i, j| {
        let (i, j) = (i + 1, j + 1);
        m[(i, j)] - 2.0 * mw[i] * w[j] - 2.0 * w[i] * wm[j] + 4.0 * w[i] * wmw * w[j]
    })
}
