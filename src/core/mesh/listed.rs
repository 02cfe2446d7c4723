//! Nodes, cells and sets of them, as decks and VTK's files list them, as the [`File`] that a mesh of Gmsh gives.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::gmsh::{Cell, File, Type, types};
use super::{ElementKind, Point};

/// What a file lists. Cells have their nodes in this program's order.
#[derive(Debug, Default)]
pub(super) struct Listed {
    pub version: String,
    /// Numbers and places.
    pub nodes: Vec<(i64, Point)>,
    /// Numbers, types, places of the nodes in the list.
    pub cells: Vec<(i64, Type, Vec<usize>)>,
    /// Cells by their places in the list: of the body, or of its sides.
    pub cell_sets: Vec<(String, Vec<usize>)>,
    /// Nodes: they stand for the sides of the boundary all of whose nodes they have.
    pub node_sets: Vec<(String, HashSet<usize>)>,
    /// Sides of cells.
    pub surfaces: Vec<(String, Vec<(usize, usize)>)>,
}

/// Nodes of an element that are in the order of VTK, in that of this program.
pub(super) fn ordered(kind: ElementKind, own: &[usize]) -> Vec<usize> {
    let places: Vec<usize> = (0..kind.nodes()).collect();
    let mut nodes = vec![0; kind.nodes()];
    for (of_file, place) in kind.ordered(&places).into_iter().enumerate() {
        nodes[place as usize] = own[of_file];
    }
    nodes
}

/// The corners of a side, ascending.
pub(super) fn corners(kind: ElementKind, nodes: &[usize], side: usize) -> Vec<usize> {
    let count = kind.linear().side(side).len();
    let mut own: Vec<usize> = kind.side(side)[..count].iter().map(|&l| nodes[l]).collect();
    own.sort_unstable();
    own
}

impl Listed {
    /// The cells of the highest dimension and their groups; sets of nodes and surfaces as groups of sides.
    pub fn file(self) -> File {
        let dim = self.cells.iter().map(|c| c.1.dim).max().unwrap_or(2);
        let mut names = BTreeMap::new();
        let cell = |(tag, of, nodes): &(i64, Type, Vec<usize>)| Cell {
            tag: *tag,
            of: *of,
            groups: vec![],
            nodes: nodes.clone(),
        };
        let mut cells: Vec<Cell> = self.cells.iter().map(cell).collect();
        let mut next = 1;
        for (name, own) in &self.cell_sets {
            for &k in own {
                cells[k].groups.push(next);
                names.insert((self.cells[k].1.dim, next), name.clone());
            }
            if own.is_empty() {
                names.insert((dim, next), name.clone());
            }
            next += 1;
        }
        let full = |k: usize| {
            let (_, of, nodes) = &self.cells[k];
            of.kind().filter(|_| of.dim == dim).map(|kind| (kind, nodes))
        };
        // sides of the boundary, by their corners
        let mut owners: HashMap<Vec<usize>, Vec<(usize, usize)>> = HashMap::new();
        for element in 0..self.cells.len() {
            let Some((kind, nodes)) = full(element) else { continue };
            for side in 0..kind.sides() {
                owners.entry(corners(kind, nodes, side)).or_default().push((element, side));
            }
        }
        let mut boundary: Vec<(usize, usize)> =
            owners.values().filter(|o| o.len() == 1).map(|o| o[0]).collect();
        boundary.sort_unstable();
        let of_side = |(element, side): (usize, usize)| -> Vec<usize> {
            let of_kind = |(kind, nodes): (ElementKind, &Vec<usize>)| -> Vec<usize> {
                kind.side(side).iter().map(|&l| nodes[l]).collect()
            };
            full(element).map(of_kind).unwrap_or_default()
        };
        let mut groups: Vec<(&String, Vec<(usize, usize)>)> = vec![];
        for (name, set) in &self.node_sets {
            let is_in = |at: &(usize, usize)| of_side(*at).iter().all(|n| set.contains(n));
            groups.push((name, boundary.iter().copied().filter(is_in).collect()));
        }
        groups.extend(self.surfaces.iter().map(|(name, own)| (name, own.clone())));
        let mut tag = self.cells.iter().map(|c| c.0).max().unwrap_or(0);
        let lines: Vec<Type> =
            types().filter(|t| t.dim == 1 && (2..=3).contains(&t.nodes)).collect();
        for (name, sides) in groups {
            // a name that sets and surfaces share is that of the surface
            names.retain(|key, own| own != name || key.0 == dim);
            for at in sides {
                let own = of_side(at);
                let face = full(at.0).and_then(|(kind, _)| kind.face(at.1));
                let of = match face {
                    Some(face) => types().find(|t| t.number == face.gmsh().0),
                    None => lines.iter().copied().find(|t| t.nodes == own.len()),
                };
                let Some(of) = of else { continue };
                tag += 1;
                cells.push(Cell { tag, of, groups: vec![next], nodes: own });
            }
            names.insert((dim - 1, next), name.clone());
            next += 1;
        }
        File { version: self.version, nodes: self.nodes, cells, names }
    }
}
