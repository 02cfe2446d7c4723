//! Coulomb friction of contact points whose tangential displacements keep their mass, before obstacles whose surface may move along itself.
//!
//! ```text
//! M ÿ + C ẏ + K_α y + Σ_i e_i r_i = f_α,      r_i ∈ μ_i r_n,i(y) Sgn(v_i − V_i)
//! ```
//!
//! `y = u_O` has the tangents among its displacements, `e_i` is the direction of one, `r_n,i = a_i p_i` the normal reaction of the method. A point that
//! slips, `σ = ±1`, is pushed by `−σ μ a p(y)`: the stiffness is unsymmetric. One that sticks is held by a reaction,
//!
//! ```text
//! λ = D⁻¹ E M⁻¹ (f_α − K_α y − C ẏ − Σ_slip e r),      D = E M⁻¹ Eᵀ,
//! ```
//!
//! over the rows `E` of all that stick. Normal reactions are Lipschitz in `y` and `Sgn` is monotone: one motion from every state, whatever `μ`.

use std::sync::Arc;

use super::expansion::{Driven, Expansion, Part};
use super::monitor::{MonitorKind, Row, Size, Term};
use super::phase::Parts;
use super::reactions::{Columns, Holds};
use super::states::{PointState, States};
use crate::fem::Csr;
use crate::mesh::Point;

/// Friction of one contact point.
#[derive(Debug, Clone, PartialEq)]
pub struct Tangent {
    /// Entry of `u_O` that is the displacement along the tangent, but for its sign.
    pub entry: usize,
    /// That sign.
    pub sign: f64,
    /// `μ > 0`
    pub coefficient: f64,
    /// `V`: velocity of the obstacle's surface along the tangent.
    pub surface: f64,
    /// The tangent: the outward normal of the obstacle's side of the body, turned by +90°.
    pub direction: Point,
}

impl Tangent {
    /// `v_t − V`
    pub fn slip_velocity(&self, v_o: &[f64]) -> f64 {
        self.sign * v_o[self.entry] - self.surface
    }

    /// Give the point exactly the velocity of the surface.
    pub fn settle(&self, v_o: &mut [f64]) {
        v_o[self.entry] = self.sign * self.surface;
    }
}

/// Friction of the contact points of a body.
#[derive(Debug)]
pub(super) struct Friction {
    /// One a contact point; none where there is no friction.
    pub tangents: Vec<Option<Tangent>>,
    /// Areas of the contact points.
    area: Vec<f64>,
    /// Which row of `along` is that of a contact point.
    place: Vec<usize>,
    /// Unit forces along the tangents.
    along: Arc<Columns>,
}

impl Friction {
    /// Of these points, with what solves with the mass of `u_O`.
    pub fn new(
        tangents: Vec<Option<Tangent>>,
        area: Vec<f64>,
        n_o: usize,
        solve: impl FnMut(&mut [f64]),
    ) -> Friction {
        let before = |k: usize| tangents[..k].iter().flatten().count();
        let place = (0..tangents.len()).map(before).collect();
        let rows = tangents.iter().flatten().enumerate().map(|(k, t)| (k, t.entry, t.sign));
        let rows = Csr::from_triplets(tangents.iter().flatten().count(), n_o, rows.collect());
        let along = Arc::new(Columns::new(Arc::new(rows), solve));
        Friction { tangents, area, place, along }
    }

    /// What a point does that comes into contact, or stays there, when nothing is known of its velocity.
    pub fn in_contact(&self, point: usize, from: PointState) -> PointState {
        match (&self.tangents[point], from.touches()) {
            (_, true) => from,
            (Some(_), false) => PointState::Stick,
            (None, false) => PointState::Closed,
        }
    }

    /// A set in which the points that were in contact before do what they did.
    pub(crate) fn keep(&self, set: &mut States, before: &States) {
        for i in 0..set.len() {
            if set.touches(i) {
                set.set(i, self.in_contact(i, before.at(i)));
            }
        }
    }
}

/// An affine function of `u_O`, with what each drive adds.
#[derive(Debug, Clone)]
struct Affine {
    constant: f64,
    entries: Vec<(usize, f64)>,
    drives: Vec<f64>,
}

