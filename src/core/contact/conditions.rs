//! The contact conditions of one body as a linear complementarity problem (theory §2–3).
//!
//! ```text
//! p = p_f(t) − N_C u_C − N_O u_O ≥ 0,   w = g − u_C ≥ 0,   wᵀp = 0
//! ```
//!
//! A displacement may have a second obstacle behind, `−u_C ≤ g'`. Each obstacle before a displacement is a *contact point*: the displacement with a sign,
//! `w = g − s u_C`, `p = s (p_f − N_C u_C − N_O u_O)`. The last displacements may face nothing (those of the surface that another one meets): they follow, `p = 0`.
//!
//! `p_f` is the pressure that loads on `u_C` itself bring in: zero where the stress is that of the displacement field, `f_C` over the area
//! where it is the nodal reaction. With `q = p_f − N_C g − N_O u_O` it reads `0 ≤ w ⟂ N_C w + q ≥ 0`.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use super::boundary::BoundaryOperator;
use super::coupling::Coupling;
use super::lcp::{self, Bounds, ComparisonMatrix, LcpError, LcpSolution, PMatrix, Side};
use super::states::{PointState, States};
use crate::fem::{Csr, Loads, largest};

/// `N_C`, `N_O`, gaps and areas of all contact points.
#[derive(Debug)]
pub struct Conditions {
    /// `N_C`, `n_C × n_C`.
    pub n_c: Coupling,
    /// `N_O`, `n_C × n_O`.
    pub n_o: Csr,
    /// Displacement of each contact point and its sign: all in front in their order, then those behind.
    pub points: Vec<(usize, f64)>,
    /// Number of displacements that face an obstacle: the first.
    facing: usize,
    /// Gap of each contact point.
    pub gap: Vec<f64>,
    /// Way from one obstacle to the other of each displacement; empty where there are none behind.
    way: Vec<f64>,
    /// Area of each displacement (force = pressure × area).
    pub area: Vec<f64>,
    /// How `N_C` is known to be a P-matrix.
    pub p_matrix: PMatrix,
    /// Loads on `u_C` enter: the pressure is a nodal reaction.
    pub(super) bears_loads: bool,
    /// `N_C` is diagonal: no contact point knows of another.
    pub(super) is_diagonal: bool,
    n_o_sums: Vec<f64>,
    n_c_sums: Vec<f64>,
    comparison: OnceLock<Option<ComparisonMatrix>>,
}

/// Gaps of contact displacements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gaps {
    /// To the obstacle in front, one a displacement; the last displacements may face nothing and have none.
    pub front: Vec<f64>,
    /// To one behind, of some displacements; their sums with those in front are positive.
    pub behind: Vec<(usize, f64)>,
}

impl Gaps {
    /// Obstacles in front alone.
    pub fn front(front: Vec<f64>) -> Gaps {
        Gaps { front, behind: vec![] }
    }
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
    /// Conditions of a boundary operator, with the gaps in front and, of some displacements, behind; the index of the displacement to blame if `N_C`
    /// cannot be shown to be a P-matrix.
    pub fn new(operator: BoundaryOperator, gaps: Gaps, bears_loads: bool) -> Result<Self, usize> {
        let BoundaryOperator { n_c, n_o, area } = operator;
        let size = area.len();
        let p_matrix = lcp::p_matrix(&n_c, &area);
        if let PMatrix::NotShown { index } = p_matrix {
            return Err(index);
        }
        let facing = gaps.front.len();
        let mut points: Vec<(usize, f64)> = (0..facing).map(|d| (d, 1.0)).collect();
        let (mut gap, mut way) = (gaps.front, vec![]);
        if !gaps.behind.is_empty() {
            way = vec![f64::INFINITY; size];
        }
        for (d, behind) in gaps.behind {
            points.push((d, -1.0));
            gap.push(behind);
            way[d] = gap[d] + behind;
        }
        Ok(Conditions {
            points,
            facing,
            way,
            gap,
            p_matrix,
            bears_loads,
            is_diagonal: n_c.is_diagonal(),
            n_o_sums: n_o.abs_row_sums(),
            n_c_sums: (0..size).map(|i| n_c.row_size(i, &vec![1.0; size])).collect(),
            comparison: OnceLock::new(),
            n_c,
            n_o,
            area,
        })
    }

    /// Bounds of how points follow each other, of an H-matrix.
    pub(super) fn follow_bounds(&self) -> Option<&ComparisonMatrix> {
        self.comparison.get_or_init(|| ComparisonMatrix::of(&self.n_c)).as_ref()
    }

    /// The gaps that it was made with.
    pub fn gaps(&self) -> Gaps {
        let (front, behind) = self.gap.split_at(self.facing);
        let of = self.points[self.facing..].iter().zip(behind);
        Gaps { front: front.to_vec(), behind: of.map(|(p, g)| (p.0, *g)).collect() }
    }

