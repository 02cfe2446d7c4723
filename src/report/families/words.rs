//! What a family is, in words for titles and legends.

use crate::records::{Solver, Way};
use crate::report::summary::significant;
use crate::store::StoredFamily;

/// `β = …` of a viscous family.
pub(in crate::report) fn viscosity(family: &StoredFamily) -> Option<String> {
    if family.outline().way == Way::Amplitudes {
        return None;
    }
    let known = family.identity.method.viscosity();
    let orbits = family.points.iter().filter_map(|p| p.orbit.as_ref());
    let beta =
        known.or_else(|| orbits.filter_map(|o| o.viscous.as_ref()).map(|v| v.beta).next())?;
    let rounded = significant(beta, 3);
    // without zeros at its end
    Some(format!("β = {}", rounded.parse::<f64>().map_or(rounded, |beta| beta.to_string())))
}

/// What computed a family, in words for a legend.
pub(in crate::report) fn kind(family: &StoredFamily) -> String {
    let outline = family.outline();
    let response = outline.way == Way::Response;
    match outline.solver {
        Solver::Shooting if outline.way == Way::Sweep => "sweep".into(),
        Solver::Shooting if response => "forced response".into(),
        Solver::Shooting => "conservative shooting".into(),
        Solver::Viscous => match viscosity(family) {
            Some(beta) => format!("viscous shooting, {beta}"),
            None => "viscous shooting".into(),
        },
        Solver::HarmonicBalance if outline.way == Way::Amplitudes => "damped nonlinear mode".into(),
        Solver::HarmonicBalance if response => "forced response by harmonic balance".into(),
        Solver::HarmonicBalance => match viscosity(family) {
            Some(beta) => format!("viscous, {beta}, harmonic balance"),
            None => "harmonic balance".into(),
        },
        Solver::Check => "orbits in time".into(),
    }
}
