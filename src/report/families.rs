//! Pictures of periodic orbits: a family over the frequency (`backbone`), Floquet multipliers (`multipliers`), the phase
//! portrait of the contact nodes (`portrait`); and the table of a family as CSV.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use plotters::prelude::*;

use super::crosscheck::crosscheck;
use super::curve::{self, Knot};
use super::export::number;
use super::figure::{
    self, Area, Chart, Drawing, Entry, FigureError, INK, LINES, Mark, colour_bar, equal_panel,
    flat, legend, legend_above, line, panel, px, range, semilog, symbol, symbols, text, viridis,
};
use crate::records::{
    Bifurcation, Branch, CheckRow, OrbitRecord, PointKind, PointRecord, Solver, Way,
};
use crate::store::{Stored, StoredFamily};

pub(super) type Drawn = Result<(), FigureError>;

/// What a picture is drawn from.
#[derive(Clone, Copy)]
enum Source<'s> {
    Orbit(&'s Stored, &'s OrbitRecord, &'s [f64]),
    Family(&'s StoredFamily),
    Check(&'s StoredFamily, &'s [CheckRow]),
}

/// A picture's name and how it is drawn.
type Picture = (&'static str, fn(Source) -> Result<String, FigureError>);

const OF_ORBIT: [Picture; 2] = [
    ("portrait", |s| match s {
        Source::Orbit(stored, _, rates) => portrait(stored, rates),
        _ => Err(FigureError::Empty("a family has no portrait")),
    }),
    ("multipliers", multipliers),
];

const OF_FAMILY: [Picture; 2] = [
    ("backbone", |s| match s {
        Source::Family(family) => backbone(family),
        _ => Err(FigureError::Empty("this is no backbone")),
    }),
    ("multipliers", multipliers),
];

const OF_CHECK: [Picture; 2] = [
    ("crosscheck", |s| match s {
        Source::Check(family, rows) => crosscheck(family, rows),
        _ => Err(FigureError::Empty("there is no cross-check")),
    }),
    ("multipliers", multipliers),
];

/// Names of the pictures of an orbit, beside those of a run.
pub fn orbit_names() -> Vec<&'static str> {
    OF_ORBIT.iter().map(|p| p.0).collect()
}

/// Names of the pictures of a family.
pub fn family_names() -> Vec<&'static str> {
    OF_FAMILY.iter().map(|p| p.0).collect()
}

/// Names of the pictures of a cross-check.
pub fn check_names() -> Vec<&'static str> {
    OF_CHECK.iter().map(|p| p.0).collect()
}

/// Draw the named pictures of an orbit (all that make sense if `only` is empty) to be written as `STEM-NAME.svg` and `.png`;
/// `rates` are those of the monitors at the switches.
pub fn pictures_of_orbit(
    stored: &Stored,
    orbit: &OrbitRecord,
    rates: &[f64],
    stem: &Path,
    only: &[String],
) -> Result<Vec<Drawing>, FigureError> {
    draw(&OF_ORBIT, Source::Orbit(stored, orbit, rates), stem, only).map(|(drawn, _)| drawn)
}

/// Draw the named pictures of a family, likewise; without any orbit there is nothing to draw.
pub fn pictures_of_family(
    family: &StoredFamily,
    stem: &Path,
    only: &[String],
) -> Result<Vec<Drawing>, FigureError> {
    something(draw(&OF_FAMILY, Source::Family(family), stem, only)?)
}

/// Draw the named pictures of a cross-check, likewise.
pub fn pictures_of_check(
    family: &StoredFamily,
    rows: &[CheckRow],
    stem: &Path,
    only: &[String],
) -> Result<Vec<Drawing>, FigureError> {
    something(draw(&OF_CHECK, Source::Check(family, rows), stem, only)?)
}

/// What was drawn, and why the first picture that is not there was left out.
type Drawings = (Vec<Drawing>, Option<FigureError>);

