//! How far a study is.

use serde_json::{Value, json};

use signorini::study::{Folder, TaskPlace, TaskState};

use super::slurm;
use super::which::{self, Which, object};
use crate::cli::{Answer, CliError, Global};

/// States in the order in which they are told.
const STATES: [&str; 5] = ["done", "failed", "running", "interrupted", "waiting"];
/// Failures that are told one by one.
const TOLD: usize = 10;

/// Tell how far every task is.
pub fn run(which: &Which, global: &Global) -> Result<Answer, CliError> {
    let folder = which.open()?;
    let (queued, silent) = match slurm::queue(&folder) {
        Ok(queued) => (queued, None),
        Err(why) => (vec![], Some(why)),
    };
    let (mut json, mut text) = told(&folder, &queued);
    if let Some(why) = silent {
        json["queue_unknown"] = why.to_string().into();
        text += &format!("  {:<14}does not tell what is in its queue ({why})\n", "slurm");
    }
    Ok(global.answer(|| json, || text))
}

/// The same at the end of a run; failures are the command's.
pub(crate) fn conclude(folder: &Folder, global: &Global) -> Result<Answer, CliError> {
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
    let tasks: Vec<(TaskPlace, TaskState)> =
        folder.tasks().into_iter().map(|t| (t.clone(), t.state())).collect();
    let count = |name: &str| tasks.iter().filter(|(_, s)| s.name() == name).count();
    let counts: serde_json::Map<String, Value> =
        STATES.iter().map(|s| ((*s).to_owned(), count(s).into())).collect();
    let seconds: Vec<f64> = tasks
        .iter()
        .filter_map(|(_, s)| match s {
            TaskState::Done(done) => Some(done.wall_s),
            _ => None,
        })
        .collect();
    let mean = seconds.iter().sum::<f64>() / seconds.len().max(1) as f64;
    let objects: Vec<Value> = tasks.iter().map(|(t, s)| object(t, s)).collect();
    let is_outdated = |s: &TaskState| matches!(s, TaskState::Done(done) if done.is_outdated());
    let outdated = tasks.iter().filter(|(_, s)| is_outdated(s)).count();
    let mut json = json!({
        "study": folder.name(), "folder": folder.root().display().to_string(),
        "counts": counts, "outdated": outdated, "mean_s": mean, "tasks": objects,
    });
    let mut text = format!(
        "{}: {} in {}\n",
        folder.name(),
        which::tasks(tasks.len()),
        folder.root().display()
    );
    for state in STATES.iter().filter(|s| count(s) > 0) {
        text += &format!("  {state:<14}{}\n", count(state));
    }
    if !seconds.is_empty() {
        let mean = if mean < 0.05 { "less than 0.1".into() } else { format!("{mean:.1}") };
        text += &format!("  {:<14}{mean} s a task\n", "time");
    }
    if let Some(said) = which::outdated(folder) {
        text +=
            &format!("  {:<14}{said} (`study run --outdated` carries them out anew)\n", "outdated");
    }
    if !queued.is_empty() {
        json["queued"] = queued.iter().map(slurm::Queued::object).collect();
        text += &format!(
            "  {:<14}{} in the queue of Slurm ({})\n",
            "slurm",
            which::tasks(queued.len()),
            slurm::words(queued)
        );
    }
    let failed = tasks.iter().filter_map(|(t, s)| match s {
        TaskState::Done(done) if done.exit_code != 0 => Some((t, done)),
        _ => None,
    });
    // tasks of one cause together, in the order of the first of each
    let mut causes: Vec<(String, Vec<&TaskPlace>)> = vec![];
    for (task, done) in failed {
        let cause = cause(task, &done.message);
        match causes.iter_mut().find(|c| c.0 == cause) {
            Some(known) => known.1.push(task),
            None => causes.push((cause, vec![task])),
        }
    }
    for (cause, of) in causes.iter().take(TOLD) {
        text += &match of[..] {
            [task] => format!("  task {} ({}) failed: {cause}\n", task.index, task.describe()),
            _ => format!("  {} failed ({}): {cause}\n", which::tasks(of.len()), numbers(of)),
        };
    }
    if causes.len() > TOLD {
        let more: usize = causes[TOLD..].iter().map(|c| c.1.len()).sum();
        text += &format!("  … and {more} more (--json tells all)\n");
    }
    (json, text)
}

/// Why a task failed, in a line, without the way to its folder, which is another for each.
fn cause(task: &TaskPlace, message: &str) -> String {
    let mut line = message.lines().next().unwrap_or_default().to_owned();
    let folder = format!("tasks/{}/", task.id);
    while let Some(at) = line.find(&folder) {
        let begin = line[..at].rfind(char::is_whitespace).map_or(0, |k| k + 1);
        line.replace_range(begin..at + folder.len(), "");
    }
    line
}

/// The numbers of the first tasks of a list.
fn numbers(tasks: &[&TaskPlace]) -> String {
    const MOST: usize = 6;
    let more = if tasks.len() > MOST { ", …" } else { "" };
    let first: Vec<String> = tasks.iter().take(MOST).map(|t| t.index.to_string()).collect();
    format!("{}{more}", first.join(", "))
}
