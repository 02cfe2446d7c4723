//! One smooth phase: expansions, accelerations, monitors of one active set (theory §3–5).
//!
//! A phase is plain data: it owns, or shares, the operators that it needs, and can be handed about without the method that it was made by.
//!
//! ```text
//! M_α ü_O + C_α u̇_O + K_α u_O = f_α(t),      u = A* u_O + d*(t),      h_k ≥ 0
//! K_α = A*ᵀ K A* + Σ w γ t bᵀ
//! ```
//!
//! with the sum over the points at which the obstacle pushes (`contact/obstacle.rs`); `K_α` is symmetric where each `t = b`.

use std::sync::Arc;

use faer::Mat;

use super::damping::{Dampers, Rayleigh};
use super::expansion::{Drive, Driven, Expansion, MeasuredDrive, Part, Signal};
use super::friction::{Creep, Rubbing, RubbingRates, elastic_force};
use super::inertia::PhaseInertia;
use super::monitor::{Monitor, MonitorKind, Row, Seen};
use super::obstacle::Obstacle;
use super::scratch::Scratch;
use super::states::States;
use crate::fem::{Body, Csr, Discrete, Kernel, Loads, along, with_elements};

/// A phase: the states of the contact points and what follows from them.
#[derive(Debug)]
pub struct Phase {
    /// The states (held nodes count as in contact).
    pub set: States,
    /// Nodes held on the switching surface (none but in exceptional cases: theory §5).
    pub held: Vec<usize>,
    /// The monitors of the phase, in the order of their points.
    pub monitors: Vec<Monitor>,
    pub(super) parts: Parts,
    pub(super) data: Data,
    /// The phases with one of the held nodes released.
    pub(super) released: Vec<Phase>,
}

/// What a method makes of an active set.
#[derive(Debug)]
pub(super) struct Data {
    /// `u = A* u_O + d*(t)`
    pub expansion: Expansion,
    /// `M_α`
    pub inertia: PhaseInertia,
    /// Points at which the obstacle pushes.
    pub pushes: Vec<usize>,
    /// Pressures of points in contact.
    pub reactions: Vec<(usize, Row)>,
    /// Friction along the tangents.
    pub rubbing: Option<Rubbing>,
}

/// What all phases of a system share.
#[derive(Debug, Clone)]
pub(super) struct Parts {
    pub body: Arc<Body>,
    /// For products with its stiffness.
    pub kernel: Arc<Kernel>,
    pub damping: Option<Rayleigh>,
    pub dampers: Option<Arc<Dampers>>,
    pub loads: Arc<Loads>,
    /// Of laws at displacements that have inertia.
    pub obstacle: Option<Arc<Obstacle>>,
}

/// Of forces without a potential: the power `u̇_Oᵀ(N u_O + r)` is lost.
#[derive(Debug)]
pub struct Lost {
    /// `N`
    pub matrix: Csr,
    /// `r`
    pub constant: Vec<f64>,
}

impl Phase {
    /// The phase of some states.
    pub(super) fn new(parts: Parts, set: States, monitors: Vec<Monitor>, data: Data) -> Phase {
        Phase { set, held: vec![], monitors, parts, data, released: vec![] }
    }

    /// Length of `u`.
    pub fn n(&self) -> usize {
        self.parts.body.dofs.n()
    }

    fn n_o(&self) -> usize {
        self.parts.body.dofs.n_o
    }

    /// Where the first monitor of a contact point stands in the list; `None` for a point that is not of this phase.
    pub(crate) fn monitor_of(&self, point: usize) -> Option<usize> {
        self.monitors.iter().position(|m| m.point == point)
    }

    /// `u = A* u_O + d*(t)`.
    pub fn expand_displacement(&self, t: f64, u_o: &[f64], u: &mut [f64]) {
        self.data.expansion.expand(u_o, u, Part::Whole(t));
    }

    /// `u̇ = A* u̇_O + ḋ*(t)`.
    pub fn expand_velocity(&self, t: f64, v_o: &[f64], v: &mut [f64]) {
        self.data.expansion.expand(v_o, v, Part::Derivative(t, 1));
    }

    /// `A* x`.
    pub fn expand(&self, x_o: &[f64], x: &mut [f64]) {
        self.data.expansion.expand(x_o, x, Part::Linear);
    }

    /// `u = A* u_O + d*(t)` of the first entries of a full vector, in place; what does not stick is remembered where it is.
    pub(crate) fn complete_displacement(&self, t: f64, u: &mut [f64]) {
        self.data.expansion.fill(u, self.n_o(), Part::Whole(t));
        if let Some(rubbing) = self.creeping() {
            rubbing.remember(&self.set, u, self.n_o());
        }
    }

