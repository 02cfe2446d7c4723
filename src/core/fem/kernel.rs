//! Products with the stiffness: each body in the way that its rows allow.
//!
//! Rows of uniform meshes repeat, and are not read ([`super::stencil`]); of irregular meshes one half is read, in blocks of a node ([`super::half`]); small bodies and
//! matrices that are neither are read as they are. Every row is summed in an order of its own, whatever part of the product is asked for.

use std::ops::Range;

use pulp::Arch;

use super::half::Half;
use super::sparse::{Csr, LARGE, blocks, sum_of_blocks};
use super::stencil::Runs;

/// Rows of a product that wait to be used.
const PART: usize = 512;
/// Blocks do not pay where more of the rows repeat, or fewer of the entries stand in blocks.
const SHARE: f64 = 0.5;

/// What products with a matrix need to know of it.
#[derive(Debug, Clone)]
pub struct Kernel {
    way: Way,
    arch: Arch,
}

#[derive(Debug, Clone)]
enum Way {
    Runs(Runs),
    Half(Half),
}

impl Kernel {
    /// Find what repeats, or the blocks: `nodes` are the first of `width` rows each that belong to one node.
    pub fn new(matrix: &Csr, width: usize, nodes: &[usize]) -> Kernel {
        let runs = Runs::new(matrix);
        let pays = matrix.n_rows() >= LARGE && runs.repeating() < SHARE;
        let half = if pays { Half::new(matrix, width, nodes) } else { None };
        let way = match half.filter(|h| h.share_in_blocks() > SHARE) {
            Some(half) => Way::Half(half),
            None => Way::Runs(runs),
        };
        Kernel { way, arch: Arch::new() }
    }

    /// The share of the rows that repeat.
    #[cfg(test)]
    pub(crate) fn repeating(&self) -> f64 {
        match &self.way {
            Way::Runs(runs) => runs.repeating(),
            Way::Half(_) => 0.0,
        }
    }

    /// `y ← A x` of some rows of the matrix for several vectors at once, on all threads where that pays; `each` gets the first of some rows that are complete, and these.
    pub(crate) fn mul_rows<const N: usize>(
        &self,
        matrix: &Csr,
        rows: Range<usize>,
        x: [&[f64]; N],
        y: [&mut [f64]; N],
        each: impl Fn(usize, [&mut [f64]; N]) + Sync,
    ) {
        match &self.way {
            Way::Runs(runs) => blocks(y, |first, mut y| {
                let first = rows.start + first;
                runs.mul_rows(self.arch, matrix, first..first + y[0].len(), x, &mut y);
                each(first, y);
            }),
            Way::Half(half) => half.mul_rows(self.arch, rows, x, y, |y| y.fill(0.0), each),
        }
    }

    /// `y ← A x`, for several vectors at once.
    pub fn mul<const N: usize>(&self, matrix: &Csr, x: [&[f64]; N], y: [&mut [f64]; N]) {
        self.mul_rows(matrix, 0..matrix.n_rows(), x, y, |_, _| {});
    }

    /// `y -= A x`.
    pub(crate) fn mul_sub(&self, matrix: &Csr, x: &[f64], y: &mut [f64]) {
        let y = &mut y[..matrix.n_rows()];
        match &self.way {
            Way::Runs(runs) => blocks([y], |first, [y]| {
                self.parts(runs, matrix, first..first + y.len(), x, |rows, of_rows| {
                    let part = rows.start - first..rows.end - first;
                    y[part].iter_mut().zip(of_rows).for_each(|(y, s)| *y -= s);
                });
            }),
            Way::Half(half) => {
                let turn = |y: &mut [f64]| y.iter_mut().for_each(|y| *y = -*y);
                half.mul_rows(self.arch, 0..y.len(), [x], [y], turn, |_, [y]| turn(y));
            }
        }
    }

    /// The quadratic form `xᵀ A x`.
    pub fn quadratic(&self, matrix: &Csr, x: &[f64]) -> f64 {
        match &self.way {
            Way::Runs(runs) => sum_of_blocks(matrix.n_rows(), |rows| {
                let mut sum = 0.0;
                self.parts(runs, matrix, rows, x, |rows, of_rows| {
                    sum += of_rows.iter().zip(&x[rows]).map(|(y, x)| x * y).sum::<f64>();
                });
                sum
            }),
            Way::Half(half) => half.quadratic(self.arch, x),
        }
    }

