//! Families with the bands that numbers of the scene leave, whose deviations are known; and their table as CSV.

use std::fmt::Write as _;

use super::export::{number, quoted};
use super::figure::{
    Axis, Cell, Chart, Entry, FigureError, LINES, Legend, Mark, Point, Sheet, entry, range,
    series_colour, tint,
};
use super::summary::significant;
use crate::records::{BandRow, Bands, Deviation};
use crate::store::StoredBands;

/// Half of the width of a band, in standard deviations.
const WIDTH: f64 = 2.0;
/// Deviations at a frequency are drawn up to so many per cent.
const UPRIGHT: f64 = 100.0;
/// Places of neighbours on their branch differ by so much.
const GAP: i64 = 1;

/// Neighbours along their branches: rows one behind the other, both with derivatives.
fn neighbours(bands: &Bands) -> impl Iterator<Item = [&BandRow; 2]> {
    bands.rows.windows(2).filter_map(|two| {
        let [a, b] = two else { return None };
        let far = (b.index - a.index).abs();
        (a.branch == b.branch && far <= GAP).then_some([a, b])
    })
}

/// A number as its deviation is told.
fn told(d: &Deviation) -> String {
    format!("{} = {} ± {}", d.key, significant(d.value, 4), significant(d.sigma, 3))
}

/// The largest contact displacement over the frequency with its band, its deviation, and what each number has of that.
pub fn picture(stored: &StoredBands) -> Result<Sheet<'static>, FigureError> {
    let bands = &stored.bands;
    let rows = || bands.rows.iter().filter(|row| bands.sigma(row)[0].is_finite());
    if rows().next().is_none() {
        return Err(FigureError::Empty("no orbit of this family has derivatives"));
    }
    let x = range(bands.rows.iter().map(|row| row.omega));
    let y = range(bands.rows.iter().map(|row| row.heights[0]));
    let units = [x.end - x.start, y.end - y.start];
    let sides = |row: &BandRow| -> [Point; 2] {
        let (dx, dy) = bands.across(row, 0, units);
        let at = |s: f64| (row.omega + s * WIDTH * dx, row.heights[0] + s * WIDTH * dy);
        [at(-1.0), at(1.0)]
    };
    let reached = rows().flat_map(|row| sides(row).map(|p| p.1));
    let y = range(reached.chain([y.start, y.end]));
    let label = "largest contact displacement";
    let mut heights = Chart::new(Axis::linear("", x.clone()), Axis::linear(label, y));
    for [a, b] in neighbours(bands) {
        let ([lower, upper], mut ends) = (sides(a), sides(b));
        // behind a fold the upper side is the other one
        let across =
            |[low, high]: [Point; 2]| [(high.0 - low.0) / units[0], (high.1 - low.1) / units[1]];
        let (here, there) = (across([lower, upper]), across(ends));
        if here[0] * there[0] + here[1] * there[1] < 0.0 {
            ends.reverse();
        }
        let [next, above] = ends;
        let all = [lower, upper, above, next];
        if all.iter().all(|p| p.0.is_finite() && p.1.is_finite()) {
            heights.area(all.to_vec(), tint(LINES[0], 0.3).into());
        }
    }
    for [a, b] in neighbours(bands) {
        let ends = [a, b].map(|row| (row.omega, row.heights[0]));
        heights.line(ends.to_vec(), LINES[0], 1.6);
    }
    let relative =
        |row: &BandRow| (row.omega, (100.0 * bands.sigma(row)[0] / row.heights[0]).log10());
    // at a fold it is without bound
    let is_drawn = |y: &f64| y.is_finite() && *y <= UPRIGHT.log10();
    let of_all = range(rows().map(|row| relative(row).1).filter(is_drawn));
    let label = "at its frequency, %";
    let mut deviations = Chart::new(Axis::linear("", x.clone()), Axis::scaled(label, of_all, true));
    let mut shares = Chart::new(Axis::linear("frequency ω", x), Axis::linear("share", 0.0..1.0));
    for [a, b] in neighbours(bands) {
        let pair = [a, b];
        if pair.iter().all(|row| relative(row).1.is_finite()) {
            deviations.line(pair.map(relative).to_vec(), LINES[0], 1.4);
            for k in 0..bands.deviations.len() {
                let of = |row: &BandRow| (row.omega, bands.share(row, k));
                shares.line(pair.map(of).to_vec(), series_colour(k + 1), 1.4);
            }
        }
    }
    let mut legend: Vec<Entry> = vec![entry(
        format!("± {WIDTH} standard deviations, across the curve"),
        tint(LINES[0], 0.3),
        Mark::Patch,
    )];
    for (k, d) in bands.deviations.iter().enumerate() {
        legend.push(entry(told(d), series_colour(k + 1), Mark::Line));
    }
    let what = format!("{} with what its numbers are known to", stored.family);
    Ok(Sheet::new(&stored.head.title, &what)
        .legend(Legend::Rows(legend))
        .row(380.0, vec![Cell::from(heights)])
        .row(170.0, vec![Cell::from(deviations)])
        .row(190.0, vec![Cell::from(shares)]))
}

/// A row an orbit.
pub fn csv(stored: &StoredBands) -> String {
    let bands = &stored.bands;
    let mut out = String::from(
        "branch,index,omega,amplitude,amplitude_deviation,amplitude_along,energy,energy_deviation,energy_along",
    );
    for d in &bands.deviations {
        for name in ["amplitude", "energy"] {
            let _ = write!(out, ",{}", quoted(&format!("{name} by {}", d.key)));
        }
    }
    out.push_str(",note\n");
    for row in &bands.rows {
        let sigma = bands.sigma(row);
        let heights = (0..2).flat_map(|k| [row.heights[k], sigma[k], row.along[k]]);
        let all = [row.omega].into_iter().chain(heights).chain(row.by.iter().flatten().copied());
        let all: Vec<String> = all.map(number).collect();
        let _ =
            writeln!(out, "{},{},{},{}", row.branch, row.index, all.join(","), quoted(&row.note));
    }
    out
}
