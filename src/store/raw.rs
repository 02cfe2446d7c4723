//! What a file holds, name by name, for those who want it as it is.

use std::path::Path;

use hdf5::types::{FixedAscii, FixedUnicode, TypeDescriptor, VarLenUnicode};
use hdf5::{Dataset, Group, H5Type, LocationType};
use ndarray::ArrayD;

use super::careful::{Careful, open, reading};
use super::columns::datasets;
use super::{StoreError, read_text};

/// An array of a file, or an attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum Raw {
    /// Numbers.
    Float(ArrayD<f64>),
    /// Whole numbers.
    Integer(ArrayD<i64>),
    /// 0 and 1.
    Byte(ArrayD<u8>),
    /// Yes or no.
    Flag(bool),
    /// Words, in one row.
    Words(Vec<String>),
}

/// A name in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// From the root: `trajectory/u`.
    pub name: String,
    /// Shape of a dataset; none for a group.
    pub shape: Option<Vec<usize>>,
}

/// All groups and datasets of a group (`""`: of the file) that stand directly in it.
pub fn entries(path: &Path, group: &str) -> Result<Vec<Entry>, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let g = if group.is_empty() { file.as_group()? } else { find(path, &file, group)? };
        let entry = |name: String| {
            let shape = match g.loc_type_by_name(&name)? {
                LocationType::Dataset => Some(g.dataset(&name)?.shape()),
                _ => None,
            };
            Ok(Entry { name, shape })
        };
        g.member_names()?.into_iter().map(entry).collect()
    })
}

/// A dataset that a file holds, and what the file says of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// From the root.
    pub name: String,
    /// Its shape.
    pub shape: Vec<usize>,
    /// Unit.
    pub units: String,
    /// What it is.
    pub description: String,
}

/// All datasets of a file; of the points of a family those of the first one.
pub fn held(path: &Path) -> Result<Vec<Held>, StoreError> {
    fn collect(g: &Group, at: &str, all: &mut Vec<Held>) -> Result<(), StoreError> {
        for name in g.member_names()? {
            let whole = if at.is_empty() { name.clone() } else { format!("{at}/{name}") };
            match g.loc_type_by_name(&name)? {
                LocationType::Dataset => {
                    let data = g.dataset(&name)?;
                    let word = |key: &str| read_text(&data, key).unwrap_or_default();
                    let (units, description) = (word("units"), word("description"));
                    all.push(Held { name: whole, shape: data.shape(), units, description });
                }
                _ if at == "backbone/points" && name != "0000" => {}
                _ => collect(&g.group(&name)?, &whole, all)?,
            }
        }
        Ok(())
    }
    reading(path, || {
        let mut all = vec![];
        collect(&*open(path)?, "", &mut all)?;
        let known = datasets();
        // a group a parameter, a curve, an attractor
        let in_groups = |h: &Held| {
            let groups = [
                "sensitivity/KEY",
                "phase_resonance/sensitivity/KEY",
                "bands/sensitivity/KEY",
                "tori/K",
                "curves/K",
                "attractors/K",
            ];
            groups.into_iter().find_map(|group| {
                let (all, _) = group.rsplit_once('/')?;
                let (_, name) = h.name.strip_prefix(all)?.strip_prefix('/')?.rsplit_once('/')?;
                Some(format!("{group}/{name}"))
            })
        };
        // a point of a family is an orbit, and the place where its continuation stood
        let of = |h: &Held| match h.name.strip_prefix("backbone/points/0000/") {
            Some(name) if name.starts_with("continuation/") => {
                format!("backbone/points/NNNN/{name}")
            }
            Some(name) => format!("orbit/{name}"),
            None => in_groups(h).unwrap_or_else(|| h.name.clone()),
        };
        for h in all.iter_mut().filter(|h| h.description.is_empty()) {
            if let Some(about) = known.iter().find(|about| about.path == of(h)) {
                (h.units, h.description) = (about.units.into(), about.what.into());
            }
        }
        let place =
            |h: &Held| known.iter().position(|about| about.path == h.name).unwrap_or(known.len());
        all.sort_by_key(|h| (place(h), h.name.clone()));
        Ok(all)
    })
}

fn missing(path: &Path, name: &str) -> StoreError {
    StoreError::Missing { path: path.to_owned(), what: format!("/{name}") }
}

fn find(path: &Path, file: &hdf5::File, group: &str) -> Result<Group, StoreError> {
    file.group(group).map_err(|_| missing(path, group))
}

/// A dataset.
pub fn read_raw(path: &Path, name: &str) -> Result<Raw, StoreError> {
    reading(path, || {
        let file = open(path)?;
        values(&file.dataset(name).map_err(|_| missing(path, name))?)
    })
}

/// The attributes of a group (`""`: of the file).
pub fn attributes(path: &Path, group: &str) -> Result<Vec<(String, Raw)>, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let g = if group.is_empty() { file.as_group()? } else { find(path, &file, group)? };
        let value = |name: String| {
            let a = g.attr(&name)?;
            let value = match a.dtype()?.to_descriptor()? {
                TypeDescriptor::Boolean => Raw::Flag(a.read_scalar()?),
                TypeDescriptor::Float(_) => Raw::Float(a.read_dyn()?),
                TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => {
                    Raw::Integer(a.read_dyn()?)
                }
                _ => Raw::Words(read_text(&g, &name).into_iter().collect()),
            };
            Ok((name, value))
        };
        g.attr_names()?.into_iter().map(value).collect()
    })
}

fn values(data: &Dataset) -> Result<Raw, StoreError> {
    Ok(match data.dtype()?.to_descriptor()? {
        TypeDescriptor::Unsigned(hdf5::types::IntSize::U1) => Raw::Byte(data.array()?),
        TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => Raw::Integer(data.array()?),
        TypeDescriptor::FixedAscii(0..=32) => Raw::Words(words::<FixedAscii<32>>(data)?),
        TypeDescriptor::FixedAscii(33..=64) => Raw::Words(words::<FixedAscii<64>>(data)?),
        TypeDescriptor::FixedAscii(_) => Raw::Words(words::<FixedAscii<256>>(data)?),
        TypeDescriptor::FixedUnicode(_) => Raw::Words(words::<FixedUnicode<256>>(data)?),
        TypeDescriptor::VarLenUnicode => Raw::Words(words::<VarLenUnicode>(data)?),
        _ => Raw::Float(data.array()?),
    })
}

fn words<T: H5Type + ToString>(data: &Dataset) -> Result<Vec<String>, StoreError> {
    crate::matrices::check_size(data, size_of::<T>())?;
    Ok(data.read_raw::<T>()?.iter().map(T::to_string).collect())
}
