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
    self, Area, Drawn, Entry, FigureError, INK, LINES, Mark, draw_line, legend, legend_above, line,
    panel, px, range, semilog, symbols, title, viridis,
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
) -> Result<String, FigureError> {
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
    figure::svg((980, if several { 1120 } else { 800 }), |root| {
        let what = match &groups[..] {
            [only] => format!("harmonic balance ({}) against orbits in time", only.name),
            _ => "harmonic balance against orbits in time".to_owned(),
        };
        title(root, &family.title, &what)?;
        let (_, sheet) = root.split_vertically(px(32.0));
        let sheet = head(sheet, &groups, rows)?;
        if !found {
            return energies(&sheet, &groups, x.clone(), ("frequency ω", energy));
        }
        let (upper, sheet) = sheet.split_vertically(px(if several { 500.0 } else { 430.0 }));
        energies(&upper, &groups, x.clone(), ("", energy))?;
        let (lower, rest) = match several {
            false => (sheet, None),
            true => {
                let (lower, rest) = sheet.split_vertically(px(290.0));
                (lower, Some(rest))
            }
        };
        distances(&lower, &groups, x.clone())?;
        match rest {
            None => Ok(()),
            Some(rest) => {
                let (left, right) = rest.split_horizontally(px(490.0));
                medians(&left, &tallies)?;
                shares(&right, &tallies)
            }
        }
    })
}

/// The legend of the upper panel; what is left of the sheet.
fn head<'b>(sheet: Area<'b>, groups: &[Group], rows: &[CheckRow]) -> Result<Area<'b>, FigureError> {
    let mut entries: Vec<Entry> = vec![];
    let mut ink = INK;
    match groups {
        [only] => ink = only.colour,
        _ => {
            entries.push(("number of harmonics:", INK, Mark::Nothing));
            entries.extend(groups.iter().map(|g| (g.name.as_str(), g.colour, Mark::Line)));
        }
    }
    let sheet = legend_above(sheet, &entries)?;
    let mut entries: Vec<Entry> = vec![("harmonic balance", ink, Mark::Line)];
    if rows.iter().any(CheckRow::is_orbit) {
        entries.push(("orbit that it approximates", ink, Mark::Dot));
    }
    if rows.iter().any(|r| r.verdict == VerdictKind::AnotherOrbit) {
        entries.push(("another orbit, found from it", ink, Mark::Circle));
    }
    let without: BTreeSet<&VerdictKind> =
        rows.iter().filter(|r| !r.has_orbit()).map(|r| &r.verdict).collect();
    // several verdicts share the cross
    let crosses = without.iter().filter(|v| mark(v) == Mark::Speck).map(|v| v.name());
    let crosses = crosses.collect::<Vec<_>>().join(" or ");
    if !without.is_empty() {
        entries.push(("no orbit from here:", INK, Mark::Nothing));
    }
    for verdict in [&VerdictKind::Fold, &VerdictKind::Grazing] {
        if without.contains(verdict) {
            entries.push((verdict.name(), ink, mark(verdict)));
        }
    }
    if !crosses.is_empty() {
        entries.push((&crosses, ink, Mark::Speck));
    }
    legend_above(sheet, &entries)
}

fn energies(
    area: &Area,
    groups: &[Group],
    x: Range<f64>,
    (x_label, energy): (&str, &str),
) -> Drawn {
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
    let mut chart = match logarithmic {
        true => semilog(area, x, y, x_label, energy)?,
        false => panel(area, x, y, x_label, energy)?,
    };
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
            draw_line(&mut chart, piece.collect(), line(g.colour, 1.2))?;
        }
    }
    for chosen in [Mark::Speck, Mark::Ring, Mark::Triangle] {
        for g in groups {
            let without = g.rows.iter().filter(|r| !r.has_orbit() && positive(&r.energy));
            let points = without.filter(|r| mark(&r.verdict) == chosen);
            symbols(&chart, points.map(|r| (r.omega, scaled(r.energy))), chosen, g.colour)?;
        }
    }
    for (own, mark) in [(false, Mark::Circle), (true, Mark::Dot)] {
        for g in groups {
            let orbits = g.rows.iter().filter(|r| r.has_orbit() && r.is_orbit() == own);
            let orbits = orbits.filter(|r| positive(&r.orbit_energy));
            symbols(&chart, orbits.map(|r| (r.omega, scaled(r.orbit_energy))), mark, g.colour)?;
        }
    }
    Ok(())
}

fn distances(area: &Area, groups: &[Group], x: Range<f64>) -> Drawn {
    let (strip, area) = area.split_vertically(px(22.0));
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
        .map(|((name, mark), _)| (*name, ink, *mark))
        .collect();
    legend(&strip, &entries)?;
    let mut y = range(all().flatten().map(|p| p.1));
    // wide enough for two numbers on the axis
    let lacking = (0.7 - (y.end - y.start)).max(0.0);
    y = y.start - 0.5 * lacking..y.end + 0.5 * lacking;
    let chart = semilog(&area, x, y, "frequency ω", "distance to the orbit")?;
    for (same, mark) in [(false, Mark::Ring), (true, Mark::Dot)] {
        for g in groups {
            symbols(&chart, shown(&g, same), mark, g.colour)?;
        }
    }
    Ok(())
}
