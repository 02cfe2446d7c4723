//! Contact displacements that have inertia: an obstacle meets displacements of the body as they are, by a law of springs or of reactions.
//!
//! `u_C = n u_O` are seen, not unknown: displacements of the body at the contact points along their normals. The mass is the body's own in every phase.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::ContactError;
use super::boundary::BoundaryOperator;
use super::conditions::{Conditions, Gaps};
use super::constraint::Constraint;
use super::expansion::{Driven, Expansion, Follow, Signal};
use super::impact::Impact;
use super::inertia::{ConstantMass, Inertia, PhaseInertia};
use super::law::{Conduct, Law, Push};
use super::lcp::UNITS;
use super::method::{Method, Promise, Selection};
use super::monitor::{Monitor, MonitorKind, Row, Size, Term};
use super::obstacle::{Obstacle, Spring};
use super::phase::{Data, Parts, Phase};
use super::reactions::{Holds, Reactions};
use super::redistribution;
use super::site::Site;
use super::states::States;
use crate::fem::{Body, Csr, FemError, Harmonic, Loads, Reduction, largest, load};

/// Springs stiffer than this, over the body, leave nothing of its own forces but rounding errors: the energy of a motion drifts by `1e-15` of the ratio.
const STIFFEST: f64 = 1e8;

/// The method.
#[derive(Debug)]
pub(super) struct Massive {
    law: Arc<dyn Law>,
    sites: Arc<Vec<Site>>,
    obstacle: Arc<Obstacle>,
    conditions: Arc<Conditions>,
    inertia: Arc<Inertia>,
    /// Of a law by which velocities jump.
    impact: Option<Impact>,
    reactions: Option<Arc<Reactions>>,
    highest: f64,
}

/// Rows over `u_O`, one a site.
fn rows<'s>(n_o: usize, of: impl ExactSizeIterator<Item = &'s [(usize, f64)]>) -> Arc<Csr> {
    let count = of.len();
    let entries = of.enumerate().flat_map(|(q, row)| row.iter().map(move |&(j, v)| (q, j, v)));
    Arc::new(Csr::from_triplets(count, n_o, entries.collect()))
}

/// The body with what the law adds to its stiffness, and the method; one gap a site.
pub(super) fn attach(
    body: Body,
    sites: Vec<Site>,
    gap: Vec<f64>,
    law: Arc<dyn Law>,
) -> Result<(Body, Massive), ContactError> {
    law.check(&body, &sites)?;
    let n_o = body.dofs.n_o;
    let pushes: Vec<Option<Push>> = sites.iter().map(|s| law.push(s)).collect();
    let largest = |entries: &mut dyn Iterator<Item = f64>| entries.fold(0.0f64, f64::max);
    let own = largest(&mut body.stiffness.triplets().map(|e| e.2.abs()));
    let springs = pushes.iter().flatten().zip(&sites).map(|(p, s)| p.spring.stiffness * s.weight);
    let ratio = largest(&mut springs.into_iter()) / own;
    if ratio > STIFFEST {
        return Err(ContactError::TooStiff { ratio });
    }
    let terms = sites.iter().flat_map(|s| law.consistent_terms(s)).collect();
    let body = body.with_points(sites.len(), terms);
    let displacements = || sites.iter().map(|s| &s.displacement[..]);
    let is_plain = pushes.iter().any(Option::is_none);
    let of_pushes = |of: fn(&Push) -> &[(usize, f64)]| match is_plain {
        true => rows(n_o, displacements()),
        false => {
            let all: Vec<&[(usize, f64)]> = pushes.iter().flatten().map(of).collect();
            rows(n_o, all.into_iter())
        }
    };
    let obstacle = Obstacle {
        normal: rows(n_o, displacements()),
        depth: of_pushes(|p| &p.depth),
        direction: of_pushes(|p| &p.direction),
        gap,
        area: sites.iter().map(|s| s.weight).collect(),
        springs: pushes.iter().flatten().map(|p| p.spring).collect(),
        norms: vec![],
    };
    let method = Massive::new(&body, obstacle, law, sites.into())?;
    Ok((body, method))
}

