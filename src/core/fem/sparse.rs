//! Sparse matrices by compressed rows.
//!
//! Products `y = A x` run in every right-hand side, so they are plain loops without allocation.

use std::ops::Range;

use rayon::prelude::*;

/// A sparse matrix by compressed rows, columns ascending in each.
#[derive(Debug, Clone, PartialEq)]
pub struct Csr {
    n_cols: usize,
    row_start: Vec<usize>,
    col: Vec<u32>,
    val: Vec<f64>,
}

impl Default for Csr {
    /// No rows, no columns.
    fn default() -> Csr {
        Csr { n_cols: 0, row_start: vec![0], col: vec![], val: vec![] }
    }
}

/// Rows that a thread merges at a time, at least.
const ROWS: usize = 4096;

/// Rows of so many entries, or that begin with so many, whose columns follow one another, are summed as pieces of vectors, in so many sums side by side.
const FULL: usize = 16;
const BEGIN: usize = 128;
const LANES: usize = 8;

/// `a · b`
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; LANES];
    for (a, b) in a.zip(b) {
        for l in 0..LANES {
            sums[l] += a[l] * b[l];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// A sum below so many times the sizes of its terms is what rounding left of zero.
const CANCELLED: f64 = 16.0 * f64::EPSILON;

/// Sort the entries of a row by their columns and add up those of one column, in the order in which they came; what cancels leaves. How many are left.
fn merge(row: &mut [(u32, f64)]) -> usize {
    row.sort_by_key(|e| e.0);
    let (mut kept, mut next) = (0, 0);
    while next < row.len() {
        let (column, mut sum) = row[next];
        let mut size = sum.abs();
        next += 1;
        while next < row.len() && row[next].0 == column {
            sum += row[next].1;
            size += row[next].1.abs();
            next += 1;
        }
        if sum.abs() > CANCELLED * size || sum.is_nan() {
            row[kept] = (column, sum);
            kept += 1;
        }
    }
    kept
}

/// A matrix that grows entry by entry.
#[derive(Debug)]
pub struct Sums {
    n_cols: usize,
    /// Entries in the order of their rows, in each in the order in which they came.
    placed: Vec<(u32, f64)>,
    /// Where the next entry of each row goes.
    end: Vec<usize>,
}

impl Sums {
    /// With so many entries to come in each row.
    pub fn new(counts: Vec<usize>, n_cols: usize) -> Sums {
        let mut end = counts;
        let mut before = 0;
        for end in &mut end {
            before += std::mem::replace(end, before);
        }
        Sums { n_cols, placed: vec![(0, 0.0); before], end }
    }

    /// Add `v` to an entry.
    pub fn add(&mut self, i: usize, j: usize, v: f64) {
        self.placed[self.end[i]] = (j as u32, v);
        self.end[i] += 1;
    }

    /// The matrix, once all entries are there; zeros and what rounding leaves of them are dropped.
    pub fn finish(self) -> Csr {
        let Sums { n_cols, mut placed, end } = self;
        let mut rows: Vec<&mut [(u32, f64)]> = Vec::with_capacity(end.len());
        let (mut rest, mut before) = (&mut placed[..], 0);
        for end in &end {
            let (row, others) = rest.split_at_mut(end - before);
            rows.push(row);
            (rest, before) = (others, *end);
        }
        let merged: Vec<usize> = rows.par_iter_mut().with_min_len(ROWS).map(|r| merge(r)).collect();
        let mut row_start = Vec::with_capacity(end.len() + 1);
        row_start.push(0);
        let sums = merged.iter().scan(0, |sum, n| {
            *sum += n;
            Some(*sum)
        });
        row_start.extend(sums);
        let all = || rows.iter().zip(&merged).flat_map(|(row, n)| &row[..*n]);
        Csr {
            n_cols,
            row_start,
            col: all().map(|e| e.0).collect(),
            val: all().map(|e| e.1).collect(),
        }
    }
}

impl Csr {
    /// Build from `(row, column, value)` entries; duplicates add up, zeros and what rounding leaves of them are dropped.
    pub fn from_triplets(n_rows: usize, n_cols: usize, entries: Vec<(usize, usize, f64)>) -> Self {
        let mut counts = vec![0; n_rows];
        entries.iter().for_each(|e| counts[e.0] += 1);
        let mut sums = Sums::new(counts, n_cols);
        entries.iter().for_each(|&(i, j, v)| sums.add(i, j, v));
        drop(entries);
        sums.finish()
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.row_start.len() - 1
    }

    /// Number of columns.
    pub fn n_cols(&self) -> usize {
        self.n_cols
    }

    /// Number of stored entries.
    pub fn n_entries(&self) -> usize {
        self.val.len()
    }

    /// The `(column, value)` entries of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.row_start[i]..self.row_start[i + 1];
        self.col[range.clone()].iter().zip(&self.val[range]).map(|(&j, &v)| (j as usize, v))
    }

    /// An entry, if it is stored.
    pub fn entry(&self, i: usize, j: usize) -> Option<&f64> {
        let range = self.row_start[i]..self.row_start[i + 1];
        let place = self.col[range.clone()].binary_search(&(j as u32)).ok()?;
        Some(&self.val[range.start + place])
    }

    /// All entries as `(row, column, value)`.
    pub fn triplets(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.n_rows()).flat_map(move |i| self.row(i).map(move |(j, v)| (i, j, v)))
    }

    /// Entries with which row `i` begins whose columns follow one another, where these are many (reduced bodies have full matrices); and its end.
    #[inline]
    fn full(&self, i: usize) -> [Range<usize>; 2] {
        let (a, b) = (self.row_start[i], self.row_start[i + 1]);
        if b - a < FULL {
            return [a..a, a..b];
        }
        let first = self.col[a] as usize;
        let follows = |k: usize| self.col[k] as usize - first == k - a;
        if follows(b - 1) {
            return [a..b, b..b];
        }
        if b - a < BEGIN || !follows(a + BEGIN - 1) {
            return [a..a, a..b];
        }
        // columns ascend: once one does not follow, no other does
        let (mut last, mut beyond) = (a + BEGIN - 1, b - 1);
        while beyond - last > 1 {
            let middle = last.midpoint(beyond);
            match follows(middle) {
                true => last = middle,
                false => beyond = middle,
            }
        }
        [a..beyond, beyond..b]
    }

    /// Row `i` times `x`.
    #[inline]
    pub fn row_dot(&self, i: usize, x: &[f64]) -> f64 {
        self.row_dots(i, [x])[0]
    }

    /// `y ← y + c row_i`
    #[inline]
    pub(crate) fn add_row(&self, i: usize, c: f64, y: &mut [f64]) {
        let [full, rest] = self.full(i);
        if let Some(&first) = self.col[full.clone()].first() {
            let y = &mut y[first as usize..];
            y.iter_mut().zip(&self.val[full]).for_each(|(y, v)| *y += c * v);
        }
        let rest = self.col[rest.clone()].iter().zip(&self.val[rest]);
        rest.for_each(|(&j, v)| y[j as usize] += c * v);
    }

    /// Row `i` times several vectors: the row is read once.
    #[inline]
    pub(crate) fn row_dots<const N: usize>(&self, i: usize, x: [&[f64]; N]) -> [f64; N] {
        let [full, rest] = self.full(i);
        let mut sums = [0.0; N];
        if let Some(&first) = self.col[full.clone()].first() {
            let columns = first as usize..first as usize + full.len();
            sums = x.map(|x| dot(&self.val[full.clone()], &x[columns.clone()]));
        }
        for (&j, &v) in self.col[rest.clone()].iter().zip(&self.val[rest]) {
            for (s, x) in sums.iter_mut().zip(x) {
                *s += v * x[j as usize];
            }
        }
        sums
    }

    /// `y = A x`.
    pub fn mul(&self, x: &[f64], y: &mut [f64]) {
        debug_assert_eq!(x.len(), self.n_cols);
        for (i, y) in y.iter_mut().enumerate().take(self.n_rows()) {
            *y = self.row_dot(i, x);
        }
    }

    /// `y -= A x`.
    pub(crate) fn mul_sub(&self, x: &[f64], y: &mut [f64]) {
        blocks([&mut y[..self.n_rows()]], |first, [y]| {
            y.iter_mut().enumerate().for_each(|(i, y)| *y -= self.row_dot(first + i, x));
        });
    }

    /// The quadratic form `xᵀ A x`.
    pub fn quadratic(&self, x: &[f64]) -> f64 {
        self.quadratic_of(0..self.n_rows(), x)
    }

    /// What some rows add to the quadratic form.
    pub(crate) fn quadratic_of(&self, rows: Range<usize>, x: &[f64]) -> f64 {
        let term = |i: usize| x[i] * self.row_dot(i, x);
        sum_of_blocks(rows.len(), |part| part.map(|i| term(rows.start + i)).sum())
    }

    /// `Aᵀ B A` of this matrix `B` and a sparse `A`.
    pub(crate) fn congruence(&self, a: &Csr) -> Csr {
        a.transposed().product(&self.product(a))
    }

    /// `A B`, row by row into one dense row (Gustavson 1978).
    pub fn product(&self, b: &Csr) -> Csr {
        let mut product = Csr { n_cols: b.n_cols, row_start: vec![0], col: vec![], val: vec![] };
        let mut sum = vec![0.0; b.n_cols];
        let mut seen = vec![false; b.n_cols];
        let mut columns: Vec<usize> = vec![];
        for i in 0..self.n_rows() {
            for (k, x) in self.row(i) {
                for (j, y) in b.row(k) {
                    if !seen[j] {
                        seen[j] = true;
                        columns.push(j);
                    }
                    sum[j] += x * y;
                }
            }
            columns.sort_unstable();
            for j in columns.drain(..) {
                if sum[j] != 0.0 {
                    product.col.push(j as u32);
                    product.val.push(sum[j]);
                }
                (sum[j], seen[j]) = (0.0, false);
            }
            product.row_start.push(product.col.len());
        }
        product
    }

    /// `Aᵀ`
    pub fn transposed(&self) -> Csr {
        let mut row_start = vec![0; self.n_cols + 1];
        self.col.iter().for_each(|&j| row_start[j as usize + 1] += 1);
        for j in 0..self.n_cols {
            row_start[j + 1] += row_start[j];
        }
        let mut next = row_start.clone();
        let (mut col, mut val) = (vec![0; self.col.len()], vec![0.0; self.col.len()]);
        for (i, j, v) in self.triplets() {
            (col[next[j]], val[next[j]]) = (i as u32, v);
            next[j] += 1;
        }
        Csr { n_cols: self.n_rows(), row_start, col, val }
    }

    /// Row sums of absolute values: the growth of rounding errors in a product.
    pub(crate) fn abs_row_sums(&self) -> Vec<f64> {
        (0..self.n_rows()).map(|i| self.row(i).map(|(_, v)| v.abs()).sum()).collect()
    }

    /// The diagonal as a vector if nothing else is stored.
    pub fn as_diagonal(&self) -> Option<Vec<f64>> {
        let mut d = vec![0.0; self.n_rows()];
        for (i, j, v) in self.triplets() {
            if i != j {
                return None;
            }
            d[i] = v;
        }
        Some(d)
    }

    /// The block of the first `n` rows and columns: `M_OO`, `K_OO`.
    pub fn leading(&self, n: usize) -> Csr {
        Csr::from_triplets(n, n, self.triplets().filter(|(i, j, _)| *i < n && *j < n).collect())
    }

    /// The rows and columns of some coordinates, in this order.
    pub(crate) fn among(&self, rows: &[usize]) -> Csr {
        self.among_by(rows, &mut vec![usize::MAX; self.n_cols])
    }

    /// The same with the places of the coordinates among them, which are `usize::MAX` before and after.
    pub(super) fn among_by(&self, rows: &[usize], place: &mut [usize]) -> Csr {
        rows.iter().enumerate().for_each(|(k, &i)| place[i] = k);
        let mut entries = vec![];
        for (k, &i) in rows.iter().enumerate() {
            let inside = self.row(i).filter(|(j, _)| place[*j] != usize::MAX);
            entries.extend(inside.map(|(j, v)| (k, place[j], v)));
        }
        rows.iter().for_each(|&i| place[i] = usize::MAX);
        Csr::from_triplets(rows.len(), rows.len(), entries)
    }

    /// `α A + β B` of two matrices of one shape.
    pub fn combination(alpha: f64, a: &Csr, beta: f64, b: &Csr) -> Csr {
        let mut sum = Csr { n_cols: a.n_cols, row_start: vec![0], col: vec![], val: vec![] };
        for i in 0..a.n_rows() {
            let (mut of_a, mut of_b) = (a.row(i).peekable(), b.row(i).peekable());
            loop {
                let (ja, jb) = (of_a.peek().map(|e| e.0), of_b.peek().map(|e| e.0));
                let Some(j) = ja.into_iter().chain(jb).min() else { break };
                let x = of_a.next_if(|e| e.0 == j).map_or(0.0, |e| alpha * e.1);
                let y = of_b.next_if(|e| e.0 == j).map_or(0.0, |e| beta * e.1);
                if x + y != 0.0 {
                    sum.col.push(j as u32);
                    sum.val.push(x + y);
                }
            }
            sum.row_start.push(sum.col.len());
        }
        sum
    }
}

