//! The picture `overlay`: families of several files in one panel, energy against frequency.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::crosscheck::{DASH, dash, parted};
use super::families::{LOGARITHMIC, branches, of_branch, pieces};
use super::figure::{
    self, Chart, Drawing, Drawn, Entry, FigureError, INK, LINES, Mark, draw_dashes, draw_line,
    flat, legend_above, line, panel, px, range, semilog, symbol, symbols, text, title,
};
use crate::records::{Branch, Solver, Way};
use crate::store::StoredFamily;

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

/// How the curves and dots of a branch are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Look {
    /// Forced response by shooting, of a damping ratio in percent.
    Response(Option<f64>),
    /// Forced response by harmonic balance.
    ThinResponse(Option<f64>),
    /// Backbone by harmonic balance, of a number of harmonics; whether its points are a grid of frequencies.
    Backbone(Option<usize>, bool),
    /// Orbits found from harmonic balance.
    Checked,
    /// Orbits found by continuation in time.
    Continued,
}

fn look(family: &StoredFamily, branch: usize) -> Look {
    let known = family.branches.get(branch);
    let ratio = known.and_then(Branch::percent);
    let outline = family.outline();
    match (outline.solver, outline.way) {
        (Solver::Check, _) => Look::Checked,
        (Solver::HarmonicBalance, Way::Response) => Look::ThinResponse(ratio),
        (Solver::Shooting, Way::Response) => Look::Response(ratio),
        (Solver::HarmonicBalance, way) => {
            Look::Backbone(known.and_then(Branch::harmonics), way == Way::Sequential)
        }
        (Solver::Shooting, _) => Look::Continued,
    }
}

/// A colour on a scale through some anchors, `s ∈ [0, 1]`.
fn scale(anchors: &[[u8; 3]], s: f64) -> RGBColor {
    let x = s.clamp(0.0, 1.0) * (anchors.len() - 1) as f64;
    let i = (x as usize).min(anchors.len().saturating_sub(2));
    let f = x - i as f64;
    let [a, b] = [anchors[i], anchors[(i + 1).min(anchors.len() - 1)]];
    let mix = |c: usize| (f64::from(a[c]) * (1.0 - f) + f64::from(b[c]) * f).round() as u8;
    RGBColor(mix(0), mix(1), mix(2))
}

/// Numbers of harmonics: blue to green.
const HARMONICS: [[u8; 3]; 4] = [[130, 170, 235], [30, 105, 190], [0, 150, 160], [0, 110, 50]];
/// Damping ratios: grey to orange.
const RATIOS: [[u8; 3]; 4] = [[105, 105, 112], [172, 172, 178], [240, 180, 105], [215, 95, 0]];

/// Where the `k`-th of `n` stands on a scale; one alone has the end that is easier to see.
fn standing(k: usize, n: usize) -> f64 {
    if n < 2 { 1.0 } else { k as f64 / (n - 1) as f64 }
}

