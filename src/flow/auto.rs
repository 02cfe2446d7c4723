//! The exact flow that costs least, phase by phase.
//!
//! A phase by its modes costs one eigensolution the first time and almost nothing afterwards; without modes it costs at least some eighty
//! products every time (of each of its vectors), and as many as phases have cost so far. Measured on one core (consistent mass; `make bench` shows the parts): an eigensolution
//! `4·10⁻¹⁰ n³` s, a product `10⁻⁷ n` s. So a phase goes to the modes once the products of its visits so far, this one
//! included, would have paid for them. Springs that do not damp with the body, and measured loads, have no product form: there the choice is
//! between modes and Dormand–Prince at the scene's tolerance, at some three hundred right-hand sides a phase. The rule looks
//! at sizes and counts only, never at a clock: a scene gives the same result every time.

use std::collections::HashMap;

use super::choice::{Choice, Rule};
use super::{Chebyshev, Counters, Flow, Modal, RungeKutta, Tolerances, dop853::DOP853};
use crate::contact::{ActiveSet, Phase, System};

/// Seconds of an eigensolution over `n³`, and the largest size for which modes are considered: their matrices fill the memory. Real modes, and complex
/// ones of phases that the real ones do not decouple.
const EIGEN: (f64, usize) = (4e-10, 4000);
const COUPLED: (f64, usize) = (2e-8, 600);
/// Least products, or right-hand sides, of a phase without modes, and the seconds of one over `n`.
const PRODUCTS: f64 = 80.0;
const STEPS: f64 = 300.0;
const PRODUCT: f64 = 1e-7;

/// The rule: flow 0 by modes, flow 1 without.
#[derive(Debug)]
pub struct LeastCost {
    n: f64,
    /// A load has a measured history: no closed form.
    is_measured: bool,
    /// Seconds of an eigensolution over `n³`, and the largest size for which modes are considered.
    eigen: (f64, usize),
    /// Products of a phase, at least.
    least: f64,
    other: &'static str,
    visits: HashMap<ActiveSet, u32>,
    modal_phases: u64,
    other_phases: u64,
}

/// The flow that has seen no phase yet.
pub fn auto(system: &System, tolerances: Tolerances) -> Choice<'_, LeastCost> {
    let n = system.n_o() as f64;
    let (other, cost): (Box<dyn Flow + '_>, f64) = if system.is_entire() {
        (Box::new(Chebyshev::new(system)), PRODUCTS)
    } else {
        (Box::new(RungeKutta::new(system, &DOP853, tolerances)), STEPS)
    };
    let rule = LeastCost {
        n,
        eigen: if system.is_decoupled() { EIGEN } else { COUPLED },
        is_measured: !system.loads.measured.is_empty(),
        least: cost,
        other: other.name(),
        visits: HashMap::new(),
        modal_phases: 0,
        other_phases: 0,
    };
    Choice::new("auto", system, vec![Box::new(Modal::new(system)), other], rule)
}

impl Rule for LeastCost {
    fn choose(&mut self, phase: &Phase, spent: &dyn Fn(usize) -> Counters) -> usize {
        let visits = self.visits.entry(phase.set.clone()).or_insert(0);
        *visits += 1;
        let other = spent(1);
        let products = (other.products + other.rhs_evaluations) as f64;
        let per_visit = (products / self.other_phases.max(1) as f64).max(self.least);
        let paid = f64::from(*visits) * per_visit * PRODUCT * self.n;
        let (seconds, limit) = self.eigen;
        if !self.is_measured && self.n <= limit as f64 && seconds * self.n.powi(3) <= paid {
            self.modal_phases += 1;
            0
        } else {
            self.other_phases += 1;
            1
        }
    }

    fn note(&self) -> Option<String> {
        let other = self.other;
        if self.is_measured {
            return Some(format!("{other}: a measured load has no closed form"));
        }
        Some(match (self.modal_phases, self.other_phases) {
            (m, 0) => {
                format!("modal for all {m} phases: at this size an eigensolution pays at once")
            }
            (0, o) => format!(
                "{other} for all {o} phases: no set came back often enough to pay for its modes"
            ),
            (m, o) => format!(
                "{other} for {o} phases, modal for {m}: their sets came back and paid for their modes"
            ),
        })
    }
}
