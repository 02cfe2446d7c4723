//! Whole files or none, numbers and texts in them, and why there are none.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::store::{Stored, replace_with};

/// Why nothing can be written, or writing failed.
#[derive(Debug, Error)]
pub enum ExportError {
    /// A body of given matrices has no shape.
    #[error(
        "{}: a body of kind \"matrices\" has no geometry that VTKHDF, VTU or XDMF could show; write its contact displacements, \
         pressures and energies with --format csv", .0.display()
    )]
    NoGeometry(PathBuf),
    /// No state is stored, or none lies in the window.
    #[error("{0}")]
    Nothing(String),
    /// The scene in the file does not fit its mesh, or is no scene.
    #[error("{}: damaged: scene: {reason}", path.display())]
    Damaged {
        /// The file that was read.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The beginning of the files' names cannot be used.
    #[error("{}: {reason}", path.display())]
    Name {
        /// As given.
        path: PathBuf,
        /// What is wrong and what would be accepted.
        reason: &'static str,
    },
    /// Writing failed; the message names the file.
    #[error("writing {0}")]
    Io(#[from] io::Error),
}

impl ExportError {
    pub(super) fn damaged(stored: &Stored, reason: impl std::fmt::Display) -> Self {
        ExportError::Damaged { path: stored.path.clone(), reason: reason.to_string() }
    }
}

/// Put the file's name before the system's words.
pub(super) fn at(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

/// Write a whole file, or leave what was there.
pub(super) fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace(path, |part| fs::write(part, bytes))
}

/// The same with a file that `write` makes at the path it is given.
pub(super) fn replace(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    replace_with(path, write).map_err(io::Error::other)
}

/// The shortest decimal that reads back as the same number: `0`, `0.0084`, `1.5e-13`.
pub(in crate::report) fn number(x: f64) -> String {
    // −0 + 0 is 0
    let text = format!("{:?}", x + 0.0);
    match text.strip_suffix(".0") {
        Some(whole) => whole.to_owned(),
        None => text,
    }
}

/// A cell of a CSV file.
pub(in crate::report) fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

/// Text for XML, which knows no control characters.
pub(super) fn escape(text: &str) -> String {
    let text: String = text.chars().filter(|c| !c.is_control()).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
