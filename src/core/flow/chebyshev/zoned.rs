//! The surroundings of the contact by themselves, everything else in steps (undamped bodies with a diagonal mass, constant loads).
//!
//! A switch changes accelerations next to the contact only, and a polynomial of degree `N − 1` in `S` moves nothing further than `N − 1` entries
//! ([`System::distances`]). So in a step of `W`, which `N` terms cover, what is `N` entries and more from the contact is free whatever happens there,
//! and goes from step to step by one recurrence instead of two, from the part of its motion that is even about the start of the step:
//!
//! ```text
//! u(t + W) = 2u(t) − u(t − W) + 2G(S) a(t)
//! v(t + W) =         v(t − W) + 2g(S) a(t)
//! ```
//!
//! The zone, all that is less than `2N − 1` entries away, is a body of its own during the step ([`Chebyshev`], from switch to switch), the
//! displacements behind its cut standing still: what these would have told it does not come closer than `N` entries to the contact, and the rest
//! of the zone is thrown away. What a polynomial of degree `N − 1` leaves out bounds both errors, in the zone as in the step.
//!
//! Between the ends of steps only the zone is known ([`Flow::near`]); [`Flow::complete`] makes a state whole by two recurrences from the start of the
//! step. Rounding errors of the two-step formula grow with their number: after some steps the flow begins anew, with two recurrences. Where nothing
//! switches for a whole step there is nothing to save, and the body goes on as one, in long windows, if memory has room for such.

use std::ops::Range;
use std::rc::Rc;

use super::length::Lengths;
use super::nodes::Nodes;
use super::series::{Rows, Share, add_up, extend};
use super::{Chebyshev, Counters, Enclosure, FIRST, Flow, FlowError, LONGEST, Layout, MEMORY};
use crate::contact::distance::NEXT;
use crate::contact::{Phase, Recurrence, System};

/// Lengths of steps that are considered, in `R = t ω_max`.
const STEPS: [f64; 7] = [8.0, 12.0, 16.0, 24.0, 32.0, 48.0, 64.0];
/// Products a unit of `R` where nodes switch one after the other, about: measured 17 at 10⁵ and 23 at 10⁶ displacements.
const RESTARTS: f64 = 17.0;
/// Two bodies must be so much cheaper than one.
const GAIN: f64 = 0.7;
/// Steps by one recurrence until the flow begins anew.
const ANCHOR: usize = 32;

/// How the flow goes.
#[derive(Clone, Copy, PartialEq)]
enum Course {
    /// No phase has begun.
    Fresh,
    /// As one body, in long windows.
    Whole,
    /// In steps of the body, with the zone from switch to switch inside.
    Steps,
}

/// The recurrences by which what is outside of the zone goes through a step.
#[derive(Clone, Copy, PartialEq)]
enum Outside {
    /// That of the accelerations and that of the velocities.
    Both,
    /// That of the accelerations, from the state before the step; so many such steps one after the other.
    Mirrored(usize),
}

/// The flow; see the module's text.
pub struct Zoned<'a> {
    layout: Layout,
    /// The body as one, and its part around the contact.
    whole: Chebyshev<'a>,
    zone: Chebyshev<'a>,
    /// The zone's share of the displacements.
    share: f64,
    /// Displacements that are not taken from the zone at the end of a step.
    outside: Vec<Range<usize>>,
    /// `W`
    length: f64,
    /// Long windows of the body as one cost less than steps.
    windows_pay: bool,
    course: Course,
    /// Start and end of the step; whether a phase began in it.
    step: (f64, f64),
    busy: bool,
    /// States at the start of the step and of the step before, and whether `W` lies between them and the flow goes on in its step.
    start: Vec<f64>,
    before: Vec<f64>,
    has_image: bool,
    by: Outside,
    /// State at the end of the step, once it is known.
    end: Vec<f64>,
    end_known: bool,
    terms: usize,
    /// Pseudo-modes of the step.
    nodes: Option<Rc<Nodes>>,
}

