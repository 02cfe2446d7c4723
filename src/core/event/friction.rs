//! Which points stick and which slip at a state (`v_t` relative to the obstacle's surface, `λ` the reaction that would hold a point).
//!
//! A point that moves along the surface slips, by the sign of its velocity. Those at rest, what sticks and what has just come to rest, are undecided:
//!
//! ```text
//! a_t = a_t⁰ − D (r_t − r_t⁰),      r_t = σ μ r_n with σ a_t ≥ 0,   or   a_t = 0 with |r_t| ≤ μ r_n
//! ```
//!
//! has one solution, for `D = E M⁻¹ Eᵀ` is positive definite. It is found by pivoting: in the phase of the present states every point that violates its own
//! condition moves to the neighbouring state. Where `|r_t| = μ r_n` and `a_t = 0` both hold, as they do when a point breaks loose, the rate of
//! `μ r_n ∓ r_t` in the phase in which it sticks decides.

use super::classify::{ClassifyError, Decision, Surface};
use crate::contact::{MonitorKind, Phase, PointState, Scratch, States, System};

/// Rounds in which all violating points change together; after these one at a time.
const TOGETHER: usize = 10;
/// Acceleration of a point that has just broken loose, over the largest: as far as its reaction is from the limit at the instant that was found.
const LOOSE: f64 = 1e-7;
/// How far from zero the monitor may be that reached it, in rounding errors: as far as the flow is from the motion.
const FOUND: f64 = 1e5;
/// A slider at its limit is at rest below this velocity, over that of its spring.
const STILL: f64 = 1e-9;
/// Rounding errors of a velocity, of an acceleration and of a reaction, over their sizes.
const ROUNDING: f64 = 256.0 * f64::EPSILON;

/// What pivoting knows besides the states.
struct Pivoted<'a> {
    /// What has broken loose by its rate.
    loose: &'a [bool],
    /// Acceleration of the forces that stuck points take.
    of_forces: f64,
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0f64, |m, x| m.max(x.abs()))
}

