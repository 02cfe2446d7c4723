//! The folder of a study: what is asked for, and how far each task is.
//!
//! ```text
//! NAME.study/study.json          version, text of the study, tasks in their order
//! NAME.study/tasks/ID/scene.toml the scene of a task
//!                     task.json  its command and values
//!                     result.h5  what its command writes
//!                     done.json  its answer and exit code, written last
//!                     messages   standard error of all attempts
//!                     lock       held while somebody carries it out; gone with the process, however it ends
//! ```

use std::fs::{File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use super::{Study, Task};
use crate::store::{StoreError, replace};

/// A folder that cannot be used.
#[derive(Debug, Error)]
pub enum StudyError {
    /// Not a folder of a study.
    #[error("{}: {why}", path.display())]
    Unusable {
        /// The folder, or the file in it.
        path: PathBuf,
        /// What is wrong, and what to do.
        why: String,
    },
    /// Writing failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}

fn unusable(path: &Path, why: impl Into<String>) -> StudyError {
    StudyError::Unusable { path: path.to_owned(), why: why.into() }
}

/// What the folder says of its study.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Manifest {
    signorini_version: String,
    name: String,
    /// The study's file.
    file: PathBuf,
    study: String,
    scene: String,
    varied: Vec<String>,
    tasks: Vec<Entry>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Entry {
    id: String,
    /// Place in the study.
    index: usize,
    varied: Vec<String>,
    values: Vec<String>,
    command: Vec<String>,
}

/// A study on disk.
#[derive(Debug, Clone)]
pub struct Folder {
    root: PathBuf,
    manifest: Manifest,
}

/// Where a task stands.
#[derive(Debug, Clone)]
pub struct TaskPlace {
    /// Its place in the study.
    pub index: usize,
    /// Name of its folder.
    pub id: String,
    /// Keys that are varied.
    pub varied: Vec<String>,
    /// Their values.
    pub values: Vec<String>,
    /// The command and its options.
    pub command: Vec<String>,
    folder: PathBuf,
}

/// How a task ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// Name of the task.
    pub id: String,
    /// Exit code of its command.
    pub exit_code: u8,
    /// The object that the command prints with `--json`; nothing where it failed before.
    pub answer: Value,
    /// Why it failed; empty where it did not.
    pub message: String,
    /// Seconds of the last attempt.
    pub wall_s: f64,
    /// Version of the program that found it; empty where it did not say so.
    #[serde(default)]
    pub version: String,
}

impl Done {
    /// Whether another version of the program found it, whose numbers may be others.
    pub(crate) fn is_outdated(&self) -> bool {
        self.version != VERSION
    }
}

/// The version of this program.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// How far a task is.
#[derive(Debug, Clone, PartialEq)]
pub enum TaskState {
    /// Nobody has begun it.
    Waiting,
    /// Somebody carries it out.
    Running,
    /// Begun and not ended: it is gone on with by the next who takes it.
    Interrupted,
    /// It has an answer, of success or of failure.
    Done(Box<Done>),
}

impl TaskState {
    /// In a word.
    pub fn name(&self) -> &'static str {
        match self {
            TaskState::Waiting => "waiting",
            TaskState::Running => "running",
            TaskState::Interrupted => "interrupted",
            TaskState::Done(done) if done.exit_code == 0 => "done",
            TaskState::Done(_) => "failed",
        }
    }
}

/// The sole right to carry a task out.
#[derive(Debug)]
pub struct TaskLock {
    /// Holds the lock while it is open.
    _file: File,
}

const MANIFEST: &str = "study.json";

