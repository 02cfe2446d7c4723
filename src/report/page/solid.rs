//! A body in space on a page: the triangles of its surface, a coarser set of them for who cannot draw all, and lines.

use std::collections::{HashMap, HashSet};

use serde_json::{Value, json};

use super::block::{single, whole};
use super::drawn::Drawn;
use crate::mesh::Point;
use crate::mesh::point::{cross, minus, norm};
use crate::report::surface::{LINED, Surface, eye};
use crate::store::Stored;

/// Most triangles of a page.
const MOST: usize = 300_000;
/// Those that a browser without a graphics processor draws while the body moves.
const COARSE: usize = 20_000;

type Triangle = [usize; 3];

/// What is drawn of the body, and its arrays; nodes are counted among those that are drawn.
pub(super) fn solid(stored: &Stored) -> (Drawn, Value) {
    let surface = Surface::of(stored);
    let mut all: Vec<Triangle> = vec![];
    let (mut lines, mut known) = ([vec![], vec![]], HashSet::new());
    for face in &surface.faces {
        for piece in face.kind.pieces() {
            let node = |l: usize| face.nodes[piece[l]];
            all.extend((2..piece.len()).map(|l| [node(0), node(l - 1), node(l)]));
            for stretch in surface.stretches(face, piece) {
                let [a, b] = stretch.ends.map(|l| face.nodes[l]);
                let is_drawn = stretch.sharp || surface.faces.len() <= LINED;
                if is_drawn && known.insert([a.min(b), a.max(b)]) {
                    lines[usize::from(stretch.sharp)].push([a, b]);
                }
            }
        }
    }
    let place = |n: usize| stored.place(n);
    let count = all.len();
    let fine = if count > MOST { coarsened(&all, &place, MOST) } else { all };
    let coarse = if fine.len() > COARSE { coarsened(&fine, &place, COARSE) } else { vec![] };
    // in the order of the mesh
    let mut nodes: Vec<usize> = fine.iter().chain(&coarse).flatten().copied().collect();
    nodes.extend(lines.iter().flatten().flatten());
    let bearing = stored.nodes_that_bear();
    nodes.extend(&bearing);
    nodes.sort_unstable();
    nodes.dedup();
    let number: HashMap<usize, usize> = nodes.iter().enumerate().map(|(k, &n)| (n, k)).collect();
    let numbered = |of: &[usize]| whole(of.iter().map(|n| number[n]));
    let value = json!({
        "nodes": single(nodes.iter().flat_map(|&n| stored.place(n))),
        "triangles": numbered(fine.as_flattened()),
        "coarse": numbered(coarse.as_flattened()),
        "count": count,
        "lines": numbered(lines[0].as_flattened()),
        "edges": numbered(lines[1].as_flattened()),
        "bearing": numbered(&bearing),
        "eye": eye(stored),
    });
    (Drawn { nodes, components: 3, bearing }, value)
}

/// At most so many triangles over the same nodes: all nodes within a cube are that nearest to their middle.
fn coarsened(all: &[Triangle], place: &dyn Fn(usize) -> Point, most: usize) -> Vec<Triangle> {
    let mut nodes: Vec<usize> = all.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    let low: Point =
        std::array::from_fn(|c| nodes.iter().map(|&n| place(n)[c]).fold(f64::INFINITY, f64::min));
    // a side of the cubes at which the surface would have that many triangles, two of them a square
    let area: f64 = all.iter().map(|t| area(t.map(place))).sum();
    let mut side = (2.0 * area / most as f64).sqrt();
    loop {
        let cube = |n: usize| minus(&place(n), &low).map(|x| (x / side) as i64);
        let mut within: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        nodes.iter().for_each(|&n| within.entry(cube(n)).or_default().push(n));
        let mut stands_for: HashMap<usize, usize> = HashMap::new();
        for own in within.values() {
            let middle: Point = std::array::from_fn(|c| {
                own.iter().map(|&n| place(n)[c]).sum::<f64>() / own.len() as f64
            });
            let distance = |n: usize| minus(&place(n), &middle).map(|x| x * x).iter().sum::<f64>();
            let nearest = own.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            stands_for.extend(own.iter().map(|&n| (n, nearest.unwrap_or(n))));
        }
        let mut known = HashSet::new();
        let is_new = |t: &Triangle| {
            let mut key = *t;
            key.sort_unstable();
            key[0] != key[1] && key[1] != key[2] && known.insert(key)
        };
        let left: Vec<Triangle> =
            all.iter().map(|t| t.map(|n| stands_for[&n])).filter(is_new).collect();
        if left.len() <= most {
            return left;
        }
        side *= 1.2;
    }
}

fn area([a, b, c]: [Point; 3]) -> f64 {
    0.5 * norm(&cross(&minus(&b, &a), &minus(&c, &a)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of a sheet of `n × n` squares on a unit square.
    fn sheet(n: usize) -> (Vec<Triangle>, impl Fn(usize) -> Point) {
        let at = move |i: usize, j: usize| i * (n + 1) + j;
        let square = |(i, j): (usize, usize)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        let all = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).flat_map(square).collect();
        let place =
            move |k: usize| [(k / (n + 1)) as f64 / n as f64, (k % (n + 1)) as f64 / n as f64, 0.0];
        (all, place)
    }

    #[test]
    fn a_coarser_surface_is_the_same_with_fewer_triangles() {
        let (all, place) = sheet(60);
        let left = coarsened(&all, &place, 500);
        assert!(left.len() <= 500 && left.len() > 150, "{}", left.len());
        // it covers the sheet once, but for less than a cube at its rim
        let covered: f64 = left.iter().map(|t| area(t.map(&place))).sum();
        assert!(covered < 1.0 + 1e-12 && covered > 0.85, "{covered}");
        let down = |t: &Triangle| {
            let [a, b, c] = t.map(&place);
            cross(&minus(&b, &a), &minus(&c, &a))[2] < -1e-12
        };
        assert!(!left.iter().any(down), "a triangle is turned over");
        assert_eq!(coarsened(&all, &place, all.len()), all);
    }
}
