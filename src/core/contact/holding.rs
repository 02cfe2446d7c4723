//! Phases of the impact law: contact displacements move by themselves, points in contact are held by reactions.
//!
//! ```text
//! M ü = f − K u − nᵀλ,      n_c ü = 0   ⇒   λ_c = D_cc⁻¹ n_c M⁻¹ (f − K u),    D = n M⁻¹nᵀ
//! ```
//!
//! Monitors: the gaps `g − n u` of free points, the pressures `λ/area` of those in contact.

use nalgebra::DMatrix;

use super::expansion::{Drive, Expansion, Follow};
use super::inertia::HeldMass;
use super::monitor::{Row, Size, Term};
use super::states::States;
use super::system::Constraint;
use crate::fem::{Harmonic, Loads};

/// The displacements and the monitors of a set, one a point; `through` are the columns `K M⁻¹nᵀ`.
pub(super) fn holding(
    (mass, through): (&HeldMass, &[Vec<f64>]),
    constraints: &[Constraint],
    set: &States,
    loads: &Loads,
) -> (Expansion, Vec<Row>) {
    let closed = set.closed_points();
    let size = closed.len();
    let inverse = mass
        .block(&closed)
        .try_inverse()
        .unwrap_or_else(|| DMatrix::from_element(size, size, f64::NAN));
    let n_o = mass.normal.n_cols();
    let combined = |i: usize, of: &dyn Fn(usize) -> f64| -> f64 {
        (0..size).map(|j| inverse[(i, j)] * of(closed[j])).sum::<f64>()
            / constraints[closed[i]].area
    };
    let reaction =
        |i: usize| -> Vec<f64> { (0..n_o).map(|c| -combined(i, &|k| through[k][c])).collect() };
    let of_force = |f: &[f64]| -> Vec<f64> {
        let along = |k: usize| mass.columns[k].iter().zip(f).map(|(a, f)| a * f).sum::<f64>();
        (0..size).map(|i| combined(i, &along)).collect()
    };
    let offsets = loads.constant.as_ref().map_or_else(|| vec![0.0; size], |f| of_force(f));
    let row = |k: usize| {
        let gap = constraints[k].gap;
        let Some(i) = closed.iter().position(|&c| c == k) else {
            let size = Size { a: 0.0, b: 1.0, gap, c: 1.0 };
            return Row { constant: gap, terms: vec![(-1.0, Term::Entry(k))], size: [size; 2] };
        };
        let own = reaction(i);
        let size = Size { a: own.iter().map(|x| x.abs()).sum(), b: 0.0, gap, c: 1.0 };
        Row { constant: offsets[i], terms: vec![(1.0, Term::Own(own.into()))], size: [size; 2] }
    };
    let held = |&k: &usize| {
        let entry = mass.normal.row(k).next();
        entry.map_or((0, 0.0), |(j, sign)| (j, sign * constraints[k].gap))
    };
    let drive = |(index, load): (usize, &Harmonic)| {
        let mut monitor = vec![0.0; constraints.len()];
        closed.iter().zip(of_force(&load.force)).for_each(|(&k, p)| monitor[k] = p);
        let displacement = vec![0.0; constraints.len()];
        let driven = monitor.iter().any(|p| *p != 0.0);
        driven.then(|| Drive { index, load: load.clone(), displacement, monitor })
    };
    let expansion = Expansion {
        follow: Follow::Rows(mass.normal.clone()),
        offset: vec![0.0; constraints.len()],
        drives: loads.harmonics.iter().enumerate().filter_map(drive).collect(),
        held: Some(closed.iter().map(held).collect()),
    };
    (expansion, (0..constraints.len()).map(row).collect())
}
