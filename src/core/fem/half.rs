//! One half of a symmetric matrix, in blocks of a node: rows that repeat nothing, of irregular meshes.
//!
//! The `p` displacements of a node are coupled to the `p` of another by a block; of `B_gh = B_hgᵀ` one is kept, and gives both `y_g += B_gh x_h` and `y_h += B_ghᵀ x_g`.
//! What is left (displacements of nodes that are held in part, contact displacements) stays entry by entry, whole. A product reads 4.5 bytes an entry instead of 12.
//!
//! Row by row the order of the sums is that of the nodes, whatever part of a product is asked for: a part begins with the nodes before it that are coupled to its rows.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::sparse::{BLOCK, Csr, SHARED, sum_of_blocks};
use super::stencil::SAME;

/// Rows after which what is done with them follows: they are in the first-level cache.
const PART: usize = 1024;
/// Parts of a thread: not all take the same time.
const TASKS: usize = 4;
/// Displacements of a node at the most.
const WIDEST: usize = 3;

/// The diagonal and what is right of it, in blocks.
#[derive(Debug, Clone)]
pub(super) struct Half {
    /// Displacements of a node.
    width: usize,
    /// The first row of each node, or the row that belongs to none; and the number of rows.
    first: Vec<usize>,
    /// Where the blocks of each begin: the diagonal one comes first. Rows that belong to no node have none.
    blocks: Vec<usize>,
    /// The first column of each block.
    columns: Vec<u32>,
    /// The blocks, column by column.
    values: Vec<f64>,
    /// Where the other entries of each begin.
    loose: Vec<usize>,
    /// Row, column and value of these, on both sides of the diagonal.
    entries: Vec<(u32, u32, f64)>,
    /// So many rows before its own a block acts on, at the most.
    reach: usize,
}

/// Rows that are wanted: those of `y`, from `first` on.
struct Wanted<'a, 'y, const N: usize> {
    first: usize,
    x: [&'a [f64]; N],
    y: &'a mut [&'y mut [f64]; N],
}

/// Some nodes of a product, for whatever vector instructions there are.
struct Sweep<'a, 'y, const P: usize, const N: usize> {
    half: &'a Half,
    nodes: Range<usize>,
    wanted: Wanted<'a, 'y, N>,
}

impl<const P: usize, const N: usize> WithSimd for Sweep<'_, '_, P, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        for g in self.nodes {
            match self.half.is_within(g, self.wanted.first, self.wanted.y[0].len()) {
                true => self.half.add::<P, N, true>(g, &mut self.wanted),
                false => self.half.add::<P, N, false>(g, &mut self.wanted),
            }
        }
    }
}

/// A part of `xᵀ A x`, likewise.
struct Quadratic<'a, const P: usize> {
    half: &'a Half,
    nodes: Range<usize>,
    x: &'a [f64],
}

impl<const P: usize> WithSimd for Quadratic<'_, P> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        self.nodes.map(|g| self.half.quadratic_of::<P>(g, self.x)).sum()
    }
}

/// `P` entries of a vector.
#[inline(always)]
fn entries<const P: usize>(x: &[f64], at: usize) -> [f64; P] {
    x[at..at + P].try_into().unwrap_or([0.0; P])
}

impl Half {
    /// Of a matrix whose rows from each of `nodes` on are the `width` displacements of a node; none where it is not symmetric.
    pub fn new(matrix: &Csr, width: usize, nodes: &[usize]) -> Option<Half> {
        let n = matrix.n_rows();
        if !(2..=WIDEST).contains(&width) || matrix.n_cols() != n {
            return None;
        }
        // the node of each row
        let mut node_of = vec![None; n];
        for &g in nodes {
            if g + width <= n && node_of[g].is_none() {
                node_of[g..g + width].fill(Some(g));
            }
        }
        let mut half = Half {
            width,
            first: vec![],
            blocks: vec![0],
            columns: vec![],
            values: vec![],
            loose: vec![0],
            entries: vec![],
            reach: 0,
        };
        let mut columns = vec![];
        let mut i = 0;
        while i < n {
            half.first.push(i);
            let rows = if node_of[i].is_some() { i..i + width } else { i..i + 1 };
            if node_of[i].is_some() {
                columns.clear();
                columns.push(i);
                let right = rows.clone().flat_map(|r| matrix.row(r)).filter(|(j, _)| *j >= i);
                columns.extend(right.filter_map(|(j, _)| node_of[j]));
                columns.sort_unstable();
                columns.dedup();
                for &c in &columns {
                    half.columns.push(c as u32);
                    half.values.extend(block(matrix, width, i, c)?);
                }
                let last = columns.last().map_or(i, |c| c + width - 1);
                half.reach = half.reach.max(last - i);
            }
            for r in rows.clone() {
                let is_loose = |j: usize| node_of[r].is_none() || node_of[j].is_none();
                let loose = matrix.row(r).filter(|(j, _)| is_loose(*j));
                half.entries.extend(loose.map(|(j, v)| (r as u32, j as u32, v)));
            }
            half.blocks.push(half.columns.len());
            half.loose.push(half.entries.len());
            i = rows.end;
        }
        half.first.push(n);
        Some(half)
    }

