//! `T_k(S̃)x`, `k = 0, 1, …`: one product each.

use std::ops::Range;

use super::nodes::Nodes;
use crate::contact::{Phase, Recurrence, Scratch, Step};
use crate::fem::blocks;

/// Numbers of a state that are summed together: they stay in the cache.
const BLOCK: usize = 1024;

/// The vectors of one recurrence, with the moments of some rows along them.
#[derive(Debug, Default)]
pub(super) struct Series {
    /// `A*T_k(S̃)x`; only the first `known` are of this `x`.
    terms: Vec<Vec<f64>>,
    known: usize,
    /// `r T_k(S̃)x` for every row, one list a term.
    moments: Vec<Vec<f64>>,
}

/// Rows over `u_O` whose moments are wanted: the monitors of a phase, then forces.
pub(super) struct Rows<'a> {
    pub phase: &'a Phase,
    pub forces: &'a [Vec<f64>],
    /// Length of `u_O`.
    pub n_o: usize,
}

impl Rows<'_> {
    fn along(&self, x: &[f64]) -> Vec<f64> {
        let x = &x[..self.n_o];
        let monitors = self.phase.monitors.len();
        let mut all = vec![0.0; monitors + self.forces.len()];
        self.phase.monitor_gradient(x, &[], &mut all[..monitors]);
        all[monitors..].iter_mut().zip(self.forces).for_each(|(m, f)| *m = dot(f, x));
        all
    }
}

impl Series {
    /// Start anew from `x_O`, of which some rows move: always the same.
    pub fn begin(&mut self, x_o: &[f64], rows: Range<usize>, phase: &Phase) {
        if self.terms.is_empty() {
            self.terms.push(vec![0.0; phase.n()]);
        }
        self.terms[0][rows.clone()].copy_from_slice(&x_o[rows]);
        phase.complete(&mut self.terms[0]);
        self.known = 1;
        self.moments.clear();
    }

    /// The first `count` terms.
    pub fn terms(&self, count: usize) -> &[Vec<f64>] {
        &self.terms[..count]
    }

    /// Their moments.
    pub fn moments(&self, count: usize) -> &[Vec<f64>] {
        &self.moments[..count]
    }

    /// Whether so many terms are known.
    pub fn is_known(&self, count: usize) -> bool {
        self.known >= count
    }

    /// The last term that is known.
    pub fn last(&self) -> &[f64] {
        &self.terms[self.known - 1]
    }

    /// The step that makes the next term.
    fn step(&mut self) -> Step<'_> {
        let k = self.known;
        if self.terms.len() == k {
            self.terms.push(vec![0.0; self.terms[0].len()]);
        }
        let (known, next) = self.terms.split_at_mut(k);
        let before = k.checked_sub(2).map(|b| known[b].as_slice());
        Step { before, now: &known[k - 1], next: &mut next[0] }
    }

    fn observe(&mut self, rows: &Rows) {
        let new = &self.terms[self.moments.len()..self.known];
        self.moments.extend(new.iter().map(|x| rows.along(x)));
    }
}

/// Have the first `count` terms of some recurrences that are equally far. Returns the products that it took.
pub(super) fn extend<const N: usize>(
    mut all: [&mut Series; N],
    count: usize,
    recurrence: &Recurrence,
    rows: &Rows,
    scratch: &mut Scratch,
) -> u64 {
    let before = all[0].known;
    while all[0].known < count {
        recurrence.step(rows.phase, all.each_mut().map(|s| s.step()), scratch);
        all.iter_mut().for_each(|s| s.known += 1);
    }
    all.iter_mut().for_each(|s| s.observe(rows));
    (N * (all[0].known - before)) as u64
}

/// What a state takes of one recurrence: coefficients for displacements and for velocities, and the terms.
pub(super) struct Share<'a> {
    pub of_u: Vec<f64>,
    pub of_v: Vec<f64>,
    pub terms: &'a [Vec<f64>],
}

impl<'a> Share<'a> {
    /// Functions at so many nodes as there are terms.
    pub fn new(series: &'a Series, nodes: &Nodes, [u, v]: [&[f64]; 2]) -> Share<'a> {
        let terms = series.terms(nodes.len());
        Share { of_u: nodes.coefficients(u), of_v: nodes.coefficients(v), terms }
    }
}

/// `u += Σ c_k x_k`, `v += Σ d_k x_k` of all shares, over some rows.
pub(super) fn add_up(shares: &[Share], rows: Range<usize>, u: &mut [f64], v: &mut [f64]) {
    blocks([&mut u[rows.clone()], &mut v[rows.clone()]], |first, [u, v]| {
        // parts that stay in the cache
        for (part, (u, v)) in u.chunks_mut(BLOCK).zip(v.chunks_mut(BLOCK)).enumerate() {
            let from = rows.start + first + part * BLOCK;
            let range = from..from + u.len();
            for Share { of_u, of_v, terms } in shares {
                for ((c, d), x) in of_u.iter().zip(of_v).zip(*terms) {
                    for ((u, v), x) in u.iter_mut().zip(v.iter_mut()).zip(&x[range.clone()]) {
                        *u += c * x;
                        *v += d * x;
                    }
                }
            }
        }
    });
}

/// `xᵀy`, in an order of its own that vector instructions take.
pub(super) fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (x.chunks_exact(8), y.chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a.zip(b) {
        sums.iter_mut().zip(x.iter().zip(y)).for_each(|(s, (x, y))| *s += x * y);
    }
    sums.iter().sum::<f64>() + rest
}
