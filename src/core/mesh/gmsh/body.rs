//! From the elements of a file to the mesh of a body: cells, regions, sides.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::topology::{self, NOWHERE, Owners, Turn};
use super::{Cell, File, GmshError, Type};
use crate::mesh::{Block, ElementKind, Facet, Mesh, Point};

/// Sides of the body that a group names.
#[derive(Debug, Clone, PartialEq)]
pub enum Sides {
    /// On its boundary.
    Boundary(Vec<Facet>),
    /// Not on it, with the tags of the nodes of the first one that is not: two cells have it, or none.
    Elsewhere {
        /// Node tags.
        nodes: Vec<i64>,
        /// How many cells have it.
        owners: usize,
    },
}

/// The mesh of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The mesh, with the groups that lie on its boundary.
    pub mesh: Mesh,
    /// Of each region of the mesh the names of its physical groups (none, one or several).
    pub regions: Vec<Vec<String>>,
    /// What the groups of lines, or of faces, name.
    pub sides: BTreeMap<String, Sides>,
    /// Tags of the nodes of the mesh.
    pub node_tags: Vec<i64>,
    /// Tags of the cells, block by block.
    pub cell_tags: Vec<Vec<i64>>,
    /// Nodes of the file that no cell has.
    pub unused: usize,
}

/// The nodes of each pair of surfaces that are meant to meet.
struct Meet<'b> {
    blocks: &'b [Block],
    surfaces: Vec<[HashSet<usize>; 2]>,
}

/// The nodes of a side.
fn nodes_of(blocks: &[Block], facet: Facet) -> impl Iterator<Item = usize> + '_ {
    let b = &blocks[facet.block];
    let first = b.kind.nodes() * facet.element;
    b.kind.side(facet.side).iter().map(move |l| b.connectivity[first + l])
}

impl<'b> Meet<'b> {
    fn new(
        sides: &BTreeMap<String, Sides>,
        blocks: &'b [Block],
        pairs: &[[String; 2]],
    ) -> Meet<'b> {
        let of = |name: &String| match sides.get(name) {
            Some(Sides::Boundary(facets)) => {
                facets.iter().flat_map(|f| nodes_of(blocks, *f)).collect()
            }
            _ => HashSet::new(),
        };
        Meet { blocks, surfaces: pairs.iter().map(|[a, b]| [of(a), of(b)]).collect() }
    }

    /// Whether a node of one surface lies on a side of the other, or on one that ends there.
    fn has(&self, node: usize, facet: Facet) -> bool {
        let ends_on = |surface: &HashSet<usize>| {
            nodes_of(self.blocks, facet).filter(|n| surface.contains(n)).count() >= 2
        };
        let on = |a: &HashSet<usize>, b: &HashSet<usize>| a.contains(&node) && ends_on(b);
        self.surfaces.iter().any(|[a, b]| on(a, b) || on(b, a))
    }
}

/// Nodes further from the plane than this, over the size of the body, are not in it.
const FLAT: f64 = 1e-9;

impl File {
    /// The mesh of a plane body, or of one in space; coordinates are multiplied by `scale`. `pairs` are groups of sides that are meant to meet, two by two.
    pub fn body(&self, scale: f64, pairs: &[[String; 2]]) -> Result<Imported, GmshError> {
        let dim = self.dim();
        let counted = || {
            let of = |(t, n): (Type, usize)| format!("{n} × {}", t.name);
            self.types().into_iter().map(of).collect::<Vec<_>>().join(", ")
        };
        if dim < 2 {
            let help = "mesh the surface or the volume too: gmsh -2 or gmsh -3, and give it a physical group";
            let message = format!("there is no body in it (elements: {})", counted());
            return Err(GmshError::of_file(message, help));
        }
        let cells: Vec<&Cell> = self.cells.iter().filter(|c| c.of.dim == dim).collect();
        let is_quadratic = |c: &&Cell| c.of.kind().is_some_and(ElementKind::is_quadratic);
        if cells.iter().any(is_quadratic) && !cells.iter().all(is_quadratic) {
            let message = format!("elements of first and second order are mixed: {}", counted());
            return Err(GmshError::of_file(
                message,
                "mesh with one order: gmsh -order 1 or -order 2",
            ));
        }
        let used = self.used(&cells);
        if dim == 2 {
            self.check_plane(&used, scale)?;
        }
        let mut places = vec![NOWHERE; self.nodes.len()];
        used.iter().enumerate().for_each(|(new, &old)| places[old] = new as u32);
        let nodes: Vec<Point> = used
            .iter()
            .map(|&old| self.nodes[old].1.map(|x| x * scale))
            .map(|[x, y, z]| if dim == 2 { [x, y, 0.0] } else { [x, y, z] })
            .collect();
        let node_tags: Vec<i64> = used.iter().map(|&old| self.nodes[old].0).collect();
        let mut built = Built::default();
        for cell in &cells {
            built.push(self, cell, &places, &nodes)?;
        }
        let Built { blocks, cell_tags, regions, .. } = built;
        let tag = |f: Facet| cell_tags[f.block][f.element];
        if let Some([a, b]) = topology::overlapping(&blocks) {
            let message = format!(
                "elements {} and {} lie on the same side of a common side: they overlap, or are one twice",
                tag(a),
                tag(b)
            );
            let help = "remove one of them: Coherence Mesh, or RemoveDuplicateElements";
            return Err(GmshError::of_file(message, help));
        }
        let owners = Owners::of(&blocks);
        let (sides, groups) = self.sides(dim - 1, &owners, &places);
        let meet = Meet::new(&sides, &blocks, pairs);
        let is_meant = |node, facet| meet.has(node, facet);
        if let Some((node, facet)) = topology::hanging(&owners, &blocks, &nodes, is_meant) {
            let message = format!(
                "node {} hangs on a side of element {} that does not have it",
                node_tags[node],
                tag(facet)
            );
            let help = "mesh the parts together, or join them: BooleanFragments, Coherence; or let them meet: [[contact]] with slave and master";
            return Err(GmshError::of_file(message, help));
        }
        if let Some([a, b]) = topology::halved(&owners, &blocks) {
            let message = format!(
                "a face of the hexahedron {} meets a triangle, of element {}: they do not share it",
                tag(a),
                tag(b)
            );
            let help = "mesh the whole body with hexahedra, or with tetrahedra";
            return Err(GmshError::of_file(message, help));
        }
        Ok(Imported {
            unused: self.nodes.len() - nodes.len(),
            mesh: Mesh::new(dim, nodes, blocks, groups),
            regions: regions
                .into_iter()
                .map(|r| r.into_iter().map(|t| self.name(dim, t)).collect())
                .collect(),
            sides,
            node_tags,
            cell_tags,
        })
    }

