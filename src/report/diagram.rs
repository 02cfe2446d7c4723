//! Bifurcation diagrams over a number of the scene; and their table as CSV.

use std::fmt::Write as _;

use super::export::{number, quoted};
use super::figure::{
    Axis, Cell, Chart, Entry, FigureError, INK, LINES, Legend, Mark, Point, Sheet, entry, range,
};
use crate::records::{AttractorRecord, DiagramRow};
use crate::store::StoredDiagram;

/// The contact point that moves most in any of some motions.
pub(super) fn lead<'a>(all: impl Iterator<Item = &'a AttractorRecord>) -> Option<usize> {
    let mut largest: Vec<f64> = vec![];
    for seen in all {
        largest.resize(largest.len().max(seen.peak.len()), 0.0);
        for (i, (a, b)) in seen.peak.iter().zip(&seen.trough).enumerate() {
            largest[i] = largest[i].max(a - b);
        }
    }
    (0..largest.len()).max_by(|&i, &j| largest[i].total_cmp(&largest[j]))
}

/// How far back the contact point that moves most goes in each period, the exponent, and the largest force, over the number.
pub fn picture(stored: &StoredDiagram) -> Result<Sheet<'static>, FigureError> {
    let diagram = &stored.diagram;
    let none = FigureError::Empty("nothing of this diagram was seen");
    let i = lead(diagram.rows.iter().map(|row| &row.seen)).ok_or(none)?;
    let dots = |row: &DiagramRow| -> Vec<Point> {
        let states = row.seen.least.chunks_exact(row.seen.peak.len().max(1));
        states.map(|u| (row.value, u[i])).collect()
    };
    let exponent = |row: &DiagramRow| vec![(row.value, row.seen.exponent)];
    let force = |row: &DiagramRow| vec![(row.value, row.seen.force)];
    let key = diagram.key.as_str();
    let mut legend: Vec<Entry> = vec![];
    for (falls, name) in [(false, "up"), (true, "down")] {
        if diagram.walk(falls).next().is_some() {
            legend.push(entry(name, LINES[usize::from(falls)], mark(falls)));
        }
    }
    let chart = |names: [&str; 2], of: &dyn Fn(&DiagramRow) -> Vec<Point>, zero: bool| {
        let points = || diagram.rows.iter().flat_map(of).filter(|p| p.1.is_finite());
        let y = range(points().map(|p| p.1).chain(zero.then_some(0.0)));
        let [low, high] = diagram.range;
        let mut chart = Chart::new(Axis::linear(names[0], low..high), Axis::linear(names[1], y));
        if zero {
            chart.line(vec![(low, 0.0), (high, 0.0)], INK, 0.8);
        }
        for falls in [false, true] {
            let of_walk = diagram.walk(falls).flat_map(of).filter(|p| p.1.is_finite());
            chart.marks(of_walk, mark(falls), LINES[usize::from(falls)]);
        }
        Cell::from(chart)
    };
    let what = format!(
        "bifurcation diagram over {key} at ω = {}",
        super::summary::significant(diagram.omega, 6)
    );
    Ok(Sheet::new(&stored.head.title, &what)
        .legend(Legend::Rows(legend))
        .row(380.0, vec![chart(["", "least contact displacement in each period"], &dots, false)])
        .row(190.0, vec![chart(["", "largest exponent a period"], &exponent, true)])
        .row(190.0, vec![chart([key, "largest contact force"], &force, false)]))
}

fn mark(falls: bool) -> Mark {
    if falls { Mark::Speck } else { Mark::Dot }
}

/// A row a value.
pub fn csv(stored: &StoredDiagram) -> String {
    let mut out = String::from(
        "value,direction,kind,period_number,lyapunov,lyapunov_error,amplitude,force,energy,switches,special\n",
    );
    for row in &stored.diagram.rows {
        let seen = &row.seen;
        let numbers = [
            seen.exponent,
            seen.exponent_error,
            seen.amplitude(),
            seen.force,
            seen.energy,
            seen.switches,
        ];
        let numbers: Vec<String> = numbers.iter().map(|x| number(*x)).collect();
        let _ = writeln!(
            out,
            "{},{},{},{},{},{}",
            number(row.value),
            if row.falls { "down" } else { "up" },
            seen.kind.word(),
            seen.kind.periods(),
            numbers.join(","),
            quoted(row.special.word())
        );
    }
    out
}
