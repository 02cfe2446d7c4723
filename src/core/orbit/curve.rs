//! Curves of orbits that are singled out, over the frequency and a number that the equations depend on: `X = (y, [t_1 … t_m,] ω, [θ,] p)`.
//!
//! The equations are those of the orbit, `R(y, ω, p) = 0`, and the scalars of [`super::condition`], `g = 0`. The orbits around one are a surface, whose tangent plane is spanned by the null
//! vectors `N_1, N_2` of `[R_y R_ω R_p]`; along them `g` is differentiated by central differences. Its derivative is there to make Newton's method fast: the points of a curve are
//! as exact as `R` and `g` are. What grazes is found on the motions that do not know of the visit ([`super::segments`]), everything else on the event-driven map.

use faer::Mat;

use super::border::Border;
use super::chain::Chain;
use super::condition::{Borders, angle};
use super::credentials::{Orbit, examine};
use super::grazing::{Candidate, bare, miss};
use super::mapped::evaluated;
use super::peak::Height;
use super::section::later;
use super::segments::Segments;
use super::shooting::Closure;
use super::values::{Bodies, Make};
use super::{OrbitError, rounding_of, tolerate};
use crate::contact::State;
use crate::continuation::{
    Family, Go, Judgement, Options, Place, Special, Stop, Units, apart, correct, dot, follow, norm,
    tangent,
};
use crate::records::{CurveOf, CurvePointKind};

/// Half the width of differences by the parameter, over its size.
const BESIDE: f64 = 1e-7;
/// The same along the tangent plane, over the size of the unknowns.
const ALONG: f64 = 1e-7;
/// So much shorter or longer steps along the plane end at the bodies that are there.
const SHARED: (f64, f64) = (1e-3, 1e2);
/// A part of the unit of frame vectors is what a scalar of one counts for.
const SCALAR: f64 = 0.1;
/// The same of slopes of amplitudes, which are known to less.
const SLOPE: f64 = 1e-4;
/// A direction in the plane without a share in the parameter.
const NONE: f64 = 1e-12;

/// A family of orbits that are singled out.
pub struct Curve<'a> {
    bodies: Bodies<'a>,
    closure: Closure,
    of: CurveOf,
    borders: Option<Borders>,
    /// What grazes, and the sequence of active sets without it.
    ghost: Option<(Candidate, Chain)>,
    /// The unit of the parameter.
    unit: f64,
    /// The second derivative of the curve at a point.
    bend: Option<(Vec<f64>, Vec<f64>)>,
    /// How the unknowns of the start are read.
    start: Option<Standing>,
}

/// How unknowns are read: the section, the borders there, what grazes with the sequence of active sets without it.
#[derive(Clone)]
struct Standing {
    section: f64,
    borders: Option<Borders>,
    ghost: Option<(Candidate, Chain)>,
}

/// A residual and what `g` is made of, at one value of the parameter.
struct Linear {
    r: Vec<f64>,
    /// By the unknowns of the orbit and the frequency.
    j: Mat<f64>,
}