    /// `u̇ = A* u̇_O + ḋ*(t)`, likewise.
    pub(crate) fn complete_velocity(&self, t: f64, v: &mut [f64]) {
        self.data.expansion.fill(v, self.n_o(), Part::Derivative(t, 1));
    }

    /// `ü = A* ü_O + d̈*(t)`, likewise.
    pub(crate) fn complete_acceleration(&self, t: f64, a: &mut [f64]) {
        self.data.expansion.fill(a, self.n_o(), Part::Derivative(t, 2));
    }

    /// `A* x` of the first entries of a full vector, in place: `u_C` follows.
    pub fn complete(&self, x: &mut [f64]) {
        self.data.expansion.fill(x, self.n_o(), Part::Linear);
    }

    /// `A*ᵀ f`; forces on displacements that are held move nothing.
    pub fn reduce(&self, force: &[f64]) -> Vec<f64> {
        let mut b = force.to_vec();
        self.data.expansion.reduce(&mut b);
        b.truncate(self.n_o());
        self.data.inertia.holds().iter().flat_map(|h| h.displacements()).for_each(|j| b[j] = 0.0);
        b
    }

    /// The obstacle, where it pushes at some points.
    fn pushing(&self) -> Option<(&Obstacle, &[usize])> {
        let pushes = &self.data.pushes[..];
        self.parts.obstacle.as_deref().filter(|_| !pushes.is_empty()).map(|o| (o, pushes))
    }

    /// The forces of the obstacle as those that act against accelerations: `b += Σ w t (P + γ d)`, or their linear part.
    pub(super) fn add_pushes(&self, u_o: &[f64], b: &mut [f64], is_affine: bool) {
        let Some((obstacle, pushes)) = self.pushing() else { return };
        for &k in pushes {
            let push = obstacle.push(k, u_o, is_affine);
            obstacle.direction.row(k).for_each(|(j, t)| b[j] += t * push);
        }
    }

    /// The constant force on `u_O`.
    pub(crate) fn constant_force(&self) -> Vec<f64> {
        let n_o = self.n_o();
        let mut force = elastic_force(&self.data.expansion, &self.parts);
        if let Some(rubbing) = &self.data.rubbing {
            force = rubbing.with_friction(force, None);
        }
        if let Some((obstacle, pushes)) = self.pushing() {
            let at_rest = vec![0.0; n_o];
            for &k in pushes {
                let push = obstacle.push(k, &at_rest, true);
                obstacle.direction.row(k).for_each(|(j, t)| force[j] -= t * push);
            }
        }
        if let Some(holds) = self.data.inertia.holds() {
            holds.decoupled_force(&self.whole_stiffness(), &mut force);
        }
        force
    }

    /// Acceleration `ü_O` at `(t, u_O, v_O)`: `M_α ü_O + C_α u̇_O + K_α u_O = f_α(t)`.
    ///
    /// Leaves the full displacement in `s.u` and, where damping or a harmonic load needs it, the full velocity in `s.v`.
    pub fn acceleration(&self, t: f64, u_o: &[f64], v_o: &[f64], s: &mut Scratch, a_o: &mut [f64]) {
        if self.held.is_empty() {
            self.smooth_acceleration(t, u_o, v_o, s, a_o);
        } else {
            self.held_acceleration(t, u_o, v_o, s, a_o);
        }
    }

    /// `ü_O = M_α⁻¹ A*ᵀ (f − K (u + β A*u̇_O)) − α u̇_O`: the mass-proportional damping stays inside the admissible space, the obstacle does not damp.
    pub(super) fn smooth_acceleration(
        &self,
        t: f64,
        u_o: &[f64],
        v_o: &[f64],
        s: &mut Scratch,
        a_o: &mut [f64],
    ) {
        let Parts { body, kernel, damping, dampers, loads, .. } = &self.parts;
        self.expand_displacement(t, u_o, &mut s.u);
        if loads.is_none() {
            s.b.fill(0.0);
        } else {
            loads.at(t, &mut s.b);
        }
        match (damping.filter(|d| d.beta > 0.0), &body.structure) {
            (None, _) => kernel.mul_sub(&body.stiffness, &s.u, &mut s.b),
            (Some(d), None) => {
                self.expand(v_o, &mut s.v);
                for ((x, u), v) in s.x.iter_mut().zip(&s.u).zip(&s.v) {
                    *x = u + d.beta * v;
                }
                kernel.mul_sub(&body.stiffness, &s.x, &mut s.b);
            }
            // what the contact adds to the stiffness does not damp
            (Some(d), Some(own)) => {
                kernel.mul_sub(&body.stiffness, &s.u, &mut s.b);
                s.x.iter_mut().zip(v_o).for_each(|(x, v)| *x = d.beta * v);
                own.mul_sub(&s.x, &mut s.b);
            }
        }
        if let Some((obstacle, pushes)) = self.pushing() {
            for &k in pushes {
                let push = obstacle.push(k, u_o, true);
                obstacle.direction.row(k).for_each(|(j, t)| s.b[j] -= t * push);
            }
        }
        if let Some(dampers) = dampers {
            dampers.push(v_o, &mut s.b);
        }
        if damping.is_some() || dampers.is_some() || loads.is_driven() {
            self.expand_velocity(t, v_o, &mut s.v);
        }
        if let Some(rubbing) = &self.data.rubbing {
            let beta = damping.map_or(0.0, |d| d.beta);
            rubbing.push(t, (u_o, v_o), beta, &self.data.expansion.drives, &mut s.b);
        }
        self.data.inertia.accelerate(&self.data.expansion, s, a_o);
        if let Some(d) = damping.filter(|d| d.alpha != 0.0) {
            a_o.iter_mut().zip(v_o).for_each(|(a, v)| *a -= d.alpha * v);
        }
        if let Some(rubbing) = &self.data.rubbing {
            rubbing.stop(a_o);
        }
    }

