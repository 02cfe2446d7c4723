//! Over a grazing of a branch of orbits, with the node that grazes and its frequency.
//!
//! At a grazing a visit of a contact point begins or ends to be: a touch, or a moment in which a resting point leaves. There the map has a corner (the depth `d` of a
//! visit enters by `√d`) or bends by `d^{3/2}` within depths of 10⁻⁹ gaps: no step test of the map passes it, or Newton's method leaps over it and comes back the way
//! it came. Two other branches are smooth there:
//!
//! - the *ghost branch*, of the motions that do not know of the visit ([`super::segments`], in the chart without it): the grazing is where the least value of the
//!   point's monitor is zero on it, and where the point stays away it is the branch itself;
//! - the branch with the duration `τ` of the visit among its unknowns: where the point comes it begins with `τ` small and given.

use super::border::Border;
use super::chain::{Chain, Propagator};
use super::period_map::integrate;
use super::segments::Segments;
use super::shooting::Closure;
use super::touch::Minima;
use super::visits::{MOMENT, Visit, is_like, is_moment, merged, switches_of, thinned, visits};
use super::{OrbitError, tolerate};
use crate::contact::{PointState, States};
use crate::continuation::{Family, Place, correct, dot, tangent};

/// Misses within so many units of length, and visits of so much of the period, may become grazings nearby.
const NEARBY: f64 = 0.05;
/// Visits of so much of the period may be those that a step lost.
const LOST: f64 = 0.2;
/// So many of them are tried, the nearest first.
const MOST: usize = 4;
/// Contacts whose distances from grazing differ by less, relative, graze together: of a symmetric body.
const TOGETHER: f64 = 1e-3;
/// The middle of the same visit in another reading of the motion, over the period.
const SAME: f64 = 5e-3;
/// How often the sequence of switches is read anew on the way to a grazing.
const READINGS: usize = 4;
/// A grazing lies ahead if the way to it has at least this cosine with the branch, or is this short.
const AHEAD: (f64, f64) = (0.3, 1e-6);
/// Durations of the visit behind a grazing, over the period.
const DURATIONS: [f64; 6] = [1e-3, 3e-4, 1e-4, 3e-5, 3e-3, 1e-6];
/// Steps of arclength from a grazing along the ghost branch to where the motion that knows of the visit is read.
const DEEPER: [f64; 4] = [1e-6, 1e-5, 1e-4, 1e-3];
/// Steps of arclength from a grazing to where nothing touches.
const AWAY: [f64; 4] = [1e-3, 1e-4, 1e-2, 1e-5];
/// Step of differences along the ghost branch.
const BESIDE: f64 = 1e-6;
/// Pieces of a march along it.
const PIECES: usize = 16;
/// Most steps along it, and the longest one.
const STEPS: usize = 10;
const FARTHEST: f64 = 0.5;
/// A point this near grazes, over the unit of length; or this near where that does not halve any more.
const GRAZES: f64 = 1e-14;
const STILL: f64 = 1e-9;

/// A point of the ghost branch at which contacts graze.
#[derive(Debug, Clone)]
pub(super) struct Ghost {
    /// The orbit in the unknowns `(z, ω)` of the map.
    pub at: Vec<f64>,
    chart: Chain,
    x: Vec<f64>,
    tangent: Vec<f64>,
    /// `d/ds` of the least value of the monitor of the first contact.
    slope: f64,
    /// The contacts, and where they graze.
    group: Vec<Candidate>,
}

impl Ghost {
    /// The border that it is.
    pub fn border(&self) -> Border {
        let points: Vec<usize> = self.group.iter().flat_map(Candidate::points).collect();
        let first = &self.group[0];
        let what = format!("contact point {} grazes", first.point());
        let (point, to, near) = (first.point(), first.to(), first.near);
        Border::Touch { phase: 0, point, to, near, together: points[1..].to_vec(), what }
    }
}

/// A contact point that may graze near an orbit, or several that do at one instant.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    /// How far from it, as a depth over the unit of length.
    distance: f64,
    /// The points, with the state of the visit.
    visit: Vec<(usize, PointState)>,
    /// Its middle, as a fraction of the time to the end.
    near: f64,
    /// Whether the orbit has the visit.
    is_visit: bool,
}

