//! Nodes held on a switching surface: how they come there and how they leave it (theory §5; their weights are in [`crate::contact`], their flow in
//! [`crate::flow`]).

use super::classify::{ClassifyError, Decision, Order, Surface};
use super::{ActiveSet, MonitorKind, Observer, Root, Run, Scratch};

/// Up to this many nodes all combinations of held nodes are tried.
const HELD_LIMIT: usize = 5;

impl Surface<'_> {
    /// Neither side can be entered: hold as few nodes as possible on the surface.
    pub(super) fn held(
        &self,
        base: &ActiveSet,
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
                set.set(i, digit(code, k) >= 1);
                if digit(code, k) == 2 { held.push(i) } else { others.push(i) }
            }
            let phase = self.system.held_phase(&set, &held);
            let theta = phase.held_theta(self.t, self.u_o, self.v_o, scratch);
            let inside = theta.iter().all(|t| (0.0..=1.0).contains(t));
            if inside && self.curvatures(&phase, &others, scratch).iter().all(|&c| c >= -1.0) {
                let grazing = nodes.to_vec();
                return Ok(Decision {
                    set,
                    held,
                    order: Order::Acceleration,
                    grazing,
                    ambiguous: false,
                });
            }
        }
        Err(unresolved())
    }
}

impl<O: Observer> Run<'_, O> {
    /// A held node whose weight reached 0 or 1 leaves the surface to that side.
    pub(super) fn leave_hold(&self, root: &Root, base: &ActiveSet) -> Option<Decision> {
        let monitor = self.phase.monitors[root.index];
        let active = match monitor.kind {
            MonitorKind::HeldToContact => true,
            MonitorKind::HeldToFree => false,
            _ => return None,
        };
        let held = self.phase.held.iter().copied().filter(|&i| i != monitor.node).collect();
        let order = Order::Acceleration;
        let set = base.with(monitor.node, active);
        Some(Decision { set, held, order, grazing: vec![], ambiguous: false })
    }
}
