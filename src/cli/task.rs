//! A command that computes something of a scene into a file: it plans, it runs or goes on, it says what came of it.

use std::path::{Path, PathBuf};
use std::time::Instant;

use signorini::families::FamilyError;
use signorini::scenario::Scene;
use signorini::store::WriterOptions;

use super::family::writer_options;
use super::{Answer, CliError, Global};

/// What a task works with.
pub(crate) struct Work<'g> {
    pub global: &'g Global,
    pub scene: Scene,
    /// The file of the results.
    pub path: PathBuf,
    /// How files are written.
    pub options: WriterOptions,
    /// Whether an earlier run is gone on with.
    pub resume: bool,
    begun: Instant,
}

impl Work<'_> {
    /// Seconds since it began.
    pub fn wall(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// How a file is written again and again by one command: what stands in its place was looked at when the command began.
    pub fn options_again(&self) -> WriterOptions {
        let outputs = self.options.outputs.with_force(true);
        WriterOptions { outputs, ..self.options.clone() }
    }

    /// When it began.
    pub fn begun(&self) -> Instant {
        self.begun
    }
}

/// Where a task reads and writes.
pub(crate) struct Files<'a> {
    /// The scene.
    pub scene: &'a Path,
    /// Other files that are read, beside those that the scene names.
    pub read: Vec<&'a Path>,
    /// Whether files of signorini's may be overwritten.
    pub force: bool,
    /// Whether an earlier run is gone on with.
    pub resume: bool,
}

/// Refuse to go on with a file that was made from something else: from what, and whether it is the same.
pub(crate) fn check_same(path: &Path, all: &[(&str, bool)]) -> Result<(), CliError> {
    match all.iter().find(|(_, same)| !same) {
        None => Ok(()),
        Some((what, _)) => {
            let why = format!("it was made from {what}");
            Err(FamilyError::Another { path: path.to_owned(), why }.into())
        }
    }
}

/// A command that computes.
pub(crate) trait Task {
    /// What is asked for, checked.
    type Plan;
    /// What was computed.
    type Found;

    /// What it reads, and how it writes.
    fn files(&self) -> Files<'_>;

    /// The scene: the caller's, or the file that the arguments name.
    fn scene(&self, global: &Global) -> Result<Scene, CliError> {
        Ok(global.scene(self.files().scene)?)
    }

    /// The file of its results.
    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError>;

    /// From arguments and a scene to what is asked for; refuses what makes no sense. Nothing long is computed.
    fn plan(&self, work: &mut Work) -> Result<Self::Plan, CliError>;

    /// Compute, or go on where an earlier run stopped; what is found is in the file.
    fn carry_out(&self, work: &Work, plan: &mut Self::Plan) -> Result<Self::Found, CliError>;

    /// What there is to say.
    fn say(&self, work: &Work, plan: &Self::Plan, found: Self::Found) -> Result<Answer, CliError>;
}

/// Carry a task out from its arguments to its answer.
pub(crate) fn run<T: Task>(task: &T, global: &Global) -> Result<Answer, CliError> {
    let begun = Instant::now();
    let Files { read, force, resume, .. } = task.files();
    let scene = task.scene(global)?;
    let path = task.output(&scene)?;
    let options = writer_options(global, &scene, &path, (force, resume), &read)?;
    let mut work = Work { global, scene, path, options, resume, begun };
    let mut plan = task.plan(&mut work)?;
    let found = task.carry_out(&work, &mut plan)?;
    task.say(&work, &plan, found)
}
