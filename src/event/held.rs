//! Nodes held on a switching surface: how they leave it (theory §5; the weights are in [`crate::contact`]).

use super::classify::{Decision, Order};
use super::{ActiveSet, MonitorKind, Observer, Root, Run};

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
