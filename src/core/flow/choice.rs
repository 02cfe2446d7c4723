//! Several flows behind one face: a rule chooses at the start of every phase.
//!
//! Exact flows know no held nodes (Filippov, theory §5): such phases always go by Dormand–Prince at a tight tolerance, and so do phases whose modes cannot be
//! computed (friction at the boundary of flutter, or of jamming).

use std::ops::Range;

use super::held::TIGHT;
use super::{Counters, Enclosure, Flow, FlowError, RungeKutta, dop853::DOP853};
use crate::contact::{Phase, System};

/// Which of several flows takes a phase.
pub trait Rule {
    /// Index of the flow for a phase without held nodes; `spent` is what each flow has spent so far.
    fn choose(&mut self, phase: &Phase, spent: &dyn Fn(usize) -> Counters) -> usize;
    /// Another flow for the rest of the phase that the flow `chosen` has; asked before every window.
    fn reconsider(
        &mut self,
        _phase: &Phase,
        _chosen: usize,
        _spent: &dyn Fn(usize) -> Counters,
    ) -> Option<usize> {
        None
    }
    /// What a reader of the summary should know of the choices.
    fn note(&self) -> Option<String> {
        None
    }
    /// What it has seen, and will choose by: for a run that goes on later.
    fn memory(&self, _spent: &dyn Fn(usize) -> Counters) -> Vec<f64> {
        vec![]
    }
    /// Take over what another rule of the same kind had seen, once the flow that it chose has begun the phase anew.
    fn recall(&mut self, _memory: &[f64], _spent: &dyn Fn(usize) -> Counters) {}
}

/// There is but one flow.
#[derive(Debug, Clone, Copy)]
pub struct Only;

impl Rule for Only {
    fn choose(&mut self, _: &Phase, _: &dyn Fn(usize) -> Counters) -> usize {
        0
    }
}

/// Flows with the rule that chooses among them; the last one takes the phases with held nodes.
pub struct Choice<'a, R> {
    name: &'static str,
    flows: Vec<Box<dyn Flow + 'a>>,
    rule: R,
    chosen: usize,
}

impl<'a, R: Rule> Choice<'a, R> {
    /// Put flows under a rule.
    pub fn new(
        name: &'static str,
        system: &'a System,
        mut flows: Vec<Box<dyn Flow + 'a>>,
        rule: R,
    ) -> Self {
        flows.push(Box::new(RungeKutta::new(system, &DOP853, TIGHT)));
        Choice { name, flows, rule, chosen: 0 }
    }

    fn active(&self) -> &dyn Flow {
        self.flows[self.chosen].as_ref()
    }

    fn active_mut(&mut self) -> &mut (dyn Flow + 'a) {
        self.flows[self.chosen].as_mut()
    }
}

impl<R: Rule> Flow for Choice<'_, R> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        let flows = &self.flows;
        self.chosen = match phase.held.is_empty() {
            true => self.rule.choose(phase, &|k| flows[k].counters()),
            false => flows.len() - 1,
        };
        self.active_mut().begin(phase, t, y);
    }

    fn advance(&mut self, phase: &Phase, t_limit: f64) -> Result<(), FlowError> {
        let (flows, chosen) = (&self.flows, self.chosen);
        if let Some(other) = self.rule.reconsider(phase, chosen, &|k| flows[k].counters()) {
            let (_, t) = self.active().window();
            let y = self.active_mut().end_state().to_vec();
            self.chosen = other;
            self.active_mut().begin(phase, t, &y);
        }
        match self.active_mut().advance(phase, t_limit) {
            // a phase whose modes cannot be had goes by steps
            Err(FlowError::NoModes { .. }) if self.chosen + 1 < self.flows.len() => {
                let (_, t) = self.active().window();
                let y = self.active_mut().end_state().to_vec();
                self.chosen = self.flows.len() - 1;
                self.active_mut().begin(phase, t, &y);
                self.active_mut().advance(phase, t_limit)
            }
            done => done,
        }
    }

    fn cut(&mut self, phase: &Phase, t: f64) {
        self.active_mut().cut(phase, t);
    }

    fn window(&self) -> (f64, f64) {
        self.active().window()
    }

    fn end_state(&mut self) -> &[f64] {
        self.active_mut().end_state()
    }

    fn state(&self, t: f64, y: &mut [f64]) {
        self.active().state(t, y);
    }

    fn near(&self, t: f64) -> Option<Range<usize>> {
        self.active().near(t)
    }

    fn complete(&mut self, phase: &Phase) {
        self.active_mut().complete(phase);
    }

    fn is_anchor(&self) -> bool {
        self.active().is_anchor()
    }

    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        self.active().enclose(index, a, b)
    }

    fn counters(&self) -> Counters {
        self.flows.iter().fold(Counters::default(), |sum, flow| sum + flow.counters())
    }

    fn name(&self) -> &'static str {
        self.name
    }

    fn is_exact(&self) -> bool {
        self.active().is_exact()
    }

    fn deviations(&self) -> Vec<f64> {
        self.active().deviations()
    }

    fn note(&self) -> Option<String> {
        self.rule.note().or_else(|| self.active().note())
    }

    /// The flow that has the phase; what each flow knows; what the rule knows.
    fn memory(&self) -> Vec<f64> {
        let of_flows = self.flows.iter().flat_map(|flow| flow.memory());
        let of_rule = self.rule.memory(&|k| self.flows[k].counters());
        std::iter::once(self.chosen as f64).chain(of_flows).chain(of_rule).collect()
    }

    /// The rule is not asked again: by what it has seen since, it might choose otherwise.
    fn resume(&mut self, phase: &Phase, (t, y): (f64, &[f64]), memory: &[f64]) {
        let (chosen, mut rest) = memory.split_first().unwrap_or((&0.0, &[]));
        self.chosen = (*chosen as usize).min(self.flows.len() - 1);
        self.active_mut().begin(phase, t, y);
        for flow in &mut self.flows {
            let Some((own, others)) = rest.split_at_checked(flow.memory().len()) else { return };
            flow.recall(own);
            rest = others;
        }
        let flows = &self.flows;
        self.rule.recall(rest, &|k| flows[k].counters());
    }
}

/// An exact flow, with the stand-in for phases with held nodes.
pub fn exact<'a>(flow: Box<dyn Flow + 'a>, system: &'a System) -> Choice<'a, Only> {
    Choice::new(flow.name(), system, vec![flow], Only)
}
