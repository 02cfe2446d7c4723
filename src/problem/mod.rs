//! From a scene to the initial-value problem of the nodal boundary equations.
//!
//! Finds what only the mesh and the matrices can tell: rigid motions, prescribed contact edges, penetrating
//! initial states. Every such finding is an [`Issue`] that names the key of the scene.

mod bearings;
mod body;
mod damping;
mod discretisation;
mod elements;
mod error;
mod form;
mod friction;
mod gaps;
mod given;
mod imported;
mod initial;
mod loads;
mod materials;
mod modes;
mod moving;
mod notes;
mod pairs;
mod parts;
mod places;
mod probes;
mod reduction;
mod rigid;
mod springs;
mod swinging;
mod table;

use crate::contact::{
    ContactError, Gaps, Instants, March, MassChoice, Restitution, Rubs, Rule, State, Stepping,
    Stress, System,
};
use crate::fem::{Body, FemError};
use crate::scenario::{Activation, BodyKind, Contact, ContactMethod, Integrator, Issue, Scene};

pub use body::mesh;
pub use error::ProblemError;

use body::{assemble, contacts};
use damping::{damping, rayleigh_of};
pub use discretisation::changes_mass_at_switches;
use discretisation::discretisation;
pub use given::uneven_text;
use given::{given_body, given_gaps_behind};
pub use imported::{read as read_mesh, read_file as read_mesh_file};
use initial::initial_state;
pub use initial::{ModeShape, mode_shapes};
use loads::loads;
pub use materials::materials;
use modes::OpenModes;
pub use notes::Notes;
pub use parts::{Parts, parts};

/// The body, its loads and its initial state.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Operators.
    pub system: System,
    /// State at `t = 0`.
    pub initial: State,
    /// What there is to say of them.
    pub notes: Notes,
}

/// Nodal fields `(displacement, velocity)` read from a file, components interleaved.
pub type StoredState = (Vec<f64>, Vec<f64>);

/// The scheme of its own that a scene asks for.
fn march(contact: &Contact, body: &Body) -> Option<March> {
    if contact.method == ContactMethod::Waves {
        return Some(March::Waves(match contact.instants {
            Some(crate::scenario::Instants::Step) => Instants::Step,
            _ => Instants::Exact,
        }));
    }
    if contact.method != ContactMethod::MoreauJean {
        return None;
    }
    let rule = match contact.activation {
        Some(Activation::FullStep) => Rule::FullStep,
        _ => Rule::HalfStep,
    };
    // a tenth of the time of a wave over an element at the contact
    let time = body.size_at_contact().zip(body.wave_speed()).map_or(1e-3, |(h, c)| 0.1 * h / c);
    Some(March::Steps(Stepping { step: contact.step.unwrap_or(time), rule }))
}

/// What the flow that is asked for does not take.
fn check_flow(scene: &Scene, system: &System) -> Result<(), ProblemError> {
    let asked = scene.run.as_ref().map(|r| r.integrator);
    if asked != Some(Integrator::Chebyshev) || system.is_entire() {
        return Ok(());
    }
    let message = if system.tangents().is_some() {
        "\"chebyshev\" needs elastic forces with a potential, and friction has none"
    } else if !system.has_potential() {
        "\"chebyshev\" needs elastic forces with a potential, which Nitsche's with theta ≠ 1 have not"
    } else if !system.is_decoupled() {
        "\"chebyshev\" needs damping in proportion to mass and stiffness: neither dampers nor ratios of all modes, nor springs of the obstacle, which do not damp"
    } else {
        "\"chebyshev\" needs a bound of the natural frequencies, which is not known for this contact method on this body"
    };
    let help = "give \"auto\", \"modal\" or \"dop853\"";
    Err(scene.error(Issue::new("run.integrator", message, help)).into())
}

