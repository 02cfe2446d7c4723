//! What an orbit has to show before it is listed as one.
//!
//! The state is integrated over a whole period by the event-driven integrator, whatever found it: return error, admissibility at
//! every step and stored state, energy balance, switches, nearness to grazing, multipliers.

use std::f64::consts::TAU;

use super::OrbitError;
use super::chain::{Chain, Propagator};
use super::extremes::Watching;
use super::floquet::{Stability, stability, stability_under_load};
use super::highest::Highest;
use super::period_map::{Passage, integrate, integrate_with};
use super::shooting::Closure;
use super::touch::Minima;
use super::walk::Walk;
use crate::contact::{MonitorKind, OMITTED_INERTIA, Phase, State, States, System};
use crate::continuation::norm;
use crate::event::{Observer, Rubbed, Sample, Switch};
use crate::fem::largest;
use crate::records::ExtremesRecord;

/// Stored states of a check.
const SAMPLES: usize = 200;
/// Above this size multipliers are not computed.
pub const MULTIPLIER_LIMIT: usize = 700;

/// A periodic orbit with its credentials. Made by what examines it: nobody else can.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Orbit {
    /// How it closes.
    pub closure: Closure,
    /// Period.
    pub period: f64,
    /// Frame vector at `t = 0`.
    pub z: Vec<f64>,
    /// State at `t = 0`.
    pub state: State,
    /// Largest energy `H` over the period: for a reversible orbit, that at the far point. Of a viscous orbit the energy at `t = 0`, where the pinned
    /// mode is at rest.
    pub energy: f64,
    /// Largest contact displacement in magnitude.
    pub amplitude: f64,
    /// `‖x(T) − x(0)‖ / ‖x(0)‖`, in the norm of the energy.
    pub residual: f64,
    /// Newton steps that it took.
    pub iterations: usize,
    /// Switches over the period.
    pub switches: Vec<Switch>,
    /// Time during which any node touches.
    pub contact_time: f64,
    /// It does not move: velocities are rounding errors.
    pub is_at_rest: bool,
    /// Largest penetration over the unit of length.
    pub penetration: f64,
    /// The same of the method's own gaps, which an obstacle that yields keeps while the body enters it.
    pub gap_error: f64,
    /// Largest tension over the pressure that a unit of length makes.
    pub tension: f64,
    /// Every switch was found by proof.
    pub certified: bool,
    /// Change of energy over the period that work, dissipation and the jumps do not explain, over the energy.
    pub balance: f64,
    /// The method leaves out an inertia, so that no balance closes ([`crate::contact::System::omits_inertia`]).
    pub omits_inertia: bool,
    /// Sum of the jumps over the energy (a reversible orbit gains what it loses).
    pub jumps: f64,
    /// Least distance from grazing: rates at switches and interior minima of gaps and pressures, as displacements over the unit of length.
    pub grazing: f64,
    /// Multipliers, unless the body is too large for them.
    pub stability: Option<Stability>,
    /// What friction and moving surfaces do over the period, of a body with friction.
    pub rubbed: Option<Rubbed>,
    /// How far the body walks along the obstacle in a period, where only friction holds its place ([`super::drift`]): of the contact points the way of the one that goes farthest, along its tangent.
    pub drift: Option<f64>,
    /// What a viscous orbit has besides.
    pub viscous: Option<Feedback>,
    /// What forces and probes come to over the period.
    pub extremes: ExtremesRecord,
    /// Of a subharmonic orbit: how far it is from itself after one period of the loads, `x(T) − x(0)` as a frame vector.
    pub halfway: Option<Vec<f64>>,
}

/// What a viscous orbit has besides: its feedback.
#[derive(Debug, Clone, PartialEq)]
pub struct Feedback {
    /// `α` of the feedback `−αM u̇`.
    pub alpha: f64,
    /// Viscosity `β` of `C = βK`.
    pub beta: f64,
    /// Energy that the viscosity takes and the feedback gives back a period, `α ∮ u̇ᵀMu̇ dt`.
    pub turned_over: f64,
    /// Multipliers of the damped body under `αM u̇(t)` as a prescribed load.
    pub under_load: Option<Stability>,
}

/// An orbit fails by more than these.
const RESIDUAL: f64 = 1e-10;
/// Whatever its multipliers make of rounding errors.
const MOST_RESIDUAL: f64 = 1e-7;
const VIOLATION: f64 = 1e-9;
const BALANCE: f64 = 1e-8;

