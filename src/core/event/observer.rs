//! Who takes what a run produces: samples, switches, grazings, checkpoints.

use std::borrow::Cow;
use std::ops::ControlFlow;

use super::checkpoint::Checkpoint;
use super::ledger::Energies;
use super::switch::{Grazing, Switch};
use crate::contact::States;
use crate::fem::Loads;

/// Windows that begin within so many steps between stored states behind a switch are those of a phase that may be short.
pub(super) const SOON: f64 = 16.0;

/// A stored state.
#[derive(Debug)]
pub struct Sample<'a> {
    /// Time.
    pub t: f64,
    /// All displacements `u = (u_O, u_C)`.
    pub u: &'a [f64],
    /// All velocities.
    pub v: &'a [f64],
    /// All accelerations; none where the observer does not ask for them ([`Observer::takes_accelerations`]), or nobody knows them.
    pub a: &'a [f64],
    /// Active set (continuous from the right).
    pub active: &'a States,
    /// Pressure at the contact nodes.
    pub pressure: &'a [f64],
    /// Traction of the obstacle on the body along the tangent of each contact point; empty without friction.
    pub traction: &'a [f64],
    /// Energies and work; none where only the surroundings of the contact are known ([`crate::flow::Flow::near`]): there other displacements and
    /// velocities are of an earlier time, too.
    pub energies: Option<Energies>,
    /// Sum of the energy jumps at switches so far.
    pub jumps: f64,
}

impl<'a> Sample<'a> {
    /// Displacements, velocities and accelerations with what contact displacements are counted from added; empty where they are not known.
    pub fn at_rest(&self, loads: &Loads) -> [Cow<'a, [f64]>; 3] {
        let mut all = [self.u, self.v, self.a].map(Cow::Borrowed);
        if loads.carried.moves_contact() {
            for (order, x) in (0..).zip(&mut all).filter(|x| !x.1.is_empty()) {
                loads.carried.add_contact(self.t, order, x.to_mut());
            }
        }
        all
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
    /// So many states besides are told of each window of a flow that begins within so many stored states behind a switch ([`SOON`]): a short phase is seen.
    fn looks_behind_switches(&self) -> usize {
        0
    }
    /// Whether samples come with accelerations.
    fn takes_accelerations(&self) -> bool {
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
