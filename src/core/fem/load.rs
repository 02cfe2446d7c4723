//! Loads `f(t) = f₀ + Σ_j f_j d^m/dt^m cos(ω_j t + φ_j)` on all displacements `u = (u_O, u_C)`; `m > 0` where a support moves: its velocity and acceleration.

use std::sync::Arc;

use super::body::Body;
use super::carried::Carried;
use super::element::{OnSide, Shape};
use super::shape;
use super::spline::Spline;

/// What a load does in time.
#[derive(Debug, Clone, PartialEq)]
pub enum Course {
    /// It stays.
    Constant,
    /// `cos(ωt + φ)`
    Harmonic {
        /// Circular frequency.
        omega: f64,
        /// Phase.
        phase: f64,
    },
    /// A measured history.
    Measured(Arc<Spline>),
}

impl Course {
    /// The derivative of this order at a time; one where it stays.
    pub fn at(&self, t: f64, order: u32) -> f64 {
        match self {
            Course::Constant => f64::from(u8::from(order == 0)),
            Course::Harmonic { omega, phase } => cosine(*omega, *phase, t, order),
            Course::Measured(history) => history.at(t, order),
        }
    }
}

/// `d^m/dt^m cos(ωt + φ)`
fn cosine(omega: f64, phase: f64, t: f64, m: u32) -> f64 {
    let angle = omega * t + phase;
    let unit = match m % 4 {
        0 => angle.cos(),
        1 => -angle.sin(),
        2 => -angle.cos(),
        _ => angle.sin(),
    };
    omega.powi(m as i32) * unit
}

/// One harmonic load.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonic {
    /// Shape and size.
    pub force: Vec<f64>,
    /// Circular frequency.
    pub omega: f64,
    /// Phase.
    pub phase: f64,
    /// `m`: the force follows this derivative of the cosine, so that its size follows the frequency.
    pub derivative: u32,
    /// It is that of dampers which are stretched as given: contact pressures, which are elastic, do not bear it, and it acts on `u_C` through what these follow.
    pub damps: bool,
}

impl Harmonic {
    /// `d^m/dt^m cos(ωt + φ)`, or its derivative of the order `order`.
    pub fn factor(&self, t: f64, order: u32) -> f64 {
        cosine(self.omega, self.phase, t, self.derivative + order)
    }

    /// `ω^m`: the force is `ω^m f cos(ωt + ψ)` with the angle `ψ` of [`Harmonic::angle`].
    pub fn size(&self) -> f64 {
        self.omega.powi(self.derivative as i32)
    }

    /// `ψ = φ + mπ/2`.
    pub fn angle(&self) -> f64 {
        self.phase + f64::from(self.derivative) * std::f64::consts::FRAC_PI_2
    }

    /// `∂/∂ω` of [`Harmonic::factor`] at a fixed time.
    pub(crate) fn factor_by_frequency(&self, t: f64) -> f64 {
        let m = f64::from(self.derivative);
        (m * self.factor(t, 0) + t * self.factor(t, 1)) / self.omega
    }
}

/// A load with a measured history: `f d^m s/dt^m`.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Shape and size.
    pub force: Vec<f64>,
    /// The history.
    pub history: Arc<Spline>,
    /// `m`: the force follows this derivative of the history.
    pub derivative: u32,
}

impl Measured {
    /// `d^m s/dt^m`, or its derivative of the order `order`.
    pub fn factor(&self, t: f64, order: u32) -> f64 {
        self.history.at(t, self.derivative + order)
    }
}

/// All loads of a scene; empty vectors cost nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Loads {
    /// Constant part, if any.
    pub constant: Option<Vec<f64>>,
    /// Harmonic parts.
    pub harmonics: Vec<Harmonic>,
    /// Measured parts.
    pub measured: Vec<Measured>,
    /// Displacements that move as given, whose forces are among the loads.
    pub carried: Carried,
    /// What of them goes straight into supports, over numbers of its own (`contact::Bearings`).
    pub borne: Option<Box<Loads>>,
}

impl Loads {
    /// Nothing acts.
    pub fn is_none(&self) -> bool {
        self.constant.is_none() && !self.is_driven()
    }

