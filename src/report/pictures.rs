//! The pictures of a stored run: contact, energy, gap map, deformed shapes.

use std::path::Path;

use plotters::prelude::*;

use super::curve::{self, Knot};
use super::figure::{
    self, Area, Chart, Drawing, FigureError, Ground, INK, LINES, Mark, SHADE, colour_bar, legend,
    line, panel, panel_with, px, range, text, viridis,
};
use crate::scenario::{BodyKind, Scene};
use crate::store::{Stored, beside};

type Drawn = Result<(), FigureError>;

/// A picture's name and how it is drawn.
struct Picture {
    name: &'static str,
    draw: fn(&Stored, &Options) -> Result<String, FigureError>,
}

const PICTURES: [Picture; 4] = [
    Picture { name: "contact", draw: contact },
    Picture { name: "energy", draw: energy },
    Picture { name: "gap", draw: gap_map },
    Picture { name: "shapes", draw: shapes },
];

/// What a user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Times of the deformed shapes, as fractions of the stored time.
    pub fractions: Vec<f64>,
    /// Mesh nodes whose contact is drawn; none: up to twelve along the edge.
    pub nodes: Vec<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Options { fractions: (0..8).map(|k| f64::from(k) / 7.0).collect(), nodes: vec![] }
    }
}

/// Names of the pictures.
pub fn names() -> Vec<&'static str> {
    PICTURES.iter().map(|p| p.name).collect()
}

/// Draw the named pictures (all that make sense if `only` is empty), to be written as `STEM-NAME.svg` and `.png`.
pub fn draw_all(
    stored: &Stored,
    stem: &Path,
    only: &[String],
    options: &Options,
) -> Result<Vec<Drawing>, FigureError> {
    let mut drawn = vec![];
    for picture in &PICTURES {
        if !only.is_empty() && !only.iter().any(|o| o == picture.name) {
            continue;
        }
        let svg = match (picture.draw)(stored, options) {
            Ok(svg) => svg,
            Err(FigureError::Empty(_)) if only.is_empty() => continue,
            Err(e) => return Err(e),
        };
        drawn.push(Drawing { stem: beside(stem, &format!("-{}", picture.name)), svg });
    }
    Ok(drawn)
}

fn time_range(stored: &Stored) -> std::ops::Range<f64> {
    let (a, b) =
        (stored.t.first().copied().unwrap_or(0.0), stored.t.last().copied().unwrap_or(1.0));
    if b > a { a..b } else { a..a + 1.0 }
}