impl Candidate {
    /// The contact point, of several the first.
    pub fn point(&self) -> usize {
        self.visit[0].0
    }

    /// The state of its visit.
    fn to(&self) -> PointState {
        self.visit[0].1
    }

    fn points(&self) -> impl Iterator<Item = usize> {
        self.visit.iter().map(|(point, _)| *point)
    }
}

/// Where a branch comes from, and in which metric it is measured.
pub(super) struct Coming<'a> {
    /// A point of the branch, and its tangent there, on the map.
    pub place: &'a Place<Chain>,
    /// Of the arclength of the map.
    pub weights: &'a [f64],
    /// The grazing that it went over last.
    pub passed: Option<&'a [f64]>,
    /// Length of a march along the ghost branch, where there is to be one.
    pub march: Option<f64>,
}

impl Coming<'_> {
    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).zip(self.weights).map(|((a, b), w)| w * a * b).sum()
    }

    /// Whether a point lies ahead on the branch.
    fn is_ahead(&self, x: &[f64]) -> bool {
        let length = |way: &[f64]| self.dot(way, way).sqrt();
        if self.passed.is_some_and(|passed| length(&from_to(passed, x)) < AHEAD.1) {
            return false;
        }
        let way = from_to(&self.place.x, x);
        let far = length(&way);
        far < AHEAD.1 || self.dot(&way, &self.place.tangent) > AHEAD.0 * far
    }
}

pub(super) fn from_to(a: &[f64], b: &[f64]) -> Vec<f64> {
    b.iter().zip(a).map(|(b, a)| b - a).collect()
}

/// The grazings of the points that `is_asked` names ahead on a branch of forced orbits, the nearest first as far as an orbit tells.
pub(super) fn ahead(
    body: &mut Propagator,
    closure: Closure,
    coming: &Coming,
    is_asked: impl Fn(usize) -> bool,
) -> Result<Vec<Ghost>, OrbitError> {
    let mut search = Search::new(body, closure);
    let Some(x) = search.read(&coming.place.x)? else { return Ok(vec![]) };
    let mut candidates = search.candidates(&x, LOST)?;
    candidates.retain(|c| c.points().any(&is_asked));
    let is_together = |a: &Candidate, b: &Candidate| {
        a.is_visit == b.is_visit && b.distance - a.distance <= TOGETHER * a.distance
    };
    let chart = search.family.chart();
    let mut found = vec![];
    for group in candidates.chunk_by(is_together).take(MOST) {
        let mut by = |march: Option<f64>| -> Result<Option<Ghost>, OrbitError> {
            search.family.set_chart(&chart);
            let ghost = tolerate(search.grazing(&x, group, coming, march))?.flatten();
            Ok(ghost.filter(|ghost| coming.is_ahead(&ghost.at)))
        };
        let ghost = match (by(None)?, coming.march) {
            (None, Some(length)) => by(Some(length))?,
            (ghost, _) => ghost,
        };
        found.extend(ghost);
    }
    Ok(found)
}

/// An orbit right behind a grazing on the branch.
pub(super) fn behind(
    body: &mut Propagator,
    closure: Closure,
    ghost: &Ghost,
) -> Result<Option<Vec<f64>>, OrbitError> {
    let mut search = Search::new(body, closure);
    let behind = match ghost.group[0].is_visit {
        true => search.apart(ghost),
        false => search.inside(ghost),
    };
    Ok(tolerate(behind)?.flatten())
}

/// The motion near an orbit `(z, ω)` that does not know of the visits that nearly graze: of a contact point, or of the one that comes nearest; of those of an earlier look the one at the
/// same instant. What grazes, the sequence of active sets without it, and the unknowns there.
pub(super) fn bare(
    body: &mut Propagator,
    closure: Closure,
    of_map: &[f64],
    (point, last): (Option<usize>, Option<&Candidate>),
) -> Result<Option<(Candidate, Chain, Vec<f64>)>, OrbitError> {
    let mut search = Search::new(body, closure);
    let Some(x) = search.read(of_map)? else { return Ok(None) };
    let mut candidates = search.candidates(&x, NEARBY)?;
    let apart = |a: f64, b: f64| (a - b - (a - b).round()).abs();
    candidates.retain(|c| {
        point.is_none_or(|p| c.points().any(|q| q == p))
            && last.is_none_or(|l| l.to() == c.to() && apart(l.near, c.near) < NEARBY)
    });
    let Some(nearest) = candidates.first() else { return Ok(None) };
    let is_with =
        |c: &&Candidate| c.distance - nearest.distance <= TOGETHER * nearest.distance.abs();
    let group: Vec<Candidate> = candidates.iter().take_while(is_with).cloned().collect();
    let x = search.without(&x, &group);
    Ok(Some((group[0].clone(), search.family.chart(), x)))
}

