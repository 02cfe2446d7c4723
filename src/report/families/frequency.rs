//! A family over the frequency: energy and amplitude of a backbone, the largest multiplier.

use std::ops::Range;

use super::LOGARITHMIC;
use super::axis::Axis as Shown;
use super::branches::{Value, branches, colour, is_sequential, is_viscous, of_branch, pieces};
use super::damped::damped;
use super::errors::{draw_errors, error_entries, reached};
use super::head::{Head, family_head, ink};
use super::look::Look;
use super::multipliers::largest_multiplier;
use super::special::Special;
use super::words::viscosity;
use crate::records::{OrbitRecord, PointRecord, Way};
use crate::report::figure::{Axis, Cell, Chart, FigureError, INK, Mark, Sheet, entry, range};
use crate::store::StoredFamily;

/// With multipliers, of which most are near 1, a smaller factor asks for a logarithmic axis.
const LOGARITHMIC_MULTIPLIERS: f64 = 8.0;

/// A family on a chart: lines, dots, gaps and special points.
fn draw_family(chart: &mut Chart, family: &StoredFamily, look: Look, value: Value) {
    for branch in branches(family) {
        let colour = colour(family, branch);
        for piece in pieces(family, branch, value) {
            match piece.stable {
                _ if look != Look::Full => chart.line(piece.points, colour, 1.4),
                Some(true) => chart.line(piece.points, colour, 2.2),
                Some(false) => chart.dashes(piece.points, colour, 1.4),
                None => chart.line(piece.points, colour, 1.0),
            }
        }
    }
    for branch in branches(family) {
        let colour = colour(family, branch);
        let gaps = of_branch(family, branch).filter(|p| p.orbit.is_none());
        chart.feet(gaps.map(|p| p.omega).collect(), colour);
        let alone = of_branch(family, branch).filter(|p| p.orbit.is_some()).count() == 1;
        if !(is_sequential(family) || alone) {
            continue;
        }
        let place = |p: &PointRecord| {
            let orbit = p.orbit.as_ref()?;
            Some((p.omega, value(orbit)?, look == Look::Full && orbit.stable == Some(false)))
        };
        for (omega, y, open) in of_branch(family, branch).filter_map(place) {
            chart.marks([(omega, y)], if open { Mark::Ring } else { Mark::Dot }, colour);
        }
    }
    for kind in Special::ALL {
        for p in family.points.iter().filter(|p| look.marked(p) == Some(kind)) {
            let colour = if kind == Special::Border { colour(family, p.branch) } else { INK };
            let at = p.orbit.as_ref().and_then(value).map(|y| (p.omega, y));
            chart.marks(at, kind.mark(), colour);
        }
    }
}

/// A quantity over the frequency.
pub(super) struct Quantity {
    pub label: String,
    pub look: Look,
    pub value: Box<dyn Fn(&OrbitRecord) -> f64>,
    /// What is known of its errors.
    pub bars: Bars,
}

/// Bars at the values of a quantity.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Bars {
    None,
    /// Of the error statement.
    Stated,
    /// Of multipliers along a series: their change with half the harmonics.
    AlongSeries,
}

/// The points of a family with multipliers along a series, and the change of these: branch, orbit, change.
fn along_series(family: &StoredFamily) -> impl Iterator<Item = (usize, &OrbitRecord, f64)> {
    family.points.iter().filter_map(|p| {
        let orbit = p.orbit.as_ref()?;
        Some((p.branch, orbit, orbit.multipliers_within?))
    })
}

impl Quantity {
    fn of_axis(family: &StoredFamily, axis: Shown) -> Self {
        Quantity {
            label: axis.label(&[family]).to_owned(),
            look: Look::of(family),
            value: match axis {
                Shown::Energy => Box::new(|o| o.energy),
                Shown::Amplitude => Box::new(|o| o.amplitude),
            },
            bars: if axis == Shown::Energy { Bars::Stated } else { Bars::None },
        }
    }

    /// What is on its axis besides the orbits: the multipliers have a limit.
    fn level(&self) -> Option<f64> {
        (self.look == Look::Plain).then_some(1.0)
    }