/// Runs of entries for which something holds.
fn runs(n: usize, holds: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = vec![];
    for i in (0..n).filter(|&i| holds(i)) {
        match runs.last_mut().filter(|r| r.end == i) {
            Some(run) => run.end = i + 1,
            None => runs.push(i..i + 1),
        }
    }
    runs
}

/// Ranges of rows that hold all within each distance: of one piece, so that the zone stays a matrix with few runs.
fn reach(distances: &[u32]) -> Vec<Range<usize>> {
    let mut reach: Vec<Range<usize>> = vec![];
    for (i, &d) in distances.iter().enumerate().filter(|(_, d)| **d != u32::MAX) {
        let d = d as usize;
        reach.resize(reach.len().max(d + 1), distances.len()..0);
        reach[d] = reach[d].start.min(i)..reach[d].end.max(i + 1);
    }
    for d in 1..reach.len() {
        let last = reach[d - 1].clone();
        reach[d] = last.start.min(reach[d].start)..last.end.max(reach[d].end);
    }
    reach
}

impl<'a> Zoned<'a> {
    /// The flow, where it is one and costs less than [`Chebyshev`] for the whole body.
    pub fn new(system: &'a System) -> Option<Self> {
        let layout = Layout::new(system);
        let plain = system.is_conservative() && system.is_entire() && system.impact().is_none();
        if !plain || system.n_contact() == 0 || !Recurrence::is_local(system) {
            return None;
        }
        let (n, omega) = (layout.n_o, system.units.highest);
        let distances = system.distances();
        let reach = reach(&distances);
        let mut lengths = Lengths::new(omega, None);
        let plan = |r: f64| {
            let terms = lengths.of(r / omega).terms;
            let rows = reach.get(2 * terms - 2)?.clone();
            let share = rows.len() as f64 / n as f64;
            Some((terms as f64 / r + share * RESTARTS, r, terms, rows))
        };
        let best = STEPS.into_iter().filter_map(plan).min_by(|a, b| a.0.total_cmp(&b.0));
        let (_, r, terms, rows) = best.filter(|b| b.0 < GAIN * RESTARTS)?;
        debug_assert!(terms > NEXT as usize);
        let share = rows.len() as f64 / n as f64;
        let in_steps = terms as f64 / r * (1.0 + 2.0 * share);
        // of two recurrences, in the longest windows that memory has room for
        let mut long = LONGEST;
        while long > FIRST.1 && 2 * n * lengths.of(long / omega).terms > MEMORY {
            long *= 0.5;
        }
        let as_one = 2.0 * lengths.of(long / omega).terms as f64 / long;
        let state = || vec![0.0; layout.len()];
        Some(Zoned {
            layout,
            whole: Chebyshev::new(system),
            share,
            windows_pay: as_one < in_steps,
            zone: Chebyshev::with(system, Recurrence::within(system, rows)),
            outside: runs(n, |i| distances[i] as usize >= terms),
            length: r / omega,
            course: Course::Fresh,
            step: (0.0, 0.0),
            busy: true,
            start: state(),
            before: state(),
            has_image: false,
            by: Outside::Both,
            end: state(),
            end_known: true,
            terms,
            nodes: None,
        })
    }

    fn steps(&self) -> bool {
        self.course == Course::Steps
    }

