//! The linear complementarity problem `0 ≤ w ⟂ p = N w + q ≥ 0` by principal pivoting (theory §3), and that between two bounds:
//! `0 ≤ w ≤ W`, with `p ≥ 0` where `w = 0`, `p ≤ 0` where `w = W`, `p = 0` between them. A P-matrix has one solution of either.
//!
//! Block pivoting from a given active set (Kostreva 1978; Júdice and Pires 1994): all infeasible indices
//! change sides at once while their number falls, otherwise one at a time by the least-index rule (Murty 1974),
//! which ends for every P-matrix: there a basis that comes back is one that rounding errors call wrong, and more is taken for them. Indices in contact have `w = 0` exactly,
//! free ones `p = 0` exactly.

use nalgebra::DMatrix;
use thiserror::Error;

use super::coupling::{Block, Coupling};
use crate::fem::{Csr, SpdFactor, largest};

/// Where an unknown stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// `w = 0`, `p ≥ 0`.
    Front,
    /// Between the bounds, `p = 0`.
    Free,
    /// `w = W`, `p ≤ 0`.
    Behind,
}

/// A solution between two bounds with its basis.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxSolution {
    /// `0 ≤ w ≤ W`
    pub w: Vec<f64>,
    /// `N w + q`
    pub p: Vec<f64>,
    /// Where each unknown stands.
    pub places: Vec<Side>,
    /// Unknowns that may be counted as standing at this bound or as free, to rounding.
    pub degenerate: Vec<(usize, Side)>,
    /// Number of changed bases.
    pub pivots: usize,
}

/// A solution with its basis.
#[derive(Debug, Clone, PartialEq)]
pub struct LcpSolution {
    /// Gaps `w ≥ 0`.
    pub w: Vec<f64>,
    /// Pressures `p ≥ 0`.
    pub p: Vec<f64>,
    /// In contact: `w = 0`.
    pub active: Vec<bool>,
    /// Indices with `w = p = 0` to rounding.
    pub degenerate: Vec<usize>,
    /// Number of changed bases.
    pub pivots: usize,
}

/// Which unknowns have bounds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds<'a> {
    /// The first so many have `w ≥ 0`; of the others `p = 0` alone is asked.
    pub count: usize,
    /// `w ≤ W`; none where the list is empty.
    pub upper: &'a [f64],
}

/// The pivoting found no solution.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum LcpError {
    /// A principal block is singular: not a P-matrix.
    #[error(
        "a principal block of N_C is singular: the contact conditions have no unique solution; stress = \"reaction\" has one on every mesh"
    )]
    Singular,
    /// The limit of pivots was reached: not a P-matrix.
    #[error(
        "no solution after {pivots} pivots: N_C is not a P-matrix; stress = \"reaction\" has one on every mesh"
    )]
    PivotLimit {
        /// Pivots done.
        pivots: usize,
    },
}

/// Rounding units that count as zero.
pub(crate) const UNITS: f64 = 16.0 * f64::EPSILON;

/// So many times as much counts as zero each time that a basis comes back, up to this.
const MORE: (f64, f64) = (8.0, 1e-9);

/// Solve from the basis `start`; `q_scale[i]` is the size of the terms that made up `q[i]`, against
/// which rounding errors are judged.
pub fn solve(
    n: &Coupling,
    q: &[f64],
    q_scale: &[f64],
    start: &[bool],
) -> Result<LcpSolution, LcpError> {
    let place = |a: &bool| if *a { Side::Front } else { Side::Free };
    let start: Vec<Side> = start.iter().map(place).collect();
    let BoxSolution { w, p, places, degenerate, pivots } =
        solve_between(n, (q, q_scale), Bounds { count: q.len(), upper: &[] }, &start)?;
    Ok(LcpSolution {
        w,
        p,
        active: places.iter().map(|p| *p == Side::Front).collect(),
        degenerate: degenerate.into_iter().map(|d| d.0).collect(),
        pivots,
    })
}

