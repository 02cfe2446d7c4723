//! The picture `shapes`: deformed shapes at fractions of the stored time.

use std::collections::HashSet;
use std::path::Path;

use rayon::prelude::*;

use super::Options;
use super::plate::plate_shapes;
use super::scaled::shape_span;
use super::solid::solid_shapes;
use crate::report::figure::{
    Axis, Bar, Cell, Chart, FigureError, INK, Mark, Sheet, Style, entry, range, viridis,
};
use crate::scenario::{BodyKind, Scene};
use crate::store::Stored;

/// Stored states nearest to the chosen fractions of that span.
fn chosen_rows(stored: &Stored, fractions: &[f64]) -> Vec<usize> {
    let time = shape_span(stored);
    let nearest = |f: &f64| {
        let t = time.start + f * (time.end - time.start);
        let row = stored.t.partition_point(|&s| s < t);
        match row {
            0 => 0,
            r if r >= stored.t.len() => stored.t.len() - 1,
            r if t - stored.t[r - 1] < stored.t[r] - t => r - 1,
            r => r,
        }
    };
    fractions.iter().map(nearest).collect()
}

/// Deformed shapes at fractions of the stored time, coloured by ‖u‖ (a bar: u against x; a body in space: its surface, coloured by the pressure).
pub(super) fn shapes<'s>(stored: &'s Stored, options: &Options) -> Result<Sheet<'s>, FigureError> {
    let rows = chosen_rows(stored, &options.fractions);
    drawn(stored, &rows, &rows)
}

/// One picture for each of `count` states, evenly over the stored time, all of one scale.
pub fn frames(stored: &Stored, count: usize, style: &Style) -> Result<Vec<String>, FigureError> {
    let fractions: Vec<f64> = (0..count).map(|k| k as f64 / count as f64).collect();
    let rows = chosen_rows(stored, &fractions);
    rows.par_iter().map(|&r| drawn(stored, &rows, &[r])?.svg(style)).collect()
}

/// The states `rows`, with the scales of the states `of`.
fn drawn<'s>(stored: &'s Stored, of: &[usize], rows: &[usize]) -> Result<Sheet<'s>, FigureError> {
    if stored.t.is_empty() {
        return Err(FigureError::Empty("no states are stored"));
    }
    if stored.whole().is_err() {
        return Err(FigureError::Empty(
            "the file does not keep the displacements of the whole body ([run] store)",
        ));
    }
    let scene = Scene::parse(&stored.scene, Path::new("stored"));
    if scene.is_ok_and(|s| s.body.kind == BodyKind::Matrices) {
        return Err(FigureError::Empty("a body given by matrices has no shape"));
    }
    if stored.is_solid() {
        solid_shapes(stored, of, rows)
    } else if stored.elements.ncols() == 2 {
        Ok(bar_shapes(stored, of, rows))
    } else {
        plate_shapes(stored, of, rows)
    }
}

/// Displacement against the coordinate of a bar.
fn bar_shapes(stored: &Stored, of: &[usize], rows: &[usize]) -> Sheet<'static> {
    let n = stored.nodes.nrows();
    let x = range((0..n).map(|i| stored.nodes[(i, 0)]));
    let all = of.iter().flat_map(|&r| (0..n).map(move |i| (r, i)));
    let y = range(all.map(|(r, i)| stored.displacement(r, i)[0]));
    // the obstacle limits the displacement of one end
    let wall = stored
        .gap
        .first()
        .filter(|_| stored.facing() > 0 && !stored.meets(0) && !stored.swings())
        .map(|g| stored.contact_normals[(0, 0)] * g);
    let y = range([y.start, y.end].into_iter().chain(wall));
    let reach = 0.04 * (x.end - x.start);
    let mut chart = Chart::new(Axis::linear("x", x), Axis::linear("displacement u", y));
    // a bar by itself is a line by itself
    let joined: HashSet<[usize; 2]> = (0..stored.elements.nrows())
        .map(|k| stored.nodes_of(k))
        .map(|nodes| [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])])
        .collect();
    let nodes: Vec<usize> = (0..n).collect();
    let bars: Vec<&[usize]> =
        nodes.chunk_by(|a, b| joined.is_empty() || joined.contains(&[*a, *b])).collect();
    let mut legend = vec![];
    if let Some(limit) = wall {
        let at = stored.contact_place(0)[0];
        chart.line(vec![(at - reach, limit), (at + reach, limit)], INK, 2.5);
        legend.push(entry("limit set by the obstacle", INK, Mark::Line));
    }
    for &r in rows {
        let at = of.iter().position(|&o| o == r).unwrap_or(0);
        let s = at as f64 / (of.len().max(2) - 1) as f64;
        for part in &bars {
            let series = part.iter().map(|&i| (stored.nodes[(i, 0)], stored.displacement(r, i)[0]));
            chart.line(series.collect(), viridis(0.92 * s), 2.0);
        }
    }
    let (range, label) = (shape_span(stored), "time".to_owned());
    Sheet::new(&stored.title, "displacement at successive times")
        .row(430.0, vec![Cell::from(chart).legend(legend)])
        .bar(Some(Bar { range, label, colour: |s| viridis(0.92 * s), white: None }))
}
