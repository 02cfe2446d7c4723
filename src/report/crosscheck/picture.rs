//! The picture `crosscheck`: energies, distances, and both against the number of harmonics.

use std::collections::BTreeSet;
use std::ops::Range;

use plotters::prelude::RGBColor;

use super::convergence::{medians, shares};
use super::parted::{DASH, dash, parted};
use super::tally::{Tally, by_harmonics, of_harmonics};
use crate::records::{CheckRow, VerdictKind};
use crate::report::families::{LOGARITHMIC, is_viscous};
use crate::report::figure::{
    Axis, Cell, Chart, Entry, FigureError, INK, LINES, Legend, Mark, Sheet, entry, range, viridis,
};
use crate::store::StoredFamily;

/// How a point is marked from which shooting reached no orbit.
fn mark(verdict: &VerdictKind) -> Mark {
    match verdict {
        VerdictKind::Fold => Mark::Triangle,
        VerdictKind::Grazing => Mark::Ring,
        _ => Mark::Speck,
    }
}

/// One number of harmonics, its rows and its colour.
struct Group<'r> {
    name: String,
    rows: Vec<&'r CheckRow>,
    colour: RGBColor,
}

/// Energies of harmonic balance and of the orbits, the distances between them, and both against the harmonics.
pub(in crate::report) fn crosscheck(
    family: &StoredFamily,
    rows: &[CheckRow],
) -> Result<Sheet<'static>, FigureError> {
    if rows.is_empty() {
        return Err(FigureError::Empty("the cross-check holds no points"));
    }
    let tallies = by_harmonics(rows);
    let last = tallies.len().saturating_sub(1).max(1) as f64;
    let group = |(k, t): (usize, &Tally)| Group {
        name: format!("N_h = {}", t.n_h),
        rows: of_harmonics(rows, t.n_h).collect(),
        colour: match tallies.len() <= LINES.len() {
            true => LINES[k],
            false => viridis(0.92 * k as f64 / last),
        },
    };
    let groups: Vec<Group> = tallies.iter().enumerate().map(group).collect();
    let several = groups.len() > 1;
    let x = range(rows.iter().map(|r| r.omega));
    let found = rows.iter().any(CheckRow::has_orbit);
    let energy = if is_viscous(family) { "energy H at t = 0" } else { "largest energy H" };
    let what = match &groups[..] {
        [only] => format!("harmonic balance ({}) against orbits in time", only.name),
        _ => "harmonic balance against orbits in time".to_owned(),
    };
    let sheet = head(Sheet::new(&family.title, &what), &groups, rows);
    if !found {
        return Ok(sheet.row(720.0, vec![energies(&groups, x, ("frequency ω", energy)).into()]));
    }
    let upper = energies(&groups, x.clone(), ("", energy)).into();
    let sheet = sheet.row(if several { 500.0 } else { 430.0 }, vec![upper]);
    let sheet = sheet.row(295.0, vec![distances(&groups, x)]);
    Ok(match several {
        true => sheet.row(270.0, vec![medians(&tallies), shares(&tallies)]),
        false => sheet,
    })
}

/// The legend of the upper chart.
fn head<'s>(sheet: Sheet<'s>, groups: &[Group], rows: &[CheckRow]) -> Sheet<'s> {
    let mut entries: Vec<Entry> = vec![];
    let mut ink = INK;
    match groups {
        [only] => ink = only.colour,
        _ => {
            entries.push(entry("number of harmonics:", INK, Mark::Nothing));
            entries.extend(groups.iter().map(|g| entry(&g.name, g.colour, Mark::Line)));
        }
    }
    let sheet = sheet.legend(Legend::Rows(entries));
    let mut entries: Vec<Entry> = vec![entry("harmonic balance", ink, Mark::Line)];
    if rows.iter().any(CheckRow::is_orbit) {
        entries.push(entry("orbit that it approximates", ink, Mark::Dot));
    }
    if rows.iter().any(|r| r.verdict == VerdictKind::AnotherOrbit) {
        entries.push(entry("another orbit, found from it", ink, Mark::Circle));
    }
    let without: BTreeSet<&VerdictKind> =
        rows.iter().filter(|r| !r.has_orbit()).map(|r| &r.verdict).collect();
    // several verdicts share the cross
    let crosses = without.iter().filter(|v| mark(v) == Mark::Speck).map(|v| v.name());
    let crosses = crosses.collect::<Vec<_>>().join(" or ");
    if !without.is_empty() {
        entries.push(entry("no orbit from here:", INK, Mark::Nothing));
    }
    for verdict in [&VerdictKind::Fold, &VerdictKind::Grazing] {
        if without.contains(verdict) {
            entries.push(entry(verdict.name(), ink, mark(verdict)));
        }
    }
    if !crosses.is_empty() {
        entries.push(entry(crosses, ink, Mark::Speck));
    }
    sheet.legend(Legend::Rows(entries))
}