impl<'a> Curve<'a> {
    /// Curves over a number with a unit of its own, in the frame of the body at one value.
    pub fn new(
        make: &'a mut Make<'a>,
        (closure, of): (Closure, CurveOf),
        (value, unit): (f64, f64),
    ) -> Result<Curve<'a>, OrbitError> {
        let bodies = Bodies::new(make, value, closure.periods())?;
        if bodies.frame.is_large() {
            return Err(OrbitError::Large(bodies.frame.n()));
        }
        if of == CurveOf::Grazing && bodies.frame.system.impact().is_some() {
            return Err(OrbitError::Parameter("velocities that jump graze in another way"));
        }
        Ok(Curve { bodies, closure, of, borders: None, ghost: None, unit, bend: None, start: None })
    }

    /// Number of unknowns of the orbit: its state, and times of switches.
    fn of_orbit(&self) -> usize {
        2 * self.bodies.frame.n() + self.ghost.as_ref().map_or(0, |(_, chain)| chain.events())
    }

    /// Unknowns of the orbit with the frequency, the angle, and the value.
    fn parts<'x>(&self, x: &'x [f64]) -> (&'x [f64], f64, f64) {
        let m = self.of_orbit() + 1;
        let theta = if self.of.unknowns() > 0 { x[m] } else { 0.0 };
        (&x[..m], theta, x[x.len() - 1])
    }

    /// The residual of the orbit, with its derivative if that is asked for.
    fn linear(
        &mut self,
        base: &[f64],
        value: f64,
        derive: bool,
    ) -> Result<Option<Linear>, OrbitError> {
        let size = 2 * self.bodies.frame.n();
        let mut x = self.bodies.in_body(value, &base[..size])?;
        x.extend_from_slice(&base[size..]);
        let here = self.bodies.at(value)?;
        let found = match &self.ghost {
            None => evaluated(&mut here.body, self.closure, &x, derive)?,
            Some((_, chain)) => {
                let mut ghost = Segments::new(&mut here.body, self.closure, chain.clone());
                let at = match derive {
                    true => ghost.linearise(&x),
                    false => ghost.residual(&x).map(|r| (r, Mat::zeros(0, 0))),
                };
                tolerate(at)?
            }
        };
        let Some((r, j)) = found else { return Ok(None) };
        let column = Mat::from_fn(r.len(), 1, |i, _| r[i]);
        let column = here.rows_out_of_body(&column);
        let r = (0..r.len()).map(|i| column[(i, 0)]).collect();
        let j = if derive { here.rows_out_of_body(&here.columns_in_body(&j)) } else { j };
        Ok(Some(Linear { r, j }))
    }

    /// `X − 1` of an orbit.
    fn less_one(&self, at: &Linear) -> Mat<f64> {
        let n = 2 * self.bodies.frame.n();
        at.j.subrows(0, n).subcols(0, n).to_owned()
    }

    /// The scalars of the condition, in the unit of the residual.
    fn scalars(
        &mut self,
        (base, theta, value): (&[f64], f64, f64),
        at: &Linear,
    ) -> Result<Option<Vec<f64>>, OrbitError> {
        let unit = self.bodies.frame.unit;
        let size = 2 * self.bodies.frame.n();
        match self.of {
            CurveOf::Grazing => {
                let Some((candidate, chain)) = self.ghost.clone() else { return Ok(None) };
                let mut x = self.bodies.in_body(value, &base[..size])?;
                x.extend_from_slice(&base[size..]);
                let body = &mut self.bodies.at(value)?.body;
                let h = tolerate(miss(body, self.closure, (&chain, &x), &candidate))?;
                Ok(h.map(|(h, _)| vec![unit * h]))
            }
            CurveOf::Peak => {
                let orbit = self.orbit((base, value), false)?;
                let Some(orbit) = orbit else { return Ok(None) };
                let body = &mut self.bodies.at(value)?.body;
                let height = tolerate(Height::of(body, &orbit))?.flatten();
                let slope = height.map(|h| h.slope * orbit.omega() / h.amplitude);
                Ok(slope.map(|slope| vec![SLOPE * unit * slope]))
            }
            of => {
                let a = of.matrix(&self.less_one(at), theta);
                let borders = match &self.borders {
                    Some(borders) => borders,
                    None => self.borders.insert(Borders::of(&a, of)?),
                };
                let g = borders.scalars(&a);
                Ok(Some(g.into_iter().map(|g| SCALAR * unit * g).collect()))
            }
        }
    }

    /// `R` and `g`, with the residual and its derivative.
    fn both(&mut self, x: &[f64]) -> Result<Option<(Linear, Vec<f64>)>, OrbitError> {
        let (base, theta, value) = self.parts(x);
        let Some(at) = self.linear(base, value, true)? else { return Ok(None) };
        let Some(g) = self.scalars((base, theta, value), &at)? else { return Ok(None) };
        Ok(Some((at, g)))
    }

    /// What a value counts for: itself, or a part of the unit where it is near zero.
    fn size(&self, value: f64) -> f64 {
        value.abs().max(LEAST * self.unit)
    }

    /// By the parameter: `R_p`.
    fn by_value(
        &mut self,
        (base, value): (&[f64], f64),
        at: &Linear,
    ) -> Result<Option<Vec<f64>>, OrbitError> {
        let width = BESIDE * self.size(value);
        let mut beside = |s: f64| -> Result<Option<Vec<f64>>, OrbitError> {
            let there = tolerate(self.linear(base, value + s * width, false))?.flatten();
            Ok(there.map(|there| there.r))
        };
        difference([beside(-1.0)?, beside(1.0)?], || Ok(Some(at.r.clone())), width)
    }

    /// The derivative of the scalars along a direction, in units, of the unknowns of the orbit, the frequency and the parameter.
    fn along(
        &mut self,
        (base, theta, value): (&[f64], f64, f64),
        direction: &[f64],
        units: &[f64],
    ) -> Result<Option<Vec<f64>>, OrbitError> {
        let last = base.len();
        let width = BESIDE * self.size(value);
        let mut step =
            ALONG * norm(&base.iter().zip(units).map(|(x, u)| x / u).collect::<Vec<_>>());
        // where a step as long as that leads to another body, to one of those that are there
        let share = (width / (direction[last] * self.unit)).abs();
        let is_shared = share > SHARED.0 * step && share < SHARED.1 * step;
        let by = match is_shared {
            true => {
                step = share;
                width.copysign(direction[last])
            }
            false => step * direction[last] * self.unit,
        };
        let mut beside = |s: f64| -> Result<Option<Vec<f64>>, OrbitError> {
            let moved: Vec<f64> =
                (0..last).map(|k| base[k] + s * step * direction[k] * units[k]).collect();
            let there = value + s * by;
            let Some(at) = tolerate(self.linear(&moved, there, true))?.flatten() else {
                return Ok(None);
            };
            self.scalars((&moved, theta, there), &at)
        };
        let both = [beside(-1.0)?, beside(1.0)?];
        difference(both, || beside(0.0), step)
    }

    /// The whole derivative at a point where the orbit's is known.
    fn derivative(&mut self, x: &[f64], at: &Linear) -> Result<Option<Mat<f64>>, OrbitError> {
        let (base, theta, value) = self.parts(x);
        let (m, scalars) = (at.r.len(), self.of.scalars());
        let units = self.units().unknowns;
        let unit = [&units[..=m], &[self.unit]].concat();
        let residual = self.bodies.frame.unit;
        let Some(by_value) = self.by_value((base, value), at)? else { return Ok(None) };
        let entry = |i: usize, k: usize| if k <= m { at.j[(i, k)] } else { by_value[i] };
        // the tangent plane, in units: what is orthogonal to all rows
        let scaled = Mat::from_fn(m + 2, m, |k, i| entry(i, k) * unit[k] / residual);
        let q = scaled.qr().compute_Q();
        let column = |k: usize| -> Vec<f64> { (0..m + 2).map(|i| q[(i, k)]).collect() };
        let plane = apart_from_last([column(m), column(m + 1)]);
        let columns = m + 2 + self.of.unknowns();
        let place = |k: usize| if k <= m { k } else { columns - 1 };
        let mut j = Mat::zeros(m + scalars, columns);
        for k in 0..m + 2 {
            (0..m).for_each(|i| j[(i, place(k))] = entry(i, k));
        }
        for direction in &plane {
            let slopes = self.along((base, theta, value), direction, &unit)?;
            let Some(slopes) = slopes else { return Ok(None) };
            for (i, slope) in slopes.iter().enumerate() {
                (0..m + 2).for_each(|k| j[(m + i, place(k))] += slope * direction[k] / unit[k]);
            }
        }
        if self.of.unknowns() > 0 {
            let mut at_angle = |s: f64| self.scalars((base, theta + s * ALONG, value), at);
            let (Some(up), Some(down)) = (at_angle(1.0)?, at_angle(-1.0)?) else {
                return Ok(None);
            };
            (0..scalars).for_each(|i| j[(m + i, m + 1)] = (up[i] - down[i]) / (2.0 * ALONG));
        }
        Ok(Some(j))
    }

    /// The orbit of a point from the section on.
    fn orbit(
        &mut self,
        (base, value): (&[f64], f64),
        multipliers: bool,
    ) -> Result<Option<Orbit>, OrbitError> {
        let size = 2 * self.bodies.frame.n();
        let z = self.bodies.in_body(value, &base[..size])?;
        let omega = base[base.len() - 1];
        let body = &mut self.bodies.at(value)?.body;
        body.system.loads_mut().set_frequency(omega);
        tolerate(examine(body, self.closure, &z, self.closure.period(omega), 0, multipliers))
    }

    /// The point of a curve near an orbit at a value of the parameter; none if there is none.
    pub fn near(
        &mut self,
        (state, omega): (&State, f64),
        value: f64,
        contact: Option<usize>,
    ) -> Result<Option<Vec<f64>>, OrbitError> {
        self.stand(Standing { section: 0.0, borders: None, ghost: None });
        let mut base = self.bodies.frame.frame(state);
        base.push(omega);
        if self.of == CurveOf::Grazing {
            let Some(with_times) = self.read(&base, value, contact)? else { return Ok(None) };
            base = with_times;
        }
        let mut theta = None;
        if self.of == CurveOf::Torus {
            let at = tolerate(self.linear(&base, value, true))?.flatten();
            theta = at.map(|at| angle(&self.less_one(&at))).transpose()?.flatten();
            if theta.is_none() {
                return Ok(None);
            }
        }
        let mut x = base;
        x.extend(theta);
        x.push(value);
        let mut c = vec![0.0; x.len()];
        *c.last_mut().unwrap_or(&mut 0.0) = 1.0;
        let Some(found) = correct(self, &x, &c, value)? else { return Ok(None) };
        self.renew(&found.x)?;
        self.start = Some(self.standing());
        Ok(Some(found.x))
    }

    /// Whether the orbit of a point is one of fewer periods of the loads, more than once.
    pub fn is_repeated(&mut self, x: &[f64]) -> Result<bool, OrbitError> {
        let (base, _, value) = self.parts(x);
        let size = 2 * self.bodies.frame.n();
        let (z, omega) = (self.bodies.in_body(value, &base[..size])?, base[base.len() - 1]);
        let k = self.closure.periods();
        let body = &mut self.bodies.at(value)?.body;
        for q in (1..k).filter(|q| k.is_multiple_of(*q)) {
            let Some(early) = tolerate(later(body, &z, omega, q as f64))? else { return Ok(false) };
            if apart(&z, &early) < SHORTER * norm(&z) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The frequency and the largest contact displacement at a point.
    pub fn seen(&mut self, x: &[f64]) -> Result<Option<(f64, f64)>, OrbitError> {
        let (base, _, value) = self.parts(x);
        let base = base.to_vec();
        Ok(self.orbit((&base, value), false)?.map(|orbit| (orbit.omega(), orbit.amplitude)))
    }

    /// Borders of the point where the curve is.
    fn renew(&mut self, x: &[f64]) -> Result<(), OrbitError> {
        let (base, theta, value) = self.parts(x);
        let Some(last) = self.borders.take() else { return Ok(()) };
        let Some(at) = self.linear(base, value, true)? else { return Ok(()) };
        self.borders = Some(last.renewed(&self.of.matrix(&self.less_one(&at), theta)));
        Ok(())
    }

    /// The unknowns of a motion that does not know of the visits that graze, from those of the map; its sequence of active sets becomes the present one.
    fn read(
        &mut self,
        base: &[f64],
        value: f64,
        contact: Option<usize>,
    ) -> Result<Option<Vec<f64>>, OrbitError> {
        let size = 2 * self.bodies.frame.n();
        let omega = base[base.len() - 1];
        let mut of_map = self.bodies.in_body(value, &base[..size])?;
        of_map.push(omega);
        let watched = self.ghost.as_ref().map(|(candidate, _)| candidate);
        let body = &mut self.bodies.at(value)?.body;
        let Some((candidate, chain, x)) = bare(body, self.closure, &of_map, (contact, watched))?
        else {
            return Ok(None);
        };
        self.ghost = Some((candidate, chain));
        let mut read = base[..size].to_vec();
        read.extend_from_slice(&x[size..]);
        Ok(Some(read))
    }

    /// The same place at a better section of the loads, or in the sequence of switches that the motion has; none where it is as good as it stands, or nothing better is found.
    fn moved(
        &mut self,
        place: &Place<Chain>,
        orbit: &Orbit,
    ) -> Result<Option<Place<Chain>>, OrbitError> {
        let before = self.standing();
        let moved = tolerate(self.elsewhere(place, orbit))?.flatten();
        if moved.is_none() {
            self.stand(before);
        }
        Ok(moved)
    }

    /// How unknowns are read at present.
    fn standing(&self) -> Standing {
        let (borders, ghost) = (self.borders.clone(), self.ghost.clone());
        Standing { section: self.bodies.section(), borders, ghost }
    }

    /// Read them as before.
    fn stand(&mut self, as_before: Standing) {
        let Standing { section, borders, ghost } = as_before;
        if section != self.bodies.section() {
            self.bodies.set_section(section);
        }
        (self.borders, self.ghost) = (borders, ghost);
    }

    fn elsewhere(
        &mut self,
        place: &Place<Chain>,
        orbit: &Orbit,
    ) -> Result<Option<Place<Chain>>, OrbitError> {
        let size = 2 * self.bodies.frame.n();
        let (_, _, value) = self.parts(&place.x);
        let section = &self.bodies.at(value)?.section;
        let better = section.better(orbit).map(|at| (at, section.until(at)));
        let m = self.of_orbit();
        let rest = m..place.x.len();
        let (mut state, mut towards) = (place.x[..size].to_vec(), place.tangent[..size].to_vec());
        if let Some((at, periods)) = better {
            let mut there = |share: f64| -> Result<Vec<f64>, OrbitError> {
                let moved: Vec<f64> =
                    place.x.iter().zip(&place.tangent).map(|(x, t)| x + share * t).collect();
                let (omega, value) = (moved[m], moved[moved.len() - 1]);
                let z = self.bodies.in_body(value, &moved[..size])?;
                let z = later(&mut self.bodies.at(value)?.body, &z, omega, periods)?;
                self.bodies.out_of_body(value, &z)
            };
            let ends = (there(-ALONG)?, there(ALONG)?);
            state = there(0.0)?;
            towards = ends.1.iter().zip(&ends.0).map(|(b, a)| (b - a) / (2.0 * ALONG)).collect();
            self.bodies.set_section(at);
            self.borders = None;
        }
        let mut times = vec![];
        if let Some((candidate, chain)) = self.ghost.clone() {
            let base = [&state[..], &[place.x[m]]].concat();
            if better.is_some() {
                // the instant of what grazes counts from the section
                self.ghost = None;
            }
            let Some(read) = self.read(&base, value, Some(candidate.point()))? else {
                return Ok(None);
            };
            let is_same = self.ghost.as_ref().is_some_and(|(_, now)| *now == chain);
            if is_same && better.is_none() {
                return Ok(None);
            }
            times = read[size..read.len() - 1].to_vec();
        } else if better.is_none() {
            return Ok(None);
        }
        let x = [&state[..], &times, &place.x[rest.clone()]].concat();
        let towards = [&towards[..], &vec![0.0; times.len()], &place.tangent[rest]].concat();
        let c: Vec<f64> = self.weights(&x).iter().zip(&towards).map(|(w, t)| w * t).collect();
        let gamma = dot(&c, &x);
        let Some(found) = correct(self, &x, &c, gamma)? else { return Ok(None) };
        let Some((tangent, orientation)) = tangent(self, &found.x, &c)? else { return Ok(None) };
        let (step, chart, signature) = (place.step, self.chart(), vec![]);
        Ok(Some(Place { x: found.x, tangent, step, chart, orientation, signature }))
    }

    /// What stands at a point.
    fn told(&mut self, x: &[f64], kind: CurvePointKind) -> Result<Option<Point>, OrbitError> {
        let (base, theta, value) = self.parts(x);
        let base = base.to_vec();
        let Some(orbit) = self.orbit((&base, value), true)? else { return Ok(None) };
        let left = self.bodies.at(value)?.section.until(0.0);
        let orbit = match left {
            0.0 => orbit,
            left => {
                let omega = base[base.len() - 1];
                let body = &mut self.bodies.at(value)?.body;
                let z = later(body, &orbit.z, omega, left)?;
                let state = body.state(&z);
                orbit.counted_from(left / self.closure.periods() as f64, z, state)
            }
        };
        let theta = (self.of == CurveOf::Torus).then_some(theta);
        let contact = self.ghost.as_ref().map(|(candidate, _)| candidate.point());
        let omega = orbit.omega();
        let here = self.bodies.at(value)?;
        let node = contact.map(|contact| here.body.system.constraints[contact].node);
        let all = here.full(&orbit.state, omega)?;
        let nodal = |x: &[f64]| here.body.system.body.nodal(x).into_owned();
        let state = [nodal(&all[0]), nodal(&all[1])];
        Ok(Some(Point { omega, value, theta, node, kind, orbit, state }))
    }

    /// Follow a curve from one of its points, to larger (`direction > 0`) or smaller values of the parameter.
    pub fn follow(
        &mut self,
        start: &[f64],
        direction: f64,
        options: &Options,
        frequencies: (f64, f64),
        mut take: impl FnMut(Point) -> Go,
    ) -> Result<String, OrbitError> {
        if let Some(standing) = self.start.clone() {
            self.stand(standing);
        }
        let Some(mut place) = Place::start(self, start.to_vec(), direction, options.step.0)? else {
            return Ok("there is no tangent at the start".into());
        };
        match self.told(start, CurvePointKind::Start)? {
            Some(point) => match take(point) {
                Go::Continue(()) => {}
                Go::Break(()) => return Ok(String::new()),
            },
            None => return Ok("the motion could not be followed".into()),
        }
        let mut options = options.clone();
        loop {
            let (mut failed, mut moved, mut why, mut count) = (None, None, None, 0);
            let mut visit = |curve: &mut Self, p: &crate::continuation::Point<Chain, Border>| {
                count += 1;
                let kind = p.special.as_ref().and_then(|s| curve.kind(s, p));
                let is_end = matches!(p.special, Some(Special::End));
                if p.special.is_some() && kind.is_none() && !is_end {
                    return Ok(Go::Continue(()));
                }
                let Some(told) = curve.told(&p.x, kind.unwrap_or(CurvePointKind::Regular))? else {
                    why = Some("the motion could not be followed".to_owned());
                    return Ok(Go::Break(()));
                };
                let flaws = told.orbit.flaws();
                if !flaws.is_empty() && curve.of != CurveOf::Grazing {
                    why = Some(format!("solutions are no orbits any more: {}", flaws.join("; ")));
                    return Ok(Go::Break(()));
                }
                if !(frequencies.0..=frequencies.1).contains(&told.omega) {
                    why = Some("leaves the range of frequencies".into());
                    return Ok(Go::Break(()));
                }
                if take(told).is_break() {
                    why = Some(String::new());
                    return Ok(Go::Break(()));
                }
                if let Some(theta) = curve.strong_resonance(&p.x) {
                    why = Some(format!("the angle of the multipliers comes to {theta}"));
                    return Ok(Go::Break(()));
                }
                if p.special.is_none() {
                    curve.renew(&p.x)?;
                    let (base, _, value) = curve.parts(&p.x);
                    let base = base.to_vec();
                    if let Some(seen) = curve.orbit((&base, value), false)? {
                        moved = curve.moved(&p.place, &seen)?;
                    }
                }
                Ok(if moved.is_some() { Go::Break(()) } else { Go::Continue(()) })
            };
            let stop = follow(self, place, &options, |curve, p| {
                visit(curve, &p).unwrap_or_else(|e| {
                    failed = Some(e);
                    Go::Break(())
                })
            })?;
            options.points = options.points.saturating_sub(count);
            match (failed, why, moved) {
                (Some(e), ..) => return Err(e),
                (_, Some(why), _) => return Ok(why),
                (.., Some(_)) if options.points == 0 => return Ok(Stop::Points.to_string()),
                (.., Some(next)) if stop == Stop::Interrupted => place = next,
                _ => return Ok(stop.to_string()),
            }
        }
    }

    /// What a special point of the continuation is.
    fn kind(
        &mut self,
        special: &Special<Border>,
        p: &crate::continuation::Point<Chain, Border>,
    ) -> Option<CurvePointKind> {
        match special {
            Special::Start => Some(CurvePointKind::Start),
            Special::End => Some(CurvePointKind::EndOfRange),
            Special::Corner { .. } => Some(CurvePointKind::Turn),
            Special::Fold => {
                let c = p.place.tangent.iter().zip(self.weights(&p.x));
                let c: Vec<f64> = c.map(|(t, w)| t * w).collect();
                let (t, _) = tangent(self, &p.x, &c).ok()??;
                let omega = self.of_orbit();
                let share = t[omega].abs() * self.weights(&p.x)[omega].sqrt();
                Some(match self.of == CurveOf::Fold && share < CUSP {
                    true => CurvePointKind::Cusp,
                    false => CurvePointKind::Turn,
                })
            }
            _ => None,
        }
    }

    /// An angle at which a pair of multipliers meets the real axis.
    fn strong_resonance(&self, x: &[f64]) -> Option<&'static str> {
        let (_, theta, _) = self.parts(x);
        if self.of != CurveOf::Torus {
            return None;
        }
        match theta {
            t if t < REAL => Some("0: a 1:1 resonance"),
            t if t > std::f64::consts::PI - REAL => Some("pi: a 1:2 resonance"),
            _ => None,
        }
    }
}

