//! `signorini trust`

use std::path::PathBuf;

use clap::Args;

use signorini::compare::trust::trust;
use signorini::continuation::Go;
use signorini::report::trust::{json, text};

use super::progress::Bar;
use super::{Answer, CliError, Global, load};

/// Arguments of `trust`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini trust scenarios/plate.toml\n  signorini trust bracket.toml --json | jq .figures\n\n\
    What moves: frequencies, and where the scene has [run] forces, impulses, displacements, energy, switches and what [[probe]] watches. \
    Linear triangles and tetrahedra are solved again with the same mesh of second order, all others with elements of half the size."
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
}

/// Compute the scene on other meshes, and say what moves.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let scene = global.scene(&arguments.scene)?;
    let problem = load::of_scene(&scene)?;
    global.caller.watch();
    let bar = Bar::new(global, &scene);
    let set_up = |scene: &signorini::scenario::Scene| load::of_scene(scene).map_err(|e| e.text());
    let found = trust(&scene, &problem, &set_up, |share, what| {
        if let Some(bar) = &bar {
            bar.set(share, what.to_owned());
        }
        match global.caller.signal() {
            None => Go::Continue(()),
            Some(_) => Go::Break(()),
        }
    });
    if let Some(bar) = &bar {
        bar.clear();
    }
    let Some(trust) = found.map_err(CliError::Numerics)? else {
        let signal = global.caller.signal().unwrap_or_default();
        return Err(CliError::Interrupted(signal, "interrupted: nothing is kept".into()));
    };
    let title = super::title(&scene);
    Ok(global.answer(|| json(&trust), || format!("{title}\n{}", text(&trust))))
}