/// The least value of what a candidate is watched by, over the unit of length, on the motion of unknowns in a chart, and where, of the time to the end.
pub(super) fn miss(
    body: &mut Propagator,
    closure: Closure,
    (chain, x): (&Chain, &[f64]),
    candidate: &Candidate,
) -> Result<(f64, f64), OrbitError> {
    let mut search = Search::new(body, closure);
    search.family.set_chart(chain);
    search.miss(x, candidate)
}

/// The charts around a grazing.
struct Search<'a> {
    family: Segments<'a>,
}

impl<'a> Search<'a> {
    fn new(body: &'a mut Propagator, closure: Closure) -> Self {
        let mut family = Segments::new(body, closure, Chain::default());
        family.watch = false;
        Search { family }
    }

    /// `(z, ω)` of an `X`.
    fn ends(&self, x: &[f64]) -> Vec<f64> {
        let (z, _, omega) = self.family.parts(x);
        [z, &[omega]].concat()
    }

    /// The chart in which an orbit `(z, ω)` lies, and its `X` there.
    fn read(&mut self, of_map: &[f64]) -> Result<Option<Vec<f64>>, OrbitError> {
        let Some((&omega, z)) = of_map.split_last() else { return Ok(None) };
        let end = self.family.end(omega);
        let body = &mut *self.family.body;
        body.system.loads_mut().set_frequency(omega);
        let Some(passage) = tolerate(integrate(body, &body.state(z), end))? else {
            return Ok(None);
        };
        let x = self.family.unknowns(z, &passage.times, omega);
        self.family.set_chart(&passage.chain);
        Ok(Some(x))
    }

    /// Visits of less than a share of the period, and minima of monitors that are small; the nearest first.
    fn candidates(&mut self, x: &[f64], share: f64) -> Result<Vec<Candidate>, OrbitError> {
        let walk = self.family.walk(x)?;
        let (_, times, omega) = self.family.parts(x);
        let end = self.family.end(omega);
        let chain = self.family.chart();
        let mut found = vec![];
        for visit in visits(&chain, times, share * end) {
            let distance = (omega * visit.duration()).powi(2) / 8.0;
            let near = visit.middle() / end;
            let visit = visit.of.into_iter().map(|(point, _)| point).collect();
            found.push(Candidate { distance, visit, near, is_visit: true });
        }
        for ((point, to), touch) in (Minima { walk: &walk, sets: &chain.sets }).all() {
            let distance = touch.h / self.family.monitor_unit(touch.phase, point);
            if distance < NEARBY {
                let (visit, near) = (vec![(point, to)], touch.t / end);
                found.push(Candidate { distance, visit, near, is_visit: false });
            }
        }
        found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        // misses of several points at one instant
        found.dedup_by(|b, a| {
            let is_same = !a.is_visit
                && !b.is_visit
                && b.distance - a.distance <= TOGETHER * a.distance
                && (b.near - a.near).abs() <= SAME;
            if is_same {
                a.visit.append(&mut b.visit);
            }
            is_same
        });
        Ok(found)
    }

    /// The visit of a candidate in the present chart, if the chart has it.
    fn visit_of(&self, x: &[f64], candidate: &Candidate) -> Option<Visit> {
        let (_, times, omega) = self.family.parts(x);
        let (end, chain) = (self.family.end(omega), &self.family.chain);
        let off = |v: &Visit| (v.middle() / end - candidate.near).abs();
        let of = candidate.visit[0];
        let is_it = |v: &Visit| v.of.iter().any(|((p, to), _)| *p == of.0 && is_like(*to, of.1));
        let nearest = visits(chain, times, end).into_iter().filter(is_it);
        nearest.min_by(|a, b| off(a).total_cmp(&off(b))).filter(|v| off(v) < SAME)
    }

