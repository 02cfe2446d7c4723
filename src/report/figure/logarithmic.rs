//! Panels with logarithmic axes, and with columns that have names: what is drawn on them are decimal logarithms.

use std::ops::Range;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::panel::{Ticks, axes};
use super::scale::{TickStyle, log_ticks, power_of_ten};
use super::{Area, Chart, Drawn, FigureError, GRID, Ground, INK, line, px, text};

/// A panel whose axes are decimal logarithms, labelled as powers of ten.
pub fn loglog<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    let decades = |r: &Range<f64>| (r.end - r.start).round() as usize + 1;
    let power = |v: &f64| {
        let exponent = v.round();
        let whole = (v - exponent).abs() <= 1e-6;
        if whole { power_of_ten(exponent as i32) } else { String::new() }
    };
    let ticks = |range: &Range<f64>, label| Ticks { label, count: decades(range), text: &power };
    let (x_ticks, y_ticks) = (ticks(&x, x_label), ticks(&y, y_label));
    axes(area, (x, x_ticks), (y, y_ticks), Ground::Grid, |_| Ok(()))
}

/// A panel whose vertical axis is a decimal logarithm: `y` and what is drawn are logarithms, the ticks are numbers.
pub(crate) fn semilog<'a, 'b>(
    area: &'a Area<'b>,
    x: Range<f64>,
    y: Range<f64>,
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    let x_style = TickStyle::new(&x);
    let x_ticks = Ticks { label: x_label, count: 8, text: &|v| x_style.text(*v) };
    let y_ticks = Ticks { label: y_label, count: 0, text: &|_| String::new() };
    let ticks = log_ticks(&y);
    let under = |chart: &mut Chart<'a, 'b>| row_ticks(area, chart, &ticks);
    axes(area, (x.clone(), x_ticks), (y.clone(), y_ticks), Ground::Grid, under)
}

/// A panel whose horizontal ticks are at given places and have given names; the vertical axis is a decimal logarithm
/// as in [`semilog`] if `logarithmic`.
pub fn columns<'a, 'b>(
    area: &'a Area<'b>,
    x: (Range<f64>, &[(f64, String)]),
    (y, logarithmic): (Range<f64>, bool),
    x_label: &str,
    y_label: &str,
) -> Result<Chart<'a, 'b>, FigureError> {
    let y_style = TickStyle::new(&y);
    let x_ticks = Ticks { label: x_label, count: 0, text: &|_| String::new() };
    let count = if logarithmic { 0 } else { 6 };
    let y_ticks = Ticks { label: y_label, count, text: &|v| y_style.text(*v) };
    let ticks = if logarithmic { log_ticks(&y) } else { vec![] };
    let under = |chart: &mut Chart<'a, 'b>| {
        row_ticks(area, chart, &ticks)?;
        column_ticks(area, chart, x.1)
    };
    axes(area, (x.0.clone(), x_ticks), (y.clone(), y_ticks), Ground::Grid, under)
}

/// A straight stroke on the pixels of an area.
fn stroke(area: &Area, ends: [(i32, i32); 2], style: ShapeStyle) -> Drawn {
    area.draw(&PathElement::new(ends.to_vec(), style)).map_err(FigureError::draw)
}

/// Ticks of the vertical axis with their grid, on the whole area: a panel cuts off what lies beside it.
fn row_ticks(area: &Area, chart: &Chart, ticks: &[(f64, String)]) -> Drawn {
    let (panel, x) = (chart.plotting_area(), chart.x_range());
    let (x0, y0) = area.get_base_pixel();
    let style = text(13).pos(Pos::new(HPos::Right, VPos::Center));
    for (value, name) in ticks {
        let place = |x: f64| panel.map_coordinate(&(x, *value));
        let (left, height) = (place(x.start).0 - x0, place(x.start).1 - y0);
        let right = place(x.end).0 - x0;
        if name.is_empty() {
            stroke(area, [(left - px(2.5), height), (left, height)], line(INK, 0.7))?;
            continue;
        }
        stroke(area, [(left, height), (right, height)], line(GRID, 1.0))?;
        stroke(area, [(left - px(4.0), height), (left, height)], line(INK, 1.0))?;
        area.draw(&Text::new(name.clone(), (left - px(8.0), height), style.clone()))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}

/// The same for the horizontal axis.
fn column_ticks(area: &Area, chart: &Chart, ticks: &[(f64, String)]) -> Drawn {
    let (panel, y) = (chart.plotting_area(), chart.y_range());
    let (x0, y0) = area.get_base_pixel();
    let style = text(13).pos(Pos::new(HPos::Center, VPos::Top));
    for (value, name) in ticks {
        let place = |y: f64| panel.map_coordinate(&(*value, y));
        let (at, bottom, top) = (place(y.start).0 - x0, place(y.start).1 - y0, place(y.end).1 - y0);
        if name.is_empty() {
            stroke(area, [(at, bottom), (at, bottom + px(2.5))], line(INK, 0.7))?;
            continue;
        }
        stroke(area, [(at, bottom), (at, top)], line(GRID, 1.0))?;
        stroke(area, [(at, bottom), (at, bottom + px(4.0))], line(INK, 1.0))?;
        area.draw(&Text::new(name.clone(), (at, bottom + px(7.0)), style.clone()))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}
