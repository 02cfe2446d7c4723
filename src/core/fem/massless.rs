//! Motions without mass of a singular mass matrix: `M z = 0`. Programs that integrate the mass with few points leave some behind, each over a few elements.
//!
//! Elimination with `M = L D Lᵀ` meets a pivot `d_p = 0` for each of them. With such pivots replaced by a `δ`,
//!
//! ```text
//! M + Σ_p δ e_p e_pᵀ      z_p = δ (M + Σ_q δ e_q e_qᵀ)⁻¹ e_p:      M z_p = 0,   z_p,q = δ_pq
//! ```
//!
//! so that `u = y + Σ_p z_p b_p` with `y_p = 0` splits any displacement.

use std::collections::BTreeMap;

use faer::linalg::cholesky::ldlt::factor::LdltRegularization;

use super::FemError;
use super::factor::SpdFactor;
use super::simplicial::ldl_pivots;
use super::sparse::Csr;

/// A motion without mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Massless {
    /// The entry that is 1 in this one, and 0 in all others.
    pub pivot: usize,
    /// Its other entries.
    pub others: Vec<(usize, f64)>,
}

/// Pivots of the mass, scaled to a unit diagonal, that are none: matrices in text have 13 digits.
const NONE: f64 = 1e-9;

/// Entries of a motion that are rounding, over its largest.
const ROUNDING: f64 = 1e-8;

const WHAT: &str = "mass matrix";

/// The motions without mass among rows that have some, of a positive semidefinite matrix.
pub fn motions_without_mass(mass: &Csr) -> Result<Vec<Massless>, FemError> {
    let n = mass.n_rows();
    let failed = || FemError::NotPositiveDefinite { what: WHAT };
    let diagonal: Vec<f64> = (0..n).map(|i| mass.entry(i, i).copied().unwrap_or(0.0)).collect();
    let rows: Vec<usize> = (0..n).filter(|&i| mass.row(i).any(|e| e.1 != 0.0)).collect();
    if rows.iter().any(|&i| diagonal[i].is_nan() || diagonal[i] <= 0.0) {
        return Err(failed());
    }
    let mut place = vec![usize::MAX; n];
    rows.iter().enumerate().for_each(|(k, &i)| place[i] = k);
    let scaled = |shift: f64| {
        let of = |(i, j, v): (usize, usize, f64)| {
            let size = diagonal[i].sqrt() * diagonal[j].sqrt();
            (place[i], place[j], v / size - if i == j { shift } else { 0.0 })
        };
        let entries = mass.triplets().filter(|e| e.2 != 0.0).map(of).collect();
        Csr::from_triplets(rows.len(), rows.len(), entries)
    };
    // most matrices are definite by far
    if SpdFactor::new(&scaled(NONE), WHAT).is_ok() {
        return Ok(vec![]);
    }
    let matrix = scaled(0.0);
    let pivots = lost_pivots(&matrix)?;
    if pivots.is_empty() {
        return Ok(vec![]);
    }
    let own = pivots.iter().map(|&p| (p, p, 1.0));
    let count = rows.len();
    let lifted = Csr::from_triplets(count, count, matrix.triplets().chain(own).collect());
    let factor = SpdFactor::new(&lifted, WHAT)?;
    let mut scratch = factor.scratch_of(1);
    let mut all = vec![];
    let (mut z, mut without) = (vec![0.0; count], vec![0.0; count]);
    for &p in &pivots {
        z.fill(0.0);
        z[p] = 1.0;
        factor.solve(&mut z, &mut scratch);
        matrix.mul(&z, &mut without);
        // it is one of negative mass
        if (z[p] - 1.0).abs() > 1e-6 || without.iter().any(|x| x.abs() > 1e-7) {
            return Err(failed());
        }
        // in the unscaled displacements, with a one at the pivot
        let unscaled = |k: usize| z[k] / z[p] * (diagonal[rows[p]] / diagonal[rows[k]]).sqrt();
        let others = (0..count).filter(|k| z[*k].abs() > ROUNDING && !pivots.contains(k));
        let others = others.map(|k| (rows[k], unscaled(k))).collect();
        all.push(Massless { pivot: rows[p], others });
    }
    Ok(all)
}

/// The same motions with pivots that are none of some rows, but for motions that move nothing else: these come last.
pub fn standing_beside(all: Vec<Massless>, rows: &[usize]) -> Vec<Massless> {
    type Motion = BTreeMap<usize, f64>;
    let whole = |m: Massless| m.others.into_iter().chain([(m.pivot, 1.0)]).collect();
    let mut waiting: Vec<Motion> = all.into_iter().map(whole).collect();
    let (mut done, mut alone): (Vec<(usize, Motion)>, Vec<Motion>) = (vec![], vec![]);
    loop {
        // those that move nothing else have their turn when all others have had it
        let all_rows = waiting.is_empty();
        let next = if all_rows { alone.pop() } else { waiting.pop() };
        let Some(mut motion) = next else { break };
        let size = motion.values().fold(0.0f64, |m, z| m.max(z.abs()));
        let own = motion.iter().filter(|e| all_rows || !rows.contains(e.0));
        let largest = own.map(|(i, z)| (*i, *z)).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let Some((pivot, z)) = largest.filter(|e| e.1.abs() > ROUNDING * size) else {
            if !all_rows {
                alone.push(motion);
            }
            continue;
        };
        motion.values_mut().for_each(|x| *x /= z);
        let others = waiting.iter_mut().chain(&mut alone).chain(done.iter_mut().map(|d| &mut d.1));
        for other in others {
            let Some(share) = other.remove(&pivot) else { continue };
            let size = other.values().fold(share.abs(), |m, z| m.max(z.abs()));
            for (&i, z) in motion.iter().filter(|e| *e.0 != pivot) {
                *other.entry(i).or_insert(0.0) -= share * z;
            }
            other.retain(|_, z| z.abs() > ROUNDING * ROUNDING * size);
        }
        done.push((pivot, motion));
    }
    let motion = |(pivot, mut motion): (usize, Motion)| {
        motion.remove(&pivot);
        Massless { pivot, others: motion.into_iter().collect() }
    };
    done.into_iter().map(motion).collect()
}

