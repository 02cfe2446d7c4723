//! Damped orbits as a family: `X = (z, α, ω)` or `(z, ω)`, and the event-driven map itself, which reads the sequence of active sets anew every time.
//!
//! Motions of viscous bodies have as many corners as undamped ones, but neighbouring charts almost agree there: the branch need not stop at them. Where a
//! grazing bends it too much for any step, [`Mapped::over`] goes through the grazing itself; [`Mapped::across`] tries longer steps.

use std::collections::{BTreeMap, BTreeSet};

use faer::Mat;

use super::border::Border;
use super::chain::{Chain, Propagator};
use super::credentials::{Orbit, examine};
use super::grazing::{self, Coming, Ghost, from_to};
use super::section::{Section, later};
use super::shooting::{Closure, image, jacobian};
use super::{OrbitError, OrbitFamily, rounding_of, tolerate};
use crate::continuation::{self, Family, Judgement, Place, Units, norm};

/// How many switches each contact point has.
type Visits = BTreeMap<usize, usize>;

/// A family of damped orbits of one body: viscous nonlinear modes, or forced.
pub struct Mapped<'a> {
    body: &'a mut Propagator,
    closure: Closure,
    section: Section,
    examined: [Option<(Vec<f64>, Orbit)>; 2],
    /// Steps in a row that were short and no longer than the first of them, and how long that was.
    short: (usize, f64),
    /// The longest steps that are taken.
    longest: f64,
    /// What lies ahead of a point, where a step led astray.
    ahead: Option<(Vec<f64>, Crossing)>,
    /// The grazing that the branch went over last: it does not lie ahead.
    passed: Option<Vec<f64>>,
}

/// Steps of arclength over a corner that no shorter step passes.
const ACROSS: [f64; 4] = [0.02, 0.05, 0.1, 0.2];

/// The first step behind a grazing, over the way from there.
const SHORTER: f64 = 0.1;

/// So many steps in a row below so much of the longest one are those of a branch that comes to a grazing; behind one they are short, too, and grow.
const SHORT: (usize, f64) = (5, 4e-3);

/// A visit of less than this part of the period is one that a turn of the branch may belong to.
const BRIEF: f64 = 5e-3;

/// A grazing within so many steps from where a step began lies in it; one that is as many of the longest away does not stop short ones.
const WITHIN: f64 = 2.0;

/// Further grazings lie within so much of a step over a first one, and are another one where they are so far from it.
const BEYOND: f64 = 1.1;
const SAME: f64 = 1e-6;

/// How far along the branch neighbours are carried to another section, of arclength.
const ALONG: f64 = 1e-6;

/// An orbit this near to a grazing, over the unit of length, is at one.
const GRAZING: f64 = 1e-3;

/// How far grazings are looked for, and how long a march along the ghost branch may be where Newton's method finds none.
#[derive(Clone, Copy)]
struct Reach {
    within: f64,
    march: Option<f64>,
}

impl Reach {
    /// Of a step of some length.
    fn of(length: f64) -> Reach {
        Reach { march: Some(WITHIN * length), ..Reach::without_march(length) }
    }

    fn without_march(length: f64) -> Reach {
        Reach { within: WITHIN * length, march: None }
    }
}

