//! Families of orbits frequency by frequency, and what a file keeps of an orbit; along the branch: [`super::along`].

use super::OrbitError;
use super::chain::{Chain, Propagator};
use super::credentials::{Feedback, Orbit};
use super::floquet::Stability;
use super::search::{Effort, Verdict, find};
use super::settle::ladder;
use super::shooting::Closure;
use super::viscous;
use crate::continuation::{Go, JUMP, Place, Special, guesses};
use crate::records::{
    FrictionRecord, GapReason, OrbitRecord, PlaceRecord, PointKind, PointRecord, StabilityChange,
    VerdictKind, ViscousRecord,
};

/// An orbit as a file keeps it.
pub fn record(body: &Propagator, orbit: &Orbit) -> Result<OrbitRecord, OrbitError> {
    let (u0, v0) = orbit.state.full(&body.system)?;
    let nodal = |x: &[f64]| body.system.body.nodal(x).into_owned();
    let (u0, v0) = (nodal(&u0), nodal(&v0));
    let stability = orbit.stability.as_ref();
    let switches = orbit.switches.iter();
    Ok(OrbitRecord {
        period: orbit.period,
        periods: orbit.closure.periods(),
        energy: orbit.energy,
        amplitude: orbit.amplitude,
        residual: orbit.residual,
        contact_time: orbit.contact_time,
        grazing: orbit.grazing,
        penetration: orbit.penetration,
        tension: orbit.tension,
        balance: orbit.balance,
        u0,
        v0,
        multipliers: pairs(stability),
        no_orbit_near: false,
        multipliers_within: None,
        trivial: stability.map_or(0, |s| s.trivial),
        // the multipliers of a viscous orbit are those of the self-excited system: no statement about the body
        stable: stability.filter(|_| orbit.viscous.is_none()).map(|s| s.is_stable()),
        jumps: switches.clone().map(|s| s.energy_jump).collect(),
        switches: switches.map(|s| (s.t, s.node, s.kind)).collect(),
        viscous: orbit.viscous.as_ref().map(feedback),
        friction: orbit.rubbed.as_ref().map(|rubbed| FrictionRecord {
            work: rubbed.work(),
            belt: rubbed.belt,
            family: orbit.residual_positions(),
            drift: orbit.drift,
        }),
        extremes: orbit.extremes.clone(),
    })
}

fn pairs(stability: Option<&Stability>) -> Vec<[f64; 2]> {
    stability.map_or(vec![], Stability::pairs)
}

fn feedback(f: &Feedback) -> ViscousRecord {
    let Feedback { alpha, beta, turned_over, under_load } = f;
    let under_load = pairs(under_load.as_ref());
    ViscousRecord { alpha: *alpha, beta: *beta, turned_over: *turned_over, under_load }
}

/// Where a continuation stands, as a file keeps it.
pub(super) fn place_record(place: &Place<Chain>, memory: Vec<f64>) -> PlaceRecord {
    PlaceRecord {
        x: place.x.clone(),
        tangent: place.tangent.clone(),
        step: place.step,
        orientation: place.orientation,
        signature: place.signature.clone(),
        sets: place.chart.sets.clone(),
        points: place.chart.points.clone(),
        base: vec![],
        memory,
    }
}

/// The place that a file kept.
pub fn place_of(record: &PlaceRecord) -> Place<Chain> {
    Place {
        x: record.x.clone(),
        tangent: record.tangent.clone(),
        step: record.step,
        orientation: record.orientation,
        signature: record.signature.clone(),
        chart: Chain { sets: record.sets.clone(), points: record.points.clone(), struck: vec![] },
    }
}

