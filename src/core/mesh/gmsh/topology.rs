//! Which cells have a side; what in a mesh is no mesh: cells that overlap, nodes that hang, faces that are not shared, cells inside out.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::mesh::point::{cross, dot, minus, norm};
use crate::mesh::{Block, ElementKind, Facet, Point, bounds, corner};

/// The number of a node that no cell has.
pub(super) const NOWHERE: u32 = u32::MAX;

/// The nodes of a side in ascending order, filled up behind.
type Key = [u32; 9];

fn key(nodes: impl Iterator<Item = u32>) -> Key {
    let mut key = [NOWHERE; 9];
    nodes.zip(&mut key).for_each(|(n, k)| *k = n);
    key.sort_unstable();
    key
}

/// All sides of all cells with their nodes.
fn sides(blocks: &[Block]) -> impl Iterator<Item = (Facet, ElementKind, &[usize])> {
    blocks.iter().enumerate().flat_map(|(block, b)| {
        let cells = b.connectivity.chunks_exact(b.kind.nodes()).enumerate();
        cells.flat_map(move |(element, nodes)| {
            (0..b.kind.sides()).map(move |side| (Facet { block, element, side }, b.kind, nodes))
        })
    })
}

/// The cells of every side, found by its nodes.
pub(super) struct Owners(Vec<(Key, Facet)>);

impl Owners {
    pub fn of(blocks: &[Block]) -> Owners {
        let of_side = |(facet, kind, nodes): (Facet, ElementKind, &[usize])| {
            (key(kind.side(facet.side).iter().map(|&l| nodes[l] as u32)), facet)
        };
        let mut all: Vec<(Key, Facet)> = sides(blocks).map(of_side).collect();
        all.par_sort_by(|a, b| a.0.cmp(&b.0));
        Owners(all)
    }

    /// The cells that have the side of these nodes.
    pub fn of_side(&self, nodes: impl Iterator<Item = u32>) -> &[(Key, Facet)] {
        let key = key(nodes);
        let first = self.0.partition_point(|s| s.0 < key);
        let n = self.0[first..].iter().take_while(|s| s.0 == key).count();
        &self.0[first..first + n]
    }

    /// The sides that one cell has alone.
    fn boundary(&self) -> impl Iterator<Item = Facet> {
        let of = self.0.chunk_by(|a, b| a.0 == b.0);
        of.filter(|owners| owners.len() == 1).map(|owners| owners[0].1)
    }
}

/// Two cells on the same side of a common side: going round both, it is passed in the same direction.
pub(super) fn overlapping(blocks: &[Block]) -> Option<[Facet; 2]> {
    let passed = |(facet, kind, nodes): (Facet, ElementKind, &[usize])| -> ([u32; 4], Facet) {
        let mut path = [NOWHERE; 4];
        match kind.face(facet.side) {
            Some(face) => {
                let corners = &kind.side(facet.side)[..face.corners()];
                // round from the lowest number
                let first = (0..corners.len()).min_by_key(|&k| nodes[corners[k]]).unwrap_or(0);
                let round = corners.iter().cycle().skip(first).take(corners.len());
                round.zip(&mut path).for_each(|(&l, p)| *p = nodes[l] as u32);
            }
            None => {
                let ends = [facet.side, (facet.side + 1) % kind.corners()];
                ends.iter().zip(&mut path).for_each(|(&l, p)| *p = nodes[l] as u32);
            }
        }
        (path, facet)
    };
    let mut all: Vec<_> = sides(blocks).map(passed).collect();
    all.par_sort_by(|a, b| a.0.cmp(&b.0));
    let twice = all.windows(2).find(|w| w[0].0 == w[1].0);
    twice.map(|w| [w[0].1, w[1].1])
}

/// A node of the boundary that lies within a straight or flat side of it, with that side: parts of the mesh that meet without sharing their nodes. Nodes and sides of two
/// surfaces that are meant to meet may do so.
pub(super) fn hanging(
    owners: &Owners,
    blocks: &[Block],
    nodes: &[Point],
    meet: impl Fn(usize, Facet) -> bool + Sync,
) -> Option<(usize, Facet)> {
    let own = |facet: Facet| -> Vec<usize> {
        let b = &blocks[facet.block];
        let first = b.kind.nodes() * facet.element;
        b.kind.side(facet.side).iter().map(|l| b.connectivity[first + l]).collect()
    };
    let mut sides: Vec<(Facet, Vec<usize>)> = owners.boundary().map(|f| (f, own(f))).collect();
    sides.sort_unstable_by(|a, b| a.1.cmp(&b.1));
    let mut boundary: Vec<usize> = sides.iter().flat_map(|s| s.1.iter().copied()).collect();
    boundary.sort_unstable();
    boundary.dedup();
    let extent = |s: &(Facet, Vec<usize>)| {
        let [low, high] = bounds(s.1.iter().map(|&n| &nodes[n]));
        (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max)
    };
    let mean = sides.iter().map(extent).sum::<f64>() / sides.len() as f64;
    let grid = Grid::new(&boundary, nodes, mean);
    sides.par_iter().find_map_first(|(facet, own)| {
        let corners = blocks[facet.block].kind.side_corners(facet.side);
        let all: Vec<Point> = own.iter().map(|&n| nodes[n]).collect();
        let (x, others) = all.split_at(corners);
        let size = extent(&(*facet, own.clone()));
        if !is_straight(x, others, 1e-6 * size) {
            return None;
        }
        let slack = 1e-9 * size;
        let within = |&n: &usize| {
            let apart = |&m: &usize| distance(&nodes[m], &nodes[n]) > 1e-6 * size;
            own.iter().all(apart) && off(x, &nodes[n]) <= slack
        };
        let near = grid.near(bounds(x), slack);
        near.filter(|&n| within(&n) && !meet(n, *facet)).min().map(|node| (node, *facet))
    })
}

