//! The body of a page: its cells, outline, obstacles, and what makes stresses of its displacements.

use serde_json::{Value, json};

use super::block::{exact, single, whole};
use super::drawn::Drawn;
use super::solid::solid;
use crate::fem::{Material, Shape, shape};
use crate::mesh::Point;
use crate::report::edge::Edge;
use crate::report::pictures::boundary;
use crate::store::Stored;

/// The body of a motion, and what of it moves; `materials` by region where they are known.
pub(super) fn body(stored: &Stored, materials: &[Material]) -> (Drawn, Value) {
    let (drawn, solid) = match stored.is_solid() {
        true => solid(stored),
        false => (Drawn::in_plane(stored), Value::Null),
    };
    let value = described(stored, materials, &drawn, solid);
    (drawn, value)
}

fn described(stored: &Stored, materials: &[Material], drawn: &Drawn, solid: Value) -> Value {
    let edge = Edge::of(stored);
    let (fronts, n_c) = (&edge.fronts, stored.gap.len());
    let cells: Vec<Vec<usize>> = (0..stored.elements.nrows()).map(|k| around(stored, k)).collect();
    let in_plane = (0..cells.len()).all(|k| stored.kind(k).is_some_and(|kind| kind.dim() == 2));
    // rows of given matrices stand in a line, which is no shape
    let dim = match in_plane {
        _ if cells.is_empty() => 0,
        _ if stored.is_solid() => 3,
        true => 2,
        false => usize::from(!materials.is_empty()),
    };
    // of a body in space the page has the surface alone
    let (nodes, cells) = match dim {
        3 => (0, vec![]),
        _ => (stored.nodes.nrows(), cells),
    };
    let sides = if dim == 3 { vec![] } else { boundary(stored) };
    let own = |p: Point| p.into_iter().take(if dim == 3 { 3 } else { 2 });
    json!({
        "dim": dim,
        "solid": solid,
        "nodes": single((0..nodes).flat_map(|n| plane(stored.place(n)))),
        "cells": whole(cells.iter().flatten().copied()),
        "corners": whole(cells.iter().map(Vec::len)),
        "sides": whole(sides.into_iter().flat_map(|s| pairs(&s)).flatten()),
        "stress": stress(stored, materials),
        "contact": {
            "axis": edge.axis,
            "position": exact(edge.position.iter().copied()),
            "gap": exact(stored.gap.iter().copied()),
            "place": single((0..n_c).flat_map(|i| own(stored.contact_place(i)))),
            "normal": single((0..n_c).flat_map(|i| own(stored.contact_normal(i)))),
            "node": whole(drawn.touching(stored)),
            "names": (0..n_c).map(|i| stored.contact_name(i)).collect::<Vec<_>>(),
            "fronts": fronts,
            "behind": (0..n_c).map(|i| edge.behind(i)).collect::<Vec<_>>(),
            "curves": edge.curves(),
            // the page draws obstacles that stay
            "parts": if stored.swings() { vec![] } else { edge.parts() },
            "meets": edge.parts().iter().map(|p| stored.meets(p[0])).collect::<Vec<bool>>(),
            "closed": edge.parts().iter().map(|p| edge.is_closed(p)).collect::<Vec<bool>>(),
        },
    })
}

fn plane([x, y, _]: Point) -> [f64; 2] {
    [x, y]
}

fn pairs(path: &[usize]) -> Vec<[usize; 2]> {
    path.windows(2).map(|p| [p[0], p[1]]).collect()
}

/// The nodes of an element around its outline, those on its sides between its corners.
fn around(stored: &Stored, k: usize) -> Vec<usize> {
    let nodes = stored.nodes_of(k);
    let Some(kind) = stored.kind(k).filter(|kind| kind.dim() == 2) else { return nodes };
    // corners come first in an element, in their order around it
    let n = kind.corners();
    let path = |corner: usize| {
        let ends = [corner, (corner + 1) % n];
        let side =
            (0..kind.sides()).map(|s| kind.side(s)).find(|s| ends.iter().all(|e| s.contains(e)));
        let middle = side.and_then(|s| s.iter().find(|l| **l >= n));
        [Some(corner), middle.copied()].into_iter().flatten().map(|l| nodes[l])
    };
    (0..n).flat_map(path).collect()
}

/// `σ_xx, σ_yy, σ_zz, σ_xy` at the centre of each element for a unit of each displacement of its nodes, one element behind the other; null for a body
/// without materials, and for one in space.
fn stress(stored: &Stored, materials: &[Material]) -> Value {
    if stored.is_solid() {
        return Value::Null;
    }
    let (mut rows, mut own, mut counts) = (vec![], vec![], vec![]);
    for k in 0..stored.elements.nrows() {
        let (Some(kind), Some(material)) =
            (stored.kind(k), materials.get(stored.regions[k]).or(materials.first()))
        else {
            return Value::Null;
        };
        let nodes = stored.nodes_of(k);
        let x: Vec<Point> = nodes.iter().map(|&n| stored.place(n)).collect();
        let of = Shape { kind, x: &x }.stress_rows(material, shape::centre(kind));
        // column by column: four numbers a displacement
        rows.extend(of.column_iter().flat_map(|c| [c[0], c[1], c[2], c[3]]));
        counts.push(nodes.len());
        own.extend(nodes);
    }
    if own.is_empty() {
        return Value::Null;
    }
    json!({"rows": single(rows), "nodes": whole(own), "counts": whole(counts)})
}
