//! `/backbone/error_statement`: the error statement of a finished family.

use std::path::Path;

use hdf5::Group;

use super::careful::Careful;
use super::describe::describe;
use super::output::Staged;
use super::{Outputs, StoreError, read_text, write_text};
use crate::records::{Changed, ErrorStatement, Variation};

/// The name of the group in `/backbone`.
const NAME: &str = "error_statement";

/// Add an error statement to the file of a finished family, or put it in the place of an earlier one. The file is replaced as a whole: nothing is half
/// there.
pub fn write_statement(
    path: &Path,
    outputs: &Outputs,
    statement: &ErrorStatement,
) -> Result<(), StoreError> {
    let mut staged = Staged::begin(&outputs.with_force(true), path)?;
    staged.restart();
    let write = || -> Result<(), StoreError> {
        std::fs::copy(staged.path(), staged.at()).map_err(|e| StoreError::write(path, e))?;
        let file = hdf5::File::open_rw(staged.at())?;
        let family = file.group("backbone")?;
        if family.link_exists(NAME) {
            family.unlink(NAME)?;
        }
        let g = family.create_group(NAME)?;
        let column = |name: &str, values: &[f64]| -> Result<hdf5::Dataset, StoreError> {
            Ok(g.new_dataset_builder().with_data(values).create(name)?)
        };
        column("omega", &statement.omega)?;
        column("energy", &statement.energy)?;
        column("slope", &statement.slope)?;
        for v in &statement.variations {
            let energies = column(v.changed.name(), &v.energy)?;
            write_text(&energies, "units", "energy")?;
            write_text(&energies, "what", &v.text)?;
        }
        describe(&file)?;
        file.flush()?;
        Ok(())
    };
    write().inspect_err(|_| staged.discard())?;
    staged.commit()
}

/// The error statement in `/backbone`, if there is one.
pub(super) fn read_statement(family: &Group) -> Result<Option<ErrorStatement>, StoreError> {
    let Ok(g) = family.group(NAME) else { return Ok(None) };
    let column = |name: &str| -> Result<Vec<f64>, StoreError> { Ok(g.dataset(name)?.values()?) };
    let omega = column("omega")?;
    let mut statement = ErrorStatement {
        energy: column("energy")?,
        slope: column("slope")?,
        omega,
        variations: vec![],
    };
    for changed in Changed::ALL.into_iter().filter(|c| g.link_exists(c.name())) {
        let dataset = g.dataset(changed.name())?;
        let text = read_text(&dataset, "what").unwrap_or_default();
        statement.variations.push(Variation { changed, text, energy: column(changed.name())? });
    }
    let count = statement.omega.len();
    let mut columns =
        statement.variations.iter().map(|v| &v.energy).chain([&statement.energy, &statement.slope]);
    if !columns.all(|c| c.len() == count) {
        return Err(hdf5::Error::from("columns of the error statement differ in length").into());
    }
    drop(columns);
    Ok(Some(statement))
}