impl<'a> Mapped<'a> {
    /// The family of a body whose orbits close in a way, followed in steps of arclength up to `longest`.
    pub fn new(body: &'a mut Propagator, closure: Closure, longest: f64) -> Mapped<'a> {
        let section = Section::new(body, closure.periods());
        Mapped {
            body,
            closure,
            section,
            examined: [None, None],
            short: (0, 0.0),
            longest,
            ahead: None,
            passed: None,
        }
    }

    /// What the map says, or nothing where it cannot be evaluated.
    fn evaluate(&mut self, x: &[f64], derive: bool) -> Result<Option<Evaluated>, OrbitError> {
        evaluated(self.body, self.closure, x, derive)
    }

    /// The branch behind a corner that no short step passes: the first of some longer ones that leads to an orbit. `x` and a tangent there.
    pub(super) fn across(
        &mut self,
        place: &Place<Chain>,
    ) -> Result<Option<Place<Chain>>, OrbitError> {
        for s in ACROSS {
            let (x, t) = (&place.x, &place.tangent);
            let predicted: Vec<f64> = x.iter().zip(t).map(|(x, t)| x + s * t).collect();
            let c: Vec<f64> = self.weights(x).iter().zip(t).map(|(w, t)| w * t).collect();
            let gamma = c.iter().zip(&predicted).map(|(c, x)| c * x).sum();
            let Some(found) = continuation::correct(self, &predicted, &c, gamma)? else { continue };
            let off = found.x.iter().zip(&predicted).zip(self.weights(&predicted));
            let off: f64 = off.map(|((a, b), w)| w * (a - b).powi(2)).sum();
            if off.sqrt() > 2.0 * s {
                continue;
            }
            let Some((tangent, orientation)) = continuation::tangent(self, &found.x, &c)? else {
                continue;
            };
            let signature = self.signature(&found.x)?;
            let step = 0.1 * s;
            let chart = self.chart();
            return Ok(Some(Place { x: found.x, tangent, step, chart, orientation, signature }));
        }
        Ok(None)
    }

    /// The scalar product of arclength at a point.
    fn product(&self, x: &[f64]) -> impl Fn(&[f64], &[f64]) -> f64 + use<> {
        let weights = self.weights(x);
        move |a, b| a.iter().zip(b).zip(&weights).map(|((a, b), w)| w * a * b).sum()
    }

    /// Whether a point lies in the step from one to another.
    fn inside(&self, from: &[f64], to: &[f64]) -> impl Fn(&[f64]) -> bool + use<> {
        let (dot, from, way) = (self.product(from), from.to_vec(), from_to(from, to));
        move |at| (0.0..=BEYOND).contains(&(dot(&from_to(&from, at), &way) / dot(&way, &way)))
    }

    /// The grazings of the points that `is_asked` names ahead on the branch, the nearest first.
    fn grazings(
        &mut self,
        place: &Place<Chain>,
        march: Option<f64>,
        is_asked: impl Fn(usize) -> bool,
    ) -> Result<Vec<Ghost>, OrbitError> {
        if !self.goes_over() {
            return Ok(vec![]);
        }
        let weights = self.weights(&place.x);
        let passed = self.passed.as_deref();
        let coming = Coming { place, weights: &weights, passed, march };
        grazing::ahead(self.body, self.closure, &coming, is_asked)
    }

    /// Whether branches of the family go over grazings.
    fn goes_over(&self) -> bool {
        let is_smooth = self.body.system.impact().is_none() && !self.body.is_large();
        self.closure.is_forced() && is_smooth
    }

    /// The first of some grazings ahead of an orbit with the visits `before` behind which the branch is found: an orbit with other visits.
    fn crossing(
        &mut self,
        before: &Visits,
        found: &[Ghost],
    ) -> Result<Option<Crossing>, OrbitError> {
        for ghost in found {
            let Some(behind) = grazing::behind(self.body, self.closure, ghost)? else { continue };
            // what comes of segments may not be a motion that can be followed
            let after = tolerate(self.visits(&behind))?;
            if let Some(after) = after.filter(|after| after != before) {
                let (at, border) = (ghost.at.clone(), ghost.border());
                return Ok(Some(Crossing { at, border, behind, after }));
            }
        }
        Ok(None)
    }

    /// The same, of grazings with which nothing else changes: neither there nor behind them are other visits than those that graze.
    fn sole_crossing(
        &mut self,
        before: &Visits,
        found: &[Ghost],
    ) -> Result<Option<Crossing>, OrbitError> {
        for ghost in found {
            let Some(crossing) = self.crossing(before, std::slice::from_ref(ghost))? else {
                continue;
            };
            let Crossing { at, border, after, .. } = &crossing;
            if border.explains(changes(before, after)) && self.is_sole(before, at, border)? {
                return Ok(Some(crossing));
            }
        }
        Ok(None)
    }

    /// Whether an orbit that grazes has the visits `before`, but for those of the points that graze; as far as its motion can be followed.
    fn is_sole(
        &mut self,
        before: &Visits,
        at: &[f64],
        border: &Border,
    ) -> Result<bool, OrbitError> {
        let there = tolerate(self.visits(at))?;
        Ok(there.is_none_or(|there| border.explains(changes(before, &there))))
    }

    /// The grazings of some points (of any, where none are named) ahead of a place and within reach of it, the nearest first.
    fn near(
        &mut self,
        place: &Place<Chain>,
        points: &[usize],
        reach: Reach,
    ) -> Result<Vec<Ghost>, OrbitError> {
        let is_asked = |p| points.is_empty() || points.contains(&p);
        let mut found = self.grazings(place, reach.march, is_asked)?;
        let dot = self.product(&place.x);
        let distance = |ghost: &Ghost| {
            let way = from_to(&place.x, &ghost.at);
            dot(&way, &way).sqrt()
        };
        found.retain(|ghost| distance(ghost) <= reach.within);
        found.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        Ok(found)
    }

    /// The next grazing of some points behind another one.
    fn behind(
        &mut self,
        points: &[usize],
        (from, last): (&Place<Chain>, &Crossing),
        reach: Reach,
    ) -> Result<Option<Crossing>, OrbitError> {
        if points.is_empty() {
            return Ok(None);
        }
        let Some((tangent, ..)) = self.leaving(last)? else { return Ok(None) };
        let place = Place { x: last.behind.clone(), tangent, ..from.clone() };
        let found = self.near(&place, points, reach)?;
        self.sole_crossing(&last.after, &found)
    }

    /// Grazings behind a first one in a step, as far as they are found: of the points that change and are not among those of `all` yet; the last of them. What one step loses
    /// may be a visit in whose midst another is.
    fn further(
        &mut self,
        from: &Place<Chain>,
        changed: &[usize],
        (mut last, reach): (Crossing, Reach),
        all: &mut Vec<Told>,
    ) -> Result<Crossing, OrbitError> {
        loop {
            let is_known =
                |p: &usize| all.iter().any(|(_, border)| border.points().any(|q| q == *p));
            let left: Vec<usize> = changed.iter().copied().filter(|p| !is_known(p)).collect();
            let Some(next) = self.behind(&left, (from, &last), reach)? else { return Ok(last) };
            all.push(next.told());
            self.passed = Some(next.at.clone());
            last = next;
        }
    }

    /// All grazings of a step from a point to `to`, where an orbit has the visits `wanted`: the first of them is one of those found ahead, behind the last the branch leads there.
    fn leading_to(
        &mut self,
        (from, before): (&Place<Chain>, &Visits),
        (to, wanted): (&[f64], &Visits),
        (found, changed): (&[Ghost], &[usize]),
        reach: Reach,
    ) -> Result<Option<Vec<Told>>, OrbitError> {
        let (dot, is_inside) = (self.product(&from.x), self.inside(&from.x, to));
        let passed = self.passed.clone();
        for ghost in found {
            let Some(first) = self.sole_crossing(before, std::slice::from_ref(ghost))? else {
                continue;
            };
            let mut all = vec![first.told()];
            self.passed = Some(first.at.clone());
            let last = self.further(from, changed, (first, reach), &mut all)?;
            let leads_there = last.after == *wanted && last.leads_to(to, &dot);
            if leads_there && all.iter().all(|(at, _)| is_inside(at)) {
                return Ok(Some(all));
            }
            self.passed.clone_from(&passed);
        }
        Ok(None)
    }

    /// What a step from a point lost, by the grazings of the points that changed behind where it led to, `x` with the tangent there: on that side a branch may be smooth up
    /// to them where it is not on the other. Those that are found; there may be others before them.
    fn looking_back(
        &mut self,
        from: &Place<Chain>,
        (x, tangent, visits): (&[f64], &[f64], &Visits),
        changed: &[usize],
        reach: Reach,
    ) -> Result<Vec<Told>, OrbitError> {
        if changed.is_empty() {
            return Ok(vec![]);
        }
        let back = tangent.iter().map(|t| -t).collect();
        let place = Place { x: x.to_vec(), tangent: back, ..from.clone() };
        let found = self.near(&place, changed, reach)?;
        let Some(nearest) = self.sole_crossing(visits, &found)? else { return Ok(vec![]) };
        let mut all = vec![nearest.told()];
        let passed = self.passed.replace(nearest.at.clone());
        self.further(&place, changed, (nearest, reach), &mut all)?;
        let is_inside = self.inside(&from.x, x);
        all.retain(|(at, _)| is_inside(at));
        self.passed = all.first().map(|(at, _)| at.clone()).or(passed);
        all.reverse();
        Ok(all)
    }

    /// Right behind a grazing: the tangent away from it, the orientation, and the way from there.
    fn leaving(&mut self, crossing: &Crossing) -> Result<Option<(Vec<f64>, f64, f64)>, OrbitError> {
        let x = &crossing.behind;
        let way = from_to(&crossing.at, x);
        let c: Vec<f64> = self.weights(x).iter().zip(&way).map(|(w, d)| w * d).collect();
        let length = way.iter().zip(&c).map(|(d, c)| d * c).sum::<f64>().sqrt();
        let found = continuation::tangent(self, x, &c)?;
        Ok(found.map(|(tangent, orientation)| (tangent, orientation, length)))
    }

    /// Why the motion a short step ahead of a place cannot be followed, where that is so.
    pub(super) fn unfollowed(
        &mut self,
        place: &Place<Chain>,
    ) -> Result<Option<String>, OrbitError> {
        let ahead = place.x.iter().zip(&place.tangent).map(|(x, t)| x + ACROSS[0] * t);
        match self.look(&ahead.collect::<Vec<f64>>(), false) {
            Err(why) if why.is_of_one_motion() => {
                Ok(Some(format!("the motion right ahead cannot be followed: {why}")))
            }
            looked => looked.map(|_| None),
        }
    }

    /// The grazing at which a branch is stuck, and the branch behind it.
    pub(super) fn over(
        &mut self,
        place: &Place<Chain>,
    ) -> Result<Option<(Crossing, Place<Chain>)>, OrbitError> {
        self.short = (0, 0.0);
        let crossing = match self.ahead.take().filter(|(x, _)| *x == place.x) {
            Some((_, crossing)) => Some(crossing),
            None => {
                let found = self.near(place, &[], Reach::without_march(self.longest))?;
                let before = self.visits(&place.x)?;
                self.crossing(&before, &found)?
            }
        };
        let Some(crossing) = crossing else { return Ok(None) };
        let Some((tangent, orientation, length)) = self.leaving(&crossing)? else {
            return Ok(None);
        };
        let x = crossing.behind.clone();
        let signature = self.signature(&x)?;
        self.passed = Some(crossing.at.clone());
        let (step, chart) = (SHORTER * length, self.chart());
        Ok(Some((crossing, Place { x, tangent, step, chart, orientation, signature })))
    }

    /// The orbit from the section on.
    fn seen(&mut self, x: &[f64]) -> Result<Orbit, OrbitError> {
        if let Some(orbit) = self.known(x) {
            return Ok(orbit.clone());
        }
        let orbit = self.look(x, true)?;
        self.examined.rotate_right(1);
        self.examined[0] = Some((x.to_vec(), orbit.clone()));
        Ok(orbit)
    }

    /// How many switches each contact point has in an orbit; its multipliers are not asked for.
    fn visits(&mut self, x: &[f64]) -> Result<Visits, OrbitError> {
        match self.known(x) {
            Some(orbit) => Ok(counts(orbit)),
            None => Ok(counts(&self.look(x, false)?)),
        }
    }

    /// An orbit that was examined lately.
    fn known(&self, x: &[f64]) -> Option<&Orbit> {
        self.examined.iter().flatten().find(|(known, _)| known == x).map(|(_, orbit)| orbit)
    }

    fn look(&mut self, x: &[f64], multipliers: bool) -> Result<Orbit, OrbitError> {
        let (omega, z) = x.split_last().ok_or(OrbitError::Eigen("unknowns"))?;
        let closure = self.closure;
        self.body.system.loads_mut().set_frequency(*omega);
        examine(self.body, closure, z, closure.period(*omega), 0, multipliers)
    }

    /// Whether a place is near a grazing.
    pub(super) fn is_grazing(&mut self, x: &[f64]) -> Result<bool, OrbitError> {
        Ok(self.seen(x)?.grazing < GRAZING)
    }
}

/// The residual of the map at `(z, ω)` (viscous: `(z, α, ω)`) with its derivative, if that is asked for; nothing where it cannot be evaluated.
pub(super) fn evaluated(
    body: &mut Propagator,
    closure: Closure,
    x: &[f64],
    derive: bool,
) -> Result<Option<Evaluated>, OrbitError> {
    let (omega, z) = x.split_last().ok_or(OrbitError::Eigen("unknowns"))?;
    let n = body.n();
    body.system.loads_mut().set_frequency(*omega);
    let period = closure.period(*omega);
    let Some(at) = tolerate(image(body, closure, z, period))? else { return Ok(None) };
    let mut j = Mat::zeros(0, 0);
    if derive {
        j = jacobian(body, closure, &at, true)?;
        // the end moves with the frequency: dT/dω = −T/ω
        let last = j.ncols() - 1;
        let rate = at.rate_end();
        // of a reversible orbit the velocities at half a period
        let (rows, offset) = if closure == Closure::Reversible { (n, n) } else { (2 * n, 0) };
        let end = closure.end(period);
        (0..rows).for_each(|i| j[(i, last)] -= end / omega * rate[offset + i]);
    }
    Ok(Some((at.r, j)))
}

/// How many switches each contact point has in an orbit.
fn counts(orbit: &Orbit) -> Visits {
    let mut counts = BTreeMap::new();
    orbit.switches.iter().for_each(|s| *counts.entry(s.point).or_default() += 1);
    counts
}

/// The points of which there are more switches in one of two orbits than in the other; a point without any stands in none.
fn changes<'v>(a: &'v Visits, b: &'v Visits) -> impl Iterator<Item = usize> {
    let all: BTreeSet<usize> = a.keys().chain(b.keys()).copied().collect();
    all.into_iter().filter(|p| a.get(p) != b.get(p))
}