/// Kinetic energy below this part of the energy is that of rounding errors.
const AT_REST: f64 = 1e-20;

/// A multiplier this near to +1 is one, where friction holds positions.
const STAYS: f64 = 1e-6;

/// A subharmonic orbit that comes back this near after one period of the loads, over its size, is none.
const SHORTER: f64 = 1e-7;

impl Orbit {
    /// Circular frequency; of a forced orbit that of the loads.
    pub fn omega(&self) -> f64 {
        self.closure.period(1.0) / self.period
    }

    /// The same orbit with its time counted from a later instant, a share of the period from here, where its state is another one.
    pub(super) fn counted_from(mut self, share: f64, z: Vec<f64>, state: State) -> Orbit {
        let from = share * self.period;
        for s in &mut self.switches {
            s.t = (s.t - from).rem_euclid(self.period);
        }
        self.switches.sort_by(|a, b| a.t.total_cmp(&b.t));
        Orbit { z, state, ..self }
    }

    /// No penetration and no tension, between switches as well as at them.
    pub fn is_admissible(&self) -> bool {
        self.gap_error <= VIOLATION && self.tension <= VIOLATION && self.certified
    }

    /// Of a body with friction: how many parameters the family of orbits has that differ by where friction holds the body, each a multiplier +1. None where multipliers are not known.
    pub fn residual_positions(&self) -> Option<usize> {
        self.rubbed.as_ref()?;
        let stability = self.stability.as_ref()?;
        let stays = |m: &&(f64, f64)| (m.0 - 1.0).hypot(m.1) < STAYS;
        Some(stability.multipliers[stability.trivial..].iter().filter(stays).count())
    }

    /// A subharmonic orbit that has come back after one period of the loads: one of that period.
    pub(super) fn is_repeated(&self) -> bool {
        self.halfway.as_ref().is_some_and(|d| norm(d) < SHORTER * norm(&self.z))
    }

    /// What speaks against the orbit; empty for an orbit.
    pub fn flaws(&self) -> Vec<String> {
        let mut flaws = vec![];
        let mut limit = |what: &str, value: f64, most: f64| {
            if value.is_nan() || value > most {
                flaws.push(format!("{what} {value:.1e} exceeds {most:.0e}"));
            }
        };
        // what is known to rounding comes back multiplied by the largest multiplier: 10⁵ and more right behind a grazing
        let spread = self.stability.as_ref().map_or(1.0, |s| s.largest.max(1.0));
        limit("residual", self.residual, (RESIDUAL * spread).min(MOST_RESIDUAL));
        limit("penetration", self.gap_error, VIOLATION);
        limit("tension", self.tension, VIOLATION);
        limit("energy balance", self.balance, BALANCE);
        if self.closure == Closure::Reversible {
            limit("sum of energy jumps", self.jumps.abs(), BALANCE);
        }
        if self.is_repeated() {
            flaws.push("it repeats after one period of the loads".into());
        }
        if self.is_at_rest {
            flaws.push("it does not move: an equilibrium".into());
        }
        if self.omits_inertia
            && let Some(balance) = flaws.iter_mut().find(|f| f.starts_with("energy balance"))
        {
            balance.push_str(&format!(" ({OMITTED_INERTIA})"));
        }
        if !self.certified {
            flaws.push("a switch was not found by proof".into());
        }
        flaws
    }
}

/// Extremes over the stored states of a period.
struct Scan<'a> {
    body: &'a Propagator,
    kinetic: f64,
    energy: Highest,
    /// Sum of the energy jumps so far.
    jumps: f64,
    /// Largest contact displacement of all points.
    amplitude: Highest,
    contact_time: f64,
    grazing: f64,
    watching: Watching<'a>,
    /// Last two stored states: time, states of the points, monitors as displacements.
    last: Vec<(f64, States, Vec<f64>)>,
}

