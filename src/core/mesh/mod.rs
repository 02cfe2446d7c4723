//! Meshes: points in space, blocks of elements of one kind, named groups of element sides.
//!
//! Generators ([`structured`]) and readers give the same [`Mesh`]; nothing above asks where one came from. A point has three coordinates whatever
//! the dimension; the displacement has `dim` components. The sides of an element are numbered; where they are lines, a side's nodes run so that a
//! group of consecutive sides names its nodes in order.

mod assembly;
pub mod bulk;
#[doc(hidden)]
pub mod corner;
pub mod deck;
pub(crate) mod fortran;
pub mod gmsh;
mod kind;
mod listed;
mod placed;
#[doc(hidden)]
pub mod point;
#[doc(hidden)]
pub mod reentrant;
pub mod slender;
pub mod structured;
pub mod vtu;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use kind::{Basis, ElementKind, Family};

/// A place: `(x, y, z)`, zero where the body has no such extent.
pub type Point = [f64; 3];

/// Least and largest coordinates of points.
pub fn bounds<'p>(points: impl IntoIterator<Item = &'p Point>) -> [Point; 2] {
    let none = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    points.into_iter().fold(none, |[low, high], p| {
        [std::array::from_fn(|c| low[c].min(p[c])), std::array::from_fn(|c| high[c].max(p[c]))]
    })
}

/// An edge of a generated body by name: its group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    /// All edges.
    pub const ALL: [Edge; 4] = [Edge::Left, Edge::Right, Edge::Bottom, Edge::Top];

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

/// Elements of one kind and one region.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Kind of all elements.
    pub kind: ElementKind,
    /// Which of the body's materials they have.
    pub region: usize,
    /// Nodes, element by element.
    pub connectivity: Vec<usize>,
    /// All elements have the shape of the first: one element matrix serves all.
    pub congruent: bool,
}

/// A side of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Facet {
    /// Block.
    pub block: usize,
    /// Element in the block.
    pub element: usize,
    /// Side of the element.
    pub side: usize,
}

/// An element as it stands in a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element<'a> {
    /// Kind.
    pub kind: ElementKind,
    /// Which of the body's materials it has.
    pub region: usize,
    /// Its nodes.
    pub nodes: &'a [usize],
}

/// Nodes, elements, named groups of sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    dim: usize,
    nodes: Vec<Point>,
    blocks: Vec<Block>,
    groups: BTreeMap<String, Vec<Facet>>,
    /// Of some groups the nodes that count; of all others every node of their sides does.
    chosen: BTreeMap<String, Vec<usize>>,
}

impl Mesh {
    /// Put a mesh together.
    pub fn new(
        dim: usize,
        nodes: Vec<Point>,
        blocks: Vec<Block>,
        groups: BTreeMap<String, Vec<Facet>>,
    ) -> Mesh {
        Mesh { dim, nodes, blocks, groups, chosen: BTreeMap::new() }
    }

    /// Number of displacement components.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Places of the nodes.
    pub fn nodes(&self) -> &[Point] {
        &self.nodes
    }