/// The duration of the shortest visit of an orbit, over its period.
fn shortest(orbit: &Orbit) -> f64 {
    let switches = &orbit.switches;
    let pairs = switches.iter().zip(switches.iter().skip(1)).filter(|(a, b)| a.point == b.point);
    pairs.map(|(a, b)| b.t - a.t).fold(f64::INFINITY, f64::min) / orbit.period
}

/// A grazing that a branch goes over, in the unknowns of the map.
pub(super) struct Crossing {
    /// The orbit that grazes.
    pub at: Vec<f64>,
    /// Which contact.
    pub border: Border,
    /// An orbit right behind it, with its visits.
    behind: Vec<f64>,
    after: Visits,
}

/// A grazing that a step went over: the orbit, and which contact.
type Told = (Vec<f64>, Border);

impl Crossing {
    fn told(&self) -> Told {
        (self.at.clone(), self.border.clone())
    }

    /// Whether the branch goes on from it towards a point.
    fn leads_to(&self, x: &[f64], dot: &impl Fn(&[f64], &[f64]) -> f64) -> bool {
        dot(&from_to(&self.at, &self.behind), &from_to(&self.at, x)) > 0.0
    }
}

/// A residual and its derivative.
pub(super) type Evaluated = (Vec<f64>, Mat<f64>);

