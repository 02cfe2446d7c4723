//! The complementarity problem of every stored state against two independent solutions, as an observer around another.

use std::ops::ControlFlow;

use super::{Checkpoint, Grazing, Observer, Sample, Switch};
use crate::contact::{System, oracle};

/// Comparison of the pivoted solutions with two independent ones.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct LcpCheck {
    /// States compared.
    pub states: u64,
    /// Largest difference to the enumeration, relative to the largest gap (none above 12 nodes).
    pub enumeration: Option<f64>,
    /// Largest difference to the interior-point solution, likewise.
    pub interior_point: f64,
    /// States at which the interior-point method gave up.
    pub gave_up: u64,
}

/// Compares the gaps of every sample, and hands everything on.
#[derive(Debug)]
pub struct Verified<'a, O> {
    system: &'a System,
    inner: &'a mut O,
    /// What was found so far.
    pub check: LcpCheck,
}

impl<'a, O> Verified<'a, O> {
    /// Around an observer of a run of this system.
    pub fn new(system: &'a System, inner: &'a mut O) -> Self {
        Verified { system, inner, check: LcpCheck::default() }
    }

    fn compare(&mut self, s: &Sample) {
        let (system, check) = (self.system, &mut self.check);
        let conditions = system.conditions();
        let load = system.load_pressure(s.t);
        let u_o = &s.u[..system.n_o()];
        // the gaps in front are the unknowns
        let u_c = system.towards_obstacles(s.u);
        let (q, _) = conditions.data(u_o, load.as_deref());
        let facing = system.constraints.iter().zip(&u_c).take(conditions.facing());
        let w: Vec<f64> = facing.map(|(c, u)| c.gap - u).collect();
        let scale = w.iter().fold(system.units.length, |m, x| m.max(x.abs()));
        let distance = |other: &[f64]| {
            w.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / scale
        };
        check.states += 1;
        let Some((matrix, q)) = conditions.plain(&q) else {
            check.gave_up += 1;
            return;
        };
        if q.len() <= oracle::ENUMERATION_LIMIT {
            let all = oracle::enumerate(&matrix, &q);
            let nearest = all.iter().map(|x| distance(x)).fold(f64::INFINITY, f64::min);
            check.enumeration = Some(check.enumeration.unwrap_or(0.0).max(nearest));
        }
        match oracle::clarabel(&matrix, &q) {
            Some(x) => check.interior_point = check.interior_point.max(distance(&x)),
            None => check.gave_up += 1,
        }
    }
}

impl<O: Observer> Observer for Verified<'_, O> {
    type Error = O::Error;
    fn sample(&mut self, sample: &Sample) -> Result<(), O::Error> {
        self.compare(sample);
        self.inner.sample(sample)
    }
    fn switch(&mut self, switch: &Switch) -> Result<(), O::Error> {
        self.inner.switch(switch)
    }
    fn grazing(&mut self, grazing: &Grazing) -> Result<(), O::Error> {
        self.inner.grazing(grazing)
    }
    fn progress(&mut self, t: f64) -> Result<ControlFlow<()>, O::Error> {
        self.inner.progress(t)
    }
    fn takes_events(&self) -> bool {
        self.inner.takes_events()
    }
    fn sees_contact_alone(&self) -> bool {
        self.inner.sees_contact_alone()
    }
    fn takes_accelerations(&self) -> bool {
        self.inner.takes_accelerations()
    }
    fn keeps_checkpoints(&self) -> bool {
        self.inner.keeps_checkpoints()
    }
    fn phase(&mut self, checkpoint: Checkpoint) {
        self.inner.phase(checkpoint);
    }
}
