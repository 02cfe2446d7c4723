//! What friction holds: the reactions of all points that stick, at once.
//!
//! ```text
//! λ = D⁻¹ E M⁻¹ (f_α − K_α y − C ẏ − Σ_slip e r) = a q,      D = E M⁻¹ Eᵀ
//! q = P (q₀(t) − S y − Z ẏ),      S = E M⁻¹ K_α,   Z = E M⁻¹ C,   P = diag(a)⁻¹ D⁻¹
//! ```
//!
//! A row of `P S` is full; those of `S` reach no further than the columns `M⁻¹Eᵀ` and their neighbours. So the tractions are computed together, and a
//! monitor names one of them.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::expansion::{Expansion, Solved};
use super::monitor::{Row, Size, Term};
use super::phase::Parts;
use super::reactions::Columns;
use crate::fem::{Csr, Discrete};

/// What unit forces along the tangents of all points meet, the same in every phase.
#[derive(Debug)]
pub(super) struct Along {
    /// `M⁻¹Eᵀ`
    pub columns: Arc<Columns>,
    /// `K [M⁻¹Eᵀ; 0]` over `u`, a column a row.
    through: Csr,
    /// `N_O M⁻¹Eᵀ`
    stress: DMatrix<f64>,
    /// Displacements that know of such forces in some phase.
    support: Vec<usize>,
}

impl Along {
    /// Of tangents, rows over `u_O`, of a body of this stiffness whose contact displacements follow by `N_O`; with the displacements that springs may pull at.
    pub fn new(
        rows: Csr,
        (stiffness, n_o): (&Csr, &Csr),
        pulled: impl Iterator<Item = usize>,
        solve: impl FnMut(&mut [f64]),
    ) -> Along {
        let columns = Columns::new(Arc::new(rows), solve);
        let (count, n) = (columns.rows.n_rows(), stiffness.n_rows());
        let padded = Csr::from_triplets(count, n, columns.columns.triplets().collect());
        let through = padded.product(stiffness);
        let mut stress = DMatrix::zeros(n_o.n_rows(), count);
        let of_tangents = n_o.product(&columns.columns.transposed());
        of_tangents.triplets().for_each(|(i, k, v)| stress[(i, k)] = v);
        let of_contact = (n_o.n_cols()..n).flat_map(|i| stiffness.row(i));
        let all = through.triplets().map(|e| e.1).chain(of_contact.map(|e| e.0));
        let all = all.chain(n_o.triplets().map(|e| e.1)).chain(pulled);
        let mut support: Vec<usize> = all.collect();
        support.sort_unstable();
        support.dedup();
        Along { columns: Arc::new(columns), through, stress, support }
    }

    /// `A*ᵀ K A* M⁻¹eᵀ` of one of them, into a full vector that is zero.
    fn elastic(&self, place: usize, (solved, stiffness): (&Solved, &Csr), force: &mut [f64]) {
        let n_o = self.columns.rows.n_cols();
        self.through.add_row(place, 1.0, force);
        let follow = solved.follow(self.stress.column(place).as_slice());
        // rows of K for its columns
        solved.free.iter().zip(&follow).for_each(|(&i, &x)| stiffness.add_row(n_o + i, x, force));
        let (of_o, of_c) = force.split_at_mut(n_o);
        solved.push(of_c, |j, x| of_o[j] += x);
    }
}

/// The force `−f (p · u_O) e` of a point that slips: the tangent among all, `f`, `p`.
pub(super) type Slipping<'a> = (usize, f64, &'a [(usize, f64)]);

/// What the tractions of a phase are made of.
pub(super) struct Sticking<'a> {
    /// Of each point that sticks: its tangent among all, its area, the velocity of the surface.
    pub points: Vec<(usize, f64, f64)>,
    /// Points that slip.
    pub slips: Vec<Slipping<'a>>,
    /// Springs that are there in this phase, and do not damp.
    pub springs: Vec<&'a Discrete>,
    /// The constant force on `u_O`.
    pub force: Vec<f64>,
    /// That of each drive.
    pub drives: Vec<Vec<f64>>,
}

/// `q` of the points that stick.
#[derive(Debug, Default)]
pub(super) struct Tractions {
    /// `P`
    combine: DMatrix<f64>,
    /// `−S`
    of_displacements: Csr,
    /// `−Z`; none where nothing but `α M` damps.
    of_velocities: Option<Csr>,
    /// Of each point, as a row of a monitor.
    rows: Vec<Row>,
}