    /// The share of the entries that stand in blocks.
    pub fn share_in_blocks(&self) -> f64 {
        let in_blocks = 2 * self.values.len();
        in_blocks as f64 / (in_blocks + self.entries.len()) as f64
    }

    /// All that a node acts on lies among the rows from `first` on.
    #[inline(always)]
    fn is_within(&self, g: usize, first: usize, rows: usize) -> bool {
        let last = match self.columns[self.blocks[g]..self.blocks[g + 1]].last() {
            Some(&c) => c as usize + self.width,
            None => self.first[g + 1],
        };
        self.first[g] >= first && last <= first + rows
    }

    /// What a node adds to the rows that are wanted, `y_g += Σ_h B_gh x_h` and `y_h += B_ghᵀ x_g`; `WITHIN`: they are all wanted.
    #[inline(always)]
    fn add<const P: usize, const N: usize, const WITHIN: bool>(
        &self,
        g: usize,
        wanted: &mut Wanted<N>,
    ) {
        let Wanted { first, x, y } = wanted;
        let first = *first;
        let rows = y[0].len();
        let is_wanted = |i: usize| WITHIN || i >= first && i < first + rows;
        let at = self.first[g];
        let own = self.blocks[g]..self.blocks[g + 1];
        if !own.is_empty() {
            // the vectors stand side by side, so that every entry of a block is read once
            let lanes = |rows: [[f64; P]; N]| -> [[f64; N]; P] {
                std::array::from_fn(|k| std::array::from_fn(|v| rows[v][k]))
            };
            let of_rows = |at: usize| lanes(std::array::from_fn(|v| entries(x[v], at)));
            let of_node = of_rows(at);
            let mut sums = [[0.0; N]; P];
            let blocks = &self.values[P * P * own.start..P * P * own.end];
            let blocks = self.columns[own].iter().zip(blocks.chunks_exact(P * P));
            for (k, (&c, block)) in blocks.enumerate() {
                let c = c as usize;
                let other = of_rows(c);
                let mut turned = [[0.0; N]; P];
                for j in 0..P {
                    for i in 0..P {
                        let b = block[P * j + i];
                        for v in 0..N {
                            sums[i][v] += b * other[j][v];
                            turned[j][v] += b * of_node[i][v];
                        }
                    }
                }
                if k == 0 {
                    continue;
                }
                for v in 0..N {
                    if WITHIN {
                        let y = &mut y[v][c - first..c - first + P];
                        (0..P).for_each(|j| y[j] += turned[j][v]);
                    } else {
                        let wanted = (0..P).filter(|j| is_wanted(c + j));
                        wanted.for_each(|j| y[v][c + j - first] += turned[j][v]);
                    }
                }
            }
            for v in 0..N {
                let wanted = (0..P).filter(|i| is_wanted(at + i));
                wanted.for_each(|i| y[v][at + i - first] += sums[i][v]);
            }
        }
        for &(i, j, a) in &self.entries[self.loose[g]..self.loose[g + 1]] {
            if is_wanted(i as usize) {
                (0..N).for_each(|v| y[v][i as usize - first] += a * x[v][j as usize]);
            }
        }
    }

    /// How many nodes begin before a row.
    fn before(&self, row: usize) -> usize {
        self.first[..self.first.len() - 1].partition_point(|f| *f < row)
    }

    /// The nodes that act on some rows: those before them, their own.
    fn acting(&self, rows: &Range<usize>) -> [Range<usize>; 2] {
        let place = |row: usize| self.first.partition_point(|f| *f <= row) - 1;
        let own = place(rows.start);
        let end = self.before(rows.end);
        [place(rows.start.saturating_sub(self.reach))..own, own..end]
    }

