//! Panels: axes with ticks and names, a light grid.

use std::ops::Range;

use plotters::prelude::*;

use super::scale::TickStyle;
use super::{Area, Chart, Drawn, FigureError, GRID, INK, line, px, text};

/// A panel with axes, a light grid and labels; an empty label leaves out that axis's name.
pub fn panel<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    panel_with(area, x, y, x_label, y_label, Ground::Grid, |_| Ok(()))
}

/// What lies under the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ground {
    /// A light grid.
    Grid,
    /// A map that covers the panel.
    Map,
}

/// As [`panel`], with something drawn first.
pub(crate) fn panel_with<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    x_label: &str,
    y_label: &str,
    ground: Ground,
    under: impl FnOnce(&mut Chart<'a, 'b>) -> Drawn,
) -> Result<Chart<'a, 'b>, FigureError> {
    let (x_style, y_style) = (TickStyle::new(&x), TickStyle::new(&y));
    let x_ticks = Ticks { label: x_label, count: 8, text: &|v| x_style.text(*v) };
    let y_ticks = Ticks { label: y_label, count: 6, text: &|v| y_style.text(*v) };
    axes(area, (x, x_ticks), (y, y_ticks), ground, under)
}

/// The name of an axis and how it is divided.
pub(super) struct Ticks<'t> {
    pub(super) label: &'t str,
    pub(super) count: usize,
    pub(super) text: &'t dyn Fn(&f64) -> String,
}

/// Around a panel.
const MARGIN: f64 = 6.0;
/// At its right end.
const MARGIN_RIGHT: f64 = 24.0;
/// For the ticks and the name of the horizontal axis.
const X_LABELS: f64 = 40.0;
/// For those of the vertical axis.
const Y_LABELS: f64 = 80.0;

/// Axes, grid and labels: the look of every panel.
pub(super) fn axes<'a, 'b>(
    area: &'a Area<'b>,
    (x, x_ticks): (Range<f64>, Ticks),
    (y, y_ticks): (Range<f64>, Ticks),
    ground: Ground,
    under: impl FnOnce(&mut Chart<'a, 'b>) -> Drawn,
) -> Result<Chart<'a, 'b>, FigureError> {
    let mut chart = ChartBuilder::on(area)
        .margin(px(MARGIN))
        .margin_right(px(MARGIN_RIGHT))
        .x_label_area_size(px(if x_ticks.label.is_empty() { 20.0 } else { X_LABELS }))
        .y_label_area_size(px(Y_LABELS))
        .build_cartesian_2d(x, y)
        .map_err(FigureError::draw)?;
    under(&mut chart)?;
    // a map that covers the panel shows no grid through its data
    let grid = if matches!(ground, Ground::Map) { TRANSPARENT } else { GRID.into() };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(grid.stroke_width(px(1.0) as u32))
        .axis_style(line(INK, 1.0))
        .x_labels(x_ticks.count)
        .y_labels(y_ticks.count)
        .x_label_formatter(&x_ticks.text)
        .y_label_formatter(&y_ticks.text)
        .set_all_tick_mark_size(px(4.0))
        .label_style(text(13))
        .axis_desc_style(text(14))
        .x_desc(x_ticks.label)
        .y_desc(y_ticks.label)
        .draw()
        .map_err(FigureError::draw)?;
    Ok(chart)
}

/// A panel with the same scale on both axes; the ranges are widened to fill it.
pub(crate) fn equal_panel<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    let (w, h) = area.dim_in_pixel();
    let width = f64::from(w as i32 - px(MARGIN + MARGIN_RIGHT + Y_LABELS)).max(1.0);
    let height = f64::from(h as i32 - px(2.0 * MARGIN + X_LABELS)).max(1.0);
    let scale = ((x.end - x.start) / width).max((y.end - y.start) / height);
    let widened = |r: Range<f64>, pixels: f64| {
        let middle = 0.5 * (r.start + r.end);
        middle - 0.5 * scale * pixels..middle + 0.5 * scale * pixels
    };
    panel(area, widened(x, width), widened(y, height), x_label, y_label)
}
