//! Static equilibrium under the constant loads, contact included: `K_α u_O = f_α` with all monitors of α ≥ 0.
//!
//! With friction the balance is that of a body that was undeformed along its obstacles, `r_t ∈ μ r_n Sgn(u_t)`: a point sticks at `u_t = 0`, or slips to the side to
//! which it has moved. On a surface that moves along itself every point slips, by `−V`.
//!
//! Principal pivoting as for the complementarity problem ([`super::lcp`]): solve in the present set, change all points that are infeasible
//! while their number falls, one at a time otherwise.

use nalgebra::{DMatrix, DVector};

use super::coupling::Coupling;
use super::friction::Slider;
use super::lcp::UNITS;
use super::monitor::{Monitor, MonitorKind};
use super::phase::Phase;
use super::states::{PointState, States};
use super::system::System;
use crate::fem::{Csr, Pivots, SpdFactor, largest};

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
        // a body that can move rigidly is held by the obstacle, or not at all, or floats under loads that balance each other
        let motions = self.rigid_motions();
        let free = !motions.is_empty();
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
            let u = static_displacement(&phase, &held)
                .or_else(|| floating(&phase, &motions))
                .ok_or(NoEquilibrium::NotHeld)?;
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

    /// The motions `u_O` that neither supports nor springs oppose while nothing touches.
    fn rigid_motions(&self) -> Vec<Vec<f64>> {
        let n_o = self.n_o();
        let of = |field: &Vec<f64>| self.body.dofs.gather(field)[..n_o].to_vec();
        self.body.rigid_motions(false).iter().map(of).collect()
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

/// A motion moves what the stiffness opposes by less than this share, and works on loads by less: it does neither.
const DRIFTS: f64 = 1e-9;

/// The equilibrium of a body that something in it leaves free to move, under loads that do not move it: without a share of these motions. Friction is left to supports.
fn floating(phase: &Phase, motions: &[Vec<f64>]) -> Option<Vec<f64>> {
    if motions.is_empty() || phase.rubs() {
        return None;
    }
    let (stiffness, mass) = phase.matrices();
    let force = phase.constant_force();
    let n = force.len();
    let all = DMatrix::from_fn(n, motions.len(), |i, k| motions[k][i]);
    let by = |matrix: &Csr, x: &DMatrix<f64>| {
        let mut product = DMatrix::zeros(n, x.ncols());
        for (k, column) in x.column_iter().enumerate() {
            matrix.mul(column.as_slice(), product.column_mut(k).as_mut_slice());
        }
        product
    };
    // those of them that touching points leave
    let work = all.transpose() * by(&stiffness, &all);
    let stiff = stiffness.triplets().fold(0.0f64, |m, e| m.max(e.2.abs()));
    let eigen = (0.5 * (&work + work.transpose())).symmetric_eigen();
    let left = |k: &usize| eigen.eigenvalues[*k].abs() <= DRIFTS * stiff;
    let free: Vec<usize> = (0..motions.len()).filter(left).collect();
    if free.is_empty() {
        return None;
    }
    let drift = &all * eigen.eigenvectors.select_columns(&free);
    let push: f64 = force.iter().map(|f| f.abs()).sum();
    for column in drift.column_iter() {
        let moved: f64 = column.iter().zip(&force).map(|(d, f)| d * f).sum();
        if moved.abs() > DRIFTS * push * largest(column.as_slice()) {
            return None;
        }
    }
    // hold as many displacements as there are motions left: those that tell them apart best
    let mut rest = drift.clone();
    let mut held = vec![false; n];
    for _ in 0..free.len() {
        let size = |i: usize| rest.row(i).norm();
        let pivot = (0..n).max_by(|&a, &b| size(a).total_cmp(&size(b)))?;
        let row = rest.row(pivot).transpose() / size(pivot);
        rest -= &rest * &row * row.transpose();
        held[pivot] = true;
    }
    let kept = stiffness.triplets().filter(|e| !held[e.0] && !held[e.1]);
    let ones = (0..n).filter(|i| held[*i]).map(|i| (i, i, stiff));
    let pinned = Csr::from_triplets(n, n, kept.chain(ones).collect());
    let mut u: Vec<f64> = (0..n).map(|i| if held[i] { 0.0 } else { force[i] }).collect();
    let factor = SpdFactor::new(&pinned, "stiffness matrix of a phase").ok()?;
    factor.solve(&mut u, &mut factor.scratch());
    // u ← u − D (DᵀMD)⁻¹ DᵀM u
    let weighted = by(&mass, &drift);
    let gram = (drift.transpose() * &weighted).cholesky()?;
    let share = gram.solve(&(weighted.transpose() * DVector::from_column_slice(&u)));
    let moved = &drift * share;
    u.iter_mut().zip(moved.iter()).for_each(|(u, m)| *u -= m);
    is_solution(&stiffness, &u, &force).then_some(u)
}

/// Whether `K u = f` was solved: a rigid motion may pass the factorisation with a pivot of rounding size.
fn is_solution(stiffness: &Csr, u: &[f64], force: &[f64]) -> bool {
    let mut rest = force.to_vec();
    stiffness.mul_sub(u, &mut rest);
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
