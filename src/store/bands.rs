//! Bands of families in HDF5: `/bands`.

use std::path::Path;

use hdf5::types::VarLenUnicode;

use super::bodies::words;
use super::careful::{Careful, open, reading};
use super::header::{Head, WriterOptions, read_problem, write_problem, write_whole};
use super::orbits::{read_scalar, scalar};
use super::{StoreError, read_text, write_text};
use crate::contact::System;
use crate::records::{BandRow, Bands, Deviation, Status};
use crate::scenario::Scene;

/// The bands of a file.
#[derive(Debug, Clone)]
pub struct StoredBands {
    /// Of which scene, and how it ended.
    pub head: Head,
    /// The file of the family, as it was called.
    pub family: String,
    /// All that the equations depend on, and the family, as one number.
    pub problem: u64,
    /// The bands.
    pub bands: Bands,
}

/// What a family is looked at by.
const HEIGHTS: [&str; 2] = ["amplitude", "energy"];

/// Write the bands of a family; `problem` is the fingerprint of what they are of.
pub fn write_bands(
    path: &Path,
    (scene, system): (&Scene, &System),
    (family, problem): (&str, u64),
    options: &WriterOptions,
    bands: &Bands,
    status: &Status,
) -> Result<(), StoreError> {
    let Bands { deviations, rows } = bands;
    let bytes = 8 * rows.len() * (8 + 4 * deviations.len());
    write_whole(path, (scene, system), options, (bytes, status), |file| {
        let g = file.create_group("bands")?;
        write_text(&g, "family", family)?;
        write_problem(&g, problem)?;
        let numbers = |g: &hdf5::Group, name: &str, of: &dyn Fn(&BandRow) -> f64| {
            let values: Vec<f64> = rows.iter().map(of).collect();
            g.new_dataset_builder().with_data(&values).create(name).map(drop)
        };
        numbers(&g, "branch", &|row| row.branch as f64)?;
        numbers(&g, "index", &|row| row.index as f64)?;
        numbers(&g, "omega", &|row| row.omega)?;
        for (k, name) in HEIGHTS.into_iter().enumerate() {
            numbers(&g, name, &|row| row.heights[k])?;
            numbers(&g, &format!("{name}_deviation"), &|row| bands.sigma(row)[k])?;
            numbers(&g, &format!("{name}_along"), &|row| row.along[k])?;
        }
        let notes: Vec<&str> = rows.iter().map(|row| row.note.as_str()).collect();
        words(&g, "note", &notes)?;
        let all = g.create_group("sensitivity")?;
        for (number, d) in deviations.iter().enumerate() {
            let by = all.create_group(&d.key)?;
            scalar(&by, "value", d.value)?;
            scalar(&by, "deviation", d.sigma)?;
            for (k, name) in HEIGHTS.into_iter().enumerate() {
                numbers(&by, name, &|row| row.by[number][k])?;
            }
        }
        Ok(())
    })
}

/// Read the bands of a file.
pub fn read_bands(path: &Path) -> Result<StoredBands, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let missing = |_| StoreError::Missing { path: path.to_owned(), what: "/bands".into() };
        let g = file.group("bands").map_err(missing)?;
        let bad = |why: &str| StoreError::unusable(path, format!("/bands: {why}"));
        let omega = g.dataset("omega")?.values::<f64>()?;
        let list = |g: &hdf5::Group, name: &str| -> Result<Vec<f64>, StoreError> {
            let list = g.dataset(name)?.values::<f64>()?;
            match list.len() == omega.len() {
                true => Ok(list),
                false => Err(bad("its rows do not fit each other")),
            }
        };
        let pair = |g: &hdf5::Group, ending: &str| -> Result<Vec<[f64; 2]>, StoreError> {
            let [a, b] = HEIGHTS.map(|name| list(g, &format!("{name}{ending}")));
            Ok(a?.into_iter().zip(b?).map(|(a, b)| [a, b]).collect())
        };
        let (branch, index) = (list(&g, "branch")?, list(&g, "index")?);
        let (heights, along) = (pair(&g, "")?, pair(&g, "_along")?);
        let notes: Vec<VarLenUnicode> = g.dataset("note")?.values()?;
        let all = g.group("sensitivity")?;
        let (mut deviations, mut by) = (vec![], vec![]);
        for key in all.member_names()? {
            let g = all.group(&key)?;
            let (value, sigma) = (read_scalar(&g, "value")?, read_scalar(&g, "deviation")?);
            deviations.push(Deviation { key, value, sigma });
            by.push(pair(&g, "")?);
        }
        let is_count = |x: &f64| x.fract() == 0.0 && (0.0..1e15).contains(&x.abs());
        let are_sound = branch.iter().all(|x| *x >= 0.0)
            && branch.iter().chain(&index).all(is_count)
            && omega.iter().chain(heights.iter().flatten()).all(|x| x.is_finite())
            && deviations.iter().all(|d| d.sigma > 0.0 && d.sigma.is_finite());
        if notes.len() != omega.len() || !are_sound {
            return Err(bad("a row is damaged"));
        }
        let row = |k: usize| BandRow {
            branch: branch[k] as usize,
            index: index[k] as i64,
            omega: omega[k],
            heights: heights[k],
            along: along[k],
            by: by.iter().map(|all: &Vec<[f64; 2]>| all[k]).collect(),
            note: notes[k].as_str().to_owned(),
        };
        Ok(StoredBands {
            head: Head::read(&file),
            family: read_text(&g, "family").unwrap_or_default(),
            problem: read_problem(&g).ok_or_else(|| bad("no fingerprint of the problem"))?,
            bands: Bands { deviations, rows: (0..omega.len()).map(row).collect() },
        })
    })
}
