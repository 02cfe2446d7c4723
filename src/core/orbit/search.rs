//! One orbit from a guess, with a verdict; all orbits from a set of starts.
//!
//! First one-shot Newton on the event-driven map. Where it stalls (a corner of the map, theory §8), multi-segment Newton with the
//! sequence that it saw last. Where that fails too, the family is looked for with the frequency free, and followed towards the
//! frequency that was asked for: it arrives, or the fold or grazing that lies between is located and named.

use super::chain::{Chain, Propagator};
use super::credentials::{Orbit, examine};
use super::segments::Segments;
use super::shooting::{Closure, Settings, Shot, shoot};
use super::{OrbitError, tolerate};
use crate::continuation::{
    self, Family, Options, Place, Special, Stop, approach, correct, least_singular_value, norm,
};
use crate::event::SwitchKind;

/// What came of a search.
#[derive(Debug, Clone)]
pub enum Verdict {
    /// An orbit with all its credentials.
    Orbit(Box<Orbit>),
    /// A periodic motion that does not touch the obstacle.
    NoContact {
        /// Its energy.
        energy: f64,
    },
    /// A solution of the shooting equations that is no orbit.
    Flawed {
        /// What was found.
        orbit: Box<Orbit>,
        /// What speaks against it.
        flaws: Vec<String>,
    },
    /// The family of the guess turns back before the frequency.
    Fold {
        /// Frequency of the fold.
        omega: f64,
        /// Energy there.
        energy: f64,
        /// Switches a period there.
        switches: usize,
        /// Smallest singular value of the shooting Jacobian at the fold over the largest.
        singular_value: f64,
    },
    /// The family of the guess ends at a grazing contact before the frequency.
    Grazing {
        /// Frequency there.
        omega: f64,
        /// Which contact.
        what: String,
    },
    /// Neither an orbit nor its family was found.
    NotFound {
        /// Least residual that was reached.
        residual: f64,
        /// Smallest singular value there over the largest.
        singular_value: f64,
        /// What was met, if more is known: the map could not be evaluated at the guess, the body does not settle.
        reason: Option<String>,
    },
}

impl Verdict {
    /// The orbit, if there is one.
    pub fn orbit(&self) -> Option<&Orbit> {
        if let Verdict::Orbit(o) = self { Some(o) } else { None }
    }

    /// One word.
    pub fn word(&self) -> &'static str {
        match self {
            Verdict::Orbit(_) => "orbit",
            Verdict::NoContact { .. } => "no contact",
            Verdict::Flawed { .. } => "flawed",
            Verdict::Fold { .. } => "fold",
            Verdict::Grazing { .. } => "grazing",
            Verdict::NotFound { .. } => "not found",
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Verdict::Orbit(o) => {
                write!(f, "orbit of energy {:.8}, residual {:.1e}", o.energy, o.residual)
            }
            Verdict::NoContact { energy } => {
                write!(f, "the iteration ended in a motion of energy {energy:.6e} without contact")
            }
            Verdict::Flawed { flaws, .. } => {
                write!(f, "the solution found is not an orbit: {}", flaws.join("; "))
            }
            Verdict::Fold { omega, energy, switches, singular_value } => write!(
                f,
                "fold: the family of orbits with {switches} switches a period that the guess leads to turns back at omega = {omega:.8} \
                 (energy {energy:.6}, smallest singular value of the Jacobian {singular_value:.1e} of the largest)"
            ),
            Verdict::Grazing { omega, what } => {
                write!(
                    f,
                    "grazing: the family of the guess ends at omega = {omega:.8}, where {what}"
                )
            }
            Verdict::NotFound { reason: Some(reason), .. } => {
                write!(f, "not found: {reason}")
            }
            Verdict::NotFound { residual, singular_value, .. } if singular_value.is_nan() => {
                write!(f, "not found: the guess is too far (least residual {residual:.1e})")
            }
            Verdict::NotFound { residual, singular_value, .. } => write!(
                f,
                "not found: the guess is too far (least residual {residual:.1e}, smallest singular value {singular_value:.1e} of the \
                 largest)"
            ),
        }
    }
}

impl Verdict {
    /// Nothing was found, and no residual is known.
    pub fn not_found(reason: impl Into<String>) -> Verdict {
        let reason = Some(reason.into());
        Verdict::NotFound { residual: f64::NAN, singular_value: f64::NAN, reason }
    }
}

