//! Where a chart of orbits with one sequence of switches ends.

use std::fmt;

use crate::contact::PointState;

/// Where a chart ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Border {
    /// The phase of this number shrinks to nothing.
    Phase {
        /// Which.
        phase: usize,
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
        /// In words.
        what: String,
    },
}

impl fmt::Display for Border {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Border::Phase { what, .. } | Border::Touch { what, .. } => f.write_str(what),
        }
    }
}
