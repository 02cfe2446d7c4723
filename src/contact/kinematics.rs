//! What one active set makes of the displacements: `u_C = A_α u_O + d_α(t)`, monitors, pressures (theory §3).
//!
//! In contact `u_C = g`; free `u_C,f = N_ff⁻¹ (p_f,f(t) − N_f,O u_O − N_f,c g_c)`. The monitors are the gaps `w_i` of free points and the
//! pressures `p_i` of points in contact, affine in `u_O`, all ≥ 0 while the phase is valid. Harmonic loads on `u_C` move both:
//! they come as *drives*.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::conditions::Conditions;
use super::coupling::Block;
use super::holding::Holding;
use super::lcp::Place;
use super::states::States;
use crate::fem::{Csr, Harmonic, Loads};

/// What a harmonic load adds to displacements and monitors, times `cos(ωt + φ)`.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Which harmonic load it is.
    pub index: usize,
    /// The load's frequency and phase.
    pub load: Harmonic,
    /// What it adds to `u_C`.
    pub displacement: Vec<f64>,
    /// What it adds to the gap or pressure of each contact point.
    pub monitor: Vec<f64>,
}

/// Which part of an affine function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Part {
    /// All of it at a time.
    Whole(f64),
    /// Its time derivative of this order (1 or 2) at a time, for the derivative of `u_O` of the same order.
    Derivative(f64, u32),
    /// All but the drives.
    Undriven,
    /// The linear part.
    Linear,
}

impl Part {
    /// Whether the constant part is in it.
    pub fn is_affine(self) -> bool {
        matches!(self, Part::Whole(_) | Part::Undriven)
    }

    /// Add the drives' share of `u_C` or of the monitors, as `of` tells.
    pub fn add_drives<'a>(
        self,
        drives: &'a [Drive],
        x: &mut [f64],
        of: impl Fn(&'a Drive) -> &'a [f64],
    ) {
        let (t, order) = match self {
            Part::Whole(t) => (t, 0),
            Part::Derivative(t, order) => (t, order),
            Part::Undriven | Part::Linear => return,
        };
        for drive in drives {
            let c = drive.load.factor(t, order);
            x.iter_mut().zip(of(drive)).for_each(|(x, d)| *x += c * d);
        }
    }
}

/// The affine functions of one active set.
#[derive(Debug)]
pub(super) enum Kinematics {
    /// `u_C` follows from `u_O`.
    Following(Following),
    /// Contact displacements move by themselves; points in contact are held.
    Holding(Holding),
}

impl Kinematics {
    pub fn drives(&self) -> &[Drive] {
        match self {
            Kinematics::Following(k) => &k.drives,
            Kinematics::Holding(k) => &k.drives,
        }
    }

    /// `u = A* u_O + d*(t)`, its rate, or `A* x`.
    pub fn expand(&self, x_o: &[f64], x: &mut [f64], part: Part) {
        match self {
            Kinematics::Following(k) => k.expand(x_o, x, part),
            Kinematics::Holding(k) => k.expand(x_o, x),
        }
    }

    /// [`Kinematics::expand`] of the first `n_o` entries of `x`, in place.
    pub fn fill(&self, x: &mut [f64], n_o: usize, part: Part) {
        match self {
            Kinematics::Following(k) => {
                let (x_o, x_c) = x.split_at_mut(n_o);
                k.fill(x_o, x_c, part);
            }
            Kinematics::Holding(k) => {
                let x_o = x[..n_o].to_vec();
                k.expand(&x_o, x);
            }
        }
    }

    /// `A*ᵀ b`, in place: the first `n_O` entries of `b`.
    pub fn reduce(&self, b: &mut [f64]) {
        match self {
            Kinematics::Following(k) => k.reduce(b),
            Kinematics::Holding(k) => k.reduce(b),
        }
    }

    /// Gap of every free point, pressure of every point in contact: their values, derivatives or linear parts.
    pub fn monitors(&self, x_o: &[f64], h: &mut [f64], part: Part) {
        match self {
            Kinematics::Following(k) => k.monitors(x_o, h, part),
            Kinematics::Holding(k) => k.monitors(x_o, h, part),
        }
    }

