//! Where families begin: how the orbits of a scene close, and guesses at the first one.

use crate::contact::{State, System};
use crate::hbm::newton::Settings;
use crate::hbm::viscous::Viscous;
use crate::orbit::branch::mode_guess;
use crate::orbit::{Closure, LARGE, Propagator};
use crate::problem::Problem;
use crate::scenario::{BodyKind, Change, Issue, Scene, SceneError};

/// What asks for periodic motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sought {
    /// Orbits, by shooting.
    Orbits,
    /// Series, by harmonic balance, and their check.
    Series,
    /// Viscous nonlinear modes.
    Viscous,
}

/// What the method that is asked for does not know: periodic motions with friction are those that a load or a moving surface keeps going.
pub fn check_sought(scene: &Scene, system: &System, what: Sought) -> Result<(), SceneError> {
    let Some(tangents) = system.tangents() else { return Ok(()) };
    if what != Sought::Orbits {
        check_with_mass(
            scene,
            system,
            "harmonic balance and viscous modes know no displacements that follow a memory",
        )?;
    }
    if what != Sought::Orbits && tangents.iter().flatten().any(|t| t.only_slips) {
        let message = "is that of a surface which slides along a body in space: harmonic balance might let it stick";
        let help = "take `signorini orbit`, or a response by shooting";
        return Err(scene.error(Issue::new(scene.friction_key(), message, help)));
    }
    let sliders = scene.all_sliders();
    let preloaded = sliders.iter().find(|s| s.preload != 0.0);
    if let Some(slider) = preloaded.filter(|_| what != Sought::Orbits) {
        let message = "is what one slider holds of a family of residual forces, and harmonic balance finds the member whose sliders began without";
        let help = "remove it, or take `signorini orbit`, which begins with it";
        return Err(scene.error(Issue::new(format!("{}.preload", slider.table), message, help)));
    }
    let carries = tangents.iter().flatten().any(|t| t.surface != 0.0);
    let is_kept = match what {
        Sought::Orbits => carries || system.loads.is_driven(),
        Sought::Series => system.loads.is_driven(),
        Sought::Viscous => false,
    };
    if is_kept {
        return Ok(());
    }
    let (message, help) = match what {
        Sought::Orbits => (
            "takes the energy of every motion that slips: without a load that changes in time, or a surface that moves, no orbit is left but rest",
            "give a [[load]] with omega, or contact.surface, or take `signorini run`",
        ),
        Sought::Series => (
            "lets no motion that stays without a load that changes in time: harmonic balance knows the period by the load's",
            "give a [[load]] with omega, or take `signorini orbit` for what a moving surface keeps going",
        ),
        Sought::Viscous => (
            "has modes that depend on the amplitude, and no viscosity to converge by",
            "give --amplitudes LOW,HIGH with --method hbm in place of --viscous (damped nonlinear modes), or a [[load]] with omega",
        ),
    };
    Err(scene.error(Issue::new(scene.friction_key(), message, help)))
}

/// What is not known where displacements along obstacles have no mass.
pub fn check_with_mass(scene: &Scene, system: &System, why: &str) -> Result<(), SceneError> {
    if !system.creeps() {
        return Ok(());
    }
    let key = scene.contact.as_ref().map_or(String::new(), |c| c.key(0, "tangent"));
    let message = format!("\"massless\" is for run, orbits and responses by shooting: {why}");
    Err(scene.error(Issue::new(key, message, "give tangent = \"inertia\"")))
}

/// Orbits and harmonic balance are those of forces with a potential, and of velocities that do not jump.
pub(super) fn check_method(scene: &Scene, system: &System) -> Result<(), SceneError> {
    if !system.has_potential() && system.tangents().is_none() {
        let message = "is for run alone: its forces have no potential, motions gain or lose energy at every contact, and there are no families of orbits";
        return Err(scene.error(Issue::new("contact.theta", message, "give theta = 1")));
    }
    let Some(law) = system.impact() else { return Ok(()) };
    if law.march.is_some() {
        let message = "is for run alone: what goes through time in its own way is not shot";
        let help = "give method = \"impact\", \"nbm\", \"mass-redistribution\", \"penalty\" or \"nitsche\"";
        return Err(scene.error(Issue::new("contact.method", message, help)));
    }
    let e = law.restitution;
    if e > 0.0 && e < 1.0 {
        let message = format!(
            "is {e}: rebounds accumulate, and no tangent of a motion passes an accumulation"
        );
        let help = "give 1, or 0 with a [[load]]; or run";
        return Err(scene.error(Issue::new("contact.restitution", message, help)));
    }
    if e == 0.0 && !system.loads.is_driven() {
        let message = "is 0: every impact takes energy, and without a load no motion that touches is periodic";
        let help = "give 1, or a [[load]] with omega";
        return Err(scene.error(Issue::new("contact.restitution", message, help)));
    }
    Ok(())
}

/// Modes of a reduction that no scene asked for.
const MODES: usize = 100;

