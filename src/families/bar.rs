//! Backbones of a uniform bar by boundary elements ([`crate::hbm::bem`]), frequency by frequency: solutions as points of a family.
//!
//! In files `t = 0` is the far point, as for every backbone; the method itself counts from mid-contact, half a period off: `u_k → (−1)^k u_k`.

use std::f64::consts::TAU;

use super::FamilyError;
use super::follow::Take;
use super::sequence::{Stretch, at_once};
use crate::contact::System;
use crate::continuation::norm;
use crate::event::SwitchKind;
use crate::hbm::bem::{BarBalance, BarSeries, NoBarSeries};
use crate::records::{
    BranchEnd, OrbitRecord, PlaceRecord, PointKind, PointRecord, SeriesRecord, place_of_function,
};

/// Instants a period at which a solution is looked at.
const SAMPLES: usize = 2000;

/// Solutions at each frequency with each number of harmonics: from the one before, from that with fewer harmonics, from the closed form.
pub fn series(
    (bar, system): (&BarBalance, &System),
    harmonics: &[usize],
    stretch: Stretch,
    known: &[&PointRecord],
    take: Take,
) -> Result<BranchEnd, FamilyError> {
    at_once(harmonics, stretch, known, take, |grid, before, take| {
        let mut last: Vec<Option<Vec<f64>>> =
            (0..harmonics.len()).map(|branch| earlier(before, branch)).collect();
        for &omega in grid {
            let mut fewer: Option<Vec<f64>> = None;
            for (branch, &m) in harmonics.iter().enumerate() {
                let padded = |u: &Vec<f64>| {
                    let mut u = u.clone();
                    u.resize(m + 1, 0.0);
                    u
                };
                let guesses = [last[branch].clone(), fewer.as_ref().map(padded)];
                let guesses = guesses.into_iter().flatten().chain(bar.closed_form(omega, m));
                let found = nearest_of(guesses.map(|u| (bar.solve(omega, &u), u)));
                let mut point = PointRecord { omega, branch, ..PointRecord::default() };
                match found {
                    Ok(s) => {
                        last[branch] = Some(s.u.clone());
                        fewer = Some(s.u.clone());
                        point.orbit = Some(record(bar, system, &s));
                        point.series = Some(displacements(bar, system, &s));
                        let x = s.u.iter().copied().chain([omega]).collect();
                        point.place = Some(PlaceRecord { x, ..PlaceRecord::default() });
                    }
                    Err(e) => point.special = PointKind::Failed(e.to_string()),
                }
                if take(point).is_break() {
                    return Ok(());
                }
            }
        }
        Ok(())
    })
}

/// Of the solutions from several guesses the one that is nearest to its own: others are of other families, or of none.
fn nearest_of(
    attempts: impl Iterator<Item = (Result<BarSeries, NoBarSeries>, Vec<f64>)>,
) -> Result<BarSeries, NoBarSeries> {
    let mut failed = NoBarSeries::NotConverged { residual: f64::NAN, iterations: 0 };
    let mut best: Option<(f64, BarSeries)> = None;
    for (attempt, guess) in attempts {
        match attempt {
            Ok(s) => {
                let moved: Vec<f64> = s.u.iter().zip(&guess).map(|(a, b)| a - b).collect();
                let far = norm(&moved) / norm(&guess).max(f64::MIN_POSITIVE);
                if best.as_ref().is_none_or(|(least, _)| far < *least) {
                    best = Some((far, s));
                }
            }
            Err(e) => failed = e,
        }
    }
    best.map(|(_, s)| s).ok_or(failed)
}

/// Coefficients of the last known solution of a branch.
fn earlier(before: &[&PointRecord], branch: usize) -> Option<Vec<f64>> {
    let mut places = before.iter().rev().filter(|p| p.branch == branch);
    let (_, u) = places.find_map(|p| p.place.as_ref())?.x.split_last()?;
    Some(u.to_vec())
}

fn direction(system: &System) -> f64 {
    system.constraints.first().map_or(1.0, |c| c.normal[0])
}

