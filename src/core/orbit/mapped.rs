//! Damped orbits as a family: `X = (z, α, ω)` or `(z, ω)`, and the event-driven map itself, which reads the sequence of active sets anew every time.
//!
//! Motions of viscous bodies have as many corners as undamped ones, but neighbouring charts almost agree there: the branch need not stop at them. Where a
//! grazing bends it too much for any step, [`Mapped::around`] goes through the charts on both sides of it, and [`Mapped::across`] tries longer steps.

use std::convert::Infallible;

use faer::Mat;

use super::chain::{Chain, Propagator};
use super::credentials::{Orbit, examine};
use super::period_map::integrate;
use super::section::{Section, later};
use super::segments::Segments;
use super::shooting::{Closure, image, jacobian};
use super::{OrbitError, OrbitFamily, tolerate};
use crate::continuation::{self, Family, Go, Options, Place, Special, Units, norm};

/// A family of damped orbits of one body: viscous nonlinear modes, or forced.
pub struct Mapped<'a> {
    body: &'a mut Propagator,
    closure: Closure,
    section: Section,
    examined: Option<(Vec<f64>, Orbit)>,
}

/// Steps of arclength over a corner that no shorter step passes.
const ACROSS: [f64; 4] = [0.02, 0.05, 0.1, 0.2];

/// First, least and largest step around a corner, the most points there, and how many of them behind the last border are enough.
const AROUND: (f64, f64, f64) = (1e-4, 1e-10, 5e-3);
const MOST_AROUND: usize = 40;
const CLEAR: usize = 3;

/// A way around a corner that leads back along the branch, by the cosine, is none.
const RETRACED: f64 = 0.98;

/// How far along the branch neighbours are carried to another section, of arclength.
const ALONG: f64 = 1e-6;

/// An orbit this near to a grazing, over the unit of length, is at one.
const GRAZING: f64 = 1e-3;

