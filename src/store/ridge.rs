//! `/backbone/ridge`: the peaks of a finished response, one row each.

use std::path::Path;

use hdf5::Group;

use super::amend::{amend, column};
use super::reader::Careful;
use super::{Outputs, StoreError};
use crate::records::Peak;

/// The name of the group in `/backbone`.
const NAME: &str = "ridge";

/// Add the ridge to the file of a finished response.
pub fn write_ridge(path: &Path, outputs: &Outputs, ridge: &[Peak]) -> Result<(), StoreError> {
    let of = |value: fn(&Peak) -> f64| ridge.iter().map(value).collect::<Vec<f64>>();
    amend(path, outputs, NAME, |g| {
        column(g, "branch", &of(|p| p.branch as f64), "")?;
        column(g, "omega", &of(|p| p.omega), "1/time")?;
        column(g, "amplitude", &of(|p| p.amplitude), "length")?;
        column(g, "energy", &of(|p| p.energy), "energy")
    })
}

/// The ridge in `/backbone`; empty if there is none.
pub(super) fn read_ridge(family: &Group) -> Result<Vec<Peak>, StoreError> {
    let Ok(g) = family.group(NAME) else { return Ok(vec![]) };
    let column = |name: &str| -> Result<Vec<f64>, StoreError> { Ok(g.dataset(name)?.values()?) };
    let (branch, omega) = (column("branch")?, column("omega")?);
    let (amplitude, energy) = (column("amplitude")?, column("energy")?);
    let count = branch.len();
    if [&omega, &amplitude, &energy].iter().any(|c| c.len() != count) {
        return Err(hdf5::Error::from("columns of the ridge differ in length").into());
    }
    let peak = |k: usize| Peak {
        branch: branch[k] as usize,
        omega: omega[k],
        amplitude: amplitude[k],
        energy: energy[k],
    };
    Ok((0..count).map(peak).collect())
}