/// How much is done for an orbit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Newton's limits.
    pub newton: Settings,
    /// Compute multipliers.
    pub multipliers: bool,
    /// Look for the family where Newton's method stalls.
    pub rescue: bool,
}

impl Default for Effort {
    fn default() -> Self {
        Effort { newton: Settings::default(), multipliers: true, rescue: true }
    }
}

impl Effort {
    /// What an orbit of a kind is worth: viscous ones are found in a few steps, or not from there.
    pub fn of(closure: Closure) -> Effort {
        let newton = match closure {
            Closure::Viscous(_) => Settings { iterations: 15, ..Settings::default() },
            _ => Settings::default(),
        };
        Effort { newton, ..Effort::default() }
    }
}

/// The orbit of frequency `omega` near the frame vector `z` (displacements only for a reversible one).
pub fn find(
    body: &mut Propagator,
    closure: Closure,
    z: &[f64],
    omega: f64,
    effort: &Effort,
) -> Result<Verdict, OrbitError> {
    body.system.loads_mut().set_frequency(omega);
    let period = closure.period(omega);
    let shot = match shoot(body, closure, z, period, &effort.newton) {
        Ok(shot) => shot,
        Err(e) if e.is_of_one_motion() => {
            let (residual, singular_value) = (f64::INFINITY, f64::NAN);
            let reason = Some(format!("the period map fails at the guess: {e}"));
            return Ok(Verdict::NotFound { residual, singular_value, reason });
        }
        Err(e) => return Err(e),
    };
    if shot.converged {
        return judge(body, closure, &shot.z, omega, shot.iterations, effort.multipliers);
    }
    if !effort.rescue
        || body.is_large()
        // switching times of friction are no unknowns
        || body.system.tangents().is_some()
        || matches!(closure, Closure::Autonomous | Closure::Viscous(_) | Closure::Limit)
        || shot.passage.chain.events() == 0
    {
        let reason = None;
        let (residual, singular_value) = (shot.residual, f64::NAN);
        return Ok(Verdict::NotFound { residual, singular_value, reason });
    }
    rescue(body, closure, shot, omega, effort)
}

/// Whether a solution of the shooting equations is an orbit.
pub(super) fn judge(
    body: &mut Propagator,
    closure: Closure,
    z: &[f64],
    omega: f64,
    iterations: usize,
    multipliers: bool,
) -> Result<Verdict, OrbitError> {
    let orbit = examine(body, closure, z, closure.period(omega), iterations, multipliers)?;
    let is_linear = orbit.contact_time == 0.0 || body.system.rest().is_some();
    if orbit.switches.is_empty() && is_linear && !closure.is_forced() {
        return Ok(Verdict::NoContact { energy: orbit.energy });
    }
    let flaws = orbit.flaws();
    let orbit = Box::new(orbit);
    Ok(if flaws.is_empty() { Verdict::Orbit(orbit) } else { Verdict::Flawed { orbit, flaws } })
}

/// From a stalled one-shot iteration: multi-segment Newton, then the family.
fn rescue(
    body: &mut Propagator,
    closure: Closure,
    shot: Shot,
    omega: f64,
    effort: &Effort,
) -> Result<Verdict, OrbitError> {
    let iterations = shot.iterations;
    let residual = shot.residual;
    let mut family = Segments::new(body, closure, shot.passage.chain.clone());
    family.watch = false;
    let x = family.unknowns(&shot.z, &shot.passage.times, omega);
    let mut natural = vec![0.0; x.len()];
    natural[x.len() - 1] = 1.0;
    if let Some(found) = tolerate(correct(&mut family, &x, &natural, omega))?.flatten()
        && tolerate(family.overstepped(&found.x))?.is_some_and(|b| b.is_empty())
    {
        let z = family.parts(&found.x).0.to_vec();
        return judge(body, closure, &z, omega, iterations + found.iterations, effort.multipliers);
    }
    let singular_value =
        tolerate(least_singular_value(&mut family, &x))?.flatten().unwrap_or(f64::NAN);
    let not_found = Verdict::NotFound { residual, singular_value, reason: None };
    let Some(near) = tolerate(approach(&mut family, &x))?.flatten() else { return Ok(not_found) };
    if !tolerate(family.overstepped(&near.x))?.is_some_and(|b| b.is_empty()) {
        return Ok(not_found);
    }
    let start = near.x[near.x.len() - 1];
    if (start / omega - 1.0).abs() > 0.1 {
        return Ok(not_found);
    }
    let verdict = tolerate(towards(&mut family, near.x, omega))?.flatten();
    Ok(match verdict {
        None => not_found,
        Some(Arrival::Arrived(z)) => {
            return judge(body, closure, &z, omega, iterations, effort.multipliers);
        }
        Some(Arrival::Fold { z, omega, singular_value }) => {
            let there = examine(body, closure, &z, closure.period(omega), 0, false)?;
            let (energy, switches) = (there.energy, there.switches.len());
            Verdict::Fold { omega, energy, switches, singular_value }
        }
        Some(Arrival::Grazing { omega, what }) => Verdict::Grazing { omega, what },
    })
}

