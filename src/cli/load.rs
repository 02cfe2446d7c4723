//! From the path of a scene to its problem, with the stored state that it may name.

use std::path::Path;

use signorini::problem::Problem;
use signorini::scenario::{Issue, Scene};
use signorini::store;

use super::CliError;

/// Read a scene and set up its problem.
pub fn problem(path: &Path) -> Result<(Scene, Problem), CliError> {
    let scene = Scene::read(path)?;
    let stored = match &scene.initial.file {
        None => None,
        Some(file) => {
            // relative to the scene
            let folder = scene.source.file.parent().unwrap_or(Path::new(""));
            let mesh = signorini::problem::mesh(&scene);
            let state =
                store::read_state(&folder.join(file), &mesh.nodes, mesh.dim).map_err(|e| {
                    let help = "give a file written by `signorini run` on the same mesh";
                    scene.error(Issue::new("initial.file", e.to_string(), help))
                })?;
            Some(state)
        }
    };
    let problem = Problem::new(&scene, stored)?;
    Ok((scene, problem))
}