    /// The part of the body that switches are looked for in.
    fn active(&self) -> &Chebyshev<'a> {
        if self.steps() { &self.zone } else { &self.whole }
    }

    fn active_mut(&mut self) -> &mut Chebyshev<'a> {
        if self.steps() { &mut self.zone } else { &mut self.whole }
    }

    /// Whether the last window ended in the midst of a step.
    fn is_inside(&self) -> bool {
        self.steps() && self.zone.window().1 < self.step.1
    }

    /// Begin the next step at the end of the last one.
    fn next_step(&mut self, phase: &Phase, t_limit: f64) {
        self.end_state();
        std::mem::swap(&mut self.before, &mut self.start);
        std::mem::swap(&mut self.start, &mut self.end);
        self.end_known = false;
        let t = self.step.1;
        let is_last = t_limit - t < self.length * (1.0 + 1e-9);
        self.step = (t, if is_last { t_limit } else { t + self.length });
        self.busy = false;
        // to rounding errors of the time
        let is_whole = (self.step.1 - (t + self.length)).abs() <= 4.0 * f64::EPSILON * self.step.1;
        let count = if let Outside::Mirrored(count) = self.by { count } else { 0 };
        let mirrors = self.has_image && is_whole && count < ANCHOR;
        self.has_image = is_whole;
        self.by = if mirrors { Outside::Mirrored(count + 1) } else { Outside::Both };
        self.zone.go_on(t, &self.start);
        self.whole.go_on(t, &self.start);
        self.whole.accelerate(phase);
        self.terms = self.whole.lengths.of(self.step.1 - t).terms;
        self.nodes = Some(self.whole.lengths.nodes(self.terms));
        self.whole.a.begin(&self.whole.a0, 0..self.layout.n_o, phase);
        self.recur(phase, !mirrors);
    }

    /// The recurrences from the start of the step that are still missing: of accelerations, or of velocities, too.
    fn recur(&mut self, phase: &Phase, of_velocities: bool) {
        let n = self.layout.n_o;
        let rows = Rows { phase, forces: &[], n_o: n };
        let all = &mut self.whole;
        let (recurrence, scratch) = (&all.recurrence, &mut all.scratch);
        if of_velocities {
            all.v.begin(&self.start[n..2 * n], 0..n, phase);
        }
        all.counters.products += match (of_velocities, all.a.is_known(self.terms)) {
            (true, false) => {
                extend([&mut all.v, &mut all.a], self.terms, recurrence, &rows, scratch)
            }
            (true, true) => extend([&mut all.v], self.terms, recurrence, &rows, scratch),
            (false, _) => extend([&mut all.a], self.terms, recurrence, &rows, scratch),
        };
    }

    /// The state at a time of the step: what is outside by the recurrences, what is inside from the zone, whose window ends there.
    fn join(&self, t: f64, y: &mut [f64]) {
        let n = self.layout.n_o;
        let Some(nodes) = &self.nodes else { return };
        let f = nodes.functions(t - self.step.0);
        let twice = |f: &[f64]| f.iter().map(|f| 2.0 * f).collect::<Vec<f64>>();
        let (of_a, of_v) = (&self.whole.a, &self.whole.v);
        let shares = match self.by {
            Outside::Mirrored(_) => {
                vec![Share::new(of_a, nodes, [&twice(&f.integral), &twice(&f.g)])]
            }
            Outside::Both => vec![
                Share::new(of_a, nodes, [&f.integral, &f.g]),
                Share::new(of_v, nodes, [&f.g, &f.rate]),
            ],
        };
        let (start, before) = (&self.start, &self.before);
        self.zone.state(t, y);
        let (u, rest) = y.split_at_mut(n);
        let v = &mut rest[..n];
        for rows in &self.outside {
            for i in rows.clone() {
                (u[i], v[i]) = match self.by {
                    Outside::Mirrored(_) => (2.0 * start[i] - before[i], before[n + i]),
                    Outside::Both => (start[i], 0.0),
                };
            }
            add_up(&shares, rows.clone(), u, v);
        }
    }

    /// The state at the end of the last window, from now on.
    fn join_end(&mut self) {
        let mut end = std::mem::take(&mut self.end);
        self.join(self.zone.window().1, &mut end);
        self.end = end;
        self.end_known = true;
    }
}

