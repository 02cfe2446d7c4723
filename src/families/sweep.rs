//! Sweeps: what a forced body does while the frequency of its loads, or a number of its scene, goes up, or down, in small steps. At each the body settles from where it was;
//! where the motion changes between two steps, the change is closed in on from the state before it.

use super::follow::Take;
use super::{FamilyError, ended};
use crate::continuation::Go;
use crate::orbit::attractor::{self, Attractor};
use crate::orbit::branch::record;
use crate::orbit::{OrbitError, Propagator};
use crate::records::{
    AttractorKind, BranchEnd, Direction, EndReason, Grid, PlaceRecord, PointKind, PointRecord,
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

/// Amplitudes that differ by more, relative, are those of another motion, if most of the change remains however near the places: a share of that over the whole step.
const CHANGE: f64 = 0.15;
const SUDDEN: f64 = 0.25;
/// So often the step in which a motion changes is halved, and so many places are looked at in one.
const HALVINGS: usize = 6;
const MOST: usize = 4 * HALVINGS;
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

/// Settle at a place.
fn settled(ground: &mut dyn Ground, z: &[f64], place: f64) -> Result<At, FamilyError> {
    Ok(At { place, found: ground.settle(z, place)? })
}

/// What a body does from one place of the grid to the next, both among them, with places between where its motion changes.
struct Step {
    all: Vec<At>,
    /// Whether the body settled at each of them from the one before.
    from_near: Vec<bool>,
    /// The nearest places that changes are closed in on; none: they are not.
    least: Option<f64>,
}

impl Step {
    fn amplitude(&self, k: usize) -> f64 {
        self.all[k].found.seen.amplitude()
    }

    /// By how much the amplitude changes from a place to the next one.
    fn moves(&self, k: usize) -> f64 {
        (self.amplitude(k + 1) - self.amplitude(k)).abs()
    }

    /// Whether two neighbours are as near to each other as they get; where changes are not closed in on none are.
    fn is_narrow(&self, k: usize) -> bool {
        // halves are not exact
        self.least
            .is_some_and(|least| (self.all[k + 1].place - self.all[k].place).abs() < 1.5 * least)
    }

    /// Whether the motion at a place is of another kind than that at the next one.
    fn turns(&self, k: usize) -> bool {
        self.all[k].found.seen.kind != self.all[k + 1].found.seen.kind
    }

    /// Whether the amplitude changes more from a place to the next one than it would if it grew over the whole step.
    fn leaps(&self, k: usize) -> bool {
        let moves: Vec<f64> = (0..self.all.len() - 1).map(|k| self.moves(k)).collect();
        let in_all: f64 = moves.iter().filter(|x| x.is_finite()).sum();
        let largest = self.amplitude(k).max(self.amplitude(k + 1));
        moves[k] > CHANGE * largest && moves[k] > SUDDEN * in_all
    }

    /// What changes between a place and the next one, if anything.
    fn change(&self, k: usize) -> Option<PointKind> {
        if self.turns(k) {
            let [before, after] = [k, k + 1].map(|k| self.all[k].found.seen.kind);
            return Some(PointKind::Change { before, after });
        }
        (self.leaps(k) && self.is_narrow(k)).then_some(PointKind::Jump)
    }

    /// The first change that is not closed in on: of several other kinds of motion in one step the first.
    fn open(&self) -> Option<usize> {
        let mut turned = false;
        (0..self.all.len() - 1).find(|&k| {
            let first = self.turns(k) && !std::mem::replace(&mut turned, true);
            (first || (!self.turns(k) && self.leaps(k))) && !self.is_narrow(k)
        })
    }

    /// The first change to where the body was brought by a longer step than from the place before: that step alone may have made it.
    fn doubtful(&self) -> Option<usize> {
        (0..self.all.len() - 1).find(|&k| !self.from_near[k + 1] && self.change(k).is_some())
    }

    /// Settle between places, each time from the motion before the change, and again behind it.
    fn close_in(&mut self, ground: &mut dyn Ground) -> Result<(), FamilyError> {
        for _ in 0..MOST {
            let open = self.open();
            let Some(k) = open.or_else(|| self.doubtful()) else { break };
            let (near, far) = (self.all[k].place, self.all[k + 1].place);
            let is_between = open.is_some();
            let place = if is_between { 0.5 * (near + far) } else { far };
            let at = settled(ground, &self.all[k].found.z, place)?;
            if is_between {
                self.all.insert(k + 1, at);
                self.from_near.insert(k + 1, true);
            } else {
                self.all[k + 1] = at;
                self.from_near[k + 1] = true;
            }
            if let Some(next) = self.from_near.get_mut(k + 2) {
                *next = false;
            }
        }
        Ok(())
    }
}

/// Settle at one place after the other, from the state `first` or from what was found `before`; changes are closed in on, unless the body is not waited for. Whether it came to the end.
pub(super) fn walk(
    ground: &mut dyn Ground,
    places: &[f64],
    (first, mut before): (&[f64], Option<At>),
    closes_in: bool,
) -> Result<Go, FamilyError> {
    for &place in places {
        let at = settled(ground, before.as_ref().map_or(first, |b| &b.found.z), place)?;
        // a place with all that lies before it is one step
        let parts = f64::from(1 << HALVINGS);
        let width = before.as_ref().map(|b| (place - b.place).abs() / parts);
        let known = usize::from(before.is_some());
        let all: Vec<At> = before.take().into_iter().chain([at]).collect();
        let from_near = vec![true; all.len()];
        let mut step = Step { all, from_near, least: width.filter(|_| closes_in) };
        if step.least.is_some() {
            step.close_in(ground)?;
        }
        for at in &mut step.all {
            // behind what has no state to go on from the body begins anew
            if matches!(at.found.seen.kind, AttractorKind::Unbounded | AttractorKind::Lost) {
                at.found.z = first.to_vec();
            }
        }
        let last = step.all.len() - 1;
        for k in known..=last {
            let special = match k {
                0 => PointKind::Start,
                k => step.change(k - 1).unwrap_or_default(),
            };
            if ground.take(&step.all[k], special, k == last)?.is_break() {
                return Ok(Go::Break(()));
            }
        }
        before = step.all.pop();
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
