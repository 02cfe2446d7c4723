//! The renderer of a chart: its axes with ticks and names, a light grid, and the layers on them.

use std::ops::Range;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::chart::{Axis, Chart, Layer, Point, Ticks};
use super::legend::width_of;
use super::mark::symbol;
use super::scale::{TickStyle, log_ticks, power_of_ten};
use super::{
    Area, Drawn, FigureError, GRID, INK, Mark, Plane, clipped, clipped_area, line, px, text,
};

/// Around a panel.
const MARGIN: f64 = 6.0;
/// At its right end.
const MARGIN_RIGHT: f64 = 24.0;
/// For the ticks and the name of the horizontal axis.
const X_LABELS: f64 = 40.0;
/// For those of the vertical axis.
const Y_LABELS: f64 = 80.0;
/// Panels less wide than this are narrow.
const NARROW: f64 = 480.0;
/// Half the length of the stroke at the end of a bar.
const CAP: f64 = 3.0;

/// A range whose ticks are different numbers: steps below the rounding of its ends would be counted for ever.
fn told_apart(range: Range<f64>) -> Range<f64> {
    let size = range.start.abs().max(range.end.abs());
    // what is no number any more is cut off: a damaged file
    if !(range.end - range.start).is_finite() {
        return range.start.clamp(-1e300, 1e300)..range.end.clamp(-1e300, 1e300);
    }
    match range.end - range.start > 1e-11 * size {
        // a tenth of a tenth of it is a number
        true if size > 1e-200 => range,
        _ if size <= 1e-200 => -1.0..1.0,
        _ => range.start - 0.5 * size..range.end + 0.5 * size,
    }
}

/// Room for what stands at the left axis: names may be long.
fn beside(chart: &Chart) -> Result<i32, FigureError> {
    let mut most = px(Y_LABELS);
    if let Ticks::Named(names) = &chart.y.ticks {
        let axis = if chart.y.label.is_empty() { 16.0 } else { 40.0 };
        for (_, name) in names {
            most = most.max(width_of(name, 13)? + px(axis));
        }
    }
    Ok(most)
}

/// Draw a chart on the whole of an area.
pub(super) fn draw(area: &Area, chart: &Chart) -> Drawn {
    let (x, y) = if chart.equal { widened(area, chart) } else { chart.frame() };
    let (x, y) = (told_apart(x), told_apart(y));
    let mut plane = ChartBuilder::on(area)
        .margin(px(MARGIN))
        .margin_right(px(MARGIN_RIGHT))
        .x_label_area_size(px(if chart.x.label.is_empty() { 20.0 } else { X_LABELS }))
        .y_label_area_size(beside(chart)?)
        .build_cartesian_2d(x.clone(), y.clone())
        .map_err(FigureError::draw)?;
    chart.under.iter().try_for_each(|layer| draw_layer(&mut plane, layer))?;
    // of its own ticks the library knows numbers and powers only
    let own = |axis: &Axis, range: &Range<f64>| match &axis.ticks {
        Ticks::Logarithm => Some(log_ticks(range)),
        Ticks::Named(ticks) => Some(ticks.clone()),
        Ticks::Linear | Ticks::Decades => None,
    };
    let (of_x, of_y) = (own(&chart.x, &x), own(&chart.y, &y));
    let grid: RGBAColor = if chart.covered { TRANSPARENT } else { GRID.into() };
    row_ticks(area, &plane, of_y.as_deref().unwrap_or(&[]), grid)?;
    column_ticks(area, &plane, of_x.as_deref().unwrap_or(&[]), grid)?;
    let count = |axis: &Axis, range: &Range<f64>, linear: usize| match axis.ticks {
        Ticks::Decades => (range.end - range.start).round() as usize + 1,
        Ticks::Linear => linear,
        _ => 0,
    };
    // a narrow panel has room for fewer numbers side by side
    let across = if area.dim_in_pixel().0 < px(NARROW) as u32 { 5 } else { 8 };
    let name = |axis: &Axis, range: &Range<f64>| {
        let (style, decades) = (TickStyle::new(range), axis.ticks == Ticks::Decades);
        move |v: &f64| match decades {
            false => style.text(*v),
            true if (v - v.round()).abs() <= 1e-6 => power_of_ten(v.round() as i32),
            true => String::new(),
        }
    };
    let (x_name, y_name) = (name(&chart.x, &x), name(&chart.y, &y));
    plane
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(grid.stroke_width(px(1.0) as u32))
        .axis_style(line(INK, 1.0))
        .x_labels(count(&chart.x, &x, across))
        .y_labels(count(&chart.y, &y, 6))
        .x_label_formatter(&x_name)
        .y_label_formatter(&y_name)
        .set_all_tick_mark_size(px(4.0))
        .label_style(text(13))
        .axis_desc_style(text(14))
        .x_desc(chart.x.label.as_str())
        .y_desc(chart.y.label.as_str())
        .draw()
        .map_err(FigureError::draw)?;
    chart.layers.iter().try_for_each(|layer| draw_layer(&mut plane, layer))
}

