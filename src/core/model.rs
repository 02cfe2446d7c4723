//! The front door: a body before an obstacle in a dozen lines, without a scene.
//!
//! [`Model`] builds a [`System`]; [`System::state_of`] gives it a state, [`run`] a motion and [`orbit`] a periodic one. What they leave out (measured loads, reductions,
//! supports that move, families) is in the rooms below: a [`System`] is all that those ask for.

use std::sync::Arc;

use crate::contact::law::Law;
use crate::contact::{
    ContactError, Contacts, Gaps, MassChoice, Rayleigh, Rubs, State, Stress, System,
    at_displacements, boundary, on_sides,
};
use crate::event::{self, Options, Report, Silent};
use crate::fem::{
    Body, ContactRows, Csr, DofMap, Facing, FemError, FrameError, Held, MassForm, Material, load,
};
use crate::flow::{Tolerances, auto};
use crate::mesh::{Mesh, Point, structured};
use crate::orbit::search::{Effort, Verdict, find};
use crate::orbit::{Closure, OrbitError, Propagator};

/// Why there is no system.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// Supports or obstacles have directions that do not go together.
    #[error("supports and obstacles: {0:?}")]
    Frame(FrameError),
    /// The mesh has no such group of sides, or the body is one of matrices, which has none.
    #[error("there is no group of sides \"{0}\"")]
    Group(String),
    /// Matrices failed.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// The contact operators failed.
    #[error(transparent)]
    Contact(#[from] ContactError),
}

/// Where the body comes from.
#[derive(Debug, Clone)]
enum Source {
    Elements { mesh: Mesh, materials: Vec<Material>, form: MassForm },
    Matrices { mass: Csr, stiffness: Csr, contact: Vec<usize> },
}

/// A load on the sides of a group, on all mass, or on the displacements of given matrices.
#[derive(Debug, Clone)]
enum Force {
    Traction { group: String, stress: Vec<f64> },
    Gravity(Vec<f64>),
    Nodal(Vec<f64>),
}

/// A body before obstacles, in the making.
#[derive(Debug, Clone)]
#[must_use]
pub struct Model {
    source: Source,
    held: Vec<Held>,
    facing: Vec<(Facing, f64)>,
    choice: (Stress, MassChoice),
    law: Option<Arc<dyn Law>>,
    damping: Option<Rayleigh>,
    /// Force, `ω` and phase of `cos(ωt + φ)`; without `ω` a constant one.
    forces: Vec<(Force, Option<f64>, f64)>,
}

impl Model {
    fn new(source: Source, choice: (Stress, MassChoice)) -> Model {
        let (held, facing, forces) = (vec![], vec![], vec![]);
        Model { source, held, facing, choice, law: None, damping: None, forces }
    }

    /// A bar along x, from the group `left` to `right`; the paper's method: stress of the displacement field, `M_α = A*ᵀMA*`.
    pub fn bar(length: f64, elements: usize, material: Material) -> Model {
        Model::structured(structured::bar(length, elements), material)
    }

    /// A rectangle of four-node elements with the groups `left`, `right`, `bottom`, `top`, likewise.
    pub fn plate([lx, ly]: [f64; 2], [nx, ny]: [usize; 2], material: Material) -> Model {
        Model::structured(structured::rectangle(lx, ly, nx, ny), material)
    }

    fn structured(mesh: Mesh, material: Material) -> Model {
        let form = MassForm::Consistent;
        let source = Source::Elements { mesh, materials: vec![material], form };
        Model::new(source, (Stress::Projection, MassChoice::Paper))
    }

    /// A mesh with one material a region; stress as nodal mean and a constant mass, which work with every element.
    pub fn mesh(mesh: Mesh, materials: Vec<Material>) -> Model {
        let source = Source::Elements { mesh, materials, form: MassForm::Consistent };
        Model::new(source, (Stress::NodalMean, MassChoice::Condensed))
    }