/// An orbit that is back as near as this after fewer periods of the loads, over its size, is one of those.
const SHORTER: f64 = 1e-6;
/// At a cusp the tangent of a fold curve has no share of the frequency beyond this.
const CUSP: f64 = 1e-4;
/// Multipliers whose angle is this near to 0 or π are as good as real.
const REAL: f64 = 1e-2;

/// A point of a curve.
#[derive(Debug, Clone)]
pub struct Point {
    /// Circular frequency.
    pub omega: f64,
    /// Value of the parameter.
    pub value: f64,
    /// Angle of the multipliers at a Neimark–Sacker point.
    pub theta: Option<f64>,
    /// Node of the mesh that grazes.
    pub node: Option<usize>,
    /// What the point is.
    pub kind: CurvePointKind,
    /// The orbit.
    pub orbit: Orbit,
    /// Nodal displacements and velocities at the origin of time.
    pub state: [Vec<f64>; 2],
}

/// Central differences of values on both sides; where there are none on one, as at the end of what a number may be, one-sided ones with those between.
fn difference(
    beside: [Option<Vec<f64>>; 2],
    between: impl FnOnce() -> Result<Option<Vec<f64>>, OrbitError>,
    width: f64,
) -> Result<Option<Vec<f64>>, OrbitError> {
    let of = |low: &[f64], high: &[f64], span: f64| -> Vec<f64> {
        low.iter().zip(high).map(|(low, high)| (high - low) / span).collect()
    };
    Ok(match beside {
        [Some(low), Some(high)] => Some(of(&low, &high, 2.0 * width)),
        [Some(low), None] => between()?.map(|here| of(&low, &here, width)),
        [None, Some(high)] => between()?.map(|here| of(&here, &high, width)),
        [None, None] => None,
    })
}

