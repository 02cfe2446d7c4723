//! Newton's law of impact in Moreau's form (Moreau 1988): bodies keep the mass of their contact points, and velocities jump.
//!
//! At `w_i = 0`, `ẇ_i⁻ < 0`, on the points `I` that touch,
//!
//! ```text
//! 0 ≤ D r + (1 + e) ẇ⁻  ⟂  r ≥ 0,      D = n M⁻¹nᵀ,      u̇⁺ = u̇⁻ − M⁻¹nᵀ r
//! ```
//!
//! One impact changes the energy by `−½ (1 − e²) ẇ²/D_ii`. Points that stay (`ẇ⁺ = 0`) are held while their reaction presses.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::ContactError;
use super::boundary::BoundaryOperator;
use super::conditions::{Conditions, Gaps};
use super::holding::holding;
use super::inertia::{HeldMass, Inertia, PhaseInertia};
use super::lcp::{self, LcpError};
use super::method::{Method, Promise, Selection};
use super::phase::{Parts, Phase};
use super::states::States;
use super::system::Constraint;
use crate::fem::{Body, ContactPoint, Csr, FemError, Loads, Reduction, Tips, load};

/// The law of a body.
#[derive(Debug)]
pub struct Impact {
    /// `e`
    pub restitution: f64,
    /// A scheme of its own in place of events.
    pub march: Option<March>,
    mass: Arc<HeldMass>,
}

/// Schemes that go through time in their own way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum March {
    /// That of Moreau and Jean.
    Steps(Stepping),
    /// Waves along the characteristics of a uniform bar.
    Waves(Instants),
}

/// When the waves of a bar decide on contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instants {
    /// Where it closes and opens.
    Exact,
    /// Once an element's travel time.
    Step,
}

/// The scheme of Moreau and Jean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stepping {
    /// Time step.
    pub step: f64,
    /// Which points are pushed.
    pub rule: Rule,
}

/// Which points are pushed over a step, with `w` and `ẇ` at its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rule {
    /// `w + ½hẇ ≤ 0`
    #[default]
    HalfStep,
    /// `w + hẇ ≤ 0` and `ẇ ≤ 0`
    FullStep,
}

/// The method.
#[derive(Debug)]
pub(super) struct ImpactLaw {
    conditions: Arc<Conditions>,
    inertia: Arc<Inertia>,
    constraints: Vec<Constraint>,
    /// `K M⁻¹nᵀ`, column by column.
    through: Vec<Vec<f64>>,
    law: Impact,
}

/// `v ← v − Σ columns_j (rows_j v)` over `u_O`.
#[derive(Debug, Clone, PartialEq)]
pub struct BlowMap {
    /// `M⁻¹nᵀ D⁻¹ E`
    pub columns: Vec<Vec<f64>>,
    /// `n`
    pub rows: Vec<Vec<(usize, f64)>>,
}

/// Velocities after an impact.
#[derive(Debug, Clone, PartialEq)]
pub struct Blow {
    /// Impulse at each of the points that touch.
    pub impulse: Vec<f64>,
    /// `ẇ⁺` of these points.
    pub rate: Vec<f64>,
}