/// A file of which nothing can be drawn says why.
fn something((drawn, reason): Drawings) -> Result<Vec<Drawing>, FigureError> {
    match reason {
        Some(reason) if drawn.is_empty() => Err(reason),
        _ => Ok(drawn),
    }
}

fn draw(
    pictures: &[Picture],
    source: Source,
    stem: &Path,
    only: &[String],
) -> Result<Drawings, FigureError> {
    let (mut drawn, mut reason) = (vec![], None);
    for (name, picture) in pictures {
        if !only.is_empty() && !only.iter().any(|o| o == name) {
            continue;
        }
        let svg = match picture(source) {
            Ok(svg) => svg,
            Err(e @ FigureError::Empty(_)) if only.is_empty() => {
                reason = reason.or(Some(e));
                continue;
            }
            Err(e) => return Err(e),
        };
        drawn.push(Drawing { stem: named(stem, &format!("-{name}")), svg });
    }
    Ok((drawn, reason))
}

pub(super) fn named(stem: &Path, ending: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

pub(super) fn title(area: &Area, title: &str, what: &str) -> Drawn {
    let title: String = title.chars().filter(|c| !c.is_control()).take(90).collect();
    let name = if title.is_empty() { String::new() } else { format!("{title}: ") };
    area.draw(&Text::new(format!("{name}{what}"), (px(12.0), px(8.0)), text(16)))
        .map_err(FigureError::draw)
}

pub(super) fn draw_line(chart: &mut Chart, points: Vec<(f64, f64)>, style: ShapeStyle) -> Drawn {
    let path = PathElement::new(points, style);
    chart.draw_series(std::iter::once(path)).map(|_| ()).map_err(FigureError::draw)
}

pub(super) fn draw_dashes(chart: &mut Chart, points: Vec<(f64, f64)>, style: ShapeStyle) -> Drawn {
    let dashes = DashedLineSeries::new(points, px(5.0), px(3.5), style);
    chart.draw_series(dashes).map(|_| ()).map_err(FigureError::draw)
}

// Families.

/// One orbit after the other at given frequencies: neighbours need not belong together.
fn is_sequential(family: &StoredFamily) -> bool {
    family.outline().is_point_by_point()
}

/// The points of a branch in their order; points of different branches are interleaved in the file.
pub(super) fn of_branch(
    family: &StoredFamily,
    branch: usize,
) -> impl Iterator<Item = &PointRecord> {
    family.points.iter().filter(move |p| p.branch == branch)
}

pub(super) fn branches(family: &StoredFamily) -> Vec<usize> {
    family.points.iter().map(|p| p.branch).collect::<BTreeSet<_>>().into_iter().collect()
}

/// Colour of a branch: more of them than line colours are a scale.
fn colour(family: &StoredFamily, branch: usize) -> RGBColor {
    let last = branches(family).last().copied().unwrap_or(0);
    match last < LINES.len() {
        true => LINES[branch],
        false => viridis(0.92 * branch as f64 / last as f64),
    }
}

/// Names of the branches without what they have in common at the start, and that.
fn branch_names(family: &StoredFamily) -> (String, Vec<String>) {
    let all = branches(family);
    let name = |b: &usize| {
        family.branches.get(*b).map_or_else(|| format!("branch {}", b + 1), Branch::to_string)
    };
    let names: Vec<String> = all.iter().map(name).collect();
    let [first, rest @ ..] = &names[..] else { return (String::new(), names) };
    if rest.is_empty() {
        return (String::new(), names);
    }
    let common = first
        .char_indices()
        .map(|(i, c)| i + c.len_utf8())
        .take_while(|&i| rest.iter().all(|n| n.get(..i) == first.get(..i)))
        .last()
        .unwrap_or(0);
    // what stands before a comma, or a word before a number
    let cut = match first[..common].rfind(", ") {
        Some(comma) => comma + 2,
        None => first[..common].rfind(' ').map_or(0, |space| space + 1),
    };
    let begins = |n: &String| n[cut..].starts_with(|c: char| c.is_ascii_digit());
    if !first[..cut].ends_with(", ") && !names.iter().all(begins) {
        return (String::new(), names);
    }
    let prefix = first[..cut].trim_end_matches([' ', ',', '=']).to_owned();
    (prefix, names.iter().map(|n| n[cut..].to_owned()).collect())
}

/// Whether a special point is one of stability, where the orbit itself is neither stable nor unstable.
fn is_critical(p: &PointRecord) -> bool {
    p.special == PointKind::Fold || bifurcation(&p.special).is_some()
}

/// What a bifurcation is called in a legend.
fn bifurcation(kind: &PointKind) -> Option<&'static str> {
    match kind {
        PointKind::BranchPoint => Some("branch point"),
        PointKind::Stability(change) => Some(match change.how {
            Bifurcation::PeriodDoubling => "period doubling",
            Bifurcation::NeimarkSacker => "Neimark–Sacker",
            Bifurcation::PlusOne => "multiplier through +1",
        }),
        _ => None,
    }
}

