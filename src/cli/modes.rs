//! `signorini modes`

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use signorini::contact::States;
use signorini::contact::phase_modes;
use signorini::mesh::slender::stiff_in_bending;
use signorini::report::summary::significant;

use super::{Answer, CliError, Global, load};

/// Arguments of `modes`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  signorini modes scenarios/plate.toml --count 4")]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// How many modes
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..))]
    count: u32,
}

/// Natural frequencies of the open and of the closed phase.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let mut scene = global.scene(&arguments.scene)?;
    // an amplitude is chosen by what this command shows
    (scene.initial.mode, scene.initial.amplitude) = (None, None);
    let problem = load::of_scene(&scene)?;
    let system = &problem.system;
    let count = arguments.count as usize;
    let modes = |set: States| {
        let phase = system.phase(&set);
        phase_modes(system, &phase, count).map_err(|e| CliError::Numerics(e.to_string()))
    };
    let open = modes(States::open(system.n_contact()))?;
    let closed = match system.n_contact() {
        0 => None,
        // forces without a potential have no natural modes
        _ if !system.has_potential() && system.tangents().is_none() => None,
        n => Some(modes(States::closed(n))?),
    };
    Ok(global.answer(
        || {
            let object = |m: &signorini::fem::Modes| {
                let shapes: Vec<_> = m.shapes.iter().map(|x| system.body.nodal_o(x)).collect();
                json!({"omega": m.omega, "shapes": shapes})
            };
            json!({"title": scene.title, "n_o": system.n_o(), "open": object(&open), "closed": closed.as_ref().map(object),
                "warning": stiff_in_bending(&system.body.mesh).map(|s| s.to_string())})
        },
        || {
            let mut text = format!("{}\n  mode        open body: omega         period        closed body: omega         period\n", scene.title);
            let entry = |w: Option<&f64>| match w {
                Some(&w) if w > 0.0 => {
                    let period = significant(std::f64::consts::TAU / w, 7);
                    format!("{:>16} {period:>14}", significant(w, 10))
                }
                Some(_) => format!("{:>16} {:>14}", 0, "rigid"),
                None => String::new(),
            };
            for k in 0..open.omega.len() {
                let right = closed.as_ref().and_then(|m| m.omega.get(k));
                let _ = writeln!(text, "  {:>4} {}   {}", k + 1, entry(open.omega.get(k)), entry(right));
            }
            if let Some(stiff) = stiff_in_bending(&system.body.mesh) {
                let _ = writeln!(text, "  WARNING       {stiff}");
            }
            text
        },
    ))
}
