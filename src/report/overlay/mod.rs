//! The picture `overlay`: families of several files in one panel, energy or amplitude against frequency.

mod curves;
mod draw;
mod legend;
mod names;
mod scene;

use std::ops::Range;
use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::families::{Axis, LOGARITHMIC, reached};
use super::figure::{
    self, Chart, Drawing, Drawn, FigureError, Mark, flat, panel, px, range, semilog, symbol, text,
    title,
};
use crate::store::StoredFamily;
use draw::draw;
use legend::Names;
use scene::Scene;

/// What a user may choose.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// What is shown over the frequency.
    pub axis: Axis,
    /// Its limits.
    pub value: Option<Range<f64>>,
    /// Limits of the frequency.
    pub frequency: Option<Range<f64>>,
    /// Places that are marked: frequency, energy or amplitude, name.
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
    let common = common_title(families);
    let scene = Scene::new(families, options.axis, &common);
    let checked = match options.axis {
        Axis::Energy => scene.checked_series(),
        Axis::Amplitude => vec![],
    };
    let all = || {
        let points = scene.branches.iter().flat_map(|(f, b, _)| scene.points(f, *b));
        points.chain(checked.iter().copied())
    };
    let marked = || options.points.iter().map(|(omega, value, _)| (*omega, *value));
    if all().next().is_none() {
        return Err(FigureError::Empty("the families hold no orbit"));
    }
    let x = options.frequency.clone();
    let x = x.unwrap_or_else(|| range(all().chain(marked()).map(|p| p.0)));
    let within = |v: f64| options.value.as_ref().is_none_or(|y| y.contains(&v));
    let shown: Vec<f64> =
        all().chain(marked()).filter(|p| x.contains(&p.0) && within(p.1)).map(|p| p.1).collect();
    if shown.is_empty() {
        return Err(FigureError::Empty("no orbit lies within these limits"));
    }
    let (y, logarithmic) = vertical(&scene, options, &shown);
    let scaled = |v: f64| if logarithmic { v.log10() } else { v };
    figure::svg((980, 720), |root| {
        title(root, &common, &format!("{} against frequency", options.axis.name()))?;
        let (_, sheet) = root.split_vertically(px(32.0));
        let sheet = Names::new(&scene).draw(sheet, &scene)?;
        let free: Vec<&StoredFamily> = families.iter().collect();
        let labels = ("frequency ω", options.axis.label(&free));
        let mut chart = match logarithmic {
            true => semilog(&sheet, x.clone(), y.clone(), labels.0, labels.1)?,
            false => panel(&sheet, x.clone(), y.clone(), labels.0, labels.1)?,
        };
        draw(&mut chart, &scene, &scaled)?;
        options.points.iter().try_for_each(|(omega, value, name)| {
            let inside = x.contains(omega) && *value > 0.0 && y.contains(&scaled(*value));
            if inside { label(&chart, (*omega, scaled(*value)), name) } else { Ok(()) }
        })
    })
}

/// The range of the vertical axis, or of its logarithm, and whether it is the latter.
fn vertical(scene: &Scene, options: &Options, shown: &[f64]) -> (Range<f64>, bool) {
    let least = shown.iter().copied().fold(f64::INFINITY, f64::min);
    let ends = options.value.clone();
    let ends = ends.unwrap_or_else(|| least..shown.iter().copied().fold(0.0, f64::max));
    let logarithmic = ends.start > 0.0 && ends.end > LOGARITHMIC * ends.start;
    let scaled = |v: f64| if logarithmic { v.log10() } else { v };
    if options.value.is_some() {
        return (scaled(ends.start)..scaled(ends.end), logarithmic);
    }
    let mut all = vec![ends.start, ends.end];
    if options.axis == Axis::Energy {
        let stated = scene.curves.iter().flat_map(|c| reached(c.family, least, logarithmic));
        all.extend(stated);
    }
    (range(all.into_iter().map(scaled)), logarithmic)
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