/// A quantity of an orbit, if it has it.
pub(super) type Value<'v> = &'v dyn Fn(&OrbitRecord) -> Option<f64>;

/// A piece of a branch of one stability.
pub(super) struct Piece {
    pub(super) stable: Option<bool>,
    pub(super) points: Vec<(f64, f64)>,
}

/// A branch in pieces that may be drawn as lines.
pub(super) fn pieces(family: &StoredFamily, branch: usize, value: Value) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = vec![];
    // the orbits of a cross-check were found one by one
    if family.outline().solver == Solver::Check {
        return pieces;
    }
    let mut before: Option<(&PointRecord, f64)> = None;
    let mut goes_on = false;
    for p in of_branch(family, branch) {
        let here = p.orbit.as_ref().and_then(value).map(|y| (p, y));
        let parted = is_sequential(family) && p.special == PointKind::Jump;
        if let (Some((a, y_a)), Some((b, y_b)), false) = (before, here, parted) {
            let stability = |p: &PointRecord| p.orbit.as_ref().and_then(|o| o.stable);
            // at a point of stability its neighbour decides
            let stable = match (is_critical(a), is_critical(b)) {
                (true, false) => stability(b),
                (false, true) => stability(a),
                _ => stability(a).zip(stability(b)).map(|(a, b)| a && b),
            };
            match pieces.last_mut() {
                Some(last) if goes_on && last.stable == stable => last.points.push((b.omega, y_b)),
                _ => {
                    pieces.push(Piece { stable, points: vec![(a.omega, y_a), (b.omega, y_b)] });
                }
            }
            goes_on = true;
        } else {
            goes_on = false;
        }
        before = here;
    }
    pieces
}

/// How a family is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// Stability by lines and dots, all special points.
    Full,
    /// The quantity itself tells the stability; borders are left out.
    Plain,
}

impl Look {
    fn marks(self) -> &'static [Special] {
        match self {
            Look::Full => &[Special::Border, Special::Bifurcation, Special::Fold],
            Look::Plain => &[Special::Bifurcation, Special::Fold],
        }
    }
}