/// Ranges that fill an area with the same scale on both axes.
fn widened(area: &Area, chart: &Chart) -> (Range<f64>, Range<f64>) {
    let (x, y) = chart.frame();
    let (w, h) = area.dim_in_pixel();
    let width = f64::from(w as i32 - px(MARGIN + MARGIN_RIGHT + Y_LABELS)).max(1.0);
    let height = f64::from(h as i32 - px(2.0 * MARGIN + X_LABELS)).max(1.0);
    let scale = ((x.end - x.start) / width).max((y.end - y.start) / height);
    let widened = |r: Range<f64>, pixels: f64| {
        let middle = 0.5 * (r.start + r.end);
        middle - 0.5 * scale * pixels..middle + 0.5 * scale * pixels
    };
    (widened(x, width), widened(y, height))
}

/// The pixels of a panel, and where a point of it lies on them.
fn flat<'b>(plane: &Plane<'_, 'b>) -> (Area<'b>, impl Fn(Point) -> (i32, i32)) {
    let panel = plane.plotting_area();
    let area = panel.strip_coord_spec();
    let (x0, y0) = area.get_base_pixel();
    let place = move |point: Point| {
        let (x, y) = panel.map_coordinate(&point);
        (x - x0, y - y0)
    };
    (area, place)
}

fn draw_layer(plane: &mut Plane, layer: &Layer) -> Drawn {
    let frame = (plane.x_range(), plane.y_range());
    // both ends belong to an axis: the last state of a motion stands on one
    let across = |x: f64| (frame.0.start..=frame.0.end).contains(&x);
    let holds = |p: &Point| across(p.0) && (frame.1.start..=frame.1.end).contains(&p.1);
    match layer {
        Layer::Line(points, style, dash) => {
            for part in clipped(points, &frame) {
                match *dash {
                    None => plane.draw_series([PathElement::new(part, *style)]).map(drop),
                    Some((on, off)) => plane
                        .draw_series(DashedLineSeries::new(part, px(on), px(off), *style))
                        .map(drop),
                }
                .map_err(FigureError::draw)?;
            }
            Ok(())
        }
        Layer::Area(outline, style) => {
            let outline = clipped_area(outline.clone(), &frame);
            if outline.len() < 3 {
                return Ok(());
            }
            plane.draw_series([Polygon::new(outline, *style)]).map(drop).map_err(FigureError::draw)
        }
        Layer::Cells(cells) => {
            let cell =
                |(corners, fill): &([Point; 2], RGBColor)| Rectangle::new(*corners, fill.filled());
            plane.draw_series(cells.iter().map(cell)).map(drop).map_err(FigureError::draw)
        }
        Layer::Marks(points, mark, colour) => {
            let (area, place) = flat(plane);
            points
                .iter()
                .filter(|p| holds(p))
                .try_for_each(|p| symbol(&area, place(*p), *mark, *colour))
        }
        Layer::Along(lines, mark, colour, [spacing, begin]) => {
            let (area, place) = flat(plane);
            for part in lines {
                let visible: Vec<Point> = part.iter().copied().filter(holds).collect();
                for p in spaced(&visible, &place, *spacing, *begin) {
                    symbol(&area, place(p), *mark, *colour)?;
                }
            }
            Ok(())
        }
        Layer::Feet(all, colour) => {
            let (area, place) = flat(plane);
            all.iter().filter(|x| across(**x)).try_for_each(|&x| {
                let (x, y) = place((x, frame.1.start));
                symbol(&area, (x, y - px(4.0)), Mark::Tick, *colour)
            })
        }
        Layer::Bar(x, ends, style, capped) => {
            let (width, _) = plane.plotting_area().dim_in_pixel();
            let cap = (frame.0.end - frame.0.start) * f64::from(px(CAP)) / f64::from(width.max(1));
            let mut strokes = vec![ends.map(|y| (*x, y))];
            if *capped {
                strokes.extend(ends.map(|y| [(x - cap, y), (x + cap, y)]));
            }
            for part in strokes.iter().flat_map(|s| clipped(s, &frame)) {
                plane.draw_series([PathElement::new(part, *style)]).map_err(FigureError::draw)?;
            }
            Ok(())
        }
        Layer::Words(at, words) => {
            let words = Text::new(words.clone(), *at, text(12));
            plane.draw_series([words]).map(drop).map_err(FigureError::draw)
        }
        Layer::Pin(at, name) if holds(at) => pin(plane, *at, name),
        Layer::Pin(..) => Ok(()),
    }
}

