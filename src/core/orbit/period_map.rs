//! The period map: a state carried over a time by the event-driven integrator, with its sequence of active sets.

use std::convert::Infallible;
use std::rc::Rc;

use super::OrbitError;
use super::chain::{Chain, Propagator};
use crate::contact::State;
use crate::continuation::Go;
use crate::event::{self, GrazingKind, Observer, Options, Outcome, Report, RunError, Sample};
use crate::flow::{self, Chebyshev, Choice, Flow, Modal, choice};

/// Switches nearer to each other than this, over the time of the run, are one event.
const SAME_TIME: f64 = 1e-11;

/// A motion over a time: the sequence that the integrator found, with its report.
#[derive(Debug)]
pub struct Passage {
    /// Active sets and nodes.
    pub chain: Chain,
    /// Switching times.
    pub times: Vec<f64>,
    /// The run.
    pub report: Report,
}

/// The exact flow of a body: by the modes of its phases, or without for large ones.
pub fn flow(body: &Propagator) -> Choice<'_, choice::Only> {
    let exact: Box<dyn Flow> = if body.is_large() {
        Box::new(Chebyshev::new(&body.system))
    } else {
        Box::new(Modal::sharing(&body.system, Rc::clone(&body.spectra)))
    };
    flow::exact(exact, &body.system)
}

/// Observes nothing, and ends the motion when it is asked to.
struct Stoppable<'a>(&'a Propagator);

impl Observer for Stoppable<'_> {
    type Error = Infallible;
    fn sample(&mut self, _: &Sample) -> Result<(), Infallible> {
        Ok(())
    }
    fn progress(&mut self, _: f64) -> Result<Go, Infallible> {
        match self.0.is_stopped() {
            true => Ok(Go::Break(())),
            false => Ok(Go::Continue(())),
        }
    }
}

/// Keeps the states as they are stored, every switch is followed by one; and ends the motion when it is asked to.
pub(super) struct Kept<'a> {
    body: &'a Propagator,
    states: Vec<(f64, State)>,
}

impl<'a> Kept<'a> {
    /// Nothing yet.
    pub fn new(body: &'a Propagator) -> Self {
        Kept { body, states: vec![] }
    }

    /// The state behind the first switch at a time.
    pub fn at(&self, t: f64) -> Option<&State> {
        self.states.iter().find(|(at, _)| *at == t).map(|(_, state)| state)
    }
}

impl Observer for Kept<'_> {
    type Error = Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        let cut = |x: &[f64]| x[..self.body.n()].to_vec();
        self.states.push((s.t, State { u: cut(s.u), v: cut(s.v) }));
        Ok(())
    }
    fn progress(&mut self, t: f64) -> Result<Go, Infallible> {
        Stoppable(self.body).progress(t)
    }
}

/// Integrate from `x` at `t = 0` to `until` with the body's exact flow.
pub fn integrate(body: &Propagator, x: &State, until: f64) -> Result<Passage, OrbitError> {
    integrate_with(body, x, until, 0, &mut Stoppable(body))
}

/// The same with an observer and a number of stored states.
pub fn integrate_with<O: Observer<Error = Infallible>>(
    body: &Propagator,
    x: &State,
    until: f64,
    samples: usize,
    observer: &mut O,
) -> Result<Passage, OrbitError> {
    let options = Options { until, samples, switch_limit: 40.0 };
    body.count(|spent| spent.motions += 1);
    let mut flow = flow(body);
    let report =
        event::run(&body.system, x, &options, &mut flow, observer).map_err(|e| match e {
            RunError::Contact(e) => OrbitError::Contact(e),
            RunError::Observer(never) => match never {},
        })?;
    if let Outcome::Interrupted { .. } = report.outcome {
        return Err(OrbitError::Stopped);
    }
    if !report.outcome.is_complete() {
        return Err(OrbitError::Incomplete(report.outcome));
    }
    if let Some(g) = report.grazings.iter().find(|g| g.kind == GrazingKind::Held) {
        return Err(OrbitError::Held { t: g.t, node: g.node });
    }
    let first = report.switches.first().map_or(&report.active, |s| &s.before);
    let mut chain = Chain { sets: vec![first.clone()], points: vec![], struck: vec![] };
    let mut times: Vec<f64> = vec![];
    for s in &report.switches {
        let together = times.last().is_some_and(|t| s.t - t <= SAME_TIME * until);
        // a node that switches twice at one time is a grazing, not a group
        if together && chain.points.last() != Some(&s.point) {
            let last = chain.sets.len() - 1;
            chain.sets[last] = s.after.clone();
        } else {
            chain.sets.push(s.after.clone());
            chain.points.push(s.point);
            chain.struck.push(s.struck.clone());
            times.push(s.t);
        }
    }
    Ok(Passage { chain, times, report })
}
