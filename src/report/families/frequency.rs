//! A family over the frequency: energy and amplitude of a backbone, the largest multiplier.

use plotters::prelude::RGBColor;

use super::LOGARITHMIC;
use super::branches::{Value, branches, colour, is_sequential, of_branch, pieces};
use super::head::family_head;
use super::multipliers::largest_multiplier;
use super::special::{Special, special};
use crate::records::{OrbitRecord, Way};
use crate::report::figure::{
    self, Area, Chart, Drawn, FigureError, INK, Mark, draw_dashes, draw_line, flat, line, panel,
    px, range, semilog, symbol, symbols,
};
use crate::store::StoredFamily;

/// With multipliers, of which most are near 1, a smaller factor asks for a logarithmic axis.
const LOGARITHMIC_MULTIPLIERS: f64 = 8.0;

/// How a family is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// Stability by lines and dots, all special points.
    Full,
    /// The quantity itself tells the stability; borders are left out.
    Plain,
}

impl Look {
    pub(super) fn marks(self) -> &'static [Special] {
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
        draw_pieces(chart, family, branch, look, value)?;
    }
    for branch in branches(family) {
        let gaps = of_branch(family, branch).filter(|p| p.orbit.is_none());
        let gaps: Vec<(f64, f64)> = gaps.map(|p| (p.omega, bottom)).collect();
        gap_ticks(chart, &gaps, colour(family, branch))?;
        let alone = of_branch(family, branch).filter(|p| p.orbit.is_some()).count() == 1;
        if is_sequential(family) || alone {
            draw_dots(chart, family, branch, look, value)?;
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

/// The lines of a branch.
fn draw_pieces(
    chart: &mut Chart,
    family: &StoredFamily,
    branch: usize,
    look: Look,
    value: Value,
) -> Drawn {
    let colour = colour(family, branch);
    for piece in pieces(family, branch, value) {
        match piece.stable {
            _ if look == Look::Plain => draw_line(chart, piece.points, line(colour, 1.4))?,
            Some(true) => draw_line(chart, piece.points, line(colour, 2.2))?,
            Some(false) => draw_dashes(chart, piece.points, line(colour, 1.4))?,
            None => draw_line(chart, piece.points, line(colour, 1.0))?,
        }
    }
    Ok(())
}

/// The orbits of a branch, one by one.
fn draw_dots(
    chart: &Chart,
    family: &StoredFamily,
    branch: usize,
    look: Look,
    value: Value,
) -> Drawn {
    let colour = colour(family, branch);
    for p in of_branch(family, branch) {
        let Some((orbit, y)) = p.orbit.as_ref().and_then(|o| Some((o, value(o)?))) else {
            continue;
        };
        let open = look == Look::Full && orbit.stable == Some(false);
        let mark = if open { Mark::Ring } else { Mark::Dot };
        symbols(chart, [(p.omega, y)], mark, colour)?;
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
pub(super) fn backbone(family: &StoredFamily) -> Result<String, FigureError> {
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

/// The largest multiplier over the frequency.
pub(super) fn family_multipliers(family: &StoredFamily) -> Result<String, FigureError> {
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
