//! One viscous or conservative orbit of a scene, found from what everybody would start from.

use signorini::orbit::search::{Effort, find};
use signorini::orbit::viscous::{by_viscosity, pinned_mode};
use signorini::orbit::{Closure, Orbit, Pin, Propagator};
use signorini::problem::Problem;
use signorini::scenario::{Contact, ContactMethod, Inertia, Scene};

/// The three discretisations of the contact.
pub const METHODS: [&str; 3] =
    ["nodal boundary method", "its constant inertia", "mass redistribution"];

/// A scene with a mesh and one of [`METHODS`].
pub fn with_method(mut scene: Scene, elements: &[usize], method: usize) -> Scene {
    scene.body.elements = elements.to_vec();
    let choose = |c: &mut Contact| match method {
        0 => {}
        1 => c.inertia = Some(Inertia::Constant),
        _ => c.method = ContactMethod::MassRedistribution,
    };
    scene.contact.iter_mut().for_each(choose);
    scene
}

/// The body of a scene, ready for shooting.
pub fn body(scene: &Scene) -> Result<Propagator, String> {
    let problem = Problem::new(scene, None).map_err(|e| e.to_string())?;
    Propagator::new(problem.system).map_err(|e| e.to_string())
}

/// The viscous orbit with `β` at `omega`, from the linear mode or along falling viscosities.
pub fn viscous(body: &mut Propagator, beta: f64, omega: f64) -> Result<Option<Orbit>, String> {
    let mode = pinned_mode(body).ok_or("a rigid motion")?;
    let pin = Pin::new(body, mode, beta);
    let closure = Closure::Viscous(pin);
    let effort = Effort { multipliers: false, ..Effort::of(closure) };
    for guess in pin.guesses(body, omega) {
        let verdict = find(body, closure, &guess, omega, &effort).map_err(|e| e.to_string())?;
        if let Some(orbit) = verdict.orbit() {
            return Ok(Some(orbit.clone()));
        }
    }
    let found = by_viscosity(body, pin, omega, &effort).map_err(|e| e.to_string())?;
    Ok(found.and_then(|v| v.orbit().cloned()))
}