    /// The nodes that cells have, in the order of the file.
    fn used(&self, cells: &[&Cell]) -> Vec<usize> {
        let mut is_used = vec![false; self.nodes.len()];
        cells.iter().flat_map(|c| &c.nodes).for_each(|&k| is_used[k] = true);
        (0..self.nodes.len()).filter(|&k| is_used[k]).collect()
    }

    /// Nodes of a plane body lie in the plane of x and y.
    fn check_plane(&self, used: &[usize], scale: f64) -> Result<(), GmshError> {
        let size = used.iter().flat_map(|&k| self.nodes[k].1).fold(0.0f64, |m, x| m.max(x.abs()));
        let out = used.iter().find(|&&k| self.nodes[k].1[2].abs() > FLAT * size);
        let Some(&k) = out else { return Ok(()) };
        let (tag, p) = self.nodes[k];
        let message = format!("node {tag} is not in the plane: z = {}", p[2] * scale);
        let help =
            "give a mesh in the plane of x and y; of a body in space the volume, meshed by gmsh -3";
        Err(GmshError::of_file(message, help))
    }

    /// What the groups of sides name.
    fn sides(
        &self,
        dim: usize,
        owners: &Owners,
        places: &[u32],
    ) -> (BTreeMap<String, Sides>, BTreeMap<String, Vec<Facet>>) {
        let mut all: BTreeMap<String, Sides> = BTreeMap::new();
        let mut known: HashSet<(i64, Facet)> = HashSet::new();
        for cell in self.cells.iter().filter(|c| c.of.dim == dim && !c.groups.is_empty()) {
            let found = owners.of_side(cell.nodes.iter().map(|&k| places[k]));
            for &tag in &cell.groups {
                let group = all.entry(self.name(dim, tag)).or_insert(Sides::Boundary(vec![]));
                match (found, group) {
                    (_, Sides::Elsewhere { .. }) => {}
                    ([(_, facet)], Sides::Boundary(facets)) => {
                        if known.insert((tag, *facet)) {
                            facets.push(*facet);
                        }
                    }
                    (other, group) => {
                        let nodes = cell.nodes.iter().map(|&k| self.nodes[k].0).collect();
                        *group = Sides::Elsewhere { nodes, owners: other.len() };
                    }
                }
            }
        }
        let boundary = |(name, sides): (&String, &Sides)| match sides {
            Sides::Boundary(facets) => Some((name.clone(), facets.clone())),
            Sides::Elsewhere { .. } => None,
        };
        let groups = all.iter().filter_map(boundary).collect();
        (all, groups)
    }
}

/// Blocks as they grow.
#[derive(Default)]
struct Built {
    blocks: Vec<Block>,
    cell_tags: Vec<Vec<i64>>,
    /// Physical tags of each region.
    regions: Vec<Vec<i64>>,
    place: HashMap<(ElementKind, usize), usize>,
}

impl Built {
    fn push(
        &mut self,
        file: &File,
        cell: &Cell,
        places: &[u32],
        nodes: &[Point],
    ) -> Result<(), GmshError> {
        let Some(kind) = cell.of.kind() else {
            let message = format!("element {} is a {}", cell.tag, cell.of.name);
            let help = match cell.of.dim {
                3 => "mesh with tetrahedra, hexahedra or prisms",
                _ => "mesh with triangles or quadrilaterals",
            };
            return Err(GmshError::of_file(message, help));
        };
        let is_own = |r: &Vec<i64>| {
            r.len() == cell.groups.len() && cell.groups.iter().all(|g| r.contains(g))
        };
        let region = self.regions.iter().position(is_own).unwrap_or_else(|| {
            let mut groups = cell.groups.clone();
            groups.sort_unstable();
            self.regions.push(groups);
            self.regions.len() - 1
        });
        let mut own: Vec<usize> = cell.nodes.iter().map(|&k| places[k] as usize).collect();
        match topology::turns(kind, &own, nodes) {
            Turn::Right => {}
            Turn::Wrong => kind.turn_round(&mut own),
            Turn::Neither(corner) => {
                let message = format!(
                    "element {} is degenerate or folded: its Jacobian is not of one sign (at the corner of node {})",
                    cell.tag, file.nodes[cell.nodes[corner]].0
                );
                return Err(GmshError::of_file(message, "mesh the body anew there"));
            }
        }
        let block = *self.place.entry((kind, region)).or_insert_with(|| {
            self.blocks.push(Block { kind, region, connectivity: vec![], congruent: false });
            self.cell_tags.push(vec![]);
            self.blocks.len() - 1
        });
        self.blocks[block].connectivity.extend(own);
        self.cell_tags[block].push(cell.tag);
        Ok(())
    }
}
