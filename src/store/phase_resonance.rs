//! Tests of phase resonance in HDF5: `/phase_resonance`.

use std::path::Path;

use hdf5::types::VarLenUnicode;

use super::bodies::words;
use super::careful::{Careful, open, reading};
use super::header::{Head, WriterOptions, read_problem, write_problem, write_whole};
use super::orbits::{matrix, read_scalar, scalar};
use super::{StoreError, read_text, write_text};
use crate::contact::System;
use crate::records::{PhaseResonance, Reading, Resonance, ResonanceRow, Status, Test};
use crate::scenario::Scene;

/// The test of a file.
#[derive(Debug, Clone)]
pub struct StoredResonance {
    /// Of which scene, and how it ended.
    pub head: Head,
    /// All that the equations depend on, as one number.
    pub problem: u64,
    /// The test, and what it found.
    pub found: PhaseResonance,
}

/// No test has more steps, or averages over more periods.
const MOST: f64 = 1e9;

/// Write the file of a test; `problem` is the fingerprint of what it is of.
pub fn write_resonance(
    path: &Path,
    (scene, system, problem): (&Scene, &System, u64),
    options: &WriterOptions,
    found: &PhaseResonance,
    status: &Status,
) -> Result<(), StoreError> {
    let PhaseResonance { test, rows } = found;
    let columns = rows.iter().map(|row| row.x.len()).max().unwrap_or(0);
    let bytes = 8 * rows.len() * (columns + 20);
    write_whole(path, (scene, system), options, (bytes, status), |file| {
        let g = file.create_group("phase_resonance")?;
        write_text(&g, "key", &test.key)?;
        write_problem(&g, problem)?;
        write_text(&g, "seed", &test.seed.to_string())?;
        for (name, x) in [
            ("start", test.omega),
            ("steps", test.steps as f64),
            ("tolerance", test.tolerance),
            ("noise", test.noise),
            ("average", test.average as f64),
        ] {
            scalar(&g, name, x)?;
        }
        g.new_dataset_builder().with_data(&test.range).create("range")?;
        g.new_dataset_builder().with_data(&test.gains).create("gains")?;
        let numbers = |name: &str, of: &dyn Fn(&ResonanceRow) -> f64| {
            let values: Vec<f64> = rows.iter().map(of).collect();
            g.new_dataset_builder().with_data(&values).create(name).map(drop)
        };
        numbers("value", &|row| row.value)?;
        numbers("locked", &|row| f64::from(u8::from(row.is_locked)))?;
        numbers("periods", &|row| row.periods as f64)?;
        numbers("energy", &|row| row.energy)?;
        numbers("kinetic", &|row| row.kinetic)?;
        numbers("damping", &ResonanceRow::damping)?;
        for (k, name) in ResonanceRow::READINGS.into_iter().enumerate() {
            numbers(name, &|row| row.readings()[k].mean)?;
            numbers(&format!("{name}_error"), &|row| row.readings()[k].error)?;
        }
        let notes: Vec<&str> = rows.iter().map(|row| row.note.as_str()).collect();
        words(&g, "note", &notes)?;
        let state = |row: &ResonanceRow| {
            let mut x = row.x.clone();
            x.resize(columns, 0.0);
            x
        };
        let x = matrix(rows.len(), columns, rows.iter().flat_map(state).collect())?;
        g.new_dataset_builder().deflate(4).with_data(&x).create("x")?;
        let all = g.create_group("sensitivity")?;
        for (k, key) in test.by.iter().enumerate() {
            let by = all.create_group(key)?;
            for (number, name) in Resonance::NAMES.into_iter().enumerate() {
                let of = |row: &ResonanceRow| row.by.get(k).unwrap_or(&Resonance::NONE).numbers();
                let values: Vec<f64> = rows.iter().map(|row| of(row)[number]).collect();
                by.new_dataset_builder().with_data(&values).create(name)?;
            }
        }
        Ok(())
    })
}

