//! What the cross-check gave, against the number of harmonics.

use std::ops::Range;

use plotters::prelude::RGBColor;

use super::tally::Tally;
use crate::report::figure::{Axis, Cell, Chart, INK, Mark, entry, range};

/// Where the numbers of harmonics lie on a logarithmic axis, and those that have room for their names.
fn harmonic_axis(tallies: &[Tally]) -> (Range<f64>, Vec<(f64, String)>) {
    let place = |t: &Tally| (t.n_h.max(1) as f64).log10();
    let x = range(tallies.iter().map(place));
    let room = 0.06 * (x.end - x.start);
    let mut ticks: Vec<(f64, String)> = vec![];
    for t in tallies {
        let here = place(t);
        if ticks.last().is_none_or(|(before, _)| here - before > room) {
            ticks.push((here, t.n_h.to_string()));
        }
    }
    (x, ticks)
}

/// Curves over the number of harmonics.
struct Curve {
    name: &'static str,
    points: Vec<(f64, f64)>,
    colour: RGBColor,
    mark: Mark,
}

fn over_harmonics(
    tallies: &[Tally],
    curves: &[Curve],
    (y, logarithmic): (Range<f64>, bool),
    label: &str,
) -> Cell<'static> {
    let (x, ticks) = harmonic_axis(tallies);
    let x = Axis::named("number of harmonics N_h", x, ticks);
    let mut chart = Chart::new(x, Axis::scaled(label, y, logarithmic));
    curves.iter().for_each(|c| chart.series(&c.points, c.mark, c.colour));
    let entries = curves.iter().map(|c| entry(c.name, c.colour, c.mark)).collect();
    Cell::from(chart).legend(entries)
}

/// Medians of distance and residual.
pub(super) fn medians(tallies: &[Tally]) -> Cell<'static> {
    let points = |value: fn(&Tally) -> f64| -> Vec<(f64, f64)> {
        let all = tallies.iter().map(|t| ((t.n_h.max(1) as f64).log10(), value(t)));
        all.filter(|p| p.1 > 0.0).map(|(x, v)| (x, v.log10())).collect()
    };
    let curves = [
        Curve {
            name: "distance to the orbit",
            points: points(|t| t.median_moved),
            colour: INK,
            mark: Mark::Dot,
        },
        Curve {
            name: "residual in time",
            points: points(|t| t.median_residual),
            colour: INK,
            mark: Mark::Diamond,
        },
    ];
    let y = range(curves.iter().flat_map(|c| c.points.iter().map(|p| p.1)));
    over_harmonics(tallies, &curves, (y, true), "median")
}

/// How many points lead to an orbit.
pub(super) fn shares(tallies: &[Tally]) -> Cell<'static> {
    let points = |value: fn(&Tally) -> usize| -> Vec<(f64, f64)> {
        let share = |t: &Tally| 100.0 * value(t) as f64 / t.points.max(1) as f64;
        tallies.iter().map(|t| ((t.n_h.max(1) as f64).log10(), share(t))).collect()
    };
    let curves = [
        Curve {
            name: "orbit found",
            points: points(|t| t.orbits + t.others),
            colour: INK,
            mark: Mark::Ring,
        },
        Curve {
            name: "that the series approximates",
            points: points(|t| t.orbits),
            colour: INK,
            mark: Mark::Dot,
        },
    ];
    over_harmonics(tallies, &curves, (0.0..105.0, false), "% of the points")
}
