//! Sweeps: what a forced body does while the frequency of its loads, or a number of its scene, goes up, or down, in small steps. At each the body settles from where it was;
//! where the motion changes between two steps, the change is closed in on from the state before it.

use super::follow::Take;
use super::{FamilyError, ended};
use crate::continuation::Go;
use crate::orbit::attractor::{self, Attractor};
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
}

/// What is swept over: the frequency of the loads, or a number of the scene. All states are told in one frame.
pub(super) trait Ground {
    /// What the body does at a place, from a state.
    fn settle(&mut self, z: &[f64], place: f64) -> Result<Attractor, FamilyError>;

    /// Take what was found: what changed since the place before it, and whether a later run may go on from there.
    fn take(&mut self, at: &At, special: PointKind, goes_on: bool) -> Result<Go, FamilyError>;
}

/// What a body does at a place.
pub(super) struct At {
    pub place: f64,
    pub found: Attractor,
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
}

/// Settle at a place.
fn settled(ground: &mut dyn Ground, z: &[f64], place: f64) -> Result<At, FamilyError> {
    Ok(At { place, found: ground.settle(z, place)? })
}

/// What the body does between two places of which it is known that the motion changes between them, in the order of the walk.
fn between(ground: &mut dyn Ground, before: &At, behind: f64) -> Result<Vec<At>, FamilyError> {
    let (mut left, mut right) = (vec![], vec![]);
    let mut behind = behind;
    for _ in 0..HALVINGS {
        let last = left.last().unwrap_or(before);
        let at = settled(ground, &last.found.z, 0.5 * (last.place + behind))?;
        if last.changes_to(&at).is_some() {
            behind = at.place;
            right.push(at);
        } else {
            left.push(at);
        }
    }
    left.extend(right.into_iter().rev());
    Ok(left)
}

/// Settle at one place after the other, from the state `first` or from what was found `before`; changes are closed in on, unless the body is not waited for. Whether it came to the end.
pub(super) fn walk(
    ground: &mut dyn Ground,
    places: &[f64],
    (first, mut before): (&[f64], Option<At>),
    closes_in: bool,
) -> Result<Go, FamilyError> {
    for &place in places {
        let from = before.as_ref().map_or(first, |b| &b.found.z);
        let at = settled(ground, from, place)?;
        // a place with all that lies before it is one step
        let mut step = match &before {
            Some(b) if closes_in && b.changes_to(&at).is_some() => between(ground, b, place)?,
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
            if ground.take(&step[k], special, k + 1 == step.len())?.is_break() {
                return Ok(Go::Break(()));
            }
        }
        before = step.pop();
    }
    Ok(Go::Continue(()))
}

/// What a body does under loads of frequency `omega` from the frame vector `z`: once it has settled, or for so many periods (`dwell`).
pub(super) fn settled_or_not(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
    dwell: Option<usize>,
) -> Result<Attractor, OrbitError> {
    match dwell {
        None => attractor::attractor(body, z, omega),
        Some(periods) => attractor::dwell(body, z, omega, periods),
    }
}

/// A body under loads of one frequency after the other.
struct Frequencies<'a> {
    body: &'a mut Propagator,
    dwell: Option<usize>,
    /// The number of the next point.
    index: i64,
    take: Take<'a>,
}

impl Ground for Frequencies<'_> {
    fn settle(&mut self, z: &[f64], omega: f64) -> Result<Attractor, FamilyError> {
        Ok(settled_or_not(self.body, z, omega, self.dwell)?)
    }

    fn take(&mut self, at: &At, special: PointKind, goes_on: bool) -> Result<Go, FamilyError> {
        let At { place: omega, found } = at;
        let x = || found.z.iter().copied().chain([*omega]).collect();
        let index = self.index;
        self.index += 1;
        Ok((self.take)(PointRecord {
            omega: *omega,
            index,
            special,
            orbit: found.orbit.as_ref().map(|orbit| record(self.body, orbit)).transpose()?,
            place: goes_on.then(|| PlaceRecord { x: x(), ..PlaceRecord::default() }),
            attractor: Some(found.seen.clone()),
            ..PointRecord::default()
        }))
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
    let before = known.iter().rev().find_map(|p| {
        let (&place, z) = p.place.as_ref()?.x.split_last()?;
        let (orbit, seen) = (None, p.attractor.clone()?);
        Some(At { place, found: Attractor { seen, orbit, z: z.to_vec() } })
    });
    let index = known.last().map_or(0, |p| p.index + 1);
    let sign = sweep.direction.sign();
    let off = SAME * sweep.grid.step;
    let left = |w: &&f64| before.as_ref().is_none_or(|b| sign * (**w - b.place) > off);
    let left: Vec<f64> = all.iter().filter(left).copied().collect();
    let mut ground = Frequencies { body, dwell: sweep.dwell, index, take };
    if walk(&mut ground, &left, (first, before), sweep.dwell.is_none())?.is_break() {
        return Ok(ended(0, EndReason::Interrupted, "interrupted", false));
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
