//! What a run comes to: how it ended, its numbers, its proof.

use super::ledger::Ledger;
use super::log::Log;
use super::proof::Proof;
use super::switch::{Grazing, Switch};
use super::verify::LcpCheck;
use crate::contact::{State, States};
use crate::flow::{Counters, FlowError};

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The end time was reached.
    EndTime,
    /// Switches accumulate.
    Accumulation {
        /// Time.
        t: f64,
        /// Switches within `window`.
        count: usize,
        /// Length of time.
        window: f64,
        /// Mesh nodes involved.
        nodes: Vec<usize>,
    },
    /// Whoever watches wanted no more.
    Interrupted {
        /// Time.
        t: f64,
    },
    /// The smooth flow could not be continued.
    Flow(FlowError),
    /// No admissible continuation was found.
    Unresolved {
        /// Time.
        t: f64,
        /// Mesh nodes.
        nodes: Vec<usize>,
    },
    /// In space a node has come to rest on a surface that slides, and might slip in any direction.
    Rests {
        /// Time.
        t: f64,
        /// Mesh nodes.
        nodes: Vec<usize>,
    },
}

impl Outcome {
    /// Whether the run did what it was asked to do.
    pub fn is_complete(&self) -> bool {
        *self == Outcome::EndTime
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Outcome::EndTime => write!(f, "end time reached"),
            Outcome::Accumulation { t, count, window, nodes } => write!(
                f,
                "accumulation of switches at t = {t:.9}, nodes {nodes:?}: {count} switches within {window:.3e}"
            ),
            Outcome::Interrupted { t } => write!(f, "interrupted at t = {t:.9}"),
            Outcome::Flow(e) => write!(f, "{e}"),
            Outcome::Unresolved { t, nodes } => {
                write!(f, "no admissible continuation at t = {t:.9}, nodes {nodes:?}")
            }
            Outcome::Rests { t, nodes } => write!(
                f,
                "nodes {nodes:?} come to rest on the surface at t = {t:.9}: in space they might slip in any direction, and friction there is that of a surface faster than the body"
            ),
        }
    }
}

/// What friction came to in a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Rubbed {
    /// Work of moving surfaces on the body.
    pub belt: f64,
    /// Of each contact point: what friction took, how far it slipped.
    pub points: Vec<(f64, f64)>,
}

impl Rubbed {
    /// What friction took at all points.
    pub fn work(&self) -> f64 {
        self.points.iter().map(|p| p.0).sum()
    }
}

/// The run in numbers, with what was proved on the way. Made by what integrated it: nobody else can.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Report {
    /// How it ended.
    pub outcome: Outcome,
    /// Time reached.
    pub t_end: f64,
    /// Last state.
    pub last: State,
    /// Last active set.
    pub active: States,
    /// Number of smooth phases.
    pub phases: usize,
    /// How many switches and grazings there were, and the first and the last.
    pub log: Log,
    /// All switches; none if the observer took them ([`super::Observer::takes_events`]).
    pub switches: Vec<Switch>,
    /// All grazings, likewise.
    pub grazings: Vec<Grazing>,
    /// What is proved of the search for switches.
    pub proof: Proof,
    /// What the flow has to say of its choices.
    pub flow_note: Option<String>,
    /// `H` at the start.
    pub energy_start: f64,
    /// `H` at the end.
    pub energy_end: f64,
    /// Sum of the jumps.
    pub energy_jumps: f64,
    /// Sum of the impulses by which the obstacle struck or pushed in steps (impact law, Moreau–Jean); what pressures push is not in it.
    pub blows: f64,
    /// Work of all loads.
    pub energy_external: f64,
    /// Dissipated energy.
    pub energy_dissipated: f64,
    /// What friction came to, of systems that have it.
    pub rubbed: Option<Rubbed>,
    /// Largest relative drift inside any one phase.
    pub energy_drift: f64,
    /// Largest relative defect of the whole ledger.
    pub energy_drift_total: f64,
    /// Largest penetration at a step's end or stored state.
    pub max_penetration: f64,
    /// By how much a gap of the method's own conditions was negative there: the same, but for obstacles that yield.
    pub gap_error: f64,
    /// Largest tension there.
    pub max_tension: f64,
    /// Work done.
    pub counters: Counters,
    /// Present if the solutions were verified ([`super::Verified`]).
    pub lcp_check: Option<LcpCheck>,
}

/// What a scheme of its own has to say of a run, for a report.
#[derive(Debug)]
pub struct Marched {
    /// How it ended, and when.
    pub outcome: Outcome,
    /// Time reached.
    pub t_end: f64,
    /// Last state, last active set.
    pub last: (State, States),
    /// All switches.
    pub log: Log,
    /// What is proved of them.
    pub proof: Proof,
    /// Work done.
    pub counters: Counters,
    /// In words.
    pub note: String,
}

impl Report {
    /// The report of a scheme that knows neither flows nor a search: what it does not say is zero.
    pub fn of(marched: Marched, ledger: &Ledger) -> Report {
        let Marched { outcome, t_end, last, log, proof, counters, note } = marched;
        let (log, switches, grazings) = log.into_lists();
        Report {
            outcome,
            t_end,
            last: last.0,
            active: last.1,
            phases: log.switches() + 1,
            log,
            switches,
            grazings,
            proof,
            flow_note: Some(note),
            energy_start: ledger.start(),
            energy_end: ledger.end(),
            energy_jumps: ledger.jumps(),
            blows: 0.0,
            energy_external: 0.0,
            energy_dissipated: 0.0,
            rubbed: None,
            energy_drift: ledger.drift_in_phase(),
            energy_drift_total: ledger.drift_total(),
            max_penetration: 0.0,
            gap_error: 0.0,
            max_tension: 0.0,
            counters,
            lcp_check: None,
        }
    }

    /// Every switch of the run that was asked for was found by proof: it reached its end, and what it proved holds (theory §12, H7).
    pub fn is_certified(&self) -> bool {
        self.outcome.is_complete() && self.proof.holds()
    }
}
