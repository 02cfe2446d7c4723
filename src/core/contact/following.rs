//! Phases of methods in which contact displacements have no inertia: they follow from the conditions (theory §3).
//!
//! In contact `u_C = g`; free `u_C,f = N_ff⁻¹ (p_f,f(t) − N_f,O u_O − N_f,c g_c)`. The monitors are the gaps `w = g − s u_C` of free points and the
//! pressures `p = s (p_f − N_O u_O − N_C u_C)` of points in contact; with friction those of the tangents besides ([`super::friction`]).

use std::sync::Arc;

use super::conditions::Conditions;
use super::expansion::{Adhesion, Driven, Expansion, Follow, Signal, Solved};
use super::friction::{Anchor, Friction, Rubbing};
use super::inertia::{Inertia, PhaseInertia};
use super::law::{Exit, Law};
use super::lcp::Side;
use super::monitor::{Monitor, Row, Size, Term};
use super::phase::{Data, Parts, Phase};
use super::states::{PointState, States};
use crate::fem::Harmonic;

/// The phase of some states: displacements that follow, and monitors as the law says.
pub(super) fn following(
    law: &dyn Law,
    conditions: &Arc<Conditions>,
    (inertia, friction): (&Arc<Inertia>, Option<&Arc<Friction>>),
    parts: &Parts,
    set: &States,
) -> Phase {
    let maker = Maker::new(conditions, set, friction);
    let loads = &parts.loads;
    let load = loads.constant.as_ref().and_then(|f| maker.load_on_contact(f));
    let offset = maker.shift(load.as_deref(), true);
    // what friction holds feels every load
    let has_mass = |i: usize| friction.is_some_and(|f| f.anchor(i).is_none());
    let sticks = set.iter().enumerate().any(|(i, s)| s == PointState::Stick && has_mass(i));
    let harmonic =
        loads.harmonics.iter().enumerate().filter_map(|(k, h)| maker.drive(k, h, sticks));
    // of measured loads that act on contact displacements there are none where reactions are the pressures
    let measured = loads.measured.iter().filter(|_| sticks);
    let measured = measured.map(|m| maker.still(Signal::Measured(m.clone())));
    let drives: Vec<(Driven, Vec<f64>)> = harmonic.chain(measured).collect();
    let driven = |k: usize| -> Vec<f64> { drives.iter().map(|d| d.1[k]).collect() };
    let count = drives.len();
    let reaction =
        |anchor: Anchor| reaction(conditions, anchor.displacement, load.as_deref(), count);
    let of_contact = (0..conditions.len()).map(|k| maker.row(k, load.as_deref(), driven(k)));
    let limits = friction.iter().flat_map(|f| f.limits(count));
    let rows: Vec<Row> = of_contact.chain(limits).collect();
    let drives = drives.into_iter().map(|d| d.0).collect();
    let follow = Follow::Solved(Box::new(maker.solved));
    let expansion = Expansion { follow, offset, drives };
    let rubbing = friction.map(|f| Rubbing::new(f, set, (&rows, &reaction), &expansion, parts));
    let (mut monitors, mut reactions) = (vec![], vec![]);
    for ((point, state), row) in set.iter().enumerate().zip(rows) {
        let of = |&(kind, to): &Exit| {
            let row = match kind.is_tangential() {
                true => rubbing.as_ref()?.monitor(kind, point, &row)?,
                false => row.clone(),
            };
            Some(Monitor { point, kind, to, row })
        };
        monitors.extend(law.exits(state).iter().filter_map(of));
        if state.touches() {
            reactions.push((point, row));
        }
    }
    let inertia = PhaseInertia::new(inertia, conditions, set);
    let data = Data { expansion, inertia, pushes: vec![], reactions, rubbing };
    Phase::new(parts.clone(), set.clone(), monitors, data)
}