/// What a special point of a continuation is as a point of a family; `of_border` tells what a border is, at which the frequency turns back or not.
pub(crate) fn kind_of<B>(
    special: &Special<B>,
    of_border: impl FnOnce(&B, bool) -> PointKind,
) -> PointKind {
    match special {
        Special::Start => PointKind::Start,
        Special::End => PointKind::EndOfRange,
        Special::Fold => PointKind::Fold,
        Special::Corner { located: true } => {
            PointKind::Border("a corner, the frequency turns back".into())
        }
        Special::Corner { located: false } => {
            PointKind::Border("a corner near here, the frequency turns back".into())
        }
        Special::BranchPoint => PointKind::BranchPoint,
        Special::Border { border, turns } => of_border(border, *turns),
        Special::Stability(before, after) => {
            PointKind::Stability(StabilityChange::new(before, after))
        }
    }
}

impl Verdict {
    /// The verdict as a file keeps it.
    pub fn kind(&self) -> VerdictKind {
        match self {
            Verdict::Orbit(_) => VerdictKind::Orbit,
            Verdict::NoContact { .. } => VerdictKind::NoContact,
            Verdict::Flawed { .. } => VerdictKind::Flawed,
            Verdict::Fold { .. } => VerdictKind::Fold,
            Verdict::Grazing { .. } => VerdictKind::Grazing,
            Verdict::NotFound { .. } => VerdictKind::NotFound,
        }
    }
}

/// How a sequential continuation tries.
pub struct Sequential<'a> {
    /// Frequencies, in order.
    pub grid: &'a [f64],
    /// The step of the whole grid.
    pub step: f64,
    /// What to do for one orbit.
    pub effort: Effort,
    /// Guesses at a frequency while nothing is known, or where the last orbit is far away.
    pub first: &'a dyn Fn(&Propagator, f64) -> Vec<Vec<f64>>,
    /// The guess of another method, where none of those leads to an orbit.
    pub last: &'a dyn Fn(&Propagator, f64) -> Option<Vec<f64>>,
}

/// Behind so many frequencies without an orbit, in steps of the grid, a branch has ended: what else there is counts.
const FAR: f64 = 3.5;

/// How often a step that fails is halved.
const HALVINGS: u32 = 2;

/// Sequential continuation: at each frequency from the secant, then the previous point, then over smaller steps in between; what does
/// not exist is a gap with its verdict, what is far from the expectation a jump. `known` are the solutions of an earlier part.
pub fn sequential(
    body: &mut Propagator,
    closure: Closure,
    plan: &Sequential,
    mut known: Vec<(f64, Vec<f64>)>,
    mut take: impl FnMut(PointRecord, &Verdict) -> Go,
) -> Result<(), OrbitError> {
    for &omega in plan.grid {
        let expected = guesses(&known, omega).into_iter().next().map(|g| g.1);
        let verdict = try_at(body, closure, plan, &known, omega)?;
        let point = match verdict.orbit() {
            Some(orbit) => {
                let found = closure.frame(&orbit.z);
                let distance = |a: &[f64]| {
                    let d: f64 = a.iter().zip(found).map(|(a, b)| (a - b).powi(2)).sum();
                    (d / found.iter().map(|z| z * z).sum::<f64>()).sqrt()
                };
                let jumped = expected.as_deref().is_some_and(|e| distance(e) > JUMP);
                let special = if known.is_empty() {
                    PointKind::Start
                } else if jumped {
                    PointKind::Jump
                } else {
                    PointKind::Regular
                };
                known.push((omega, orbit.z.clone()));
                let place = PlaceRecord {
                    x: orbit.z.iter().copied().chain([omega]).collect(),
                    ..PlaceRecord::default()
                };
                let orbit = Some(record(body, orbit)?);
                PointRecord { omega, special, orbit, place: Some(place), ..PointRecord::default() }
            }
            None => PointRecord {
                omega,
                special: PointKind::Gap(GapReason::Verdict(verdict.kind())),
                ..PointRecord::default()
            },
        };
        if take(point, &verdict).is_break() {
            return Ok(());
        }
    }
    Ok(())
}

