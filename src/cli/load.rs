//! From the path of a scene to its problem, with the stored state that it may name.

use std::path::Path;

use signorini::problem::Problem;
use signorini::report::summary::mesh_warning;
use signorini::scenario::{Issue, Scene};
use signorini::store::{self, Raw, attributes};

use super::{CliError, Global};

/// The problem of a scene, for a command whose answer has no place for warnings: they go to the user at once.
pub fn warned(scene: &Scene, global: &Global) -> Result<Problem, CliError> {
    let problem = of_scene(scene)?;
    problem.notes.warnings.iter().for_each(|w| global.caller.warn(w));
    mesh_warning(&problem.system).iter().for_each(|w| global.caller.warn(w));
    Ok(problem)
}

/// Set up the problem of a scene that is read already.
pub(crate) fn of_scene(scene: &Scene) -> Result<Problem, CliError> {
    super::resources::check_body(scene)?;
    let stored = match &scene.initial.file {
        None => None,
        Some(file) => {
            // relative to the scene
            let folder = scene.source.file.parent().unwrap_or(Path::new(""));
            let mesh = signorini::problem::mesh(scene)?;
            let has_mesh = scene.body.kind != signorini::scenario::BodyKind::Matrices;
            let path = folder.join(file);
            let state = store::check_rows(&path, scene)
                .and_then(|()| store::read_state(&path, &mesh, has_mesh))
                .map_err(|e| {
                    let help = "give a file written by `signorini run` on the same mesh";
                    scene.error(Issue::new("initial.file", e.to_string(), help))
                })?;
            Some(state)
        }
    };
    Ok(Problem::new(scene, stored)?)
}

/// The scene of a file of results, with the place that it was read from; none where this version cannot read it.
pub(crate) fn stored(file: &Path, text: &str) -> Option<Scene> {
    let from = attributes(file, "").ok()?.into_iter().find(|(name, _)| name == "scene_file");
    let from = match from {
        Some((_, Raw::Words(words))) => words.into_iter().next().unwrap_or_default(),
        _ => String::new(),
    };
    Scene::parse(text, from.as_ref()).ok()
}
