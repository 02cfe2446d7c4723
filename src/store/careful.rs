//! Opening files, and reading datasets whose sizes are not believed.

use std::path::Path;
use std::time::Duration;

use ndarray::Array2;

use super::StoreError;
use super::form::check_format;
use crate::matrices::check_size;

/// What the library says of a file that is read means that the file is damaged, or of another kind.
pub(super) fn reading<T>(
    path: &Path,
    read: impl FnOnce() -> Result<T, StoreError>,
) -> Result<T, StoreError> {
    read().map_err(|e| match e {
        StoreError::Hdf5(e) => {
            let text = e.to_string();
            // the innermost cause stands behind the last colon of the first line
            let line = text.lines().next().unwrap_or_default().to_owned();
            StoreError::unusable(path, format!("damaged, or not what it should be ({line})"))
        }
        e => e,
    })
}

/// Reading of datasets whose sizes are not believed.
pub(super) trait Careful {
    /// All values, in one row.
    fn values<T: hdf5::H5Type>(&self) -> Result<Vec<T>, hdf5::Error>;
    /// A table.
    fn table<T: hdf5::H5Type>(&self) -> Result<Array2<T>, hdf5::Error>;
    /// An array of any dimension.
    fn array<T: hdf5::H5Type>(&self) -> Result<ndarray::ArrayD<T>, hdf5::Error>;
}

impl Careful for hdf5::Dataset {
    fn values<T: hdf5::H5Type>(&self) -> Result<Vec<T>, hdf5::Error> {
        check_size(self, size_of::<T>())?;
        self.read_raw()
    }
    fn table<T: hdf5::H5Type>(&self) -> Result<Array2<T>, hdf5::Error> {
        check_size(self, size_of::<T>())?;
        self.read_2d()
    }
    fn array<T: hdf5::H5Type>(&self) -> Result<ndarray::ArrayD<T>, hdf5::Error> {
        check_size(self, size_of::<T>())?;
        self.read_dyn()
    }
}

pub(super) fn open(path: &Path) -> Result<hdf5::File, StoreError> {
    if path.is_dir() {
        return Err(StoreError::unusable(path, "is a folder; give a file"));
    }
    if !path.is_file() {
        return Err(StoreError::unusable(path, "no such file"));
    }
    let damaged = || StoreError::unusable(path, "not an HDF5 file, or damaged");
    // a child that another thread starts holds the locks of this process until it has become its program
    for _ in 0..PATIENCE {
        match hdf5::File::open(path) {
            Ok(file) => return check_format(path, &file).map(|()| file),
            Err(e) if e.to_string().contains("lock") => std::thread::sleep(BETWEEN),
            Err(_) => return Err(damaged()),
        }
    }
    let file = hdf5::File::open(path).map_err(|_| damaged())?;
    check_format(path, &file).map(|()| file)
}

/// How often a file that somebody locks is tried, and how long between.
const PATIENCE: usize = 20;
const BETWEEN: Duration = Duration::from_millis(10);
