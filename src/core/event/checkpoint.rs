//! What a run needs to go on from the beginning of a phase, to the last bit.
//!
//! Inside a phase the flow is anchored at its beginning; a run that goes on from there takes the same steps as one that was never
//! interrupted.

use super::evidence::Evidence;
use super::ledger::Ledger;
use crate::contact::States;

/// The state of a run at the beginning of a phase.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// Time.
    pub t: f64,
    /// `u_O`, `u̇_O`, and the integrals of work and dissipation where there are such.
    pub y: Vec<f64>,
    /// States of the contact points in the phase that begins.
    pub states: States,
    /// Nodes held on the surface.
    pub held: Vec<usize>,
    /// Contact nodes whose near misses are recorded.
    pub armed: Vec<bool>,
    /// Recent switches: time and mesh node.
    pub recent: Vec<(f64, usize)>,
    /// The ledger.
    pub ledger: [f64; 8],
    /// Counts and extremes.
    pub seen: Evidence,
    /// Potential of the loads at the start.
    pub potential_start: f64,
    /// Time of the last stored state.
    pub last_stored: f64,
    /// Next sample.
    pub next_sample: usize,
    /// Phases.
    pub phases: usize,
    /// What the flow has learnt.
    pub flow: Vec<f64>,
    /// Stored states, switches and grazings until here.
    pub rows: [usize; 3],
}

impl Checkpoint {
    /// Of a scheme of its own, that knows neither flows nor a search: time and state, states of the points, largest penetration and impulses; the next
    /// sample, stored states and switches.
    pub(crate) fn marched(
        (t, y): (f64, Vec<f64>),
        states: &States,
        ledger: &Ledger,
        (penetration, blows): (f64, f64),
        [next_sample, stored, switches]: [usize; 3],
    ) -> Checkpoint {
        Checkpoint {
            t,
            y,
            states: states.clone(),
            held: vec![],
            armed: vec![true; states.len()],
            recent: vec![],
            ledger: ledger.numbers(),
            seen: Evidence { gap_error: penetration, blows, ..Evidence::default() },
            potential_start: 0.0,
            last_stored: t,
            next_sample,
            phases: 0,
            flow: vec![],
            rows: [stored, switches, 0],
        }
    }
}
