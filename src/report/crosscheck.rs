//! Harmonic balance beside the orbits that shooting found from it: the picture `crosscheck`, its numbers, its table.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use plotters::prelude::RGBColor;

use super::export::number;
use super::families::{Drawn, LOGARITHMIC, draw_line, title};
use super::figure::{
    self, Area, Entry, FigureError, INK, LINES, Mark, columns, legend, legend_above, line, panel,
    px, range, semilog, symbols, viridis,
};
use crate::records::{CheckRow, VerdictKind};
use crate::store::StoredFamily;

/// A point whose orbit is nearer than this and has its sequence of switches is that orbit's approximation.
pub const NEAR: f64 = 0.1;

/// What the cross-check of one number of harmonics gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// Number of harmonics.
    pub n_h: usize,
    /// Number of points.
    pub points: usize,
    /// How many of them led to an orbit.
    pub orbits: usize,
    /// How many of those orbits have the switches of the series.
    pub same_sequence: usize,
    /// How many of these are nearer than [`NEAR`].
    pub near: usize,
    /// The other verdicts, and how often each was given.
    pub verdicts: BTreeMap<VerdictKind, usize>,
    /// Median relative distance to the orbit; NaN: there is none.
    pub median_moved: f64,
    /// Median residual in time of all points.
    pub median_residual: f64,
}

/// The median; what is no number is worse than any (a point that failed must not flatter the others).
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.map(|v| if v.is_nan() { f64::INFINITY } else { v }).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn of_harmonics(rows: &[CheckRow], n_h: usize) -> impl Iterator<Item = &CheckRow> {
    rows.iter().filter(move |r| r.n_h == n_h)
}

/// The numbers of a cross-check, ascending by harmonics.
pub fn by_harmonics(rows: &[CheckRow]) -> Vec<Tally> {
    let mut harmonics: Vec<usize> = rows.iter().map(|r| r.n_h).collect();
    harmonics.sort_unstable();
    harmonics.dedup();
    let tally = |n_h: usize| {
        let of = || of_harmonics(rows, n_h);
        let orbits = || of().filter(|r| r.is_orbit());
        let mut verdicts = BTreeMap::new();
        for row in of().filter(|r| !r.is_orbit()) {
            *verdicts.entry(row.verdict.clone()).or_default() += 1;
        }
        Tally {
            n_h,
            points: of().count(),
            orbits: orbits().count(),
            same_sequence: orbits().filter(|r| r.same_sequence).count(),
            near: orbits().filter(|r| r.same_sequence && r.moved < NEAR).count(),
            verdicts,
            median_moved: median(orbits().map(|r| r.moved)),
            median_residual: median(of().map(|r| r.residual)),
        }
    };
    harmonics.into_iter().map(tally).collect()
}

/// A step of the frequency longer than this many usual ones is a gap.
const GAP: f64 = 1.5;
/// A change of the energy by more than this factor between neighbours is a jump, unless the curve is that steep.
const JUMP: f64 = 1.25;
/// Steps of a steep curve differ by less than this factor.
const ALIKE: f64 = 2.0;

/// Points of a sequential continuation in pieces that belong together.
pub(super) fn parted(points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let steps: Vec<f64> = points.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let usual = median(steps.iter().map(|s| s.abs()));
    // a curve that turns round has steps of every length
    let turns = steps.iter().any(|s| *s > 0.0) && steps.iter().any(|s| *s < 0.0);
    let apart = |k: usize| !turns && steps[k].abs() > GAP * usual;
    let change = |k: usize| (points[k + 1].1 / points[k].1).ln();
    let steep = |k: usize| {
        let neighbours = [k.checked_sub(1), Some(k + 1)].into_iter().flatten();
        let mut shared = neighbours.filter(|&n| n < steps.len() && !apart(n)).peekable();
        let alike = |n: usize| {
            let ratio = change(n) / change(k);
            ratio > 1.0 / ALIKE && ratio < ALIKE
        };
        shared.peek().is_some() && shared.all(alike)
    };
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![];
    for (k, &point) in points.iter().enumerate() {
        let joined = k > 0 && {
            let step = k - 1;
            !apart(step) && (change(step).abs() <= JUMP.ln() || steep(step))
        };
        match pieces.last_mut() {
            Some(piece) if joined => piece.push(point),
            _ => pieces.push(vec![point]),
        }
    }
    pieces
}

