//! `/trajectory` and `/energy`: the tables of the stored states.

use super::StoreError;
use super::columns::{ENERGY, STATES};
use super::kept::Kept;
use super::row::Row;
use super::schema::Rows;
use super::table::{Form, Resume};

/// Aim of a chunk's size in bytes.
const CHUNK_BYTES: usize = 256 * 1024;

/// The open tables of the stored states.
pub(super) struct Trajectory {
    states: Rows<Row>,
    energy: Rows<Row>,
}

impl Trajectory {
    /// Create both groups, for `n_c` contact nodes, the states compressed or not.
    pub fn create(
        file: &hdf5::File,
        kept: &Kept,
        (n_c, compressed): (usize, bool),
    ) -> Result<Self, StoreError> {
        let n = kept.len();
        let chunk = (CHUNK_BYTES / (8 * n.max(1))).clamp(1, 1024);
        let states = Rows::create(file, STATES, &|about| match about.place().1 {
            "t" => Form::plain(None, chunk),
            name => Form {
                columns: Some(if matches!(name, "u" | "v") { n } else { n_c }),
                chunk,
                compressed,
                single: kept.single && name != "active",
            },
        })?;
        if let Some(columns) = kept.columns() {
            let g = file.group("trajectory")?;
            let columns = g.new_dataset_builder().with_data(&columns).create("columns")?;
            let all = kept.all_columns() as i64;
            columns.new_attr::<i64>().create("of")?.write_scalar(&all)?;
        }
        let energy = Rows::create(file, ENERGY, &|_| Form::plain(None, chunk))?;
        Ok(Trajectory { states, energy })
    }

    /// Go on with the tables of a file.
    pub(crate) fn reopen(file: &hdf5::File, place: Resume) -> Result<Self, StoreError> {
        let states = Rows::reopen(file, STATES, place)?;
        Ok(Trajectory { states, energy: Rows::reopen(file, ENERGY, place)? })
    }

    pub fn push(&mut self, s: &Row) {
        self.states.push(s);
        self.energy.push(s);
    }

    /// Whether a chunk is complete.
    pub(crate) fn is_full(&self) -> bool {
        self.states.is_full()
    }

    /// Bytes of all rows that wait.
    pub(crate) fn waiting_bytes(&self) -> u64 {
        self.states.waiting_bytes() + self.energy.waiting_bytes()
    }

    /// Append all rows that wait.
    pub fn append(&mut self) -> Result<(), StoreError> {
        self.states.append()?;
        self.energy.append()
    }
}
