//! What a run tells: samples, switches, grazings, outcome.

use std::ops::ControlFlow;

use super::checkpoint::Checkpoint;
use super::ledger::{Energies, Ledger};
use super::log::Log;
use super::proof::Proof;
use super::verify::LcpCheck;
use crate::contact::{MonitorKind, PointState, State, States};
use crate::flow::{Counters, FlowError};

/// A stored state.
#[derive(Debug)]
pub struct Sample<'a> {
    /// Time.
    pub t: f64,
    /// All displacements `u = (u_O, u_C)`.
    pub u: &'a [f64],
    /// All velocities.
    pub v: &'a [f64],
    /// Active set (continuous from the right).
    pub active: &'a States,
    /// Pressure at the contact nodes.
    pub pressure: &'a [f64],
    /// Energies and work; none where only the surroundings of the contact are known ([`crate::flow::Flow::near`]): there other displacements and
    /// velocities are of an earlier time, too.
    pub energies: Option<Energies>,
    /// Sum of the energy jumps at switches so far.
    pub jumps: f64,
}

/// Direction of a switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SwitchKind {
    /// A free node came into contact.
    Close,
    /// A node left the obstacle.
    Open,
    /// A node rebounded (impact law): it is free before and after.
    Impact,
    /// A node whose rebounds accumulated came to rest on the obstacle (impact law).
    Rest,
}

impl SwitchKind {
    /// All kinds.
    pub const ALL: [SwitchKind; 4] =
        [SwitchKind::Close, SwitchKind::Open, SwitchKind::Impact, SwitchKind::Rest];

    /// Name in files and JSON.
    pub fn name(self) -> &'static str {
        match self {
            SwitchKind::Close => "close",
            SwitchKind::Open => "open",
            SwitchKind::Impact => "impact",
            SwitchKind::Rest => "rest",
        }
    }

    /// The kind of a name in a file.
    pub fn of_name(name: &str) -> SwitchKind {
        // what rest was called in files of earlier versions
        let name = if name == "stick" { "rest" } else { name };
        SwitchKind::ALL.into_iter().find(|k| k.name() == name).unwrap_or(SwitchKind::Open)
    }

    /// Of a point that goes into a state.
    pub(crate) fn of_state(to: PointState) -> SwitchKind {
        SwitchKind::of_crossing(to.touches())
    }

    /// Of a node that comes into contact, or leaves it.
    pub fn of_crossing(closes: bool) -> SwitchKind {
        if closes { SwitchKind::Close } else { SwitchKind::Open }
    }

    /// Whether a node came against the obstacle.
    pub fn arrives(self) -> bool {
        self != SwitchKind::Open
    }
}

/// One node that switched. Several at one time are listed one after the other; their energy jumps add
/// up to the jump of the whole change.
#[derive(Debug, Clone, PartialEq)]
pub struct Switch {
    /// Time.
    pub t: f64,
    /// Contact point.
    pub point: usize,
    /// Mesh node.
    pub node: usize,
    /// Direction.
    pub kind: SwitchKind,
    /// What reached zero.
    pub monitor: MonitorKind,
    /// Rate of that monitor (gap or pressure per time), ≤ 0.
    pub monitor_rate: f64,
    /// `½ u̇_Oᵀ (M⁺ − M⁻) u̇_O`
    pub energy_jump: f64,
    /// Points that were pushed by an impulse at this time (impact law): their velocities jumped together.
    pub struck: Vec<usize>,
    /// Active set before.
    pub before: States,
    /// Active set after.
    pub after: States,
}

impl Switch {
    /// State of the point before.
    pub fn from(&self) -> PointState {
        self.before.at(self.point)
    }

    /// State of the point after.
    pub fn to(&self) -> PointState {
        self.after.at(self.point)
    }
}

/// A touch, or a switch that velocities could not decide.
#[derive(Debug, Clone, PartialEq)]
pub struct Grazing {
    /// Time.
    pub t: f64,
    /// Contact point.
    pub point: usize,
    /// Mesh node.
    pub node: usize,
    /// Least value of the monitor.
    pub distance: f64,
    /// What it was.
    pub kind: GrazingKind,
}

/// Kinds of grazing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GrazingKind {
    /// The monitor came within 1e-9 of its scale and turned back.
    NearMiss,
    /// Accelerations decided the next set.
    Decided,
    /// Several continuations were admissible; the present one was kept.
    Ambiguous,
    /// Accelerations admitted a set, of more than could be tried: whether it is the only one is not known.
    Untried,
    /// No side could be entered; the node was held on the surface.
    Held,
    /// The monitor touched zero so flatly that the time resolution cannot tell a touch from a crossing.
    Undecided,
}

impl GrazingKind {
    /// Name in files and JSON.
    pub fn name(self) -> &'static str {
        match self {
            GrazingKind::NearMiss => "near miss",
            GrazingKind::Decided => "decided by accelerations",
            GrazingKind::Ambiguous => "ambiguous, present phase kept",
            GrazingKind::Untried => "admissible, others not tried",
            GrazingKind::Held => "held on the surface",
            GrazingKind::Undecided => "tangent to time resolution",
        }
    }

    /// The kind of a name in a file (of which a file keeps 31 letters).
    pub fn of_name(name: &str) -> Option<GrazingKind> {
        use GrazingKind::*;
        let all = [NearMiss, Decided, Ambiguous, Untried, Held, Undecided];
        all.into_iter().find(|k| k.name() == name)
    }
}

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
        }
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
    /// All switches; none if the observer took them ([`Observer::takes_events`]).
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

/// Takes what a run produces, as it is produced.
pub trait Observer {
    /// What can go wrong on its side.
    type Error;
    /// A stored state.
    fn sample(&mut self, sample: &Sample) -> Result<(), Self::Error>;
    /// A switch.
    fn switch(&mut self, _switch: &Switch) -> Result<(), Self::Error> {
        Ok(())
    }
    /// A grazing.
    fn grazing(&mut self, _grazing: &Grazing) -> Result<(), Self::Error> {
        Ok(())
    }
    /// Whether the report need not list switches and grazings: the observer takes them as they come.
    fn takes_events(&self) -> bool {
        false
    }
    /// Whether of a sample only the contact and what lies next to it ([`crate::contact::distance::NEXT`]) is looked at: a flow may then know no more
    /// ([`Sample::energies`]).
    fn sees_contact_alone(&self) -> bool {
        false
    }
    /// Time reached; whether to go on.
    fn progress(&mut self, _t: f64) -> Result<ControlFlow<()>, Self::Error> {
        Ok(ControlFlow::Continue(()))
    }
    /// Whether [`Observer::phase`] is of use.
    fn keeps_checkpoints(&self) -> bool {
        false
    }
    /// A phase begins: all that is needed to go on from here.
    fn phase(&mut self, _checkpoint: Checkpoint) {}
}

/// An observer that keeps nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {
    type Error = std::convert::Infallible;
    fn sample(&mut self, _: &Sample) -> Result<(), Self::Error> {
        Ok(())
    }
}
