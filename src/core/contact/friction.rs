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

use super::conditions::Conditions;
use super::expansion::{Adhesion, Driven, Expansion, Part};
use super::monitor::{MonitorKind, Row, Seen, Size, Term};
use super::phase::Parts;
use super::reactions::Holds;
use super::states::{PointState, States};
use super::tractions::{Along, Sticking, Tractions};
use crate::fem::{Csr, Discrete, along};
use crate::mesh::Point;

/// Friction of one contact point.
#[derive(Debug, Clone, PartialEq)]
pub struct Tangent {
    /// `e`: the displacement along the tangent is `e u_O`; entries of `u_O`, each once. None where it has no mass: what it is follows from the phase.
    pub row: Vec<(usize, f64)>,
    /// Where it has no mass: which one it is.
    pub anchor: Option<Anchor>,
    /// `μ > 0`
    pub coefficient: f64,
    /// `V`: velocity of the obstacle's surface along the tangent.
    pub surface: f64,
    /// The tangent: the outward normal of the obstacle's side of the body, turned by +90°; in space the direction of the surface's velocity.
    pub direction: Point,
    /// In space: what is at rest on the surface might slip in any direction, and this knows one. It slips, or is open.
    pub only_slips: bool,
}

/// A displacement along an obstacle without mass: `u_t`, a contact displacement. Where the point sticks, `u_t = z`; `z` is a displacement of `u_O` that has a mass of one,
/// no force, and the velocity of the surface; it is set anew where the point begins to stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Anchor {
    /// Its place in `u_C`.
    pub displacement: usize,
    /// The entry of `u_O` that is `z`.
    pub memory: usize,
}

impl Tangent {
    /// The same over `u`: displacements without mass are contact displacements.
    pub fn row_over(&self, n_o: usize) -> Vec<(usize, f64)> {
        match self.anchor {
            None => self.row.clone(),
            Some(anchor) => vec![(n_o + anchor.displacement, 1.0)],
        }
    }

    /// `e x`
    pub fn along(&self, x: &[f64]) -> f64 {
        along(&self.row, x)
    }

    /// `v_t − V`
    pub fn slip_velocity(&self, v_o: &[f64]) -> f64 {
        self.along(v_o) - self.surface
    }

    /// Give the point exactly the velocity of the surface, by the displacement that counts most.
    pub fn settle(&self, v_o: &mut [f64]) {
        let Some(&(pivot, w)) = self.row.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        else {
            return;
        };
        let others = self.row.iter().filter(|e| e.0 != pivot);
        let others: f64 = others.map(|&(j, w)| w * v_o[j]).sum();
        v_o[pivot] = (self.surface - others) / w;
    }
}

/// A slider: friction between two displacements, or one and the ground, under a force that stays. It is a contact point that never opens, of the pressure
/// `limit` over the area one, with `μ = 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct Slider {
    /// `w u_O` is the displacement over which it slides.
    pub row: Vec<(usize, f64)>,
    /// The force at which it slides.
    pub limit: f64,
    /// A spring in series, if any.
    pub elastic: Option<Elastic>,
    /// What files and messages name: a mesh node, or a row of given matrices.
    pub node: usize,
    /// Place on the undeformed body.
    pub position: Point,
    /// Direction along which it slides.
    pub direction: Point,
}

/// The spring in series with a slider (Jenkins): the force is `k (w u − z)`, `z` the place where the slider holds it. `z` is a displacement of `u_O` that has a
/// mass of its own, no other force, and never a velocity: it is set anew where a slip ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// `k`
    pub stiffness: f64,
    /// The entry of `u_O` that is `z`.
    pub memory: usize,
    /// The force where nothing is displaced: `z = −preload/k` there.
    pub preload: f64,
}

impl Elastic {
    /// `z` where nothing is displaced.
    pub fn start(&self) -> f64 {
        -self.preload / self.stiffness
    }
}

impl Slider {
    fn tangent(&self) -> Tangent {
        let (row, direction) = (self.row.clone(), self.direction);
        Tangent { row, anchor: None, coefficient: 1.0, surface: 0.0, direction, only_slips: false }
    }

    /// `w u`
    pub fn along(&self, u_o: &[f64]) -> f64 {
        along(&self.row, u_o)
    }

    /// `k (w u − z)`, of one with a spring; beyond the limit while it slides.
    pub fn trial(&self, u_o: &[f64]) -> Option<f64> {
        self.elastic.map(|e| e.stiffness * (self.along(u_o) - u_o[e.memory]))
    }

