//! `/backbone/error_statement`: the error statement of a finished family.

use std::path::Path;

use hdf5::Group;

use super::amend::{amend, column};
use super::reader::Careful;
use super::{Outputs, StoreError, read_text, write_text};
use crate::records::{Changed, ErrorStatement, Variation};

/// The name of the group in `/backbone`.
const NAME: &str = "error_statement";

/// Add an error statement to the file of a finished family.
pub fn write_statement(
    path: &Path,
    outputs: &Outputs,
    statement: &ErrorStatement,
) -> Result<(), StoreError> {
    amend(path, outputs, NAME, |g| {
        column(g, "omega", &statement.omega, "1/time")?;
        column(g, "energy", &statement.energy, "energy")?;
        column(g, "slope", &statement.slope, "energy time")?;
        for v in &statement.variations {
            column(g, v.changed.name(), &v.energy, "energy")?;
            let dataset = g.dataset(v.changed.name())?;
            write_text(&dataset, "what", &v.text)?;
        }
        Ok(())
    })
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
