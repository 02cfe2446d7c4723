//! `/crosscheck`: what became of the points of harmonic balance.

use std::path::Path;

use hdf5::types::{FixedAscii, FixedUnicode};

use super::StoreError;
use super::careful::{Careful, open, reading};
use super::columns::{CHECKS, empty_check};
use super::schema::{Rows, read_numbers};
use super::table::Form;
use crate::records::{CheckRow, VerdictKind};

/// Write `/crosscheck` into the file of a family.
pub(super) fn write_crosscheck(file: &hdf5::File, rows: &[CheckRow]) -> Result<(), StoreError> {
    let mut table = Rows::create(file, CHECKS, &|_| Form::plain(None, 64))?;
    rows.iter().for_each(|row| table.push(row));
    table.append()
}

/// Read `/crosscheck`, if the file holds one.
pub fn read_crosscheck(path: &Path) -> Result<Option<Vec<CheckRow>>, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let Ok(g) = file.group("crosscheck") else { return Ok(None) };
        let words: Vec<FixedAscii<32>> = g.dataset("verdict")?.values()?;
        let messages: Vec<FixedUnicode<256>> = g.dataset("message")?.values()?;
        let row = |(k, word): (usize, &FixedAscii<32>)| {
            let message = messages.get(k).map_or(String::new(), |m| m.as_str().to_owned());
            empty_check(VerdictKind::of_name(word.as_str()), message)
        };
        let mut rows: Vec<CheckRow> = words.iter().enumerate().map(row).collect();
        read_numbers(&file, CHECKS, &mut rows)?;
        Ok(Some(rows))
    })
}
