//! Tasks on this machine: so many processes at a time.

use std::collections::VecDeque;
use std::fs::OpenOptions;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use signorini::study::{Folder, TaskPlace, TaskState};

use super::which::task_command;
use crate::cli::progress::Bar;
use crate::cli::{CliError, Global};

/// How often a worker looks after its task.
const LOOK: Duration = Duration::from_millis(20);

/// Carry tasks out until all are, or a signal comes.
pub fn work(
    folder: &Folder,
    open: Vec<TaskPlace>,
    workers: Option<u16>,
    global: &Global,
) -> Result<(), CliError> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = usize::from(global.threads.unwrap_or(1));
    let workers = workers.map_or((cores / threads).max(1), usize::from).min(open.len());
    let (all, count) = (folder.tasks().len(), open.len());
    global.caller.watch();
    let bar = Bar::named(global, folder.name().to_owned());
    let (queue, ended) = (Mutex::new(VecDeque::from(open)), AtomicUsize::new(0));
    let next = || queue.lock().ok().and_then(|mut q| q.pop_front());
    let worker = || -> Result<(), CliError> {
        while global.caller.signal().is_none() {
            let Some(task) = next() else { break };
            carry_out(folder, &task, threads, global)?;
            // what an earlier command left behind, or a job array, may have it: it is waited for
            while task.state() == TaskState::Running && global.caller.signal().is_none() {
                std::thread::sleep(LOOK);
            }
            if task.state() == TaskState::Interrupted {
                carry_out(folder, &task, threads, global)?;
            }
            let now = ended.fetch_add(1, Ordering::Relaxed) + 1;
            if let Some(bar) = &bar {
                let share = (all - count + now) as f64 / all as f64;
                bar.set(share, format!("{} of {all} tasks", all - count + now));
            }
        }
        Ok(())
    };
    let results: Vec<Result<(), CliError>> = std::thread::scope(|scope| {
        let started: Vec<_> = (0..workers).map(|_| scope.spawn(worker)).collect();
        let lost = || Err(CliError::Other("a worker ended abnormally".into()));
        started.into_iter().map(|w| w.join().unwrap_or_else(|_| lost())).collect()
    });
    if let Some(bar) = &bar {
        bar.clear();
    }
    results.into_iter().collect::<Result<(), CliError>>()?;
    match global.caller.signal() {
        None => Ok(()),
        Some(signal) => {
            let is_done = |t: &TaskPlace| matches!(t.state(), TaskState::Done(_));
            let done = folder.tasks().iter().filter(|t| is_done(t)).count();
            let text = format!(
                "interrupted: {done} of {all} tasks are done; go on with the same command (what was begun is gone on with)"
            );
            Err(CliError::Interrupted(signal, text))
        }
    }
}

/// One task in a process of its own, whatever becomes of it.
fn carry_out(
    folder: &Folder,
    task: &TaskPlace,
    threads: usize,
    global: &Global,
) -> Result<(), CliError> {
    let command = task_command(folder.root(), &task.id)?;
    let messages = task.file("messages");
    let messages = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&messages)
        .map_err(|e| CliError::Other(format!("{}: {e}", messages.display())))?;
    let mut process = Command::new(&command[0]);
    process.args(&command[1..]).arg("--quiet").args(["--threads", &threads.to_string()]);
    if global.force_large {
        process.arg("--force-large");
    }
    process.stdin(Stdio::null()).stdout(Stdio::null()).stderr(messages);
    let started = process.spawn();
    let mut child =
        started.map_err(|e| CliError::Other(format!("starting {}: {e}", command[0])))?;
    let mut told = false;
    loop {
        match child.try_wait() {
            // its answer, or that it has none, is in its folder
            Ok(Some(_)) => return Ok(()),
            Ok(None) => {}
            Err(e) => return Err(CliError::Other(format!("waiting for a task: {e}"))),
        }
        // at a terminal the signal reaches all processes; elsewhere it is handed on
        if global.caller.signal().is_some() && !told {
            tell(&child);
            told = true;
        }
        std::thread::sleep(LOOK);
    }
}

/// Ask a process to end where its results are whole.
fn tell(child: &Child) {
    #[cfg(unix)]
    if let Some(process) = rustix::process::Pid::from_raw(child.id() as i32) {
        // it may have ended meanwhile
        let _ = rustix::process::kill_process(process, rustix::process::Signal::TERM);
    }
    #[cfg(not(unix))]
    let _ = child;
}