    /// `X` in the present chart without the visits of candidates, which becomes the present one.
    fn without(&mut self, x: &[f64], group: &[Candidate]) -> Vec<f64> {
        let found: Vec<Visit> = group.iter().filter_map(|c| self.visit_of(x, c)).collect();
        let (z, times, omega) = self.family.parts(x);
        let end = self.family.end(omega);
        let chain = self.family.chart();
        let is_gone = |j: usize, point: usize| {
            let is_of = |c: &Candidate| {
                let is_here = (times[j] / end - c.near).abs() < SAME;
                let mut of_point = c.visit.iter().filter(|(p, _)| *p == point);
                is_here && of_point.any(|of| is_moment(&chain, times, (j, *of), end))
            };
            found.iter().any(|visit| visit.has(j, point)) || group.iter().any(is_of)
        };
        let (chain, times) = thinned(&chain, times, is_gone);
        let x = self.family.unknowns(z, &times, omega);
        self.family.set_chart(&chain);
        x
    }

    /// The least value of a candidate's monitor near where it is, over the unit of length, and where, of the time to the end.
    fn miss(&mut self, x: &[f64], candidate: &Candidate) -> Result<(f64, f64), OrbitError> {
        let walk = self.family.walk(x)?;
        let (_, times, omega) = self.family.parts(x);
        let end = self.family.end(omega);
        let phase = times.iter().take_while(|t| **t < candidate.near * end).count();
        let to = candidate.visit[0];
        let touch = self.family.touch(&walk, phase, to, candidate.near);
        Ok((touch.h / self.family.monitor_unit(touch.phase, to.0), touch.t / end))
    }

    /// The grazing of contacts nearest to an orbit in the present chart: Newton's method along the ghost branch for the first of them, from the orbit itself, or from
    /// where a march ahead finds that the contact changes from one side to the other.
    fn grazing(
        &mut self,
        x: &[f64],
        group: &[Candidate],
        coming: &Coming,
        march: Option<f64>,
    ) -> Result<Option<Ghost>, OrbitError> {
        let (mut x, mut group) = (self.without(x, group), group.to_vec());
        if let Some(length) = march {
            let start = self.march(x, &group[0], (coming, length))?;
            let Some((start, near)) = start else { return Ok(None) };
            (x, group[0].near) = (start, near);
        }
        for _ in 0..READINGS {
            let Some(ghost) = self.along(x, group, coming)? else { return Ok(None) };
            // the other switches as the motion has them
            let Some(read) = self.read(&ghost.at)? else { return Ok(None) };
            let bare = self.without(&read, &ghost.group);
            if self.sets_at(&bare, &self.family.chain) == self.sets_at(&ghost.x, &ghost.chart) {
                return Ok(Some(ghost));
            }
            (x, group) = (bare, ghost.group);
        }
        Ok(None)
    }

    /// The active sets that `X` goes through in a chart.
    fn sets_at(&self, x: &[f64], chain: &Chain) -> Vec<States> {
        let n = x.len() - 1 - chain.events();
        let end = self.family.end(x[x.len() - 1]);
        let (first, others) = merged(chain, &x[n..x.len() - 1], end);
        std::iter::once(first).chain(others.into_iter().map(|(_, set)| set)).collect()
    }

    /// The direction of the branch as far as the present chart shares its unknowns, times their weights.
    fn direction(&self, x: &[f64], coming: &Coming) -> Vec<f64> {
        let n = self.family.closure.unknowns(self.family.body.n());
        let weights = self.family.weights(x);
        let mut c = vec![0.0; x.len()];
        (0..n).for_each(|i| c[i] = weights[i] * coming.place.tangent[i]);
        c[x.len() - 1] = weights[x.len() - 1] * coming.place.tangent[n];
        c
    }

