//! The event-driven integration of the nodal boundary equations: advance, locate, classify, switch, record.
//!
//! `u_O` and `u̇_O` are continuous across a switch; the active set, and with it `M_α`, `K_α` and the acceleration, jump.
//! The complementarity problem is solved anew at every switch; the rules for degenerate sets are in [`classify`].

mod checkpoint;
pub mod classify;
pub mod find;
pub mod ledger;
pub mod record;

pub use checkpoint::{Checkpoint, Resumed};
pub use ledger::{Energies, Ledger};
pub use record::{
    Grazing, GrazingKind, LcpCheck, Observer, Outcome, Report, Sample, Silent, Switch, SwitchKind,
};

use std::collections::VecDeque;

use crate::contact::{ActiveSet, ContactError, MonitorKind, Phase, Scratch, State, System, oracle};
use crate::flow::{Flow, FlowError, Layout};
use classify::{ClassifyError, Decision, Surface};
use find::Root;

/// What a run is asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// End time (the start is 0).
    pub until: f64,
    /// Evenly spaced states to store after the first.
    pub samples: usize,
    /// Most switches a contact node may make within ten shortest natural periods.
    pub switch_limit: f64,
    /// Compare every stored state's complementarity problem with two independent solutions.
    pub verify_lcp: bool,
}

/// A run could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum RunError<E> {
    /// The operators failed.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// The observer failed.
    #[error("{0}")]
    Observer(E),
}

/// Near misses within this fraction of a monitor's scale are recorded.
const NEAR_MISS: f64 = 1e-9;
/// A monitor whose near miss was recorded must rise to so many times that level before the next one is: a body at rest
/// on the obstacle is one near miss, not one a step.
const DEPARTURE: f64 = 10.0;
/// A slack above this fraction of a monitor's scale is no rounding error: it is reported, and ends the certificate.
const LOOSE: f64 = 1e-9;
/// With an exact flow no slack grows beyond this fraction: what lies further below zero is found, whatever was decided.
const LOOSEST: f64 = 1e-6;
/// Units of rounding error in the time.
const TIME_UNITS: f64 = 8.0 * f64::EPSILON;

/// Integrate from `initial` at `t = 0`.
pub fn run<O: Observer>(
    system: &System,
    initial: &State,
    options: &Options,
    flow: &mut dyn Flow,
    observer: &mut O,
) -> Result<Report, RunError<O::Error>> {
    let mut run = Run::start(system, initial, options, flow, observer)?;
    let outcome = run.integrate()?;
    Ok(run.report(outcome))
}

/// Go on with a run from where it stood, as if it had never been interrupted.
pub fn resume<O: Observer>(
    system: &System,
    resumed: Resumed,
    options: &Options,
    flow: &mut dyn Flow,
    observer: &mut O,
) -> Result<Report, RunError<O::Error>> {
    let mut run = Run::resume(system, resumed, options, flow, observer)?;
    let outcome = run.integrate()?;
    Ok(run.report(outcome))
}

struct Run<'a, O: Observer> {
    system: &'a System,
    options: &'a Options,
    flow: &'a mut dyn Flow,
    observer: &'a mut O,
    layout: Layout,
    scratch: Scratch,
    phase: Phase,
    slack: Vec<f64>,
    /// Rounding errors of the monitors: what the slack begins with.
    rounding: Vec<f64>,
    /// Contact nodes whose near misses are recorded.
    armed: Vec<bool>,
    /// The monitors are no numbers any more.
    blind: bool,
    /// Stored states so far.
    stored: usize,
    /// Time of the state `y`.
    t: f64,
    y: Vec<f64>,
    u: Vec<f64>,
    v: Vec<f64>,
    largest_u: f64,
    potential_start: f64,
    next_sample: usize,
    last_stored: f64,
    ledger: Ledger,
    recent: VecDeque<(f64, usize)>,
    phases: usize,
    switches: Vec<Switch>,
    grazings: Vec<Grazing>,
    missed: usize,
    uncertified: usize,
    undecided: usize,
    loosened: usize,
    max_penetration: f64,
    max_tension: f64,
    violation: f64,
    lcp_check: Option<LcpCheck>,
    early: Option<Outcome>,
}

