//! The event-driven integration of the nodal boundary equations: advance, locate, classify, switch, record.
//!
//! `u_O` and `u̇_O` are continuous across a switch; the active set, and with it `M_α`, `K_α` and the acceleration, jump.
//! The complementarity problem is solved anew at every switch; the rules for degenerate sets are in [`classify`].

mod account;
mod adhesion;
mod checkpoint;
pub(crate) mod classify;
mod evidence;
#[doc(hidden)]
pub mod find;
mod friction;
mod held;
mod impact;
pub(crate) mod ledger;
mod log;
mod observer;
mod present;
mod proof;
mod report;
mod start;
mod switch;
mod told;
mod touch;
mod verify;
mod watch;

pub use checkpoint::Checkpoint;
pub use evidence::Evidence;
pub use ledger::{Energies, Ledger};
pub use log::{Log, Resumed};
pub use observer::{Observer, Sample, Silent};
pub use proof::Proof;
pub use report::{Marched, Outcome, Report, Rubbed};
pub use switch::{Grazing, GrazingKind, Switch, SwitchKind};
pub use verify::{LcpCheck, Verified};
pub use watch::{Watch, Watched, label};

use crate::contact::{
    ContactError, MonitorKind, Phase, PointState, Scratch, State, States, System, leading,
};
use crate::flow::{Flow, FlowError, Layout};
use account::Account;
use classify::{ClassifyError, Decision, Surface};
use find::Root;
use present::Present;
use told::Told;

/// What a run is asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// End time (the start is 0).
    pub until: f64,
    /// Evenly spaced states to store after the first.
    pub samples: usize,
    /// Most switches a contact node may make within ten shortest natural periods.
    pub switch_limit: f64,
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
    run.make_whole();
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
    run.make_whole();
    Ok(run.report(outcome))
}

struct Run<'a, O: Observer> {
    system: &'a System,
    options: &'a Options,
    flow: &'a mut dyn Flow,
    observer: &'a mut O,
    scratch: Scratch,
    phase: Phase,
    now: Present,
    search: Search,
    account: Account,
    told: Told,
    seen: Evidence,
    early: Option<Outcome>,
}

/// What the search for switches knows of the monitors of the present phase.
struct Search {
    /// How far below zero each may be without having crossed it.
    slack: Vec<f64>,
    /// Their rounding errors: what the slack begins with.
    rounding: Vec<f64>,
    /// What the last search has proved to lie below them, but where they are monotone.
    least: Vec<f64>,
    /// Contact points whose near misses are recorded.
    armed: Vec<bool>,
    /// The monitors are no numbers any more.
    blind: bool,
}

/// What a station of the run returns.
type Done<T, O> = Result<T, RunError<<O as Observer>::Error>>;