impl Affine {
    /// A monitor of a phase, `u_C` put in.
    fn of(row: &Row, expansion: &Expansion, n_o: usize) -> Affine {
        let mut of_o = vec![0.0; n_o];
        let mut of_c = vec![0.0; expansion.offset.len()];
        row.entries(|j, x| of_o[j] += x, |d, x| of_c[d] += x);
        let offsets = of_c.iter().zip(&expansion.offset).map(|(c, d)| c * d);
        let constant = row.constant + offsets.sum::<f64>();
        expansion.push(&of_c, |j, x| of_o[j] += x);
        let entries = of_o.into_iter().enumerate().filter(|e| e.1 != 0.0).collect();
        Affine { constant, entries, drives: row.drives.clone() }
    }

    fn along(&self, x: &[f64]) -> f64 {
        self.entries.iter().map(|&(j, v)| v * x[j]).sum()
    }

    /// Its value at a time.
    fn at(&self, t: f64, u_o: &[f64], drives: &[Driven]) -> f64 {
        self.constant + self.along(u_o) + driven(&self.drives, t, drives)
    }
}

/// What all drives add at a time, `shares` of each.
fn driven(shares: &[f64], t: f64, drives: &[Driven]) -> f64 {
    shares.iter().zip(drives).map(|(x, d)| x * d.load.factor(t, 0)).sum()
}

/// A point that slips: the force `−f p` on an entry of `u_O`.
#[derive(Debug)]
struct Slip {
    point: usize,
    tangent: Tangent,
    /// `f = σ μ a`, in the sign of the entry.
    factor: f64,
    pressure: Affine,
}

/// What friction does in one phase.
#[derive(Debug)]
pub(super) struct Rubbing {
    friction: Arc<Friction>,
    slips: Vec<Slip>,
    stuck: Vec<(usize, Tangent)>,
    holds: Option<Holds>,
    /// Tractions `q` of the points that stick, `area q = λ`, as rows.
    tractions: Vec<Row>,
}

impl Rubbing {
    /// In a phase; `pressures` are the rows of all points.
    pub fn new(
        friction: &Arc<Friction>,
        set: &States,
        pressures: &[Row],
        expansion: &Expansion,
        parts: &Parts,
    ) -> Rubbing {
        let n_o = parts.body.dofs.n_o;
        let slip = |(point, state): (usize, PointState)| {
            let (sigma, tangent) = (state.slip()?, friction.tangents[point].as_ref()?);
            let factor = sigma * tangent.coefficient * friction.area[point] * tangent.sign;
            let pressure = Affine::of(&pressures[point], expansion, n_o);
            Some(Slip { point, tangent: tangent.clone(), factor, pressure })
        };
        let slips = set.iter().enumerate().filter_map(slip).collect();
        let stick = |(point, state): (usize, PointState)| {
            let tangent = friction.tangents[point].as_ref()?;
            (state == PointState::Stick).then(|| (point, tangent.clone()))
        };
        let stuck: Vec<(usize, Tangent)> = set.iter().enumerate().filter_map(stick).collect();
        let places = stuck.iter().map(|s| friction.place[s.0]).collect();
        let holds = Holds::along(&friction.along, places, vec![]);
        let friction = friction.clone();
        let mut rubbing = Rubbing { friction, slips, stuck, holds, tractions: vec![] };
        rubbing.tractions = rubbing.reactions(expansion, parts);
        rubbing
    }

