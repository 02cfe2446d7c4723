//! What happens in a run: switches and grazings.

use crate::contact::{MonitorKind, PointState, States};

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
    /// A node in contact came to rest along the obstacle's surface (friction).
    Sticking,
    /// A node in contact began to move along the obstacle's surface, or turned back on it (friction).
    Slipping,
}

impl SwitchKind {
    /// All kinds.
    pub const ALL: [SwitchKind; 6] = [
        SwitchKind::Close,
        SwitchKind::Open,
        SwitchKind::Impact,
        SwitchKind::Rest,
        SwitchKind::Sticking,
        SwitchKind::Slipping,
    ];

    /// Name in files and JSON.
    pub fn name(self) -> &'static str {
        match self {
            SwitchKind::Close => "close",
            SwitchKind::Open => "open",
            SwitchKind::Impact => "impact",
            SwitchKind::Rest => "rest",
            SwitchKind::Sticking => "sticking",
            SwitchKind::Slipping => "slipping",
        }
    }

    /// The kind of a name in a file.
    pub fn of_name(name: &str) -> SwitchKind {
        // what rest was called in files of earlier versions
        let name = if name == "stick" { "rest" } else { name };
        SwitchKind::ALL.into_iter().find(|k| k.name() == name).unwrap_or(SwitchKind::Open)
    }

    /// Of a point that goes from one state to another.
    pub(crate) fn of_states(from: PointState, to: PointState) -> SwitchKind {
        match (from.touches() && to.touches(), to) {
            (true, PointState::Stick) => SwitchKind::Sticking,
            (true, _) => SwitchKind::Slipping,
            (false, _) => SwitchKind::of_crossing(to.touches()),
        }
    }

    /// Of a node that comes into contact, or leaves it.
    pub fn of_crossing(closes: bool) -> SwitchKind {
        if closes { SwitchKind::Close } else { SwitchKind::Open }
    }

    /// Whether a node that touches changed what it does along the obstacle.
    pub fn is_tangential(self) -> bool {
        matches!(self, SwitchKind::Sticking | SwitchKind::Slipping)
    }

    /// Whether a node came against the obstacle.
    pub fn arrives(self) -> bool {
        matches!(self, SwitchKind::Close | SwitchKind::Impact | SwitchKind::Rest)
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