    /// Number of contact displacements.
    pub fn count(&self) -> usize {
        self.area.len()
    }

    /// Number of contact displacements that face an obstacle: the first of them all.
    pub fn facing(&self) -> usize {
        self.facing
    }

    /// Displacements of the contact points towards their obstacles.
    pub fn at_points(&self, u_c: &[f64]) -> Vec<f64> {
        self.points.iter().map(|&(d, s)| s * u_c[d]).collect()
    }

    /// Where the displacements stand when the points of a set touch.
    pub fn places(&self, set: &States) -> Vec<Side> {
        let mut places = vec![Side::Free; self.count()];
        let touching = self.points.iter().zip(set.iter()).filter(|(_, state)| state.touches());
        for (&(d, s), _) in touching {
            places[d] = if s > 0.0 { Side::Front } else { Side::Behind };
        }
        places
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
        let (d, _) = self.points[i];
        self.n_c[(d, d)]
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
            _ => vec![0.0; self.count()],
        };
        for h in loads.harmonics.iter().filter(|h| !h.damps) {
            let c = h.factor(t, order);
            p.iter_mut().zip(self.pressure_of(&h.force)).for_each(|(p, f)| *p += c * f);
        }
        p.iter().any(|p| *p != 0.0).then_some(p)
    }

    /// Size of the terms that make up the pressure of displacement `d` when displacements are of the order of `u`: rounding errors of pressures are judged against it.
    pub(super) fn pressure_scale(&self, d: usize, u: f64, gap: f64) -> f64 {
        self.n_o_sums[d] * u + self.n_c_sums[d] * u.max(gap.abs())
    }

    /// Sums of magnitudes of the rows of `N_O` and `N_C` of a displacement.
    pub(super) fn sums(&self, d: usize) -> (f64, f64) {
        (self.n_o_sums[d], self.n_c_sums[d])
    }

    /// Size of the terms of `∇p_i · x` for `x` of the order of `size` (a velocity, an acceleration).
    pub(crate) fn pressure_rate_scale(&self, i: usize, size: f64) -> f64 {
        self.n_o_sums[self.points[i].0] * size
    }

    /// `q = p_f − N_C g − N_O u_O` with the gaps in front (zero of what faces nothing), and the size of its terms.
    pub fn data(&self, u_o: &[f64], load: Option<&[f64]>) -> (Vec<f64>, Vec<f64>) {
        let size = self.count();
        let u = largest(u_o);
        let mut gap = self.gap[..self.facing].to_vec();
        gap.resize(size, 0.0);
        let load = |i: usize| load.map_or(0.0, |p| p[i]);
        let of = |i: usize| load(i) - (self.n_c.row_dot(i, &gap) + self.n_o.row_dot(i, u_o));
        let scale = |i: usize| self.pressure_scale(i, u, gap[i]) + load(i).abs();
        ((0..size).map(of).collect(), (0..size).map(scale).collect())
    }

    /// The problem of [`Conditions::data`] for solvers that know no upper bound and no unknown without one: what faces nothing is eliminated, and the pressures behind
    /// are unknowns besides, `[N I; −I 0]`, `(q, W)`. Nothing where what faces nothing has a singular block.
    pub fn plain(&self, q: &[f64]) -> Option<(DMatrix<f64>, Vec<f64>)> {
        let n = self.facing;
        let bounded: Vec<usize> = self.points[n..].iter().map(|p| p.0).collect();
        let size = n + bounded.len();
        let all = self.n_c.dense();
        let (own, free) = (all.view((0, 0), (n, n)), self.count() - n);
        let (mut schur, mut q) = (own.into_owned(), q.to_vec());
        let rest = q.split_off(n);
        if free > 0 {
            let lu = all.view((n, n), (free, free)).into_owned().lu();
            let across = all.view((0, n), (n, free));
            schur -= across * lu.solve(&all.view((n, 0), (free, n)).into_owned())?;
            let taken = across * lu.solve(&DVector::from_vec(rest))?;
            q.iter_mut().zip(&taken).for_each(|(q, t)| *q -= t);
        }
        let matrix = DMatrix::from_fn(size, size, |i, j| match (i < n, j < n) {
            (true, true) => schur[(i, j)],
            (true, false) => f64::from(u8::from(bounded[j - n] == i)),
            (false, true) => -f64::from(u8::from(bounded[i - n] == j)),
            (false, false) => 0.0,
        });
        Some((matrix, q.into_iter().chain(bounded.iter().map(|&d| self.way[d])).collect()))
    }

    /// Solve `0 ≤ w ⟂ N_C w + q ≥ 0` for the gaps at `u_O`, warm from `start`.
    pub fn solve(
        &self,
        u_o: &[f64],
        load: Option<&[f64]>,
        start: &States,
    ) -> Result<LcpSolution, LcpError> {
        let (q, scale) = self.data(u_o, load);
        let bounds = Bounds { count: self.facing, upper: &self.way };
        let found = lcp::solve_between(&self.n_c, (&q, &scale), bounds, &self.places(start))?;
        let side = |s: f64| if s > 0.0 { Side::Front } else { Side::Behind };
        let is_at = |d: usize, s: f64| found.places[d] == side(s);
        let of_points = self.points.iter();
        let gap = |&(d, s): &(usize, f64)| match s > 0.0 {
            true => found.w[d],
            false => self.way[d] - found.w[d],
        };
        let is_degenerate = |&k: &usize| {
            let (d, s) = self.points[k];
            found.degenerate.contains(&(d, side(s)))
        };
        Ok(LcpSolution {
            w: of_points.clone().map(gap).collect(),
            p: of_points
                .clone()
                .map(|&(d, s)| if is_at(d, s) { s * found.p[d] } else { 0.0 })
                .collect(),
            active: of_points.map(|&(d, s)| is_at(d, s)).collect(),
            degenerate: (0..self.len()).filter(is_degenerate).collect(),
            pivots: found.pivots,
        })
    }

    /// `0 ≤ ẇ ⟂ ṗ ≥ 0` on the degenerate points, `ṗ = S ẇ + q̇` with `S` the Schur complement of `N_C` on them: the free points that are not
    /// degenerate follow with `ṗ = 0`, those in contact stay (theory §5). Returns the set and the points that stay degenerate.
    pub(crate) fn solve_rates(
        &self,
        present: &States,
        degenerate: &[usize],
        rates: Rates,
    ) -> Result<(States, Vec<usize>), LcpError> {
        let size = largest(rates.x) + rates.blur;
        let load = |d: usize| rates.load.map_or(0.0, |p| p[d]);
        let (own, signs): (Vec<usize>, Vec<f64>) =
            degenerate.iter().map(|&i| self.points[i]).unzip();
        let scale: Vec<f64> = degenerate
            .iter()
            .zip(&own)
            .map(|(&i, &d)| self.pressure_rate_scale(i, size) + load(d).abs())
            .collect();
        let rate = |d: usize| load(d) - self.n_o.row_dot(d, rates.x);
        let places = self.places(present);
        let others: Vec<usize> =
            (0..self.count()).filter(|d| places[*d] == Side::Free && !own.contains(d)).collect();
        let block = |rows: &[usize], cols: &[usize]| {
            DMatrix::from_fn(rows.len(), cols.len(), |a, b| self.n_c[(rows[a], cols[b])])
        };
        let mut schur = block(&own, &own);
        let mut q: Vec<f64> = own.iter().map(|&d| rate(d)).collect();
        let mut place = vec![usize::MAX; self.count()];
        others.iter().enumerate().for_each(|(k, &d)| place[d] = k);
        // rows of N over the others
        let coupling: Vec<Vec<(usize, f64)>> = own
            .iter()
            .map(|&d| self.n_c.row(d).map(|(j, v)| (place[j], v)))
            .map(|row| row.filter(|e| e.0 != usize::MAX).collect())
            .collect();
        if coupling.iter().any(|row| !row.is_empty()) {
            let factor = self.n_c.block(&others)?;
            let through = |mut x: Vec<f64>| -> Result<Vec<f64>, LcpError> {
                factor.solve(&mut x)?;
                let of = |row: &Vec<(usize, f64)>| row.iter().map(|(k, v)| v * x[*k]).sum();
                Ok(coupling.iter().map(of).collect())
            };
            for (b, &d) in own.iter().enumerate() {
                let column = through(others.iter().map(|&i| self.n_c[(i, d)]).collect())?;
                column.iter().enumerate().for_each(|(a, v)| schur[(a, b)] -= v);
            }
            let shift = through(others.iter().map(|&d| rate(d)).collect())?;
            q.iter_mut().zip(&shift).for_each(|(q, s)| *q -= s);
        }
        // in the points' own signs
        for (a, s) in signs.iter().enumerate() {
            q[a] *= s;
            for (b, t) in signs.iter().enumerate() {
                schur[(a, b)] *= s * t;
            }
        }
        let start: Vec<bool> = degenerate.iter().map(|&i| present.touches(i)).collect();
        let solution = lcp::solve(&schur.into(), &q, &scale, &start)?;
        let mut set = present.clone();
        degenerate
            .iter()
            .zip(&solution.active)
            .for_each(|(&i, &a)| set.set(i, PointState::of_contact(a)));
        Ok((set, solution.degenerate.iter().map(|&k| degenerate[k]).collect()))
    }
}