/// The same between two bounds, `0 ≤ w ≤ W`; what has no bounds stands [`Side::Free`]. `q` with the sizes of its terms.
pub(crate) fn solve_between(
    n: &Coupling,
    (q, q_scale): (&[f64], &[f64]),
    bounds: Bounds,
    start: &[Side],
) -> Result<BoxSolution, LcpError> {
    let size = bounds.count;
    let bound = |i: usize| bounds.upper.get(i).copied().unwrap_or(f64::INFINITY);
    let mut places = start.to_vec();
    let mut pivots = 0;
    let mut fewest = size + 1;
    let mut patience = 3;
    let limit = 50 + 20 * size * size;
    let mut units = UNITS;
    // bases since one index at a time changes sides
    let mut passed: Vec<Vec<Side>> = vec![];
    loop {
        let (w, p) = basic_solution(n, q, &bound, &places)?;
        // a row without terms of its own knows those of the others by the solution of all: counted once a basis has come back
        let largest = largest(&w);
        let of_all = |i: usize| (units - UNITS) * n[(i, i)].abs() * largest;
        let tolerance = |i: usize| units * (q_scale[i] + n.row_size(i, &w)) + of_all(i);
        // where an unknown belongs that stands wrong
        let belongs = |i: usize| -> Option<Side> {
            let (diagonal, rounding) = (n[(i, i)].abs(), tolerance(i));
            match places[i] {
                Side::Front => (p[i] < -rounding).then_some(Side::Free),
                Side::Behind => (p[i] > rounding).then_some(Side::Free),
                Side::Free if w[i] * diagonal < -rounding => Some(Side::Front),
                Side::Free => ((w[i] - bound(i)) * diagonal > rounding).then_some(Side::Behind),
            }
        };
        let wrong: Vec<(usize, Side)> = (0..size).filter_map(|i| Some((i, belongs(i)?))).collect();
        if wrong.is_empty() {
            let touches = |i: usize| -> Option<(usize, Side)> {
                let (diagonal, rounding) = (n[(i, i)].abs(), tolerance(i));
                let at = match places[i] {
                    Side::Front if p[i] <= rounding => Side::Front,
                    Side::Behind if -p[i] <= rounding => Side::Behind,
                    Side::Free if w[i] * diagonal <= rounding => Side::Front,
                    Side::Free if (bound(i) - w[i]) * diagonal <= rounding => Side::Behind,
                    _ => return None,
                };
                Some((i, at))
            };
            let degenerate = (0..size).filter_map(touches).collect();
            let within = |(i, w): (usize, f64)| if i < size { w.max(0.0).min(bound(i)) } else { w };
            let w = w.into_iter().enumerate().map(within).collect();
            let sided = |(i, p): (usize, &f64)| match places[i] {
                Side::Front => p.max(0.0),
                Side::Behind => p.min(0.0),
                Side::Free => 0.0,
            };
            let p = p.iter().enumerate().map(sided).collect();
            return Ok(BoxSolution { w, p, places, degenerate, pivots });
        }
        if pivots >= limit {
            return Err(LcpError::PivotLimit { pivots });
        }
        pivots += 1;
        if wrong.len() < fewest {
            fewest = wrong.len();
            patience = 3;
        } else {
            patience -= 1;
        }
        if patience >= 0 {
            passed.clear();
            wrong.iter().for_each(|&(i, place)| places[i] = place);
        } else if passed.contains(&places) && units < MORE.1 {
            units *= MORE.0;
            passed.clear();
        } else {
            passed.push(places.clone());
            places[wrong[0].0] = wrong[0].1;
        }
    }
}

/// `w = 0` in front, `w = W` behind, `p = 0` between: `N_ff w_f = −q_f − N_fb W_b`; then `p` of the others.
fn basic_solution(
    n: &Coupling,
    q: &[f64],
    bound: &dyn Fn(usize) -> f64,
    places: &[Side],
) -> Result<(Vec<f64>, Vec<f64>), LcpError> {
    let free: Vec<usize> = (0..q.len()).filter(|&i| places[i] == Side::Free).collect();
    let mut w: Vec<f64> =
        (0..q.len()).map(|i| if places[i] == Side::Behind { bound(i) } else { 0.0 }).collect();
    let mut of_free: Vec<f64> = free.iter().map(|&i| -(q[i] + n.row_dot(i, &w))).collect();
    n.block(&free)?.solve(&mut of_free)?;
    free.iter().zip(&of_free).for_each(|(&i, &x)| w[i] = x);
    if w.iter().any(|x| !x.is_finite()) {
        return Err(LcpError::Singular);
    }
    let mut p = vec![0.0; q.len()];
    for i in (0..q.len()).filter(|&i| places[i] != Side::Free) {
        p[i] = q[i] + n.row_dot(i, &w);
    }
    Ok((w, p))
}

/// The natural residual `max_i |min(w_i, p_i / N_ii)|` with `p = N w + q`: zero at the solution alone.
pub fn residual(n: &DMatrix<f64>, q: &[f64], w: &[f64]) -> f64 {
    let p = |i: usize| q[i] + (0..q.len()).map(|j| n[(i, j)] * w[j]).sum::<f64>();
    (0..q.len()).map(|i| w[i].min(p(i) / n[(i, i)]).abs()).fold(0.0, f64::max)
}

/// Why a matrix is known to be a P-matrix.
#[derive(Debug, Clone, PartialEq)]
pub enum PMatrix {
    /// The symmetric part of a positive row scaling is positive definite.
    PositiveDefinite,
    /// `2D − |N|` is an M-matrix: `N` is an H-matrix with positive diagonal.
    HMatrix,
    /// All principal minors were computed and are positive.
    Minors,
    /// It is not one, or it could not be shown; the index is the one most to blame.
    NotShown {
        /// Index of the contact node.
        index: usize,
    },
}

/// Pivots and minors below this, relative, may be rounding errors and show nothing.
const MARGIN: f64 = 1e-12;

/// A solution of a system with the right-hand side 1 above this is that of a singular matrix.
const SINGULAR: f64 = 1e8;

/// Largest size for which all principal minors are computed.
const MINORS_LIMIT: usize = 14;

/// `⟨N⟩ = 2D − |N|` of an H-matrix with a positive diagonal, factorised: `|N_ff⁻¹| ≤ (⟨N⟩⁻¹)_ff` entry by entry, for every set of points `f`.
#[derive(Debug)]
pub struct ComparisonMatrix(Block);