/// One panel of a family: lines, dots, gaps and special points.
fn draw_family(
    chart: &mut Chart,
    family: &StoredFamily,
    look: Look,
    value: Value,
    bottom: f64,
) -> Drawn {
    for branch in branches(family) {
        let colour = colour(family, branch);
        for piece in pieces(family, branch, value) {
            match piece.stable {
                _ if look == Look::Plain => draw_line(chart, piece.points, line(colour, 1.4))?,
                Some(true) => draw_line(chart, piece.points, line(colour, 2.2))?,
                Some(false) => draw_dashes(chart, piece.points, line(colour, 1.4))?,
                None => draw_line(chart, piece.points, line(colour, 1.0))?,
            }
        }
    }
    for branch in branches(family) {
        let colour = colour(family, branch);
        let gaps = of_branch(family, branch).filter(|p| p.orbit.is_none());
        let gaps: Vec<(f64, f64)> = gaps.map(|p| (p.omega, bottom)).collect();
        gap_ticks(chart, &gaps, colour)?;
        let alone = of_branch(family, branch).filter(|p| p.orbit.is_some()).count() == 1;
        if is_sequential(family) || alone {
            for p in of_branch(family, branch) {
                let Some((orbit, y)) = p.orbit.as_ref().and_then(|o| Some((o, value(o)?))) else {
                    continue;
                };
                let open = look == Look::Full && orbit.stable == Some(false);
                let mark = if open { Mark::Ring } else { Mark::Dot };
                symbols(chart, [(p.omega, y)], mark, colour)?;
            }
        }
    }
    for &kind in look.marks() {
        for p in family.points.iter().filter(|p| special(p) == Some(kind)) {
            let colour = if kind == Special::Border { colour(family, p.branch) } else { INK };
            let at = p.orbit.as_ref().and_then(value).map(|y| (p.omega, y));
            symbols(chart, at, kind.mark(), colour)?;
        }
    }
    Ok(())
}

/// Short strokes on the lower edge.
fn gap_ticks(chart: &Chart, points: &[(f64, f64)], colour: RGBColor) -> Drawn {
    let (sheet, place) = flat(chart);
    for point in points {
        let (x, y) = place(*point);
        symbol(&sheet, (x, y - px(4.0)), Mark::Tick, colour)?;
    }
    Ok(())
}

/// Special points that are marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Special {
    Border,
    Bifurcation,
    Fold,
}

impl Special {
    fn mark(self) -> Mark {
        match self {
            Special::Border => Mark::Ring,
            Special::Bifurcation => Mark::Diamond,
            Special::Fold => Mark::Triangle,
        }
    }
}

/// How a point is marked. Bifurcations between unstable orbits are not: they would hide the branch.
fn special(p: &PointRecord) -> Option<Special> {
    match &p.special {
        PointKind::Fold => Some(Special::Fold),
        PointKind::Border(_) => Some(Special::Border),
        PointKind::BranchPoint => Some(Special::Bifurcation),
        PointKind::Stability(change) if !change.stays_unstable() => Some(Special::Bifurcation),
        _ => None,
    }
}

/// Title and legend of a family's picture; what is left of the sheet.
fn family_head<'b>(
    root: &Area<'b>,
    family: &StoredFamily,
    what: &str,
    look: Look,
    extra: &[Entry],
) -> Result<Area<'b>, FigureError> {
    let sequential = is_sequential(family);
    let all = branches(family);
    let (prefix, names) = branch_names(family);
    // one branch has its name in the title
    let what = match &names[..] {
        [name] => format!("{what} ({name})"),
        _ => what.to_owned(),
    };
    title(root, &family.title, &what)?;
    let (_, sheet) = root.split_vertically(px(32.0));
    let lead = format!("{prefix}:");
    let mut entries: Vec<Entry> = vec![];
    if names.len() > 1 {
        if !prefix.is_empty() {
            entries.push((&lead, INK, Mark::Nothing));
        }
        let mark = if sequential { Mark::Dot } else { Mark::Line };
        let named = all.iter().zip(&names);
        entries.extend(named.map(|(&b, name)| (name.as_str(), colour(family, b), mark)));
    }
    let sheet = legend_above(sheet, &entries)?;

    let orbits = || family.points.iter().filter_map(|p| p.orbit.as_ref());
    let any = |stable: Option<bool>| orbits().any(|o| o.stable == stable);
    let ink = if all.len() == 1 { colour(family, all[0]) } else { INK };
    let mut entries: Vec<Entry> = vec![];
    let [yes, no] = if sequential { [Mark::Dot, Mark::Ring] } else { [Mark::Line, Mark::Dashes] };
    for (stable, name, mark) in [(true, "stable", yes), (false, "unstable", no)] {
        if look == Look::Full && any(Some(stable)) {
            entries.push((name, ink, mark));
        }
    }
    let specials: Vec<&PointRecord> =
        family.points.iter().filter(|p| special(p).is_some()).collect();
    let has = |kind: Special| specials.iter().any(|p| special(p) == Some(kind));
    let marked = specials.iter().filter(|p| special(p) == Some(Special::Bifurcation));
    let kinds: BTreeSet<_> = marked.filter_map(|p| bifurcation(&p.special)).collect();
    let kinds = kinds.into_iter().collect::<Vec<_>>().join(", ");
    for (kind, name) in [
        (Special::Fold, "fold"),
        (Special::Border, "change of switch sequence"),
        (Special::Bifurcation, kinds.as_str()),
    ] {
        if look.marks().contains(&kind) && has(kind) {
            entries.push((name, INK, kind.mark()));
        }
    }
    if family.points.iter().any(|p| p.orbit.is_none()) {
        entries.push(("no orbit found", ink, Mark::Tick));
    }
    entries.extend_from_slice(extra);
    legend_above(sheet, &entries)
}

