//! The contact conditions of one body as a linear complementarity problem (theory §2–3).
//!
//! ```text
//! p = p_f(t) − N_C u_C − N_O u_O ≥ 0,   w = g − u_C ≥ 0,   wᵀp = 0
//! ```
//!
//! `p_f` is the pressure that loads on `u_C` itself bring in: zero where the stress is that of the displacement field, `f_C` over the area
//! where it is the nodal reaction. With `q = p_f − N_C g − N_O u_O` it reads `0 ≤ w ⟂ N_C w + q ≥ 0`.

use nalgebra::{DMatrix, DVector};

use super::active::ActiveSet;
use super::boundary::BoundaryOperator;
use super::coupling::Coupling;
use super::lcp::{self, LcpError, LcpSolution, PMatrix};
use crate::fem::{Csr, Loads};

/// `N_C`, `N_O`, gaps and areas of all contact points.
#[derive(Debug)]
pub struct Conditions {
    /// `N_C`, `n_C × n_C`.
    pub n_c: Coupling,
    /// `N_O`, `n_C × n_O`.
    pub n_o: Csr,
    /// Gap of each contact point.
    pub gap: Vec<f64>,
    /// Area of each contact point (force = pressure × area).
    pub area: Vec<f64>,
    /// How `N_C` is known to be a P-matrix.
    pub p_matrix: PMatrix,
    /// Loads on `u_C` enter: the pressure is a nodal reaction.
    pub(super) bears_loads: bool,
    /// `N_C` is diagonal: no contact point knows of another.
    pub(super) is_diagonal: bool,
    n_o_sums: Vec<f64>,
    n_c_sums: Vec<f64>,
}

/// Data of a degenerate state one order up: what changes with the rates `x = u̇_O` (or, another order up, `ü_O`).
#[derive(Debug, Clone, Copy)]
pub struct Rates<'a> {
    /// `u̇_O`, or `ü_O`.
    pub x: &'a [f64],
    /// Derivative of `p_f` of the same order, where there is one.
    pub load: Option<&'a [f64]>,
    /// Rounding errors of `x`.
    pub blur: f64,
}

impl Conditions {
    /// Conditions of a boundary operator; the index of the point to blame if `N_C` cannot be shown to be a P-matrix.
    pub fn new(
        operator: BoundaryOperator,
        gap: Vec<f64>,
        bears_loads: bool,
    ) -> Result<Self, usize> {
        let BoundaryOperator { n_c, n_o, area } = operator;
        let size = area.len();
        let p_matrix = lcp::p_matrix(&n_c, &area);
        let n_c = Coupling::from(n_c);
        if let PMatrix::NotShown { index } = p_matrix {
            return Err(index);
        }
        Ok(Conditions {
            gap,
            p_matrix,
            bears_loads,
            is_diagonal: n_c.is_diagonal(),
            n_o_sums: n_o.abs_row_sums(),
            n_c_sums: (0..size).map(|i| n_c.row_size(i, &vec![1.0; size])).collect(),
            n_c,
            n_o,
            area,
        })
    }

    /// Number of contact points.
    pub fn len(&self) -> usize {
        self.gap.len()
    }

    /// Whether there is no contact at all.
    pub fn is_empty(&self) -> bool {
        self.gap.is_empty()
    }

    /// Pressure that a unit displacement of point `i` alone takes away: its unit of pressure over length.
    pub fn stiffness(&self, i: usize) -> f64 {
        self.n_c[(i, i)]
    }

    /// `p` of a force on all displacements: what it adds to the pressures.
    pub(super) fn pressure_of(&self, force: &[f64]) -> Vec<f64> {
        let n_o = self.n_o.n_cols();
        force[n_o..].iter().zip(&self.area).map(|(f, a)| f / a).collect()
    }

    /// `p_f(t)`, or its first or second derivative; none where loads do not enter, or do not act on `u_C`.
    pub(super) fn load_pressure(&self, loads: &Loads, t: f64, order: u32) -> Option<Vec<f64>> {
        if !self.bears_loads || loads.is_none() {
            return None;
        }
        let mut p = match &loads.constant {
            Some(f) if order == 0 => self.pressure_of(f),
            _ => vec![0.0; self.len()],
        };
        for h in &loads.harmonics {
            let c = h.factor(t, order);
            p.iter_mut().zip(self.pressure_of(&h.force)).for_each(|(p, f)| *p += c * f);
        }
        p.iter().any(|p| *p != 0.0).then_some(p)
    }

