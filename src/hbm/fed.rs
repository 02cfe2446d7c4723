//! Families of viscous nonlinear modes by harmonic balance, point by point, with all that a file keeps of them.

use super::branch::{gap_reason, record, series_record};
use super::newton::Settings;
use super::series::{Basis, Series};
use super::viscous::{Fed, Viscous};
use super::{Failure, HbmError};
use crate::continuation::{Go, JUMP, guesses};
use crate::orbit::search::{Effort, find};
use crate::orbit::{Closure, Propagator};
use crate::records::{
    OrbitRecord, PlaceRecord, PointKind, PointRecord, SeriesRecord, ViscousRecord,
};

/// With fewer harmonics `α`, the damping of the mode, is off by tens of per cent, and is not told.
pub const LEAST_FOR_ALPHA: usize = 7;

/// The body of a family.
pub struct Body {
    /// For harmonic balance.
    pub viscous: Viscous,
    /// For shooting from every solution; none: nothing is shot.
    pub shooter: Option<Propagator>,
}

/// What is computed at each frequency.
pub struct Sequential<'a> {
    /// Frequencies, in order.
    pub grid: &'a [f64],
    /// Numbers of harmonics, ascending: a branch each.
    pub harmonics: &'a [usize],
    /// Newton's settings.
    pub settings: &'a Settings,
}

/// What is known of one number of harmonics: `(q, α)` at the last two frequencies.
type Track = Vec<(f64, Vec<f64>)>;

/// Sequential continuation: at each frequency and for each number of harmonics from the secant, the previous point, the solution with fewer harmonics, the
/// linear mode. `known` are the points of an earlier part.
pub fn sequential(
    body: &mut Body,
    plan: &Sequential,
    known: &[&PointRecord],
    mut take: impl FnMut(PointRecord) -> Go,
) -> Result<(), HbmError> {
    let mut tracks: Vec<Track> = vec![vec![]; plan.harmonics.len()];
    for p in known {
        if let (Some(track), Some(place)) = (tracks.get_mut(p.branch), &p.place)
            && let [unknowns @ .., omega] = &place.x[..]
        {
            push(track, *omega, unknowns.to_vec());
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
                    push(track, omega, unknowns);
                    let place = Some(PlaceRecord { x, ..PlaceRecord::default() });
                    let Body { viscous, shooter } = body;
                    let point = point(viscous, shooter.as_mut(), &fed, kind)?;
                    below = Some(fed);
                    PointRecord { place, ..point }
                }
                Err(failure) => PointRecord {
                    omega,
                    special: PointKind::Gap(gap_reason(&failure)),
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

fn push(track: &mut Track, omega: f64, unknowns: Vec<f64>) {
    track.push((omega, unknowns));
    if track.len() > 2 {
        track.remove(0);
    }
}

/// Whether a series is far from what the points before it let expect.
fn is_far(expected: &[f64], found: &[f64]) -> bool {
    let d: f64 = expected.iter().zip(found).map(|(a, b)| (a - b).powi(2)).sum();
    d > JUMP * JUMP * found.iter().map(|x| x * x).sum::<f64>()
}

/// A solution of `n_h` harmonics from the first of all guesses that leads to one.
fn attempt(
    body: &mut Viscous,
    track: &Track,
    below: Option<&Fed>,
    (n_h, omega): (usize, f64),
    plan: &Sequential,
) -> Result<Result<Fed, Failure>, HbmError> {
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
    viscous: &Viscous,
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
    let plain = record(reduction, s)?;
    let system = &reduction.system;
    let energy = system.elastic(&plain.u0) + system.kinetic(&plain.v0);
    let mut orbit = OrbitRecord { energy, viscous: Some(feedback), ..plain };
    let mut special = kind;
    if let Some(body) = shooter {
        let closure = Closure::Viscous(viscous.pin);
        let (q, dq) = s.q.at(0.0);
        let mut guess = body.frame(&reduction.state(&q, &dq, s.omega));
        guess.push(fed.alpha);
        let verdict = find(body, closure, &guess, s.omega, &Effort::of(closure))?;
        match verdict.orbit().and_then(|o| o.stability.as_ref()) {
            Some(known) => {
                orbit.multipliers = known.multipliers.iter().map(|m| [m.0, m.1]).collect();
                orbit.trivial = known.trivial;
            }
            None if special == PointKind::Regular => {
                special = PointKind::NoOrbitNear(verdict.kind());
            }
            None => {}
        }
    }
    if s.undecided > 0 && special == PointKind::Regular {
        special = PointKind::Undecided(s.undecided);
    }
    let series = Some(SeriesRecord { alpha: Some(fed.alpha), ..series_record(reduction, s) });
    Ok(PointRecord {
        omega: s.omega,
        special,
        orbit: Some(orbit),
        series,
        ..PointRecord::default()
    })
}
