//! A study's results in one file.

use std::path::Path;

use hdf5::types::FixedAscii;

use super::describe::describe;
use super::form::write_version;
use super::output::Staged;
use super::{Outputs, StoreError, read_text, write_text};
use crate::records::StudyTable;

/// Letters of a word: Octave reads none but ASCII of a fixed length (the CSV has them as they are).
const LENGTH: usize = 256;

fn text(value: &str) -> Result<FixedAscii<LENGTH>, hdf5::Error> {
    let letter = |c: char| if c.is_ascii() && c != '\0' { c } else { '?' };
    let word: String = value.chars().map(letter).take(LENGTH - 1).collect();
    FixedAscii::from_ascii(&word).map_err(|_| hdf5::Error::from("text with a NUL"))
}

fn words(g: &hdf5::Group, name: &str, values: &[String]) -> Result<(), StoreError> {
    let values = values.iter().map(|v| text(v)).collect::<Result<Vec<_>, _>>()?;
    g.new_dataset_builder().with_data(&values).create(name)?;
    Ok(())
}

fn numbers(g: &hdf5::Group, columns: &[(String, Vec<f64>)]) -> Result<(), StoreError> {
    for (name, values) in columns {
        g.new_dataset_builder().with_data(values).create(name.as_str())?;
    }
    Ok(())
}

/// Write a table: `/study` (tasks: id, state, message; varied keys), `/results`, `/work` (a row for each task), `/points` (a row for each point of a family).
pub(crate) fn write_study(
    path: &Path,
    table: &StudyTable,
    outputs: &Outputs,
) -> Result<(), StoreError> {
    let mut staged = Staged::begin(outputs, path)?;
    let at = staged.at().to_owned();
    let write = || -> Result<(), StoreError> {
        let file = hdf5::File::create(&at)?;
        write_version(&file)?;
        write_text(&file, "title", &table.name)?;
        write_text(&file, "command", &table.command)?;
        write_text(&file, "study", &table.texts[0])?;
        write_text(&file, "scene", &table.texts[1])?;
        let g = file.create_group("study")?;
        words(&g, "id", &table.ids)?;
        words(&g, "state", &table.states)?;
        words(&g, "message", &table.messages)?;
        let varied = file.create_group("study/varied")?;
        for (k, (key, values)) in table.varied.iter().enumerate() {
            // a slash would be a group
            let name = key.replace('/', "|");
            match table.numbers(k) {
                Some(x) => {
                    varied.new_dataset_builder().with_data(&x).create(name.as_str()).map(drop)?
                }
                None => words(&varied, &name, values)?,
            }
        }
        numbers(&file.create_group("results")?, &table.results)?;
        numbers(&file.create_group("work")?, &table.work)?;
        let points = file.create_group("points")?;
        let task: Vec<i64> = table.points.task.iter().map(|&t| t as i64).collect();
        points.new_dataset_builder().with_data(&task).create("task")?;
        numbers(&points, &table.points.columns)?;
        words(&points, "special", &table.points.special)?;
        describe(&file)?;
        // the last word: a file without it is not whole
        write_text(&file, "status", "complete")?;
        file.flush()?;
        Ok(())
    };
    write().inspect_err(|_| staged.discard())?;
    staged.commit()
}

/// Whether a file is a table of the study of this name.
pub(crate) fn is_collected(path: &Path, name: &str) -> bool {
    let Ok(file) = hdf5::File::open(path) else { return false };
    file.group("study/varied").is_ok() && read_text(&file, "title").as_deref() == Some(name)
}
