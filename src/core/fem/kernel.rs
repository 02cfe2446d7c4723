//! Products with a matrix many of whose rows repeat, as they do on uniform meshes.
//!
//! Where row `i` has the entries of row `i − p` (`p` displacements a node), shifted by `p`, the rows need not be read at all: a run of them is a
//! few diagonals whose weights repeat after `p` rows, `y_i = Σ_e w_e(i mod p) x_(i + o_e)`. Rows that repeat nothing stay compressed.
//! Every row is summed in an order of its own, whatever part of the product is asked for.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::sparse::{Csr, blocks, sum_of_blocks};

/// Rows that are computed together: multiples of all periods, and of the width of vector instructions.
const LANES: usize = 24;
/// Displacements of a node.
const PERIODS: [usize; 3] = [2, 1, 3];
/// Shorter runs are not worth it.
const SHORTEST: usize = 2 * LANES;
/// Entries are equal if they differ by so many units in the last place of the largest of the row: sums of the same elements in another order.
const SAME: f64 = 64.0 * f64::EPSILON;
/// Rows of a product that wait to be used.
const PART: usize = 512;

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
pub struct Kernel {
    runs: Vec<Run>,
    arch: Arch,
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

impl Kernel {
    /// Find what repeats.
    pub fn new(matrix: &Csr) -> Kernel {
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
        Kernel { runs, arch: Arch::new() }
    }

    /// The share of the rows that repeat.
    #[cfg(test)]
    pub(crate) fn repeating(&self) -> f64 {
        let rows = self.runs.iter().filter(|r| r.stencil.is_some()).map(|r| r.rows.len());
        let all = self.runs.last().map_or(1, |r| r.rows.end);
        rows.sum::<usize>() as f64 / all as f64
    }

    /// `y ← A x` of some rows of the matrix, for several vectors at once.
    #[inline]
    pub(crate) fn mul_rows<const N: usize>(
        &self,
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
                        self.arch.dispatch(Part { stencil, first, lane, x, y });
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

    /// `y -= A x`.
    pub(crate) fn mul_sub(&self, matrix: &Csr, x: &[f64], y: &mut [f64]) {
        blocks([&mut y[..matrix.n_rows()]], |first, [y]| {
            self.parts(matrix, first..first + y.len(), x, |rows, of_rows| {
                let part = rows.start - first..rows.end - first;
                y[part].iter_mut().zip(of_rows).for_each(|(y, s)| *y -= s);
            });
        });
    }

    /// The quadratic form `xᵀ A x`.
    pub fn quadratic(&self, matrix: &Csr, x: &[f64]) -> f64 {
        sum_of_blocks(matrix.n_rows(), |rows| {
            let mut sum = 0.0;
            self.parts(matrix, rows, x, |rows, of_rows| {
                sum += of_rows.iter().zip(&x[rows]).map(|(y, x)| x * y).sum::<f64>();
            });
            sum
        })
    }

    /// Some rows of `A x`, a few at a time.
    fn parts(
        &self,
        matrix: &Csr,
        rows: Range<usize>,
        x: &[f64],
        mut take: impl FnMut(Range<usize>, &[f64]),
    ) {
        let mut room = [0.0; PART];
        for first in rows.clone().step_by(PART) {
            let part = first..rows.end.min(first + PART);
            let sums = &mut room[..part.len()];
            self.mul_rows(matrix, part.clone(), [x], &mut [&mut *sums]);
            take(part, sums);
        }
    }

    /// `y ← A x`, for several vectors at once.
    pub fn mul<const N: usize>(&self, matrix: &Csr, x: [&[f64]; N], y: [&mut [f64]; N]) {
        blocks(y, |first, mut y| {
            self.mul_rows(matrix, first..first + y[0].len(), x, &mut y);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix like that of a plate: nodes of two displacements in columns, with irregular ends, over a few numbers of which one changes.
    fn plate(columns: usize, rows: usize, odd: Option<usize>) -> Csr {
        let n = 2 * columns * rows;
        let node = |c: usize, r: usize| c * rows + r;
        let mut entries = vec![];
        for c in 0..columns {
            for r in 0..rows {
                for (dc, dr) in (0..9).map(|k| (k / 3, k % 3)) {
                    let (Some(c2), Some(r2)) = ((c + dc).checked_sub(1), (r + dr).checked_sub(1))
                    else {
                        continue;
                    };
                    if c2 >= columns || r2 >= rows {
                        continue;
                    }
                    for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let v = (1 + 4 * (3 * dc + dr) + 2 * a + b) as f64;
                        entries.push((2 * node(c, r) + a, 2 * node(c2, r2) + b, v.sin()));
                    }
                }
            }
        }
        if let Some(i) = odd {
            entries.push((i, i, 0.25));
        }
        Csr::from_triplets(n, n, entries)
    }

    #[test]
    fn products_are_those_of_the_matrix() {
        for (columns, rows, odd) in [(6, 70, None), (5, 90, Some(333)), (1, 2, None), (40, 7, None)]
        {
            let matrix = plate(columns, rows, odd);
            let n = matrix.n_rows();
            let kernel = Kernel::new(&matrix);
            assert_eq!(kernel.repeating() > 0.5, rows > 60, "{columns} {rows}");
            let x: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).cos()).collect();
            let z: Vec<f64> = (0..n).map(|i| (0.2 * i as f64).sin()).collect();
            let mut exact = vec![0.0; n];
            matrix.mul(&x, &mut exact);
            let [mut y, mut w] = [vec![0.0; n], vec![0.0; n]];
            kernel.mul(&matrix, [&x, &z], [&mut y, &mut w]);
            assert!(y.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-13));
            let mut rest = exact.clone();
            kernel.mul_sub(&matrix, &x, &mut rest);
            assert!(rest.iter().all(|r| r.abs() < 1e-13));
            assert!((kernel.quadratic(&matrix, &x) - matrix.quadratic(&x)).abs() < 1e-11);
            // any part of it gives the same bits
            for (a, b) in [(0, n), (1, n - 1), (n / 3, n / 2), (n / 2, n / 2 + 1)] {
                let mut part = vec![0.0; b - a];
                kernel.mul_rows(&matrix, a..b, [&x], &mut [&mut part]);
                assert_eq!(part, y[a..b], "{columns} {rows}: {a} {b}");
            }
        }
    }
}
