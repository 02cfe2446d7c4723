//! From the elements of a file to the mesh of a body: cells, regions, sides.

use std::collections::{BTreeMap, HashMap};

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
    /// What the groups of lines name.
    pub sides: BTreeMap<String, Sides>,
    /// Tags of the nodes of the mesh.
    pub node_tags: Vec<i64>,
    /// Tags of the cells, block by block.
    pub cell_tags: Vec<Vec<i64>>,
    /// Nodes of the file that no cell has.
    pub unused: usize,
}

/// Nodes further from the plane than this, over the size of the body, are not in it.
const FLAT: f64 = 1e-9;

impl File {
    /// The mesh of a plane body; coordinates are multiplied by `scale`.
    pub fn body(&self, scale: f64) -> Result<Imported, GmshError> {
        let dim = self.dim();
        let counted = || {
            let of = |(t, n): (Type, usize)| format!("{n} × {}", t.name);
            self.types().into_iter().map(of).collect::<Vec<_>>().join(", ")
        };
        if dim != 2 {
            let help = match dim {
                3 => "bodies of three dimensions are not read yet; give a plane one",
                _ => "mesh the surface too: gmsh -2, and give it a physical group",
            };
            let message = format!("there is no plane body in it (elements: {})", counted());
            return Err(GmshError::of_file(message, help));
        }
        let cells: Vec<&Cell> = self.cells.iter().filter(|c| c.of.dim == 2).collect();
        let order = |c: &&Cell| c.of.nodes > 4;
        if cells.iter().any(order) && !cells.iter().all(order) {
            let message = format!("elements of first and second order are mixed: {}", counted());
            return Err(GmshError::of_file(
                message,
                "mesh with one order: gmsh -order 1 or -order 2",
            ));
        }
        let places = self.used(&cells, scale)?;
        let mut nodes = vec![[0.0; 3]; places.len()];
        let mut node_tags = vec![0; places.len()];
        for (&old, &new) in &places {
            let (tag, p) = self.nodes[old];
            nodes[new] = [p[0] * scale, p[1] * scale, 0.0];
            node_tags[new] = tag;
        }
        let mut built = Built::default();
        for cell in &cells {
            built.push(self, cell, &places, &nodes)?;
        }
        let Built { blocks, cell_tags, regions, .. } = built;
        let owners = owners(&blocks);
        if let Some([a, b]) = overlapping(&blocks) {
            let message = format!(
                "elements {} and {} lie on the same side of a common side: they overlap, or are one twice",
                cell_tags[a.block][a.element], cell_tags[b.block][b.element]
            );
            let help = "remove one of them: Coherence Mesh, or RemoveDuplicateElements";
            return Err(GmshError::of_file(message, help));
        }
        if let Some((node, facet)) = hanging(&owners, &blocks, &nodes) {
            let message = format!(
                "node {} hangs on a side of element {} that does not have it",
                node_tags[node], cell_tags[facet.block][facet.element]
            );
            let help = "mesh the parts together, or join them: BooleanFragments, Coherence";
            return Err(GmshError::of_file(message, help));
        }
        let (sides, groups) = self.sides(&owners, &places);
        Ok(Imported {
            unused: self.nodes.len() - nodes.len(),
            mesh: Mesh::new(2, nodes, blocks, groups),
            regions: regions
                .into_iter()
                .map(|r| r.into_iter().map(|t| self.name(2, t)).collect())
                .collect(),
            sides,
            node_tags,
            cell_tags,
        })
    }

    /// New numbers of the nodes that cells have, in the order of the file; they must lie in the plane.
    fn used(&self, cells: &[&Cell], scale: f64) -> Result<BTreeMap<usize, usize>, GmshError> {
        let mut used: Vec<usize> = cells.iter().flat_map(|c| c.nodes.iter().copied()).collect();
        used.sort_unstable();
        used.dedup();
        let size = used.iter().flat_map(|&k| self.nodes[k].1).fold(0.0f64, |m, x| m.max(x.abs()));
        let out = used.iter().find(|&&k| self.nodes[k].1[2].abs() > FLAT * size);
        if let Some(&k) = out {
            let (tag, p) = self.nodes[k];
            let message = format!("node {tag} is not in the plane: z = {}", p[2] * scale);
            return Err(GmshError::of_file(message, "give a mesh in the plane of x and y"));
        }
        Ok(used.into_iter().enumerate().map(|(new, old)| (old, new)).collect())
    }

