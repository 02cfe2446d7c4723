//! Penalty and Nitsche's method: the obstacle pushes at points of quadrature on the contact edge (Chouly, Hild, Renard 2015).
//!
//! With the displacement `n_q u` of the body at point `q` along its normal, the normal stress `s_q u` there, the weight `w_q`,
//! `κ = κ₀E′/h` and `γ = γ₀E′/h`,
//!
//! ```text
//! penalty:  M ü + K u + κ Σ w [n u − g]₊ nᵀ = f
//! Nitsche:  M ü + K u − (θ/γ) Σ w (s u) sᵀ + (1/γ) Σ w [γ(n u − g) − s u]₊ (γ n − θ s)ᵀ = f
//! ```
//!
//! Both are one body: it carries a spring without mass at every point, of stiffness `γ w`, between the combination `b u` of its displacements and a
//! tip `τ` that meets the obstacle, `τ ≤ g`:
//!
//! ```text
//! M ü + (K − (θ/γ) Σ w sᵀs) u + Σ γ w tᵀ(b u − τ) = f,   0 ≤ p = γ (b u − τ)  ⟂  g − τ ≥ 0,
//! b = n,  t = n (penalty, κ for γ);   b = n − s/γ,  t = n − θ s/γ (Nitsche)
//! ```
//!
//! A free tip follows, `τ = b u`; one at the obstacle presses. So `u_C = τ` makes the nodal reactions' complementarity problem of it, with
//! `N_C = diag γ`, `N_O = −γ b`, and mass redistribution's constant inertia, here the body's own mass. `θ = 1` has the energy
//! `½u̇ᵀMu̇ + ½uᵀKu − (1/2γ) Σ w (s u)² + ½ Σ γ w (b u − τ)²` and keeps it. With `θ ≠ 1` the matrix of forces is not symmetric, and the energy
//! `E_θ = H + (θ/2γ) Σ w (p² − (s u)²)` changes by `Ė_θ = (θ − 1) Σ w p n u̇`.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::ContactError;
use super::boundary::{self, BoundaryOperator};
use super::conditions::{Conditions, Gaps};
use super::inertia::{ConstantMass, Inertia};
use super::method::{Method, Promise};
use super::redistribution;
use super::system::Constraint;
use crate::fem::{Body, Csr, Reduction, SpdFactor, Tips, load};
use crate::mesh::Point;

/// What pushes at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// A spring of stiffness `κ₀` times the point's unit.
    Penalty {
        /// `κ₀`
        stiffness: f64,
    },
    /// Nitsche's consistent spring of stiffness `γ₀` times the point's unit.
    Nitsche {
        /// `γ₀`
        gamma: f64,
        /// 1, 0 or −1.
        theta: f64,
    },
}

impl Law {
    /// Stiffness over the point's unit.
    fn factor(self) -> f64 {
        match self {
            Law::Penalty { stiffness } => stiffness,
            Law::Nitsche { gamma, .. } => gamma,
        }
    }

    /// Shares of the stress `s/γ` that are taken from `n` in `t` and in `b`.
    fn shares(self) -> [f64; 2] {
        match self {
            Law::Penalty { .. } => [0.0, 0.0],
            Law::Nitsche { theta, .. } => [theta, 1.0],
        }
    }

    /// Whether the forces have a potential.
    pub(super) fn is_symmetric(self) -> bool {
        !matches!(self, Law::Nitsche { theta, .. } if theta != 1.0)
    }
}

/// A place where the obstacle can push.
#[derive(Debug, Clone, PartialEq)]
pub struct SpringPoint {
    /// Which of the groups before obstacles it belongs to.
    pub group: usize,
    /// The node that it is, of a body of given matrices; points of quadrature are none.
    node: Option<usize>,
    /// Place on the undeformed body.
    pub place: Point,
    /// Direction of the displacement that the obstacle limits.
    pub normal: Point,
    /// Area.
    weight: f64,
    /// `E′/h`; one where stiffnesses are absolute.
    unit: f64,
    /// `n_q`, entries over the displacements of the body.
    displacement: Vec<(usize, f64)>,
    /// `s_q`.
    stress: Vec<(usize, f64)>,
    /// The obstacle behind: the terms of the stress alone are those of the point in front.
    is_behind: bool,
}

impl SpringPoint {
    /// Whether it belongs to the obstacle behind.
    pub fn is_behind(&self) -> bool {
        self.is_behind
    }

    /// A point on the other side: the obstacle behind.
    pub fn behind(&self) -> SpringPoint {
        let turned = |row: &[(usize, f64)]| row.iter().map(|&(j, v)| (j, -v)).collect();
        SpringPoint {
            normal: self.normal.map(|x| -x),
            displacement: turned(&self.displacement),
            stress: turned(&self.stress),
            is_behind: true,
            ..self.clone()
        }
    }
}