    /// `y ← y₀ + A x` of some rows, and what is to be made of them: `begin` makes `y₀` of a part of `y`, `each` gets the first of some rows that are complete, and these.
    pub fn mul_rows<const N: usize>(
        &self,
        arch: Arch,
        rows: Range<usize>,
        x: [&[f64]; N],
        y: [&mut [f64]; N],
        begin: impl Fn(&mut [f64]) + Sync,
        each: impl Fn(usize, [&mut [f64]; N]) + Sync,
    ) {
        let n = rows.len();
        let tasks = match rayon::current_num_threads() {
            _ if n < SHARED => 1,
            threads => threads * (n / (TASKS * threads * self.reach.max(BLOCK))).clamp(1, TASKS),
        };
        let size = n.div_ceil(tasks).max(1);
        let mut parts = y.map(|y| y.chunks_mut(size));
        let parts = (0..n.div_ceil(size)).map(|k| {
            let y: [&mut [f64]; N] = std::array::from_fn(|v| parts[v].next().unwrap_or_default());
            (rows.start + k * size, y)
        });
        let run = |(first, mut y): (usize, [&mut [f64]; N])| {
            y.iter_mut().for_each(|y| begin(y));
            self.add_part(arch, first, x, y, &each);
        };
        if tasks == 1 {
            parts.for_each(run);
        } else {
            parts.collect::<Vec<_>>().into_par_iter().for_each(run);
        }
    }

    fn add_part<const N: usize>(
        &self,
        arch: Arch,
        first: usize,
        x: [&[f64]; N],
        mut y: [&mut [f64]; N],
        each: &impl Fn(usize, [&mut [f64]; N]),
    ) {
        let end = first + y[0].len();
        let [before, own] = self.acting(&(first..end));
        let sweep = |nodes: Range<usize>, y: &mut [&mut [f64]; N]| {
            let wanted = Wanted { first, x, y };
            match self.width {
                2 => arch.dispatch(Sweep::<2, N> { half: self, nodes, wanted }),
                _ => arch.dispatch(Sweep::<3, N> { half: self, nodes, wanted }),
            }
        };
        sweep(before, &mut y);
        let mut complete = first;
        let mut node = own.start;
        while node < own.end {
            let next =
                self.first.partition_point(|f| *f < complete + PART).clamp(node + 1, own.end);
            sweep(node..next, &mut y);
            let until = if next == own.end { end } else { self.first[next] };
            each(complete, y.each_mut().map(|y| &mut y[complete - first..until - first]));
            (node, complete) = (next, until);
        }
    }

    /// `xᵀ A x = Σ_g x_gᵀ(B_gg x_g + 2 Σ_{h>g} B_gh x_h)`
    pub fn quadratic(&self, arch: Arch, x: &[f64]) -> f64 {
        let n = self.first[self.first.len() - 1];
        sum_of_blocks(n, |rows| {
            let nodes = self.before(rows.start)..self.before(rows.end);
            match self.width {
                2 => arch.dispatch(Quadratic::<2> { half: self, nodes, x }),
                _ => arch.dispatch(Quadratic::<3> { half: self, nodes, x }),
            }
        })
    }

    /// What a node adds to it.
    #[inline(always)]
    fn quadratic_of<const P: usize>(&self, g: usize, x: &[f64]) -> f64 {
        let own = self.blocks[g]..self.blocks[g + 1];
        let loose = &self.entries[self.loose[g]..self.loose[g + 1]];
        let mut sum = 0.0;
        for &(i, j, a) in loose {
            sum += x[i as usize] * a * x[j as usize];
        }
        if own.is_empty() {
            return sum;
        }
        let of_node: [f64; P] = entries(x, self.first[g]);
        let blocks = &self.values[P * P * own.start..P * P * own.end];
        let blocks = self.columns[own].iter().zip(blocks.chunks_exact(P * P));
        let mut sums = [0.0; P];
        for (k, (&c, block)) in blocks.enumerate() {
            let other: [f64; P] = entries(x, c as usize);
            for (j, i) in (0..P).flat_map(|j| (0..P).map(move |i| (j, i))) {
                sums[i] += block[P * j + i] * other[j];
            }
            if k == 0 {
                // the other half counts twice
                sums = sums.map(|s| 0.5 * s);
            }
        }
        sum + 2.0 * sums.iter().zip(of_node).map(|(s, x)| s * x).sum::<f64>()
    }
}

/// The block of two nodes, column by column; none where the other half differs.
fn block(matrix: &Csr, p: usize, g: usize, h: usize) -> Option<Vec<f64>> {
    let of = |i: usize, j: usize| matrix.entry(i, j).copied().unwrap_or(0.0);
    let diagonal = (0..p).flat_map(|k| [of(g + k, g + k), of(h + k, h + k)]);
    let size = diagonal.fold(0.0f64, |m, d| m.max(d.abs()));
    let mut values = Vec::with_capacity(p * p);
    for (j, i) in (0..p).flat_map(|j| (0..p).map(move |i| (j, i))) {
        let (above, below) = (of(g + i, h + j), of(h + j, g + i));
        if (above - below).abs() > SAME * size {
            return None;
        }
        values.push(above);
    }
    Some(values)
}
