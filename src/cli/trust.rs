//! `signorini trust`

use std::path::PathBuf;

use clap::Args;
use serde_json::json as object;

use signorini::compare::trust::{Periodic, trust};
use signorini::continuation::Go;
use signorini::families::start;
use signorini::orbit::Closure;
use signorini::problem::Problem;
use signorini::report::figure::{self, Drawing};
use signorini::report::margins;
use signorini::report::trust::{json, text};
use signorini::scenario::Scene;
use signorini::store::{Outputs, beside, replace};

use super::progress::Bar;
use super::{Answer, CliError, Global, family, load, viscous};

/// Arguments of `trust`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini trust scenarios/plate.toml\n  signorini trust scenarios/probed-plate.toml -o trust          # with trust.csv and trust.svg\n  signorini trust bracket.toml --json | jq .figures\n  signorini trust scenarios/half-plate-response.toml --orbit --omega 1.6\n\n\
    What moves: frequencies, and where the scene has [run] forces, impulses, displacements, energy, switches and what [[probe]] watches; \
    the same of an orbit with --orbit, found anew on each mesh as by signorini orbit. \
    Linear triangles and tetrahedra are solved again with the same mesh of second order, all others with elements of half the size."
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// Also the periodic motion at the frequency of the scene's [orbit], or of its loads: its forces, peaks, multipliers
    #[arg(long)]
    orbit: bool,
    /// Frequency of the orbit
    #[arg(long, value_name = "W", requires = "orbit", allow_negative_numbers = true)]
    omega: Option<f64>,
    /// Also write the table, STEM.csv, and the picture of how far each number is off, STEM.svg, .png and .pdf
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Overwrite an existing table of signorini's (its pictures are drawn anew in any case)
    #[arg(long)]
    force: bool,
}

impl Arguments {
    /// The orbit that is asked for.
    fn periodic(
        &self,
        global: &Global,
        scene: &Scene,
        problem: &Problem,
    ) -> Result<Option<Periodic>, CliError> {
        if !self.orbit {
            return Ok(None);
        }
        let closure = start::closure(scene, problem)?;
        let omega = family::omega(scene, self.omega, None)?;
        family::check_frequency(problem, omega)?;
        if matches!(closure, Closure::Reversible | Closure::Autonomous) {
            global.caller.warn(viscous::CONSERVATIVE);
        }
        Ok(Some(Periodic { omega, stop: global.caller.stop() }))
    }
}

/// Compute the scene on other meshes, and say what moves.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let scene = global.scene(&arguments.scene)?;
    let problem = load::of_scene(&scene)?;
    let orbit = arguments.periodic(global, &scene, &problem)?;
    let outputs =
        Outputs::new(arguments.force).reads(scene.source.file.clone()).reads_all(scene.files());
    if let Some(stem) = &arguments.output {
        let of_this = [".csv", ".svg", ".png"].map(|ending| beside(stem, ending));
        of_this.iter().try_for_each(|path| outputs.check_derived(path))?;
    }
    global.caller.watch();
    let bar = Bar::new(global, &scene);
    let set_up = |scene: &Scene| load::of_scene(scene).map_err(|e| e.text());
    let found = trust(&scene, &problem, &set_up, orbit.as_ref(), |share, what| {
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
    let interrupted = |signal| CliError::Interrupted(signal, "interrupted: nothing is kept".into());
    let failed = |why| global.caller.signal().map_or(CliError::Numerics(why), interrupted);
    let Some(trust) = found.map_err(failed)? else {
        return Err(interrupted(global.caller.signal().unwrap_or_default()));
    };
    let title = super::title(&scene);
    let mut written = vec![];
    if let Some(stem) = arguments.output.clone() {
        let table = beside(&stem, ".csv");
        let sheet = margins::picture(&title, &trust)?;
        replace(&table, margins::csv(&trust).as_bytes())?;
        written.push(table);
        let drawing = Drawing { stem, sheet };
        written.extend(figure::save(&[drawing], &outputs, &figure::Output::default())?);
    }
    let written: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
    Ok(global.answer(
        || {
            let mut answer = json(&trust);
            answer["written"] = object!(written);
            answer
        },
        || {
            let list = match written.is_empty() {
                true => String::new(),
                false => format!("  written to    {}\n", written.join(", ")),
            };
            format!("{title}\n{}{list}", text(&trust))
        },
    ))
}