/// The points of quadrature before obstacles, of a body whose contact displacements move by themselves.
pub fn on_sides(body: &Body) -> Vec<SpringPoint> {
    let dofs = &body.dofs;
    let spring = |point: boundary::EdgePoint| {
        let normal = point.direction(dofs);
        SpringPoint {
            group: point.group,
            node: None,
            place: point.place,
            normal,
            weight: point.weight,
            unit: point.material.axial_stiffness() / point.size,
            displacement: point.displacement(dofs, normal),
            stress: point.stress(dofs, normal),
            is_behind: false,
        }
    };
    let mut points: Vec<SpringPoint> = boundary::quadrature(body).into_iter().map(spring).collect();
    // the obstacle cannot push at what a support holds
    points.retain(|p| !p.displacement.is_empty());
    points
}

/// Springs at displacements of a body of given matrices: stiffnesses are absolute, and a pressure is a force.
pub fn at_displacements(body: &Body, rows: &[usize]) -> Vec<SpringPoint> {
    let at = |&row: &usize| SpringPoint {
        group: 0,
        node: Some(row),
        place: body.mesh.nodes()[row],
        normal: [1.0, 0.0, 0.0],
        weight: 1.0,
        unit: 1.0,
        displacement: vec![(body.dofs.row(row), 1.0)],
        stress: vec![],
        is_behind: false,
    };
    rows.iter().map(at).collect()
}

/// Springs stiffer than this, over the body, leave nothing of its own forces but rounding errors: the energy of a motion drifts by `1e-15` of the ratio.
const STIFFEST: f64 = 1e8;

/// The method.
#[derive(Debug)]
pub(super) struct Springs {
    conditions: Arc<Conditions>,
    inertia: Arc<Inertia>,
    highest: f64,
    law: Law,
    points: Arc<Vec<SpringPoint>>,
}

/// The body with springs, and the method; one gap a point.
pub(super) fn attach(
    body: Body,
    points: Vec<SpringPoint>,
    gap: Vec<f64>,
    law: Law,
) -> Result<(Body, Springs), ContactError> {
    if let Law::Nitsche { gamma, .. } = law {
        let bound = coercivity(&body, &points)?;
        if gamma <= bound {
            return Err(ContactError::NotCoercive { gamma, bound });
        }
    }
    let [share_t, share_b] = law.shares();
    let (n_o, n_c) = (body.dofs.n_o, points.len());
    let n = n_o + n_c;
    let structure = Csr::from_triplets(n, n, body.stiffness.triplets().collect());
    let mut forces: Vec<_> = structure.triplets().collect();
    let mut energy = forces.clone();
    let mut rows = vec![];
    let stiffness: Vec<f64> = points.iter().map(|p| law.factor() * p.unit).collect();
    for (q, (point, &gamma)) in points.iter().zip(&stiffness).enumerate() {
        let w = point.weight;
        let less = |share: f64| combine(&point.displacement, &point.stress, -share / gamma);
        let (t, b) = (less(share_t), less(share_b));
        let s = &point.stress;
        let outer = |x: &[(usize, f64)], y: &[(usize, f64)], c: f64| -> Vec<_> {
            x.iter().flat_map(|&(i, x)| y.iter().map(move |&(j, y)| (i, j, c * x * y))).collect()
        };
        let tip = [(n_o + q, -1.0)];
        let (from, to) = ([&b[..], &tip].concat(), [&t[..], &tip].concat());
        for (entries, to, c) in [(&mut forces, &to, 1.0), (&mut energy, &from, share_t)] {
            if !point.is_behind {
                entries.extend(outer(s, s, -share_t * w / gamma));
            }
            entries.extend(outer(to, &from, c * gamma * w));
        }
        rows.extend(b.iter().map(|&(j, v)| (q, j, -gamma * v)));
    }
    let of_displacement = |(q, p): (usize, &SpringPoint)| {
        p.displacement.iter().map(|&(j, v)| (q, j, v)).collect::<Vec<_>>()
    };
    let normal = points.iter().enumerate().flat_map(of_displacement).collect();
    let largest = |entries: &mut dyn Iterator<Item = f64>| entries.fold(0.0f64, f64::max);
    let own = largest(&mut structure.triplets().map(|e| e.2.abs()));
    let springs = points.iter().zip(&stiffness).map(|(p, gamma)| gamma * p.weight);
    let ratio = largest(&mut springs.into_iter()) / own;
    if ratio > STIFFEST {
        return Err(ContactError::TooStiff { ratio });
    }
    let tips = Tips {
        normal: Csr::from_triplets(n_c, n_o, normal),
        structure,
        energy: (!law.is_symmetric()).then(|| Csr::from_triplets(n, n, energy)),
    };
    let body = body.with_tips(Csr::from_triplets(n, n, forces), tips);
    let operator = BoundaryOperator {
        n_c: DMatrix::from_diagonal(&stiffness.into()).into(),
        n_o: Csr::from_triplets(n_c, n_o, rows),
        area: points.iter().map(|p| p.weight).collect(),
    };
    let method = Springs::new(&body, operator, gap, (law, Arc::new(points)))?;
    Ok((body, method))
}