/// From so many rows on it pays to look for what blocks and components of a matrix have in common; smaller ones stay as they are.
pub(super) const LARGE: usize = 2000;

/// Rows of one task, and the least number of rows that is shared among threads.
pub(super) const BLOCK: usize = 4096;
pub(super) const SHARED: usize = 8 * BLOCK;

/// A sum over rows, block by block, whoever computes them: the same on any number of threads.
pub(super) fn sum_of_blocks(n: usize, of: impl Fn(Range<usize>) -> f64 + Sync) -> f64 {
    let of_block = |b: usize| of(b * BLOCK..n.min((b + 1) * BLOCK));
    if n < SHARED {
        return (0..n.div_ceil(BLOCK)).map(of_block).sum();
    }
    let parts: Vec<f64> = (0..n.div_ceil(BLOCK)).into_par_iter().map(of_block).collect();
    parts.iter().sum()
}

/// Go through some vectors in blocks, on all threads where that pays: `each` gets the first row of a block and the block's part
/// of every vector. What it does with a block must not depend on others.
pub(crate) fn blocks<const N: usize>(
    y: [&mut [f64]; N],
    each: impl Fn(usize, [&mut [f64]; N]) + Sync,
) {
    let n = y[0].len();
    let mut parts = y.map(|y| y.chunks_mut(BLOCK));
    let blocks = (0..n.div_ceil(BLOCK)).map(|b| {
        let block: [&mut [f64]; N] = std::array::from_fn(|v| parts[v].next().unwrap_or_default());
        (b * BLOCK, block)
    });
    if n < SHARED {
        blocks.for_each(|(first, block)| each(first, block));
    } else {
        let blocks: Vec<(usize, [&mut [f64]; N])> = blocks.collect();
        blocks.into_par_iter().for_each(|(first, block)| each(first, block));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laplacian(n: usize) -> Csr {
        let mut e = vec![];
        for i in 0..n {
            e.push((i, i, 2.0));
            if i + 1 < n {
                e.push((i, i + 1, -1.0));
                e.push((i + 1, i, -1.0));
            }
        }
        Csr::from_triplets(n, n, e)
    }

    #[test]
    fn duplicates_add_up_and_zeros_vanish() {
        let a = Csr::from_triplets(2, 2, vec![(1, 1, 2.0), (0, 0, 1.0), (1, 1, 3.0), (0, 1, 0.0)]);
        assert_eq!(a.triplets().collect::<Vec<_>>(), vec![(0, 0, 1.0), (1, 1, 5.0)]);
        assert_eq!(a.as_diagonal(), Some(vec![1.0, 5.0]));
    }

    /// Products and sums of a large matrix have the same bits on any number of threads.
    #[test]
    fn threads_change_no_bit() {
        let n = 3 * SHARED / 2 + 17;
        let a = laplacian(n);
        let x: Vec<f64> = (0..n).map(|i| (0.37 * i as f64).sin()).collect();
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut y = vec![0.5; n];
                a.mul_sub(&x, &mut y);
                (a.quadratic(&x), y)
            })
        };
        let one = on(1);
        assert_eq!(one, on(2));
        assert_eq!(one, on(5));
        let slow: f64 = (0..n).map(|i| x[i] * a.row_dot(i, &x)).sum();
        assert!((one.0 - slow).abs() < 1e-12 * slow);
    }
}