    /// Where the spring begins to stick: `z` such that the force is at its limit, where it was beyond.
    pub fn settle(&self, u_o: &mut [f64]) {
        if let (Some(e), Some(trial)) = (self.elastic, self.trial(u_o))
            && trial.abs() > self.limit
        {
            u_o[e.memory] = self.along(u_o) - self.limit.copysign(trial) / e.stiffness;
        }
    }

    /// Energy of the spring.
    pub(crate) fn energy(&self, u_o: &[f64]) -> f64 {
        let Some(e) = self.elastic else { return 0.0 };
        let force = self.trial(u_o).unwrap_or(0.0).clamp(-self.limit, self.limit);
        0.5 * force * force / e.stiffness
    }

    /// The same as a polynomial of the displacements: of a spring that sticks, whatever its force, or of one that slips.
    pub(crate) fn energy_if(&self, sticks: bool, u_o: &[f64]) -> f64 {
        let Some(e) = self.elastic else { return 0.0 };
        let force = if sticks { self.trial(u_o).unwrap_or(0.0) } else { self.limit };
        0.5 * force * force / e.stiffness
    }
}

/// Friction of the contact points of a body, and its sliders, which are the last points.
#[derive(Debug)]
pub(super) struct Friction {
    /// One a point; none where there is no friction.
    pub tangents: Vec<Option<Tangent>>,
    pub sliders: Vec<Slider>,
    /// Areas of the contact points.
    area: Vec<f64>,
    /// Which row of `along` is that of a contact point.
    place: Vec<usize>,
    /// Unit forces along the tangents.
    along: Along,
}

impl Friction {
    /// Of contact points and sliders, with the stiffness of the body and what solves with the mass of `u_O`.
    pub fn new(
        mut tangents: Vec<Option<Tangent>>,
        sliders: Vec<Slider>,
        (stiffness, conditions): (&Csr, &Conditions),
        solve: impl FnMut(&mut [f64]),
    ) -> Friction {
        let n_o = &conditions.n_o;
        let mut area: Vec<f64> =
            conditions.points.iter().map(|&(d, _)| conditions.area[d]).collect();
        tangents.extend(sliders.iter().map(|s| Some(s.tangent())));
        area.resize(tangents.len(), 1.0);
        let before = |k: usize| tangents[..k].iter().flatten().count();
        let place = (0..tangents.len()).map(before).collect();
        let rows = tangents.iter().flatten().enumerate();
        let rows = rows.flat_map(|(k, t)| t.row.iter().map(move |&(j, w)| (k, j, w)));
        let count = tangents.iter().flatten().count();
        let rows = Csr::from_triplets(count, n_o.n_cols(), rows.collect());
        let pulled = sliders.iter().flat_map(|s| s.row.iter().map(|e| e.0));
        let pulled = pulled.chain(sliders.iter().filter_map(|s| Some(s.elastic?.memory)));
        let along = Along::new(rows, (stiffness, n_o), pulled, solve);
        Friction { tangents, sliders, area, place, along }
    }

