//! What a run writes down: samples, energies, violations, the report.

use super::present::Present;
use super::report::Rubbed;
use super::{
    Done, Energies, Ledger, MonitorKind, Observer, Outcome, Report, Run, RunError, Sample, State,
    System,
};
use crate::contact::lcp::UNITS;

/// The energies of a run.
#[derive(Default)]
pub(super) struct Account {
    pub ledger: Ledger,
    /// Potential of the loads at the start.
    pub potential_start: f64,
    /// There were switches since the energies were known last.
    pub unbooked: bool,
}

impl Account {
    /// The energies of a state, if it is one of the whole body.
    pub fn energies(&self, system: &System, now: &Present) -> Option<Energies> {
        let integral = |place: Option<usize>| place.map_or(0.0, |i| now.y[i]);
        let rubbed = now.layout.rubbed;
        now.near.is_none().then(|| Energies {
            kinetic: system.kinetic(now.t, &now.v),
            elastic: system.elastic(now.t, &now.u),
            external: system.potential(now.t, &now.u, &now.v) - self.potential_start
                + integral(now.layout.work),
            dissipated: integral(now.layout.dissipated),
            friction: rubbed.map_or(0.0, |r| r.of_points(&now.y).map(|p| p.0).sum()),
            belt: rubbed.map_or(0.0, |r| r.belt(&now.y)),
        })
    }

    /// Book the jump of a switch, and the energies behind it where they are known.
    pub fn switch(&mut self, jump: f64, after: Option<&Energies>) {
        self.ledger.switch(jump, after);
        self.unbooked |= after.is_none();
    }
}

