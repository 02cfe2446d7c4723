//! Curves of folds, doublings, Neimark–Sacker points, grazings and peaks over a number of the scene: from those of a response on.

use std::collections::BTreeMap;
use std::iter;

use super::follow::{BranchTask, response};
use super::known::Known;
use super::parameters::{of_equations, systems};
use super::{FamilyError, state_of};
use crate::contact::{State, System};
use crate::continuation::{Go, Options};
use crate::orbit::along::Start as From;
use crate::orbit::curve::{self, Point};
use crate::orbit::{Closure, Orbit, OrbitError, Propagator};
use crate::problem::ProblemError;
use crate::records::{
    Bifurcation, Branch, Curve, CurveOf, CurvePoint, CurvePointKind, Curves, PointKind,
    PointRecord, summits,
};
use crate::scenario::{Issue, Scene};

/// An orbit near which a curve is looked for.
#[derive(Debug, Clone)]
pub struct Start {
    /// The orbit, and those beside it on its branch: frequency and state.
    near: Vec<(f64, State)>,
    /// Periods of the loads in it.
    periods: usize,
    /// What grazes.
    contact: Option<usize>,
    amplitude: f64,
}

/// What is looked for.
#[derive(Debug, Clone)]
pub struct Asked<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// What is singled out.
    pub of: CurveOf,
    /// Key of the number.
    pub key: &'a str,
    /// Its range.
    pub range: (f64, f64),
    /// Frequencies beyond which curves are not followed.
    pub frequencies: (f64, f64),
    /// Largest step of arclength.
    pub step: f64,
    /// Most points on either side of a start.
    pub points: usize,
}

/// The value of the number in the scene, if the equations depend on it and it lies within the range.
pub fn value(scene: &Scene, key: &str, (low, high): (f64, f64)) -> Result<f64, ProblemError> {
    let value = of_equations(scene, key)?;
    if !(low..=high).contains(&value) {
        let message = format!(
            "is {value} in the scene: curves begin there, and that is outside of {low} to {high}"
        );
        let help = "give a range around it, or a scene with another value";
        return Err(scene.error(Issue::new(key, message, help)).into());
    }
    // a little larger, or a little smaller where that is no scene
    let beside = |share: f64| scene.with_number(key, value + share * value.abs().max(1e-3));
    if let (Err(_), Err(why)) = (beside(-1e-6), beside(1e-6)) {
        return Err(why.into());
    }
    Ok(value)
}

/// The orbits of a response, followed in a range, that are singled out.
pub fn of_response(
    body: &mut Propagator,
    (of, range, step): (CurveOf, (f64, f64), f64),
    first: impl FnOnce(&mut Propagator) -> Result<Result<From, String>, FamilyError>,
    mut go_on: impl FnMut(f64) -> Go,
) -> Result<Vec<Start>, FamilyError> {
    let known = Known::default();
    // folds and grazings are located anyway
    let locate = matches!(of, CurveOf::Doubling | CurveOf::Torus);
    let options =
        Options { range, step: (0.2 * step, 1e-9, step), points: 5000, locate, natural: false };
    let task = BranchTask { index: 0, known: &known, options: &options, points_suffice: true };
    let mut found = vec![];
    let mut take = |point: PointRecord| {
        let go = go_on(point.omega);
        found.push(point);
        go
    };
    let end = response(body, task, first, &mut take)?;
    if found.is_empty() {
        return Err(FamilyError::NoStart(end.text));
    }
    Ok(starts(&body.system, of, &found, 1))
}

/// The orbits of a family that are singled out: of the branches of orbits.
pub fn of_family<'p>(
    system: &System,
    of: CurveOf,
    branches: impl Iterator<Item = (&'p Branch, Vec<&'p PointRecord>)>,
) -> Vec<Start> {
    let mut all = vec![];
    for (branch, points) in branches {
        let periods = match branch {
            Branch::Response { series: None, .. } => 1,
            Branch::Doubled { .. } => 2,
            Branch::Through { periods, .. } => *periods,
            _ => continue,
        };
        let points: Vec<PointRecord> = points.into_iter().cloned().collect();
        all.extend(starts(system, of, &points, periods));
    }
    all
}

