//! Phases of the impact law: contact displacements move by themselves, points in contact are held by reactions.
//!
//! ```text
//! M ü = f − K u − nᵀλ,      n_c ü = 0   ⇒   λ_c = D_cc⁻¹ n_c M⁻¹ (f − K u),    D = n M⁻¹nᵀ
//! ```
//!
//! Monitors: the gaps `g − n u` of free points, the pressures `λ/area` of those in contact.

use nalgebra::DMatrix;

use super::inertia::HeldMass;
use super::kinematics::{Drive, Part};
use super::states::States;
use super::system::Constraint;
use crate::fem::{Csr, Harmonic, Loads};

/// The affine functions of one active set.
#[derive(Debug)]
pub(super) struct Holding {
    /// `n`, rows over `u_O`.
    normal: Csr,
    gap: Vec<f64>,
    free: Vec<usize>,
    closed: Vec<usize>,
    /// Pressures of the points in contact: rows over `u_O`, and what constant loads give.
    rows: Vec<Vec<f64>>,
    offsets: Vec<f64>,
    /// Sums of the magnitudes of the rows.
    sums: Vec<f64>,
    /// Displacements that are held, and where.
    held: Vec<(usize, f64)>,
    pub drives: Vec<Drive>,
}

impl Holding {
    /// `through` are the columns `K M⁻¹nᵀ`.
    pub fn new(
        (mass, through): (&HeldMass, &[Vec<f64>]),
        constraints: &[Constraint],
        set: &States,
        loads: &Loads,
    ) -> Holding {
        let (free, closed) = (set.open_points(), set.closed_points());
        let size = closed.len();
        let inverse = mass
            .block(&closed)
            .try_inverse()
            .unwrap_or_else(|| DMatrix::from_element(size, size, f64::NAN));
        let n_o = mass.normal.n_cols();
        let combined = |i: usize, of: &dyn Fn(usize) -> f64| -> f64 {
            (0..size).map(|j| inverse[(i, j)] * of(closed[j])).sum::<f64>()
                / constraints[closed[i]].area
        };
        let row =
            |i: usize| -> Vec<f64> { (0..n_o).map(|c| -combined(i, &|k| through[k][c])).collect() };
        let of_force = |f: &[f64]| -> Vec<f64> {
            let along = |k: usize| mass.columns[k].iter().zip(f).map(|(a, f)| a * f).sum::<f64>();
            (0..size).map(|i| combined(i, &along)).collect()
        };
        let rows: Vec<Vec<f64>> = (0..size).map(row).collect();
        let held = |&k: &usize| {
            let entry = mass.normal.row(k).next();
            entry.map_or((0, 0.0), |(j, sign)| (j, sign * constraints[k].gap))
        };
        let drive = |(index, load): (usize, &Harmonic)| {
            let mut monitor = vec![0.0; constraints.len()];
            closed.iter().zip(of_force(&load.force)).for_each(|(&k, p)| monitor[k] = p);
            let displacement = vec![0.0; constraints.len()];
            let driven = monitor.iter().any(|p| *p != 0.0);
            driven.then(|| Drive { index, load: load.clone(), displacement, monitor })
        };
        Holding {
            normal: mass.normal.clone(),
            gap: constraints.iter().map(|c| c.gap).collect(),
            offsets: loads.constant.as_ref().map_or_else(|| vec![0.0; size], |f| of_force(f)),
            sums: rows.iter().map(|r| r.iter().map(|x| x.abs()).sum()).collect(),
            held: closed.iter().map(held).collect(),
            drives: loads.harmonics.iter().enumerate().filter_map(drive).collect(),
            free,
            closed,
            rows,
        }
    }

    pub fn expand(&self, x_o: &[f64], x: &mut [f64]) {
        let (x_o_out, x_c) = x.split_at_mut(x_o.len());
        x_o_out.copy_from_slice(x_o);
        x_c.iter_mut().enumerate().for_each(|(i, x)| *x = self.normal.row_dot(i, x_o));
    }

    /// Forces on held displacements move nothing.
    pub fn reduce(&self, b: &mut [f64]) {
        self.held.iter().for_each(|&(j, _)| b[j] = 0.0);
    }

    pub fn monitors(&self, x_o: &[f64], h: &mut [f64], part: Part) {
        let affine = part.is_affine();
        for &i in &self.free {
            h[i] = if affine { self.gap[i] } else { 0.0 } - self.normal.row_dot(i, x_o);
        }
        for ((&i, row), offset) in self.closed.iter().zip(&self.rows).zip(&self.offsets) {
            let linear: f64 = row.iter().zip(x_o).map(|(r, x)| r * x).sum();
            h[i] = if affine { offset + linear } else { linear };
        }
        part.add_drives(&self.drives, h, |d| &d.monitor);
    }

    pub fn a_star(&self) -> Csr {
        let n_o = self.normal.n_cols();
        let own = (0..n_o).map(|i| (i, i, 1.0));
        let of_points = self.normal.triplets().map(|(i, j, v)| (n_o + i, j, v));
        Csr::from_triplets(n_o + self.gap.len(), n_o, own.chain(of_points).collect())
    }

    pub fn scales(&self, i: usize, u: f64) -> [f64; 2] {
        let pressure = self.closed.iter().position(|&k| k == i).map_or(0.0, |k| self.sums[k] * u);
        [u.max(self.gap[i].abs()), pressure]
    }

    pub fn held_displacements(&self) -> Vec<usize> {
        self.held.iter().map(|h| h.0).collect()
    }

    /// A matrix over `u_O` in which held displacements know of no other.
    pub fn decoupled(&self, a: &Csr) -> Csr {
        let n_o = self.normal.n_cols();
        let is_held = |i: usize| self.held.iter().any(|h| h.0 == i);
        let kept = a
            .triplets()
            .filter(|&(i, j, _)| i < n_o && j < n_o && (i == j || !(is_held(i) || is_held(j))));
        Csr::from_triplets(n_o, n_o, kept.collect())
    }

    /// The constant force on `u_O` beside the decoupled matrices: held displacements are at rest under it.
    pub fn constant_force(&self, stiffness: &Csr, mut force: Vec<f64>) -> Vec<f64> {
        let n_o = self.normal.n_cols();
        force.truncate(n_o);
        let mut d = vec![0.0; stiffness.n_cols()];
        self.held.iter().for_each(|&(j, x)| d[j] = x);
        for (i, f) in force.iter_mut().enumerate() {
            *f -= stiffness.row_dot(i, &d);
        }
        for &(j, x) in &self.held {
            let own = stiffness.row(j).find(|e| e.0 == j).map_or(0.0, |e| e.1);
            force[j] = own * x;
        }
        force
    }
}
