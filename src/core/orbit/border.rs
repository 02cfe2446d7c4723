//! Where a chart of orbits with one sequence of switches ends.

use std::fmt;

use crate::contact::{PointState, System};
use crate::records::{GrazingRecord, PointKind};

/// Where a chart ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Border {
    /// The phase of this number shrinks to nothing.
    Phase {
        /// Which.
        phase: usize,
        /// The visit that it is, if it is one: the contact point, and the state that it comes into and leaves.
        visit: Option<(usize, PointState)>,
        /// In words.
        what: String,
    },
    /// A monitor touches zero inside a phase.
    Touch {
        /// Phase.
        phase: usize,
        /// Contact point.
        point: usize,
        /// The state that it would go into.
        to: PointState,
        /// Where, as a fraction of the time to the end.
        near: f64,
        /// Other points that graze with it.
        together: Vec<usize>,
        /// In words.
        what: String,
    },
}

impl Border {
    /// The contact point that grazes there, and the state of the visit that begins or ends to be.
    pub fn grazing(&self) -> Option<(usize, PointState)> {
        match self {
            Border::Phase { visit, .. } => *visit,
            Border::Touch { point, to, .. } => Some((*point, *to)),
        }
    }

    /// Contact points that graze with it.
    fn together(&self) -> &[usize] {
        match self {
            Border::Phase { .. } => &[],
            Border::Touch { together, .. } => together,
        }
    }

    /// All contact points that graze there.
    pub(super) fn points(&self) -> impl Iterator<Item = usize> {
        self.grazing().map(|(point, _)| point).into_iter().chain(self.together().iter().copied())
    }
}

impl Border {
    /// Whether the points that change are among those that graze.
    pub(super) fn explains(&self, mut changed: impl Iterator<Item = usize>) -> bool {
        changed.all(|p| self.points().any(|q| q == p))
    }

    /// As a point of a family, whose frequency turns back there or not.
    pub(super) fn kind(&self, turns: bool, system: &System) -> PointKind {
        match self.grazing() {
            Some((point, to)) => {
                let node = |point: usize| system.constraints[point].node;
                let (opening, together) = (to == PointState::Open, self.together());
                let together = together.iter().map(|p| node(*p)).collect();
                PointKind::Grazing(GrazingRecord { node: node(point), opening, turns, together })
            }
            None => PointKind::Border(self.to_string()),
        }
    }
}

impl fmt::Display for Border {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Border::Phase { what, .. } | Border::Touch { what, .. } => f.write_str(what),
        }
    }
}
