//! The quasi-static driver: a body without inertia under loads that go along straight lines in time.
//!
//! With the loads of a time a balance holds at every instant,
//!
//! ```text
//! K_α u_O + Σ e_t r_t = f_α(t),      r_t ∈ μ r_n Sgn(u̇_t − V),      0 ≤ w ⟂ r_n ≥ 0
//! ```
//!
//! and where the loads go along a straight line everything is a piecewise linear function of time. In a phase (`w = 0` where points touch, `u_t = τ + V t` where they stick,
//! `r_t = σ μ r_n` where they slip) the state at the end of the line is one linear system, the monitors are linear on the way there, and the first that reaches zero ends the phase: all
//! switches are exact. Which phase follows is decided by rates: points at a boundary between states, and all that slip, take the states whose conditions hold behind it.
//! A point that slips may stick at any switch: rates jump there.

use std::ops::ControlFlow;

use crate::contact::{
    MonitorKind, Phase, PointState, State, States, System, leading, monitor_tolerance,
    static_displacement,
};
use crate::event::{
    Checkpoint, Energies, Ledger, Log, Marched, Observer, Options, Outcome, Proof, Report, Resumed,
    Rubbed, RunError, Sample, Switch, SwitchKind,
};
use crate::fem::Measured;
use crate::flow::Counters;

/// Rounds in which all points whose conditions fail change together; after these one at a time.
const TOGETHER: usize = 10;
/// So many switches a point at one instant are no motion.
const STALLED: usize = 20;
/// A slip rate below this part of the largest one is none.
const STILL: f64 = 1e-11;

/// The loads along straight lines between the points of their tables.
struct Path {
    constant: Option<Vec<f64>>,
    courses: Vec<Measured>,
    /// Where a line ends, up to the end of the run.
    corners: Vec<f64>,
}

impl Path {
    fn new(system: &System, until: f64) -> Path {
        let loads = &system.loads;
        let times = loads.measured.iter().flat_map(|m| m.history.times());
        let mut corners: Vec<f64> =
            times.copied().filter(|t| *t > 0.0 && *t < until).chain([until]).collect();
        corners.sort_by(f64::total_cmp);
        corners.dedup();
        Path { constant: loads.constant.clone(), courses: loads.measured.clone(), corners }
    }

    /// All loads at a time.
    fn force(&self, n: usize, t: f64) -> Vec<f64> {
        let mut force = self.constant.clone().unwrap_or_else(|| vec![0.0; n]);
        for course in &self.courses {
            let size = course.history.straight(t);
            force.iter_mut().zip(&course.force).for_each(|(f, a)| *f += size * a);
        }
        force
    }
}

/// All that is linear in time on a line, at a time.
#[derive(Clone)]
struct Instant {
    t: f64,
    /// All displacements.
    u: Vec<f64>,
    force: Vec<f64>,
    pressure: Vec<f64>,
    /// Of the obstacle on the body along the tangents.
    traction: Vec<f64>,
}

impl Instant {
    /// A share of the way to another one.
    fn towards(&self, end: &Instant, share: f64) -> Instant {
        let between = |a: &[f64], b: &[f64]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
        };
        Instant {
            t: self.t + share * (end.t - self.t),
            u: between(&self.u, &end.u),
            force: between(&self.force, &end.force),
            pressure: between(&self.pressure, &end.pressure),
            traction: between(&self.traction, &end.traction),
        }
    }
}

/// What was handed round since the start.
#[derive(Clone)]
struct Books {
    external: f64,
    belt: f64,
    /// Of each contact point: what friction took, how far it slipped.
    points: Vec<(f64, f64)>,
}

impl Books {
    /// With what happens between two instants on a line.
    fn after(&self, (system, set): (&System, &States), a: &Instant, b: &Instant) -> Books {
        let mut books = self.clone();
        let mean = |x: &[f64], y: &[f64], i: usize| 0.5 * (x[i] + y[i]);
        books.external +=
            (0..a.u.len()).map(|i| mean(&a.force, &b.force, i) * (b.u[i] - a.u[i])).sum::<f64>();
        for (i, point) in books.points.iter_mut().enumerate() {
            let Some(tangent) = system.tangent(i) else { continue };
            let force = mean(&a.traction, &b.traction, i) * system.constraints[i].area;
            let carried = tangent.surface * (b.t - a.t);
            books.belt += force * carried;
            // what sticks by a spring moves
            if set.at(i).slip().is_none() {
                continue;
            }
            let slip = tangent.along(&b.u) - tangent.along(&a.u) - carried;
            point.0 -= force * slip;
            point.1 += slip.abs();
        }
        books
    }