    /// Powers and speeds of the contact points that rub, for a state `(u_O, u̇_O)`.
    pub(crate) fn rubbing_rates(
        &self,
        t: f64,
        state: (&[f64], &[f64]),
        each: impl FnMut(usize, RubbingRates),
    ) {
        if let Some(rubbing) = &self.data.rubbing {
            rubbing.rates(t, state, &self.data.expansion.drives, each);
        }
    }

    /// Tractions of the obstacle along the tangents of the contact points, zero where there is no friction.
    pub fn tractions(&self, t: f64, state: (&[f64], &[f64]), q: &mut [f64]) {
        q.fill(0.0);
        if let Some(rubbing) = &self.data.rubbing {
            rubbing.tractions(t, state, &self.data.expansion.drives, q);
        }
    }

    /// What sticks: its displacement as a row over `u_O`, and its velocity.
    pub(crate) fn stuck(&self) -> Vec<(&[(usize, f64)], f64)> {
        self.data.rubbing.iter().flat_map(Rubbing::stuck).collect()
    }

    /// What friction does where displacements along obstacles have no mass.
    fn creeping(&self) -> Option<&Rubbing> {
        self.data.rubbing.as_ref().filter(|r| r.creeps())
    }

    /// Whether displacements along obstacles have no mass, at some points.
    pub(crate) fn creeps(&self) -> bool {
        self.creeping().is_some()
    }

    /// What they are.
    pub(crate) fn creep(&self) -> Vec<Creep> {
        self.creeping().map_or(vec![], |r| r.creeping(&self.data.expansion))
    }

    /// Entries of `u_O` that only remember: their inertia is none of the body's.
    pub(crate) fn remembers(&self) -> Vec<usize> {
        self.data.rubbing.iter().flat_map(Rubbing::remembers).collect()
    }

    /// Whether monitors know velocities, and their rates accelerations.
    pub(crate) fn knows_velocities(&self) -> bool {
        self.data.rubbing.as_ref().is_some_and(Rubbing::knows_velocities)
    }

    /// `y = M_α⁻¹ K_α x` for one homogeneous vector.
    pub(crate) fn stiffness_product(&self, x_o: &[f64], s: &mut Scratch, y_o: &mut [f64]) {
        self.expand(x_o, &mut s.u);
        self.parts.kernel.mul(&self.parts.body.stiffness, [&s.u], [&mut s.b]);
        self.add_pushes(x_o, &mut s.b, false);
        self.data.inertia.accelerate(&self.data.expansion, s, y_o);
    }

    /// `b = M_α⁻¹ A*ᵀ F`
    pub(crate) fn force_acceleration(&self, force: &[f64], s: &mut Scratch, b_o: &mut [f64]) {
        s.b.copy_from_slice(force);
        self.data.inertia.accelerate(&self.data.expansion, s, b_o);
    }

