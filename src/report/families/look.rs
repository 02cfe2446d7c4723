//! How a family is drawn.

use super::branches::is_viscous;
use super::special::{Special, special};
use crate::records::{PointKind, PointRecord};
use crate::store::StoredFamily;

/// How a family is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// Stability by lines and dots, all special points.
    Full,
    /// Its multipliers belong to another system: nothing of stability.
    Unjudged,
    /// The quantity itself tells the stability; borders are left out.
    Plain,
}

impl Look {
    /// That of a family whose multipliers are not the quantity shown.
    pub(super) fn of(family: &StoredFamily) -> Self {
        if is_viscous(family) { Look::Unjudged } else { Look::Full }
    }

    /// How a point is marked.
    pub(super) fn marked(self, p: &PointRecord) -> Option<Special> {
        let hidden = match self {
            Look::Full => false,
            Look::Unjudged => matches!(p.special, PointKind::Stability(_)),
            Look::Plain => p.special.is_border(),
        };
        special(p).filter(|_| !hidden)
    }
}
