//! What became of the points, by number of harmonics.

use std::collections::BTreeMap;

use crate::records::{CheckRow, VerdictKind};

/// What the cross-check of one number of harmonics gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// Number of harmonics.
    pub n_h: usize,
    /// Number of points.
    pub points: usize,
    /// How many of them led to the orbit that they approximate: near, and of the same switches.
    pub orbits: usize,
    /// How many led to another orbit.
    pub others: usize,
    /// The other verdicts, and how often each was given.
    pub verdicts: BTreeMap<VerdictKind, usize>,
    /// Median relative distance to the orbit, this one or another; NaN: there is none.
    pub median_moved: f64,
    /// Median residual in time of all points.
    pub median_residual: f64,
}

/// The median; what is no number is worse than any (a point that failed must not flatter the others).
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.map(|v| if v.is_nan() { f64::INFINITY } else { v }).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

pub(super) fn of_harmonics(rows: &[CheckRow], n_h: usize) -> impl Iterator<Item = &CheckRow> {
    rows.iter().filter(move |r| r.n_h == n_h)
}

/// The numbers of a cross-check, ascending by harmonics.
pub(crate) fn by_harmonics(rows: &[CheckRow]) -> Vec<Tally> {
    let mut harmonics: Vec<usize> = rows.iter().map(|r| r.n_h).collect();
    harmonics.sort_unstable();
    harmonics.dedup();
    let tally = |n_h: usize| {
        let of = || of_harmonics(rows, n_h);
        let orbits = || of().filter(|r| r.has_orbit());
        let mut verdicts = BTreeMap::new();
        for row in of().filter(|r| !r.has_orbit()) {
            *verdicts.entry(row.verdict.clone()).or_default() += 1;
        }
        Tally {
            n_h,
            points: of().count(),
            orbits: of().filter(|r| r.is_orbit()).count(),
            others: of().filter(|r| r.verdict == VerdictKind::AnotherOrbit).count(),
            verdicts,
            median_moved: median(orbits().map(|r| r.moved)),
            median_residual: median(of().map(|r| r.residual)),
        }
    };
    harmonics.into_iter().map(tally).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tally_counts_verdicts_and_takes_medians() {
        let row = |verdict: VerdictKind, moved: f64, same_sequence: bool| CheckRow {
            omega: 1.0,
            n_h: 3,
            energy: 1.0,
            residual: 0.5,
            return_error: 0.1,
            verdict,
            message: String::new(),
            moved,
            orbit_energy: 1.0,
            contact_change: 0.0,
            same_sequence,
        };
        let rows = [
            row(VerdictKind::Orbit, 0.1, true),
            row(VerdictKind::AnotherOrbit, 0.3, false),
            row(VerdictKind::AnotherOrbit, 0.2, true),
            row(VerdictKind::Fold, f64::NAN, false),
        ];
        let [t] = &by_harmonics(&rows)[..] else { panic!("one number of harmonics") };
        assert_eq!((t.n_h, t.points, t.orbits, t.others), (3, 4, 1, 2));
        assert_eq!((t.median_moved, t.median_residual), (0.2, 0.5));
        assert_eq!(t.verdicts.get(&VerdictKind::Fold), Some(&1));
    }
}