    /// Dissipated power `u̇_Oᵀ C_α u̇_O`, and what forces without a potential take, for the displacement in `s.u`; leaves `A* u̇_O` in `s.v`.
    pub fn dissipation(&self, v_o: &[f64], s: &mut Scratch) -> f64 {
        self.expand(v_o, &mut s.v);
        let body = &self.parts.body;
        let mut power = 0.0;
        if let (Some(d), Some(rubbing)) = (self.parts.damping, self.creeping())
            && d.beta > 0.0
        {
            power += d.beta * rubbing.viscous(v_o, &s.v, &body.stiffness);
        }
        let rubbing = self.data.rubbing.iter();
        rubbing.flat_map(Rubbing::remembers).for_each(|z| s.v[z] = 0.0);
        let v = &s.v;
        if let Some((obstacle, pushes)) = self.pushing().filter(|(o, _)| !o.has_potential()) {
            let u_o = &s.u[..v_o.len()];
            let of = |&k: &usize| along(&obstacle.lost_along(k), v_o) * obstacle.push(k, u_o, true);
            power += pushes.iter().map(of).sum::<f64>();
        }
        if let Some(dampers) = &self.parts.dampers {
            power += dampers.power(v_o);
        }
        let Some(Rayleigh { alpha, beta }) = self.parts.damping else { return power };
        if alpha != 0.0 {
            let rows = 0..body.dofs.n_o;
            power += alpha * self.data.inertia.shared.quadratic(body, rows, v);
        }
        if beta > 0.0 {
            power += beta
                * match &body.structure {
                    None => self.parts.kernel.quadratic(&body.stiffness, v),
                    Some(own) => own.quadratic(v),
                };
        }
        power
    }

    /// The linear part of the monitors: `∇h · x` for a coefficient of an interpolant, a perturbation, a mode; `w` is its velocity, of phases that know any.
    pub(crate) fn monitor_gradient(&self, x_o: &[f64], w_o: &[f64], h: &mut [f64]) {
        self.monitors_of((x_o, w_o), h, Part::Linear);
    }

    fn monitors_of(&self, (x_o, w_o): (&[f64], &[f64]), h: &mut [f64], part: Part) {
        let expansion = &self.data.expansion;
        let x_c = expansion.seen(x_o, part);
        let tractions = self.data.rubbing.as_ref().map_or(vec![], |r| r.seen(x_o, w_o));
        let seen = Seen { of_o: x_o, of_c: &x_c, tractions: &tractions };
        for (h, monitor) in h.iter_mut().zip(&self.monitors) {
            *h = monitor.row.value(&seen, part.is_affine()) + monitor.row.of_velocity(w_o);
        }
        part.each_drive(&expansion.drives, |k, c| {
            h.iter_mut().zip(&self.monitors).for_each(|(h, m)| *h += c * m.row.drives[k]);
        });
    }

    fn new_monitors(&self, state: (&[f64], &[f64]), part: Part) -> Vec<f64> {
        let mut h = vec![0.0; self.monitors.len()];
        self.monitors_of(state, &mut h, part);
        h
    }

    /// Values of the monitors at `(u_O, u̇_O)` (for held nodes: those of their phase in contact); velocities are read where the phase knows any.
    pub fn monitor_values(&self, t: f64, u_o: &[f64], v_o: &[f64]) -> Vec<f64> {
        self.new_monitors((u_o, v_o), Part::Whole(t))
    }

    /// Their rates at a velocity `u̇_O` and, where the phase knows velocities, an acceleration `ü_O`.
    pub fn monitor_rates(&self, t: f64, v_o: &[f64], a_o: &[f64]) -> Vec<f64> {
        self.new_monitors((v_o, a_o), Part::Derivative(t, 1))
    }

    /// Their rates at a state; the acceleration is computed where the phase knows velocities.
    pub(crate) fn rates_along(
        &self,
        t: f64,
        (u_o, v_o): (&[f64], &[f64]),
        scratch: &mut Scratch,
    ) -> Vec<f64> {
        let mut a = vec![];
        if self.knows_velocities() {
            a.resize(u_o.len(), 0.0);
            self.acceleration(t, u_o, v_o, scratch, &mut a);
        }
        self.monitor_rates(t, v_o, &a)
    }

    /// The second derivatives at an acceleration `ü_O` of those that know no velocities.
    pub(crate) fn monitor_curvatures_at(&self, t: f64, a_o: &[f64]) -> Vec<f64> {
        let none = if self.knows_velocities() { vec![0.0; a_o.len()] } else { vec![] };
        self.new_monitors((a_o, &none), Part::Derivative(t, 2))
    }

    /// [`Phase::monitor_gradient`] as a new vector.
    pub fn monitor_gradient_at(&self, x_o: &[f64], w_o: &[f64]) -> Vec<f64> {
        self.new_monitors((x_o, w_o), Part::Linear)
    }

    /// [`Phase::monitor_values`] without what drives add.
    pub(crate) fn monitor_undriven(&self, u_o: &[f64], v_o: &[f64], h: &mut [f64]) {
        self.monitors_of((u_o, v_o), h, Part::Undriven);
    }

    /// The same at rest at `u_O = 0`, as a new vector.
    pub(crate) fn monitor_offsets(&self) -> Vec<f64> {
        let zero = vec![0.0; self.n_o()];
        self.new_monitors((&zero, &zero), Part::Undriven)
    }