impl OrbitFamily for Mapped<'_> {
    /// As it is from the origin of time on.
    fn orbit(&mut self, x: &[f64]) -> Result<Orbit, OrbitError> {
        let orbit = self.seen(x)?;
        let left = self.section.until(0.0);
        if left == 0.0 {
            return Ok(orbit);
        }
        let (omega, z) = x.split_last().ok_or(OrbitError::Eigen("unknowns"))?;
        let z = later(self.body, z, *omega, left)?;
        let state = self.body.state(&z);
        Ok(orbit.counted_from(left / self.closure.periods() as f64, z, state))
    }

    fn body(&self) -> &Propagator {
        self.body
    }

    fn section(&self) -> f64 {
        self.section.at()
    }

    fn set_section(&mut self, at: f64) {
        if at != self.section.at() {
            self.section.set(self.body, at);
            self.examined = [None, None];
            (self.ahead, self.passed) = (None, None);
        }
    }

    fn moved(&mut self, place: &Place<Chain>) -> Result<Option<Place<Chain>>, OrbitError> {
        if !self.closure.is_forced() {
            return Ok(None);
        }
        let seen = self.seen(&place.x)?;
        let Some(at) = self.section.better(&seen) else { return Ok(None) };
        let (from, periods) = (self.section.at(), self.section.until(at));
        let n = place.x.len() - 1;
        let along = |share: f64| -> Vec<f64> {
            place.x.iter().zip(&place.tangent).map(|(x, t)| x + share * t).collect()
        };
        let mut there = |share: f64| -> Result<Option<Vec<f64>>, OrbitError> {
            let x = along(share);
            let z = tolerate(later(self.body, &x[..n], x[n], periods))?;
            Ok(z.map(|z| [z, vec![x[n]]].concat()))
        };
        // the tangent is carried along by differences: it is the direction of the next step, and made exact below
        let ends = (there(-ALONG)?, there(0.0)?, there(ALONG)?);
        let (Some(before), Some(x), Some(behind)) = ends else { return Ok(None) };
        self.set_section(at);
        let carried = behind.iter().zip(&before).map(|(b, a)| (b - a) / (2.0 * ALONG));
        let c: Vec<f64> = self.weights(&x).iter().zip(carried).map(|(w, t)| w * t).collect();
        let Some((tangent, orientation)) = continuation::tangent(self, &x, &c)? else {
            self.set_section(from);
            return Ok(None);
        };
        let signature = self.signature(&x)?;
        let (step, chart) = (place.step, self.chart());
        Ok(Some(Place { x, tangent, step, chart, orientation, signature }))
    }
}