    /// Some load changes in time.
    pub fn is_driven(&self) -> bool {
        !self.harmonics.is_empty() || !self.measured.is_empty()
    }

    /// Give all harmonic loads one frequency.
    pub fn set_frequency(&mut self, omega: f64) {
        self.harmonics.iter_mut().for_each(|h| h.omega = omega);
        self.carried.set_frequency(omega);
        self.borne.iter_mut().for_each(|b| b.set_frequency(omega));
    }

    /// Count time from another instant of all harmonic loads: their angles grow by `angle`.
    pub(crate) fn turn(&mut self, angle: f64) {
        self.harmonics.iter_mut().for_each(|h| h.phase += angle);
        self.carried.turn(angle);
        self.borne.iter_mut().for_each(|b| b.turn(angle));
    }

    /// Add a load; without `omega` it is constant, and has no phase.
    pub fn push(&mut self, force: Vec<f64>, omega: Option<f64>, phase: f64) {
        match omega {
            Some(omega) => self.follow(force, 0, &Course::Harmonic { omega, phase }),
            None => self.follow(force, 0, &Course::Constant),
        }
    }

    /// Add a force that follows the derivative of the order `derivative` of a course in time.
    pub fn follow(&mut self, force: Vec<f64>, derivative: u32, course: &Course) {
        if force.iter().all(|f| *f == 0.0) && derivative > 0 {
            return;
        }
        match course {
            Course::Harmonic { omega, phase } => {
                let (omega, phase) = (*omega, *phase);
                self.harmonics.push(Harmonic { force, omega, phase, derivative, damps: false });
            }
            Course::Measured(history) => {
                let history = history.clone();
                self.measured.push(Measured { force, history, derivative });
            }
            Course::Constant if derivative > 0 => {}
            Course::Constant => match &mut self.constant {
                Some(c) => c.iter_mut().zip(&force).for_each(|(c, f)| *c += f),
                None => self.constant = Some(force),
            },
        }
    }

    /// Add the force of dampers that are stretched by a course in time: see [`Harmonic::damps`].
    pub fn damp(&mut self, force: Vec<f64>, course: &Course) {
        let before = self.harmonics.len();
        self.follow(force, 1, course);
        self.harmonics[before..].iter_mut().for_each(|h| h.damps = true);
    }

    /// `f ← f(t)`.
    pub fn at(&self, t: f64, f: &mut [f64]) {
        match &self.constant {
            Some(c) => f.copy_from_slice(c),
            None => f.fill(0.0),
        }
        for h in &self.harmonics {
            let c = h.factor(t, 0);
            f.iter_mut().zip(&h.force).for_each(|(f, a)| *f += c * a);
        }
        for m in &self.measured {
            let c = m.factor(t, 0);
            f.iter_mut().zip(&m.force).for_each(|(f, a)| *f += c * a);
        }
    }

    /// Power `(f(t) − f₀)ᵀ v` of what changes in time, but for dampers that are stretched as given.
    pub(crate) fn driven_power(&self, t: f64, v: &[f64]) -> f64 {
        let measured = self.measured.iter().map(|m| m.factor(t, 0) * dot(&m.force, v));
        self.harmonic_power(t, v, false) + measured.sum::<f64>()
    }

    /// That of these dampers along `A* u̇_O`.
    pub(crate) fn stretched_power(&self, t: f64, followed: &[f64]) -> f64 {
        self.harmonic_power(t, followed, true)
    }

    fn harmonic_power(&self, t: f64, v: &[f64], damps: bool) -> f64 {
        let own = self.harmonics.iter().filter(|h| h.damps == damps);
        own.map(|h| h.factor(t, 0) * dot(&h.force, v)).sum()
    }

