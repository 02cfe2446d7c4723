//! What one phase makes of the displacements: `u_C = A_α u_O + d_α(t)` (theory §3), from the method that makes the phase.
//!
//! Where contact displacements follow from the others: in contact `u_C = g`; free `u_C,f = N_ff⁻¹ (p_f,f(t) − N_f,O u_O − N_f,c g_c)`. Where they have
//! inertia they are displacements of the body, seen along the normals, `u_C = n u_O`. Harmonic loads on `u_C` move it: they come as *drives*.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::conditions::Conditions;
use super::coupling::{Block, Coupling};
use crate::fem::{Csr, Harmonic, Measured};

/// A load that changes in time: a harmonic one, with its place among those, or one with a measured history.
#[derive(Debug, Clone)]
pub(super) enum Signal {
    Harmonic(usize, Harmonic),
    Measured(Measured),
}

impl Signal {
    /// Its factor at a time, or the derivative of this order.
    pub fn factor(&self, t: f64, order: u32) -> f64 {
        match self {
            Signal::Harmonic(_, load) => load.factor(t, order),
            Signal::Measured(load) => load.factor(t, order),
        }
    }

    /// Shape and size.
    pub fn force(&self) -> &[f64] {
        match self {
            Signal::Harmonic(_, load) => &load.force,
            Signal::Measured(load) => &load.force,
        }
    }
}

/// What a load adds to displacements, times its factor; what it adds to monitors stands in their rows.
#[derive(Debug, Clone)]
pub(super) struct Driven {
    pub load: Signal,
    pub displacement: Vec<f64>,
}

/// What a harmonic load adds to displacements and monitors of a phase, times `cos(ωt + φ)`.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Which harmonic load it is.
    pub index: usize,
    /// The load's frequency and phase.
    pub load: Harmonic,
    /// What it adds to `u_C`.
    pub displacement: Vec<f64>,
    /// What it adds to each monitor.
    pub monitor: Vec<f64>,
}

/// What a measured load adds to the monitors of a phase, times its history.
#[derive(Debug, Clone)]
pub struct MeasuredDrive {
    /// The load.
    pub load: Measured,
    /// What it adds to each monitor.
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
    pub(crate) fn is_affine(self) -> bool {
        matches!(self, Part::Whole(_) | Part::Undriven)
    }

    /// Each drive with its factor, where drives are part of it.
    pub(crate) fn each_drive(self, drives: &[Driven], mut add: impl FnMut(usize, f64)) {
        let (t, order) = match self {
            Part::Whole(t) => (t, 0),
            Part::Derivative(t, order) => (t, order),
            Part::Undriven | Part::Linear => return,
        };
        drives.iter().enumerate().for_each(|(k, d)| add(k, d.load.factor(t, order)));
    }
}

/// `A_α`, as a method gives it.
#[derive(Debug)]
pub(super) enum Follow {
    /// Rows over `u_O`, the same in every phase: displacements of the body, seen along the normals.
    Rows(Arc<Csr>),
    /// `−N_ff⁻¹ N_fO` on the free displacements, nothing on the others.
    Solved(Box<Solved>),
}

/// The free contact displacements, which follow from `N_ff u_f = −N_fO u_O + …`.
#[derive(Debug)]
pub(super) struct Solved {
    pub conditions: Arc<Conditions>,
    /// Displacements that are free.
    pub free: Vec<usize>,
    /// `N_ff⁻¹`, with friction `(E N)_f⁻¹`
    block: Block,
    along: Adhesion,
}

/// Displacements along rough obstacles that have no mass. One that slips follows from `r_t = f r_n`, a row `e_t − f e_n` of `E`; one that sticks stands at an entry `z` of `u_O`.
#[derive(Debug, Clone, Default)]
pub(super) struct Adhesion {
    /// Those that slip: place among the free ones, `n`, `f`.
    pub slips: Vec<(usize, usize, f64)>,
    /// Those that stick: `t`, and the entry of `u_O`.
    pub stuck: Vec<(usize, usize)>,
}

impl Adhesion {
    fn is_none(&self) -> bool {
        self.slips.is_empty() && self.stuck.is_empty()
    }
}

impl Solved {
    pub fn new(conditions: &Arc<Conditions>, free: Vec<usize>) -> Solved {
        Solved::along(conditions, free, Adhesion::default())
    }

    /// The same where displacements along rough obstacles have no mass.
    pub fn along(conditions: &Arc<Conditions>, free: Vec<usize>, along: Adhesion) -> Solved {
        // principal blocks of a P-matrix are regular; one that is not gives what is no number
        let singular = |_| Block::Diagonal(vec![f64::NAN; free.len()]);
        let n_c = &conditions.n_c;
        let block = match along.slips.is_empty() {
            true => n_c.block(&free),
            false => {
                let mut block =
                    DMatrix::from_fn(free.len(), free.len(), |a, b| n_c[(free[a], free[b])]);
                for &(k, n, f) in &along.slips {
                    (0..free.len()).for_each(|b| block[(k, b)] -= f * n_c[(n, free[b])]);
                }
                Coupling::from(block).block(&(0..free.len()).collect::<Vec<_>>())
            }
        };
        let block = block.unwrap_or_else(singular);
        Solved { conditions: conditions.clone(), free, block, along }
    }