fn energies(groups: &[Group], x: Range<f64>, (x_label, energy): (&str, &str)) -> Chart {
    let all = || groups.iter().flat_map(|g| g.rows.iter());
    let positive = |v: &f64| v.is_finite() && *v > 0.0;
    let values: Vec<f64> =
        all().flat_map(|r| [r.energy, r.orbit_energy]).filter(positive).collect();
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(0.0, f64::max);
    let logarithmic = most > LOGARITHMIC * least;
    let scaled = |v: f64| if logarithmic { v.log10() } else { v };
    let y = range(values.iter().map(|&v| scaled(v)));
    let dash_width = DASH * (x.end - x.start);
    let mut chart = Chart::new(Axis::linear(x_label, x), Axis::scaled(energy, y, logarithmic));
    for g in groups {
        let points: Vec<(f64, f64)> =
            g.rows.iter().filter(|r| positive(&r.energy)).map(|r| (r.omega, r.energy)).collect();
        let alone_without = |piece: &Vec<(f64, f64)>| match piece[..] {
            [(omega, energy)] => {
                g.rows.iter().any(|r| !r.has_orbit() && r.omega == omega && r.energy == energy)
            }
            _ => false,
        };
        // the mark of such a point stands for it
        for piece in parted(&points).into_iter().filter(|p| !alone_without(p)) {
            let piece = dash(piece, dash_width).into_iter().map(|(x, v)| (x, scaled(v)));
            chart.line(piece.collect(), g.colour, 1.2);
        }
    }
    for chosen in [Mark::Speck, Mark::Ring, Mark::Triangle] {
        for g in groups {
            let without = g.rows.iter().filter(|r| !r.has_orbit() && positive(&r.energy));
            let points = without.filter(|r| mark(&r.verdict) == chosen);
            chart.marks(points.map(|r| (r.omega, scaled(r.energy))), chosen, g.colour);
        }
    }
    for (own, mark) in [(false, Mark::Circle), (true, Mark::Dot)] {
        for g in groups {
            let orbits = g.rows.iter().filter(|r| r.has_orbit() && r.is_orbit() == own);
            let orbits = orbits.filter(|r| positive(&r.orbit_energy));
            chart.marks(orbits.map(|r| (r.omega, scaled(r.orbit_energy))), mark, g.colour);
        }
    }
    chart
}

fn distances(groups: &[Group], x: Range<f64>) -> Cell<'static> {
    let ink = if let [only] = groups { only.colour } else { INK };
    let names = [("same switches as the series", Mark::Dot), ("other switches", Mark::Ring)];
    let shown = |g: &&Group, same: bool| -> Vec<(f64, f64)> {
        let rows = g.rows.iter().filter(|r| r.has_orbit() && r.same_sequence == same);
        rows.filter(|r| r.moved > 0.0).map(|r| (r.omega, r.moved.log10())).collect()
    };
    let all = || groups.iter().flat_map(|g| [true, false].map(|same| shown(&g, same)));
    let present = [true, false].map(|same| groups.iter().any(|g| !shown(&g, same).is_empty()));
    let entries: Vec<Entry> = names
        .iter()
        .zip(present)
        .filter(|(_, present)| *present)
        .map(|((name, mark), _)| entry(*name, ink, *mark))
        .collect();
    let mut y = range(all().flatten().map(|p| p.1));
    // wide enough for two numbers on the axis
    let lacking = (0.7 - (y.end - y.start)).max(0.0);
    y = y.start - 0.5 * lacking..y.end + 0.5 * lacking;
    let mut chart =
        Chart::new(Axis::linear("frequency ω", x), Axis::scaled("distance to the orbit", y, true));
    for (same, mark) in [(false, Mark::Ring), (true, Mark::Dot)] {
        for g in groups {
            chart.marks(shown(&g, same), mark, g.colour);
        }
    }
    Cell::from(chart).legend(entries)
}
