//! Which study a step is about, who carries its tasks out, and what they are called.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use signorini::study::{Done, Folder, Study, StudyError, Task, TaskPlace, TaskState, VERSION};

use crate::cli::CliError;

/// How many tasks, in words.
pub(super) fn tasks(count: usize) -> String {
    format!("{count} {}", if count == 1 { "task" } else { "tasks" })
}

/// A study, by its file or its folder.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  signorini study status gaps.toml")]
pub struct Which {
    /// The study (TOML), or its folder
    pub(super) study: PathBuf,
    /// The folder, where it is not NAME.study in this folder
    #[arg(short, long, value_name = "FOLDER")]
    pub(super) output: Option<PathBuf>,
}

/// Who carries the tasks out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Engine {
    /// Processes on this machine
    Local,
    /// A job array of an existing Slurm, one task one array index
    Slurm,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini study run gaps.toml\n  signorini study run gaps.toml --workers 4\n  signorini study run gaps.toml --engine slurm --sbatch=--time=2:00:00 --at-once 20\n  signorini study run gaps.toml --print-tasks | parallel"
)]
pub(super) struct Run {
    #[command(flatten)]
    pub(super) which: Which,
    /// Who carries the tasks out
    #[arg(long, value_enum, default_value = "local")]
    pub(super) engine: Engine,
    /// Tasks at a time on this machine [default: as many as there are cores; each works on one, or on --threads]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) workers: Option<u16>,
    /// An option of sbatch, passed through (can be given more than once)
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub(super) sbatch: Vec<String>,
    /// With slurm: at most so many tasks of the array at a time
    #[arg(long, value_name = "N")]
    pub(super) at_once: Option<u32>,
    /// With slurm: wait until the whole array has ended
    #[arg(long)]
    pub(super) wait: bool,
    /// Carry failed tasks out anew
    #[arg(long)]
    pub(super) retry: bool,
    /// Carry tasks out anew whose answer is of another version of signorini
    #[arg(long)]
    pub(super) outdated: bool,
    /// Print the command of every task that is neither done nor failed (--retry: nor done), one a line, and do nothing else (for GNU parallel, Snakemake, a job script)
    #[arg(long)]
    pub(super) print_tasks: bool,
}

impl From<StudyError> for CliError {
    fn from(e: StudyError) -> Self {
        match e {
            StudyError::Store(e) => e.into(),
            e @ StudyError::Unusable { .. } => CliError::Input(e.to_string()),
        }
    }
}

impl Which {
    /// The folder of the study.
    pub(super) fn root(&self) -> PathBuf {
        match &self.output {
            Some(folder) => folder.clone(),
            None if self.study.is_dir() => self.study.clone(),
            None => {
                let stem = self.study.file_stem().unwrap_or_default().to_string_lossy();
                PathBuf::from(format!("{stem}.study"))
            }
        }
    }

    /// The folder as `study run` left it; a study that has changed since is refused.
    pub(super) fn open(&self) -> Result<Folder, CliError> {
        let folder = Folder::open(&self.root())?;
        if !self.study.is_dir() {
            let (_, tasks) = self.asked()?;
            if !folder.is_of(&tasks) {
                return Err(CliError::Input(format!(
                    "{} holds something else than {} asks for: the study, its scene or a file has changed. `signorini study run` does what is missing (what is done is found again); give the folder itself to see it as it is",
                    folder.root().display(),
                    self.study.display()
                )));
            }
        }
        Ok(folder)
    }

    /// What the study asks for.
    pub(super) fn asked(&self) -> Result<(Study, Vec<Task>), CliError> {
        if !self.study.exists() {
            let text = format!(
                "there is no study {}; give a TOML file with scene, command and [vary], or its folder",
                self.study.display()
            );
            return Err(CliError::Input(text));
        }
        let study = Study::read(&self.study)?;
        let tasks = study.tasks(&self.root().join("tasks"))?;
        Ok((study, tasks))
    }
}

/// How many answers are of another version of this program, and of which; nothing where none is.
pub(super) fn outdated(folder: &Folder) -> Option<String> {
    let of_others = folder.tasks().into_iter().filter_map(|t| t.done()).filter(Done::is_outdated);
    let versions: Vec<String> = of_others.map(|d| d.version).collect();
    let mut names: Vec<&str> = versions.iter().map(String::as_str).collect();
    names.sort_unstable();
    names.dedup();
    names.iter_mut().filter(|n| n.is_empty()).for_each(|n| *n = "of an earlier version");
    let count = versions.len();
    let verb = if count == 1 { "has its answer" } else { "have their answers" };
    (count > 0).then(|| {
        format!("{} {verb} from signorini {}, this is {VERSION}", tasks(count), names.join(", "))
    })
}

/// The command that carries out a task, whoever calls it and wherever.
pub(super) fn task_command(root: &Path, id: &str) -> Result<Vec<String>, CliError> {
    let other = |e: std::io::Error| CliError::Other(format!("finding this program: {e}"));
    let program = std::env::current_exe().map_err(other)?;
    let root = std::path::absolute(root).map_err(other)?;
    let mut command = vec![program.display().to_string()];
    // called from Python, the program is its interpreter
    if program.file_stem().is_some_and(|n| n.to_string_lossy().starts_with("python")) {
        command.extend(["-m".into(), "signorini".into()]);
    }
    command.extend(["study", "task"].map(String::from));
    command.extend([root.display().to_string(), id.to_owned()]);
    Ok(command)
}

/// Words as a shell reads them.
pub(super) fn words(command: &[String]) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    let word = |w: &String| match !w.is_empty() && w.chars().all(is_plain) {
        true => w.clone(),
        false => format!("'{}'", w.replace('\'', "'\\''")),
    };
    command.iter().map(word).collect::<Vec<_>>().join(" ")
}

/// A task and its state as an object.
pub(super) fn object(task: &TaskPlace, state: &TaskState) -> Value {
    let values: serde_json::Map<String, Value> =
        task.varied.iter().zip(&task.values).map(|(k, v)| (k.clone(), v.clone().into())).collect();
    let mut object = json!({
        "index": task.index, "id": task.id, "values": values, "state": state.name(),
        "folder": task.file("").display().to_string(),
    });
    if let TaskState::Done(done) = state {
        object["wall_s"] = done.wall_s.into();
        object["version"] = done.version.clone().into();
        if done.exit_code != 0 {
            object["message"] = done.message.clone().into();
        }
    }
    object
}