/// Values that differ by more than this factor need a logarithmic axis.
pub(super) const LOGARITHMIC: f64 = 50.0;
/// The same for multipliers, of which most are near 1.
const LOGARITHMIC_MULTIPLIERS: f64 = 8.0;

/// A panel of a quantity over the frequency, its axis linear or logarithmic.
fn over_frequency(
    area: &Area,
    family: &StoredFamily,
    (x_label, y_label): (&str, &str),
    look: Look,
    value: fn(&OrbitRecord) -> f64,
) -> Drawn {
    // the multipliers have a limit
    let include = (look == Look::Plain).then_some(1.0);
    let orbits = || family.points.iter().filter_map(|p| p.orbit.as_ref());
    let values: Vec<f64> = orbits().map(value).filter(|v| v.is_finite()).chain(include).collect();
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let factor = if look == Look::Plain { LOGARITHMIC_MULTIPLIERS } else { LOGARITHMIC };
    let logarithmic = least > 0.0 && most > factor * least;
    let x = range(family.points.iter().map(|p| p.omega));
    let scaled = move |v: f64| if logarithmic { v.log10() } else { v };
    let of_orbit = move |o: &OrbitRecord| {
        let v = value(o);
        v.is_finite().then(|| scaled(v))
    };
    let mut y = range(values.iter().map(|&v| scaled(v)));
    if let Some(level) = include.filter(|_| !logarithmic) {
        y = y.start.min(0.9 * level)..y.end.max(1.1 * level);
    }
    let limit = |chart: &mut Chart| match include {
        Some(level) => {
            let ends = vec![(x.start, scaled(level)), (x.end, scaled(level))];
            draw_dashes(chart, ends, line(INK, 1.0))
        }
        None => Ok(()),
    };
    let mut chart = match logarithmic {
        true => semilog(area, x.clone(), y.clone(), x_label, y_label)?,
        false => panel(area, x.clone(), y.clone(), x_label, y_label)?,
    };
    limit(&mut chart)?;
    draw_family(&mut chart, family, look, &of_orbit, y.start)
}

fn has_orbits(family: &StoredFamily) -> Drawn {
    match family.points.iter().any(|p| p.orbit.is_some()) {
        true => Ok(()),
        false => Err(FigureError::Empty("the family holds no orbit")),
    }
}

/// Energy and largest contact displacement over the frequency.
fn backbone(family: &StoredFamily) -> Result<String, FigureError> {
    has_orbits(family)?;
    let what = if family.outline().way == Way::Response { "forced response" } else { "backbone" };
    figure::svg((980, 800), |root| {
        let sheet = family_head(root, family, what, Look::Full, &[])?;
        let (_, height) = sheet.dim_in_pixel();
        // the lower panel has the name of the axis
        let (upper, lower) = sheet.split_vertically(height as i32 / 2 - px(10.0));
        over_frequency(&upper, family, ("", "largest energy H"), Look::Full, |o| o.energy)?;
        let labels = ("frequency ω", "largest contact displacement");
        over_frequency(&lower, family, labels, Look::Full, |o| o.amplitude)
    })
}