    /// What harmonic loads on `u_C` add to displacements and monitors; weights of held nodes are none of theirs.
    pub(crate) fn drives(&self) -> Vec<Drive> {
        let of = |(k, d): (usize, &Driven)| {
            let Signal::Harmonic(index, load) = &d.load else { return None };
            let monitor = self.driven_monitors(k);
            let displacement = d.displacement.clone();
            Some(Drive { index: *index, load: load.clone(), displacement, monitor })
        };
        self.data.expansion.drives.iter().enumerate().filter_map(of).collect()
    }

    /// What measured loads add to monitors: those of points that stick.
    pub(crate) fn measured_drives(&self) -> Vec<MeasuredDrive> {
        let of = |(k, d): (usize, &Driven)| {
            let Signal::Measured(load) = &d.load else { return None };
            Some(MeasuredDrive { load: load.clone(), monitor: self.driven_monitors(k) })
        };
        self.data.expansion.drives.iter().enumerate().filter_map(of).collect()
    }

    /// What the drive of this place adds to each monitor.
    fn driven_monitors(&self, k: usize) -> Vec<f64> {
        let of = |m: &Monitor| if m.kind.is_weight() { 0.0 } else { m.row.drives[k] };
        self.monitors.iter().map(of).collect()
    }

    /// Bounds of `‖∇h‖_{M⁻¹}` of all monitors.
    pub(crate) fn gradient_bounds(&self) -> Vec<f64> {
        if let Some(obstacle) = &self.parts.obstacle {
            let of = |m: &Monitor| match m.kind {
                MonitorKind::Pressure => {
                    let stiffness = obstacle.springs.get(m.point).map_or(1.0, |s| s.stiffness);
                    stiffness * obstacle.norms[m.point]
                }
                _ => obstacle.norms[m.point],
            };
            return self.monitors.iter().map(of).collect();
        }
        let of_points = self.data.inertia.gradient_bounds(&self.data.expansion, &self.set);
        // the limits of sliders stay
        self.monitors.iter().map(|m| of_points.get(m.point).copied().unwrap_or(0.0)).collect()
    }

    /// Rounding error of each monitor when displacements are of the order of `u`, velocities of that of `v`.
    pub fn monitor_rounding(&self, u: f64, v: f64) -> Vec<f64> {
        let rounding = |m: &Monitor| if m.kind.is_weight() { 1e-12 } else { m.row.rounding(u, v) };
        self.monitors.iter().map(rounding).collect()
    }

    /// Rounding error of each monitor's rate (or second derivative) when `u̇_O` (`ü_O`) is of the order of `size`.
    pub(crate) fn rate_rounding(&self, size: f64) -> Vec<f64> {
        self.monitors.iter().map(|m| m.row.rate_rounding(size)).collect()
    }

    /// Pressures at the contact nodes: exactly zero where free, and where a node is held on the switching surface.
    pub fn pressures(&self, t: f64, u_o: &[f64], p: &mut [f64]) {
        let expansion = &self.data.expansion;
        let part = Part::Whole(t);
        let x_c = expansion.seen(u_o, part);
        // pressures know no tractions
        let seen = Seen { of_o: u_o, of_c: &x_c, tractions: &[] };
        p.fill(0.0);
        for (point, row) in &self.data.reactions {
            if !self.held.contains(point) {
                let h = &mut p[*point];
                *h = row.value(&seen, true);
                part.each_drive(&expansion.drives, |k, c| *h += c * row.drives[k]);
            }
        }
    }

    /// `K` over `u_O` with what the obstacle adds where it pushes: `K_α` where contact displacements have inertia, but for what is held.
    fn whole_stiffness(&self) -> Csr {
        let n_o = self.n_o();
        let own = self.parts.body.stiffness.leading(n_o);
        match self.pushing() {
            None => own,
            Some((obstacle, pushes)) => {
                let more = pushes.iter().flat_map(|&k| obstacle.stiffness(k));
                Csr::from_triplets(n_o, n_o, own.triplets().chain(more).collect())
            }
        }
    }

    /// `K_α` and `M_α` as sparse matrices (for modes and exact flows; the event-driven Runge–Kutta methods never form them).
    pub fn matrices(&self) -> (Csr, Csr) {
        let (body, inertia) = (&self.parts.body, &self.data.inertia);
        let (stiffness, mass) = match self.data.expansion.solved() {
            Some(_) => {
                let a = self.a_star();
                (body.stiffness.congruence(&a), inertia.matrix(body, &a))
            }
            None => (self.whole_stiffness(), inertia.shared.mass(body).leading(self.n_o())),
        };
        let springs: Vec<Discrete> = self.springs().cloned().collect();
        let stiffness = with_elements(stiffness, &springs, |e| e.stiffness);
        match inertia.holds() {
            Some(holds) => (holds.decoupled(&stiffness), holds.decoupled(&mass)),
            None => (stiffness, mass),
        }
    }