    /// Its range, or that of its logarithm; whether it is the latter.
    fn scale(&self, family: &StoredFamily) -> (Range<f64>, bool) {
        let orbits = family.points.iter().filter_map(|p| p.orbit.as_ref());
        let finite = orbits.map(&self.value).filter(|v| v.is_finite());
        let mut values: Vec<f64> = finite.chain(self.level()).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let factor = if self.look == Look::Plain { LOGARITHMIC_MULTIPLIERS } else { LOGARITHMIC };
        let logarithmic = least > 0.0 && most > factor * least;
        if self.bars == Bars::Stated {
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

    /// Its chart, the axis linear or logarithmic.
    pub(super) fn chart(&self, family: &StoredFamily, x_label: &str) -> Chart {
        let x = range(family.points.iter().map(|p| p.omega));
        let (y, logarithmic) = self.scale(family);
        let lowest = if logarithmic { y.start } else { 0.0 };
        let scaled = move |v: f64| if logarithmic { v.log10() } else { v };
        let of_orbit = |o: &OrbitRecord| {
            let v = (self.value)(o);
            v.is_finite().then(|| scaled(v))
        };
        let axes = (Axis::linear(x_label, x.clone()), Axis::scaled(&self.label, y, logarithmic));
        let mut chart = Chart::new(axes.0, axes.1);
        if self.bars == Bars::Stated {
            let colours = (&(|branch| colour(family, branch)) as &dyn Fn(usize) -> _, ink(family));
            draw_errors(&mut chart, family, colours, &scaled);
        }
        if let Some(level) = self.level() {
            chart.dashes(vec![(x.start, scaled(level)), (x.end, scaled(level))], INK, 1.0);
        }
        draw_family(&mut chart, family, self.look, &of_orbit);
        if self.bars == Bars::AlongSeries {
            for (branch, o, change) in along_series(family) {
                // a bar may go below the axis, where a logarithm has no end
                let end = |e: f64| (o.omega(), scaled(((self.value)(o) + e).max(0.0)).max(lowest));
                chart.line(vec![end(-change), end(change)], colour(family, branch), 0.8);
            }
        }
        chart
    }
}

/// An empty picture is none.
pub(super) fn has_orbits(family: &StoredFamily) -> Result<(), FigureError> {
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
pub(super) fn backbone(
    family: &StoredFamily,
    axis: Option<Shown>,
) -> Result<Sheet<'static>, FigureError> {
    if family.outline().way == Way::Sweep {
        return Err(FigureError::Empty("of a sweep there are sweep, bifurcation, waterfall"));
    }
    if family.outline().way == Way::Amplitudes {
        return damped(family);
    }
    has_orbits(family)?;
    let shown = axis.map_or(vec![Shown::Energy, Shown::Amplitude], |axis| vec![axis]);
    let below = match shown.contains(&Shown::Energy) {
        true => error_entries(&[(family, ink(family))]),
        false => vec![],
    };
    let head = Head { what: what(family), look: Look::of(family), extra: vec![], below };
    let mut sheet = family_head(family, head);
    for (k, axis) in shown.iter().enumerate() {
        // the lowest chart has the name of the axis
        let is_last = k + 1 == shown.len();
        let chart = Quantity::of_axis(family, *axis)
            .chart(family, if is_last { "frequency ω" } else { "" });
        let height =
            if shown.len() == 1 { 490.0 } else { 355.0 + 20.0 * f64::from(u8::from(is_last)) };
        sheet = sheet.row(height, vec![Cell::from(chart)]);
    }
    Ok(sheet)
}

/// The largest multiplier over the frequency.
pub(super) fn family_multipliers(family: &StoredFamily) -> Result<Sheet<'static>, FigureError> {
    has_orbits(family)?;
    let orbits = || family.points.iter().filter_map(|p| p.orbit.as_ref());
    if !orbits().any(|o| largest_multiplier(o).is_finite()) {
        return Err(FigureError::Empty("no multipliers were computed"));
    }
    let (what, limit) = match is_viscous(family) {
        true => ("multipliers of the self-excited system, the largest", "|μ| = 1"),
        false => ("largest Floquet multiplier", "limit of stability"),
    };
    let mut extra = vec![entry(limit, INK, Mark::Dashes)];
    if along_series(family).next().is_some() {
        extra.push(entry(
            "no orbit near: along the series, and its change with half the harmonics",
            INK,
            Mark::Thin,
        ));
    }
    let head = Head { what: what.to_owned(), look: Look::Plain, extra, below: vec![] };
    let quantity = Quantity {
        label: "largest modulus |μ|".to_owned(),
        look: Look::Plain,
        value: Box::new(largest_multiplier),
        bars: Bars::AlongSeries,
    };
    let chart = quantity.chart(family, "frequency ω");
    Ok(family_head(family, head).row(450.0, vec![chart.into()]))
}
