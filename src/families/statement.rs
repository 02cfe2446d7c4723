//! The error statement of a family: the same orbits with half the viscosity, on coarser meshes, with the other discretisation of the contact, with more modes.

use crate::contact::State;
use crate::continuation::Go;
use crate::orbit::along::section_of;
use crate::orbit::search::{Effort, find};
use crate::orbit::section::at_origin;
use crate::orbit::viscous::{by_viscosity, pinned_mode};
use crate::orbit::{Closure, OrbitError, Pin, Propagator};
use crate::problem::Problem;
use crate::records::{Changed, ErrorStatement, PlaceRecord, PointKind, PointRecord, Variation};
use crate::scenario::{
    BodyKind, ContactMethod, Elements, Initial, Reduction, Scene, SidesKey, StressKey,
};

use super::FamilyError;

/// Orbits that are computed again.
const SAMPLES: usize = 5;

/// A family whose errors are asked for.
pub struct Judged<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its problem.
    pub problem: &'a Problem,
    /// How its orbits close: the viscous ones of a pin, or forced ones.
    pub closure: Closure,
    /// Its points.
    pub points: &'a [PointRecord],
    /// The branch that alone is of this body; none: all are.
    pub branch: Option<usize>,
}

/// A body with one thing changed.
struct Changing {
    changed: Changed,
    text: String,
    body: Propagator,
    closure: Closure,
    /// Whether it has the same displacements.
    same_mesh: bool,
}

