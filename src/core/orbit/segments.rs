//! Multi-segment shooting as a family: `X = (z, t_1 … t_m, ω)` over charts that are sequences of active sets (theory §8).
//!
//! The equations are the closure of the orbit and one condition a switch. A chart ends where a phase shrinks to nothing or a
//! monitor touches zero inside a phase:
//!
//! - two switches of one node meet: the pair disappears; of two nodes: they change places;
//! - a switch meets the start or the middle of a reversible orbit: it disappears with its mirror image; of a forced orbit: it goes round;
//! - a monitor touches: a pair of switches (one switch, at a point of symmetry) appears, of length zero.

use faer::Mat;

use super::border::Border;
use super::chain::{Chain, Propagator};
use super::credentials::{Orbit, examine};
use super::period_map::integrate;
use super::shooting::Closure;
use super::tangent::Variation;
use super::touch::{Minima, Touch};
use super::walk::Walk;
use super::{OrbitError, OrbitFamily, rounding_of};
use crate::contact::PointState;
use crate::continuation::{Family, Units, norm};

/// A family of orbits of one body.
pub struct Segments<'a> {
    /// The body; its harmonic loads follow the frequency.
    pub body: &'a mut Propagator,
    /// How orbits close.
    pub closure: Closure,
    /// The present chart.
    pub chain: Chain,
    /// Whether multipliers are watched.
    pub watch: bool,
    /// The last solution that was examined.
    examined: Option<(Vec<f64>, Orbit)>,
}

/// Times this near to each other, over the time to the end, are in order.
const ORDER: f64 = 1e-11;

impl<'a> Segments<'a> {
    /// The family through an orbit that the event-driven integrator has read.
    pub fn new(body: &'a mut Propagator, closure: Closure, chain: Chain) -> Segments<'a> {
        Segments { body, closure, chain, watch: true, examined: None }
    }

    /// `X` of a state with its switching times.
    pub fn unknowns(&self, z: &[f64], times: &[f64], omega: f64) -> Vec<f64> {
        z.iter().chain(times).copied().chain([omega]).collect()
    }

    /// `z`, switching times and `ω` of an `X` in the present chart.
    pub fn parts<'x>(&self, x: &'x [f64]) -> (&'x [f64], &'x [f64], f64) {
        let n = self.closure.unknowns(self.body.n());
        (&x[..n], &x[n..x.len() - 1], x[x.len() - 1])
    }

    /// Time at which the closure is evaluated.
    pub(super) fn end(&self, omega: f64) -> f64 {
        self.closure.end(self.closure.period(omega))
    }

    fn set_frequency(&mut self, omega: f64) {
        self.body.system.loads_mut().set_frequency(omega);
    }

    pub(super) fn walk(&mut self, x: &[f64]) -> Result<Walk, OrbitError> {
        let (z, times, omega) = self.parts(x);
        let end = self.end(omega);
        self.set_frequency(omega);
        Ok(self.body.walk(&self.chain, z, times, end)?)
    }

    /// What makes an equation of event `j` a number of the kind and size of `z`.
    fn equation_scale(&self, j: usize) -> f64 {
        let system = &self.body.system;
        let rate = if self.chain.is_pair(j) { system.units.frequency } else { 1.0 };
        self.body.unit / (self.monitor_unit(j, self.chain.points[j]) * rate)
    }

    /// What the unit of length makes of the monitors of a point in a phase: a length, or a pressure.
    pub(super) fn monitor_unit(&self, phase: usize, point: usize) -> f64 {
        self.body.system.unit_of_monitor(self.chain.sets[phase].at(point), point)
    }

    fn assemble(&self, x: &[f64], walk: &Walk) -> Vec<f64> {
        let (z, ..) = self.parts(x);
        let events = walk.events.iter().enumerate();
        let switches = events.map(|(j, e)| e.equation * self.equation_scale(j));
        self.closure.residual(z, &walk.z_end).into_iter().chain(switches).collect()
    }

    pub(super) fn node_name(&self, contact: usize) -> usize {
        self.body.system.constraints[contact].node
    }