/// Whether a side is what its corners say: its other nodes are in the middle between two of them, or of all.
fn is_straight(corners: &[Point], others: &[Point], slack: f64) -> bool {
    let middle = |of: &[&Point]| -> Point {
        std::array::from_fn(|c| of.iter().map(|x| x[c]).sum::<f64>() / of.len() as f64)
    };
    let centre = middle(&corners.iter().collect::<Vec<_>>());
    let pairs = corners.iter().flat_map(|a| corners.iter().map(move |b| [a, b]));
    let middles: Vec<Point> = pairs.map(|pair| middle(&pair)).chain([centre]).collect();
    others.iter().all(|x| middles.iter().any(|m| distance(x, m) <= slack))
}

fn distance(a: &Point, b: &Point) -> f64 {
    norm(&minus(a, b))
}

/// How far a point is from a segment, a triangle, or the two triangles of a quadrilateral; infinite where it does not lie above it.
fn off(corners: &[Point], p: &Point) -> f64 {
    match corners {
        [a, b] => {
            let (along, to) = (minus(b, a), minus(p, a));
            let s = dot(&to, &along) / dot(&along, &along);
            let foot = std::array::from_fn(|c| a[c] + s * along[c]);
            if (0.0..=1.0).contains(&s) { distance(p, &foot) } else { f64::INFINITY }
        }
        [a, b, c] => {
            let normal = cross(&minus(b, a), &minus(c, a));
            let area = norm(&normal);
            let share = |p: &Point, q: &Point, r: &Point| {
                dot(&cross(&minus(q, p), &minus(r, p)), &normal) / (area * area)
            };
            let least = share(p, b, c).min(share(a, p, c)).min(share(a, b, p));
            let height = dot(&minus(p, a), &normal).abs() / area;
            if least >= -1e-9 { height } else { f64::INFINITY }
        }
        [a, b, c, d] => off(&[*a, *b, *c], p).min(off(&[*a, *c, *d], p)),
        _ => f64::INFINITY,
    }
}

/// Points in boxes, so that only what is near is looked at.
struct Grid<'n> {
    boxes: HashMap<[i64; 3], Vec<usize>>,
    all: &'n [usize],
    size: f64,
}

impl<'n> Grid<'n> {
    fn new(all: &'n [usize], nodes: &[Point], size: f64) -> Grid<'n> {
        let mut boxes: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        let place = |p: &Point| p.map(|x| (x / size).floor() as i64);
        all.iter().for_each(|&n| boxes.entry(place(&nodes[n])).or_default().push(n));
        Grid { boxes, all, size }
    }

    /// What may lie in a region.
    fn near(&self, [low, high]: [Point; 2], slack: f64) -> Box<dyn Iterator<Item = usize> + '_> {
        let from = low.map(|x| ((x - slack) / self.size).floor() as i64);
        let to = high.map(|x| ((x + slack) / self.size).floor() as i64);
        let count = (0..3).map(|c| (to[c] - from[c] + 1) as f64).product::<f64>();
        if count > self.boxes.len() as f64 {
            return Box::new(self.all.iter().copied());
        }
        let places = (from[0]..=to[0]).flat_map(move |x| {
            (from[1]..=to[1]).flat_map(move |y| (from[2]..=to[2]).map(move |z| [x, y, z]))
        });
        Box::new(places.filter_map(|p| self.boxes.get(&p)).flatten().copied())
    }
}

/// A quadrilateral on the boundary, half of which is the triangle of another cell: the two do not share it.
pub(super) fn halved(owners: &Owners, blocks: &[Block]) -> Option<[Facet; 2]> {
    let corners_of = |facet: Facet, corners: usize| -> Vec<u32> {
        let b = &blocks[facet.block];
        let first = b.kind.nodes() * facet.element;
        let own = &b.kind.side(facet.side)[..corners];
        own.iter().map(|l| b.connectivity[first + l] as u32).collect()
    };
    let (triangles, squares): (Vec<Facet>, Vec<Facet>) = owners
        .boundary()
        .filter(|f| blocks[f.block].kind.face(f.side).is_some())
        .partition(|f| blocks[f.block].kind.side_corners(f.side) == 3);
    if triangles.is_empty() || squares.is_empty() {
        return None;
    }
    let of_nodes: HashMap<Key, Facet> =
        triangles.into_iter().map(|f| (key(corners_of(f, 3).into_iter()), f)).collect();
    squares.into_iter().find_map(|square| {
        let corners = corners_of(square, 4);
        (0..4).find_map(|left_out| {
            let half = (0..4).filter(|k| *k != left_out).map(|k| corners[k]);
            of_nodes.get(&key(half)).map(|&triangle| [square, triangle])
        })
    })
}

/// Which way the corners of a cell go round.
pub(super) enum Turn {
    /// As they should.
    Right,
    /// The other way: it is inside out.
    Wrong,
    /// Not the same way everywhere: at this corner.
    Neither(usize),
}

/// The sign of the Jacobian at the corners of a cell.
pub(super) fn turns(kind: ElementKind, own: &[usize], nodes: &[Point]) -> Turn {
    let corners: Vec<Point> = own[..kind.corners()].iter().map(|&n| nodes[n]).collect();
    let all = || (0..corners.len()).map(|k| corner::span(kind, &corners, k));
    let sign = all().sum::<f64>().signum();
    match all().position(|c| c.is_nan() || c * sign <= 1e-9) {
        Some(k) => Turn::Neither(k),
        None if sign > 0.0 => Turn::Right,
        None => Turn::Wrong,
    }
}