/// The scene with a reduction, and that in words, where the body has too many displacements for the modes of every phase and the scene says nothing of it.
pub fn reduced_if_large(
    scene: &Scene,
    system: &System,
) -> Result<Option<(Scene, String)>, SceneError> {
    let is_small = system.n_o() <= LARGE;
    let keeps_all =
        system.impact().is_some() || system.remembers() || scene.body.kind == BodyKind::Matrices;
    if is_small || keeps_all || scene.reduction.is_some() {
        return Ok(None);
    }
    // modes of the open body have statics where something holds it beside its contact
    let (kind, what) = match system.body.rigid_motions(true).is_empty() {
        true => ("free-interface", "of the open body and the statics of its contact"),
        false => ("fixed-interface", "of the body whose contact is held, and its contact"),
    };
    let text = format!(
        "{} displacements move by themselves: reduced to {MODES} modes {what}, as by [reduction] with kind = \"{kind}\", modes = {MODES} in the scene",
        system.n_o()
    );
    let kind = Change::set("reduction.kind", kind);
    let reduced = scene.with(&[kind, Change::set("reduction.modes", MODES.to_string())])?;
    Ok(Some((reduced, text)))
}

/// How periodic motions of a scene close.
pub fn closure(scene: &Scene, problem: &Problem) -> Result<Closure, SceneError> {
    let system = &problem.system;
    let fail =
        |key: &str, message: &str, help: &str| Err(scene.error(Issue::new(key, message, help)));
    if system.n_contact() == 0 {
        return fail(
            "contact",
            "is missing: orbits are those of a body in contact, or on sliders",
            "add [contact], or a [[slider]]",
        );
    }
    if let Some(i) = scene.loads.iter().position(|l| l.table.is_some()) {
        return fail(
            &format!("load[{i}].table"),
            "a measured history has no period: it is for run",
            "give omega in its place",
        );
    }
    check_method(scene, system)?;
    check_sought(scene, system, Sought::Orbits)?;
    let mut frequencies = system.loads.harmonics.iter().map(|h| h.omega);
    if let Some(first) = frequencies.next() {
        if frequencies.any(|w| w != first) {
            let gap = scene.contact.as_ref().filter(|c| c.swings()).map(|c| c.key(0, "gap"));
            let (key, message, help) = match &gap {
                Some(gap) => (
                    gap.as_str(),
                    "orbits are sought under one frequency, and the gap and the loads have several",
                    "give the gap and all loads one frequency",
                ),
                None => (
                    "load",
                    "harmonic loads of different frequencies have no common period",
                    "give all loads one omega",
                ),
            };
            return fail(key, message, help);
        }
        return Ok(Closure::FORCED);
    }
    if system.tangents().is_some() {
        return Ok(Closure::Limit);
    }
    if system.is_damped() {
        let key = scene.damping_key();
        return fail(
            key,
            "without a harmonic load a damped body has no periodic motion but rest",
            "remove it for a backbone, or add a [[load]] with omega",
        );
    }
    let moving = problem.initial.v.iter().any(|v| *v != 0.0);
    Ok(if moving { Closure::Autonomous } else { Closure::Reversible })
}

/// Harmonics of a series that an orbit is shot from.
const HARMONICS: usize = 15;

/// Amplitudes of the first mode over grazing, on the side away from the obstacle.
const AMPLITUDES: [f64; 7] = [-1.1, -1.2, -1.05, -1.4, -1.7, -2.2, -3.0];

fn is_given(scene: &Scene) -> bool {
    let s = &scene.initial;
    s.mode.is_some() || s.file.is_some() || s.displacement.is_some() || s.velocity.is_some()
}

/// The scene's initial state as a frame vector, if it has one.
pub fn given(scene: &Scene, initial: &State, body: &Propagator) -> Vec<Vec<f64>> {
    is_given(scene).then(|| body.frame(initial)).into_iter().collect()
}

/// Guesses at an orbit: the scene's initial state, or the first mode of the open body beyond grazing.
pub fn guesses(
    scene: &Scene,
    initial: &State,
    body: &Propagator,
    closure: Closure,
    omega: f64,
) -> Vec<Vec<f64>> {
    let given = is_given(scene);
    let unknowns = closure.unknowns(body.n());
    let mut list = vec![];
    if let Closure::Viscous(pin) = closure {
        list.extend(given.then(|| pin.unknowns(body.frame(initial))));
        list.extend(pin.guesses(body, omega));
    } else if given {
        list.push(body.frame(initial)[..unknowns].to_vec());
    } else if closure.is_forced() {
        list.push(body.linear_response());
        list.push(vec![0.0; unknowns]);
    } else {
        list.extend(of_first_mode(body, unknowns));
    }
    list
}

/// Unknowns `(z, α)` of a viscous nonlinear mode as harmonic balance finds it: Newton's method on a series comes from further away than on the map.
pub(super) fn by_series(body: &Propagator, closure: Closure, omega: f64) -> Option<Vec<f64>> {
    let Closure::Viscous(pin) = closure else { return None };
    // contact stiffens a body, but for one that is told around a state in contact
    if omega < pin.omega && body.system.rest().is_none() {
        return None;
    }
    let mut viscous = Viscous::new(body.system.clone(), pin).ok()?;
    let fed = viscous.from_mode(HARMONICS, omega, &Settings::default()).ok()?.ok()?;
    let mut z = body.frame(&viscous.state(&fed).ok()?);
    z.push(fed.alpha);
    Some(z)
}

/// The first mode of the open body at several amplitudes beyond grazing.
pub(crate) fn of_first_mode(body: &Propagator, unknowns: usize) -> Vec<Vec<f64>> {
    let resized = |mut z: Vec<f64>| {
        z.resize(unknowns, 0.0);
        z
    };
    AMPLITUDES.iter().filter_map(|&a| mode_guess(body, 1, a)).map(resized).collect()
}
