//! A body in space on a page: the triangles of its surface, a coarser set of them for who cannot draw all, and lines.

use std::collections::{HashMap, HashSet};

use serde_json::{Value, json};

use super::block::{single, whole};
use super::drawn::Drawn;
use crate::mesh::Point;
use crate::mesh::point::{cross, minus, norm, plus};
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
    // those that bear contact come first
    let mut all: [Vec<Triangle>; 2] = [vec![], vec![]];
    let (mut lines, mut known) = ([vec![], vec![]], HashSet::new());
    for face in &surface.faces {
        for piece in face.kind.pieces() {
            let node = |l: usize| face.nodes[piece[l]];
            let own = (2..piece.len()).map(|l| [node(0), node(l - 1), node(l)]);
            all[usize::from(!face.touches)].extend(own);
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
    let size = |t: &[Vec<Triangle>; 2]| t[0].len() + t[1].len();
    let count = size(&all);
    let fine = if count > MOST { coarsened(&all, &place, MOST) } else { all };
    let coarse = match size(&fine) > COARSE {
        true => coarsened(&fine, &place, COARSE),
        false => [vec![], vec![]],
    };
    let touching = [&fine, &coarse].map(|t| t[0].len());
    let [fine, coarse] = [fine, coarse].map(|t| t.concat());
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
        "touching": touching,
        "count": count,
        "lines": numbered(lines[0].as_flattened()),
        "edges": numbered(lines[1].as_flattened()),
        "bearing": numbered(&bearing),
        "eye": eye(stored),
    });
    (Drawn { nodes, components: 3, bearing }, value)
}

/// At most so many triangles over the same nodes: all nodes of one part of the surface within a cube, where it faces the
/// same way, are that nearest to their middle.
fn coarsened(
    all: &[Vec<Triangle>; 2],
    place: &dyn Fn(usize) -> Point,
    most: usize,
) -> [Vec<Triangle>; 2] {
    let every = || all.iter().flatten();
    let mut nodes: Vec<usize> = every().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    let low: Point =
        std::array::from_fn(|c| nodes.iter().map(|&n| place(n)[c]).fold(f64::INFINITY, f64::min));
    let part_of = parts(every());
    let mut normals: HashMap<usize, Point> = HashMap::new();
    for t in every() {
        let normal = normal(t.map(place));
        for n in t {
            let sum = normals.entry(*n).or_insert([0.0; 3]);
            *sum = plus(sum, &normal);
        }
    }
    // the axis along which a node faces most, and which way
    let faces = |n: usize| {
        let own = normals[&n];
        let axis = (0..3).max_by(|&a, &b| own[a].abs().total_cmp(&own[b].abs())).unwrap_or(0);
        2 * axis + usize::from(own[axis] < 0.0)
    };
    // a side of the cubes at which the surface would have that many triangles, two of them a square
    let area: f64 = every().map(|t| area(t.map(place))).sum();
    let mut side = (2.0 * area / most as f64).sqrt();
    loop {
        let cube = |n: usize| minus(&place(n), &low).map(|x| (x / side) as i64);
        let mut within: HashMap<([i64; 3], usize, usize), Vec<usize>> = HashMap::new();
        for &n in &nodes {
            within.entry((cube(n), part_of[&n], faces(n))).or_default().push(n);
        }
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
        let mut is_new = |t: &Triangle| {
            let mut key = *t;
            key.sort_unstable();
            key[0] != key[1] && key[1] != key[2] && known.insert(key)
        };
        let left = [&all[0], &all[1]].map(|from| -> Vec<Triangle> {
            from.iter().map(|t| t.map(|n| stands_for[&n])).filter(&mut is_new).collect()
        });
        if left[0].len() + left[1].len() <= most {
            return left;
        }
        side *= 1.2;
    }
}

/// The part of the surface that each node belongs to: parts share no triangle.
fn parts<'t>(triangles: impl Iterator<Item = &'t Triangle>) -> HashMap<usize, usize> {
    let mut above: HashMap<usize, usize> = HashMap::new();
    fn top(above: &mut HashMap<usize, usize>, n: usize) -> usize {
        let mut at = n;
        while let Some(&next) = above.get(&at).filter(|next| **next != at) {
            at = next;
        }
        above.insert(n, at);
        at
    }
    for t in triangles {
        let root = top(&mut above, t[0]);
        for &n in &t[1..] {
            let own = top(&mut above, n);
            above.insert(own, root);
        }
    }
    let nodes: Vec<usize> = above.keys().copied().collect();
    nodes.into_iter().map(|n| (n, top(&mut above, n))).collect()
}

/// Twice the area along the outward normal.
fn normal([a, b, c]: [Point; 3]) -> Point {
    cross(&minus(&b, &a), &minus(&c, &a))
}

fn area(corners: [Point; 3]) -> f64 {
    0.5 * norm(&normal(corners))
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
        let both = [all.clone(), vec![]];
        let [left, none] = coarsened(&both, &place, 500);
        assert!(left.len() <= 500 && left.len() > 150 && none.is_empty(), "{}", left.len());
        // it covers the sheet once, but for less than a cube at its rim
        let covered: f64 = left.iter().map(|t| area(t.map(&place))).sum();
        assert!(covered < 1.0 + 1e-12 && covered > 0.85, "{covered}");
        let down = |t: &Triangle| {
            let [a, b, c] = t.map(&place);
            cross(&minus(&b, &a), &minus(&c, &a))[2] < -1e-12
        };
        assert!(!left.iter().any(down), "a triangle is turned over");
    }

    /// Two sheets at one place, of nodes of their own, stay two: they may move apart.
    #[test]
    fn parts_that_touch_are_not_welded() {
        let (all, place) = sheet(40);
        let n = 41 * 41;
        let twin: Vec<Triangle> = all.iter().map(|t| t.map(|k| k + n)).collect();
        let at = |k: usize| place(k % n);
        let [lower, upper] = coarsened(&[all, twin], &at, 600);
        assert!(lower.len() > 100 && lower.len() == upper.len());
        assert!(lower.iter().flatten().all(|k| *k < n) && upper.iter().flatten().all(|k| *k >= n));
    }
}
