//! What files hold: one row a dataset, with its unit, what its dimensions count, and what it is; a column of a table that is written row by row says besides how
//! a row gives it. Who writes, reads, lists, exports and documents tables goes by these rows: a new quantity is one more of them.

use std::borrow::Cow;

use hdf5::types::{FixedAscii, FixedUnicode};

use super::StoreError;
use super::careful::Careful;
use super::table::{Form, Resume, Table};
use crate::contact::States;

/// A dataset of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct About {
    /// Where it stands, from the root: `trajectory/u`.
    pub path: &'static str,
    /// Unit of its numbers; of words those that occur, separated by ` | `.
    pub units: &'static str,
    /// What its dimensions count.
    pub axes: &'static [&'static str],
    /// What it is.
    pub what: &'static str,
}

impl About {
    pub(super) const fn new(
        path: &'static str,
        units: &'static str,
        axes: &'static [&'static str],
        what: &'static str,
    ) -> About {
        About { path, units, axes, what }
    }

    /// Its group and its name there.
    pub fn place(&self) -> (&'static str, &'static str) {
        self.path.rsplit_once('/').unwrap_or(("", self.path))
    }
}

/// How a row gives the value of a column.
pub(super) enum Get<R> {
    /// A number.
    Number(fn(&R) -> f64),
    /// A whole number.
    Whole(fn(&R) -> i64),
    /// Numbers, one column each.
    Numbers(fn(&R) -> &[f64]),
    /// States of contact points, by their codes.
    States(fn(&R) -> &States),
    /// A word of at most 8 letters.
    Name(fn(&R) -> &'static str),
    /// Words of at most so many letters: 32, 128 (ASCII), 256 (any).
    Words(usize, fn(&R) -> Cow<'_, str>),
}

/// A column of a table whose rows are `R`s.
pub(super) struct Column<R> {
    pub about: About,
    pub get: Get<R>,
    /// How a number that was read is given back to a row.
    pub set: Option<fn(&mut R, f64)>,
}

impl<R> Column<R> {
    pub const fn new(
        path: &'static str,
        units: &'static str,
        axes: &'static [&'static str],
        what: &'static str,
        get: Get<R>,
    ) -> Self {
        Column { about: About::new(path, units, axes, what), get, set: None }
    }

    /// A number that is read back.
    pub const fn kept(self, set: fn(&mut R, f64)) -> Self {
        Column { set: Some(set), ..self }
    }
}

/// Cells of a column, in the type of the file.
enum Cells {
    Number(Table<f64>),
    Whole(Table<i64>),
    Byte(Table<u8>),
    Name(Table<FixedAscii<8>>),
    Word(Table<FixedAscii<32>>),
    Long(Table<FixedAscii<128>>),
    Text(Table<FixedUnicode<256>>),
}

macro_rules! each {
    ($cells:expr, $table:ident => $does:expr) => {
        match $cells {
            Cells::Number($table) => $does,
            Cells::Whole($table) => $does,
            Cells::Byte($table) => $does,
            Cells::Name($table) => $does,
            Cells::Word($table) => $does,
            Cells::Long($table) => $does,
            Cells::Text($table) => $does,
        }
    };
}

macro_rules! open {
    ($get:expr, $table:expr) => {
        match $get {
            Get::Number(_) | Get::Numbers(_) => Cells::Number($table),
            Get::Whole(_) => Cells::Whole($table),
            Get::States(_) => Cells::Byte($table),
            Get::Name(_) => Cells::Name($table),
            Get::Words(..=32, _) => Cells::Word($table),
            Get::Words(..=128, _) => Cells::Long($table),
            Get::Words(..) => Cells::Text($table),
        }
    };
}

/// The open columns of a table.
pub(super) struct Rows<R: 'static> {
    columns: Vec<(&'static Column<R>, Cells)>,
}

impl<R> Rows<R> {
    /// Empty columns, each in its form.
    pub fn create(
        file: &hdf5::File,
        columns: impl IntoIterator<Item = &'static Column<R>>,
        form: &dyn Fn(&About) -> Form,
    ) -> Result<Self, StoreError> {
        let open = |column: &'static Column<R>| {
            let (group, name) = column.about.place();
            let g = if has(file, group) { file.group(group)? } else { file.create_group(group)? };
            let form = form(&column.about);
            let cells = open!(column.get, Table::create(&g, name, form)?);
            Ok((column, cells))
        };
        let columns: Result<Vec<_>, StoreError> = columns.into_iter().map(open).collect();
        Ok(Rows { columns: columns? })
    }

