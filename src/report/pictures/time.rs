//! The axis of time, with the intervals of contact shaded.

use std::ops::Range;

use crate::report::figure::{Axis, Chart, Entry, LINES, Mark, Point, SHADE, entry};
use crate::store::Stored;

/// From the first to the last stored state.
pub(super) fn time_range(stored: &Stored) -> Range<f64> {
    let (a, b) =
        (stored.t.first().copied().unwrap_or(0.0), stored.t.last().copied().unwrap_or(1.0));
    if b > a { a..b } else { a..a + 1.0 }
}

/// Intervals of time in which any node touches.
fn contact_intervals(stored: &Stored) -> Vec<(f64, f64)> {
    let touching = |row: usize| (0..stored.facing()).any(|i| stored.touches(row, i));
    let mut intervals = vec![];
    let mut start = None;
    for row in 0..stored.t.len() {
        match (touching(row), start) {
            (true, None) => start = Some(stored.t[row]),
            (false, Some(a)) => {
                intervals.push((a, stored.t[row]));
                start = None;
            }
            _ => {}
        }
    }
    if let (Some(a), Some(&b)) = (start, stored.t.last()) {
        intervals.push((a, b));
    }
    intervals
}

/// A chart over time, contact shaded.
pub(super) fn over_time(stored: &Stored, y: Range<f64>, labels: (&str, &str)) -> Chart {
    let (low, high) = (y.start, y.end);
    let shade = |(a, b)| ([(a, low), (b, high)], SHADE);
    let mut chart =
        Chart::new(Axis::linear(labels.0, time_range(stored)), Axis::linear(labels.1, y));
    chart.ground(contact_intervals(stored).into_iter().map(shade).collect());
    chart
}

/// Draw curves in colours that come again as dashes.
pub(super) fn draw(chart: &mut Chart, curves: Vec<(String, Vec<Point>)>, entries: &mut Vec<Entry>) {
    for (k, (name, points)) in curves.into_iter().enumerate() {
        let colour = LINES[k % LINES.len()];
        let mark = if k < LINES.len() { Mark::Line } else { Mark::Dashes };
        match mark {
            Mark::Dashes => chart.dashes(points, colour, 1.5),
            _ => chart.line(points, colour, 1.5),
        }
        entries.push(entry(name, colour, mark));
    }
}
