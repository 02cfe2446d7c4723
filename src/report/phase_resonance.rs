//! Tests of phase resonance: amplitude and damping over the frequency; and their table as CSV.

use std::fmt::Write as _;

use super::export::{number, quoted};
use super::figure::{Axis, Cell, Chart, FigureError, LINES, Mark, Point, Sheet, range};
use super::summary::significant;
use crate::records::{Resonance, ResonanceRow};
use crate::store::StoredResonance;

/// Error bars are so many standard errors to each side.
const BARS: f64 = 2.0;

/// The amplitude, the damping ratio, and the number of the scene, over the frequency where the loop came to rest.
pub fn picture(stored: &StoredResonance) -> Result<Sheet<'static>, FigureError> {
    let found = &stored.found;
    let rows: Vec<&ResonanceRow> = found.rows.iter().filter(|row| row.is_locked).collect();
    if rows.is_empty() {
        return Err(FigureError::Empty("the loop came to rest nowhere"));
    }
    let x = range(rows.iter().map(|row| row.omega.mean));
    // each with half of the length of its error bar
    let chart = |names: [&str; 2], of: &dyn Fn(&ResonanceRow) -> (f64, f64)| {
        let ends = rows.iter().flat_map(|row| {
            let (y, half) = of(row);
            [y - half, y + half]
        });
        let y = range(ends.filter(|y| y.is_finite()));
        let mut chart = Chart::new(Axis::linear(names[0], x.clone()), Axis::linear(names[1], y));
        let line: Vec<Point> = rows.iter().map(|row| (row.omega.mean, of(row).0)).collect();
        for row in &rows {
            let ((y, half), (at, across)) = (of(row), (row.omega.mean, BARS * row.omega.error));
            for (length, bar) in [
                (half, vec![(at, y - half), (at, y + half)]),
                (across, vec![(at - across, y), (at + across, y)]),
            ] {
                if length > 0.0 {
                    chart.line(bar, LINES[1], 1.2);
                }
            }
        }
        chart.line(line.clone(), LINES[0], 1.0);
        chart.marks(line, Mark::Dot, LINES[0]);
        Cell::from(chart)
    };
    let bar = |r: crate::records::Reading| (r.mean, BARS * r.error);
    let damping = |row: &ResonanceRow| {
        let half = BARS * row.work.error / row.work.mean * row.damping();
        (row.damping(), half.abs())
    };
    let test = &found.test;
    let ends = test.range.map(|x| significant(x, 4));
    let mut what = format!("phase resonance, {} from {} to {}", test.key, ends[0], ends[1]);
    if test.noise > 0.0 {
        let _ = write!(what, ", readings off by {} (bars: {BARS} standard errors)", test.noise);
    }
    let name = "largest contact displacement";
    Ok(Sheet::new(&stored.head.title, &what)
        .row(380.0, vec![chart(["", name], &|row| bar(row.amplitude))])
        .row(190.0, vec![chart(["", "damping ratio W/(4πK)"], &damping)])
        .row(190.0, vec![chart(["frequency ω", test.key.as_str()], &|row| (row.value, 0.0))]))
}

/// A row a value.
pub fn csv(stored: &StoredResonance) -> String {
    let names = ResonanceRow::READINGS.map(|n| format!("{n},{n}_error"));
    let by = stored.found.test.by.iter();
    let by = by.flat_map(|key| Resonance::NAMES.map(|name| quoted(&format!("{name} by {key}"))));
    let names: Vec<String> = names.into_iter().collect();
    let last = ["energy", "kinetic", "damping"].map(str::to_owned);
    let names: Vec<String> = names.into_iter().chain(last).chain(by).collect();
    let mut out = format!("value,locked,periods,{},note\n", names.join(","));
    for row in &stored.found.rows {
        let readings = row.readings().map(|r| [number(r.mean), number(r.error)].join(","));
        let by = row.by.iter().flat_map(Resonance::numbers);
        let own = [row.energy, row.kinetic, row.damping()].into_iter();
        let missing = if row.by.is_empty() { 3 * stored.found.test.by.len() } else { 0 };
        let all = own.chain(by).chain(std::iter::repeat_n(f64::NAN, missing));
        let more: Vec<String> = all.map(number).collect();
        let _ = writeln!(
            out,
            "{},{},{},{},{},{}",
            number(row.value),
            u8::from(row.is_locked),
            row.periods,
            readings.join(","),
            more.join(","),
            quoted(&row.note)
        );
    }
    out
}