/// Those among the points of a branch.
fn starts(system: &System, of: CurveOf, points: &[PointRecord], periods: usize) -> Vec<Start> {
    let begin = |p: &PointRecord, contact: Option<usize>| -> Option<Start> {
        let orbit = p.orbit.as_ref()?;
        let state = state_of(system, orbit);
        Some(Start { near: vec![(p.omega, state)], periods, contact, amplitude: orbit.amplitude })
    };
    if of == CurveOf::Peak {
        let with = points.iter().filter(|p| p.orbit.is_some());
        let with: Vec<&PointRecord> = with.collect();
        let row = with.iter().filter_map(|p| {
            let orbit = p.orbit.as_ref()?;
            Some([p.omega, orbit.amplitude, orbit.energy])
        });
        let tops = summits(0, row.collect());
        return tops.into_iter().filter_map(|(_, around)| begin(with[around[1]], None)).collect();
    }
    if of == CurveOf::Grazing {
        return grazings(system, points, &begin);
    }
    let mut all = vec![];
    for (k, p) in points.iter().enumerate() {
        let is_one = match (&p.special, of) {
            (PointKind::Fold, CurveOf::Fold) => true,
            (PointKind::Stability(change), CurveOf::Doubling) => {
                change.how == Bifurcation::PeriodDoubling
            }
            (PointKind::Stability(change), CurveOf::Torus) => {
                change.how == Bifurcation::NeimarkSacker
            }
            _ => false,
        };
        if !is_one {
            continue;
        }
        // the orbit itself, where it is one, and those on both sides
        let beside = [points[..k].iter().next_back(), points.get(k + 1)];
        let mut all_near =
            iter::once(Some(p)).chain(beside).flatten().filter_map(|p| begin(p, None));
        if let Some(mut start) = all_near.next() {
            start.near.extend(all_near.flat_map(|s| s.near));
            all.push(start);
        }
    }
    all
}

/// Where the number of switches of a contact point changes from one orbit of a branch to the next: the one of both that comes nearer to grazing.
fn grazings(
    system: &System,
    points: &[PointRecord],
    begin: &dyn Fn(&PointRecord, Option<usize>) -> Option<Start>,
) -> Vec<Start> {
    let with: Vec<&PointRecord> = points.iter().filter(|p| p.orbit.is_some()).collect();
    let counts = |p: &PointRecord| {
        let mut counts = BTreeMap::<usize, usize>::new();
        let switches = p.orbit.iter().flat_map(|o| &o.switches);
        switches.for_each(|s| *counts.entry(s.1).or_default() += 1);
        counts
    };
    let mut all = vec![];
    for two in with.windows(2).filter(|two| !two[1].special.is_another_motion()) {
        let (before, behind) = (counts(two[0]), counts(two[1]));
        let changed = |node: usize| before.get(&node) != behind.get(&node);
        let nearer = |p: &PointRecord| p.orbit.as_ref().map_or(f64::INFINITY, |o| o.grazing);
        let near = if nearer(two[0]) < nearer(two[1]) { two[0] } else { two[1] };
        let of_node = |c: &(usize, _)| changed(c.1);
        let points = system.constraints.iter().map(|c| c.node).enumerate();
        let contacts: Vec<usize> = points.filter(of_node).map(|c| c.0).collect();
        all.extend(contacts.into_iter().filter_map(|contact| begin(near, Some(contact))));
    }
    all
}

/// Two orbits are one where frequencies and amplitudes differ by less than this part of the step between points of a curve.
const SAME: f64 = 0.1;
/// The same beyond all steps, relative.
const NEAR: f64 = 1e-7;
/// So many points in a row that lie on another curve, this near, run along it.
const TOGETHER: usize = 5;
const MET: f64 = 0.02;
/// A curve comes back to its start behind so many points.
const BACK: usize = 8;

/// A point as it is compared: frequency, value, amplitude, over their sizes.
fn glimpse(omega: f64, value: f64, amplitude: f64, unit: f64) -> [f64; 3] {
    [omega.ln(), value / unit, amplitude.max(f64::MIN_POSITIVE).ln()]
}

fn row(p: &CurvePoint, unit: f64) -> [f64; 3] {
    glimpse(p.omega, p.value, p.amplitude, unit)
}

