//! Static equilibrium under the constant loads, contact included: `K_α u_O = f_α` with all monitors of α ≥ 0.
//!
//! With friction the balance is that of a body that was undeformed along its obstacles, `r_t ∈ μ r_n Sgn(u_t)`: a point sticks at `u_t = 0`, or slips to the side to
//! which it has moved. On a surface that moves along itself every point slips, by `−V`.
//!
//! Principal pivoting as for the complementarity problem ([`super::lcp`]): solve in the present set, change all points that are infeasible
//! while their number falls, one at a time otherwise.

use super::coupling::Coupling;
use super::friction::Slider;
use super::lcp::UNITS;
use super::monitor::{Monitor, MonitorKind};
use super::phase::Phase;
use super::states::{PointState, States};
use super::system::System;
use crate::fem::{Csr, Pivots, SpdFactor};

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
        let mut set = States::of_contact((0..n_c).map(|i| free || i >= self.conditions().len()));
        (0..n_c).for_each(|i| set.set(i, self.at_rest(i, set.at(i))));
        let (mut fewest, mut patience) = (n_c + 1, 3);
        let limit = 50 + 20 * n_c * n_c;
        let remembered: Vec<f64> =
            self.sliders().iter().filter_map(|s| Some(s.elastic?.start())).collect();
        for _ in 0..limit {
            let phase = self.phase(&set);
            // what springs of sliders remember stands behind what sticks
            let mut held = vec![0.0; phase.stuck().len() - remembered.len()];
            held.extend(&remembered);
            let u = static_displacement(&phase, &held).ok_or(NoEquilibrium::NotHeld)?;
            let wrong = infeasible(self, &phase, &u);
            let Some(first) = wrong.first() else {
                let mut u = u;
                self.sliders().iter().for_each(|s| s.settle(&mut u));
                return Ok((set, u));
            };
            if wrong.len() < fewest {
                (fewest, patience) = (wrong.len(), 3);
            } else {
                patience -= 1;
            }
            let change = if patience >= 0 { &wrong[..] } else { std::slice::from_ref(first) };
            change.iter().for_each(|m| set.set(m.point, self.at_rest(m.point, m.to)));
        }
        Err(NoEquilibrium::Pivots(limit))
    }

    /// What a point at rest does that is to go into a state: where it touches a surface that moves, it slips.
    fn at_rest(&self, point: usize, to: PointState) -> PointState {
        match (self.tangent(point), to) {
            (Some(t), _) if to.touches() && t.surface != 0.0 => PointState::of_slip(-t.surface),
            (Some(_), PointState::Closed) => PointState::Stick,
            _ => to,
        }
    }
}

/// `K_α⁻¹ f_α`, if the phase is held; what sticks is at `held`.
pub(crate) fn static_displacement(phase: &Phase, held: &[f64]) -> Option<Vec<f64>> {
    let mut stiffness = phase.matrices().0;
    let mut force = phase.constant_force();
    let mut u = force.clone();
    if phase.rubs() {
        let n = force.len();
        let stuck = phase.stuck();
        let rows: Vec<&[(usize, f64)]> = stuck.iter().map(|s| s.0).collect();
        let rows = Pivots::of(n, &rows)?;
        if let Some(slips) = phase.slip_stiffness() {
            let entries = stiffness.triplets().chain(slips.triplets());
            stiffness = Csr::from_triplets(n, n, entries.collect());
        }
        // what sticks stays where it is
        stiffness = rows.congruence(&stiffness).unwrap_or(stiffness);
        rows.onto(&mut force);
        let moves = |i: usize| !rows.pivots.contains(&i);
        let place = |j: usize| rows.pivots.iter().position(|p| *p == j);
        for (i, j, k) in stiffness.triplets().filter(|e| moves(e.0)) {
            if let Some(p) = place(j) {
                force[i] -= k * held[p];
            }
        }
        let kept = stiffness.triplets().filter(|e| moves(e.0) && moves(e.1));
        let kept = kept.chain(rows.pivots.iter().map(|&i| (i, i, 1.0)));
        stiffness = Csr::from_triplets(n, n, kept.collect());
        rows.pivots.iter().zip(held).for_each(|(&i, h)| force[i] = *h);
        u.copy_from_slice(&force);
        let all: Vec<usize> = (0..n).collect();
        Coupling::from(stiffness.clone()).block(&all).ok()?.solve(&mut u).ok()?;
        let is_held = is_solution(&stiffness, &u, &force);
        rows.forth(&mut u);
        return is_held.then_some(u);
    } else {
        let factor = SpdFactor::new(&stiffness, "stiffness matrix of a phase").ok()?;
        factor.solve(&mut u, &mut factor.scratch());
    }
    is_solution(&stiffness, &u, &force).then_some(u)
}

/// Whether `K u = f` was solved: a rigid motion may pass the factorisation with a pivot of rounding size.
fn is_solution(stiffness: &Csr, u: &[f64], force: &[f64]) -> bool {
    let mut rest = force.to_vec();
    stiffness.mul_sub(u, &mut rest);
    let largest = |x: &[f64]| x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let stiff = stiffness.triplets().fold(0.0f64, |m, e| m.max(e.2.abs()));
    let held =
        largest(u) * stiff <= 1e13 * largest(force) && largest(&rest) <= 1e-6 * largest(force);
    held && u.iter().all(|u| u.is_finite())
}

/// The monitors that are negative; of a point that slips on a surface at rest by how far it has moved to its side.
fn infeasible(system: &System, phase: &Phase, u: &[f64]) -> Vec<Monitor> {
    let mut h = vec![0.0; phase.monitors.len()];
    phase.monitor_undriven(u, &vec![0.0; u.len()], &mut h);
    let least = monitor_tolerance(system, phase, u);
    for (h, monitor) in h.iter_mut().zip(&phase.monitors) {
        if let (MonitorKind::Slip, Some(t)) = (monitor.kind, system.tangent(monitor.point)) {
            let sigma = phase.set.at(monitor.point).slip().unwrap_or(0.0);
            // a spring has given way before
            let spring =
                |s: &Slider| s.elastic.map(|e| (s.limit - sigma * e.preload) / e.stiffness);
            let given = system.slider(monitor.point).and_then(spring).unwrap_or(0.0);
            *h = if t.surface == 0.0 { sigma * t.along(u) - given } else { t.surface.abs() };
        }
    }
    let negative = |k: &usize| h[*k] < -least[*k];
    (0..h.len()).filter(negative).map(|k| phase.monitors[k].clone()).collect()
}

/// What counts as zero of each monitor: displacements of a static solution carry more than one rounding error.
pub(crate) fn monitor_tolerance(system: &System, phase: &Phase, u: &[f64]) -> Vec<f64> {
    let size = u.iter().fold(system.units.length, |m, x| m.max(x.abs()));
    phase.monitor_rounding(size, size).iter().map(|r| 1e-12 / UNITS * r).collect()
}
