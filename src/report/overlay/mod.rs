//! The picture `overlay`: families of several files in one panel, energy against frequency.

mod clip;
mod legend;
mod scene;

use std::ops::Range;
use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::crosscheck::{DASH, dash, parted};
use super::families::{LOGARITHMIC, pieces};
use super::figure::{
    self, Chart, Drawing, Drawn, FigureError, Mark, draw_dashes, draw_line, flat, legend_above,
    line, panel, px, range, semilog, symbol, symbols, text, title,
};
use crate::records::OrbitRecord;
use crate::store::StoredFamily;
use clip::clipped;
use legend::Names;
use scene::{Look, Scene, is_response, points};

/// What a user may choose.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// Limits of the energy.
    pub energy: Option<Range<f64>>,
    /// Limits of the frequency.
    pub frequency: Option<Range<f64>>,
    /// Places that are marked: frequency, energy, name.
    pub points: Vec<(f64, f64, String)>,
}

/// Draw the families, to be written as `STEM.svg` and `STEM.png`.
pub fn picture(
    families: &[StoredFamily],
    options: &Options,
    stem: &Path,
) -> Result<Drawing, FigureError> {
    Ok(Drawing { stem: stem.to_owned(), svg: overlay(families, options)? })
}

fn overlay(families: &[StoredFamily], options: &Options) -> Result<String, FigureError> {
    let scene = Scene::new(families);
    let all = || scene.branches.iter().flat_map(|(f, b, _)| points(f, *b));
    let marked = || options.points.iter().map(|(omega, energy, _)| (*omega, *energy));
    if all().next().is_none() {
        return Err(FigureError::Empty("the families hold no orbit"));
    }
    let x = options.frequency.clone();
    let x = x.unwrap_or_else(|| range(all().chain(marked()).map(|p| p.0)));
    let within = |e: f64| options.energy.as_ref().is_none_or(|y| y.contains(&e));
    let shown: Vec<f64> =
        all().chain(marked()).filter(|p| x.contains(&p.0) && within(p.1)).map(|p| p.1).collect();
    if shown.is_empty() {
        return Err(FigureError::Empty("no orbit lies within these limits"));
    }
    let ends = options.energy.clone().unwrap_or_else(|| {
        let least = shown.iter().copied().fold(f64::INFINITY, f64::min);
        least..shown.iter().copied().fold(0.0, f64::max)
    });
    let logarithmic = ends.start > 0.0 && ends.end > LOGARITHMIC * ends.start;
    let scaled = |v: f64| if logarithmic { v.log10() } else { v };
    let y = match options.energy {
        Some(_) => scaled(ends.start)..scaled(ends.end),
        None => range([scaled(ends.start), scaled(ends.end)]),
    };
    figure::svg((980, 720), |root| {
        title(root, &common_title(families), "energy against frequency")?;
        let (_, mut sheet) = root.split_vertically(px(32.0));
        let names = Names::new(&scene);
        for entries in names.groups(&scene) {
            sheet = legend_above(sheet, &entries)?;
        }
        let labels = ("frequency ω", "largest energy H");
        let mut chart = match logarithmic {
            true => semilog(&sheet, x.clone(), y.clone(), labels.0, labels.1)?,
            false => panel(&sheet, x.clone(), y.clone(), labels.0, labels.1)?,
        };
        draw(&mut chart, &scene, &scaled)?;
        options.points.iter().try_for_each(|(omega, energy, name)| {
            let inside = x.contains(omega) && *energy > 0.0 && y.contains(&scaled(*energy));
            if inside { label(&chart, (*omega, scaled(*energy)), name) } else { Ok(()) }
        })
    })
}

/// Lines first, dots on top of them.
fn draw(chart: &mut Chart, scene: &Scene, scaled: &dyn Fn(f64) -> f64) -> Drawn {
    let frame = (chart.x_range(), chart.y_range());
    let dash_width = DASH * (frame.0.end - frame.0.start);
    let flat_points = |points: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        points.into_iter().map(|(x, v)| (x, scaled(v))).collect()
    };
    for wanted in [
        (|look| matches!(look, Look::Response(_))) as fn(&Look) -> bool,
        |look| matches!(look, Look::ThinResponse(_)),
        |look| matches!(look, Look::Backbone(..)),
    ] {
        for (family, branch, look) in scene.branches.iter().filter(|(_, _, look)| wanted(look)) {
            let colour = scene.colour(*look);
            if let Look::Response(_) = look {
                let energy = |o: &OrbitRecord| (o.energy > 0.0).then_some(o.energy);
                for piece in pieces(family, *branch, &energy) {
                    for points in clipped(&flat_points(piece.points), &frame) {
                        match piece.stable {
                            Some(false) => draw_dashes(chart, points, line(colour, 1.3))?,
                            _ => draw_line(chart, points, line(colour, 2.0))?,
                        }
                    }
                }
                continue;
            }
            let width = if is_response(look) { 0.8 } else { 1.2 };
            let all: Vec<(f64, f64)> = points(family, *branch).collect();
            let parts = match look {
                Look::Backbone(_, false) => vec![all],
                _ => parted(&all),
            };
            for part in parts {
                for points in clipped(&flat_points(dash(part, dash_width)), &frame) {
                    draw_line(chart, points, line(colour, width))?;
                }
            }
        }
    }
    for wanted in [Look::Continued, Look::Checked] {
        for (family, branch, look) in scene.branches.iter().filter(|(_, _, look)| *look == wanted) {
            let places = points(family, *branch).map(|(x, v)| (x, scaled(v)));
            let inside = places.filter(|p| frame.0.contains(&p.0) && frame.1.contains(&p.1));
            symbols(chart, inside, Mark::Dot, scene.colour(*look))?;
        }
    }
    Ok(())
}

/// A cross and its name.
fn label(chart: &Chart, point: (f64, f64), name: &str) -> Drawn {
    let (area, place) = flat(chart);
    let (x, y) = place(point);
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

/// What the titles of all families begin with, up to a comma.
fn common_title(families: &[StoredFamily]) -> String {
    let [first, rest @ ..] = families else { return String::new() };
    let first = &first.title;
    if rest.iter().all(|f| f.title == *first) {
        return first.clone();
    }
    let commas = first.match_indices([',', ':']).map(|(i, _)| i);
    let shared = |i: &usize| rest.iter().all(|f| f.title.get(..=*i) == first.get(..=*i));
    commas.rev().find(shared).map_or(String::new(), |i| first[..i].to_owned())
}
