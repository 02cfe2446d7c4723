//! Switches of the impact law: velocities jump, points stay on the obstacle or fly on.
//!
//! Rebounds under `0 < e < 1` shrink geometrically and accumulate. A rebound of velocity `v` flies `v²/2a` high: at a millionth of the largest velocity that the
//! motion has had at a switch that is a rounding error of the displacements. There the point sticks, `v := 0`, and the switch says so. The velocities of the present
//! are no measure: where nothing but the rebounding points moves, they shrink with the rebounds.

use super::{
    Done, MonitorKind, Observer, Outcome, PointState, Root, Run, RunError, States, Switch,
    SwitchKind,
};
use crate::contact::lcp::UNITS;
use crate::contact::{ContactError, Impact};

/// A rebound slower than this, over the largest velocity of the body so far, sticks.
const STICKS: f64 = 1e-6;
/// A velocity or an impulse below this, over that of the body, is a rounding error.
const ROUNDING: f64 = 1e-12;

/// A state further inside the obstacle than this, over its displacements, is no rounding error.
const INSIDE: f64 = 1e-9;

/// What the points that touch do next.
#[derive(Debug, Default)]
pub(super) struct Meeting {
    /// Points that were hit.
    hit: Vec<usize>,
    /// Of these, points whose rebound was cut off.
    resting: Vec<usize>,
    /// Points that are held from now on.
    staying: Vec<usize>,
}

/// How many rebounds end below the cut-off: of a restitution near one, very many.
pub(super) fn rebounds(e: f64) -> f64 {
    if e > 0.0 && e < 1.0 { 1.0 + STICKS.ln() / e.ln() } else { 1.0 }
}

impl<O: Observer> Run<'_, O> {
    /// The switch of an impact law at the state of the run.
    pub(super) fn impact(&mut self, law: &Impact, root: &Root) -> Done<Option<Outcome>, O> {
        let present = self.phase.set.clone();
        let monitor = self.phase.monitors[root.index].clone();
        let rates = self.monitor_rates();
        let of_monitors: Vec<usize> = self.phase.monitors.iter().map(|m| m.point).collect();
        // what a blow does to supports that move is work of theirs
        let kinetic = self.system.kinetic_of_free(&self.now.v);
        let meeting = match monitor.kind {
            MonitorKind::Pressure => {
                let resting: Vec<usize> =
                    present.closed_points().into_iter().filter(|k| *k != monitor.point).collect();
                Meeting { staying: self.staying(law, &resting)?, ..Meeting::default() }
            }
            _ => {
                let mut touching = self.degenerate(root, &[]);
                touching.extend(present.closed_points());
                touching.sort_unstable();
                touching.dedup();
                self.meet(law, &touching)?
            }
        };
        let mut set = States::open(self.system.n_contact());
        meeting.staying.iter().for_each(|&k| set.set(k, PointState::Closed));
        self.phase = self.system.phase(&set);
        self.told.phase(self.now.t);
        self.begin_phase();
        self.now.expand(&self.phase);
        let mut jump = self.system.kinetic_of_free(&self.now.v) - kinetic;
        let energies = self.account.energies(self.system, &self.now);
        self.account.ledger.switch(jump, energies.as_ref());
        let mut before = present.clone();
        // the point that was met first: what others do follows from its blow
        let first = monitor.point;
        let others = (0..self.system.n_contact()).filter(|k| *k != first);
        for point in std::iter::once(first).chain(others) {
            let hit = meeting.hit.contains(&point);
            let kind = match (present.at(point), set.at(point)) {
                (PointState::Closed, PointState::Open) => SwitchKind::Open,
                (PointState::Open, PointState::Closed) if meeting.resting.contains(&point) => {
                    SwitchKind::Rest
                }
                (PointState::Open, PointState::Closed) => SwitchKind::Close,
                (PointState::Open, PointState::Open) if hit => SwitchKind::Impact,
                _ => continue,
            };
            let after = before.with(point, set.at(point));
            let index = of_monitors.iter().position(|p| *p == point);
            let change = Switch {
                t: self.now.t,
                point,
                node: self.system.constraints[point].node,
                kind,
                monitor: self.system.law().watched(present.at(point)),
                monitor_rate: index.map_or(0.0, |k| rates[k]),
                // one energy for all that happens at one time: booked with the first
                energy_jump: std::mem::take(&mut jump),
                struck: meeting.hit.clone(),
                before,
                after: after.clone(),
            };
            before = after;
            self.search.armed[point] = true;
            self.told.recent.push_back((change.t, change.node));
            self.told.log.switch(change, self.observer).map_err(RunError::Observer)?;
        }
        // blows at one time leave one state: times in a file ascend
        if self.now.t > self.told.last_stored {
            self.store_sample(energies)?;
        }
        self.tell_checkpoint();
        Ok(None)
    }

    /// The points on the obstacle when the run begins; or those inside it, from where no motion goes on.
    pub(super) fn meet_at_start(&mut self, law: &Impact) -> Done<Result<States, Vec<usize>>, O> {
        let h = self.now.monitors(&self.phase);
        let rounding = self.phase.monitor_rounding(self.seen.largest_u, 0.0);
        let inside: Vec<usize> =
            (0..h.len()).filter(|&k| h[k] < -INSIDE / UNITS * rounding[k]).collect();
        if !inside.is_empty() {
            return Ok(Err(self.mesh_nodes(&inside)));
        }
        let on = |k: &usize| h[*k] <= 4.0 * rounding[*k];
        let touching: Vec<usize> = (0..h.len()).filter(on).collect();
        let meeting = self.meet(law, &touching)?;
        let mut set = States::open(self.system.n_contact());
        meeting.staying.iter().for_each(|&k| set.set(k, PointState::Closed));
        Ok(Ok(set))
    }

    /// Strike the points that touch; which of them stay.
    fn meet(&mut self, law: &Impact, touching: &[usize]) -> Done<Meeting, O> {
        let n = self.now.layout.n_o;
        let mut v = self.now.v_o().to_vec();
        self.seen.largest_v = v.iter().fold(self.seen.largest_v, |m, v| m.max(v.abs()));
        let speed = self.seen.largest_v;
        let blow = law.strike(touching, &mut v).map_err(ContactError::from)?;
        self.seen.blows += blow.impulse.iter().sum::<f64>();
        let heaviest = blow.impulse.iter().fold(0.0f64, |m, r| m.max(*r));
        let least = if law.restitution < 1.0 { STICKS } else { ROUNDING };
        let (mut resting, mut meeting) = (vec![], Meeting::default());
        for ((&k, r), rate) in touching.iter().zip(&blow.impulse).zip(&blow.rate) {
            if *r > ROUNDING * heaviest {
                meeting.hit.push(k);
            }
            if *rate <= least * speed {
                resting.push(k);
                if *rate > ROUNDING * speed {
                    meeting.resting.push(k);
                }
            }
        }
        if !resting.is_empty() {
            law.stop(&resting, &mut v);
        }
        self.now.y[n..2 * n].copy_from_slice(&v);
        meeting.staying = self.staying(law, &resting)?;
        Ok(meeting)
    }

    /// Which of the points at rest on the obstacle are pressed against it.
    fn staying(&mut self, law: &Impact, resting: &[usize]) -> Done<Vec<usize>, O> {
        let mut a = vec![0.0; self.now.layout.n_o];
        let (u, v) = (self.now.u_o(), self.now.v_o());
        self.system.open_phase().acceleration(self.now.t, u, v, &mut self.scratch, &mut a);
        Ok(law.staying(resting, &a).map_err(ContactError::from)?)
    }
}
