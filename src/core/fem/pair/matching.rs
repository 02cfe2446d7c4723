//! Node against node.

use std::collections::{BTreeMap, HashMap};

use super::super::normals::GroupNode;
use super::against::Against;
use super::overlap::Patch;
use crate::mesh::point::{dot, minus, norm};
use crate::mesh::{Mesh, Point};

/// A partner stands this close to the normal, in sizes of a side.
const ON_NORMAL: f64 = 1e-6;

/// The partner of every node; the first node that has none of its own.
pub fn of(
    mesh: &Mesh,
    slave: &[GroupNode],
    masters: &[usize],
    patches: &[Patch],
    whole: &BTreeMap<usize, f64>,
) -> Result<Vec<Against>, usize> {
    let x = mesh.nodes();
    let size = match mesh.dim() {
        1 => mesh.length(),
        2 => patches.iter().map(|p| p.size).fold(f64::INFINITY, f64::min),
        _ => patches.iter().map(|p| p.size.sqrt()).fold(f64::INFINITY, f64::min),
    };
    let mut taken: HashMap<usize, usize> = HashMap::new();
    let mut found = vec![];
    for GroupNode { node, normal, .. } in slave {
        let off = |j: usize| {
            let way = minus(&x[j], &x[*node]);
            let along = dot(&way, normal);
            let across: Point = std::array::from_fn(|c| way[c] - along * normal[c]);
            (norm(&across) <= ON_NORMAL * size).then_some((along.abs(), j))
        };
        let nearest = masters.iter().filter_map(|&j| off(j)).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, partner)) = nearest else { return Err(*node) };
        if taken.insert(partner, *node).is_some() {
            return Err(*node);
        }
        found.push(Against {
            node: *node,
            normal: *normal,
            share: whole.get(node).copied().unwrap_or(0.0),
            masters: vec![(partner, 1.0)],
        });
    }
    match (taken.len() == masters.len(), slave.first()) {
        (false, Some(first)) => Err(first.node),
        _ => Ok(found),
    }
}
