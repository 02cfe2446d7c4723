//! Which active set is next (theory §5).
//!
//! At a switch the indices with `w_i = p_i = 0` are degenerate. First the complementarity problem one order up,
//! `0 ≤ ẇ ⟂ ṗ ≥ 0` with `ṗ = S ẇ + q̇` (S the Schur complement of `N_C` on the degenerate indices, again a P-matrix). Where that
//! too is degenerate (grazing), the accelerations decide, and these differ from one set to the next: a set is admissible
//! if in *its own* phase the second derivatives of its monitors are ≥ 0. One admissible set is the rule; with several the
//! present one is kept and the event recorded; with none the node is held on the surface (Filippov).

use thiserror::Error;

use super::held::is_weight;
use crate::contact::lcp::UNITS;
use crate::contact::{
    ContactError, Degenerate, Phase, PointState, Scratch, Selection, States, System,
};

/// How a switch was decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// By displacements alone.
    Displacement,
    /// By the velocities.
    Velocity,
    /// By the accelerations: grazing.
    Acceleration,
}

/// The next phase.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// Active set (held nodes count as in contact).
    pub set: States,
    /// Nodes held on the surface.
    pub held: Vec<usize>,
    /// What decided.
    pub order: Order,
    /// Nodes decided by accelerations.
    pub grazing: Vec<usize>,
    /// Whether more than one continuation was admissible; none where not all were tried.
    pub ambiguous: Option<bool>,
}

/// No rule applies.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum ClassifyError {
    /// An operator failed.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// No admissible continuation was found among the sets that could be tried.
    #[error("no admissible continuation at t = {t:.12} for the contact nodes {nodes:?}")]
    Unresolved {
        /// Time.
        t: f64,
        /// Degenerate contact nodes (index in `u_C`).
        nodes: Vec<usize>,
    },
    /// A point that can but slip has come to rest on the surface.
    #[error("the contact node {node} comes to rest on the surface at t = {t:.12}")]
    Rests {
        /// Time.
        t: f64,
        /// Contact node (index in `u_C`).
        node: usize,
    },
}

/// A state on a switching surface.
pub struct Surface<'a> {
    /// Operators.
    pub system: &'a System,
    /// The phase that ends here.
    pub phase: &'a Phase,
    /// Time.
    pub t: f64,
    /// Displacements.
    pub u_o: &'a [f64],
    /// Velocities.
    pub v_o: &'a [f64],
    /// Time differences below this are rounding errors.
    pub resolution: f64,
}