/// The reaction of a contact displacement over its area, under constant loads, beside so many drives.
fn reaction(c: &Arc<Conditions>, d: usize, load: Option<&[f64]>, drives: usize) -> Row {
    let (a, b) = c.sums(d);
    let size = Size { a, b, gap: 0.0, c: 1.0 };
    let terms = vec![(-1.0, Term::StressO(c.clone(), d)), (-1.0, Term::StressC(c.clone(), d))];
    let constant = load.map_or(0.0, |p| p[d]);
    Row::of_displacements(constant, terms, vec![0.0; drives], [size; 2])
}

struct Maker<'a> {
    c: &'a Arc<Conditions>,
    set: &'a States,
    solved: Solved,
}

impl<'a> Maker<'a> {
    fn new(c: &'a Arc<Conditions>, set: &'a States, friction: Option<&Arc<Friction>>) -> Maker<'a> {
        let places = c.places(set);
        let sticks = |(point, a): (usize, Anchor)| {
            (set.at(point) == PointState::Stick).then_some(a.displacement)
        };
        let stuck: Vec<usize> =
            friction.iter().flat_map(|f| f.anchors()).filter_map(sticks).collect();
        let is_free = |d: &usize| places[*d] == Side::Free && !stuck.contains(d);
        let free: Vec<usize> = (0..c.count()).filter(is_free).collect();
        let along = friction.map_or_else(Adhesion::default, |f| f.adhesion(set, c, &free));
        Maker { c, set, solved: Solved::along(c, free, along) }
    }

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
            for k in set.closed_points().into_iter().filter(|k| *k < c.len()) {
                let (i, s) = c.points[k];
                d[i] = s * c.gap[k];
            }
        }
        // free entries of d are still zero
        let rest = |i: usize| load.map_or(0.0, |p| p[i]) - c.n_c.row_dot(i, &d);
        let mut x = solved.combined(rest);
        solved.solve(&mut x);
        solved.free.iter().zip(x.iter()).for_each(|(&i, &x)| d[i] = x);
        d
    }

    /// What a harmonic load adds to displacements, and to the gap or pressure of each point; of one that does not act on them nothing, or zeros.
    fn drive(&self, index: usize, load: &Harmonic, always: bool) -> Option<(Driven, Vec<f64>)> {
        let p = (!load.damps).then(|| self.load_on_contact(&load.force)).flatten();
        let Some(p) = p else {
            return always.then(|| self.still(Signal::Harmonic(index, load.clone())));
        };
        let displacement = self.shift(Some(&p), false);
        let c = self.c;
        // those in contact do not move
        let monitor = (0..c.len()).map(|k| match (self.set.touches(k), c.points[k]) {
            (false, (d, s)) => -s * displacement[d],
            (true, (d, s)) => s * (p[d] - c.n_c.row_dot(d, &displacement)),
        });
        let of_points = monitor.collect();
        Some((Driven { load: Signal::Harmonic(index, load.clone()), displacement }, of_points))
    }

    /// A load that adds nothing to displacements, gaps and pressures.
    fn still(&self, load: Signal) -> (Driven, Vec<f64>) {
        (Driven { load, displacement: vec![0.0; self.c.count()] }, vec![0.0; self.c.len()])
    }

    /// Gap of a free point, pressure of one in contact, under constant loads.
    fn row(&self, k: usize, load: Option<&[f64]>, drives: Vec<f64>) -> Row {
        let c = self.c;
        let (d, s) = c.points[k];
        let (of_o, of_c) = c.sums(d);
        let size = |over: f64| {
            let value = Size { a: of_o, b: of_c, gap: c.gap[k], c: over };
            [value, Size { b: 0.0, ..value }]
        };
        if !self.set.touches(k) {
            let terms = vec![(-s, Term::Entry(d))];
            return Row::of_displacements(c.gap[k], terms, drives, size(c.stiffness(k)));
        }
        let own = match c.is_diagonal {
            true => (-s * c.n_c[(d, d)], Term::Entry(d)),
            false => (-s, Term::StressC(c.clone(), d)),
        };
        let constant = s * load.map_or(0.0, |p| p[d]);
        let terms = vec![(-s, Term::StressO(c.clone(), d)), own];
        Row::of_displacements(constant, terms, drives, size(1.0))
    }
}