impl Surface<'_> {
    /// The decision with the states along the tangents put in; `trigger` is the monitor along a tangent that reached zero.
    pub(super) fn rub(
        &self,
        mut decision: Decision,
        trigger: Option<(usize, MonitorKind)>,
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let Some(tangents) = self.system.tangents() else { return Ok(decision) };
        let size = largest(self.v_o);
        // where one comes to rest others may, within what an instant is known to
        let slows = match trigger {
            Some((_, MonitorKind::Slip)) => self.acceleration(self.phase, scratch),
            _ => vec![0.0; self.v_o.len()],
        };
        let mut undecided = vec![];
        for (i, tangent) in tangents.iter().enumerate() {
            let Some(tangent) = tangent.as_ref().filter(|_| decision.set.touches(i)) else {
                continue;
            };
            let slip = tangent.slip_velocity(self.v_o);
            let blur = 8.0 * self.resolution * tangent.along(&slows).abs();
            if let Some(trial) = self.system.slider(i).and_then(|s| s.trial(self.u_o)) {
                let least = blur.max(ROUNDING * size);
                let state = self.of_spring(i, (trial, slip, least), trigger, &slows);
                decision.set.set(i, state);
                continue;
            }
            let rests = slip.abs() <= blur.max(ROUNDING * size.max(tangent.surface.abs()));
            let stuck = self.phase.set.at(i) == PointState::Stick;
            let is_undecided = rests || stuck || trigger.is_some_and(|t| t.0 == i);
            if is_undecided && tangent.only_slips {
                return Err(ClassifyError::Rests { t: self.t, node: i });
            }
            if is_undecided {
                undecided.push(i);
                decision.set.set(i, PointState::Stick);
            } else {
                decision.set.set(i, PointState::of_slip(slip));
            }
        }
        if !undecided.is_empty() {
            // reactions are those of springs that are at their limits at the most
            let mut u_o = self.u_o.to_vec();
            remember(self.system, &decision.set, &mut u_o);
            let settled = Surface { u_o: &u_o, ..*self };
            decision.set = settled.pivot(decision.set, &undecided, trigger, scratch)?;
        }
        Ok(decision)
    }

    /// What a slider with a spring does, whose trial force is `k (w u − z)`: it slides where that is at its limit or beyond, and grows. It is at rest below the velocity
    /// `least`; `slows` are the accelerations where some slip ends.
    fn of_spring(
        &self,
        point: usize,
        (trial, slip, least): (f64, f64, f64),
        trigger: Option<(usize, MonitorKind)>,
        slows: &[f64],
    ) -> PointState {
        let Some(slider) = self.system.slider(point) else { return PointState::Stick };
        let stiffness = slider.elastic.map_or(0.0, |e| e.stiffness);
        let sigma = trial.signum();
        let found = trigger.filter(|t| t.0 == point).map(|t| t.1);
        if found == Some(MonitorKind::Slip) {
            // it comes to rest, or its velocity only touches zero
            let goes_on = sigma * slider.along(slows) > LOOSE * largest(slows);
            return if goes_on { PointState::of_slip(sigma) } else { PointState::Stick };
        }
        // of several sliders that come to rest at one instant each ends by itself
        let slides = self.phase.set.at(point).slip().is_some();
        let least = match slides || found.is_some() {
            true => least,
            false => STILL * self.system.units.frequency * slider.limit / stiffness,
        };
        let blur = ROUNDING * slider.limit + 8.0 * self.resolution * stiffness * slip.abs();
        let at_limit = slides || found.is_some() || trial.abs() >= slider.limit - blur;
        match at_limit && sigma * slip > least {
            true => PointState::of_slip(sigma),
            false => PointState::Stick,
        }
    }

    fn pivot(
        &self,
        mut set: States,
        points: &[usize],
        trigger: Option<(usize, MonitorKind)>,
        scratch: &mut Scratch,
    ) -> Result<States, ClassifyError> {
        // what has broken loose by its rate, and stays so
        let mut loose = vec![false; points.len()];
        // accelerations that are but what cancelled forces leave by rounding decide nothing: where it goes round in circles, their sizes are asked for
        let mut of_forces = 0.0;
        for round in 0..TOGETHER + 8 * points.len() {
            if round == TOGETHER {
                of_forces = self.unhindered(set.clone(), points, scratch);
            }
            let phase = self.system.phase(&set);
            let known = Pivoted { loose: &loose, of_forces };
            let moves = self.violations(&phase, points, trigger, &known, scratch);
            let few = if round < TOGETHER { moves.len() } else { moves.len().min(1) };
            if few == 0 {
                return Ok(set);
            }
            for &(k, to, by_rate) in &moves[..few] {
                set.set(points[k], to);
                loose[k] = by_rate;
            }
        }
        Err(ClassifyError::Unresolved { t: self.t, nodes: points.to_vec() })
    }

    /// The largest acceleration where all of the points slip.
    fn unhindered(&self, mut set: States, points: &[usize], scratch: &mut Scratch) -> f64 {
        points.iter().for_each(|i| set.set(*i, PointState::SlipPlus));
        largest(&self.acceleration(&self.system.phase(&set), scratch))
    }

    /// The points that leave their state: place in the list, whereto, and whether a rate decides that.
    fn violations(
        &self,
        phase: &Phase,
        points: &[usize],
        trigger: Option<(usize, MonitorKind)>,
        known: &Pivoted,
        scratch: &mut Scratch,
    ) -> Vec<(usize, PointState, bool)> {
        let a = self.acceleration(phase, scratch);
        // accelerations of the body's own forces: of one that rests there are no others
        let units = &self.system.units;
        let own = units.frequency * largest(self.v_o).max(units.frequency * largest(self.u_o));
        let scale = largest(&a).max(own).max(known.of_forces);
        let blur = ROUNDING * scale;
        let h = phase.monitor_values(self.t, self.u_o, self.v_o);
        let rates = phase.monitor_rates(self.t, self.v_o, &a);
        let rounding =
            phase.monitor_rounding(largest(self.u_o).max(units.length), largest(self.v_o));
        let mut moves = vec![];
        for (k, &i) in points.iter().enumerate() {
            let Some(tangent) = self.system.tangent(i) else { continue };
            let state = phase.set.at(i);
            if let Some(sigma) = state.slip() {
                let along = sigma * tangent.along(&a);
                // what broke loose by its rate starts without an acceleration
                let stays = if known.loose[k] { along >= -LOOSE * scale } else { along > blur };
                if !stays {
                    moves.push((k, PointState::Stick, false));
                }
                continue;
            }
            let of = phase.monitors.iter().enumerate().filter(|(_, m)| m.point == i);
            let sides = of.filter(|(_, m)| {
                [MonitorKind::StickPlus, MonitorKind::StickMinus].contains(&m.kind)
            });
            // the side that is violated most, or leaves zero fastest
            let worst = sides
                .filter_map(|(m, monitor)| {
                    let slack = 16.0 * rounding[m] + 8.0 * self.resolution * rates[m].abs();
                    let found = trigger == Some((i, monitor.kind));
                    let tied = h[m].abs() <= if found { FOUND * slack } else { slack };
                    match tied {
                        true => (rates[m] < 0.0).then_some((monitor.to, 0.0, true)),
                        false => (h[m] < 0.0).then_some((monitor.to, h[m], false)),
                    }
                })
                .min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((to, _, by_rate)) = worst {
                moves.push((k, to, by_rate));
            }
        }
        moves
    }
}

/// Where springs of sliders stick, none is beyond its limit.
pub(super) fn remember(system: &System, set: &States, u_o: &mut [f64]) {
    let first = system.facing().len();
    for (s, slider) in system.sliders().iter().enumerate() {
        if set.at(first + s) == PointState::Stick {
            slider.settle(u_o);
        }
    }
}

/// Give what sticks exactly the velocity of the surface; springs of sliders stick at any, and what they remember has none.
pub(super) fn settle(system: &System, set: &States, v_o: &mut [f64]) {
    system.sliders().iter().filter_map(|s| s.elastic).for_each(|e| v_o[e.memory] = 0.0);
    for (i, state) in set.iter().enumerate() {
        if let (Some(t), PointState::Stick) = (system.rigid_tangent(i), state) {
            t.settle(v_o);
        }
    }
}
