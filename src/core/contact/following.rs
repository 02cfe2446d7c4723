//! Phases of methods in which contact displacements have no inertia: they follow from the conditions (theory §3).
//!
//! In contact `u_C = g`; free `u_C,f = N_ff⁻¹ (p_f,f(t) − N_f,O u_O − N_f,c g_c)`. The monitors are the gaps `w = g − s u_C` of free points and the
//! pressures `p = s (p_f − N_O u_O − N_C u_C)` of points in contact.

use std::sync::Arc;

use super::conditions::Conditions;
use super::expansion::{Drive, Expansion, Follow, Solved};
use super::lcp::Place;
use super::monitor::{Row, Size, Term};
use super::states::States;
use crate::fem::{Harmonic, Loads};

/// The displacements and the monitors of a set, one a point.
pub(super) fn following(
    conditions: &Arc<Conditions>,
    set: &States,
    loads: &Loads,
) -> (Expansion, Vec<Row>) {
    let c = conditions;
    let places = c.places(set);
    let free: Vec<usize> = (0..c.count()).filter(|&d| places[d] == Place::Free).collect();
    let maker = Maker { c, set, solved: Solved::new(c, free) };
    let load = loads.constant.as_ref().and_then(|f| maker.load_on_contact(f));
    let offset = maker.shift(load.as_deref(), true);
    let drives: Vec<Drive> =
        loads.harmonics.iter().enumerate().filter_map(|(k, h)| maker.drive(k, h)).collect();
    let rows = (0..c.len()).map(|k| maker.row(k, load.as_deref())).collect();
    (Expansion { follow: Follow::Solved(maker.solved), offset, drives, held: None }, rows)
}

struct Maker<'a> {
    c: &'a Arc<Conditions>,
    set: &'a States,
    solved: Solved,
}

impl Maker<'_> {
    /// The pressures that a force brings in, if it does.
    fn load_on_contact(&self, force: &[f64]) -> Option<Vec<f64>> {
        if !self.c.bears_loads {
            return None;
        }
        let p = self.c.pressure_of(force);
        p.iter().any(|p| *p != 0.0).then_some(p)
    }

    /// `u_C` at `u_O = 0` under pressures `load`, with the gaps or without.
    fn shift(&self, load: Option<&[f64]>, with_gap: bool) -> Vec<f64> {
        let Maker { c, set, solved } = self;
        let mut d = vec![0.0; c.count()];
        if with_gap {
            for k in set.closed_points() {
                let (i, s) = c.points[k];
                d[i] = s * c.gap[k];
            }
        }
        // free entries of d are still zero
        let rest = |&i: &usize| load.map_or(0.0, |p| p[i]) - c.n_c.row_dot(i, &d);
        let mut x: Vec<f64> = solved.free.iter().map(rest).collect();
        solved.solve(&mut x);
        solved.free.iter().zip(x.iter()).for_each(|(&i, &x)| d[i] = x);
        d
    }

    fn drive(&self, index: usize, load: &Harmonic) -> Option<Drive> {
        let p = self.load_on_contact(&load.force)?;
        let displacement = self.shift(Some(&p), false);
        let c = self.c;
        // those in contact do not move
        let monitor = (0..c.len()).map(|k| match (self.set.touches(k), c.points[k]) {
            (false, (d, s)) => -s * displacement[d],
            (true, (d, s)) => s * (p[d] - c.n_c.row_dot(d, &displacement)),
        });
        let monitor = monitor.collect();
        Some(Drive { index, load: load.clone(), displacement, monitor })
    }

    /// Gap of a free point, pressure of one in contact, under constant loads.
    fn row(&self, k: usize, load: Option<&[f64]>) -> Row {
        let c = self.c;
        let (d, s) = c.points[k];
        let (of_o, of_c) = c.sums(d);
        let size = |over: f64| {
            let value = Size { a: of_o, b: of_c, gap: c.gap[k], c: over };
            [value, Size { b: 0.0, ..value }]
        };
        if !self.set.touches(k) {
            let terms = vec![(-s, Term::Entry(d))];
            return Row { constant: c.gap[k], terms, size: size(c.stiffness(k)) };
        }
        let own = match c.is_diagonal {
            true => (-s * c.n_c[(d, d)], Term::Entry(d)),
            false => (-s, Term::StressC(c.clone(), d)),
        };
        let constant = s * load.map_or(0.0, |p| p[d]);
        Row { constant, terms: vec![(-s, Term::StressO(c.clone(), d)), own], size: size(1.0) }
    }
}