/// The body with all contact displacements among those that move by themselves, and the method.
pub(super) fn attach(
    body: Body,
    gap: Vec<f64>,
    area: Vec<f64>,
    (restitution, march): (f64, Option<March>),
) -> Result<(Body, ImpactLaw), ContactError> {
    let dofs = &body.dofs;
    let (n_o, count) = (dofs.n_o, dofs.contact.len());
    let entry = |k: usize| {
        let (place, sign) = dofs.contact_place(k);
        (k, place, sign)
    };
    let entries = (0..count).map(entry);
    let normal = Csr::from_triplets(count, n_o, entries.collect());
    let n = n_o + count;
    let stiffness = Csr::from_triplets(n, n, body.stiffness.triplets().collect());
    let tips = Tips { normal: normal.clone(), structure: stiffness.clone(), energy: None };
    let body = body.with_tips(stiffness, tips);
    let dofs = &body.dofs;
    let held = Arc::new(HeldMass::new(&body, normal)?);
    let through = held.columns.iter().map(|c| {
        let mut x = c.clone();
        x.resize(n, 0.0);
        let mut y = vec![0.0; n];
        body.stiffness.mul(&x, &mut y);
        y.truncate(n_o);
        y
    });
    let through = through.collect();
    let constraint = |k: usize| {
        let ContactPoint { node, direction, group, .. } = dofs.contact[k];
        // a unit displacement of the point alone under the stiffness of its own row
        let (j, _) = dofs.contact_place(k);
        let own = body.stiffness.row(j).find(|e| e.0 == j).map_or(1.0, |e| e.1);
        Constraint {
            node,
            position: body.mesh.nodes()[node],
            normal: direction,
            group,
            gap: gap[k],
            area: area[k],
            stiffness: own / area[k],
        }
    };
    let constraints: Vec<Constraint> = (0..count).map(constraint).collect();
    // what the state itself obeys: u_C ≤ g, no force where it is free
    let stiffnesses: Vec<f64> = constraints.iter().map(|c| c.stiffness).collect();
    let rows = held.normal.triplets().map(|(i, j, v)| (i, j, -stiffnesses[i] * v));
    let operator = BoundaryOperator {
        n_o: Csr::from_triplets(count, n_o, rows.collect()),
        n_c: DMatrix::from_diagonal(&stiffnesses.clone().into()).into(),
        area,
    };
    let conditions = Conditions::new(operator, Gaps::front(gap), false).map_err(|index| {
        let node = dofs.contact[index].node;
        ContactError::NotPMatrix { node, at: body.mesh.nodes()[node] }
    })?;
    let inertia = Arc::new(Inertia::Held(held.clone()));
    let law = Impact { restitution, march, mass: held };
    let conditions = Arc::new(conditions);
    Ok((body, ImpactLaw { conditions, inertia, constraints, through, law }))
}

impl Impact {
    /// The impact of the points `touching` at the velocity `v`, which becomes that after it.
    pub fn strike(&self, touching: &[usize], v: &mut [f64]) -> Result<Blow, LcpError> {
        let rate = |v: &[f64], k: usize| -self.mass.normal.row_dot(k, v);
        let before: Vec<f64> = touching.iter().map(|&k| rate(v, k)).collect();
        let largest = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let q: Vec<f64> = before.iter().map(|w| (1.0 + self.restitution) * w).collect();
        let impulse = self.complementary(touching, &q, largest)?;
        self.push(touching, &impulse, v);
        Ok(Blow { rate: touching.iter().map(|&k| rate(v, k)).collect(), impulse })
    }

    /// `0 ≤ D r + q ⟂ r ≥ 0` on some points: the smallest `r` of the solution; what is zero to rounding is zero.
    fn complementary(&self, points: &[usize], q: &[f64], size: f64) -> Result<Vec<f64>, LcpError> {
        let start: Vec<bool> = q.iter().map(|q| *q >= 0.0).collect();
        let solution =
            lcp::solve(&self.mass.block(points).into(), q, &vec![4.0 * size; q.len()], &start)?;
        Ok(solution.w)
    }

    /// `v ← v − M⁻¹nᵀ r`
    fn push(&self, points: &[usize], impulse: &[f64], v: &mut [f64]) {
        for (&k, r) in points.iter().zip(impulse) {
            v.iter_mut().zip(&self.mass.columns[k]).for_each(|(v, c)| *v -= r * c);
        }
    }

    /// The jump of velocities as a linear map, for as long as the same points are struck, of which `held` were at rest before:
    /// `R = I − M⁻¹nᵀ D⁻¹ E n` with `1 + e` in the diagonal matrix `E`, 1 for points at rest. The factors `M⁻¹nᵀ D⁻¹ E` column by column.
    pub fn blow(&self, struck: &[usize], held: &States) -> Option<BlowMap> {
        let mass = &self.mass;
        let inverse = mass.block(struck).try_inverse()?;
        let factor = |k: usize| if held.touches(k) { 1.0 } else { 1.0 + self.restitution };
        let column = |j: usize| -> Vec<f64> {
            let mut sum = vec![0.0; mass.normal.n_cols()];
            for (i, &k) in struck.iter().enumerate() {
                let c = inverse[(i, j)] * factor(struck[j]);
                sum.iter_mut().zip(&mass.columns[k]).for_each(|(s, x)| *s += c * x);
            }
            sum
        };
        let row = |&k: &usize| mass.normal.row(k).collect();
        Some(BlowMap {
            columns: (0..struck.len()).map(column).collect(),
            rows: struck.iter().map(row).collect(),
        })
    }