    /// Whether its matrices are those of the body and of what contact displacements follow, and of nothing else.
    pub(super) fn is_of_the_body(&self) -> bool {
        self.springs().next().is_none() && self.data.inertia.holds().is_none()
    }

    /// The springs of sliders that stick.
    fn springs(&self) -> impl Iterator<Item = &Discrete> {
        self.data.rubbing.iter().flat_map(Rubbing::springs)
    }

    /// Displacements of `u_O` that reactions hold: in [`Phase::matrices`] they know of no other.
    pub(crate) fn held_displacements(&self) -> Vec<usize> {
        self.data.inertia.holds().iter().flat_map(|h| h.displacements()).collect()
    }

    /// The same, and where they are held.
    pub(crate) fn held_places(&self) -> Vec<(usize, f64)> {
        self.data.inertia.holds().map_or(vec![], |h| h.places().to_vec())
    }

    /// The symmetric part of the stiffness that natural modes are made of: `K_α` without friction, and without forces of the obstacle that have no potential.
    pub(crate) fn symmetric_stiffness(&self) -> Csr {
        match self.pushing().is_none_or(|(obstacle, _)| obstacle.has_potential()) {
            true => self.matrices().0,
            false => self.parts.body.stiffness.leading(self.n_o()),
        }
    }

    /// What points that slip add to `K_α`, if any do.
    pub(crate) fn slip_stiffness(&self) -> Option<Csr> {
        let rubbing = self.data.rubbing.as_ref().filter(|r| r.slips())?;
        let n_o = self.n_o();
        Some(Csr::from_triplets(n_o, n_o, rubbing.stiffness().collect()))
    }

    /// Whether there is friction at some contact points, of any phase.
    pub(crate) fn rubs(&self) -> bool {
        self.data.rubbing.is_some()
    }

    /// The force of a harmonic load on `u_O`, with what it makes of friction.
    pub(crate) fn harmonic_force(&self, index: usize) -> Vec<f64> {
        let force = self.reduce(&self.parts.loads.harmonics[index].force);
        let is_it = |d: &Driven| matches!(d.load, Signal::Harmonic(i, _) if i == index);
        let drive = self.data.expansion.drives.iter().position(is_it);
        match (&self.data.rubbing, drive) {
            (Some(rubbing), Some(k)) => rubbing.with_friction(force, Some(k)),
            _ => force,
        }
    }

    /// The stiffness over `u_O` that damps, where it is not `K_α` itself: that of the body alone.
    pub(crate) fn damping_stiffness(&self) -> Option<Csr> {
        let body = &self.parts.body;
        // without mass what slips damps as it is stiff, and nothing acts on what only remembers
        if let Some(rubbing) = self.creeping().filter(|r| r.slips() || r.is_carried()) {
            let still = self.remembers();
            let own = body.stiffness.congruence(&self.a_star());
            let all = own.triplets().chain(rubbing.stiffness());
            let kept = all.filter(|e| !still.contains(&e.0)).collect();
            return Some(Csr::from_triplets(self.n_o(), self.n_o(), kept));
        }
        if self.springs().next().is_some() {
            return Some(body.stiffness.congruence(&self.a_star()));
        }
        let differs = self.pushing().is_some() || body.structure.is_some();
        differs.then(|| body.structure().leading(self.n_o()))
    }

    /// `ΦᵀWᵀWΦ` of the dampers, of shapes over `u_O`.
    pub(crate) fn dampers_among(&self, shapes: &Mat<f64>) -> Option<Mat<f64>> {
        self.parts.dampers.as_ref().map(|d| d.among(shapes))
    }

    /// What forces without a potential take.
    pub fn lost(&self) -> Option<Lost> {
        let (obstacle, pushes) = self.pushing().filter(|(o, _)| !o.has_potential())?;
        let n_o = self.n_o();
        let entries = pushes.iter().flat_map(|&k| obstacle.lost(k)).collect();
        let mut constant = vec![0.0; n_o];
        let at_rest = vec![0.0; n_o];
        for &k in pushes {
            let push = obstacle.push(k, &at_rest, true);
            obstacle.lost_along(k).into_iter().for_each(|(j, x)| constant[j] += x * push);
        }
        Some(Lost { matrix: Csr::from_triplets(n_o, n_o, entries), constant })
    }

    /// `‖A_α‖_∞`
    pub(super) fn amplification(&self) -> f64 {
        self.data.expansion.amplification()
    }