impl ComparisonMatrix {
    /// None where `N` is no H-matrix, or its diagonal not positive.
    pub fn of(n: &Coupling) -> Option<ComparisonMatrix> {
        let size = n.size();
        if (0..size).any(|i| n[(i, i)] <= 0.0) {
            return None;
        }
        let entry = |(i, j, v): (usize, usize, f64)| (i, j, if i == j { v } else { -v.abs() });
        let entries = n.rows().triplets().map(entry).collect();
        let all: Vec<usize> = (0..size).collect();
        let factor = Coupling::from(Csr::from_triplets(size, size, entries)).block(&all).ok()?;
        // an M-matrix: ⟨N⟩ x = 1 has a solution x > 0; scaled by the diagonal, so that no unit decides; of a singular one x has no bound but rounding
        let mut sums = vec![1.0; size];
        factor.solve(&mut sums).ok()?;
        let is_within = |(i, x): (usize, &f64)| (MARGIN..SINGULAR).contains(&(x * n[(i, i)]));
        sums.iter().enumerate().all(is_within).then_some(ComparisonMatrix(factor))
    }

    /// `⟨N⟩⁻¹ x`
    pub fn solve(&self, mut x: Vec<f64>) -> Vec<f64> {
        if self.0.solve(&mut x).is_err() {
            x.fill(f64::INFINITY);
        }
        x
    }

    /// `⟨N⟩⁻ᵀ x`
    pub(crate) fn solve_transposed(&self, mut x: Vec<f64>) -> Vec<f64> {
        self.0.solve_transposed(&mut x);
        x
    }

    /// Bounds over all active sets of the norms of `Σ_k L_ik n_k`, where the rows of gaps and pressures over the stresses are `L` and the stresses have these
    /// norms: `⟨N⟩⁻¹ n` of a free point, `n_i + Σ_{f≠i} |N_if| (⟨N⟩⁻¹ n)_f` of one in contact.
    pub fn follow(&self, n: &Coupling, norms: Vec<f64>) -> [Vec<f64>; 2] {
        let gap = self.solve(norms.clone());
        let others = |i: usize| n.row(i).filter(move |(j, _)| *j != i);
        let pressure = |i: usize| norms[i] + others(i).map(|(j, v)| v.abs() * gap[j]).sum::<f64>();
        let pressure = (0..gap.len()).map(pressure).collect();
        [gap, pressure]
    }
}

/// Show that `N` is a P-matrix; `row_scale > 0` may symmetrise it (the P property does not change).
pub fn p_matrix(n: &Coupling, row_scale: &[f64]) -> PMatrix {
    if n.is_sparse() {
        return sparse_p_matrix(n, row_scale);
    }
    let n = &n.dense();
    let size = n.nrows();
    let symmetric_part = |scale: &dyn Fn(usize) -> f64| {
        DMatrix::from_fn(size, size, |i, j| 0.5 * (scale(i) * n[(i, j)] + scale(j) * n[(j, i)]))
    };
    let plain = symmetric_part(&|_| 1.0);
    let scaled = symmetric_part(&|i| row_scale[i]);
    let is_definite = |a: &DMatrix<f64>| {
        a.clone().cholesky().is_some_and(|c| {
            // pivots over the diagonal they began with
            (0..size).all(|i| c.l_dirty()[(i, i)].powi(2) > MARGIN * a[(i, i)])
        })
    };
    if is_definite(&plain) || is_definite(&scaled) {
        return PMatrix::PositiveDefinite;
    }
    // with positive diagonal, and 2D − |N| an M-matrix: (2D − |N|) x = 1 has a solution x > 0
    let comparison = DMatrix::from_fn(size, size, |i, j| match i == j {
        true => n[(i, i)],
        false => -n[(i, j)].abs(),
    });
    let sums = comparison.lu().solve(&DMatrix::from_element(size, 1, 1.0));
    let positive = (0..size).all(|i| n[(i, i)] > 0.0);
    // scaled by the diagonal, so that no unit decides; of a singular matrix x has no bound but rounding
    let is_within = |(i, x): (usize, &f64)| (MARGIN..SINGULAR).contains(&(*x * n[(i, i)]));
    if positive && sums.is_some_and(|x| x.iter().enumerate().all(is_within)) {
        return PMatrix::HMatrix;
    }
    let minor = |set: usize| {
        let index: Vec<usize> = (0..size).filter(|i| set >> i & 1 == 1).collect();
        let block = DMatrix::from_fn(index.len(), index.len(), |a, b| n[(index[a], index[b])]);
        // over Hadamard's bound
        let bound: f64 = block.row_iter().map(|r| r.norm()).product();
        block.determinant() / bound
    };
    if size <= MINORS_LIMIT && (1..1usize << size).all(|set| minor(set) > MARGIN) {
        return PMatrix::Minors;
    }
    let eigen = plain.symmetric_eigen();
    let worst = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    PMatrix::NotShown { index: worst.iamax() }
}