impl Judged<'_> {
    /// Compute the statement; `tick` hears the share that is done and what comes next. None if it was stopped, or if the family has no orbit.
    pub fn statement(
        &self,
        mut tick: impl FnMut(f64, &str) -> Go,
    ) -> Result<Option<ErrorStatement>, FamilyError> {
        let samples = self.samples();
        let mut statement = self.outline(&samples);
        if samples.is_empty() {
            return Ok(None);
        }
        let mut base = Propagator::new(self.problem.system.clone()).map_err(OrbitError::from)?;
        let all = match self.closure {
            Closure::Viscous(_) => &Changed::ALL[..],
            _ => &[Changed::MoreModes],
        };
        for (k, &changed) in all.iter().enumerate() {
            let Some(mut changing) = self.change(changed, &base)? else { continue };
            let mut energy = vec![];
            for (j, sample) in samples.iter().enumerate() {
                let done = (k as f64 + j as f64 / samples.len() as f64) / all.len() as f64;
                if tick(done, &changing.text).is_break() {
                    return Ok(None);
                }
                energy.push(changing.energy(&mut base, &self.points[*sample])?);
            }
            let Changing { changed, text, .. } = changing;
            statement.variations.push(Variation { changed, text, energy });
        }
        Ok(Some(statement))
    }

    /// Points that stand for the family: evenly over its orbits, and where the energy is largest.
    fn samples(&self) -> Vec<usize> {
        let is_regular = |p: &PointRecord| {
            let kind = matches!(
                p.special,
                PointKind::Regular | PointKind::Start | PointKind::EndOfRange | PointKind::Jump
            );
            let is_of_body = self.branch.is_none_or(|b| p.branch == b);
            kind && is_of_body && p.orbit.is_some() && p.place.is_some()
        };
        let all: Vec<usize> =
            (0..self.points.len()).filter(|&k| is_regular(&self.points[k])).collect();
        let count = all.len().min(SAMPLES);
        let energy = |k: usize| self.points[k].energy();
        let largest = all.iter().copied().max_by(|a, b| energy(*a).total_cmp(&energy(*b)));
        let mut chosen: Vec<usize> =
            (0..count).map(|k| all[k * (all.len() - 1) / (count - 1).max(1)]).collect();
        chosen.extend(largest.filter(|k| !chosen.contains(k)));
        chosen.sort_by(|&a, &b| self.points[a].omega.total_cmp(&self.points[b].omega));
        chosen
    }

    /// The statement before anything is changed.
    fn outline(&self, samples: &[usize]) -> ErrorStatement {
        let of = |k: usize| {
            (self.points[k].omega, self.points[k].orbit.as_ref().map_or(f64::NAN, |o| o.energy))
        };
        let slope = |&k: &usize| {
            let neighbour = |step: i64| {
                let p = &self.points[k];
                let other = self
                    .points
                    .iter()
                    .position(|q| q.branch == p.branch && q.index == p.index + step);
                other.map(of).filter(|(_, e)| e.is_finite())
            };
            let (a, b) = (neighbour(-1).unwrap_or(of(k)), neighbour(1).unwrap_or(of(k)));
            (b.1 - a.1) / (b.0 - a.0)
        };
        let (omega, energy) = samples.iter().map(|&k| of(k)).unzip();
        ErrorStatement {
            omega,
            energy,
            slope: samples.iter().map(slope).collect(),
            variations: vec![],
        }
    }

    /// The body with one thing changed; none where that is not possible.
    fn change(&self, changed: Changed, base: &Propagator) -> Result<Option<Changing>, FamilyError> {
        if changed == Changed::HalfViscosity {
            let Closure::Viscous(pin) = self.closure else { return Ok(None) };
            let body = Propagator::new(self.problem.system.clone()).map_err(OrbitError::from)?;
            let pin = Pin { beta: 0.5 * pin.beta, ..pin };
            let text = format!("beta/2 = {:.4e}", pin.beta);
            let closure = Closure::Viscous(pin);
            return Ok(Some(Changing { changed, text, body, closure, same_mesh: true }));
        }
        let mut scene = self.scene.clone();
        // what the family is told around stays
        let equilibrium = scene.initial.equilibrium;
        scene.initial = Initial { equilibrium, ..Initial::default() };
        let text = match changed {
            Changed::HalfMesh => coarser(&mut scene, 2, base),
            Changed::QuarterMesh => coarser(&mut scene, 4, base),
            Changed::OtherContact => other_contact(&mut scene),
            _ => more_modes(&mut scene, base),
        };
        let Some(text) = text else { return Ok(None) };
        // a mesh may be too coarse for the contact conditions
        let Ok(problem) = Problem::new(&scene, None) else { return Ok(None) };
        let body = Propagator::new(problem.system).map_err(OrbitError::from)?;
        let closure = match self.closure {
            Closure::Viscous(pin) => {
                let named = scene.orbit.as_ref().and_then(|o| o.mode).map(|m| m - 1);
                let Some(mode) = named.filter(|m| *m < body.n()).or_else(|| pinned_mode(&body))
                else {
                    return Ok(None);
                };
                Closure::Viscous(Pin::new(&body, mode, pin.beta))
            }
            closure => closure,
        };
        let same_mesh = !matches!(changed, Changed::HalfMesh | Changed::QuarterMesh);
        Ok(Some(Changing { changed, text, body, closure, same_mesh }))
    }
}

impl Changing {
    /// Energy of the orbit that belongs to a point of the family; not a number if none is found.
    fn energy(&mut self, base: &mut Propagator, point: &PointRecord) -> Result<f64, FamilyError> {
        let effort = Effort { multipliers: false, ..Effort::of(self.closure) };
        if let Some(place) = point.place.as_ref().filter(|_| self.same_mesh)
            && let Some(guess) = self.guess(base, place, point.omega)?
        {
            let verdict = find(&mut self.body, self.closure, &guess, point.omega, &effort)?;
            if let Some(orbit) = verdict.orbit() {
                return Ok(orbit.energy);
            }
        }
        let Closure::Viscous(pin) = self.closure else { return Ok(f64::NAN) };
        let found = by_viscosity(&mut self.body, pin, point.omega, &effort)?;
        Ok(found.as_ref().and_then(|v| v.orbit()).map_or(f64::NAN, |o| o.energy))
    }