    /// `E x` over the free displacements, of what the rows of the conditions have.
    pub fn combined(&self, of_row: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut x: Vec<f64> = self.free.iter().map(|&i| of_row(i)).collect();
        self.along.slips.iter().for_each(|&(k, n, f)| x[k] -= f * of_row(n));
        x
    }

    /// `x ← N_ff⁻¹ x` over the free displacements.
    pub fn solve(&self, x: &mut [f64]) {
        if self.block.solve(x).is_err() {
            x.fill(f64::NAN);
        }
    }

    /// From `stress = N_O x` to `A x` over the free displacements.
    pub fn follow(&self, stress: &[f64]) -> Vec<f64> {
        let mut x = self.combined(|i| -stress[i]);
        self.solve(&mut x);
        x
    }

    /// `Aᵀ` of one of the contact displacements: a row of `A_α`.
    pub fn row(&self, displacement: usize) -> Vec<(usize, f64)> {
        let mut unit = vec![0.0; self.conditions.count()];
        unit[displacement] = 1.0;
        let mut row = BTreeMap::new();
        self.push(&unit, |j, x| *row.entry(j).or_insert(0.0) += x);
        row.into_iter().filter(|e| e.1 != 0.0).collect()
    }

    /// `N_ff⁻¹` where no contact point knows of another.
    fn diagonal(&self) -> Option<&Vec<f64>> {
        match &self.block {
            Block::Diagonal(inverse) if self.conditions.is_diagonal && self.along.is_none() => {
                Some(inverse)
            }
            _ => None,
        }
    }

    /// `x_C += A_α x_O`
    fn add(&self, x_o: &[f64], x_c: &mut [f64]) {
        let n_o = &self.conditions.n_o;
        match self.diagonal() {
            Some(inverse) => {
                for (&i, inverse) in self.free.iter().zip(inverse) {
                    x_c[i] -= n_o.row_dot(i, x_o) * inverse;
                }
            }
            None => {
                let n_c = &self.conditions.n_c;
                let of_stuck = |i: usize| -> f64 {
                    self.along.stuck.iter().map(|&(t, z)| n_c[(i, t)] * x_o[z]).sum()
                };
                let stress: Vec<f64> = (0..self.conditions.count())
                    .map(|i| n_o.row_dot(i, x_o) + of_stuck(i))
                    .collect();
                let free = self.follow(&stress);
                self.free.iter().zip(free.iter()).for_each(|(&i, &v)| x_c[i] += v);
                self.along.stuck.iter().for_each(|&(t, z)| x_c[t] += x_o[z]);
            }
        }
    }

    /// What forces on `u_C` add to displacements, `A_αᵀ b_C`, entry by entry.
    pub fn push(&self, b_c: &[f64], mut add: impl FnMut(usize, f64)) {
        let mut x: Vec<f64> = self.free.iter().map(|&i| -b_c[i]).collect();
        self.block.solve_transposed(&mut x);
        let Conditions { n_o, n_c, .. } = &*self.conditions;
        for (&i, &y) in self.free.iter().zip(x.iter()) {
            n_o.row(i).for_each(|(j, v)| add(j, y * v));
        }
        let Adhesion { slips, stuck } = &self.along;
        for &(k, n, f) in slips {
            n_o.row(n).for_each(|(j, v)| add(j, -f * x[k] * v));
        }
        for &(t, z) in stuck {
            let of_free: f64 = self.free.iter().zip(&x).map(|(&i, y)| y * n_c[(i, t)]).sum();
            let of_slips: f64 = slips.iter().map(|&(k, n, f)| f * x[k] * n_c[(n, t)]).sum();
            add(z, b_c[t] + of_free - of_slips);
        }
    }

    /// The rows of `A_α` as entries (row, column, value).
    fn entries(&self) -> Vec<(usize, usize, f64)> {
        let c = &self.conditions;
        let mut entries = vec![];
        if !self.along.is_none() {
            let stuck = self.along.stuck.iter().map(|e| e.0);
            let all = self.free.iter().copied().chain(stuck);
            return all
                .flat_map(|i| self.row(i).into_iter().map(move |(j, v)| (i, j, v)))
                .collect();
        }
        match self.diagonal() {
            Some(inverse) => {
                for (&i, inverse) in self.free.iter().zip(inverse) {
                    entries.extend(c.n_o.row(i).map(|(j, v)| (i, j, -inverse * v)));
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
                    entries.extend(rows.map(|(&i, &v)| (i, j, v)));
                }
            }
        }
        entries
    }