/// The same of a large matrix that is mostly zero.
fn sparse_p_matrix(n: &Coupling, row_scale: &[f64]) -> PMatrix {
    let size = n.size();
    let is_definite = |scale: &dyn Fn(usize) -> f64| {
        let half = |(i, j, v): (usize, usize, f64)| {
            let v = 0.5 * scale(i) * v;
            // what rounding may have added to the diagonal is taken away
            let less = if i == j { 2.0 * (1.0 - MARGIN) * v } else { v };
            if i == j { [(i, j, less), (i, j, 0.0)] } else { [(i, j, v), (j, i, v)] }
        };
        let entries = n.rows().triplets().flat_map(half).collect();
        let symmetric = Csr::from_triplets(size, size, entries);
        SpdFactor::new(&symmetric, "symmetric part of N_C").is_ok()
    };
    if is_definite(&|_| 1.0) || is_definite(&|i| row_scale[i]) {
        return PMatrix::PositiveDefinite;
    }
    if ComparisonMatrix::of(n).is_some() {
        return PMatrix::HMatrix;
    }
    // the row that its diagonal rules least
    let rest = |i: usize| n.row(i).filter(|e| e.0 != i).map(|e| e.1.abs()).sum::<f64>();
    let rule = |i: usize| n[(i, i)] / rest(i);
    let index = (0..size).min_by(|&a, &b| rule(a).total_cmp(&rule(b)));
    PMatrix::NotShown { index: index.unwrap_or(0) }
}

/// Largest size for which all active sets are gone through.
const SETS_LIMIT: usize = 10;

