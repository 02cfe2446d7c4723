//! `T_k(S̃)x`, `k = 0, 1, …`: one product each.

use crate::contact::{Phase, Scratch};

/// The vectors of one recurrence, with the moments of some rows along them.
#[derive(Debug, Default)]
pub(super) struct Series {
    /// `T_k(S̃)x`; only the first `known` are of this `x`.
    terms: Vec<Vec<f64>>,
    known: usize,
    /// `r T_k(S̃)x` for every row, one list a term.
    moments: Vec<Vec<f64>>,
}

/// Rows over `u_O` whose moments are wanted: the monitors of a phase, then forces.
pub(super) struct Rows<'a> {
    pub phase: &'a Phase,
    pub forces: &'a [Vec<f64>],
}

impl Rows<'_> {
    fn along(&self, x: &[f64]) -> Vec<f64> {
        let monitors = self.phase.monitors.len();
        let mut all = vec![0.0; monitors + self.forces.len()];
        self.phase.monitor_gradient(x, &mut all[..monitors]);
        all[monitors..].iter_mut().zip(self.forces).for_each(|(m, f)| *m = dot(f, x));
        all
    }
}

impl Series {
    /// Start anew from `x`.
    pub fn begin(&mut self, x: &[f64]) {
        if self.terms.is_empty() {
            self.terms.push(vec![]);
        }
        self.terms[0].clear();
        self.terms[0].extend_from_slice(x);
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

    /// The last term that is known.
    pub fn last(&self) -> &[f64] {
        &self.terms[self.known - 1]
    }

    /// Room for the next term.
    fn room(&mut self) -> Vec<f64> {
        if self.terms.len() == self.known {
            self.terms.push(vec![0.0; self.terms[0].len()]);
        }
        std::mem::take(&mut self.terms[self.known])
    }

    /// From `S T_{k−1}x` to `T_k x = 2S̃T_{k−1}x − T_{k−2}x`.
    fn push(&mut self, mut next: Vec<f64>, scale: f64) {
        let k = self.known;
        match k {
            1 => next.iter_mut().zip(&self.terms[0]).for_each(|(n, x)| *n = scale * *n - x),
            _ => {
                let (x, p) = (&self.terms[k - 1], &self.terms[k - 2]);
                for ((n, x), p) in next.iter_mut().zip(x).zip(p) {
                    *n = 2.0 * (scale * *n - x) - p;
                }
            }
        }
        self.terms[k] = next;
        self.known += 1;
    }

    fn observe(&mut self, rows: &Rows) {
        let new = &self.terms[self.moments.len()..self.known];
        self.moments.extend(new.iter().map(|x| rows.along(x)));
    }
}

/// Have the first `count` terms of one recurrence, `scale = 2/s_max`. Returns the products that it took.
pub(super) fn extend(
    one: &mut Series,
    count: usize,
    scale: f64,
    rows: &Rows,
    scratch: &mut Scratch,
) -> u64 {
    let before = one.known;
    while one.known < count {
        let mut next = one.room();
        rows.phase.stiffness_product(&one.terms[one.known - 1], scratch, &mut next);
        one.push(next, scale);
    }
    one.observe(rows);
    (one.known - before) as u64
}

/// The same of two recurrences that have begun: every product reads the matrix once for both.
pub(super) fn extend_both(
    [one, other]: [&mut Series; 2],
    count: usize,
    scale: f64,
    rows: &Rows,
    scratch: &mut Scratch,
) -> u64 {
    for k in 1..count {
        let (mut a, mut b) = (one.room(), other.room());
        let x = [&one.terms[k - 1][..], &other.terms[k - 1][..]];
        rows.phase.stiffness_products(x, scratch, [&mut a, &mut b]);
        one.push(a, scale);
        other.push(b, scale);
    }
    one.observe(rows);
    other.observe(rows);
    2 * (count - 1) as u64
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