impl<O: Observer> Run<'_, O> {
    /// Store the samples of the window, note its end.
    pub(super) fn record_window(&mut self, ends_at_switch: bool) -> Done<(), O> {
        let (a, b) = self.flow.window();
        // what is due at the very time of a switch is stored behind it
        let is_due = |t: &f64| *t < b || (*t == b && !(ends_at_switch && b < self.options.until));
        let looks = self.observer.looks_behind_switches();
        let mut besides = self.told.besides((a, b), looks, self.options).into_iter().peekable();
        loop {
            let due = self.told.sample_time(self.options).filter(is_due);
            let t = match (due, besides.peek()) {
                (Some(due), Some(&t)) if t < due => t,
                (None, Some(&t)) => t,
                (Some(due), _) => {
                    self.told.next_sample += 1;
                    due
                }
                (None, None) => break,
            };
            besides.next_if(|besides| *besides <= t);
            // a switch at this very time is stored already
            if t > self.told.last_stored {
                self.now.take(self.flow, t.max(a));
                self.now.expand(&self.phase);
                let energies = self.account.energies(self.system, &self.now);
                self.store_sample(energies)?;
            }
        }
        if !ends_at_switch {
            self.record_near_misses((a, b))?;
            // the exact flow has no error to watch between the events, but where jumps have yet to be balanced
            let balances = self.account.unbooked && self.flow.near(b).is_none();
            let watched = !self.flow.is_exact() || balances || self.flow.is_anchor();
            if !watched && b < self.options.until {
                return Ok(());
            }
        }
        self.now.take_end(self.flow, b);
        self.seen.largest_u = self.seen.largest_u.max(self.now.largest_u());
        self.now.expand(&self.phase);
        self.note_violations();
        let Some(energies) = self.account.energies(self.system, &self.now) else { return Ok(()) };
        if !self.phase.held.is_empty() {
            self.account.ledger.held_phase(&energies);
            return Ok(());
        }
        self.account.ledger.note(&energies);
        if std::mem::take(&mut self.account.unbooked) {
            // several phases in one
            self.account.ledger.switch(0.0, Some(&energies));
        }
        Ok(())
    }

    /// Have all displacements and velocities of the present state.
    pub(super) fn make_whole(&mut self) {
        if self.now.near.is_none() {
            return;
        }
        if self.flow.window().1 != self.now.t {
            self.flow.cut(&self.phase, self.now.t);
        }
        self.flow.complete(&self.phase);
        self.now.take_end(self.flow, self.now.t);
        self.now.expand(&self.phase);
        if let Some(energies) = self.account.energies(self.system, &self.now) {
            self.account.ledger.note(&energies);
        }
    }

    /// The present state; what has no mass along an obstacle would stick where it is.
    fn last(&self) -> State {
        let mut last = State { u: self.now.u_o().to_vec(), v: self.now.v_o().to_vec() };
        self.system.anchors().iter().for_each(|(_, a)| last.u[a.memory] = self.now.u[a.memory]);
        last
    }

    pub(super) fn note_violations(&mut self) {
        let h = self.now.monitors(&self.phase);
        if self.system.promise().yields {
            self.seen.entered = self.seen.entered.max(self.system.penetration(&self.now.u));
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
            self.seen.proof.violation = self.seen.proof.violation.max(-h / scale);
        }
    }

    /// Store the present state, which has been expanded, with its energies.
    pub(super) fn store_sample(&mut self, energies: Option<Energies>) -> Done<(), O> {
        self.note_violations();
        let mut pressure = vec![0.0; self.system.n_contact()];
        self.phase.pressures(self.now.t, self.now.u_o(), &mut pressure);
        let mut traction = vec![];
        if self.system.tangents().is_some() {
            traction.resize(pressure.len(), 0.0);
            let state = (self.now.u_o(), self.now.v_o());
            self.phase.tractions(self.now.t, state, &mut traction);
        }
        let mut a = vec![];
        if self.observer.takes_accelerations() && energies.is_some() {
            a.resize(self.now.u.len(), 0.0);
            let mut scratch = self.system.scratch();
            let (u, v, own) = (self.now.u_o(), self.now.v_o(), &mut a[..self.system.n_o()]);
            self.phase.acceleration(self.now.t, u, v, &mut scratch, own);
            self.phase.complete_acceleration(self.now.t, &mut a);
        }
        self.told.last_stored = self.now.t;
        self.told.stored += 1;
        let sample = Sample {
            t: self.now.t,
            u: &self.now.u,
            v: &self.now.v,
            a: &a,
            active: &self.phase.set,
            pressure: &pressure,
            traction: &traction,
            energies,
            jumps: self.account.ledger.jumps(),
        };
        self.observer.sample(&sample).map_err(RunError::Observer)
    }

    pub(super) fn mesh_nodes(&self, contacts: &[usize]) -> Vec<usize> {
        contacts.iter().map(|&i| self.system.constraints[i].node).collect()
    }

    pub(super) fn report(mut self, outcome: Outcome) -> Report {
        self.note_deviation();
        let energies = self.account.energies(self.system, &self.now).unwrap_or_default();
        let last = self.last();
        let (log, switches, grazings) = self.told.log.into_lists();
        Report {
            outcome,
            t_end: self.now.t,
            last,
            active: self.phase.set.clone(),
            phases: self.told.phases,
            log,
            switches,
            grazings,
            proof: self.seen.proof,
            flow_note: self.flow.note(),
            energy_start: self.account.ledger.start(),
            energy_end: self.account.ledger.end(),
            energy_jumps: self.account.ledger.jumps(),
            blows: self.seen.blows,
            energy_external: energies.external,
            energy_dissipated: energies.dissipated,
            rubbed: self.now.layout.rubbed.map(|r| Rubbed {
                belt: r.belt(&self.now.y),
                points: r.of_points(&self.now.y).collect(),
            }),
            energy_drift: self.account.ledger.drift_in_phase(),
            energy_drift_total: self.account.ledger.drift_total(),
            max_penetration: self.seen.gap_error.max(self.seen.entered),
            gap_error: self.seen.gap_error,
            max_tension: self.seen.max_tension,
            counters: self.flow.counters(),
            lcp_check: None,
        }
    }
}
