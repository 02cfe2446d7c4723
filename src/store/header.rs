//! What every file says of its origin.

use std::path::Path;

use super::bodies::{words, write_bodies, write_contact};
use super::describe::describe;
use super::form::write_version;
use super::mesh::{size_of_mesh, write_mesh};
use super::moving::write_moving;
use super::output::{Outputs, Staged, check_room};
use super::state::TURNS;
use super::swings::write_swings;
use super::{StoreError, read_text, write_text};
use crate::contact::System;
use crate::records::Status;
use crate::scenario::Scene;

/// How a file is made.
#[derive(Debug, Clone, Default)]
pub struct WriterOptions {
    /// What may be written where.
    pub outputs: Outputs,
    /// The command line, for the record.
    pub command: String,
    /// States are not compressed: for a file that is read at once and thrown away.
    pub is_scratch: bool,
}

/// A new file with everything that every file says of its origin, and the mesh.
pub(super) fn create_file(
    path: &Path,
    scene: &Scene,
    system: &System,
    options: &WriterOptions,
) -> Result<hdf5::File, StoreError> {
    let file = hdf5::File::create(path)
        .map_err(|e| StoreError::write(path, std::io::Error::other(e.to_string())))?;
    write_origin(&file, scene, &options.command)?;
    write_mesh(&file, system)?;
    write_swings(&file, system)?;
    write_moving(&file, system)?;
    let mut names = scene.rows.labels();
    if !names.is_empty() {
        // held ones are nodes, too
        let held = scene.rows.held_rows().map(|(_, name)| name.to_string());
        names.extend(held.filter(|_| scene.rows.superelement.is_none()));
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        words(&file.group("mesh")?, "row_names", &names)?;
        let written = file.dataset("mesh/row_names")?;
        write_text(&written, TURNS, &scene.rows.turns())?;
    }
    write_bodies(&file, scene, system)?;
    write_contact(&file, system)?;
    Ok(file)
}

/// Write a file at once: what every file says, what `fill` puts into it (about so many bytes), and how its computation ended. What is there stays until the new one is whole.
pub(super) fn write_whole(
    path: &Path,
    (scene, system): (&Scene, &System),
    options: &WriterOptions,
    (bytes, status): (usize, &Status),
    fill: impl FnOnce(&hdf5::File) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let mut staged = Staged::begin(&options.outputs, path)?;
    let write = || -> Result<(), StoreError> {
        check_room(staged.at(), size_of_mesh(system) + bytes as u64)?;
        let file = create_file(staged.at(), scene, system, options)?;
        fill(&file)?;
        describe(&file)?;
        write_text(&file, "status", &status.to_string())?;
        file.flush()?;
        Ok(())
    };
    if let Err(e) = write() {
        staged.discard();
        return Err(e);
    }
    staged.commit()
}

/// Of which scene a file is, and how its computation ended.
#[derive(Debug, Clone)]
pub struct Head {
    /// Scene title.
    pub title: String,
    /// Scene text.
    pub scene: String,
    /// How it ended.
    pub status: Status,
}

impl Head {
    pub(super) fn read(file: &hdf5::File) -> Head {
        let text = |name: &str| read_text(file, name).unwrap_or_default();
        let (title, scene) = (text("title"), text("scene"));
        Head { title, scene, status: Status::of_name(&text("status")) }
    }
}

/// Write the number of all that the equations depend on.
pub(super) fn write_problem(g: &hdf5::Group, problem: u64) -> Result<(), StoreError> {
    write_text(g, "problem", &format!("{problem:016x}"))
}

/// The number of all that the equations depend on.
pub(super) fn read_problem(g: &hdf5::Group) -> Option<u64> {
    u64::from_str_radix(&read_text(g, "problem")?, 16).ok()
}

/// Program, scene, command, time.
pub(super) fn write_origin(
    file: &hdf5::File,
    scene: &Scene,
    command: &str,
) -> Result<(), StoreError> {
    write_version(file)?;
    write_text(file, "title", &scene.title)?;
    write_text(file, "scene", &scene.source.text)?;
    write_text(file, "scene_file", &scene.source.file.display().to_string())?;
    write_text(file, "command", command)?;
    write_text(file, "created", &timestamp())?;
    write_text(file, "status", &Status::Running.to_string())
}

/// Seconds since 1970 as an ISO 8601 time in UTC.
fn timestamp() -> String {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seconds = now.map_or(0, |d| d.as_secs());
    let (days, rest) = ((seconds / 86_400) as i64, seconds % 86_400);
    // civil date from days (Howard Hinnant's algorithm)
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let doe = z.rem_euclid(146_097);
    let yoe = (doe - doe / 1_460 + doe / 36_524 - doe / 146_096) / 365;
    let doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
    let mp = (5 * doy + 2) / 153;
    let (day, month) = (doy - (153 * mp + 2) / 5 + 1, if mp < 10 { mp + 3 } else { mp - 9 });
    let year = yoe + era * 400 + i64::from(month <= 2);
    let (h, m, s) = (rest / 3_600, rest / 60 % 60, rest % 60);
    format!("{year:04}-{month:02}-{day:02}T{h:02}:{m:02}:{s:02}Z")
}