impl Tractions {
    /// In a phase in which some points stick.
    pub fn new(
        along: &Along,
        sticking: &Sticking,
        expansion: &Expansion,
        parts: &Parts,
    ) -> Tractions {
        let places: Vec<usize> = sticking.points.iter().map(|p| p.0).collect();
        let columns = &along.columns;
        let mut combine = columns.inverse(&places);
        for (mut row, (_, area, _)) in combine.row_iter_mut().zip(&sticking.points) {
            row /= *area;
        }
        let [of_displacements, of_velocities] = along.meet(&places, sticking, expansion, parts);
        let alpha = parts.damping.map_or(0.0, |d| d.alpha);
        let met = |force: &[f64], k: usize| columns.columns.row_dot(k, force);
        let points = sticking.points.iter();
        let constant = points.map(|&(k, _, surface)| met(&sticking.force, k) - alpha * surface);
        let constant = &combine * DVector::from_vec(constant.collect());
        let drive = |force: &Vec<f64>| {
            &combine * DVector::from_vec(places.iter().map(|&k| met(force, k)).collect())
        };
        let drives: Vec<DVector<f64>> = sticking.drives.iter().map(drive).collect();
        let sums = [&of_displacements, &of_velocities]
            .map(|rows| combine.abs() * DVector::from_vec(rows.abs_row_sums()));
        let row = |i: usize| {
            let sum = sums[0][i];
            let gap = constant[i] / sum.max(f64::MIN_POSITIVE);
            let size = Size { a: sum, b: 0.0, gap, c: 1.0 };
            Row {
                constant: constant[i],
                terms: vec![(1.0, Term::Traction(i))],
                rates: vec![],
                drives: drives.iter().map(|d| d[i]).collect(),
                size: [size; 2],
                rate_size: sums[1][i],
            }
        };
        let rows = (0..places.len()).map(row).collect();
        let of_velocities = (of_velocities.n_entries() > 0).then_some(of_velocities);
        Tractions { combine, of_displacements, of_velocities, rows }
    }

    /// As rows of monitors.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Whether they depend on velocities.
    pub fn know_velocities(&self) -> bool {
        self.of_velocities.is_some()
    }

    /// Their linear part, `−P (S x + Z w)`.
    pub fn linear(&self, x_o: &[f64], w_o: &[f64]) -> Vec<f64> {
        if self.rows.is_empty() {
            return vec![];
        }
        let mut along = DVector::zeros(self.rows.len());
        self.of_displacements.mul(x_o, along.as_mut_slice());
        if let Some(rows) = &self.of_velocities {
            along.iter_mut().enumerate().for_each(|(k, a)| *a += rows.row_dot(k, w_o));
        }
        (&self.combine * along).as_slice().to_vec()
    }
}

impl Along {
    /// `−S` and `−Z` of some tangents.
    fn meet(
        &self,
        places: &[usize],
        sticking: &Sticking,
        expansion: &Expansion,
        parts: &Parts,
    ) -> [Csr; 2] {
        let (n, n_o) = (parts.body.dofs.n(), self.columns.rows.n_cols());
        let columns = &self.columns.columns;
        let beta = parts.damping.map_or(0.0, |d| d.beta);
        let mut force = vec![0.0; n];
        let (mut of_displacements, mut of_velocities) = (vec![], vec![]);
        let support = || self.support.iter().copied().filter(|j| *j < n_o);
        for (row, &k) in places.iter().enumerate() {
            if let Some(solved) = expansion.solved() {
                self.elastic(k, (solved, &parts.body.stiffness), &mut force);
            }
            if beta > 0.0 {
                of_velocities.extend(support().map(|j| (row, j, -beta * force[j])));
            }
            for spring in &sticking.springs {
                let own = |&(j, w): &(usize, f64)| w * columns.entry(k, j).unwrap_or(&0.0);
                let push = spring.stiffness * spring.row.iter().map(own).sum::<f64>();
                spring.row.iter().for_each(|&(j, w)| force[j] += push * w);
            }
            for &(place, factor, pressure) in &sticking.slips {
                let push = factor * self.columns.between(place, k);
                pressure.iter().for_each(|&(j, v)| force[j] += push * v);
            }
            of_displacements.extend(support().map(|j| (row, j, -force[j])));
            self.support.iter().for_each(|&j| force[j] = 0.0);
        }
        if let Some(dampers) = &parts.dampers {
            let all = columns.product(&dampers.matrix());
            let of = places.iter().enumerate();
            let entries = of.flat_map(|(row, &k)| all.row(k).map(move |(j, v)| (row, j, -v)));
            of_velocities.extend(entries);
        }
        [of_displacements, of_velocities]
            .map(|entries| Csr::from_triplets(places.len(), n_o, entries))
    }
}
