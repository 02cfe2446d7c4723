//! The state at `t = 0`.

use super::modes::OpenModes;
use super::moving;
use super::notes::Notes;
use super::parts::parts;
use super::places::place;
use super::{ProblemError, StoredState};
use crate::contact::{March, NoEquilibrium, State, States, System, phase_modes};
use crate::scenario::{BodyKind, Components, Field, Issue, Scene};

pub(super) fn initial_state(
    scene: &Scene,
    system: &System,
    modes: &OpenModes,
    stored: Option<StoredState>,
    notes: &mut Notes,
) -> Result<State, ProblemError> {
    let s = &scene.initial;
    let n_o = system.n_o();
    let dofs = &system.body.dofs;
    if let (Some(mode), Some(amplitude), true) = (s.mode, s.amplitude, s.equilibrium) {
        return mode_at_rest(scene, system, (mode, amplitude));
    }
    if let (Some(mode), Some(amplitude)) = (s.mode, s.amplitude) {
        let (_, mut shape) = modes.get(scene, "initial.mode", mode, system)?;
        let Some((lead, leading)) = leading(system, &shape) else {
            let message = format!(
                "mode {mode} does not move the contact edge: it cannot be scaled by the gap"
            );
            let help = "choose another mode, or give displacement = [\"…\"]";
            return Err(scene.error(Issue::new("initial.mode", message, help)).into());
        };
        let unit = system.constraints.get(lead).map_or(1.0, |c| c.gap);
        let scale = amplitude * unit / leading;
        shape.iter_mut().for_each(|x| *x *= scale);
        check_penetration(scene, system, "initial.amplitude", &shape).map_err(|e| {
            // what this shape allows at each obstacle
            let along = system.along_normals(&shape);
            let limits = along.iter().zip(&system.constraints).map(|(u, c)| amplitude * c.gap / u);
            let (above, below): (Vec<f64>, Vec<f64>) =
                limits.filter(|x| x.is_finite()).partition(|x| *x > 0.0);
            let high = above.into_iter().fold(f64::INFINITY, f64::min);
            let low = below.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let still = moving::frame(scene, system).is_none();
            match still && system.facing().iter().all(|c| c.gap > 0.0) {
                true => {
                    let message = format!(
                        "the initial state penetrates the obstacle: mode {mode} by {amplitude} gaps"
                    );
                    let help = format!("give an amplitude from {low:.6} to {high:.6}");
                    scene.error(Issue::new("initial.amplitude", message, help)).into()
                }
                false => e,
            }
        })?;
        return Ok(State { u: shape[..n_o].to_vec(), v: vec![0.0; n_o] });
    }
    if stored.is_some() && system.remembers() {
        let message = "holds displacements of nodes, and not what springs of sliders remember";
        let help = "start from rest, or go on with the run itself: signorini run --resume";
        return Err(scene.error(Issue::new("initial.file", message, help)).into());
    }
    if let Some((u, v)) = stored {
        let (u, v) = (dofs.gather(&u), dofs.gather(&v));
        // steps enter the obstacle by what they move in one, and stay there until they leave
        let steps = system.impact().is_some_and(|law| matches!(law.march, Some(March::Steps(_))));
        if !steps {
            check_penetration(scene, system, "initial.file", &u)?;
        }
        return Ok(State { u: u[..n_o].to_vec(), v: v[..n_o].to_vec() });
    }
    let at_rest = match system.rest() {
        Some(rest) => Some(rest.u.clone()),
        None if s.equilibrium => {
            Some(system.equilibrium().map_err(|e| no_equilibrium(scene, &e))?.1)
        }
        None => None,
    };
    let mut field = |key: &str, order: usize, given: &Option<Components>| {
        let Some(given) = given else { return Ok::<_, ProblemError>(vec![0.0; system.n()]) };
        let nodal = nodal_field(scene, system, key, given)?;
        if scene.body.kind != BodyKind::Matrices {
            notes.held_field((scene, system), (key, order), &nodal);
        }
        Ok(dofs.gather(&nodal))
    };
    let u = field("initial.displacement", 0, &s.displacement)?;
    let v = field("initial.velocity", 1, &s.velocity)?;
    if s.displacement.is_some() {
        check_penetration(scene, system, "initial.displacement", &u)?;
    } else if system.impact().is_some() && at_rest.is_none() {
        // contact displacements do not follow: the undeformed body may stand inside the obstacle
        check_penetration(scene, system, "contact.gap", &u)?;
    }
    if let Some(u) = at_rest {
        return Ok(State { u, v: v[..n_o].to_vec() });
    }
    Ok(State { u: u[..n_o].to_vec(), v: v[..n_o].to_vec() })
}

