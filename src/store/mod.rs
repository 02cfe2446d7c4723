//! Results in HDF5: one file a run, readable by `h5py`, MATLAB and `h5dump` without this program.
//!
//! The file is written as the run goes: rows are collected until a chunk is full, appended and flushed, so that a
//! killed program leaves a file that opens and holds everything up to the last flush. The attribute `status` says how it ended.

mod background;
mod bands;
mod basins;
mod bodies;
mod careful;
mod checkpoint;
mod columns;
mod comparison;
mod content;
mod crosscheck;
mod csv;
mod curves;
mod describe;
mod diagram;
mod events;
mod excursions;
mod extremes;
mod family;
mod forces;
mod form;
mod grazings;
mod header;
mod journal;
mod kept;
mod lyapunov;
mod matrices;
mod mesh;
mod moving;
mod orbits;
mod output;
mod phase_resonance;
mod probes;
mod problem;
mod raw;
mod reader;
mod report;
mod ridge;
mod row;
mod schema;
mod sensitivity;
mod series;
mod state;
mod statement;
mod stored;
mod study;
mod sweep;
mod swings;
mod table;
mod tori;
mod trajectory;
mod watched;
mod writer;

pub(crate) use background::Background;
pub use bands::{StoredBands, read_bands, write_bands};
pub use basins::{StoredBasins, read_basins, write_basins};
pub use columns::datasets;
pub(crate) use columns::switch_columns;
pub(crate) use comparison::ComparisonWriter;
pub use comparison::read_comparison;
pub use content::content;
pub(crate) use content::{Content, Origin, read_origin};
pub use crosscheck::read_crosscheck;
pub(crate) use csv::read_csv;
pub use curves::{StoredCurves, read_curves, write_curves};
pub use diagram::{StoredDiagram, read_diagram, write_diagram};
pub use excursions::ExcursionRecord;
pub use extremes::StoredWatched;
pub(crate) use family::{FamilyPlan, FamilyWriter};
pub use header::Head;
pub(crate) use header::WriterOptions;
pub use kept::Kept;
pub use matrices::{Array, ArrayFormat, write_arrays};
pub(crate) use moving::StoredMoving;
pub use orbits::read_stored_orbit;
pub(crate) use output::replace_with;
pub use output::{MARK, Outputs, beside, replace, room, without_ending};
pub use phase_resonance::{StoredResonance, read_resonance, write_resonance};
pub use probes::ProbeRecord;
pub(crate) use problem::{write_problem, write_problem_flat};
pub use raw::{Entry, Held, Raw, attributes, entries, held, read_raw};
pub use reader::{Stored, StoredForces, StoredFriction};
pub use schema::About;
pub use series::Names;
pub(crate) use series::read_series;
pub use state::{check_rows, read_state};
pub use statement::write_statement;
pub use stored::StoredFamily;
pub(crate) use study::{is_collected, write_study};
pub(crate) use swings::StoredSwings;
pub use tori::{StoredTori, read_tori, write_tori};
pub use watched::StoredProbe;
pub(crate) use writer::Writer;

use std::path::{Path, PathBuf};
use thiserror::Error;

/// What can go wrong with a file of results.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The file exists.
    #[error("{} exists already; choose another name with -o or overwrite it with --force", .0.display())]
    Exists(PathBuf),
    /// The file is one of those that are read.
    #[error("{} is an input of this command ({}); choose another name with -o", path.display(), input.display())]
    IsInput {
        /// The output.
        path: PathBuf,
        /// The input that it is.
        input: PathBuf,
    },
    /// The file was made by someone else.
    #[error("{} was not made by signorini, and stays as it is; choose another name with -o, or remove it yourself", .0.display())]
    Foreign(PathBuf),
    /// Another process writes the file.
    #[error("{} is being written by another process; wait for it, or choose another name with -o", .0.display())]
    Busy(PathBuf),
    /// No room.
    #[error("{}: the disk is full: {} are needed, {} are there; free some, keep less (run.store = \"contact\", fewer samples), or write elsewhere with -o", path.display(), in_bytes(*needed), in_bytes(*there))]
    DiskFull {
        /// Path.
        path: PathBuf,
        /// Bytes that are to be written.
        needed: u64,
        /// Bytes that are free.
        there: u64,
    },
    /// The system refused to write.
    #[error("writing {}: {source}", path.display())]
    Write {
        /// Path.
        path: PathBuf,
        /// Its words.
        source: std::io::Error,
    },
    /// The file or folder cannot be used.
    #[error("{}: {reason}", path.display())]
    Unusable {
        /// Path.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The file lacks something.
    #[error("{} holds no {what}", path.display())]
    Missing {
        /// Path.
        path: PathBuf,
        /// What was looked for.
        what: String,
    },
    /// The library's own words.
    #[error("HDF5: {0}")]
    Hdf5(#[from] hdf5::Error),
}

impl StoreError {
    pub(crate) fn unusable(path: &Path, reason: impl std::fmt::Display) -> Self {
        StoreError::Unusable { path: path.to_owned(), reason: reason.to_string() }
    }

    pub(crate) fn write(path: &Path, source: std::io::Error) -> Self {
        StoreError::Write { path: path.to_owned(), source }
    }
}

/// A number of bytes as one says it.
pub(crate) fn in_bytes(n: u64) -> String {
    let mut x = n as f64;
    let mut units = ["bytes", "kB", "MB", "GB", "TB"].into_iter();
    let mut unit = units.next().unwrap_or_default();
    for larger in units {
        if x < 1000.0 {
            break;
        }
        x /= 1000.0;
        unit = larger;
    }
    if unit == "bytes" { format!("{n} bytes") } else { format!("{x:.1} {unit}") }
}

pub(crate) fn write_text(
    location: &hdf5::Location,
    name: &str,
    text: &str,
) -> Result<(), StoreError> {
    use hdf5::types::VarLenUnicode;
    let value: VarLenUnicode = text
        .replace('\0', " ")
        .parse()
        .map_err(|_| hdf5::Error::from(format!("attribute {name} is not valid text")))?;
    let attribute = match location.attr(name) {
        Ok(a) => a,
        Err(_) => location.new_attr::<VarLenUnicode>().create(name)?,
    };
    attribute.write_scalar(&value)?;
    Ok(())
}

pub(crate) fn read_text(location: &hdf5::Location, name: &str) -> Option<String> {
    let value = location.attr(name).ok()?.read_scalar::<hdf5::types::VarLenUnicode>().ok()?;
    Some(value.as_str().to_owned())
}
