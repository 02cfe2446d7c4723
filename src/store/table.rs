//! An append-only dataset that is written in whole chunks.

use hdf5::plist::dataset_create::FillTime;
use hdf5::{Dataset, Group, H5Type};
use ndarray::{ArrayView1, ArrayView2};

use super::StoreError;

/// Rows waiting for their chunk.
pub(super) struct Table<T: H5Type> {
    dataset: Dataset,
    columns: Option<usize>,
    chunk: usize,
    rows: usize,
    waiting: usize,
    pending: Vec<T>,
    /// Rows to come that are there already.
    known: usize,
}

/// Where to go on with a table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resume {
    /// Behind so many rows.
    pub rows: usize,
    /// What lies behind them is what comes next, and stays: it is computed again, and not written. Otherwise it is cut off.
    pub keeps: bool,
}

/// How a table lies in its file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    /// Numbers of a row; absent: one value a row.
    pub columns: Option<usize>,
    /// Rows of a chunk.
    pub chunk: usize,
    /// Compressed tables append whole chunks only.
    pub compressed: bool,
    /// Numbers in single precision.
    pub single: bool,
}

impl Form {
    /// Neither compressed nor rounded.
    pub fn plain(columns: Option<usize>, chunk: usize) -> Form {
        Form { columns, chunk, compressed: false, single: false }
    }
}

impl<T: H5Type + Clone> Table<T> {
    /// An empty table.
    pub fn create(group: &Group, name: &str, form: Form) -> Result<Self, StoreError> {
        let Form { columns, chunk, compressed, single } = form;
        let kind = if single { f32::type_descriptor() } else { T::type_descriptor() };
        // whole rows are written: nothing has to be filled in before
        let builder = group.new_dataset_builder().fill_time(FillTime::Never).empty_as(&kind);
        let dataset = match (columns, compressed) {
            // a body without contact: no columns, and HDF5 wants chunks of at least one
            (Some(0), _) => builder.chunk((chunk, 1)).shape((0.., 0..)).create(name)?,
            (Some(n), true) => {
                builder.chunk((chunk, n)).shuffle().deflate(1).shape((0.., n)).create(name)?
            }
            (Some(n), false) => builder.chunk((chunk, n)).shape((0.., n)).create(name)?,
            (None, true) => builder.chunk(chunk).shuffle().deflate(1).shape(0..).create(name)?,
            (None, false) => builder.chunk(chunk).shape(0..).create(name)?,
        };
        Ok(Table { dataset, columns, chunk, rows: 0, waiting: 0, pending: vec![], known: 0 })
    }

    /// Go on with a table of a file.
    pub(crate) fn reopen(group: &Group, name: &str, place: Resume) -> Result<Self, StoreError> {
        let dataset = group.dataset(name)?;
        let shape = dataset.shape();
        let short = || hdf5::Error::from(format!("{name} has fewer rows than its checkpoint says"));
        let there = shape.first().copied().unwrap_or(0);
        if there < place.rows {
            return Err(short().into());
        }
        let rows = if place.keeps { there } else { place.rows };
        let columns = shape.get(1).copied();
        match columns {
            Some(n) => dataset.resize((rows, n))?,
            None => dataset.resize(rows)?,
        }
        let chunk = dataset.chunk().and_then(|c| c.first().copied()).unwrap_or(1);
        let known = rows - place.rows;
        Ok(Table { dataset, columns, chunk, rows, waiting: 0, pending: vec![], known })
    }

    pub fn push(&mut self, row: &[T]) {
        debug_assert_eq!(row.len(), self.columns.unwrap_or(1));
        if self.known > 0 {
            self.known -= 1;
            return;
        }
        self.pending.extend_from_slice(row);
        self.waiting += 1;
    }

    pub(crate) fn is_full(&self) -> bool {
        self.waiting >= self.chunk
    }

    /// Bytes of what waits, and of the chunk that it may begin.
    pub(crate) fn waiting_bytes(&self) -> u64 {
        if self.waiting == 0 {
            return 0;
        }
        let rows = self.waiting + self.chunk;
        (rows * self.columns.unwrap_or(1).max(1) * size_of::<T>()) as u64
    }

    /// Append what waits.
    pub fn append(&mut self) -> Result<(), StoreError> {
        let added = std::mem::take(&mut self.waiting);
        if added == 0 {
            return Ok(());
        }
        let (from, to) = (self.rows, self.rows + added);
        match self.columns {
            Some(n) => {
                self.dataset.resize((to, n))?;
                if n == 0 {
                    self.rows = to;
                    return Ok(());
                }
                let view = ArrayView2::from_shape((added, n), &self.pending)
                    .map_err(|e| hdf5::Error::from(e.to_string()))?;
                self.dataset.write_slice(view, (from..to, ..))?;
            }
            None => {
                self.dataset.resize(to)?;
                self.dataset.write_slice(ArrayView1::from(&self.pending), from..to)?;
            }
        }
        self.rows = to;
        self.pending.clear();
        Ok(())
    }
}
