//! Signorini's conditions: `0 ≤ g − u_C ⟂ p ≥ 0`, on a contact displacement without inertia.

use super::{Conduct, Law};
use crate::contact::states::PointState;

/// The law.
#[derive(Debug, Clone, Copy, Default)]
pub struct Signorini;

impl Law for Signorini {
    fn name(&self) -> String {
        "Signorini's conditions".into()
    }

    fn conduct(&self, state: PointState) -> Conduct {
        match state {
            PointState::Open => Conduct::Follows,
            _ => Conduct::Stands,
        }
    }

    fn dissipates(&self) -> bool {
        false
    }
}
