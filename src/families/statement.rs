//! The error statement of a family of viscous orbits: the same orbits with half the viscosity, on coarser meshes, with the other discretisation of
//! the contact, with more modes.

use crate::contact::State;
use crate::continuation::Go;
use crate::orbit::search::{Effort, find};
use crate::orbit::viscous::{by_viscosity, pinned_mode};
use crate::orbit::{Closure, OrbitError, Pin, Propagator};
use crate::problem::Problem;
use crate::records::{Changed, ErrorStatement, PointKind, PointRecord, Variation};
use crate::scenario::{BodyKind, ContactMethod, Reduction, Scene, StressKey};

use super::FamilyError;
use super::viscous::Viscosity;

/// Orbits that are computed again.
const SAMPLES: usize = 5;

/// A family whose errors are asked for.
pub struct Judged<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its problem.
    pub problem: &'a Problem,
    /// Its viscosity.
    pub viscosity: &'a Viscosity,
    /// Its points.
    pub points: &'a [PointRecord],
}

/// A body with one thing changed.
struct Changing {
    changed: Changed,
    text: String,
    body: Propagator,
    pin: Pin,
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
        let base = Propagator::new(self.problem.system.clone()).map_err(OrbitError::from)?;
        for (k, changed) in Changed::ALL.into_iter().enumerate() {
            let Some(mut changing) = self.change(changed, &base)? else { continue };
            let mut energy = vec![];
            for (j, sample) in samples.iter().enumerate() {
                let done = (k as f64 + j as f64 / samples.len() as f64) / Changed::ALL.len() as f64;
                if tick(done, &changing.text).is_break() {
                    return Ok(None);
                }
                energy.push(changing.energy(&base, &self.points[*sample])?);
            }
            let Changing { changed, text, .. } = changing;
            statement.variations.push(Variation { changed, text, energy });
        }
        Ok(Some(statement))
    }

    /// Points that stand for the family: evenly over its orbits.
    fn samples(&self) -> Vec<usize> {
        let is_regular = |p: &PointRecord| {
            let kind = matches!(
                p.special,
                PointKind::Regular | PointKind::Start | PointKind::EndOfRange | PointKind::Jump
            );
            kind && p.orbit.is_some() && p.place.is_some()
        };
        let all: Vec<usize> =
            (0..self.points.len()).filter(|&k| is_regular(&self.points[k])).collect();
        let count = all.len().min(SAMPLES);
        let mut chosen: Vec<usize> =
            (0..count).map(|k| all[k * (all.len() - 1) / (count - 1).max(1)]).collect();
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
        let pin = self.viscosity.pin;
        if changed == Changed::HalfViscosity {
            let body = Propagator::new(self.problem.system.clone()).map_err(OrbitError::from)?;
            let pin = Pin { beta: 0.5 * pin.beta, ..pin };
            let text = format!("beta/2 = {:.4e}", pin.beta);
            return Ok(Some(Changing { changed, text, body, pin, same_mesh: true }));
        }
        let mut scene = self.scene.clone();
        scene.initial = Default::default();
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
        let named = scene.orbit.as_ref().and_then(|o| o.mode).map(|m| m - 1);
        let Some(mode) = named.filter(|m| *m < body.n()).or_else(|| pinned_mode(&body)) else {
            return Ok(None);
        };
        let pin = Pin::new(&body, mode, pin.beta);
        let same_mesh = !matches!(changed, Changed::HalfMesh | Changed::QuarterMesh);
        Ok(Some(Changing { changed, text, body, pin, same_mesh }))
    }
}

impl Changing {
    /// Energy of the orbit that belongs to a point of the family; not a number if none is found.
    fn energy(&mut self, base: &Propagator, point: &PointRecord) -> Result<f64, FamilyError> {
        let closure = Closure::Viscous(self.pin);
        let effort = Effort { multipliers: false, ..Effort::of(closure) };
        if let Some(place) = point.place.as_ref().filter(|_| self.same_mesh)
            && let [frame @ .., alpha, _] = &place.x[..]
        {
            let mut guess = self.moved(base, frame);
            guess.push(*alpha);
            let verdict = find(&mut self.body, closure, &guess, point.omega, &effort)?;
            if let Some(orbit) = verdict.orbit() {
                return Ok(orbit.energy);
            }
        }
        let found = by_viscosity(&mut self.body, self.pin, point.omega, &effort)?;
        Ok(found.as_ref().and_then(|v| v.orbit()).map_or(f64::NAN, |o| o.energy))
    }

    /// A frame vector of the family's body in the frame of this one, which has the same displacements.
    fn moved(&self, base: &Propagator, frame: &[f64]) -> Vec<f64> {
        let State { u, v } = base.state(frame);
        let (from, to) = (&base.system.body, &self.body.system.body);
        let moved = |x: &[f64]| to.coordinates(&from.nodal_o(x)).into_owned();
        self.body.frame(&State { u: moved(&u), v: moved(&v) })
    }
}

/// Elements divided, rounded; the modes of a reduction up to the same frequency.
fn coarser(scene: &mut Scene, by: usize, base: &Propagator) -> Option<String> {
    if matches!(scene.body.kind, BodyKind::Matrices | BodyKind::Mesh) {
        return None;
    }
    let divided: Vec<usize> =
        scene.body.elements.iter().map(|n| ((2 * n + by) / (2 * by)).max(1)).collect();
    if divided == scene.body.elements || divided[0] < 2 {
        return None;
    }
    let text: Vec<String> = divided.iter().map(usize::to_string).collect();
    scene.body.elements = divided;
    if scene.reduction.is_some() {
        let cutoff = base.system.body.reduction().and_then(|r| r.cutoff);
        scene.reduction = cutoff.map(|w| Reduction { modes: None, cutoff: Some(w) });
    }
    Some(format!("mesh of {} elements", text.join(" x ")))
}

/// Mass redistribution in place of the nodal boundary method, or the other way round.
fn other_contact(scene: &mut Scene) -> Option<String> {
    let matrices = scene.body.kind == BodyKind::Matrices;
    let contact = scene.contact.as_mut()?;
    let is_reaction = contact.is_reaction();
    let is_mesh = scene.body.kind == BodyKind::Mesh;
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

/// Half as many modes again.
fn more_modes(scene: &mut Scene, base: &Propagator) -> Option<String> {
    let reduction = base.system.body.reduction()?;
    reduction.cutoff?;
    let modes = (3 * reduction.modes).div_ceil(2);
    scene.reduction = Some(Reduction { modes: Some(modes), cutoff: None });
    Some(format!("{modes} modes"))
}
