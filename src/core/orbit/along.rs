//! Families of orbits along the branch, through folds and corners.

use super::border::Border;
use super::branch::{kind_of, place_of, place_record, record};
use super::chain::{Chain, Propagator};
use super::credentials::Orbit;
use super::mapped::{Crossing, Mapped};
use super::search::chain_of;
use super::segments::Segments;
use super::shooting::Closure;
use super::{OrbitError, OrbitFamily};
use crate::continuation::{self, Go, Options, Place, Special, Stop, norm};
use crate::records::{OrbitRecord, PlaceRecord, PointKind, PointRecord};

/// Where a branch begins.
pub enum Start {
    /// At an orbit, towards growing (`> 0`) or falling frequency.
    Orbit(Box<Orbit>, f64),
    /// Where an earlier continuation stood, and what it remembered.
    Place(Place<Chain>, Memory),
}

impl Start {
    /// Where a file says that an earlier continuation stood.
    pub fn of_record(record: &PlaceRecord) -> Start {
        Start::Place(place_of(record), Memory::of_numbers(&record.memory))
    }
}

/// Follow a family by arclength (or, with `natural`, by frequency).
pub fn arclength(
    body: &mut Propagator,
    closure: Closure,
    start: Start,
    options: &Options,
    mut take: impl FnMut(PointRecord) -> Go,
) -> Result<Option<Ending>, OrbitError> {
    let mapped = is_mapped(body, closure);
    let mut memory = Memory::default();
    let (chain, start) = match start {
        Start::Place(place, earlier) => {
            memory = earlier;
            (place.chart.clone(), Begin::Place(place))
        }
        Start::Orbit(orbit, direction) => {
            body.system.loads_mut().set_frequency(orbit.omega());
            let (chain, times) = match mapped {
                true => (Chain::default(), vec![]),
                false => chain_of(body, &orbit)?,
            };
            let x = orbit.z.iter().copied().chain(times).chain([orbit.omega()]).collect();
            (chain, Begin::At(x, direction))
        }
    };
    if mapped {
        let family = &mut Mapped::new(body, closure, options.step.2);
        let ended = across_corners(family, start, options, &mut memory, &mut take);
        family.set_section(0.0);
        return ended;
    }
    let mut family = Segments::new(body, closure, chain);
    let walked = along(&mut family, start, options, (&mut memory, false), &mut take)?;
    Ok(walked.map(|w| w.end.unwrap_or(Ending::of(w.stop))))
}

/// Whether a family is followed on the event-driven map itself. Viscosity makes neighbouring charts almost agree: a branch passes hundreds of corners
/// without a stop.
fn is_mapped(body: &Propagator, closure: Closure) -> bool {
    match closure {
        Closure::Viscous(_) => true,
        // velocities that jump are in the map, and in no segment
        _ if body.system.impact().is_some() => true,
        Closure::Forced(_) => body.system.damping.is_some_and(|d| d.beta > 0.0),
        Closure::Reversible | Closure::Autonomous | Closure::Limit => false,
    }
}

fn within((low, high): (f64, f64), x: &[f64]) -> bool {
    x.last().is_some_and(|omega| (low..=high).contains(omega))
}

/// So many points behind a corner the next one may be passed by a longer step.
const BEHIND: usize = 3;

/// How a branch ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Ending {
    /// How the continuation stopped.
    pub stop: Stop,
    /// Why, in words that the continuation does not know, if so: a grazing corner, a motion that grows without bound.
    pub why: Option<String>,
    /// It met the branch that it came from: there is no more of it.
    pub met: bool,
}

impl Ending {
    fn of(stop: Stop) -> Ending {
        Ending { stop, why: None, met: false }
    }

    /// A continuation that cannot go on.
    fn because(lambda: f64, why: String) -> Ending {
        Ending { stop: Stop::Step { lambda }, why: Some(why), met: false }
    }
}

/// A motion of so many units of length does not know the gap any more: its family goes to infinity.
const UNBOUNDED: f64 = 100.0;

/// So many solutions in a row that are no orbits end a branch.
const FLAWED: usize = 5;

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (&self.why, &self.stop) {
            (Some(why), _) if self.met => f.write_str(why),
            (Some(why), Stop::Step { lambda }) => write!(f, "ends at {lambda:.9}: {why}"),
            (_, stop) => write!(f, "{stop}"),
        }
    }
}

/// Where a branch begins, in the unknowns of its family.
enum Begin {
    Place(Place<Chain>),
    At(Vec<f64>, f64),
}

