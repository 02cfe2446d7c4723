//! What an earlier run left of a family, and whether it is all that is asked for.

use std::collections::BTreeSet;

use super::sweep::Sweep;
use super::{Asked, Legs};
use crate::records::{
    Branch, BranchEnd, Direction, EndReason, PlaceRecord, PointKind, PointRecord, Walk,
};
use crate::store::FamilyPlan;

/// What an earlier run left.
#[derive(Debug, Default)]
pub struct Known {
    points: Vec<PointRecord>,
    ends: Vec<BranchEnd>,
}

impl Known {
    /// Of an earlier run's points and ends of branches those that stand.
    pub(super) fn standing(
        asked: &Asked,
        plan: &FamilyPlan,
        points: Vec<PointRecord>,
        ends: Vec<BranchEnd>,
    ) -> Known {
        match plan.identity.walk {
            // all harmonics of a frequency belong together: the ladder begins anew at each
            Walk::Grid(_) => Known { points: on_grid(plan, points, true), ends },
            Walk::Response(_) => Known { points: on_grid(plan, points, false), ends },
            Walk::Branch { .. } | Walk::Upwards { .. } => along(asked, plan, &points, &ends),
            Walk::Sweep { .. } => {
                let points = swept(plan, points);
                along(asked, plan, &points, &ends)
            }
            Walk::Given | Walk::Amplitudes { .. } => Known { points, ends },
        }
    }

    /// Whether nothing of what is asked for is missing.
    pub(super) fn is_whole(&self, asked: &Asked, plan: &FamilyPlan) -> bool {
        let range = (plan.range[0], plan.range[1]);
        plan.branches.iter().enumerate().all(|(k, branch)| match plan.identity.walk {
            Walk::Grid(grid) => Legs::new(grid, range, false, &self.branch(k)).is_empty(),
            Walk::Response(grid) => {
                let downwards = branch.direction() == Some(Direction::Down);
                Legs::new(grid, range, downwards, &self.branch(k)).is_empty()
            }
            Walk::Branch { .. } | Walk::Upwards { .. } | Walk::Sweep { .. } => {
                self.end(k).is_some()
            }
            Walk::Given | Walk::Amplitudes { .. } => self.len() == asked.points,
        })
    }

    /// All points, as they were found.
    pub fn points(&self) -> &[PointRecord] {
        &self.points
    }

    /// The points of a branch, in the order of the walk.
    pub fn branch(&self, branch: usize) -> Vec<&PointRecord> {
        let mut points: Vec<&PointRecord> =
            self.points.iter().filter(|p| p.branch == branch).collect();
        points.sort_by_key(|p| p.index);
        points
    }

    /// All points, in the order of the walk.
    pub fn all(&self) -> Vec<&PointRecord> {
        let mut points: Vec<&PointRecord> = self.points.iter().collect();
        points.sort_by_key(|p| (p.index, p.branch));
        points
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// How a branch ended, if it did.
    pub fn end(&self, branch: usize) -> Option<&BranchEnd> {
        self.ends.iter().find(|e| e.branch == branch)
    }
}

/// Points of a branch as they are counted where it ends at a number of them: the start is none.
pub(super) fn count<'p>(points: impl IntoIterator<Item = &'p PointRecord>) -> usize {
    points.into_iter().filter(|p| p.special != PointKind::Start).count()
}

/// The last place of a branch to go on from.
pub(super) fn last_place<'p>(points: &[&'p PointRecord]) -> Option<&'p PlaceRecord> {
    points.iter().rev().find_map(|p| p.place.as_ref())
}

/// Points on a grid: the longest run without a hole, of all branches together where they are computed `at_once`.
fn on_grid(plan: &FamilyPlan, mut points: Vec<PointRecord>, at_once: bool) -> Vec<PointRecord> {
    let of_branch = |b: usize| points.iter().filter(|p| p.branch == b).map(|p| p.index).collect();
    let mut kept: Vec<BTreeSet<i64>> = (0..plan.branches.len()).map(of_branch).collect();
    if at_once {
        let first = kept.first().cloned().unwrap_or_default();
        let all = without_holes(&kept.iter().skip(1).fold(first, |a, b| &a & b));
        kept.iter_mut().for_each(|k| k.clone_from(&all));
    } else {
        kept.iter_mut().for_each(|k| *k = without_holes(k));
    }
    points.retain(|p| kept.get(p.branch).is_some_and(|k| k.contains(&p.index)));
    points
}

/// The longest run of successive numbers that holds the first one (they are counted from 0).
fn without_holes(all: &BTreeSet<i64>) -> BTreeSet<i64> {
    let Some(first) = all.iter().min_by_key(|k| k.abs()).copied() else { return BTreeSet::new() };
    let up = (first..).take_while(|k| all.contains(k));
    let down = (1..).map(|d| first - d).take_while(|k| all.contains(k));
    up.chain(down).collect()
}

/// Points of sweeps that begin where they are asked to: what a body does depends on where it comes from.
fn swept(plan: &FamilyPlan, mut points: Vec<PointRecord>) -> Vec<PointRecord> {
    let Walk::Sweep { grid, dwell } = plan.identity.walk else {
        return points;
    };
    let begins = |(k, branch): (usize, &Branch)| {
        let direction = branch.direction()?;
        let range = (plan.range[0], plan.range[1]);
        let sweep = Sweep { grid, range, direction, dwell };
        let first = points.iter().filter(|p| p.branch == k).min_by_key(|p| p.index)?;
        Some(sweep.begins(first))
    };
    let stands: Vec<bool> =
        plan.branches.iter().enumerate().map(|b| begins(b).unwrap_or(true)).collect();
    points.retain(|p| stands.get(p.branch).copied().unwrap_or(false));
    points
}

/// Points of branches that are followed: whole steps, up to the last place; all of them where the branch has ended.
fn along(asked: &Asked, plan: &FamilyPlan, points: &[PointRecord], ends: &[BranchEnd]) -> Known {
    let mut known = Known::default();
    for branch in 0..plan.branches.len() {
        let mut own: Vec<PointRecord> =
            points.iter().filter(|p| p.branch == branch).cloned().collect();
        own.sort_by_key(|p| p.index);
        let end = ends.iter().find(|e| e.branch == branch).filter(|e| match e.reason {
            EndReason::Range => own.last().is_some_and(|p| {
                plan.range.iter().any(|bound| (p.omega - bound).abs() <= 1e-9 * bound)
            }),
            EndReason::Points => count(&own) >= asked.points,
            EndReason::Lost | EndReason::Met => true,
            EndReason::Interrupted => false,
        });
        if end.is_none() {
            // special points of a step that was not finished come again, and so does the end of a narrower range
            let last = own.iter().rposition(|p| p.place.is_some());
            own.truncate(last.map_or(0, |k| k + 1));
        }
        known.ends.extend(end.cloned());
        known.points.extend(own);
    }
    known
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_holes_holds_the_number_nearest_to_the_origin() {
        let run = |all: &[i64]| without_holes(&all.iter().copied().collect());
        assert_eq!(run(&[-3, -1, 0, 1, 2, 4]), [-1, 0, 1, 2].into());
        assert_eq!(run(&[5, 6, 8]), [5, 6].into());
        assert!(run(&[]).is_empty());
    }
}