/// A piece of one point is a dash as long as a piece of the line.
pub(super) fn dash(piece: Vec<(f64, f64)>, width: f64) -> Vec<(f64, f64)> {
    match piece[..] {
        [(x, y)] => vec![(x - 0.5 * width, y), (x + 0.5 * width, y)],
        _ => piece,
    }
}

/// Length of such a dash, of the length of the axis.
pub(super) const DASH: f64 = 0.006;

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
pub(super) fn crosscheck(family: &StoredFamily, rows: &[CheckRow]) -> Result<String, FigureError> {
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
    let found = rows.iter().any(CheckRow::is_orbit);
    figure::svg((980, if several { 1120 } else { 800 }), |root| {
        let what = match &groups[..] {
            [only] => format!("harmonic balance ({}) against orbits in time", only.name),
            _ => "harmonic balance against orbits in time".to_owned(),
        };
        title(root, &family.title, &what)?;
        let (_, sheet) = root.split_vertically(px(32.0));
        let sheet = head(sheet, &groups, rows)?;
        if !found {
            return energies(&sheet, &groups, x.clone(), "frequency ω");
        }
        let (upper, sheet) = sheet.split_vertically(px(if several { 500.0 } else { 430.0 }));
        energies(&upper, &groups, x.clone(), "")?;
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
        entries.push(("orbit that shooting found from it", ink, Mark::Dot));
    }
    let without: BTreeSet<&VerdictKind> =
        rows.iter().filter(|r| !r.is_orbit()).map(|r| &r.verdict).collect();
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

fn energies(area: &Area, groups: &[Group], x: std::ops::Range<f64>, x_label: &str) -> Drawn {
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
        true => semilog(area, x, y, x_label, "largest energy H")?,
        false => panel(area, x, y, x_label, "largest energy H")?,
    };
    for g in groups {
        let points: Vec<(f64, f64)> =
            g.rows.iter().filter(|r| positive(&r.energy)).map(|r| (r.omega, r.energy)).collect();
        let alone_without = |piece: &Vec<(f64, f64)>| match piece[..] {
            [(omega, energy)] => {
                g.rows.iter().any(|r| !r.is_orbit() && r.omega == omega && r.energy == energy)
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
            let without = g.rows.iter().filter(|r| !r.is_orbit() && positive(&r.energy));
            let points = without.filter(|r| mark(&r.verdict) == chosen);
            symbols(&chart, points.map(|r| (r.omega, scaled(r.energy))), chosen, g.colour)?;
        }
    }
    for g in groups {
        let orbits = g.rows.iter().filter(|r| r.is_orbit() && positive(&r.orbit_energy));
        symbols(&chart, orbits.map(|r| (r.omega, scaled(r.orbit_energy))), Mark::Dot, g.colour)?;
    }
    Ok(())
}

fn distances(area: &Area, groups: &[Group], x: std::ops::Range<f64>) -> Drawn {
    let (strip, area) = area.split_vertically(px(22.0));
    let ink = if let [only] = groups { only.colour } else { INK };
    let names = [("same switches as the series", Mark::Dot), ("other switches", Mark::Ring)];
    let shown = |g: &&Group, same: bool| -> Vec<(f64, f64)> {
        let rows = g.rows.iter().filter(|r| r.is_orbit() && r.same_sequence == same);
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

/// Where the numbers of harmonics lie on a logarithmic axis, and those that have room for their names.
fn harmonic_axis(tallies: &[Tally]) -> (std::ops::Range<f64>, Vec<(f64, String)>) {
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
    area: &Area,
    tallies: &[Tally],
    curves: &[Curve],
    (y, logarithmic): (std::ops::Range<f64>, bool),
    label: &str,
) -> Drawn {
    let (strip, area) = area.split_vertically(px(22.0));
    let entries: Vec<Entry> = curves.iter().map(|c| (c.name, c.colour, c.mark)).collect();
    legend(&strip, &entries)?;
    let (x, ticks) = harmonic_axis(tallies);
    let mut chart =
        columns(&area, (x, &ticks), (y, logarithmic), "number of harmonics N_h", label)?;
    for c in curves {
        draw_line(&mut chart, c.points.clone(), line(c.colour, 1.4))?;
        symbols(&chart, c.points.iter().copied(), c.mark, c.colour)?;
    }
    Ok(())
}

/// Medians of distance and residual.
fn medians(area: &Area, tallies: &[Tally]) -> Drawn {
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
    over_harmonics(area, tallies, &curves, (y, true), "median")
}

/// How many points lead to an orbit.
fn shares(area: &Area, tallies: &[Tally]) -> Drawn {
    let points = |value: fn(&Tally) -> usize| -> Vec<(f64, f64)> {
        let share = |t: &Tally| 100.0 * value(t) as f64 / t.points.max(1) as f64;
        tallies.iter().map(|t| ((t.n_h.max(1) as f64).log10(), share(t))).collect()
    };
    let curves = [
        Curve { name: "orbit found", points: points(|t| t.orbits), colour: INK, mark: Mark::Ring },
        Curve {
            name: "with the same switches",
            points: points(|t| t.same_sequence),
            colour: INK,
            mark: Mark::Dot,
        },
    ];
    over_harmonics(area, tallies, &curves, (0.0..105.0, false), "% of the points")
}

/// A row a point of harmonic balance; what a point without an orbit does not have is empty.
pub fn csv(rows: &[CheckRow]) -> String {
    let mut out = String::from(
        "omega,harmonics,hbm_energy,residual,return_error,verdict,moved,orbit_energy,contact_change,same_sequence\n",
    );
    let finite = |v: f64| if v.is_finite() { number(v) } else { String::new() };
    for r in rows {
        let [energy, residual, back] = [r.energy, r.residual, r.return_error].map(finite);
        let _ =
            write!(out, "{},{},{energy},{residual},{back},{}", number(r.omega), r.n_h, r.verdict);
        let _ = match r.is_orbit() {
            true => {
                let [moved, energy, change] =
                    [r.moved, r.orbit_energy, r.contact_change].map(finite);
                writeln!(out, ",{moved},{energy},{change},{}", u8::from(r.same_sequence))
            }
            false => writeln!(out, ",,,,"),
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_part_at_gaps_and_jumps_but_not_where_they_are_steep() {
        let lengths = |energies: &[f64]| -> Vec<usize> {
            let points: Vec<_> =
                energies.iter().enumerate().map(|(k, e)| (1.0 + 0.1 * k as f64, *e)).collect();
            parted(&points).iter().map(Vec::len).collect()
        };
        assert_eq!(lengths(&[1.0, 1.1, 1.2, 2.4, 2.5, 1.5]), [3, 2, 1]);
        assert_eq!(lengths(&[1.0, 1.3, 1.7, 2.3, 3.1]), [5]);
        let gap = [(1.0, 1.0), (1.1, 1.0), (1.2, 1.0), (1.4, 1.0), (1.5, 1.0)];
        assert_eq!(parted(&gap).iter().map(Vec::len).collect::<Vec<_>>(), [3, 2]);
    }

    #[test]
    fn the_tally_counts_verdicts_and_takes_medians() {
        let row = |verdict: VerdictKind, moved: f64, same_sequence: bool| CheckRow {
            omega: 1.0,
            n_h: 3,
            energy: 1.0,
            residual: 0.5,
            return_error: 0.1,
            verdict,
            message: String::new(),
            moved,
            orbit_energy: 1.0,
            contact_change: 0.0,
            same_sequence,
        };
        let rows = [
            row(VerdictKind::Orbit, 0.1, true),
            row(VerdictKind::Orbit, 0.3, false),
            row(VerdictKind::Orbit, 0.2, true),
            row(VerdictKind::Fold, f64::NAN, false),
        ];
        let [t] = &by_harmonics(&rows)[..] else { panic!("one number of harmonics") };
        assert_eq!((t.n_h, t.points, t.orbits, t.same_sequence), (3, 4, 3, 2));
        assert_eq!((t.median_moved, t.median_residual), (0.2, 0.5));
        assert_eq!(t.verdicts.get(&VerdictKind::Fold), Some(&1));
    }
}