/// What a station of the run returns.
type Done<T, O> = Result<T, RunError<<O as Observer>::Error>>;

impl<'a, O: Observer> Run<'a, O> {
    /// The initial active set: from the complementarity problem, then from the velocities.
    fn start(
        system: &'a System,
        initial: &State,
        options: &'a Options,
        flow: &'a mut dyn Flow,
        observer: &'a mut O,
    ) -> Done<Self, O> {
        let mut run = Self::blank(system, options, flow, observer)?;
        let n_o = run.layout.n_o;
        run.y[..n_o].copy_from_slice(&initial.u);
        run.y[n_o..2 * n_o].copy_from_slice(&initial.v);
        let open = ActiveSet::open(system.n_contact());
        let selection = system.select(0.0, run.layout.u(&run.y), &open)?;
        match run.decide(&selection.set, &selection.degenerate)? {
            Ok(decision) => {
                run.note_grazing(&decision, 0.0)?;
                run.phase = system.held_phase(&decision.set, &decision.held);
            }
            Err(outcome) => {
                run.phase = system.phase(&selection.set);
                run.early = Some(outcome);
            }
        }
        run.begin_phase();
        run.expand();
        run.potential_start = system.loads.constant_potential(&run.u);
        let energies = run.energies();
        run.ledger = Ledger::new(energies);
        run.store_sample()?;
        run.next_sample = 1;
        run.tell_checkpoint();
        Ok(run)
    }

    /// A run at the beginning of the phase of a checkpoint.
    fn resume(
        system: &'a System,
        resumed: Resumed,
        options: &'a Options,
        flow: &'a mut dyn Flow,
        observer: &'a mut O,
    ) -> Done<Self, O> {
        let Resumed { checkpoint: c, switches, grazings } = resumed;
        let mut run = Self::blank(system, options, flow, observer)?;
        (run.t, run.y) = (c.t, c.y);
        run.phase = system.held_phase(&ActiveSet::new(c.active), &c.held);
        run.armed = c.armed;
        run.recent = c.recent.into();
        run.ledger = Ledger::of_numbers(c.ledger);
        let [largest_u, potential_start, last_stored, penetration, tension, violation] = c.extremes;
        (run.largest_u, run.potential_start, run.last_stored) =
            (largest_u, potential_start, last_stored);
        let [next_sample, phases, missed, uncertified, undecided, loosened] = c.counts;
        run.begin_phase();
        run.flow.recall(&c.flow);
        // what the beginning of the phase counts is in these numbers already
        (run.max_penetration, run.max_tension, run.violation) = (penetration, tension, violation);
        (run.next_sample, run.phases, run.missed) = (next_sample, phases, missed);
        (run.uncertified, run.undecided, run.loosened) = (uncertified, undecided, loosened);
        run.stored = c.rows[0];
        (run.switches, run.grazings) = (switches, grazings);
        run.expand();
        run.tell_checkpoint();
        Ok(run)
    }

    /// A run without a state.
    fn blank(
        system: &'a System,
        options: &'a Options,
        flow: &'a mut dyn Flow,
        observer: &'a mut O,
    ) -> Done<Self, O> {
        let layout = Layout::new(system);
        let phase = system.open_phase();
        let y = vec![0.0; layout.len()];
        Ok(Run {
            system,
            options,
            flow,
            observer,
            layout,
            scratch: system.scratch(),
            phase,
            slack: vec![],
            rounding: vec![],
            armed: vec![true; system.n_contact()],
            blind: false,
            stored: 0,
            t: 0.0,
            y,
            u: vec![0.0; system.n()],
            v: vec![0.0; system.n()],
            largest_u: system.units.length,
            potential_start: 0.0,
            next_sample: 0,
            last_stored: f64::NEG_INFINITY,
            ledger: Ledger::default(),
            recent: VecDeque::new(),
            phases: 1,
            switches: vec![],
            grazings: vec![],
            missed: 0,
            uncertified: 0,
            undecided: 0,
            loosened: 0,
            max_penetration: 0.0,
            max_tension: 0.0,
            violation: 0.0,
            lcp_check: options.verify_lcp.then(LcpCheck::default),
            early: None,
        })
    }