    /// The points whose displacements along the obstacle have no mass.
    pub fn anchors(&self) -> impl Iterator<Item = (usize, Anchor)> + '_ {
        let all = self.tangents.iter().enumerate();
        all.filter_map(|(i, t)| Some((i, t.as_ref()?.anchor?)))
    }

    /// The anchor of a point that has one.
    pub fn anchor(&self, point: usize) -> Option<Anchor> {
        self.tangents.get(point)?.as_ref()?.anchor
    }

    /// What displacements without mass along the obstacles do in a phase; `free` are those that follow.
    pub fn adhesion(&self, set: &States, conditions: &Conditions, free: &[usize]) -> Adhesion {
        let mut along = Adhesion::default();
        for (point, Anchor { displacement, memory }) in self.anchors() {
            let place = free.iter().position(|d| *d == displacement);
            match (set.at(point).slip(), place) {
                (Some(sigma), Some(place)) => {
                    // areas are those of the points
                    let (normal, sign) = conditions.points[point];
                    let mu = self.tangents[point].as_ref().map_or(0.0, |t| t.coefficient);
                    along.slips.push((place, normal, sigma * mu * sign));
                }
                (None, None) => along.stuck.push((displacement, memory)),
                _ => {}
            }
        }
        along
    }

    /// The spring of a slider that has one, along `(w, −1)`.
    fn spring(&self, point: usize) -> Option<Discrete> {
        let first = self.tangents.len() - self.sliders.len();
        let slider = self.sliders.get(point.checked_sub(first)?)?;
        let elastic = slider.elastic?;
        let row = slider.row.iter().copied().chain([(elastic.memory, -1.0)]).collect();
        Some(Discrete { row, stiffness: elastic.stiffness, mass: 0.0 })
    }

    /// What springs in series with sliders add to the square of the highest frequency while they stick, at the most: `Σ k wᵀM⁻¹w`.
    pub fn of_springs(&self) -> f64 {
        let columns = &self.along.columns;
        let places = &self.place[self.tangents.len() - self.sliders.len()..];
        let of = |(slider, &k): (&Slider, &usize)| {
            slider.elastic.map_or(0.0, |e| e.stiffness * columns.between(k, k))
        };
        self.sliders.iter().zip(places).map(of).sum::<f64>().max(0.0)
    }

    /// `μ a`: the largest force over the pressure.
    pub fn limit_over_pressure(&self, point: usize) -> f64 {
        self.tangents[point].as_ref().map_or(0.0, |t| t.coefficient * self.area[point])
    }

    /// The pressures of the sliders, which stay, beside so many drives.
    pub fn limits(&self, drives: usize) -> impl Iterator<Item = Row> + '_ {
        let size = Size { a: 0.0, b: 0.0, gap: 0.0, c: 1.0 };
        let of =
            move |s: &Slider| Row::of_displacements(s.limit, vec![], vec![0.0; drives], [size; 2]);
        self.sliders.iter().map(of)
    }

    /// What a point does that comes into contact, or stays there, when nothing is known of its velocity.
    pub fn in_contact(&self, point: usize, from: PointState) -> PointState {
        match (&self.tangents[point], from.touches()) {
            (_, true) => from,
            (Some(_), false) => PointState::Stick,
            (None, false) => PointState::Closed,
        }
    }

    /// A set in which the points that were in contact before do what they did, and so do the sliders.
    pub(crate) fn keep(&self, set: &mut States, before: &States) {
        let contacts = self.tangents.len() - self.sliders.len();
        let of_point = |i: usize| match i < contacts && !set.touches(i) {
            true => set.at(i),
            false => self.in_contact(i, before.at(i)),
        };
        *set = (0..self.tangents.len()).map(of_point).collect();
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
        along(&self.entries, x)
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

/// A point that slips: the force `−f p e` on `u_O`.
#[derive(Debug)]
struct Slip {
    point: usize,
    tangent: Tangent,
    /// `f = σ μ a`
    factor: f64,
    pressure: Affine,
}

/// A point that sticks by a displacement without mass.
#[derive(Debug)]
struct Adhering {
    point: usize,
    tangent: Tangent,
    /// `r_t` over the area.
    row: Row,
    reaction: Affine,
}

/// What friction does in one phase.
#[derive(Debug)]
pub(super) struct Rubbing {
    friction: Arc<Friction>,
    slips: Vec<Slip>,
    stuck: Vec<(usize, Tangent)>,
    /// What sticks without mass: its reaction over the area, as a row and of `u_O` alone.
    adheres: Vec<Adhering>,
    /// Springs of sliders that stick: their points, and `(w, −1)` over `u_O` and `z`.
    springs: Vec<(usize, Discrete)>,
    /// The places `z` of all springs and of what has no mass, as rows, and their velocities.
    memory: Vec<([(usize, f64); 1], f64)>,
    holds: Option<Holds>,
    /// `q` of the points that stick, `area q = λ`.
    tractions: Tractions,
}

impl Rubbing {
    /// In a phase; `pressures` are the rows of all points, `reactions` those along the obstacle of what has no mass there.
    pub fn new(
        friction: &Arc<Friction>,
        set: &States,
        (pressures, reactions): (&[Row], &dyn Fn(Anchor) -> Row),
        expansion: &Expansion,
        parts: &Parts,
    ) -> Rubbing {
        let n_o = parts.body.dofs.n_o;
        let slip = |(point, state): (usize, PointState)| {
            let (sigma, tangent) = (state.slip()?, friction.tangents[point].as_ref()?);
            let factor = sigma * friction.limit_over_pressure(point);
            let pressure = Affine::of(&pressures[point], expansion, n_o);
            let mut tangent = tangent.clone();
            if let (Some(anchor), Some(solved)) = (tangent.anchor, expansion.solved()) {
                tangent.row = solved.row(anchor.displacement);
            }
            Some(Slip { point, tangent, factor, pressure })
        };
        let slips = set.iter().enumerate().filter_map(slip).collect();
        let sticks = |(point, _): &(usize, PointState)| set.at(*point) == PointState::Stick;
        let stick = |(point, _): (usize, PointState)| {
            let tangent = friction.tangents[point].as_ref()?;
            let has_mass = friction.spring(point).is_none() && tangent.anchor.is_none();
            has_mass.then(|| (point, tangent.clone()))
        };
        let at_rest = || set.iter().enumerate().filter(sticks);
        let stuck: Vec<(usize, Tangent)> = at_rest().filter_map(stick).collect();
        let adhere = |(point, _): (usize, PointState)| {
            let tangent = friction.tangents[point].clone()?;
            let row = reactions(tangent.anchor?);
            let reaction = Affine::of(&row, expansion, n_o);
            Some(Adhering { point, tangent, row, reaction })
        };
        let adheres = at_rest().filter_map(adhere).collect();
        let springs = at_rest().filter_map(|(point, _)| Some((point, friction.spring(point)?)));
        let springs = springs.collect();
        let elastic = friction.sliders.iter().filter_map(|s| s.elastic);
        let of_springs = elastic.map(|e| ([(e.memory, 1.0)], 0.0));
        let anchored = friction.anchors().map(|(point, anchor)| {
            let sticks = set.at(point) == PointState::Stick;
            let tangent = friction.tangents[point].as_ref().filter(|_| sticks);
            ([(anchor.memory, 1.0)], tangent.map_or(0.0, |t| t.surface))
        });
        let memory = anchored.chain(of_springs).collect();
        let places = stuck.iter().map(|s| friction.place[s.0]).collect();
        let holds = Holds::along(&friction.along.columns, places, vec![]);
        let friction = friction.clone();
        let tractions = Tractions::default();
        let mut rubbing =
            Rubbing { friction, slips, stuck, adheres, springs, memory, holds, tractions };
        rubbing.tractions = rubbing.stick(expansion, parts);
        rubbing
    }

    /// `λ/a` of the points that stick.
    fn stick(&self, expansion: &Expansion, parts: &Parts) -> Tractions {
        if self.stuck.is_empty() {
            return Tractions::default();
        }
        let Friction { along, place, area, .. } = &*self.friction;
        let (n_o, drives) = (parts.body.dofs.n_o, &expansion.drives);
        let driven = |k: usize| {
            let mut force = drives[k].load.force().to_vec();
            expansion.reduce(&mut force);
            force.truncate(n_o);
            self.with_friction(force, Some(k))
        };
        let point = |(point, t): &(usize, Tangent)| (place[*point], area[*point], t.surface);
        let sticking = Sticking {
            points: self.stuck.iter().map(point).collect(),
            slips: self
                .slips
                .iter()
                .map(|s| (place[s.point], s.factor, &s.pressure.entries[..]))
                .collect(),
            springs: self.springs().collect(),
            force: self.with_friction(elastic_force(expansion, parts), None),
            drives: (0..drives.len()).map(driven).collect(),
        };
        Tractions::new(along, &sticking, expansion, parts)
    }

    /// A force on `u_O` with what the slipping points' friction adds at rest, or, of a drive, with the drive.
    pub fn with_friction(&self, mut force: Vec<f64>, drive: Option<usize>) -> Vec<f64> {
        for Slip { tangent, factor, pressure, .. } in &self.slips {
            let p = drive.map_or(pressure.constant, |k| pressure.drives[k]);
            tangent.row.iter().for_each(|(j, w)| force[*j] -= factor * w * p);
        }
        force
    }

    /// The row of a monitor along the tangent, of a point that has one; `pressure` is that of the point.
    pub fn monitor(&self, kind: MonitorKind, point: usize, pressure: &Row) -> Option<Row> {
        if kind == MonitorKind::Slip {
            let Slip { tangent, factor, .. } = self.slips.iter().find(|s| s.point == point)?;
            let sigma = factor.signum();
            let size = Size { a: 0.0, b: 0.0, gap: 0.0, c: 1.0 };
            return Some(Row {
                constant: -sigma * tangent.surface,
                terms: vec![],
                rates: tangent.row.iter().map(|&(j, w)| (sigma * w, Term::Of(j))).collect(),
                drives: vec![0.0; pressure.drives.len()],
                size: [size; 2],
                rate_size: match tangent.anchor {
                    None => 1.0,
                    Some(_) => tangent.row.iter().map(|e| e.1.abs()).sum(),
                },
            });
        }
        let sign = if kind == MonitorKind::StickPlus { -1.0 } else { 1.0 };
        if let Some((_, spring)) = self.springs.iter().find(|s| s.0 == point) {
            let terms = spring.row.iter().map(|&(j, w)| (spring.stiffness * w, Term::Of(j)));
            let sum = spring.row.iter().map(|e| spring.stiffness * e.1.abs()).sum();
            let size = Size { a: sum, b: 0.0, gap: 0.0, c: 1.0 };
            let drives = vec![0.0; pressure.drives.len()];
            let force = Row::of_displacements(0.0, terms.collect(), drives, [size; 2]);
            return Some(combined([(1.0, pressure), (sign, &force)]));
        }
        if let Some(Adhering { tangent, row, .. }) = self.adheres.iter().find(|s| s.point == point)
        {
            return Some(combined([(tangent.coefficient, pressure), (sign, row)]));
        }
        let place = self.stuck.iter().position(|s| s.0 == point)?;
        let coefficient = self.stuck[place].1.coefficient;
        Some(combined([(coefficient, pressure), (sign, &self.tractions.rows()[place])]))
    }

    /// The linear part of the tractions of all that sticks, which monitors name.
    pub fn seen(&self, x_o: &[f64], w_o: &[f64]) -> Vec<f64> {
        self.tractions.linear(x_o, w_o)
    }

    /// Whether monitors know velocities.
    pub fn knows_velocities(&self) -> bool {
        self.tractions.know_velocities() || !self.slips.is_empty()
    }

    /// Whether some point slips under a pressure that follows the motion.
    pub fn slips(&self) -> bool {
        self.slips.iter().any(|s| !s.pressure.entries.is_empty())
    }

    /// The forces of the slipping points and of springs: `b −= f p` at a state. None on what only remembers. Where what slips has no mass, it damps as it is stiff, by `β ṗ`.
    pub fn push(
        &self,
        t: f64,
        (u_o, v_o): (&[f64], &[f64]),
        beta: f64,
        drives: &[Driven],
        b: &mut [f64],
    ) {
        for slip in &self.slips {
            let mut pressure = slip.pressure.at(t, u_o, drives);
            if beta > 0.0 && slip.tangent.anchor.is_some() {
                pressure += beta * slip.pressure.along(v_o);
            }
            slip.tangent.row.iter().for_each(|(j, w)| b[*j] -= slip.factor * w * pressure);
        }
        for (_, spring) in &self.springs {
            let force = spring.stiffness * spring.along(u_o);
            spring.row.iter().for_each(|(j, w)| b[*j] -= force * w);
        }
        self.memory.iter().for_each(|([(z, _)], _)| b[*z] = 0.0);
    }

    /// Take the acceleration of what sticks, and of what only remembers.
    pub fn stop(&self, a: &mut [f64]) {
        self.memory.iter().for_each(|([(z, _)], _)| a[*z] = 0.0);
        if let Some(holds) = &self.holds {
            holds.stop(a);
        }
    }

    /// Whether displacements along obstacles have no mass, at some points.
    pub fn creeps(&self) -> bool {
        self.friction.anchors().next().is_some()
    }

    /// Whether some without mass stick to a surface that moves.
    pub fn is_carried(&self) -> bool {
        self.adheres.iter().any(|a| a.tangent.surface != 0.0)
    }

    /// Where displacements without mass do not stick, `z` is where they are.
    pub fn remember(&self, set: &States, u: &mut [f64], n_o: usize) {
        let all = self.friction.anchors();
        let free = all.filter(|(point, _)| set.at(*point) != PointState::Stick);
        free.for_each(|(_, anchor)| u[anchor.memory] = u[n_o + anchor.displacement]);
    }

    /// What the power `v·K v` of a full velocity is more than that of the forces on `u_O` that have inertia, and friction's share in it: `f (e v)(p v)` of what slips, less `V (K v)_t` of what sticks.
    pub fn viscous(&self, v_o: &[f64], v: &[f64], stiffness: &Csr) -> f64 {
        let massless = self.slips.iter().filter(|s| s.tangent.anchor.is_some());
        let slips = massless.map(|s| s.factor * s.tangent.along(v_o) * s.pressure.along(v_o));
        let carried = self.adheres.iter().filter_map(|a| {
            let anchor = a.tangent.anchor.filter(|_| a.tangent.surface != 0.0)?;
            Some(a.tangent.surface * stiffness.row_dot(v_o.len() + anchor.displacement, v))
        });
        slips.sum::<f64>() - carried.sum::<f64>()
    }

    /// The stiffness of the slipping points' friction: `f e pᵀ`, entry by entry.
    pub(crate) fn stiffness(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let of_entry = |s: &Slip, (i, w): (usize, f64)| -> Vec<(usize, usize, f64)> {
            s.pressure.entries.iter().map(|&(j, v)| (i, j, s.factor * w * v)).collect()
        };
        let entries = self.slips.iter().flat_map(|s| s.tangent.row.iter().map(move |e| (s, *e)));
        entries.flat_map(move |(s, e)| of_entry(s, e))
    }

    /// What sticks: its displacement as a row over `u_O`, and its velocity.
    pub(crate) fn stuck(&self) -> impl Iterator<Item = (&[(usize, f64)], f64)> {
        let memory = self.memory.iter().map(|(z, velocity)| (&z[..], *velocity));
        self.stuck.iter().map(|(_, t)| (&t.row[..], t.surface)).chain(memory)
    }

    /// Entries of `u_O` that only remember: their inertia is none of the body's.
    pub(crate) fn remembers(&self) -> impl Iterator<Item = usize> + '_ {
        self.memory.iter().map(|([(z, _)], _)| *z)
    }

    /// The springs of sliders that stick; they do not damp.
    pub(crate) fn springs(&self) -> impl Iterator<Item = &Discrete> {
        self.springs.iter().map(|s| &s.1)
    }

    /// `λ/a` of the points that stick, one after the other.
    fn reactions(
        &self,
        t: f64,
        (u_o, v_o): (&[f64], &[f64]),
        drives: &[Driven],
    ) -> impl Iterator<Item = f64> {
        let tractions = self.seen(u_o, v_o);
        self.tractions.rows().iter().map(move |row| {
            let seen = Seen { of_o: u_o, of_c: &[], tractions: &tractions };
            row.value(&seen, true) + driven(&row.drives, t, drives)
        })
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
            let factor = slip.factor / self.friction.area[slip.point];
            q[slip.point] = -factor * slip.pressure.at(t, u_o, drives);
        }
        let stuck = self.stuck.iter().zip(self.reactions(t, (u_o, v_o), drives));
        stuck.for_each(|((point, _), reaction)| q[*point] = -reaction);
        self.adheres.iter().for_each(|a| q[a.point] = -a.reaction.at(t, u_o, drives));
        for (point, spring) in &self.springs {
            q[*point] = -spring.stiffness * spring.along(u_o);
        }
    }
}