impl Family for Mapped<'_> {
    type Chart = Chain;
    type Border = Border;
    type Error = OrbitError;

    fn residual(&mut self, x: &[f64]) -> Result<Vec<f64>, OrbitError> {
        Ok(self.evaluate(x, false)?.map_or_else(|| vec![f64::NAN; x.len() - 1], |(r, _)| r))
    }

    fn linearise(&mut self, x: &[f64]) -> Result<Evaluated, OrbitError> {
        let nowhere = || (vec![f64::NAN; x.len() - 1], Mat::zeros(x.len() - 1, x.len()));
        Ok(self.evaluate(x, true)?.unwrap_or_else(nowhere))
    }

    fn units(&self) -> Units {
        let frequency = self.body.system.units.frequency;
        let (all, of_state) = self.closure.sizes(self.body.n());
        // behind the state α, where there is one, and ω
        let mut unknowns = vec![self.body.unit; of_state];
        unknowns.resize(all + 1, frequency);
        Units { unknowns, residual: self.body.unit }
    }

    fn rounding(&self, x: &[f64]) -> f64 {
        let n = self.closure.sizes(self.body.n()).1;
        rounding_of(&x[..n])
    }

    fn weights(&self, x: &[f64]) -> Vec<f64> {
        let n = self.closure.sizes(self.body.n()).1;
        let size = norm(&x[..n]).max(1e-300);
        let of_state = (0..n).map(|_| 1.0 / (size * size));
        let omega = x[x.len() - 1];
        let others = match self.closure {
            Closure::Viscous(pin) => pin.weights().to_vec(),
            _ => vec![4.0 / (omega * omega)],
        };
        of_state.chain(others).collect()
    }

    fn chart(&self) -> Chain {
        Chain::default()
    }

    fn set_chart(&mut self, _: &Chain) {}

    /// A step that changes the number of visits of one contact point leaps over a grazing; one that turns the frequency back while a visit is brief, or the last of a
    /// few short ones, comes to one. The branch behind it says whether the step went there.
    fn judge(
        &mut self,
        from: &Place<Chain>,
        x: &[f64],
        tangent: &[f64],
    ) -> Result<Judgement<Border>, OrbitError> {
        let (dot, way) = (self.product(&from.x), from_to(&from.x, x));
        let length = dot(&way, &way).sqrt();
        self.short = match self.short {
            _ if length >= SHORT.1 * self.longest => (0, 0.0),
            (_, first) if length > first => (1, length),
            (count, first) => (count + 1, first),
        };
        if !self.goes_over() {
            return Ok(Judgement::Along);
        }
        let (before, after) = (self.seen(&from.x)?, self.seen(x)?);
        let (a, b) = (counts(&before), counts(&after));
        let changed: Vec<usize> = changes(&a, &b).collect();
        let last = x.len() - 1;
        let turned = from.tangent[last] * tangent[last] < 0.0;
        let brief = shortest(&before).min(shortest(&after)) < BRIEF || before.grazing < GRAZING;
        let is_stuck = self.short.0 >= SHORT.0;
        if changed.is_empty() && !(brief && (turned || is_stuck)) {
            return Ok(Judgement::Along);
        }
        let reach = if is_stuck { Reach::without_march(self.longest) } else { Reach::of(length) };
        let found = self.near(from, &changed, reach)?;
        if !changed.is_empty() {
            let (step, lost) = ((from, &a), (&found[..], &changed[..]));
            if let Some(all) = self.leading_to(step, (x, &b), lost, reach)? {
                return Ok(Judgement::Over(all));
            }
        }
        let Some(crossing) = self.crossing(&a, &found)? else {
            let back = self.looking_back(from, (x, tangent, &b), &changed, reach)?;
            return Ok(if back.is_empty() { Judgement::Along } else { Judgement::Over(back) });
        };
        if !changed.is_empty() && crossing.leads_to(x, &dot) {
            let is_inside = self.inside(&from.x, x);
            let mut all = vec![crossing.told()];
            for (border, at) in found.into_iter().map(|ghost| (ghost.border(), ghost.at)) {
                // in the step, and another one
                let is_known = all.iter().any(|(x, known): &Told| {
                    let apart = from_to(x, &at);
                    let shares = border.points().any(|p| known.points().any(|q| p == q));
                    shares && dot(&apart, &apart).sqrt() < SAME
                });
                if is_inside(&at) && !is_known && self.is_sole(&crossing.after, &at, &border)? {
                    all.push((at, border));
                }
            }
            self.passed = Some(crossing.at.clone());
            self.further(from, &changed, (crossing, reach), &mut all)?;
            return Ok(Judgement::Over(all));
        }
        self.ahead = Some((from.x.clone(), crossing));
        Ok(Judgement::Astray)
    }

    fn signature(&mut self, x: &[f64]) -> Result<Vec<i64>, OrbitError> {
        let orbit = self.seen(x)?;
        Ok(orbit.stability.map_or(vec![], |s| s.outside.iter().map(|&k| k as i64).collect()))
    }
}
