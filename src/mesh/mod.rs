//! Meshes: a uniform bar of two-node elements, a rectangle of four-node quadrilaterals.
//!
//! Nodes are points `(x, y)`; a bar has `y = 0`. Elements list their nodes
//! counter-clockwise. The four edges of the rectangle (two ends of the bar) are named.

use serde::{Deserialize, Serialize};

/// An edge of the body by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Edge {
    /// `x = 0`, outward normal −x.
    Left,
    /// `x = L`, outward normal +x.
    Right,
    /// `y = 0`, outward normal −y.
    Bottom,
    /// `y = H`, outward normal +y.
    Top,
}

impl Edge {
    /// The axis of the normal: 0 for x, 1 for y.
    pub fn axis(self) -> usize {
        matches!(self, Edge::Bottom | Edge::Top) as usize
    }

    /// Sign of the outward normal along [`Edge::axis`].
    pub fn sign(self) -> f64 {
        if matches!(self, Edge::Left | Edge::Bottom) { -1.0 } else { 1.0 }
    }

    /// The edge's name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Edge::Left => "left",
            Edge::Right => "right",
            Edge::Bottom => "bottom",
            Edge::Top => "top",
        }
    }
}

/// One element side on an edge: the element, and the side's nodes as local numbers in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side {
    /// Element index.
    pub element: usize,
    /// Local numbers of the side's nodes (equal for the end of a bar).
    pub local: [usize; 2],
}

/// Nodes and elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Space dimension of the displacement: 1 (bar) or 2 (plate).
    pub dim: usize,
    /// Node positions.
    pub nodes: Vec<[f64; 2]>,
    /// Nodes of an element: 2 (bar) or 4 (plate).
    pub nodes_per_element: usize,
    /// Element connectivity, `nodes_per_element` a row.
    pub elements: Vec<usize>,
    cells: [usize; 2],
    size: [f64; 2],
}

impl Mesh {
    /// `n` equal elements on `[0, length]`.
    pub fn bar(length: f64, n: usize) -> Mesh {
        Mesh {
            dim: 1,
            nodes: (0..=n).map(|i| [length * i as f64 / n as f64, 0.0]).collect(),
            nodes_per_element: 2,
            elements: (0..n).flat_map(|i| [i, i + 1]).collect(),
            cells: [n, 0],
            size: [length, 0.0],
        }
    }

    /// `nx × ny` equal rectangles on `[0, lx] × [0, ly]`; nodes run along y first.
    pub fn rectangle(lx: f64, ly: f64, nx: usize, ny: usize) -> Mesh {
        let node = |i: usize, j: usize| i * (ny + 1) + j;
        let mut nodes = Vec::with_capacity((nx + 1) * (ny + 1));
        for i in 0..=nx {
            for j in 0..=ny {
                nodes.push([lx * i as f64 / nx as f64, ly * j as f64 / ny as f64]);
            }
        }
        let mut elements = Vec::with_capacity(4 * nx * ny);
        for i in 0..nx {
            for j in 0..ny {
                elements.extend([node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]);
            }
        }
        Mesh { dim: 2, nodes, nodes_per_element: 4, elements, cells: [nx, ny], size: [lx, ly] }
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.elements.len() / self.nodes_per_element
    }

    /// The nodes of element `e`.
    pub fn element(&self, e: usize) -> &[usize] {
        &self.elements[e * self.nodes_per_element..(e + 1) * self.nodes_per_element]
    }

    /// Length and height of the body.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// Elements along x and y.
    pub fn cells(&self) -> [usize; 2] {
        self.cells
    }

    /// The nodes of an edge in increasing order of the coordinate along it.
    pub fn edge_nodes(&self, edge: Edge) -> Vec<usize> {
        let [nx, ny] = self.cells;
        let node = |i: usize, j: usize| i * (ny + 1) + j;
        match (self.dim, edge) {
            (1, Edge::Left) => vec![0],
            (1, _) => vec![nx],
            (_, Edge::Left) => (0..=ny).map(|j| node(0, j)).collect(),
            (_, Edge::Right) => (0..=ny).map(|j| node(nx, j)).collect(),
            (_, Edge::Bottom) => (0..=nx).map(|i| node(i, 0)).collect(),
            (_, Edge::Top) => (0..=nx).map(|i| node(i, ny)).collect(),
        }
    }

    /// The element sides that make up an edge.
    pub fn edge_sides(&self, edge: Edge) -> Vec<Side> {
        let [nx, ny] = self.cells;
        let cell = |i: usize, j: usize| i * ny + j;
        let side = |element, local| Side { element, local };
        match (self.dim, edge) {
            (1, Edge::Left) => vec![side(0, [0, 0])],
            (1, _) => vec![side(nx - 1, [1, 1])],
            (_, Edge::Left) => (0..ny).map(|j| side(cell(0, j), [0, 3])).collect(),
            (_, Edge::Right) => (0..ny).map(|j| side(cell(nx - 1, j), [1, 2])).collect(),
            (_, Edge::Bottom) => (0..nx).map(|i| side(cell(i, 0), [0, 1])).collect(),
            (_, Edge::Top) => (0..nx).map(|i| side(cell(i, ny - 1), [3, 2])).collect(),
        }
    }

    /// The node nearest to a point.
    pub fn nearest_node(&self, at: [f64; 2]) -> usize {
        let distance = |p: &[f64; 2]| (p[0] - at[0]).powi(2) + (p[1] - at[1]).powi(2);
        (0..self.n_nodes())
            .min_by(|&a, &b| distance(&self.nodes[a]).total_cmp(&distance(&self.nodes[b])))
            .unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_and_sides_agree() {
        let m = Mesh::rectangle(2.0, 1.0, 4, 3);
        assert_eq!((m.n_nodes(), m.n_elements()), (20, 12));
        for edge in [Edge::Left, Edge::Right, Edge::Bottom, Edge::Top] {
            let nodes = m.edge_nodes(edge);
            let wall = if edge.sign() < 0.0 { 0.0 } else { m.size()[edge.axis()] };
            assert!(nodes.iter().all(|&n| m.nodes[n][edge.axis()] == wall));
            for (k, s) in m.edge_sides(edge).iter().enumerate() {
                let e = m.element(s.element);
                assert_eq!([e[s.local[0]], e[s.local[1]]], [nodes[k], nodes[k + 1]]);
            }
        }
        assert_eq!(m.nearest_node([1.9, 0.1]), m.edge_nodes(Edge::Right)[0]);
    }
}