/// Follow a family on the map itself; where a grazing corner stops it, go on behind the corner if there is a way around or a step across.
fn across_corners(
    family: &mut Mapped,
    start: Begin,
    options: &Options,
    memory: &mut Memory,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Option<Ending>, OrbitError> {
    let (mut options, mut start) = (options.clone(), start);
    loop {
        let before = memory.since_corner;
        let walked = along(family, start, &options, (memory, true), take)?;
        let Some(Walked { stop, last, end }) = walked else { return Ok(None) };
        if end.is_some() {
            return Ok(end);
        }
        options.points = options.points.saturating_sub(memory.since_corner - before);
        let Stop::Step { .. } = stop else { return Ok(Some(Ending::of(stop))) };
        if options.points == 0 {
            return Ok(Some(Ending::of(Stop::Points)));
        }
        if options.natural || memory.since_corner == 0 {
            return Ok(Some(Ending::of(stop)));
        }
        let (at, border, turns, place) = match family.over(&last)? {
            // what lies ahead outside of the range is not to be gone to
            Some((Crossing { at, .. }, _)) if !within(options.range, &at) => {
                return Ok(Some(Ending::of(stop)));
            }
            Some((Crossing { at, border, .. }, place)) => {
                let rate = |p: &Place<Chain>| p.tangent[p.tangent.len() - 1];
                (Some(at), border, rate(&last) * rate(&place) < 0.0, place)
            }
            // what was not passed right behind a corner is not passed by trying again
            None if memory.since_corner > BEHIND && family.is_grazing(&last.x)? => {
                let Some(place) = family.across(&last)? else {
                    let why = family.unfollowed(&last)?;
                    return Ok(Some(Ending { why, ..Ending::of(stop) }));
                };
                let border = Border::Phase { phase: 0, visit: None, what: "corner".into() };
                (None, border, false, place)
            }
            None => {
                let why = family.unfollowed(&last)?;
                return Ok(Some(Ending { why, ..Ending::of(stop) }));
            }
        };
        memory.since_corner = 0;
        let special = Special::Border { border, turns };
        let mut hand_out = |family: &mut Mapped, x: &[f64], special, here| {
            let orbit = family.orbit(x)?;
            Ok::<_, OrbitError>(take(point(family.body(), (x, &orbit), special, here)?))
        };
        let here = Some((&place, &*memory));
        // the grazing itself is no place to go on from
        let go = match at {
            Some(at) => match hand_out(family, &at, Some(&special), None)? {
                Go::Continue(()) => hand_out(family, &place.x, None, here)?,
                enough => enough,
            },
            None => hand_out(family, &place.x, Some(&special), here)?,
        };
        if go.is_break() {
            return Ok(Some(Ending::of(Stop::Interrupted)));
        }
        start = Begin::Place(place);
    }
}

/// How a family ended, and where.
struct Walked {
    stop: Stop,
    last: Place<Chain>,
    /// What ended it that the continuation does not know of.
    end: Option<Ending>,
}

/// What a branch remembers of its way: all that decides how it goes on and ends, beside the place where it is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Memory {
    /// A subharmonic branch: how far the last orbit was from itself one period of the loads later. Behind a period doubling come the same orbits again.
    halfway: Option<Vec<f64>>,
    /// The most of that so far.
    largest: f64,
    /// Solutions in a row that were no orbits.
    flawed: usize,
    /// Points since the last corner that was passed.
    since_corner: usize,
    /// The instant of the loads at which the states of the branch are taken, in their periods.
    section: f64,
}

impl Memory {
    /// The numbers that a file keeps (what a subharmonic orbit is halfway is computed anew).
    fn numbers(&self) -> Vec<f64> {
        vec![self.largest, self.flawed as f64, self.since_corner as f64, self.section]
    }

    fn of_numbers(numbers: &[f64]) -> Memory {
        let &[largest, flawed, since_corner, section] = numbers else { return Memory::default() };
        let (flawed, since_corner) = (flawed as usize, since_corner as usize);
        Memory { halfway: None, largest, flawed, since_corner, section }
    }

    /// One more point.
    fn count(&mut self, orbit: Option<&OrbitRecord>) {
        self.flawed = if orbit.is_none() { self.flawed + 1 } else { 0 };
        self.since_corner += 1;
    }
}

/// The instant of the loads at which the state of a place is taken, in their periods.
pub fn section_of(place: &PlaceRecord) -> f64 {
    Memory::of_numbers(&place.memory).section
}

/// At the fold of a period doubling an orbit differs from itself one period later by less than this, over the most on its branch.
const AT_DOUBLING: f64 = 0.02;

impl Memory {
    /// What a subharmonic orbit is halfway, where that is not known at the section of its branch: behind a resumption, and where the section has moved.
    fn look_halfway<F: OrbitFamily>(
        &mut self,
        family: &mut F,
        x: &[f64],
    ) -> Result<(), OrbitError> {
        if self.halfway.is_none() && self.since_corner > 0 {
            self.halfway = family.orbit(x)?.halfway;
        }
        Ok(())
    }

    /// Whether the branch has come to a period doubling.
    fn is_doubling(&mut self, orbit: &Orbit, is_fold: bool) -> bool {
        let Some(now) = &orbit.halfway else { return false };
        let size = norm(now);
        self.largest = self.largest.max(size);
        let dot = |a: &[f64]| a.iter().zip(now).map(|(a, b)| a * b).sum::<f64>();
        let turned = self.halfway.as_deref().is_some_and(|last| dot(last) < 0.0);
        let at_fold = is_fold && size < AT_DOUBLING * self.largest;
        self.halfway = Some(now.clone());
        turned || at_fold
    }
}

