//! The certified search of switches against a witness that shares no code with it.
//!
//! Random states of random small bodies ([`super::bodies`]) are integrated by the program with its exact modal flow and by the safe
//! march of [`super::witness`]. Every switch of the one must have its partner in the other ([`super::agreement`]): the same node, the same
//! direction, the same time to 10⁻⁹ of the longest period; and the final states must agree. A switch of the witness without a
//! partner was *missed* by the program; one of the program without a partner was *invented*, or repeated.
//!
//! Two kinds of motion are not compared to their end, counted, and bounded in number. Where a motion *grazes*, the witness stops, and only
//! what came before is compared. And a motion can be so *sensitive* that rounding errors decide: where a difference shows, the
//! witness integrates four times more, with random errors of the size of rounding errors in the initial state (10⁻¹³, or
//! `ε (ω_max/ω_min)²` where that is more) and in every monitor that has just switched (8ε). If it parts with itself no later than the program did with it, or if
//! the times and states of one sequence lie no further apart than ten times what these errors make, the difference says nothing.

use rayon::prelude::*;

use signorini::contact::State;
use signorini::event::{self, Options, Report, Silent, Switch, SwitchKind};
use signorini::flow::{Flow, Tolerances};
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

use super::super::{Case, Check};
use super::agreement::{Agreement, Alone, REACH};
use super::bodies::RandomBody;
use super::witness::{Change, Course};

/// A million states, by name only.
pub const MILLION: Case = Case {
    name: "hard-million",
    title: "a million random states of random bodies: the certified search of switches against a safe march",
    source: "an independent integration from the matrices alone",
    only_by_name: true,
    run: |effort| {
        let mut checks = vec![];
        against_witness(if effort.short { 10_000 } else { 1_000_000 }, &mut checks)?;
        Ok(checks)
    },
};

/// Times agree to this fraction of the longest period of the open body.
const TIME: f64 = 1e-9;
/// Final displacements and velocities agree to this fraction of the largest of the motion.
const STATE: f64 = 1e-7;
/// Differences up to so many times what the disturbances make are theirs.
const FACTOR: f64 = 10.0;
/// Switches after which a motion is followed no further: rounding errors grow with every one.
const SWITCHES: usize = 16;
/// States of one body.
const STATES: u64 = 100;
/// A contact or a gap shorter than this, in periods, is brief.
const BRIEF: f64 = 0.01;

/// What was seen.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    switches: u64,
    brief: u64,
    together: u64,
    missed: u64,
    late: u64,
    invented: u64,
    moved: u64,
    unfinished: u64,
    grazing: u64,
    sensitive: u64,
    worst_time: f64,
    worst_state: f64,
}

impl Tally {
    /// Sums and maxima: the order of the bodies leaves no trace.
    fn plus(self, other: Tally) -> Tally {
        Tally {
            switches: self.switches + other.switches,
            brief: self.brief + other.brief,
            together: self.together + other.together,
            missed: self.missed + other.missed,
            late: self.late + other.late,
            invented: self.invented + other.invented,
            moved: self.moved + other.moved,
            unfinished: self.unfinished + other.unfinished,
            grazing: self.grazing + other.grazing,
            sensitive: self.sensitive + other.sensitive,
            worst_time: self.worst_time.max(other.worst_time),
            worst_state: self.worst_state.max(other.worst_state),
        }
    }

    /// How much there was to find.
    fn note_course(&mut self, course: &Course, period: f64) {
        let changes = &course.changes;
        self.switches += changes.len() as u64;
        self.grazing += u64::from(course.grazes);
        for (i, x) in changes.iter().enumerate() {
            let before = changes[..i].iter().rfind(|y| y.contact == x.contact);
            self.brief += u64::from(before.is_some_and(|y| x.t - y.t < BRIEF * period));
            self.together += u64::from(i > 0 && x.t - changes[i - 1].t <= TIME * period);
        }
    }
}

/// A body and the flow that keeps the eigenbases of its phases from state to state.
struct Comparison<'a> {
    body: &'a RandomBody,
    flow: Box<dyn Flow + 'a>,
    tally: Tally,
}