    /// `A* = [I; A_α]`, sparse.
    pub(crate) fn a_star(&self) -> Csr {
        self.data.expansion.a_star()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::inertia::{Inertia, Projector};
    use crate::contact::{Contacts, Gaps, MassChoice, Stress, System};
    use crate::fem::{Body, DofMap, Facing, Held, MassForm, Material, SpdFactor};
    use crate::mesh::structured;

    fn example(lumped_mass: bool, lumped_boundary: bool) -> System {
        let paper = (Stress::Projection, MassChoice::Paper);
        example_of(lumped_mass, lumped_boundary, paper)
    }

    fn example_of(
        lumped_mass: bool,
        lumped_boundary: bool,
        choice: (Stress, MassChoice),
    ) -> System {
        let mesh = structured::rectangle(1.0, 0.5, 5, 4);
        let held = [Held::along("left", 0), Held::along("left", 1)];
        let dofs = DofMap::new(&mesh, &held, &[Facing::surface("right")]).unwrap();
        let material = Material::plate(2.0, 0.3, 1.5, 1.0);
        let gap = dofs.contact.iter().map(|c| 0.3 + mesh.nodes()[c.node][1]).collect();
        let form = if lumped_mass { MassForm::Lumped } else { MassForm::Consistent };
        let body = Body::assemble(mesh, dofs, &[material], form);
        let contacts = Contacts { gaps: Gaps::front(gap), lumped: lumped_boundary };
        System::new(body, &contacts, choice).unwrap()
    }

    fn wave(n: usize, k: f64) -> Vec<f64> {
        (0..n).map(|i| (k * (i as f64 + 0.3)).sin()).collect()
    }

    /// The projection must equal `M_α⁻¹ A*ᵀ (f − K d* − …)` with the matrices formed outright.
    #[test]
    fn acceleration_equals_the_projected_operators() {
        for (lumped_mass, lumped_boundary) in [(false, false), (true, true), (false, true)] {
            let mut system = example(lumped_mass, lumped_boundary);
            system.damping = Some(Rayleigh { alpha: 0.2, beta: 0.05 });
            let n = system.n();
            system.loads_mut().push(wave(n, 0.7), Some(2.0), 0.3);
            for flags in 0..32u32 {
                let set = States::of_contact((0..5).map(|i| flags >> i & 1 == 1));
                let phase = system.phase(&set);
                let (u, v) = (wave(system.n_o(), 0.9), wave(system.n_o(), 1.7));
                let mut s = system.scratch();
                let mut a = vec![0.0; system.n_o()];
                phase.acceleration(0.4, &u, &v, &mut s, &mut a);

                let (k, m) = phase.matrices();
                let a_star = phase.a_star();
                let mut d = vec![0.0; system.n()];
                phase.expand_displacement(0.0, &vec![0.0; system.n_o()], &mut d);
                let mut f = vec![0.0; system.n()];
                system.loads.at(0.4, &mut f);
                system.body.stiffness.mul_sub(&d, &mut f);
                let mut rhs = vec![0.0; system.n_o()];
                a_star.triplets().for_each(|(i, j, x)| rhs[j] += x * f[i]);
                let w: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u + 0.05 * v).collect();
                k.mul_sub(&w, &mut rhs);
                let damped: Vec<f64> = v.iter().map(|v| 0.2 * v).collect();
                m.mul_sub(&damped, &mut rhs);
                let factor = SpdFactor::new(&m, "M_α").unwrap();
                factor.solve(&mut rhs, &mut factor.scratch());
                let scale = rhs.iter().fold(0.0f64, |s, x| s.max(x.abs()));
                let worst = a.iter().zip(&rhs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-11 * scale, "set {flags:05b}: {worst} of {scale}");
            }
        }
    }

    /// The monitors are the two sides of the complementarity problem.
    #[test]
    fn monitors_solve_the_lcp() {
        for lumped in [false, true] {
            let system = example(false, lumped);
            for k in 1..20 {
                let u: Vec<f64> = wave(system.n_o(), 0.1 * k as f64);
                let open = States::open(5);
                let solution = system.conditions().solve(&u, None, &open).unwrap();
                let phase = system.phase(&States::of_contact(solution.active.clone()));
                let h = phase.monitor_values(0.0, &u, &[]);
                for (h, m) in h.iter().zip(&phase.monitors) {
                    let expected = solution.w[m.point].max(solution.p[m.point]);
                    assert!((h - expected).abs() < 1e-12 * (1.0 + expected) && *h >= 0.0);
                }
                let mut full = vec![0.0; system.n()];
                phase.expand_displacement(0.0, &u, &mut full);
                for i in 0..5 {
                    let w = system.constraints[i].gap - full[system.n_o() + i];
                    assert!((w - solution.w[i]).abs() < 1e-12);
                }
            }
        }
    }

