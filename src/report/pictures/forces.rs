//! The picture `forces`: what contact groups, supports and springs bear over time.

use super::Options;
use super::time::over_time;
use crate::report::figure::{Cell, Entry, FigureError, LINES, Mark, SHADE, Sheet, entry, range};
use crate::store::{Stored, StoredForces};

/// Components below this part of the largest of a kind are rounding, and have no curve.
const ROUNDING: f64 = 1e-9;

/// A chart a kind of force.
pub(super) fn forces<'s>(stored: &'s Stored, _: &Options) -> Result<Sheet<'s>, FigureError> {
    let known: Vec<&StoredForces> = stored.forces.iter().filter(|f| largest(f) > 0.0).collect();
    if known.is_empty() {
        return Err(FigureError::Empty("no forces are stored"));
    }
    let height = if known.len() < 3 { 280.0 } else { 230.0 };
    let sheet = Sheet::new(&stored.title, "forces");
    let last = known.len() - 1;
    Ok(known
        .iter()
        .enumerate()
        .fold(sheet, |sheet, (k, of)| sheet.row(height, vec![chart(stored, of, (k, last))])))
}

/// The largest component; zero where nobody knows them.
fn largest(forces: &StoredForces) -> f64 {
    let sizes = forces.values.iter().map(|x| x.abs());
    sizes.filter(|x| x.is_finite()).fold(0.0, f64::max)
}

/// Components over time.
fn chart(stored: &Stored, forces: &StoredForces, (place, last): (usize, usize)) -> Cell<'static> {
    let dim = forces.components();
    let floor = ROUNDING * largest(forces);
    let column = |c: usize| forces.values.column(c);
    let shown = (0..forces.values.ncols()).filter(|&c| column(c).iter().any(|x| x.abs() > floor));
    let shown: Vec<usize> = shown.collect();
    let y = range(shown.iter().flat_map(|&c| column(c).to_vec()).chain([0.0]));
    let name = match forces.kind {
        "contact" => "force of contact",
        "support" => "force of supports",
        _ => "force of springs",
    };
    let labels = (if place == last { "time" } else { "" }, name);
    let mut chart = over_time(stored, y, labels);
    let shade = entry("in contact", SHADE, Mark::Patch);
    let mut entries: Vec<Entry> = vec![shade];
    entries.truncate(if place == 0 { stored.facing().min(1) } else { 0 });
    for (k, &c) in shown.iter().enumerate() {
        let points = stored.t.iter().copied().zip(column(c).to_vec()).collect();
        let colour = LINES[k % LINES.len()];
        let mark = if k < LINES.len() { Mark::Line } else { Mark::Dashes };
        match mark {
            Mark::Dashes => chart.dashes(points, colour, 1.5),
            _ => chart.line(points, colour, 1.5),
        }
        let axis = if dim > 1 { format!(", {}", ["x", "y", "z"][c % dim]) } else { String::new() };
        entries.push(entry(format!("{}{axis}", forces.names[c / dim]), colour, mark));
    }
    Cell::from(chart).legend(entries)
}