    /// Tell the observer where the run can go on from: the beginning of the present phase.
    fn tell_checkpoint(&mut self) {
        if !self.observer.keeps_checkpoints() {
            return;
        }
        let checkpoint = Checkpoint {
            t: self.t,
            y: self.y.clone(),
            active: self.phase.set.flags().to_vec(),
            held: self.phase.held.clone(),
            armed: self.armed.clone(),
            recent: self.recent.iter().copied().collect(),
            ledger: self.ledger.numbers(),
            extremes: [
                self.largest_u,
                self.potential_start,
                self.last_stored,
                self.max_penetration,
                self.max_tension,
                self.violation,
            ],
            counts: [
                self.next_sample,
                self.phases,
                self.missed,
                self.uncertified,
                self.undecided,
                self.loosened,
            ],
            flow: self.flow.memory(),
            rows: [self.stored, self.switches.len(), self.grazings.len()],
        };
        self.observer.phase(checkpoint);
    }

    fn integrate(&mut self) -> Done<Outcome, O> {
        if let Some(outcome) = self.early.take() {
            return Ok(outcome);
        }
        while self.t < self.options.until {
            if let Err(e) = self.flow.advance(&self.phase, self.options.until) {
                return Ok(Outcome::Flow(e));
            }
            let root = self.locate();
            if self.blind {
                return Ok(Outcome::Flow(FlowError::NotFinite { t: self.t }));
            }
            self.record_window(root.is_some())?;
            if let Some(root) = root {
                if let Some(outcome) = self.switch(root)? {
                    return Ok(outcome);
                }
                if let Some(outcome) = self.accumulation() {
                    return Ok(outcome);
                }
            }
            let (_, reached) = self.flow.window();
            if self.observer.progress(reached).map_err(RunError::Observer)?.is_break()
                && reached < self.options.until
            {
                return Ok(self.stop_at(reached));
            }
        }
        Ok(Outcome::EndTime)
    }

    /// Leave the run at the end of the window.
    fn stop_at(&mut self, t: f64) -> Outcome {
        if t > self.t {
            self.t = t;
            self.y.copy_from_slice(self.flow.end_state());
            self.expand();
        }
        Outcome::Interrupted { t: self.t }
    }

    /// Differences of times near `t` below this are rounding errors.
    fn resolution(&self, t: f64) -> f64 {
        TIME_UNITS * t.abs().max(1.0 / self.system.units.frequency)
    }

    /// The first switch in the window, with the window cut to end there.
    fn locate(&mut self) -> Option<Root> {
        let window = self.flow.window();
        let resolution = self.resolution(window.1);
        let mut root = find::earliest(self.flow, &self.slack, window, resolution)?;
        if root.tangent {
            // a monitor whose bounds are no numbers: nothing can be found in this window, or behind it
            let all = self.flow.enclose(root.index, window.0, window.1);
            self.blind = !(all.polynomial.min() - all.error).is_finite();
        }
        for _ in 0..8 {
            self.flow.cut(&self.phase, root.t);
            // the cut step is more accurate than the interpolant: another monitor may be first
            let before = (window.0, root.t - 4.0 * resolution);
            let search = || find::earliest(self.flow, &self.slack, before, resolution);
            if let Some(earlier) = (before.1 > before.0).then(search).flatten() {
                root = earlier;
                continue;
            }
            let Some(correction) = self.correction(&root) else { break };
            let t = (root.t + correction).clamp(window.0, window.1);
            if (t - root.t).abs() <= resolution {
                break;
            }
            root.t = t;
        }
        if self.flow.window().1 != root.t {
            self.flow.cut(&self.phase, root.t);
        }
        Some(root)
    }

