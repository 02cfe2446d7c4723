//! The nodal boundary method: complementarity between gap and stress at every contact node, `u_C` follows `u_O`.
//!
//! Three choices make four methods of it: the *stress* (of the displacement field, or the nodal reaction: the rows of `K` over the node's area), the
//! *inertia* (the paper's `A*ᵀMA*`, which jumps at switches; or one mass `M_0` in every phase), and that mass (condensed, or optimal:
//! [`super::redistribution`]). Reaction with a constant mass is the mass redistribution method: `V(u_O) = min_{u_C ≤ g} ½uᵀKu − fᵀu` is
//! continuously differentiable.

use std::sync::Arc;

use super::ContactError;
use super::boundary::{BoundaryOperator, Stress};
use super::conditions::{Conditions, Gaps};
use super::constraint::Constraint;
use super::following::following;
use super::friction::{Elastic, Friction, Slider, Tangent};
use super::inertia::{Inertia, Projector};
use super::law::{Coulomb, Law, Signorini};
use super::method::{Method, Promise};
use super::phase::{Parts, Phase};
use super::redistribution::{self, MassChoice, Redistributed};
use super::states::States;
use crate::fem::{Body, ContactPoint, Csr, FemError, Reduction, load};
use crate::mesh::Point;

/// The method; see the module's text.
#[derive(Debug)]
pub(super) struct Nbm {
    conditions: Arc<Conditions>,
    inertia: Arc<Inertia>,
    choice: (Stress, MassChoice),
    highest: f64,
    redistributed: Option<Redistributed>,
    friction: Option<Arc<Friction>>,
    law: Box<dyn Law>,
}

impl Nbm {
    pub fn new(
        body: &Body,
        operator: BoundaryOperator,
        gaps: Gaps,
        (stress, mass): (Stress, MassChoice),
    ) -> Result<Nbm, ContactError> {
        let conditions =
            Conditions::new(operator, gaps, stress == Stress::Reaction).map_err(|index| {
                let node = body.dofs.contact[index].node;
                ContactError::NotPMatrix { node, at: body.mesh.nodes()[node] }
            })?;
        let conditions = Arc::new(conditions);
        let redistributed = match mass {
            MassChoice::Paper => None,
            MassChoice::Condensed => Some(redistribution::condensed(body, &conditions)?),
            MassChoice::Optimal => Some(redistribution::optimal(body, &conditions)?),
        };
        let (inertia, highest) = match &redistributed {
            None => (
                Inertia::Projected(Projector::new(body, &conditions)?.into()),
                body.frequency_bound(),
            ),
            Some(new) => {
                let (constant, highest) = match new {
                    Redistributed::Condensed(mass) => {
                        let bound = redistribution::bound(body, &conditions, mass, stress)?;
                        (mass.clone(), bound * body.frequency_bound())
                    }
                    Redistributed::Optimal { mass, .. } => {
                        let held = body.stiffness.leading(body.dofs.n_o);
                        (mass.clone(), redistribution::bound_of_all(&held, body, mass))
                    }
                };
                (Inertia::Constant(constant), highest)
            }
        };
        Ok(Nbm {
            conditions,
            inertia: Arc::new(inertia),
            choice: (stress, mass),
            highest,
            redistributed,
            friction: None,
            law: Box::new(Signorini),
        })
    }

    /// The same with friction at some of its contact points, and with sliders.
    pub fn with_friction(
        self,
        body: &Body,
        mut tangents: Vec<Option<Tangent>>,
        sliders: Vec<Slider>,
    ) -> Result<Nbm, ContactError> {
        let coefficients = tangents.iter().flatten().map(|t| t.coefficient);
        let extremes = coefficients.fold(None, |all: Option<[f64; 2]>, mu| match all {
            None => Some([mu, mu]),
            Some([a, b]) => Some([a.min(mu), b.max(mu)]),
        });
        if extremes.is_none() && sliders.is_empty() {
            return Ok(self);
        }
        let Inertia::Constant(mass) = &*self.inertia else { return Err(ContactError::NoFriction) };
        if self.choice.0 != Stress::Reaction {
            return Err(ContactError::NoFriction);
        }
        let c = &self.conditions;
        tangents.resize(c.len(), None);
        let mut scratch = mass.scratch();
        let solve = |x: &mut [f64]| mass.solve(x, &mut scratch);
        let is_massless = tangents.iter().flatten().any(|t| t.anchor.is_some());
        let law = Coulomb { coefficients: extremes, is_massless, sliders: sliders.len() };
        let of_body = (&body.stiffness, &**c);
        let friction = Friction::new(tangents, sliders, of_body, solve);
        // no bound is known where what slips has no mass: its projections are oblique, by a norm of a few
        let highest = if friction.anchors().next().is_some() { 2.0 } else { 1.0 } * self.highest;
        let highest = highest.hypot(friction.of_springs().sqrt());
        Ok(Nbm { friction: Some(Arc::new(friction)), law: Box::new(law), highest, ..self })
    }
}

