//! The surface of a body in space at stored states: deformed, shaded, coloured by the contact pressure.
//!
//! Parallel projection from a direction that the contact faces; faces behind others are painted first.

use std::ops::Range;
use std::sync::Arc;

use plotters::prelude::*;

use super::scaled::{Magnified, Projection, label, side_by_side, significant};
use crate::mesh::Point;
use crate::mesh::point::{cross, dot, minus, unit};
use crate::report::figure::{Area, Bar, Drawn, FigureError, Sheet, line, px, range, text, viridis};
use crate::report::surface::{self, Face, LINED, Surface};
use crate::store::Stored;

/// What carries no pressure.
const BODY: RGBColor = RGBColor(205, 208, 214);
/// Share of the light that comes from everywhere: on the body, and where colours say something.
const AMBIENT: [f64; 2] = [0.5, 0.85];
/// Where the eye is: unit vectors to the right, up, and towards it.
struct View {
    right: Point,
    up: Point,
    eye: Point,
}

impl View {
    fn from(eye: Point) -> View {
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

/// One state.
struct Scene<'s> {
    stored: &'s Stored,
    surface: Surface,
    view: View,
    magnified: Magnified,
    /// Largest pressure of all states.
    largest: f64,
}

impl<'s> Scene<'s> {
    fn of(stored: &'s Stored, rows: &[usize]) -> Scene<'s> {
        let pressure = stored.nodal_pressure();
        let pressures = rows.iter().flat_map(|&r| pressure(r));
        Scene {
            surface: Surface::of(stored),
            view: View::from(surface::eye(stored)),
            magnified: Magnified::of(stored, rows),
            largest: pressures.fold(0.0, f64::max),
            stored,
        }
    }

    fn place(&self, row: usize, node: usize) -> Point {
        let (p, u) = (self.stored.place(node), self.stored.displacement(row, node));
        std::array::from_fn(|c| p[c] + self.magnified.factor * u[c])
    }

    /// The range of all that is drawn, deformed or not.
    fn extent(&self, rows: &[usize], c: usize) -> Range<f64> {
        let nodes = || self.surface.faces.iter().flat_map(|f| &f.nodes);
        let moved =
            rows.iter().flat_map(|&r| nodes().map(move |&n| self.view.plane(&self.place(r, n))[c]));
        let rest = nodes().map(|&n| self.view.plane(&self.stored.place(n))[c]);
        range(moved.chain(rest))
    }

    /// What is to be painted, far things first.
    fn pieces(&self, row: usize) -> Vec<Piece> {
        let pressure = self.stored.nodal_pressure()(row);
        // from above the left shoulder
        let light = unit(std::array::from_fn(|c| {
            self.view.eye[c] - 0.25 * self.view.right[c] + 0.4 * self.view.up[c]
        }));
        let mut pieces: Vec<Piece> = vec![];
        for face in &self.surface.faces {
            let x: Vec<Point> = face.nodes.iter().map(|&n| self.place(row, n)).collect();
            // fine where the pressure has colours, and where faces are curved
            for part in face.kind.pieces() {
                let corners: Vec<Point> = part.iter().map(|&k| x[k]).collect();
                let last = corners[corners.len() - 1];
                let normal = cross(&minus(&corners[1], &corners[0]), &minus(&last, &corners[0]));
                let size = dot(&normal, &normal).sqrt();
                // nothing at all; or turned away, which shows where large displacements fold a surface
                let turned = dot(&normal, &self.view.eye) <= 0.0;
                if size == 0.0 || turned && self.surface.faces.len() > LINED {
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
        let all = self.surface.stretches(face, part).into_iter();
        let drawn = all.filter(|s| s.sharp || self.surface.faces.len() <= LINED);
        let at = |l: usize| self.view.plane(&x[l]);
        drawn.map(|s| (at(s.ends[0]), at(s.ends[1]), s.sharp)).collect()
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
    if scene.surface.faces.is_empty() {
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