    /// What the groups of lines name.
    fn sides(
        &self,
        owners: &Owners,
        places: &BTreeMap<usize, usize>,
    ) -> (BTreeMap<String, Sides>, BTreeMap<String, Vec<Facet>>) {
        let mut all: BTreeMap<String, Sides> = BTreeMap::new();
        for cell in self.cells.iter().filter(|c| c.of.dim == 1) {
            let key: Option<Vec<usize>> =
                cell.nodes.iter().map(|k| places.get(k).copied()).collect();
            let found = key.and_then(|mut key| {
                key.sort_unstable();
                owners.get(&key)
            });
            for &tag in &cell.groups {
                let group = all.entry(self.name(1, tag)).or_insert(Sides::Boundary(vec![]));
                match (found.map(Vec::as_slice), group) {
                    (_, Sides::Elsewhere { .. }) => {}
                    (Some([facet]), Sides::Boundary(facets)) => {
                        if !facets.contains(facet) {
                            facets.push(*facet);
                        }
                    }
                    (other, group) => {
                        let nodes = cell.nodes.iter().map(|&k| self.nodes[k].0).collect();
                        *group =
                            Sides::Elsewhere { nodes, owners: other.map_or(0, <[Facet]>::len) };
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

/// The cells of every side, by its nodes.
type Owners = HashMap<Vec<usize>, Vec<Facet>>;

fn owners(blocks: &[Block]) -> Owners {
    let mut owners: Owners = HashMap::new();
    for (b, block) in blocks.iter().enumerate() {
        let n = block.kind.nodes();
        for (e, nodes) in block.connectivity.chunks_exact(n).enumerate() {
            for side in 0..block.kind.sides() {
                let mut key: Vec<usize> = block.kind.side(side).iter().map(|&l| nodes[l]).collect();
                key.sort_unstable();
                owners.entry(key).or_default().push(Facet { block: b, element: e, side });
            }
        }
    }
    owners
}

/// Two cells on the same side of a common side: going round both, it is passed in the same direction.
fn overlapping(blocks: &[Block]) -> Option<[Facet; 2]> {
    let mut passed: HashMap<[usize; 2], Facet> = HashMap::new();
    for (b, block) in blocks.iter().enumerate() {
        let corners = block.kind.corners();
        for (e, nodes) in block.connectivity.chunks_exact(block.kind.nodes()).enumerate() {
            for side in 0..corners {
                let facet = Facet { block: b, element: e, side };
                if let Some(other) =
                    passed.insert([nodes[side], nodes[(side + 1) % corners]], facet)
                {
                    return Some([other, facet]);
                }
            }
        }
    }
    None
}

/// A node of the boundary that lies within a straight side of it, with that side: parts of the mesh that meet without sharing their nodes.
fn hanging(owners: &Owners, blocks: &[Block], nodes: &[Point]) -> Option<(usize, Facet)> {
    let mut sides: Vec<(&Vec<usize>, Facet)> =
        owners.iter().filter(|(_, f)| f.len() == 1).map(|(key, f)| (key, f[0])).collect();
    sides.sort_unstable_by(|a, b| a.0.cmp(b.0));
    let mut boundary: Vec<usize> = sides.iter().flat_map(|(key, _)| key.iter().copied()).collect();
    boundary.sort_unstable();
    boundary.dedup();
    // along x, so that only what is near is looked at
    boundary.sort_by(|&a, &b| nodes[a][0].total_cmp(&nodes[b][0]));
    for (key, facet) in sides {
        let block = &blocks[facet.block];
        let own = &block.connectivity[block.kind.nodes() * facet.element..];
        let ends = block.kind.side(facet.side);
        let (a, b) = (nodes[own[ends[0]]], nodes[own[ends[1]]]);
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]);
        let within = |&&n: &&usize| {
            let p = [nodes[n][0] - a[0], nodes[n][1] - a[1]];
            let s = (p[0] * along[0] + p[1] * along[1]) / length;
            let off = (p[0] * along[1] - p[1] * along[0]).abs() / length;
            !key.contains(&n)
                && off <= 1e-9 * length
                && s > 1e-6 * length
                && s < (1.0 - 1e-6) * length
        };
        let slack = 1e-9 * length;
        let from = boundary.partition_point(|&n| nodes[n][0] < a[0].min(b[0]) - slack);
        let to = boundary.partition_point(|&n| nodes[n][0] <= a[0].max(b[0]) + slack);
        if let Some(&node) = boundary[from..to.max(from)].iter().find(within) {
            return Some((node, facet));
        }
    }
    None
}

/// Blocks as they grow.
#[derive(Default)]
struct Built {
    blocks: Vec<Block>,
    cell_tags: Vec<Vec<i64>>,
    /// Physical tags of each region.
    regions: Vec<Vec<i64>>,
    place: HashMap<(usize, usize), usize>,
}

impl Built {
    fn push(
        &mut self,
        file: &File,
        cell: &Cell,
        places: &BTreeMap<usize, usize>,
        nodes: &[Point],
    ) -> Result<(), GmshError> {
        let Some(kind) = cell.of.kind() else {
            let message = format!("element {} is a {}", cell.tag, cell.of.name);
            return Err(GmshError::of_file(message, "mesh with triangles or quadrilaterals"));
        };
        let mut groups = cell.groups.clone();
        groups.sort_unstable();
        let region = self.regions.iter().position(|r| *r == groups).unwrap_or_else(|| {
            self.regions.push(groups);
            self.regions.len() - 1
        });
        let mut own: Vec<usize> =
            cell.nodes.iter().filter_map(|k| places.get(k).copied()).collect();
        let corners: Vec<[f64; 2]> =
            own[..kind.corners()].iter().map(|&n| [nodes[n][0], nodes[n][1]]).collect();
        match turns(&corners) {
            Turn::Left => {}
            Turn::Right => turn_round(kind, &mut own),
            Turn::Neither(angle) => {
                let tags: Vec<i64> =
                    cell.nodes[..kind.corners()].iter().map(|&k| file.nodes[k].0).collect();
                let message = format!(
                    "element {} is degenerate or folded: its Jacobian is not of one sign (at the corner of node {})",
                    cell.tag, tags[angle]
                );
                return Err(GmshError::of_file(message, "mesh the body anew there"));
            }
        }
        let key = (kind as usize, region);
        let block = *self.place.entry(key).or_insert_with(|| {
            self.blocks.push(Block { kind, region, connectivity: vec![], congruent: false });
            self.cell_tags.push(vec![]);
            self.blocks.len() - 1
        });
        self.blocks[block].connectivity.extend(own);
        self.cell_tags[block].push(cell.tag);
        Ok(())
    }
}

/// Which way the corners of a cell go round.
enum Turn {
    Left,
    Right,
    /// Not the same way everywhere: at this corner.
    Neither(usize),
}

fn turns(x: &[[f64; 2]]) -> Turn {
    let n = x.len();
    let cross = |k: usize| {
        let (a, b, c) = (x[(k + n - 1) % n], x[k], x[(k + 1) % n]);
        let (p, q) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
        let size = p[0].hypot(p[1]) * q[0].hypot(q[1]);
        (p[0] * q[1] - p[1] * q[0]) / size
    };
    let all: Vec<f64> = (0..n).map(cross).collect();
    let sign = all.iter().sum::<f64>().signum();
    match all.iter().position(|c| c.is_nan() || c * sign <= 1e-9) {
        Some(k) => Turn::Neither(k),
        None if sign > 0.0 => Turn::Left,
        None => Turn::Right,
    }
}

/// The same cell with its nodes the other way round.
fn turn_round(kind: ElementKind, nodes: &mut [usize]) {
    let swaps: &[(usize, usize)] = match kind {
        ElementKind::Bar2 => &[],
        ElementKind::Tri3 => &[(1, 2)],
        ElementKind::Tri6 => &[(1, 2), (3, 5)],
        ElementKind::Quad4 => &[(1, 3)],
        ElementKind::Quad8 | ElementKind::Quad9 => &[(1, 3), (4, 7), (5, 6)],
    };
    swaps.iter().for_each(|&(a, b)| nodes.swap(a, b));
}
