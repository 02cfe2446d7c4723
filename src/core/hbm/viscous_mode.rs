//! Families of viscous nonlinear modes by harmonic balance, point by point, with all that a file keeps of them.

use super::branch::{Sequential, confirmed, record};
use super::multipliers::Told;
use super::newton::Settings;
use super::response::is_far;
use super::series::{Basis, Series};
use super::viscous::{Fed, Viscous};
use super::{Balanced, HbmError};
use crate::continuation::{Go, guesses};
use crate::orbit::{Closure, Propagator};
use crate::records::{GapReason, OrbitRecord, PlaceRecord, PointKind, PointRecord, ViscousRecord};

/// With fewer harmonics `α`, the damping of the mode, is off by tens of per cent, and is not told.
pub(crate) const LEAST_FOR_ALPHA: usize = 7;

/// The body of a family.
pub struct ViscousBody {
    /// For harmonic balance.
    pub viscous: Viscous,
    /// For shooting from every solution; none: nothing is shot.
    pub shooter: Option<Propagator>,
}

/// What is known of one number of harmonics: `(q, α)` at the frequencies so far.
type Track = Vec<(f64, Vec<f64>)>;

/// Sequential continuation: at each frequency and for each number of harmonics from the secant, the previous point, the solution with fewer harmonics, the
/// linear mode. `known` are the points of an earlier part.
pub fn sequential(
    body: &mut ViscousBody,
    plan: &Sequential,
    known: &[&PointRecord],
    mut take: impl FnMut(PointRecord) -> Go,
) -> Result<(), HbmError> {
    let mut tracks: Vec<Track> = vec![vec![]; plan.harmonics.len()];
    for p in known {
        if let (Some(track), Some(place)) = (tracks.get_mut(p.branch), &p.place)
            && let [unknowns @ .., omega] = &place.x[..]
        {
            track.push((*omega, unknowns.to_vec()));
        }
    }
    for &omega in plan.grid {
        let mut below: Option<Fed> = None;
        for (branch, (&n_h, track)) in plan.harmonics.iter().zip(&mut tracks).enumerate() {
            let expected = guesses(track, omega).into_iter().next().map(|g| g.1);
            let found = attempt(&mut body.viscous, track, below.as_ref(), (n_h, omega), plan)?;
            let point = match found {
                Ok(fed) => {
                    let first = track.is_empty();
                    let kind = match expected {
                        _ if first => PointKind::Start,
                        Some(e) if is_far(&e, &fed.solution.q.a) => PointKind::Jump,
                        _ => PointKind::Regular,
                    };
                    let unknowns: Vec<f64> =
                        fed.solution.q.a.iter().copied().chain([fed.alpha]).collect();
                    let x = unknowns.iter().copied().chain([omega]).collect();
                    track.push((omega, unknowns));
                    let place = Some(PlaceRecord { x, ..PlaceRecord::default() });
                    let point = point(&mut body.viscous, body.shooter.as_mut(), &fed, kind)?;
                    below = Some(fed);
                    PointRecord { place, ..point }
                }
                Err(failure) => PointRecord {
                    omega,
                    special: PointKind::Gap(failure),
                    ..PointRecord::default()
                },
            };
            if take(PointRecord { branch, ..point }).is_break() {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// A solution of `n_h` harmonics from the first of all guesses that leads to one.
fn attempt(
    body: &mut Viscous,
    track: &Track,
    below: Option<&Fed>,
    (n_h, omega): (usize, f64),
    plan: &Sequential,
) -> Result<Result<Fed, GapReason>, HbmError> {
    let n = body.reduction().n();
    let mut starts: Vec<(Series, f64)> = vec![];
    for (_, unknowns) in guesses(track, omega) {
        let mut q = Series::zeros(Basis::Full, n_h, n);
        // a place of another body does not get this far: its file is refused
        if let Some((alpha, a)) = unknowns.split_last().filter(|(_, a)| a.len() == q.a.len()) {
            q.a.copy_from_slice(a);
            starts.push((q, *alpha));
        }
    }
    starts.extend(below.map(|b| (b.solution.q.with_harmonics(n_h), b.alpha)));
    for (q, alpha) in starts {
        let found = body.solve(&q, alpha, omega, plan.settings)?;
        if found.is_ok() {
            return Ok(found);
        }
    }
    body.from_mode(n_h, omega, plan.settings)
}

/// A solution as a point, with the multipliers of the orbit shot from it if that is asked for.
pub(super) fn point(
    viscous: &mut Viscous,
    shooter: Option<&mut Propagator>,
    fed: &Fed,
    kind: PointKind,
) -> Result<PointRecord, HbmError> {
    let reduction = viscous.reduction();
    let s = &fed.solution;
    let told = s.q.n_h >= LEAST_FOR_ALPHA;
    let feedback = ViscousRecord {
        alpha: if told { fed.alpha } else { f64::NAN },
        beta: viscous.pin.beta,
        turned_over: f64::NAN,
        under_load: vec![],
    };
    let u = reduction.displacements(s)?;
    let plain = record(reduction, s, &u)?;
    let system = &reduction.system;
    let (u0, v0) = s.state(&u, 0.0, 0).full(system)?;
    let energy = system.energy(0.0, &u0, &v0);
    let orbit = OrbitRecord { energy, viscous: Some(feedback), ..plain };
    let shooter = shooter.map(|body| (body, Closure::Viscous(viscous.pin)));
    let mut fewer = |n_h: usize| -> Result<Option<Told>, HbmError> {
        let guess = s.q.with_harmonics(n_h);
        let found = viscous.solve(&guess, fed.alpha, s.omega, &Settings::default())?;
        let Ok(Fed { solution, alpha }) = found else { return Ok(None) };
        let displacements = viscous.reduction().displacements(&solution)?;
        Ok(Some(Told { solution, displacements, alpha: Some(alpha) }))
    };
    confirmed(shooter, (s, &u, Some(fed.alpha)), (orbit, kind), &mut fewer)
}
