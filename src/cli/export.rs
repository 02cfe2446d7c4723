//! `signorini export`

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;

use signorini::report::export::{self, ExportError, Plan, Selection, Written};
use signorini::report::{crosscheck, families};
use signorini::store::{
    Content, Outputs, Stored, StoredFamily, content, read_crosscheck, replace, without_ending,
};

use super::{Answer, CliError, Global, one_picture};

/// Arguments of `export`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini export plate.h5 --format csv\n  signorini export plate.h5 --format csv --nodes 3,7          # with the motion of two nodes\n  signorini export plate.h5 --format csv --place 0.5,0.15     # and at a place\n  signorini export plate.h5 --format vtkhdf --every 4         # plate.vtkhdf for ParaView\n  signorini export plate.h5 --format vtu                      # plate-vtu/plate.pvd for ParaView and PyVista\n  signorini export plate.h5 --format xdmf --from 1 --to 2 -o touch\n  signorini export backbone.h5 --format csv\n\n\
    Fields of VTKHDF, VTU and XDMF: displacement, velocity, contact_pressure (on both sides where two surfaces meet, 0 off the contact), contact_force (on the body at each node), contact_status (1 in contact, with friction 2 sticks, 3 and 4 slips; 0 open, -1 no contact node), gap (distance to the obstacle, NaN off the contact edge); by element: stress at its centre (a 3 × 3 tensor and von_mises, of a bar the axial stress); at nodes stress_averaged, the mean of the elements around by their volumes, and stress_recovered with von_mises_recovered, by polynomial preserving recovery (Zhang and Naga)."
)]
pub struct Arguments {
    /// A file written by `run`, `orbit`, `backbone`, `response` or `crosscheck`
    file: PathBuf,
    /// What to write
    #[arg(long, value_enum, default_value = "csv")]
    format: Format,
    /// Beginning of the files' names; VTU files go into the folder STEM-vtu [default: the file's name without its ending]
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Only each Nth stored state, beginning with the first; switches are stored states too
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    every: Option<String>,
    /// Only states (and switches) from this time on
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    from: Option<String>,
    /// Only states (and switches) up to this time
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    to: Option<String>,
    /// CSV of a run or an orbit: displacements and velocities of these nodes besides (numbers of mesh/nodes from 0; of a body of matrices its rows, by number or by name: 101.3)
    #[arg(long, value_delimiter = ',', value_name = "NODES")]
    nodes: Vec<String>,
    /// CSV of a run or an orbit: displacement and velocity at a place of the undeformed body besides, interpolated in its element; may be given several times
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    place: Vec<String>,
    /// Overwrite an existing table of signorini's (other exports of its own are written anew in any case)
    #[arg(long)]
    force: bool,
}

/// Formats.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// Contact displacements, pressures, energies and forces (of contact groups, supports and springs), one row a stored state; switches in a second file. Of a family
    /// or a cross-check: one row a point
    Csv,
    /// One file with the mesh once and all stored states behind one another, for ParaView and VTK
    #[value(name = "vtkhdf")]
    VtkHdf,
    /// One VTU file a stored state and the PVD collection STEM.pvd for ParaView, in the folder STEM-vtu
    Vtu,
    /// One XDMF file with all stored states, its numbers in STEM.xdmf.h5, for ParaView and meshio
    Xdmf,
}

impl From<Format> for export::Format {
    fn from(format: Format) -> Self {
        match format {
            Format::Csv => export::Format::Csv,
            Format::VtkHdf => export::Format::VtkHdf,
            Format::Vtu => export::Format::Vtu,
            Format::Xdmf => export::Format::Xdmf,
        }
    }
}

impl From<ExportError> for CliError {
    fn from(e: ExportError) -> Self {
        match e {
            ExportError::Io(_) => CliError::Other(e.to_string()),
            _ => CliError::Input(e.to_string()),
        }
    }
}

