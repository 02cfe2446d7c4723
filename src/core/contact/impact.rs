//! Newton's law of impact in Moreau's form (Moreau 1988): bodies keep the mass of their contact points, and velocities jump.
//!
//! At `w_i = 0`, `ẇ_i⁻ < 0`, on the points `I` that touch,
//!
//! ```text
//! 0 ≤ D r + (1 + e) ẇ⁻  ⟂  r ≥ 0,      D = n M⁻¹nᵀ,      u̇⁺ = u̇⁻ − M⁻¹nᵀ r
//! ```
//!
//! One impact changes the energy by `−½ (1 − e²) ẇ²/D_ii`. Points that stay (`ẇ⁺ = 0`) are held while their reaction presses.

use std::sync::Arc;

use nalgebra::DVector;

use super::law::{March, Restitution};
use super::lcp::{self, LcpError};
use super::reactions::Columns;
use super::states::States;
use crate::fem::largest;

/// The impacts of a body.
#[derive(Debug)]
pub struct Impact {
    /// `e`
    pub restitution: f64,
    /// A scheme of its own in place of events.
    pub march: Option<March>,
    mass: Arc<Columns>,
}

/// `v ← v − Σ columns_j (rows_j v)` over `u_O`.
#[derive(Debug, Clone, PartialEq)]
pub struct BlowMap {
    /// `M⁻¹nᵀ D⁻¹ E`
    pub columns: Vec<Vec<f64>>,
    /// `n`
    pub rows: Vec<Vec<(usize, f64)>>,
}

/// Velocities after an impact.
#[derive(Debug, Clone, PartialEq)]
pub struct Blow {
    /// Impulse at each of the points that touch.
    pub impulse: Vec<f64>,
    /// `ẇ⁺` of these points.
    pub rate: Vec<f64>,
}

impl Impact {
    pub(super) fn new(law: Restitution, mass: Arc<Columns>) -> Impact {
        Impact { restitution: law.coefficient, march: law.march, mass }
    }

    /// `n`: displacement of each contact point along its normal, rows over `u_O`.
    pub fn normal(&self) -> &crate::fem::Csr {
        &self.mass.rows
    }

    /// The impact of the points `touching` at the velocity `v`, which becomes that after it.
    pub fn strike(&self, touching: &[usize], v: &mut [f64]) -> Result<Blow, LcpError> {
        let rate = |v: &[f64], k: usize| -self.mass.rows.row_dot(k, v);
        let before: Vec<f64> = touching.iter().map(|&k| rate(v, k)).collect();
        let largest = largest(v);
        let q: Vec<f64> = before.iter().map(|w| (1.0 + self.restitution) * w).collect();
        let impulse = self.complementary(touching, &q, largest)?;
        self.push(touching, &impulse, v);
        Ok(Blow { rate: touching.iter().map(|&k| rate(v, k)).collect(), impulse })
    }

    /// `0 ≤ D r + q ⟂ r ≥ 0` on some points: the smallest `r` of the solution; what is zero to rounding is zero.
    fn complementary(&self, points: &[usize], q: &[f64], size: f64) -> Result<Vec<f64>, LcpError> {
        let start: Vec<bool> = q.iter().map(|q| *q >= 0.0).collect();
        let solution =
            lcp::solve(&self.mass.block(points).into(), q, &vec![4.0 * size; q.len()], &start)?;
        Ok(solution.w)
    }

    /// `v ← v − M⁻¹nᵀ r`
    fn push(&self, points: &[usize], impulse: &[f64], v: &mut [f64]) {
        for (&k, r) in points.iter().zip(impulse) {
            self.mass.columns.add_row(k, -r, v);
        }
    }

    /// The jump of velocities as a linear map, for as long as the same points are struck, of which `held` were at rest before:
    /// `R = I − M⁻¹nᵀ D⁻¹ E n` with `1 + e` in the diagonal matrix `E`, 1 for points at rest. The factors `M⁻¹nᵀ D⁻¹ E` column by column.
    pub fn blow(&self, struck: &[usize], held: &States) -> Option<BlowMap> {
        let mass = &self.mass;
        let inverse = mass.block(struck).try_inverse()?;
        let factor = |k: usize| if held.touches(k) { 1.0 } else { 1.0 + self.restitution };
        let column = |j: usize| -> Vec<f64> {
            let mut sum = vec![0.0; mass.rows.n_cols()];
            for (i, &k) in struck.iter().enumerate() {
                let c = inverse[(i, j)] * factor(struck[j]);
                mass.columns.add_row(k, c, &mut sum);
            }
            sum
        };
        let row = |&k: &usize| mass.rows.row(k).collect();
        Some(BlowMap {
            columns: (0..struck.len()).map(column).collect(),
            rows: struck.iter().map(row).collect(),
        })
    }

    /// Take what is left of the velocity of some points against the obstacle.
    pub fn stop(&self, points: &[usize], v: &mut [f64]) {
        let along = points.iter().map(|&k| self.mass.rows.row_dot(k, v));
        let along = DVector::from_iterator(points.len(), along);
        if let Some(r) = self.mass.block(points).lu().solve(&along) {
            self.push(points, r.as_slice(), v);
        }
    }

    /// Which of the points at rest on the obstacle stay: `0 ≤ ẅ ⟂ λ ≥ 0` with the acceleration `a` of the body without their reactions.
    pub(crate) fn staying(&self, resting: &[usize], a: &[f64]) -> Result<Vec<usize>, LcpError> {
        let q: Vec<f64> = resting.iter().map(|&k| -self.mass.rows.row_dot(k, a)).collect();
        let largest = largest(a);
        let reaction = self.complementary(resting, &q, largest)?;
        Ok(resting.iter().zip(&reaction).filter(|(_, r)| **r > 0.0).map(|(&k, _)| k).collect())
    }
}
