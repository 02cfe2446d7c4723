//! `response --doublings`: where the branches of twice the period begin.

use std::path::Path;

use signorini::families::doubling::{Doubling, of_family};
use signorini::orbit::Closure;
use signorini::records::fingerprint;
use signorini::scenario::Scene;
use signorini::store::StoredFamily;

use super::ratios::with_ratios;
use super::{CliError, load};

/// The scenes of a response that has period doublings, each with its damping ratio in percent; and the doublings, each with the number of its scene.
type Found = (Vec<(Option<f64>, Scene)>, Option<Vec<(usize, Doubling)>>);

/// The period doublings of the response in a file, which must be of this scene.
pub(super) fn of_file(file: &Path, scene: &Scene) -> Result<Found, CliError> {
    let family = StoredFamily::read(file)?;
    let refuse = |why: &str| {
        let text = format!("--doublings {}: {why}", file.display());
        Err(CliError::Input(text))
    };
    let percents: Vec<Option<f64>> = family.branches.iter().map(|b| b.percent()).collect();
    let ratios: Option<Vec<f64>> = percents.iter().map(|p| p.map(|p| p / 100.0)).collect();
    let scenes = match &ratios {
        Some(ratios) => with_ratios(scene, Some(ratios))?,
        None => vec![(None, scene.clone())],
    };
    let Some((_, first)) = scenes.first() else { return refuse("it has no branch") };
    let problem = load::of_scene(first)?;
    if family.identity.as_ref().is_none_or(|k| k.problem != fingerprint(&problem)) {
        return refuse("it is no response of this scene; give the scene that it was made from");
    }
    let size = Closure::FORCED.unknowns(problem.system.n_o());
    let found = of_family(&family, size);
    if found.is_empty() {
        return refuse(
            "it has no period doubling; give a response by shooting in which some orbits are unstable",
        );
    }
    let scene_of = |d: &Doubling| if ratios.is_some() { d.branch } else { 0 };
    Ok((scenes, Some(found.into_iter().map(|d| (scene_of(&d), d)).collect())))
}
