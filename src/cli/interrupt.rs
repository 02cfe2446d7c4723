//! Ctrl-C and SIGTERM at a terminal: the first one asks the work to end where its results are whole, a second one ends the program at once.
//!
//! Tests cannot hit a certain place of the work from outside, on a machine that may be busy. With `SIGNORINI_AT_LOOK="INT 57"` in its environment the program does to
//! itself at its 57th look for a signal what a user may do at any time: INT, TERM, KILL and STOP are sent; WAIT is said on standard error, and a line on standard
//! input waited for. With a third word ("STOP 30 task") that happens in commands alone that have this word.

use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGKILL, SIGSTOP, SIGTERM};
use signal_hook::low_level::raise;

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

/// What happens at which look, if anything.
static AT_LOOK: OnceLock<Option<(String, usize)>> = OnceLock::new();
static LOOKS: AtomicUsize = AtomicUsize::new(0);

fn at_look() -> Option<(String, usize)> {
    let text = std::env::var("SIGNORINI_AT_LOOK").ok()?;
    let mut words = text.split(' ');
    let (what, look) = (words.next()?.to_owned(), words.next()?.parse().ok()?);
    let is_meant = words.next().is_none_or(|word| std::env::args().any(|a| a == word));
    is_meant.then_some((what, look))
}

fn happen() {
    let Some((what, look)) = AT_LOOK.get_or_init(at_look) else { return };
    if LOOKS.fetch_add(1, Ordering::Relaxed) + 1 != *look {
        return;
    }
    // that it fails is seen by whoever set the variable
    let _ = match what.as_str() {
        "INT" => raise(SIGINT),
        "TERM" => raise(SIGTERM),
        "KILL" => raise(SIGKILL),
        "STOP" => {
            eprintln!("signorini: stops at look {look}, process {}", std::process::id());
            raise(SIGSTOP)
        }
        _ => {
            eprintln!("signorini: waits at look {look}");
            std::io::stdin().read_line(&mut String::new()).map(drop)
        }
    };
}

/// The number of the signal that came, if one did.
pub fn signal() -> Option<u8> {
    happen();
    let number = RECEIVED.get().map_or(0, |r| r.load(Ordering::Relaxed));
    u8::try_from(number).ok().filter(|n| *n > 0)
}
