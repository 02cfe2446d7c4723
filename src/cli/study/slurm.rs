//! Tasks as a job array of Slurm: one task one array index.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use signorini::store::replace;
use signorini::study::{Folder, TaskPlace, TaskState};

use super::status;
use super::which::{self, Run, task_command, tasks};
use crate::cli::{Answer, CliError, Global};

/// An array that was submitted; `slurm/jobs.json` lists them.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Array {
    job: String,
    /// Index 1 is the first.
    tasks: Vec<String>,
}

/// A task in the queue.
#[derive(Debug, Clone)]
pub struct Queued {
    id: String,
    job: String,
    index: usize,
    state: String,
}

impl Queued {
    /// As an object.
    pub fn object(&self) -> Value {
        json!({"id": self.id, "job": self.job, "array_index": self.index, "state": self.state})
    }
}

/// Their states and how many are in each.
pub fn words(queued: &[Queued]) -> String {
    let states: BTreeSet<&str> = queued.iter().map(|q| q.state.as_str()).collect();
    let count = |s: &str| queued.iter().filter(|q| q.state == s).count();
    states
        .iter()
        .map(|s| format!("{} {}", count(s), s.to_lowercase()))
        .collect::<Vec<_>>()
        .join(", ")
}

fn arrays(folder: &Folder) -> Vec<Array> {
    let text = std::fs::read_to_string(folder.root().join("slurm/jobs.json")).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// What Slurm still has of the study; nothing where there is no Slurm. `Err`: it does not answer, so that nobody knows.
pub fn queue(folder: &Folder) -> Result<Vec<Queued>, String> {
    let mut all = vec![];
    for array in arrays(folder) {
        let asked =
            Command::new("squeue").args(["-h", "-r", "-o", "%K %T", "-j", &array.job]).output();
        let Ok(answer) = asked else { continue };
        let errors = String::from_utf8_lossy(&answer.stderr);
        // a job that is over is an error to squeue, too
        if !answer.status.success() && !errors.contains("Invalid job id") {
            return Err(errors.lines().last().unwrap_or("squeue failed").trim().to_owned());
        }
        for line in String::from_utf8_lossy(&answer.stdout).lines() {
            let Some((index, state)) = line.trim().split_once(' ') else { continue };
            let Ok(index) = index.parse::<usize>() else { continue };
            let Some(id) = index.checked_sub(1).and_then(|k| array.tasks.get(k)) else { continue };
            let (id, job, state) = (id.clone(), array.job.clone(), state.trim().to_owned());
            all.push(Queued { id, job, index, state });
        }
    }
    Ok(all)
}

/// Submit what is neither done nor in the queue.
pub(crate) fn submit(
    folder: &Folder,
    open: &[TaskPlace],
    run: &Run,
    global: &Global,
) -> Result<Answer, CliError> {
    // a task that may be in the queue is not submitted a second time
    let silent = |why| {
        let next = "nothing was submitted; try again when `squeue` answers";
        CliError::Other(format!("Slurm does not tell what is in its queue ({why}): {next}"))
    };
    let queued: BTreeSet<String> =
        queue(folder).map_err(silent)?.into_iter().map(|q| q.id).collect();
    let missing: Vec<&TaskPlace> = open
        .iter()
        .filter(|t| {
            !queued.contains(&t.id) && !matches!(t.state(), TaskState::Running | TaskState::Done(_))
        })
        .collect();
    let mut said = vec![];
    if !missing.is_empty() {
        let job = sbatch(folder, &missing, run, global)?;
        said.push(format!("submitted {} as job array {job}", tasks(missing.len())));
    }
    if !queued.is_empty() {
        said.push(format!("in the queue already: {}", tasks(queued.len())));
    }
    if run.wait {
        let begun = std::time::Instant::now();
        global.caller.watch();
        // a controller that is away for a while still has the array
        while queue(folder).map_or(true, |left| !left.is_empty()) {
            if let Some(signal) = global.caller.signal() {
                let text = "interrupted: the array goes on without this command; look with `signorini study status`";
                return Err(CliError::Interrupted(signal, text.into()));
            }
            // the queue of others is asked gently
            let pause = if begun.elapsed().as_secs() < 60 { 1 } else { 15 };
            std::thread::sleep(Duration::from_secs(pause));
        }
        return status::conclude(folder, global);
    }
    if said.is_empty() {
        said.push("every task is done".into());
    }
    let next = "look with `signorini study status`, and take the results together with `signorini study collect`";
    let submitted = missing.len();
    Ok(global.answer(
        || json!({"submitted": submitted, "queued": queued.len()}),
        || format!("{}\n  {next}\n", said.join("; ")),
    ))
}

fn write(path: &Path, text: &str) -> Result<(), CliError> {
    Ok(replace(path, text.as_bytes())?)
}

/// Write the script and hand it to Slurm; the number of the job.
fn sbatch(
    folder: &Folder,
    tasks: &[&TaskPlace],
    run: &Run,
    global: &Global,
) -> Result<String, CliError> {
    let place = std::path::absolute(folder.root())
        .map_err(|e| CliError::Other(e.to_string()))?
        .join("slurm");
    std::fs::create_dir_all(&place)
        .map_err(|e| CliError::Other(format!("{}: {e}", place.display())))?;
    let mut known = arrays(folder);
    let number = known.len() + 1;
    let (list, script) =
        (place.join(format!("tasks-{number}")), place.join(format!("array-{number}.sh")));
    let ids: Vec<String> = tasks.iter().map(|t| t.id.clone()).collect();
    write(&list, &format!("{}\n", ids.join("\n")))?;
    let command = task_command(folder.root(), "ID")?;
    let quoted = which::words(&command[..command.len() - 1]);
    let limit = run.at_once.map_or(String::new(), |n| format!("%{n}"));
    let threads = global.threads.unwrap_or(1);
    let text = format!(
        "#!/bin/sh\n\
         # tasks of the study {name}: index k carries out line k of {list}\n\
         #SBATCH --job-name={name}\n\
         #SBATCH --array=1-{count}{limit}\n\
         #SBATCH --cpus-per-task={threads}\n\
         #SBATCH --output=\"{out}\"\n\
         #SBATCH --open-mode=append\n\
         id=$(sed -n \"${{SLURM_ARRAY_TASK_ID}}p\" {list_word})\n\
         exec {quoted} \"$id\" --quiet --threads \"${{SLURM_CPUS_PER_TASK:-{threads}}}\"\n",
        name = folder.name().replace(char::is_whitespace, "-"),
        list = list.display(),
        list_word = which::words(&[list.display().to_string()]),
        count = ids.len(),
        out = place.join("%A_%a.out").display(),
    );
    write(&script, &text)?;
    let asked = Command::new("sbatch").arg("--parsable").args(&run.sbatch).arg(&script).output();
    let advice = "without Slurm: `--engine local`, or `--print-tasks` for another scheduler";
    let answer = asked.map_err(|e| CliError::Other(format!("sbatch: {e}; {advice}")))?;
    if !answer.status.success() {
        let why = String::from_utf8_lossy(&answer.stderr).trim().to_owned();
        return Err(CliError::Other(format!("sbatch refused {}: {why}", script.display())));
    }
    // JOB or JOB;CLUSTER
    let said = String::from_utf8_lossy(&answer.stdout).trim().to_owned();
    let job = said.split(';').next().unwrap_or(&said).to_owned();
    known.push(Array { job: job.clone(), tasks: ids });
    let text = serde_json::to_string_pretty(&known).map_err(|e| CliError::Other(e.to_string()))?;
    write(&place.join("jobs.json"), &text)?;
    Ok(job)
}