fn sign_of(k: usize) -> f64 {
    if k.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// `u_k` at every node, along x, `t = 0` in mid-contact.
fn at_nodes(bar: &BarBalance, system: &System, s: &BarSeries, k: usize) -> Vec<f64> {
    let mesh = &system.body.mesh;
    let kappa = k as f64 * s.omega / bar.speed;
    let of = |x: f64| {
        let held = if direction(system) > 0.0 { x } else { bar.length - x };
        let shape = match k {
            0 => held / bar.stiffness,
            _ => (kappa * held).sin() / (kappa * bar.stiffness * (kappa * bar.length).cos()),
        };
        direction(system) * s.p[k] * shape
    };
    mesh.nodes().iter().map(|p| of(p[0])).collect()
}

/// All displacements from those of the nodes.
fn full(system: &System, nodal: &[f64]) -> Vec<f64> {
    let mut u = system.body.dofs.gather(nodal);
    let of_points = system.along_normals(&u);
    u[system.n_o()..].copy_from_slice(&of_points);
    u
}

/// The series of `u_O`.
fn displacements(bar: &BarBalance, system: &System, s: &BarSeries) -> SeriesRecord {
    let (n, n_h) = (system.n_o(), s.u.len() - 1);
    let mut coefficients = vec![0.0; (2 * n_h + 1) * n];
    for k in 0..=n_h {
        let u = full(system, &at_nodes(bar, system, s, k));
        let place = place_of_function((k, false)) * n;
        (0..n).for_each(|i| coefficients[place + i] = sign_of(k) * u[i]);
    }
    SeriesRecord { omega: s.omega, n_h, coefficients, alpha: None }
}

/// A solution as an orbit: what the weighted conditions leave is in its penetration and tension.
fn record(bar: &BarBalance, system: &System, s: &BarSeries) -> OrbitRecord {
    let period = TAU / s.omega;
    let unit = system.units.length;
    let nodes = system.body.mesh.n_nodes();
    let mut u0 = vec![0.0; nodes];
    for k in 0..s.u.len() {
        let shape = at_nodes(bar, system, s, k);
        u0.iter_mut().zip(&shape).for_each(|(u, x)| *u += sign_of(k) * x);
    }
    let at = |x: &[f64], t: f64| -> f64 {
        x.iter().enumerate().map(|(k, x)| x * (k as f64 * s.omega * t).cos()).sum()
    };
    let rho = bar.rho * bar.stiffness / bar.length;
    // half a period from mid-contact is the far point
    let excess = |t: f64| {
        let t = t + 0.5 * period;
        rho * (at(&s.u, t) - bar.gap) - at(&s.p, t)
    };
    let (mut amplitude, mut energy, mut contact_time) = (0.0f64, 0.0f64, 0.0);
    let mut switches = vec![];
    let node = system.constraints.first().map_or(0, |c| c.node);
    let step = period / SAMPLES as f64;
    let mut last = excess(0.0);
    for i in 1..=SAMPLES {
        let t = i as f64 * step;
        let now = excess(t);
        amplitude = amplitude.max(at(&s.u, t).abs());
        if (now > 0.0) != (last > 0.0) {
            switches.push((
                t - step * now / (now - last),
                node,
                SwitchKind::of_crossing(now > 0.0),
            ));
        }
        contact_time += if now > 0.0 { step } else { 0.0 };
        if i % 50 == 0 {
            energy = energy.max(bar.energies(s, t).iter().sum());
        }
        last = now;
    }
    let [penetration, tension] = bar.violations(s);
    OrbitRecord {
        period,
        energy,
        amplitude,
        residual: s.residual,
        contact_time,
        grazing: f64::NAN,
        penetration: penetration / unit,
        tension: tension / (bar.stiffness / bar.length * unit),
        balance: f64::NAN,
        jumps: vec![f64::NAN; switches.len()],
        switches,
        u0: full(system, &u0),
        v0: vec![0.0; system.n()],
        ..OrbitRecord::default()
    }
}