    /// Some rows of `A x`, a few at a time.
    fn parts(
        &self,
        runs: &Runs,
        matrix: &Csr,
        rows: Range<usize>,
        x: &[f64],
        mut take: impl FnMut(Range<usize>, &[f64]),
    ) {
        let mut room = [0.0; PART];
        for first in rows.clone().step_by(PART) {
            let part = first..rows.end.min(first + PART);
            let sums = &mut room[..part.len()];
            runs.mul_rows(self.arch, matrix, part.clone(), [x], &mut [&mut *sums]);
            take(part, sums);
        }
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
            let kernel = Kernel::new(&matrix, 1, &[]);
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
                kernel.mul_rows(&matrix, a..b, [&x], [&mut part], |_, _| {});
                assert_eq!(part, y[a..b], "{columns} {rows}: {a} {b}");
            }
        }
    }

    /// Symmetric, no row like another: nodes of `width` displacements on a grid, of which some are held in part, numbered along it or at random.
    fn irregular(width: usize, sides: [usize; 3], is_random: bool) -> (Csr, Vec<usize>) {
        let count = sides.iter().product::<usize>();
        let at = |k: usize| [k / (sides[1] * sides[2]), k / sides[2] % sides[1], k % sides[2]];
        let near = |k: usize| {
            let step = |d: usize, c: usize| (at(k)[c] + d).checked_sub(1).filter(|i| *i < sides[c]);
            let all = (0..27).map(move |d| [step(d / 9, 0), step(d / 3 % 3, 1), step(d % 3, 2)]);
            let place =
                move |[a, b, c]: [Option<usize>; 3]| Some((a? * sides[1] + b?) * sides[2] + c?);
            all.filter_map(place).collect::<Vec<usize>>()
        };
        let mut order: Vec<usize> = (0..count).collect();
        if is_random {
            let mut state = 7u64;
            for k in (1..count).rev() {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                order.swap(k, (state >> 33) as usize % (k + 1));
            }
        }
        // a node in seven has but one displacement
        let mut first = vec![0; count];
        let (mut n, mut nodes) = (0, vec![]);
        for &k in &order {
            first[k] = n;
            let is_whole = k % 7 != 3;
            if is_whole {
                nodes.push(n);
            }
            n += if is_whole { width } else { 1 };
        }
        let size = |k: usize| if k % 7 == 3 { 1 } else { width };
        let mut entries = vec![];
        for k in 0..count {
            for l in near(k) {
                for (a, b) in (0..size(k)).flat_map(|a| (0..size(l)).map(move |b| (a, b))) {
                    let (i, j) = (first[k] + a, first[l] + b);
                    let v = ((i.min(j) * 37 + i.max(j) * 101) as f64).sin();
                    entries.push((i, j, v));
                }
            }
        }
        (Csr::from_triplets(n, n, entries), nodes)
    }

    #[test]
    fn one_half_gives_the_products_of_the_whole() {
        for (width, sides, is_random) in [
            (3, [40, 6, 5], false),
            (2, [1, 70, 30], false),
            (3, [12, 12, 9], true),
            (2, [1, 2600, 8], false),
        ] {
            let (matrix, nodes) = irregular(width, sides, is_random);
            let n = matrix.n_rows();
            let kernel = Kernel::new(&matrix, width, &nodes);
            assert!(matches!(kernel.way, Way::Half(_)), "{width} {sides:?}");
            let x: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).cos()).collect();
            let z: Vec<f64> = (0..n).map(|i| (0.2 * i as f64).sin()).collect();
            let mut exact = vec![0.0; n];
            matrix.mul(&x, &mut exact);
            let of = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let [mut y, mut w, mut rest] = [vec![0.0; n], vec![0.0; n], exact.clone()];
                pool.install(|| {
                    kernel.mul(&matrix, [&x, &z], [&mut y, &mut w]);
                    kernel.mul_sub(&matrix, &x, &mut rest);
                    (y, w, rest, kernel.quadratic(&matrix, &x))
                })
            };
            let (y, w, rest, quadratic) = of(1);
            assert!(y.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-13));
            assert!(rest.iter().all(|r| r.abs() < 1e-13));
            assert!((quadratic - matrix.quadratic(&x)).abs() < 1e-11);
            for threads in [2, 3] {
                assert_eq!(of(threads), (y.clone(), w.clone(), rest.clone(), quadratic));
            }
            // any part of it gives the same bits, and every row is handed on once
            for (a, b) in [(0, n), (1, n - 1), (n / 3, n / 2), (n / 2, n / 2 + 1), (n - 5, n)] {
                let mut part = vec![0.0; b - a];
                let seen = std::sync::Mutex::new(vec![]);
                kernel.mul_rows(&matrix, a..b, [&z], [&mut part], |first, [y]| {
                    seen.lock().unwrap().push((first, y.to_vec()));
                });
                assert_eq!(part, w[a..b], "{width} {sides:?}: {a} {b}");
                let mut seen = seen.into_inner().unwrap();
                seen.sort_by_key(|s| s.0);
                let all: Vec<f64> = seen.into_iter().flat_map(|s| s.1).collect();
                assert_eq!(all, part);
            }
        }
    }

    #[test]
    fn what_is_not_symmetric_is_read_whole() {
        let (matrix, nodes) = irregular(3, [40, 6, 5], false);
        let odd = matrix.triplets().map(|(i, j, v)| (i, j, if (i, j) == (0, 4) { 3.0 } else { v }));
        let odd = Csr::from_triplets(matrix.n_rows(), matrix.n_rows(), odd.collect());
        assert!(matches!(Kernel::new(&odd, 3, &nodes).way, Way::Runs(_)));
    }
}
