//! A writer on a thread of its own: compressing and writing do not hold up the flow.
//!
//! What a run reports is copied and sent, in its order; the queue is short, so that memory stays bounded where the disk is slower than the flow. A failure of
//! the writer reaches the run at its next report.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use super::StoreError;
use super::writer::Writer;
use crate::contact::ActiveSet;
use crate::event::{Checkpoint, Energies, Grazing, Observer, Sample, Switch};

/// Memory for reports that wait, in numbers, and the most of them.
const MEMORY: usize = 8_000_000;
const LONGEST: usize = 256;

/// A report of a run.
enum Entry {
    Sample(Box<Stored>),
    Switch(Switch),
    Grazing(Grazing),
    Phase(Box<Checkpoint>),
    Progress(f64),
}

/// A stored state of its own.
struct Stored {
    t: f64,
    u: Vec<f64>,
    v: Vec<f64>,
    active: ActiveSet,
    pressure: Vec<f64>,
    energies: Energies,
    jumps: f64,
}

/// A writer with its thread.
pub struct Background {
    /// None once the writer has failed.
    queue: Option<SyncSender<Entry>>,
    worker: Option<JoinHandle<Result<Writer, StoreError>>>,
    at: PathBuf,
    keeps_checkpoints: bool,
}

fn work(mut writer: Writer, queue: &Receiver<Entry>) -> Result<Writer, StoreError> {
    for entry in queue {
        match entry {
            Entry::Sample(s) => writer.sample(&Sample {
                t: s.t,
                u: &s.u,
                v: &s.v,
                active: &s.active,
                pressure: &s.pressure,
                energies: s.energies,
                jumps: s.jumps,
            })?,
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
    /// Start the thread; states have `n` displacements.
    pub fn new(writer: Writer, n: usize) -> Background {
        let length = (MEMORY / (2 * n.max(1))).clamp(2, LONGEST);
        let (queue, entries) = sync_channel(length);
        let (at, keeps_checkpoints) = (writer.at().to_owned(), writer.keeps_checkpoints());
        let worker = std::thread::spawn(move || work(writer, &entries));
        Background { queue: Some(queue), worker: Some(worker), at, keeps_checkpoints }
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
        self.send(Entry::Sample(Box::new(Stored {
            t: s.t,
            u: s.u.to_vec(),
            v: s.v.to_vec(),
            active: s.active.clone(),
            pressure: s.pressure.to_vec(),
            energies: s.energies,
            jumps: s.jumps,
        })))
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

    fn keeps_checkpoints(&self) -> bool {
        self.keeps_checkpoints
    }

    fn phase(&mut self, checkpoint: Checkpoint) {
        // a writer that has failed says so at the next report
        let _ = self.queue.as_ref().map(|q| q.send(Entry::Phase(Box::new(checkpoint))));
    }
}