/// The first of some curves that a point lies on.
fn on(known: &[Vec<[f64; 3]>], p: [f64; 3], within: f64) -> Option<usize> {
    known.iter().position(|c| c.windows(2).any(|two| is_between(two[0], two[1], p, within)))
}

/// Whether a point lies on the way from one to another.
fn is_between(a: [f64; 3], b: [f64; 3], p: [f64; 3], within: f64) -> bool {
    let minus = |x: [f64; 3], y: [f64; 3]| [x[0] - y[0], x[1] - y[1], x[2] - y[2]];
    let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let (way, to) = (minus(b, a), minus(p, a));
    let length = dot(way, way);
    if length == 0.0 {
        return false;
    }
    let s = dot(way, to) / length;
    let off = minus(to, way.map(|w| s * w));
    (-1e-9..=1.0 + 1e-9).contains(&s) && dot(off, off).sqrt() <= within * length.sqrt() + NEAR
}

/// Follow the curves through the starts; `go_on` is told of every point. Curves that come through another start are followed once.
pub fn follow(
    asked: &Asked,
    starts: &[Start],
    mut go_on: impl FnMut(usize, &Point) -> Go,
) -> Result<Curves, FamilyError> {
    let Asked { scene, of, key, range, frequencies, .. } = *asked;
    let value = scene.number(key).map_err(|e| OrbitError::Value(f64::NAN, e.to_string()))?;
    let unit = if value == 0.0 { range.0.abs().max(range.1.abs()) } else { value.abs() };
    let mut curves = Curves {
        of,
        key: key.into(),
        range: range.into(),
        frequencies: frequencies.into(),
        all: vec![],
        lost: vec![],
    };
    let mut make = systems(scene, key, value)?;
    let mut stopped = false;
    for (k, start) in starts.iter().enumerate() {
        let here = glimpse(start.omega(), value, start.amplitude, unit);
        let outside = !(frequencies.0..=frequencies.1).contains(&start.omega());
        let known: Vec<Vec<[f64; 3]>> = curves
            .all
            .iter()
            .map(|c| match c.periods == start.periods {
                true => c.points.iter().map(|p| row(p, unit)).collect(),
                false => vec![],
            })
            .collect();
        if stopped || outside || on(&known, here, SAME).is_some() {
            continue;
        }
        let closure = Closure::Forced(start.periods);
        let mut walk = curve::Curve::new(&mut make, (closure, of), (value, unit))?;
        let mut go = |point: &Point| {
            let go = go_on(k, point);
            stopped = go.is_break();
            go
        };
        match through(asked, start, (value, unit), (&mut walk, &known), &mut go) {
            Ok(Found::Curve(curve)) => curves.all.push(curve),
            // another curve has it, or a branch of fewer periods
            Ok(Found::Known) => {}
            Ok(Found::Nothing) => {
                let text = format!("no {} is found near omega = {:.8}", of.word(), start.omega());
                curves.lost.push(text);
            }
            Err(e) => curves.lost.push(format!("omega = {:.8}: {e}", start.omega())),
        }
    }
    Ok(curves)
}

/// What a start leads to.
enum Found {
    Curve(Curve),
    /// A point of a curve that is known, or an orbit of fewer periods, more than once.
    Known,
    Nothing,
}