fn modulus([re, im]: [f64; 2]) -> f64 {
    re.hypot(im)
}

/// The largest modulus apart from the multipliers that belong to the family; NaN: not computed.
fn largest_multiplier(o: &OrbitRecord) -> f64 {
    let moduli = o.multipliers.iter().skip(o.trivial).map(|&m| modulus(m));
    moduli.fold(f64::NAN, f64::max)
}

fn multipliers(source: Source) -> Result<String, FigureError> {
    match source {
        Source::Orbit(stored, orbit, _) => orbit_multipliers(stored, orbit),
        Source::Family(family) | Source::Check(family, _) => family_multipliers(family),
    }
}

/// The largest multiplier over the frequency.
fn family_multipliers(family: &StoredFamily) -> Result<String, FigureError> {
    has_orbits(family)?;
    if !family
        .points
        .iter()
        .filter_map(|p| p.orbit.as_ref())
        .any(|o| largest_multiplier(o).is_finite())
    {
        return Err(FigureError::Empty("no multipliers were computed"));
    }
    figure::svg((980, 520), |root| {
        let extra = [("limit of stability", INK, Mark::Dashes)];
        let sheet = family_head(root, family, "largest Floquet multiplier", Look::Plain, &extra)?;
        let labels = ("frequency ω", "largest modulus |μ|");
        over_frequency(&sheet, family, labels, Look::Plain, largest_multiplier)
    })
}

/// Multipliers further out than this are outside the unit circle.
const OUTSIDE: f64 = 1e-6;
/// Beyond this modulus the neighbourhood of the circle has a panel of its own.
const FAR: f64 = 3.0;

/// Floquet multipliers in the complex plane.
fn orbit_multipliers(stored: &Stored, orbit: &OrbitRecord) -> Result<String, FigureError> {
    if orbit.multipliers.is_empty() {
        return Err(FigureError::Empty("no multipliers were computed"));
    }
    let (trivial, others) = orbit.multipliers.split_at(orbit.trivial.min(orbit.multipliers.len()));
    let (outside, inside): (Vec<_>, Vec<_>) =
        others.iter().copied().partition(|&m| modulus(m) > 1.0 + OUTSIDE);
    let farthest = orbit.multipliers.iter().map(|&m| modulus(m)).fold(1.0, f64::max);
    let names = [
        format!("on or within the unit circle: {}", inside.len()),
        format!("outside: {}", outside.len()),
        format!("of the family: {}", trivial.len()),
    ];
    let groups = [
        (inside.as_slice(), LINES[0], Mark::Dot),
        (outside.as_slice(), LINES[1], Mark::Dot),
        (trivial, INK, Mark::Cross),
    ];
    let draw =
        |area: &Area, x: std::ops::Range<f64>, y: std::ops::Range<f64>, labels: (&str, &str)| {
            let mut chart = equal_panel(area, x, y, labels.0, labels.1)?;
            let (x, y) = (chart.x_range(), chart.y_range());
            let axes = [[(x.start, 0.0), (x.end, 0.0)], [(0.0, y.start), (0.0, y.end)]];
            for ends in axes {
                let visible = x.contains(&ends[0].0) && y.contains(&ends[0].1);
                if visible {
                    draw_line(&mut chart, ends.to_vec(), line(RGBColor(170, 170, 176), 1.0))?;
                }
            }
            let turn = |k: i32| (f64::from(k) / 360.0 * std::f64::consts::TAU).sin_cos();
            let circle = (0..=360).map(|k| (turn(k).1, turn(k).0)).collect();
            draw_line(&mut chart, circle, line(INK, 1.0))?;
            for (group, colour, mark) in groups {
                let shown = group.iter().map(|m| (m[0], m[1]));
                let shown = shown.filter(|(re, im)| x.contains(re) && y.contains(im));
                symbols(&chart, shown, mark, colour)?;
            }
            Ok::<_, FigureError>(())
        };
    let bounds = |c: usize| range(orbit.multipliers.iter().map(|m| m[c]).chain([-1.1, 1.1]));
    let far = farthest > FAR;
    let length = |r: std::ops::Range<f64>| r.end - r.start;
    let tall = (660.0 * length(bounds(1)) / length(bounds(0))).clamp(330.0, 760.0) as u32;
    figure::svg(if far { (980, 560) } else { (770, tall + 104) }, |root| {
        let stable = match orbit.stable {
            Some(true) => ", stable",
            Some(false) => ", unstable",
            None => "",
        };
        title(root, &stored.title, &format!("Floquet multipliers{stable}"))?;
        let (_, sheet) = root.split_vertically(px(32.0));
        let (strip, sheet) = sheet.split_vertically(px(20.0));
        let named = names.iter().zip(&groups).filter(|(_, (group, ..))| !group.is_empty());
        let entries: Vec<Entry> =
            named.map(|(name, (_, colour, mark))| (name.as_str(), *colour, *mark)).collect();
        legend(&strip, &entries)?;
        if far {
            let (left, right) = sheet.split_horizontally(px(490.0));
            draw(&left, bounds(0), bounds(1), ("Re μ (all)", "Im μ"))?;
            draw(&right, -1.3..1.3, -1.3..1.3, ("Re μ (near the unit circle)", "Im μ"))
        } else {
            draw(&sheet, bounds(0), bounds(1), ("Re μ", "Im μ"))
        }
    })
}

