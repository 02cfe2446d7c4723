//! `signorini plot`

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use signorini::report::pictures::{self, Options};
use signorini::store::Stored;

use super::{CliError, Global};

/// Arguments of `plot`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini plot plate.h5\n  signorini plot plate.h5 --only shapes --at 0,0.25,0.5,0.75 -o plate-quarters"
)]
pub struct Arguments {
    /// A file written by `run`
    file: PathBuf,
    /// Beginning of the pictures' names [default: the file's name without its ending]
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Only these pictures: contact, energy, gap, shapes
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    /// Fractions of the stored time at which shapes are drawn
    #[arg(long, value_delimiter = ',', value_name = "FRACTIONS")]
    at: Vec<f64>,
}

/// Draw the pictures.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let known = pictures::names();
    if let Some(unknown) = arguments.only.iter().find(|o| !known.contains(&o.as_str())) {
        return Err(CliError::Input(format!(
            "no picture \"{unknown}\"; there are {}",
            known.join(", ")
        )));
    }
    if let Some(bad) = arguments.at.iter().find(|f| !(0.0..=1.0).contains(*f)) {
        return Err(CliError::Input(format!("--at {bad}: give fractions between 0 and 1")));
    }
    let stem = arguments.output.clone().unwrap_or_else(|| arguments.file.with_extension(""));
    super::check_folder(&stem)?;
    let stored = Stored::read(&arguments.file)?;
    let mut options = Options::default();
    if !arguments.at.is_empty() {
        options.fractions = arguments.at.clone();
    }
    let written = pictures::save_all(&stored, &stem, &arguments.only, &options)?;
    let names: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
    global.print(|| json!({"written": names}), || names.join("\n") + "\n");
    Ok(())
}
