//! Bodies that walk: directions along which a body could be anywhere.
//!
//! A rigid displacement `φ` that no gap and no spring feels, `K φ = 0`, `∇h φ = 0`, changes nothing of the equations: a frame that stands on a floor by friction may stand
//! anywhere on it. Its period map takes `x + c φ` to `x(T) + c φ`, and what can be asked of a periodic motion is that it comes back but for that,
//!
//! ```text
//! x(T) = x(0) + d φ
//! ```
//!
//! with `d` the way that the body walks in a period. It vanishes for a motion that a symmetry maps to itself, not in general.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::contact::System;
use crate::continuation::norm;
use crate::flow::spectrum::Spectrum;

/// A gap or a spring feels a rigid displacement by less than this, over what it feels of all modes: not at all.
const UNFELT: f64 = 1e-6;

/// Orthonormal directions among frame vectors, displacements only: none for most bodies.
#[derive(Debug, Default)]
pub struct Drift(Vec<Vec<f64>>);

impl Drift {
    /// The directions of a body with friction, from the modes of its open phase. Without friction velocities drift as well, and nothing holds a position.
    pub(super) fn of(system: &System, open: &Spectrum) -> Drift {
        let rigid: Vec<usize> =
            (0..open.modes.len()).filter(|k| open.modes[*k].omega == 0.0).collect();
        if rigid.is_empty() {
            return Drift::default();
        }
        // gaps, and springs of sliders
        let gaps = open.rows.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>());
        let shapes = || open.shapes.col_iter().map(|c| c.iter().copied().collect::<Vec<f64>>());
        let springs = system.sliders().iter().filter(|s| s.elastic.is_some());
        let springs = springs.map(|s| shapes().filter_map(|shape| s.trial(&shape)).collect());
        let rows: Vec<Vec<f64>> = gaps.chain(springs).collect();
        let felt = DMatrix::from_fn(rows.len(), rigid.len(), |i, j| {
            rows[i][rigid[j]] / norm(&rows[i]).max(f64::MIN_POSITIVE)
        });
        let eigen = SymmetricEigen::new(felt.transpose() * felt);
        let unfelt = (0..rigid.len()).filter(|&j| eigen.eigenvalues[j] < UNFELT * UNFELT);
        let direction = |j: usize| {
            let mut d = vec![0.0; open.modes.len()];
            rigid.iter().zip(&eigen.eigenvectors.column(j)).for_each(|(&k, &share)| d[k] = share);
            d
        };
        Drift(unfelt.map(direction).collect())
    }

    /// Take its drift from a difference of frame vectors.
    pub fn leave_out(&self, r: &mut [f64]) {
        for d in &self.0 {
            let along: f64 = d.iter().zip(&*r).map(|(d, r)| d * r).sum();
            r.iter_mut().zip(d).for_each(|(r, d)| *r -= along * d);
        }
    }

    /// `b − a` without its drift.
    pub fn difference(&self, a: &[f64], b: &[f64]) -> Vec<f64> {
        let mut r: Vec<f64> = b.iter().zip(a).map(|(b, a)| b - a).collect();
        self.leave_out(&mut r);
        r
    }

    /// How far two frame vectors are apart without their drift.
    pub fn apart(&self, a: &[f64], b: &[f64]) -> f64 {
        norm(&self.difference(a, b))
    }

    /// Whether the body has a place that equations know.
    pub fn is_none(&self) -> bool {
        self.0.is_empty()
    }
}