impl<O: Observer> Run<'_, O> {
    fn integrate(&mut self) -> Done<Outcome, O> {
        if let Some(outcome) = self.early.take() {
            return Ok(outcome);
        }
        while self.now.t < self.options.until {
            if let Err(e) = self.flow.advance(&self.phase, self.options.until) {
                return Ok(Outcome::Flow(e));
            }
            let root = self.locate();
            if self.search.blind {
                return Ok(Outcome::Flow(FlowError::NotFinite { t: self.now.t }));
            }
            self.record_window(root.is_some())?;
            if let Some(root) = root {
                if let Some(outcome) = self.switch(root)? {
                    return Ok(outcome);
                }
                if let Some(outcome) = self.accumulation() {
                    return Ok(outcome);
                }
            } else if self.flow.is_anchor() {
                self.begin_phase();
                self.tell_checkpoint();
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
        if t > self.now.t {
            self.now.take_end(self.flow, t);
            self.now.expand(&self.phase);
        }
        Outcome::Interrupted { t: self.now.t }
    }

    /// Rates of the monitors at the present state.
    fn monitor_rates(&mut self) -> Vec<f64> {
        let state = (self.now.u_o(), self.now.v_o());
        self.phase.rates_along(self.now.t, state, &mut self.scratch)
    }

    /// Differences of times near `t` below this are rounding errors.
    fn resolution(&self, t: f64) -> f64 {
        TIME_UNITS * t.abs().max(1.0 / self.system.units.frequency)
    }

    /// The first switch in the window, with the window cut to end there.
    fn locate(&mut self) -> Option<Root> {
        let window = self.flow.window();
        let resolution = self.resolution(window.1);
        let Search { slack, least, .. } = &mut self.search;
        least.resize(slack.len(), 0.0);
        let mut root = find::earliest(self.flow, slack, window, resolution, least)?;
        if root.tangent {
            // a monitor whose bounds are no numbers: nothing can be found in this window, or behind it
            let all = self.flow.enclose(root.index, window.0, window.1);
            self.search.blind = !(all.polynomial.min() - all.error).is_finite();
        }
        for _ in 0..8 {
            self.flow.cut(&self.phase, root.t);
            // the cut step is more accurate than the interpolant: another monitor may be first
            let before = (window.0, root.t - 4.0 * resolution);
            let Search { slack, least, .. } = &mut self.search;
            let search = || find::earliest(self.flow, slack, before, resolution, least);
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
        if root.tangent || kind.is_weight() {
            return None;
        }
        let y = self.flow.end_state();
        let (u, v) = (self.now.layout.u(y), self.now.layout.v(y));
        let h = self.phase.monitor_values(root.t, u, v)[root.index];
        let rate = self.phase.rates_along(root.t, (u, v), &mut self.scratch)[root.index];
        let correction = -h / rate;
        // a weak crossing is left where it was found
        let (a, b) = self.flow.window();
        (rate < 0.0 && correction.abs() <= 0.1 * (b - a)).then_some(correction)
    }

    /// Solve the complementarity problem at the switch (theory §12, H6), decide the degenerate nodes, change the phase.
    fn switch(&mut self, root: Root) -> Done<Option<Outcome>, O> {
        if !self.now.is_finite() {
            return Ok(Some(Outcome::Flow(FlowError::NotFinite { t: self.now.t })));
        }
        if let Some(law) = self.system.impact() {
            return self.impact(law, &root);
        }
        let present = self.phase.set.clone();
        if self.system.creeps() {
            let monitor = &self.phase.monitors[root.index];
            return match self.adhere(Some((monitor.point, monitor.kind)))? {
                Ok(decision) => self.change_phase(&root, present, decision),
                Err(outcome) => Ok(Some(outcome)),
            };
        }
        let selection = self.system.select(self.now.t, self.now.u_o(), &present)?;
        let degenerate = self.degenerate(&root, &selection.degenerate);
        let mut base = present.clone();
        for (i, _, to) in present.changes(&selection.set) {
            if !degenerate.contains(&i) {
                base.set(i, to);
                self.seen.proof.missed += 1;
            }
        }
        let monitor = &self.phase.monitors[root.index];
        let trigger = monitor.kind.is_tangential().then_some((monitor.point, monitor.kind));
        let decision = match self.leave_hold(&root, &base) {
            Some(decision) => decision,
            None => match self.decide(&base, &degenerate, trigger)? {
                Ok(decision) => decision,
                Err(outcome) => return Ok(Some(outcome)),
            },
        };
        self.change_phase(&root, present, decision)
    }

    /// The nodes with `w = p = 0` at the state, to rounding and to the time resolution.
    fn degenerate(&mut self, root: &Root, of_lcp: &[usize]) -> Vec<usize> {
        let h = self.now.monitors(&self.phase);
        let rate = self.monitor_rates();
        let resolution = 8.0 * self.resolution(self.now.t);
        let mut nodes: Vec<usize> = self
            .phase
            .monitors
            .iter()
            .enumerate()
            .filter(|(_, m)| !m.kind.is_tangential())
            .filter(|&(k, m)| {
                let at_zero = h[k] + rate[k].min(0.0) * resolution <= 4.0 * self.search.slack[k];
                at_zero || k == root.index || of_lcp.contains(&m.point)
            })
            .map(|(_, m)| m.point)
            .collect();
        nodes.dedup();
        nodes
    }

    /// The next phase, or the outcome of a run that none continues.
    fn decide(
        &mut self,
        base: &States,
        degenerate: &[usize],
        trigger: Option<(usize, MonitorKind)>,
    ) -> Done<Result<Decision, Outcome>, O> {
        let decided = self.at_surface(|surface, _, scratch| {
            let decision = surface.decide(base, degenerate, scratch)?;
            surface.rub(decision, trigger, scratch)
        });
        self.decided(decided)
    }

    /// The same where nothing has mass along rough obstacles; all displacements are known.
    fn adhere(
        &mut self,
        trigger: Option<(usize, MonitorKind)>,
    ) -> Done<Result<Decision, Outcome>, O> {
        let decided =
            self.at_surface(|surface, u_c, scratch| surface.adhere(u_c, trigger, scratch));
        self.decided(decided)
    }

    /// What is decided at the present state, also from its contact displacements.
    fn at_surface<T>(&mut self, decide: impl FnOnce(&Surface, &[f64], &mut Scratch) -> T) -> T {
        let surface = Surface {
            system: self.system,
            phase: &self.phase,
            t: self.now.t,
            u_o: self.now.u_o(),
            v_o: self.now.v_o(),
            resolution: self.resolution(self.now.t),
        };
        decide(&surface, &self.now.u[self.now.layout.n_o..], &mut self.scratch)
    }

    /// A decision, or that none continues as an outcome.
    fn decided(
        &self,
        decided: Result<Decision, ClassifyError>,
    ) -> Done<Result<Decision, Outcome>, O> {
        match decided {
            Ok(decision) => Ok(Ok(decision)),
            Err(ClassifyError::Contact(e)) => Err(e.into()),
            Err(ClassifyError::Unresolved { t, nodes }) => {
                Ok(Err(Outcome::Unresolved { t, nodes: self.mesh_nodes(&nodes) }))
            }
            Err(ClassifyError::Rests { t, node }) => {
                Ok(Err(Outcome::Rests { t, nodes: self.mesh_nodes(&[node]) }))
            }
        }
    }

    /// Go into the phase of a decision.
    fn take_up(&mut self, decision: &Decision) {
        if self.system.tangents().is_some() {
            let n_o = self.now.layout.n_o;
            let states = (&self.phase.set, &decision.set);
            friction::anchor(self.system, states, &self.now.u, &mut self.now.y[..2 * n_o]);
            friction::settle(self.system, &decision.set, &mut self.now.y[n_o..2 * n_o]);
            friction::remember(self.system, &decision.set, &mut self.now.y[..n_o]);
        }
        self.phase = self.system.held_phase(&decision.set, &decision.held);
    }

    fn change_phase(
        &mut self,
        root: &Root,
        present: States,
        decision: Decision,
    ) -> Done<Option<Outcome>, O> {
        let h = self.now.monitors(&self.phase)[root.index];
        if decision.set == present && decision.held == self.phase.held {
            // a touch: the phase goes on, and the monitor may lie below zero by its rounding error
            let point = self.phase.monitors[root.index].point;
            if self.is_too_deep(root.index, h) {
                let nodes = self.mesh_nodes(&[point]);
                return Ok(Some(Outcome::Unresolved { t: self.now.t, nodes }));
            }
            let kind = if root.tangent { GrazingKind::Undecided } else { GrazingKind::Decided };
            self.seen.proof.undecided += usize::from(root.tangent);
            self.push_grazing(self.now.t, point, h, kind)?;
            let slack = 4.0 * self.search.slack[root.index].max(-h);
            self.set_slack(root.index, slack);
            return Ok(None);
        }
        self.note_grazing(&decision, h)?;
        let rates = self.monitor_rates();
        let monitors = &self.phase.monitors;
        let found = &monitors[root.index];
        let of_point = |point: usize, from: PointState, to: PointState| {
            let leads = leading(monitors, point, to);
            match leads.map(|k| if found.point == point { root.index } else { k }) {
                Some(k) => (monitors[k].kind, rates[k]),
                None => (self.system.law().watched(from), 0.0),
            }
        };
        // with friction one point takes others along: who reached zero comes first
        let (first, others): (Vec<_>, Vec<_>) = present
            .changes(&decision.set)
            .partition(|change| change.0 == found.point && self.system.tangents().is_some());
        let mut before = present.clone();
        let mut jump = 0.0;
        let mut changes = vec![];
        for (point, from, to) in first.into_iter().chain(others) {
            self.search.armed[point] = true;
            let after = before.with(point, to);
            let (monitor, monitor_rate) = of_point(point, from, to);
            let u_c = self.now.v[self.now.layout.n_o..].to_vec();
            self.system.phase(&after).complete_velocity(self.now.t, &mut self.now.v);
            let energy_jump = self.system.kinetic_jump(&u_c, &self.now.v);
            changes.push(Switch {
                t: self.now.t,
                point,
                node: self.system.constraints[point].node,
                kind: SwitchKind::of_states(from, to),
                monitor,
                monitor_rate,
                energy_jump,
                struck: vec![],
                before,
                after: after.clone(),
            });
            jump += energy_jump;
            before = after;
        }
        if !decision.held.is_empty() {
            // what flows on knows no surroundings
            self.make_whole();
        }
        self.take_up(&decision);
        self.told.phase(self.now.t);
        self.begin_phase();
        self.now.expand(&self.phase);
        let energies = self.account.energies(self.system, &self.now);
        self.account.switch(jump, energies.as_ref());
        for change in changes {
            self.told.recent.push_back((change.t, change.node));
            self.told.log.switch(change, self.observer).map_err(RunError::Observer)?;
        }
        self.store_sample(energies)?;
        self.tell_checkpoint();
        Ok(None)
    }

    /// More switches than a node can make in so short a time.
    fn accumulation(&mut self) -> Option<Outcome> {
        let rebounds = self.system.impact().map_or(1.0, |law| impact::rebounds(law.restitution));
        let limit = rebounds * self.options.switch_limit * self.system.n_contact() as f64;
        let (count, nodes) = self.told.more_than(limit, self.now.t)?;
        Some(Outcome::Accumulation { t: self.now.t, count, window: self.told.window, nodes })
    }
}
