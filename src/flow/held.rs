//! Exact flows know no held nodes: such phases (Filippov, theory §5) go by Dormand–Prince at a tight tolerance.

use super::{Counters, Enclosure, Flow, FlowError, RungeKutta, Tolerances, dop853::DOP853};
use crate::contact::{Nbm, Phase};

/// Tolerance of the phases with held nodes.
const TIGHT: Tolerances = Tolerances { rtol: 1e-13, atol: 1e-16 };

/// An exact flow, and the one that stands in for it while nodes are held.
pub struct WithHeld<'a, F> {
    exact: F,
    stand_in: RungeKutta<'a>,
    holding: bool,
}

impl<'a, F: Flow> WithHeld<'a, F> {
    /// Wrap an exact flow.
    pub fn new(nbm: &'a Nbm, exact: F) -> Self {
        WithHeld { exact, stand_in: RungeKutta::new(nbm, &DOP853, TIGHT), holding: false }
    }

    fn active(&self) -> &dyn Flow {
        if self.holding { &self.stand_in } else { &self.exact }
    }

    fn active_mut(&mut self) -> &mut dyn Flow {
        if self.holding { &mut self.stand_in } else { &mut self.exact }
    }
}

impl<F: Flow> Flow for WithHeld<'_, F> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        self.holding = !phase.held.is_empty();
        self.active_mut().begin(phase, t, y);
    }

    fn advance(&mut self, phase: &Phase, t_limit: f64) -> Result<(), FlowError> {
        self.active_mut().advance(phase, t_limit)
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

    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        self.active().enclose(index, a, b)
    }

    fn counters(&self) -> Counters {
        self.exact.counters() + self.stand_in.counters()
    }

    fn name(&self) -> &'static str {
        self.exact.name()
    }

    fn is_exact(&self) -> bool {
        self.active().is_exact()
    }

    fn note(&self) -> Option<String> {
        self.exact.note()
    }
}
