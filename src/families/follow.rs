//! Branches that are followed along a family, from where an earlier run stood or from a first orbit.

use super::{FamilyError, Known, ended, known, single, summit};
use crate::continuation::{Go, Options, Stop};
use crate::hbm::branch as series_branch;
use crate::hbm::newton::Settings;
use crate::hbm::{viscous_branch, viscous_mode};
use crate::orbit::along::{self, Start};
use crate::orbit::search::{Effort, Verdict, find};
use crate::orbit::settle::{Settled, settle};
use crate::orbit::{Closure, Orbit, Propagator};
use crate::records::{BranchEnd, EndReason, PlaceRecord, PointKind, PointRecord};

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

/// Where a branch goes on, or what it begins with, or why with nothing.
fn begin(
    body: &mut Propagator,
    place: Option<&PlaceRecord>,
    start: impl FnOnce(&mut Propagator) -> Result<Result<Start, String>, FamilyError>,
) -> Result<Result<Start, String>, FamilyError> {
    match place {
        Some(place) => Ok(Ok(Start::of_record(place))),
        None => start(body),
    }
}

/// Follow a branch of orbits: from where an earlier run stood, or from what `start` finds (or why it finds nothing).
pub fn orbits(
    body: &mut Propagator,
    closure: Closure,
    task: BranchTask,
    start: impl FnOnce(&mut Propagator) -> Result<Result<Start, String>, FamilyError>,
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    go_on(task, take, |place, options, take| {
        let from = match begin(body, place, start)? {
            Ok(start) => start,
            Err(why) => return Ok(Err(why)),
        };
        let ending = along::arclength(body, closure, from, options, take)?;
        let told = |e: along::Ending| {
            (e.to_string(), if e.met { EndReason::Met } else { reason(&e.stop) })
        };
        Ok(ending.map(told).ok_or_else(|| NO_TANGENT.into()))
    })
}

/// Follow a forced response to higher frequencies, up to the end of the range: where the branch is lost, or comes back along itself, an orbit a little further on is
/// looked for, and the response goes on from there behind a jump.
pub fn response(
    body: &mut Propagator,
    task: BranchTask,
    start: impl FnOnce(&mut Propagator) -> Result<Result<Start, String>, FamilyError>,
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    let high = task.options.range.1;
    let earlier = task.known.branch(task.index);
    let mut trace = Trace::of(&earlier);
    let mut found: Vec<PointRecord> = earlier.into_iter().cloned().collect();
    let mut keeping = |point: PointRecord| {
        found.push(point.clone());
        take(point)
    };
    let end = go_on(task, &mut keeping, |place, options, take| {
        let mut from = match begin(body, place, start)? {
            Ok(start) => start,
            Err(why) => return Ok(Err(why)),
        };
        let (mut options, mut told) = (options.clone(), vec![]);
        let mut is_jump = false;
        loop {
            let mut count = 0;
            let mut watched = |mut point: PointRecord| {
                if std::mem::take(&mut is_jump) {
                    point.special = PointKind::Jump;
                }
                count += 1;
                trace.add(&point);
                match take(point) {
                    Go::Continue(()) if trace.retraced => Go::Break(()),
                    go => go,
                }
            };
            let ending = along::arclength(body, Closure::FORCED, from, &options, &mut watched)?;
            let Some(ending) = ending else { return Ok(Err(NO_TANGENT.into())) };
            options.points = options.points.saturating_sub(count);
            let why = match &ending.stop {
                _ if trace.retraced => format!("comes back along itself at {:.9}", trace.omega()),
                Stop::Step { .. } | Stop::DeadEnd { .. } => ending.to_string(),
                stop => {
                    let reason = if ending.met { EndReason::Met } else { reason(stop) };
                    told.push(ending.to_string());
                    return Ok(Ok((told.join("; "), reason)));
                }
            };
            let at = trace.omega();
            let next = if options.points > 0 { trace.beyond(body, high)? } else { None };
            let Some(orbit) = next else {
                told.push(why);
                return Ok(Ok((told.join("; "), EndReason::Lost)));
            };
            let what = match is_grazed(&orbit) {
                true => format!("turns at a grazing at {at:.9}, behind it nothing touches"),
                false => format!("lost: {why}"),
            };
            told.push(format!("{what}; goes on behind a jump at {:.9}", orbit.omega()));
            trace.retraced = false;
            is_jump = true;
            from = Start::Orbit(Box::new(orbit), 1.0);
        }
    })?;
    if !end.complete || !end.peaks.is_empty() {
        return Ok(end);
    }
    let peaks = summit::peaks(body, end.branch, &found)?;
    Ok(BranchEnd { peaks, ..end })
}

/// How far beyond a place where a branch was lost an orbit is looked for, over the frequency.
const BEYOND: [f64; 4] = [1e-4, 1e-3, 5e-3, 0.02];
/// Orbits whose energies, amplitudes, and times in contact differ by less, relative, are taken for one.
const SAME: f64 = 1e-3;
/// So many points in a row that lie on a branch that is known mean that it comes back.
const BACK: usize = 3;
/// A free motion that comes as near as this to the obstacle grazes it, over the unit of length.
const GRAZES: f64 = 1e-2;

