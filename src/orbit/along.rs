//! Families of orbits along the branch, through folds and corners.

use super::branch::{kind_of, place_record, record};
use super::chain::{Chain, Propagator};
use super::credentials::Orbit;
use super::mapped::Mapped;
use super::search::chain_of;
use super::segments::Segments;
use super::shooting::Closure;
use super::{OrbitError, OrbitFamily};
use crate::continuation::{self, Go, Options, Place, Special, Stop, norm};
use crate::records::{PointKind, PointRecord};

/// Where a branch begins.
pub enum Start {
    /// At an orbit, towards growing (`> 0`) or falling frequency.
    Orbit(Box<Orbit>, f64),
    /// Where an earlier continuation stood.
    Place(Place<Chain>),
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
    let (chain, start) = match start {
        Start::Place(place) => (place.chart.clone(), Begin::Place(place)),
        Start::Orbit(orbit, direction) => {
            body.system.loads_mut().set_frequency(orbit.omega());
            let (chain, times) = match mapped {
                true => (Chain { sets: vec![], nodes: vec![], struck: vec![] }, vec![]),
                false => chain_of(body, &orbit)?,
            };
            let x = orbit.z.iter().copied().chain(times).chain([orbit.omega()]).collect();
            (chain, Begin::At(x, direction))
        }
    };
    if mapped {
        return across_corners(&mut Mapped::new(body, closure), start, options, &mut take);
    }
    let mut family = Segments::new(body, closure, chain);
    let walked = along(&mut family, start, options, &mut Halfway::default(), &mut take)?;
    Ok(walked.map(|w| w.met.unwrap_or(Ending::of(w.stop))))
}

/// From so many contact points on a forced, viscous body passes more corners than multi-segment shooting, which locates every one, has steps for.
const MANY_CONTACTS: usize = 4;

/// Whether a family is followed on the event-driven map itself. Viscosity makes neighbouring charts almost agree: a branch passes hundreds of corners
/// without a stop. Bodies of few contact points have few corners, and some that turn the branch back, which the map alone takes for the way it came.
fn is_mapped(body: &Propagator, closure: Closure) -> bool {
    match closure {
        Closure::Viscous(_) => true,
        // velocities that jump are in the map, and in no segment
        _ if body.system.impact().is_some() => true,
        Closure::Forced(_) => {
            let is_viscous = body.system.damping.is_some_and(|d| d.beta > 0.0);
            is_viscous && body.system.n_contact() >= MANY_CONTACTS
        }
        Closure::Reversible | Closure::Autonomous => false,
    }
}

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
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Option<Ending>, OrbitError> {
    let (mut options, mut start) = (options.clone(), start);
    let mut halfway = Halfway::default();
    loop {
        let (mut count, mut flawed, mut end) = (0, 0, None);
        let unit = family.body().system.units.length;
        let mut counted = |p: PointRecord| {
            count += 1;
            flawed = if p.orbit.is_none() { flawed + 1 } else { 0 };
            let (omega, amplitude) = (p.omega, p.orbit.as_ref().map_or(0.0, |o| o.amplitude));
            if amplitude > UNBOUNDED * unit {
                end = Some(Ending::because(
                    omega,
                    format!("the motion grows beyond {UNBOUNDED} times the gap"),
                ));
            } else if flawed >= FLAWED {
                end = Some(Ending::because(omega, "solutions are no orbits any more".into()));
            }
            let go = take(p);
            if end.is_some() { Go::Break(()) } else { go }
        };
        let walked = along(family, start, &options, &mut halfway, &mut counted)?;
        let Some(Walked { stop, last, met }) = walked else { return Ok(None) };
        if met.is_some() {
            return Ok(met);
        }
        options.points = options.points.saturating_sub(count);
        if end.is_some() {
            return Ok(end);
        }
        let Stop::Step { .. } = stop else { return Ok(Some(Ending::of(stop))) };
        let grazing = family.grazing(&last.x)?;
        // what was not passed right behind a corner is not passed by trying again
        let behind = match count > 3 && options.points > 0 && !options.natural {
            true => match family.around(&last)? {
                Some(place) => Some(place),
                None if grazing.is_some() => family.across(&last)?,
                None => None,
            },
            false => None,
        };
        let Some(place) = behind else {
            let why =
                grazing.map(|what| format!("a {what}, and no step across finds another side"));
            return Ok(Some(Ending { stop, why, met: false }));
        };
        let special = Special::Border(grazing.unwrap_or_else(|| "corner".into()));
        let point = point(family, &place.x, Some(&special), Some(&place))?;
        if take(point).is_break() {
            return Ok(Some(Ending::of(Stop::Interrupted)));
        }
        start = Begin::Place(place);
    }
}

