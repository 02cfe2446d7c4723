//! The undeformed outline of a plate and its obstacle.

use plotters::prelude::*;

use crate::report::figure::{Area, Drawn, FigureError, INK, line, px};
use crate::store::Stored;

/// The undeformed outline.
pub(super) fn draw_outline(
    canvas: &Area,
    stored: &Stored,
    pixel: impl Fn([f64; 2]) -> (i32, i32),
) -> Drawn {
    let bound = |c: usize| {
        let column = stored.nodes.column(c);
        (
            column.iter().copied().fold(f64::INFINITY, f64::min),
            column.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        )
    };
    let ((x0, x1), (y0, y1)) = (bound(0), bound(1));
    let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]].map(pixel);
    canvas
        .draw(&PathElement::new(corners.to_vec(), line(RGBColor(120, 120, 125), 0.8)))
        .map_err(FigureError::draw)
}

/// The obstacle: the contact edge moved by the magnified gap along the normal.
pub(super) fn wall_line(stored: &Stored, magnification: f64) -> Option<Vec<[f64; 2]>> {
    let axis = usize::from(stored.contact_normal.ends_with('y'));
    let sign = if stored.contact_normal.starts_with('-') { -1.0 } else { 1.0 };
    if stored.gap.is_empty() {
        return None;
    }
    let at = |(i, g): (usize, &f64)| {
        let mut p = stored.contact_place(i);
        p[axis] += sign * magnification * g;
        p
    };
    Some(stored.gap.iter().enumerate().map(at).collect())
}

/// Draw it, hatched behind.
pub(super) fn draw_wall(
    canvas: &Area,
    wall: &Option<Vec<[f64; 2]>>,
    stored: &Stored,
    pixel: impl Fn([f64; 2]) -> (i32, i32),
) -> Drawn {
    let Some(wall) = wall else { return Ok(()) };
    let points: Vec<(i32, i32)> = wall.iter().map(|&p| pixel(p)).collect();
    let (dx, dy) = match stored.contact_normal.as_str() {
        "+x" => (px(6.0), 0),
        "-x" => (-px(6.0), 0),
        "+y" => (0, -px(6.0)),
        _ => (0, px(6.0)),
    };
    canvas.draw(&PathElement::new(points.clone(), line(INK, 1.6))).map_err(FigureError::draw)?;
    // hatching behind the obstacle
    for pair in points.windows(2) {
        let ((xa, ya), (xb, yb)) = (pair[0], pair[1]);
        let length = f64::from((xb - xa).pow(2) + (yb - ya).pow(2)).sqrt();
        let strokes = (length / f64::from(px(7.0))).ceil().max(1.0) as i32;
        for k in 0..strokes {
            let (x, y) = (xa + (xb - xa) * k / strokes, ya + (yb - ya) * k / strokes);
            let end = if dx != 0 { (x + dx, y + px(5.0)) } else { (x + px(5.0), y + dy) };
            canvas
                .draw(&PathElement::new(vec![(x, y), end], line(INK, 0.8)))
                .map_err(FigureError::draw)?;
        }
    }
    Ok(())
}