/// Two directions of a plane, the first without a share in the last unknown.
fn apart_from_last([a, b]: [Vec<f64>; 2]) -> [Vec<f64>; 2] {
    let last = a.len() - 1;
    let (x, y) = (a[last], b[last]);
    let length = x.hypot(y);
    if length < NONE {
        return [a, b];
    }
    let of = |s: f64, c: f64| a.iter().zip(&b).map(|(a, b)| (s * a + c * b) / length).collect();
    [of(y, -x), of(x, y)]
}

impl Family for Curve<'_> {
    type Chart = Chain;
    type Border = Border;
    type Error = OrbitError;

    fn linearise(&mut self, x: &[f64]) -> Result<(Vec<f64>, Mat<f64>), OrbitError> {
        let nowhere = || (vec![f64::NAN; x.len() - 1], Mat::zeros(x.len() - 1, x.len()));
        let Some((at, g)) = tolerate(self.both(x))?.flatten() else { return Ok(nowhere()) };
        let Some(j) = tolerate(self.derivative(x, &at))?.flatten() else { return Ok(nowhere()) };
        Ok(([at.r, g].concat(), j))
    }

    fn residual(&mut self, x: &[f64]) -> Result<Vec<f64>, OrbitError> {
        let found = tolerate(self.both(x))?.flatten();
        Ok(found.map_or_else(|| vec![f64::NAN; x.len() - 1], |(at, g)| [at.r, g].concat()))
    }

    fn units(&self) -> Units {
        let frame = &self.bodies.frame;
        let frequency = frame.system.units.frequency;
        let mut unknowns = vec![frame.unit; 2 * frame.n()];
        unknowns.resize(self.of_orbit(), 1.0 / frequency);
        unknowns.push(frequency);
        unknowns.extend(vec![1.0; self.of.unknowns()]);
        unknowns.push(self.unit);
        Units { unknowns, residual: frame.unit }
    }

    fn rounding(&self, x: &[f64]) -> f64 {
        let n = 2 * self.bodies.frame.n();
        rounding_of(&x[..n])
    }

    fn weights(&self, x: &[f64]) -> Vec<f64> {
        let n = 2 * self.bodies.frame.n();
        let size = norm(&x[..n]).max(1e-300);
        let m = self.of_orbit();
        let (omega, value) = (x[m], x[x.len() - 1]);
        let of_value = self.size(value);
        let mut weights = vec![1.0 / (size * size); n];
        weights.resize(m, 0.0);
        weights.push(4.0 / (omega * omega));
        weights.extend(vec![1.0; self.of.unknowns()]);
        weights.push(1.0 / (of_value * of_value));
        weights
    }

    fn judge(
        &mut self,
        from: &Place<Chain>,
        x: &[f64],
        tangent: &[f64],
    ) -> Result<Judgement<Border>, OrbitError> {
        let weights = self.weights(&from.x);
        let way = from.x.iter().zip(x).zip(&weights).map(|((a, b), w)| w * (b - a).powi(2));
        let length = way.sum::<f64>().sqrt();
        let bend = tangent.iter().zip(&from.tangent).map(|(b, a)| (b - a) / length).collect();
        self.bend = Some((x.to_vec(), bend));
        Ok(Judgement::Along)
    }

    fn bend(&self, x: &[f64]) -> Option<&[f64]> {
        self.bend.as_ref().filter(|(at, _)| at == x).map(|(_, bend)| &bend[..])
    }

    fn chart(&self) -> Chain {
        self.ghost.as_ref().map_or_else(Chain::default, |(_, chain)| chain.clone())
    }

    fn set_chart(&mut self, chart: &Chain) {
        if let Some((_, chain)) = &mut self.ghost {
            *chain = chart.clone();
        }
    }
}

/// A value below this part of the unit counts for that.
const LEAST: f64 = 0.05;
