//! `response --doublings`, `response --through`: where branches begin that an earlier file leads to.

use signorini::families::doubling::{Doubling, of_family};
use signorini::families::through::{self, Seed};
use signorini::orbit::Closure;
use signorini::problem::Problem;
use signorini::records::{Way, fingerprint};
use signorini::scenario::Scene;
use signorini::store::StoredFamily;

use super::ratios::with_ratios;
use super::{CliError, load};

fn refuse<T>(response: &StoredFamily, why: &str) -> Result<T, CliError> {
    Err(CliError::Input(format!("{}: {why}", response.path.display())))
}

/// Damping ratios of the branches of a response, if it has several.
fn ratios(response: &StoredFamily) -> Option<Vec<f64>> {
    // as it was given, and not a rounding error beside: 7.000000000000001 % was 0.07
    let of = |percent: f64| format!("{:.13e}", percent / 100.0).parse().ok();
    response.branches.iter().map(|b| b.percent().and_then(of)).collect()
}

/// The scenes of a response, each with its damping ratio in percent.
pub(super) fn scenes(
    response: &StoredFamily,
    scene: &Scene,
) -> Result<Vec<(Option<f64>, Scene)>, CliError> {
    if response.branches.is_empty() {
        return refuse(response, "it has no branch");
    }
    match ratios(response) {
        Some(ratios) => with_ratios(scene, "--ratios", Some(&ratios)),
        None => Ok(vec![(None, scene.clone())]),
    }
}

/// Refuse a response that is not of a scene, but for its damping ratio.
pub(super) fn check(response: &StoredFamily, scene: &Scene) -> Result<(), CliError> {
    let scenes = scenes(response, scene).unwrap_or_default();
    let is_of = |first: &Scene| -> Result<bool, CliError> {
        Ok(response.identity.problem == fingerprint(first, &load::of_scene(first)?))
    };
    match scenes.first().map(|(_, first)| is_of(first)).transpose()? {
        Some(true) => Ok(()),
        _ => refuse(
            response,
            "it is no response of this scene; give the scene that it was made from",
        ),
    }
}

/// The period doublings of a response, which must be of this body, each with the number of its scene.
pub(super) fn of_response(
    response: &StoredFamily,
    scene: &Scene,
    problem: &Problem,
) -> Result<Vec<(usize, Doubling)>, CliError> {
    if response.identity.problem != fingerprint(scene, problem) {
        return refuse(
            response,
            "it is no response of this scene; give the scene that it was made from",
        );
    }
    let found = of_family(response, Closure::FORCED.unknowns(problem.system.n_o()));
    if found.is_empty() {
        return refuse(
            response,
            "it has no period doubling; give a response by shooting in which some orbits are unstable",
        );
    }
    let several = ratios(response).is_some();
    Ok(found.into_iter().map(|d| (if several { d.branch } else { 0 }, d)).collect())
}

/// The orbits of sweeps of this body through which branches are followed.
pub(super) fn of_sweep(
    sweep: &StoredFamily,
    scene: &Scene,
    problem: &Problem,
) -> Result<Vec<Seed>, CliError> {
    if sweep.outline().way != Way::Sweep {
        return refuse(sweep, "it is no sweep; give a file of `signorini response --sweep both`");
    }
    if sweep.identity.problem != fingerprint(scene, problem) {
        return refuse(sweep, "it is no sweep of this scene; give the scene that it was made from");
    }
    let found = through::seeds(sweep);
    if found.is_empty() {
        return refuse(sweep, "it met no orbit");
    }
    Ok(found)
}