fn title(area: &Area, stored: &Stored, what: &str) -> Drawn {
    let title: String = stored.title.chars().filter(|c| !c.is_control()).take(90).collect();
    let name = if title.is_empty() { String::new() } else { format!("{title}: ") };
    area.draw(&Text::new(format!("{name}{what}"), (px(12.0), px(8.0)), text(16)))
        .map_err(FigureError::draw)
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

fn shade(chart: &mut Chart, stored: &Stored, y: &std::ops::Range<f64>) -> Drawn {
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

/// Position of a contact node along its edge, from 0 to 1.
fn along_edge(stored: &Stored) -> (Vec<f64>, &'static str) {
    let axis = if stored.contact_normal.ends_with('y') { 0 } else { 1 };
    let position: Vec<f64> =
        stored.contact_nodes.iter().map(|&n| stored.nodes[(n, axis)]).collect();
    (position, ["x", "y"][axis])
}

/// Contact displacement and pressure against time, contact intervals shaded.
fn contact(stored: &Stored, options: &Options) -> Result<String, FigureError> {
    let n_c = stored.gap.len();
    if n_c == 0 || stored.t.is_empty() {
        return Err(FigureError::Empty("the body has no contact nodes"));
    }
    let (position, axis) = along_edge(stored);
    let chosen = |i: &usize| options.nodes.contains(&stored.contact_nodes[*i]);
    let shown: Vec<usize> = match n_c {
        _ if !options.nodes.is_empty() => (0..n_c).filter(chosen).collect(),
        0..=12 => (0..n_c).collect(),
        _ => (0..12).map(|k| k * (n_c - 1) / 11).collect(),
    };
    let (low, high) = (position[0], position[n_c - 1]);
    let colour = |i: usize| match n_c {
        1 => LINES[0],
        _ => viridis(0.92 * (position[i] - low) / (high - low)),
    };
    let rows = stored.t.len();
    figure::svg((980, 620), |root| {
        title(root, stored, "contact")?;
        let (_, sheet) = root.split_vertically(px(30.0));
        let (main, bar) = if n_c > 1 {
            let (main, bar) = sheet.split_horizontally(px(900.0));
            (main, Some(bar))
        } else {
            (sheet, None)
        };
        let (strip, main) = main.split_vertically(px(20.0));
        let panels = main.split_evenly((2, 1));
        let x = time_range(stored);
        let value = |row: usize, i: usize| stored.contact_displacement(row, i);
        let sign = if stored.contact_normal.starts_with('-') { -1.0 } else { 1.0 };
        let first = stored.v.ncols() - n_c;
        let velocity = |row: usize, i: usize| sign * stored.v[(row, first + i)];
        let all = shown.iter().flat_map(|&i| (0..rows).map(move |r| (r, i)));
        let y = range(all.clone().map(|(r, i)| value(r, i)).chain(stored.gap.iter().copied()));
        let under = |c: &mut Chart<'_, '_>| shade(c, stored, &y);
        let mut upper = panel_with(
            &panels[0],
            x.clone(),
            y.clone(),
            "",
            "contact displacement",
            Ground::Grid,
            under,
        )?;
        let gaps: Vec<f64> = stored.gap.clone();
        let mut entries = vec![("in contact", SHADE, Mark::Patch)];
        if gaps.iter().all(|g| *g == gaps[0]) {
            let ends = [(x.start, gaps[0]), (x.end, gaps[0])];
            let dashes = DashedLineSeries::new(ends, px(6.0), px(4.0), line(INK, 1.0));
            upper.draw_series(dashes).map_err(FigureError::draw)?;
            entries.push(("obstacle", INK, Mark::Dashes));
        }
        legend(&strip, &entries)?;
        for &i in &shown {
            let knot = |r: usize| Knot { t: stored.t[r], x: value(r, i), v: velocity(r, i) };
            let knots: Vec<Knot> = (0..rows).map(knot).collect();
            let jump = |r: usize| stored.switch_t.contains(&stored.t[r]);
            let series = curve::through(&knots, jump).into_iter().map(|k| (k.t, k.x));
            upper
                .draw_series(LineSeries::new(series, line(colour(i), 2.0)))
                .map_err(FigureError::draw)?;
        }
        let y = range(all.map(|(r, i)| stored.pressure[(r, i)]).chain([0.0]));
        let under = |c: &mut Chart<'_, '_>| shade(c, stored, &y);
        let mut lower =
            panel_with(&panels[1], x, y.clone(), "time", "contact pressure", Ground::Grid, under)?;
        for &i in &shown {
            let series = (0..rows).map(|r| (stored.t[r], stored.pressure[(r, i)]));
            lower
                .draw_series(LineSeries::new(series, line(colour(i), 2.0)))
                .map_err(FigureError::draw)?;
        }
        match bar {
            Some(bar) => {
                let label = format!("node {axis}");
                colour_bar(&bar, low..high, &label, |s| viridis(0.92 * s))
            }
            None => Ok(()),
        }
    })
}

/// Energies, and what the ledger leaves unexplained.
fn energy(stored: &Stored, _: &Options) -> Result<String, FigureError> {
    let [kinetic, elastic, external, dissipated, jumps] = &stored.energy[..] else {
        return Err(FigureError::Empty("no energies are stored"));
    };
    let rows = stored.t.len();
    if rows == 0 {
        return Err(FigureError::Empty("no states are stored"));
    }
    let total: Vec<f64> = (0..rows).map(|r| kinetic[r] + elastic[r]).collect();
    let explained: Vec<f64> =
        (0..rows).map(|r| total[0] + external[r] - dissipated[r] + jumps[r]).collect();
    let scale = total.iter().chain(external).chain(dissipated).fold(0.0f64, |m, x| m.max(x.abs()));
    let floor = 1e-16;
    let defect: Vec<f64> = total
        .iter()
        .zip(&explained)
        .map(|(a, b)| ((a - b).abs() / scale.max(f64::MIN_POSITIVE)).max(floor))
        .collect();
    figure::svg((980, 760), |root| {
        title(root, stored, "energy ledger")?;
        let (_, sheet) = root.split_vertically(px(30.0));
        let (strip, sheet) = sheet.split_vertically(px(20.0));
        let panels = sheet.split_evenly((3, 1));
        let x = time_range(stored);
        let curves: Vec<(&str, &Vec<f64>)> = vec![
            ("kinetic", kinetic),
            ("elastic", elastic),
            ("work of the loads", external),
            ("dissipated", dissipated),
            ("kinetic + elastic", &total),
        ];
        let present: Vec<_> =
            curves.into_iter().filter(|(_, c)| c.iter().any(|&v| v != 0.0)).collect();
        let y = range(present.iter().flat_map(|(_, c)| c.iter().copied()).chain([0.0]));
        let under = |c: &mut Chart<'_, '_>| shade(c, stored, &y);
        let mut upper =
            panel_with(&panels[0], x.clone(), y.clone(), "", "energy", Ground::Grid, under)?;
        let mut entries = vec![("in contact", SHADE, Mark::Patch)];
        entries.truncate(usize::from(!stored.gap.is_empty()));
        for (k, (name, values)) in present.iter().enumerate() {
            let colour = if *name == "kinetic + elastic" { INK } else { LINES[k % LINES.len()] };
            let series = stored.t.iter().copied().zip(values.iter().copied());
            upper
                .draw_series(LineSeries::new(series, line(colour, 2.0)))
                .map_err(FigureError::draw)?;
            entries.push((*name, colour, Mark::Line));
        }
        legend(&strip, &entries)?;

        let y = range(jumps.iter().copied().chain([0.0]));
        let under = |c: &mut Chart<'_, '_>| shade(c, stored, &y);
        let mut middle = panel_with(
            &panels[1],
            x.clone(),
            y.clone(),
            "",
            "Σ jumps at switches",
            Ground::Grid,
            under,
        )?;
        let steps = (0..rows).flat_map(|r| {
            let before = if r > 0 { jumps[r - 1] } else { jumps[0] };
            [(stored.t[r], before), (stored.t[r], jumps[r])]
        });
        middle
            .draw_series(LineSeries::new(steps, line(LINES[1], 2.0)))
            .map_err(FigureError::draw)?;

        let digits = defect.iter().map(|d| d.log10()).collect::<Vec<_>>();
        let low = digits.iter().copied().fold(-16.0f64, f64::min).floor() - 0.3;
        let high = digits.iter().copied().fold(-14.0f64, f64::max).ceil() + 0.3;
        let y = low..high;
        let label = "log₁₀ |unexplained| / energy";
        let under = |c: &mut Chart<'_, '_>| shade(c, stored, &y);
        let mut lower = panel_with(&panels[2], x, y.clone(), "time", label, Ground::Grid, under)?;
        lower
            .draw_series(LineSeries::new(stored.t.iter().copied().zip(digits), line(LINES[2], 1.0)))
            .map_err(FigureError::draw)?;
        Ok(())
    })
}

/// The gap over the contact edge and time; contact is white.
fn gap_map(stored: &Stored, _: &Options) -> Result<String, FigureError> {
    let n_c = stored.gap.len();
    let rows = stored.t.len();
    if n_c < 2 || rows < 2 {
        return Err(FigureError::Empty(
            "a gap map needs at least two contact nodes and two states",
        ));
    }
    let (position, axis) = along_edge(stored);
    let gap = |r: usize, i: usize| stored.gap[i] - stored.contact_displacement(r, i);
    let largest = (0..rows)
        .flat_map(|r| (0..n_c).map(move |i| (r, i)))
        .map(|(r, i)| gap(r, i))
        .fold(f64::MIN_POSITIVE, f64::max);
    let boundaries: Vec<f64> = (0..=n_c)
        .map(|i| match i {
            0 => position[0],
            i if i == n_c => position[n_c - 1],
            i => 0.5 * (position[i - 1] + position[i]),
        })
        .collect();
    // at most this many columns: neighbours in time are drawn together, contact first
    let stride = rows.div_ceil(900);
    figure::svg((980, 420), |root| {
        title(root, stored, "gap along the contact edge")?;
        let (_, sheet) = root.split_vertically(px(30.0));
        let (main, bar) = sheet.split_horizontally(px(895.0));
        let x = time_range(stored);
        let y = position[0]..position[n_c - 1];
        let label = format!("{axis} on the contact edge");
        let under = |chart: &mut Chart<'_, '_>| -> Drawn {
            let last = stored.t[rows - 1];
            for start in (0..rows - 1).step_by(stride) {
                let end = (start + stride).min(rows - 1);
                // each cell reaches under its right and upper neighbours, which are drawn later: no seams
                let beyond = stored.t[(end + stride).min(rows - 1)].min(last);
                for i in 0..n_c {
                    let touching = (start..end).filter(|&r| stored.active[(r, i)] == 1).count();
                    let gap_here = (start..end).map(|r| gap(r, i)).fold(f64::INFINITY, f64::min);
                    let fill = if 2 * touching > end - start {
                        WHITE
                    } else {
                        viridis(gap_here / largest)
                    };
                    let corners =
                        [(stored.t[start], boundaries[i]), (beyond, boundaries[(i + 2).min(n_c)])];
                    let cell = Rectangle::new(corners, fill.filled());
                    chart.draw_series(std::iter::once(cell)).map_err(FigureError::draw)?;
                }
            }
            Ok(())
        };
        panel_with(&main, x, y, "time", &label, Ground::Map, under)?;
        colour_bar(&bar, 0.0..largest, "gap", viridis)?;
        let (_, h) = bar.dim_in_pixel();
        let note = h as i32 - px(30.0);
        let (left, right) = (px(8.0), px(24.0));
        bar.draw(&Rectangle::new([(left, note), (right, note + px(14.0))], line(INK, 1.0)))
            .map_err(FigureError::draw)?;
        bar.draw(&Text::new("contact", (px(29.0), note), text(12))).map_err(FigureError::draw)
    })
}

/// The span of time whose fractions are drawn: all that is stored, or the last period of a scene that
/// has one.
fn shape_span(stored: &Stored) -> std::ops::Range<f64> {
    let time = time_range(stored);
    let period = Scene::parse(&stored.scene, Path::new("stored")).ok().and_then(|s| s.period());
    match period {
        Some(t) if time.end - time.start > 2.0 * t => time.end - t..time.end,
        _ => time,
    }
}

/// Stored states nearest to the chosen fractions of that span.
fn chosen_rows(stored: &Stored, options: &Options) -> Vec<usize> {
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
    options.fractions.iter().map(nearest).collect()
}

/// Deformed shapes at fractions of the stored time, coloured by ‖u‖ (a bar: u against x).
fn shapes(stored: &Stored, options: &Options) -> Result<String, FigureError> {
    if stored.t.is_empty() {
        return Err(FigureError::Empty("no states are stored"));
    }
    let scene = Scene::parse(&stored.scene, Path::new("stored"));
    if scene.is_ok_and(|s| s.body.kind == BodyKind::Matrices) {
        return Err(FigureError::Empty("a body given by matrices has no shape"));
    }
    let rows = chosen_rows(stored, options);
    if stored.elements.ncols() == 2 {
        bar_shapes(stored, &rows)
    } else {
        plate_shapes(stored, &rows)
    }
}

fn bar_shapes(stored: &Stored, rows: &[usize]) -> Result<String, FigureError> {
    let n = stored.nodes.nrows();
    figure::svg((980, 460), |root| {
        title(root, stored, "displacement at successive times")?;
        let (_, sheet) = root.split_vertically(px(30.0));
        let (main, bar) = sheet.split_horizontally(px(895.0));
        let x = range((0..n).map(|i| stored.nodes[(i, 0)]));
        let all = rows.iter().flat_map(|&r| (0..n).map(move |i| (r, i)));
        let y = range(all.map(|(r, i)| stored.displacement(r, i)[0]));
        let (strip, main) = main.split_vertically(px(20.0));
        // the obstacle limits the displacement of one end
        let sign = if stored.contact_normal.starts_with('-') { -1.0 } else { 1.0 };
        let wall = stored.gap.first().map(|g| sign * g);
        let y = range([y.start, y.end].into_iter().chain(wall));
        let reach = 0.04 * (x.end - x.start);
        let mut chart = panel(&main, x, y, "x", "displacement u")?;
        if let (Some(limit), Some(&node)) = (wall, stored.contact_nodes.first()) {
            let at = stored.nodes[(node, 0)];
            let ends = vec![(at - reach, limit), (at + reach, limit)];
            chart
                .draw_series(std::iter::once(PathElement::new(ends, line(INK, 2.5))))
                .map_err(FigureError::draw)?;
            legend(&strip, &[("limit set by the obstacle", INK, Mark::Line)])?;
        }
        for (k, &r) in rows.iter().enumerate() {
            let s = k as f64 / (rows.len().max(2) - 1) as f64;
            let series = (0..n).map(|i| (stored.nodes[(i, 0)], stored.displacement(r, i)[0]));
            chart
                .draw_series(LineSeries::new(series, line(viridis(0.92 * s), 2.0)))
                .map_err(FigureError::draw)?;
        }
        colour_bar(&bar, shape_span(stored), "time", |s| viridis(0.92 * s))
    })
}

/// Largest displacement as drawn, as a fraction of the body's length: linear elasticity knows no scale.
const DRAWN: f64 = 0.25;

fn plate_shapes(stored: &Stored, rows: &[usize]) -> Result<String, FigureError> {
    let n = stored.nodes.nrows();
    let size = |r: usize, i: usize| {
        let [ux, uy] = stored.displacement(r, i);
        ux.hypot(uy)
    };
    let all = || rows.iter().flat_map(|&r| (0..n).map(move |i| (r, i)));
    let largest = all().map(|(r, i)| size(r, i)).fold(f64::MIN_POSITIVE, f64::max);
    let length = stored.nodes.iter().fold(0.0f64, |m, x| m.max(*x));
    let magnification = DRAWN * length / largest;
    let position = |r: usize, i: usize| {
        let [ux, uy] = stored.displacement(r, i);
        [stored.nodes[(i, 0)] + magnification * ux, stored.nodes[(i, 1)] + magnification * uy]
    };
    let wall = wall_line(stored, magnification);
    let through = |c: usize| {
        let walls = wall.iter().flatten().map(move |p| p[c]);
        let nodes = (0..n).map(|i| stored.nodes[(i, c)]);
        range(all().map(|(r, i)| position(r, i)[c]).chain(nodes).chain(walls))
    };
    let (x, y) = (through(0), through(1));
    let columns = if rows.len() > 3 { rows.len().div_ceil(2) } else { rows.len() };
    let lines = rows.len().div_ceil(columns.max(1));
    let width = 900.0 / columns.max(1) as f64;
    let aspect = (y.end - y.start) / (x.end - x.start);
    let height = (width - 12.0) * aspect + 32.0;
    let sheet_height = 40 + (lines as f64 * height) as u32;
    figure::svg((980, sheet_height.max(220)), |root| {
        let what = format!("deformed shape, displacements × {}", significant(magnification));
        title(root, stored, &what)?;
        let (_, sheet) = root.split_vertically(px(36.0));
        let (main, bar) = sheet.split_horizontally(px(905.0));
        let panels = main.split_evenly((lines, columns));
        let time = shape_span(stored);
        for (panel, &r) in panels.iter().zip(rows) {
            let fraction = (stored.t[r] - time.start) / (time.end - time.start);
            let label = format!(
                "t = {} ({} %)",
                super::summary::significant(stored.t[r], 5),
                percent(fraction)
            );
            panel
                .draw(&Text::new(label, (px(8.0), px(2.0)), text(13)))
                .map_err(FigureError::draw)?;
            let (_, canvas) = panel.split_vertically(px(20.0));
            let (w, h) = canvas.dim_in_pixel();
            // equal scales in both directions
            let (w, h) = (f64::from(w), f64::from(h));
            let border = f64::from(px(4.0));
            let scale = ((w - 2.0 * border) / (x.end - x.start))
                .min((h - 2.0 * border) / (y.end - y.start));
            let pixel = |p: [f64; 2]| {
                let along = border + (p[0] - x.start) * scale;
                let up = h - border - (p[1] - y.start) * scale;
                (along.round() as i32, up.round() as i32)
            };
            for e in stored.elements.rows() {
                let corners: Vec<Corner> = e
                    .iter()
                    .map(|&i| Corner { at: position(r, i as usize), value: size(r, i as usize) })
                    .collect();
                for (patch, value) in patches(&corners, scale, largest) {
                    let patch: Vec<(i32, i32)> = patch.into_iter().map(pixel).collect();
                    let colour = viridis(value / largest);
                    canvas
                        .draw(&Polygon::new(patch.clone(), colour.filled()))
                        .map_err(FigureError::draw)?;
                    // neighbours touch without a light seam
                    let closed: Vec<_> = patch.iter().chain(&patch[..1]).copied().collect();
                    canvas
                        .draw(&PathElement::new(closed, line(colour, 0.7)))
                        .map_err(FigureError::draw)?;
                }
            }
            draw_outline(&canvas, stored, pixel)?;
            draw_wall(&canvas, &wall, stored, pixel)?;
        }
        colour_bar(&bar, 0.0..largest, "‖u‖", viridis)
    })
}

/// A corner of an element in a picture: place and value.
#[derive(Clone, Copy)]
struct Corner {
    at: [f64; 2],
    value: f64,
}

/// Colours that an element is at least divided into, over the whole scale; and least size of a patch in pixels.
const SHADES: f64 = 48.0;
const SMALLEST_PATCH: f64 = 3.0;

/// An element in patches of one colour each: the value is interpolated between the corners (bilinear on quadrilaterals), in as many steps as its
/// change asks for.
fn patches(corners: &[Corner], scale: f64, largest: f64) -> Vec<(Vec<[f64; 2]>, f64)> {
    let &[a, b, c, d] = corners else {
        let mean = corners.iter().map(|c| c.value).sum::<f64>() / corners.len() as f64;
        return vec![(corners.iter().map(|c| c.at).collect(), mean)];
    };
    let mix = |f: &dyn Fn(Corner) -> f64, s: f64, t: f64| {
        (1.0 - t) * ((1.0 - s) * f(a) + s * f(b)) + t * ((1.0 - s) * f(d) + s * f(c))
    };
    let steps = |p: [Corner; 2], q: [Corner; 2]| -> usize {
        let of = |[p, q]: [Corner; 2]| {
            let length = scale * (p.at[0] - q.at[0]).hypot(p.at[1] - q.at[1]);
            let shades = SHADES * (p.value - q.value).abs() / largest;
            shades.min(length / SMALLEST_PATCH)
        };
        of(p).max(of(q)).ceil().clamp(1.0, 12.0) as usize
    };
    let (m, n) = (steps([a, b], [d, c]), steps([a, d], [b, c]));
    let mut all = Vec::with_capacity(m * n);
    for i in 0..m {
        for j in 0..n {
            let at = |i: usize, j: usize| {
                let (s, t) = (i as f64 / m as f64, j as f64 / n as f64);
                [mix(&|c| c.at[0], s, t), mix(&|c| c.at[1], s, t)]
            };
            let middle = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
            let value = mix(&|c| c.value, middle(i, m), middle(j, n));
            all.push((vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], value));
        }
    }
    all
}

/// A fraction in percent with one decimal where it has one.
fn percent(fraction: f64) -> String {
    let text = format!("{:.1}", 100.0 * fraction);
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// Three significant digits, no trailing zeros.
fn significant(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let decimals = (2.0 - v.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{v:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// The undeformed outline.
fn draw_outline(canvas: &Area, stored: &Stored, pixel: impl Fn([f64; 2]) -> (i32, i32)) -> Drawn {
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
fn wall_line(stored: &Stored, magnification: f64) -> Option<Vec<[f64; 2]>> {
    let axis = usize::from(stored.contact_normal.ends_with('y'));
    let sign = if stored.contact_normal.starts_with('-') { -1.0 } else { 1.0 };
    if stored.gap.is_empty() {
        return None;
    }
    let at = |(&n, g): (&usize, &f64)| {
        let mut p = [stored.nodes[(n, 0)], stored.nodes[(n, 1)]];
        p[axis] += sign * magnification * g;
        p
    };
    Some(stored.contact_nodes.iter().zip(&stored.gap).map(at).collect())
}

fn draw_wall(
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