    /// Take what is left of the velocity of some points against the obstacle.
    pub fn stop(&self, points: &[usize], v: &mut [f64]) {
        let along = points.iter().map(|&k| self.mass.normal.row_dot(k, v));
        let along = DVector::from_iterator(points.len(), along);
        if let Some(r) = self.mass.block(points).lu().solve(&along) {
            self.push(points, r.as_slice(), v);
        }
    }

    /// Which of the points at rest on the obstacle stay: `0 ≤ ẅ ⟂ λ ≥ 0` with the acceleration `a` of the body without their reactions.
    pub fn staying(&self, resting: &[usize], a: &[f64]) -> Result<Vec<usize>, LcpError> {
        let q: Vec<f64> = resting.iter().map(|&k| -self.mass.normal.row_dot(k, a)).collect();
        let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let reaction = self.complementary(resting, &q, largest)?;
        Ok(resting.iter().zip(&reaction).filter(|(_, r)| **r > 0.0).map(|(&k, _)| k).collect())
    }
}

impl Method for ImpactLaw {
    fn name(&self) -> String {
        let e = self.law.restitution;
        match self.law.march {
            None => format!("impact law, e = {e}"),
            Some(March::Steps(_)) => format!("Moreau-Jean, e = {e}"),
            Some(March::Waves(Instants::Exact)) => "waves of a uniform bar".to_owned(),
            Some(March::Waves(Instants::Step)) => "wave finite elements".to_owned(),
        }
    }

    fn reduced(&self, _: &Body, _: &Reduction) -> Result<Arc<dyn Method>, ContactError> {
        // the contact displacements carry mass: they are among those that modes would stand for
        Err(FemError::Singular { what: "reduced impact law" }.into())
    }

    fn promise(&self) -> Promise {
        Promise {
            is_lipschitz: false,
            conserves_energy: self.law.restitution == 1.0
                || matches!(self.law.march, Some(March::Waves(_))),
            is_strong: false,
            yields: false,
        }
    }

    fn conditions(&self) -> &Arc<Conditions> {
        &self.conditions
    }

    fn inertia(&self) -> &Arc<Inertia> {
        &self.inertia
    }

    fn constraints(&self, _: &Body) -> Vec<Constraint> {
        self.constraints.clone()
    }

    fn impact(&self) -> Option<&Impact> {
        Some(&self.law)
    }

    /// Which points touch is not a matter of displacements alone: those of `start` that do stay.
    fn select(
        &self,
        _: &Loads,
        _: f64,
        x: &[f64],
        start: &States,
    ) -> Result<Selection, ContactError> {
        let size = x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let touches = |k: usize| {
            let gap = self.constraints[k].gap;
            let moved = -self.conditions.n_o.row_dot(k, x) / self.constraints[k].stiffness;
            gap - moved <= 64.0 * lcp::UNITS * size.max(gap.abs())
        };
        let touching = (0..self.constraints.len()).map(|k| start.touches(k) && touches(k));
        Ok(Selection { set: States::of_contact(touching), degenerate: vec![] })
    }

    fn phase(&self, parts: &Parts, set: &States) -> Phase {
        let inertia = PhaseInertia::new(&self.inertia, &self.conditions, set);
        let mass = (&*self.law.mass, &*self.through);
        let affine = holding(mass, &self.constraints, set, &parts.loads);
        Phase::new(parts.clone(), affine, inertia, set.clone())
    }

    fn gravity(&self, body: &Body, acceleration: &[f64]) -> Vec<f64> {
        load::gravity(body, acceleration)
    }

    fn highest_frequency(&self) -> f64 {
        f64::INFINITY
    }

    fn directions(&self, _: &Body) -> Vec<Vec<(usize, f64)>> {
        vec![]
    }
}
