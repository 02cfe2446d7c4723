//! Error against the size of elements and against time; of orbits, energy (and feedback or largest multiplier) against the size of elements.

use std::ops::Range;

use plotters::prelude::*;

use crate::records::{Compared, Comparison, Quantity, Row};
use crate::report::figure::{
    self, Area, Chart, Drawn, Entry, FigureError, INK, Mark, columns, draw_dashes, draw_line,
    legend_above, line, log_ticks, px, range, series_colour, symbols, text,
};

/// Errors below this are rounding, and are not drawn.
const FLOOR: f64 = 1e-16;
/// Errors above this are on another motion, and leave the picture.
const MOST: f64 = 10.0;

/// Values that differ by more than this factor are drawn as logarithms.
const WIDE: f64 = 6.0;
/// Names of meshes nearer than this, over the width of the panel, run into each other.
const CROWDED: f64 = 0.11;

const MARKS: [Mark; 6] =
    [Mark::Disc, Mark::Square, Mark::Triangle, Mark::Diamond, Mark::Circle, Mark::Cross];

/// Colour and mark of the `k`-th series.
fn look(k: usize) -> (RGBColor, Mark) {
    (series_colour(k), MARKS[(k + k / 8) % MARKS.len()])
}

/// A picture as SVG.
pub fn picture(comparison: &Comparison) -> Result<String, FigureError> {
    match comparison.compared {
        Compared::Run => errors(comparison),
        Compared::Orbit | Compared::Viscous => orbits(comparison),
    }
}

/// The range of some logarithms with a margin.
fn spanned(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    let margin = 0.06 * (high - low).max(0.5);
    low - margin..high + margin
}

/// Names of meshes at their places, each once; those that would run into each other are left out.
fn named(meshes: impl Iterator<Item = (f64, String)>) -> Vec<(f64, String)> {
    let mut all: Vec<(f64, String)> =
        meshes.map(|(x, name)| (x, name.replace('x', " × "))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.dedup_by(|a, b| a.0 == b.0);
    let width = all.last().map_or(0.0, |m| m.0) - all.first().map_or(0.0, |m| m.0);
    let mut last = f64::NEG_INFINITY;
    for (x, name) in &mut all {
        match *x - last < CROWDED * width {
            true => name.clear(),
            false => last = *x,
        }
    }
    all
}

/// A series on a panel: a line with marks.
fn draw_series(
    chart: &mut Chart,
    points: &[(f64, f64)],
    (colour, mark): (RGBColor, Mark),
) -> Drawn {
    draw_line(chart, points.to_vec(), line(colour, 1.4))?;
    symbols(chart, points.iter().copied(), mark, colour)
}

/// Footer and title around what is drawn between them.
fn sheet(
    (width, height): (u32, u32),
    title: &str,
    footer: &str,
    draw: impl FnOnce(&Area) -> Drawn,
) -> Result<String, FigureError> {
    figure::svg((width, height), |root| {
        root.draw(&Text::new(title.to_owned(), (px(12.0), px(8.0)), text(16)))
            .map_err(FigureError::draw)?;
        let at = (px(12.0), px(f64::from(height) - 20.0));
        root.draw(&Text::new(footer.to_owned(), at, text(11))).map_err(FigureError::draw)?;
        let (_, below) = root.split_vertically(px(32.0));
        let (between, _) = below.split_vertically(px(f64::from(height) - 32.0 - 26.0));
        draw(&between)
    })
}

/// Errors of motions.
fn errors(comparison: &Comparison) -> Result<String, FigureError> {
    let series = comparison.series();
    let place = |r: &&Row, x: f64| {
        let error = r.get(Quantity::Error);
        (x > 0.0 && error > FLOOR && error < MOST).then(|| (x.log10(), error.log10()))
    };
    // what is exact to rounding leaves no room for the others: it is named, and not drawn
    let is_drawn = |s: &&Vec<&Row>| !comparison.is_exact(s);
    let over = |x: &dyn Fn(&Row) -> f64| -> Vec<Vec<(f64, f64)>> {
        let of = |s: &Vec<&Row>| s.iter().filter_map(|r| place(r, x(r))).collect();
        series.iter().filter(is_drawn).map(of).collect()
    };
    let (over_h, over_time) = (over(&|r| r.h), over(&|r| r.get(Quantity::Wall)));
    let all = || over_h.iter().flatten();
    if all().next().is_none() {
        return Err(FigureError::Empty("no row has an error"));
    }
    let y = spanned(all().map(|p| p.1));
    let names: Vec<String> =
        series.iter().filter(is_drawn).map(|s| comparison.name(s[0])).collect();
    let exact: Vec<String> = series
        .iter()
        .filter(|s| comparison.is_exact(s))
        .map(|s| format!("{}: exact to rounding", comparison.name(s[0])))
        .collect();
    let mut entries: Vec<Entry> = vec![];
    for (k, name) in names.iter().enumerate().filter(|(k, _)| !over_h[*k].is_empty()) {
        let (colour, mark) = look(k);
        entries.push((name, colour, mark));
    }
    entries.extend(exact.iter().map(|name| (name.as_str(), INK, Mark::Nothing)));
    let of_h = series.iter().flatten().filter(|r| r.h > 0.0);
    let meshes = named(of_h.map(|r| (r.h.log10(), r.mesh.clone())));
    let with = comparison.common().map_or(String::new(), |c| format!(", {c}"));
    let title = format!("{}{with}", comparison.title);
    let footer = format!("errors against {}; {}", comparison.reference, comparison.footer);
    sheet((1060, 540), &title, &footer, |area| {
        let area = legend_above(area.clone(), &entries)?;
        let (left, right) = area.split_horizontally(px(530.0));
        let x = spanned(over_h.iter().flatten().map(|p| p.0));
        let name = "relative error of u at the end";
        let mut chart = columns(&left, (x.clone(), &meshes), (y.clone(), true), "elements", name)?;
        first_order(&mut chart, (&x, &y), &over_h)?;
        for (k, points) in over_h.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            draw_series(&mut chart, points, look(k))?;
        }
        if over_time.iter().all(Vec::is_empty) {
            return Ok(());
        }
        let x = spanned(over_time.iter().flatten().map(|p| p.0));
        let times = log_ticks(&x);
        let mut chart =
            columns(&right, (x, &times), (y.clone(), true), "time of the run in s", "")?;
        for (k, points) in over_time.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            draw_series(&mut chart, points, look(k))?;
        }
        Ok(())
    })
}

