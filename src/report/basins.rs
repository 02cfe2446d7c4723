//! Basins of attraction in the plane of their states; and their table as CSV.

use std::fmt::Write as _;

use plotters::style::RGBColor;

use super::export::{number, quoted};
use super::figure::{
    Axis, Cell, Chart, Entry, FigureError, INK, Legend, Mark, Point, Sheet, entry, series_colour,
    tint,
};
use crate::records::{AttractorFound, Basins, Fate, Starts, StateAxis};
use crate::store::StoredBasins;

/// So much of an attractor's colour is left in its basin.
const SHARE: f64 = 0.45;

/// The colour of what leads to an attractor, or to none.
fn colour(fate: Fate) -> RGBColor {
    match fate {
        Fate::Attractor(k) => tint(series_colour(k), SHARE),
        Fate::Slow => RGBColor(190, 190, 195),
        Fate::Unbounded => RGBColor(110, 110, 116),
        Fate::Lost => INK,
        Fate::Inside => RGBColor(243, 243, 245),
    }
}

/// What an axis is called.
fn label(axis: &StateAxis) -> String {
    let mode = axis.mode;
    match axis.is_velocity {
        false => format!("amplitude of mode {mode} over grazing, q{mode}"),
        true => format!("velocity of mode {mode} over its frequency, v{mode}"),
    }
}

/// An attractor with the share of its basin.
fn name(basins: &Basins, k: usize, a: &AttractorFound) -> String {
    let share = basins.share(Fate::Attractor(k));
    format!("{}, {:.1} ± {:.1} %", a.seen.kind, 100.0 * share.share, 100.0 * share.error)
}

/// By so much of a cell its neighbours lie over it, so that no seam shows.
const OVER: f64 = 0.2;

/// The cells of a grid, those of one row that are alike as one.
fn cells(basins: &Basins, n: usize, [x, y]: [&StateAxis; 2]) -> Vec<([Point; 2], RGBColor)> {
    let at = |axis: &StateAxis, k: f64| {
        axis.range.0 + (axis.range.1 - axis.range.0) * k.min(n as f64) / n as f64
    };
    let edge = |axis: &StateAxis, k: usize| at(axis, k as f64);
    let end = |axis: &StateAxis, k: usize| at(axis, k as f64 + OVER);
    let mut all = vec![];
    for row in 0..n {
        let fates = &basins.fates[row * n..(row + 1) * n];
        let mut from = 0;
        for to in 1..=n {
            if to < n && fates[to] == fates[from] {
                continue;
            }
            if let Some(fate) = fates[from] {
                let corners = [(edge(x, from), edge(y, row)), (end(x, to), end(y, row + 1))];
                all.push((corners, colour(fate)));
            }
            from = to;
        }
    }
    all
}

/// Basins over two of their axes.
pub fn picture(stored: &StoredBasins) -> Result<Sheet<'static>, FigureError> {
    let basins = &stored.basins;
    if basins.told() == 0 {
        return Err(FigureError::Empty("no state is told yet"));
    }
    let mut free = basins.axes.iter().enumerate().filter(|(_, a)| !a.is_fixed());
    let first = free.next().ok_or(FigureError::Empty("the states differ along no axis"))?;
    // states along one axis alone stand on a line
    let second = free.next();
    let more = free.count();
    let line = StateAxis { mode: 0, is_velocity: false, range: (-1.0, 1.0) };
    let y = second.map_or(&line, |s| s.1);
    let axis = |a: &StateAxis, label: String| Axis::linear(label, a.range.0..a.range.1);
    let mut chart = Chart::new(
        axis(first.1, label(first.1)),
        axis(y, second.map_or(String::new(), |s| label(s.1))),
    );
    match (basins.starts, second) {
        (Starts::Grid(n), Some(second)) => chart.cover(cells(basins, n, [first.1, second.1])),
        _ => {
            let point = |x: &Vec<f64>| (x[first.0], second.map_or(0.0, |s| x[s.0]));
            let fates = (0..basins.attractors.len()).map(Fate::Attractor).chain(Fate::OTHERS);
            for fate in fates {
                let of = stored.at.iter().zip(&basins.fates).filter(|(_, f)| **f == Some(fate));
                chart.marks(of.map(|(x, _)| point(x)), Mark::Dot, colour(fate));
            }
        }
    }
    let within = |p: &Point| {
        let inside = |x: f64, a: &StateAxis| (a.range.0..=a.range.1).contains(&x);
        inside(p.0, first.1) && inside(p.1, y)
    };
    let mut legend: Vec<Entry> = vec![];
    for (k, a) in basins.attractors.iter().enumerate() {
        legend.push(entry(name(basins, k, a), colour(Fate::Attractor(k)), Mark::Patch));
        let point = |x: &Vec<f64>| (x[first.0], second.map_or(0.0, |s| x[s.0]));
        let states = a.at.iter().map(point).filter(within);
        match a.seen.kind.periods() {
            0 => chart.marks(states, Mark::Dot, series_colour(k)),
            _ => chart.marks(states, Mark::Disc, series_colour(k)),
        }
    }
    for fate in Fate::OTHERS {
        let share = basins.share(fate);
        if share.count > 0 {
            let text = match fate {
                Fate::Inside => fate.to_string(),
                _ => format!("{fate}, {:.1} %", 100.0 * share.share),
            };
            legend.push(entry(text, colour(fate), Mark::Patch));
        }
    }
    let fixed = basins.axes.iter().filter(|a| a.is_fixed());
    let mut what = vec![format!("basins at ω = {}", super::summary::significant(basins.omega, 6))];
    what.extend(fixed.map(|a| format!("{} = {}", a.name(), a.range.0)));
    if more > 0 {
        what.push(format!("{more} more axes drawn"));
    }
    Ok(Sheet::new(&stored.head.title, &what.join(", "))
        .legend(Legend::Rows(legend))
        .footer("dots: the attractors at phase zero of the loads".into())
        .row(560.0, vec![Cell::from(chart)]))
}

/// A row a state.
pub fn csv(stored: &StoredBasins) -> String {
    let basins = &stored.basins;
    let mut out = String::new();
    let names: Vec<String> = basins.axes.iter().map(StateAxis::name).collect();
    let _ = writeln!(out, "{},attractor,fate,periods", names.join(","));
    for ((at, fate), maps) in stored.at.iter().zip(&basins.fates).zip(&basins.maps) {
        let Some(fate) = fate else { continue };
        let at: Vec<String> = at.iter().map(|x| number(*x)).collect();
        let (attractor, word) = match fate {
            Fate::Attractor(k) => (k.to_string(), basins.attractors[*k].seen.kind.to_string()),
            other => (String::new(), other.to_string()),
        };
        let _ = writeln!(out, "{},{attractor},{},{maps}", at.join(","), quoted(&word));
    }
    out
}