    /// Work function `f₀ᵀ u` of the constant part.
    pub fn constant_potential(&self, u: &[f64]) -> f64 {
        let Some(c) = &self.constant else { return 0.0 };
        dot(c, u)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `M a` for a uniform acceleration `a`, on the components of all nodes.
pub fn nodal_gravity(body: &Body, acceleration: &[f64]) -> Vec<f64> {
    // the mass of prescribed displacements pulls on the support, not on `u`, so a uniform field must
    // be integrated with all shape functions: use the element masses' row sums
    if let Some(force) = body.pull_on_rows(acceleration) {
        return force;
    }
    let dim = body.mesh.dim();
    let of_node = |m: f64| (0..dim).map(move |c| m * acceleration[c]);
    body.nodal_mass().into_iter().flat_map(of_node).collect()
}

/// The same on `u`.
pub fn gravity(body: &Body, acceleration: &[f64]) -> Vec<f64> {
    let dim = body.mesh.dim();
    let mut force = body.dofs.gather_forces(&nodal_gravity(body, acceleration));
    // of masses at displacements: m w (w a)
    if body.discrete.iter().any(|e| e.mass != 0.0) {
        let field = acceleration[..dim].repeat(body.mesh.n_nodes());
        let field = body.dofs.gather(&field);
        for element in &body.discrete {
            let along = element.mass * element.along(&field);
            element.row.iter().for_each(|&(j, w)| force[j] += w * along);
        }
    }
    force
}

/// A uniform force per unit area on a group of sides.
pub fn traction(body: &Body, group: &str, stress: &[f64]) -> Vec<f64> {
    body.dofs.gather_forces(&nodal_traction(body, group, stress))
}

/// The areas that belong to the nodes of a group of sides, others none; over an angle of 2π around an axis: nodal forces of a unit traction.
pub fn nodal_areas(body: &Body, group: &str) -> Vec<f64> {
    let dim = body.mesh.dim();
    let mut unit = vec![0.0; dim];
    unit[0] = 1.0;
    nodal_traction(body, group, &unit).into_iter().step_by(dim).collect()
}

/// Areas of the nodes of a group of sides, all positive: the same, but on sides whose shape functions have integrals that are not (second order without a node
/// in the middle), where the area of each is shared out by `∫ P²`.
pub fn positive_areas(body: &Body, group: &str) -> Vec<f64> {
    let mesh = &body.mesh;
    let mut areas = vec![0.0; mesh.n_nodes()];
    for &facet in mesh.group(group) {
        let element = mesh.element(facet);
        let Some(material) = body.materials().get(element.region) else { continue };
        let x = mesh.corners(element);
        let bears = shape::bears(element.kind, facet.side);
        let points = (Shape { kind: element.kind, x: &x }).side(facet.side);
        let area = |p: &OnSide| p.area * material.measure(p.place[0]);
        let squares = |p: &OnSide| area(p) * p.values.iter().map(|v| v * v).sum::<f64>();
        let whole = points.iter().map(area).sum::<f64>() / points.iter().map(squares).sum::<f64>();
        for point in &points {
            for (&l, value) in element.kind.side(facet.side).iter().zip(&point.values) {
                let share = if bears { *value } else { whole * value * value };
                areas[element.nodes[l]] += area(point) * share;
            }
        }
    }
    areas
}

/// The same on the components of all nodes.
pub fn nodal_traction(body: &Body, group: &str, stress: &[f64]) -> Vec<f64> {
    let (mesh, dim) = (&body.mesh, body.mesh.dim());
    let mut nodal = vec![0.0; dim * mesh.n_nodes()];
    for &facet in mesh.group(group) {
        let element = mesh.element(facet);
        let Some(material) = body.materials().get(element.region) else { continue };
        let x = mesh.corners(element);
        for point in (Shape { kind: element.kind, x: &x }).side(facet.side) {
            let area = point.area * material.measure(point.place[0]);
            for (&l, value) in element.kind.side(facet.side).iter().zip(&point.values) {
                for c in 0..dim {
                    nodal[dim * element.nodes[l] + c] += area * value * stress[c];
                }
            }
        }
    }
    nodal
}

/// A force at a node.
pub fn point(body: &Body, node: usize, force: &[f64]) -> Vec<f64> {
    body.dofs.gather_forces(&nodal_point(body, node, force))
}

/// The same on the components of all nodes.
pub fn nodal_point(body: &Body, node: usize, force: &[f64]) -> Vec<f64> {
    let dim = body.mesh.dim();
    let mut nodal = vec![0.0; dim * body.mesh.n_nodes()];
    nodal[dim * node..dim * (node + 1)].copy_from_slice(force);
    nodal
}
