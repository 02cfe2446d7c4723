//! `/backbone/ridge`: the peaks of a finished response, one row each.

use hdf5::Group;

use super::{StoreError, write_text};
use crate::records::Peak;

/// Write the ridge beside the rows of a response.
pub(super) fn write_ridge(family: &Group, ridge: &[Peak]) -> Result<(), StoreError> {
    let g = family.create_group("ridge")?;
    let column = |name: &str, value: fn(&Peak) -> f64, units: &str| -> Result<(), StoreError> {
        let values: Vec<f64> = ridge.iter().map(value).collect();
        let dataset = g.new_dataset_builder().with_data(&values).create(name)?;
        write_text(&dataset, "units", units)
    };
    column("branch", |p| p.branch as f64, "")?;
    column("omega", |p| p.omega, "1/time")?;
    column("amplitude", |p| p.amplitude, "length")?;
    column("energy", |p| p.energy, "energy")
}