/// The curve through a start, to both sides.
fn through(
    asked: &Asked,
    start: &Start,
    (value, unit): (f64, f64),
    (walk, known): (&mut curve::Curve, &[Vec<[f64; 3]>]),
    go_on: &mut dyn FnMut(&Point) -> Go,
) -> Result<Found, OrbitError> {
    let mut found = None;
    for (omega, state) in &start.near {
        if found.is_none() {
            found = walk.near((state, *omega), value, start.contact)?;
        }
    }
    let Some(x) = found else { return Ok(Found::Nothing) };
    let is_known = match walk.seen(&x)? {
        Some((omega, amplitude)) => on(known, glimpse(omega, value, amplitude, unit), SAME),
        None => None,
    };
    if is_known.is_some() || walk.is_repeated(&x)? {
        return Ok(Found::Known);
    }
    let Asked { of, range, frequencies, points, .. } = *asked;
    let step = (0.2 * asked.step, 1e-7, asked.step);
    let options = Options { range, step, points, locate: false, natural: false };
    let nothing = |why: &str| (vec![], why.to_owned());
    let mut sides: [(Vec<CurvePoint>, String); 2] =
        [nothing("interrupted"), nothing("interrupted")];
    let (mut closed, mut stopped, mut meets, mut node) = (false, false, false, None);
    for (side, direction) in [1.0, -1.0].into_iter().enumerate() {
        if closed || stopped {
            break;
        }
        // the start itself stands on the other side
        let is_end = [value >= range.1, value <= range.0][side];
        if is_end {
            sides[side] = nothing("end of the range");
            continue;
        }
        let mut points: Vec<CurvePoint> = vec![];
        let mut met = vec![];
        let ended = walk.follow(&x, direction, &options, frequencies, |point| {
            let there = glimpse(point.omega, point.value, point.orbit.amplitude, unit);
            if let [first, .., last] = &points[..]
                && points.len() > BACK
                && is_between(row(last, unit), there, row(first, unit), SAME)
            {
                closed = true;
                return Go::Break(());
            }
            stopped = go_on(&point).is_break();
            node = point.node;
            points.push(record(of, point));
            match on(known, there, MET) {
                Some(curve) => met.push(curve),
                None => met.clear(),
            }
            if stopped || met.len() >= TOGETHER { Go::Break(()) } else { Go::Continue(()) }
        });
        let runs_on = (met.len() >= TOGETHER).then(|| met[0]);
        meets |= runs_on.is_some();
        points.truncate(points.len() - if runs_on.is_some() { TOGETHER - 1 } else { 0 });
        let why = match (closed, stopped, ended) {
            (true, ..) => "comes back to its start".to_owned(),
            (_, false, _) if runs_on.is_some() => {
                format!("runs onto curve {}", runs_on.unwrap_or_default())
            }
            (_, true, _) => "interrupted".to_owned(),
            (.., Ok(why)) => why,
            // what was found up to there is worth keeping
            (.., Err(e)) => e.to_string(),
        };
        sides[side] = (points, why);
    }
    let [(up, above), (down, below)] = sides;
    // from one end to the other, the start once
    let again = usize::from(!up.is_empty());
    let points: Vec<CurvePoint> = down.into_iter().skip(again).rev().chain(up).collect();
    if meets && points.len() <= TOGETHER {
        return Ok(Found::Known);
    }
    let below = if closed { above.clone() } else { below };
    Ok(Found::Curve(Curve { periods: start.periods, node, points, ends: [below, above], closed }))
}

/// A point as a file keeps it.
fn record(of: CurveOf, point: Point) -> CurvePoint {
    let Point { omega, value, theta, kind, orbit, state: [u0, v0], .. } = point;
    let outside = outside(of, &orbit);
    let (amplitude, energy) = (orbit.amplitude, orbit.energy);
    CurvePoint { omega, value, theta, kind, amplitude, energy, outside, u0, v0 }
}

/// A multiplier that differs by less from what a curve is of is one that singles the orbit out.
const ON: f64 = 1e-5;

/// Multipliers outside of the unit circle.
fn outside(of: CurveOf, orbit: &Orbit) -> Option<usize> {
    let stability = orbit.stability.as_ref()?;
    let on = |m: &(f64, f64)| match of {
        CurveOf::Fold => (m.0 - 1.0).hypot(m.1) < ON,
        CurveOf::Doubling => (m.0 + 1.0).hypot(m.1) < ON,
        CurveOf::Torus => m.1 != 0.0 && (m.0.hypot(m.1) - 1.0).abs() < ON,
        CurveOf::Peak | CurveOf::Grazing => false,
    };
    let outside = |m: &&(f64, f64)| m.0.hypot(m.1) > 1.0 && !on(m);
    Some(stability.multipliers.iter().filter(outside).count())
}

impl Start {
    /// Its frequency.
    pub fn omega(&self) -> f64 {
        self.near.first().map_or(f64::NAN, |near| near.0)
    }
}

/// Whether a point is worth a word.
pub fn is_special(point: &CurvePoint) -> bool {
    !matches!(point.kind, CurvePointKind::Regular | CurvePointKind::Start)
}
