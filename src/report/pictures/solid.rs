//! The surface of a body in space at stored states: deformed, shaded, coloured by the contact pressure.
//!
//! Parallel projection from a direction that the contact faces; faces behind others are painted first.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use plotters::prelude::*;

use super::scaled::{Magnified, Projection, label, side_by_side, significant};
use crate::fem::shape;
use crate::mesh::point::{cross, dot, unit};
use crate::mesh::{ElementKind, Point};
use crate::report::figure::{Area, Bar, Drawn, FigureError, Sheet, line, px, range, text, viridis};
use crate::store::Stored;

/// What carries no pressure.
const BODY: RGBColor = RGBColor(205, 208, 214);
/// Share of the light that comes from everywhere: on the body, and where colours say something.
const AMBIENT: [f64; 2] = [0.5, 0.85];
/// More faces than this are drawn without the lines between them.
const LINED: usize = 4000;
/// Neighbours that turn by more meet in an edge (cosine).
const EDGE: f64 = 0.8;

/// A face of the surface.
struct Face {
    kind: ElementKind,
    nodes: Vec<usize>,
    touches: bool,
}

/// The faces that one element has alone.
fn surface(stored: &Stored) -> Vec<Face> {
    let touching: std::collections::HashSet<usize> =
        (0..stored.gap.len()).map(|i| stored.nearest_node(i)).collect();
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

/// Where the eye is: unit vectors to the right, up, and towards it.
struct View {
    right: Point,
    up: Point,
    eye: Point,
}

impl View {
    /// From the corner of the room that the contact faces most; of equals the usual one.
    fn towards(normals: &[Point]) -> View {
        let corner = |k: usize| {
            let sign = |bit: usize| if k >> bit & 1 == 0 { 1.0 } else { -1.0 };
            unit([0.75 * sign(0), -0.6 * sign(1), 0.5 * sign(2)])
        };
        let seen = |eye: &Point| normals.iter().map(|n| dot(n, eye)).sum::<f64>();
        let best = (0..8).map(corner).fold(None, |best: Option<Point>, eye| match best {
            Some(known) if seen(&known) >= seen(&eye) - 1e-9 => Some(known),
            _ => Some(eye),
        });
        let eye = best.unwrap_or([1.0, 0.0, 0.0]);
        let right = unit(cross(&[0.0, 0.0, 1.0], &eye));
        View { right, up: cross(&eye, &right), eye }
    }

    fn plane(&self, p: &Point) -> [f64; 2] {
        [dot(p, &self.right), dot(p, &self.up)]
    }
}

/// A piece of the surface as it is painted.
struct Piece {
    outline: Vec<[f64; 2]>,
    /// How near it is to the eye.
    depth: f64,
    colour: RGBColor,
    /// Parts of the outline that are drawn as lines: an edge of the body, or of an element.
    lines: Vec<([f64; 2], [f64; 2], bool)>,
}

/// The edges of the surface between two faces, by the corners at their ends: nodes along them, and whether the body turns there.
fn edges(faces: &[Face], at: &dyn Fn(usize) -> Point) -> HashMap<[usize; 2], bool> {
    let normal = |f: &Face| {
        let [a, b, c] = [0, 1, 2].map(|k| at(f.nodes[k]));
        let minus = |p: &Point, q: &Point| -> Point { std::array::from_fn(|c| p[c] - q[c]) };
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

/// One state.
struct Scene<'s> {
    stored: &'s Stored,
    faces: Vec<Face>,
    sharp: HashMap<[usize; 2], bool>,
    view: View,
    magnified: Magnified,
    /// Largest pressure of all states.
    largest: f64,
}

impl<'s> Scene<'s> {
    fn of(stored: &'s Stored, rows: &[usize]) -> Scene<'s> {
        let normals: Vec<Point> = (0..stored.gap.len()).map(|i| stored.contact_normal(i)).collect();
        let faces = surface(stored);
        let pressures = rows.iter().flat_map(|&r| stored.nodal_pressure(r));
        Scene {
            sharp: edges(&faces, &|n| stored.place(n)),
            view: View::towards(&normals),
            magnified: Magnified::of(stored, rows),
            largest: pressures.fold(0.0, f64::max),
            stored,
            faces,
        }
    }

    fn place(&self, row: usize, node: usize) -> Point {
        let (p, u) = (self.stored.place(node), self.stored.displacement(row, node));
        std::array::from_fn(|c| p[c] + self.magnified.factor * u[c])
    }

    /// The range of all that is drawn, deformed or not.
    fn extent(&self, rows: &[usize], c: usize) -> Range<f64> {
        let nodes = || self.faces.iter().flat_map(|f| &f.nodes);
        let moved =
            rows.iter().flat_map(|&r| nodes().map(move |&n| self.view.plane(&self.place(r, n))[c]));
        let rest = nodes().map(|&n| self.view.plane(&self.stored.place(n))[c]);
        range(moved.chain(rest))
    }

    /// What is to be painted, far things first.
    fn pieces(&self, row: usize) -> Vec<Piece> {
        let pressure = self.stored.nodal_pressure(row);
        // from above the left shoulder
        let light = unit(std::array::from_fn(|c| {
            self.view.eye[c] - 0.25 * self.view.right[c] + 0.4 * self.view.up[c]
        }));
        let mut pieces: Vec<Piece> = vec![];
        for face in &self.faces {
            let x: Vec<Point> = face.nodes.iter().map(|&n| self.place(row, n)).collect();
            // fine where the pressure has colours, and where faces are curved
            for part in face.kind.pieces() {
                let corners: Vec<Point> = part.iter().map(|&k| x[k]).collect();
                let minus =
                    |p: &Point, q: &Point| -> Point { std::array::from_fn(|c| p[c] - q[c]) };
                let last = corners[corners.len() - 1];
                let normal = cross(&minus(&corners[1], &corners[0]), &minus(&last, &corners[0]));
                let size = dot(&normal, &normal).sqrt();
                // nothing at all; or turned away, which shows where large displacements fold a surface
                let turned = dot(&normal, &self.view.eye) <= 0.0;
                if size == 0.0 || turned && self.faces.len() > LINED {
                    continue;
                }
                let values: Vec<f64> = part.iter().map(|&k| pressure[face.nodes[k]]).collect();
                let carries = face.touches && values.iter().any(|p| *p > 0.0);
                let ambient = AMBIENT[usize::from(carries)];
                let bright = (dot(&normal, &light) / size).abs().min(1.0);
                let shade = ambient + (1.0 - ambient) * bright;
                let lines = self.lines(face, part, &x);
                for (outline, value) in divided(&corners, &values, carries) {
                    let base = match carries {
                        true => viridis(value / self.largest),
                        false => BODY,
                    };
                    let shaded = |c: u8| (f64::from(c) * shade).round().clamp(0.0, 255.0) as u8;
                    let middle = outline.iter().map(|p| dot(p, &self.view.eye)).sum::<f64>();
                    pieces.push(Piece {
                        depth: middle / outline.len() as f64,
                        outline: outline.iter().map(|p| self.view.plane(p)).collect(),
                        colour: RGBColor(shaded(base.0), shaded(base.1), shaded(base.2)),
                        lines: vec![],
                    });
                }
                if let Some(last) = pieces.last_mut() {
                    last.lines = lines;
                }
            }
        }
        pieces.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        pieces
    }

    /// The sides of a part that lie on those of its face.
    fn lines(&self, face: &Face, part: &[usize], x: &[Point]) -> Vec<([f64; 2], [f64; 2], bool)> {
        let corners = face.kind.corners();
        let local = shape::places(face.kind);
        let mut lines = vec![];
        for k in 0..part.len() {
            let (a, b) = (part[k], part[(k + 1) % part.len()]);
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
            if sharp || self.faces.len() <= LINED {
                lines.push((self.view.plane(&x[a]), self.view.plane(&x[b]), sharp));
            }
        }
        lines
    }

    /// One state with its time.
    fn draw(&self, panel: &Area, row: usize, x: &Range<f64>, y: &Range<f64>) -> Drawn {
        let words = label(self.stored, row);
        panel.draw(&Text::new(words, (px(8.0), px(2.0)), text(13))).map_err(FigureError::draw)?;
        let (_, canvas) = panel.split_vertically(px(20.0));
        let place = Projection::on(&canvas, 6.0, x, y);
        let pixel = |p: &[f64; 2]| place.pixel(*p);
        for piece in self.pieces(row) {
            let outline: Vec<(i32, i32)> = piece.outline.iter().map(pixel).collect();
            canvas
                .draw(&Polygon::new(outline.clone(), piece.colour.filled()))
                .map_err(FigureError::draw)?;
            // neighbours touch without a light seam
            let closed: Vec<_> = outline.iter().chain(&outline[..1]).copied().collect();
            canvas
                .draw(&PathElement::new(closed, line(piece.colour, 0.5)))
                .map_err(FigureError::draw)?;
            for (a, b, sharp) in &piece.lines {
                let darker = |c: u8| (f64::from(c) * 0.72) as u8;
                let RGBColor(r, g, b_) = piece.colour;
                let style = match sharp {
                    true => line(RGBColor(45, 45, 50), 1.1),
                    false => line(RGBColor(darker(r), darker(g), darker(b_)), 0.4),
                };
                canvas
                    .draw(&PathElement::new(vec![pixel(a), pixel(b)], style))
                    .map_err(FigureError::draw)?;
            }
        }
        Ok(())
    }
}

/// A part of a face, cut finer where it has a colour that changes: outlines with their values.
fn divided(corners: &[Point], values: &[f64], carries: bool) -> Vec<(Vec<Point>, f64)> {
    let n = if carries { 4 } else { 1 };
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    if n == 1 {
        return vec![(corners.to_vec(), mean)];
    }
    // a triangle is a quadrilateral whose last corner is its third
    let at = |s: f64, t: f64| -> (Point, f64) {
        let weights = match corners.len() {
            3 => vec![1.0 - s, s * (1.0 - t), s * t],
            _ => vec![(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t],
        };
        let place =
            std::array::from_fn(|c| weights.iter().zip(corners).map(|(w, p)| w * p[c]).sum());
        (place, weights.iter().zip(values).map(|(w, v)| w * v).sum())
    };
    let step = |k: usize| k as f64 / n as f64;
    let cell = |i: usize, j: usize| {
        let all =
            [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| at(step(i), step(j)));
        let value = all.iter().map(|a| a.1).sum::<f64>() / 4.0;
        (all.iter().map(|a| a.0).collect(), value)
    };
    (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| cell(i, j)).collect()
}

/// States side by side in one or two rows.
pub(super) fn solid_shapes<'s>(
    stored: &'s Stored,
    of: &[usize],
    rows: &[usize],
) -> Result<Sheet<'s>, FigureError> {
    let scene = Arc::new(Scene::of(stored, of));
    if scene.faces.is_empty() {
        return Err(FigureError::Empty("the mesh has no surface"));
    }
    let (x, y) = (scene.extent(of, 0), scene.extent(of, 1));
    let words =
        format!("deformed surface, displacements × {}", significant(scene.magnified.factor));
    let (range, label) = (0.0..scene.largest, "pressure".to_owned());
    let bar = (scene.largest > 0.0).then_some(Bar { range, label, colour: viridis, white: None });
    let extent = (x.clone(), y.clone());
    let draw = move |panel: &Area, r| scene.draw(panel, r, &extent.0, &extent.1);
    Ok(side_by_side(stored, &words, rows, (&x, &y), draw, bar))
}