    /// Blocks of elements.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.blocks.iter().map(|b| b.connectivity.len() / b.kind.nodes()).sum()
    }

    /// All elements, block by block.
    pub fn elements(&self) -> impl Iterator<Item = Element<'_>> {
        self.blocks.iter().flat_map(|b| {
            let of = |nodes| Element { kind: b.kind, region: b.region, nodes };
            b.connectivity.chunks_exact(b.kind.nodes()).map(of)
        })
    }

    /// The element of a facet.
    pub fn element(&self, facet: Facet) -> Element<'_> {
        let block = &self.blocks[facet.block];
        let n = block.kind.nodes();
        let nodes = &block.connectivity[n * facet.element..n * (facet.element + 1)];
        Element { kind: block.kind, region: block.region, nodes }
    }

    /// Extent of an element along a direction.
    pub fn extent(&self, element: Element, along: Point) -> f64 {
        let x = |&n: &usize| (0..3).map(|c| self.nodes[n][c] * along[c]).sum::<f64>();
        let (low, high) = element
            .nodes
            .iter()
            .map(x)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        high - low
    }

    /// Places of the nodes of an element.
    pub fn corners(&self, element: Element) -> Vec<Point> {
        element.nodes.iter().map(|&n| self.nodes[n]).collect()
    }

    /// The sides of a group; none if there is no such group.
    pub fn group(&self, name: &str) -> &[Facet] {
        self.groups.get(name).map_or(&[], Vec::as_slice)
    }

    /// The names of all groups.
    pub fn groups(&self) -> impl Iterator<Item = &str> {
        self.groups.keys().map(String::as_str)
    }

    /// The nodes of a group that alone count, where some were chosen: its sides are all those that they are on.
    pub fn chosen(&self, name: &str) -> Option<&[usize]> {
        self.chosen.get(name).map(Vec::as_slice)
    }

    /// The nodes of a group, each once: where sides are lines in their order and from end to end of each, where they are faces by their numbers.
    pub fn group_nodes(&self, name: &str) -> Vec<usize> {
        let mut nodes = self.nodes_of_sides(name);
        if let Some(chosen) = self.chosen(name) {
            nodes.retain(|n| chosen.contains(n));
        }
        nodes
    }

    /// All nodes of the sides of a group, in that order.
    fn nodes_of_sides(&self, name: &str) -> Vec<usize> {
        let facets = self.group(name);
        if self.dim == 3 {
            let mut nodes: Vec<usize> = facets.iter().flat_map(|&f| self.side_nodes(f)).collect();
            nodes.sort_unstable();
            nodes.dedup();
            return nodes;
        }
        let mut nodes = vec![];
        let mut known = vec![false; self.n_nodes()];
        for (k, &facet) in facets.iter().enumerate() {
            let mut path = self.side_nodes(facet);
            let [first, last] = [path[0], path[path.len() - 1]];
            // from the end that the side before has; the first one to the end that the next has
            let next = facets.get(k + 1).map_or(vec![], |&f| self.side_nodes(f));
            let turned = match (known[first], known[last]) {
                (true, false) => false,
                (false, true) => true,
                _ => next.contains(&first) && !next.contains(&last),
            };
            if turned {
                path.reverse();
            }
            path.retain(|&n| !std::mem::replace(&mut known[n], true));
            nodes.extend(path);
        }
        nodes
    }

    /// The nodes of a side: of a line from end to end, of a face in the order of its kind.
    pub fn side_nodes(&self, facet: Facet) -> Vec<usize> {
        let element = self.element(facet);
        let mut path: Vec<usize> =
            element.kind.side(facet.side).iter().map(|&l| element.nodes[l]).collect();
        // ends, then the middle
        if path.len() == 3 && self.dim < 3 {
            path.swap(1, 2);
        }
        path
    }

    /// Lines in the order in which they hang together, piece by piece; faces as they are.
    pub fn in_chains(&self, facets: &[Facet]) -> Vec<Facet> {
        if self.dim == 3 {
            return facets.to_vec();
        }
        let ends = |f: &Facet| {
            let path = self.side_nodes(*f);
            [path[0], path[path.len() - 1]]
        };
        let mut at: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (k, facet) in facets.iter().enumerate() {
            ends(facet).into_iter().for_each(|n| at.entry(n).or_default().push(k));
        }
        // open pieces from the end of the lowest number, closed ones from anywhere
        let loose = at.values().filter(|k| k.len() == 1).map(|k| k[0]);
        let starts: Vec<usize> = loose.chain(0..facets.len()).collect();
        let mut used = vec![false; facets.len()];
        let mut order = vec![];
        for start in starts {
            let mut next = Some(start).filter(|&k| !used[k]);
            while let Some(k) = next {
                used[k] = true;
                order.push(facets[k]);
                let around = ends(&facets[k]).into_iter().filter_map(|n| at.get(&n)).flatten();
                next = around.copied().find(|&k| !used[k]);
            }
        }
        order
    }

    /// Of each node the part of the mesh that it belongs to, counted from 0 in the order of their first nodes: parts share no nodes.
    pub fn parts(&self) -> Vec<usize> {
        let mut root: Vec<usize> = (0..self.n_nodes()).collect();
        fn find(root: &mut [usize], mut n: usize) -> usize {
            while root[n] != n {
                root[n] = root[root[n]];
                n = root[n];
            }
            n
        }
        for element in self.elements() {
            for pair in element.nodes.windows(2) {
                let (a, b) = (find(&mut root, pair[0]), find(&mut root, pair[1]));
                root[a.max(b)] = a.min(b);
            }
        }
        let mut number = BTreeMap::new();
        (0..self.n_nodes())
            .map(|n| {
                let (own, next) = (find(&mut root, n), number.len());
                *number.entry(own).or_insert(next)
            })
            .collect()
    }

    /// Extents along the three axes.
    pub fn size(&self) -> Point {
        let [low, high] = bounds(&self.nodes);
        std::array::from_fn(|c| (high[c] - low[c]).max(0.0))
    }

    /// The middle of the extents.
    pub fn centre(&self) -> Point {
        let ([low, _], size) = (bounds(&self.nodes), self.size());
        std::array::from_fn(|c| low[c] + size[c] / 2.0)
    }

    /// The mesh with other numbers for its regions.
    pub fn with_regions(mut self, regions: &[usize]) -> Mesh {
        self.blocks.iter_mut().for_each(|b| b.region = regions[b.region]);
        self
    }

    /// The mesh with these groups in place of its own.
    pub fn with_groups(self, groups: impl IntoIterator<Item = (String, Vec<Facet>)>) -> Mesh {
        Mesh { groups: groups.into_iter().collect(), ..self }
    }

    /// The mesh with groups of which these nodes alone count.
    pub fn with_chosen(self, chosen: impl IntoIterator<Item = (String, Vec<usize>)>) -> Mesh {
        Mesh { chosen: chosen.into_iter().collect(), ..self }
    }

    /// The mesh after an affine map.
    pub fn moved(&self, map: impl Fn(Point) -> Point) -> Mesh {
        Mesh { nodes: self.nodes.iter().map(|&p| map(p)).collect(), ..self.clone() }
    }

    /// The largest extent.
    pub fn length(&self) -> f64 {
        self.size().into_iter().fold(0.0, f64::max)
    }

    /// Whether a place is in the body, or less than half an element from it: within the radius `√(d/(2d+2))` of a node, in diameters of an element of that node
    /// (Jung: no place in an element is further from all of its nodes).
    pub fn is_near(&self, at: Point) -> bool {
        let d = self.dim as f64;
        let radius = (1.0 + 1e-9) * (d / (2.0 * d + 2.0)).sqrt();
        let away = |n: usize, p: &Point| point::norm(&point::minus(&self.nodes[n], p));
        let furthest =
            |p: &Point, e: Element| e.nodes.iter().map(|&n| away(n, p)).fold(0.0, f64::max);
        self.elements().any(|e| {
            let least = e.nodes.iter().map(|&n| away(n, &at)).fold(f64::INFINITY, f64::min);
            let reach = |n: &usize| least <= radius * furthest(&self.nodes[*n], e);
            e.nodes.iter().any(reach)
        })
    }

    /// The node nearest to a point.
    pub fn nearest_node(&self, at: Point) -> usize {
        let distance = |p: &Point| (0..3).map(|c| (p[c] - at[c]).powi(2)).sum::<f64>();
        (0..self.n_nodes())
            .min_by(|&a, &b| distance(&self.nodes[a]).total_cmp(&distance(&self.nodes[b])))
            .unwrap_or(0)
    }
}
