//! Bifurcation diagrams over a number of the scene: sweeps at one frequency.

use super::FamilyError;
use super::parameters::systems;
use super::start::given;
use super::sweep::{At, Ground, settled_or_not, walk};
use crate::continuation::Go;
use crate::orbit::OrbitError;
use crate::orbit::attractor::Attractor;
use crate::orbit::values::Bodies;
use crate::problem::Problem;
use crate::records::{Diagram, DiagramRow, PointKind};
use crate::scenario::Scene;

/// Told of what is known after each row.
pub type Take<'a> = &'a mut dyn FnMut(&Diagram) -> Result<Go, FamilyError>;

/// The body at one value after the other.
struct Values<'a, 'b> {
    bodies: Bodies<'a>,
    falls: bool,
    diagram: &'b mut Diagram,
    take: Take<'b>,
}

impl Ground for Values<'_, '_> {
    fn settle(&mut self, z: &[f64], value: f64) -> Result<Attractor, FamilyError> {
        let omega = self.diagram.omega;
        let z = self.bodies.in_body(value, z)?;
        let body = self.bodies.body(value)?;
        let mut found = settled_or_not(body, &z, omega, self.diagram.dwell)?;
        found.z = self.bodies.out_of_body(value, &found.z)?;
        Ok(found)
    }

    fn take(&mut self, at: &At, special: PointKind, goes_on: bool) -> Result<Go, FamilyError> {
        let At { place: value, found } = at;
        self.diagram.rows.push(DiagramRow {
            value: *value,
            falls: self.falls,
            special,
            seen: found.seen.clone(),
            x: found.z.clone(),
            goes_on,
        });
        (self.take)(self.diagram)
    }
}

/// What is missing of a diagram, upwards, downwards, or both: each from the scene's own state, or from rest. Whether it came to its end.
pub fn follow(
    (scene, problem): (&Scene, &Problem),
    diagram: &mut Diagram,
    directions: &[bool],
    take: Take,
) -> Result<Go, FamilyError> {
    let value = scene.number(&diagram.key);
    let value = value.map_err(|e| OrbitError::Value(f64::NAN, e.to_string()))?;
    // what stands between values of the grid behind the last of them is found again
    let last = diagram.rows.iter().rposition(|row| row.goes_on);
    diagram.rows.truncate(last.map_or(0, |k| k + 1));
    for &falls in directions {
        let mut make = systems(scene, &diagram.key, value)?;
        let bodies = Bodies::new(&mut make, value, 1)?;
        let z = given(scene, &problem.initial, &bodies.frame).pop();
        let first = z.unwrap_or_else(|| vec![0.0; 2 * bodies.frame.n()]);
        let before = diagram.walk(falls).last().map(|row| At {
            place: row.value,
            found: Attractor { seen: row.seen.clone(), orbit: None, z: row.x.clone() },
        });
        let is_left = |v: &f64| match &before {
            Some(b) if falls => *v < b.place,
            Some(b) => *v > b.place,
            None => true,
        };
        let left: Vec<f64> = diagram.values(falls).into_iter().filter(is_left).collect();
        let closes_in = diagram.dwell.is_none();
        let mut ground = Values { bodies, falls, diagram, take: &mut *take };
        let go = walk(&mut ground, &left, (&first, before), closes_in)?;
        if go.is_break() {
            return Ok(go);
        }
    }
    Ok(Go::Continue(()))
}
