//! Generated meshes: a uniform bar, a uniform rectangle, a row of points for bodies without a shape. Their edges are the groups `left`, `right`,
//! `bottom`, `top`.

use std::collections::BTreeMap;

use super::{Block, Edge, ElementKind, Facet, Mesh};

fn groups(of: impl Fn(Edge) -> Vec<Facet>) -> BTreeMap<String, Vec<Facet>> {
    Edge::ALL
        .iter()
        .map(|&e| (e.name().to_owned(), of(e)))
        .filter(|(_, facets)| !facets.is_empty())
        .collect()
}

/// `n` equal two-node elements on `[0, length]`.
pub fn bar(length: f64, n: usize) -> Mesh {
    let nodes = (0..=n).map(|i| [length * i as f64 / n as f64, 0.0, 0.0]).collect();
    let connectivity = (0..n).flat_map(|i| [i, i + 1]).collect();
    let block = Block { kind: ElementKind::Bar2, region: 0, connectivity, congruent: true };
    let groups = groups(|edge| match edge {
        Edge::Left => vec![Facet { block: 0, element: 0, side: 0 }],
        Edge::Right => vec![Facet { block: 0, element: n - 1, side: 1 }],
        _ => vec![],
    });
    Mesh::new(1, nodes, vec![block], groups)
}

/// `nx × ny` equal rectangles on `[0, lx] × [0, ly]`; nodes run along y first.
pub fn rectangle(lx: f64, ly: f64, nx: usize, ny: usize) -> Mesh {
    let node = |i: usize, j: usize| i * (ny + 1) + j;
    let mut nodes = Vec::with_capacity((nx + 1) * (ny + 1));
    for i in 0..=nx {
        for j in 0..=ny {
            nodes.push([lx * i as f64 / nx as f64, ly * j as f64 / ny as f64, 0.0]);
        }
    }
    let mut connectivity = Vec::with_capacity(4 * nx * ny);
    for i in 0..nx {
        for j in 0..ny {
            connectivity.extend([node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]);
        }
    }
    let block = Block { kind: ElementKind::Quad4, region: 0, connectivity, congruent: true };
    let facet = |i: usize, j: usize, side: usize| Facet { block: 0, element: i * ny + j, side };
    let groups = groups(|edge| match edge {
        Edge::Bottom => (0..nx).map(|i| facet(i, 0, 0)).collect(),
        Edge::Right => (0..ny).map(|j| facet(nx - 1, j, 1)).collect(),
        Edge::Top => (0..nx).map(|i| facet(i, ny - 1, 2)).collect(),
        Edge::Left => (0..ny).map(|j| facet(0, j, 3)).collect(),
    });
    Mesh::new(2, nodes, vec![block], groups)
}

/// A row of `n + 1` points for a body of `n` displacements without a shape: point `i` carries displacement `i`, so that there is one numbering, and the last
/// point is the ground, at the beginning of the row; lines join neighbours in pictures. There are no groups, and nothing is assembled from it.
pub fn row(length: f64, n: usize) -> Mesh {
    let place = |i: usize| [length * i as f64 / n as f64, 0.0, 0.0];
    let nodes = (1..=n).chain([0]).map(place).collect();
    let connectivity = (0..n).flat_map(|i| [if i == 0 { n } else { i - 1 }, i]).collect();
    let block = Block { kind: ElementKind::Bar2, region: 0, connectivity, congruent: true };
    Mesh::new(1, nodes, vec![block], BTreeMap::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_groups_in_order() {
        let m = rectangle(2.0, 1.0, 4, 3);
        assert_eq!((m.n_nodes(), m.n_elements()), (20, 12));
        for edge in Edge::ALL {
            let nodes = m.group_nodes(edge.name());
            let wall = if edge.sign() < 0.0 { 0.0 } else { m.size()[edge.axis()] };
            assert!(nodes.iter().all(|&n| m.nodes()[n][edge.axis()] == wall));
            let along = 1 - edge.axis();
            assert!(nodes.windows(2).all(|p| m.nodes()[p[0]][along] < m.nodes()[p[1]][along]));
            assert_eq!(nodes.len(), m.group(edge.name()).len() + 1);
        }
        assert_eq!(m.nearest_node([1.9, 0.1, 0.0]), m.group_nodes("right")[0]);
        assert_eq!(bar(1.0, 3).group_nodes("right"), [3]);
        assert!(bar(1.0, 3).group("top").is_empty() && row(1.0, 3).group("right").is_empty());
        // the ground is the last point
        assert_eq!(
            row(2.0, 4).nodes().iter().map(|p| p[0]).collect::<Vec<_>>(),
            [0.5, 1.0, 1.5, 2.0, 0.0]
        );
    }
}
