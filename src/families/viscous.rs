//! The viscous nonlinear mode of a scene: its viscosity, and whether the mesh resolves it.

use super::start;
use crate::orbit::viscous::pinned_mode;
use crate::orbit::{Pin, Propagator};
use crate::scenario::{Auto, Beta, BodyKind, Issue, Scene, SceneError};

/// `β = (L/c)/min(10, n/2)²`: sharper fronts than this are not asked for by `"auto"`.
const SHARPEST: f64 = 10.0;

/// What a viscous nonlinear mode is pinned to, and how its viscosity stands to the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viscosity {
    /// Mode and `β`.
    pub pin: Pin,
    /// `n = (L/c) c_p/h`: elements over the length of the body, at the contact and normal to it; none for given matrices.
    pub elements: Option<f64>,
}

impl Viscosity {
    /// Of a scene, or with another `β`.
    pub(crate) fn of_scene(
        scene: &Scene,
        body: &Propagator,
        beta: Option<f64>,
    ) -> Result<Viscosity, SceneError> {
        let fail = |key: &str, message: String, help: &str| {
            Err(scene.error(Issue::new(key, message, help)))
        };
        let system = &body.system;
        if system.n_contact() == 0 {
            return fail(
                "contact",
                "is missing: orbits are those of a body in contact".into(),
                "add [contact]",
            );
        }
        start::check_method(scene, system)?;
        start::check_sought(scene, system, start::Sought::Viscous)?;
        if system.impact().is_some() {
            let message = "the viscous nonlinear mode is damped in proportion to the stiffness: under the impact law reactions at held points would follow velocities";
            return fail(
                "contact.method",
                message.into(),
                "give another contact method, or leave --viscous out",
            );
        }
        if system.loads.is_driven() {
            let message = "the viscous nonlinear mode has no load that changes in time: its own feedback keeps it going";
            return fail(
                "load",
                message.into(),
                "remove the [[load]] with omega (and the motion of the obstacle), or leave --viscous out",
            );
        }
        if system.is_damped() {
            let message =
                "the viscous nonlinear mode has C = beta K - alpha M and no other damping";
            let help = "remove it, and give [orbit] beta";
            return fail(scene.damping_key(), message.into(), help);
        }
        let Some(stiffest) = pinned_mode(body) else {
            let message =
                "the open body can move rigidly, and such a motion has no viscous nonlinear mode";
            return fail("support", message.into(), "hold the body, or leave --viscous out");
        };
        let orbit = scene.orbit.as_ref();
        let mode = match orbit.and_then(|o| o.mode) {
            Some(mode) if mode > body.n() => {
                let message =
                    format!("mode {mode} does not exist: the open body has {} modes", body.n());
                return fail("orbit.mode", message, &format!("give 1 to {}", body.n()));
            }
            Some(mode) => mode - 1,
            None => stiffest,
        };
        let mut pin = Pin::new(body, mode, f64::NAN);
        let elements = elements(body, &pin);
        let given = beta.map(Beta::Number).or(orbit.and_then(|o| o.beta));
        pin.beta = match given {
            Some(Beta::Number(beta)) => beta,
            Some(Beta::Word(Auto::Auto)) | None if scene.body.kind == BodyKind::Matrices => {
                let message =
                    "a body of matrices has no elements that a viscosity could be chosen by".into();
                return fail(
                    "orbit.beta",
                    message,
                    "[orbit] beta = 0.01, a time, or --beta on the command line",
                );
            }
            _ => pin.beta_of(elements.map_or(SHARPEST, |n| SHARPEST.min(0.5 * n))),
        };
        Ok(Viscosity { pin, elements })
    }

    /// Whether fronts are sharper than the mesh resolves: `√(L/(cβ)) > n/2`.
    pub(crate) fn is_unresolved(&self) -> bool {
        self.elements.is_some_and(|n| self.pin.sharpness() > 0.5 * n * (1.0 + 1e-9))
    }
}

/// `n = (L/c) c_p/h`
fn elements(body: &Propagator, pin: &Pin) -> Option<f64> {
    let body = &body.system.body;
    Some(pin.travel_time() * body.wave_speed()? / body.size_at_contact()?)
}
