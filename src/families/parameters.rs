//! The parameters of a scene that orbits are differentiated by: its numbers, by their keys.

use super::start::check_with_mass;
use crate::contact::System;
use crate::orbit::parameter::{Kind, Neighbour, Parameter, STEP, Stencil};
use crate::orbit::{Closure, OrbitError};
use crate::problem::{Problem, ProblemError};
use crate::scenario::{Change, Issue, Scene, SceneError};

/// The name of the circular frequency among parameters.
pub const FREQUENCY: &str = "omega";
/// The name of the viscosity of a viscous orbit.
pub const VISCOSITY: &str = "beta";

/// Why a number of a scene is no parameter.
fn refused(scene: &Scene, key: &str, message: &str, help: &str) -> ProblemError {
    scene.error(Issue::new(key, message, help)).into()
}

/// The parameter of a key of a scene whose body is `system`, for an orbit of a closure and a circular frequency.
pub fn parameter(
    scene: &Scene,
    system: &System,
    (closure, omega): (Closure, f64),
    key: &str,
) -> Result<Parameter, ProblemError> {
    match (key, closure) {
        (FREQUENCY, Closure::Limit) => {
            let message = "of a limit cycle is found with it";
            return Err(refused(scene, key, message, "leave it out"));
        }
        (FREQUENCY, _) => return Ok(Parameter::frequency(system, omega)),
        (VISCOSITY, Closure::Viscous(pin)) => return Ok(Parameter::viscosity(system, pin.beta)),
        _ => {}
    }
    if key == VISCOSITY {
        let help = "give --viscous, or a key of the scene: damping.rayleigh[1]";
        return Err(refused(scene, key, "belongs to viscous orbits", help));
    }
    let why = "derivatives by numbers of the scene leave out what the memory does";
    check_with_mass(scene, system, why)?;
    let value = of_equations(scene, key)?;
    let step = STEP * if value == 0.0 { 1.0 } else { value.abs() };
    let mut why = None;
    for stencil in [Stencil::Central, Stencil::OneSided(1.0), Stencil::OneSided(-1.0)] {
        match neighbours(scene, system, key, value, &stencil.points(step)) {
            Ok(all) => return Ok(Parameter::new(Kind::Operators, value, all)),
            Err(e) => why = why.or(Some(e)),
        }
    }
    let text = why.map_or(String::new(), |e| e.to_string());
    let message = format!("cannot be a little larger or smaller: {}", text.replace('\n', " "));
    let help = "give a number that enters the equations smoothly, no count";
    Err(refused(scene, key, &message, help))
}

/// The parameters of some keys of a scene, for orbits whose frequency follows the phase of their loads.
pub fn beside_frequency(
    scene: &Scene,
    system: &System,
    keys: &[String],
) -> Result<Vec<Parameter>, ProblemError> {
    let of = |key: &String| match key.as_str() {
        FREQUENCY => {
            let message = "follows the phase of the loads";
            Err(refused(scene, key, message, "leave it out: derivatives of the frequency are told"))
        }
        key => parameter(scene, system, (Closure::FORCED, f64::NAN), key),
    };
    keys.iter().map(of).collect()
}

/// The number at a key of a scene, if it is one of the equations, and not the frequency.
pub(super) fn of_equations(scene: &Scene, key: &str) -> Result<f64, ProblemError> {
    if ["run.", "orbit.", "initial.", "reduction."].iter().any(|table| key.starts_with(table)) {
        let help = "give a number of the body, of what holds it, of contact, loads or damping";
        return Err(refused(scene, key, "is no number of the equations", help));
    }
    let value = scene.number(key)?;
    if key.ends_with(".omega") || key.ends_with(".period") {
        let help = "give omega: the frequency of the orbit and of its loads";
        return Err(refused(scene, key, "is the frequency of the orbit", help));
    }
    Ok(value)
}

fn neighbours(
    scene: &Scene,
    system: &System,
    key: &str,
    value: f64,
    points: &[(f64, f64)],
) -> Result<Vec<Neighbour>, ProblemError> {
    let still = without_start(scene)?;
    let beside = |&(offset, weight): &(f64, f64)| -> Result<Neighbour, ProblemError> {
        let changed = still.with_number(key, value + offset)?;
        let there = Problem::new(&changed, None)?.system;
        if [there.n_o(), there.n(), there.n_contact()]
            != [system.n_o(), system.n(), system.n_contact()]
        {
            let message = "changes the displacements that there are";
            return Err(refused(scene, key, message, "give a number that enters smoothly"));
        }
        Ok(Neighbour { offset, weight, system: there })
    };
    points.iter().map(beside).collect()
}

/// Where motions begin is no matter of the equations, and need not be possible beside.
fn without_start(scene: &Scene) -> Result<Scene, SceneError> {
    match scene.is_around_equilibrium() {
        true => Ok(scene.clone()),
        false => scene.with(&[Change::remove("initial")]),
    }
}

/// The bodies at the ends of a range of a number, which is refused where one of them has no scene.
pub fn at_ends(
    scene: &Scene,
    key: &str,
    (low, high): (f64, f64),
) -> Result<[System; 2], ProblemError> {
    of_equations(scene, key)?;
    let still = without_start(scene)?;
    let at = |value| -> Result<System, ProblemError> {
        Ok(Problem::new(&still.with_number(key, value)?, None)?.system)
    };
    Ok([at(low)?, at(high)?])
}

/// What makes the system of a scene at a value of one of its numbers, which is `value` in the scene.
pub(super) fn systems(
    scene: &Scene,
    key: &str,
    value: f64,
) -> Result<impl FnMut(f64) -> Result<System, OrbitError> + use<>, OrbitError> {
    let still = without_start(scene).map_err(|e| OrbitError::Value(value, e.to_string()))?;
    let key = key.to_owned();
    Ok(move |value: f64| -> Result<System, OrbitError> {
        let refused = |text: String| OrbitError::Value(value, text.replace('\n', " "));
        let changed = still.with_number(&key, value).map_err(|e| refused(e.to_string()))?;
        Ok(Problem::new(&changed, None).map_err(|e| refused(e.to_string()))?.system)
    })
}