/// What the impact law does not go with.
fn check_impact(scene: &Scene, system: &System) -> Result<(), ProblemError> {
    if system.impact().is_none() {
        return Ok(());
    }
    let fail = |key: &str, message: &str, help: &str| {
        Err(scene.error(Issue::new(key, message, help)).into())
    };
    let march = system.impact().and_then(|law| law.march);
    if march.is_none() && system.damping.is_some_and(|d| d.beta != 0.0) {
        let message = "in proportion to the stiffness acts on held points: under the impact law their reactions would follow velocities";
        return fail("damping", message, "give rayleigh = [alpha, 0.0], or another contact method");
    }
    if let Some(March::Waves(_)) = march {
        let held = system.body.rigid_motions(false).is_empty();
        if scene.body.kind != BodyKind::Bar || !held {
            let message = "\"waves\" is for a uniform bar that is held at its other end";
            return fail("contact.method", message, "give another contact method");
        }
        if system.damping.is_some() {
            let message = "takes energy from waves, which \"waves\" carries unchanged";
            return fail("damping", message, "remove [damping], or give another contact method");
        }
        if !scene.loads.is_empty() {
            let message = "\"waves\" knows the motion of a bar without loads";
            return fail("load", message, "remove it, or give another contact method");
        }
        if scene.contact.as_ref().is_some_and(|c| c.motion.is_some()) {
            let message = "\"waves\" knows an obstacle at rest";
            return fail("contact.motion", message, "remove it, or give another contact method");
        }
    }
    let integrator = scene.run.as_ref().map_or(Integrator::Auto, |r| r.integrator);
    if march.is_some() && integrator != Integrator::Auto {
        let message = "is not read: the contact method goes through time in its own way";
        return fail("run.integrator", message, "remove the key, or give another contact method");
    }
    if integrator == Integrator::Chebyshev {
        let message =
            "\"chebyshev\" needs a bound of the frequencies, which no phase with held points has";
        return fail("run.integrator", message, "give \"auto\", \"modal\" or \"dop853\"");
    }
    if scene.reduction.is_some() {
        let message = "leaves contact displacements out of the modes, and with this contact method they have mass";
        return fail("reduction", message, "leave [reduction] out, or give another contact method");
    }
    Ok(())
}

/// Friction at obstacles, and sliders.
fn rubs(scene: &Scene, body: &Body) -> Result<Rubs, ProblemError> {
    Ok(Rubs {
        tangents: friction::tangents(scene, body)?,
        sliders: elements::sliders(scene, body)?,
    })
}

/// The system of a method whose conditions hold at nodes.
fn nodal(scene: &Scene) -> Result<System, ProblemError> {
    let choice = discretisation(scene);
    let mut thin = None;
    let built = match scene.body.kind {
        BodyKind::Matrices => {
            let (body, operator, gap) = given_body(scene)?;
            let behind = given_gaps_behind(scene, &gap)?;
            let rubs = rubs(scene, &body)?;
            // rows without mass follow as nodal reactions make them
            let choice = match scene.contact {
                None if body.dofs.n_c > 0 => (Stress::Reaction, MassChoice::Condensed),
                _ => choice,
            };
            System::with_operator(body, operator, Gaps { front: gap, behind }, choice, rubs)
        }
        _ => {
            let body = assemble(scene)?;
            thin = pairs::thin(scene, &body);
            let contacts = contacts(scene, &body)?;
            match scene.contact.as_ref().filter(|c| c.has_impacts()) {
                Some(c) => {
                    let coefficient = c.restitution.unwrap_or(0.0);
                    let law = Restitution { coefficient, march: march(c, &body) };
                    System::with_impacts(body, contacts.gaps.front, law)
                }
                None => {
                    let rubs = rubs(scene, &body)?;
                    System::with_friction(body, &contacts, choice, rubs)
                }
            }
        }
    };
    built.map_err(|e| match e {
        ContactError::NotPMatrix { .. } => {
            if let Some(issue) = thin {
                return scene.error(issue).into();
            }
            let (key, help) = match scene.body.kind {
                BodyKind::Matrices => {
                    ("contact.n_c", "give stress = \"reaction\", or another boundary operator")
                }
                BodyKind::Mesh => ("contact", "give stress = \"reaction\": it works on every mesh"),
                _ => (
                    "contact.edge",
                    "give the elements along the contact edge regular shapes, boundary_mass = \"consistent\", or stress = \"reaction\"",
                ),
            };
            scene.error(Issue::new(key, e.to_string(), help)).into()
        }
        ContactError::NoFriction if scene.slides() => {
            let help = "remove stress and inertia: beside sliders they are \"reaction\" and \"constant\"";
            scene.error(Issue::new(scene.friction_key(), e.to_string(), help)).into()
        }
        ContactError::NoFriction => {
            let key = scene.friction_key();
            let help = "remove stress and inertia: with friction they are \"reaction\" and \"constant\"";
            scene.error(Issue::new(key, e.to_string(), help)).into()
        }
        ContactError::SeveralDirections => {
            let help = "give mass = \"condensed\": it knows no direction";
            scene.error(Issue::new("contact.mass", e.to_string(), help)).into()
        }
        ContactError::Moments { .. } => {
            let help = "give mass = \"condensed\", or refine the mesh near the contact edge";
            scene.error(Issue::new("contact.mass", e.to_string(), help)).into()
        }
        ContactError::Fem(FemError::NotPositiveDefinite { .. })
            if choice.1 == MassChoice::Optimal =>
        {
            let message = "the redistributed mass is not positive definite on this mesh";
            let help = "give mass = \"condensed\", or refine the mesh near the contact edge";
            scene.error(Issue::new("contact.mass", message, help)).into()
        }
        other => other.into(),
    })
}

