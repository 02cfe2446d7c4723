//! `/comparison`: contact methods side by side, a row each. The file is small: it is written anew with every few rows, beside the one that stands there, and takes
//! its place.

use std::path::Path;

use hdf5::types::VarLenUnicode;

use super::careful::{Careful, open, reading};
use super::describe::describe;
use super::header::WriterOptions;
use super::header::write_origin;
use super::output::Staged;
use super::{StoreError, read_text, write_text};
use crate::records::{Compared, Comparison, Row, Status};
use crate::scenario::Scene;

/// Writes a comparison as it grows.
#[derive(Debug)]
pub struct ComparisonWriter {
    staged: Staged,
    scene: Scene,
    command: String,
    identity: String,
}

/// A stored comparison.
#[derive(Debug, Clone)]
pub struct StoredComparison {
    /// The comparison.
    pub comparison: Comparison,
    /// How it ended.
    pub status: Status,
    /// Scene text.
    pub scene: String,
    /// What the files that the scene and the command name amount to.
    pub identity: String,
    /// Program version, time of creation, command line.
    pub origin: [String; 3],
}

fn text(value: &str) -> Result<VarLenUnicode, hdf5::Error> {
    value.replace('\0', " ").parse().map_err(|_| hdf5::Error::from("text with a NUL"))
}

impl ComparisonWriter {
    /// Claim a path; what stands there stays until the first rows are written.
    pub fn begin(
        path: &Path,
        scene: &Scene,
        options: &WriterOptions,
        (resume, identity): (bool, String),
    ) -> Result<Self, StoreError> {
        let outputs = options.outputs.with_force(options.outputs.is_forced() || resume);
        let staged = Staged::begin(&outputs, path)?;
        Ok(ComparisonWriter {
            staged,
            scene: scene.clone(),
            command: options.command.clone(),
            identity,
        })
    }

    /// Write all rows.
    pub fn write(&mut self, comparison: &Comparison, status: &Status) -> Result<(), StoreError> {
        if self.staged.path().exists() {
            self.staged.restart();
        }
        let at = self.staged.at();
        let write = || -> Result<(), StoreError> {
            let file = hdf5::File::create(at)?;
            write_origin(&file, &self.scene, &self.command)?;
            let g = file.create_group("comparison")?;
            write_text(&g, "compared", comparison.compared.name())?;
            write_text(&g, "reference", &comparison.reference)?;
            write_text(&g, "exact", if comparison.exact { "yes" } else { "no" })?;
            write_text(&g, "footer", &comparison.footer)?;
            write_text(&g, "identity", &self.identity)?;
            let rows = &comparison.rows;
            let column =
                |name: &str, units: &str, of: &dyn Fn(&Row) -> f64| -> Result<(), StoreError> {
                    let values: Vec<f64> = rows.iter().map(of).collect();
                    let dataset = g.new_dataset_builder().with_data(&values).create(name)?;
                    write_text(&dataset, "units", units)
                };
            let words = |name: &str, of: &dyn Fn(&Row) -> &str| -> Result<(), StoreError> {
                let values = rows.iter().map(|r| text(of(r))).collect::<Result<Vec<_>, _>>()?;
                g.new_dataset_builder().with_data(&values).create(name)?;
                Ok(())
            };
            words("variant", &|r| &r.variant)?;
            words("changed", &|r| &r.changed)?;
            words("mesh", &|r| &r.mesh)?;
            words("note", &|r| &r.note)?;
            column("h", "length", &|r| r.h)?;
            for &quantity in comparison.compared.quantities() {
                column(quantity.name(), quantity.units(), &|r| r.get(quantity))?;
            }
            describe(&file)?;
            // the last word: a file without it is not whole
            write_text(&file, "status", &status.to_string())?;
            file.flush()?;
            Ok(())
        };
        write().inspect_err(|_| self.staged.discard())?;
        self.staged.commit()
    }
}

/// Read a comparison.
pub fn read_comparison(path: &Path) -> Result<StoredComparison, StoreError> {
    reading(path, || {
        let missing = |what: &str| StoreError::Missing { path: path.to_owned(), what: what.into() };
        let file = open(path)?;
        let g = file.group("comparison").map_err(|_| missing("/comparison"))?;
        let word = |name: &str| read_text(&g, name).unwrap_or_default();
        let of_file = |name: &str| read_text(&file, name).unwrap_or_default();
        let name = word("compared");
        let compared = Compared::ALL.into_iter().find(|c| c.name() == name);
        let compared =
            compared.ok_or_else(|| missing("kind of comparison that this program knows"))?;
        let words = |name: &str| -> Result<Vec<String>, StoreError> {
            let values: Vec<VarLenUnicode> =
                g.dataset(name).map_err(|_| missing(name))?.values()?;
            Ok(values.iter().map(|v| v.as_str().to_owned()).collect())
        };
        let column = |name: &str| -> Result<Vec<f64>, StoreError> {
            Ok(g.dataset(name).map_err(|_| missing(name))?.values()?)
        };
        let (variants, changed, meshes, notes) =
            (words("variant")?, words("changed")?, words("mesh")?, words("note")?);
        let h = column("h")?;
        let count = variants.len();
        let damaged =
            || StoreError::unusable(path, "damaged: columns of /comparison differ in length");
        if [changed.len(), meshes.len(), notes.len(), h.len()] != [count; 4] {
            return Err(damaged());
        }
        let mut rows: Vec<Row> = (0..count)
            .map(|k| Row {
                variant: variants[k].clone(),
                changed: changed[k].clone(),
                mesh: meshes[k].clone(),
                h: h[k],
                values: Default::default(),
                note: notes[k].clone(),
            })
            .collect();
        for &quantity in compared.quantities() {
            let values = column(quantity.name())?;
            if values.len() != count {
                return Err(damaged());
            }
            for (row, value) in rows.iter_mut().zip(values).filter(|(_, v)| v.is_finite()) {
                row.values.insert(quantity, value);
            }
        }
        Ok(StoredComparison {
            comparison: Comparison {
                compared,
                title: of_file("title"),
                reference: word("reference"),
                exact: word("exact") == "yes",
                footer: word("footer"),
                rows,
            },
            status: Status::of_name(&of_file("status")),
            scene: of_file("scene"),
            identity: word("identity"),
            origin: [of_file("signorini_version"), of_file("created"), of_file("command")],
        })
    })
}