/// The contact displacement of largest magnitude of a shape, with its point; the largest displacement of a body without contact. None where it is zero beside the others.
fn leading(system: &System, shape: &[f64]) -> Option<(usize, f64)> {
    let mut of_contact = system.along_normals(shape);
    // obstacles behind count the same displacements once more
    of_contact.truncate(system.conditions().facing());
    let moved = if of_contact.is_empty() { shape } else { &of_contact };
    let lead = (0..moved.len()).max_by(|&a, &b| moved[a].abs().total_cmp(&moved[b].abs()))?;
    let largest = shape.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    (moved[lead].abs() >= 1e-9 * largest).then(|| (lead, moved[lead]))
}

/// A mode by which states are told.
#[derive(Debug, Clone)]
pub struct ModeShape {
    /// Its circular frequency; of a rigid motion the body's unit of frequency.
    pub omega: f64,
    /// Displacements `u_O` of amplitude one: where the first contact point grazes, or the first one opens or closes on the way from an equilibrium; where that is the state itself, its largest contact
    /// displacement is 1.
    pub u: Vec<f64>,
}

/// Modes, from 1, by which the states of a scene are told, and the state that they are told around: rest, or the equilibrium.
pub fn mode_shapes(
    system: &System,
    modes: &[usize],
) -> Result<(State, Vec<ModeShape>), ProblemError> {
    let n_o = system.n_o();
    let count = modes.iter().copied().max().unwrap_or(0);
    let (set, around) = match system.rest() {
        Some(rest) => (rest.set.clone(), rest.u.clone()),
        None => (States::open(system.n_contact()), vec![0.0; n_o]),
    };
    let phase = system.phase(&set);
    let found = phase_modes(system, &phase, count.min(n_o))?;
    let no_such = |mode: usize, message: String| {
        let help = format!("there are the modes 1 to {n_o}");
        ProblemError::Mode { mode, message, help }
    };
    let shape = |&mode: &usize| -> Result<ModeShape, ProblemError> {
        let index = mode.checked_sub(1).filter(|k| *k < found.shapes.len());
        let index = index.ok_or_else(|| no_such(mode, "does not exist".into()))?;
        let shape = &found.shapes[index];
        let scale = match system.first_switch(shape).filter(|x| x.is_finite() && *x != 0.0) {
            Some(scale) => scale,
            None => {
                let mut full = vec![0.0; system.n()];
                phase.expand(shape, &mut full);
                let message = "does not move the contact: its amplitude has no unit";
                1.0 / leading(system, &full).ok_or_else(|| no_such(mode, message.into()))?.1
            }
        };
        let omega = found.omega[index];
        Ok(ModeShape {
            omega: if omega > 0.0 { omega } else { system.body.frequency_unit() },
            u: shape.iter().map(|x| scale * x).collect(),
        })
    };
    let shapes = modes.iter().map(shape).collect::<Result<_, _>>()?;
    Ok((State { u: around, v: vec![0.0; n_o] }, shapes))
}

/// Refuse an equilibrium of forces that have no potential.
pub(super) fn check_potential(scene: &Scene, system: &System) -> Result<(), ProblemError> {
    if system.has_potential() {
        return Ok(());
    }
    let message = "is that of forces with a potential, and those of theta other than 1 have none";
    let help = "give theta = 1, or displacement = [\"…\"]";
    Err(scene.error(Issue::new("initial.equilibrium", message, help)).into())
}

