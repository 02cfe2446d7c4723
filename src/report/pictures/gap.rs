//! The picture `gap`: the gap over the contact edge and time.

use plotters::prelude::{RGBColor, WHITE};

use super::Options;
use super::time::time_range;
use crate::report::edge::Edge;
use crate::report::figure::{Axis, Bar, Chart, FigureError, Point, Sheet, viridis};
use crate::store::Stored;

/// At most this many columns: neighbours in time are drawn together.
const COLUMNS: usize = 900;

/// The gap of a node at a stored state.
fn gap(stored: &Stored, row: usize, i: usize) -> f64 {
    stored.gap[i] - stored.contact_displacement(row, i)
}

/// Where the cells of the nodes begin and end: half-way between neighbours.
fn boundaries(position: &[f64]) -> Vec<f64> {
    let n_c = position.len();
    let boundary = |i: usize| match i {
        0 => position[0],
        i if i == n_c => position[n_c - 1],
        i => 0.5 * (position[i - 1] + position[i]),
    };
    (0..=n_c).map(boundary).collect()
}

/// The cells, white where most of the states of a cell are in contact.
fn cells(stored: &Stored, edge: &Edge, largest: f64) -> Vec<([Point; 2], RGBColor)> {
    let (n_c, rows) = (edge.fronts.len(), stored.t.len());
    let position: Vec<f64> = edge.fronts.iter().map(|&i| edge.position[i]).collect();
    let boundaries = boundaries(&position);
    let stride = rows.div_ceil(COLUMNS);
    let last = stored.t[rows - 1];
    let mut cells = vec![];
    // each cell reaches under its right and upper neighbours, which are drawn later, row by row: no seams
    for (k, &i) in edge.fronts.iter().enumerate() {
        for start in (0..rows - 1).step_by(stride) {
            let end = (start + stride).min(rows - 1);
            let beyond = stored.t[(end + stride).min(rows - 1)].min(last);
            let touching = (start..end).filter(|&r| stored.touches(r, i)).count();
            let here = (start..end).map(|r| gap(stored, r, i)).fold(f64::INFINITY, f64::min);
            let fill = if 2 * touching > end - start { WHITE } else { viridis(here / largest) };
            let corners =
                [(stored.t[start], boundaries[k]), (beyond, boundaries[(k + 2).min(n_c)])];
            cells.push((corners, fill));
        }
    }
    cells
}

/// The gap over the contact edge and time; contact is white.
pub(super) fn gap_map<'s>(stored: &'s Stored, _: &Options) -> Result<Sheet<'s>, FigureError> {
    let edge = Edge::of(stored);
    let rows = stored.t.len();
    if edge.fronts.len() < 2 || rows < 2 {
        return Err(FigureError::Empty(
            "a gap map needs at least two contact nodes and two states",
        ));
    }
    let largest = (0..rows)
        .flat_map(|r| edge.fronts.iter().map(move |&i| (r, i)))
        .map(|(r, i)| gap(stored, r, i))
        .fold(f64::MIN_POSITIVE, f64::max);
    let across = Axis::linear(edge.label(), edge.span());
    let axes = (Axis::linear("time", time_range(stored)), across);
    let mut chart = Chart::new(axes.0, axes.1);
    chart.cover(cells(stored, &edge, largest));
    let bar =
        Bar { range: 0.0..largest, label: "gap".into(), colour: viridis, white: Some("contact") };
    Ok(Sheet::new(&stored.title, "gap along the contact edge")
        .row(390.0, vec![chart.into()])
        .bar(Some(bar)))
}