/// Follow a family; how that ended, and where. With `limits` a motion that grows without bound, and solutions that are no orbits any more, end it.
fn along<F: OrbitFamily<Border = Border>>(
    family: &mut F,
    start: Begin,
    options: &Options,
    (memory, limits): (&mut Memory, bool),
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Option<Walked>, OrbitError> {
    let mut place = match start {
        Begin::Place(place) => {
            family.set_section(memory.section);
            memory.look_halfway(family, &place.x)?;
            place
        }
        Begin::At(x, direction) => {
            let Some(place) = Place::start(family, x, direction, options.step.0)? else {
                return Ok(None);
            };
            memory.since_corner += 1;
            let orbit = family.orbit(&place.x)?;
            let here = Some((&place, &*memory));
            let point = point(family.body(), (&place.x, &orbit), Some(&Special::Start), here)?;
            if take(point).is_break() {
                return Ok(Some(Walked { stop: Stop::Interrupted, last: place, end: None }));
            }
            place
        }
    };
    let mut options = options.clone();
    let mut last = place.clone();
    let unit = family.body().system.units.length;
    // a walk for each section
    loop {
        let (mut failed, mut end, mut moved, mut count) = (None, None, None, 0);
        let mut visit = |family: &mut F, p: &continuation::Point<Chain, Border>| {
            let at = p.x[p.x.len() - 1];
            let orbit = family.orbit(&p.x)?;
            if memory.is_doubling(
                &orbit,
                matches!(p.special, Some(Special::Fold | Special::Corner { .. })),
            ) {
                let why = format!(
                    "meets the orbits of one period of the loads at omega = {at:.8}: a period doubling"
                );
                end = Some(Ending { stop: Stop::Interrupted, why: Some(why), met: true });
                return Ok(Go::Break(()));
            }
            let at_point = (&p.x[..], &orbit);
            let mut found = point(family.body(), at_point, p.special.as_ref(), None)?;
            memory.count(found.orbit.as_ref());
            count += 1;
            // a special point inside a step is no place to go on from: the step is made anew
            if p.special.is_none() || p.x == p.place.x {
                last = p.place.clone();
                moved = family.moved(&last)?;
                if let Some(place) = &moved {
                    last = place.clone();
                    memory.section = family.section();
                    memory.halfway = None;
                }
                found.place = Some(place_record(&last, memory.numbers()));
            }
            if limits {
                end = limit(&found, memory, unit);
            }
            if take(found).is_break() {
                moved = None;
                return Ok(Go::Break(()));
            }
            Ok(match end.is_some() || moved.is_some() {
                true => Go::Break(()),
                false => Go::Continue(()),
            })
        };
        let stop = continuation::follow(family, place, &options, |family, p| {
            visit(family, &p).unwrap_or_else(|e| {
                failed = Some(e);
                Go::Break(())
            })
        })?;
        match (failed, moved) {
            (Some(e), _) => return Err(e),
            // the branch goes on at another section
            (None, Some(next)) if end.is_none() && stop == Stop::Interrupted => {
                options.points = options.points.saturating_sub(count);
                if options.points == 0 {
                    return Ok(Some(Walked { stop: Stop::Points, last, end }));
                }
                memory.look_halfway(family, &next.x)?;
                place = next;
            }
            _ => return Ok(Some(Walked { stop, last, end })),
        }
    }
}

/// Why a branch has no more to tell, if so.
fn limit(point: &PointRecord, memory: &Memory, unit: f64) -> Option<Ending> {
    let amplitude = point.orbit.as_ref().map_or(0.0, |o| o.amplitude);
    let why = if amplitude > UNBOUNDED * unit {
        format!("the motion grows beyond {UNBOUNDED} times the gap")
    } else if memory.flawed >= FLAWED {
        "solutions are no orbits any more".into()
    } else {
        return None;
    };
    Some(Ending::because(point.omega, why))
}

fn point(
    body: &Propagator,
    (x, orbit): (&[f64], &Orbit),
    special: Option<&Special<Border>>,
    place: Option<(&Place<Chain>, &Memory)>,
) -> Result<PointRecord, OrbitError> {
    let mut flaws = orbit.flaws();
    if orbit.viscous.is_some() && orbit.switches.is_empty() {
        flaws.push("no contact".into());
    }
    let of_border = |border: &Border, turns| border.kind(turns, &body.system);
    let kind = special.map_or(PointKind::Regular, |s| kind_of(s, of_border));
    let (orbit, special) = match flaws.is_empty() {
        true => (Some(record(body, orbit)?), kind),
        // what happens to the branch there does not depend on what the solution is
        false if kind.is_event() => (None, kind),
        false => (None, PointKind::Failed(flaws.join("; "))),
    };
    Ok(PointRecord {
        omega: x[x.len() - 1],
        special,
        orbit,
        place: place.map(|(place, memory)| place_record(place, memory.numbers())),
        ..PointRecord::default()
    })
}