/// Where a scene begins at its equilibrium, motions are told around it. With friction it is one of a family, where velocities jump its phase has no modes of its own: they are not.
fn around_equilibrium(scene: &Scene, system: &mut System) -> Result<(), ProblemError> {
    // a reduced body asks again, any other one has it
    if !scene.is_around_equilibrium() || system.rest().is_some() {
        return Ok(());
    }
    initial::check_potential(scene, system)?;
    system.set_rest().map_err(|why| initial::no_equilibrium(scene, &why))
}

impl Problem {
    /// Set up a scene. `stored` is the state of the file named in `[initial]`, if any.
    pub fn new(scene: &Scene, stored: Option<StoredState>) -> Result<Problem, ProblemError> {
        let contact = scene.contact.as_ref();
        elements::check_sliders(scene)?;
        let mut system = match contact.and_then(|c| Some((c, springs::law(c)?))) {
            Some((contact, law)) => springs::system(scene, contact, law)?,
            None => nodal(scene)?,
        };
        let modes = OpenModes::for_scene(scene, &system)?;
        system.damping = damping(scene, &modes)?;
        check_impact(scene, &system)?;
        if let Some(name) = &scene.body.damping_matrix {
            system.damping = Some(rayleigh_of(scene, &system, name)?);
        }
        let mut notes = Notes::default();
        *system.loads_mut() = loads(scene, &system, &modes, &mut notes)?;
        notes.places.extend(elements::places(scene, &system.body)?);
        pairs::note(scene, &system.body, &mut notes);
        given::note(scene, &system.body, &mut notes);
        let dampers = elements::dampers(scene, &system)?;
        elements::add(&mut system, dampers);
        let (bearings, borne) = bearings::bearings(scene, &system)?;
        system.bearings = bearings.into();
        system.loads_mut().borne = borne;
        system.probes = probes::probes(scene, &system.body)?.into();
        friction::move_loads(&mut system, &mut notes);
        friction::check(scene, &system, &mut notes)?;
        around_equilibrium(scene, &mut system)?;
        let mut initial = initial_state(scene, &system, &modes, stored, &mut notes)?;
        if !scene.initial.equilibrium {
            let preloaded = system.sliders().iter().filter_map(|s| s.elastic);
            preloaded.for_each(|e| initial.u[e.memory] += e.start());
        }
        if let Some([u, v]) = moving::frame(scene, &system) {
            initial.u.iter_mut().zip(&u).for_each(|(x, u)| *x -= u);
            initial.v.iter_mut().zip(&v).for_each(|(x, v)| *x -= v);
        }
        check_flow(scene, &system)?;
        let problem = Problem { system, initial, notes };
        problem.check_rigid_motion(scene)?;
        elements::check(scene, &problem)?;
        let mut problem = reduction::reduced(scene, problem)?;
        let modal = damping::modal(scene, &problem.system)?;
        elements::add(&mut problem.system, modal);
        if problem.system.impact().is_some() && problem.system.dampers.is_some() {
            let message =
                "acts on points that the impact law holds: their reactions would follow velocities";
            let help = "give [damping] rayleigh = [alpha, 0.0], or another contact method";
            return Err(scene.error(Issue::new(scene.damping_key(), message, help)).into());
        }
        check_flow(scene, &problem.system)?;
        around_equilibrium(scene, &mut problem.system)?;
        Ok(problem)
    }
}
