//! Families of motions of two frequencies: closed curves of the period map, size by size from where a pair of multipliers leaves the unit circle ([`crate::orbit::torus`]).

use super::FamilyError;
use crate::contact::System;
use crate::continuation::Go;
use crate::orbit::settle::ladder;
use crate::orbit::torus::{Given, Torus};
use crate::orbit::{OrbitError, Propagator};
use crate::records::{Tori, TorusRow};

/// Told of what is known after each curve.
pub type Take<'a> = &'a mut dyn FnMut(&Tori) -> Result<Go, FamilyError>;

/// Harmonics of the first curve, and most.
const HARMONICS: (usize, usize) = (12, 72);
/// Where the last coefficients are larger than this, over the first, there have to be more.
const TAIL: f64 = 1e-8;
/// A step is so much longer than the last one where that was taken at once, and half as long where there was no curve; the shortest, over the first size.
const LONGER: f64 = 1.3;
const SHORTEST: f64 = 0.02;

/// The first size of a curve, over the unit of frame vectors, where none is given.
pub const SIZE: f64 = 0.01;

/// What is missing of a family, from the orbit of the loads' own period at its first frequency. In words, how it ended where it came to an end.
pub fn follow(
    system: &System,
    guesses: &[Vec<f64>],
    tori: &mut Tori,
    (take, ends_now): (Take, &dyn Fn() -> bool),
) -> Result<Go, FamilyError> {
    let mut body = Propagator::new(system.clone()).map_err(OrbitError::from)?;
    let body = &mut body;
    let (mut torus, mut step) = match tori.rows.last() {
        Some(row) => {
            let Some(torus) = of_row(body, row) else { return Err(FamilyError::Place) };
            (torus, row.step)
        }
        None => match first(body, guesses, tori)? {
            Ok(torus) => (torus, tori.size),
            Err(why) => {
                tori.end = why;
                return Ok(Go::Continue(()));
            }
        },
    };
    while tori.rows.len() < tori.count {
        if ends_now() {
            return Ok(Go::Break(()));
        }
        let is_first = tori.rows.is_empty();
        let size = if is_first { tori.size } else { torus.size() + step };
        let found = torus.grown(size).corrected(body, Given::Size(size))?;
        let Some(next) = found else {
            step *= 0.5;
            if is_first || step < SHORTEST * tori.size {
                tori.end = format!(
                    "no curve of size {size:.3e} next to the last one: it ends there, or is no smooth one any more"
                );
                break;
            }
            continue;
        };
        if next.tail() > TAIL {
            let more = next.harmonics() + next.harmonics() / 2;
            if more > HARMONICS.1 {
                tori.end = format!(
                    "the curve of size {size:.3e} asks for more than {} harmonics",
                    HARMONICS.1
                );
                break;
            }
            torus = torus.with_harmonics(more);
            continue;
        }
        let [low, high] = tori.range;
        if !(low..=high).contains(&next.omega) {
            tori.end = format!("the end of the range: omega = {:.6}", next.omega);
            break;
        }
        step *= LONGER;
        tori.rows.push(row(body, &next, step)?);
        torus = next;
        if take(tori)?.is_break() {
            return Ok(Go::Break(()));
        }
    }
    if tori.end.is_empty() {
        tori.end = format!("{} curves", tori.rows.len());
    }
    Ok(Go::Continue(()))
}

/// A small curve around the orbit at the first frequency; in words, why there is none.
fn first(
    body: &mut Propagator,
    guesses: &[Vec<f64>],
    tori: &Tori,
) -> Result<Result<Torus, String>, FamilyError> {
    let orbit = match ladder(body, guesses, tori.start)? {
        Ok(orbit) => orbit,
        Err(why) => return Ok(Err(format!("no orbit at omega = {}: {why}", tori.start))),
    };
    let torus = Torus::around(body, &orbit.z, tori.start, (tori.size, HARMONICS.0))?;
    Ok(torus.ok_or_else(|| {
        format!("the orbit at omega = {} has no pair of complex multipliers", tori.start)
    }))
}

/// The curve of a row, if it fits the body.
fn of_row(body: &Propagator, row: &TorusRow) -> Option<Torus> {
    let n = 2 * body.n();
    let fits = row.states.len() % 2 == 1 && row.states.iter().all(|x| x.len() == n);
    let TorusRow { omega, rho, states, .. } = row.clone();
    fits.then_some(Torus { omega, rho, states })
}

fn row(body: &mut Propagator, torus: &Torus, step: f64) -> Result<TorusRow, FamilyError> {
    let (amplitude, force) = torus.seen(body)?;
    let attraction = torus.attraction(body)?.unwrap_or(f64::NAN);
    let system = &body.system;
    let at_points: Vec<[Vec<f64>; 2]> = torus.states.iter().map(|z| at_contact(body, z)).collect();
    let extent = |i: usize| {
        let of = || at_points.iter().map(|p| p[0][i]);
        of().fold(f64::NEG_INFINITY, f64::max) - of().fold(f64::INFINITY, f64::min)
    };
    let lead = (0..system.n_contact()).max_by(|&i, &j| extent(i).total_cmp(&extent(j)));
    let lead = lead.map_or(vec![], |i| at_points.iter().map(|p| [p[0][i], p[1][i]]).collect());
    Ok(TorusRow {
        omega: torus.omega,
        rho: torus.rho,
        size: torus.size(),
        tail: torus.tail(),
        attraction,
        amplitude,
        force,
        step,
        states: torus.states.clone(),
        lead,
    })
}

/// Displacements and velocities of the contact points of a state, with the active set that it has.
fn at_contact(body: &Propagator, z: &[f64]) -> [Vec<f64>; 2] {
    let system = &body.system;
    let state = body.state(z);
    let open = crate::contact::States::open(system.n_contact());
    let set = system.select(0.0, &state.u, &open).map_or(open, |selection| selection.set);
    let phase = system.phase(&set);
    let (mut u, mut v) = (vec![0.0; system.n()], vec![0.0; system.n()]);
    phase.expand_displacement(0.0, &state.u, &mut u);
    phase.expand_velocity(0.0, &state.v, &mut v);
    [system.at_points(&u), system.at_points(&v)]
}