/// What a displacement without mass along an obstacle is in a phase: `u_t = row · u_O + constant`; where its point sticks it stands at `z`.
#[derive(Debug, Clone)]
pub(crate) struct Creep {
    pub point: usize,
    /// The entry of `u_O` that is `z`.
    pub memory: usize,
    pub sticks: bool,
    pub row: Vec<(usize, f64)>,
    pub constant: f64,
    /// Velocity of the surface.
    pub surface: f64,
}

impl Rubbing {
    /// All displacements without mass along obstacles.
    pub fn creeping(&self, expansion: &Expansion) -> Vec<Creep> {
        let of = |(point, Anchor { displacement, memory }): (usize, Anchor)| {
            let sticks = self.adheres.iter().any(|a| a.point == point);
            let surface = self.friction.tangents[point].as_ref().map_or(0.0, |t| t.surface);
            let row = expansion.solved().map_or(vec![], |solved| solved.row(displacement));
            Creep { point, memory, sticks, row, constant: expansion.offset[displacement], surface }
        };
        self.friction.anchors().map(of).collect()
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
            let surface = slip.tangent.surface;
            let r = slip.factor * slip.pressure.at(t, u_o, drives);
            let s = slip.tangent.slip_velocity(v_o);
            let rates = RubbingRates { work: r * s, path: s.abs(), belt: -r * surface };
            each(slip.point, rates);
        }
        for Adhering { point, tangent, reaction, .. } in &self.adheres {
            let belt = -area[*point] * reaction.at(t, u_o, drives) * tangent.surface;
            each(*point, RubbingRates { belt, ..RubbingRates::default() });
        }
        // the others have no power
        if self.stuck.iter().all(|(_, tangent)| tangent.surface == 0.0) {
            return;
        }
        for ((point, tangent), q) in self.stuck.iter().zip(self.reactions(t, (u_o, v_o), drives)) {
            let belt = -area[*point] * q * tangent.surface;
            each(*point, RubbingRates { belt, ..RubbingRates::default() });
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
