//! Monitors in a window: sums over pseudo-modes, with bounds of their fourth derivatives.
//!
//! ```text
//! h_i(t) = h_i(u₀) + Σ_j [g m_ij^v + G m_ij^a + Re(z p) m_ij^b]
//! ```
//!
//! The velocity of a pseudo-mode is a free motion beside the steady answer to the loads, so its third derivative is bounded by the
//! amplitudes of both.

use std::rc::Rc;

use super::drive::{Split, amplitude};
use super::nodes::Nodes;
use crate::fem::Harmonic;

/// Damped motions get calmer: the bounds are renewed so many times in a window.
const SLICES: usize = 8;

/// The sums of one window.
#[derive(Debug)]
pub(super) struct Sums {
    pub nodes: Rc<Nodes>,
    /// `m_ij` along `v₀`, `a₀` and each `b`: one list a node, monitors first, then forces.
    pub weights: Vec<Vec<Vec<f64>>>,
    /// Bounds of the fourth derivatives from the start of each slice on, once they are asked for.
    fourth: Vec<Option<Vec<f64>>>,
    length: f64,
}

impl Sums {
    /// Of a window of the length `length`.
    pub fn new(nodes: Rc<Nodes>, weights: Vec<Vec<Vec<f64>>>, length: f64) -> Sums {
        let changes = nodes.modes.iter().any(|m| m.c > 0.0);
        let slices = if changes { SLICES } else { 1 };
        Sums { nodes, weights, fourth: vec![None; slices], length }
    }

    /// `Σ_j f_j m_j` of the first rows, for the functions that go with each vector.
    pub fn along(&self, functions: &[Vec<f64>], sums: &mut [f64]) {
        for (f, weights) in functions.iter().zip(&self.weights) {
            for (f, m) in f.iter().zip(weights) {
                sums.iter_mut().zip(m).for_each(|(s, m)| *s += f * m);
            }
        }
    }

    /// Bounds (theory §12, H2) of `|h⁗|` of the first `count` rows from `tau` after the start of the window to its end; `loads` are those of each shape.
    pub fn fourth(
        &mut self,
        count: usize,
        loads: &[Vec<&Harmonic>],
        (t0, tau): (f64, f64),
    ) -> &[f64] {
        let slices = self.fourth.len();
        let slice = ((tau / self.length * slices as f64) as usize).min(slices - 1);
        let from = self.length * slice as f64 / slices as f64;
        if self.fourth[slice].is_none() {
            self.fourth[slice] = Some(self.bounds(count, loads, t0, from));
        }
        self.fourth[slice].as_deref().unwrap_or_default()
    }

    fn bounds(&self, count: usize, loads: &[Vec<&Harmonic>], t0: f64, from: f64) -> Vec<f64> {
        let span = (from, self.length);
        let mut bounds = vec![0.0; count];
        for (j, mode) in self.nodes.modes.iter().enumerate() {
            // of each shape: what is free of the velocity, and what the rest adds
            let of_shape = |loads: &Vec<&Harmonic>| {
                let mut sum = ((0.0, 0.0), 0.0);
                for load in loads {
                    let z = amplitude(load, t0);
                    match Split::of(mode, load.omega, z) {
                        Some(Split { steady, free }) => {
                            sum.0 = (sum.0.0 + free.0, sum.0.1 + free.1);
                            sum.1 += steady.norm() * load.omega.powi(4);
                        }
                        None => sum.1 += mode.rest_bound(load.omega, z.norm(), self.length, 4),
                    }
                }
                sum
            };
            let shapes: Vec<((f64, f64), f64)> = loads.iter().map(of_shape).collect();
            let at = |x: usize, i: usize| self.weights[x][j][i];
            for (i, bound) in bounds.iter_mut().enumerate() {
                let (mut q, mut v) = (at(0, i), at(1, i) - 2.0 * mode.c * at(0, i));
                for (k, (free, rest)) in shapes.iter().enumerate() {
                    let b = at(2 + k, i);
                    (q, v) = (q + free.0 * b, v + free.1 * b);
                    *bound += rest * b.abs();
                }
                *bound += mode.free_bound((q, v), 3, span);
            }
        }
        bounds
    }
}
