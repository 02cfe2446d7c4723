//! The axis of time, with the intervals of contact shaded.

use std::ops::Range;

use plotters::prelude::*;

use crate::report::figure::{Area, Chart, Drawn, FigureError, Ground, SHADE, panel_with};
use crate::store::Stored;

/// From the first to the last stored state.
pub(super) fn time_range(stored: &Stored) -> Range<f64> {
    let (a, b) =
        (stored.t.first().copied().unwrap_or(0.0), stored.t.last().copied().unwrap_or(1.0));
    if b > a { a..b } else { a..a + 1.0 }
}

/// Intervals of time in which any node touches.
fn contact_intervals(stored: &Stored) -> Vec<(f64, f64)> {
    let touching = |row: usize| stored.active.row(row).iter().any(|&a| a == 1);
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

/// Shade the intervals of contact.
fn shade(chart: &mut Chart, stored: &Stored, y: &Range<f64>) -> Drawn {
    for (a, b) in contact_intervals(stored) {
        chart
            .draw_series(std::iter::once(Rectangle::new(
                [(a, y.start), (b, y.end)],
                SHADE.filled(),
            )))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}

/// A panel over time, contact shaded.
pub(super) fn over_time<'a, 'b>(
    area: &'a Area<'b>,
    stored: &Stored,
    y: Range<f64>,
    labels: (&str, &str),
) -> Result<Chart<'a, 'b>, FigureError> {
    let under = |c: &mut Chart<'_, '_>| shade(c, stored, &y);
    panel_with(area, time_range(stored), y.clone(), labels.0, labels.1, Ground::Grid, under)
}