fn try_at(
    body: &mut Propagator,
    closure: Closure,
    plan: &Sequential,
    known: &[(f64, Vec<f64>)],
    omega: f64,
) -> Result<Verdict, OrbitError> {
    let mut list: Vec<Vec<f64>> = guesses(known, omega).into_iter().map(|g| g.1).collect();
    if list.is_empty() {
        list = (plan.first)(body, omega);
    }
    // quick attempts first, the search for the cause last
    let quick = Effort { rescue: false, ..plan.effort };
    for guess in &list {
        let verdict = find(body, closure, guess, omega, &quick)?;
        if verdict.orbit().is_some() {
            return Ok(verdict);
        }
    }
    if let Some((last, _)) = known.last() {
        for halving in 1..=HALVINGS {
            let parts = 1 << halving;
            let mut near = known.to_vec();
            let mut verdict = None;
            for k in 1..=parts {
                let w = last + (omega - last) * f64::from(k) / f64::from(parts);
                let multipliers = k == parts && plan.effort.multipliers;
                let found = guesses(&near, w).into_iter().map(|g| g.1).find_map(|guess| {
                    let effort = Effort { multipliers, ..quick };
                    find(body, closure, &guess, w, &effort).ok().filter(|v| v.orbit().is_some())
                });
                let Some(found) = found else { break };
                near.extend(found.orbit().map(|o| (w, o.z.clone())));
                verdict = (k == parts).then_some(found);
            }
            if let Some(verdict) = verdict {
                return Ok(verdict);
            }
        }
    }
    if let Closure::Viscous(pin) = closure {
        // a basin that reaches from the linear mode: higher viscosity first, then down
        let mut found = viscous::by_viscosity(body, pin, omega, &quick)?;
        if found.as_ref().and_then(Verdict::orbit).is_none()
            && known.is_empty()
            && let Some(guess) = (plan.last)(body, omega)
        {
            found = Some(find(body, closure, &guess, omega, &quick)?);
        }
        let nothing = || Verdict::not_found("no path of viscosities leads to an orbit");
        return Ok(found.unwrap_or_else(nothing));
    }
    if closure == Closure::FORCED {
        // what the body settles to from where it was
        return Ok(match ladder(body, &list, omega)? {
            Ok(orbit) => Verdict::Orbit(orbit),
            Err(why) => Verdict::not_found(why),
        });
    }
    let mut worst = None;
    for guess in list.iter().rev() {
        let verdict = find(body, closure, guess, omega, &plan.effort)?;
        if verdict.orbit().is_some() {
            return Ok(verdict);
        }
        // a fold or a grazing says more than that nothing was found
        if worst.is_none() || !matches!(verdict, Verdict::NotFound { .. }) {
            worst = Some(verdict);
        }
    }
    if known.last().is_some_and(|(last, _)| (omega - last).abs() > FAR * plan.step) {
        for guess in (plan.first)(body, omega) {
            let verdict = find(body, closure, &guess, omega, &quick)?;
            if verdict.orbit().is_some() {
                return Ok(verdict);
            }
        }
    }
    Ok(worst.unwrap_or_else(|| Verdict::not_found("there is nothing to start from")))
}

/// Displacements, as a frame vector, of the mode `mode` (from 1) at `amplitude` times grazing (negative: the far point); of the phase of the equilibrium, around it and over the first
/// switch, where motions are told around one.
pub fn mode_guess(body: &Propagator, mode: usize, amplitude: f64) -> Option<Vec<f64>> {
    let n = body.n();
    let k = mode.checked_sub(1).filter(|k| *k < n)?;
    let scale = body.system.first_switch(body.home.shapes.col_as_slice(k))?;
    let mut z = vec![0.0; n];
    z[k] = amplitude * scale * body.scale[k];
    Some(z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_is_called_in_files_as_it_calls_itself() {
        let grazing = Verdict::Grazing { omega: 1.0, what: "node 1 touches".into() };
        let fold = Verdict::Fold { omega: 1.0, energy: 1.0, switches: 8, singular_value: 1e-9 };
        let lost = Verdict::NotFound { residual: 1.0, singular_value: 1.0, reason: None };
        for verdict in [Verdict::NoContact { energy: 0.0 }, fold, grazing, lost] {
            assert_eq!(verdict.kind().name(), verdict.word());
        }
    }
}
