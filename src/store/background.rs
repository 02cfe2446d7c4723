//! A writer on a thread of its own: compressing and writing do not hold up the flow.
//!
//! What a run reports is copied and sent, in its order; the queue is short, so that memory stays bounded where the disk is slower than the flow. A failure of
//! the writer reaches the run at its next report.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Instant;

use super::StoreError;
use super::kept::Kept;
use super::row::Row;
use super::writer::{FLUSH_EVERY, Writer};
use crate::event::{Checkpoint, Grazing, Observer, Sample, Switch};

/// Memory for reports that wait, in numbers, and the most of them.
const MEMORY: usize = 8_000_000;
const LONGEST: usize = 256;
/// Numbers of a checkpoint that is copied in next to no time.
const LARGE: usize = 100_000;

/// A report of a run.
enum Entry {
    Sample(Box<Row>),
    Switch(Switch),
    Grazing(Grazing),
    Phase(Box<Checkpoint>),
    Progress(f64),
}

/// A writer with its thread.
pub struct Background {
    /// None once the writer has failed.
    queue: Option<SyncSender<Entry>>,
    worker: Option<JoinHandle<Result<Writer, StoreError>>>,
    at: PathBuf,
    kept: Arc<Kept>,
    keeps_checkpoints: bool,
    /// When a large checkpoint was last sent.
    marked: Option<Instant>,
}

fn work(mut writer: Writer, queue: &Receiver<Entry>) -> Result<Writer, StoreError> {
    for entry in queue {
        match entry {
            Entry::Sample(row) => writer.store(&row)?,
            Entry::Switch(s) => writer.switch(&s)?,
            Entry::Grazing(g) => writer.grazing(&g)?,
            Entry::Phase(checkpoint) => writer.phase(*checkpoint),
            Entry::Progress(t) => {
                let _ = writer.progress(t)?;
            }
        }
    }
    Ok(writer)
}

impl Background {
    /// Start the thread.
    pub fn new(writer: Writer) -> Background {
        let kept = writer.kept().clone();
        let length = (MEMORY / (2 * kept.len().max(1))).clamp(2, LONGEST);
        let (queue, entries) = sync_channel(length);
        let (at, keeps_checkpoints) = (writer.at().to_owned(), writer.keeps_checkpoints());
        let worker = std::thread::spawn(move || work(writer, &entries));
        let (queue, worker) = (Some(queue), Some(worker));
        Background { queue, worker, at, kept, keeps_checkpoints, marked: None }
    }

    /// The file as it is named now.
    pub fn at(&self) -> &std::path::Path {
        &self.at
    }

    /// Wait until all is written; the writer.
    pub fn end(mut self) -> Result<Writer, StoreError> {
        self.join()
    }

    fn join(&mut self) -> Result<Writer, StoreError> {
        self.queue = None;
        let gone = || StoreError::unusable(&self.at, "its writer ended early");
        match self.worker.take().ok_or_else(gone)?.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }

    fn send(&mut self, entry: Entry) -> Result<(), StoreError> {
        let sent = self.queue.as_ref().is_some_and(|q| q.send(entry).is_ok());
        // the writer leaves its queue only when it has failed
        if sent { Ok(()) } else { self.join().map(|_| ()) }
    }
}

impl Observer for Background {
    type Error = StoreError;

    fn sample(&mut self, s: &Sample) -> Result<(), StoreError> {
        self.send(Entry::Sample(Box::new(Row::of(&self.kept, s))))
    }

    fn switch(&mut self, s: &Switch) -> Result<(), StoreError> {
        self.send(Entry::Switch(s.clone()))
    }

    fn grazing(&mut self, g: &Grazing) -> Result<(), StoreError> {
        self.send(Entry::Grazing(g.clone()))
    }

    fn progress(&mut self, t: f64) -> Result<ControlFlow<()>, StoreError> {
        self.send(Entry::Progress(t))?;
        Ok(ControlFlow::Continue(()))
    }

    fn sees_contact_alone(&self) -> bool {
        self.kept.contact_alone
    }

    fn takes_accelerations(&self) -> bool {
        self.kept.takes_accelerations()
    }

    fn keeps_checkpoints(&self) -> bool {
        // the writer keeps one in so much time, and a large one is not copied for nothing
        self.keeps_checkpoints && self.marked.is_none_or(|at| at.elapsed() >= FLUSH_EVERY)
    }

    fn phase(&mut self, checkpoint: Checkpoint) {
        self.marked = (checkpoint.y.len() > LARGE).then(Instant::now);
        // a writer that has failed says so at the next report
        let _ = self.queue.as_ref().map(|q| q.send(Entry::Phase(Box::new(checkpoint))));
    }
}
