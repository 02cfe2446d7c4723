//! Gaps that a scene gives, at places of the edge.

use super::ProblemError;
use super::places::place;
use crate::mesh::Point;
use crate::scenario::{Field, Issue, Scene};

/// There is room between an obstacle in front and one behind.
pub(super) fn check_way(scene: &Scene, key: &str, way: f64) -> Result<(), ProblemError> {
    if way > 0.0 {
        return Ok(());
    }
    let message = format!("leaves no room: the way from one obstacle to the other is {way:e}");
    Err(scene.error(Issue::new(key, message, "give gap + gap_behind > 0")).into())
}

/// The gaps of an obstacle at places of its group.
pub(super) fn gaps_to(
    scene: &Scene,
    obstacle: usize,
    places: impl Iterator<Item = Point> + Clone,
) -> Result<Vec<f64>, ProblemError> {
    let Some(c) = &scene.contact else { return Ok(vec![]) };
    match (&c.obstacles[obstacle].gap, &c.obstacles[obstacle].plane) {
        (Some(field), _) => gaps_at(scene, &c.key(obstacle, "gap"), field, places),
        (None, Some(plane)) => {
            let along = |p: Point| plane.normal.iter().zip(p).map(|(n, x)| n * x).sum::<f64>();
            Ok(places.map(|p| (plane.offset - along(p)) / plane.scale()).collect())
        }
        (None, None) => Ok(vec![]),
    }
}

/// A gap at places of the edge.
pub(super) fn gaps_at(
    scene: &Scene,
    key: &str,
    field: &Field,
    places: impl Iterator<Item = Point> + Clone,
) -> Result<Vec<f64>, ProblemError> {
    let gap: Vec<f64> = places.clone().map(|p| field.at(p)).collect();
    // squares of gaps must not overflow
    let wrong = gap.iter().zip(places).find(|(g, _)| g.is_nan() || g.abs() > 1e60);
    if let Some((gap, p)) = wrong {
        let message = format!("is {gap:e} at {}", place(p, scene.dim().max(2)));
        let help = "give an expression of at most 1e60 on the whole edge";
        return Err(scene.error(Issue::new(key, message, help)).into());
    }
    Ok(gap)
}
