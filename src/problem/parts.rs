//! Several bodies, or several materials of one: their names, and which nodes are whose.

use crate::mesh::Mesh;
use crate::scenario::{BodyKind, Scene};

/// The parts of a mesh that a scene can call by a name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parts {
    /// Names: of the bodies, or of the groups of cells that have materials of their own.
    pub names: Vec<String>,
    /// Which of them each node belongs to: the first of those whose elements have it.
    pub of_node: Vec<usize>,
}

impl Parts {
    /// The part of this name.
    pub fn called(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }
}

/// What each region of the mesh is called.
fn of_regions(scene: &Scene) -> Vec<String> {
    let bodies = scene.bodies();
    let generated = bodies.iter().filter(|(_, b)| b.kind != BodyKind::Mesh);
    let name = |b: &crate::scenario::Body| b.name.clone().unwrap_or_else(|| "body".to_owned());
    let of_table = scene.materials.iter().map(|m| match (scene.owner(m), &m.group) {
        (Some((owner, _)), _) if owner.name.is_some() => name(owner),
        (_, Some(group)) => group.clone(),
        _ => "body".to_owned(),
    });
    generated.map(|(_, b)| name(b)).chain(of_table).collect()
}

/// The parts of the mesh of a scene.
pub fn parts(scene: &Scene, mesh: &Mesh) -> Parts {
    let of_regions = of_regions(scene);
    let mut names: Vec<String> = vec![];
    let number: Vec<usize> = of_regions
        .iter()
        .map(|name| {
            names.iter().position(|n| n == name).unwrap_or_else(|| {
                names.push(name.clone());
                names.len() - 1
            })
        })
        .collect();
    let mut of_node = vec![usize::MAX; mesh.n_nodes()];
    for element in mesh.elements() {
        let own = number.get(element.region).copied().unwrap_or(0);
        element.nodes.iter().for_each(|&n| of_node[n] = of_node[n].min(own));
    }
    of_node.iter_mut().filter(|p| **p == usize::MAX).for_each(|p| *p = 0);
    Parts { names, of_node }
}
