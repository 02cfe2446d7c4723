//! How far a study is.

use serde_json::{Value, json};

use signorini::study::{Folder, State, TaskPlace};

use super::{Answer, CliError, Global, Which, object, slurm};

/// States in the order in which they are told.
const STATES: [&str; 5] = ["done", "failed", "running", "interrupted", "waiting"];
/// Failures that are told one by one.
const TOLD: usize = 10;

/// Tell how far every task is.
pub fn run(which: &Which, global: &Global) -> Result<Answer, CliError> {
    let folder = which.open()?;
    let queued = slurm::queue(&folder);
    let (json, text) = told(&folder, &queued);
    Ok(global.answer(|| json, || text))
}

/// The same at the end of a run; failures are the command's.
pub fn conclude(folder: &Folder, global: &Global) -> Result<Answer, CliError> {
    let (json, text) = told(folder, &[]);
    let count = |state: &str| json["counts"][state].as_u64().unwrap_or(0);
    let (failed, open) = (count("failed"), count("interrupted") + count("waiting"));
    let answer = global.answer(|| json.clone(), || text);
    Ok(match (failed, open) {
        (0, 0) => answer,
        (0, n) => answer.failed(format!(
            "{n} tasks have no answer: they were killed; go on with the same command"
        )),
        (n, _) => answer.failed(format!(
            "{n} tasks failed; the others are whole, and `signorini study collect` takes them together"
        )),
    })
}

fn told(folder: &Folder, queued: &[slurm::Queued]) -> (Value, String) {
    let tasks: Vec<(TaskPlace, State)> =
        folder.tasks().into_iter().map(|t| (t.clone(), t.state())).collect();
    let count = |name: &str| tasks.iter().filter(|(_, s)| s.name() == name).count();
    let counts: serde_json::Map<String, Value> =
        STATES.iter().map(|s| ((*s).to_owned(), count(s).into())).collect();
    let seconds: Vec<f64> = tasks
        .iter()
        .filter_map(|(_, s)| match s {
            State::Done(done) => Some(done.wall_s),
            _ => None,
        })
        .collect();
    let mean = seconds.iter().sum::<f64>() / seconds.len().max(1) as f64;
    let objects: Vec<Value> = tasks.iter().map(|(t, s)| object(t, s)).collect();
    let mut json = json!({
        "study": folder.name(), "folder": folder.root().display().to_string(),
        "counts": counts, "mean_s": mean, "tasks": objects,
    });
    let mut text = format!(
        "{}: {} in {}\n",
        folder.name(),
        super::tasks(tasks.len()),
        folder.root().display()
    );
    for state in STATES.iter().filter(|s| count(s) > 0) {
        text += &format!("  {state:<14}{}\n", count(state));
    }
    if !seconds.is_empty() {
        text += &format!("  {:<14}{mean:.1} s a task\n", "time");
    }
    if !queued.is_empty() {
        json["queued"] = queued.iter().map(slurm::Queued::object).collect();
        text += &format!(
            "  {:<14}{} in the queue of Slurm ({})\n",
            "slurm",
            super::tasks(queued.len()),
            slurm::words(queued)
        );
    }
    let failed = tasks.iter().filter_map(|(t, s)| match s {
        State::Done(done) if done.exit_code != 0 => Some((t, done)),
        _ => None,
    });
    for (task, done) in failed.clone().take(TOLD) {
        let first = done.message.lines().next().unwrap_or_default();
        text += &format!("  task {} ({}) failed: {first}\n", task.index, task.describe());
    }
    if failed.clone().count() > TOLD {
        text += &format!("  … and {} more (--json tells all)\n", failed.count() - TOLD);
    }
    (json, text)
}