/// Read the test of a file.
pub fn read_resonance(path: &Path) -> Result<StoredResonance, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let what = "/phase_resonance";
        let missing = |_| StoreError::Missing { path: path.to_owned(), what: what.into() };
        let g = file.group("phase_resonance").map_err(missing)?;
        let bad = |why: &str| StoreError::unusable(path, format!("{what}: {why}"));
        let values = g.dataset("value")?.values::<f64>()?;
        let list = |g: &hdf5::Group, name: &str| -> Result<Vec<f64>, StoreError> {
            let list = g.dataset(name)?.values::<f64>()?;
            match list.len() == values.len() {
                true => Ok(list),
                false => Err(bad("its rows do not fit each other")),
            }
        };
        let pair = |name: &str| -> Result<[f64; 2], StoreError> {
            let pair = g.dataset(name)?.values::<f64>()?;
            let pair: Option<[f64; 2]> = pair.try_into().ok();
            pair.filter(|p| p.iter().all(|x| x.is_finite())).ok_or_else(|| bad("a pair is damaged"))
        };
        let whole = |name: &str| -> Result<usize, StoreError> {
            let x = read_scalar(&g, name)?;
            match (1.0..=MOST).contains(&x) {
                true => Ok(x as usize),
                false => Err(bad(&format!("{name} is damaged"))),
            }
        };
        let readings = |name: &str| -> Result<Vec<Reading>, StoreError> {
            let (means, errors) = (list(&g, name)?, list(&g, &format!("{name}_error"))?);
            let pairs = means.into_iter().zip(errors);
            Ok(pairs.map(|(mean, error)| Reading { mean, error }).collect())
        };
        let (locked, periods) = (list(&g, "locked")?, list(&g, "periods")?);
        let (energy, kinetic) = (list(&g, "energy")?, list(&g, "kinetic")?);
        let all = g.group("sensitivity")?;
        let keys = all.member_names()?;
        let mut by = vec![];
        for key in &keys {
            let g = all.group(key)?;
            let [omega, amplitude, work] = Resonance::NAMES.map(|name| list(&g, name));
            by.push((omega?, amplitude?, work?));
        }
        let by = |k: usize| {
            let of = |(omega, amplitude, work): &(Vec<f64>, Vec<f64>, Vec<f64>)| Resonance {
                omega: omega[k],
                amplitude: amplitude[k],
                work: work[k],
            };
            by.iter().map(of).collect()
        };
        let (omega, lag, amplitude) =
            (readings("omega")?, readings("lag")?, readings("amplitude")?);
        let (force, work) = (readings("force")?, readings("work")?);
        let notes: Vec<VarLenUnicode> = g.dataset("note")?.values()?;
        let x = g.dataset("x")?.table::<f64>()?;
        if notes.len() != values.len() || x.nrows() != values.len() {
            return Err(bad("its rows do not fit each other"));
        }
        let seed = read_text(&g, "seed").and_then(|s| s.parse().ok());
        let test = Test {
            key: read_text(&g, "key").unwrap_or_default(),
            range: pair("range")?,
            steps: whole("steps")?,
            omega: read_scalar(&g, "start")?,
            gains: pair("gains")?,
            tolerance: read_scalar(&g, "tolerance")?,
            noise: read_scalar(&g, "noise")?,
            average: whole("average")?,
            seed: seed.ok_or_else(|| bad("no seed"))?,
            by: keys,
        };
        if !values.iter().all(|x| (test.range[0]..=test.range[1]).contains(x)) {
            return Err(bad("values are not within their range"));
        }
        let row = |k: usize| {
            let is_locked = locked[k] == 1.0;
            ResonanceRow {
                value: values[k],
                is_locked,
                periods: periods[k] as usize,
                omega: omega[k],
                lag: lag[k],
                amplitude: amplitude[k],
                force: force[k],
                work: work[k],
                energy: energy[k],
                kinetic: kinetic[k],
                x: if is_locked { x.row(k).to_vec() } else { vec![] },
                by: if is_locked { by(k) } else { vec![] },
                note: notes[k].as_str().to_owned(),
            }
        };
        let rows: Vec<ResonanceRow> = (0..values.len()).map(row).collect();
        if !locked.iter().all(|x| *x == 0.0 || *x == 1.0)
            || !rows.iter().all(ResonanceRow::is_sound)
        {
            return Err(bad("a row is damaged"));
        }
        Ok(StoredResonance {
            head: Head::read(&file),
            problem: read_problem(&g).ok_or_else(|| bad("no fingerprint of the problem"))?,
            found: PhaseResonance { test, rows },
        })
    })
}