/// Write the files.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let selection = selection(arguments)?;
    let stem = arguments.output.clone().unwrap_or_else(|| arguments.file.with_extension(""));
    // a name with the ending that it will have
    let stem = without_ending(stem, &["csv", "vtkhdf", "vtu", "pvd", "xdmf"]);
    let outputs = Outputs::new(arguments.force).reads(arguments.file.clone());
    let folder = stem.parent().filter(|f| !f.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|f| !f.is_dir()) {
        let message = format!("{}: no such folder; create it first", folder.display());
        return Err(CliError::Input(message));
    }
    let kind = content(&arguments.file)?;
    let is_table = kind == Content::Family || one_picture::name(kind).is_some();
    let (written, states) = if is_table {
        (table(arguments, &outputs, &stem)?, None)
    } else {
        let stored = Stored::read(&arguments.file)?;
        let plan = Plan::new(&stored, arguments.format.into(), selection, &stem)?
            .with_nodes(&arguments.nodes)?
            .with_places(&places(arguments)?)?;
        // a folder of its own is made where there is none
        let there = plan.targets().into_iter().filter(|path| path.exists());
        there.into_iter().try_for_each(|path| outputs.check_derived(&path))?;
        (plan.write()?, Some(plan.states()))
    };
    let names = |paths: &[PathBuf]| -> Vec<String> {
        paths.iter().map(|p| p.display().to_string()).collect()
    };
    let (files, removed) = (names(&written.files), names(&written.removed));
    Ok(global.answer(
        || json!({"written": files, "removed": removed, "states": states}),
        || {
            let list = match &files[..] {
                [first, .., last] if files.len() > 3 => {
                    format!("{first} … {last} ({} files)\n", files.len())
                }
                _ => files.join("\n") + "\n",
            };
            match removed.len() {
                0 => list,
                n => format!("{list}removed {n} states of an earlier, longer export\n"),
            }
        },
    ))
}

/// The places that the options name.
fn places(arguments: &Arguments) -> Result<Vec<Vec<f64>>, CliError> {
    let place = |text: &String| {
        let number = |x: &str| x.trim().parse().ok().filter(|x: &f64| x.is_finite());
        let all: Option<Vec<f64>> = text.split(',').map(number).collect();
        all.ok_or_else(|| {
            CliError::Input(format!("--place {text}: give coordinates, for example 0.5,0.2"))
        })
    };
    arguments.place.iter().map(place).collect()
}

/// Which states the options choose.
fn selection(arguments: &Arguments) -> Result<Selection, CliError> {
    let every = match &arguments.every {
        None => 1,
        Some(text) => text.trim().parse().ok().filter(|n| *n > 0).ok_or_else(|| {
            CliError::Input(format!(
                "--every {text}: give a whole number from 1 on, for example 10 for each tenth stored state"
            ))
        })?,
    };
    let time = |option: &str, text: &Option<String>| match text {
        None => Ok(None),
        Some(text) => match text.trim().parse::<f64>() {
            Ok(t) if t.is_finite() && t >= 0.0 => Ok(Some(t)),
            _ => Err(CliError::Input(format!(
                "--{option} {text}: give a time, a number from 0 on, in the scene's units"
            ))),
        },
    };
    let (from, to) = (time("from", &arguments.from)?, time("to", &arguments.to)?);
    if from.zip(to).is_some_and(|(from, to)| from > to) {
        let message = "--from lies behind --to: give the earlier time with --from";
        return Err(CliError::Input(message.into()));
    }
    Ok(Selection { every, from, to })
}

/// A family, a cross-check or a comparison is a table.
fn table(arguments: &Arguments, outputs: &Outputs, stem: &Path) -> Result<Written, CliError> {
    let message = if !matches!(arguments.format, Format::Csv) {
        Some(
            "a family of orbits or a comparison is written as csv only; write one orbit with `signorini orbit`, or a run",
        )
    } else if arguments.every.is_some()
        || arguments.from.is_some()
        || arguments.to.is_some()
        || !arguments.nodes.is_empty()
        || !arguments.place.is_empty()
    {
        Some(
            "--every, --from, --to, --nodes and --place choose among the stored states of a run or an orbit; a family or a comparison is written whole",
        )
    } else {
        None
    };
    if let Some(message) = message {
        return Err(CliError::Input(message.into()));
    }
    let path = export::table(stem);
    outputs.check_derived(&path)?;
    let text = match one_picture::table(content(&arguments.file)?, &arguments.file)? {
        Some(text) => text,
        None => match read_crosscheck(&arguments.file)? {
            Some(rows) => crosscheck::csv(&rows),
            None => families::csv(&StoredFamily::read(&arguments.file)?),
        },
    };
    replace(&path, text.as_bytes())?;
    Ok(Written { files: vec![path], removed: vec![] })
}