impl Observer for Scan<'_> {
    type Error = std::convert::Infallible;

    fn sample(&mut self, s: &Sample) -> Result<(), Self::Error> {
        self.watching.note(s);
        let system = &self.body.system;
        let u_c = system.towards_obstacles(s.u);
        let energy = s.energies.map_or(f64::NAN, |e| system.beyond_rest(e.total(), s.u));
        self.kinetic = self.kinetic.max(s.energies.map_or(0.0, |e| e.kinetic));
        let switched = self.last.last().is_some_and(|(_, states, _)| states != s.active);
        let at_points = system.at_points(s.u);
        let moved = system.beside_rest(&at_points);
        let amplitude = largest(&moved);
        if switched || s.jumps != self.jumps {
            self.amplitude.switch(s.t, amplitude);
            self.energy.switch(s.t, energy - (s.jumps - self.jumps));
            self.jumps = s.jumps;
        }
        self.energy.note(s.t, energy);
        self.amplitude.note(s.t, amplitude);
        let monitor = |i: usize| match system.law().watched(s.active.at(i)) {
            MonitorKind::Pressure => s.pressure[i] / system.constraints[i].stiffness,
            MonitorKind::Depth => at_points[i] - system.constraints[i].gap,
            _ => system.constraints[i].gap - u_c[i],
        };
        let now: Vec<f64> = (0..system.n_contact()).map(monitor).collect();
        if let Some((t, states, _)) = self.last.last()
            && states.count_closed() > 0
        {
            self.contact_time += s.t - t;
        }
        if let [(_, f0, a), (_, f1, b)] = &self.last[..]
            && f0 == f1
            && f1 == s.active
        {
            for i in 0..now.len() {
                if b[i] < a[i] && b[i] <= now[i] {
                    self.grazing = self.grazing.min(b[i] / system.units.length);
                }
            }
        }
        if self.last.len() == 2 {
            self.last.remove(0);
        }
        self.last.push((s.t, s.active.clone(), now));
        Ok(())
    }

    fn switch(&mut self, s: &Switch) -> Result<(), Self::Error> {
        self.watching.switch(s.t, &s.before);
        Ok(())
    }

    fn takes_accelerations(&self) -> bool {
        self.watching.takes_accelerations()
    }
}

/// At a grazing, or at rest on the obstacle, the monodromy matrix is not finite.
fn if_known(computed: Result<Stability, OrbitError>) -> Result<Option<Stability>, OrbitError> {
    match computed {
        Ok(known) => Ok(Some(known)),
        Err(OrbitError::Eigen(_)) => Ok(None),
        Err(e) => Err(e),
    }
}

/// What the feedback of a viscous orbit gives back, and the multipliers without it.
fn feedback(
    body: &Propagator,
    (alpha, beta): (f64, f64),
    along: (&Chain, &Walk),
    multipliers: bool,
) -> Result<Feedback, OrbitError> {
    let under_load = match multipliers {
        true => if_known(stability_under_load(body, along, alpha))?,
        false => None,
    };
    Ok(Feedback { alpha, beta, turned_over: alpha * along.1.squared_speed(), under_load })
}

/// `H` of a walk along the phases of its chain; continuous from the left.
fn energy_along(system: &System, walk: &Walk, phases: &[Phase], t: f64) -> f64 {
    let Some((k, u_o, v_o)) = walk.state(t) else { return f64::NAN };
    let Some(phase) = phases.get(k) else { return f64::NAN };
    system.energy_in(phase, t, &State { u: u_o, v: v_o })
}

/// The largest contact displacement of a walk, likewise.
fn amplitude_along(system: &System, walk: &Walk, phases: &[Phase], t: f64) -> f64 {
    let Some((k, u_o, _)) = walk.state(t) else { return f64::NAN };
    let Some(phase) = phases.get(k) else { return f64::NAN };
    let mut u = vec![0.0; system.n()];
    phase.expand_displacement(t, &u_o, &mut u);
    let moved = system.beside_rest(&system.at_points(&u));
    largest(&moved)
}

