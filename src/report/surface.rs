//! The surface of a body in space as pictures and pages draw it: its faces, the edges where it turns, and where it is
//! looked at from.

use std::collections::{HashMap, HashSet};

use crate::fem::shape;
use crate::mesh::point::{cross, dot, minus, unit};
use crate::mesh::{ElementKind, Point};
use crate::store::Stored;

/// More faces than this are drawn without the lines between them.
pub(super) const LINED: usize = 4000;
/// Neighbours that turn by more meet in an edge (cosine).
const EDGE: f64 = 0.8;

/// A face of the surface.
pub(super) struct Face {
    pub kind: ElementKind,
    pub nodes: Vec<usize>,
    /// Whether all of its nodes bear contact.
    pub touches: bool,
}

/// A stretch of a line between two nodes of a face, by their local numbers; `sharp`: the body turns there.
pub(super) struct Stretch {
    pub ends: [usize; 2],
    pub sharp: bool,
}

/// The faces that one element has alone, and where they meet in an edge.
pub(super) struct Surface {
    pub faces: Vec<Face>,
    /// Sides between two faces, by the corners at their ends: whether the body turns there.
    sharp: HashMap<[usize; 2], bool>,
}

impl Surface {
    pub fn of(stored: &Stored) -> Surface {
        let faces = faces(stored);
        Surface { sharp: sharp(&faces, &|n| stored.place(n)), faces }
    }

    /// The sides of a piece (`ElementKind::pieces`) that lie on those of its face.
    pub fn stretches(&self, face: &Face, piece: &[usize]) -> Vec<Stretch> {
        let corners = face.kind.corners();
        let local = shape::places(face.kind);
        let mut all = vec![];
        for k in 0..piece.len() {
            let (a, b) = (piece[k], piece[(k + 1) % piece.len()]);
            // both ends on the side between two corners
            let side = (0..corners).find(|&s| {
                let (p, q) = (local[s], local[(s + 1) % corners]);
                let on = |l: usize| {
                    let along = [q[0] - p[0], q[1] - p[1]];
                    let to = [local[l][0] - p[0], local[l][1] - p[1]];
                    (along[0] * to[1] - along[1] * to[0]).abs() < 1e-12
                };
                on(a) && on(b)
            });
            let Some(s) = side else { continue };
            let (p, q) = (face.nodes[s], face.nodes[(s + 1) % corners]);
            let sharp = self.sharp.get(&[p.min(q), p.max(q)]).copied().unwrap_or(true);
            all.push(Stretch { ends: [a, b], sharp });
        }
        all
    }
}

fn faces(stored: &Stored) -> Vec<Face> {
    let touching: HashSet<usize> = stored.nodes_that_bear().into_iter().collect();
    let mut found: HashMap<Vec<usize>, Option<Face>> = HashMap::new();
    let mut order = vec![];
    for k in 0..stored.elements.nrows() {
        let Some(kind) = stored.kind(k) else { continue };
        let own = stored.nodes_of(k);
        for side in 0..kind.sides() {
            let Some(face) = kind.face(side) else { continue };
            let nodes: Vec<usize> = kind.side(side).iter().map(|&l| own[l]).collect();
            let mut key = nodes.clone();
            key.sort_unstable();
            match found.get_mut(&key) {
                Some(twice) => *twice = None,
                None => {
                    let touches = nodes.iter().all(|n| touching.contains(n));
                    found.insert(key.clone(), Some(Face { kind: face, nodes, touches }));
                    order.push(key);
                }
            }
        }
    }
    order.iter().filter_map(|key| found.remove(key).flatten()).collect()
}

fn sharp(faces: &[Face], at: &dyn Fn(usize) -> Point) -> HashMap<[usize; 2], bool> {
    let normal = |f: &Face| {
        let [a, b, c] = [0, 1, 2].map(|k| at(f.nodes[k]));
        unit(cross(&minus(&b, &a), &minus(&c, &b)))
    };
    let mut known: HashMap<[usize; 2], Point> = HashMap::new();
    let mut sharp = HashMap::new();
    for face in faces {
        let (n, corners) = (normal(face), face.kind.corners());
        for k in 0..corners {
            let (a, b) = (face.nodes[k], face.nodes[(k + 1) % corners]);
            let key = [a.min(b), a.max(b)];
            match known.get(&key) {
                Some(other) => {
                    sharp.insert(key, dot(other, &n) < EDGE);
                }
                None => {
                    known.insert(key, n);
                }
            }
        }
    }
    sharp
}

/// Towards the eye: from the corner of the room that the contact faces most; of equals the usual one.
pub(super) fn eye(stored: &Stored) -> Point {
    let normals: Vec<Point> = (0..stored.facing()).map(|i| stored.contact_normal(i)).collect();
    let corner = |k: usize| {
        let sign = |bit: usize| if k >> bit & 1 == 0 { 1.0 } else { -1.0 };
        unit([0.75 * sign(0), -0.6 * sign(1), 0.5 * sign(2)])
    };
    let seen = |eye: &Point| normals.iter().map(|n| dot(n, eye)).sum::<f64>();
    let best = (0..8).map(corner).fold(None, |best: Option<Point>, eye| match best {
        Some(known) if seen(&known) >= seen(&eye) - 1e-9 => Some(known),
        _ => Some(eye),
    });
    best.unwrap_or([1.0, 0.0, 0.0])
}
