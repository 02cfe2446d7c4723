//! The undeformed outline of a body in the plane and its obstacles.

use std::collections::HashMap;

use plotters::prelude::*;

use crate::report::edge::Edge;
use crate::report::figure::{Area, Drawn, FigureError, INK, line, px};
use crate::store::Stored;

/// The sides of elements that no other element has: nodes from end to end.
pub(in crate::report) fn boundary(stored: &Stored) -> Vec<Vec<usize>> {
    let mut sides: HashMap<[usize; 2], Option<Vec<usize>>> = HashMap::new();
    let mut order = vec![];
    for k in 0..stored.elements.nrows() {
        let Some(kind) = stored.kind(k) else { continue };
        let nodes = stored.nodes_of(k);
        for side in 0..kind.sides() {
            let own: Vec<usize> = kind.side(side).iter().map(|&l| nodes[l]).collect();
            let &[a, b, ..] = &own[..] else { continue };
            let path = match own.get(2) {
                Some(&middle) => vec![a, middle, b],
                None => vec![a, b],
            };
            let key = [a.min(b), a.max(b)];
            match sides.get_mut(&key) {
                Some(twice) => *twice = None,
                None => {
                    sides.insert(key, Some(path));
                    order.push(key);
                }
            }
        }
    }
    order.iter().filter_map(|key| sides.remove(key).flatten()).collect()
}

/// The undeformed outline.
pub(super) fn draw_outline(
    canvas: &Area,
    stored: &Stored,
    sides: &[Vec<usize>],
    pixel: impl Fn([f64; 2]) -> (i32, i32),
) -> Drawn {
    let at = |&n: &usize| pixel([stored.nodes[(n, 0)], stored.nodes[(n, 1)]]);
    for side in sides {
        let path: Vec<(i32, i32)> = side.iter().map(at).collect();
        canvas
            .draw(&PathElement::new(path, line(RGBColor(120, 120, 125), 0.8)))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}

/// A part of an obstacle: places, and the direction behind it.
pub(super) type Wall = Vec<([f64; 2], [f64; 2])>;

/// Obstacles farther off than this part of the body are drawn only where they are touched.
const REACH: f64 = 2.0;

/// The obstacles at stored state `row`: the contact edges moved by the magnified gaps along the contact directions.
pub(super) fn walls(stored: &Stored, magnification: f64, row: usize) -> Vec<Wall> {
    let at = |&i: &usize| {
        let normal = [0, 1].map(|c| stored.contact_normals[(i, c)]);
        let place = stored.contact_place(i);
        let moved = [0, 1].map(|c| place[c] + magnification * stored.gap_at(row, i) * normal[c]);
        (moved, normal)
    };
    let edge = Edge::of(stored);
    // an obstacle behind stands behind the body, and where two surfaces meet there is none
    let front = |part: &&Vec<usize>| edge.fronts.contains(&part[0]) && !stored.meets(part[0]);
    // what lies far off and is never touched would leave no room for the body
    let size = (0..2).fold(0.0f64, |m, c| {
        let all = || stored.nodes.column(c).to_vec().into_iter();
        m.max(all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min))
    });
    let touches = |i: usize| (0..stored.t.len()).any(|row| stored.touches(row, i));
    let in_reach = |&i: &usize| magnification * stored.gap[i].abs() <= REACH * size || touches(i);
    let wall = |part: &Vec<usize>| -> Vec<Wall> {
        if part.iter().all(in_reach) {
            let mut wall: Wall = part.iter().map(at).collect();
            if edge.is_closed(part) {
                wall.push(wall[0]);
            }
            return vec![wall];
        }
        let pieces = part.split(|i| !in_reach(i)).filter(|piece| !piece.is_empty());
        pieces.map(|piece| piece.iter().map(at).collect()).collect()
    };
    edge.parts().iter().filter(front).flat_map(wall).collect()
}

/// Draw one, hatched behind.
pub(super) fn draw_wall(
    canvas: &Area,
    wall: &Wall,
    pixel: impl Fn([f64; 2]) -> (i32, i32),
) -> Drawn {
    let points: Vec<(i32, i32)> = wall.iter().map(|p| pixel(p.0)).collect();
    let stroke = |points: Vec<(i32, i32)>, width: f64| {
        canvas.draw(&PathElement::new(points, line(INK, width))).map_err(FigureError::draw)
    };
    stroke(points.clone(), 1.6)?;
    // hatching behind the obstacle: away from the body, and to one side
    for (pair, normals) in points.windows(2).zip(wall.windows(2)) {
        let ((xa, ya), (xb, yb)) = (pair[0], pair[1]);
        let [nx, ny] = [0, 1].map(|c| 0.5 * (normals[0].1[c] + normals[1].1[c]));
        // the normal, turned by forty degrees (pixels count downwards)
        let (sin, cos) = 40f64.to_radians().sin_cos();
        let length = f64::from(px(7.8)) / nx.hypot(ny).max(f64::MIN_POSITIVE);
        let step = (
            (length * (cos * nx + sin * ny)).round() as i32,
            (length * (sin * nx - cos * ny)).round() as i32,
        );
        let length = f64::from((xb - xa).pow(2) + (yb - ya).pow(2)).sqrt();
        let strokes = (length / f64::from(px(7.0))).ceil().max(1.0) as i32;
        for k in 0..strokes {
            let (x, y) = (xa + (xb - xa) * k / strokes, ya + (yb - ya) * k / strokes);
            stroke(vec![(x, y), (x + step.0, y + step.1)], 0.8)?;
        }
    }
    Ok(())
}
