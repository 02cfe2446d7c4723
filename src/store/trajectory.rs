//! `/trajectory` and `/energy`: the tables of the stored states.

use super::StoreError;
use super::bodies::words;
use super::columns::{
    ENERGY, FORCES, FRICTION, MOMENTA, ROTATIONS, SLIDING, SPRINGS, STATES, SUPPORTS, TRACTIONS,
};
use super::kept::Kept;
use super::row::Row;
use super::schema::{About, Column, Rows};
use super::table::{Form, Resume};
use super::watched::Watched;

/// Aim of a chunk's size in bytes.
const CHUNK_BYTES: usize = 256 * 1024;

/// The open tables of the stored states.
pub(super) struct Trajectory {
    tables: Vec<Rows<Row>>,
    probes: Watched,
}

impl Trajectory {
    /// Create both groups, for `n_c` contact nodes, with friction or without, the states compressed or not.
    pub fn create(
        file: &hdf5::File,
        kept: &Kept,
        (n_c, rubs, compressed): (usize, bool, bool),
    ) -> Result<Self, StoreError> {
        let n = kept.len();
        let chunk = (CHUNK_BYTES / (8 * n.max(1))).clamp(1, 1024);
        let form = |about: &About| match about.place().1 {
            "t" => Form::plain(None, chunk),
            name => Form {
                columns: Some(if matches!(name, "u" | "v") { n } else { n_c }),
                chunk,
                compressed,
                single: kept.single && name != "active",
            },
        };
        let states = Rows::create(file, STATES, &form)?;
        if let Some(columns) = kept.columns() {
            let g = file.group("trajectory")?;
            let columns = g.new_dataset_builder().with_data(&columns).create("columns")?;
            let all = kept.all_columns() as i64;
            columns.new_attr::<i64>().create("of")?.write_scalar(&all)?;
        }
        let plain = |_: &About| Form::plain(None, chunk);
        let mut tables = vec![states, Rows::create(file, ENERGY, &plain)?];
        let groups = &kept.watch.resultants;
        if !groups.names.is_empty() {
            let components = groups.dim * groups.names.len();
            tables.push(Rows::create(file, FORCES, &|_| Form::plain(Some(components), chunk))?);
            let names: Vec<&str> = groups.names.iter().map(String::as_str).collect();
            words(&file.group("forces/contact")?, "group", &names)?;
        }
        let bearings = &kept.watch.bearings;
        let mut add = |columns, width: usize| -> Result<bool, StoreError> {
            if width > 0 {
                let form = Form { columns: Some(width), chunk, compressed, single: false };
                tables.push(Rows::create(file, columns, &|_| form)?);
            }
            Ok(width > 0)
        };
        for (columns, names, components, place) in [
            (SUPPORTS, &bearings.supports, bearings.dim, ("forces/support", "group")),
            (SPRINGS, &bearings.springs, 1, ("forces/spring", "name")),
        ] {
            if add(columns, components * names.len())? {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                words(&file.group(place.0)?, place.1, &names)?;
            }
        }
        add(MOMENTA, bearings.momenta())?;
        add(SLIDING, kept.excursions.pairs.len())?;
        add(ROTATIONS, kept.excursions.rotations())?;
        if rubs {
            tables.push(Rows::create(file, TRACTIONS, &form)?);
            tables.push(Rows::create(file, FRICTION, &plain)?);
        }
        Ok(Trajectory { tables, probes: Watched::create(file, kept, chunk)? })
    }

    /// Go on with the tables of a file.
    pub(crate) fn reopen(
        file: &hdf5::File,
        kept: &Kept,
        place: Resume,
    ) -> Result<Self, StoreError> {
        let tables = [
            STATES, ENERGY, FORCES, SUPPORTS, SPRINGS, MOMENTA, SLIDING, ROTATIONS, TRACTIONS,
            FRICTION,
        ];
        let is_there = |columns: &&'static [Column<Row>]| file.link_exists(columns[0].about.path);
        let reopen = |columns| Rows::reopen(file, columns, place);
        let tables = tables.into_iter().filter(is_there).map(reopen);
        let probes = Watched::reopen(file, kept, place)?;
        Ok(Trajectory { tables: tables.collect::<Result<_, _>>()?, probes })
    }

    pub fn push(&mut self, s: &Row) {
        self.tables.iter_mut().for_each(|t| t.push(s));
        self.probes.push(&s.probes);
    }

    /// Whether a chunk is complete.
    pub(crate) fn is_full(&self) -> bool {
        self.tables[0].is_full()
    }

    /// Bytes of all rows that wait.
    pub(crate) fn waiting_bytes(&self) -> u64 {
        self.tables.iter().map(Rows::waiting_bytes).sum::<u64>() + self.probes.waiting_bytes()
    }

    /// Append all rows that wait.
    pub fn append(&mut self) -> Result<(), StoreError> {
        self.tables.iter_mut().try_for_each(Rows::append)?;
        self.probes.append()
    }
}
