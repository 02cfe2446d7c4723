//! Progress of long work: on standard error a bar on a terminal, elsewhere a line a minute; on its desk where a program called.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use signorini::scenario::Scene;

use super::{Desk, Global};

/// Parts that a bar is divided into.
const TICKS: f64 = 1000.0;
/// Where nobody watches: how often a line is written.
const EVERY: Duration = Duration::from_secs(60);

/// A bar, or its stand-in.
pub struct Bar {
    shown: Shown,
    title: String,
    start: Instant,
}

/// Where progress is seen.
enum Shown {
    /// On a terminal.
    Bar(ProgressBar),
    /// In lines; when the last one was written.
    Lines(Mutex<Instant>),
    /// By the program that called the command.
    Desk(Arc<Desk>),
}

impl Bar {
    /// A bar for long work, with what it is about; none if the user wants quiet.
    pub fn new(global: &Global, scene: &Scene) -> Option<Bar> {
        Bar::named(global, scene.stem())
    }

    /// The same with another title.
    pub fn named(global: &Global, title: String) -> Option<Bar> {
        let start = Instant::now();
        if let Some(desk) = &global.caller.desk {
            return Some(Bar { shown: Shown::Desk(desk.clone()), title, start });
        }
        if global.quiet {
            return None;
        }
        let style = "{prefix} [{bar:30}] {percent:>3} %  {elapsed} elapsed, {eta} left  {msg}";
        let style =
            ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(TICKS as u64).with_style(style.progress_chars("=> "));
        let shown = match bar.is_hidden() {
            true => Shown::Lines(Mutex::new(start)),
            false => {
                bar.enable_steady_tick(Duration::from_millis(200));
                Shown::Bar(bar.with_prefix(title.clone()))
            }
        };
        Some(Bar { shown, title, start })
    }

    /// A share of the work is done.
    pub fn set(&self, share: f64, message: String) {
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        match &self.shown {
            Shown::Desk(desk) => desk.set(share, message),
            Shown::Bar(bar) => {
                bar.set_position((TICKS * share) as u64);
                bar.set_message(message);
            }
            Shown::Lines(last) => {
                let Ok(mut last) = last.lock() else { return };
                if last.elapsed() >= EVERY {
                    *last = Instant::now();
                    let elapsed = self.start.elapsed().as_secs() / 60;
                    eprintln!(
                        "signorini: {}: {:.1} % after {elapsed} min  {message}",
                        self.title,
                        100.0 * share
                    );
                }
            }
        }
    }

    /// Take it away.
    pub fn clear(&self) {
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
    }
}
