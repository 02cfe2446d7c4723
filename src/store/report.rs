//! `/report`: what a command said of its result, beside the tables: numbers and words (a line each) as attributes, rows of numbers as datasets, objects as groups.
//! What is absent was null.

use hdf5::Group;
use ndarray::Array2;
use serde_json::Value;

use super::orbits::scalar;
use super::{StoreError, Writer, write_text};
use crate::contact::{System, Tangent};
use crate::event::Rubbed;

impl Writer {
    /// Write an object; lists of objects are left out: they stand in tables of their own.
    pub fn report(&self, object: &Value) -> Result<(), StoreError> {
        write_object(&fresh_group(self.file(), "report")?, object)
    }
}

impl Writer {
    /// Write what friction came to, with its coefficients.
    pub(crate) fn friction(&self, system: &System, rubbed: &Rubbed) -> Result<(), StoreError> {
        let g = fresh_group(self.file(), "friction")?;
        let tangents = system.tangents().unwrap_or_default();
        let of = |get: &dyn Fn(&Tangent) -> f64| -> Vec<f64> {
            tangents.iter().map(|t| t.as_ref().map_or(0.0, get)).collect()
        };
        let (work, path): (Vec<f64>, Vec<f64>) = rubbed.points.iter().copied().unzip();
        let rows = [
            ("work", work),
            ("path", path),
            ("coefficient", of(&|t| t.coefficient)),
            ("surface", of(&|t| t.surface)),
        ];
        for (name, row) in rows {
            g.new_dataset_builder().with_data(&row).create(name)?;
        }
        let direction = Array2::from_shape_fn((tangents.len(), 2), |(i, c)| {
            tangents[i].as_ref().map_or(0.0, |t| t.direction[c])
        });
        g.new_dataset_builder().with_data(&direction).create("direction")?;
        Ok(())
    }
}

/// A group of that name and nothing in it: a run that was killed as it ended has left one, and goes on.
pub(super) fn fresh_group(file: &hdf5::File, name: &str) -> Result<Group, StoreError> {
    if file.link_exists(name) {
        file.unlink(name)?;
    }
    Ok(file.create_group(name)?)
}

fn write_object(g: &Group, object: &Value) -> Result<(), StoreError> {
    for (name, value) in object.as_object().into_iter().flatten() {
        match value {
            Value::Null => {}
            Value::Bool(yes) => g.new_attr::<bool>().create(name.as_str())?.write_scalar(yes)?,
            Value::Number(x) => match x.as_i64() {
                Some(whole) => g.new_attr::<i64>().create(name.as_str())?.write_scalar(&whole)?,
                None => scalar(g, name, x.as_f64().unwrap_or(f64::NAN))?,
            },
            Value::String(text) => write_text(g, name, text)?,
            Value::Array(list) => {
                let words: Option<Vec<&str>> = list.iter().map(Value::as_str).collect();
                if let Some(words) = words.filter(|w| !w.is_empty()) {
                    write_text(g, name, &words.join("\n"))?;
                    continue;
                }
                let numbers: Option<Vec<f64>> = list.iter().map(Value::as_f64).collect();
                if let Some(numbers) = numbers.filter(|n| !n.is_empty()) {
                    g.new_dataset_builder().with_data(&numbers).create(name.as_str())?;
                }
            }
            Value::Object(_) => write_object(&g.create_group(name)?, value)?,
        }
    }
    Ok(())
}
