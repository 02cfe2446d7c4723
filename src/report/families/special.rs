//! Special points of a family, and how they are marked.

use crate::records::{Bifurcation, PointKind, PointRecord};
use crate::report::figure::Mark;

/// Special points that are marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Special {
    Border,
    Bifurcation,
    Fold,
}

impl Special {
    /// All, the last on top.
    pub(super) const ALL: [Special; 3] = [Special::Border, Special::Bifurcation, Special::Fold];

    pub(super) fn mark(self) -> Mark {
        match self {
            Special::Border => Mark::Ring,
            Special::Bifurcation => Mark::Diamond,
            Special::Fold => Mark::Triangle,
        }
    }
}

/// How a point is marked. Bifurcations between unstable orbits are not: they would hide the branch.
pub(super) fn special(p: &PointRecord) -> Option<Special> {
    match &p.special {
        PointKind::Fold => Some(Special::Fold),
        PointKind::Border(_) | PointKind::Grazing(_) => Some(Special::Border),
        PointKind::BranchPoint => Some(Special::Bifurcation),
        PointKind::Stability(change) if !change.stays_unstable() => Some(Special::Bifurcation),
        _ => None,
    }
}

/// Whether a special point is one of stability, where the orbit itself is neither stable nor unstable.
pub(super) fn is_critical(p: &PointRecord) -> bool {
    p.special == PointKind::Fold || bifurcation(&p.special).is_some()
}

/// What a bifurcation is called in a legend.
pub(super) fn bifurcation(kind: &PointKind) -> Option<&'static str> {
    match kind {
        PointKind::BranchPoint => Some("branch point"),
        PointKind::Stability(change) => Some(match change.how {
            Bifurcation::PeriodDoubling => "period doubling",
            Bifurcation::NeimarkSacker => "Neimark–Sacker",
            Bifurcation::PlusOne => "multiplier through +1",
        }),
        _ => None,
    }
}