/// A line of slope one below the errors.
fn first_order(
    chart: &mut Chart,
    (x, y): (&Range<f64>, &Range<f64>),
    places: &[Vec<(f64, f64)>],
) -> Drawn {
    let points = || places.iter().flatten();
    let ends =
        points().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)));
    let below = points().map(|p| p.1 - p.0).fold(f64::INFINITY, f64::min) - 0.15;
    if !(ends.0 < ends.1 && below.is_finite()) {
        return Ok(());
    }
    let line_of_one = [(ends.0, ends.0 + below), (ends.1, ends.1 + below)];
    let parts = figure::clipped(&line_of_one, &(x.clone(), y.clone()));
    for part in &parts {
        draw_dashes(chart, part.clone(), line(INK, 1.0))?;
    }
    if let Some((a, b)) = parts.first().and_then(|p| Some((p.first()?, p.last()?))) {
        let middle = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let at = (middle.0 + 0.03 * (x.end - x.start), middle.1 - 0.02 * (y.end - y.start));
        let word = Text::new("slope 1", at, text(12));
        chart.draw_series(std::iter::once(word)).map_err(FigureError::draw)?;
    }
    Ok(())
}

/// Energies of orbits, and what stands beside them, a row of panels a frequency.
fn orbits(comparison: &Comparison) -> Result<String, FigureError> {
    let second = match comparison.compared {
        Compared::Viscous => Quantity::Alpha,
        _ => Quantity::Multiplier,
    };
    let series = comparison.series();
    let is_drawn = |s: &&Vec<&Row>| s.iter().any(|r| r.get(Quantity::Energy).is_finite());
    let drawn: Vec<&Vec<&Row>> = series.iter().filter(is_drawn).collect();
    if drawn.is_empty() {
        return Err(FigureError::Empty("no row has an orbit"));
    }
    let mut omegas: Vec<f64> = drawn.iter().map(|s| s[0].get(Quantity::Omega)).collect();
    omegas.sort_by(f64::total_cmp);
    omegas.dedup();
    let mut names: Vec<String> = vec![];
    for s in &drawn {
        let name = comparison.name(s[0]);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let mut entries: Vec<Entry> = names
        .iter()
        .enumerate()
        .map(|(k, name)| {
            let (colour, mark) = look(k);
            (name.as_str(), colour, mark)
        })
        .collect();
    if comparison.rows.iter().any(|r| r.get(Quantity::EnergyError).is_finite()) {
        entries.push(("closed form", INK, Mark::Dashes));
    }
    let height = 100 + 340 * omegas.len().min(6) as u32;
    let what = comparison.reference.replace("omega", "ω").replace("beta", "β");
    let title = format!("{}: {what}", comparison.title);
    sheet((1060, height), &title, &comparison.footer, |area| {
        let area = legend_above(area.clone(), &entries)?;
        let mut rest = area;
        for &omega in omegas.iter().take(6) {
            let (strip, below) = rest.split_vertically(px(340.0));
            rest = below;
            let (left, right) = strip.split_horizontally(px(530.0));
            for (half, quantity) in [(&left, Quantity::Energy), (&right, second)] {
                let label = match quantity {
                    Quantity::Energy => format!("energy at ω = {omega}"),
                    Quantity::Alpha => "feedback α".into(),
                    _ => "largest multiplier".into(),
                };
                panel(half, comparison, (&drawn, &names), omega, quantity, &label)?;
            }
        }
        Ok(())
    })
}

/// A quantity of the orbits of one frequency over the size of elements, limits at `h = 0`.
fn panel(
    area: &Area,
    comparison: &Comparison,
    (drawn, names): (&[&Vec<&Row>], &[String]),
    omega: f64,
    quantity: Quantity,
    label: &str,
) -> Drawn {
    let of_omega: Vec<&&Vec<&Row>> =
        drawn.iter().filter(|s| s[0].get(Quantity::Omega) == omega).collect();
    let points = |s: &[&Row]| -> Vec<(f64, f64)> {
        s.iter().map(|r| (r.h, r.get(quantity))).filter(|p| p.1.is_finite()).collect()
    };
    let limits = |s: &[&Row]| -> Option<f64> {
        let is_limit = comparison.compared.limits().contains(&quantity);
        let last = comparison.limits_of(s, quantity).last().copied();
        last.filter(|x| is_limit && x.is_finite())
    };
    let mut values: Vec<f64> = of_omega.iter().flat_map(|s| points(s)).map(|p| p.1).collect();
    values.extend(of_omega.iter().filter_map(|s| limits(s)));
    let of_h = of_omega.iter().flat_map(|s| s.iter()).map(|r| (r.h, r.mesh.clone()));
    let meshes = named(std::iter::once((0.0, "h → 0".to_owned())).chain(of_h));
    let widest = meshes.iter().map(|m| m.0).fold(0.0, f64::max);
    let x = -0.06 * widest..1.08 * widest.max(1e-300);
    // the closed form, where there is one
    let exact = of_omega.iter().flat_map(|s| s.iter()).find_map(|r| {
        let e = r.get(Quantity::Energy) / (1.0 + r.get(Quantity::EnergyError));
        Some(e).filter(|e| e.is_finite() && quantity == Quantity::Energy)
    });
    values.extend(exact);
    // values over more than a decade: their logarithms
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(0.0, f64::max);
    let logarithmic = least > 0.0 && most > WIDE * least;
    let shown = |v: f64| if logarithmic { v.log10() } else { v };
    let y = range(values.iter().map(|v| shown(*v)));
    let mut chart = columns(area, (x.clone(), &meshes), (y, logarithmic), "elements", label)?;
    if let Some(exact) = exact.map(shown) {
        draw_dashes(&mut chart, vec![(x.start, exact), (x.end, exact)], line(INK, 1.0))?;
    }
    for s in of_omega {
        let k = names.iter().position(|n| *n == comparison.name(s[0])).unwrap_or(0);
        let (colour, mark) = look(k);
        let places: Vec<(f64, f64)> = points(s).iter().map(|p| (p.0, shown(p.1))).collect();
        draw_series(&mut chart, &places, (colour, mark))?;
        if let (Some(limit), Some(&last)) = (limits(s).map(shown), places.last()) {
            draw_dashes(&mut chart, vec![last, (0.0, limit)], line(colour, 1.0))?;
            symbols(&chart, [(0.0, limit)], mark, colour)?;
        }
    }
    Ok(())
}