    /// Ahead along the present chart until the least value of a contact's monitor changes its sign: `X` on the nearer side, and where the contact is there.
    fn march(
        &mut self,
        mut x: Vec<f64>,
        candidate: &Candidate,
        (coming, length): (&Coming, f64),
    ) -> Result<Option<(Vec<f64>, f64)>, OrbitError> {
        let (mut c, mut candidate) = (self.direction(&x, coming), candidate.clone());
        let weights = self.family.weights(&x);
        let mut last: Option<(Vec<f64>, f64, f64)> = None;
        for _ in 0..=PIECES {
            let Some(found) = correct(&mut self.family, &x, &c, dot(&c, &x))? else {
                return Ok(None);
            };
            let Some((t, _)) = tangent(&mut self.family, &found.x, &c)? else { return Ok(None) };
            let (h, near) = self.miss(&found.x, &candidate)?;
            candidate.near = near;
            if self.is_at_switch(&found.x, &candidate) {
                return Ok(None);
            }
            if let Some((x, g, near)) = last.filter(|(_, g, _)| *g * h < 0.0) {
                let is_nearer = g.abs() < h.abs();
                return Ok(Some(if is_nearer { (x, near) } else { (found.x, candidate.near) }));
            }
            let ahead = found.x.iter().zip(&t).map(|(x, t)| x + length / PIECES as f64 * t);
            x = ahead.collect();
            c = weights.iter().zip(&t).map(|(w, t)| w * t).collect();
            last = Some((found.x, h, near));
        }
        Ok(None)
    }

    /// Along the present chart to where the first of some contacts grazes.
    fn along(
        &mut self,
        mut x: Vec<f64>,
        mut group: Vec<Candidate>,
        coming: &Coming,
    ) -> Result<Option<Ghost>, OrbitError> {
        let weights = self.family.weights(&x);
        let mut c = self.direction(&x, coming);
        let mut nearest = f64::INFINITY;
        for _ in 0..STEPS {
            let gamma = dot(&c, &x);
            let Some(found) = correct(&mut self.family, &x, &c, gamma)? else { return Ok(None) };
            x = found.x;
            let Some((t, _)) = tangent(&mut self.family, &x, &c)? else { return Ok(None) };
            let beside =
                |s: f64| -> Vec<f64> { x.iter().zip(&t).map(|(x, t)| x + s * t).collect() };
            let (h, near) = self.miss(&x, &group[0])?;
            let (ahead, back) = (
                self.miss(&beside(BESIDE), &group[0])?.0,
                self.miss(&beside(-BESIDE), &group[0])?.0,
            );
            let slope = (ahead - back) / (2.0 * BESIDE);
            group[0].near = near;
            let s = -h / slope;
            let is_still = h.abs() >= 0.5 * nearest;
            if h.abs() < GRAZES || h.abs() < STILL && is_still {
                for k in 1..group.len() {
                    group[k].near = self.miss(&x, &group[k])?.1;
                }
                if group.iter().any(|c| self.is_at_switch(&x, c)) {
                    return Ok(None);
                }
                let chart = self.family.chart();
                let at = self.ends(&x);
                return Ok(Some(Ghost { at, chart, x, tangent: t, slope, group }));
            }
            if s.is_nan() || s.abs() > FARTHEST {
                return Ok(None);
            }
            nearest = nearest.min(h.abs());
            x = beside(s);
            c = weights.iter().zip(&t).map(|(w, t)| w * t).collect();
        }
        Ok(None)
    }

    /// Whether what would graze vanishes at a switch of its own, where it does on every orbit.
    fn is_at_switch(&self, x: &[f64], candidate: &Candidate) -> bool {
        let (_, times, omega) = self.family.parts(x);
        let (end, chain) = (self.family.end(omega), &self.family.chain);
        let at = |j: &usize| (times[*j] / end - candidate.near).abs() <= MOMENT;
        candidate.points().any(|point| switches_of(chain, point).iter().any(at))
    }

