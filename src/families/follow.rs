//! Branches that are followed along a family, from where an earlier run stood or from a first orbit.

use super::{FamilyError, Known, ended, known};
use crate::continuation::{Go, Options, Stop};
use crate::hbm::branch as series_branch;
use crate::hbm::newton::Settings;
use crate::hbm::{viscous_branch, viscous_mode};
use crate::orbit::along::{self, Start};
use crate::orbit::search::{Effort, find};
use crate::orbit::{Closure, Orbit, Propagator};
use crate::records::{BranchEnd, EndReason, PlaceRecord, PointRecord};

/// A branch to follow.
#[derive(Clone, Copy)]
pub struct BranchTask<'a> {
    /// Its number in the family.
    pub index: usize,
    /// What an earlier run left of the family.
    pub known: &'a Known,
    /// Range, steps, number of points.
    pub options: &'a Options,
    /// Whether it is complete when it has as many points as were asked for.
    pub points_suffice: bool,
}

/// Who takes points as they are found.
pub type Take<'a> = &'a mut dyn FnMut(PointRecord) -> Go;

/// The first tangent is singular.
const NO_TANGENT: &str = "the first tangent could not be computed";

/// Follow a branch of orbits: from where an earlier run stood, or from what `start` finds (or why it finds nothing).
pub fn orbits(
    body: &mut Propagator,
    closure: Closure,
    task: BranchTask,
    start: impl FnOnce(&mut Propagator) -> Result<Result<Start, String>, FamilyError>,
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    go_on(task, take, |place, options, take| {
        let from = match place {
            Some(place) => Start::of_record(place),
            None => match start(body)? {
                Ok(start) => start,
                Err(why) => return Ok(Err(why)),
            },
        };
        let ending = along::arclength(body, closure, from, options, take)?;
        let told = |e: along::Ending| {
            (e.to_string(), if e.met { EndReason::Met } else { reason(&e.stop) })
        };
        Ok(ending.map(told).ok_or_else(|| NO_TANGENT.into()))
    })
}

/// The first orbit of frequency `omega` that a guess leads to.
pub(crate) fn first_orbit(
    body: &mut Propagator,
    closure: Closure,
    guesses: &[Vec<f64>],
    omega: f64,
) -> Result<Orbit, FamilyError> {
    for guess in guesses {
        let verdict = find(body, closure, guess, omega, &Effort::of(closure))?;
        if let Some(orbit) = verdict.orbit() {
            return Ok(orbit.clone());
        }
    }
    Err(FamilyError::NoStart { omega })
}

/// Follow a branch of harmonic balance with `n_h` harmonics from the frequency `omega`, to higher (`direction > 0`) or lower ones.
pub fn series(
    body: &mut series_branch::BalancedBody,
    (n_h, omega, direction): (usize, f64, f64),
    task: BranchTask,
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    if body.balanced.is_free() {
        return Err(FamilyError::Free);
    }
    go_on(task, take, |place, options, take| {
        let from = match place {
            Some(place) => {
                let place = series_branch::place_of(body.balanced.interface(), n_h, place);
                series_branch::Start::Place(place.ok_or(FamilyError::Place)?)
            }
            None => match series_branch::first_solution(body.balanced.as_mut(), n_h, omega)? {
                Some(s) => series_branch::Start::Solution(Box::new(s), direction),
                None => return Ok(Err(format!("no solution to start from at omega = {omega}"))),
            },
        };
        let stop = series_branch::arclength(body, n_h, from, options, take)?;
        Ok(stop.map(|s| (s.to_string(), reason(&s))).ok_or_else(|| NO_TANGENT.into()))
    })
}

/// The same of viscous nonlinear modes.
pub(crate) fn viscous_series(
    body: &mut viscous_mode::ViscousBody,
    (n_h, omega, direction): (usize, f64, f64),
    task: BranchTask,
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    go_on(task, take, |place, options, take| {
        let from = match place {
            Some(place) => {
                let place = viscous_branch::place_of(&body.viscous, n_h, place);
                viscous_branch::Start::Place(place.ok_or(FamilyError::Place)?)
            }
            None => match body.viscous.from_mode(n_h, omega, &Settings::default())? {
                Ok(fed) => viscous_branch::Start::Solution(Box::new(fed), direction),
                Err(e) => {
                    return Ok(Err(format!("no solution to start from at omega = {omega}: {e}")));
                }
            },
        };
        let stop = viscous_branch::arclength(body, n_h, from, options, take)?;
        Ok(stop.map(|s| (s.to_string(), reason(&s))).ok_or_else(|| NO_TANGENT.into()))
    })
}

/// Why a branch was not followed at all, in words, or how following it ended, in words and as a value.
type Followed = Result<Result<(String, EndReason), String>, FamilyError>;

/// Go on along a branch: `follow` starts from the last place that is known (or from nothing) and hands its points on.
fn go_on(
    task: BranchTask,
    take: Take,
    follow: impl FnOnce(Option<&PlaceRecord>, &Options, Take) -> Followed,
) -> Result<BranchEnd, FamilyError> {
    let BranchTask { index, known, points_suffice, .. } = task;
    if let Some(end) = known.end(index) {
        return Ok(end.clone());
    }
    let earlier = known.branch(index);
    let mut options = task.options.clone();
    options.points = options.points.saturating_sub(known::count(earlier.iter().copied()));
    if options.points == 0 {
        let text = "number of points reached (earlier run)";
        return Ok(ended(index, EndReason::Points, text, points_suffice));
    }
    let mut next = earlier.last().map_or(0, |p| p.index + 1);
    let mut numbered = |mut point: PointRecord| {
        point.index = next;
        next += 1;
        take(point)
    };
    Ok(match follow(known::last_place(&earlier), &options, &mut numbered)? {
        Err(why) => ended(index, EndReason::Stuck, why, false),
        Ok((text, reason)) => {
            let complete = match reason {
                EndReason::Range | EndReason::Met => true,
                EndReason::Points => points_suffice,
                EndReason::Stuck | EndReason::Interrupted => false,
            };
            ended(index, reason, text, complete)
        }
    })
}

fn reason(stop: &Stop) -> EndReason {
    match stop {
        Stop::Range => EndReason::Range,
        Stop::Points => EndReason::Points,
        Stop::Interrupted => EndReason::Interrupted,
        Stop::Step { .. } | Stop::DeadEnd { .. } => EndReason::Stuck,
    }
}