impl Massive {
    fn new(
        body: &Body,
        mut obstacle: Obstacle,
        law: Arc<dyn Law>,
        sites: Arc<Vec<Site>>,
    ) -> Result<Massive, ContactError> {
        let n_o = body.dofs.n_o;
        // what the state itself obeys: b u ≤ g where it is free, in units of pressure
        let of_spring =
            |k: usize| obstacle.springs.get(k).map(|s| s.stiffness).filter(|s| *s > 0.0);
        let stiffness: Vec<f64> = (0..sites.len())
            .map(|k| {
                of_spring(k)
                    .unwrap_or_else(|| own_stiffness(body, &obstacle.normal, k) / sites[k].weight)
            })
            .collect();
        let n_rows = obstacle.depth.triplets().map(|(q, j, v)| (q, j, -stiffness[q] * v));
        let operator = BoundaryOperator {
            n_o: Csr::from_triplets(sites.len(), n_o, n_rows.collect()),
            n_c: DMatrix::from_diagonal(&stiffness.clone().into()).into(),
            area: obstacle.area.clone(),
        };
        let conditions = Conditions::new(operator, Gaps::front(obstacle.gap.clone()), false)
            .map_err(|index| ContactError::NotPMatrix {
                node: sites[index].node.unwrap_or(index),
                at: sites[index].place,
            })?;
        let mass = ConstantMass::formed(body.mass.leading(n_o), &body.dofs, &conditions, None)?;
        let restitution = law.restitution();
        let reactions = match restitution {
            Some(_) => Some(Arc::new(Reactions::new(body, obstacle.normal.clone())?)),
            None => None,
        };
        let impact =
            restitution.zip(reactions.clone()).map(|(law, r)| Impact::new(law, r.along.clone()));
        let knows_bound = restitution.is_none() && obstacle.has_potential();
        let highest = match knows_bound {
            true => {
                let all = (0..obstacle.springs.len()).flat_map(|k| obstacle.stiffness(k));
                let own = body.stiffness.leading(n_o);
                let closed = Csr::from_triplets(n_o, n_o, own.triplets().chain(all).collect());
                redistribution::bound_of_all(&closed, body, &mass)
            }
            false => f64::INFINITY,
        };
        let norm = |k: usize| mass.gram(&conditions)[(k, k)].max(0.0).sqrt() / stiffness[k];
        obstacle.norms = match restitution {
            None => (0..sites.len()).map(norm).collect(),
            Some(_) => vec![f64::INFINITY; sites.len()],
        };
        Ok(Massive {
            law,
            sites,
            obstacle: Arc::new(obstacle),
            conditions: Arc::new(conditions),
            inertia: Arc::new(Inertia::Constant(mass.into())),
            impact,
            reactions,
            highest,
        })
    }

    /// Rows of the gap, the depth and (of a point in contact) the pressure of a site; drives add nothing to them.
    fn row(&self, kind: MonitorKind, k: usize, drives: usize) -> Row {
        let Obstacle { depth, gap, springs, .. } = &*self.obstacle;
        let Spring { stiffness, preload, .. } = springs.get(k).copied().unwrap_or(Spring::NONE);
        let (constant, factor) = match kind {
            MonitorKind::Pressure => (preload - stiffness * gap[k], stiffness),
            MonitorKind::Depth => (-gap[k], 1.0),
            _ => (gap[k], -1.0),
        };
        let sum = depth.row(k).map(|e| e.1.abs()).sum::<f64>().max(1.0);
        let size = Size { a: 0.0, b: factor.abs() * sum, gap: gap[k], c: 1.0 };
        let terms = vec![(factor, Term::Over(depth.clone(), k))];
        Row::of_displacements(constant, terms, vec![0.0; drives], [size; 2])
    }
}

/// What a unit displacement of a point alone meets of the body's own stiffness.
fn own_stiffness(body: &Body, normal: &Csr, k: usize) -> f64 {
    let row: Vec<(usize, f64)> = normal.row(k).collect();
    let mut x = vec![0.0; body.dofs.n()];
    row.iter().for_each(|&(j, v)| x[j] = v);
    let square: f64 = row.iter().map(|e| e.1 * e.1).sum();
    let own = row.iter().map(|&(j, v)| v * body.stiffness.row_dot(j, &x)).sum::<f64>();
    let own = own / (square * square);
    if own > 0.0 { own } else { 1.0 }
}

/// What a reaction holds of the points of a phase: their pressures, as rows.
struct HeldRows {
    points: Vec<usize>,
    rows: Vec<Row>,
    drives: Vec<Driven>,
}

impl Massive {
    /// The pressures of the points that are held.
    fn held_rows(&self, points: Vec<usize>, loads: &Loads) -> HeldRows {
        let Some(reactions) = self.reactions.as_ref().filter(|_| !points.is_empty()) else {
            return HeldRows { points, rows: vec![], drives: vec![] };
        };
        let of = reactions.pressures(&points, &self.obstacle.area);
        let drive = |(index, load): (usize, &Harmonic)| {
            let pressures = of.of_force(&load.force);
            let displacement = vec![0.0; self.sites.len()];
            let is_driven = pressures.iter().any(|p| *p != 0.0);
            is_driven.then(|| {
                (Driven { load: Signal::Harmonic(index, load.clone()), displacement }, pressures)
            })
        };
        let (drives, shares): (Vec<Driven>, Vec<Vec<f64>>) =
            loads.harmonics.iter().enumerate().filter_map(drive).unzip();
        let offsets = loads.constant.as_ref().map(|f| of.of_force(f));
        let row = |i: usize| {
            let own = of.row(i);
            let gap = self.obstacle.gap[points[i]];
            let size = Size { a: own.iter().map(|x| x.abs()).sum(), b: 0.0, gap, c: 1.0 };
            let constant = offsets.as_ref().map_or(0.0, |o| o[i]);
            let terms = vec![(1.0, Term::Own(own.into()))];
            let drives = shares.iter().map(|s| s[i]).collect();
            Row::of_displacements(constant, terms, drives, [size; 2])
        };
        let rows = (0..points.len()).map(row).collect();
        HeldRows { points, rows, drives }
    }
}

