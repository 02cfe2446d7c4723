//! What a run has told its observer: states, switches and grazings, and how soon one switch followed the other.

use std::collections::VecDeque;

use super::Options;
use super::log::Log;
use super::observer::SOON;

/// What was told so far.
pub(super) struct Told {
    pub log: Log,
    /// Stored states so far.
    pub stored: usize,
    pub next_sample: usize,
    pub last_stored: f64,
    /// Smooth phases so far.
    pub phases: usize,
    /// When the present one began.
    pub began: f64,
    /// Switches of the last while: time and mesh node.
    pub recent: VecDeque<(f64, usize)>,
    /// Ten shortest natural periods: the time in which switches are counted.
    pub window: f64,
}

impl Told {
    /// Nothing; whether the log lists what happens, and the highest frequency of the system.
    pub fn nothing(lists: bool, highest: f64) -> Told {
        Told {
            log: Log::new(lists),
            stored: 0,
            next_sample: 0,
            last_stored: f64::NEG_INFINITY,
            phases: 1,
            began: f64::NEG_INFINITY,
            recent: VecDeque::new(),
            window: 10.0 * std::f64::consts::TAU / highest,
        }
    }

    /// A phase begins.
    pub fn phase(&mut self, t: f64) {
        self.phases += 1;
        self.began = t;
    }

    /// The times in a window at which so many states besides are told, where it follows a switch.
    pub fn besides(&self, (a, b): (f64, f64), looks: usize, options: &Options) -> Vec<f64> {
        if looks == 0 || (a - self.began) * options.samples as f64 > SOON * options.until {
            return vec![];
        }
        let step = (b - a) / (looks + 1) as f64;
        (1..=looks).map(|k| a + k as f64 * step).collect()
    }

    /// When the next state is to be stored.
    pub(crate) fn sample_time(&self, options: &Options) -> Option<f64> {
        let Options { until, samples, .. } = *options;
        match self.next_sample {
            k if k < samples => Some(k as f64 * (until / samples as f64)),
            k if k == samples => Some(until),
            _ => None,
        }
    }

    /// How many switches there were within the window before a time, and at which mesh nodes, if they are more than this.
    pub(crate) fn more_than(&mut self, limit: f64, t: f64) -> Option<(usize, Vec<usize>)> {
        while self.recent.front().is_some_and(|&(then, _)| then < t - self.window) {
            self.recent.pop_front();
        }
        let count = self.recent.len();
        // asked at every switch: the nodes are gathered only for an answer
        if count as f64 <= limit {
            return None;
        }
        let mut nodes: Vec<usize> = self.recent.iter().map(|&(_, n)| n).collect();
        nodes.sort_unstable();
        nodes.dedup();
        Some((count, nodes))
    }
}