    /// Newton correction of a switching time from the state at the end of the cut window.
    fn correction(&mut self, root: &Root) -> Option<f64> {
        let kind = self.phase.monitors[root.index].kind;
        // a root of the exact flow is where it was found
        if self.flow.is_exact() {
            return None;
        }
        if root.tangent || matches!(kind, MonitorKind::HeldToContact | MonitorKind::HeldToFree) {
            return None;
        }
        let y = self.flow.end_state();
        let h = self.phase.monitor_values_at(root.t, self.layout.u(y))[root.index];
        let rate = self.phase.monitor_rates_at(root.t, self.layout.v(y))[root.index];
        let correction = -h / rate;
        // a weak crossing is left where it was found
        let (a, b) = self.flow.window();
        (rate < 0.0 && correction.abs() <= 0.1 * (b - a)).then_some(correction)
    }

    /// Store the samples of the window, note its end.
    fn record_window(&mut self, ends_at_switch: bool) -> Done<(), O> {
        let (a, b) = self.flow.window();
        while let Some(t) = self.sample_time().filter(|&t| t <= b) {
            self.next_sample += 1;
            // a switch at this very time is stored already
            if t > self.last_stored {
                self.t = t.max(a);
                self.flow.state(self.t, &mut self.y);
                self.store_sample()?;
            }
        }
        if !ends_at_switch {
            self.record_near_misses((a, b))?;
            // the exact flow has no error to watch between the events
            if self.flow.is_exact() && b < self.options.until {
                return Ok(());
            }
        }
        self.t = b;
        self.y.copy_from_slice(self.flow.end_state());
        let largest = self.layout.u(&self.y).iter().fold(0.0f64, |m, x| m.max(x.abs()));
        self.largest_u = self.largest_u.max(largest);
        self.expand();
        self.note_violations();
        let energies = self.energies();
        if self.phase.held.is_empty() {
            self.ledger.note(&energies);
        } else {
            self.ledger.held_phase(&energies);
        }
        Ok(())
    }

    fn sample_time(&self) -> Option<f64> {
        let Options { until, samples, .. } = *self.options;
        match self.next_sample {
            k if k < samples => Some(k as f64 * (until / samples as f64)),
            k if k == samples => Some(until),
            _ => None,
        }
    }

    fn record_near_misses(&mut self, window: (f64, f64)) -> Done<(), O> {
        // the position of a minimum is known to half the digits only
        let resolution = (window.1 - window.0) * 1e-7;
        for index in 0..self.phase.monitors.len() {
            let monitor = self.phase.monitors[index];
            if !matches!(monitor.kind, MonitorKind::Gap | MonitorKind::Pressure) {
                continue;
            }
            let contact = monitor.node;
            let level = self.rounding[index] * (NEAR_MISS / crate::contact::lcp::UNITS);
            if !self.armed[contact] {
                let end = self.flow.enclose(index, window.1, window.1);
                self.armed[contact] = end.polynomial.coefficients()[0] > DEPARTURE * level;
                continue;
            }
            if let Some((t, distance)) =
                find::near_miss(self.flow, index, level, window, resolution)
            {
                self.armed[contact] = false;
                self.push_grazing(t, contact, distance, GrazingKind::NearMiss)?;
            }
        }
        Ok(())
    }

    /// Solve the complementarity problem at the switch, decide the degenerate nodes, change the phase.
    fn switch(&mut self, root: Root) -> Done<Option<Outcome>, O> {
        if self.y.iter().any(|x| !x.is_finite()) {
            return Ok(Some(Outcome::Flow(FlowError::NotFinite { t: self.t })));
        }
        let present = self.phase.set.clone();
        let selection = self.system.select(self.t, self.layout.u(&self.y), &present)?;
        let degenerate = self.degenerate(&root, &selection.degenerate);
        let mut base = present.clone();
        for i in 0..self.system.n_contact() {
            let active = selection.set.is_active(i);
            if !degenerate.contains(&i) && base.is_active(i) != active {
                base.set(i, active);
                self.missed += 1;
            }
        }
        let decision = match self.leave_hold(&root, &base) {
            Some(decision) => decision,
            None => match self.decide(&base, &degenerate)? {
                Ok(decision) => decision,
                Err(outcome) => return Ok(Some(outcome)),
            },
        };
        self.change_phase(&root, present, decision)?;
        Ok(None)
    }