    /// `‖A_α‖_∞`, row by row: `|e_iᵀ N_ff⁻¹ N_O|`.
    fn amplification(&self) -> f64 {
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

    /// Over `N_O`, one row a contact displacement: `u_C` of those that are free, the pressure of the others.
    pub(crate) fn over_stress(&self) -> DMatrix<f64> {
        let c = &self.conditions;
        let size = c.count();
        let mut l = DMatrix::<f64>::zeros(size, size);
        let mut unit = vec![0.0; size];
        let mut is_closed = vec![true; size];
        self.free.iter().for_each(|&i| is_closed[i] = false);
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
        l
    }
}

/// `u = A* u_O + d*(t)`, `A* = [I; A_α]`.
#[derive(Debug)]
pub(super) struct Expansion {
    pub follow: Follow,
    /// `d_α` under constant loads, all of `u_C`.
    pub offset: Vec<f64>,
    pub drives: Vec<Driven>,
}

impl Expansion {
    /// `A_∅`: how contact displacements follow where none touches, without loads.
    pub fn open(conditions: &Arc<Conditions>) -> Expansion {
        let count = conditions.count();
        let solved = Solved::new(conditions, (0..count).collect());
        let follow = Follow::Solved(Box::new(solved));
        Expansion { follow, offset: vec![0.0; count], drives: vec![] }
    }

    /// The displacements that follow from conditions, if they do.
    pub fn solved(&self) -> Option<&Solved> {
        match &self.follow {
            Follow::Solved(solved) => Some(solved),
            Follow::Rows(_) => None,
        }
    }

    /// `x_C`, without the drives: `d_α + A_α x_O`, or the linear part.
    pub(crate) fn undriven(&self, x_o: &[f64], x_c: &mut [f64], part: Part) {
        match part.is_affine() {
            true => x_c.copy_from_slice(&self.offset),
            false => x_c.fill(0.0),
        }
        match &self.follow {
            Follow::Rows(rows) => {
                x_c.iter_mut().enumerate().for_each(|(i, x)| *x += rows.row_dot(i, x_o));
            }
            Follow::Solved(solved) => solved.add(x_o, x_c),
        }
    }

    /// The same as a new vector, which monitors see.
    pub fn seen(&self, x_o: &[f64], part: Part) -> Vec<f64> {
        let mut x_c = vec![0.0; self.offset.len()];
        self.undriven(x_o, &mut x_c, part);
        x_c
    }

    /// `u = A* u_O + d*(t)`, its rate, or `A* x`.
    pub fn expand(&self, x_o: &[f64], x: &mut [f64], part: Part) {
        x[..x_o.len()].copy_from_slice(x_o);
        self.fill(x, x_o.len(), part);
    }

    /// [`Expansion::expand`] of the first `n_o` entries of `x`, in place.
    pub fn fill(&self, x: &mut [f64], n_o: usize, part: Part) {
        let (x_o, x_c) = x.split_at_mut(n_o);
        self.undriven(x_o, x_c, part);
        part.each_drive(&self.drives, |k, c| {
            x_c.iter_mut().zip(&self.drives[k].displacement).for_each(|(x, d)| *x += c * d);
        });
    }

    /// `A*ᵀ b`, in place: the first `n_O` entries of `b`. There is no force on what is but seen along normals.
    pub fn reduce(&self, b: &mut [f64]) {
        if let Follow::Solved(solved) = &self.follow {
            let (b_o, b_c) = b.split_at_mut(solved.conditions.n_o.n_cols());
            solved.push(b_c, |j, x| b_o[j] += x);
        }
    }

    /// `A* = [I; A_α]`, sparse.
    pub(crate) fn a_star(&self) -> Csr {
        let (n_o, rows) = match &self.follow {
            Follow::Rows(rows) => (rows.n_cols(), rows.triplets().collect()),
            Follow::Solved(solved) => (solved.conditions.n_o.n_cols(), solved.entries()),
        };
        let own = (0..n_o).map(|i| (i, i, 1.0));
        let all = own.chain(rows.into_iter().map(|(i, j, v)| (n_o + i, j, v)));
        Csr::from_triplets(n_o + self.offset.len(), n_o, all.collect())
    }

    /// What forces on `u_C` add to displacements, `A_αᵀ b_C`, entry by entry, where contact displacements follow.
    pub fn push(&self, b_c: &[f64], add: impl FnMut(usize, f64)) {
        if let Some(solved) = self.solved() {
            solved.push(b_c, add);
        }
    }

    /// `‖A_α‖_∞`; zero where contact displacements are displacements of the body.
    pub fn amplification(&self) -> f64 {
        self.solved().map_or(0.0, Solved::amplification)
    }
}