    /// Size of the terms that make up the pressure at point `i` when displacements are of the order of `u`: rounding errors of pressures
    /// are judged against it.
    pub fn pressure_scale(&self, i: usize, u: f64) -> f64 {
        self.n_o_sums[i] * u + self.n_c_sums[i] * u.max(self.gap[i].abs())
    }

    /// Size of the terms of `∇p_i · x` for `x` of the order of `size` (a velocity, an acceleration).
    pub fn pressure_rate_scale(&self, i: usize, size: f64) -> f64 {
        self.n_o_sums[i] * size
    }

    /// `q = p_f − N_C g − N_O u_O` and the size of its terms.
    pub fn data(&self, u_o: &[f64], load: Option<&[f64]>) -> (Vec<f64>, Vec<f64>) {
        let size = self.len();
        let u = u_o.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let n_c_gap = |i: usize| self.n_c.row_dot(i, &self.gap);
        let load = |i: usize| load.map_or(0.0, |p| p[i]);
        let q = (0..size).map(|i| load(i) - (n_c_gap(i) + self.n_o.row_dot(i, u_o))).collect();
        let scale = (0..size).map(|i| self.pressure_scale(i, u) + load(i).abs()).collect();
        (q, scale)
    }

    /// Solve `0 ≤ w ⟂ N_C w + q ≥ 0` for the gaps at `u_O`, warm from `start`.
    pub fn solve(
        &self,
        u_o: &[f64],
        load: Option<&[f64]>,
        start: &ActiveSet,
    ) -> Result<LcpSolution, LcpError> {
        let (q, scale) = self.data(u_o, load);
        lcp::solve(&self.n_c, &q, &scale, start.flags())
    }

    /// `0 ≤ ẇ ⟂ ṗ ≥ 0` on the degenerate points, `ṗ = S ẇ + q̇` with `S` the Schur complement of `N_C` on them: the free points that are not
    /// degenerate follow with `ṗ = 0`, those in contact stay (theory §5). Returns the set and the points that stay degenerate.
    pub fn solve_rates(
        &self,
        present: &ActiveSet,
        degenerate: &[usize],
        rates: Rates,
    ) -> Result<(ActiveSet, Vec<usize>), LcpError> {
        let size = rates.x.iter().fold(0.0f64, |m, x| m.max(x.abs())) + rates.blur;
        let load = |i: usize| rates.load.map_or(0.0, |p| p[i]);
        let scale: Vec<f64> =
            degenerate.iter().map(|&i| self.pressure_rate_scale(i, size) + load(i).abs()).collect();
        let rate = |i: usize| load(i) - self.n_o.row_dot(i, rates.x);
        let others: Vec<usize> =
            (0..self.len()).filter(|i| !present.is_active(*i) && !degenerate.contains(i)).collect();
        let block = |rows: &[usize], cols: &[usize]| {
            DMatrix::from_fn(rows.len(), cols.len(), |a, b| self.n_c[(rows[a], cols[b])])
        };
        let mut schur = block(degenerate, degenerate);
        let mut q: Vec<f64> = degenerate.iter().map(|&i| rate(i)).collect();
        let coupling = block(degenerate, &others);
        if coupling.iter().any(|&x| x != 0.0) {
            let lu = block(&others, &others).lu();
            let solve = |rhs: DMatrix<f64>| lu.solve(&rhs).ok_or(LcpError::Singular);
            let of_others = DMatrix::from_fn(others.len(), 1, |a, _| rate(others[a]));
            schur -= &coupling * solve(block(&others, degenerate))?;
            let shift: DVector<f64> = (&coupling * solve(of_others)?).column(0).into_owned();
            q.iter_mut().zip(shift.iter()).for_each(|(q, s)| *q -= s);
        }
        let start: Vec<bool> = degenerate.iter().map(|&i| present.is_active(i)).collect();
        let solution = lcp::solve(&schur.into(), &q, &scale, &start)?;
        let mut set = present.clone();
        degenerate.iter().zip(&solution.active).for_each(|(&i, &a)| set.set(i, a));
        Ok((set, solution.degenerate.iter().map(|&k| degenerate[k]).collect()))
    }
}
