//! Pictures of a sweep: the peaks with jumps and hysteresis, how far each period goes back (bifurcation diagram), the spectrum (waterfall).

use super::axis::Axis as Shown;
use super::branches::{branches, of_branch};
use crate::records::{AttractorRecord, Branch, Direction, PointRecord, Way};
use crate::report::diagram::lead;
use crate::report::figure::{
    Axis, Cell, Chart, Entry, FigureError, INK, LINES, Legend, Mark, Point, SHADE, Sheet, entry,
    range, viridis,
};
use crate::store::StoredFamily;

/// Heights of both directions that differ by more than this, of the larger one, are two motions at one frequency.
const HYSTERESIS: f64 = 0.05;
/// Heights that differ by less, of the larger one, are shown without an arrow between them.
const ARROW: f64 = 0.02;
/// Magnitudes of a spectrum that are shown, in decades below the largest one.
const DECADES: f64 = 4.0;

/// A point of a sweep, with what the body does there.
pub(super) type Swept<'f> = (&'f PointRecord, &'f AttractorRecord);

fn sweep(family: &StoredFamily, branch: usize) -> Vec<Swept<'_>> {
    of_branch(family, branch).filter_map(|p| Some((p, p.attractor.as_ref()?))).collect()
}

fn is_a_sweep(family: &StoredFamily) -> Result<(), FigureError> {
    match family.outline().way == Way::Sweep && !family.points.is_empty() {
        true => Ok(()),
        false => Err(FigureError::Empty("no sweep (`signorini response --sweep`)")),
    }
}

fn direction(family: &StoredFamily, branch: usize) -> Option<Direction> {
    family.branches.get(branch).and_then(Branch::direction)
}

fn colour(family: &StoredFamily, branch: usize) -> plotters::prelude::RGBColor {
    // the direction has the colour; of several damping ratios all branches have their own
    match family.branches.len() {
        0..=2 => LINES[usize::from(direction(family, branch) == Some(Direction::Down))],
        _ => LINES[branch % LINES.len()],
    }
}

fn is_orbit((p, _): &Swept) -> bool {
    p.orbit.is_some()
}

/// A height of a motion.
pub(super) type Height<'h> = &'h dyn Fn(&Swept) -> f64;

/// The orbits of a branch in runs without jumps, and the jumps.
fn runs(all: &[Swept], height: Height) -> (Vec<Vec<Point>>, Vec<[Point; 2]>) {
    let (mut runs, mut jumps): (Vec<Vec<Point>>, Vec<[Point; 2]>) = (vec![], vec![]);
    let mut last: Option<(Point, bool)> = None;
    for swept in all {
        let here = (swept.0.omega, height(swept));
        if !here.1.is_finite() {
            last = None;
            continue;
        }
        let is_new = swept.0.special.is_another_motion();
        let orbit = is_orbit(swept);
        match (last, runs.last_mut()) {
            (Some((_, true)), Some(run)) if orbit && !is_new => run.push(here),
            (before, _) => {
                let far = |a: f64, b: f64| (a - b).abs() > ARROW * a.abs().max(b.abs());
                let before = before.filter(|(before, _)| is_new && far(before.1, here.1));
                jumps.extend(before.map(|(before, _)| [before, here]));
                // no line goes through what is no orbit
                runs.extend(orbit.then(|| vec![here]));
            }
        }
        last = Some((here, orbit));
    }
    (runs, jumps)
}

/// The height of a branch at a frequency, between its points; its points stand in the order of the frequency.
fn at(points: &[Point], omega: f64) -> Option<f64> {
    let k = points.partition_point(|p| p.0 < omega);
    let (a, b) = (points.get(k.checked_sub(1)?)?, points.get(k)?);
    let s = (omega - a.0) / (b.0 - a.0).max(f64::MIN_POSITIVE);
    Some(a.1 + s * (b.1 - a.1))
}

/// Outlines of the areas between two branches where both directions show different motions.
fn hysteresis(a: &[Swept], b: &[Swept], height: Height) -> Vec<Vec<Point>> {
    let points = |all: &[Swept]| {
        let orbits = all.iter().filter(|s| is_orbit(s));
        let mut points: Vec<Point> = orbits.map(|s| (s.0.omega, height(s))).collect();
        points.retain(|p| p.1.is_finite());
        points.sort_by(|p, q| p.0.total_cmp(&q.0));
        points
    };
    let (a, b) = (points(a), points(b));
    let mut places: Vec<f64> = a.iter().chain(&b).map(|p| p.0).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let (mut areas, mut upper, mut lower) = (vec![], vec![], vec![]);
    let mut close = |upper: &mut Vec<Point>, lower: &mut Vec<Point>| {
        if upper.len() > 1 {
            areas.push(upper.drain(..).chain(lower.drain(..).rev()).collect());
        }
        upper.clear();
        lower.clear();
    };
    for omega in places {
        match (at(&a, omega), at(&b, omega)) {
            (Some(x), Some(y)) if (x - y).abs() > HYSTERESIS * x.abs().max(y.abs()) => {
                upper.push((omega, x));
                lower.push((omega, y));
            }
            _ => close(&mut upper, &mut lower),
        }
    }
    close(&mut upper, &mut lower);
    areas
}

