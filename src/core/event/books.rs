//! What a run writes down: samples, energies, violations, the report.

use std::ops::Range;

use super::{
    Done, Energies, MonitorKind, Observer, Options, Outcome, Report, Run, RunError, Sample, State,
};
use crate::contact::lcp::UNITS;

impl<O: Observer> Run<'_, O> {
    /// Store the samples of the window, note its end.
    pub(super) fn record_window(&mut self, ends_at_switch: bool) -> Done<(), O> {
        let (a, b) = self.flow.window();
        while let Some(t) = self.sample_time().filter(|&t| t <= b) {
            self.next_sample += 1;
            // a switch at this very time is stored already
            if t > self.last_stored {
                self.t = t.max(a);
                self.near = self.flow.near(self.t);
                self.flow.state(self.t, &mut self.y);
                self.expand();
                let energies = self.energies();
                self.store_sample(energies)?;
            }
        }
        if !ends_at_switch {
            self.record_near_misses((a, b))?;
            // the exact flow has no error to watch between the events, but where jumps have yet to be balanced
            let balances = self.unbooked && self.flow.near(b).is_none();
            let watched = !self.flow.is_exact() || balances || self.flow.is_anchor();
            if !watched && b < self.options.until {
                return Ok(());
            }
        }
        self.take_end(b);
        let largest = self.layout.u(&self.y)[self.known()].iter();
        self.seen.largest_u = largest.fold(self.seen.largest_u, |m, x| m.max(x.abs()));
        self.expand();
        self.note_violations();
        let Some(energies) = self.energies() else { return Ok(()) };
        if !self.phase.held.is_empty() {
            self.ledger.held_phase(&energies);
            return Ok(());
        }
        self.ledger.note(&energies);
        if std::mem::take(&mut self.unbooked) {
            // several phases in one
            self.ledger.switch(0.0, Some(&energies));
        }
        Ok(())
    }

    /// Displacements of `u_O` of which the present state is one.
    fn known(&self) -> Range<usize> {
        self.near.clone().unwrap_or(0..self.layout.n_o)
    }

    /// The state at the end of the window becomes the present one.
    pub(super) fn take_end(&mut self, t: f64) {
        self.t = t;
        let rows = self.flow.near(t);
        let end = self.flow.end_state();
        match &rows {
            None => self.y.copy_from_slice(end),
            Some(rows) => self.layout.copy(rows, end, &mut self.y),
        }
        self.near = rows;
    }

    /// Have all displacements and velocities of the present state.
    pub(super) fn make_whole(&mut self) {
        if self.near.is_none() {
            return;
        }
        if self.flow.window().1 != self.t {
            self.flow.cut(&self.phase, self.t);
        }
        self.flow.complete(&self.phase);
        self.take_end(self.t);
        self.expand();
        if let Some(energies) = self.energies() {
            self.ledger.note(&energies);
        }
    }

    /// Whether the present state is one of numbers.
    pub(super) fn is_finite(&self) -> bool {
        let rows = self.known();
        let [u, v] = [self.layout.u(&self.y), self.layout.v(&self.y)];
        let integrals = &self.y[2 * self.layout.n_o..];
        u[rows.clone()].iter().chain(&v[rows]).chain(integrals).all(|x| x.is_finite())
    }

    pub(super) fn sample_time(&self) -> Option<f64> {
        let Options { until, samples, .. } = *self.options;
        match self.next_sample {
            k if k < samples => Some(k as f64 * (until / samples as f64)),
            k if k == samples => Some(until),
            _ => None,
        }
    }

    /// Values of the gap and pressure monitors at the present state.
    pub(super) fn monitor_values(&self) -> Vec<f64> {
        self.phase.monitor_values_at(self.t, self.layout.u(&self.y))
    }

    /// Full displacement and velocity of the present state.
    pub(super) fn expand(&mut self) {
        let rows = self.known();
        self.u[rows.clone()].copy_from_slice(&self.layout.u(&self.y)[rows.clone()]);
        self.v[rows.clone()].copy_from_slice(&self.layout.v(&self.y)[rows]);
        self.phase.complete_displacement(self.t, &mut self.u);
        self.phase.complete_velocity(self.t, &mut self.v);
    }

    /// The energies of the present state, if it is one of the whole body.
    pub(super) fn energies(&self) -> Option<Energies> {
        let harmonic = self.layout.work.map_or(0.0, |i| self.y[i]);
        self.near.is_none().then(|| Energies {
            kinetic: self.system.kinetic(self.t, &self.v),
            elastic: self.system.elastic(self.t, &self.u),
            external: self.system.potential(self.t, &self.u, &self.v) - self.potential_start
                + harmonic,
            dissipated: self.layout.dissipated.map_or(0.0, |i| self.y[i]),
        })
    }

    pub(super) fn note_violations(&mut self) {
        let h = self.monitor_values();
        if self.system.promise().yields {
            self.seen.entered = self.seen.entered.max(self.system.penetration(&self.u));
        }
        for (k, (h, m)) in h.iter().zip(&self.phase.monitors).enumerate() {
            match m.kind {
                MonitorKind::Gap | MonitorKind::Depth => {
                    self.seen.gap_error = self.seen.gap_error.max(-h)
                }
                MonitorKind::Pressure => self.seen.max_tension = self.seen.max_tension.max(-h),
                _ => continue,
            }
            let scale = self.search.rounding[k] / UNITS;
            self.seen.violation = self.seen.violation.max(-h / scale);
        }
    }

    /// Store the present state, which has been expanded, with its energies.
    pub(super) fn store_sample(&mut self, energies: Option<Energies>) -> Done<(), O> {
        self.note_violations();
        let mut pressure = vec![0.0; self.system.n_contact()];
        self.phase.pressures(self.t, self.layout.u(&self.y), &mut pressure);
        self.last_stored = self.t;
        self.stored += 1;
        let sample = Sample {
            t: self.t,
            u: &self.u,
            v: &self.v,
            active: &self.phase.set,
            pressure: &pressure,
            energies,
            jumps: self.ledger.jumps(),
        };
        self.observer.sample(&sample).map_err(RunError::Observer)
    }

    pub(super) fn mesh_nodes(&self, contacts: &[usize]) -> Vec<usize> {
        contacts.iter().map(|&i| self.system.constraints[i].node).collect()
    }

    pub(super) fn report(mut self, outcome: Outcome) -> Report {
        self.note_deviation();
        let energies = self.energies().unwrap_or_default();
        let (log, switches, grazings) = self.log.into_lists();
        Report {
            outcome,
            t_end: self.t,
            last: State { u: self.layout.u(&self.y).to_vec(), v: self.layout.v(&self.y).to_vec() },
            active: self.phase.set.clone(),
            phases: self.phases,
            log,
            switches,
            grazings,
            uncertified_phases: self.seen.uncertified,
            undecided: self.seen.undecided,
            flow_note: self.flow.note(),
            loosened: self.seen.loosened,
            state_error: self.seen.state_error,
            missed: self.seen.missed,
            energy_start: self.ledger.start(),
            energy_end: self.ledger.end(),
            energy_jumps: self.ledger.jumps(),
            blows: self.seen.blows,
            energy_external: energies.external,
            energy_dissipated: energies.dissipated,
            energy_drift: self.ledger.drift_in_phase(),
            energy_drift_total: self.ledger.drift_total(),
            max_penetration: self.seen.gap_error.max(self.seen.entered),
            gap_error: self.seen.gap_error,
            max_tension: self.seen.max_tension,
            violation: self.seen.violation,
            counters: self.flow.counters(),
            lcp_check: None,
        }
    }
}
