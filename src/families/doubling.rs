//! Period doublings of a response, and the orbits of twice the period that begin there.
//!
//! At a period doubling a multiplier passes −1: to first order the motion `z + ε v`, `M v = −v`, comes back after two periods of the loads. The orbits of twice
//! the period are looked for from there, on the side where the multiplier is below −1 (a supercritical doubling), then on the other one (a subcritical one).

use std::f64::consts::TAU;

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::FamilyError;
use crate::orbit::along::{self, Start};
use crate::orbit::period_map::integrate;
use crate::orbit::search::{Effort, find};
use crate::orbit::section::at_origin;
use crate::orbit::{Closure, OrbitError, Propagator, floquet};
use crate::records::{Bifurcation, PointKind, PointRecord};
use crate::store::StoredFamily;

/// An orbit beside a doubling: its frame vector at a section of the loads, and its frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Beside {
    z: Vec<f64>,
    omega: f64,
    section: f64,
}

/// A period doubling of a stored response.
#[derive(Debug, Clone, PartialEq)]
pub struct Doubling {
    /// Branch of the response.
    pub branch: usize,
    /// Frequency: to the accuracy with which the response located it.
    pub omega: f64,
    /// Orbits on the side where a multiplier is below −1, and on the other one, nearest first: frame vector and frequency.
    pub sides: [Vec<Beside>; 2],
}

/// So many orbits on each side of a doubling are tried.
const TRIED: usize = 6;

/// All period doublings of a response by shooting, of a body whose frame vectors have `size` entries.
pub(crate) fn of_family(family: &StoredFamily, size: usize) -> Vec<Doubling> {
    let mut found = vec![];
    for branch in 0..family.branches.len() {
        let points = family.branch(branch);
        for (k, p) in points.iter().enumerate() {
            let PointKind::Stability(change) = &p.special else { continue };
            if change.how != Bifurcation::PeriodDoubling {
                continue;
            }
            let below = |x: &[i64]| x.get(1).copied().unwrap_or(0);
            let opens = below(&change.after) > below(&change.before);
            let known = |p: &&PointRecord| {
                let place = p.place.as_ref().filter(|_| p.orbit.is_some())?;
                let (&omega, z) = place.x.split_last()?;
                let section = along::section_of(place);
                (z.len() >= size).then(|| Beside { z: z[..size].to_vec(), omega, section })
            };
            let behind = points[k..].iter().filter_map(known).take(TRIED).collect();
            let ahead = points[..k].iter().rev().filter_map(known).take(TRIED).collect();
            let sides = if opens { [behind, ahead] } else { [ahead, behind] };
            found.push(Doubling { branch, omega: p.omega, sides });
        }
    }
    found
}

/// A multiplier above this is no sign of a doubling nearby.
const LOWEST: f64 = -0.3;

/// How far along the eigenvector an orbit of twice the period is looked for, over the size of the state.
const ALONG: [f64; 8] = [0.01, 0.03, 0.003, 0.1, 0.2, 0.5, 1.0, 2.0];

/// An orbit of two periods of the loads beside a doubling, and the direction that leads away from the doubling.
pub fn start(
    body: &mut Propagator,
    doubling: &Doubling,
) -> Result<Result<Start, String>, FamilyError> {
    let closure = Closure::Forced(2);
    for Beside { z, omega, section } in doubling.sides.iter().flatten() {
        body.system.loads_mut().set_frequency(*omega);
        let z = &at_origin(body, z, *omega, (*section, 1))?;
        let Some(v) = flip(body, z, TAU / omega)? else { continue };
        let size = z.iter().map(|z| z * z).sum::<f64>().sqrt();
        for share in ALONG {
            let guess: Vec<f64> = z.iter().zip(&v).map(|(z, v)| z + share * size * v).collect();
            let effort = Effort { rescue: false, ..Effort::of(closure) };
            let verdict = find(body, closure, &guess, *omega, &effort)?;
            if let Some(orbit) = verdict.orbit() {
                let away = (omega - doubling.omega).signum();
                return Ok(Ok(Start::Orbit(Box::new(orbit.clone()), away)));
            }
        }
    }
    Ok(Err(format!("no orbit of twice the period is found beside omega = {:.8}", doubling.omega)))
}

/// The unit eigenvector of the lowest real multiplier, by inverse iteration; none if that is far from −1.
fn flip(body: &Propagator, z: &[f64], period: f64) -> Result<Option<Vec<f64>>, FamilyError> {
    let passage = integrate(body, &body.state(z), period)?;
    let walk = body.walk(&passage.chain, z, &passage.times, period).map_err(OrbitError::from)?;
    let m = floquet::monodromy(body, (&passage.chain, &walk))?;
    let all = floquet::multipliers(&m)?;
    let real = all.iter().filter(|m| m.1 == 0.0 && m.0 < LOWEST);
    let Some(mu) = real.map(|m| m.0).min_by(f64::total_cmp) else { return Ok(None) };
    let n = m.nrows();
    let near = mu * (1.0 + 1e-9);
    let shifted = Mat::from_fn(n, n, |i, j| m[(i, j)] - if i == j { near } else { 0.0 });
    let lu = shifted.partial_piv_lu();
    let mut v = Mat::from_fn(n, 1, |i, _| 1.0 + ((i * i) as f64).sin());
    for _ in 0..4 {
        v = lu.solve(&v);
        let length = v.norm_l2();
        v = Mat::from_fn(n, 1, |i, _| v[(i, 0)] / length);
    }
    let v: Vec<f64> = (0..n).map(|i| v[(i, 0)]).collect();
    Ok(v.iter().all(|x| x.is_finite()).then_some(v))
}