    /// `λ/a` of the points that stick.
    fn reactions(&self, expansion: &Expansion, parts: &Parts) -> Vec<Row> {
        let Friction { along, place, area, .. } = &*self.friction;
        let (n, n_o) = (parts.body.dofs.n(), parts.body.dofs.n_o);
        let places: Vec<usize> = self.stuck.iter().map(|s| place[s.0]).collect();
        if places.is_empty() {
            return vec![];
        }
        let force = self.with_friction(elastic_force(expansion, parts), None);
        let drives = &expansion.drives;
        let driven: Vec<Vec<f64>> = (0..drives.len())
            .map(|k| {
                let mut force = drives[k].load.force.clone();
                expansion.reduce(&mut force);
                force.truncate(n_o);
                self.with_friction(force, Some(k))
            })
            .collect();
        let beta = parts.damping.map_or(0.0, |d| d.beta);
        let alpha = parts.damping.map_or(0.0, |d| d.alpha);
        // columns M⁻¹eⱼ: what they are of K_α with the slipping points' forces, and the forces of what damps but αM
        let of_columns: Vec<(Vec<f64>, Vec<f64>)> = places
            .iter()
            .map(|&k| {
                let c = &along.columns[k];
                let (mut x, mut elastic) = (vec![0.0; n], vec![0.0; n]);
                expansion.expand(c, &mut x, Part::Linear);
                parts.kernel.mul(&parts.body.stiffness, [&x], [&mut elastic]);
                expansion.reduce(&mut elastic);
                elastic.truncate(n_o);
                let mut all = elastic.clone();
                for slip in &self.slips {
                    let f = slip.factor * c[slip.tangent.entry];
                    slip.pressure.entries.iter().for_each(|&(j, v)| all[j] += f * v);
                }
                let mut viscous = elastic;
                viscous.iter_mut().for_each(|e| *e *= -beta);
                if let Some(dampers) = &parts.dampers {
                    dampers.push(c, &mut viscous);
                }
                (all, viscous)
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let inverse = along.inverse(&places);
        let row = |(i, (point, _)): (usize, &(usize, Tangent))| {
            let (mut own, mut rates) = (vec![0.0; n_o], vec![0.0; n_o]);
            let (mut constant, mut of_drives) = (0.0, vec![0.0; drives.len()]);
            for (j, &k) in places.iter().enumerate() {
                let x = inverse[(i, j)] / area[*point];
                let (all, viscous) = &of_columns[j];
                own.iter_mut().zip(all).for_each(|(o, a)| *o -= x * a);
                rates.iter_mut().zip(viscous).for_each(|(r, e)| *r += x * e);
                constant += x * dot(&along.columns[k], &force);
                constant -= x * alpha * self.stuck[j].1.surface;
                let of_load = |f: &Vec<f64>| x * dot(&along.columns[k], f);
                of_drives.iter_mut().zip(&driven).for_each(|(d, f)| *d += of_load(f));
            }
            let sum = |x: &[f64]| x.iter().map(|x| x.abs()).sum::<f64>();
            let gap = constant / sum(&own).max(f64::MIN_POSITIVE);
            let value = Size { a: sum(&own), b: 0.0, gap, c: 1.0 };
            let rate_size = sum(&rates);
            let rates = match rate_size == 0.0 {
                true => vec![],
                false => vec![(1.0, Term::Own(rates.into()))],
            };
            let terms = vec![(1.0, Term::Own(own.into()))];
            Row { constant, terms, rates, drives: of_drives, size: [value; 2], rate_size }
        };
        self.stuck.iter().enumerate().map(row).collect()
    }

    /// A force on `u_O` with what the slipping points' friction adds at rest, or, of a drive, with the drive.
    pub fn with_friction(&self, mut force: Vec<f64>, drive: Option<usize>) -> Vec<f64> {
        for Slip { tangent, factor, pressure, .. } in &self.slips {
            let p = drive.map_or(pressure.constant, |k| pressure.drives[k]);
            force[tangent.entry] -= factor * p;
        }
        force
    }

    /// The row of a monitor along the tangent, of a point that has one; `pressure` is that of the point.
    pub fn monitor(&self, kind: MonitorKind, point: usize, pressure: &Row) -> Option<Row> {
        if kind == MonitorKind::Slip {
            let Slip { tangent, factor, .. } = self.slips.iter().find(|s| s.point == point)?;
            let sigma = (factor * tangent.sign).signum();
            let size = Size { a: 0.0, b: 0.0, gap: 0.0, c: 1.0 };
            return Some(Row {
                constant: -sigma * tangent.surface,
                terms: vec![],
                rates: vec![(sigma * tangent.sign, Term::Of(tangent.entry))],
                drives: vec![0.0; pressure.drives.len()],
                size: [size; 2],
                rate_size: 1.0,
            });
        }
        let sign = if kind == MonitorKind::StickPlus { -1.0 } else { 1.0 };
        let place = self.stuck.iter().position(|s| s.0 == point)?;
        let coefficient = self.stuck[place].1.coefficient;
        Some(combined([(coefficient, pressure), (sign, &self.tractions[place])]))
    }

    /// Whether some point slips.
    pub fn slips(&self) -> bool {
        !self.slips.is_empty()
    }

    /// The forces of the slipping points: `b −= f p` at a state.
    pub fn push(&self, t: f64, u_o: &[f64], drives: &[Driven], b: &mut [f64]) {
        for slip in &self.slips {
            b[slip.tangent.entry] -= slip.factor * slip.pressure.at(t, u_o, drives);
        }
    }

    /// Take the acceleration of what sticks.
    pub fn stop(&self, a: &mut [f64]) {
        if let Some(holds) = &self.holds {
            holds.stop(a);
        }
    }

    /// The stiffness of the slipping points' friction: `f e pᵀ`, entry by entry.
    pub(crate) fn stiffness(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let of = |s: &Slip| {
            let (entry, factor) = (s.tangent.entry, s.factor);
            let all = s.pressure.entries.clone();
            all.into_iter().map(move |(j, v)| (entry, j, factor * v))
        };
        self.slips.iter().flat_map(of)
    }

    /// Displacements of `u_O` that stick, and their velocities.
    pub(crate) fn stuck(&self) -> Vec<(usize, f64)> {
        let of = |(_, t): &(usize, Tangent)| (t.entry, t.sign * t.surface);
        self.stuck.iter().map(of).collect()
    }

    /// `λ/a` of one of the points that stick.
    fn reaction(&self, k: usize, t: f64, (u_o, v_o): (&[f64], &[f64]), drives: &[Driven]) -> f64 {
        let row = &self.tractions[k];
        row.value(u_o, &[], true) + row.of_velocity(v_o) + driven(&row.drives, t, drives)
    }

    /// Tractions of the obstacle on the body along the tangents, `−r_t/a`.
    pub(crate) fn tractions(
        &self,
        t: f64,
        (u_o, v_o): (&[f64], &[f64]),
        drives: &[Driven],
        q: &mut [f64],
    ) {
        for slip in &self.slips {
            let factor = slip.factor * slip.tangent.sign / self.friction.area[slip.point];
            q[slip.point] = -factor * slip.pressure.at(t, u_o, drives);
        }
        for (k, (point, _)) in self.stuck.iter().enumerate() {
            q[*point] = -self.reaction(k, t, (u_o, v_o), drives);
        }
    }
}

/// Powers of friction at a state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RubbingRates {
    /// `r_t (v_t − V) ≥ 0`: what friction takes.
    pub work: f64,
    /// `|v_t − V|`
    pub path: f64,
    /// `−r_t V`: what the moving surface brings.
    pub belt: f64,
}

impl Rubbing {
    /// Powers and speeds of the points that rub, one after the other.
    pub(crate) fn rates(
        &self,
        t: f64,
        (u_o, v_o): (&[f64], &[f64]),
        drives: &[Driven],
        mut each: impl FnMut(usize, RubbingRates),
    ) {
        let area = &self.friction.area;
        for slip in &self.slips {
            let Tangent { sign, surface, .. } = slip.tangent;
            let r = sign * slip.factor * slip.pressure.at(t, u_o, drives);
            let s = slip.tangent.slip_velocity(v_o);
            let rates = RubbingRates { work: r * s, path: s.abs(), belt: -r * surface };
            each(slip.point, rates);
        }
        for (k, &(point, Tangent { surface, .. })) in self.stuck.iter().enumerate() {
            if surface == 0.0 {
                continue;
            }
            let q = self.reaction(k, t, (u_o, v_o), drives);
            let belt = -area[point] * q * surface;
            each(point, RubbingRates { belt, ..RubbingRates::default() });
        }
    }
}

/// A sum of two rows.
fn combined(parts: [(f64, &Row); 2]) -> Row {
    let [(x, a), (y, b)] = parts;
    let scaled = |f: f64, terms: &[(f64, Term)]| -> Vec<(f64, Term)> {
        terms.iter().map(|(c, t)| (f * c, t.clone())).collect()
    };
    let of =
        |pick: fn(&Row) -> &Vec<(f64, Term)>| [scaled(x, pick(a)), scaled(y, pick(b))].concat();
    let size = |k: usize| a.size[k].plus(x.abs(), &b.size[k], y.abs());
    Row {
        constant: x * a.constant + y * b.constant,
        terms: of(|r| &r.terms),
        rates: of(|r| &r.rates),
        drives: a.drives.iter().zip(&b.drives).map(|(a, b)| x * a + y * b).collect(),
        size: [size(0), size(1)],
        rate_size: x.abs() * a.rate_size + y.abs() * b.rate_size,
    }
}

/// `A*ᵀ (f₀ − K d*)`: the constant force of the loads and of the gaps on `u_O` (a drive's `K d*` is balanced on the points that it moves).
pub(super) fn elastic_force(expansion: &Expansion, parts: &Parts) -> Vec<f64> {
    let (n, n_o) = (parts.body.dofs.n(), parts.body.dofs.n_o);
    let mut force = parts.loads.constant.clone().unwrap_or_else(|| vec![0.0; n]);
    if expansion.solved().is_some() {
        let mut d = vec![0.0; n];
        expansion.expand(&vec![0.0; n_o], &mut d, Part::Undriven);
        parts.body.stiffness.mul_sub(&d, &mut force);
        expansion.reduce(&mut force);
    }
    force.truncate(n_o);
    force
}
