//! A bilinear stop: beyond its gap a displacement meets a spring, which may be compressed already.
//!
//! ```text
//! M ü + K u + Σ w [P + k (n u − g)] nᵀ = f      over the points with n u > g
//! ```
//!
//! Without a preload the force is continuous, and it is a penalty whose stiffness somebody measured. With one it jumps by `P`: a motion that is too slow to push the spring
//! away rests against it.

use super::{Conduct, Exit, Law, Push};
use crate::contact::monitor::MonitorKind;
use crate::contact::obstacle::Spring;
use crate::contact::site::Site;
use crate::contact::states::PointState;

/// The law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// `k`, pressure over length (of bodies from matrices force over length).
    pub stiffness: f64,
    /// `P`, a pressure (a force).
    pub preload: f64,
}

impl Law for Stop {
    fn name(&self) -> String {
        format!("stop, k = {}, P = {}", self.stiffness, self.preload)
    }

    fn conduct(&self, state: PointState) -> Conduct {
        match state {
            PointState::Open => Conduct::Moves,
            _ => Conduct::Pushed,
        }
    }

    fn exits(&self, state: PointState) -> &'static [Exit] {
        match state {
            PointState::Open => &[(MonitorKind::Gap, PointState::Closed)],
            _ => &[(MonitorKind::Depth, PointState::Open)],
        }
    }

    fn push(&self, site: &Site) -> Option<Push> {
        let Stop { stiffness, preload } = *self;
        let spring = Spring { stiffness, preload, share: 1.0 };
        Some(Push::along_normal(site, spring))
    }

    fn dissipates(&self) -> bool {
        false
    }
}
