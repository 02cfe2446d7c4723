//! Meshes: points in space, blocks of elements of one kind, named groups of element sides.
//!
//! Generators ([`structured`]) and readers give the same [`Mesh`]; nothing above asks where one came from. A point has three coordinates whatever
//! the dimension; the displacement has `dim` components. An element lists its nodes counter-clockwise; its sides are numbered, and a side's nodes
//! run so that a group of consecutive sides names its nodes in order.

pub mod gmsh;
pub mod structured;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

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

/// Kinds of element. Nodes: corners counter-clockwise, middles of the sides between them, the centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ElementKind {
    /// Two nodes on a line.
    Bar2,
    /// Three corners of a triangle.
    Tri3,
    /// A triangle with nodes in the middle of its sides.
    Tri6,
    /// Four corners of a quadrilateral.
    Quad4,
    /// A quadrilateral with nodes in the middle of its sides.
    Quad8,
    /// The same with a node at its centre.
    Quad9,
}

impl ElementKind {
    /// The kinds that fill the plane.
    pub const PLANE: [ElementKind; 5] = [
        ElementKind::Tri3,
        ElementKind::Tri6,
        ElementKind::Quad4,
        ElementKind::Quad8,
        ElementKind::Quad9,
    ];

    /// The kind on a line or in the plane with so many nodes.
    pub fn of_nodes(nodes: usize) -> Option<ElementKind> {
        let all = ElementKind::PLANE.into_iter().chain([ElementKind::Bar2]);
        all.into_iter().find(|k| k.nodes() == nodes)
    }

    /// Short name: triangles and quadrilaterals by their number of nodes.
    pub fn name(self) -> &'static str {
        match self {
            ElementKind::Bar2 => "bar",
            ElementKind::Tri3 => "T3",
            ElementKind::Tri6 => "T6",
            ElementKind::Quad4 => "Q4",
            ElementKind::Quad8 => "Q8",
            ElementKind::Quad9 => "Q9",
        }
    }

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        match self {
            ElementKind::Bar2 => 2,
            ElementKind::Tri3 => 3,
            ElementKind::Tri6 => 6,
            ElementKind::Quad4 => 4,
            ElementKind::Quad8 => 8,
            ElementKind::Quad9 => 9,
        }
    }

    /// Number of corners: the first nodes.
    pub fn corners(self) -> usize {
        match self {
            ElementKind::Bar2 => 2,
            ElementKind::Tri3 | ElementKind::Tri6 => 3,
            ElementKind::Quad4 | ElementKind::Quad8 | ElementKind::Quad9 => 4,
        }
    }

    /// Number of sides.
    pub fn sides(self) -> usize {
        self.corners()
    }

    /// Space that it fills: 1 or 2.
    pub fn dim(self) -> usize {
        if self == ElementKind::Bar2 { 1 } else { 2 }
    }

    /// Local nodes of a side: its ends, then its middle. The ends of a bar; the sides of a triangle counter-clockwise; bottom, right, top and left of a
    /// quadrilateral, along the increasing coordinate.
    pub fn side(self, side: usize) -> &'static [usize] {
        match (self, side) {
            (ElementKind::Bar2, 0) => &[0],
            (ElementKind::Bar2, _) => &[1],
            (ElementKind::Tri3, 0) => &[0, 1],
            (ElementKind::Tri3, 1) => &[1, 2],
            (ElementKind::Tri3, _) => &[2, 0],
            (ElementKind::Tri6, 0) => &[0, 1, 3],
            (ElementKind::Tri6, 1) => &[1, 2, 4],
            (ElementKind::Tri6, _) => &[2, 0, 5],
            (ElementKind::Quad4, 0) => &[0, 1],
            (ElementKind::Quad4, 1) => &[1, 2],
            (ElementKind::Quad4, 2) => &[3, 2],
            (ElementKind::Quad4, _) => &[0, 3],
            (ElementKind::Quad8 | ElementKind::Quad9, 0) => &[0, 1, 4],
            (ElementKind::Quad8 | ElementKind::Quad9, 1) => &[1, 2, 5],
            (ElementKind::Quad8 | ElementKind::Quad9, 2) => &[3, 2, 6],
            (ElementKind::Quad8 | ElementKind::Quad9, _) => &[0, 3, 7],
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
}

impl Mesh {
    /// Put a mesh together.
    pub fn new(
        dim: usize,
        nodes: Vec<Point>,
        blocks: Vec<Block>,
        groups: BTreeMap<String, Vec<Facet>>,
    ) -> Mesh {
        Mesh { dim, nodes, blocks, groups }
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

    /// The same in the plane.
    pub fn plane_corners(&self, element: Element) -> Vec<[f64; 2]> {
        element.nodes.iter().map(|&n| [self.nodes[n][0], self.nodes[n][1]]).collect()
    }

    /// The sides of a group; none if there is no such group.
    pub fn group(&self, name: &str) -> &[Facet] {
        self.groups.get(name).map_or(&[], Vec::as_slice)
    }

    /// The nodes of a group, each once, in the order of its sides and from end to end of each.
    pub fn group_nodes(&self, name: &str) -> Vec<usize> {
        let facets = self.group(name);
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

    /// The nodes of a side from end to end.
    pub fn side_nodes(&self, facet: Facet) -> Vec<usize> {
        let element = self.element(facet);
        let mut path: Vec<usize> =
            element.kind.side(facet.side).iter().map(|&l| element.nodes[l]).collect();
        // ends, then the middle
        if path.len() == 3 {
            path.swap(1, 2);
        }
        path
    }

    /// Sides in the order in which they hang together, piece by piece.
    pub fn in_chains(&self, facets: &[Facet]) -> Vec<Facet> {
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

    /// The mesh after an affine map.
    pub fn moved(&self, map: impl Fn(Point) -> Point) -> Mesh {
        Mesh { nodes: self.nodes.iter().map(|&p| map(p)).collect(), ..self.clone() }
    }

    /// The largest extent.
    pub fn length(&self) -> f64 {
        self.size().into_iter().fold(0.0, f64::max)
    }

    /// The node nearest to a point.
    pub fn nearest_node(&self, at: Point) -> usize {
        let distance = |p: &Point| (0..3).map(|c| (p[c] - at[c]).powi(2)).sum::<f64>();
        (0..self.n_nodes())
            .min_by(|&a, &b| distance(&self.nodes[a]).total_cmp(&distance(&self.nodes[b])))
            .unwrap_or(0)
    }
}