    /// `A*`, sparse.
    pub fn a_star(&self) -> Csr {
        match self {
            Kinematics::Following(k) => k.a_star(),
            Kinematics::Holding(k) => k.a_star(),
        }
    }

    /// Size of the terms of the gap and of the pressure of a point when displacements are of the order of `u`.
    pub fn scales(&self, i: usize, u: f64) -> [f64; 2] {
        match self {
            Kinematics::Following(k) => {
                let pressure = k.conditions.pressure_scale(i, u);
                [pressure / k.conditions.stiffness(i), pressure]
            }
            Kinematics::Holding(k) => k.scales(i, u),
        }
    }

    /// The same of their rates (or second derivatives) for `u̇_O` (`ü_O`) of the order of `size`.
    pub fn rate_scales(&self, i: usize, size: f64) -> [f64; 2] {
        match self {
            Kinematics::Following(k) => {
                let pressure = k.conditions.pressure_rate_scale(i, size);
                [pressure / k.conditions.stiffness(i), pressure]
            }
            Kinematics::Holding(k) => k.scales(i, size),
        }
    }
}

/// The affine functions of one active set where `u_C` follows.
#[derive(Debug)]
pub(super) struct Following {
    pub conditions: Arc<Conditions>,
    /// Displacements that are free.
    pub free: Vec<usize>,
    /// Where the others stand.
    pub closed: Vec<(usize, f64)>,
    /// Points in contact.
    set: States,
    block: Block,
    /// `d_α` under constant loads, all of `u_C`.
    offset: Vec<f64>,
    /// Constant part of `p_f`.
    load: Option<Vec<f64>>,
    pub drives: Vec<Drive>,
}

impl Following {
    pub fn new(conditions: &Arc<Conditions>, set: &States, loads: &Loads) -> Following {
        let c = conditions;
        let places = c.places(set);
        let free: Vec<usize> = (0..c.count()).filter(|&d| places[d] == Place::Free).collect();
        let touching = set.closed_points().into_iter().map(|k| (c.points[k], c.gap[k]));
        let closed = touching.map(|((d, s), gap)| (d, s * gap)).collect();
        // principal blocks of a P-matrix are regular; one that is not gives what is no number
        let singular = |_| Block::Diagonal(vec![f64::NAN; free.len()]);
        let block = c.n_c.block(&free).unwrap_or_else(singular);
        let mut of_set = Following {
            conditions: conditions.clone(),
            free,
            closed,
            set: set.clone(),
            block,
            offset: vec![],
            load: None,
            drives: vec![],
        };
        of_set.load = loads.constant.as_ref().and_then(|f| of_set.load_on_contact(f));
        of_set.offset = of_set.shift(of_set.load.as_deref(), true);
        let drives: Vec<Drive> =
            loads.harmonics.iter().enumerate().filter_map(|(k, h)| of_set.drive(k, h)).collect();
        of_set.drives = drives;
        of_set
    }

    /// The pressures that a force brings in, if it does.
    fn load_on_contact(&self, force: &[f64]) -> Option<Vec<f64>> {
        if !self.conditions.bears_loads {
            return None;
        }
        let p = self.conditions.pressure_of(force);
        p.iter().any(|p| *p != 0.0).then_some(p)
    }

    /// `u_C` at `u_O = 0` under pressures `load`, with the gaps or without.
    fn shift(&self, load: Option<&[f64]>, with_gap: bool) -> Vec<f64> {
        let c = &self.conditions;
        let mut d = vec![0.0; c.count()];
        if with_gap {
            self.closed.iter().for_each(|&(i, at)| d[i] = at);
        }
        // free entries of d are still zero
        let rest = |&i: &usize| load.map_or(0.0, |p| p[i]) - c.n_c.row_dot(i, &d);
        let mut x: Vec<f64> = self.free.iter().map(rest).collect();
        self.solve_free(&mut x);
        self.free.iter().zip(x.iter()).for_each(|(&i, &x)| d[i] = x);
        d
    }