impl Folder {
    /// Write what a study asks for; tasks that are there already stay as they are.
    pub fn prepare(root: &Path, study: &Study, tasks: &[Task]) -> Result<Folder, StudyError> {
        let is_empty = |p: &Path| std::fs::read_dir(p).is_ok_and(|mut d| d.next().is_none());
        let is_ours = root.join(MANIFEST).exists() || root.join("tasks").is_dir();
        if root.exists() && !is_ours && !is_empty(root) {
            return Err(unusable(root, "is no folder of a study; give another one with -o"));
        }
        let file = std::path::absolute(&study.path).unwrap_or_else(|_| study.path.clone());
        // a study that was moved takes its folder with it
        if let Ok(before) = Folder::open(root)
            && let Ok(theirs) = before.manifest.file.canonicalize()
            && file.canonicalize().is_ok_and(|own| own != theirs)
        {
            let other = before.manifest.file.display();
            return Err(unusable(
                root,
                format!("belongs to the study {other}; give another folder with -o"),
            ));
        }
        let made = |path: &Path| {
            std::fs::create_dir_all(path).map_err(|e| StudyError::from(StoreError::write(path, e)))
        };
        made(&root.join("tasks"))?;
        for task in tasks {
            let folder = root.join("tasks").join(&task.id);
            made(&folder)?;
        }
        let varied: Vec<String> = study.vary.iter().map(|v| v.key.clone()).collect();
        let entry = |(index, t): (usize, &Task)| Entry {
            id: t.id.clone(),
            index,
            varied: varied.clone(),
            values: t.values.clone(),
            command: t.command.clone(),
        };
        let entries: Vec<Entry> = tasks.iter().enumerate().map(entry).collect();
        for (task, entry) in tasks.iter().zip(&entries) {
            let folder = root.join("tasks").join(&task.id);
            put(&folder.join("scene.toml"), &task.scene)?;
            let text = serde_json::to_string_pretty(entry);
            put(&folder.join("task.json"), &text.map_err(|e| unusable(root, e.to_string()))?)?;
        }
        let manifest = Manifest {
            signorini_version: VERSION.into(),
            name: study.stem(),
            study: study.text.clone(),
            scene: study.scene.source.text.clone(),
            file,
            varied,
            tasks: entries,
        };
        let text =
            serde_json::to_string_pretty(&manifest).map_err(|e| unusable(root, e.to_string()))?;
        put(&root.join(MANIFEST), &text)?;
        Ok(Folder { root: root.to_owned(), manifest })
    }

    /// The study of a folder.
    pub fn open(root: &Path) -> Result<Folder, StudyError> {
        let path = root.join(MANIFEST);
        let text = std::fs::read_to_string(&path).map_err(|e| {
            unusable(
                &path,
                format!("{e}; `signorini study run STUDY.toml` makes the folder of a study"),
            )
        })?;
        let manifest = serde_json::from_str(&text).map_err(|e| {
            unusable(&path, format!("{e}; `signorini study run STUDY.toml` writes it anew"))
        })?;
        Ok(Folder { root: root.to_owned(), manifest })
    }

    /// Where it is.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Name of the study.
    pub fn name(&self) -> &str {
        &self.manifest.name
    }

    /// The texts of the study and of its scene.
    pub fn texts(&self) -> (&str, &str) {
        (&self.manifest.study, &self.manifest.scene)
    }

    /// Keys that are varied.
    pub fn varied(&self) -> &[String] {
        &self.manifest.varied
    }

    /// All tasks.
    pub fn tasks(&self) -> Vec<TaskPlace> {
        self.manifest.tasks.iter().map(|e| TaskPlace::of(&self.root, e.clone())).collect()
    }

    /// Whether it holds what a study asks for now.
    pub(crate) fn is_of(&self, tasks: &[Task]) -> bool {
        let own = self.manifest.tasks.iter().map(|e| &e.id);
        own.eq(tasks.iter().map(|t| &t.id))
    }
}

/// Write a text, if it is not there already.
fn put(path: &Path, text: &str) -> Result<(), StudyError> {
    if std::fs::read(path).is_ok_and(|there| there == text.as_bytes()) {
        return Ok(());
    }
    Ok(replace(path, text.as_bytes())?)
}

