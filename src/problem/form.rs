//! The mesh of a scene before anything is assembled.

use super::places::place;
use crate::mesh::Mesh;

/// A body without its matrices.
pub(super) struct Form {
    pub mesh: Mesh,
    /// What messages call a node, where it has a name.
    pub tags: Vec<Option<i64>>,
}

impl Form {
    /// A node in words.
    pub fn node(&self, node: usize) -> String {
        let place = place(self.mesh.nodes()[node], self.mesh.dim());
        match self.tags.get(node) {
            Some(Some(tag)) => format!("node {tag} at {place}"),
            _ => format!("the node at {place}"),
        }
    }
}