impl Method for Massive {
    fn name(&self) -> String {
        self.law.name()
    }

    fn reduced(&self, body: &Body, reduction: &Reduction) -> Result<Arc<dyn Method>, ContactError> {
        if self.reactions.is_some() {
            // what reactions hold is among what modes would stand for
            return Err(FemError::Singular { what: "reduced impact law" }.into());
        }
        let obstacle = self.obstacle.reduced(reduction);
        Ok(Arc::new(Massive::new(body, obstacle, self.law.clone(), self.sites.clone())?))
    }

    fn promise(&self) -> Promise {
        let yields = !self.obstacle.springs.is_empty();
        Promise {
            is_lipschitz: yields && !self.obstacle.jumps(),
            conserves_energy: !self.law.dissipates(),
            is_strong: false,
            yields,
        }
    }

    fn law(&self) -> &dyn Law {
        &*self.law
    }

    fn conditions(&self) -> &Arc<Conditions> {
        &self.conditions
    }

    fn inertia(&self) -> &Arc<Inertia> {
        &self.inertia
    }

    fn obstacle(&self) -> Option<&Arc<Obstacle>> {
        Some(&self.obstacle)
    }

    fn constraints(&self, _: &Body) -> Vec<Constraint> {
        let constraint = |(q, s): (usize, &Site)| Constraint {
            node: s.node.unwrap_or(q),
            position: s.place,
            normal: s.normal,
            group: s.group,
            gap: self.obstacle.gap[q],
            area: s.weight,
            stiffness: self.conditions.stiffness(q),
        };
        self.sites.iter().enumerate().map(constraint).collect()
    }

    fn impact(&self) -> Option<&Impact> {
        self.impact.as_ref()
    }

    /// With memory, which points touch is not a matter of displacements alone: those of `start` that do stay.
    fn select(
        &self,
        loads: &Loads,
        t: f64,
        x: &[f64],
        start: &States,
    ) -> Result<Selection, ContactError> {
        if !self.law.has_memory() {
            return self.select_by_conditions(loads, t, x, start);
        }
        let size = largest(x);
        let touches = |k: usize| {
            let gap = self.obstacle.gap[k];
            -self.obstacle.depth(k, x) <= 64.0 * UNITS * size.max(gap.abs())
        };
        let touching = (0..self.sites.len()).map(|k| start.touches(k) && touches(k));
        Ok(Selection { set: States::of_contact(touching), degenerate: vec![] })
    }

    fn phase(&self, parts: &Parts, set: &States) -> Phase {
        let conduct = |k: usize| self.law.conduct(set.at(k));
        let of = |kind: Conduct| (0..set.len()).filter(move |&k| conduct(k) == kind);
        let held = self.held_rows(of(Conduct::Held).collect(), &parts.loads);
        let count = held.drives.len();
        let place = |k: usize| held.points.iter().position(|p| *p == k);
        let pressure = |k: usize| match place(k) {
            Some(i) => held.rows[i].clone(),
            None => self.row(MonitorKind::Pressure, k, count),
        };
        let mut monitors = vec![];
        for (point, state) in set.iter().enumerate() {
            for &(kind, to) in self.law.exits(state) {
                let row = match kind {
                    MonitorKind::Pressure => pressure(point),
                    kind => self.row(kind, point, count),
                };
                monitors.push(Monitor { point, kind, to, row });
            }
        }
        let pushes: Vec<usize> = of(Conduct::Pushed).collect();
        let reactions = set.closed_points().into_iter().map(|k| (k, pressure(k))).collect();
        let holds = self
            .reactions
            .as_ref()
            .and_then(|r| Holds::new(r, held.points.clone(), &self.obstacle.gap));
        let inertia = PhaseInertia::holding(&self.inertia, holds);
        let expansion = Expansion {
            follow: Follow::Rows(self.obstacle.normal.clone()),
            offset: vec![0.0; set.len()],
            drives: held.drives,
        };
        let data = Data { expansion, inertia, pushes, reactions, rubbing: None };
        Phase::new(parts.clone(), set.clone(), monitors, data)
    }

    fn gravity(&self, body: &Body, acceleration: &[f64]) -> Vec<f64> {
        load::gravity(body, acceleration)
    }

    fn highest_frequency(&self) -> f64 {
        self.highest
    }

    fn directions(&self, _: &Body) -> Vec<Vec<(usize, f64)>> {
        if self.reactions.is_some() {
            return vec![];
        }
        // K_α differs on b, and where the forces have no potential on t
        let Obstacle { depth, direction, .. } = &*self.obstacle;
        let count = self.sites.len();
        let of_depth = (0..count).map(|q| depth.row(q).collect());
        match self.obstacle.has_potential() {
            true => of_depth.collect(),
            false => of_depth.chain((0..count).map(|q| direction.row(q).collect())).collect(),
        }
    }
}