impl Comparison<'_> {
    /// One state both ways.
    fn add(&mut self, state: &State) -> Result<(), String> {
        let RandomBody { witness, problem, until, .. } = self.body;
        let course = witness.integrate(&state.u, &state.v, *until, SWITCHES);
        self.tally.note_course(&course, witness.period);
        // the program goes on through a grazing: what comes after it is not compared
        let until = if course.grazes { *until } else { course.end };
        let options = Options { until, samples: 1, switch_limit: 40.0 };
        let flow = self.flow.as_mut();
        let report = event::run(&problem.system, state, &options, flow, &mut Silent)
            .map_err(|e| e.to_string())?;
        self.tally.late += report.proof.missed as u64;
        if !report.outcome.is_complete() {
            self.tally.unfinished += u64::from(!course.grazes);
            return Ok(());
        }
        self.judge(state, &course, &of_program(report, &course));
        Ok(())
    }

    fn judge(&mut self, state: &State, course: &Course, other: &Course) {
        let agreement = Agreement::new(course, other, self.body.witness.period);
        let tally = &mut self.tally;
        if let Some((at, alone)) = agreement.alone {
            let blur = REACH * self.body.witness.period;
            if disturbed(self.body, state, course).any(|(a, c)| a.parts_by(at + blur, &c)) {
                tally.sensitive += 1;
            } else if alone == Alone::Missed {
                tally.missed += 1;
            } else {
                tally.invented += 1;
            }
        } else if agreement.time > TIME || agreement.state > STATE {
            // the same switches, but further apart than they ought to be
            let (mut times, mut states, mut parts) = (TIME, STATE, false);
            for (a, c) in disturbed(self.body, state, course) {
                times = times.max(FACTOR * a.time);
                states = states.max(FACTOR * a.state);
                parts |= a.parts_by(course.end, &c);
            }
            let theirs = agreement.time <= times && agreement.state <= states;
            *(if parts || theirs { &mut tally.sensitive } else { &mut tally.moved }) += 1;
        } else {
            tally.worst_time = tally.worst_time.max(agreement.time);
            tally.worst_state = tally.worst_state.max(agreement.state);
        }
    }
}

/// The witness with rounding errors of other signs, compared with itself.
fn disturbed<'a>(
    body: &'a RandomBody,
    state: &'a State,
    course: &'a Course,
) -> impl Iterator<Item = (Agreement, Course)> + 'a {
    (0..4).map(move |seed| {
        let other = body.witness.disturbed(&state.u, &state.v, course.end, seed);
        (Agreement::new(course, &other, body.witness.period), other)
    })
}

/// The program's run in the words of the witness.
fn of_program(report: Report, course: &Course) -> Course {
    let change =
        |x: &Switch| Change { t: x.t, contact: x.point, closes: x.kind == SwitchKind::Close };
    Course {
        changes: report.switches.iter().map(change).collect(),
        end: report.t_end,
        u: report.last.u,
        v: report.last.v,
        largest: course.largest,
        grazes: false,
    }
}

/// All states of one body.
fn compare_body(number: u64) -> Result<Tally, String> {
    let body = RandomBody::new(number)?;
    let tolerances = Tolerances { rtol: 1e-12, atol: 1e-15 };
    let flow = by_name(Integrator::Modal, &body.problem.system, tolerances);
    let mut comparison = Comparison { body: &body, flow, tally: Tally::default() };
    for k in 0..STATES {
        comparison.add(&body.state(k))?;
    }
    Ok(comparison.tally)
}

/// `count` states, a hundred of each body.
pub fn against_witness(count: u64, checks: &mut Vec<Check>) -> Result<(), String> {
    let tally = (0..count / STATES)
        .into_par_iter()
        .map(compare_body)
        .try_reduce(Tally::default, |a, b| Ok(a.plus(b)))?;
    let name = |what: &str| format!("{count} states, safe march: {what}");
    let share = |n: u64| n as f64 / count as f64;
    checks.extend([
        Check::at_least(name("switches in all"), tally.switches as f64, 5.0 * count as f64),
        Check::at_least(name("after < 1 % of a period"), share(tally.brief), 0.1),
        Check::at_least(name("simultaneous switches"), share(tally.together), 0.1),
        Check::near(name("missed"), tally.missed as f64, 0.0, 0.0),
        Check::near(name("seen only by the complementarity problem"), tally.late as f64, 0.0, 0.0),
        Check::near(name("invented or repeated"), tally.invented as f64, 0.0, 0.0),
        Check::near(name("displaced"), tally.moved as f64, 0.0, 0.0),
        Check::near(name("runs not finished"), tally.unfinished as f64, 0.0, 0.0),
        Check::at_most(name("grazing, share"), share(tally.grazing), 1e-3),
        Check::at_most(name("sensitive, share"), share(tally.sensitive), 3e-3),
        Check::at_most(name("times, in periods"), tally.worst_time, TIME),
        Check::at_most(name("final states"), tally.worst_state, STATE),
    ]);
    Ok(())
}
