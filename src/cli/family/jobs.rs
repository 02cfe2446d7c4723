//! Branches computed side by side into one file.

use std::panic::AssertUnwindSafe;
use std::sync::mpsc::{self, Receiver};

use rayon::prelude::*;

use signorini::contact::System;
use signorini::continuation::Go;
use signorini::families::{self, Asked, Known, Opened};
use signorini::records::{Branch, BranchEnd, Direction, PointRecord, Status};
use signorini::store::{FamilyWriter, StoreError, StoredFamily};

use crate::cli::progress::Bar;
use crate::cli::{CliError, Global};

/// What computes branches, and hands their points on: they count from the first of its branches.
type Compute<'a> = dyn Fn(&mut dyn FnMut(PointRecord) -> Go) -> Result<Vec<BranchEnd>, CliError>
    + Send
    + Sync
    + 'a;

/// A branch to compute, or several one after the other.
pub struct Job<'a> {
    /// How many.
    branches: usize,
    compute: Box<Compute<'a>>,
}

impl<'a> Job<'a> {
    /// So many branches that are next to each other in the file.
    pub fn new(
        branches: usize,
        compute: impl Fn(&mut dyn FnMut(PointRecord) -> Go) -> Result<Vec<BranchEnd>, CliError>
        + Send
        + Sync
        + 'a,
    ) -> Job<'a> {
        Job { branches, compute: Box::new(compute) }
    }
}

/// A family that is carried out.
pub struct Carried {
    /// All of it.
    pub stored: StoredFamily,
    /// How its branches ended.
    pub ends: Vec<BranchEnd>,
    /// Points of an earlier run.
    pub resumed: usize,
}

/// Carry out what is asked for: open the file, let `compute` write what is missing, show the progress, read the whole family.
pub(crate) fn carry_out(
    global: &Global,
    asked: &Asked,
    resume: bool,
    compute: impl FnOnce(FamilyWriter, &Known, Option<&Bar>) -> Result<Vec<BranchEnd>, CliError>,
) -> Result<Carried, CliError> {
    match families::open(asked, resume, |text| global.caller.warn(text))? {
        Opened::Whole(stored) => {
            let (ends, resumed) = (stored.ends.clone(), stored.points.len());
            Ok(Carried { stored: *stored, ends, resumed })
        }
        Opened::Writing(writer, known) => {
            global.caller.watch();
            let bar = Bar::new(global, asked.scene);
            let result = compute(*writer, &known, bar.as_ref());
            if let Some(bar) = &bar {
                bar.clear();
            }
            let ends = result?;
            Ok(Carried { stored: StoredFamily::read(asked.path)?, ends, resumed: known.len() })
        }
    }
}

/// Compute branches side by side; every point is written as soon as it is there. At the end the file has its status.
pub(crate) fn run_jobs(
    global: &Global,
    jobs: &[Job],
    mut writer: FamilyWriter,
    system: &System,
    range: (f64, f64),
    bar: Option<&Bar>,
) -> Result<Vec<BranchEnd>, CliError> {
    let (sender, receiver) = mpsc::sync_channel::<PointRecord>(64);
    // the threads of the command compute, one beside them writes: a thread that is started here would compute on those of the whole process
    let sizes = (writer.plan().branches.len(), range);
    let (ends, written) = std::thread::scope(|scope| {
        let (sender, writer) = (sender, &mut writer);
        let keeper = scope.spawn(move || write_all(receiver, writer, system, sizes, bar));
        let run = |(index, job): (usize, &Job)| {
            let sender = sender.clone();
            let before: usize = jobs[..index].iter().map(|j| j.branches).sum();
            let mut take = |mut point: PointRecord| {
                point.branch += before;
                match sender.send(point) {
                    Ok(()) if global.caller.signal().is_none() => Go::Continue(()),
                    _ => Go::Break(()),
                }
            };
            (job.compute)(&mut take)
        };
        let all = || jobs.par_iter().enumerate().map(&run).collect::<Vec<_>>();
        let ends = std::panic::catch_unwind(AssertUnwindSafe(all)).unwrap_or_default();
        drop(sender);
        (ends, keeper.join())
    });
    let written = written.unwrap_or_else(|_| {
        Err(StoreError::unusable(writer.path(), "writing ended abnormally; please report it"))
    });
    if let Err(e) = written {
        // what was written before stays; the journal holds it too
        let text = format!("{e}\n  {} points are kept: go on with --resume", writer.count());
        return Err(match CliError::from(e) {
            CliError::Input(_) => CliError::Input(text),
            _ => CliError::Other(text),
        });
    }
    let ends = match ends.len() == jobs.len() {
        true => ends.into_iter().collect::<Result<Vec<_>, CliError>>().map(|ends| ends.concat()),
        false => {
            Err(CliError::Other("a branch ended abnormally; what it found is in the file".into()))
        }
    };
    conclude(global, writer, ends, system)
}

/// Write points as they come, and show how far the branches are.
fn write_all(
    receiver: Receiver<PointRecord>,
    writer: &mut FamilyWriter,
    system: &System,
    (branches, (low, high)): (usize, (f64, f64)),
    bar: Option<&Bar>,
) -> Result<(), StoreError> {
    let mut progress = vec![0.0f64; branches.max(1)];
    for (count, point) in receiver.iter().enumerate() {
        writer.push(&point, system)?;
        if let Some(bar) = bar {
            let up = ((point.omega - low) / (high - low)).clamp(0.0, 1.0);
            let branch = writer.plan().branches.get(point.branch);
            let falls = branch.and_then(Branch::direction) == Some(Direction::Down);
            let share = if falls { 1.0 - up } else { up };
            let of = point.branch.min(progress.len() - 1);
            progress[of] = progress[of].max(share);
            let mean = progress.iter().sum::<f64>() / progress.len() as f64;
            bar.set(mean, format!("{} points, omega = {:.4}", count + 1, point.omega));
        }
    }
    Ok(())
}

/// Give the file its status: complete, interrupted by a signal, or failed. Of what is refused before it has begun none is left.
pub(crate) fn conclude(
    global: &Global,
    writer: FamilyWriter,
    ends: Result<Vec<BranchEnd>, CliError>,
    system: &System,
) -> Result<Vec<BranchEnd>, CliError> {
    match (ends, global.caller.signal()) {
        (Ok(ends), Some(signal)) => {
            let (path, count) = (writer.path().to_owned(), writer.count());
            writer.finish(&Status::Interrupted, &ends, system)?;
            let text = format!(
                "interrupted; {count} points are in {}: go on with the same command and --resume",
                path.display()
            );
            Err(CliError::Interrupted(signal, text))
        }
        (Ok(ends), None) => {
            writer.finish(&Status::Complete, &ends, system)?;
            Ok(ends)
        }
        (Err(e), _) if writer.is_blank() && e.exit_code() == 2 => {
            writer.discard();
            Err(e)
        }
        (Err(e), _) => {
            // the reason of the failure matters more than a failure to record it
            let _ = writer.finish(&Status::Failed(e.text()), &[], system);
            Err(e)
        }
    }
}
