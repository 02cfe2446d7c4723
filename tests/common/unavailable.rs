//! What a test needs and cannot have: left out loudly at home, a failure where everything pinned was installed.

use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

/// Where what is missing comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A lock or requirements file of this repository names its version: `SIGNORINI_STRICT=1` wants it.
    Pinned,
    /// The packages of the system: it may be missing anywhere, and is counted.
    System,
}

/// This test goes without `what`: said past the capture of output, and written as a line to the file `SIGNORINI_SKIPPED`, whose lines `.ci/run` counts.
pub fn unavailable(what: &str, kind: Kind) {
    let strict = std::env::var_os("SIGNORINI_STRICT").is_some_and(|v| v == "1");
    assert!(kind == Kind::System || !strict, "{what}: is pinned, and must be there");
    let test = std::thread::current().name().unwrap_or_default().to_owned();
    // eprintln! is captured, and nobody would read it
    #[allow(clippy::explicit_write)]
    writeln!(std::io::stderr(), "SKIPPED: {what} is not there: {test}").unwrap();
    if let Some(list) = std::env::var_os("SIGNORINI_SKIPPED") {
        let file = std::fs::OpenOptions::new().append(true).create(true).open(list);
        writeln!(file.unwrap(), "{what} ({test})").unwrap();
    }
}

/// Python with these modules: `SIGNORINI_PYTHON`, or the virtual environment that `make setup` creates; `what` is said where there is none.
pub fn python(modules: &str, what: &str) -> Option<PathBuf> {
    let environment = std::env::var_os("SIGNORINI_PYTHON").map(PathBuf::from);
    let python = environment.unwrap_or_else(|| super::root().join(".venv/bin/python"));
    let known = Command::new(&python).args(["-c", &format!("import {modules}")]).output();
    if known.is_ok_and(|o| o.status.success()) {
        return Some(python);
    }
    unavailable(what, Kind::Pinned);
    None
}