enum Arrival {
    Arrived(Vec<f64>),
    Fold { z: Vec<f64>, omega: f64, singular_value: f64 },
    Grazing { omega: f64, what: String },
}

/// Follow a family from a solution to a frequency.
fn towards(family: &mut Segments, x: Vec<f64>, omega: f64) -> Result<Option<Arrival>, OrbitError> {
    let start = x[x.len() - 1];
    let range = if start < omega { (0.0, omega) } else { (omega, f64::INFINITY) };
    let step = (2e-3, 1e-8, 0.02);
    let Some(place) = Place::start(family, x, omega - start, step.0)? else { return Ok(None) };
    let options = Options { range, step, points: 200, locate: false, natural: false };
    let mut arrival = None;
    let stop = continuation::follow(family, place, &options, |family, point| {
        let z = family.parts(&point.x).0.to_vec();
        let omega = point.x[point.x.len() - 1];
        match point.special {
            Some(Special::End) => arrival = Some(Arrival::Arrived(z)),
            Some(Special::Fold | Special::Corner { .. }) => {
                let singular_value =
                    least_singular_value(family, &point.x).ok().flatten().unwrap_or(f64::NAN);
                arrival = Some(Arrival::Fold { z, omega, singular_value });
                return continuation::Go::Break(());
            }
            _ => {}
        }
        continuation::Go::Continue(())
    })?;
    if let (None, Stop::DeadEnd { lambda, border }) = (&arrival, &stop) {
        arrival = Some(Arrival::Grazing { omega: *lambda, what: border.clone() });
    }
    Ok(arrival)
}

/// Orbits nearer to each other than this, over their size, are one.
const SAME: f64 = 1e-5;

/// Whether two orbits are the same, started at whichever instant at which the closure holds: a reversible one at either of its two instants of rest, a
/// subharmonic one after any period of the loads. Mirror images of a symmetric body agree in energy, switches and contact time, and are two.
pub fn same(body: &Propagator, a: &Orbit, b: &Orbit) -> Result<bool, OrbitError> {
    let alike = (a.energy - b.energy).abs() <= 1e-7 * a.energy.abs().max(b.energy.abs())
        && a.switches.len() == b.switches.len()
        && (a.contact_time - b.contact_time).abs() <= 1e-6 * a.period;
    if !alike {
        return Ok(false);
    }
    let parts = match a.closure {
        Closure::Reversible => 2,
        Closure::Forced(periods) => periods,
        // the phase condition leaves one instant
        Closure::Viscous(_) => 1,
        Closure::Autonomous | Closure::Limit => return Ok(same_sequence(a, b)),
    };
    let state = body.frame(&b.state);
    for part in 0..parts {
        let t = a.period * part as f64 / parts as f64;
        let there = match part {
            0 => body.frame(&a.state),
            _ => body.frame(&super::period_map::integrate(body, &a.state, t)?.report.last),
        };
        if body.drift.apart(&there, &state) <= SAME * norm(&state) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Whether contact points switch in the same cyclic order: all that two orbits without a common instant can be asked.
fn same_sequence(a: &Orbit, b: &Orbit) -> bool {
    let of = |o: &Orbit| -> Vec<(usize, SwitchKind)> {
        o.switches.iter().map(|s| (s.point, s.kind)).collect()
    };
    let (a, b) = (of(a), of(b));
    a.is_empty() || (0..a.len()).any(|k| a[k..].iter().chain(&a[..k]).eq(&b))
}

/// The sequence of active sets over the closure's time, for a family through an orbit.
pub fn chain_of(body: &Propagator, orbit: &Orbit) -> Result<(Chain, Vec<f64>), OrbitError> {
    let end = orbit.closure.end(orbit.period);
    let passage = super::period_map::integrate(body, &orbit.state, end)?;
    Ok((passage.chain, passage.times))
}
