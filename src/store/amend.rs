//! Groups that are added to the file of a finished family.

use std::path::Path;

use hdf5::Group;

use super::output::Staged;
use super::{Outputs, StoreError, write_text};

/// Add the group `name` to `/backbone` of a finished family, or put it in the place of an earlier one. The file is replaced as a whole: nothing is half
/// there.
pub(super) fn amend(
    path: &Path,
    outputs: &Outputs,
    name: &str,
    fill: impl Fn(&Group) -> Result<(), StoreError>,
) -> Result<(), StoreError> {
    let mut staged = Staged::begin(&outputs.with_force(true), path)?;
    staged.restart();
    let write = || -> Result<(), StoreError> {
        std::fs::copy(staged.path(), staged.at()).map_err(|e| StoreError::write(path, e))?;
        let file = hdf5::File::open_rw(staged.at())?;
        let family = file.group("backbone")?;
        if family.link_exists(name) {
            family.unlink(name)?;
        }
        fill(&family.create_group(name)?)?;
        file.flush()?;
        Ok(())
    };
    write().inspect_err(|_| staged.discard())?;
    staged.commit()
}

/// A column of numbers with its units.
pub(super) fn column(g: &Group, name: &str, values: &[f64], units: &str) -> Result<(), StoreError> {
    let dataset = g.new_dataset_builder().with_data(values).create(name)?;
    write_text(&dataset, "units", units)
}