    /// The numbers, to be kept.
    fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let points = self.points.iter().flat_map(|p| [p.0, p.1]);
        [self.external, self.belt].into_iter().chain(points)
    }

    fn of_numbers(x: &[f64]) -> Books {
        let points = x[2..].chunks_exact(2).map(|p| (p[0], p[1])).collect();
        Books { external: x[0], belt: x[1], points }
    }
}

/// A phase at the two ends of a line, under the loads there, with `u_O` and the monitors.
struct End {
    t: f64,
    phase: Phase,
    u: Vec<f64>,
    h: Vec<f64>,
    /// What counts as zero of each monitor.
    least: Vec<f64>,
}

impl End {
    fn new(system: &System, t: f64, phase: Phase, u: Vec<f64>) -> End {
        let mut h = vec![0.0; phase.monitors.len()];
        phase.monitor_undriven(&u, &vec![0.0; u.len()], &mut h);
        let least = monitor_tolerance(system, &phase, &u);
        End { t, phase, u, h, least }
    }

    /// All that is linear in time on the way to the other end.
    fn instant(&self, system: &System, force: Vec<f64>) -> Instant {
        let points = system.n_contact();
        let mut instant = Instant {
            t: self.t,
            u: vec![0.0; system.n()],
            force,
            pressure: vec![0.0; points],
            traction: vec![0.0; points],
        };
        let still = vec![0.0; self.u.len()];
        self.phase.expand_displacement(self.t, &self.u, &mut instant.u);
        self.phase.pressures(self.t, &self.u, &mut instant.pressure);
        self.phase.tractions(self.t, (&self.u, &still), &mut instant.traction);
        instant
    }
}

struct Driver<'a, O: Observer> {
    /// With the loads of one time as constant ones.
    system: System,
    path: Path,
    options: &'a Options,
    observer: &'a mut O,
    t: f64,
    u: Vec<f64>,
    set: States,
    /// The monitor that ended the last phase, with its rate.
    found: Option<(usize, MonitorKind, f64)>,
    books: Books,
    /// The present state, and the ends of the line that led to it.
    last: Option<[Instant; 3]>,
    ledger: Ledger,
    log: Log,
    next_sample: usize,
    stored: usize,
    penetration: f64,
    tension: f64,
    solved: u64,
}

/// Take a body through its loads without inertia.
pub fn run<O: Observer>(
    system: &System,
    resumed: Option<Resumed>,
    options: &Options,
    observer: &mut O,
) -> Result<Report, RunError<O::Error>> {
    let path = Path::new(system, options.until);
    let mut own = system.clone();
    own.loads_mut().measured.clear();
    let log = Log::new(!observer.takes_events());
    let points = vec![(0.0, 0.0); system.n_contact()];
    let mut driver = Driver {
        u: vec![0.0; system.n_o()],
        set: States::open(system.n_contact()),
        system: own,
        path,
        options,
        observer,
        t: 0.0,
        found: None,
        books: Books { external: 0.0, belt: 0.0, points },
        last: None,
        ledger: Ledger::default(),
        log,
        next_sample: 1,
        stored: 0,
        penetration: 0.0,
        tension: 0.0,
        solved: 0,
    };
    let outcome = match resumed {
        Some(resumed) => {
            driver.go_on(resumed);
            driver.drive()?
        }
        None if driver.start() => driver.drive()?,
        None => {
            driver.sample_last()?;
            driver.unresolved()
        }
    };
    Ok(driver.report(outcome))
}

