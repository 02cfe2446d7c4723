//! Rows that repeat, as they do on uniform meshes.
//!
//! Where row `i` has the entries of row `i − p` (`p` displacements a node), shifted by `p`, the rows need not be read at all: a run of them is a
//! few diagonals whose weights repeat after `p` rows, `y_i = Σ_e w_e(i mod p) x_(i + o_e)`. Rows that repeat nothing stay compressed.
//! Every row is summed in an order of its own, whatever part of the product is asked for.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::sparse::Csr;

/// Rows that are computed together: multiples of all periods, and of the width of vector instructions.
const LANES: usize = 24;
/// Displacements of a node.
const PERIODS: [usize; 3] = [2, 1, 3];
/// Shorter runs are not worth it.
const SHORTEST: usize = 2 * LANES;
/// Entries are equal if they differ by so many units in the last place of the largest of the row: sums of the same elements in another order.
pub(super) const SAME: f64 = 64.0 * f64::EPSILON;

/// Diagonals whose weights repeat.
#[derive(Debug, Clone)]
struct Stencil {
    offsets: Vec<isize>,
    weights: Vec<[f64; LANES]>,
}

/// Rows of one kind.
#[derive(Debug, Clone)]
struct Run {
    rows: Range<usize>,
    stencil: Option<Stencil>,
}

/// What repeats in a matrix, for products with it.
#[derive(Debug, Clone)]
pub(super) struct Runs {
    runs: Vec<Run>,
}

/// Whether a row has the entries of another that is `shift` rows before it.
fn repeats(matrix: &Csr, row: usize, first: usize) -> bool {
    let shift = row - first;
    let (mut of_row, mut of_first) = (matrix.row(row), matrix.row(first));
    let size = matrix.row(first).fold(0.0f64, |m, e| m.max(e.1.abs()));
    loop {
        match (of_row.next(), of_first.next()) {
            (None, None) => return true,
            (Some((j, v)), Some((i, w))) if j == i + shift && (v - w).abs() <= SAME * size => {}
            _ => return false,
        }
    }
}

impl Stencil {
    /// Of the `period` rows from `first` on.
    fn of(matrix: &Csr, first: usize, period: usize) -> Stencil {
        let offset = |i: usize, j: usize| j as isize - i as isize;
        let rows = first..first + period;
        let mut offsets: Vec<isize> =
            rows.clone().flat_map(|i| matrix.row(i).map(move |(j, _)| offset(i, j))).collect();
        offsets.sort_unstable();
        offsets.dedup();
        let mut weights = vec![[0.0; LANES]; offsets.len()];
        for i in rows {
            for (j, v) in matrix.row(i) {
                let Ok(e) = offsets.binary_search(&offset(i, j)) else { continue };
                (i - first..LANES).step_by(period).for_each(|lane| weights[e][lane] = v);
            }
        }
        Stencil { offsets, weights }
    }

    /// `y ← A x` of rows from `first` on, which is the lane `lane`.
    #[inline(always)]
    fn mul(&self, mut first: usize, mut lane: usize, x: &[f64], mut y: &mut [f64]) {
        while !y.is_empty() {
            if lane == 0 && y.len() >= LANES {
                let (part, rest) = y.split_at_mut(LANES);
                let mut sums = [0.0; LANES];
                for (o, w) in self.offsets.iter().zip(&self.weights) {
                    let at = (first as isize + o) as usize;
                    let x = &x[at..at + LANES];
                    for l in 0..LANES {
                        sums[l] += w[l] * x[l];
                    }
                }
                part.copy_from_slice(&sums);
                (first, y) = (first + LANES, rest);
                continue;
            }
            let mut sum = 0.0;
            for (o, w) in self.offsets.iter().zip(&self.weights) {
                sum += w[lane] * x[(first as isize + o) as usize];
            }
            y[0] = sum;
            (first, lane, y) = (first + 1, (lane + 1) % LANES, &mut y[1..]);
        }
    }
}

/// Some rows of a run, for whatever vector instructions there are: the sums are the same with all of them.
struct Part<'a> {
    stencil: &'a Stencil,
    first: usize,
    lane: usize,
    x: &'a [f64],
    y: &'a mut [f64],
}

impl WithSimd for Part<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.stencil.mul(self.first, self.lane, self.x, self.y);
    }
}

impl Runs {
    /// Find what repeats.
    pub fn new(matrix: &Csr) -> Runs {
        let (n, columns) = (matrix.n_rows(), matrix.n_cols());
        let mut runs: Vec<Run> = vec![];
        let mut plain = 0;
        let mut i = 0;
        while i < n {
            let found = PERIODS.iter().find_map(|&p| {
                let mut end = i + p;
                while end < n && repeats(matrix, end, i + (end - i) % p) {
                    end += 1;
                }
                (end <= n && end - i >= SHORTEST).then_some((p, end))
            });
            let inside = |(p, end): (usize, usize)| {
                let stencil = Stencil::of(matrix, i, p);
                let (low, high) = (*stencil.offsets.first()?, *stencil.offsets.last()?);
                let fits = i as isize + low >= 0 && end as isize - 1 + high < columns as isize;
                fits.then_some((stencil, end))
            };
            let Some((stencil, end)) = found.and_then(inside) else {
                i += 1;
                continue;
            };
            if plain < i {
                runs.push(Run { rows: plain..i, stencil: None });
            }
            runs.push(Run { rows: i..end, stencil: Some(stencil) });
            (i, plain) = (end, end);
        }
        if plain < n {
            runs.push(Run { rows: plain..n, stencil: None });
        }
        Runs { runs }
    }

    /// The share of the rows that repeat.
    pub fn repeating(&self) -> f64 {
        let rows = self.runs.iter().filter(|r| r.stencil.is_some()).map(|r| r.rows.len());
        let all = self.runs.last().map_or(1, |r| r.rows.end);
        rows.sum::<usize>() as f64 / all as f64
    }

    /// `y ← A x` of some rows of the matrix, for several vectors at once.
    #[inline]
    pub fn mul_rows<const N: usize>(
        &self,
        arch: Arch,
        matrix: &Csr,
        rows: Range<usize>,
        x: [&[f64]; N],
        y: &mut [&mut [f64]; N],
    ) {
        let mut k = self.runs.partition_point(|r| r.rows.end <= rows.start);
        let mut first = rows.start;
        while first < rows.end {
            let run = &self.runs[k];
            let end = run.rows.end.min(rows.end);
            let part = first - rows.start..end - rows.start;
            match &run.stencil {
                Some(stencil) => {
                    let lane = (first - run.rows.start) % LANES;
                    for (x, y) in x.iter().zip(y.iter_mut()) {
                        let y = &mut y[part.clone()];
                        arch.dispatch(Part { stencil, first, lane, x, y });
                    }
                }
                None => {
                    for i in first..end {
                        let sums = matrix.row_dots(i, x);
                        y.iter_mut().zip(sums).for_each(|(y, s)| y[i - rows.start] = s);
                    }
                }
            }
            (first, k) = (end, k + 1);
        }
    }
}
