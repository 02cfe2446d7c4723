//! What the datasets of a file mean, as attributes of them.

use hdf5::types::VarLenAscii;

use super::columns::datasets;
use super::schema::{About, has};
use super::{StoreError, write_text};

/// Say of every dataset that a file has what it is, as attributes: `units`, `description`, and HDF5's own `DIMENSION_LABELS` (h5py: `dataset.dims[0].label`;
/// MATLAB: `h5readatt`).
pub(super) fn describe(file: &hdf5::File) -> Result<(), StoreError> {
    for About { path, units, axes, what } in datasets() {
        if !has(file, path) {
            continue;
        }
        let dataset = file.dataset(path)?;
        // what is there from the beginning was described then
        if dataset.attr("description").is_ok() {
            continue;
        }
        write_text(&dataset, "units", units)?;
        write_text(&dataset, "description", what)?;
        if dataset.ndim() == axes.len() {
            let words: Result<Vec<VarLenAscii>, _> =
                axes.iter().map(VarLenAscii::from_ascii).collect();
            let words = words.map_err(|_| hdf5::Error::from("a label is not ASCII"))?;
            dataset.new_attr_builder().with_data(&words).create("DIMENSION_LABELS")?;
        }
    }
    Ok(())
}
