//! The answers of all tasks as one table.

use serde_json::Value;

use super::{Folder, TaskState};
use crate::records::{Points, StudyTable};
use crate::store::{Raw, StoreError, entries, read_raw};

/// Numbers of an answer that tell what it took to find it: they depend on the machine, or on how often a task was interrupted.
const WORK: [&str; 10] = [
    "wall_s",
    "rhs_evaluations",
    "products",
    "phases",
    "newton_iterations",
    "resumed_from",
    "resumed",
    "factorisations",
    "steps",
    "rejected",
];

/// What comes first of a point.
const LEADING: [&str; 5] = ["branch", "index", "omega", "energy", "amplitude"];

/// A column of numbers, made where it is first met.
fn put(columns: &mut Vec<(String, Vec<f64>)>, rows: usize, (key, row): (&str, usize), x: f64) {
    let at = columns.iter().position(|c| c.0 == key).unwrap_or_else(|| {
        columns.push((key.to_owned(), vec![f64::NAN; rows]));
        columns.len() - 1
    });
    columns[at].1[row] = x;
}

/// The numbers in an answer: numbers as they are, yes and no as 1 and 0, a list by its length.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(x) => x.as_f64(),
        Value::Bool(b) => Some(f64::from(u8::from(*b))),
        Value::Array(list) => Some(list.len() as f64),
        _ => None,
    }
}

/// Gather what there is: every task has a row, whatever its state.
pub fn gather(folder: &Folder) -> Result<StudyTable, StoreError> {
    let tasks = folder.tasks();
    let (study, scene) = folder.texts();
    let mut table = StudyTable {
        name: folder.name().to_owned(),
        command: tasks.first().map_or(String::new(), |t| t.command[0].clone()),
        texts: [study.to_owned(), scene.to_owned()],
        varied: folder.varied().iter().map(|k| (k.clone(), vec![])).collect(),
        ..StudyTable::default()
    };
    for (row, task) in tasks.iter().enumerate() {
        table.ids.push(task.id.clone());
        for (varied, value) in table.varied.iter_mut().zip(&task.values) {
            varied.1.push(value.clone());
        }
        let state = task.state();
        table.states.push(state.name().to_owned());
        let TaskState::Done(done) = state else {
            table.messages.push(String::new());
            continue;
        };
        table.messages.push(done.message.clone());
        put(&mut table.work, tasks.len(), ("wall_s", row), done.wall_s);
        for (key, value) in done.answer.as_object().into_iter().flatten() {
            let Some(x) = number(value) else { continue };
            let of_work = WORK.contains(&key.as_str());
            let columns = if of_work { &mut table.work } else { &mut table.results };
            if key != "wall_s" {
                put(columns, tasks.len(), (key, row), x);
            }
        }
        if task.result().exists() {
            points_of(&task.result(), row, &mut table.points).map_err(|e| {
                let advice = "remove the file, and `signorini study run` computes it anew";
                StoreError::unusable(&task.result(), format!("{e}; {advice}"))
            })?;
        }
    }
    // whoever ended first is no order
    table.results.sort_by(|a, b| a.0.cmp(&b.0));
    table.work.sort_by(|a, b| a.0.cmp(&b.0));
    let rank = |name: &str| LEADING.iter().position(|l| *l == name).unwrap_or(LEADING.len());
    table.points.columns.sort_by(|a, b| (rank(&a.0), &a.0).cmp(&(rank(&b.0), &b.0)));
    Ok(table)
}

/// The points of a family, one a row.
fn points_of(file: &std::path::Path, task: usize, points: &mut Points) -> Result<(), StoreError> {
    if !entries(file, "")?.iter().any(|e| e.name == "backbone") {
        return Ok(());
    }
    let (mut columns, mut special) = (vec![], vec![]);
    for entry in entries(file, "backbone")? {
        if entry.shape.as_ref().is_none_or(|s| s.len() != 1) {
            continue;
        }
        let values: Vec<f64> = match read_raw(file, &format!("backbone/{}", entry.name))? {
            Raw::Float(a) => a.into_iter().collect(),
            Raw::Integer(a) => a.into_iter().map(|x| x as f64).collect(),
            Raw::Byte(a) => a.into_iter().map(f64::from).collect(),
            Raw::Words(words) if entry.name == "special" => {
                special = words;
                continue;
            }
            Raw::Flag(_) | Raw::Words(_) => continue,
        };
        columns.push((entry.name, values));
    }
    let before = points.task.len();
    let more = columns.iter().find(|c| c.0 == "omega").map_or(0, |c| c.1.len());
    points.task.extend(std::iter::repeat_n(task, more));
    for (name, values) in columns.into_iter().filter(|c| c.1.len() == more) {
        let at = points.columns.iter().position(|c| c.0 == name).unwrap_or_else(|| {
            points.columns.push((name, vec![f64::NAN; before]));
            points.columns.len() - 1
        });
        points.columns[at].1.extend(values);
    }
    let rows = points.task.len();
    points.special.extend(special);
    points.special.resize(rows, String::new());
    points.columns.iter_mut().for_each(|c| c.1.resize(rows, f64::NAN));
    Ok(())
}
