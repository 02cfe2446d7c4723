//! A body before its obstacles as plain matrices, for programs that know nothing of phases.
//!
//! ```text
//! M ü + C u̇ + K u = f₀ + Σ_j f_j d^m/dt^m cos(ω_j t + φ_j) − Wᵀ λ,      g − W u ≥ 0 ⟂ λ ≥ 0
//! ```

use super::states::States;
use super::system::{State, System};
use crate::fem::Csr;

/// The matrices over `u = (u_O, u_C)`.
#[derive(Debug, Clone)]
pub struct Given {
    /// `K`
    pub stiffness: Csr,
    /// `M`, of contact displacements without mass zero there.
    pub mass: Csr,
    /// `C`, where anything damps.
    pub damping: Option<Csr>,
    /// `W`: displacements of the contact points towards their obstacles, a row each.
    pub contact: Csr,
    /// `g`
    pub gap: Vec<f64>,
}

impl System {
    /// Whether pressures are nodal reactions: forces on contact displacements over their areas.
    pub fn bears_reactions(&self) -> bool {
        self.conditions().bears_loads
    }

    /// All displacements and velocities of a state at `t = 0`; none where its complementarity problem was not solved.
    pub fn whole_state(&self, state: &State) -> Option<[Vec<f64>; 2]> {
        let set = self.select(0.0, &state.u, &States::open(self.n_contact())).ok()?.set;
        let phase = self.phase(&set);
        let [mut u, mut v] = [vec![0.0; self.n()], vec![0.0; self.n()]];
        phase.expand_displacement(0.0, &state.u, &mut u);
        phase.expand_velocity(0.0, &state.v, &mut v);
        Some([u, v])
    }

    /// Its matrices; friction, sliders and obstacles that yield are none of them.
    pub fn given(&self) -> Given {
        let n = self.n_displacements();
        let (stiffness, mass) = (self.body.stiffness.leading(n), self.mass().leading(n));
        let of_body = |alpha: f64, beta: f64| {
            Csr::combination(alpha, &mass, beta, &self.body.structure().leading(n))
        };
        let proportional = self.damping.map(|d| of_body(d.alpha, d.beta));
        let own = self.dampers.as_ref().map(|d| {
            // over u_O
            Csr::from_triplets(n, n, d.matrix().triplets().collect())
        });
        let damping = match (proportional, own) {
            (Some(a), Some(b)) => Some(Csr::combination(1.0, &a, 1.0, &b)),
            (a, b) => a.or(b),
        };
        let facing = self.facing();
        let contact = match self.obstacle_rows() {
            Some([normal, ..]) => normal.clone(),
            None => {
                let points = self.conditions().points.iter().enumerate();
                let rows = points.map(|(k, &(d, s))| (k, self.n_o() + d, s)).collect();
                Csr::from_triplets(facing.len(), n, rows)
            }
        };
        let gap = facing.iter().map(|c| c.gap).collect();
        Given { stiffness, mass, damping, contact, gap }
    }
}