impl<O: Observer> Driver<'_, O> {
    /// The balance under the loads at the start, with which the books are opened; whether there is one.
    fn start(&mut self) -> bool {
        self.load(0.0);
        let found = self.system.equilibrium();
        let is_balanced = found.is_ok();
        if let Ok((set, u)) = found {
            (self.set, self.u) = (set, u);
        }
        let begin = End::new(&self.system, 0.0, self.system.phase(&self.set), self.u.clone());
        let now = begin.instant(&self.system, self.path.force(self.system.n(), 0.0));
        self.ledger = Ledger::new(self.energies(&now, &self.books));
        self.last = Some([now.clone(), now.clone(), now]);
        is_balanced
    }

    fn go_on(&mut self, resumed: Resumed) {
        let Resumed { checkpoint: c, log } = resumed;
        let n = self.u.len();
        self.t = c.t;
        self.u.copy_from_slice(&c.y[..n]);
        let (books, found) = c.y[2 * n..].split_at(c.y.len() - 2 * n - 3);
        self.books = Books::of_numbers(books);
        let kind = MonitorKind::ALL.get(found[1] as usize).filter(|_| found[0] > 0.0);
        self.found = kind.map(|kind| (found[0] as usize - 1, *kind, found[2]));
        self.set = c.states;
        self.ledger = Ledger::of_numbers(c.ledger);
        (self.next_sample, self.stored) = (c.next_sample, c.rows[0]);
        (self.penetration, self.tension) = (c.seen.gap_error, c.seen.blows);
        self.log = log;
    }

    fn drive(&mut self) -> Result<Outcome, RunError<O::Error>> {
        while let Some(corner) = self.path.corners.iter().copied().find(|c| *c > self.t) {
            let mut at_once = 0;
            while self.t < corner {
                let Some(ends) = self.line(corner) else {
                    self.sample_last()?;
                    return Ok(self.unresolved());
                };
                self.tell_switches(&ends.0.phase.set)?;
                let before = self.t;
                self.follow(&ends.0, &ends.1)?;
                at_once = if self.t > before { 0 } else { at_once + 1 };
                if at_once > STALLED * self.system.n_contact().max(1) {
                    self.sample_last()?;
                    return Ok(self.unresolved());
                }
                let go = self.observer.progress(self.t).map_err(RunError::Observer)?;
                if matches!(go, ControlFlow::Break(())) && self.t < self.options.until {
                    return Ok(Outcome::Interrupted { t: self.t });
                }
            }
        }
        self.sample_last()?;
        Ok(Outcome::EndTime)
    }

    /// Store the last state, behind which no line begins.
    fn sample_last(&mut self) -> Result<(), RunError<O::Error>> {
        let Some([stop, a, b]) = self.last.take() else { return Ok(()) };
        let books = self.books.clone();
        self.sample(&stop, (&a, &b), &books)
    }

    fn unresolved(&self) -> Outcome {
        let touching = (0..self.set.len()).filter(|i| self.set.at(*i).touches());
        let nodes = touching.map(|i| self.system.constraints[i].node).collect();
        Outcome::Unresolved { t: self.t, nodes }
    }

    /// Put the loads of a time on the body.
    fn load(&mut self, t: f64) {
        let force = self.path.force(self.system.n(), t);
        self.system.loads_mut().constant = Some(force);
    }

    /// The phase of some states under the loads of a time.
    fn phase(&mut self, set: &States, t: f64) -> Phase {
        self.load(t);
        self.system.phase(set)
    }

    /// The phase behind the present instant, here and at the end of the line; none where no states are found, or nothing holds the body in them.
    fn line(&mut self, end: f64) -> Option<(End, End)> {
        let (points, dt) = (self.set.len(), end - self.t);
        let mut set = self.set.clone();
        for round in 0..TOGETHER + 20 * points {
            let mut from = self.u.clone();
            let sticks = |i: usize| set.at(i) == PointState::Stick;
            for i in (0..points).filter(|i| sticks(*i)) {
                if let Some(slider) = self.system.slider(i) {
                    slider.settle(&mut from);
                }
            }
            let now = self.phase(&set, self.t);
            let then = self.phase(&set, end);
            let held: Vec<f64> = then
                .stuck()
                .iter()
                .map(|(row, v)| row.iter().map(|&(j, w)| w * from[j]).sum::<f64>() + v * dt)
                .collect();
            self.solved += 1;
            let to = static_displacement(&then, &held)?;
            let a = End::new(&self.system, self.t, now, from);
            let b = End::new(&self.system, end, then, to);
            let moves = self.violations(&a, &b);
            if moves.is_empty() {
                return Some((a, b));
            }
            let count = if round < TOGETHER { moves.len() } else { 1 };
            moves[..count].iter().for_each(|&(i, state)| set.set(i, state));
        }
        None
    }

    /// The points at a boundary whose conditions fail behind it, and their neighbouring states.
    fn violations(&self, a: &End, b: &End) -> Vec<(usize, PointState)> {
        let largest = b.u.iter().zip(&a.u).fold(0.0f64, |m, (b, a)| m.max((b - a).abs()));
        let mut moves: Vec<(usize, PointState)> = vec![];
        for (k, monitor) in a.phase.monitors.iter().enumerate() {
            let i = monitor.point;
            let state = a.phase.set.at(i);
            let tangent = self.system.tangent(i);
            let slip = tangent.map(|t| t.along(&b.u) - t.along(&a.u) - t.surface * (b.t - a.t));
            let s = slip.unwrap_or(0.0);
            let fails = match monitor.kind {
                MonitorKind::Slip => state.slip().unwrap_or(0.0) * s < -STILL * largest,
                _ => a.h[k] <= a.least[k] && b.h[k] < -b.least[k],
            };
            if !fails || moves.last().is_some_and(|m| m.0 == i) {
                continue;
            }
            // a point that closes slips the way it moves
            let closes = !state.touches() && tangent.is_some();
            let next = match closes {
                true if s.abs() <= STILL * largest => PointState::Stick,
                true => PointState::of_slip(s),
                false => monitor.to,
            };
            moves.push((i, next));
        }
        moves
    }

    /// Go along a line to its end, or to the first monitor that reaches zero.
    fn follow(&mut self, from: &End, to: &End) -> Result<(), RunError<O::Error>> {
        let mut share = 1.0;
        self.found = None;
        for (k, monitor) in from.phase.monitors.iter().enumerate() {
            let (h, ahead) = (from.h[k], to.h[k]);
            let falls = h > from.least[k] && ahead < -to.least[k];
            if monitor.kind != MonitorKind::Slip && falls && h / (h - ahead) < share {
                share = h / (h - ahead);
                let rate = (ahead - h) / (to.t - from.t);
                self.found = Some((monitor.point, monitor.kind, rate));
            }
        }
        let n = self.system.n();
        let a = from.instant(&self.system, self.path.force(n, from.t));
        let b = to.instant(&self.system, self.path.force(n, to.t));
        let stop = if share < 1.0 { a.towards(&b, share) } else { b.clone() };
        // rates jump where a line begins: a state is stored with those behind it
        let begun = self.books.clone();
        if stop.t > a.t {
            self.sample(&a, (&a, &b), &begun)?;
        }
        // stored states on the way
        let (until, samples) = (self.options.until, self.options.samples);
        let due = |k: usize| until * k as f64 / samples as f64;
        while self.next_sample < samples && due(self.next_sample) <= stop.t {
            let t = due(self.next_sample);
            self.next_sample += 1;
            if t > a.t && t < stop.t {
                let middle = a.towards(&b, (t - a.t) / (b.t - a.t));
                let books = begun.after((&self.system, &self.set), &a, &middle);
                self.sample(&middle, (&a, &b), &books)?;
            }
        }
        self.books = begun.after((&self.system, &self.set), &a, &stop);
        self.u = match share < 1.0 {
            true => from.u.iter().zip(&to.u).map(|(a, b)| a + share * (b - a)).collect(),
            false => to.u.clone(),
        };
        self.t = stop.t;
        self.last = Some([stop, a, b]);
        self.keep();
        Ok(())
    }

    fn energies(&self, at: &Instant, books: &Books) -> Energies {
        Energies {
            elastic: self.system.elastic(at.t, &at.u),
            external: books.external,
            belt: books.belt,
            friction: books.points.iter().map(|p| p.0).sum(),
            ..Energies::default()
        }
    }

    fn tell_switches(&mut self, next: &States) -> Result<(), RunError<O::Error>> {
        // a corner of the loads may change nothing
        if *next == self.set {
            return Ok(());
        }
        let present = self.set.clone();
        let monitors = self.phase(&present, self.t).monitors.clone();
        let found = self.found.map_or(usize::MAX, |f| f.0);
        let (first, others): (Vec<_>, Vec<_>) =
            present.changes(next).partition(|change| change.0 == found);
        let mut before = present.clone();
        for (point, from, to) in first.into_iter().chain(others) {
            let leads = leading(&monitors, point, to).map(|k| monitors[k].kind);
            let of_found = self.found.filter(|f| f.0 == point).map(|f| (f.1, f.2));
            let watched = self.system.law().watched(from);
            let (monitor, monitor_rate) = of_found.unwrap_or((leads.unwrap_or(watched), 0.0));
            let after = before.with(point, to);
            let change = Switch {
                t: self.t,
                point,
                node: self.system.constraints[point].node,
                kind: SwitchKind::of_states(from, to),
                monitor,
                monitor_rate,
                energy_jump: 0.0,
                struck: vec![],
                before,
                after: after.clone(),
            };
            before = after;
            self.log.switch(change, self.observer).map_err(RunError::Observer)?;
        }
        self.set = next.clone();
        Ok(())
    }

    /// Store a state of a line.
    fn sample(
        &mut self,
        at: &Instant,
        (begin, end): (&Instant, &Instant),
        books: &Books,
    ) -> Result<(), RunError<O::Error>> {
        // at the very start there is no line yet
        let dt = (end.t - begin.t).max(f64::MIN_POSITIVE);
        let rate: Vec<f64> = end.u.iter().zip(&begin.u).map(|(b, a)| (b - a) / dt).collect();
        let energies = self.energies(at, books);
        self.ledger.note(&energies);
        self.penetration = self.penetration.max(self.system.penetration(&at.u));
        self.tension = at.pressure.iter().fold(self.tension, |m, p| m.max(-p));
        let rubs = self.system.tangents().is_some();
        // without inertia
        let still = vec![0.0; at.u.len()];
        let sample = Sample {
            t: at.t,
            u: &at.u,
            v: &rate,
            a: &still,
            active: &self.set,
            pressure: &at.pressure,
            traction: if rubs { &at.traction } else { &[] },
            energies: Some(energies),
            jumps: 0.0,
        };
        self.observer.sample(&sample).map_err(RunError::Observer)?;
        self.stored += 1;
        Ok(())
    }

    /// All that is needed to go on from here.
    fn keep(&mut self) {
        if self.observer.keeps_checkpoints() {
            // velocities have no part in it, and a state has a place for them
            let rates = self.u.iter().map(|_| 0.0);
            let found = self.found.map_or([0.0; 3], |(point, kind, rate)| {
                let of = MonitorKind::ALL.iter().position(|k| *k == kind).unwrap_or(0);
                [point as f64 + 1.0, of as f64, rate]
            });
            let state =
                self.u.iter().copied().chain(rates).chain(self.books.numbers()).chain(found);
            let counts = [self.next_sample, self.stored, self.log.switches()];
            let sizes = (self.penetration, self.tension);
            let at = (self.t, state.collect());
            self.observer.phase(Checkpoint::marched(at, &self.set, &self.ledger, sizes, counts));
        }
    }

    fn report(self, outcome: Outcome) -> Report {
        let rubs = self.system.tangents().is_some();
        let rubbed = Rubbed { belt: self.books.belt, points: self.books.points };
        let v = vec![0.0; self.u.len()];
        let marched = Marched {
            outcome,
            t_end: self.t,
            last: (State { u: self.u, v }, self.set),
            log: self.log,
            // linear functions hide no roots
            proof: Proof::default(),
            counters: Counters { steps: self.solved, ..Counters::default() },
            note:
                "no inertia, loads along straight lines: everything is linear from switch to switch"
                    .into(),
        };
        Report {
            energy_external: self.books.external,
            rubbed: rubs.then_some(rubbed),
            max_penetration: self.penetration,
            gap_error: self.penetration,
            max_tension: self.tension,
            ..Report::of(marched, &self.ledger)
        }
    }
}
