//! Static equilibrium under the constant loads, contact included: `K_α u_O = f_α` with all monitors of α ≥ 0.
//!
//! Principal pivoting as for the complementarity problem ([`super::lcp`]): solve in the present set, change all points that are infeasible
//! while their number falls, one at a time otherwise.

use super::lcp::UNITS;
use super::monitor::Monitor;
use super::phase::Phase;
use super::states::States;
use super::system::System;
use crate::fem::SpdFactor;

/// No equilibrium was found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoEquilibrium {
    /// The body is not held, with whatever points in contact.
    #[error(
        "nothing holds the body: the constant loads carry it away from the obstacle, or along it"
    )]
    NotHeld,
    /// The pivoting did not end.
    #[error("no equilibrium after {0} changes of the active set")]
    Pivots(usize),
}

impl System {
    /// The active set and `u_O` of the static equilibrium; harmonic loads are left out.
    pub fn equilibrium(&self) -> Result<(States, Vec<f64>), NoEquilibrium> {
        let n_c = self.n_contact();
        // a body that can move rigidly is held by the obstacle, or not at all
        let free = !self.body.rigid_motions(false).is_empty();
        let mut set = if free { States::closed(n_c) } else { States::open(n_c) };
        let (mut fewest, mut patience) = (n_c + 1, 3);
        let limit = 50 + 20 * n_c * n_c;
        for _ in 0..limit {
            let phase = self.phase(&set);
            let u = static_displacement(&phase).ok_or(NoEquilibrium::NotHeld)?;
            let wrong = infeasible(&phase, &u, self.units.length);
            let Some(first) = wrong.first() else { return Ok((set, u)) };
            if wrong.len() < fewest {
                (fewest, patience) = (wrong.len(), 3);
            } else {
                patience -= 1;
            }
            let change = if patience >= 0 { &wrong[..] } else { std::slice::from_ref(first) };
            change.iter().for_each(|m| set.set(m.point, m.to));
        }
        Err(NoEquilibrium::Pivots(limit))
    }
}

/// `K_α⁻¹ f_α`, if the phase is held.
fn static_displacement(phase: &Phase) -> Option<Vec<f64>> {
    let stiffness = phase.matrices().0;
    let mut u = phase.constant_force();
    let factor = SpdFactor::new(&stiffness, "stiffness matrix of a phase").ok()?;
    let force = u.clone();
    factor.solve(&mut u, &mut factor.scratch());
    // a rigid motion may pass the factorisation with a pivot of rounding size
    let mut rest = force.clone();
    stiffness.mul_sub(&u, &mut rest);
    let largest = |x: &[f64]| x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let stiff = stiffness.triplets().fold(0.0f64, |m, e| m.max(e.2.abs()));
    let held =
        largest(&u) * stiff <= 1e13 * largest(&force) && largest(&rest) <= 1e-6 * largest(&force);
    (held && u.iter().all(|u| u.is_finite())).then_some(u)
}

/// The monitors that are negative.
fn infeasible(phase: &Phase, u: &[f64], unit: f64) -> Vec<Monitor> {
    let size = u.iter().fold(unit, |m, x| m.max(x.abs()));
    let mut h = vec![0.0; phase.monitors.len()];
    phase.monitor_undriven(u, &vec![0.0; u.len()], &mut h);
    // displacements of a static solution carry more than one rounding error
    let rounding = phase.monitor_rounding(size, 0.0);
    let negative = |k: &usize| h[*k] < -1e-12 / UNITS * rounding[*k];
    (0..h.len()).filter(negative).map(|k| phase.monitors[k].clone()).collect()
}
