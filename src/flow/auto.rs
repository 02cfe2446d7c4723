//! The exact flow that costs least, phase by phase.
//!
//! A phase by its modes costs one eigensolution the first time and almost nothing afterwards; without modes it costs some eighty
//! products every time. Measured on one core (consistent mass; `make bench` shows the parts): an eigensolution
//! `4·10⁻¹⁰ n³` s, a product `10⁻⁷ n` s. So a phase goes to the modes once the products of its visits so far, this one
//! included, would have paid for them. Damping and harmonic loads have no product form: there the choice is
//! between modes and Dormand–Prince at the scene's tolerance, at some three hundred right-hand sides a phase. The rule looks
//! at sizes and counts only, never at a clock: a scene gives the same result every time.

use std::collections::HashMap;

use super::{
    Chebyshev, Counters, Enclosure, Flow, FlowError, Modal, RungeKutta, Tolerances, dop853,
};
use crate::contact::{ActiveSet, Nbm, Phase};

/// Seconds of an eigensolution over `n³`.
const EIGEN: f64 = 4e-10;
/// Seconds of a phase without modes over `n`: eighty products, or three hundred right-hand sides.
const PRODUCTS: f64 = 80.0 * 1e-7;
const STEPS: f64 = 300.0 * 1e-7;
/// Largest size for which modes are considered: their matrices fill the memory.
const MODAL_LIMIT: usize = 4000;

/// The flow; see the module's text.
pub struct Auto<'a> {
    n: f64,
    per_visit: f64,
    modal: Modal<'a>,
    other: Box<dyn Flow + 'a>,
    visits: HashMap<ActiveSet, u32>,
    by_modes: bool,
    modal_phases: u64,
    other_phases: u64,
}

impl<'a> Auto<'a> {
    /// A flow that has seen no phase yet.
    pub fn new(nbm: &'a Nbm, tolerances: Tolerances) -> Self {
        let conservative = nbm.damping.is_none() && nbm.loads.harmonics.is_empty();
        let n = nbm.n_o() as f64;
        let other: Box<dyn Flow + 'a> = if conservative {
            Box::new(Chebyshev::new(nbm))
        } else {
            Box::new(RungeKutta::new(nbm, &dop853::DOP853, tolerances))
        };
        Auto {
            n,
            per_visit: if conservative { PRODUCTS * n } else { STEPS * n },
            modal: Modal::new(nbm),
            other,
            visits: HashMap::new(),
            by_modes: false,
            modal_phases: 0,
            other_phases: 0,
        }
    }

    fn active(&self) -> &dyn Flow {
        if self.by_modes { &self.modal } else { self.other.as_ref() }
    }

    fn active_mut(&mut self) -> &mut (dyn Flow + 'a) {
        if self.by_modes { &mut self.modal } else { self.other.as_mut() }
    }
}

impl Flow for Auto<'_> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        let visits = self.visits.entry(phase.set.clone()).or_insert(0);
        *visits += 1;
        let paid = f64::from(*visits) * self.per_visit;
        self.by_modes = self.n <= MODAL_LIMIT as f64 && EIGEN * self.n.powi(3) <= paid;
        if self.by_modes {
            self.modal_phases += 1;
        } else {
            self.other_phases += 1;
        }
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
        self.modal.counters() + self.other.counters()
    }

    fn name(&self) -> &'static str {
        "auto"
    }

    fn is_exact(&self) -> bool {
        self.active().is_exact()
    }

    fn note(&self) -> Option<String> {
        let other = self.other.name();
        Some(match (self.modal_phases, self.other_phases) {
            (m, 0) => {
                format!("modal for all {m} phases: at this size an eigensolution pays at once")
            }
            (0, o) => format!(
                "{other} for all {o} phases: no set came back often enough to pay for its modes"
            ),
            (m, o) => {
                format!(
                    "{other} for {o} phases, modal for {m}: their sets came back and paid for their modes"
                )
            }
        })
    }
}
