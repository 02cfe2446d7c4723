//! What of a mesh moves on a page: its nodes, in the plane or in space.

use crate::store::Stored;

/// The nodes that are drawn.
pub(super) struct Drawn {
    /// Their numbers in the mesh, in its order.
    pub nodes: Vec<usize>,
    /// Directions that are drawn.
    pub components: usize,
    /// Those that show a pressure, in space.
    pub bearing: Vec<usize>,
}

impl Drawn {
    /// All of a body in the plane.
    pub fn in_plane(stored: &Stored) -> Drawn {
        Drawn { nodes: (0..stored.nodes.nrows()).collect(), components: 2, bearing: vec![] }
    }

    /// Bytes of a state of an orbit.
    pub fn bytes(&self, points: usize) -> usize {
        2 * (self.components * self.nodes.len() + self.bearing.len()) + 5 * points
    }

    /// Of each contact point the number of the node that it lies at, or nearest to, among those that are drawn.
    pub fn touching(&self, stored: &Stored) -> Vec<usize> {
        let number = |n: usize| self.nodes.binary_search(&n).unwrap_or(0);
        (0..stored.gap.len()).map(|i| number(stored.nearest_node(i))).collect()
    }

    /// Displacements at a stored state.
    pub fn displacements(&self, stored: &Stored, row: usize) -> Vec<f64> {
        let of = |&n: &usize| stored.displacement(row, n).into_iter().take(self.components);
        self.nodes.iter().flat_map(of).collect()
    }
}