/// `u = y + Σ_p z_p b_p` as a matrix, `b_p` in the place of `y_p`.
pub(super) fn split(n: usize, all: &[Massless]) -> Csr {
    let own = (0..n).map(|i| (i, i, 1.0));
    let of = |m: &Massless| m.others.iter().map(|&(i, z)| (i, m.pivot, z)).collect::<Vec<_>>();
    Csr::from_triplets(n, n, own.chain(all.iter().flat_map(of)).collect())
}

/// The pivots that vanish when a matrix with a unit diagonal is eliminated.
fn lost_pivots(a: &Csr) -> Result<Vec<usize>, FemError> {
    let failed = || FemError::NotPositiveDefinite { what: WHAT };
    // a pivot that is none is replaced by one that no other has; what is negative, too, and is no motion without mass then
    let signs = vec![1; a.n_rows()];
    let regularization = LdltRegularization {
        dynamic_regularization_signs: Some(&signs),
        dynamic_regularization_delta: LOST,
        dynamic_regularization_epsilon: NONE,
    };
    let pivots = ldl_pivots(a, regularization).ok_or_else(failed)?;
    let mut lost: Vec<usize> = pivots.iter().filter(|p| p.1 == LOST).map(|p| p.0).collect();
    lost.sort_unstable();
    Ok(lost)
}

/// What stands in place of a pivot that is none: large, as the others are at most one.
const LOST: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;

    /// Masses at few points: `M = Bᵀ B` with fewer rows than columns, some of whose columns have nothing to do with the others.
    fn of_points(n: usize, points: &[Vec<(usize, f64)>]) -> Csr {
        let pairs = |p: &Vec<(usize, f64)>| {
            let of = |a: &(usize, f64)| {
                let a = *a;
                p.iter().map(move |b| (a.0, b.0, a.1 * b.1)).collect::<Vec<_>>()
            };
            p.iter().flat_map(of).collect::<Vec<_>>()
        };
        Csr::from_triplets(n, n, points.iter().flat_map(pairs).collect())
    }

    #[test]
    fn masses_at_few_points_leave_motions_behind() {
        // 8 displacements, five points
        let points: Vec<Vec<(usize, f64)>> = vec![
            vec![(0, 0.5), (1, 0.5), (2, 0.25)],
            vec![(1, 1.0), (3, 2.0)],
            vec![(4, 0.3), (5, 0.7)],
            vec![(5, 100.0), (6, 3.0)],
            vec![(7, 1e-3)],
        ];
        let mass = of_points(8, &points);
        let all = motions_without_mass(&mass).unwrap();
        assert_eq!(all.len(), 3);
        for motion in &all {
            let mut z = [0.0; 8];
            z[motion.pivot] = 1.0;
            motion.others.iter().for_each(|&(i, v)| z[i] = v);
            // no point moves
            for p in &points {
                let moved: f64 = p.iter().map(|&(i, w)| w * z[i]).sum();
                let size: f64 = p.iter().map(|&(i, w)| (w * z[i]).abs()).sum();
                assert!(moved.abs() <= 1e-9 * size.max(1e-12), "{motion:?}");
            }
            assert!(all.iter().all(|m| m.pivot == motion.pivot || z[m.pivot] == 0.0));
        }
        // a row more makes it definite, one of another sign indefinite
        let full = Csr::from_triplets(8, 8, (0..8).map(|i| (i, i, 1.0)).collect());
        assert!(motions_without_mass(&full).unwrap().is_empty());
        let definite = Csr::combination(1.0, &mass, 1e-3, &full);
        assert!(motions_without_mass(&definite).unwrap().is_empty());
        let negative = Csr::combination(1.0, &mass, -1e-2, &full);
        assert!(motions_without_mass(&negative).is_err());
        // other rows may stand for them, or, of what moves these alone, none
        let rows: Vec<usize> = all.iter().map(|m| m.pivot).collect();
        let beside = standing_beside(all.clone(), &rows);
        assert_eq!(beside.len(), 3);
        for motion in &beside {
            assert!(!rows.contains(&motion.pivot));
            let mut z = [0.0; 8];
            z[motion.pivot] = 1.0;
            motion.others.iter().for_each(|&(i, v)| z[i] = v);
            let moved = points.iter().map(|p| p.iter().map(|&(i, w)| w * z[i]).sum::<f64>());
            assert!(moved.map(f64::abs).fold(0.0, f64::max) < 1e-9);
            assert!(beside.iter().all(|m| m.pivot == motion.pivot || z[m.pivot] == 0.0));
        }
        // that of 4, 5 and 6 moves these alone
        let last = standing_beside(all.clone(), &[4, 5, 6]);
        assert_eq!(last.len(), 3);
        assert!(last[..2].iter().all(|m| m.pivot < 4) && last[2].pivot >= 4);
        // rows without any mass are none of its business
        let wider = Csr::from_triplets(9, 9, mass.triplets().collect());
        assert_eq!(motions_without_mass(&wider).unwrap(), all);
    }
}
