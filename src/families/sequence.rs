//! Families frequency by frequency on a grid: the legs that an earlier run left.

use super::follow::Take;
use super::{FamilyError, Legs, ended, start};
use crate::hbm::branch as series_branch;
use crate::hbm::newton::Settings;
use crate::hbm::viscous_mode;
use crate::orbit::branch::{self, Sequential};
use crate::orbit::search::Effort;
use crate::orbit::settle::ladder;
use crate::orbit::{Closure, Propagator};
use crate::records::{BranchEnd, EndReason, Grid, PointRecord};

/// The part of a grid that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// The grid.
    pub grid: Grid,
    /// Its least and largest frequency.
    pub range: (f64, f64),
    /// Whether it is walked from the high end to the low one.
    pub downwards: bool,
}

impl Stretch {
    fn legs(&self, known: &[&PointRecord]) -> Legs {
        Legs::new(self.grid, self.range, self.downwards, known)
    }
}

/// The unknowns and the frequency of a point, if it has an orbit.
fn solution_of(p: &&PointRecord) -> Option<(f64, Vec<f64>)> {
    let (omega, z) = p.place.as_ref()?.x.split_last()?;
    Some((*omega, z.to_vec()))
}

/// Orbits at each frequency; `first` are the guesses at one while nothing is known, `known` the points of an earlier run in the order of the
/// walk.
pub fn orbits(
    body: &mut Propagator,
    closure: Closure,
    first: &dyn Fn(&Propagator, f64) -> Vec<Vec<f64>>,
    stretch: Stretch,
    known: &[&PointRecord],
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    let mut interrupted = false;
    let legs = stretch.legs(known);
    for (places, before) in legs.each(known) {
        let frequencies = legs.frequencies(places);
        let solutions = before.iter().filter_map(solution_of).collect();
        let last = |body: &Propagator, omega| start::by_series(body, closure, omega);
        let effort = Effort::of(closure);
        let step = stretch.grid.step;
        let plan = Sequential { grid: &frequencies, step, effort, first, last: &last };
        let mut next = places.iter();
        branch::sequential(body, closure, &plan, solutions, |point, _| {
            let index = next.next().copied().unwrap_or_default();
            let go = take(PointRecord { index, ..point });
            interrupted = go.is_break();
            go
        })?;
        if interrupted {
            return Ok(ended(0, EndReason::Interrupted, "interrupted", false));
        }
    }
    let Stretch { grid, range: (low, high), .. } = stretch;
    let text = format!("{} frequencies from {low} to {high}", grid.within((low, high)).count());
    Ok(ended(0, EndReason::Range, text, true))
}

/// A forced response at each frequency, from what the body does, or settles to, at the first one; `given` is the state of the scene, if it has one. Friction holds whole families of
/// orbits at a frequency, and no one branch could be followed along its length.
pub fn response(
    body: &mut Propagator,
    given: &[Vec<f64>],
    stretch: Stretch,
    known: &[&PointRecord],
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    let omega = stretch.range.0;
    let first = match known.is_empty() {
        true => match ladder(body, given, omega)? {
            Ok(orbit) => vec![orbit.z],
            Err(why) => {
                let text = format!("no orbit at omega = {omega}: {why}");
                return Ok(ended(0, EndReason::Lost, text, false));
            }
        },
        false => vec![],
    };
    let first = |_: &Propagator, _: f64| first.clone();
    orbits(body, Closure::FORCED, &first, stretch, known, take)
}

/// Viscous nonlinear modes by harmonic balance at each frequency, all numbers of harmonics at once; `known` as in [`series`].
pub(crate) fn viscous_series(
    body: &mut viscous_mode::ViscousBody,
    (harmonics, settings): (&[usize], &Settings),
    stretch: Stretch,
    known: &[&PointRecord],
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    at_once(harmonics, stretch, known, take, |grid, before, take| {
        let plan = series_branch::Sequential { grid, harmonics, settings, aside: &[] };
        Ok(viscous_mode::sequential(body, &plan, before, take)?)
    })
}

/// Solutions of harmonic balance at each frequency, all numbers of harmonics at once; `known` are the points of an earlier run in the
/// order of the walk, `aside` those of another walk over the same frequencies.
pub fn series(
    body: &mut series_branch::BalancedBody,
    (harmonics, settings): (&[usize], &Settings),
    stretch: Stretch,
    (known, aside): (&[&PointRecord], &[PointRecord]),
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    at_once(harmonics, stretch, known, take, |grid, before, take| {
        let plan = series_branch::Sequential { grid, harmonics, settings, aside };
        Ok(series_branch::sequential(body, &plan, before, take)?)
    })
}

/// The legs of a grid on which all numbers of harmonics are solved for together at a frequency.
pub(super) fn at_once(
    harmonics: &[usize],
    stretch: Stretch,
    known: &[&PointRecord],
    take: Take,
    mut solve: impl FnMut(&[f64], &[&PointRecord], Take) -> Result<(), FamilyError>,
) -> Result<BranchEnd, FamilyError> {
    let mut interrupted = false;
    let legs = stretch.legs(known);
    for (places, before) in legs.each(known) {
        let frequencies = legs.frequencies(places);
        let mut next = places.iter().flat_map(|place| harmonics.iter().map(move |_| *place));
        solve(&frequencies, &before, &mut |point| {
            let index = next.next().unwrap_or_default();
            let go = take(PointRecord { index, ..point });
            interrupted = go.is_break();
            go
        })?;
        if interrupted {
            break;
        }
    }
    let all = stretch.grid.within(stretch.range).count();
    let text = format!("{all} frequencies, {} numbers of harmonics", harmonics.len());
    let reason = if interrupted { EndReason::Interrupted } else { EndReason::Range };
    Ok(ended(0, reason, text, !interrupted))
}