    /// With a constant mass the acceleration is that of the reduced operators, in every phase and for both stresses.
    #[test]
    fn a_constant_mass_gives_the_reduced_acceleration() {
        for stress in [Stress::Projection, Stress::Reaction] {
            for lumped in [false, true] {
                let mut system = example_of(false, lumped, (stress, MassChoice::Condensed));
                // the load acts on the contact displacements too
                let force = wave(system.n(), 0.7);
                system.loads_mut().push(force.clone(), None, 0.0);
                let n = system.n();
                system.loads_mut().push(wave(n, 1.3), Some(2.0), 0.3);
                let open = system.open_phase().matrices().1;
                for flags in 0..32u32 {
                    let set = States::of_contact((0..5).map(|i| flags >> i & 1 == 1));
                    let phase = system.phase(&set);
                    let (k, m) = phase.matrices();
                    assert_eq!(
                        m.triplets().collect::<Vec<_>>(),
                        open.triplets().collect::<Vec<_>>()
                    );
                    let (u, v) = (wave(system.n_o(), 0.9), wave(system.n_o(), 1.7));
                    let mut a = vec![0.0; system.n_o()];
                    phase.acceleration(0.4, &u, &v, &mut system.scratch(), &mut a);
                    // A*ᵀ (f − K d*(t)) − K_α u_O
                    let a_star = phase.a_star();
                    let mut d = vec![0.0; system.n()];
                    phase.expand_displacement(0.4, &vec![0.0; system.n_o()], &mut d);
                    let mut f = vec![0.0; system.n()];
                    system.loads.at(0.4, &mut f);
                    system.body.stiffness.mul_sub(&d, &mut f);
                    let mut rhs = vec![0.0; system.n_o()];
                    a_star.triplets().for_each(|(i, j, x)| rhs[j] += x * f[i]);
                    k.mul_sub(&u, &mut rhs);
                    let factor = SpdFactor::new(&m, "M_0").unwrap();
                    factor.solve(&mut rhs, &mut factor.scratch());
                    let scale = rhs.iter().fold(0.0f64, |s, x| s.max(x.abs()));
                    let worst = a.iter().zip(&rhs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(worst < 1e-11 * scale, "set {flags:05b}: {worst} of {scale}");
                }
            }
        }
    }

    /// Loads on contact displacements enter the complementarity problem: monitors, their rates and the pressures follow them in time.
    #[test]
    fn driven_monitors_are_their_own_derivatives() {
        let mut system = example_of(false, false, (Stress::Reaction, MassChoice::Condensed));
        let n = system.n();
        system.loads_mut().push(wave(n, 1.3), Some(2.0), 0.3);
        let zero = vec![0.0; system.n_o()];
        for flags in [0u32, 5, 31] {
            let set = States::of_contact((0..5).map(|i| flags >> i & 1 == 1));
            let phase = system.phase(&set);
            let (t, h) = (0.7, 1e-5);
            let at = |t: f64| phase.monitor_values(t, &zero, &[]);
            let (before, now, after) = (at(t - h), at(t), at(t + h));
            let (rate, second) =
                (phase.monitor_rates(t, &zero, &[]), phase.monitor_curvatures_at(t, &zero));
            // the nodal forces of the free points vanish: the state is in equilibrium there
            let mut u = vec![0.0; system.n()];
            phase.expand_displacement(t, &zero, &mut u);
            let mut rest = vec![0.0; system.n()];
            system.loads.at(t, &mut rest);
            system.body.stiffness.mul_sub(&u, &mut rest);
            for i in 0..5 {
                let slope = (after[i] - before[i]) / (2.0 * h);
                assert!((slope - rate[i]).abs() < 1e-6 * (1.0 + rate[i].abs()));
                let bend = (after[i] - 2.0 * now[i] + before[i]) / (h * h);
                assert!((bend - second[i]).abs() < 1e-3 * (1.0 + second[i].abs()));
                let force = rest[system.n_o() + i];
                let expected =
                    if set.touches(i) { force / system.constraints[i].area } else { 0.0 };
                let pressure = if set.touches(i) { now[i] } else { force };
                assert!((pressure - expected).abs() < 1e-11, "{pressure} {expected}");
            }
        }
    }

    #[test]
    fn two_solves_equal_stored_columns() {
        let system = example(false, false);
        let phase = system.phase(&States::of_contact([true, false, true, false, false]));
        let mut other = system.phase(&phase.set);
        let conditions = system.conditions();
        other.data.inertia.shared =
            Inertia::Projected(Projector::storing(&system.body, conditions, 0).unwrap().into())
                .into();
        let (u, v) = (wave(system.n_o(), 0.4), wave(system.n_o(), 1.1));
        let mut out = [vec![0.0; system.n_o()], vec![0.0; system.n_o()]];
        phase.acceleration(0.0, &u, &v, &mut system.scratch(), &mut out[0]);
        other.acceleration(0.0, &u, &v, &mut system.scratch(), &mut out[1]);
        let worst = out[0].iter().zip(&out[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-11 && out[0] != out[1]);
    }
}
