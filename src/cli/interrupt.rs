//! Ctrl-C and SIGTERM at a terminal: the first one asks the work to end where its results are whole, a second one ends the program at once.

use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};

static RECEIVED: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// From now on signals are noted. Only for work that looks at [`signal`] and has something to save: everything else may end at once.
pub fn watch() {
    let received = RECEIVED.get_or_init(Arc::default);
    let again = Arc::new(AtomicBool::new(false));
    for number in [SIGINT, SIGTERM] {
        // in this order: the second signal finds the flag that the first one left; without handlers the system's default holds
        let _ = signal_hook::flag::register_conditional_default(number, again.clone());
        let _ = signal_hook::flag::register(number, again.clone());
        let _ = signal_hook::flag::register_usize(number, received.clone(), number as usize);
    }
}

/// The number of the signal that came, if one did.
pub fn signal() -> Option<u8> {
    let number = RECEIVED.get().map_or(0, |r| r.load(Ordering::Relaxed));
    u8::try_from(number).ok().filter(|n| *n > 0)
}