/// The equilibrium with a mode of its phase added.
fn mode_at_rest(
    scene: &Scene,
    system: &System,
    (mode, amplitude): (usize, f64),
) -> Result<State, ProblemError> {
    let refuse = |key: &str, message: String, help: &str| {
        Err(scene.error(Issue::new(key, message, help)).into())
    };
    let Some(rest) = system.rest() else {
        let message = "mixes mode and equilibrium: with friction an equilibrium is one of a family, and where velocities jump its phase has no modes of its own";
        let help = "give velocity with equilibrium, or backbone --method hbm --amplitudes LOW,HIGH";
        return refuse("initial", message.into(), help);
    };
    let modes = phase_modes(system, &system.phase(&rest.set), mode)?;
    let Some(shape) = modes.shapes.get(mode - 1) else {
        let message = format!("mode {mode} does not exist: there are {}", system.n_o());
        return refuse("initial.mode", message, "give a lower one");
    };
    let Some(scale) = rest.first_switch(system, shape) else {
        let message = format!("mode {mode} opens and closes nothing: it has no first switch");
        return refuse("initial.mode", message, "choose another mode");
    };
    let u: Vec<f64> = rest.u.iter().zip(shape).map(|(u, x)| u + amplitude * scale * x).collect();
    let v = vec![0.0; u.len()];
    Ok(State { u, v })
}

/// Refuse a scene that asks for an equilibrium and has none.
pub(super) fn no_equilibrium(scene: &Scene, why: &NoEquilibrium) -> ProblemError {
    let help = "give other constant loads, or displacement = [\"…\"]";
    scene.error(Issue::new("initial.equilibrium", why.to_string(), help)).into()
}

/// The values of a field at all nodes, components interleaved.
fn nodal_field(
    scene: &Scene,
    system: &System,
    key: &str,
    given: &Components,
) -> Result<Vec<f64>, ProblemError> {
    let mesh = &system.body.mesh;
    let parts = parts(scene, mesh);
    let mut lists: Vec<Option<&[Field]>> = vec![None; parts.names.len()];
    for (name, list) in given.lists() {
        match name {
            None => lists.fill(Some(list)),
            Some(name) => match parts.called(name) {
                Some(part) => lists[part] = Some(list),
                None => {
                    let message = format!("no body is called \"{name}\"");
                    let help = format!("there are \"{}\"", parts.names.join("\", \""));
                    let key = format!("{key}.{name}");
                    return Err(scene.error(Issue::new(key, message, help)).into());
                }
            },
        }
    }
    let of_node = |(n, p): (usize, &crate::mesh::Point)| -> Vec<f64> {
        match lists[parts.of_node[n]] {
            Some(list) => list.iter().map(|f| f.at(*p)).collect(),
            None => vec![0.0; mesh.dim()],
        }
    };
    let nodal: Vec<f64> = mesh.nodes().iter().enumerate().flat_map(of_node).collect();
    // squares must not overflow
    if nodal.iter().any(|x| x.is_nan() || x.abs() > 1e60) {
        let message = "is not finite, or beyond 1e60, at a node";
        return Err(scene.error(Issue::new(key, message, "check the expression")).into());
    }
    Ok(nodal)
}

pub(super) fn check_penetration(
    scene: &Scene,
    system: &System,
    key: &str,
    u: &[f64],
) -> Result<(), ProblemError> {
    // an obstacle of springs may be entered
    if system.promise().yields {
        return Ok(());
    }
    let moved = moving::frame(scene, system);
    let moved = moved.map(|[u, _]| system.along_normals(&u));
    let start = |i: usize| moved.as_ref().map_or(0.0, |u| u[i]);
    let along = system.along_normals(u);
    let excess = |i: usize| along[i] - start(i) - system.constraints[i].gap;
    let Some(worst) = (0..system.n_contact()).max_by(|&a, &b| excess(a).total_cmp(&excess(b)))
    else {
        return Ok(());
    };
    let scale = u.iter().fold(system.units.length, |m, x| m.max(x.abs()));
    if excess(worst) <= 1e-9 * scale {
        return Ok(());
    }
    let node = system.constraints[worst].node;
    let at = match scene.body.kind {
        // the points of such a body count from 1, its displacements from 0
        BodyKind::Matrices => format!("displacement {}", node.saturating_sub(1)),
        _ => format!("the node {}", place(system.body.mesh.nodes()[node], scene.dim())),
    };
    let message =
        format!("the initial state penetrates the obstacle by {:.6e} at {at}", excess(worst));
    Err(scene
        .error(Issue::new(key, message, "give a state with u·n ≤ gap on the contact edge"))
        .into())
}