/// A bound of `‖N_ff⁻¹ N_fc‖` over all sets of free points `f` and closed ones `c`; a positive row scaling changes nothing of it. The least of
///
/// - `‖off N‖ / λ_min(½(N + Nᵀ))`, of the matrix itself and of its rows scaled,
/// - `‖⟨N⟩⁻¹ |off N|‖` of an H-matrix, `⟨N⟩ = 2D − |N|`: `|N_ff⁻¹| ≤ (⟨N⟩⁻¹)_ff` entry by entry,
/// - all sets in turn, where there are few.
///
/// Infinite where none of them holds.
pub(crate) fn coupling_bound(n: &Coupling, row_scale: &[f64]) -> f64 {
    let n = &n.dense();
    let size = n.nrows();
    let norm = |a: &DMatrix<f64>| a.singular_values().max();
    if (0..size).all(|i| (0..size).all(|j| i == j || n[(i, j)] == 0.0)) {
        return 0.0;
    }
    if size <= SETS_LIMIT {
        let of_set = |set: u32| -> f64 {
            let (closed, free): (Vec<usize>, Vec<usize>) =
                (0..size).partition(|i| set >> i & 1 == 1);
            let block = |cols: &[usize]| {
                DMatrix::from_fn(free.len(), cols.len(), |a, b| n[(free[a], cols[b])])
            };
            block(&free).lu().solve(&block(&closed)).map_or(f64::INFINITY, |x| norm(&x))
        };
        return (1..(1u32 << size) - 1).map(of_set).fold(0.0, f64::max);
    }
    let of_part = |scale: &dyn Fn(usize) -> f64| {
        let scaled = DMatrix::from_fn(size, size, |i, j| scale(i) * n[(i, j)]);
        let least = (0.5 * (&scaled + scaled.transpose())).symmetric_eigenvalues().min();
        let off = &scaled - DMatrix::from_diagonal(&scaled.diagonal());
        if least > 0.0 { norm(&off) / least } else { f64::INFINITY }
    };
    let off = DMatrix::from_fn(size, size, |i, j| if i == j { 0.0 } else { n[(i, j)].abs() });
    let comparison = DMatrix::from_diagonal(&n.diagonal()) - &off;
    let of_comparison = comparison.try_inverse().map_or(f64::INFINITY, |inverse| {
        // an M-matrix has a positive inverse
        match inverse.iter().all(|x| *x >= 0.0) {
            true => norm(&(inverse * &off)),
            false => f64::INFINITY,
        }
    });
    [of_part(&|_| 1.0), of_part(&|i| row_scale[i]), of_part(&|i| 1.0 / n[(i, i)])]
        .into_iter()
        .fold(of_comparison, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between two bounds: every choice of places is tried, and one is right.
    #[test]
    fn box_problems_have_the_one_solution_of_enumeration() {
        let size = 4;
        let wave = |k: f64| (12.9898 * k).sin() * 437.585 % 1.0;
        for case in 0..200 {
            let c = f64::from(case);
            let n = DMatrix::from_fn(size, size, |i, j| match i == j {
                true => 2.0,
                false => 0.6 * wave(c + 0.37 * (size * i + j) as f64),
            });
            let q: Vec<f64> = (0..size).map(|i| 3.0 * wave(c + 7.1 + i as f64)).collect();
            let upper: Vec<f64> = (0..size)
                .map(|i| if i == 3 { f64::INFINITY } else { 0.2 + wave(c + 3.3 * i as f64).abs() })
                .collect();
            let scale: Vec<f64> = q.iter().map(|x| x.abs()).collect();
            let all = [Side::Front, Side::Free, Side::Behind];
            let start: Vec<Side> = (0..size).map(|i| all[(case as usize + i) % 2]).collect();
            let coupling = Coupling::from(n.clone());
            let bounds = Bounds { count: size, upper: &upper };
            let found = solve_between(&coupling, (&q, &scale), bounds, &start).unwrap();
            let mut right = vec![];
            for code in 0..81 {
                let places: Vec<Side> = (0..4).map(|i| all[code / 3usize.pow(i) % 3]).collect();
                if places[3] == Side::Behind {
                    continue;
                }
                let free: Vec<usize> = (0..4).filter(|i| places[*i] == Side::Free).collect();
                let mut w = nalgebra::DVector::from_fn(4, |i, _| match places[i] {
                    Side::Behind => upper[i],
                    _ => 0.0,
                });
                let rest = &n * &w;
                if !free.is_empty() {
                    let block =
                        DMatrix::from_fn(free.len(), free.len(), |a, b| n[(free[a], free[b])]);
                    let rhs = DMatrix::from_fn(free.len(), 1, |a, _| -q[free[a]] - rest[free[a]]);
                    let x = block.try_inverse().unwrap() * rhs;
                    free.iter().enumerate().for_each(|(a, &i)| w[i] = x[a]);
                }
                let p = &n * &w + nalgebra::DVector::from_column_slice(&q);
                let fits = |i: usize| match places[i] {
                    Side::Front => p[i] >= 0.0,
                    Side::Behind => p[i] <= 0.0,
                    Side::Free => w[i] >= 0.0 && w[i] <= upper[i],
                };
                if (0..4).all(fits) {
                    right.push((places, w, p));
                }
            }
            assert_eq!(right.len(), 1, "case {case}");
            let (places, w, p) = &right[0];
            assert_eq!(&found.places, places);
            for i in 0..4 {
                assert!((found.w[i] - w[i]).abs() < 1e-13);
                let exact = if places[i] == Side::Free { 0.0 } else { p[i] };
                assert!((found.p[i] - exact).abs() < 1e-13);
            }
        }
    }

    /// What is proved of large matrices holds for every set that is tried.
    #[test]
    fn couplings_stay_below_their_bound() {
        let size = 12;
        let wave = |i: usize, j: usize| (1.3 * i as f64 + 2.1 * (j * j) as f64).sin();
        for (strength, area) in [(0.05, 1.0), (0.12, 3.0), (0.3, 0.2)] {
            let n = DMatrix::from_fn(size, size, |i, j| match i == j {
                true => 2.0 + 0.5 * wave(i, i),
                false => strength * wave(i, j),
            });
            let areas: Vec<f64> = (0..size).map(|i| 1.0 + area * (i % 3) as f64).collect();
            let bound = coupling_bound(&n.clone().into(), &areas);
            let mut largest = 0.0f64;
            for set in 1..(1u32 << size) - 1 {
                let (closed, free): (Vec<usize>, Vec<usize>) =
                    (0..size).partition(|i| set >> i & 1 == 1);
                let inner = DMatrix::from_fn(free.len(), free.len(), |a, b| n[(free[a], free[b])]);
                let outer =
                    DMatrix::from_fn(free.len(), closed.len(), |a, b| n[(free[a], closed[b])]);
                let x = inner.try_inverse().unwrap() * outer;
                largest = largest.max(x.singular_values().max());
            }
            assert!(largest <= bound && bound < 20.0, "{largest} {bound}");
            // of a part of it all sets are gone through
            let part = n.view((0, 0), (6, 6)).into_owned();
            assert!(coupling_bound(&part.clone().into(), &areas[..6]) <= bound);
        }
        assert_eq!(coupling_bound(&DMatrix::identity(3, 3).into(), &[1.0; 3]), 0.0);
    }

    #[test]
    fn zeros_are_exact_and_warm_start_needs_no_pivot() {
        let n = DMatrix::from_row_slice(3, 3, &[2.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 2.0]);
        let q = [-1.0, 0.5, 3.0];
        let s = solve(&n.clone().into(), &q, &[1.0, 0.5, 3.0], &[false; 3]).unwrap();
        for i in 0..3 {
            assert!(if s.active[i] { s.w[i] == 0.0 } else { s.p[i] == 0.0 });
        }
        assert!(residual(&n, &q, &s.w) < 1e-15);
        let again = solve(&n.clone().into(), &q, &[1.0, 0.5, 3.0], &s.active).unwrap();
        assert_eq!((again.pivots, &again.active), (0, &s.active));
    }

    #[test]
    fn degenerate_indices_are_named() {
        let n = DMatrix::<f64>::identity(2, 2);
        let s = solve(&n.into(), &[0.0, -1.0], &[1.0, 1.0], &[true, false]).unwrap();
        assert_eq!(s.degenerate, vec![0]);
    }

    /// What is zero to rounding stays where it stands, whichever way it is met; only what has bounds is kept within them.
    #[test]
    fn rounding_moves_nothing() {
        let one = DMatrix::<f64>::identity(2, 2);
        for touching in [true, false] {
            let found = solve(&one.clone().into(), &[0.0, -1.0], &[1.0; 2], &[touching, false]);
            let found = found.unwrap();
            assert_eq!((found.active, found.pivots), (vec![touching, false], 0));
        }
        let bounds = |count, upper| Bounds { count, upper };
        let within = |q: &[f64], b: Bounds, start: &[Side]| {
            let sizes: Vec<f64> = q.iter().map(|q| q.abs().max(1.0)).collect();
            let n = DMatrix::<f64>::identity(q.len(), q.len());
            solve_between(&n.into(), (q, &sizes), b, start).unwrap()
        };
        // the second has no bound, the first is above its own by rounding
        let found = within(&[1e-17, 2.0], bounds(1, &[]), &[Side::Free; 2]);
        assert_eq!(found.w, [0.0, -2.0]);
        // at the bound behind, pressed against it or not, and found free there
        let pressed = within(&[-3.0], bounds(1, &[2.0]), &[Side::Behind]);
        assert_eq!((pressed.p, pressed.degenerate), (vec![-1.0], vec![]));
        for start in [Side::Behind, Side::Free] {
            let touches = within(&[-2.0], bounds(1, &[2.0]), &[start]);
            assert_eq!(touches.places, [start]);
            assert_eq!(touches.degenerate, [(0, Side::Behind)]);
        }
    }

    /// Displacements are judged by the pressures that they would make: 1e-10 is much where the stiffness is 1e8.
    #[test]
    fn small_displacements_of_stiff_bodies_are_told_apart() {
        let n: Coupling = DMatrix::from_element(1, 1, 1e8).into();
        let between = |q: f64, upper: f64, start: Side| {
            let bounds = Bounds { count: 1, upper: &[upper] };
            solve_between(&n, (&[q], &[q.abs()]), bounds, &[start]).unwrap()
        };
        let free = between(-1e-2, 2e-10, Side::Free);
        assert_eq!((free.places, free.degenerate), (vec![Side::Free], vec![]));
        let behind = between(-3e-2, 2e-10, Side::Free);
        assert_eq!(behind.places, [Side::Behind]);
        assert!((behind.p[0] + 1e-2).abs() < 1e-15);
        let front = between(1e-2, 2e-10, Side::Free);
        assert_eq!((front.places, front.p), (vec![Side::Front], vec![1e-2]));
    }

    /// All that stand wrong change sides at once; a matrix that is none of ours ends at the limit.
    #[test]
    fn pivots_are_few_and_have_a_limit() {
        let size = 60;
        let all = solve(
            &DMatrix::identity(size, size).into(),
            &vec![-1.0; size],
            &vec![1.0; size],
            &vec![true; size],
        );
        assert_eq!(all.unwrap().pivots, 1);
        // an obstacle under a string: the part that touches shrinks from both sides
        let string = DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        let q: Vec<f64> = (0..size).map(|i| 0.02 * ((i as f64) * 0.11).cos()).collect();
        let s = solve(&string.clone().into(), &q, &vec![0.02; size], &vec![false; size]).unwrap();
        assert!(residual(&string, &q, &s.w) < 1e-12 && s.pivots < 12, "{}", s.pivots);
        let no = DMatrix::from_row_slice(1, 1, &[-1.0]);
        let limit = Err(LcpError::PivotLimit { pivots: 70 });
        assert_eq!(solve(&no.into(), &[-1.0], &[1.0], &[false]), limit);
    }

    #[test]
    fn the_residual_is_a_displacement() {
        let n = DMatrix::from_element(1, 1, 4.0);
        assert_eq!(residual(&n, &[-4.0], &[0.0]), 1.0);
        assert_eq!(residual(&n, &[-4.0], &[1.5]), 0.5);
        assert_eq!(residual(&n, &[-4.0], &[1.0]), 0.0);
    }

    /// `⟨N⟩⁻¹`, and the bounds of gaps and pressures made of it, against a dense inverse; in any unit.
    #[test]
    fn comparison_matrices_bound_gaps_and_pressures() {
        for unit in [1.0f64, 1e10, 1e-10] {
            let rows = [3.0, -1.0, 0.5, 0.2, 2.0, 0.7, -0.9, 0.3, 4.0].map(|x: f64| x * unit);
            let n = DMatrix::from_row_slice(3, 3, &rows);
            let dense = DMatrix::from_fn(3, 3, |i, j| match i == j {
                true => n[(i, i)],
                false => -n[(i, j)].abs(),
            });
            let inverse = dense.try_inverse().unwrap();
            let coupling = Coupling::from(n.clone());
            let comparison = ComparisonMatrix::of(&coupling).unwrap();
            let x = nalgebra::DVector::from_column_slice(&[1.0, 2.0, 5.0]);
            let near = |a: &[f64], b: &nalgebra::DVector<f64>| {
                a.len() == 3 && a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < 1e-13)
            };
            assert!(near(&comparison.solve(x.as_slice().to_vec()), &(&inverse * &x)));
            let transposed = comparison.solve_transposed(x.as_slice().to_vec());
            assert!(near(&transposed, &(inverse.transpose() * &x)));
            let [gap, pressure] = comparison.follow(&coupling, x.as_slice().to_vec());
            let gaps = &inverse * &x;
            let of_others = |i: usize| {
                let others = (0..3).filter(|j| *j != i);
                others.map(|j| n[(i, j)].abs() * gaps[j]).sum::<f64>()
            };
            let pressures = nalgebra::DVector::from_fn(3, |i, _| x[i] + of_others(i));
            assert!(near(&gap, &gaps) && near(&pressure, &pressures));
        }
        for diagonal in [0.0, -1.0] {
            let no = DMatrix::from_row_slice(2, 2, &[diagonal, 0.0, 0.0, 1.0]);
            assert!(ComparisonMatrix::of(&no.into()).is_none());
        }
        let ruled = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 1.0, 1.0]);
        assert!(ComparisonMatrix::of(&ruled.into()).is_none());
    }

    /// In any unit, rows scaled or not, small and large.
    #[test]
    fn what_a_matrix_is_knows_no_units() {
        let block =
            |rows: [f64; 4], unit: f64| DMatrix::from_row_slice(2, 2, &rows.map(|x| x * unit));
        for unit in [1e-10, 1.0, 1e10] {
            let of = |rows, scale: &[f64]| p_matrix(&block(rows, unit).into(), scale);
            assert_eq!(of([1.0, -3.0, 0.0, 1.0], &[1.0; 2]), PMatrix::HMatrix);
            assert_eq!(of([1.0, -3.0, 0.5, 1.0], &[1.0; 2]), PMatrix::Minors);
            // definite once its rows are scaled
            assert_eq!(of([1.0, 0.9, 0.9e-4, 1e-4], &[1.0, 1e4]), PMatrix::PositiveDefinite);
            assert_eq!(of([1.0, 0.9, 0.9, 1.0], &[1.0, 1e-4]), PMatrix::PositiveDefinite);
            // singular but for rounding
            let near = 1.0 - 1e-14;
            let singular = of([1.0, near, near, 1.0], &[1.0; 2]);
            assert!(matches!(singular, PMatrix::NotShown { .. }), "{unit}");
        }
        let of_blocks = |count: usize| {
            let inner = block([1.0, -3.0, 0.5, 1.0], 1.0);
            DMatrix::from_fn(2 * count, 2 * count, |i, j| match i / 2 == j / 2 {
                true => inner[(i % 2, j % 2)],
                false => 0.0,
            })
        };
        assert_eq!(p_matrix(&of_blocks(7).into(), &[1.0; 14]), PMatrix::Minors);
        assert!(matches!(p_matrix(&of_blocks(8).into(), &[1.0; 16]), PMatrix::NotShown { .. }));
    }

    /// The same of large matrices that are mostly zero.
    #[test]
    fn sparse_matrices_are_told_apart() {
        let size = 80;
        let band = |below: f64, diagonal: &dyn Fn(usize) -> f64, above: f64| {
            let row = |i: usize| {
                let below = i.checked_sub(1).map(|j| (i, j, below * diagonal(i)));
                let above = (i + 1 < size).then(|| (i, i + 1, above * diagonal(i)));
                [Some((i, i, diagonal(i))), below, above].into_iter().flatten()
            };
            Coupling::from(Csr::from_triplets(size, size, (0..size).flat_map(row).collect()))
        };
        let even = |_: usize| 3.0;
        let steep = |i: usize| if i.is_multiple_of(2) { 3.0 } else { 3e-4 };
        let ones = vec![1.0; size];
        let areas: Vec<f64> = (0..size).map(|i| 3.0 / steep(i)).collect();
        let definite = band(0.49, &even, 0.49);
        assert!(definite.is_sparse());
        assert_eq!(p_matrix(&definite, &ones), PMatrix::PositiveDefinite);
        assert_eq!(p_matrix(&definite, &areas), PMatrix::PositiveDefinite);
        // one below the margin: 2 cos(π/81)·½ leaves 8e-4 of the diagonal; more than half leaves nothing
        assert_eq!(p_matrix(&band(0.5, &even, 0.5), &ones), PMatrix::PositiveDefinite);
        assert!(matches!(p_matrix(&band(0.51, &even, 0.51), &ones), PMatrix::NotShown { .. }));
        assert_eq!(p_matrix(&band(0.49, &steep, 0.49), &areas), PMatrix::PositiveDefinite);
        // no symmetric part is definite
        let row = |i: usize| {
            let above = i.is_multiple_of(2).then(|| (i, i + 1, -9.0));
            [Some((i, i, 3.0)), above].into_iter().flatten()
        };
        let ruled = Csr::from_triplets(size, size, (0..size).flat_map(row).collect());
        assert_eq!(p_matrix(&ruled.into(), &ones), PMatrix::HMatrix);
        // the row that its diagonal rules least
        let weak = |i: usize| if i == 33 { 3.0 } else { 1.0 };
        let row = |i: usize| {
            let others = [i.checked_sub(1), (i + 1 < size).then_some(i + 1)];
            let beside = others.into_iter().flatten().map(move |j| (i, j, 0.7 * weak(i)));
            beside.chain([(i, i, 1.0)])
        };
        let entries = (0..size).flat_map(row).collect();
        let no = Coupling::from(Csr::from_triplets(size, size, entries));
        assert_eq!(p_matrix(&no, &ones), PMatrix::NotShown { index: 33 });
    }

    /// Bounds in closed form: each of them where the others have none.
    #[test]
    fn couplings_are_bounded_as_in_closed_form() {
        let size = 12;
        // 2 + ½ off the diagonal: ‖off‖ = 5.5, the least eigenvalue 1.5; no H-matrix
        let full = DMatrix::from_fn(size, size, |i, j| if i == j { 2.0 } else { 0.5 });
        let ones = vec![1.0; size];
        let scaled =
            |f: &dyn Fn(usize) -> f64| DMatrix::from_fn(size, size, |i, j| f(i) * full[(i, j)]);
        let steep = |i: usize| 10f64.powi(i as i32 % 4);
        let inverse: Vec<f64> = (0..size).map(|i| 1.0 / steep(i)).collect();
        for (n, scale) in
            [(full.clone(), &ones), (scaled(&steep), &ones), (scaled(&steep), &inverse)]
        {
            let bound = coupling_bound(&n.into(), scale);
            assert!((bound / (5.5 / 1.5) - 1.0).abs() < 1e-12, "{bound}");
        }
        // triangular: ⟨N⟩⁻¹ is a finite sum of powers, no symmetric part is definite
        let off = DMatrix::from_fn(size, size, |i, j| if j == i + 1 { 3.0 } else { 0.0 });
        let n = DMatrix::identity(size, size) - &off;
        let (mut sum, mut power) = (DMatrix::<f64>::identity(size, size), off.clone());
        while power.norm() > 0.0 {
            sum += &power;
            power *= &off;
        }
        let bound = coupling_bound(&n.into(), &ones);
        assert!((bound / (sum * &off).singular_values().max() - 1.0).abs() < 1e-12, "{bound}");
        // neither
        let no = DMatrix::from_fn(size, size, |i, j| if i == j { 1.0 } else { 2.0 });
        assert_eq!(coupling_bound(&no.into(), &ones), f64::INFINITY);
        // few points: all sets, not a bound of them
        let few = full.view((0, 0), (10, 10)).into_owned();
        let bound = coupling_bound(&few.into(), &ones[..10]);
        assert!(bound < 0.9 * 4.5 / 1.5, "{bound}");
    }

    #[test]
    fn p_matrices_are_told_from_others() {
        assert_eq!(p_matrix(&DMatrix::identity(3, 3).into(), &[1.0; 3]), PMatrix::PositiveDefinite);
        // a P-matrix whose symmetric part is indefinite: triangular, so an H-matrix
        let p = DMatrix::from_row_slice(2, 2, &[1.0, -3.0, 0.0, 1.0]);
        assert_eq!(p_matrix(&p.clone().into(), &[1.0; 2]), PMatrix::HMatrix);
        // singular, and its comparison matrix too: rounding decides nothing
        let rows = [1.0, -0.3, -0.7, -0.7, 1.0, -0.3, -0.3, -0.7, 1.0];
        let p = DMatrix::from_row_slice(3, 3, &rows);
        assert!(matches!(p_matrix(&p.clone().into(), &[1.0; 3]), PMatrix::NotShown { .. }));
        // one that is neither
        let p = DMatrix::from_row_slice(2, 2, &[1.0, -3.0, 0.5, 1.0]);
        assert_eq!(p_matrix(&p.clone().into(), &[1.0; 2]), PMatrix::Minors);
        let no = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        assert!(matches!(p_matrix(&no.clone().into(), &[1.0; 2]), PMatrix::NotShown { .. }));
    }

    /// What touches without a pressure is there to rounding alone, and rows of very different sizes bring more of it into one another than each has of its own: no basis is
    /// right to the last digit, and the search goes round among them.
    #[test]
    fn bases_that_come_back_are_told_apart_by_rounding() {
        let size = 12;
        let wave = |k: f64| (12.9898 * k).sin() * 43758.5453 % 1.0;
        for case in 0..2000 {
            let c = f64::from(case);
            let a = DMatrix::from_fn(size, size, |i, j| wave(c + 0.377 * (size * i + j) as f64));
            let scale = |i: usize| 10f64.powf(1.8 * (1.0 + wave(1.3 * c + 0.71 * i as f64)));
            let spd = a.transpose() * &a + DMatrix::identity(size, size) * 0.1;
            let n = DMatrix::from_fn(size, size, |i, j| scale(i) * spd[(i, j)] * scale(j));
            // a third touches without a pressure, a third is pressed, a third is free
            let exact = |i: usize, what: usize| match i % 3 == what {
                true => 0.1 + wave(c + 5.1 * i as f64).abs(),
                false => 0.0,
            };
            let w: Vec<f64> = (0..size).map(|i| exact(i, 1) / scale(i)).collect();
            let product = |i: usize, f: &dyn Fn(f64) -> f64| -> f64 {
                (0..size).map(|j| f(n[(i, j)] * w[j])).sum()
            };
            let p = |i: usize| exact(i, 2) * scale(i);
            let q: Vec<f64> = (0..size).map(|i| p(i) - product(i, &|x| x)).collect();
            let sizes: Vec<f64> = (0..size).map(|i| p(i) + product(i, &f64::abs)).collect();
            for start in [[false; 12], [true; 12]] {
                let found = solve(&n.clone().into(), &q, &sizes, &start);
                let found = found.unwrap_or_else(|e| panic!("case {case}: {e}"));
                for i in 0..size {
                    let off = (found.w[i] - w[i]).abs() * scale(i);
                    assert!(off < 1e-9, "case {case}: {off:e}");
                }
            }
        }
    }

    #[test]
    fn not_a_p_matrix_ends_with_an_error() {
        let n = DMatrix::from_row_slice(1, 1, &[-1.0]);
        assert!(solve(&n.into(), &[-1.0], &[1.0], &[false]).is_err());
    }
}