    /// Matrices over all displacements, of which `contact` (rows, counted from 0, positive towards the obstacle) meet obstacles; nodal reactions and a constant mass.
    pub fn matrices(mass: Csr, stiffness: Csr, contact: &[usize]) -> Model {
        let source = Source::Matrices { mass, stiffness, contact: contact.to_vec() };
        Model::new(source, (Stress::Reaction, MassChoice::Condensed))
    }

    /// A diagonal mass ([`MassForm::Lumped`]).
    pub fn lumped(self) -> Model {
        self.mass_form(MassForm::Lumped)
    }

    /// How the mass of the elements is spread.
    pub fn mass_form(mut self, wanted: MassForm) -> Model {
        if let Source::Elements { form, .. } = &mut self.source {
            *form = wanted;
        }
        self
    }

    /// Hold some components of the displacements of a group of sides.
    pub fn hold(mut self, group: &str, components: &[usize]) -> Model {
        self.held.extend(components.iter().map(|&c| Held::along(group, c)));
        self
    }

    /// A rigid obstacle at a distance along the outward normals of a group of sides.
    pub fn obstacle(mut self, group: &str, gap: f64) -> Model {
        self.facing.push((Facing::surface(group), gap));
        self
    }

    /// The same before the contact displacements of given matrices.
    pub fn gap(self, gap: f64) -> Model {
        self.obstacle("", gap)
    }

    /// Where the pressure comes from, and which mass the phases have (Signorini's conditions).
    pub fn discretise(mut self, stress: Stress, mass: MassChoice) -> Model {
        self.choice = (stress, mass);
        self
    }

    /// A contact law on displacements that have inertia, in place of Signorini's conditions.
    pub fn law(mut self, law: impl Law + 'static) -> Model {
        self.law = Some(Arc::new(law));
        self
    }

    /// `C = α M + β K`
    pub fn damp(mut self, alpha: f64, beta: f64) -> Model {
        self.damping = Some(Rayleigh { alpha, beta });
        self
    }

    /// A traction on the sides of a group, one number a component.
    pub fn traction(mut self, group: &str, stress: &[f64]) -> Model {
        let force = Force::Traction { group: group.to_owned(), stress: stress.to_vec() };
        self.forces.push((force, None, 0.0));
        self
    }

    /// A uniform acceleration of all mass.
    pub fn gravity(mut self, acceleration: &[f64]) -> Model {
        self.forces.push((Force::Gravity(acceleration.to_vec()), None, 0.0));
        self
    }

    /// Forces on the displacements of given matrices, in the order of their rows.
    pub fn forces(mut self, forces: &[f64]) -> Model {
        self.forces.push((Force::Nodal(forces.to_vec()), None, 0.0));
        self
    }

    /// The last load as a harmonic one, `cos(ωt + φ)` times it.
    pub fn harmonic(mut self, omega: f64, phase: f64) -> Model {
        if let Some((_, w, p)) = self.forces.last_mut() {
            (*w, *p) = (Some(omega), phase);
        }
        self
    }

