//! Contact laws: what a contact point may do, what its displacement does in each state, through which monitors it leaves, and whereto.
//!
//! A law knows one point at a time. Everything above (phases, flows, search for switches, orbits, harmonic balance) knows states, monitors and phases, and
//! asks for no law by name: what a law *is* (does it yield? dissipate? remember?) it says itself.
//!
//! | law | states | contact displacement |
//! | --- | --- | --- |
//! | [`Signorini`] | open, closed | follows; stands at the gap |
//! | [`Penalty`], [`Nitsche`] | open, closed | moves; moves, pushed by a spring |
//! | [`Stop`] | open, closed | moves; moves, pushed by a spring with a preload |
//! | [`Coulomb`] | open, stick, slip± (closed where there is no friction) | follows; stands at the gap |
//! | [`Restitution`] | open, closed | moves, its velocity jumps; is held by a reaction |

mod coulomb;
mod nitsche;
mod penalty;
mod restitution;
mod signorini;
mod stop;

pub use coulomb::Coulomb;
pub use nitsche::Nitsche;
pub use penalty::Penalty;
pub use restitution::{Instants, March, Restitution, Rule, Stepping};
pub use signorini::Signorini;
pub use stop::Stop;

use std::fmt::Debug;

use super::ContactError;
use super::monitor::MonitorKind;
use super::obstacle::Spring;
use super::site::Site;
use super::states::PointState;
use crate::fem::Body;

/// What the contact displacement of a point does in a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conduct {
    /// Without inertia: it follows from the others so that the contact pressure vanishes.
    Follows,
    /// Without inertia: it stands at the gap.
    Stands,
    /// With inertia: it moves, and nothing acts on it.
    Moves,
    /// With inertia: it moves, and the obstacle pushes at it ([`Law::push`]).
    Pushed,
    /// With inertia: a reaction holds it at the gap.
    Held,
}

/// A way out of a state: the monitor that reaches zero, and the state behind it.
pub type Exit = (MonitorKind, PointState);

/// The exits of laws with contact and without, that know the gap of a free point and the pressure of one in contact.
pub(crate) const OPEN_AND_CLOSED: [Exit; 2] =
    [(MonitorKind::Gap, PointState::Closed), (MonitorKind::Pressure, PointState::Open)];

/// How an obstacle that yields pushes at a point: the force `−w t (P + γ d)` on the body, `d = b u − g`.
#[derive(Debug, Clone, PartialEq)]
pub struct Push {
    /// `γ` and `P`, and the share of the force that has a potential.
    pub spring: Spring,
    /// `b`: entries over `u_O`.
    pub depth: Vec<(usize, f64)>,
    /// `t`, likewise.
    pub direction: Vec<(usize, f64)>,
}

impl Push {
    /// Of a spring along the normal, by how far the displacement is beyond the gap.
    pub fn along_normal(site: &Site, spring: Spring) -> Push {
        let n = site.displacement.clone();
        Push { spring, depth: n.clone(), direction: n }
    }
}

/// A contact law; one file each.
pub trait Law: Debug + Send + Sync {
    /// In words, with its parameters, for summaries.
    fn name(&self) -> String;

    /// The states that a point may be in.
    fn states(&self) -> &'static [PointState] {
        &[PointState::Open, PointState::Closed]
    }

    /// What the contact displacement does in a state.
    fn conduct(&self, state: PointState) -> Conduct;

    /// The monitors of a point in a state, and the states that they lead to.
    fn exits(&self, state: PointState) -> &'static [Exit] {
        match state {
            PointState::Open => &OPEN_AND_CLOSED[..1],
            _ => &OPEN_AND_CLOSED[1..],
        }
    }

    /// What is watched of a point in a state.
    fn watched(&self, state: PointState) -> MonitorKind {
        self.exits(state).first().map_or(MonitorKind::Gap, |exit| exit.0)
    }

    /// How the obstacle pushes at a point in the state [`Conduct::Pushed`]; none where no state is of that kind.
    fn push(&self, _site: &Site) -> Option<Push> {
        None
    }

    /// What it adds to the stiffness of the body at a point in every state: entries over `u_O`. It does not damp.
    fn consistent_terms(&self, _site: &Site) -> Vec<(usize, usize, f64)> {
        vec![]
    }

    /// What it does not go with.
    fn check(&self, _body: &Body, _sites: &[Site]) -> Result<(), ContactError> {
        Ok(())
    }

    /// Whether it takes energy from the body (but for what a harmonic load does, and damping).
    fn dissipates(&self) -> bool;

    /// Whether the states of the points are more than the displacements tell: a point that touches may be in contact or not.
    fn has_memory(&self) -> bool {
        false
    }

    /// The coefficient of restitution, and a scheme of its own, of a law by which velocities jump.
    fn restitution(&self) -> Option<Restitution> {
        None
    }
}