    /// The nodes with `w = p = 0` at the state, to rounding and to the time resolution.
    fn degenerate(&self, root: &Root, of_lcp: &[usize]) -> Vec<usize> {
        let h = self.monitor_values();
        let rate = self.phase.monitor_rates_at(self.t, self.layout.v(&self.y));
        let resolution = 8.0 * self.resolution(self.t);
        let mut nodes: Vec<usize> = self
            .phase
            .monitors
            .iter()
            .enumerate()
            .filter(|&(k, m)| {
                let at_zero = h[k] + rate[k].min(0.0) * resolution <= 4.0 * self.slack[k];
                at_zero || k == root.index || of_lcp.contains(&m.node)
            })
            .map(|(_, m)| m.node)
            .collect();
        nodes.dedup();
        nodes
    }

    /// A held node whose weight reached 0 or 1 leaves the surface to that side.
    fn leave_hold(&self, root: &Root, base: &ActiveSet) -> Option<Decision> {
        let monitor = self.phase.monitors[root.index];
        let active = match monitor.kind {
            MonitorKind::HeldToContact => true,
            MonitorKind::HeldToFree => false,
            _ => return None,
        };
        let held = self.phase.held.iter().copied().filter(|&i| i != monitor.node).collect();
        let order = classify::Order::Acceleration;
        let set = base.with(monitor.node, active);
        Some(Decision { set, held, order, grazing: vec![], ambiguous: false })
    }

    /// The next phase, or the outcome of a run that none continues.
    fn decide(
        &mut self,
        base: &ActiveSet,
        degenerate: &[usize],
    ) -> Done<Result<Decision, Outcome>, O> {
        let surface = Surface {
            system: self.system,
            t: self.t,
            u_o: self.layout.u(&self.y),
            v_o: self.layout.v(&self.y),
            resolution: self.resolution(self.t),
        };
        match surface.decide(base, degenerate, &mut self.scratch) {
            Ok(decision) => Ok(Ok(decision)),
            Err(ClassifyError::Contact(e)) => Err(e.into()),
            Err(ClassifyError::Unresolved { t, nodes }) => {
                Ok(Err(Outcome::Unresolved { t, nodes: self.mesh_nodes(&nodes) }))
            }
        }
    }

    fn change_phase(&mut self, root: &Root, present: ActiveSet, decision: Decision) -> Done<(), O> {
        let h = self.monitor_values()[root.index];
        if decision.set == present && decision.held == self.phase.held {
            // a touch: the phase goes on, and the monitor may lie below zero by its rounding error
            let contact = self.phase.monitors[root.index].node;
            let kind = if root.tangent { GrazingKind::Undecided } else { GrazingKind::Decided };
            self.undecided += usize::from(root.tangent);
            self.push_grazing(self.t, contact, h, kind)?;
            let slack = 4.0 * self.slack[root.index].max(-h);
            self.set_slack(root.index, slack);
            return Ok(());
        }
        self.note_grazing(&decision, h)?;
        let rates = self.phase.monitor_rates_at(self.t, self.layout.v(&self.y));
        let rate_of = |i: usize| {
            let k = self.phase.monitors.iter().position(|m| m.node == i);
            k.map_or(0.0, |k| rates[k])
        };
        for contact in 0..self.system.n_contact() {
            self.armed[contact] |= decision.set.is_active(contact) != present.is_active(contact);
        }
        let mut before = present;
        let mut kinetic = self.system.kinetic(&self.v);
        let mut jump = 0.0;
        let mut changes = vec![];
        for contact in 0..self.system.n_contact() {
            let active = decision.set.is_active(contact);
            if active == before.is_active(contact) {
                continue;
            }
            let after = before.with(contact, active);
            self.system.phase(&after).expand_velocity(self.t, self.layout.v(&self.y), &mut self.v);
            let energy = self.system.kinetic(&self.v);
            changes.push(Switch {
                t: self.t,
                contact,
                node: self.system.constraints[contact].node,
                kind: if active { SwitchKind::Close } else { SwitchKind::Open },
                monitor_rate: rate_of(contact),
                energy_jump: energy - kinetic,
                before,
                after: after.clone(),
            });
            jump += energy - kinetic;
            kinetic = energy;
            before = after;
        }
        self.phase = self.system.held_phase(&decision.set, &decision.held);
        self.phases += 1;
        self.begin_phase();
        self.expand();
        let energies = self.energies();
        self.ledger.switch(jump, &energies);
        for change in changes {
            self.observer.switch(&change).map_err(RunError::Observer)?;
            self.recent.push_back((change.t, change.node));
            self.switches.push(change);
        }
        self.store_sample()?;
        self.tell_checkpoint();
        Ok(())
    }

