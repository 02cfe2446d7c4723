//! Who calls a command: a user at a terminal, or a program that holds this one as a library (Python).

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use signal_hook::consts::SIGINT;
use signorini::scenario::Scene;

/// What a calling program and the command share while it works: it may be looked at, and asked to end, from another thread.
#[derive(Debug, Default)]
pub struct Desk {
    stop: Arc<AtomicBool>,
    /// Share of the work that is done, and what is being done.
    progress: Mutex<(f64, String)>,
    warnings: Mutex<Vec<String>>,
}

/// What a panic left half done is a number or a text, which are whole.
fn held<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Desk {
    /// Ask the command to end where its results are whole.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Share of the work that is done, and what is being done.
    pub fn progress(&self) -> (f64, String) {
        held(&self.progress).clone()
    }

    /// Take the warnings that there are.
    pub fn warnings(&self) -> Vec<String> {
        std::mem::take(&mut held(&self.warnings))
    }

    pub(super) fn set(&self, share: f64, what: String) {
        *held(&self.progress) = (share, what);
    }
}

/// A calling program; none at a terminal.
#[derive(Debug, Clone, Default)]
pub struct Caller {
    /// The scene in place of the file that the arguments name.
    pub(super) scene: Option<Scene>,
    /// Its results are read at once and thrown away.
    pub(super) is_scratch: bool,
    /// The command as it called it.
    pub(super) command: Option<String>,
    pub(super) desk: Option<Arc<Desk>>,
}

impl Caller {
    /// The command, for the record.
    pub(super) fn command(&self) -> String {
        let own = || std::env::args().collect::<Vec<_>>().join(" ");
        self.command.clone().unwrap_or_else(own)
    }

    /// Warn the user.
    pub(super) fn warn(&self, text: &str) {
        match &self.desk {
            Some(desk) => held(&desk.warnings).push(text.to_owned()),
            None => eprintln!("signorini: WARNING: {text}"),
        }
    }

    /// What work looks at that can be ended at any time; nothing at a terminal, where a signal ends the program.
    pub(super) fn stop(&self) -> Option<Arc<AtomicBool>> {
        self.desk.as_ref().map(|d| d.stop.clone())
    }

    /// The number of the signal that came, if one did; to be asked to end by a program is like Ctrl-C.
    pub(super) fn signal(&self) -> Option<u8> {
        match &self.desk {
            Some(desk) => desk.stop.load(Ordering::Relaxed).then_some(SIGINT as u8),
            None => super::interrupt::signal(),
        }
    }

    /// From now on signals are noted, by whoever hears them.
    pub(super) fn watch(&self) {
        if self.desk.is_none() {
            super::interrupt::watch();
        }
    }
}