    /// Assemble.
    pub fn build(self) -> Result<System, ModelError> {
        let Model { source, held, facing, choice, law, damping, forces } = self;
        let mut system = match source {
            Source::Elements { mesh, materials, form } => {
                let groups = held.iter().map(|h| &h.group).chain(facing.iter().map(|f| &f.0.group));
                if let Some(unknown) = groups.into_iter().find(|g| mesh.group(g).is_empty()) {
                    return Err(ModelError::Group(unknown.clone()));
                }
                let before: Vec<Facing> = facing.iter().map(|f| f.0.clone()).collect();
                let number = if law.is_some() { DofMap::beside } else { DofMap::new };
                let dofs = number(&mesh, &held, &before).map_err(ModelError::Frame)?;
                let gap_of = |group: usize| facing[group].1;
                let body = Body::assemble(mesh, dofs, &materials, form);
                match law {
                    Some(law) => {
                        let sites = on_sides(&body);
                        let gap = sites.iter().map(|s| gap_of(s.group)).collect();
                        System::with_law(body, sites, gap, law)?
                    }
                    None => {
                        let gap = body.dofs.contact.iter().map(|c| gap_of(c.group)).collect();
                        let contacts = Contacts { gaps: Gaps::front(gap), lumped: false };
                        System::new(body, &contacts, choice)?
                    }
                }
            }
            Source::Matrices { mass, stiffness, contact } => {
                let gap = vec![facing.first().map_or(0.0, |f| f.1); contact.len()];
                let apart = if law.is_some() { &[] } else { &contact[..] };
                let body =
                    Body::from_matrices(&mass, &stiffness, &ContactRows::facing(apart), 1.0)?;
                match law {
                    Some(law) => {
                        let rows = ContactRows::facing(&contact);
                        let sites = at_displacements(&body, &rows);
                        System::with_law(body, sites, gap, law)?
                    }
                    None => {
                        let operator = boundary::reaction(&body, vec![1.0; contact.len()]);
                        System::with_operator(
                            body,
                            operator,
                            Gaps::front(gap),
                            choice,
                            Rubs::default(),
                        )?
                    }
                }
            }
        };
        system.damping = damping;
        for (force, omega, phase) in forces {
            let force = match force {
                Force::Gravity(a) => system.gravity(&a),
                Force::Traction { group, stress } => {
                    if system.body.mesh.group(&group).is_empty() {
                        return Err(ModelError::Group(group));
                    }
                    load::traction(&system.body, &group, &stress)
                }
                Force::Nodal(rows) => {
                    let mut force = system.body.dofs.gather_forces(&rows);
                    force.resize(system.n(), 0.0);
                    force
                }
            };
            system.loads_mut().push(force, omega, phase);
        }
        Ok(system)
    }
}

impl System {
    /// The state in which every point of the body has a displacement and a velocity (components along the axes).
    pub fn state_of(
        &self,
        displacement: impl Fn(Point) -> Point,
        velocity: impl Fn(Point) -> Point,
    ) -> State {
        let (mesh, dofs) = (&self.body.mesh, self.body.nodal_dofs());
        let field = |of: &dyn Fn(Point) -> Point| -> Vec<f64> {
            let nodal = |x: &Point| of(*x)[..dofs.dim].to_vec();
            let mut u = dofs.gather(&mesh.nodes().iter().flat_map(nodal).collect::<Vec<f64>>());
            u.truncate(dofs.n_o);
            self.body.coordinates(&u).into_owned()
        };
        State { u: field(&displacement), v: field(&velocity) }
    }
}

/// The motion from a state to a time, by the exact flow that costs least.
pub fn run(system: &System, start: &State, until: f64) -> Result<Report, ContactError> {
    let options = Options { until, samples: 0, switch_limit: 40.0 };
    let mut flow = auto::auto(system, Tolerances { rtol: 1e-9, atol: 1e-12 });
    event::run(system, start, &options, &mut flow, &mut Silent).map_err(|e| match e {
        event::RunError::Contact(e) => e,
        event::RunError::Observer(never) => match never {},
    })
}

/// The periodic motion of a frequency near that from a state at rest, by shooting: reversible of a conservative system, of the period of the loads of one that is
/// driven at `omega`. The verdict says what was found, or why nothing was.
pub fn orbit(system: System, start: &State, omega: f64) -> Result<Verdict, OrbitError> {
    let mut body = Propagator::new(system)?;
    body.system.loads_mut().set_frequency(omega);
    let z = body.frame(start);
    let (closure, unknowns) = match body.system.is_conservative() {
        true => (Closure::Reversible, body.n()),
        false => (Closure::FORCED, 2 * body.n()),
    };
    find(&mut body, closure, &z[..unknowns], omega, &Effort::of(closure))
}