/// Pairs of branches of one body, up and down.
fn pairs(family: &StoredFamily) -> Vec<(usize, usize)> {
    let ratio = |b: usize| family.branches.get(b).and_then(Branch::percent);
    let is_pair = |a: usize, b: usize| {
        ratio(a) == ratio(b)
            && direction(family, a) == Some(Direction::Up)
            && direction(family, b) == Some(Direction::Down)
    };
    let all = branches(family);
    all.windows(2).map(|w| (w[0], w[1])).filter(|&(a, b)| is_pair(a, b)).collect()
}

/// Where both directions of a body show different motions.
fn two_motions(family: &StoredFamily, height: Height) -> Vec<Vec<Point>> {
    let of = |(a, b)| hysteresis(&sweep(family, a), &sweep(family, b), height);
    pairs(family).into_iter().flat_map(of).collect()
}

/// A height over the frequency, both directions.
pub(super) fn chart(family: &StoredFamily, (name, height): (&str, Height), x_label: &str) -> Chart {
    let all: Vec<Vec<Swept>> = branches(family).into_iter().map(|b| sweep(family, b)).collect();
    let x = range(family.points.iter().map(|p| p.omega));
    let y = range(all.iter().flatten().map(height).chain([0.0]));
    let mut chart = Chart::new(Axis::linear(x_label, x), Axis::linear(name, y));
    for area in two_motions(family, height) {
        chart.area(area, SHADE.into());
    }
    for (swept, branch) in all.iter().zip(branches(family)) {
        let colour = colour(family, branch);
        let (runs, jumps) = runs(swept, height);
        for run in runs {
            chart.line(run, colour, 1.8);
        }
        for [from, to] in jumps {
            chart.dashes(vec![from, to], colour, 1.2);
            let mark = if to.1 > from.1 { Mark::Triangle } else { Mark::Falling };
            chart.marks([(to.0, 0.5 * (from.1 + to.1))], mark, colour);
        }
        let other = swept.iter().filter(|s| !is_orbit(s));
        chart.marks(other.map(|s| (s.0.omega, height(s))), Mark::Speck, colour);
    }
    chart
}

/// Names of the branches, and what their marks mean.
fn head(
    family: &StoredFamily,
    what: &str,
    mark: impl Fn(usize) -> Mark,
    more: Vec<Entry>,
) -> Sheet<'static> {
    let named = branches(family).into_iter();
    let name = |b: usize| family.branches.get(b).map_or(String::new(), Branch::to_string);
    let branches = named.map(|b| entry(name(b), colour(family, b), mark(b))).collect();
    let sheet = Sheet::new(&family.title, what).legend(Legend::Rows(branches));
    sheet.legend(Legend::Rows(more))
}

/// The head of a picture of heights over the frequency; the first tells where there are jumps.
pub(super) fn sheet(family: &StoredFamily, what: &str, heights: &[Height]) -> Sheet<'static> {
    let mut more = vec![];
    let all: Vec<Vec<Swept>> = branches(family).into_iter().map(|b| sweep(family, b)).collect();
    let jumps = || all.iter().flat_map(|s| runs(s, heights[0]).1);
    if jumps().any(|[a, b]| b.1 > a.1) {
        more.push(entry("jump up", INK, Mark::Triangle));
    }
    if jumps().any(|[a, b]| b.1 < a.1) {
        more.push(entry("jump down", INK, Mark::Falling));
    }
    if heights.iter().any(|height| !two_motions(family, height).is_empty()) {
        more.push(entry("hysteresis", SHADE, Mark::Patch));
    }
    if all.iter().flatten().any(|s| !is_orbit(s)) {
        more.push(entry("not periodic, or not settled", INK, Mark::Speck));
    }
    head(family, what, |_| Mark::Line, more)
}

/// The largest contact displacement and the largest contact force over the frequency, both directions; or one quantity.
pub(super) fn peaks(
    family: &StoredFamily,
    axis: Option<Shown>,
) -> Result<Sheet<'static>, FigureError> {
    is_a_sweep(family)?;
    let amplitude: (&str, Height) = ("largest contact displacement", &|s| s.0.amplitude());
    let energy: (&str, Height) = ("largest energy", &|s| s.0.energy());
    let force: (&str, Height) = ("largest contact force", &|s| s.1.force);
    let shown = match axis {
        None => vec![amplitude, force],
        Some(Shown::Amplitude) => vec![amplitude],
        Some(Shown::Energy) => vec![energy],
    };
    let heights: Vec<Height> = shown.iter().map(|s| s.1).collect();
    let mut sheet = sheet(family, "sweep", &heights);
    for (k, quantity) in shown.iter().enumerate() {
        let is_last = k + 1 == shown.len();
        let label = if is_last { "frequency ω" } else { "" };
        let height = match (shown.len(), k) {
            (1, _) => 490.0,
            (_, 0) => 400.0,
            _ => 270.0,
        };
        sheet = sheet.row(height, vec![Cell::from(chart(family, *quantity, label))]);
    }
    Ok(sheet)
}

