//! Contact: boundary stress, complementarity, active sets, methods, phases (theory §2–5).

mod added;
pub(crate) mod adhesion;
mod around;
mod bearings;
#[doc(hidden)]
pub mod boundary;
mod condensed;
pub(crate) mod conditions;
mod constraint;
pub(crate) mod coupling;
mod damping;
#[doc(hidden)]
pub mod distance;
mod equilibrium;
mod excursions;
mod expansion;
mod following;
pub(crate) mod friction;
mod given;
mod gram;
mod held;
mod impact;
mod inertia;
pub(crate) mod law;
pub mod lcp;
mod massive;
mod method;
mod modes;
mod monitor;
mod nbm;
mod obstacle;
#[doc(hidden)]
pub mod oracle;
pub(crate) mod phase;
mod reactions;
mod recurrence;
mod redistribution;
mod reduction;
mod relief;
mod rest;
mod resultants;
mod scratch;
mod site;
pub(crate) mod states;
pub(crate) mod system;
mod tractions;

pub(crate) use added::Added;
pub(crate) use adhesion::{Choice, Touch};
pub use bearings::{Bearings, Borne, Pull};
pub use boundary::Stress;
pub use conditions::{Conditions, Gaps};
pub use constraint::Constraint;
pub use damping::{Dampers, Rayleigh};
pub use equilibrium::NoEquilibrium;
pub(crate) use equilibrium::{monitor_tolerance, static_displacement};
pub use excursions::{Excursions, Strayed};
pub use expansion::{Drive, MeasuredDrive};
pub(crate) use friction::Creep;
pub use friction::{Anchor, Elastic, RubbingRates, Slider, Tangent};
pub use given::Given;
pub use impact::{Blow, BlowMap, Impact};
pub use law::{
    Conduct, Coulomb, Exit, Instants, Law, March, Nitsche, Penalty, Push, Restitution, Rule,
    Signorini, Stepping, Stop,
};
pub use lcp::LcpError;
pub use method::{Degenerate, Promise, Selection};
pub(crate) use modes::grazing_of;
pub use modes::{grazing_scale, phase_modes};
pub use monitor::{Monitor, MonitorKind, leading};
pub use obstacle::Spring;
pub use phase::{Lost, Phase};
pub use recurrence::{Recurrence, Step};
pub use redistribution::MassChoice;
pub use relief::relief;
pub use rest::Rest;
pub use resultants::Resultants;
pub use scratch::Scratch;
pub use site::{Site, at_displacements, on_sides};
pub use states::{PointState, States};
pub use system::{Contacts, OMITTED_INERTIA, Rubs, State, System, Units};

use crate::fem::FemError;
use thiserror::Error;

/// The third coordinate of a place, where there is one.
fn third(z: f64) -> String {
    if z == 0.0 { String::new() } else { format!(", {z:.6}") }
}

/// What can go wrong in the contact operators.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum ContactError {
    /// `N_C` cannot be shown to be a P-matrix.
    #[error(
        "the contact conditions may have several solutions: N_C cannot be shown to be a P-matrix near \
         contact node {node} at ({:.6}, {:.6}{})", at[0], at[1], third(at[2])
    )]
    NotPMatrix {
        /// Mesh node.
        node: usize,
        /// Its position.
        at: [f64; 3],
    },
    /// Nitsche's stiffness does not outweigh what its consistent terms take away.
    #[error(
        "gamma = {gamma} makes the open body unstable: it must exceed {bound:.6}, the bound of coercivity on this mesh"
    )]
    NotCoercive {
        /// `γ₀`
        gamma: f64,
        /// What it must exceed.
        bound: f64,
    },
    /// A mass along one direction, and contact in several.
    #[error(
        "the optimal mass is one along the direction of the contact, and there are several directions"
    )]
    SeveralDirections,
    /// The optimal mass has other moments than the body.
    #[error(
        "the moments of the redistributed mass differ from those of the body by {off:.1e} of its mass: too few nodes are left to carry them"
    )]
    Moments {
        /// The largest difference, over mass and size.
        off: f64,
    },
    /// Friction beside a method that has none.
    #[error(
        "friction acts on nodal reactions and tangents that keep their mass: mass redistribution, or stress = \"reaction\" with inertia = \"constant\""
    )]
    NoFriction,
    /// Nothing has mass along rough obstacles, and no states of the points go together.
    #[error(
        "at t = {t} no states of the points before the rough obstacle go together: the coefficient of friction may be beyond the bound of tangent = \"massless\""
    )]
    NoAdhesion {
        /// When.
        t: f64,
    },
    /// Springs that rounding errors drown.
    #[error(
        "springs {ratio:.1e} times as stiff as the body drown its own forces in rounding errors: give at most 1e8 times its stiffness"
    )]
    TooStiff {
        /// Stiffness over the largest entry of the body's.
        ratio: f64,
    },
    /// The pivoting failed.
    #[error(transparent)]
    Lcp(#[from] LcpError),
    /// A matrix could not be factorised.
    #[error(transparent)]
    Fem(#[from] FemError),
}