impl TaskPlace {
    fn of(root: &Path, entry: Entry) -> TaskPlace {
        let Entry { id, index, varied, values, command } = entry;
        let folder = root.join("tasks").join(&id);
        TaskPlace { index, id, varied, values, command, folder }
    }

    /// A task of the study in a folder by its name, whatever else the study asks for by now.
    pub fn open(root: &Path, id: &str) -> Result<TaskPlace, StudyError> {
        let path = root.join("tasks").join(id).join("task.json");
        let is_name = !id.is_empty() && id.chars().all(|c| c.is_ascii_alphanumeric());
        let text = std::fs::read_to_string(&path).ok().filter(|_| is_name);
        let entry = text.and_then(|t| serde_json::from_str(&t).ok());
        let advice = "`signorini study run STUDY.toml` makes the tasks of a study";
        let why = || unusable(root, format!("there is no task {id} in this study; {advice}"));
        Ok(TaskPlace::of(root, entry.ok_or_else(why)?))
    }

    /// A file of the task.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// What its command writes.
    pub fn result(&self) -> PathBuf {
        self.file("result.h5")
    }

    /// What was varied, in words.
    pub(crate) fn describe(&self) -> String {
        let said = self.varied.iter().zip(&self.values).map(|(k, v)| format!("{k} = {v}"));
        said.collect::<Vec<_>>().join(", ")
    }

    /// Its answer, if it has one, and what belongs to it.
    pub fn done(&self) -> Option<Done> {
        let text = std::fs::read_to_string(self.file("done.json")).ok()?;
        let done: Done = serde_json::from_str(&text).ok()?;
        let is_whole = done.exit_code != 0 || self.result().exists();
        (done.id == self.id && is_whole).then_some(done)
    }

    /// Take away what an earlier attempt left.
    pub fn clear(&self) {
        for name in [
            "result.h5",
            "result.h5.part",
            "result.h5.journal",
            "result.h5.checkpoint",
            "result.h5.part.checkpoint",
        ] {
            // what is not there need not go
            let _ = std::fs::remove_file(self.file(name));
        }
    }

    /// Leave its answer.
    pub(crate) fn finish(&self, done: &Done) -> Result<(), StudyError> {
        let path = self.file("done.json");
        let text =
            serde_json::to_string_pretty(done).map_err(|e| unusable(&path, e.to_string()))?;
        Ok(replace(&path, text.as_bytes())?)
    }

    /// Forget its answer: it will be carried out anew.
    pub(crate) fn forget(&self) -> Result<(), StudyError> {
        let path = self.file("done.json");
        std::fs::remove_file(&path).map_err(|e| StoreError::write(&path, e).into())
    }

    /// How far it is.
    pub fn state(&self) -> TaskState {
        if let Some(done) = self.done() {
            return TaskState::Done(Box::new(done));
        }
        let lock = self.file("lock");
        let Ok(file) = OpenOptions::new().write(true).open(&lock) else {
            return TaskState::Waiting;
        };
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => TaskState::Running,
            // between the look at the answer and the look at the lock it may have ended
            _ => self.done().map_or(TaskState::Interrupted, |d| TaskState::Done(Box::new(d))),
        }
    }

    /// Take the right to carry it out; none while another has it.
    pub fn lock(&self) -> Result<Option<TaskLock>, StudyError> {
        let path = self.file("lock");
        let open = OpenOptions::new().create(true).truncate(false).write(true).open(&path);
        let file = open.map_err(|e| StudyError::from(StoreError::write(&path, e)))?;
        // who only asks how far it is holds the lock for a moment, too
        for _ in 0..20 {
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(10)),
                // a file system without locks
                Err(TryLockError::Error(_)) | Ok(()) => {
                    return Ok(Some(TaskLock { _file: file }));
                }
            }
        }
        Ok(None)
    }
}
