//! Families of damped nonlinear modes, amplitude by amplitude, with all that a file keeps of them.

use super::branch::{confirmed, record_of};
use super::damped::{DampedMode, Found};
use super::newton::Settings;
use super::response::Summary;
use super::viscous::Fed;
use super::viscous_mode::LEAST_FOR_ALPHA;
use super::{Balanced, HbmError};
use crate::continuation::{Go, guesses};
use crate::records::{GapReason, OrbitRecord, PlaceRecord, PointKind, PointRecord, ViscousRecord};

/// A family: amplitudes, ascending.
pub struct Amplitudes<'a> {
    /// Largest displacements of the body where everything sticks.
    pub grid: &'a [f64],
    /// Number of harmonics.
    pub n_h: usize,
    /// Newton's settings.
    pub settings: &'a Settings,
}

/// Most halvings of a step between amplitudes.
const HALVINGS: u32 = 6;

/// Follow a damped nonlinear mode; `known` are the points of an earlier part.
pub fn follow(
    mode: &DampedMode,
    plan: &Amplitudes,
    known: &[&PointRecord],
    mut take: impl FnMut(PointRecord) -> Go,
) -> Result<(), HbmError> {
    let reach = mode.reach();
    let mut track: Vec<(f64, Vec<f64>)> = vec![];
    for place in known.iter().filter_map(|p| p.place.as_ref()) {
        if let [n @ .., alpha, amplitude, omega] = &place.x[..] {
            let unknowns = n.iter().copied().chain([*omega, *alpha]).collect();
            track.push((amplitude.ln(), unknowns));
        }
    }
    for &size in &plan.grid[known.len().min(plan.grid.len())..] {
        let amplitude = size / reach;
        let found = reach_amplitude(mode, plan, &mut track, amplitude)?;
        let point = match found {
            Ok(Found { fed, mut unknowns }) => {
                unknowns.truncate(unknowns.len() - 2);
                unknowns.extend([fed.alpha, amplitude, fed.solution.omega]);
                let place = Some(PlaceRecord { x: unknowns, ..PlaceRecord::default() });
                PointRecord { place, ..point(mode, &fed)? }
            }
            Err(failure) => PointRecord {
                omega: track.last().map_or(mode.stuck_frequency(), |t| t.1[t.1.len() - 2]),
                special: PointKind::Gap(failure),
                ..PointRecord::default()
            },
        };
        if take(point).is_break() {
            return Ok(());
        }
    }
    Ok(())
}

/// The mode at an amplitude, by way of others where one step is too long.
fn reach_amplitude(
    mode: &DampedMode,
    plan: &Amplitudes,
    track: &mut Vec<(f64, Vec<f64>)>,
    amplitude: f64,
) -> Result<Result<Found, GapReason>, HbmError> {
    let to = amplitude.ln();
    let mut halvings = 0;
    let mut last = Err(GapReason::NoStart);
    let mut there = to;
    while halvings <= HALVINGS {
        let size = there.exp();
        let mut starts: Vec<Vec<f64>> = guesses(track, there).into_iter().map(|g| g.1).collect();
        if track.is_empty() {
            starts.extend(mode.starts(plan.n_h, size)?);
        }
        for start in &starts {
            last = mode.solve(start, (plan.n_h, size), plan.settings)?;
            if last.is_ok() {
                break;
            }
        }
        match &last {
            Ok(found) => {
                track.push((there, found.unknowns.clone()));
                if there == to {
                    return Ok(last);
                }
                there = to;
            }
            Err(_) => {
                halvings += 1;
                let Some((from, _)) = track.last() else { return Ok(last) };
                there = 0.5 * (from + there);
            }
        }
    }
    Ok(last)
}

/// A solution as a point.
fn point(mode: &DampedMode, fed: &Fed) -> Result<PointRecord, HbmError> {
    let (reduction, s) = (mode.reduction(), &fed.solution);
    let u = reduction.displacements(s)?;
    let summary = Summary::along(reduction, s, &u);
    let mut plain = record_of(reduction, s, &u, &summary)?;
    if mode.is_preloaded() {
        plain.amplitude = summary.swing;
    }
    let told = s.q.n_h >= LEAST_FOR_ALPHA || reduction.system.facing().is_empty();
    let feedback = ViscousRecord {
        alpha: if told { fed.alpha } else { f64::NAN },
        beta: 0.0,
        turned_over: f64::NAN,
        under_load: vec![],
    };
    let orbit = OrbitRecord { viscous: Some(feedback), ..plain };
    confirmed(None, (s, &u, Some(fed.alpha)), (orbit, PointKind::Regular), &mut |_| Ok(None))
}