    /// Values of the gap and pressure monitors at the present state.
    fn monitor_values(&self) -> Vec<f64> {
        self.phase.monitor_values_at(self.t, self.layout.u(&self.y))
    }

    fn note_grazing(&mut self, decision: &Decision, distance: f64) -> Done<(), O> {
        // only the exceptional cases are worth a record at the start; elsewhere every grazing is
        for &contact in &decision.grazing {
            let kind = if decision.held.contains(&contact) {
                GrazingKind::Held
            } else if decision.ambiguous {
                GrazingKind::Ambiguous
            } else if self.t > 0.0 {
                GrazingKind::Decided
            } else {
                continue;
            };
            self.push_grazing(self.t, contact, distance, kind)?;
        }
        Ok(())
    }

    fn push_grazing(
        &mut self,
        t: f64,
        contact: usize,
        distance: f64,
        kind: GrazingKind,
    ) -> Done<(), O> {
        let node = self.system.constraints[contact].node;
        let grazing = Grazing { t, contact, node, distance, kind };
        self.observer.grazing(&grazing).map_err(RunError::Observer)?;
        self.grazings.push(grazing);
        Ok(())
    }

    /// Hand the state to the flow; set the slack of the new monitors.
    fn begin_phase(&mut self) {
        self.flow.begin(&self.phase, self.t, &self.y);
        self.uncertified += usize::from(!self.flow.is_exact());
        self.rounding = self.phase.monitor_rounding(2.0 * self.largest_u);
        self.slack = self.rounding.clone();
        let h = self.monitor_values();
        for k in 0..self.phase.monitors.len() {
            if matches!(self.phase.monitors[k].kind, MonitorKind::Gap | MonitorKind::Pressure) {
                self.set_slack(k, self.slack[k].max(-2.0 * h[k]));
            }
        }
    }

    /// How far a monitor may lie below zero without being a switch. More than rounding explains is told.
    fn set_slack(&mut self, index: usize, slack: f64) {
        let scale = self.rounding[index] / crate::contact::lcp::UNITS;
        self.loosened += usize::from(slack > LOOSE * scale && self.slack[index] <= LOOSE * scale);
        let most = if self.flow.is_exact() { LOOSEST * scale } else { f64::INFINITY };
        // not a number is no slack at all
        self.slack[index] = if slack <= most { slack } else { most };
    }

    /// Full displacement and velocity of the present state.
    fn expand(&mut self) {
        self.phase.expand_displacement(self.t, self.layout.u(&self.y), &mut self.u);
        self.phase.expand_velocity(self.t, self.layout.v(&self.y), &mut self.v);
    }

    fn energies(&self) -> Energies {
        let harmonic = self.layout.work.map_or(0.0, |i| self.y[i]);
        Energies {
            kinetic: self.system.kinetic(&self.v),
            elastic: self.system.elastic(&self.u),
            external: self.system.loads.constant_potential(&self.u) - self.potential_start
                + harmonic,
            dissipated: self.layout.dissipated.map_or(0.0, |i| self.y[i]),
        }
    }