    /// The touch nearest to `near`, of the time to the end, of the monitor through which a point would leave to `to`.
    pub(super) fn touch(
        &self,
        walk: &Walk,
        phase: usize,
        lead: (usize, PointState),
        near: f64,
    ) -> Touch {
        let minima = Minima { walk, sets: &self.chain.sets };
        minima.nearest(phase, lead, near * minima.end())
    }
}

impl Family for Segments<'_> {
    type Chart = Chain;
    type Border = Border;
    type Error = OrbitError;

    fn residual(&mut self, x: &[f64]) -> Result<Vec<f64>, OrbitError> {
        let walk = self.walk(x)?;
        Ok(self.assemble(x, &walk))
    }

    fn linearise(&mut self, x: &[f64]) -> Result<(Vec<f64>, Mat<f64>), OrbitError> {
        let walk = self.walk(x)?;
        let r = self.assemble(x, &walk);
        let (n, m) = (self.closure.unknowns(self.body.n()), self.chain.events());
        let variation = self.closure.varied(Variation::FREE);
        let tangent = self.body.derivative((&self.chain, &walk), n, variation)?;
        let closure = self.closure.derivative(&tangent.end, n);
        let mut j = Mat::zeros(n + m, n + m + 1);
        for c in 0..n + m {
            for i in 0..n {
                j[(i, c)] = closure[(i, c)];
            }
            for i in 0..m {
                j[(n + i, c)] = tangent.equations[(i, c)] * self.equation_scale(i);
            }
        }
        let omega = x[n + m];
        if self.body.system.loads.harmonics.is_empty() {
            // only the end moves: dT_end/dω = −T_end/ω
            let factor = -self.end(omega) / omega;
            let offset = if self.closure == Closure::Reversible { n } else { 0 };
            for i in 0..n {
                j[(i, n + m)] = factor * walk.rate_end[offset + i];
            }
        } else {
            let h = 1e-6 * omega;
            let mut shifted = |s: f64| {
                let mut y = x.to_vec();
                y[n + m] += s;
                self.residual(&y)
            };
            let (up, down) = (shifted(h)?, shifted(-h)?);
            for i in 0..n + m {
                j[(i, n + m)] = (up[i] - down[i]) / (2.0 * h);
            }
            self.set_frequency(omega);
        }
        Ok((r, j))
    }

    fn units(&self) -> Units {
        let frequency = self.body.system.units.frequency;
        let mut unknowns = vec![self.body.unit; self.closure.unknowns(self.body.n())];
        unknowns.extend(vec![1.0 / frequency; self.chain.events()]);
        unknowns.push(frequency);
        Units { unknowns, residual: self.body.unit }
    }

    fn rounding(&self, x: &[f64]) -> f64 {
        let n = self.closure.unknowns(self.body.n());
        rounding_of(&x[..n])
    }

    fn weights(&self, x: &[f64]) -> Vec<f64> {
        let n = self.closure.unknowns(self.body.n());
        let size = norm(&x[..n]).max(1e-300);
        let last = x.len() - 1;
        let weight = |i: usize| match i {
            _ if i < n => 1.0 / (size * size),
            _ if i == last => 4.0 / (x[last] * x[last]),
            _ => 0.0,
        };
        (0..x.len()).map(weight).collect()
    }

    fn chart(&self) -> Chain {
        self.chain.clone()
    }

    fn set_chart(&mut self, chart: &Chain) {
        self.chain = chart.clone();
    }

    fn overstepped(&mut self, x: &[f64]) -> Result<Vec<Border>, OrbitError> {
        let (z, times, omega) = self.parts(x);
        let end = self.end(omega);
        self.set_frequency(omega);
        let at = |j: usize| match j {
            0 => 0.0,
            j if j <= times.len() => times[j - 1],
            _ => end,
        };
        let mut borders = vec![];
        for phase in 0..self.chain.sets.len() {
            if !times.is_empty() && at(phase + 1) - at(phase) < -ORDER * end {
                borders.push(self.phase_border(phase));
            }
        }
        if !borders.is_empty() {
            return Ok(borders);
        }
        let passage = integrate(self.body, &self.body.state(z), end)?;
        let same_time = |k: usize| {
            k < passage.times.len().min(times.len())
                && passage.chain.points[k] == self.chain.points[k]
                && (passage.times[k] - times[k]).abs() <= 1e-7 * end
        };
        if passage.chain.sets[0] == self.chain.sets[0] {
            let agree = (0..times.len()).take_while(|&k| same_time(k)).count();
            if agree == times.len()
                && agree == passage.times.len()
                && passage.chain.sets == self.chain.sets
            {
                return Ok(vec![]);
            }
            // the first switch that the chart does not know, and its partner
            let Some(&t) = passage.times.get(agree) else {
                return Ok(vec![self.phase_border(agree.saturating_sub(1))]);
            };
            let point = passage.chain.points[agree];
            let to = passage.chain.sets[agree + 1].at(point);
            let partner = match passage.chain.points.get(agree + 1) {
                Some(&next) if next == point => Some(passage.times[agree + 1]),
                _ if self.closure == Closure::Reversible && agree == times.len() => Some(end),
                _ => None,
            };
            let middle = partner.map_or(t, |p| if p == end { end } else { 0.5 * (t + p) });
            let what = format!("node {} touches", self.node_name(point));
            let (phase, near) = (agree.min(times.len()), middle / end);
            let together = vec![];
            return Ok(vec![Border::Touch { phase, point, to, near, together, what }]);
        }
        // the first sets differ
        let first = self.chain.sets[0].changes(&passage.chain.sets[0]).next();
        let Some((point, _, to)) = first else { return Ok(vec![]) };
        let what = format!("node {} touches at the start", self.node_name(point));
        Ok(vec![Border::Touch { phase: 0, point, to, near: 0.0, together: vec![], what }])
    }

    fn margin(&mut self, x: &[f64], border: &Border) -> Result<f64, OrbitError> {
        let (_, times, omega) = self.parts(x);
        let end = self.end(omega);
        match border {
            Border::Phase { phase, .. } => {
                let a = if *phase == 0 { 0.0 } else { times[phase - 1] };
                let b = times.get(*phase).copied().unwrap_or(end);
                Ok((b - a) / end)
            }
            Border::Touch { phase, point, to, near, .. } => {
                let walk = self.walk(x)?;
                let touch = self.touch(&walk, *phase, (*point, *to), *near);
                Ok(touch.h / self.monitor_unit(*phase, *point))
            }
        }
    }

    fn beyond(&mut self, x: &[f64], border: &Border) -> Option<(Chain, Vec<f64>)> {
        let (z, times, omega) = self.parts(x);
        let (z, mut times) = (z.to_vec(), times.to_vec());
        let end = self.end(omega);
        let Chain { mut sets, mut points, .. } = self.chain.clone();
        match border {
            Border::Phase { phase, .. } => {
                let (first, last) = (*phase == 0, *phase == points.len());
                match self.closure {
                    Closure::Reversible if first || last => {
                        sets.remove(*phase);
                        let event = if first { 0 } else { points.len() - 1 };
                        points.remove(event);
                        times.remove(event);
                    }
                    _ if first => {
                        // the first switch becomes the last one of the period before
                        sets.remove(0);
                        sets.push(sets[0].clone());
                        points.rotate_left(1);
                        times.rotate_left(1);
                        *times.last_mut()? = end;
                    }
                    _ if last => {
                        sets.pop();
                        sets.insert(0, sets[sets.len() - 1].clone());
                        points.rotate_right(1);
                        times.rotate_right(1);
                        *times.first_mut()? = 0.0;
                    }
                    _ if sets[phase - 1] == sets[phase + 1] => {
                        sets.drain(*phase..=*phase + 1);
                        points.drain(phase - 1..=*phase);
                        times.drain(phase - 1..=*phase);
                    }
                    _ => {
                        // α → β → γ becomes α → β′ → γ: what the second switch changes goes first
                        let (a, b, c) = (&sets[phase - 1], &sets[*phase], &sets[phase + 1]);
                        let mut other = a.clone();
                        b.changes(c).for_each(|(i, _, to)| other.set(i, to));
                        sets[*phase] = other;
                        points.swap(phase - 1, *phase);
                        let t = 0.5 * (times[phase - 1] + times[*phase]);
                        (times[phase - 1], times[*phase]) = (t, t);
                    }
                }
            }
            Border::Touch { phase, point, to, near, .. } => {
                let walk = self.walk(x).ok()?;
                let Touch { phase, t, .. } = self.touch(&walk, *phase, (*point, *to), *near);
                let changed = sets[phase].with(*point, *to);
                let symmetric = self.closure == Closure::Reversible;
                if symmetric && t == 0.0 && phase == 0 {
                    sets.insert(0, changed);
                    points.insert(0, *point);
                    times.insert(0, 0.0);
                } else if symmetric && phase == points.len() && t >= end * (1.0 - 1e-12) {
                    sets.push(changed);
                    points.push(*point);
                    times.push(end);
                } else {
                    let back = sets[phase].clone();
                    sets.insert(phase + 1, changed);
                    sets.insert(phase + 2, back);
                    for _ in 0..2 {
                        points.insert(phase, *point);
                        times.insert(phase, t);
                    }
                }
            }
        }
        let chain = Chain { sets, points, struck: vec![] };
        let mut all = z;
        all.extend(times);
        all.push(omega);
        Some((chain, all))
    }

    fn reread(&mut self, x: &[f64]) -> Result<Option<(Chain, Vec<f64>)>, OrbitError> {
        if !self.body.system.promise().is_lipschitz {
            return Ok(None);
        }
        let (z, _, omega) = self.parts(x);
        let (z, end) = (z.to_vec(), self.end(omega));
        self.set_frequency(omega);
        match integrate(self.body, &self.body.state(&z), end) {
            Ok(passage) => {
                let x = self.unknowns(&z, &passage.times, omega);
                Ok(Some((passage.chain, x)))
            }
            Err(OrbitError::Incomplete(_) | OrbitError::Held { .. }) => Ok(None),
            Err(e) => Err(e),
        }
    }

    fn signature(&mut self, x: &[f64]) -> Result<Vec<i64>, OrbitError> {
        if !self.watch || self.body.n() > super::credentials::MULTIPLIER_LIMIT {
            return Ok(vec![]);
        }
        let orbit = self.orbit(x)?;
        let outside = orbit.stability.map_or([0; 3], |s| s.outside);
        Ok(outside.iter().map(|&k| k as i64).collect())
    }
}