    /// The branch where the visits are: of a short duration that is given for the first of them.
    fn inside(&mut self, ghost: &Ghost) -> Result<Option<Vec<f64>>, OrbitError> {
        self.family.set_chart(&ghost.chart);
        let mut x = ghost.x.clone();
        for candidate in &ghost.group {
            x = self.with(&x, candidate);
        }
        let Some(found) = self.switches_of(&x, ghost) else { return Ok(None) };
        let n = self.family.closure.unknowns(self.family.body.n());
        let end = self.family.end(x[x.len() - 1]);
        for share in DURATIONS {
            let mut with = x.clone();
            for &(a, b) in &found {
                with[n + a] -= 0.5 * share * end;
                with[n + b] += 0.5 * share * end;
            }
            if let Some(found) = self.of_duration(&with, (found[0], share * end))? {
                return Ok(Some(found));
            }
        }
        // a point that sticks for a moment however lightly it touches: the visit as the motion has it
        for s in DEEPER {
            let deeper = ghost.x.iter().zip(&ghost.tangent);
            let deeper = deeper.map(|(x, t)| x - ghost.slope.signum() * s * t).collect::<Vec<_>>();
            self.family.set_chart(&ghost.chart);
            let Some(with) = self.read(&self.ends(&deeper))? else { continue };
            let Some(found) = self.switches_of(&with, ghost) else { continue };
            let (a, b) = found[0];
            let duration = with[n + b] - with[n + a];
            if let Some(found) = self.of_duration(&with, ((a, b), duration))? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// `X` in the present chart with the visit of a candidate, of no duration, which becomes the present one: all its points come and leave by one switch.
    fn with(&mut self, x: &[f64], candidate: &Candidate) -> Vec<f64> {
        let (z, times, omega) = self.family.parts(x);
        let (mut times, instant) = (times.to_vec(), candidate.near * self.family.end(omega));
        let phase = times.iter().take_while(|t| **t < instant).count();
        let mut chain = self.family.chart();
        let back = chain.sets[phase].clone();
        let mut inside = back.clone();
        candidate.visit.iter().for_each(|&(point, to)| inside.set(point, to));
        chain.sets.splice(phase + 1..phase + 1, [inside, back]);
        chain.points.splice(phase..phase, [candidate.point(); 2]);
        times.splice(phase..phase, [instant; 2]);
        let x = self.family.unknowns(z, &times, omega);
        self.family.set_chart(&chain);
        x
    }

    /// The first and the last switch in the present chart of each visit of a grazing, if the chart has them all.
    fn switches_of(&self, x: &[f64], ghost: &Ghost) -> Option<Vec<(usize, usize)>> {
        ghost.group.iter().map(|c| self.visit_of(x, c).map(|v| v.of[0].1)).collect()
    }

    /// The orbit in the present chart in which the visit between two switches has a duration.
    fn of_duration(
        &mut self,
        x: &[f64],
        ((a, b), duration): ((usize, usize), f64),
    ) -> Result<Option<Vec<f64>>, OrbitError> {
        let n = self.family.closure.unknowns(self.family.body.n());
        let mut c = vec![0.0; x.len()];
        (c[n + b], c[n + a]) = (1.0, -1.0);
        let Some(found) = correct(&mut self.family, x, &c, duration)? else { return Ok(None) };
        Ok(self.is_read(&found.x)?.then(|| self.ends(&found.x)))
    }

    /// Whether the motion goes through the present chart, but for the order of switches at one time: points that come together do so to rounding errors.
    fn is_read(&mut self, x: &[f64]) -> Result<bool, OrbitError> {
        let (chart, ends) = (self.family.chart(), self.ends(x));
        let read = self.read(&ends)?;
        let passage = self.family.chart();
        self.family.set_chart(&chart);
        let Some(read) = read else { return Ok(false) };
        let end = self.family.end(ends[ends.len() - 1]);
        let first = ends.len() - 1;
        let of_chart = merged(&chart, &x[first..x.len() - 1], end);
        let of_motion = merged(&passage, &read[first..read.len() - 1], end);
        let is_same = |(a, b): (&(f64, States), &(f64, States))| {
            a.1 == b.1 && (a.0 - b.0).abs() <= 1e-7 * end
        };
        Ok(of_chart.0 == of_motion.0
            && of_chart.1.len() == of_motion.1.len()
            && of_chart.1.iter().zip(&of_motion.1).all(is_same))
    }

    /// The branch where the visits are no more: the ghost branch on the side where the point stays away.
    fn apart(&mut self, ghost: &Ghost) -> Result<Option<Vec<f64>>, OrbitError> {
        self.family.set_chart(&ghost.chart);
        let side = ghost.slope.signum();
        let weights = self.family.weights(&ghost.x);
        let c: Vec<f64> = weights.iter().zip(&ghost.tangent).map(|(w, t)| w * t).collect();
        for s in AWAY {
            let away = ghost.x.iter().zip(&ghost.tangent).map(|(x, t)| x + side * s * t);
            let predicted: Vec<f64> = away.collect();
            if let Some(found) = correct(&mut self.family, &predicted, &c, dot(&c, &predicted))?
                && self.is_read(&found.x)?
            {
                return Ok(Some(self.ends(&found.x)));
            }
        }
        Ok(None)
    }
}