impl<'a> Mapped<'a> {
    /// The family of a body whose orbits close in a way.
    pub fn new(body: &'a mut Propagator, closure: Closure) -> Mapped<'a> {
        let section = Section::new(body, closure.periods());
        Mapped { body, closure, section, examined: None }
    }

    /// What the map says, or nothing where it cannot be evaluated.
    fn evaluate(&mut self, x: &[f64], derive: bool) -> Result<Option<Evaluated>, OrbitError> {
        let (omega, z) = x.split_last().ok_or(OrbitError::Eigen("unknowns"))?;
        let (n, closure) = (self.body.n(), self.closure);
        self.body.system.loads_mut().set_frequency(*omega);
        let period = closure.period(*omega);
        let Some(at) = tolerate(image(self.body, closure, z, period))? else { return Ok(None) };
        let mut j = Mat::zeros(0, 0);
        if derive {
            j = jacobian(self.body, closure, &at, true)?;
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

    /// The branch behind a corner that no short step passes: the first of some longer ones that leads to an orbit. `x` and a tangent there.
    pub fn across(&mut self, place: &Place<Chain>) -> Result<Option<Place<Chain>>, OrbitError> {
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

    /// The branch behind a corner by multi-segment shooting, to which the corner is a border between two charts. Viscous orbits have an unknown more
    /// than it knows.
    pub fn around(&mut self, place: &Place<Chain>) -> Result<Option<Place<Chain>>, OrbitError> {
        let (omega, z) = place.x.split_last().ok_or(OrbitError::Eigen("unknowns"))?;
        if matches!(self.closure, Closure::Viscous(_)) {
            return Ok(None);
        }
        self.body.system.loads_mut().set_frequency(*omega);
        let passage = integrate(self.body, &self.body.state(z), self.closure.period(*omega))?;
        let mut family = Segments::new(self.body, self.closure, passage.chain);
        family.watch = false;
        let x = family.unknowns(z, &passage.times, *omega);
        let (of_state, last) = place.tangent.split_at(z.len());
        let still = vec![0.0; passage.times.len()];
        let weights = family.weights(&x);
        let c: Vec<f64> = [of_state, &still, last].concat();
        let c: Vec<f64> = c.iter().zip(&weights).map(|(t, w)| w * t).collect();
        let Some((tangent, orientation)) = continuation::tangent(&mut family, &x, &c)? else {
            return Ok(None);
        };
        let chart = family.chart();
        let begin = Place { x, tangent, step: AROUND.0, chart, orientation, signature: vec![] };
        let options = Options {
            range: (0.0, f64::INFINITY),
            step: AROUND,
            points: MOST_AROUND,
            locate: false,
            natural: false,
        };
        let (mut clear, mut found) = (None, None);
        let n = z.len();
        let followed = continuation::follow(&mut family, begin, &options, |_, p| {
            match p.special {
                Some(Special::Border(_)) => clear = Some(0),
                None => clear = clear.map(|k| k + 1),
                Some(_) => {}
            }
            if clear != Some(CLEAR) {
                return Go::Continue(());
            }
            let ends = |x: &[f64]| [&x[..n], &x[x.len() - 1..]].concat();
            found = Some((ends(&p.place.x), ends(&p.place.tangent)));
            Go::Break(())
        });
        let (Some(_), Some((x, along))) = (tolerate(followed)?, found) else { return Ok(None) };
        let weights = self.weights(&x);
        let from: Vec<f64> = x.iter().zip(&place.x).map(|(a, b)| a - b).collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 {
            a.iter().zip(b).zip(&weights).map(|((a, b), w)| w * a * b).sum()
        };
        let (back, length) = (-dot(&from, &place.tangent), dot(&from, &from).sqrt());
        if back > RETRACED * length * dot(&place.tangent, &place.tangent).sqrt() {
            return Ok(None);
        }
        let c: Vec<f64> = weights.iter().zip(&along).map(|(w, t)| w * t).collect();
        let Some((tangent, orientation)) = continuation::tangent(self, &x, &c)? else {
            return Ok(None);
        };
        let signature = self.signature(&x)?;
        let chart = self.chart();
        Ok(Some(Place { x, tangent, step: AROUND.2, chart, orientation, signature }))
    }

    /// The orbit from the section on.
    fn seen(&mut self, x: &[f64]) -> Result<Orbit, OrbitError> {
        if let Some((known, orbit)) = &self.examined
            && known == x
        {
            return Ok(orbit.clone());
        }
        let (omega, z) = x.split_last().ok_or(OrbitError::Eigen("unknowns"))?;
        let closure = self.closure;
        self.body.system.loads_mut().set_frequency(*omega);
        let orbit = examine(self.body, closure, z, closure.period(*omega), 0, true)?;
        self.examined = Some((x.to_vec(), orbit.clone()));
        Ok(orbit)
    }

    /// How near a place is to a grazing, in words, if it is.
    pub fn grazing(&mut self, x: &[f64]) -> Result<Option<String>, OrbitError> {
        let orbit = self.seen(x)?;
        Ok((orbit.grazing < GRAZING)
            .then(|| format!("grazing corner ({:.1e} of the unit of length)", orbit.grazing)))
    }
}

type Evaluated = (Vec<f64>, Mat<f64>);

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
            self.examined = None;
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
    type Border = Infallible;
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
        2e-14 * norm(&x[..n]).max(1e-300) * (1.0 + (n as f64).sqrt() * 0.1)
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
        Chain { sets: vec![], points: vec![], struck: vec![] }
    }

    fn set_chart(&mut self, _: &Chain) {}

    fn signature(&mut self, x: &[f64]) -> Result<Vec<i64>, OrbitError> {
        let orbit = self.seen(x)?;
        Ok(orbit.stability.map_or(vec![], |s| s.outside.iter().map(|&k| k as i64).collect()))
    }
}