/// Numbers that occur, ascending.
fn ascending(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// All that is drawn, with the colours' scales.
struct Scene<'f> {
    branches: Vec<(&'f StoredFamily, usize, Look)>,
    harmonics: Vec<f64>,
    ratios: Vec<f64>,
}

impl<'f> Scene<'f> {
    fn new(families: &'f [StoredFamily]) -> Self {
        let of = |f: &'f StoredFamily| branches(f).into_iter().map(move |b| (f, b, look(f, b)));
        let branches: Vec<_> = families.iter().flat_map(of).collect();
        let harmonics = branches.iter().filter_map(|(_, _, look)| match look {
            Look::Backbone(n_h, _) => n_h.map(|n| n as f64),
            _ => None,
        });
        let ratios = branches.iter().filter_map(|(_, _, look)| match look {
            Look::Response(ratio) | Look::ThinResponse(ratio) => *ratio,
            _ => None,
        });
        let (harmonics, ratios) = (ascending(harmonics), ascending(ratios));
        Scene { branches, harmonics, ratios }
    }

    fn colour(&self, look: Look) -> RGBColor {
        let on = |anchors: &[[u8; 3]], all: &[f64], value: Option<f64>| {
            let k = value.and_then(|v| all.iter().position(|&o| o == v));
            k.map_or(LINES[4], |k| scale(anchors, standing(k, all.len())))
        };
        match look {
            Look::Response(ratio) | Look::ThinResponse(ratio) => on(&RATIOS, &self.ratios, ratio),
            Look::Backbone(n_h, _) => on(&HARMONICS, &self.harmonics, n_h.map(|n| n as f64)),
            Look::Checked => RGBColor(0, 0, 0),
            Look::Continued => LINES[3],
        }
    }

    fn any(&self, wanted: fn(&Look) -> bool) -> bool {
        self.branches.iter().any(|(_, _, look)| wanted(look))
    }
}

fn is_response(look: &Look) -> bool {
    matches!(look, Look::Response(_) | Look::ThinResponse(_))
}

/// Frequency and energy of the orbits of a branch.
fn points(family: &StoredFamily, branch: usize) -> impl Iterator<Item = (f64, f64)> {
    let energy = |e: f64| (e.is_finite() && e > 0.0).then_some(e);
    of_branch(family, branch)
        .filter_map(move |p| p.orbit.as_ref().and_then(|o| energy(o.energy)).map(|e| (p.omega, e)))
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
                let energy = |o: &crate::records::OrbitRecord| (o.energy > 0.0).then_some(o.energy);
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

/// The parts of a line within a frame: the panel would draw what is outside along its edges.
fn clipped(points: &[(f64, f64)], frame: &(Range<f64>, Range<f64>)) -> Vec<Vec<(f64, f64)>> {
    let (x, y) = frame;
    let mut parts: Vec<Vec<(f64, f64)>> = vec![];
    let mut open = false;
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let d = (b.0 - a.0, b.1 - a.1);
        // the part from `low` to `high` of the way lies within all four edges
        let (mut low, mut high) = (0.0f64, 1.0f64);
        for (start, step, edge) in [(a.0, d.0, x), (a.1, d.1, y)] {
            if step == 0.0 {
                if start < edge.start || start > edge.end {
                    high = -1.0;
                }
                continue;
            }
            let (s, t) = ((edge.start - start) / step, (edge.end - start) / step);
            low = low.max(s.min(t));
            high = high.min(s.max(t));
        }
        if low >= high {
            open = false;
            continue;
        }
        let at = |s: f64| (a.0 + s * d.0, a.1 + s * d.1);
        match parts.last_mut() {
            Some(part) if open && low == 0.0 => part.push(at(high)),
            _ => parts.push(vec![at(low), at(high)]),
        }
        open = high == 1.0;
    }
    parts
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

/// Names in the legend.
struct Names {
    ratios: Vec<(String, RGBColor, Mark)>,
    harmonics: Vec<(String, RGBColor)>,
    thin: String,
}

impl Names {
    fn new(scene: &Scene) -> Self {
        let full = scene.any(|look| matches!(look, Look::Response(_)));
        let mark = if full { Mark::Line } else { Mark::Thin };
        let ratio = |r: &f64| (format!("{r} %"), scene.colour(Look::Response(Some(*r))), mark);
        let harmonic =
            |n: &f64| (format!("N_h = {n}"), scene.colour(Look::Backbone(Some(*n as usize), true)));
        let of_thin = scene.branches.iter().filter(|b| matches!(b.2, Look::ThinResponse(_)));
        let used: BTreeSet<usize> = of_thin
            .filter_map(|(f, b, _)| f.branches.get(*b).and_then(Branch::harmonics))
            .collect();
        let used: Vec<String> = used.iter().map(usize::to_string).collect();
        let used =
            if used.is_empty() { String::new() } else { format!(", N_h = {}", used.join(", ")) };
        Names {
            ratios: scene.ratios.iter().map(ratio).collect(),
            harmonics: scene.harmonics.iter().map(harmonic).collect(),
            thin: format!("harmonic balance{used}"),
        }
    }

    /// The entries that belong together in rows.
    fn groups<'n>(&'n self, scene: &Scene) -> Vec<Vec<Entry<'n>>> {
        let mut response: Vec<Entry> = vec![];
        if scene.any(is_response) {
            let lead = match self.ratios.is_empty() {
                true => "forced response:",
                false => "forced response, damping ratio ξ:",
            };
            response.push((lead, INK, Mark::Nothing));
            response
                .extend(self.ratios.iter().map(|(n, colour, mark)| (n.as_str(), *colour, *mark)));
            let of = |stable: bool| {
                scene.branches.iter().any(|(f, b, look)| {
                    matches!(look, Look::Response(_))
                        && of_branch(f, *b)
                            .filter_map(|p| p.orbit.as_ref())
                            .any(|o| o.stable == Some(stable))
                })
            };
            for (stable, name, mark) in
                [(true, "stable", Mark::Line), (false, "unstable", Mark::Dashes)]
            {
                if of(stable) {
                    response.push((name, INK, mark));
                }
            }
            if scene.any(|look| matches!(look, Look::ThinResponse(_))) {
                response.push((&self.thin, INK, Mark::Thin));
            }
        }
        let mut free: Vec<Entry> = vec![];
        for (look, name) in
            [(Look::Checked, "orbits in time"), (Look::Continued, "orbits continued in time")]
        {
            if scene.branches.iter().any(|b| b.2 == look) {
                free.push((name, scene.colour(look), Mark::Dot));
            }
        }
        if scene.any(|look| matches!(look, Look::Backbone(..))) {
            free.push(("backbone by harmonic balance:", INK, Mark::Nothing));
            free.extend(self.harmonics.iter().map(|(n, colour)| (n.as_str(), *colour, Mark::Line)));
        }
        [response, free].into_iter().filter(|g| !g.is_empty()).collect()
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_the_frame() {
        let frame = (0.0..1.0, 0.0..1.0);
        let through =
            clipped(&[(-1.0, 0.5), (0.5, 0.5), (0.5, 2.0), (0.8, 2.0), (0.8, 0.0)], &frame);
        assert_eq!(
            through,
            [vec![(0.0, 0.5), (0.5, 0.5), (0.5, 1.0)], vec![(0.8, 1.0), (0.8, 0.0)]]
        );
        assert!(clipped(&[(-1.0, 2.0), (2.0, 2.0)], &frame).is_empty());
    }
}
