//! Two independent solutions of the complementarity problem, for tests and `--verify-lcp`.
//!
//! Enumeration tries every basis; Clarabel minimises `wᵀ(N w + q)` over `w ≥ 0`, `N w + q ≥ 0` (for a symmetric
//! `N` the half of it, whose optimality conditions *are* the problem). Neither shares code with the pivoting.

use crate::fem::largest;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};
use nalgebra::{DMatrix, DVector};

/// All bases of size up to this are tried.
pub(crate) const ENUMERATION_LIMIT: usize = 12;

/// Every solution found by trying all `2^n` bases (one for a P-matrix, but for degenerate data).
pub fn enumerate(n: &DMatrix<f64>, q: &[f64]) -> Vec<Vec<f64>> {
    let size = q.len();
    let mut found: Vec<Vec<f64>> = vec![];
    for basis in 0..1usize << size {
        let free: Vec<usize> = (0..size).filter(|i| basis >> i & 1 == 1).collect();
        let mut w = DVector::<f64>::zeros(size);
        if !free.is_empty() {
            let block = DMatrix::from_fn(free.len(), free.len(), |a, b| n[(free[a], free[b])]);
            let rhs = DVector::from_iterator(free.len(), free.iter().map(|&i| -q[i]));
            let Some(inverse) = block.try_inverse() else { continue };
            let part = inverse * rhs;
            free.iter().zip(part.iter()).for_each(|(&i, &x)| w[i] = x);
        }
        // an unknown without a diagonal is a force: over the stiffness of all it is a length
        let stiffness = n.diagonal().max();
        let scale = |i: usize| if n[(i, i)] > 0.0 { n[(i, i)] } else { 1.0 / stiffness };
        let p = n * &w + DVector::from_column_slice(q);
        // rounding errors of row i are of the order of its terms
        let terms = |i: usize| {
            q[i].abs()
                + (0..size).map(|j| (n[(i, j)] * w[j]).abs()).sum::<f64>()
                + f64::MIN_POSITIVE
        };
        let fits =
            (0..size).all(|i| w[i] * scale(i) >= -1e-10 * terms(i) && p[i] >= -1e-10 * terms(i));
        let same =
            |f: &Vec<f64>| (0..size).all(|i| ((f[i] - w[i]) * scale(i)).abs() <= 1e-8 * terms(i));
        if fits && !found.iter().any(same) {
            found.push(w.as_slice().to_vec());
        }
    }
    found
}

/// The solution by Clarabel's interior-point method, accurate to about 1e-8 of the scale, or `None`
/// if it gives up.
pub fn clarabel(n: &DMatrix<f64>, q: &[f64]) -> Option<Vec<f64>> {
    // rows of very different sizes, as next to an axis of revolution, each by itself
    scaled_clarabel(n, q, false).or_else(|| scaled_clarabel(n, q, true))
}

fn scaled_clarabel(n: &DMatrix<f64>, q: &[f64], by_rows: bool) -> Option<Vec<f64>> {
    let size = q.len();
    // bring rows and unknowns to the order of one
    let stiffness = (0..size).map(|i| n[(i, i)].abs()).fold(0.0, f64::max);
    let off = |i: usize, j: usize| (n[(i, j)] - n[(j, i)]).abs();
    let symmetric = !by_rows && (0..size).all(|i| (0..i).all(|j| off(i, j) <= 1e-14 * stiffness));
    let scale = |i: usize| if by_rows { n[(i, i)].abs() } else { stiffness };
    let scaled = DMatrix::from_fn(size, size, |i, j| n[(i, j)] / scale(i));
    let q: Vec<f64> = q.iter().enumerate().map(|(i, x)| x / scale(i)).collect();
    let force = largest(&q);
    if size == 0 || force == 0.0 {
        return Some(vec![0.0; size]);
    }
    let q: Vec<f64> = q.iter().map(|x| x / force).collect();
    let upper = |i: usize, j: usize| if i <= j { scaled[(i, j)] + scaled[(j, i)] } else { 0.0 };
    let half = if symmetric { 0.5 } else { 1.0 };
    let dense = |rows: usize, f: &dyn Fn(usize, usize) -> f64| {
        let entries = (0..rows).flat_map(|i| (0..size).map(move |j| (i, j)));
        let kept: Vec<(usize, usize, f64)> =
            entries.map(|(i, j)| (i, j, f(i, j))).filter(|e| e.2 != 0.0).collect();
        let (mut rows_of, mut cols, mut values) = (vec![], vec![], vec![]);
        for (i, j, v) in kept {
            rows_of.push(i);
            cols.push(j);
            values.push(v);
        }
        CscMatrix::new_from_triplets(rows, size, rows_of, cols, values)
    };
    let objective = dense(size, &|i, j| half * upper(i, j));
    // constraints A w + s = b, s ≥ 0: −w ≤ 0 and, where the objective alone does not imply it, −N w ≤ q
    let rows = if symmetric { size } else { 2 * size };
    let constraints = dense(rows, &|i, j| match i.checked_sub(size) {
        None => -f64::from(u8::from(i == j)),
        Some(i) => -scaled[(i, j)],
    });
    let mut bound = vec![0.0; size];
    if !symmetric {
        bound.extend_from_slice(&q);
    }
    // the tightest tolerance that the method can still reach
    [1e-12, 1e-10, 1e-8].into_iter().find_map(|tolerance| {
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .tol_gap_abs(tolerance)
            .tol_gap_rel(tolerance)
            .tol_feas(tolerance)
            .build()
            .ok()?;
        let cones = [SupportedConeT::NonnegativeConeT(rows)];
        let mut solver =
            DefaultSolver::new(&objective, &q, &constraints, &bound, &cones, settings).ok()?;
        solver.solve();
        let solved = solver.solution.status == SolverStatus::Solved;
        solved.then(|| solver.solution.x.iter().map(|x| x * force).collect())
    })
}
