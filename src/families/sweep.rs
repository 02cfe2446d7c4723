//! Sweeps: what a forced body does while the frequency of its loads goes up, or down, in small steps. At each the body settles from where it was; where the
//! motion changes between two steps, the change is closed in on from the state before it.

use super::follow::Take;
use super::{FamilyError, ended};
use crate::orbit::attractor::{Attractor, attractor, dwell};
use crate::orbit::branch::record;
use crate::orbit::{OrbitError, Propagator};
use crate::records::{
    AttractorKind, AttractorRecord, BranchEnd, Direction, EndReason, Grid, PlaceRecord, PointKind,
    PointRecord,
};

/// A sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Frequencies; the ends of the range besides.
    pub grid: Grid,
    /// Its least and largest frequency.
    pub range: (f64, f64),
    /// Which way it goes.
    pub direction: Direction,
    /// Periods at each frequency; none: until the body has settled.
    pub dwell: Option<usize>,
}

/// Amplitudes that differ by more, relative, are those of another motion.
const CHANGE: f64 = 0.15;
/// So often the step in which a motion changes is halved.
const HALVINGS: usize = 6;
/// A frequency of the grid this near to an end of the range is that end, over the step.
const SAME: f64 = 1e-6;

impl Sweep {
    /// The frequencies, in the order of the walk.
    pub fn frequencies(&self) -> Vec<f64> {
        let (low, high) = self.range;
        let off = SAME * self.grid.step;
        let inside = self.grid.within(self.range).map(|k| self.grid.at(k));
        let inside = inside.filter(|w| *w > low + off && *w < high - off);
        let mut all: Vec<f64> = [low].into_iter().chain(inside).chain([high]).collect();
        if self.direction == Direction::Down {
            all.reverse();
        }
        all
    }

    /// Whether a branch of an earlier run begins where this sweep does.
    pub(super) fn begins(&self, first: &PointRecord) -> bool {
        (first.omega - self.frequencies()[0]).abs() <= SAME * self.grid.step
    }

    /// What the body does at a frequency, from a state.
    fn settle(&self, body: &mut Propagator, z: &[f64], omega: f64) -> Result<At, OrbitError> {
        let found = match self.dwell {
            None => attractor(body, z, omega)?,
            Some(periods) => dwell(body, z, omega, periods)?,
        };
        Ok(At { omega, found })
    }

    /// What it does between two frequencies of which it is known that the motion changes between them, in the order of the walk.
    fn between(
        &self,
        body: &mut Propagator,
        before: &At,
        behind: f64,
    ) -> Result<Vec<At>, OrbitError> {
        let (mut left, mut right) = (vec![], vec![]);
        let mut behind = behind;
        for _ in 0..HALVINGS {
            let last = left.last().unwrap_or(before);
            let at = self.settle(body, &last.found.z, 0.5 * (last.omega + behind))?;
            if last.changes_to(&at).is_some() {
                behind = at.omega;
                right.push(at);
            } else {
                left.push(at);
            }
        }
        left.extend(right.into_iter().rev());
        Ok(left)
    }
}

/// What a body does at a frequency.
struct At {
    omega: f64,
    found: Attractor,
}

impl At {
    /// What changes from here to there, if anything.
    fn changes_to(&self, next: &At) -> Option<PointKind> {
        let (a, b): (&AttractorRecord, &AttractorRecord) = (&self.found.seen, &next.found.seen);
        if a.kind != b.kind {
            return Some(PointKind::Change { before: a.kind, after: b.kind });
        }
        let (x, y) = (a.amplitude(), b.amplitude());
        ((x - y).abs() > CHANGE * x.max(y)).then_some(PointKind::Jump)
    }

    /// As a point of a family; `place`: one from which a sweep goes on.
    fn point(
        &self,
        body: &Propagator,
        special: PointKind,
        place: bool,
    ) -> Result<PointRecord, OrbitError> {
        let At { omega, found } = self;
        let x = || found.z.iter().copied().chain([*omega]).collect();
        Ok(PointRecord {
            omega: *omega,
            special,
            orbit: found.orbit.as_ref().map(|orbit| record(body, orbit)).transpose()?,
            place: place.then(|| PlaceRecord { x: x(), ..PlaceRecord::default() }),
            attractor: Some(found.seen.clone()),
            ..PointRecord::default()
        })
    }
}

/// Sweep from the state `first` (a frame vector), or on from the points `known` of an earlier run, in the order of the walk.
pub fn sweep(
    body: &mut Propagator,
    sweep: &Sweep,
    first: &[f64],
    known: &[&PointRecord],
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    let all = sweep.frequencies();
    let earlier = known.iter().rev().find_map(|p| {
        let (&omega, z) = p.place.as_ref()?.x.split_last()?;
        let (orbit, seen) = (None, p.attractor.clone()?);
        Some(At { omega, found: Attractor { seen, orbit, z: z.to_vec() } })
    });
    let mut index = known.last().map_or(0, |p| p.index + 1);
    let mut before = earlier;
    let sign = sweep.direction.sign();
    let off = SAME * sweep.grid.step;
    let left = |w: &&f64| before.as_ref().is_none_or(|b| sign * (**w - b.omega) > off);
    let left: Vec<f64> = all.iter().filter(left).copied().collect();
    for omega in left {
        let from = before.as_ref().map_or(first, |b| &b.found.z);
        let at = sweep.settle(body, from, omega)?;
        // a point of the grid with all that lies before it is one step
        let mut step = match &before {
            Some(b) if sweep.dwell.is_none() && b.changes_to(&at).is_some() => {
                sweep.between(body, b, omega)?
            }
            _ => vec![],
        };
        step.push(at);
        for at in &mut step {
            // behind what has no state to go on from the body begins anew
            if matches!(at.found.seen.kind, AttractorKind::Unbounded | AttractorKind::Lost) {
                at.found.z = first.to_vec();
            }
        }
        for k in 0..step.len() {
            let last = if k > 0 { step.get(k - 1) } else { before.as_ref() };
            let special = match last {
                None => PointKind::Start,
                Some(last) => last.changes_to(&step[k]).unwrap_or_default(),
            };
            let mut point = step[k].point(body, special, k + 1 == step.len())?;
            (point.index, index) = (index, index + 1);
            if take(point).is_break() {
                return Ok(ended(0, EndReason::Interrupted, "interrupted", false));
            }
        }
        before = step.pop();
    }
    let (low, high) = sweep.range;
    let text = format!("{} frequencies from {low} to {high}", all.len());
    Ok(ended(0, EndReason::Range, text, true))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_covers_its_range() {
        let grid = Grid { origin: 1.0, step: 0.3 };
        let sweep = |direction| Sweep { grid, range: (1.0, 2.0), direction, dwell: None };
        let up = sweep(Direction::Up).frequencies();
        assert_eq!(up, [1.0, 1.3, 1.6, 1.9, 2.0]);
        let mut down = sweep(Direction::Down).frequencies();
        down.reverse();
        assert_eq!(up, down);
    }
}