/// Integrate a candidate over a period and write down what it is; `multipliers` only where they are asked for.
pub fn examine(
    body: &mut Propagator,
    closure: Closure,
    z: &[f64],
    period: f64,
    iterations: usize,
    multipliers: bool,
) -> Result<Orbit, OrbitError> {
    closure.adopt(body, z)?;
    let period = closure.period_of(z, period);
    let body = &*body;
    let system = &body.system;
    let state = body.state(closure.frame(z));
    let mut scan = Scan {
        body,
        kinetic: 0.0,
        energy: Highest::default(),
        jumps: 0.0,
        amplitude: Highest::default(),
        contact_time: 0.0,
        grazing: f64::INFINITY,
        watching: Watching::new(system),
        last: vec![],
    };
    let passage: Passage = integrate_with(body, &state, period, SAMPLES, &mut scan)?;
    let report = &passage.report;
    let mut start = closure.frame(z).to_vec();
    start.resize(2 * body.n(), 0.0);
    let end = body.frame(&report.last);
    let difference: Vec<f64> = match closure.is_forced() {
        true => body.drift.difference(&start, &end),
        false => end.iter().zip(&start).map(|(a, b)| a - b).collect(),
    };
    let walked = || {
        let points = (0..system.n_contact()).filter_map(|i| system.tangent(i));
        let ways = points.map(|t| t.along(&report.last.u) - t.along(&state.u));
        ways.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
    };
    let drift = (closure.is_forced() && !body.drift.is_none()).then(walked);
    let unit = system.units.length;
    // how near is told by gaps and pressures: a slip that ends softly is no grazing of the obstacle
    for s in report.switches.iter().filter(|s| !s.monitor.is_tangential()) {
        let scale = system.monitor_unit(s.monitor, s.point);
        scan.grazing = scan.grazing.min(s.monitor_rate.abs() / scale * period / TAU / unit);
    }
    let stiffness =
        system.constraints.iter().map(|c| c.stiffness).fold(f64::MIN_POSITIVE, f64::max);
    let wanted = multipliers && body.n() <= MULTIPLIER_LIMIT;
    // the motion in closed form: the energy alone does without it
    let needed = wanted || matches!(closure, Closure::Viscous(_));
    let walk = || body.walk(&passage.chain, &start, &passage.times, period);
    let walk = match needed {
        true => Some(walk()?),
        false if body.is_large() => None,
        // without it the tops of parabolas between the states stand for the largest energy
        false => walk().ok(),
    };
    let along = walk.as_ref().map(|walk| (&passage.chain, walk));
    if let Some((chain, walk)) = along {
        for ((point, to), touch) in (Minima { walk, sets: &chain.sets }).all() {
            let from = chain.sets[touch.phase].at(point);
            if from.touches() && to.touches() {
                continue;
            }
            let unit = system.unit_of_monitor(from, point);
            scan.grazing = scan.grazing.min(touch.h.max(0.0) / unit);
        }
    }
    let phases: Option<(&Walk, Vec<Phase>)> =
        along.map(|(chain, walk)| (walk, chain.sets.iter().map(|set| system.phase(set)).collect()));
    let highest = |scanned: Highest, along: fn(&System, &Walk, &[Phase], f64) -> f64| {
        let of = phases.as_ref().map(|(walk, phases)| move |t: f64| along(system, walk, phases, t));
        scanned.of(of.as_ref().map(|f| f as &dyn Fn(f64) -> f64))
    };
    let (largest, amplitude) =
        (highest(scan.energy, energy_along), highest(scan.amplitude, amplitude_along));
    let energy = largest.max(f64::MIN_POSITIVE);
    let stability = match along {
        Some(along) if wanted => if_known(stability(body, closure, z, along))?,
        _ => None,
    };
    let viscous = match (closure, along) {
        (Closure::Viscous(pin), Some(along)) => {
            let alpha = z[z.len() - 1];
            Some(feedback(body, (alpha, pin.beta), along, wanted)?)
        }
        _ => None,
    };
    let halfway = match closure.periods() {
        1 => None,
        k => {
            let passage = integrate(body, &state, period / k as f64)?;
            let there = body.frame(&passage.report.last);
            Some(body.drift.difference(&start, &there))
        }
    };
    let energy_at_start = || -> Result<f64, OrbitError> {
        let (u, v) = state.full(system)?;
        Ok(system.energy(0.0, &u, &v))
    };
    Ok(Orbit {
        closure,
        period,
        energy: if viscous.is_some() { energy_at_start()? } else { largest },
        amplitude,
        residual: norm(&difference) / norm(&start).max(f64::MIN_POSITIVE),
        iterations,
        contact_time: scan.contact_time,
        is_at_rest: scan.kinetic <= AT_REST * energy.abs(),
        penetration: report.max_penetration.max(0.0) / unit,
        gap_error: report.gap_error.max(0.0) / unit,
        tension: report.max_tension.max(0.0) / (stiffness * unit),
        certified: report.is_certified(),
        balance: report.energy_drift_total,
        omits_inertia: system.omits_inertia(),
        jumps: report.energy_jumps / energy,
        grazing: scan.grazing,
        stability,
        viscous,
        rubbed: report.rubbed.clone(),
        drift,
        extremes: {
            scan.watching.close(period);
            scan.watching.seen()
        },
        halfway,
        switches: passage.report.switches,
        z: z.to_vec(),
        state,
    })
}
