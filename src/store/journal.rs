//! The journal of a family that is being computed: one line a point, beside the HDF5 file.
//!
//! A process can be killed while the HDF5 library writes its metadata, and then the file does not open. A line that was cut off
//! is told by its missing end, and everything before it stands. Numbers are kept by their bits: what is read is what was written.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::orbits::{PointRecord, StoredFamily};
use super::{StoreError, orbits};

/// What the first line says.
#[derive(Debug, Serialize, Deserialize)]
struct Header {
    scene: String,
    kind: String,
    branches: Vec<String>,
    harmonics: usize,
}

/// An open journal.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
}

fn name_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".journal");
    PathBuf::from(name)
}

fn fail(path: &Path, e: impl std::fmt::Display) -> StoreError {
    StoreError::unusable(path, e)
}

fn line<T: Serialize>(path: &Path, value: &T) -> Result<Vec<u8>, StoreError> {
    let mut text = serde_json::to_vec(value).map_err(|e| fail(path, e))?;
    text.push(b'\n');
    Ok(text)
}

impl Journal {
    /// A new journal for the file `path`, with the points that are known already; an old one is replaced at once.
    pub fn create(path: &Path, family: &StoredFamily) -> Result<Journal, StoreError> {
        let name = name_of(path);
        let header = Header {
            scene: family.scene.clone(),
            kind: family.kind.clone(),
            branches: family.branches.clone(),
            harmonics: family.harmonics,
        };
        let mut text = line(&name, &header)?;
        for point in &family.points {
            text.extend(line(&name, point)?);
        }
        let fresh = PathBuf::from(format!("{}.new", name.display()));
        std::fs::write(&fresh, text).map_err(|e| fail(&fresh, e))?;
        std::fs::rename(&fresh, &name).map_err(|e| fail(&name, e))?;
        let file = OpenOptions::new().append(true).open(&name).map_err(|e| fail(&name, e))?;
        Ok(Journal { path: name, file })
    }

    /// Append a point.
    pub fn append(&mut self, point: &PointRecord) -> Result<(), StoreError> {
        let text = line(&self.path, point)?;
        self.file.write_all(&text).map_err(|e| fail(&self.path, e))
    }

    /// The family is complete: the HDF5 file holds everything.
    pub fn remove(self) {
        // a journal that stays does no harm
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The unfinished family of the file `path`, if there is a journal of it.
pub(super) fn read(path: &Path) -> Option<orbits::StoredFamily> {
    let text = std::fs::read_to_string(name_of(path)).ok()?;
    let mut lines = text.split_inclusive('\n').filter(|l| l.ends_with('\n'));
    let header: Header = serde_json::from_str(lines.next()?).ok()?;
    let points = lines.map_while(|l| serde_json::from_str(l).ok()).collect();
    Some(StoredFamily {
        path: path.to_owned(),
        scene: header.scene,
        kind: header.kind,
        branches: header.branches,
        harmonics: header.harmonics,
        status: "running".into(),
        points,
        ..StoredFamily::default()
    })
}

/// Numbers by their bits.
pub(super) mod bits {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    /// One number.
    pub mod one {
        use super::*;
        pub fn serialize<S: Serializer>(x: &f64, s: S) -> Result<S::Ok, S::Error> {
            x.to_bits().serialize(s)
        }
        pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<f64, D::Error> {
            Ok(f64::from_bits(u64::deserialize(d)?))
        }
    }

    /// A list.
    pub mod many {
        use super::*;
        pub fn serialize<S: Serializer>(x: &[f64], s: S) -> Result<S::Ok, S::Error> {
            s.collect_seq(x.iter().map(|x| x.to_bits()))
        }
        pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<Vec<f64>, D::Error> {
            Ok(Vec::<u64>::deserialize(d)?.into_iter().map(f64::from_bits).collect())
        }
    }

    /// A list of pairs.
    pub mod pairs {
        use super::*;
        pub fn serialize<S: Serializer>(x: &[[f64; 2]], s: S) -> Result<S::Ok, S::Error> {
            s.collect_seq(x.iter().map(|x| x.map(f64::to_bits)))
        }
        pub fn deserialize<'d, D: Deserializer<'d>>(d: D) -> Result<Vec<[f64; 2]>, D::Error> {
            Ok(Vec::<[u64; 2]>::deserialize(d)?
                .into_iter()
                .map(|x| x.map(f64::from_bits))
                .collect())
        }
    }

    /// Switches: time, node, whether it closes.
    pub mod switches {
        use super::*;
        pub fn serialize<S: Serializer>(x: &[(f64, usize, bool)], s: S) -> Result<S::Ok, S::Error> {
            s.collect_seq(x.iter().map(|&(t, n, c)| (t.to_bits(), n, c)))
        }
        pub fn deserialize<'d, D: Deserializer<'d>>(
            d: D,
        ) -> Result<Vec<(f64, usize, bool)>, D::Error> {
            let list = Vec::<(u64, usize, bool)>::deserialize(d)?;
            Ok(list.into_iter().map(|(t, n, c)| (f64::from_bits(t), n, c)).collect())
        }
    }
}
