//! `signorini export`

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use signorini::report::{crosscheck, export, families};
use signorini::store::{
    Content, Outputs, Stored, StoredFamily, beside, content, read_crosscheck, replace,
};

use super::{CliError, Global};

/// Arguments of `export`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini export plate.h5 --format csv\n  signorini export plate.h5 --format vtu -o plate-states\n  signorini export backbone.h5 --format csv"
)]
pub struct Arguments {
    /// A file written by `run`, `orbit`, `backbone`, `response` or `crosscheck`
    file: PathBuf,
    /// What to write
    #[arg(long, value_enum, default_value = "csv")]
    format: Format,
    /// Beginning of the files' names [default: the file's name without its ending]
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Overwrite an existing table of signorini's
    #[arg(long)]
    force: bool,
}

/// Formats.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// Contact displacements, pressures and energies, one row a stored state; switches in a second file. Of a family
    /// or a cross-check: one row a point
    Csv,
    /// One VTU file a stored state and a PVD collection for ParaView
    Vtu,
    /// One XDMF file with all stored states
    Xdmf,
}

/// Write the files.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let stem = arguments.output.clone().unwrap_or_else(|| arguments.file.with_extension(""));
    let outputs = Outputs::new(arguments.force).reads(arguments.file.clone());
    let written = if content(&arguments.file)? == Content::Family {
        if !matches!(arguments.format, Format::Csv) {
            let message =
                "a family of orbits is written as csv only; write one orbit with `signorini orbit`";
            return Err(CliError::Input(message.into()));
        }
        let path = beside(&stem, ".csv");
        outputs.check_derived(&path)?;
        let text = match read_crosscheck(&arguments.file)? {
            Some(rows) => crosscheck::csv(&rows),
            None => families::csv(&StoredFamily::read(&arguments.file)?),
        };
        replace(&path, text.as_bytes())?;
        vec![path]
    } else {
        let stored = Stored::read(&arguments.file)?;
        match arguments.format {
            Format::Csv => export::csv(&stored, &stem),
            Format::Vtu => export::vtu(&stored, &stem),
            Format::Xdmf => export::xdmf(&stored, &stem),
        }
        .map_err(|e| CliError::Other(format!("writing {}: {e}", stem.display())))?
    };
    let names: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
    global.print(
        || json!({"written": names}),
        || match &names[..] {
            [first, .., last] if names.len() > 3 => {
                format!("{first} … {last} ({} files)\n", names.len())
            }
            _ => names.join("\n") + "\n",
        },
    )
}
