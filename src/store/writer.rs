//! Writing a trajectory while it is computed.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::careful::reading;
use super::checkpoint;
use super::describe::describe;
use super::events::{Events, read_log};
use super::form::check_format;
use super::header::{WriterOptions, create_file};
use super::kept::Kept;
use super::mesh::size_of_mesh;
use super::output::{Staged, beside, check_room};
use super::row::Row;
use super::table::Resume;
use super::trajectory::Trajectory;
use super::{StoreError, write_text};
use crate::contact::System;
use crate::event::{Checkpoint, Grazing, Observer, Resumed, Sample, Switch};
use crate::records::Status;
use crate::scenario::Scene;

/// Tables are appended and flushed at least this often.
pub(super) const FLUSH_EVERY: Duration = Duration::from_secs(2);

/// Attribute of the fingerprint of what is integrated.
const PROBLEM: &str = "problem";

/// The open file of a run.
pub struct Writer {
    staged: Staged,
    file: hdf5::File,
    kept: Arc<Kept>,
    trajectory: Trajectory,
    events: Events,
    flushed: Instant,
    problem: u64,
    checkpoint: Option<Checkpoint>,
    /// When a checkpoint was last put on the disk.
    marked: Option<Instant>,
    /// Nobody looks at the file before it is whole.
    is_scratch: bool,
}

impl Writer {
    /// Create the file with everything that is known before the run; of each state it keeps `kept`.
    pub fn create(
        path: &Path,
        scene: &Scene,
        (system, kept): (&System, Kept),
        options: &WriterOptions,
    ) -> Result<Writer, StoreError> {
        let staged = Staged::begin(&options.outputs, path)?;
        // a file that could not even be begun is of no use, and an old one stands untouched
        Self::begin(staged, scene, (system, kept), options)
    }

    fn begin(
        staged: Staged,
        scene: &Scene,
        (system, kept): (&System, Kept),
        options: &WriterOptions,
    ) -> Result<Writer, StoreError> {
        let file = check_room(staged.at(), size_of_mesh(system))
            .and_then(|()| create_file(staged.at(), scene, system, options))
            .inspect_err(|_| staged.discard())?;
        let (n_c, rubs) = (system.n_contact(), system.tangents().is_some());
        let trajectory = Trajectory::create(&file, &kept, (n_c, rubs, !options.is_scratch))?;
        let events = Events::create(&file, n_c)?;
        if !options.is_scratch {
            describe(&file)?;
        }
        file.flush()?;
        Ok(Writer {
            staged,
            file,
            kept: Arc::new(kept),
            trajectory,
            events,
            flushed: Instant::now(),
            problem: 0,
            checkpoint: None,
            marked: None,
            is_scratch: options.is_scratch,
        })
    }

    /// From now on the run can be gone on with after an interruption, as long as `problem`, the fingerprint of what is integrated, is
    /// the same.
    pub(crate) fn keep_checkpoints(&mut self, problem: u64) -> Result<(), StoreError> {
        self.problem = problem;
        if problem != 0 {
            write_text(&self.file, PROBLEM, &format!("{problem:016x}"))?;
            self.file.flush()?;
        }
        Ok(())
    }

    /// The fingerprint of what was integrated, of a file that can be gone on with.
    pub(crate) fn problem_of(path: &Path) -> Option<u64> {
        let read = || Ok(super::read_text(&*hdf5::File::open(path)?, PROBLEM));
        u64::from_str_radix(&reading(path, read).ok()??, 16).ok()
    }

    /// Open the file of a run that was interrupted, at its checkpoint, and what the run needs to go on: with `lists`, all its switches and
    /// grazings, else their number.
    pub fn resume(
        path: &Path,
        scene: &Scene,
        system: &System,
        options: &WriterOptions,
        (problem, lists): (u64, bool),
    ) -> Result<(Writer, Resumed), StoreError> {
        let mut staged = Staged::begin(&options.outputs.with_force(true), path)?;
        // a run over an old file was writing beside it
        match Self::unfinished(staged.path()) {
            Some(at) if at != staged.path() => staged.restart(),
            _ => staged.in_place(),
        }
        let at = staged.at().to_owned();
        let (checkpoint, of) = checkpoint::read(&at)?;
        let refuse = |why: &str| {
            StoreError::unusable(&at, format!("cannot be gone on with: {why}; --force starts anew"))
        };
        // a scheme of its own keeps its state in its own way
        let marches = system.impact().is_some_and(|law| law.march.is_some());
        if of != problem
            || (!marches && checkpoint.y.len() < 2 * system.n_o())
            || checkpoint.armed.len() != system.n_contact()
        {
            return Err(refuse("the scene, or a file that it names, has changed since"));
        }
        let opened = || -> Result<(Writer, Resumed), StoreError> {
            let file = hdf5::File::open_rw(&at)?;
            check_format(&at, &file)?;
            if super::read_text(&file, "scene").as_deref() != Some(&scene.source.text) {
                return Err(refuse("it was made from another scene"));
            }
            let [_, switches, grazings] = checkpoint.rows;
            // what a run that was left in order has behind its checkpoint comes again, to the last bit: nothing is lost if it is left again before
            let was_left = super::read_text(&file, "status");
            let keeps = was_left.is_some_and(|s| s == Status::Interrupted.to_string());
            let [of_states, of_switches, of_grazings] =
                checkpoint.rows.map(|rows| Resume { rows, keeps });
            let kept = Arc::new(Kept::of_run(scene, system));
            let trajectory = Trajectory::reopen(&file, &kept, of_states)?;
            write_text(&file, "status", &Status::Running.to_string())?;
            let events = Events::reopen(&file, of_switches, of_grazings)?;
            let writer = Writer {
                kept,
                trajectory,
                events,
                flushed: Instant::now(),
                problem,
                checkpoint: Some(checkpoint.clone()),
                marked: None,
                is_scratch: options.is_scratch,
                file: file.clone(),
                staged,
            };
            let log = read_log(&file, system, (switches, grazings), lists)?;
            let resumed = Resumed { log, checkpoint: checkpoint.clone() };
            Ok((writer, resumed))
        };
        reading(&at, opened)
    }

