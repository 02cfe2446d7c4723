//! Obstacles that yield: they push at displacements that have inertia.
//!
//! At a point whose displacement `b u` has passed the gap the obstacle acts on the body by
//!
//! ```text
//! −w t (P + γ d),      d = b u − g ≥ 0
//! ```
//!
//! with a preload `P`, a stiffness `γ` and an area `w`; `b` and `t` are rows over `u_O`, the normal displacement where nothing else is said. Where `t = b` the force
//! has the potential `w (P d + ½γ d²)`.

use std::sync::Arc;

use crate::fem::{Csr, Reduction};

/// The spring behind one contact point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// `γ`, pressure over length.
    pub stiffness: f64,
    /// `P`, a pressure.
    pub preload: f64,
    /// `θ`: the part of the force that has a potential, over that of `b`; one where `t = b`.
    pub share: f64,
}

impl Spring {
    /// No spring.
    pub(super) const NONE: Spring = Spring { stiffness: 0.0, preload: 0.0, share: 1.0 };
}

/// An obstacle before displacements that have inertia.
#[derive(Debug, Clone)]
pub(super) struct Obstacle {
    /// `n`: displacement of the body at each point along its normal, rows over `u_O`.
    pub normal: Arc<Csr>,
    /// `b`
    pub depth: Arc<Csr>,
    /// `t`
    pub direction: Arc<Csr>,
    pub gap: Vec<f64>,
    pub area: Vec<f64>,
    /// Of laws that yield: one a point.
    pub springs: Vec<Spring>,
    /// `‖b‖_{M⁻¹}`; not finite where it is not known.
    pub norms: Vec<f64>,
}

impl Obstacle {
    /// The same in fewer coordinates.
    pub fn reduced(&self, reduction: &Reduction) -> Obstacle {
        let of = |a: &Csr| Arc::new(reduction.operator(a));
        let (normal, depth, direction) = (of(&self.normal), of(&self.depth), of(&self.direction));
        Obstacle { normal, depth, direction, ..self.clone() }
    }

    /// `d = b u − g`
    pub fn depth(&self, point: usize, u_o: &[f64]) -> f64 {
        self.depth.row_dot(point, u_o) - self.gap[point]
    }

    /// The force on the body, over `−t`: `w (P + γ d)`, or its linear part.
    pub fn push(&self, point: usize, u_o: &[f64], is_affine: bool) -> f64 {
        let Spring { stiffness, preload, .. } = self.springs[point];
        self.area[point]
            * match is_affine {
                true => preload + stiffness * self.depth(point, u_o),
                false => stiffness * self.depth.row_dot(point, u_o),
            }
    }

    /// `w γ t bᵀ` as entries.
    pub fn stiffness(&self, point: usize) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let factor = self.area[point] * self.springs[point].stiffness;
        let row = move |(i, t)| self.depth.row(point).map(move |(j, b)| (i, j, factor * t * b));
        self.direction.row(point).flat_map(row)
    }

    /// What of [`Obstacle::stiffness`] has no potential: `w γ (t − θ b) bᵀ`.
    pub fn lost(&self, point: usize) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let factor = self.area[point] * self.springs[point].stiffness;
        let along = self.lost_along(point);
        let row = move |(i, x)| self.depth.row(point).map(move |(j, b)| (i, j, factor * x * b));
        along.into_iter().flat_map(row)
    }

    /// `t − θ b`
    pub(crate) fn lost_along(&self, point: usize) -> Vec<(usize, f64)> {
        let share = self.springs[point].share;
        let of_depth = self.depth.row(point).map(|(j, b)| (j, -share * b));
        self.direction.row(point).chain(of_depth).collect()
    }

    /// The potential of all pushes at a displacement: `Σ θ w (P d + ½γ d²)` over the points that it has passed.
    pub fn energy(&self, u_o: &[f64]) -> f64 {
        (0..self.springs.len()).map(|k| self.energy_at(k, self.depth(k, u_o).max(0.0))).sum()
    }

    /// The same of the points that push in a phase, as a polynomial of the displacements: whether they are in the obstacle is not asked.
    pub fn energy_of(&self, pushes: &[usize], u_o: &[f64]) -> f64 {
        pushes.iter().map(|&k| self.energy_at(k, self.depth(k, u_o))).sum()
    }

    /// Of a spring at a depth.
    fn energy_at(&self, k: usize, d: f64) -> f64 {
        self.springs
            .get(k)
            .map_or(0.0, |s| s.share * self.area[k] * d * (s.preload + 0.5 * s.stiffness * d))
    }

    /// Whether the pushes have a potential.
    pub fn has_potential(&self) -> bool {
        self.springs.iter().all(|s| s.share == 1.0)
    }

    /// Whether forces jump where a point passes the gap.
    pub fn jumps(&self) -> bool {
        self.springs.iter().any(|s| s.preload != 0.0)
    }
}
