//! The exact flow that costs least, phase by phase.
//!
//! A phase by its modes costs one eigensolution the first time and almost nothing afterwards; without modes it costs some forty
//! products every time, and more where switches are far apart. Measured on one core (consistent mass; `make bench` shows the parts): an
//! eigensolution `4·10⁻¹⁰ n³` s, a product `10⁻⁷ n` s. So a phase goes to the modes, in its midst if need be, once the products that
//! its set has cost so far would have paid for them: never more than twice the cost of the better choice. Springs that do not damp with the body, and measured loads, have no product form: there the choice is
//! between modes and Dormand–Prince at the scene's tolerance, at some three hundred right-hand sides a phase. The rule looks
//! at sizes and counts only, never at a clock: a scene gives the same result every time.

use std::collections::HashMap;

use super::choice::{Choice, Rule};
use super::{Chebyshev, Counters, Flow, Modal, RungeKutta, Tolerances, dop853::DOP853};
use crate::contact::{Phase, States, System};

/// Seconds of an eigensolution over `n³`, and the largest size for which modes are considered: their matrices fill the memory. Real modes, and complex
/// ones of phases that the real ones do not decouple.
const EIGEN: (f64, usize) = (4e-10, 4000);
const COUPLED: (f64, usize) = (2e-8, 600);
/// Least products, or right-hand sides, of a phase without modes, and the seconds of one over `n`.
const PRODUCTS: f64 = 40.0;
const STEPS: f64 = 300.0;
const PRODUCT: f64 = 1e-7;
/// Sets whose costs are remembered.
const MOST_SETS: usize = 10_000;

/// The rule: flow 0 by modes, flow 1 without.
#[derive(Debug)]
pub struct LeastCost {
    n: f64,
    /// Contact points: the length of a set.
    points: usize,
    /// A load has a measured history: no closed form.
    is_measured: bool,
    /// Seconds of an eigensolution over `n³`, and the largest size for which modes are considered.
    eigen: (f64, usize),
    /// Products of a phase, at least.
    least: f64,
    other: &'static str,
    /// Products that each set has cost so far.
    paid: HashMap<States, f64>,
    /// The phase that products go into, with those before it.
    open: Option<(States, f64)>,
    modal_phases: u64,
    other_phases: u64,
}

/// Whether a body is too large for its modes, whatever they would save.
pub fn never_by_modes(system: &System) -> bool {
    system.is_entire() && system.n_o() > EIGEN.1
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
        points: system.n_contact(),
        eigen: if system.is_decoupled() { EIGEN } else { COUPLED },
        is_measured: !system.loads.measured.is_empty(),
        least: cost,
        other: other.name(),
        paid: HashMap::new(),
        open: None,
        modal_phases: 0,
        other_phases: 0,
    };
    Choice::new("auto", system, vec![Box::new(Modal::new(system)), other], rule)
}

impl LeastCost {
    /// Whether so many products of a set pay for its modes.
    fn pays(&self, products: f64) -> bool {
        let (seconds, limit) = self.eigen;
        let small = !self.is_measured && self.n <= limit as f64;
        small && seconds * self.n.powi(3) <= products * PRODUCT * self.n
    }

    /// What a set has cost before the present phase.
    fn paid(&self, set: &States) -> f64 {
        *self.paid.get(set).unwrap_or(&0.0)
    }
}

/// Bits of a state, and states in one number: as many as its mantissa of 52 bits holds.
const BITS: usize = 3;
const PACK: usize = 52 / BITS;

/// A set as numbers.
fn packed(set: &States) -> impl Iterator<Item = f64> {
    let codes: Vec<u8> = set.codes().collect();
    let bits = |codes: &[u8]| codes.iter().rev().fold(0u64, |b, c| b << BITS | u64::from(*c));
    let numbers: Vec<f64> = codes.chunks(PACK).map(|codes| bits(codes) as f64).collect();
    numbers.into_iter()
}

/// The set that [`packed`] made numbers of.
fn unpacked(numbers: &[f64], points: usize) -> States {
    let mask = (1 << BITS) - 1;
    let code = |i: usize| (numbers[i / PACK] as u64 >> (BITS * (i % PACK)) & mask) as u8;
    States::of_codes((0..points).map(code))
}

/// Products so far.
fn products(spent: &dyn Fn(usize) -> Counters) -> f64 {
    let other = spent(1);
    (other.products + other.rhs_evaluations) as f64
}

impl Rule for LeastCost {
    fn choose(&mut self, phase: &Phase, spent: &dyn Fn(usize) -> Counters) -> usize {
        let now = products(spent);
        if let Some((set, before)) = self.open.take() {
            *self.paid.entry(set).or_insert(0.0) += now - before;
        }
        // sets that never come back are forgotten
        if self.paid.len() > MOST_SETS {
            self.paid.clear();
        }
        if self.pays(self.paid(&phase.set) + self.least) {
            self.modal_phases += 1;
            return 0;
        }
        self.other_phases += 1;
        self.open = Some((phase.set.clone(), now));
        1
    }

    fn reconsider(
        &mut self,
        phase: &Phase,
        chosen: usize,
        spent: &dyn Fn(usize) -> Counters,
    ) -> Option<usize> {
        let before = self.open.as_ref().filter(|_| chosen == 1)?.1;
        let cost = self.paid(&phase.set) + products(spent) - before;
        self.pays(cost).then_some(0)
    }

    /// Phases of either flow; sets with what they have cost; the present set, if products go into it, with what it has cost since its phase began.
    fn memory(&self, spent: &dyn Fn(usize) -> Counters) -> Vec<f64> {
        let phases = [self.modal_phases as f64, self.other_phases as f64];
        let open = self.open.as_ref().map(|(set, before)| (set, products(spent) - before));
        let is_open = f64::from(u8::from(open.is_some()));
        let entries = open.into_iter().chain(self.paid.iter().map(|(set, cost)| (set, *cost)));
        let numbers = entries.flat_map(|(set, cost)| packed(set).chain([cost]));
        phases.into_iter().chain([is_open]).chain(numbers).collect()
    }

    fn recall(&mut self, memory: &[f64], spent: &dyn Fn(usize) -> Counters) {
        let Some((&[modal, other, is_open], sets)) = memory.split_first_chunk() else { return };
        (self.modal_phases, self.other_phases) = (modal as u64, other as u64);
        let points = self.points;
        let entry =
            |entry: &[f64]| entry.split_last().map(|(cost, set)| (unpacked(set, points), *cost));
        let mut entries = sets.chunks_exact(points.div_ceil(PACK) + 1).filter_map(entry);
        let open = if is_open == 0.0 { None } else { entries.next() };
        self.open = open.map(|(set, cost)| (set, products(spent) - cost));
        self.paid = entries.collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_packed_and_unpacked() {
        for points in [0usize, 1, PACK - 1, PACK, PACK + 1, 200] {
            let set = States::of_contact((0..points).map(|i| (i * i) % 7 < 3));
            let numbers: Vec<f64> = packed(&set).collect();
            assert_eq!(numbers.len(), points.div_ceil(PACK));
            assert_eq!(unpacked(&numbers, points), set);
        }
    }
}