    fn drive(&self, index: usize, load: &Harmonic) -> Option<Drive> {
        let p = self.load_on_contact(&load.force)?;
        let displacement = self.shift(Some(&p), false);
        let c = &self.conditions;
        // those in contact do not move
        let monitor = (0..c.len()).map(|k| match (self.set.touches(k), c.points[k]) {
            (false, (d, s)) => -s * displacement[d],
            (true, (d, s)) => s * (p[d] - c.n_c.row_dot(d, &displacement)),
        });
        let monitor = monitor.collect();
        Some(Drive { index, load: load.clone(), displacement, monitor })
    }

    /// `x ← N_ff⁻¹ x` over the free points.
    fn solve_free(&self, x: &mut [f64]) {
        if self.block.solve(x).is_err() {
            x.fill(f64::NAN);
        }
    }

    /// From `stress = N_O x` to `A x` over the free points.
    fn follow(&self, stress: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = self.free.iter().map(|&i| -stress[i]).collect();
        self.solve_free(&mut x);
        x
    }

    /// `N_ff⁻¹` where no contact point knows of another.
    fn diagonal(&self) -> Option<&Vec<f64>> {
        match &self.block {
            Block::Diagonal(inverse) if self.conditions.is_diagonal => Some(inverse),
            _ => None,
        }
    }

    fn stress(&self, x_o: &[f64]) -> Vec<f64> {
        let n_o = &self.conditions.n_o;
        (0..self.conditions.count()).map(|i| n_o.row_dot(i, x_o)).collect()
    }

    /// `u = A* u_O + d*(t)`, its rate, or `A* x`.
    pub fn expand(&self, x_o: &[f64], x: &mut [f64], part: Part) {
        let (x_o_out, x_c) = x.split_at_mut(x_o.len());
        x_o_out.copy_from_slice(x_o);
        self.fill(x_o, x_c, part);
    }

    /// `u_C`, its rate, or its linear part.
    fn fill(&self, x_o: &[f64], x_c: &mut [f64], part: Part) {
        let affine = part.is_affine();
        match affine {
            true => x_c.copy_from_slice(&self.offset),
            false => x_c.fill(0.0),
        }
        match self.diagonal() {
            Some(inverse) => {
                for (&i, inverse) in self.free.iter().zip(inverse) {
                    x_c[i] -= self.conditions.n_o.row_dot(i, x_o) * inverse;
                }
            }
            None => {
                let free = self.follow(&self.stress(x_o));
                self.free.iter().zip(free.iter()).for_each(|(&i, &v)| x_c[i] += v);
            }
        }
        part.add_drives(&self.drives, x_c, |d| &d.displacement);
    }

    /// `u_C = A_α u_O`, the linear part alone.
    pub fn fill_linear(&self, x_o: &[f64], x_c: &mut [f64]) {
        self.fill(x_o, x_c, Part::Linear);
    }

    /// `A*ᵀ b`, in place: the first `n_O` entries of `b`.
    pub fn reduce(&self, b: &mut [f64]) {
        let n_o = self.conditions.n_o.n_cols();
        let (b_o, b_c) = b.split_at_mut(n_o);
        self.push(b_c, |j, x| b_o[j] += x);
    }

    /// What forces on `u_C` add to displacements, `A_αᵀ b_C`, entry by entry.
    pub fn push(&self, b_c: &[f64], mut add: impl FnMut(usize, f64)) {
        let mut x: Vec<f64> = self.free.iter().map(|&i| -b_c[i]).collect();
        self.block.solve_transposed(&mut x);
        for (&i, &y) in self.free.iter().zip(x.iter()) {
            self.conditions.n_o.row(i).for_each(|(j, v)| add(j, y * v));
        }
    }

    /// Gap of every free point, pressure of every point in contact: their values, derivatives or linear parts.
    pub fn monitors(&self, x_o: &[f64], h: &mut [f64], part: Part) {
        let c = &self.conditions;
        let affine = part.is_affine();
        let load = |i: usize| match &self.load {
            Some(p) if affine => p[i],
            _ => 0.0,
        };
        // displacements first, then what they mean at the points
        let mut u: Vec<f64> = if affine { self.offset.clone() } else { vec![0.0; c.count()] };
        match self.diagonal() {
            Some(inverse) => {
                for (&i, inverse) in self.free.iter().zip(inverse) {
                    u[i] -= c.n_o.row_dot(i, x_o) * inverse;
                }
            }
            None => {
                let free = self.follow(&self.stress(x_o));
                self.free.iter().zip(free.iter()).for_each(|(&i, &v)| u[i] += v);
            }
        }
        for (k, h) in h.iter_mut().enumerate() {
            let (d, s) = c.points[k];
            *h = match self.set.touches(k) {
                false if affine => c.gap[k] - s * u[d],
                false => -s * u[d],
                true => {
                    let own = match c.is_diagonal {
                        true => c.n_c[(d, d)] * u[d],
                        false => c.n_c.row_dot(d, &u),
                    };
                    s * (load(d) - c.n_o.row_dot(d, x_o) - own)
                }
            };
        }
        part.add_drives(&self.drives, h, |d| &d.monitor);
    }