/// `x + c y` of rows.
fn combine(x: &[(usize, f64)], y: &[(usize, f64)], c: f64) -> Vec<(usize, f64)> {
    let mut sum = x.to_vec();
    for &(j, y) in y.iter().filter(|_| c != 0.0) {
        match sum.iter_mut().find(|e| e.0 == j) {
            Some(e) => e.1 += c * y,
            None => sum.push((j, c * y)),
        }
    }
    sum
}

/// What `γ₀` must exceed: the largest eigenvalue of `(Σ w sᵀs / unit, K)`, as that of the Gram matrix of the rows. Rigid motions have no stress: a
/// shift by a rounding-sized share of the mass holds them and changes nothing else.
fn coercivity(body: &Body, points: &[SpringPoint]) -> Result<f64, ContactError> {
    let shift = 1e-9 * body.frequency_unit().powi(2);
    let stiffness = Csr::combination(1.0, &body.stiffness, shift, &body.mass);
    let factor = SpdFactor::new(&stiffness, "stiffness matrix")?;
    let front = points.iter().enumerate().filter(|(_, p)| !p.is_behind);
    let entries = front.flat_map(|(q, p)| {
        let scale = (p.weight / p.unit).sqrt();
        p.stress.iter().map(move |&(j, s)| (q, j, scale * s))
    });
    let rows = Csr::from_triplets(points.len(), body.dofs.n_o, entries.collect());
    let gram = super::inertia::gram(&factor, &rows, |_, _| ());
    Ok((0.5 * (&gram + gram.transpose())).symmetric_eigenvalues().max())
}

impl Springs {
    fn new(
        body: &Body,
        operator: BoundaryOperator,
        gap: Vec<f64>,
        (law, points): (Law, Arc<Vec<SpringPoint>>),
    ) -> Result<Springs, ContactError> {
        let conditions = Conditions::new(operator, Gaps::front(gap), false)
            .map_err(|index| ContactError::NotPMatrix { node: index, at: points[index].place })?;
        let mass = body.mass.leading(body.dofs.n_o);
        let constant = ConstantMass::formed(mass, &conditions, None)?;
        let highest = match law.is_symmetric() {
            true => redistribution::bound_of_all(body, &constant),
            false => f64::INFINITY,
        };
        let (conditions, inertia) =
            (Arc::new(conditions), Arc::new(Inertia::Constant(constant.into())));
        Ok(Springs { conditions, inertia, highest, law, points })
    }
}

impl Method for Springs {
    fn name(&self) -> String {
        match self.law {
            Law::Penalty { stiffness } => format!("penalty, κ₀ = {stiffness}"),
            Law::Nitsche { gamma, theta } => format!("Nitsche, θ = {theta}, γ₀ = {gamma}"),
        }
    }

    fn reduced(&self, body: &Body, reduction: &Reduction) -> Result<Arc<dyn Method>, ContactError> {
        let Conditions { n_c, n_o, area, gap, .. } = &*self.conditions;
        let (n_c, n_o, area) = (n_c.clone(), reduction.operator(n_o), area.clone());
        let operator = BoundaryOperator { n_c, n_o, area };
        let of_points = (self.law, self.points.clone());
        Ok(Arc::new(Springs::new(body, operator, gap.clone(), of_points)?))
    }

    fn promise(&self) -> Promise {
        Promise {
            is_lipschitz: true,
            conserves_energy: self.law.is_symmetric(),
            is_strong: false,
            yields: true,
        }
    }

    fn conditions(&self) -> &Arc<Conditions> {
        &self.conditions
    }

    fn inertia(&self) -> &Arc<Inertia> {
        &self.inertia
    }

    fn constraints(&self, _: &Body) -> Vec<Constraint> {
        let constraint = |(q, p): (usize, &SpringPoint)| Constraint {
            node: p.node.unwrap_or(q),
            position: p.place,
            normal: p.normal,
            group: p.group,
            gap: self.conditions.gap[q],
            area: p.weight,
            stiffness: self.conditions.stiffness(q),
        };
        self.points.iter().enumerate().map(constraint).collect()
    }

    fn gravity(&self, body: &Body, acceleration: &[f64]) -> Vec<f64> {
        load::gravity(body, acceleration)
    }

    fn highest_frequency(&self) -> f64 {
        self.highest
    }

    fn directions(&self, body: &Body) -> Vec<Vec<(usize, f64)>> {
        // K_α differs on b (and, where the forces have no potential, on t)
        let n_o = body.dofs.n_o;
        let size = self.conditions.len();
        let rows = (0..size).map(|q| self.conditions.n_o.row(q).collect());
        if self.law.is_symmetric() {
            return rows.collect();
        }
        let forces = body.stiffness.transposed();
        let of_tip = |q: usize| forces.row(n_o + q).filter(|(j, _)| *j < n_o).collect();
        rows.chain((0..size).map(of_tip)).collect()
    }
}
