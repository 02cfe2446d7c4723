//! The same body with more unknowns: elements of second order in place of those of first order, or each element in pieces of half its size.
//!
//! New nodes lie where the shape functions of the old elements put them: on curved sides of elements of second order, on straight ones of first order. Groups of sides stay.

use std::collections::{BTreeMap, HashMap};

use super::element::weighted;
use super::shape::{places, values};
use crate::mesh::{Basis, Block, ElementKind, Facet, Family, Mesh, Point};

/// How a mesh differs from the one that is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Finer {
    /// It does not.
    #[default]
    No,
    /// Elements of first order have the nodes of those of second order; others stay.
    Raised,
    /// Elements are cut into pieces of half their size.
    Halved,
}

/// Local coordinates in the element that is cut, of the corners of a piece.
type Piece = Vec<Point>;

/// What a node is: corners of the old mesh with their shares of 64, ascending.
type Name = Vec<(usize, u8)>;

/// Shares of corners are multiples of this part.
const PARTS: f64 = 64.0;

/// The mesh; none where two nodes of it stand for the same place of the same element, as those of a crack of one side do.
pub fn finer(mesh: &Mesh, how: Finer) -> Option<Mesh> {
    if how == Finer::No {
        return Some(mesh.clone());
    }
    let mut known: HashMap<Name, usize> = HashMap::new();
    for e in mesh.elements() {
        let linear = e.kind.linear();
        for (local, &node) in places(e.kind).iter().zip(e.nodes) {
            let name = name(linear, *local, e.nodes);
            if *known.entry(name).or_insert(node) != node {
                return None;
            }
        }
    }
    let mut nodes = mesh.nodes().to_vec();
    let mut blocks = vec![];
    for block in mesh.blocks() {
        let kind = block.kind;
        let (linear, target) =
            (kind.linear(), if how == Finer::Raised { raised(kind) } else { kind });
        let pieces = pieces(kind, how);
        let mut connectivity = vec![];
        for own in block.connectivity.chunks_exact(kind.nodes()) {
            let x: Vec<Point> = own.iter().map(|&n| mesh.nodes()[n]).collect();
            for (piece, local) in
                pieces.iter().flat_map(|p| places(target).iter().map(move |l| (p, l)))
            {
                let at = weighted(values(linear, *local).into_iter(), piece.iter());
                let place = || weighted(values(kind, at).into_iter(), x.iter());
                let node = *known.entry(name(linear, at, own)).or_insert_with(|| {
                    nodes.push(place());
                    nodes.len() - 1
                });
                connectivity.push(node);
            }
        }
        // pieces of triangles lie turned
        let congruent = block.congruent && (pieces.len() == 1 || kind.family() == Family::Cube);
        blocks.push(Block { kind: target, region: block.region, connectivity, congruent });
    }
    let groups: Vec<(String, Vec<Facet>)> = mesh
        .groups()
        .map(|group| {
            let of = |f: &Facet| sides(mesh.blocks()[f.block].kind, f, how);
            (group.to_owned(), mesh.group(group).iter().flat_map(of).collect())
        })
        .collect();
    let all = Mesh::new(mesh.dim(), nodes, blocks, BTreeMap::new());
    let chained = groups.into_iter().map(|(name, facets)| (name, all.in_chains(&facets)));
    let chained: Vec<_> = chained.collect();
    Some(all.with_groups(chained))
}

/// A place of an element by its corners.
fn name(linear: ElementKind, local: Point, nodes: &[usize]) -> Name {
    let shares = values(linear, local).into_iter().map(|w| (PARTS * w).round() as u8);
    let mut name: Name =
        nodes.iter().copied().zip(shares).filter(|(_, share)| *share > 0).collect();
    name.sort_unstable();
    name
}

/// The kind of second order with these corners; of bars, which have none, themselves.
fn raised(kind: ElementKind) -> ElementKind {
    let same = |k: &ElementKind| {
        (k.family(), k.dim(), k.basis()) == (kind.family(), kind.dim(), Basis::Quadratic)
    };
    match kind.is_quadratic() {
        true => kind,
        false => ElementKind::ALL.into_iter().find(same).unwrap_or(kind),
    }
}

/// The pieces of an element.
fn pieces(kind: ElementKind, how: Finer) -> Vec<Piece> {
    let corners = places(kind.linear());
    if how == Finer::Raised {
        return vec![corners.to_vec()];
    }
    let middle = |a: Point, b: Point| -> Point { std::array::from_fn(|c| 0.5 * (a[c] + b[c])) };
    // the one at each corner is the whole at half its size
    let at_corner = |corners: &[Point], k: usize| -> Piece {
        corners.iter().map(|x| middle(corners[k], *x)).collect()
    };
    match (kind.family(), kind.dim()) {
        (Family::Cube, _) => (0..corners.len()).map(|k| at_corner(corners, k)).collect(),
        (Family::Simplex, 2) => triangles(corners),
        (Family::Simplex, _) => {
            let m = |a: usize, b: usize| middle(corners[a], corners[b]);
            let mut all: Vec<Piece> = (0..4).map(|k| at_corner(corners, k)).collect();
            // four around the diagonal between the middles of two opposite edges
            let (from, to) = (m(0, 2), m(1, 3));
            let around = [m(0, 1), m(1, 2), m(2, 3), m(0, 3)];
            for k in 0..4 {
                let mut piece = vec![from, to, around[k], around[(k + 1) % 4]];
                let edge = |k: usize| -> nalgebra::Vector3<f64> {
                    nalgebra::Vector3::from_fn(|c, _| piece[k][c] - piece[0][c])
                };
                if edge(1).cross(&edge(2)).dot(&edge(3)) < 0.0 {
                    piece.swap(2, 3);
                }
                all.push(piece);
            }
            all
        }
        (Family::Prism, _) => {
            let at =
                |piece: &Piece, z: f64| piece.iter().map(|p| [p[0], p[1], z]).collect::<Piece>();
            let all = triangles(&corners[..3]);
            let halves = [(-1.0, 0.0), (0.0, 1.0)];
            let of = |p: &Piece| halves.map(|(low, high)| [at(p, low), at(p, high)].concat());
            all.iter().flat_map(of).collect()
        }
    }
}