    /// `A* = [I; A_α]`, sparse.
    pub fn a_star(&self) -> Csr {
        let c = &self.conditions;
        let n_o = c.n_o.n_cols();
        let mut entries: Vec<(usize, usize, f64)> = (0..n_o).map(|i| (i, i, 1.0)).collect();
        match self.diagonal() {
            Some(inverse) => {
                for (&i, inverse) in self.free.iter().zip(inverse) {
                    entries.extend(c.n_o.row(i).map(|(j, v)| (n_o + i, j, -inverse * v)));
                }
            }
            None => {
                let mut columns: Vec<usize> =
                    self.free.iter().flat_map(|&i| c.n_o.row(i).map(|(j, _)| j)).collect();
                columns.sort_unstable();
                columns.dedup();
                let mut stress = DMatrix::<f64>::zeros(c.count(), columns.len());
                for &i in &self.free {
                    for (j, v) in c.n_o.row(i) {
                        if let Ok(k) = columns.binary_search(&j) {
                            stress[(i, k)] = v;
                        }
                    }
                }
                for (k, &j) in columns.iter().enumerate() {
                    let free = self.follow(stress.column(k).as_slice());
                    let rows = self.free.iter().zip(free.iter());
                    entries.extend(rows.map(|(&i, &v)| (n_o + i, j, v)));
                }
            }
        }
        Csr::from_triplets(n_o + c.count(), n_o, entries)
    }

    /// `‖A_α‖_∞`, row by row: `|e_iᵀ N_ff⁻¹ N_O|`.
    pub fn amplification(&self) -> f64 {
        let n_o = &self.conditions.n_o;
        let mut row = vec![0.0; n_o.n_cols()];
        let mut of_row = |i: usize| {
            let mut x = vec![0.0; self.free.len()];
            x[i] = 1.0;
            self.block.solve_transposed(&mut x);
            row.fill(0.0);
            let rows = self.free.iter().zip(&x);
            rows.for_each(|(&k, x)| n_o.row(k).for_each(|(j, v)| row[j] += x * v));
            row.iter().map(|v| v.abs()).sum::<f64>()
        };
        (0..self.free.len()).map(&mut of_row).fold(0.0, f64::max)
    }

    /// The rows of all monitors over `N_O`: `∇h = L N_O`.
    pub fn over_stress(&self) -> DMatrix<f64> {
        let c = &self.conditions;
        let size = c.count();
        // of displacements: u_C of free ones, the pressure of the others
        let mut l = DMatrix::<f64>::zeros(size, size);
        let mut unit = vec![0.0; size];
        let mut is_closed = vec![false; size];
        self.closed.iter().for_each(|&(j, _)| is_closed[j] = true);
        for k in 0..size {
            unit[k] = 1.0;
            let free = self.follow(&unit);
            for (&i, &u) in self.free.iter().zip(free.iter()) {
                l[(i, k)] = u;
                for (j, v) in c.n_c.column(i).filter(|(j, _)| is_closed[*j]) {
                    l[(j, k)] -= v * u;
                }
            }
            if is_closed[k] {
                l[(k, k)] -= 1.0;
            }
            unit[k] = 0.0;
        }
        // a gap behind an obstacle that a displacement touches does not change
        DMatrix::from_fn(c.len(), size, |k, j| match (self.set.touches(k), c.points[k]) {
            (true, (d, s)) => s * l[(d, j)],
            (false, (d, s)) if !is_closed[d] => -s * l[(d, j)],
            (false, _) => 0.0,
        })
    }
}