/// How a family ended, and where.
struct Walked {
    stop: Stop,
    last: Place<Chain>,
    /// It met the branch that it came from.
    met: Option<Ending>,
}

/// A subharmonic branch on its way: behind a period doubling come the same orbits again, one period of the loads later.
#[derive(Default)]
struct Halfway {
    last: Option<Vec<f64>>,
    largest: f64,
}

/// At the fold of a period doubling an orbit differs from itself one period later by less than this, over the most on its branch.
const AT_DOUBLING: f64 = 0.02;

impl Halfway {
    /// Whether the branch has come to a period doubling.
    fn is_doubling(&mut self, orbit: &Orbit, special: Option<&Special>) -> bool {
        let Some(now) = &orbit.halfway else { return false };
        let size = norm(now);
        self.largest = self.largest.max(size);
        let dot = |a: &[f64]| a.iter().zip(now).map(|(a, b)| a * b).sum::<f64>();
        let turned = self.last.as_deref().is_some_and(|last| dot(last) < 0.0);
        let at_fold = special == Some(&Special::Fold) && size < AT_DOUBLING * self.largest;
        self.last = Some(now.clone());
        turned || at_fold
    }
}

/// Follow a family; how that ended, and where.
fn along<F: OrbitFamily>(
    family: &mut F,
    start: Begin,
    options: &Options,
    halfway: &mut Halfway,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Option<Walked>, OrbitError> {
    let place = match start {
        Begin::Place(place) => place,
        Begin::At(x, direction) => {
            let Some(place) = Place::start(family, x, direction, options.step.0)? else {
                return Ok(None);
            };
            let point = point(family, &place.x, Some(&Special::Start), Some(&place))?;
            if take(point).is_break() {
                return Ok(Some(Walked { stop: Stop::Interrupted, last: place, met: None }));
            }
            place
        }
    };
    let (mut failed, mut met) = (None, None);
    let mut last = place.clone();
    let stop = continuation::follow(family, place, options, |family, p| {
        let at = p.x[p.x.len() - 1];
        match family.orbit(&p.x).map(|orbit| halfway.is_doubling(&orbit, p.special.as_ref())) {
            Ok(true) => {
                let why = format!(
                    "meets the orbits of one period of the loads at omega = {at:.8}: a period doubling"
                );
                met = Some(Ending { stop: Stop::Interrupted, why: Some(why), met: true });
                return Go::Break(());
            }
            Ok(false) => {}
            Err(e) => {
                failed = Some(e);
                return Go::Break(());
            }
        }
        // a special point inside a step is no place to go on from: the step is made anew
        let regular = matches!(p.special, None | Some(Special::Border(_)));
        let place = regular.then_some(&p.place);
        if regular {
            last = p.place.clone();
        }
        match point(family, &p.x, p.special.as_ref(), place) {
            Ok(point) => take(point),
            Err(e) => {
                failed = Some(e);
                Go::Break(())
            }
        }
    })?;
    match failed {
        Some(e) => Err(e),
        None => Ok(Some(Walked { stop, last, met })),
    }
}

fn point<F: OrbitFamily>(
    family: &mut F,
    x: &[f64],
    special: Option<&Special>,
    place: Option<&Place<Chain>>,
) -> Result<PointRecord, OrbitError> {
    let orbit = family.orbit(x)?;
    let mut flaws = orbit.flaws();
    if orbit.viscous.is_some() && orbit.switches.is_empty() {
        flaws.push("no contact".into());
    }
    let kind = special.map_or(PointKind::Regular, kind_of);
    let (orbit, special) = if flaws.is_empty() {
        (Some(record(family.body(), &orbit)?), kind)
    } else {
        (None, PointKind::Failed(flaws.join("; ")))
    };
    Ok(PointRecord {
        omega: x[x.len() - 1],
        special,
        orbit,
        place: place.map(place_record),
        ..PointRecord::default()
    })
}