/// Four pieces of a triangle.
fn triangles(corners: &[Point]) -> Vec<Piece> {
    let middle = |a: usize, b: usize| -> Point {
        std::array::from_fn(|c| 0.5 * (corners[a][c] + corners[b][c]))
    };
    let (a, b, c) = (middle(0, 1), middle(1, 2), middle(2, 0));
    let [p, q, r] = [corners[0], corners[1], corners[2]];
    vec![vec![p, a, c], vec![a, q, b], vec![c, b, r], vec![a, b, c]]
}

/// The sides of pieces that lie on a side of an element.
fn sides(kind: ElementKind, facet: &Facet, how: Finer) -> Vec<Facet> {
    let linear = kind.linear();
    let of_side = linear.side(facet.side);
    let lies_on = |p: &Point| {
        let weights = values(linear, *p);
        weights.iter().enumerate().all(|(k, w)| w.abs() < 1e-12 || of_side.contains(&k))
    };
    let all = pieces(kind, how);
    let mut found = vec![];
    for (k, piece) in all.iter().enumerate() {
        for side in 0..linear.sides() {
            if linear.side(side).iter().all(|&c| lies_on(&piece[c])) {
                let element = all.len() * facet.element + k;
                found.push(Facet { block: facet.block, element, side });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Material, Shape, StressState};

    /// One distorted element of each kind, its first side a group.
    fn alone(kind: ElementKind) -> Mesh {
        let bend = |p: &Point| -> Point {
            let [x, y, z] = *p;
            [x + 0.1 * y * y, y - 0.05 * x * z, z + 0.1 * x]
        };
        let nodes: Vec<Point> = match kind.dim() {
            1 => places(kind).to_vec(),
            2 => places(kind)
                .iter()
                .map(|p| bend(&[p[0], p[1], 0.0]))
                .map(|[x, y, _]| [x, y, 0.0])
                .collect(),
            _ => places(kind).iter().map(bend).collect(),
        };
        let connectivity = (0..kind.nodes()).collect();
        let block = Block { kind, region: 0, connectivity, congruent: false };
        let first = vec![Facet { block: 0, element: 0, side: 0 }];
        Mesh::new(kind.dim(), nodes, vec![block], BTreeMap::from([("side".into(), first)]))
    }

    fn volume(mesh: &Mesh) -> f64 {
        let state = match mesh.dim() {
            3 => StressState::Solid,
            _ => StressState::PlaneStress { thickness: 1.0 },
        };
        let m = match mesh.dim() {
            1 => Material::bar(1.0, 1.0, 1.0),
            _ => Material { young: 1.0, poisson: 0.3, density: 1.0, state },
        };
        let of = |e| {
            let x = mesh.corners(e);
            let shape = Shape { kind: e.kind, x: &x };
            for local in places(e.kind) {
                assert!(e.kind.dim() == 1 || shape.determinant(*local) > 0.0, "{:?}", e.kind);
            }
            shape.volume(&m)
        };
        mesh.elements().map(of).sum()
    }

    fn area(mesh: &Mesh) -> f64 {
        let of = |f: &Facet| {
            let e = mesh.element(*f);
            let x = mesh.corners(e);
            let side = Shape { kind: e.kind, x: &x }.side(f.side);
            side.iter().map(|p| p.area).sum::<f64>()
        };
        mesh.group("side").iter().map(of).sum()
    }

    /// Volumes and the areas of sides stay, elements are not turned inside out, neighbours share their nodes.
    #[test]
    fn pieces_fill_their_element_and_its_side() {
        for kind in ElementKind::ALL {
            let mesh = alone(kind);
            let halved = finer(&mesh, Finer::Halved).unwrap();
            let count = if kind.dim() == 1 { 2 } else { 1 << kind.dim() };
            assert_eq!(halved.n_elements(), count, "{kind:?}");
            // of curved sides pieces of serendipity elements are others by the third order
            let curved = kind.is_quadratic();
            let slack = if curved { 2e-3 } else { 1e-12 };
            let (v, a) = (volume(&mesh), area(&mesh));
            assert!((volume(&halved) / v - 1.0).abs() < slack, "{kind:?} {} {v}", volume(&halved));
            assert!(
                (area(&halved) / a - 1.0).abs() < 10.0 * slack,
                "{kind:?} {} {a}",
                area(&halved)
            );
            let parts = halved.parts();
            assert!(parts.iter().all(|p| *p == 0), "{kind:?}");
            let raised = finer(&mesh, Finer::Raised).unwrap();
            assert_eq!(raised.n_elements(), 1);
            assert_eq!(raised.elements().next().unwrap().kind.is_quadratic(), kind.dim() > 1);
            assert!((volume(&raised) / v - 1.0).abs() < 1e-12, "{kind:?}");
            assert!((area(&raised) / a - 1.0).abs() < 1e-9, "{kind:?}");
            assert!(raised.nodes()[..kind.nodes()] == mesh.nodes()[..]);
        }
    }
}
