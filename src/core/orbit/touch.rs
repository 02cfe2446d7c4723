//! Minima of monitors along a motion: where a contact point comes nearest to a visit that it does not make.

use super::walk::Walk;
use crate::contact::{PointState, States};

/// Samples of a monitor over the whole motion, and at least so many in a phase.
const SAMPLES: f64 = 128.0;
const FEWEST: f64 = 4.0;
/// First stride downhill, over the length of a phase.
const STRIDE: f64 = 1e-4;
/// Halvings of an interval around a minimum.
const HALVINGS: usize = 60;

/// A minimum of a monitor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    pub phase: usize,
    pub t: f64,
    pub h: f64,
}

/// The monitors along a motion.
#[derive(Clone, Copy)]
pub(super) struct Minima<'a> {
    pub walk: &'a Walk,
    /// The active set of each phase.
    pub sets: &'a [States],
}

impl Minima<'_> {
    /// When the motion ends.
    pub fn end(&self) -> f64 {
        self.walk.links[self.walk.links.len() - 1].span.1
    }

    /// All minima inside phases, of monitors through which a point would leave to a state.
    pub fn all(&self) -> Vec<((usize, PointState), Touch)> {
        let end = self.end();
        let mut found = vec![];
        for (phase, link) in self.walk.links.iter().enumerate() {
            let (a, b) = link.span;
            let pieces = (SAMPLES * (b - a) / end).ceil().max(FEWEST) as usize;
            let times: Vec<f64> =
                (0..=pieces).map(|k| a + (b - a) * k as f64 / pieces as f64).collect();
            let rates: Vec<Vec<f64>> = times.iter().map(|&t| link.monitor_rates(t)).collect();
            for (k, lead) in link.leads().enumerate() {
                for i in (0..pieces).filter(|&i| rates[i][k] < 0.0 && rates[i + 1][k] >= 0.0) {
                    found.push((lead, self.nearest(phase, lead, 0.5 * (times[i] + times[i + 1]))));
                }
            }
        }
        found
    }

    /// The minimum nearest to a time of the monitor through which a point would leave to `to`: it may lie in a neighbouring phase, as long as the point stays
    /// what it is.
    pub fn nearest(&self, phase: usize, (point, to): (usize, PointState), near: f64) -> Touch {
        let (walk, sets) = (self.walk, self.sets);
        let present = sets[phase].at(point);
        let monitor = |phase: usize, t: f64| {
            let link = &walk.links[phase];
            link.monitor(link.leading(point, to), t)
        };
        let at = |phase: usize, t: f64| Touch { phase, t, h: monitor(phase, t).0 };
        let rate = |phase: usize, t: f64| monitor(phase, t).1;
        let goes_on = |phase: usize| sets.get(phase).is_some_and(|s| s.at(point) == present);
        // downhill from `near`, in growing steps, until the rate changes its sign or the contact state ends
        let mut phase = phase;
        let (mut a, mut b) = walk.links[phase].span;
        let mut low = near.max(a.min(b)).min(b);
        let mut high = low;
        // a newborn phase has no length, an iterate of Newton's method may have a negative one
        let mut stride = STRIDE * (b - a).abs().max(1e-2 * self.end());
        if rate(phase, low) < 0.0 {
            while rate(phase, high) < 0.0 {
                if high >= b {
                    if !goes_on(phase + 1) {
                        return at(phase, b);
                    }
                    phase += 1;
                    b = walk.links[phase].span.1;
                    low = high;
                    continue;
                }
                (low, high) = (high, (high + stride).min(b));
                stride *= 1.3;
            }
        } else {
            while rate(phase, low) >= 0.0 {
                if low <= a {
                    if phase == 0 || !goes_on(phase - 1) {
                        return at(phase, a);
                    }
                    phase -= 1;
                    a = walk.links[phase].span.0;
                    high = low;
                    continue;
                }
                (low, high) = ((low - stride).max(a), low);
                stride *= 1.3;
            }
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if rate(phase, middle) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        at(phase, 0.5 * (low + high))
    }
}
