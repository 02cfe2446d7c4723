//! Progress of long work, on standard error: a bar on a terminal, elsewhere a line a minute.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use signorini::scenario::Scene;

use super::Global;

/// Parts that a bar is divided into.
const TICKS: f64 = 1000.0;
/// Where nobody watches: how often a line is written.
const EVERY: Duration = Duration::from_secs(60);

/// A bar, or its stand-in.
pub struct Bar {
    bar: ProgressBar,
    title: String,
    start: Instant,
    /// When the last line was written, where there is no terminal.
    line: Option<Mutex<Instant>>,
}

impl Bar {
    /// A bar for long work, with what it is about; none if the user wants quiet.
    pub fn new(global: &Global, scene: &Scene) -> Option<Bar> {
        if global.quiet {
            return None;
        }
        let style = "{prefix} [{bar:30}] {percent:>3} %  {elapsed} elapsed, {eta} left  {msg}";
        let style =
            ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(TICKS as u64).with_style(style.progress_chars("=> "));
        let hidden = bar.is_hidden();
        if !hidden {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        let now = Instant::now();
        let bar = bar.with_prefix(scene.stem());
        Some(Bar { bar, title: scene.stem(), start: now, line: hidden.then(|| Mutex::new(now)) })
    }

    /// A share of the work is done.
    pub fn set(&self, share: f64, message: String) {
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        match &self.line {
            None => {
                self.bar.set_position((TICKS * share) as u64);
                self.bar.set_message(message);
            }
            Some(last) => {
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
        self.bar.finish_and_clear();
    }
}
