//! Rotation numbers: how far a motion goes around its torus in a period of the loads.
//!
//! The states of a motion of two frequencies at the beginnings of the periods of the loads lie on a closed curve. In the plane of its two largest extents they go around its
//! middle by `Δθ_k`, and
//!
//! ```text
//! ρ = Σ w(k/N) Δθ_k / 2π Σ w(k/N) ,   w(s) = exp(−1/(s(1 − s)))
//! ```
//!
//! the weighted mean of Birkhoff, whose error falls faster than any power of `1/N` where the motion is one of two frequencies (Das, Sander, Yorke and others 2016). What
//! is known is `ρ` or `1 − ρ`: the lines of its spectrum are at `(j ± kρ) ω` for both. The smaller one is told.

use std::f64::consts::{PI, TAU};

use faer::{Mat, Side};

/// Curves that come nearer to their middle than this, over their largest distance from it, are not gone around.
const HOLLOW: f64 = 1e-2;

/// The rotation number of a motion by its states at the beginnings of periods of the loads, with the difference that half of them make; none where they do not go around a
/// middle.
pub fn rotation_number(states: &[Vec<f64>]) -> Option<(f64, f64)> {
    let (count, n) = (states.len(), states.first()?.len());
    let mean = |i: usize| states.iter().map(|z| z[i]).sum::<f64>() / count as f64;
    let middle: Vec<f64> = (0..n).map(mean).collect();
    let away = Mat::from_fn(count, n, |k, i| states[k][i] - middle[i]);
    // principal directions: eigenvectors of the covariance, the largest last
    let covariance = away.transpose() * &away;
    let principal = covariance.self_adjoint_eigen(Side::Lower).ok()?;
    let last = |k: usize| n.checked_sub(1 + k).map(|k| &away * principal.U().col(k));
    let (x, y) = (last(0)?, last(1)?);
    let sizes: Vec<f64> = (0..count).map(|k| x[k].hypot(y[k])).collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    if sizes.iter().any(|r| *r <= HOLLOW * largest) {
        return None;
    }
    let angles: Vec<f64> = (0..count).map(|k| y[k].atan2(x[k])).collect();
    let steps: Vec<f64> = angles.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // steps lie around their mean direction, less than a half turn away
    let (sin, cos) = steps.iter().fold((0.0, 0.0), |(s, c), d| (s + d.sin(), c + d.cos()));
    let about = f64::atan2(sin, cos);
    let near = |d: &f64| about + (d - about + PI).rem_euclid(TAU) - PI;
    let steps: Vec<f64> = steps.iter().map(near).collect();
    let of = |steps: &[f64]| {
        let count = steps.len() as f64;
        let weight = |k: usize| {
            let s = (k as f64 + 0.5) / count;
            (-1.0 / (s * (1.0 - s))).exp()
        };
        let all: f64 = (0..steps.len()).map(weight).sum();
        let sum: f64 = steps.iter().enumerate().map(|(k, d)| weight(k) * d).sum();
        sum / all / TAU
    };
    let (whole, half) = (of(&steps), of(&steps[..steps.len() / 2]));
    let rho = whole.rem_euclid(1.0);
    Some((rho.min(1.0 - rho), (whole - half).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed curve in four dimensions that is gone around unevenly: the rotation number stays.
    #[test]
    fn a_rotation_number_does_not_depend_on_how_a_curve_is_gone_around() {
        let rho = 0.5 * (5.0f64.sqrt() - 1.0);
        let state = |k: usize| {
            let s = TAU * rho * k as f64;
            let uneven = s + 0.3 * s.sin() + 0.1 * (2.0 * s).cos();
            let (x, y) = (2.0 * uneven.cos(), 0.7 * uneven.sin());
            vec![x + 0.2 * y, y - 1.0, 0.1 * (3.0 * s).cos(), 0.3 * x * y]
        };
        let states: Vec<Vec<f64>> = (0..1000).map(state).collect();
        let (found, error) = rotation_number(&states).unwrap();
        assert!((found - (1.0 - rho)).abs() < 1e-9 && error < 1e-6, "{found} {error}");
        // one that goes through its middle is none
        let eight = |k: usize| {
            let s = TAU * rho * k as f64;
            vec![s.cos(), (2.0 * s).sin()]
        };
        assert!(rotation_number(&(0..1000).map(eight).collect::<Vec<_>>()).is_none());
    }
}