// Orbits.

/// Contact displacement along the outward normal and its velocity, a curve a node; thin: jumps of the velocity at its switches.
fn portrait(stored: &Stored, rates: &[f64]) -> Result<String, FigureError> {
    let (n_c, rows) = (stored.gap.len(), stored.t.len());
    if n_c == 0 || rows < 2 {
        return Err(FigureError::Empty("a portrait needs a contact node and two states"));
    }
    let axis = if stored.contact_normal.ends_with('y') { 0 } else { 1 };
    let position: Vec<f64> =
        stored.contact_nodes.iter().map(|&n| stored.nodes[(n, axis)]).collect();
    let shown: Vec<usize> =
        if n_c <= 12 { (0..n_c).collect() } else { (0..12).map(|k| k * (n_c - 1) / 11).collect() };
    let (low, high) = (position[0], position[n_c - 1]);
    let colour = |i: usize| match n_c {
        1 => LINES[0],
        _ => viridis(0.92 * (position[i] - low) / (high - low)),
    };
    let sign = if stored.contact_normal.starts_with('-') { -1.0 } else { 1.0 };
    let first = stored.v.ncols() - n_c;
    let at = |row: usize, i: usize| {
        (stored.contact_displacement(row, i), sign * stored.v[(row, first + i)])
    };
    let knot = |row: usize, (x, v): (f64, f64)| Knot { t: stored.t[row], x, v };
    // the velocity of a free contact displacement jumps at the switches of its neighbours too
    let jumps: Vec<f64> = stored.switch_t.to_vec();
    let smooth = |knots: Vec<Knot>| -> Vec<(f64, f64)> {
        let last = knots.len() - 1;
        let jump = |k: usize| k < last && jumps.contains(&knots[k].t);
        curve::through(&knots, jump).iter().map(|k| (k.x, k.v)).collect()
    };
    // a switch of a node: the stored state is that after it; a node that closes came with the rate of its gap
    let row_of = |t: f64| stored.t.partition_point(|&s| s < t).min(rows - 1);
    let switches = |i: usize| {
        let of_node = move |k: &usize| stored.switch_node[*k] == stored.contact_nodes[i];
        let before = move |k: usize| {
            let row = row_of(stored.switch_t[k]);
            let closes = stored.switch_kind[k] == "close";
            let (x, last) = (at(row, i).0, at(row.saturating_sub(1), i));
            let rate = rates.get(k).copied();
            (row, if closes { (x, rate.map_or(last.1, |r| -r)) } else { (x, 0.0) }, closes)
        };
        (0..stored.switch_t.len()).filter(of_node).map(before)
    };
    let all = || shown.iter().flat_map(|&i| (0..rows).map(move |r| at(r, i)));
    let x = range(all().map(|p| p.0).chain(stored.gap.iter().copied()));
    let arrivals = shown.iter().flat_map(|&i| switches(i).map(|(_, before, _)| before.1));
    let y = range(all().map(|p| p.1).chain(arrivals));
    figure::svg((980, 640), |root| {
        title(root, &stored.title, "phase portrait of the contact nodes")?;
        let (_, sheet) = root.split_vertically(px(30.0));
        let (main, bar) = match n_c {
            1 => (sheet, None),
            _ => {
                let (main, bar) = sheet.split_horizontally(px(895.0));
                (main, Some(bar))
            }
        };
        let (strip, main) = main.split_vertically(px(20.0));
        let wall = stored.gap[0];
        let labels = ("contact displacement", "its velocity");
        let mut entries: Vec<Entry> = vec![];
        let even = stored.gap.iter().all(|g| *g == wall);
        let mut chart = panel(&main, x.clone(), y.clone(), labels.0, labels.1)?;
        if even {
            draw_dashes(&mut chart, vec![(wall, y.start), (wall, y.end)], line(INK, 1.0))?;
            entries.push(("obstacle", INK, Mark::Dashes));
        }
        for &i in &shown {
            let mut from = 0;
            for (row, before, _) in switches(i).filter(|s| s.0 > 0) {
                let knots = (from..row).map(|r| knot(r, at(r, i))).chain([knot(row, before)]);
                draw_line(&mut chart, smooth(knots.collect()), line(colour(i), 1.8))?;
                draw_line(&mut chart, vec![before, at(row, i)], line(colour(i), 0.8))?;
                from = row;
            }
            let knots = (from..rows).map(|r| knot(r, at(r, i))).collect();
            draw_line(&mut chart, smooth(knots), line(colour(i), 1.8))?;
        }
        for (kind, mark, name) in [(true, Mark::Dot, "closes"), (false, Mark::Ring, "opens")] {
            // where the node leaves or meets the free motion
            let points = shown.iter().flat_map(|&i| {
                let chosen = switches(i).filter(move |s| s.2 == kind);
                chosen.map(move |(row, before, closes)| if closes { before } else { at(row, i) })
            });
            let points: Vec<_> = points.collect();
            if !points.is_empty() {
                symbols(&chart, points, mark, INK)?;
                entries.push((name, INK, mark));
            }
        }
        legend(&strip, &entries)?;
        match bar {
            Some(bar) => {
                let label = format!("node {}", ["x", "y"][axis]);
                colour_bar(&bar, low..high, &label, |s| viridis(0.92 * s))
            }
            None => Ok(()),
        }
    })
}

// The table.

/// A row a point of a family; a point without an orbit has empty cells.
pub fn csv(family: &StoredFamily) -> String {
    let mut out = String::from(
        "omega,energy,amplitude,residual,contact_time,grazing_distance,switches,stable,branch,special\n",
    );
    for p in &family.points {
        out.push_str(&number(p.omega));
        match &p.orbit {
            Some(o) => {
                for x in [o.energy, o.amplitude, o.residual, o.contact_time, o.grazing] {
                    let _ = write!(out, ",{}", number(x));
                }
                let stable = o.stable.map_or(-1, i32::from);
                let _ = write!(out, ",{},{stable}", o.switches.len());
            }
            None => out.push_str(",,,,,,,"),
        }
        let _ = writeln!(out, ",{},{}", p.branch, quoted(&p.special.to_string()));
    }
    out
}

/// A cell of a CSV file.
fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}