    /// The unknowns of this body near a place of the family.
    fn guess(
        &self,
        base: &mut Propagator,
        place: &PlaceRecord,
        omega: f64,
    ) -> Result<Option<Vec<f64>>, FamilyError> {
        // behind the state α, if there is one, then the times of switches, if they are unknowns
        let (_, of_state) = self.closure.sizes(base.n());
        let Some((frame, rest)) = place.x.split_at_checked(of_state) else { return Ok(None) };
        Ok(match (self.closure, rest) {
            (Closure::Viscous(_), [alpha, ..]) => {
                self.moved(base, frame).map(|z| [&z, &[*alpha][..]].concat())
            }
            (Closure::Forced(periods), _) => {
                base.system.loads_mut().set_frequency(omega);
                let z = at_origin(base, frame, omega, (section_of(place), periods))?;
                self.moved(base, &z)
            }
            _ => None,
        })
    }

    /// A frame vector of the family's body in the frame of this one; none where only one of them has the displacements of the contact among its unknowns.
    fn moved(&self, base: &Propagator, frame: &[f64]) -> Option<Vec<f64>> {
        let (from, to) = (&base.system.body, &self.body.system.body);
        if from.nodal_dofs().n_o != to.nodal_dofs().n_o {
            return None;
        }
        let State { u, v } = base.state(frame);
        let moved = |x: &[f64]| to.coordinates(&from.nodal_o(x)).into_owned();
        Some(self.body.frame(&State { u: moved(&u), v: moved(&v) }))
    }
}

/// Elements divided, rounded; the modes of a reduction up to the same frequency.
fn coarser(scene: &mut Scene, by: usize, base: &Propagator) -> Option<String> {
    if !scene.has_elements_of_choice() {
        return None;
    }
    let divided = Elements::of(scene).divided(by)?;
    let text = format!("mesh of {divided} elements");
    divided.put(scene);
    if scene.reduction.is_some() {
        let cutoff = base.system.body.reduction().and_then(|r| r.cutoff);
        let kind = scene.reduction.map_or_else(Default::default, |r| r.kind);
        scene.reduction = cutoff.map(|w| Reduction { kind, modes: None, cutoff: Some(w) });
    }
    Some(text)
}

/// Mass redistribution in place of the nodal boundary method, or the other way round; where surfaces meet the inertia of one side, or of both.
pub(crate) fn other_contact(scene: &mut Scene) -> Option<String> {
    let matrices = scene.body.kind == BodyKind::Matrices;
    let contact = scene.contact.as_mut()?;
    if contact.has_pairs() {
        let (sides, text) = match contact.sides.unwrap_or_default() {
            SidesKey::Both => (SidesKey::Slave, "sides = \"slave\""),
            SidesKey::Slave => (SidesKey::Both, "sides = \"both\""),
        };
        contact.sides = Some(sides);
        return Some(text.into());
    }
    let is_reaction = contact.is_reaction();
    let is_mesh = scene.body.kind.has_groups();
    // given matrices have a boundary operator, or have not
    if is_reaction && matrices {
        return None;
    }
    (contact.inertia, contact.mass) = (None, None);
    (contact.n_c, contact.n_o) = (None, None);
    if is_reaction {
        contact.method = ContactMethod::NodalBoundary;
        contact.stress = (!is_mesh).then_some(StressKey::Projection);
        return Some("nodal boundary method".into());
    }
    contact.method = ContactMethod::MassRedistribution;
    contact.stress = None;
    Some("mass redistribution".into())
}

/// Twice as many modes.
fn more_modes(scene: &mut Scene, base: &Propagator) -> Option<String> {
    let reduction = base.system.body.reduction()?;
    reduction.cutoff?;
    let modes = 2 * reduction.modes;
    let kind = scene.reduction?.kind;
    scene.reduction = Some(Reduction { kind, modes: Some(modes), cutoff: None });
    Some(format!("{modes} modes"))
}