/// Up to this many nodes all `2^k` sets are tried at the level of accelerations.
const ENUMERATION_LIMIT: usize = 10;
impl Surface<'_> {
    /// Decide the degenerate nodes; the others keep their place in `present`.
    pub fn decide(
        &self,
        present: &States,
        degenerate: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let decision = |set, order| Decision {
            set,
            held: vec![],
            order,
            grazing: vec![],
            ambiguous: Some(false),
        };
        if degenerate.is_empty() {
            return Ok(decision(present.clone(), Order::Displacement));
        }
        let Selection { set, degenerate: undecided } =
            self.by_velocity(present, degenerate, scratch)?;
        if undecided.is_empty() {
            return Ok(decision(set, Order::Velocity));
        }
        // undecided nodes enter as they are in the present phase
        let mut base = set;
        undecided.iter().for_each(|&i| base.set(i, present.at(i)));
        match self.system.is_lipschitz() {
            true => self.by_common_acceleration(&base, &undecided, scratch),
            false => self.by_acceleration(&base, &undecided, scratch),
        }
    }

    /// What a point does if it touches: what it did, or slips by its velocity.
    pub(super) fn state_of(&self, point: usize, touches: bool, base: &States) -> PointState {
        let from = base.at(point);
        match (touches, self.system.tangent(point)) {
            (true, _) if from.touches() => from,
            (true, Some(t)) => PointState::of_slip(t.slip_velocity(self.v_o)),
            _ => PointState::of_contact(touches),
        }
    }

    pub(super) fn acceleration(&self, phase: &Phase, scratch: &mut Scratch) -> Vec<f64> {
        let mut a = vec![0.0; self.system.n_o()];
        phase.acceleration(self.t, self.u_o, self.v_o, scratch, &mut a);
        a
    }

    /// `0 ≤ ẇ ⟂ ṗ ≥ 0` on the degenerate nodes; returns the set and the nodes that stay degenerate.
    fn by_velocity(
        &self,
        present: &States,
        points: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Selection, ClassifyError> {
        let a = match self.phase.set == *present && self.phase.held.is_empty() {
            true => self.acceleration(self.phase, scratch),
            false => self.acceleration(&self.system.phase(present), scratch),
        };
        let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let blur = largest * self.resolution / UNITS;
        let at = Degenerate { present, points, t: self.t, x: self.v_o, order: 1, blur };
        Ok(self.system.select_rates(at)?)
    }

    /// Where the acceleration is the same on both sides of the surface, it decides as the velocity did: `0 ≤ ẅ ⟂ p̈ ≥ 0`. What is degenerate even
    /// then stays as it is: every continuation is the same.
    fn by_common_acceleration(
        &self,
        base: &States,
        points: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let a = self.acceleration(&self.system.phase(base), scratch);
        let at = Degenerate { present: base, points, t: self.t, x: &a, order: 2, blur: 0.0 };
        let Selection { mut set, degenerate } = self.system.select_rates(at)?;
        degenerate.iter().for_each(|&i| set.set(i, base.at(i)));
        let grazing = points.to_vec();
        let order = Order::Acceleration;
        Ok(Decision { set, held: vec![], order, grazing, ambiguous: Some(false) })
    }

    /// Second derivatives of the monitors of `nodes` in a phase, over their rounding error.
    pub(super) fn curvatures(
        &self,
        phase: &Phase,
        nodes: &[usize],
        scratch: &mut Scratch,
    ) -> Vec<f64> {
        let a = self.acceleration(phase, scratch);
        let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let curvatures = phase.monitor_curvatures_at(self.t, &a);
        let rounding = phase.rate_rounding(largest);
        let of = |&i: &usize| {
            let k = phase.monitor_of(i).unwrap_or(0);
            curvatures[k] / (16.0 * rounding[k]).max(f64::MIN_POSITIVE)
        };
        nodes.iter().map(of).collect()
    }

    fn by_acceleration(
        &self,
        base: &States,
        nodes: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let decision = |set: States, ambiguous| Decision {
            set,
            held: vec![],
            order: Order::Acceleration,
            grazing: nodes.to_vec(),
            ambiguous,
        };
        if nodes.len() > ENUMERATION_LIMIT {
            return self.by_iteration(base, nodes, scratch);
        }
        let mut best: Option<(usize, States)> = None;
        let mut strict = 0;
        for bits in 0..1usize << nodes.len() {
            let mut set = base.clone();
            nodes
                .iter()
                .enumerate()
                .for_each(|(k, &i)| set.set(i, self.state_of(i, bits >> k & 1 == 1, base)));
            let curvature = self.curvatures(&self.system.phase(&set), nodes, scratch);
            if curvature.iter().any(|&c| c < -1.0) {
                continue;
            }
            strict += usize::from(curvature.iter().all(|&c| c > 1.0));
            let changes = nodes.iter().filter(|&&i| set.at(i) != base.at(i)).count();
            if best.as_ref().is_none_or(|(least, _)| changes < *least) {
                best = Some((changes, set));
            }
        }
        match best {
            Some((_, set)) => Ok(decision(set, Some(strict > 1))),
            None => self.held(base, nodes, scratch),
        }
    }

    /// Many nodes at once: change all inadmissible ones together, then one by one, until none is left. What changes again and again is attracted from both
    /// sides: it is held, and let go where its weight leaves `[0, 1]`. Whether there are other solutions is not asked.
    fn by_iteration(
        &self,
        base: &States,
        nodes: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        /// Rounds in which all change together.
        const TOGETHER: usize = 4;
        /// Changes one by one after which a node is held.
        const RESTLESS: usize = 2;
        let (mut set, mut held) = (base.clone(), vec![]);
        let mut changes = vec![0; self.system.n_contact()];
        for round in 0..8 * nodes.len() {
            let phase = self.system.held_phase(&set, &held);
            let free: Vec<usize> = nodes.iter().copied().filter(|i| !held.contains(i)).collect();
            let curvature = self.curvatures(&phase, &free, scratch);
            let wrong: Vec<usize> =
                free.iter().zip(&curvature).filter(|(_, c)| **c < -1.0).map(|(&i, _)| i).collect();
            let Some(&first) = wrong.first() else {
                let theta = match held.is_empty() {
                    true => vec![],
                    false => phase.held_theta(self.t, self.u_o, self.v_o, scratch),
                };
                let Some(k) = theta.iter().position(|t| !is_weight(*t)) else {
                    let (order, grazing) = (Order::Acceleration, nodes.to_vec());
                    return Ok(Decision { set, held, order, grazing, ambiguous: None });
                };
                // one is free, zero in contact
                let released = held.remove(k);
                set.set(released, self.state_of(released, theta[k] < 0.5, base));
                changes[released] = 0;
                continue;
            };
            let change = if round < TOGETHER { &wrong[..] } else { &[first][..] };
            for &i in change {
                set.set(i, phase.monitor_of(i).map_or(set.at(i), |k| phase.monitors[k].to));
                changes[i] += usize::from(round >= TOGETHER);
                if changes[i] > RESTLESS {
                    set.set(i, PointState::Closed);
                    held.push(i);
                }
            }
        }
        Err(ClassifyError::Unresolved { t: self.t, nodes: nodes.to_vec() })
    }
}
