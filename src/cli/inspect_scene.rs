//! `signorini inspect SCENE.toml`: what a scene comes to, before anything is computed of it.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;

use signorini::contact::phase_modes;
use signorini::problem::{Problem, parts};
use signorini::report::summary::{inward_corners, mesh_warning, significant};
use signorini::scenario::Scene;

use super::{Answer, CliError, Global, load};

/// Frequencies that are told.
const FEW: usize = 3;

/// Whether a file is a scene, by its name.
pub(crate) fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// The masses of the parts of a body of elements, by their names.
fn masses(scene: &Scene, problem: &Problem) -> Vec<(String, f64)> {
    let body = &problem.system.body;
    if body.materials().is_empty() {
        return vec![];
    }
    let parts = parts(scene, &body.mesh);
    let mut all: Vec<(String, f64)> = parts.names.into_iter().map(|name| (name, 0.0)).collect();
    for (mass, part) in body.nodal_mass().into_iter().zip(parts.of_node) {
        all[part].1 += mass;
    }
    all
}

/// Say what a scene comes to.
pub fn run(path: &Path, global: &Global) -> Result<Answer, CliError> {
    let scene = global.scene(path)?;
    let problem = load::of_scene(&scene)?;
    let system = &problem.system;
    let masses = masses(&scene, &problem);
    let modes = phase_modes(system, &system.open_phase(), FEW)
        .map_err(|e| CliError::Numerics(e.to_string()))?;
    let mut warnings = problem.notes.warnings.clone();
    warnings.extend(mesh_warning(system));
    warnings.extend(inward_corners(&system.body.mesh));
    let gaps = system.gaps();
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let most = gaps.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (all, moving, points) = (system.n_displacements(), system.n_o(), system.n_contact());
    Ok(global.answer(
        || {
            let of_part = |(name, mass): &(String, f64)| json!({"name": name, "mass": mass});
            json!({
                "title": scene.title, "n_dof": all, "n_o": moving, "n_contact": points,
                "masses": masses.iter().map(of_part).collect::<Vec<_>>(),
                "gap": (points > 0).then_some([least, most]), "omega": modes.omega, "warnings": warnings,
            })
        },
        || {
            let mut out = String::new();
            let mut line = |label: &str, text: String| {
                let _ = writeln!(out, "  {label:<12}{text}");
            };
            line("scene", scene.name());
            line("body", format!("{all} displacements, {moving} move by themselves"));
            // a sum of shares that comes to .09999… is .1
            let rounded = |x: f64| significant(format!("{x:.4e}").parse().unwrap_or(x), 5);
            let part = |(name, mass): &(String, f64)| format!("{name} {}", rounded(*mass));
            match &masses[..] {
                [] => {}
                [(_, mass)] => line("mass", rounded(*mass)),
                several => {
                    let sum: f64 = several.iter().map(|m| m.1).sum();
                    let each: Vec<String> = several.iter().map(part).collect();
                    line("mass", format!("{} ({})", rounded(sum), each.join(", ")));
                }
            }
            if points > 0 {
                let (least, most) = (significant(least, 5), significant(most, 5));
                line("contact", format!("{points} points, gaps from {least} to {most}"));
            }
            let list = |factor: f64| {
                let words: Vec<String> =
                    modes.omega.iter().map(|w| significant(factor * w, 6)).collect();
                words.join(", ")
            };
            let cycles = list(1.0 / std::f64::consts::TAU);
            line("open body", format!("omega {}; over 2 pi {cycles}", list(1.0)));
            warnings.iter().for_each(|w| line("warning", w.clone()));
            line("next", format!("signorini run {0}, or signorini modes {0}", path.display()));
            out
        },
    ))
}
