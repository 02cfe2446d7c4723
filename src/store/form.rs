//! The form of files, by number.

use std::path::Path;

use super::{StoreError, read_text, write_text};

/// The form of files: what is written so that programs that know an earlier form would misread it has the next number.
pub(super) const FORMAT: u32 = 1;

/// The program that writes a file, and the form of it.
pub(super) fn write_version(file: &hdf5::File) -> Result<(), StoreError> {
    write_text(file, "signorini_version", env!("CARGO_PKG_VERSION"))?;
    file.new_attr::<u32>().create("format")?.write_scalar(&FORMAT)?;
    Ok(())
}

/// Whether a file is of a form that is known: those without a number are of the first.
pub(super) fn check_format(path: &Path, file: &hdf5::File) -> Result<(), StoreError> {
    let Ok(attribute) = file.attr("format") else { return Ok(()) };
    let format: i64 = attribute.read_scalar().unwrap_or(-1);
    if (1..=i64::from(FORMAT)).contains(&format) {
        return Ok(());
    }
    if format < 1 {
        return Err(StoreError::unusable(path, "its attribute format is no number of a form"));
    }
    let version = read_text(file, "signorini_version").unwrap_or_default();
    Err(StoreError::unusable(
        path,
        format!(
            "written by signorini {version}, in a form ({format}) that this version ({}, forms up to {FORMAT}) does not know: read it with that version or a later one",
            env!("CARGO_PKG_VERSION")
        ),
    ))
}
