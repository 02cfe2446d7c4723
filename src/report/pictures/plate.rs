//! Deformed shapes of a body in the plane, coloured by ‖u‖.

use std::ops::Range;
use std::sync::Arc;

use plotters::prelude::*;

use super::patches::{Corner, patches};
use super::scaled::{Magnified, Projection, label, side_by_side, significant, size};
use super::wall::{Wall, boundary, draw_outline, draw_wall, walls};
use crate::report::figure::{Area, Bar, Drawn, FigureError, Sheet, line, px, range, text, viridis};
use crate::store::Stored;

/// A plate as it is drawn: scales that some stored states share.
struct Shapes<'s> {
    stored: &'s Stored,
    rows: Vec<usize>,
    /// Largest `‖u‖` of these states.
    largest: f64,
    /// Of the displacements.
    magnification: f64,
    /// The obstacles at each of these states.
    walls: Vec<Vec<Wall>>,
    /// The outline.
    sides: Vec<Vec<usize>>,
}

impl<'s> Shapes<'s> {
    fn of(stored: &'s Stored, rows: &[usize]) -> Self {
        let Magnified { largest, factor: magnification } = Magnified::of(stored, rows);
        let walls = rows.iter().map(|&row| walls(stored, magnification, row)).collect();
        let sides = boundary(stored);
        Shapes { stored, rows: rows.to_vec(), largest, magnification, walls, sides }
    }

    /// A node as drawn.
    fn position(&self, r: usize, i: usize) -> [f64; 2] {
        let (nodes, m) = (&self.stored.nodes, self.magnification);
        let [ux, uy, _] = self.stored.displacement(r, i);
        [nodes[(i, 0)] + m * ux, nodes[(i, 1)] + m * uy]
    }

    /// The range of all that is drawn, deformed or not, along one axis.
    fn extent(&self, c: usize) -> Range<f64> {
        let n = self.stored.nodes.nrows();
        let all = self.rows.iter().flat_map(|&r| (0..n).map(move |i| (r, i)));
        let walls = self.walls.iter().flatten().flatten().map(|p| p.0[c]);
        let nodes = (0..n).map(|i| self.stored.nodes[(i, c)]);
        range(all.map(|(r, i)| self.position(r, i)[c]).chain(nodes).chain(walls))
    }

    /// One state with its time.
    fn draw(&self, panel: &Area, r: usize, x: &Range<f64>, y: &Range<f64>) -> Drawn {
        let stored = self.stored;
        panel
            .draw(&Text::new(label(stored, r), (px(8.0), px(2.0)), text(13)))
            .map_err(FigureError::draw)?;
        let (_, canvas) = panel.split_vertically(px(20.0));
        let place = Projection::on(&canvas, 4.0, x, y);
        for k in 0..stored.elements.nrows() {
            let corner = |i: usize| Corner { at: self.position(r, i), value: size(stored, r, i) };
            let corners: Vec<Corner> = stored.nodes_of(k).into_iter().map(corner).collect();
            for (patch, value) in patches(&corners, place.scale, self.largest) {
                let patch: Vec<(i32, i32)> = patch.into_iter().map(|p| place.pixel(p)).collect();
                fill(&canvas, &patch, viridis(value / self.largest))?;
            }
        }
        draw_outline(&canvas, stored, &self.sides, |p| place.pixel(p))?;
        let own = self.rows.iter().position(|&row| row == r).map(|k| &self.walls[k]);
        own.into_iter().flatten().try_for_each(|wall| draw_wall(&canvas, wall, |p| place.pixel(p)))
    }
}

/// A patch of one colour; neighbours touch without a light seam.
fn fill(canvas: &Area, patch: &[(i32, i32)], colour: RGBColor) -> Drawn {
    canvas.draw(&Polygon::new(patch.to_vec(), colour.filled())).map_err(FigureError::draw)?;
    let closed: Vec<_> = patch.iter().chain(&patch[..1]).copied().collect();
    canvas.draw(&PathElement::new(closed, line(colour, 0.7))).map_err(FigureError::draw)
}

/// Deformed shapes side by side in one or two rows, with the scales of the states `of`.
pub(super) fn plate_shapes<'s>(
    stored: &'s Stored,
    of: &[usize],
    rows: &[usize],
) -> Result<Sheet<'s>, FigureError> {
    let shapes = Arc::new(Shapes::of(stored, of));
    let (x, y) = (shapes.extent(0), shapes.extent(1));
    let words = format!("deformed shape, displacements × {}", significant(shapes.magnification));
    let (range, label) = (0.0..shapes.largest, "‖u‖".to_owned());
    let bar = Bar { range, label, colour: viridis, white: None };
    let extent = (x.clone(), y.clone());
    let draw = move |panel: &Area, r| shapes.draw(panel, r, &extent.0, &extent.1);
    Ok(side_by_side(stored, &words, rows, (&x, &y), draw, Some(bar)))
}