impl Method for Nbm {
    fn name(&self) -> String {
        let name = match self.choice {
            (Stress::Projection, MassChoice::Paper) => "nodal boundary method",
            (Stress::Reaction, MassChoice::Paper) => "nodal boundary method, nodal reactions",
            (Stress::Projection, _) => "nodal boundary method, constant inertia",
            (Stress::NodalMean, MassChoice::Paper) => "nodal boundary method, nodal mean stress",
            (Stress::NodalMean, _) => "nodal boundary method, nodal mean stress, constant inertia",
            (Stress::Reaction, MassChoice::Condensed) => "mass redistribution, condensed",
            (Stress::Reaction, MassChoice::Optimal) => "mass redistribution, optimal",
        };
        name.to_owned()
    }

    fn reduced(&self, body: &Body, reduction: &Reduction) -> Result<Arc<dyn Method>, ContactError> {
        let Conditions { n_c, n_o, area, .. } = &*self.conditions;
        let operator =
            BoundaryOperator { n_c: n_c.clone(), n_o: reduction.operator(n_o), area: area.clone() };
        let new = Nbm::new(body, operator, self.conditions.gaps(), self.choice)?;
        let Some(friction) = &self.friction else { return Ok(Arc::new(new)) };
        // a displacement that is a coordinate stays one
        let placed = |row: &[(usize, f64)]| match row {
            [(j, w)] if reduction.place(*j).is_some() => {
                reduction.place(*j).map_or(vec![], |place| vec![(place, *w)])
            }
            row => {
                let entries = row.iter().map(|&(j, w)| (0, j, w)).collect();
                let row = reduction.operator(&Csr::from_triplets(1, n_o.n_cols(), entries));
                row.row(0).collect()
            }
        };
        let of_contact = friction.tangents.iter().take(self.conditions.len());
        let tangents = of_contact
            .map(|t| t.as_ref().map(|t| Tangent { row: placed(&t.row), ..t.clone() }))
            .collect();
        // so does what a spring remembers
        let remembered = |e: Elastic| {
            let memory = reduction.place(e.memory);
            let lost = || FemError::Singular { what: "what springs of sliders remember" };
            Ok::<_, ContactError>(Elastic { memory: memory.ok_or_else(lost)?, ..e })
        };
        let slider = |s: &Slider| {
            let elastic = s.elastic.map(remembered).transpose()?;
            Ok(Slider { row: placed(&s.row), elastic, ..s.clone() })
        };
        let sliders = friction.sliders.iter().map(slider).collect::<Result<_, ContactError>>()?;
        Ok(Arc::new(new.with_friction(body, tangents, sliders)?))
    }

    fn promise(&self) -> Promise {
        let (stress, mass) = self.choice;
        let constant = mass != MassChoice::Paper;
        Promise {
            is_lipschitz: constant && stress == Stress::Reaction,
            conserves_energy: constant,
            is_strong: stress != Stress::Reaction,
            yields: false,
        }
    }

    fn law(&self) -> &dyn Law {
        &*self.law
    }

    fn friction(&self) -> Option<&Arc<Friction>> {
        self.friction.as_ref()
    }

    fn conditions(&self) -> &Arc<Conditions> {
        &self.conditions
    }

    fn inertia(&self) -> &Arc<Inertia> {
        &self.inertia
    }

    /// Nodes of the mesh.
    fn constraints(&self, body: &Body) -> Vec<Constraint> {
        let (dofs, conditions) = (&body.dofs, &self.conditions);
        let constraint = |i: usize| {
            let (d, s) = conditions.points[i];
            let ContactPoint { node, direction, group, .. } = dofs.contact[d];
            Constraint {
                node,
                position: body.mesh.nodes()[node],
                normal: if s > 0.0 { direction } else { direction.map(|x| -x) },
                group,
                gap: conditions.gap[i],
                area: conditions.area[d],
                stiffness: conditions.stiffness(i),
            }
        };
        let of_slider = |s: &Slider| Constraint {
            node: s.node,
            position: s.position,
            normal: Point::default(),
            group: usize::MAX,
            gap: 0.0,
            area: 1.0,
            stiffness: 1.0,
        };
        let sliders = self.friction.iter().flat_map(|f| &f.sliders).map(of_slider);
        (0..conditions.len()).map(constraint).chain(sliders).collect()
    }

    fn phase(&self, parts: &Parts, set: &States) -> Phase {
        let inertia = (&self.inertia, self.friction.as_ref());
        following(&*self.law, &self.conditions, inertia, parts, set)
    }

    fn gravity(&self, body: &Body, acceleration: &[f64]) -> Vec<f64> {
        match &self.redistributed {
            None => load::gravity(body, acceleration),
            Some(new) => new.gravity(body, acceleration),
        }
    }

    fn highest_frequency(&self) -> f64 {
        self.highest
    }

    fn directions(&self, body: &Body) -> Vec<Vec<(usize, f64)>> {
        // every A_α maps through the rows of N_O; K_α differs on these and on the columns K_OC, the paper's M_α on M_OC too
        let n_o = body.dofs.n_o;
        let masses = (self.choice.1 == MassChoice::Paper).then_some(&body.mass);
        let mut columns: Vec<Vec<(usize, f64)>> =
            (0..self.conditions.count()).map(|i| self.conditions.n_o.row(i).collect()).collect();
        for matrix in masses.into_iter().chain([&body.stiffness]) {
            for i in 0..self.conditions.count() {
                columns.push(matrix.row(n_o + i).filter(|(j, _)| *j < n_o).collect());
            }
        }
        columns
    }
}
