//! What a contact method is: from an active set to the data of its phase, and from a state to its active set.
//!
//! All methods of this house give piecewise linear second-order systems `M_α ẍ + C_α ẋ + K_α x = f_α(t)` with affine monitors. Everything above
//! (flows, search for switches, orbits, harmonic balance) knows phases and never asks for a method's name; what a method *is*
//! (Lipschitz? conservative?) it says itself.

use std::fmt::Debug;
use std::sync::Arc;

use super::ContactError;
use super::conditions::{Conditions, Rates};
use super::constraint::Constraint;
use super::friction::Friction;
use super::impact::Impact;
use super::inertia::Inertia;
use super::law::Law;
use super::obstacle::Obstacle;
use super::phase::{Parts, Phase};
use super::states::States;
use crate::fem::{Body, Loads, Reduction};

/// The active set of a state.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// The set.
    pub set: States,
    /// Contact points that may be counted to either side: `w = p = 0` to rounding.
    pub degenerate: Vec<usize>,
}

/// A state one order up: what decides the degenerate points.
#[derive(Debug, Clone, Copy)]
pub struct Degenerate<'a> {
    /// The set of all other points.
    pub present: &'a States,
    /// The degenerate points.
    pub points: &'a [usize],
    /// Time.
    pub t: f64,
    /// `u̇_O` (order 1) or `ü_O` (order 2).
    pub x: &'a [f64],
    /// 1 or 2.
    pub order: u32,
    /// Rounding errors of `x`.
    pub blur: f64,
}

/// What can be relied on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Promise {
    /// The acceleration is continuous across switches: no saltation (but for stiffness-proportional damping), one continuation from every state.
    pub is_lipschitz: bool,
    /// The energy of an undamped motion without harmonic loads is constant.
    pub conserves_energy: bool,
    /// The contact conditions are those of the stress of the displacement field, pointwise (not of nodal reactions).
    pub is_strong: bool,
    /// The body enters the obstacle, which pushes back like a spring: penetration is the method's, not an error.
    pub yields: bool,
}

/// A contact method; one file each.
pub(super) trait Method: Debug + Send + Sync {
    /// In words, with its parameters, for summaries.
    fn name(&self) -> String;
    /// The same method for a body in fewer coordinates of `u_O`.
    fn reduced(&self, body: &Body, reduction: &Reduction) -> Result<Arc<dyn Method>, ContactError>;

    /// What can be relied on.
    fn promise(&self) -> Promise;

    /// What one point does.
    fn law(&self) -> &dyn Law;

    /// The complementarity problem.
    fn conditions(&self) -> &Arc<Conditions>;

    /// The mass of the phases.
    fn inertia(&self) -> &Arc<Inertia>;

    /// The contact points in the order of active sets.
    fn constraints(&self, body: &Body) -> Vec<Constraint>;

    /// Friction of the contact points, of methods that have it.
    fn friction(&self) -> Option<&Arc<Friction>> {
        None
    }

    /// The obstacle, where contact displacements have inertia.
    fn obstacle(&self) -> Option<&Arc<Obstacle>> {
        None
    }

    /// The set of a state, warm from `start`.
    fn select(
        &self,
        loads: &Loads,
        t: f64,
        x: &[f64],
        start: &States,
    ) -> Result<Selection, ContactError> {
        self.select_by_conditions(loads, t, x, start)
    }

    /// The set by the complementarity problem.
    fn select_by_conditions(
        &self,
        loads: &Loads,
        t: f64,
        x: &[f64],
        start: &States,
    ) -> Result<Selection, ContactError> {
        let load = self.conditions().load_pressure(loads, t, 0);
        let solution = self.conditions().solve(x, load.as_deref(), start)?;
        let mut set = States::of_contact(solution.active);
        self.keep(&mut set, start);
        Ok(Selection { set, degenerate: solution.degenerate })
    }

    /// The same one order up, on the degenerate points alone.
    fn select_rates(&self, loads: &Loads, at: Degenerate) -> Result<Selection, ContactError> {
        let load = self.conditions().load_pressure(loads, at.t, at.order);
        let rates = Rates { x: at.x, load: load.as_deref(), blur: at.blur };
        let (mut set, degenerate) = self.conditions().solve_rates(at.present, at.points, rates)?;
        self.keep(&mut set, at.present);
        Ok(Selection { set, degenerate })
    }

    /// Points that are still in contact do what they did; displacements tell no more.
    fn keep(&self, set: &mut States, before: &States) {
        if let Some(friction) = self.friction() {
            friction.keep(set, before);
        }
    }

    /// The phase of a set.
    fn phase(&self, parts: &Parts, set: &States) -> Phase;

    /// The law by which velocities jump, of a method that has one.
    fn impact(&self) -> Option<&Impact> {
        None
    }

    /// The load of a uniform acceleration, on the mass of the method.
    fn gravity(&self, body: &Body, acceleration: &[f64]) -> Vec<f64>;

    /// A bound of the natural frequencies of all phases; not finite where none is known.
    fn highest_frequency(&self) -> f64;

    /// Columns over `u_O` on which `M_α`, `K_α` and the monitors of the phases differ.
    fn directions(&self, body: &Body) -> Vec<Vec<(usize, f64)>>;
}