impl Flow for Zoned<'_> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        self.busy = true;
        // a switch in the midst of a step
        if self.is_inside() && t == self.zone.window().1 {
            return self.zone.begin(phase, t, y);
        }
        // a run may go on from here later, and knows no state before
        self.has_image = false;
        self.step = (t, t);
        self.course = match self.course {
            Course::Fresh => Course::Whole,
            Course::Whole | Course::Steps => Course::Steps,
        };
        if !self.steps() {
            self.whole.begin(phase, t, y);
        }
        self.end.copy_from_slice(y);
        self.end_known = true;
        self.zone.begin(phase, t, y);
    }

    fn advance(&mut self, phase: &Phase, t_limit: f64) -> Result<(), FlowError> {
        if self.steps() && !self.is_inside() {
            if !self.busy && self.windows_pay {
                // nothing to save
                self.end_state();
                self.whole.begin(phase, self.step.1, &self.end);
                self.course = Course::Whole;
                self.whole.length = Some(2.0 * self.length * self.whole.omega);
            } else if self.step.1 < t_limit {
                self.next_step(phase, t_limit);
            }
        }
        let limit = if self.steps() { self.step.1 } else { t_limit };
        self.active_mut().advance(phase, limit)
    }

    fn cut(&mut self, phase: &Phase, t: f64) {
        self.active_mut().cut(phase, t);
        self.end_known = false;
    }

    fn window(&self) -> (f64, f64) {
        self.active().window()
    }

    fn end_state(&mut self) -> &[f64] {
        if !self.steps() || self.is_inside() {
            return self.active_mut().end_state();
        }
        if !self.end_known {
            self.join_end();
        }
        &self.end
    }

    fn state(&self, t: f64, y: &mut [f64]) {
        match self.steps() && self.near(t).is_none() {
            true if self.end_known => y.copy_from_slice(&self.end),
            true => self.join(t, y),
            false => self.active().state(t, y),
        }
    }

    fn near(&self, t: f64) -> Option<Range<usize>> {
        let is_end = !self.is_inside() && t == self.step.1;
        (self.steps() && !is_end).then(|| self.zone.recurrence.rows())
    }

    fn complete(&mut self, phase: &Phase) {
        if self.is_inside() {
            let t = self.zone.window().1;
            if self.by != Outside::Both {
                self.recur(phase, true);
                self.by = Outside::Both;
            }
            self.join_end();
            self.step.1 = t;
            self.has_image = false;
        }
    }

    fn is_anchor(&self) -> bool {
        let is_due = matches!(self.by, Outside::Mirrored(count) if count >= ANCHOR);
        self.steps() && is_due && !self.is_inside()
    }

    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        self.active().enclose(index, a, b)
    }

    /// Products with the zone's part of the body count by its share.
    fn counters(&self) -> Counters {
        let (whole, zone) = (self.whole.counters(), self.zone.counters());
        let share = (zone.products as f64 * self.share).round() as u64;
        whole + Counters { products: share, ..zone }
    }

    fn name(&self) -> &'static str {
        "chebyshev"
    }

    // theory §12, H1
    fn is_exact(&self) -> bool {
        true
    }

    /// In the zone as in the step.
    fn deviations(&self) -> Vec<f64> {
        self.active().deviations().into_iter().map(|d| 2.0 * d).collect()
    }

    fn note(&self) -> Option<String> {
        let percent = (100.0 * self.share).round();
        Some(format!(
            "chebyshev: the {percent:.0} % of the body around the contact from switch to switch, everything else in steps"
        ))
    }

    fn memory(&self) -> Vec<f64> {
        vec![self.zone.distance, f64::from(u8::from(self.steps()))]
    }

    fn recall(&mut self, memory: &[f64]) {
        self.zone.distance = memory[0];
        self.course = match (memory[1] != 0.0, self.course) {
            // a phase with held nodes may come first, which another flow takes
            (true, _) => Course::Steps,
            (false, Course::Fresh) => Course::Fresh,
            (false, _) => Course::Whole,
        };
    }
}
