//! Coulomb's law on Signorini's conditions: `0 ≤ g − u_n ⟂ r_n ≥ 0`, `r_t ∈ μ r_n Sgn(v_t − V)`, on normal displacements without inertia and tangential ones
//! that keep theirs, or have none either. Points without friction are open or closed.

use super::{Conduct, Exit, Law, OPEN_AND_CLOSED};
use crate::contact::monitor::MonitorKind;
use crate::contact::states::PointState;

/// The law; the coefficients are those of the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// Least and largest `μ`, where there is friction at obstacles.
    pub coefficients: Option<[f64; 2]>,
    /// Displacements along the obstacles have no mass either.
    pub is_massless: bool,
    /// Number of sliders, whose limit force stays.
    pub sliders: usize,
}

const STICK: [Exit; 3] = [
    (MonitorKind::Pressure, PointState::Open),
    (MonitorKind::StickPlus, PointState::SlipPlus),
    (MonitorKind::StickMinus, PointState::SlipMinus),
];
const SLIP: [Exit; 2] =
    [(MonitorKind::Pressure, PointState::Open), (MonitorKind::Slip, PointState::Stick)];

impl Law for Coulomb {
    fn name(&self) -> String {
        let along = if self.is_massless { " without mass along the obstacle" } else { "" };
        let at_obstacles = self.coefficients.map(|[least, largest]| match least == largest {
            true => format!("Coulomb's friction{along}, μ = {least}"),
            false => format!("Coulomb's friction{along}, μ = {least} … {largest}"),
        });
        let sliders = match self.sliders {
            0 => None,
            1 => Some("1 slider".to_owned()),
            n => Some(format!("{n} sliders")),
        };
        at_obstacles.into_iter().chain(sliders).collect::<Vec<_>>().join(", ")
    }

    fn states(&self) -> &'static [PointState] {
        &PointState::ALL
    }

    fn conduct(&self, state: PointState) -> Conduct {
        if state.touches() { Conduct::Stands } else { Conduct::Follows }
    }

    fn exits(&self, state: PointState) -> &'static [Exit] {
        match state {
            PointState::Open => &OPEN_AND_CLOSED[..1],
            PointState::Closed => &OPEN_AND_CLOSED[1..],
            PointState::Stick => &STICK,
            PointState::SlipPlus | PointState::SlipMinus => &SLIP,
        }
    }

    fn dissipates(&self) -> bool {
        true
    }
}
