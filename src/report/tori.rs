//! Families of motions of two frequencies: their curves, sizes and rotation numbers; and their table as CSV.

use std::fmt::Write as _;

use super::export::number;
use super::figure::{Axis, Cell, Chart, FigureError, LINES, Mark, Point, Sheet, range, viridis};
use super::summary::significant;
use crate::records::TorusRow;
use crate::store::StoredTori;

/// So many curves are drawn at most, of so many points.
const CURVES: usize = 12;
const POINTS: usize = 360;

/// Curves at the beginnings of the periods of the loads, size and rotation number over the frequency.
pub fn picture(stored: &StoredTori) -> Result<Sheet<'static>, FigureError> {
    let rows = &stored.tori.rows;
    if rows.is_empty() {
        return Err(FigureError::Empty("there are no curves"));
    }
    let every = rows.len().div_ceil(CURVES);
    let shown: Vec<&TorusRow> = rows.iter().rev().step_by(every).collect();
    let points = || shown.iter().flat_map(|row| &row.lead);
    let mut section = Chart::new(
        Axis::linear(
            "displacement of the contact point that moves most",
            range(points().map(|p| p[0])),
        ),
        Axis::linear("its velocity", range(points().map(|p| p[1]))),
    );
    for (k, row) in shown.iter().enumerate() {
        let curve: Vec<Point> = row.around(POINTS).iter().map(|p| (p[0], p[1])).collect();
        section.line(curve, viridis(0.85 * k as f64 / shown.len() as f64), 1.2);
    }
    let x = range(rows.iter().map(|row| row.omega));
    let over = |names: [&str; 2], of: &dyn Fn(&TorusRow) -> f64| {
        let y = range(rows.iter().map(of).filter(|y| y.is_finite()));
        let mut chart = Chart::new(Axis::linear(names[0], x.clone()), Axis::linear(names[1], y));
        let line: Vec<Point> = rows.iter().map(|row| (row.omega, of(row))).collect();
        chart.line(line.clone(), LINES[0], 1.2);
        for (row, at) in rows.iter().zip(line) {
            let mark = if row.attracts() { Mark::Dot } else { Mark::Ring };
            chart.marks([at], mark, LINES[0]);
        }
        Cell::from(chart)
    };
    let what = format!(
        "motions of two frequencies from ω = {} on (filled: they attract)",
        significant(rows[0].omega, 6)
    );
    Ok(Sheet::new(&stored.head.title, &what)
        .row(420.0, vec![Cell::from(section)])
        .row(170.0, vec![over(["", "largest displacement"], &|row| row.amplitude)])
        .row(170.0, vec![over(["frequency ω of the loads", "rotation number"], &|row| row.rho)]))
}

/// A row a curve.
pub fn csv(stored: &StoredTori) -> String {
    let mut out =
        String::from("omega,rotation_number,size,tail,harmonics,attraction,amplitude,force\n");
    for row in &stored.tori.rows {
        let first = [row.omega, row.rho, row.size, row.tail].map(number).join(",");
        let last = [row.attraction, row.amplitude, row.force].map(number).join(",");
        let _ = writeln!(out, "{first},{},{last}", row.states.len() / 2);
    }
    out
}
