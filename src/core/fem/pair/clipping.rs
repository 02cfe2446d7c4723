//! Pieces of faces that face each other: both are projected onto the middle plane of the slave's face, cut there, and integrated on triangles.

use super::super::shape::{self, Local};
use super::against::{FACES, PairError};
use super::overlap::{Meet, Patch};
use crate::mesh::point::{cross, dot, minus, norm, unit};
use crate::mesh::{Basis, Point};

/// A place in a plane.
type Flat = [f64; 2];

/// Pieces smaller than this share of a face are none.
const SMALL: f64 = 1e-12;

/// The plane of a face.
struct Plane {
    origin: Point,
    axes: [Point; 2],
}

impl Plane {
    fn new(patch: &Patch) -> Plane {
        let n = patch.normal;
        let edge = minus(&patch.x[1], &patch.x[0]);
        let along = dot(&edge, &n);
        let first = unit(std::array::from_fn(|c| edge[c] - along * n[c]));
        Plane { origin: patch.x[0], axes: [first, cross(&n, &first)] }
    }

    fn of(&self, x: &Point) -> Flat {
        let way = minus(x, &self.origin);
        self.axes.map(|a| dot(&way, &a))
    }

    /// The corners of a face, counter-clockwise.
    fn polygon(&self, patch: &Patch) -> Vec<Flat> {
        let mut corners: Vec<Flat> = patch.x[..patch.corners].iter().map(|x| self.of(x)).collect();
        if area(&corners) < 0.0 {
            corners.reverse();
        }
        corners
    }

    /// The place of a face, in its own coordinates, over a place of the plane.
    fn local(&self, patch: &Patch, at: &Flat) -> [f64; 2] {
        let centre: Local = patch.face().map_or([0.0; 3], shape::centre);
        let mut s = [centre[0], centre[1]];
        for _ in 0..30 {
            let spot = patch.at(s);
            let here = self.of(&spot.place);
            let off = [at[0] - here[0], at[1] - here[1]];
            let columns = spot.tangents.map(|t| self.axes.map(|a| dot(&t, &a)));
            let det = columns[0][0] * columns[1][1] - columns[1][0] * columns[0][1];
            let step = [
                (off[0] * columns[1][1] - off[1] * columns[1][0]) / det,
                (off[1] * columns[0][0] - off[0] * columns[0][1]) / det,
            ];
            if !step[0].is_finite() || !step[1].is_finite() {
                break;
            }
            s = [s[0] + step[0], s[1] + step[1]];
            if step[0].abs().max(step[1].abs()) < 1e-15 {
                break;
            }
        }
        s
    }
}

fn area(polygon: &[Flat]) -> f64 {
    let n = polygon.len();
    let part = |k: usize| {
        let (a, b) = (polygon[k], polygon[(k + 1) % n]);
        0.5 * (a[0] * b[1] - b[0] * a[1])
    };
    (0..n).map(part).sum()
}

/// What two convex polygons, both counter-clockwise, have in common (Sutherland and Hodgman 1974).
fn common(subject: &[Flat], clip: &[Flat]) -> Vec<Flat> {
    let mut left = subject.to_vec();
    for k in 0..clip.len() {
        let (a, b) = (clip[k], clip[(k + 1) % clip.len()]);
        let inside = |p: &Flat| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        let all = std::mem::take(&mut left);
        for (i, p) in all.iter().enumerate() {
            let q = &all[(i + 1) % all.len()];
            let (here, next) = (inside(p), inside(q));
            if here >= 0.0 {
                left.push(*p);
            }
            if here * next < 0.0 {
                let t = here / (here - next);
                left.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
        }
    }
    left
}

/// Points and weights of a rule on a triangle that is exact to degree `2n − 2`: Gauss along one side and towards the corner.
fn on_triangle([a, b, c]: [Flat; 3], n: usize) -> Vec<(Flat, f64)> {
    let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let rule = shape::gauss(n);
    let unit_rule: Vec<(f64, f64)> = rule.iter().map(|(x, w)| (0.5 * (x + 1.0), 0.5 * w)).collect();
    let of = |&(r, v): &(f64, f64)| {
        unit_rule.iter().map(move |&(s, w)| {
            let at = std::array::from_fn(|k| a[k] + r * (b[k] - a[k]) + r * s * (c[k] - b[k]));
            (at, twice * r * v * w)
        })
    };
    unit_rule.iter().flat_map(of).collect()
}

/// All points at which the faces of two surfaces are integrated.
pub fn of(slave: &[Patch], master: &[Patch]) -> Result<Vec<Meet>, PairError> {
    let mut meets = vec![];
    // a master that is further away in the plane than both reach is not looked at
    let reach = |p: &Patch| {
        let middle = centre(p);
        (middle, p.x.iter().map(|x| norm(&minus(x, &middle))).fold(0.0, f64::max))
    };
    let spheres: Vec<(Point, f64)> = master.iter().map(reach).collect();
    for (own, patch) in slave.iter().enumerate() {
        let plane = Plane::new(patch);
        let (middle, radius) = reach(patch);
        let polygon = plane.polygon(patch);
        let whole = area(&polygon);
        // products of functions of this degree
        let n = match patch.face().map(|f| f.basis()) {
            Some(Basis::Linear) => 3,
            _ => 5,
        };
        for (k, other) in master.iter().enumerate() {
            let cosine = dot(&patch.normal, &other.normal);
            let away = minus(&spheres[k].0, &middle);
            let along = dot(&away, &patch.normal);
            let across: Point = std::array::from_fn(|c| away[c] - along * patch.normal[c]);
            if cosine >= 0.0 || norm(&across) > radius + spheres[k].1 {
                continue;
            }
            let piece = common(&plane.polygon(other), &polygon);
            if piece.len() < 3 || area(&piece) <= SMALL * whole {
                continue;
            }
            if cosine > FACES {
                let degrees = cosine.acos().to_degrees();
                return Err(PairError::Turned { node: patch.nodes[0], degrees });
            }
            let count = piece.len() as f64;
            let heart: Flat =
                std::array::from_fn(|c| piece.iter().map(|p| p[c]).sum::<f64>() / count);
            for i in 0..piece.len() {
                let corners = [heart, piece[i], piece[(i + 1) % piece.len()]];
                for (at, weight) in on_triangle(corners, n) {
                    let here = patch.at(plane.local(patch, &at));
                    let there = other.at(plane.local(other, &at));
                    meets.push(Meet {
                        slave: own,
                        master: k,
                        weight,
                        place: here.place,
                        own: here.values,
                        theirs: there.values,
                    });
                }
            }
        }
    }
    Ok(meets)
}

/// The mean of the corners.
fn centre(patch: &Patch) -> Point {
    let count = patch.corners as f64;
    std::array::from_fn(|c| patch.x[..patch.corners].iter().map(|x| x[c]).sum::<f64>() / count)
}
