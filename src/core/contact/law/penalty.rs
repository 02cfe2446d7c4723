//! Penalty: the obstacle pushes like a spring at points of quadrature on the contact edge.
//!
//! ```text
//! M ü + K u + κ Σ w [n u − g]₊ nᵀ = f,     κ = κ₀E′/h
//! ```

use super::{Conduct, Law, Push};
use crate::contact::obstacle::Spring;
use crate::contact::site::Site;
use crate::contact::states::PointState;

/// The law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalty {
    /// `κ₀`: stiffness over the unit of the point.
    pub stiffness: f64,
}

impl Law for Penalty {
    fn name(&self) -> String {
        format!("penalty, κ₀ = {}", self.stiffness)
    }

    fn conduct(&self, state: PointState) -> Conduct {
        match state {
            PointState::Open => Conduct::Moves,
            _ => Conduct::Pushed,
        }
    }

    fn push(&self, site: &Site) -> Option<Push> {
        let spring = Spring { stiffness: self.stiffness * site.unit, preload: 0.0, share: 1.0 };
        Some(Push::along_normal(site, spring))
    }

    fn dissipates(&self) -> bool {
        false
    }
}
