//! `signorini plot`

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use signorini::report::families;
use signorini::report::pictures::{self, Options};
use signorini::store::{
    Content, Stored, StoredFamily, content, read_stored_orbit, read_switch_rates,
};

use super::{CliError, Global};

/// Arguments of `plot`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini plot plate.h5\n  signorini plot plate.h5 --only shapes --at 0,0.25,0.5,0.75 -o plate-quarters\n  signorini plot orbit.h5 --only portrait,multipliers\n  signorini plot backbone.h5"
)]
pub struct Arguments {
    /// A file written by `run`, `orbit`, `backbone` or `response`
    file: PathBuf,
    /// Beginning of the pictures' names [default: the file's name without its ending]
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Only these pictures: contact, energy, gap, shapes (of a run or an orbit), portrait, multipliers (of an orbit), backbone,
    /// multipliers (of a family)
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    /// Fractions of the stored time (of an orbit: of its period) at which shapes are drawn
    #[arg(long, value_delimiter = ',', value_name = "FRACTIONS")]
    at: Vec<f64>,
}

/// Draw the pictures.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let kind = content(&arguments.file)?;
    let known = match kind {
        Content::Run => pictures::names(),
        Content::Orbit => [pictures::names(), families::orbit_names()].concat(),
        Content::Family => families::family_names(),
    };
    if let Some(unknown) = arguments.only.iter().find(|o| !known.contains(&o.as_str())) {
        return Err(CliError::Input(format!(
            "no picture \"{unknown}\" of {}; there are {}",
            arguments.file.display(),
            known.join(", ")
        )));
    }
    if let Some(bad) = arguments.at.iter().find(|f| !(0.0..=1.0).contains(*f)) {
        return Err(CliError::Input(format!("--at {bad}: give fractions between 0 and 1")));
    }
    let stem = arguments.output.clone().unwrap_or_else(|| arguments.file.with_extension(""));
    super::check_folder(&stem)?;
    let written = match kind {
        Content::Family if !arguments.at.is_empty() => {
            let message =
                "--at: a family of orbits has no shapes; write one orbit with `signorini orbit`";
            return Err(CliError::Input(message.into()));
        }
        Content::Family => {
            let family = StoredFamily::read(&arguments.file)?;
            families::save_family(&family, &stem, &arguments.only)?
        }
        _ => of_run(arguments, &stem)?,
    };
    let names: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
    global.print(|| json!({"written": names}), || names.join("\n") + "\n");
    Ok(())
}

/// The pictures of a run, and those of its orbit if it is one.
fn of_run(arguments: &Arguments, stem: &Path) -> Result<Vec<PathBuf>, CliError> {
    let stored = Stored::read(&arguments.file)?;
    let orbit = read_stored_orbit(&arguments.file)?;
    let mut options = Options::default();
    if !arguments.at.is_empty() {
        options.fractions = arguments.at.clone();
    } else if orbit.is_some() {
        // the end of a period is its start
        options.fractions = (0..8).map(|k| f64::from(k) / 8.0).collect();
    }
    let only = &arguments.only;
    let of_orbit = families::orbit_names();
    let wanted = |o: &&String| !of_orbit.contains(&o.as_str());
    let of_run: Vec<String> = only.iter().filter(wanted).cloned().collect();
    let mut written = vec![];
    if only.is_empty() || !of_run.is_empty() {
        written = pictures::save_all(&stored, stem, &of_run, &options)?;
    }
    let of_orbit: Vec<String> = only.iter().filter(|o| !wanted(o)).cloned().collect();
    match orbit {
        Some(orbit) if only.is_empty() || !of_orbit.is_empty() => {
            let rates = read_switch_rates(&arguments.file)?;
            written.extend(families::save_orbit(&stored, &orbit, &rates, stem, &of_orbit)?);
        }
        _ => {}
    }
    Ok(written)
}