    fn note_violations(&mut self) {
        let h = self.monitor_values();
        for (k, (h, m)) in h.iter().zip(&self.phase.monitors).enumerate() {
            match m.kind {
                MonitorKind::Gap => self.max_penetration = self.max_penetration.max(-h),
                MonitorKind::Pressure => self.max_tension = self.max_tension.max(-h),
                _ => continue,
            }
            let scale = self.rounding[k] / crate::contact::lcp::UNITS;
            self.violation = self.violation.max(-h / scale);
        }
    }

    fn store_sample(&mut self) -> Done<(), O> {
        self.expand();
        self.note_violations();
        self.verify()?;
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
            energies: self.energies(),
            jumps: self.ledger.jumps(),
        };
        self.observer.sample(&sample).map_err(RunError::Observer)
    }

    /// Compare the gaps of the phase with two independent solutions of the complementarity problem.
    fn verify(&mut self) -> Done<(), O> {
        let Some(mut check) = self.lcp_check else { return Ok(()) };
        let system = self.system;
        let conditions = system.conditions();
        let load = system.load_pressure(self.t);
        let (q, _) = conditions.data(self.layout.u(&self.y), load.as_deref());
        let gaps = system.constraints.iter().zip(&self.u[system.n_o()..]);
        let w: Vec<f64> = gaps.map(|(c, u)| c.gap - u).collect();
        let scale = w.iter().fold(system.units.length, |m, x| m.max(x.abs()));
        let distance = |other: &[f64]| {
            w.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / scale
        };
        check.states += 1;
        if system.n_contact() <= oracle::ENUMERATION_LIMIT {
            let all = oracle::enumerate(&conditions.n_c, &q);
            let nearest = all.iter().map(|x| distance(x)).fold(f64::INFINITY, f64::min);
            check.enumeration = Some(check.enumeration.unwrap_or(0.0).max(nearest));
        }
        match oracle::clarabel(&conditions.n_c, &q) {
            Some(x) => check.interior_point = check.interior_point.max(distance(&x)),
            None => check.gave_up += 1,
        }
        self.lcp_check = Some(check);
        Ok(())
    }

    /// More switches than a node can make in so short a time.
    fn accumulation(&mut self) -> Option<Outcome> {
        let window = 10.0 * std::f64::consts::TAU / self.system.body.frequency_bound();
        while self.recent.front().is_some_and(|&(t, _)| t < self.t - window) {
            self.recent.pop_front();
        }
        let count = self.recent.len();
        if count as f64 <= self.options.switch_limit * self.system.n_contact() as f64 {
            return None;
        }
        let mut nodes: Vec<usize> = self.recent.iter().map(|&(_, n)| n).collect();
        nodes.sort_unstable();
        nodes.dedup();
        Some(Outcome::Accumulation { t: self.t, count, window, nodes })
    }

    fn mesh_nodes(&self, contacts: &[usize]) -> Vec<usize> {
        contacts.iter().map(|&i| self.system.constraints[i].node).collect()
    }

    fn report(self, outcome: Outcome) -> Report {
        let energies = self.energies();
        Report {
            outcome,
            t_end: self.t,
            last: State { u: self.layout.u(&self.y).to_vec(), v: self.layout.v(&self.y).to_vec() },
            active: self.phase.set.clone(),
            phases: self.phases,
            switches: self.switches,
            grazings: self.grazings,
            uncertified_phases: self.uncertified,
            undecided: self.undecided,
            flow_note: self.flow.note(),
            loosened: self.loosened,
            missed: self.missed,
            energy_start: self.ledger.start(),
            energy_end: self.ledger.end(),
            energy_jumps: self.ledger.jumps(),
            energy_external: energies.external,
            energy_dissipated: energies.dissipated,
            energy_drift: self.ledger.drift_in_phase(),
            energy_drift_total: self.ledger.drift_total(),
            max_penetration: self.max_penetration,
            max_tension: self.max_tension,
            violation: self.violation,
            counters: self.flow.counters(),
            lcp_check: self.lcp_check,
        }
    }
}
