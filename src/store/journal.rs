//! The journal of a family that is being computed: one line a point, beside the HDF5 file.
//!
//! A process can be killed while the HDF5 library writes its metadata, and then the file does not open. A line that was cut off
//! is told by its missing end, and everything before it stands. Every line begins with a checksum of itself and of the line before
//! it: one that was changed, or whose predecessor was taken away, is told too. Numbers are kept by their bits: what is read
//! is what was written.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::StoreError;
use super::output::{beside, check_room, checksum};
use super::stored::StoredFamily;
use crate::records::{Branch, FamilyKind, PointRecord, Status, bits};

/// What the first line says.
#[derive(Debug, Serialize, Deserialize)]
struct Header {
    scene: String,
    identity: FamilyKind,
    branches: Vec<Branch>,
    harmonics: usize,
    #[serde(with = "bits::many")]
    range: Vec<f64>,
}

/// An open journal.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
    sum: u32,
}

fn name_of(path: &Path) -> PathBuf {
    beside(path, ".journal")
}

/// A line with its checksum, which becomes the one of the line before.
fn line<T: Serialize>(path: &Path, sum: &mut u32, value: &T) -> Result<String, StoreError> {
    let text = serde_json::to_string(value)
        .map_err(|e| StoreError::write(path, std::io::Error::other(e)))?;
    *sum = checksum(*sum, &text);
    Ok(format!("{sum:08x} {text}\n"))
}

impl Journal {
    /// A new journal for the file `path`, with the points that are known already; an old one is replaced at once.
    pub fn create(path: &Path, family: &StoredFamily) -> Result<Journal, StoreError> {
        let name = name_of(path);
        let fail = |e| StoreError::write(&name, e);
        let header = Header {
            scene: family.scene.clone(),
            identity: family.identity.clone(),
            branches: family.branches.clone(),
            harmonics: family.harmonics,
            range: family.range.to_vec(),
        };
        let mut sum = 0;
        let mut text = line(&name, &mut sum, &header)?;
        for point in &family.points {
            text.push_str(&line(&name, &mut sum, point)?);
        }
        let fresh = beside(&name, ".new");
        std::fs::write(&fresh, text).and_then(|()| std::fs::rename(&fresh, &name)).map_err(
            |e| {
                let _ = std::fs::remove_file(&fresh);
                fail(e)
            },
        )?;
        let file = OpenOptions::new().append(true).open(&name).map_err(fail)?;
        Ok(Journal { path: name, file, sum })
    }

    /// Append a point.
    pub fn append(&mut self, point: &PointRecord) -> Result<(), StoreError> {
        let text = line(&self.path, &mut self.sum, point)?;
        check_room(&self.path, text.len() as u64)?;
        self.file.write_all(text.as_bytes()).map_err(|e| StoreError::write(&self.path, e))
    }

    /// The family is complete: the HDF5 file holds everything.
    pub fn remove(self) {
        // a journal that stays does no harm
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The unfinished family of the file `path`, if there is a journal of it, and the number of the first line that is damaged.
pub(super) fn read(path: &Path) -> Option<(StoredFamily, Option<usize>)> {
    // a damaged line need not be text
    let bytes = std::fs::read(name_of(path)).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let mut sum = 0;
    let mut number = 0;
    let mut next = |line: &str| -> Option<String> {
        number += 1;
        let (found, text) = line.strip_suffix('\n')?.split_once(' ')?;
        sum = checksum(sum, text);
        (u32::from_str_radix(found, 16) == Ok(sum)).then(|| text.to_owned())
    };
    let mut lines = text.split_inclusive('\n').peekable();
    let header: Header = serde_json::from_str(&next(lines.next()?)?).ok()?;
    let &[low, high] = &header.range[..] else { return None };
    let mut points: Vec<PointRecord> = vec![];
    let mut damaged = None;
    while let Some(line) = lines.next() {
        let Some(point) = next(line).and_then(|text| serde_json::from_str(&text).ok()) else {
            // the last line of a process that was killed is no damage
            let cut_off = !line.ends_with('\n') && lines.peek().is_none();
            damaged = (!cut_off).then_some(points.len() + 2);
            break;
        };
        points.push(point);
    }
    let family = StoredFamily {
        path: path.to_owned(),
        scene: header.scene,
        identity: header.identity,
        range: [low, high],
        branches: header.branches,
        harmonics: header.harmonics,
        status: Status::Running,
        points,
        ..StoredFamily::default()
    };
    Some((family, damaged))
}

/// Whether there is a journal of the file `path`.
pub(super) fn exists(path: &Path) -> bool {
    name_of(path).exists()
}
