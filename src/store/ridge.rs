//! `/backbone/ridge`: the peaks of a finished response, one row each.

use super::StoreError;
use super::columns::RIDGE;
use super::schema::Rows;
use super::table::Form;
use crate::records::Peak;

/// Write the ridge beside the rows of a response.
pub(super) fn write_ridge(file: &hdf5::File, ridge: &[Peak]) -> Result<(), StoreError> {
    let mut table = Rows::create(file, RIDGE, &|_| Form::plain(None, 64))?;
    ridge.iter().for_each(|peak| table.push(peak));
    table.append()
}
