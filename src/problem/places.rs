//! Places on the body: in words, and the nodes that they name.

use super::ProblemError;
use crate::mesh::point::{minus, norm};
use crate::mesh::{Mesh, Point, bounds};
use crate::scenario::{Issue, Scene};

/// A place in words: `(1, 0.5)`, `(1, 0.5, 0)` in space.
pub(super) fn place(p: Point, dim: usize) -> String {
    let numbers: Vec<String> = p[..dim.max(2)].iter().map(f64::to_string).collect();
    format!("({})", numbers.join(", "))
}

/// A node that a place in the scene names.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// The key.
    pub key: String,
    /// The place in the scene.
    pub wanted: Vec<f64>,
    /// The node, by its number in files.
    pub node: usize,
    /// Where it is.
    pub found: Point,
    /// How far it is from the place.
    pub distance: f64,
}

/// The node that a place names: none is far from the body.
pub(super) fn placed(
    scene: &Scene,
    mesh: &Mesh,
    key: &str,
    at: Option<&[f64]>,
) -> Result<Placed, ProblemError> {
    let dim = scene.dim().max(1);
    let mut wanted = Point::default();
    at.unwrap_or(&[]).iter().zip(&mut wanted).for_each(|(x, w)| *w = *x);
    let node = mesh.nearest_node(wanted);
    let found = mesh.nodes()[node];
    let distance = norm(&minus(&found, &wanted));
    if !mesh.is_near(wanted) {
        let message = format!(
            "{} is outside the body: {distance:.6e} from the nearest node {}, more than half an element",
            place(wanted, dim),
            place(found, dim)
        );
        let [low, high] = bounds(mesh.nodes());
        let of = |c: usize| format!("{} from {} to {}", ["x", "y", "z"][c], low[c], high[c]);
        let ranges: Vec<String> = (0..dim).map(of).collect();
        let help = format!("give a place in the body: {}", ranges.join(", "));
        return Err(scene.error(Issue::new(key, message, help)).into());
    }
    Ok(Placed { key: key.to_owned(), wanted: wanted[..dim].to_vec(), node, found, distance })
}