    /// The columns of a file, to go on with.
    pub fn reopen(
        file: &hdf5::File,
        columns: &'static [Column<R>],
        place: Resume,
    ) -> Result<Self, StoreError> {
        let open = |column: &'static Column<R>| {
            let (group, name) = column.about.place();
            let g = file.group(group)?;
            let cells = open!(column.get, Table::reopen(&g, name, place)?);
            Ok((column, cells))
        };
        let columns: Result<Vec<_>, StoreError> = columns.iter().map(open).collect();
        Ok(Rows { columns: columns? })
    }

    /// A row behind all others.
    pub fn push(&mut self, row: &R) {
        for (column, cells) in &mut self.columns {
            match (&column.get, cells) {
                (Get::Number(of), Cells::Number(table)) => table.push(&[of(row)]),
                (Get::Numbers(of), Cells::Number(table)) => table.push(of(row)),
                (Get::Whole(of), Cells::Whole(table)) => table.push(&[of(row)]),
                (Get::States(of), Cells::Byte(table)) => table.push(&codes(of(row))),
                (Get::Name(of), Cells::Name(table)) => table.push(&[ascii(of(row))]),
                (Get::Words(_, of), Cells::Word(table)) => table.push(&[ascii(&of(row))]),
                (Get::Words(_, of), Cells::Long(table)) => table.push(&[ascii(&of(row))]),
                (Get::Words(_, of), Cells::Text(table)) => table.push(&[unicode(&of(row))]),
                _ => unreachable!("cells are made for their column"),
            }
        }
    }

    /// Whether the widest rows fill a chunk.
    pub fn is_full(&self) -> bool {
        self.columns.iter().any(|(_, cells)| each!(cells, table => table.is_full()))
    }

    /// Bytes of all rows that wait.
    pub fn waiting_bytes(&self) -> u64 {
        let bytes = |cells: &Cells| each!(cells, table => table.waiting_bytes());
        self.columns.iter().map(|(_, cells)| bytes(cells)).sum()
    }

    /// Append all rows that wait.
    pub fn append(&mut self) -> Result<(), StoreError> {
        self.columns.iter_mut().try_for_each(|(_, cells)| each!(cells, table => table.append()))
    }
}

/// Give rows the numbers that a file keeps of them.
pub(super) fn read_numbers<R>(
    file: &hdf5::File,
    columns: &'static [Column<R>],
    rows: &mut [R],
) -> Result<(), StoreError> {
    for column in columns {
        let Some(set) = column.set else { continue };
        let path = column.about.path;
        let values = file.dataset(path)?.values::<f64>()?;
        if values.len() != rows.len() {
            let what = format!("damaged: /{path} has {} rows of {}", values.len(), rows.len());
            return Err(StoreError::unusable(std::path::Path::new(&file.filename()), what));
        }
        rows.iter_mut().zip(values).for_each(|(row, value)| set(row, value));
    }
    Ok(())
}

/// A row of a table of states.
pub(super) fn codes(states: &States) -> Vec<u8> {
    states.codes().collect()
}

/// Words as far as there is room for them, without what is no letter of ASCII.
pub(super) fn ascii<const N: usize>(text: &str) -> FixedAscii<N> {
    let text: String = text.chars().filter(|c| c.is_ascii() && *c != '\0').take(N).collect();
    FixedAscii::from_ascii(text.as_bytes()).unwrap_or_default()
}

fn unicode<const N: usize>(text: &str) -> FixedUnicode<N> {
    let mut end = text.len().min(N - 1);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    text[..end].replace('\0', " ").parse().unwrap_or_default()
}

/// Whether a file has something of this name: a path through a group that is not there is an error of the library.
pub(super) fn has(file: &hdf5::File, path: &str) -> bool {
    let mut at = String::new();
    path.split('/').all(|part| {
        at = if at.is_empty() { part.to_owned() } else { format!("{at}/{part}") };
        file.link_exists(&at)
    })
}
