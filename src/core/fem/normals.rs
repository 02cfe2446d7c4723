//! The normals of a group's nodes.

use std::collections::BTreeMap;

use super::element::Shape;
use super::shape::bears;
use crate::mesh::point::unit;
use crate::mesh::{Mesh, Point};

/// A node of a group: its normal `∫ P n ds`, normalised, and those of the sides there. On faces with shape functions whose integrals are not all
/// positive it is `∫ P² n ds`.
#[derive(Debug, Clone)]
pub(super) struct GroupNode {
    pub node: usize,
    pub normal: Point,
    pub sides: Vec<Point>,
}

/// The nodes of a group with their outward normals.
pub fn normals_of(mesh: &Mesh, group: &str) -> Vec<(usize, Point)> {
    nodes_of(mesh, group).into_iter().map(|n| (n.node, n.normal)).collect()
}

/// The nodes of a group in their order.
pub(super) fn nodes_of(mesh: &Mesh, group: &str) -> Vec<GroupNode> {
    let order = mesh.group_nodes(group);
    let place: BTreeMap<usize, usize> = order.iter().enumerate().map(|(k, &n)| (n, k)).collect();
    let new = |node| GroupNode { node, normal: [0.0; 3], sides: vec![] };
    let mut nodes: Vec<GroupNode> = order.iter().copied().map(new).collect();
    for &facet in mesh.group(group) {
        let element = mesh.element(facet);
        let x = mesh.corners(element);
        let bears = bears(element.kind, facet.side);
        for point in (Shape { kind: element.kind, x: &x }).side(facet.side) {
            let n = point.normal;
            for (&local, p) in element.kind.side(facet.side).iter().zip(&point.values) {
                let Some(&k) = place.get(&element.nodes[local]) else { continue };
                let of_node = &mut nodes[k];
                let weight = if bears { *p } else { p * p };
                (0..3).for_each(|c| of_node.normal[c] += weight * point.area * n[c]);
                of_node.sides.push(n);
            }
        }
    }
    nodes.iter_mut().for_each(|n| n.normal = unit(n.normal));
    nodes
}