/// A cross and its name, where there is room for it.
fn pin(plane: &Plane, at: Point, name: &str) -> Drawn {
    let (area, place) = flat(plane);
    let (x, y) = place(at);
    let style = text(15);
    let (width, height) = area.estimate_text_size(name, &style).map_err(FigureError::draw)?;
    let (width, height) = (width as i32, height as i32);
    let right = x + width + px(16.0) < area.dim_in_pixel().0 as i32;
    let high = y > height + px(14.0);
    let left = if right { x + px(8.0) } else { x - px(8.0) - width };
    let top = if high { y - px(6.0) - height } else { y + px(6.0) };
    let corners =
        [(left - px(2.0), top - px(1.0)), (left + width + px(2.0), top + height + px(1.0))];
    area.draw(&Rectangle::new(corners, WHITE.mix(0.85).filled())).map_err(FigureError::draw)?;
    let style = style.pos(Pos::new(HPos::Left, VPos::Top));
    area.draw(&Text::new(name.to_owned(), (left, top), style)).map_err(FigureError::draw)?;
    symbol(&area, (x, y), Mark::Cross, RGBColor(200, 0, 0))
}

/// Some points of a line, at least one, at a distance on the paper.
fn spaced(
    points: &[Point],
    place: &dyn Fn(Point) -> (i32, i32),
    spacing: f64,
    begin: f64,
) -> Vec<Point> {
    let mut left = begin;
    let mut before: Option<(i32, i32)> = None;
    let mut chosen = vec![];
    for &point in points {
        let here = place(point);
        if let Some((x, y)) = before {
            left -= f64::from(here.0 - x).hypot(f64::from(here.1 - y)) / f64::from(px(1.0));
        }
        before = Some(here);
        if left <= 0.0 {
            chosen.push(point);
            left = spacing;
        }
    }
    if chosen.is_empty() {
        chosen.extend(points.get(points.len() / 2));
    }
    chosen
}

/// A straight stroke on the pixels of an area.
fn stroke(area: &Area, ends: [(i32, i32); 2], style: ShapeStyle) -> Drawn {
    area.draw(&PathElement::new(ends.to_vec(), style)).map_err(FigureError::draw)
}

/// Ticks of the vertical axis with their grid, on the whole area: a panel cuts off what lies beside it.
fn row_ticks(area: &Area, plane: &Plane, ticks: &[(f64, String)], grid: RGBAColor) -> Drawn {
    let (panel, x) = (plane.plotting_area(), plane.x_range());
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
        stroke(area, [(left, height), (right, height)], grid.stroke_width(px(1.0) as u32))?;
        stroke(area, [(left - px(4.0), height), (left, height)], line(INK, 1.0))?;
        area.draw(&Text::new(name.clone(), (left - px(8.0), height), style.clone()))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}

/// The same for the horizontal axis.
fn column_ticks(area: &Area, plane: &Plane, ticks: &[(f64, String)], grid: RGBAColor) -> Drawn {
    let (panel, y) = (plane.plotting_area(), plane.y_range());
    let (x0, y0) = area.get_base_pixel();
    let style = text(13).pos(Pos::new(HPos::Center, VPos::Top));
    for (value, name) in ticks {
        let place = |y: f64| panel.map_coordinate(&(*value, y));
        let (at, bottom, top) = (place(y.start).0 - x0, place(y.start).1 - y0, place(y.end).1 - y0);
        if name.is_empty() {
            stroke(area, [(at, bottom), (at, bottom + px(2.5))], line(INK, 0.7))?;
            continue;
        }
        stroke(area, [(at, bottom), (at, top)], grid.stroke_width(px(1.0) as u32))?;
        stroke(area, [(at, bottom), (at, bottom + px(4.0))], line(INK, 1.0))?;
        area.draw(&Text::new(name.clone(), (at, bottom + px(7.0)), style.clone()))
            .map_err(FigureError::draw)?;
    }
    Ok(())
}
