//! One task of a study: an ordinary command with an ordinary file, in this process.

use std::panic::AssertUnwindSafe;
use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, Parser};
use serde_json::{Value, json};

use signorini::store::Writer;
use signorini::study::{Done, TaskPlace, VERSION};

use super::super::{Cli, Said, execute};
use super::which::object;
use crate::cli::{Answer, CliError, Global};

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini study task gaps.study 1f0c3a55d2b1e6a0\n\nDoes nothing if the task is done or somebody else carries it out."
)]
pub struct One {
    /// The folder of the study
    folder: PathBuf,
    /// The name of the task: that of its folder
    id: String,
}

/// Carry a task out, unless it is done or somebody else does.
pub fn run(one: &One, global: &Global) -> Result<Answer, CliError> {
    let task = TaskPlace::open(&one.folder, &one.id)?;
    let said = |what: &str| {
        let text = format!("task {} ({}): {what}\n", task.index, task.describe());
        global.answer(|| object(&task, &task.state()), || text)
    };
    let Some(_lock) = task.lock()? else {
        return Ok(said("somebody else carries it out"));
    };
    // between the look and the lock another may have ended it
    if task.done().is_some() {
        return Ok(said("is done already"));
    }
    let begun = Instant::now();
    let (exit_code, answer, message) = match attempt(&task, global) {
        Ok((answer, None)) => (0, answer, String::new()),
        Ok((answer, Some(why))) => (3, answer, why),
        // it is gone on with another time
        Err(e @ CliError::Interrupted(..)) => return Err(e),
        Err(e) => {
            let code = match &e {
                CliError::Scene(_) | CliError::Input(_) => 2,
                CliError::Numerics(_) => 3,
                _ => 1,
            };
            (code, Value::Null, e.text())
        }
    };
    let wall_s = begun.elapsed().as_secs_f64();
    let (id, version) = (task.id.clone(), VERSION.to_owned());
    let done = Done { id, exit_code, answer, message, wall_s, version };
    task.finish(&done)?;
    let answer = said(if exit_code == 0 { "done" } else { "failed" });
    Ok(match exit_code {
        0 => answer,
        _ => answer.failed(format!("task {}: {}", task.index, done.message)),
    })
}

/// What its command answers, and what its numerics failed at.
fn attempt(task: &TaskPlace, global: &Global) -> Result<(Value, Option<String>), CliError> {
    // what was begun is gone on with where it can be
    if begun_before(task) {
        match command(task, global, Some("--resume")) {
            // it was not what it seemed
            Err(CliError::Input(_)) => {}
            other => return other,
        }
    }
    task.clear();
    command(task, global, None)
}

/// Whether the options of a command are such.
pub fn check(command: &[String]) -> Result<(), CliError> {
    let words = ["signorini".to_owned(), command[0].clone(), "scene.toml".into()];
    let words = words.into_iter().chain(command[1..].iter().cloned());
    match Cli::try_parse_from(words.chain(["-o".into(), "result.h5".into()])) {
        Ok(_) => Ok(()),
        Err(e) if e.use_stderr() => {
            let text = e.to_string();
            let said = text.trim_start_matches("error: ").trim_end();
            Err(CliError::Input(format!("the options of the tasks: {said}")))
        }
        Err(_) => Err(CliError::Input("the options of the tasks ask for help".into())),
    }
}

/// Whether an earlier attempt left something to go on with.
fn begun_before(task: &TaskPlace) -> bool {
    let result = task.result();
    match task.command[0].as_str() {
        "run" => Writer::is_interrupted(&result),
        "backbone" | "response" => ["result.h5", "result.h5.part", "result.h5.journal"]
            .iter()
            .any(|name| task.file(name).exists()),
        _ => false,
    }
}

fn command(
    task: &TaskPlace,
    global: &Global,
    way: Option<&str>,
) -> Result<(Value, Option<String>), CliError> {
    let path = |p: PathBuf| p.display().to_string();
    let mut words = vec!["signorini".to_owned(), task.command[0].clone()];
    words.push(path(task.file("scene.toml")));
    words.extend(task.command[1..].iter().cloned());
    words.extend(["-o".into(), path(task.result()), "--json".into(), "--quiet".into()]);
    words.extend(way.map(String::from));
    let mut cli = Cli::try_parse_from(words)
        .map_err(|e| CliError::Input(e.to_string().trim_end().to_owned()))?;
    cli.global.threads = global.threads;
    cli.global.force_large = global.force_large;
    let answer = std::panic::catch_unwind(AssertUnwindSafe(|| execute(&cli)))
        .unwrap_or_else(|_| Err(CliError::Other("the command panicked; see messages".into())))?;
    let value = match answer.said {
        Said::Object(value) => value,
        Said::Text(text) => json!({"text": text}),
    };
    Ok((value, answer.failure))
}
