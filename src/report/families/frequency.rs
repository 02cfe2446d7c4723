//! A family over the frequency: energy and amplitude of a backbone, the largest multiplier.

use std::ops::Range;

use plotters::prelude::RGBColor;

use super::LOGARITHMIC;
use super::axis::Axis;
use super::branches::{Value, branches, colour, is_sequential, is_viscous, of_branch, pieces};
use super::errors::{draw_errors, error_entries, reached};
use super::head::{Head, family_head, ink};
use super::look::Look;
use super::multipliers::largest_multiplier;
use super::special::Special;
use super::words::viscosity;
use crate::records::{OrbitRecord, Way};
use crate::report::figure::{
    self, Area, Chart, Drawn, FigureError, INK, Mark, draw_dashes, draw_line, flat, line, panel,
    px, range, semilog, symbol, symbols,
};
use crate::store::StoredFamily;

/// With multipliers, of which most are near 1, a smaller factor asks for a logarithmic axis.
const LOGARITHMIC_MULTIPLIERS: f64 = 8.0;

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
    for kind in Special::ALL {
        for p in family.points.iter().filter(|p| look.marked(p) == Some(kind)) {
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
            _ if look != Look::Full => draw_line(chart, piece.points, line(colour, 1.4))?,
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

/// A quantity over the frequency.
struct Quantity {
    label: &'static str,
    look: Look,
    value: fn(&OrbitRecord) -> f64,
    /// The error statement speaks of it.
    errors: bool,
}

impl Quantity {
    fn of_axis(family: &StoredFamily, axis: Axis) -> Self {
        Quantity {
            label: axis.label(&[family]),
            look: Look::of(family),
            value: match axis {
                Axis::Energy => |o| o.energy,
                Axis::Amplitude => |o| o.amplitude,
            },
            errors: axis == Axis::Energy,
        }
    }

    /// What is on its axis besides the orbits: the multipliers have a limit.
    fn level(&self) -> Option<f64> {
        (self.look == Look::Plain).then_some(1.0)
    }

    /// Its range, or that of its logarithm; whether it is the latter.
    fn scale(&self, family: &StoredFamily) -> (Range<f64>, bool) {
        let orbits = family.points.iter().filter_map(|p| p.orbit.as_ref());
        let finite = orbits.map(self.value).filter(|v| v.is_finite());
        let mut values: Vec<f64> = finite.chain(self.level()).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let factor = if self.look == Look::Plain { LOGARITHMIC_MULTIPLIERS } else { LOGARITHMIC };
        let logarithmic = least > 0.0 && most > factor * least;
        if self.errors {
            values.extend(reached(family, least, logarithmic));
        }
        if logarithmic {
            return (range(values.iter().map(|v| v.log10())), true);
        }
        let y = range(values);
        match self.level() {
            Some(level) => (y.start.min(0.9 * level)..y.end.max(1.1 * level), false),
            None => (y, false),
        }
    }

    /// Its panel, the axis linear or logarithmic.
    fn draw(&self, area: &Area, family: &StoredFamily, x_label: &str) -> Drawn {
        let x = range(family.points.iter().map(|p| p.omega));
        let (y, logarithmic) = self.scale(family);
        let scaled = move |v: f64| if logarithmic { v.log10() } else { v };
        let of_orbit = |o: &OrbitRecord| {
            let v = (self.value)(o);
            v.is_finite().then(|| scaled(v))
        };
        let mut chart = match logarithmic {
            true => semilog(area, x.clone(), y.clone(), x_label, self.label)?,
            false => panel(area, x.clone(), y.clone(), x_label, self.label)?,
        };
        if self.errors {
            let colours = (&(|branch| colour(family, branch)) as &dyn Fn(usize) -> _, ink(family));
            draw_errors(&mut chart, family, colours, &scaled)?;
        }
        if let Some(level) = self.level() {
            let ends = vec![(x.start, scaled(level)), (x.end, scaled(level))];
            draw_dashes(&mut chart, ends, line(INK, 1.0))?;
        }
        draw_family(&mut chart, family, self.look, &of_orbit, y.start)
    }
}

fn has_orbits(family: &StoredFamily) -> Drawn {
    match family.points.iter().any(|p| p.orbit.is_some()) {
        true => Ok(()),
        false => Err(FigureError::Empty("the family holds no orbit")),
    }
}

/// What a family is, in the title.
fn what(family: &StoredFamily) -> String {
    let kind = if family.outline().way == Way::Response { "forced response" } else { "backbone" };
    match viscosity(family) {
        Some(beta) => format!("{kind} with viscosity, {beta}"),
        None => kind.to_owned(),
    }
}

/// Energy and largest contact displacement over the frequency, or one of them alone.
pub(super) fn backbone(family: &StoredFamily, axis: Option<Axis>) -> Result<String, FigureError> {
    has_orbits(family)?;
    let shown: &[Axis] = match &axis {
        Some(axis) => std::slice::from_ref(axis),
        None => &[Axis::Energy, Axis::Amplitude],
    };
    let errors = match shown.contains(&Axis::Energy) {
        true => error_entries(&[(family, ink(family))]),
        false => vec![],
    };
    let head = Head { what: what(family), look: Look::of(family), extra: &[], below: &errors };
    figure::svg((980, if shown.len() > 1 { 800 } else { 560 }), |root| {
        let sheet = family_head(root, family, &head)?;
        let (_, height) = sheet.dim_in_pixel();
        let [first, rest @ ..] = shown else { return Ok(()) };
        let first = Quantity::of_axis(family, *first);
        let [second] = rest else { return first.draw(&sheet, family, "frequency ω") };
        // the lower panel has the name of the axis
        let (upper, lower) = sheet.split_vertically(height as i32 / 2 - px(10.0));
        first.draw(&upper, family, "")?;
        Quantity::of_axis(family, *second).draw(&lower, family, "frequency ω")
    })
}

/// The largest multiplier over the frequency.
pub(super) fn family_multipliers(family: &StoredFamily) -> Result<String, FigureError> {
    has_orbits(family)?;
    let orbits = || family.points.iter().filter_map(|p| p.orbit.as_ref());
    if !orbits().any(|o| largest_multiplier(o).is_finite()) {
        return Err(FigureError::Empty("no multipliers were computed"));
    }
    let (what, limit) = match is_viscous(family) {
        true => ("multipliers of the self-excited system, the largest", "|μ| = 1"),
        false => ("largest Floquet multiplier", "limit of stability"),
    };
    let extra = [(limit, INK, Mark::Dashes)];
    let head = Head { what: what.to_owned(), look: Look::Plain, extra: &extra, below: &[] };
    let quantity = Quantity {
        label: "largest modulus |μ|",
        look: Look::Plain,
        value: largest_multiplier,
        errors: false,
    };
    figure::svg((980, 520), |root| {
        let sheet = family_head(root, family, &head)?;
        quantity.draw(&sheet, family, "frequency ω")
    })
}
