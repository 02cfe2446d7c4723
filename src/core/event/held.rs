//! Nodes held on a switching surface: how they come there and how they leave it (theory §5; their weights are in [`crate::contact`], their flow in
//! [`crate::flow`]).

use super::classify::{ClassifyError, Decision, Order, Surface};
use super::{Observer, Root, Run, Scratch, States};

/// Up to this many nodes all combinations of held nodes are tried.
const HELD_LIMIT: usize = 5;
/// Rounding errors of the weight of a held node.
const ROUNDING: f64 = 1e-12;

/// Whether a number is the weight of a node on the surface, to rounding.
pub(super) fn is_weight(theta: f64) -> bool {
    (-ROUNDING..=1.0 + ROUNDING).contains(&theta)
}

impl Surface<'_> {
    /// Neither side can be entered: hold as few nodes as possible on the surface.
    pub(super) fn held(
        &self,
        (base, unhindered): (&States, f64),
        nodes: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let unresolved = || ClassifyError::Unresolved { t: self.t, nodes: nodes.to_vec() };
        if nodes.len() > HELD_LIMIT {
            return Err(unresolved());
        }
        // each node: 0 free, 1 in contact, 2 held
        let count = 3usize.pow(nodes.len() as u32);
        let digit = |code: usize, k: usize| code / 3usize.pow(k as u32) % 3;
        let n_held = |code: usize| (0..nodes.len()).filter(|&k| digit(code, k) == 2).count();
        let mut codes: Vec<usize> = (0..count).filter(|&c| n_held(c) > 0).collect();
        codes.sort_by_key(|&c| n_held(c));
        for code in codes {
            let mut set = base.clone();
            let (mut held, mut others) = (vec![], vec![]);
            for (k, &i) in nodes.iter().enumerate() {
                set.set(i, self.state_of(i, digit(code, k) >= 1));
                if digit(code, k) == 2 { held.push(i) } else { others.push(i) }
            }
            let phase = self.system.held_phase(&set, &held);
            let theta = phase.held_theta(self.t, self.u_o, self.v_o, scratch);
            let inside = theta.iter().all(|t| is_weight(*t));
            let known = (&phase, unhindered);
            if inside && self.curvatures(known, &others, scratch).iter().all(|&c| c >= -1.0) {
                let grazing = nodes.to_vec();
                return Ok(Decision {
                    set,
                    held,
                    order: Order::Acceleration,
                    grazing,
                    ambiguous: Some(false),
                });
            }
        }
        Err(unresolved())
    }
}

impl<O: Observer> Run<'_, O> {
    /// A held node whose weight reached 0 or 1 leaves the surface to that side.
    pub(super) fn leave_hold(&self, root: &Root, base: &States) -> Option<Decision> {
        let monitor = &self.phase.monitors[root.index];
        if !monitor.kind.is_weight() {
            return None;
        }
        let held = self.phase.held.iter().copied().filter(|&i| i != monitor.point).collect();
        let order = Order::Acceleration;
        let set = base.with(monitor.point, monitor.to);
        Some(Decision { set, held, order, grazing: vec![], ambiguous: Some(false) })
    }
}

#[cfg(test)]
mod tests {
    use super::is_weight;

    #[test]
    fn weights_are_known_to_rounding() {
        assert!([-1e-14, 0.0, 0.3, 1.0, 1.0 + 1e-14].into_iter().all(is_weight));
        assert!(![-1e-9, 1.0 + 1e-9, f64::NAN].into_iter().any(is_weight));
    }
}
