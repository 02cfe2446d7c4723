//! Chebyshev nodes as pseudo-modes.
//!
//! With `S = M_α⁻¹K_α`, whose spectrum lies in `[0, s_max]`, `S̃ = 2S/s_max − I` and the nodes `s_j = s_max cos²(θ_j/2)`, `θ_j = π(j+½)/N`, a
//! function `f` that is entire in `s` becomes
//!
//! ```text
//! f(S)x ≈ Σ_k c_k T_k(S̃)x,   c_k = (2−δ_k0)/N Σ_j f(s_j) cos kθ_j,   error ≤ 2 Σ_{k≥N} |c_k|
//! ```
//!
//! and a row of it `r f(S)x = Σ_j f(s_j) m_j` with `m_j = (1/N) [μ_0 + 2 Σ_{k≥1} μ_k cos kθ_j]`, `μ_k = r T_k(S̃)x`: the form that a
//! sum over modes has, with `N` frequencies that are known beforehand.

use nalgebra::Complex;

use super::super::oscillator::{Basis, Oscillator};
use super::super::trigonometry::sin_cos;
use crate::contact::Rayleigh;

/// The nodes, with the damping that the modes there would have.
#[derive(Debug)]
pub(super) struct Nodes {
    /// `√s_j`, and half the damping rate `δ_j = ½(α + β s_j)`.
    pub modes: Vec<Oscillator>,
    is_undamped: bool,
    /// `cos(πm/2N)`, `m < 4N`.
    cos: Vec<f64>,
}

/// What the pseudo-modes do at one time after the start of a window.
#[derive(Debug)]
pub(super) struct Functions {
    /// `g′`
    pub rate: Vec<f64>,
    /// `g″ + 2δg′ + sg = 0`, `g(0) = 0`, `g′(0) = 1`.
    pub g: Vec<f64>,
    /// `G = ∫g`
    pub integral: Vec<f64>,
}

impl Nodes {
    /// So many nodes on `[0, ω²]`.
    pub fn new(count: usize, omega: f64, damping: Option<Rayleigh>) -> Nodes {
        let (alpha, beta) = damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
        let unit = std::f64::consts::PI / (2 * count) as f64;
        let mode = |j: usize| {
            let omega = omega * (unit * (j as f64 + 0.5)).cos();
            Oscillator { omega, c: 0.5 * (alpha + beta * omega * omega) }
        };
        Nodes {
            modes: (0..count).map(mode).collect(),
            is_undamped: alpha == 0.0 && beta == 0.0,
            cos: (0..4 * count).map(|m| (unit * m as f64).cos()).collect(),
        }
    }

    /// `N`
    pub fn len(&self) -> usize {
        self.modes.len()
    }

    /// `cos kθ_j`
    fn cos(&self, k: usize, j: usize) -> f64 {
        self.cos[k * (2 * j + 1) % self.cos.len()]
    }

    /// `c_0 … c_{N−1}` of a function that is given at the nodes.
    pub fn coefficients(&self, f: &[f64]) -> Vec<f64> {
        let of_order = |k: usize| {
            let sum: f64 = f.iter().enumerate().map(|(j, f)| f * self.cos(k, j)).sum();
            sum * if k == 0 { 1.0 } else { 2.0 } / f.len() as f64
        };
        (0..f.len()).map(of_order).collect()
    }

    /// From the moments `μ_k` (`k < N`, one row each) to `m_j`, one row a node.
    pub fn spread(&self, moments: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let n = self.len();
        let of_node = |j: usize| {
            let mut sum = vec![0.0; moments.first().map_or(0, Vec::len)];
            for (k, row) in moments.iter().enumerate() {
                let weight = if k == 0 { 1.0 } else { 2.0 * self.cos(k, j) } / n as f64;
                sum.iter_mut().zip(row).for_each(|(s, m)| *s += weight * m);
            }
            sum
        };
        (0..n).map(of_node).collect()
    }

    /// The functions at a time.
    pub fn functions(&self, t: f64) -> Functions {
        let n = self.len();
        let zero = || vec![0.0; n];
        let mut f = Functions { rate: zero(), g: zero(), integral: zero() };
        if self.is_undamped {
            // by half the angle, so that 1 − cos loses nothing
            let half: Vec<f64> = self.modes.iter().map(|m| 0.5 * t * m.omega).collect();
            let (mut sin, mut cos) = (zero(), zero());
            sin_cos(&half, &mut sin, &mut cos);
            for (j, m) in self.modes.iter().enumerate() {
                f.rate[j] = 1.0 - 2.0 * sin[j] * sin[j];
                f.g[j] = 2.0 * sin[j] * cos[j] / m.omega;
                f.integral[j] = 2.0 * (sin[j] / m.omega).powi(2);
            }
            return f;
        }
        for (j, m) in self.modes.iter().enumerate() {
            let Basis { s, ds, .. } = m.basis(t);
            (f.rate[j], f.g[j]) = (ds, s);
            f.integral[j] = m.response_from_rest(0.0, t)[0].re;
        }
        f
    }

    /// `p = ∫₀ᵗ g(t − x) e^{iΩx} dx` and its rate, at every node.
    pub fn responses(&self, omega: f64, t: f64) -> Vec<[Complex<f64>; 2]> {
        self.modes.iter().map(|m| m.response_from_rest(omega, t)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two ways to a row of `f(S)x`: by coefficients and by weights of the nodes.
    #[test]
    fn weights_of_nodes_are_the_transposed_of_coefficients() {
        let nodes = Nodes::new(24, 3.0, Some(Rayleigh { alpha: 0.1, beta: 0.2 }));
        let f = nodes.functions(1.3);
        let moments: Vec<Vec<f64>> = (0..24).map(|k| vec![(0.7 * k as f64 + 0.2).sin()]).collect();
        let weights = nodes.spread(&moments);
        for f in [&f.rate, &f.g, &f.integral] {
            let c = nodes.coefficients(f);
            let one: f64 = c.iter().zip(&moments).map(|(c, m)| c * m[0]).sum();
            let other: f64 = f.iter().zip(&weights).map(|(f, w)| f * w[0]).sum();
            assert!((one - other).abs() < 1e-14, "{one} {other}");
        }
    }
}
