//! `signorini study`: many independent runs.

mod collect;
mod local;
mod slurm;
mod status;
mod task;
mod which;

use clap::{Args, Subcommand};
use serde_json::json;

use signorini::study::{Folder, TaskPlace, TaskState};

use super::{Answer, CliError, Global};
use which::{Engine, Run, Which, outdated, task_command, words};

/// Arguments of `study`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    step: Step,
}

#[derive(Debug, Subcommand)]
enum Step {
    /// Carry out every task that is not done: here in parallel, or as a job array of Slurm
    Run(Run),
    /// How far every task is
    Status(Which),
    /// What the tasks found, in one HDF5, tables and pictures
    Collect(collect::Collect),
    /// One task: what workers, job arrays and other schedulers call
    Task(task::One),
}

/// Carry out a step.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    match &arguments.step {
        Step::Run(run) => carry_out(run, global),
        Step::Status(which) => status::run(which, global),
        Step::Collect(collect) => collect::run(collect, global),
        Step::Task(one) => task::run(one, global),
    }
}

fn carry_out(run: &Run, global: &Global) -> Result<Answer, CliError> {
    if run.engine == Engine::Local && !(run.sbatch.is_empty() && run.at_once.is_none() && !run.wait)
    {
        let text = "--sbatch, --at-once and --wait belong to --engine slurm";
        return Err(CliError::Input(text.into()));
    }
    let folder = prepare(&run.which)?;
    for task in folder.tasks() {
        let Some(done) = task.done() else { continue };
        if run.outdated && done.is_outdated() {
            // whoever carries it out just now is of this version
            if let Some(_lock) = task.lock()? {
                task.forget()?;
                task.clear();
            }
        } else if run.retry && done.exit_code != 0 {
            task.forget()?;
        }
    }
    let open: Vec<TaskPlace> =
        folder.tasks().into_iter().filter(|t| !matches!(t.state(), TaskState::Done(_))).collect();
    if let Some(text) = outdated(&folder) {
        global.caller.warn(&format!("{text}; --outdated carries them out anew"));
    }
    if run.print_tasks {
        let lines: Result<Vec<String>, CliError> =
            open.iter().map(|t| Ok(words(&task_command(folder.root(), &t.id)?))).collect();
        let lines = lines?;
        let text = lines.iter().map(|l| format!("{l}\n")).collect::<String>();
        return Ok(match global.json {
            true => global.answer(|| json!({"tasks": lines}), String::new),
            false => Answer::text(text),
        });
    }
    match run.engine {
        Engine::Local => {
            local::work(&folder, open, run.workers, global)?;
            status::conclude(&folder, global)
        }
        Engine::Slurm => slurm::submit(&folder, &open, run, global),
    }
}

/// The folder with everything that a study asks for.
fn prepare(which: &Which) -> Result<Folder, CliError> {
    if which.study.is_dir() {
        return which.open();
    }
    let (study, tasks) = which.asked()?;
    tasks.iter().try_for_each(|t| task::check(&t.command))?;
    Ok(Folder::prepare(&which.root(), &study, &tasks)?)
}