    /// Whether there is a run at `path` that can be gone on with.
    pub(crate) fn is_interrupted(path: &Path) -> bool {
        Self::unfinished(&path.canonicalize().unwrap_or_else(|_| path.to_owned())).is_some()
    }

    /// The file of that run: beside an old one, or at its place. A kill between the end of a run and the end of its program leaves a checkpoint without its file,
    /// or beside one that is whole: that is no run to go on with.
    fn unfinished(path: &Path) -> Option<PathBuf> {
        let beside = beside(path, ".part");
        let is_begun = |p: &Path| p.exists() && checkpoint::name_of(p).exists();
        if is_begun(&beside) {
            return Some(beside);
        }
        let status = || Ok(super::read_text(&*hdf5::File::open(path)?, "status"));
        let is_whole =
            || reading(path, status).is_ok_and(|s| s == Some(Status::Complete.to_string()));
        (is_begun(path) && !is_whole()).then(|| path.to_owned())
    }

    /// Take away the checkpoints that a kill left beside a file that is whole.
    pub(crate) fn tidy(path: &Path) {
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if Self::unfinished(&path).is_none() {
            for at in [beside(&path, ".part"), path] {
                // what is not there need not go
                let _ = std::fs::remove_file(checkpoint::name_of(&at));
            }
        }
    }

    /// The file as it is named now: beside an old one until it is whole.
    pub fn at(&self) -> &Path {
        self.staged.at()
    }

    /// The file, for what else belongs into it.
    pub(super) fn file(&self) -> &hdf5::File {
        &self.file
    }

    /// What it keeps of a state.
    pub(super) fn kept(&self) -> &Arc<Kept> {
        &self.kept
    }

    /// Store a state.
    pub(super) fn store(&mut self, row: &Row) -> Result<(), StoreError> {
        if self.kept.single && !row.is_single() {
            let what = "a number is too large for single precision; run the scene with precision = \"double\"";
            return Err(StoreError::unusable(self.staged.at(), what));
        }
        self.trajectory.push(row);
        if self.trajectory.is_full() { self.flush() } else { Ok(()) }
    }

    /// Append and flush all rows that wait.
    pub(super) fn flush(&mut self) -> Result<(), StoreError> {
        let waiting = self.trajectory.waiting_bytes() + self.events.waiting_bytes();
        check_room(self.staged.at(), waiting)?;
        self.trajectory.append()?;
        self.events.append()?;
        if !self.is_scratch {
            self.file.flush()?;
        }
        self.flushed = Instant::now();
        // a large state is not written at every switch: what lies behind a checkpoint is computed again
        let is_due = self.marked.is_none_or(|at| at.elapsed() >= FLUSH_EVERY);
        match &self.checkpoint {
            Some(c) if is_due => {
                self.marked = Some(Instant::now());
                checkpoint::write(self.staged.at(), self.problem, c)
            }
            _ => Ok(()),
        }
    }

    /// Give the file up: nothing of it is worth keeping.
    pub(crate) fn discard(self) {
        let Writer { staged, file, .. } = self;
        drop(file);
        staged.discard();
    }

    /// Write what waits and the final status.
    pub(crate) fn finish(mut self, status: &Status) -> Result<(), StoreError> {
        self.flush()?;
        if !self.is_scratch {
            describe(&self.file)?;
        }
        write_text(&self.file, "status", &status.to_string())?;
        self.file.flush()?;
        let Writer { mut staged, file, checkpoint, problem, .. } = self;
        drop(file);
        let (old, name) = (checkpoint::name_of(staged.at()), checkpoint::name_of(staged.path()));
        let kept = checkpoint.filter(|_| *status == Status::Interrupted);
        // in this order there is no moment in which an interrupted file has no checkpoint
        if let Some(c) = &kept {
            checkpoint::write(staged.path(), problem, c)?;
        }
        staged.commit()?;
        if kept.is_none() || old != name {
            let _ = std::fs::remove_file(old);
        }
        if kept.is_none() {
            let _ = std::fs::remove_file(name);
        }
        Ok(())
    }
}

impl Observer for Writer {
    type Error = StoreError;

    fn sample(&mut self, s: &Sample) -> Result<(), StoreError> {
        self.store(&Row::of(&self.kept, s))
    }

    fn switch(&mut self, s: &Switch) -> Result<(), StoreError> {
        self.events.switch(s);
        Ok(())
    }

    fn grazing(&mut self, g: &Grazing) -> Result<(), StoreError> {
        self.events.grazing(g);
        Ok(())
    }

    fn progress(&mut self, _: f64) -> Result<ControlFlow<()>, StoreError> {
        if self.flushed.elapsed() >= FLUSH_EVERY {
            self.flush()?;
        }
        Ok(ControlFlow::Continue(()))
    }

    fn takes_accelerations(&self) -> bool {
        self.kept.takes_accelerations()
    }

    fn keeps_checkpoints(&self) -> bool {
        self.problem != 0
    }

    fn phase(&mut self, checkpoint: Checkpoint) {
        self.checkpoint = Some(checkpoint);
    }
}
