//! The picture `states`: what each contact point does over time, of bodies with friction.

use std::ops::Range;

use plotters::prelude::RGBColor;

use super::Options;
use super::time::time_range;
use crate::contact::PointState;
use crate::report::edge::Edge;
use crate::report::figure::{
    Axis, Cell, Chart, Entry, FigureError, LINES, Legend, Mark, Point, SHADE, Sheet, entry,
};
use crate::store::Stored;

/// So many stored states at the most have a colour of their own; of more, neighbours in time are drawn together.
const COLUMNS: usize = 2000;
/// How far cells reach under their neighbours, over their height.
const UNDER: f64 = 0.1;
/// Neighbours that are so many times further apart than those on the other side are none.
const APART: f64 = 4.0;
/// So many sliders have names at the axis.
const NAMED: usize = 24;

/// What a point can do, what it is called here, its colour.
const KINDS: [(PointState, &str, RGBColor); 5] = [
    (PointState::Open, "open", RGBColor(232, 232, 232)),
    (PointState::Closed, "in contact, without friction", SHADE),
    (PointState::Stick, "sticks", LINES[0]),
    (PointState::SlipPlus, "slips forwards", LINES[1]),
    (PointState::SlipMinus, "slips backwards", LINES[2]),
];

/// The state of a point over some stored states: that which lasts longest.
fn lasting(stored: &Stored, rows: Range<usize>, point: usize) -> usize {
    let mut time = [0.0; KINDS.len()];
    for r in rows {
        let code = stored.active[(r, point)];
        let kind = KINDS.iter().position(|k| k.0.code() == code).unwrap_or(0);
        time[kind] += stored.t[r + 1] - stored.t[r];
    }
    (0..KINDS.len()).max_by(|a, b| time[*a].total_cmp(&time[*b])).unwrap_or(0)
}

/// Cells of some points, which stand between given heights; what occurs is marked in `seen`.
fn cells(
    stored: &Stored,
    points: &[(usize, Range<f64>)],
    seen: &mut [bool; KINDS.len()],
) -> Vec<([Point; 2], RGBColor)> {
    let rows = stored.t.len() - 1;
    let stride = rows.div_ceil(COLUMNS);
    let (last, span) = (stored.t[rows], stored.t[rows] - stored.t[0]);
    let mut all = vec![];
    for (k, (point, height)) in points.iter().enumerate() {
        let starts: Vec<usize> = (0..rows).step_by(stride).collect();
        let of = |start: usize| lasting(stored, start..rows.min(start + stride), *point);
        let kinds: Vec<usize> = starts.iter().map(|s| of(*s)).collect();
        let mut runs: Vec<(usize, f64)> = vec![];
        for (start, kind) in starts.iter().zip(kinds) {
            seen[kind] = true;
            if runs.last().is_none_or(|last| last.0 != kind) {
                runs.push((kind, stored.t[*start]));
            }
        }
        // each reaches a little under its right and upper neighbours, which are drawn later: no seams
        let touches = points.get(k + 1).is_some_and(|p| p.1.start <= height.end);
        let under = if touches { UNDER * (height.end - height.start) } else { 0.0 };
        for (i, &(kind, start)) in runs.iter().enumerate() {
            let end = runs.get(i + 1).map_or(last, |r| last.min(r.1 + 0.01 * UNDER * span));
            all.push(([(start, height.start), (end, height.end + under)], KINDS[kind].2));
        }
    }
    all
}

/// Contact points along the edge between the middles of their neighbours; sliders one above the other.
fn places(stored: &Stored) -> [Vec<(usize, Range<f64>)>; 2] {
    let edge = Edge::of(stored);
    let at: Vec<f64> = edge.fronts.iter().map(|&i| edge.position[i]).collect();
    let last = at.len().saturating_sub(1);
    let of_front = |(k, &i): (usize, &usize)| {
        let below = if k == 0 { 0.0 } else { at[k] - at[k - 1] };
        let above = if k == last { 0.0 } else { at[k + 1] - at[k] };
        let half = |own: f64, other: f64| match other > 0.0 && own > APART * other {
            true => 0.5 * other,
            false => 0.5 * own,
        };
        (i, at[k] - half(below, above)..at[k] + half(above, below))
    };
    let rises = last > 0 && at.windows(2).all(|p| p[1] > p[0]);
    let numbered = |(k, i): (usize, usize)| (i, k as f64 - 0.5..k as f64 + 0.5);
    let fronts = match rises {
        true => edge.fronts.iter().enumerate().map(of_front).collect(),
        false => edge.fronts.iter().copied().enumerate().map(numbered).collect(),
    };
    [fronts, (stored.facing()..stored.gap.len()).enumerate().map(numbered).collect()]
}

/// The states of all points with friction over time.
pub(super) fn states<'s>(stored: &'s Stored, _: &Options) -> Result<Sheet<'s>, FigureError> {
    if stored.rubbed.is_none() || stored.t.len() < 2 {
        return Err(FigureError::Empty("states in time are drawn of runs with friction"));
    }
    let mut seen = [false; KINDS.len()];
    let mut charts = vec![];
    let [fronts, sliders] = places(stored);
    for (points, is_edge) in [(fronts, true), (sliders, false)] {
        let (Some(first), Some(last)) = (points.first(), points.last()) else { continue };
        let range = first.1.start..last.1.end;
        let names =
            || points.iter().map(|(i, h)| (0.5 * (h.start + h.end), stored.contact_name(*i)));
        let axis = match (is_edge, points.len()) {
            (true, 2..) => Axis::linear(Edge::of(stored).label(), range),
            (true, _) => Axis::named("contact node", range, names().collect()),
            (false, ..=NAMED) => Axis::named("", range, names().collect()),
            (false, _) => Axis::linear("slider", range),
        };
        let mut chart = Chart::new(Axis::linear("time", time_range(stored)), axis);
        chart.cover(cells(stored, &points, &mut seen));
        charts.push((90.0 + 300.0 * (points.len() as f64 / 12.0).min(1.0), chart));
    }
    let shown = KINDS.iter().zip(seen).filter(|(_, seen)| *seen);
    let entries: Vec<Entry> = shown.map(|(k, _)| entry(k.1.to_owned(), k.2, Mark::Patch)).collect();
    let sheet = Sheet::new(&stored.title, "states over time").legend(Legend::Rows(entries));
    Ok(charts.into_iter().fold(sheet, |s, (height, chart)| s.row(height, vec![Cell::from(chart)])))
}