/// The bifurcation diagram: how far the contact point that moves most goes back in each period of the loads. (Where it stands at one instant of the period says
/// nothing while it lies on the obstacle then.)
pub(super) fn bifurcation(family: &StoredFamily) -> Result<Sheet<'static>, FigureError> {
    is_a_sweep(family)?;
    let all: Vec<Vec<Swept>> = branches(family).into_iter().map(|b| sweep(family, b)).collect();
    let none = FigureError::Empty("nothing of this sweep was seen");
    let i = lead(all.iter().flatten().map(|s| s.1)).ok_or(none)?;
    let dots = |swept: &[Swept]| -> Vec<Point> {
        let of = |(p, seen): &Swept| {
            let states = seen.least.chunks_exact(seen.peak.len().max(1));
            states.map(|u| (p.omega, u[i])).collect::<Vec<_>>()
        };
        swept.iter().flat_map(of).collect()
    };
    let x = range(family.points.iter().map(|p| p.omega));
    let y = range(all.iter().flat_map(|s| dots(s)).map(|p| p.1));
    let label = "least contact displacement in each period";
    let mut chart = Chart::new(Axis::linear("frequency ω", x), Axis::linear(label, y));
    let mark = |branch: usize| match direction(family, branch) {
        Some(Direction::Down) if all.len() > 1 => Mark::Speck,
        _ => Mark::Dot,
    };
    for (swept, branch) in all.iter().zip(branches(family)) {
        chart.marks(dots(swept), mark(branch), colour(family, branch));
    }
    Ok(head(family, "bifurcation diagram", mark, vec![]).row(490.0, vec![chart.into()]))
}

/// The waterfall: magnitudes of the harmonics of the contact point that moves most, over the frequency of the loads, of the first sweep.
pub(super) fn waterfall(family: &StoredFamily) -> Result<Sheet<'static>, FigureError> {
    is_a_sweep(family)?;
    let first = branches(family)[0];
    let mut all = sweep(family, first);
    all.sort_by(|a, b| a.0.omega.total_cmp(&b.0.omega));
    let magnitudes = || all.iter().flat_map(|s| s.1.spectrum.iter().skip(1));
    let largest = magnitudes().copied().filter(|m| m.is_finite()).fold(0.0, f64::max);
    let lines = all.first().map_or(0, |s| s.1.spectrum.len());
    if largest <= 0.0 || lines < 2 {
        return Err(FigureError::Empty("nothing of this sweep moves"));
    }
    // lines at multiples of a twelfth
    let height = 1.0 / 12.0;
    let edge = |k: usize| match (k.checked_sub(1).and_then(|j| all.get(j)), all.get(k)) {
        (Some(a), Some(b)) => 0.5 * (a.0.omega + b.0.omega),
        (Some(a), None) => a.0.omega,
        (None, b) => b.map_or(0.0, |b| b.0.omega),
    };
    let top = (lines - 1) as f64 * height;
    let x = edge(0)..edge(all.len());
    // one ground, and on it what stands out
    let mut cells = vec![([(x.start, 0.0), (x.end, top)], viridis(0.0))];
    for (k, (_, seen)) in all.iter().enumerate() {
        for (j, m) in seen.spectrum.iter().enumerate().skip(1) {
            let share = 1.0 + (m / largest).max(1e-99).log10() / DECADES;
            let order = j as f64 * height;
            let corners = [(edge(k), order - 0.5 * height), (edge(k + 1), order + 0.5 * height)];
            if share > 0.0 {
                cells.push((corners, viridis(share)));
            }
        }
    }
    let label = "order (frequency over ω)";
    let axes = (Axis::linear("frequency ω", x), Axis::linear(label, 0.5 * height..top));
    let mut chart = Chart::new(axes.0, axes.1);
    chart.cover(cells);
    let name = family.branches.get(first).map_or(String::new(), Branch::to_string);
    let shades = [1.0, 0.75, 0.5, 0.25, 0.0].into_iter().map(|s| {
        let decade = (DECADES * (1.0 - s)) as i32;
        let power = ["1", "10⁻¹", "10⁻²", "10⁻³", "≤ 10⁻⁴"][decade.clamp(0, 4) as usize];
        entry(power, viridis(s), Mark::Patch)
    });
    let legend: Vec<Entry> = [entry("magnitude over the largest:", INK, Mark::Nothing)]
        .into_iter()
        .chain(shades)
        .collect();
    let what = format!("spectrum of the contact point that moves most ({name})");
    Ok(Sheet::new(&family.title, &what).legend(Legend::Rows(legend)).row(490.0, vec![chart.into()]))
}
