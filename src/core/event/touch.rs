//! Touches: near misses, grazings, and how far a monitor may lie below zero without being a switch.

use super::classify::Decision;
use super::{Done, Grazing, GrazingKind, Observer, Run, RunError, find};
use crate::contact::lcp::UNITS;

/// Near misses within this fraction of a monitor's scale are recorded.
const NEAR_MISS: f64 = 1e-9;
/// A monitor whose near miss was recorded must rise to so many times that level before the next one is: a body at rest
/// on the obstacle is one near miss, not one a step.
const DEPARTURE: f64 = 10.0;
/// A slack above this fraction of a monitor's scale is no rounding error: it is reported, and ends the certificate.
const LOOSE: f64 = 1e-9;
/// No slack grows beyond this fraction, with an exact flow and with interpolants, which are wrong by their tolerance: what lies further below zero is
/// found, whatever was decided.
const LOOSEST: f64 = 1e-6;
const LOOSEST_OF_STEPS: f64 = 1e-2;

/// The slack that is granted of what is asked for: at most `most`; what is not a number is no slack at all (theory §12, H3).
fn granted(asked: f64, most: f64) -> f64 {
    if asked <= most {
        asked
    } else if asked > most {
        most
    } else {
        0.0
    }
}

impl<O: Observer> Run<'_, O> {
    pub(super) fn record_near_misses(&mut self, window: (f64, f64)) -> Done<(), O> {
        // the position of a minimum is known to half the digits only
        let resolution = (window.1 - window.0) * 1e-7;
        for index in 0..self.phase.monitors.len() {
            let monitor = &self.phase.monitors[index];
            if monitor.kind.is_weight() {
                continue;
            }
            let point = monitor.point;
            let level = self.search.rounding[index] * (NEAR_MISS / UNITS);
            let is_armed = self.search.armed[point];
            if is_armed && self.search.least[index] > level {
                continue;
            }
            let miss = is_armed
                .then(|| find::near_miss(self.flow, index, level, window, resolution))
                .flatten();
            if !is_armed || miss.is_some() {
                let end = self.flow.enclose(index, window.1, window.1);
                self.search.armed[point] = end.polynomial.coefficients()[0] > DEPARTURE * level;
            }
            if let Some((t, distance)) = miss {
                self.push_grazing(t, point, distance, GrazingKind::NearMiss)?;
            }
        }
        Ok(())
    }

    pub(super) fn note_grazing(&mut self, decision: &Decision, distance: f64) -> Done<(), O> {
        // only the exceptional cases are worth a record at the start; elsewhere every grazing is
        for &point in &decision.grazing {
            let kind = if decision.held.contains(&point) {
                GrazingKind::Held
            } else if decision.ambiguous == Some(true) {
                GrazingKind::Ambiguous
            } else if decision.ambiguous.is_none() {
                GrazingKind::Untried
            } else if self.now.t > 0.0 {
                GrazingKind::Decided
            } else {
                continue;
            };
            self.push_grazing(self.now.t, point, distance, kind)?;
        }
        Ok(())
    }

    pub(super) fn push_grazing(
        &mut self,
        t: f64,
        point: usize,
        distance: f64,
        kind: GrazingKind,
    ) -> Done<(), O> {
        let node = self.system.constraints[point].node;
        let grazing = Grazing { t, point, node, distance, kind };
        self.told.log.grazing(grazing, self.observer).map_err(RunError::Observer)
    }

    /// Note how far the monitors of the phase that ends may be from those of the equations, over their sizes; too far, and nothing is proved of the
    /// phase (theory §12, H4).
    pub(super) fn note_deviation(&mut self) {
        if !self.flow.is_exact() {
            return;
        }
        // the limit of a slider does not move, and has no error
        let of_monitor = |(d, r): (f64, &f64)| if d == 0.0 { 0.0 } else { d / (r / UNITS) };
        let all = self.flow.deviations().into_iter().zip(&self.search.rounding).map(of_monitor);
        self.seen.proof.end_phase(all);
    }

    /// Hand the state to the flow; set the slack of the new monitors.
    pub(super) fn begin_phase(&mut self) {
        self.note_deviation();
        self.flow.begin(&self.phase, self.now.t, &self.now.y);
        self.measure_phase();
    }

    /// The same for the phase of a checkpoint, with what the flow had learnt by then.
    pub(super) fn resume_phase(&mut self, memory: &[f64]) {
        self.flow.resume(&self.phase, (self.now.t, &self.now.y), memory);
        self.measure_phase();
    }

    fn measure_phase(&mut self) {
        self.seen.proof.begin_phase(self.flow.is_exact());
        if self.phase.knows_velocities() {
            self.seen.largest_v = self.seen.largest_v.max(self.now.largest_v());
        }
        let units = &self.system.units;
        let largest_v = self.seen.largest_v.max(units.length * units.frequency);
        let (u, v) = (2.0 * self.seen.largest_u, 2.0 * largest_v);
        self.search.rounding = self.phase.monitor_rounding(u, v);
        self.search.slack = self.search.rounding.clone();
        let h = self.now.monitors(&self.phase);
        for k in 0..self.phase.monitors.len() {
            if !self.phase.monitors[k].kind.is_weight() {
                self.set_slack(k, self.search.slack[k].max(-2.0 * h[k]));
            }
        }
    }

    /// The most slack of a monitor.
    fn most_slack(&self, index: usize) -> f64 {
        let share = if self.flow.is_exact() { LOOSEST } else { LOOSEST_OF_STEPS };
        share * self.search.rounding[index] / UNITS
    }

    /// How far a monitor may lie below zero without being a switch (theory §12, H3). More than rounding explains is told.
    pub(super) fn set_slack(&mut self, index: usize, slack: f64) {
        let scale = self.search.rounding[index] / UNITS;
        self.seen.proof.loosened +=
            usize::from(slack > LOOSE * scale && self.search.slack[index] <= LOOSE * scale);
        self.search.slack[index] = granted(slack, self.most_slack(index));
    }

    /// Whether a monitor lies so far below zero that no slack lets the phase go on with it: it would be found again at once, without end.
    pub(super) fn is_too_deep(&self, index: usize, h: f64) -> bool {
        !self.phase.monitors[index].kind.is_weight() && -h > self.most_slack(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_no_slack() {
        for most in [1e-6, f64::INFINITY] {
            assert_eq!(granted(f64::NAN, most), 0.0);
            assert_eq!(granted(1e-9, most), 1e-9);
        }
        assert_eq!(granted(f64::INFINITY, 1e-2), 1e-2);
        assert_eq!(granted(1e-9, f64::NAN), 0.0);
    }

    /// A touch multiplies the slack by four: without a ceiling twenty of them would hide every switch of the monitor.
    #[test]
    fn touches_one_after_the_other_do_not_blind_the_search() {
        let slack = (0..40).fold(UNITS, |slack, _| granted(4.0 * slack, LOOSEST_OF_STEPS));
        assert_eq!(slack, LOOSEST_OF_STEPS);
    }
}
