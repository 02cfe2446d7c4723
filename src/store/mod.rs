//! Results in HDF5: one file a run, readable by `h5py`, MATLAB and `h5dump` without this program.
//!
//! The file is written as the run goes: rows are collected until a chunk is full, appended and flushed, so that a
//! killed program leaves a file that opens and holds everything up to the last flush. The attribute `status` says how it ended.

mod content;
mod journal;
mod orbits;
mod problem;
mod reader;
mod series;
mod table;
mod writer;

pub use content::{Content, Origin, content, read_origin, read_switch_rates};
pub use orbits::{
    FamilyWriter, OrbitRecord, PlaceRecord, PointRecord, StoredFamily, read_stored_orbit,
};
pub use problem::write_problem;
pub use reader::{Stored, read_state};
pub use series::{
    CheckRow, Names, SeriesRecord, SeriesWriter, place_of_function, read_crosscheck, read_csv,
    read_series, write_crosscheck,
};
pub use writer::{Writer, WriterOptions};

use std::path::{Path, PathBuf};
use thiserror::Error;

/// What can go wrong with a file of results.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The file exists.
    #[error("{} exists already; choose another name with -o or overwrite it with --force", .0.display())]
    Exists(PathBuf),
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
    fn unusable(path: &Path, reason: impl std::fmt::Display) -> Self {
        StoreError::Unusable { path: path.to_owned(), reason: reason.to_string() }
    }
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
