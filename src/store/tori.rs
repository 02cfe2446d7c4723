//! Families of motions of two frequencies in HDF5: `/tori`.

use std::path::Path;

use super::careful::{Careful, open, reading};
use super::header::{Head, WriterOptions, read_problem, write_problem, write_whole};
use super::orbits::{matrix, read_scalar, scalar};
use super::{StoreError, read_text, write_text};
use crate::contact::System;
use crate::records::{Status, Tori, TorusRow};
use crate::scenario::Scene;

/// The family of a file.
#[derive(Debug, Clone)]
pub struct StoredTori {
    /// Of which scene, and how it ended.
    pub head: Head,
    /// All that the equations depend on, as one number.
    pub problem: u64,
    /// The family.
    pub tori: Tori,
}

/// No family has more curves.
const MOST: f64 = 1e6;

/// Write a family; `problem` is the fingerprint of what it is of.
pub fn write_tori(
    path: &Path,
    (scene, system, problem): (&Scene, &System, u64),
    options: &WriterOptions,
    tori: &Tori,
    status: &Status,
) -> Result<(), StoreError> {
    let rows = &tori.rows;
    let numbers = |row: &TorusRow| row.states.iter().map(|x| x.len() + 2).sum::<usize>();
    let bytes = 8 * rows.iter().map(numbers).sum::<usize>();
    write_whole(path, (scene, system), options, (bytes, status), |file| {
        let g = file.create_group("tori")?;
        write_problem(&g, problem)?;
        write_text(&g, "end", &tori.end)?;
        scalar(&g, "start", tori.start)?;
        scalar(&g, "count", tori.count as f64)?;
        scalar(&g, "first_size", tori.size)?;
        g.new_dataset_builder().with_data(&tori.range).create("range")?;
        let numbers = |name: &str, of: &dyn Fn(&TorusRow) -> f64| {
            let values: Vec<f64> = rows.iter().map(of).collect();
            g.new_dataset_builder().with_data(&values).create(name).map(drop)
        };
        numbers("omega", &|row| row.omega)?;
        numbers("rotation_number", &|row| row.rho)?;
        numbers("size", &|row| row.size)?;
        numbers("tail", &|row| row.tail)?;
        numbers("attraction", &|row| row.attraction)?;
        numbers("amplitude", &|row| row.amplitude)?;
        numbers("force", &|row| row.force)?;
        numbers("step", &|row| row.step)?;
        for (k, row) in rows.iter().enumerate() {
            let curve = g.create_group(&k.to_string())?;
            let columns = row.states.first().map_or(0, Vec::len);
            let x = row.states.iter().flatten().copied().collect();
            let x = matrix(row.states.len(), columns, x)?;
            curve.new_dataset_builder().deflate(4).with_data(&x).create("x")?;
            let lead = row.lead.iter().flatten().copied().collect();
            let lead = matrix(row.lead.len(), 2, lead)?;
            curve.new_dataset_builder().with_data(&lead).create("lead")?;
        }
        Ok(())
    })
}

/// Read the family of a file.
pub fn read_tori(path: &Path) -> Result<StoredTori, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let missing = |_| StoreError::Missing { path: path.to_owned(), what: "/tori".into() };
        let g = file.group("tori").map_err(missing)?;
        let bad = |why: &str| StoreError::unusable(path, format!("/tori: {why}"));
        let omega = g.dataset("omega")?.values::<f64>()?;
        let list = |name: &str| -> Result<Vec<f64>, StoreError> {
            let list = g.dataset(name)?.values::<f64>()?;
            match list.len() == omega.len() {
                true => Ok(list),
                false => Err(bad("its rows do not fit each other")),
            }
        };
        let (rho, size, tail) = (list("rotation_number")?, list("size")?, list("tail")?);
        let (attraction, amplitude) = (list("attraction")?, list("amplitude")?);
        let (force, step) = (list("force")?, list("step")?);
        let mut rows = vec![];
        for k in 0..omega.len() {
            let curve = g.group(&k.to_string())?;
            let x = curve.dataset("x")?.table::<f64>()?;
            let lead = curve.dataset("lead")?.table::<f64>()?;
            let row = TorusRow {
                omega: omega[k],
                rho: rho[k],
                size: size[k],
                tail: tail[k],
                attraction: attraction[k],
                amplitude: amplitude[k],
                force: force[k],
                step: step[k],
                states: x.rows().into_iter().map(|x| x.to_vec()).collect(),
                lead: lead.rows().into_iter().map(|x| [x[0], x[1]]).collect(),
            };
            let is_sound = x.iter().chain(&lead).all(|x| x.is_finite())
                && [row.omega, row.size, row.rho, row.step]
                    .iter()
                    .all(|x| x.is_finite() && *x > 0.0)
                && x.nrows() % 2 == 1
                && (lead.nrows() == x.nrows() || lead.nrows() == 0);
            if !is_sound {
                return Err(bad("a row is damaged"));
            }
            rows.push(row);
        }
        let range: Result<[f64; 2], _> = g.dataset("range")?.values::<f64>()?.try_into();
        let count = read_scalar(&g, "count")?;
        if !(1.0..=MOST).contains(&count) {
            return Err(bad("count is damaged"));
        }
        let tori = Tori {
            start: read_scalar(&g, "start")?,
            range: range.map_err(|_| bad("a range is damaged"))?,
            count: count as usize,
            size: read_scalar(&g, "first_size")?,
            rows,
            end: read_text(&g, "end").unwrap_or_default(),
        };
        Ok(StoredTori {
            head: Head::read(&file),
            problem: read_problem(&g).ok_or_else(|| bad("no fingerprint of the problem"))?,
            tori,
        })
    })
}
