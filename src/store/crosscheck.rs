//! `/crosscheck`: what became of the points of harmonic balance.

use std::path::Path;

use hdf5::types::{FixedAscii, FixedUnicode};

use super::StoreError;
use super::reader::{Careful, open, reading};
use crate::records::{CheckRow, VerdictKind};

/// Write `/crosscheck` into the file of a family.
pub(super) fn write_crosscheck(file: &hdf5::File, rows: &[CheckRow]) -> Result<(), StoreError> {
    let g = file.create_group("crosscheck")?;
    let column = |name: &str, f: &dyn Fn(&CheckRow) -> f64| -> Result<(), StoreError> {
        let values: Vec<f64> = rows.iter().map(f).collect();
        g.new_dataset_builder().with_data(&values).create(name)?;
        Ok(())
    };
    column("omega", &|r| r.omega)?;
    column("harmonics", &|r| r.n_h as f64)?;
    column("hbm_energy", &|r| r.energy)?;
    column("residual", &|r| r.residual)?;
    column("return_error", &|r| r.return_error)?;
    column("moved", &|r| r.moved)?;
    column("orbit_energy", &|r| r.orbit_energy)?;
    column("contact_change", &|r| r.contact_change)?;
    column("same_sequence", &|r| f64::from(u8::from(r.same_sequence)))?;
    // what a file has room for
    let cut = |text: &str| {
        let mut end = text.len().min(255);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        text[..end].replace('\0', " ").parse().unwrap_or_default()
    };
    let words: Vec<FixedAscii<32>> = rows
        .iter()
        .map(|r| FixedAscii::from_ascii(r.verdict.name().as_bytes()).unwrap_or_default())
        .collect();
    g.new_dataset_builder().with_data(&words).create("verdict")?;
    let messages: Vec<FixedUnicode<256>> = rows.iter().map(|r| cut(&r.message)).collect();
    g.new_dataset_builder().with_data(&messages).create("message")?;
    Ok(())
}

/// Read `/crosscheck`, if the file holds one.
pub fn read_crosscheck(path: &Path) -> Result<Option<Vec<CheckRow>>, StoreError> {
    reading(path, || read_crosscheck_of(path))
}

fn read_crosscheck_of(path: &Path) -> Result<Option<Vec<CheckRow>>, StoreError> {
    let file = open(path)?;
    let Ok(g) = file.group("crosscheck") else { return Ok(None) };
    let words: Vec<FixedAscii<32>> = g.dataset("verdict")?.values()?;
    // files of earlier versions keep the verdict only
    let messages: Vec<FixedUnicode<256>> = match g.dataset("message") {
        Ok(data) => data.values()?,
        Err(_) => vec![],
    };
    let names = [
        "omega",
        "harmonics",
        "hbm_energy",
        "residual",
        "return_error",
        "moved",
        "orbit_energy",
        "contact_change",
        "same_sequence",
    ];
    let mut c: Vec<Vec<f64>> = vec![];
    for name in names {
        let column: Vec<f64> = g.dataset(name)?.values()?;
        if column.len() != words.len() {
            let what =
                format!("damaged: /crosscheck/{name} has {} rows of {}", column.len(), words.len());
            return Err(StoreError::unusable(path, what));
        }
        c.push(column);
    }
    Ok(Some(
        (0..words.len())
            .map(|i| CheckRow {
                omega: c[0][i],
                n_h: c[1][i] as usize,
                energy: c[2][i],
                residual: c[3][i],
                return_error: c[4][i],
                verdict: VerdictKind::of_name(words[i].as_str()),
                message: messages.get(i).map_or(String::new(), |m| m.as_str().to_owned()),
                moved: c[5][i],
                orbit_energy: c[6][i],
                contact_change: c[7][i],
                same_sequence: c[8][i] == 1.0,
            })
            .collect(),
    ))
}