impl OrbitFamily for Segments<'_> {
    fn body(&self) -> &Propagator {
        self.body
    }

    fn orbit(&mut self, x: &[f64]) -> Result<Orbit, OrbitError> {
        if let Some((known, orbit)) = &self.examined
            && known == x
        {
            return Ok(orbit.clone());
        }
        let (z, _, omega) = self.parts(x);
        let z = z.to_vec();
        self.set_frequency(omega);
        let orbit =
            examine(self.body, self.closure, &z, self.closure.period(omega), 0, self.watch)?;
        self.examined = Some((x.to_vec(), orbit.clone()));
        Ok(orbit)
    }
}

impl Segments<'_> {
    /// The border at which a phase vanishes.
    fn phase_border(&self, phase: usize) -> Border {
        let Chain { sets, points, .. } = &self.chain;
        let last = points.len();
        let is_visit = match phase {
            0 => false,
            p if p == last => self.closure == Closure::Reversible,
            p => sets[p - 1] == sets[p + 1],
        };
        let visit = is_visit.then(|| (points[phase - 1], sets[phase].at(points[phase - 1])));
        Border::Phase { phase, visit, what: self.describe(phase) }
    }

    fn describe(&self, phase: usize) -> String {
        let name = |event: usize| self.node_name(self.chain.points[event]);
        let last = self.chain.points.len();
        match phase {
            0 => format!("switch of node {} meets the start of the period", name(0)),
            p if p == last && self.closure == Closure::Reversible => {
                format!("switch of node {} meets its mirror image and disappears", name(p - 1))
            }
            p if p == last => format!("switch of node {} meets the end of the period", name(p - 1)),
            p if self.chain.sets[p - 1] == self.chain.sets[p + 1] => {
                format!("node {} grazes: a pair of switches disappears", name(p))
            }
            p => format!("switches of nodes {} and {} change places", name(p - 1), name(p)),
        }
    }
}