/// What is compared of an orbit of a family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Glimpse {
    pub omega: f64,
    pub energy: f64,
    pub amplitude: f64,
    pub contact_time: f64,
    /// Switches: a branch that turns at a grazing goes on beside itself, with others.
    pub switches: usize,
}

impl Glimpse {
    /// That of a point which has an orbit.
    pub fn of(p: &PointRecord) -> Option<Glimpse> {
        let o = p.orbit.as_ref()?;
        Some(Glimpse {
            omega: p.omega,
            energy: o.energy,
            amplitude: o.amplitude,
            contact_time: o.contact_time,
            switches: o.switches.len(),
        })
    }

    /// That of an orbit.
    fn of_orbit(o: &Orbit) -> Glimpse {
        Glimpse {
            omega: o.omega(),
            energy: o.energy,
            amplitude: o.amplitude,
            contact_time: o.contact_time,
            switches: o.switches.len(),
        }
    }
}

/// The way that a response has come.
#[derive(Default)]
pub(super) struct Trace {
    points: Vec<Glimpse>,
    /// Where a piece begins behind a jump.
    pieces: Vec<usize>,
    back: usize,
    /// It comes back along itself.
    pub retraced: bool,
}

impl Trace {
    fn along(points: &[&PointRecord]) -> Trace {
        let mut trace = Trace::default();
        points.iter().for_each(|p| trace.add(p));
        trace
    }

    /// Whether points come back along themselves.
    pub fn comes_back(points: &[&PointRecord]) -> bool {
        Trace::along(points).retraced
    }

    /// That of points that are known.
    pub fn of(points: &[&PointRecord]) -> Trace {
        let mut trace = Trace::along(points);
        // what was found before was judged then
        trace.retraced = false;
        trace
    }

    /// One point more.
    pub fn add(&mut self, p: &PointRecord) {
        let Some(here) = Glimpse::of(p) else { return };
        if p.special == PointKind::Jump {
            self.pieces.push(self.points.len());
            self.back = 0;
        }
        self.back = if self.knows(here, BACK) { self.back + 1 } else { 0 };
        self.retraced |= self.back >= BACK;
        self.points.push(here);
    }

    /// The frequency at its end.
    pub fn omega(&self) -> f64 {
        self.points.last().map_or(f64::NAN, |p| p.omega)
    }

    /// Whether an orbit lies on the way, but for its last points.
    pub fn knows(&self, here: Glimpse, but: usize) -> bool {
        let old = &self.points[..self.points.len().saturating_sub(but)];
        old.windows(2).enumerate().any(|(k, pair)| {
            let [a, b] = [pair[0], pair[1]];
            let (low, high) = (a.omega.min(b.omega), a.omega.max(b.omega));
            let is_inside = low < high && (low..=high).contains(&here.omega);
            let is_like = [a.switches, b.switches].contains(&here.switches);
            if self.pieces.contains(&(k + 1)) || !is_inside || !is_like {
                return false;
            }
            let s = (here.omega - a.omega) / (b.omega - a.omega);
            let near = |of: fn(&Glimpse) -> f64| {
                let (value, there) = (of(&here), of(&a) + s * (of(&b) - of(&a)));
                (there - value).abs() <= SAME * value.abs().max(there.abs())
            };
            near(|g| g.energy) && near(|g| g.amplitude) && near(|g| g.contact_time)
        })
    }

    /// An orbit a little further on that does not lie on the way.
    fn beyond(&self, body: &mut Propagator, high: f64) -> Result<Option<Orbit>, FamilyError> {
        let at = self.omega();
        for share in BEYOND {
            let omega = at * (1.0 + share);
            if omega > high {
                return Ok(None);
            }
            body.system.loads_mut().set_frequency(omega);
            let linear = body.linear_response();
            let effort = Effort { rescue: false, ..Effort::of(Closure::FORCED) };
            let mut found = find(body, Closure::FORCED, &linear, omega, &effort)?.orbit().cloned();
            let is_new = |o: &Orbit| !self.knows(Glimpse::of_orbit(o), 0);
            if !found.as_ref().is_some_and(is_new)
                && let Settled::Orbit(orbit) = settle(body, &linear, omega)?.to
                && orbit.closure == Closure::FORCED
            {
                found = Some(*orbit);
            }
            if let Some(orbit) = found.filter(is_new) {
                return Ok(Some(orbit));
            }
        }
        Ok(None)
    }
}

/// Whether a branch turned at a grazing, by the orbit behind it: nothing touches, and the motion comes near the obstacle.
fn is_grazed(behind: &Orbit) -> bool {
    behind.switches.is_empty() && behind.contact_time == 0.0 && behind.grazing < GRAZES
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
        if let Verdict::Orbit(orbit) = verdict {
            return Ok(*orbit);
        }
    }
    match single::search(body, closure, guesses, omega)? {
        Verdict::Orbit(orbit) => Ok(*orbit),
        why => Err(FamilyError::NoStart(format!("at omega = {omega}, {why}"))),
    }
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
        Err(why) => ended(index, EndReason::Lost, why, false),
        Ok((text, reason)) => {
            let complete = match reason {
                EndReason::Range | EndReason::Met => true,
                EndReason::Points => points_suffice,
                EndReason::Lost | EndReason::Interrupted => false,
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
        Stop::Step { .. } | Stop::DeadEnd { .. } => EndReason::Lost,
    }
}
