//! Error against the size of elements and against time; of orbits, energy (and feedback or largest multiplier) against the size of elements.

use std::ops::Range;

use plotters::prelude::RGBColor;

use crate::records::{Compared, Comparison, Quantity, Row};
use crate::report::figure::{
    self, Axis, Cell, Chart, Entry, FigureError, INK, Legend, Mark, Point, Sheet, entry, log_ticks,
    range, series_colour,
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
pub fn picture(comparison: &Comparison) -> Result<Sheet<'static>, FigureError> {
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
        meshes.map(|(x, name)| (x, name.replace('x', " × ").replace('+', " + "))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.dedup_by(|a, b| a.0 == b.0);
    let width = all.last().map_or(0.0, |m| m.0) - all.first().map_or(0.0, |m| m.0);
    // names of several bodies are longer
    let longest = all.iter().map(|m| m.1.chars().count()).max().unwrap_or(0);
    let crowded = CROWDED * (longest as f64 / 9.0).max(1.0);
    let mut last = f64::NEG_INFINITY;
    for (x, name) in &mut all {
        match *x - last < crowded * width {
            true => name.clear(),
            false => last = *x,
        }
    }
    all
}

/// Errors of motions.
fn errors(comparison: &Comparison) -> Result<Sheet<'static>, FigureError> {
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
        entries.push(entry(name, colour, mark));
    }
    entries.extend(exact.iter().map(|name| entry(name, INK, Mark::Nothing)));
    let of_h = series.iter().flatten().filter(|r| r.h > 0.0);
    let meshes = named(of_h.map(|r| (r.h.log10(), r.mesh.clone())));
    let with = comparison.common().map_or(String::new(), |c| format!(", {c}"));
    let title = format!("{}{with}", comparison.title);
    let footer = format!("errors against {}; {}", comparison.reference, comparison.footer);
    let chart = |x: Axis, label: &str, all: &[Vec<Point>]| {
        let mut chart = Chart::new(x, Axis::scaled(label, y.clone(), true));
        for (k, points) in all.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            let (colour, mark) = look(k);
            chart.series(points, mark, colour);
        }
        chart
    };
    let x = spanned(over_h.iter().flatten().map(|p| p.0));
    let name = "relative error of u at the end";
    let mut left = chart(Axis::named("elements", x, meshes), name, &over_h);
    first_order(&mut left, &over_h);
    let mut cells = vec![Cell::from(left)];
    if !over_time.iter().all(Vec::is_empty) {
        let x = spanned(over_time.iter().flatten().map(|p| p.0));
        let times = log_ticks(&x);
        cells.push(chart(Axis::named("time of the run in s", x, times), "", &over_time).into());
    }
    let sheet = Sheet::new(&title, "").wide(1060.0).footer(footer);
    Ok(sheet.legend(Legend::Rows(entries)).row(440.0, cells))
}

/// A line of slope one below the errors.
fn first_order(chart: &mut Chart, places: &[Vec<Point>]) {
    let (x, y) = chart.frame();
    let points = || places.iter().flatten();
    let ends =
        points().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)));
    let below = points().map(|p| p.1 - p.0).fold(f64::INFINITY, f64::min) - 0.15;
    if !(ends.0 < ends.1 && below.is_finite()) {
        return;
    }
    let line_of_one = [(ends.0, ends.0 + below), (ends.1, ends.1 + below)];
    chart.dashes(line_of_one.to_vec(), INK, 1.0);
    let parts = figure::clipped(&line_of_one, &(x.clone(), y.clone()));
    if let Some((a, b)) = parts.first().and_then(|p| Some((p.first()?, p.last()?))) {
        let middle = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let at = (middle.0 + 0.03 * (x.end - x.start), middle.1 - 0.02 * (y.end - y.start));
        chart.words(at, "slope 1");
    }
}

/// Energies of orbits, and what stands beside them, a row of panels a frequency.
fn orbits(comparison: &Comparison) -> Result<Sheet<'static>, FigureError> {
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
            entry(name, colour, mark)
        })
        .collect();
    if comparison.rows.iter().any(|r| r.get(Quantity::EnergyError).is_finite()) {
        entries.push(entry("closed form", INK, Mark::Dashes));
    }
    let what = comparison.reference.replace("omega", "ω").replace("beta", "β");
    let mut sheet = Sheet::new(&comparison.title, &what).wide(1060.0);
    sheet = sheet.footer(comparison.footer.clone()).legend(Legend::Rows(entries));
    for &omega in omegas.iter().take(6) {
        let label = |quantity: Quantity| match quantity {
            Quantity::Energy => format!("energy at ω = {omega}"),
            Quantity::Alpha => "feedback α".into(),
            _ => "largest multiplier".into(),
        };
        let cell = |quantity| {
            chart(comparison, (&drawn, &names), omega, quantity, &label(quantity)).into()
        };
        sheet = sheet.row(340.0, [Quantity::Energy, second].map(cell).into());
    }
    Ok(sheet)
}

/// A quantity of the orbits of one frequency over the size of elements, limits at `h = 0`.
fn chart(
    comparison: &Comparison,
    (drawn, names): (&[&Vec<&Row>], &[String]),
    omega: f64,
    quantity: Quantity,
    label: &str,
) -> Chart {
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
    let axes = (Axis::named("elements", x.clone(), meshes), Axis::scaled(label, y, logarithmic));
    let mut chart = Chart::new(axes.0, axes.1);
    if let Some(exact) = exact.map(shown) {
        chart.dashes(vec![(x.start, exact), (x.end, exact)], INK, 1.0);
    }
    for s in of_omega {
        let k = names.iter().position(|n| *n == comparison.name(s[0])).unwrap_or(0);
        let (colour, mark) = look(k);
        let places: Vec<(f64, f64)> = points(s).iter().map(|p| (p.0, shown(p.1))).collect();
        chart.series(&places, mark, colour);
        if let (Some(limit), Some(&last)) = (limits(s).map(shown), places.last()) {
            chart.dashes(vec![last, (0.0, limit)], colour, 1.0);
            chart.marks([(0.0, limit)], mark, colour);
        }
    }
    chart
}
