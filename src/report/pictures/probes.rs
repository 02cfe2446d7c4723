//! The pictures `probes`, `portraits` and `spectra`: what probes and forces do over time, against one another, and by frequency.

use super::Options;
use super::forces::name_of;
use super::time::{draw, over_time};
use crate::fem::Quantity;
use crate::report::figure::{
    Axis, Cell, Chart, Entry, FigureError, Mark, Point, SHADE, Sheet, entry, range,
};
use crate::report::spectrum::{Even, Spectrum};
use crate::store::{Stored, StoredProbe};

/// A curve with its name.
type Curve = (String, Vec<f64>);

/// Lines of a spectrum below this part of the largest are not drawn: decades.
const DECADES: f64 = 8.0;

/// What a component is called: of a quantity that has but one, the probe alone.
fn called(probe: &StoredProbe, component: usize) -> String {
    match probe.components.len() {
        1 => probe.name.clone(),
        _ => format!("{}, {}", probe.name, probe.components[component]),
    }
}

/// The curves of a quantity: its components that act and are known, of all probes.
fn curves(stored: &Stored, quantity: Quantity) -> Vec<Curve> {
    let of = stored.probes.iter().filter(|p| p.quantity == quantity);
    let of_probe = |p: &StoredProbe| {
        let curve = |c: usize| (called(p, c), p.values.column(c).to_vec());
        p.components_that_act().into_iter().map(curve).collect::<Vec<_>>()
    };
    of.flat_map(of_probe).collect()
}

/// A sheet of charts one below the other.
fn stacked<'s>(stored: &Stored, what: &str, cells: Vec<Cell<'s>>) -> Sheet<'s> {
    let height = if cells.len() < 3 { 290.0 } else { 230.0 };
    let sheet = Sheet::new(&stored.title, what);
    cells.into_iter().fold(sheet, |sheet, cell| sheet.row(height, vec![cell]))
}

/// Quantities over time, a chart each.
pub(super) fn probes<'s>(stored: &'s Stored, _: &Options) -> Result<Sheet<'s>, FigureError> {
    let all: Vec<(Quantity, Vec<Curve>)> =
        Quantity::ALL.into_iter().map(|q| (q, curves(stored, q))).collect();
    let all: Vec<_> = all.into_iter().filter(|(_, curves)| !curves.is_empty()).collect();
    if all.is_empty() {
        return Err(FigureError::Empty(
            "no probe saw anything: name places in [[probe]] of the scene",
        ));
    }
    let last = all.len() - 1;
    let cell = |(k, (quantity, curves)): (usize, (Quantity, Vec<Curve>))| {
        let known = curves.iter().flat_map(|c| &c.1).copied().filter(|x| x.is_finite());
        let y = range(known.chain([0.0]));
        let labels = (if k == last { "time" } else { "" }, quantity.name());
        let mut chart = over_time(stored, y, labels);
        let mut entries: Vec<Entry> = vec![entry("in contact", SHADE, Mark::Patch)];
        entries.truncate(if k == 0 { stored.facing().min(1) } else { 0 });
        let points = |(name, x): Curve| (name, stored.t.iter().copied().zip(x).collect());
        draw(&mut chart, curves.into_iter().map(points).collect(), &mut entries);
        Cell::from(chart).legend(entries)
    };
    let cells = all.into_iter().enumerate().map(cell).collect();
    Ok(stacked(stored, "probes", cells))
}

/// Velocity over displacement of the probes that have both.
pub(super) fn portraits<'s>(stored: &'s Stored, _: &Options) -> Result<Sheet<'s>, FigureError> {
    let mut cells: Vec<Cell> = vec![];
    let of = |q| stored.probes.iter().filter(move |p: &&StoredProbe| p.quantity == q);
    for x in of(Quantity::Displacement) {
        let Some(v) = of(Quantity::Velocity).find(|v| v.name == x.name) else { continue };
        let curve = |c: usize| {
            let (x_c, v_c) = (x.values.column(c).to_vec(), v.values.column(c).to_vec());
            (called(x, c), x_c.into_iter().zip(v_c).collect::<Vec<Point>>())
        };
        let curves: Vec<_> = x.components_that_act().into_iter().map(curve).collect();
        let points = || curves.iter().flat_map(|c| &c.1);
        let axis = |name: &str, of: fn(&Point) -> f64| Axis::linear(name, range(points().map(of)));
        let mut chart = Chart::new(axis("displacement", |p| p.0), axis("velocity", |p| p.1));
        let mut entries = vec![];
        draw(&mut chart, curves, &mut entries);
        cells.push(Cell::from(chart).legend(entries));
    }
    if cells.is_empty() {
        let why = "a portrait needs a probe of displacement and velocity: [[probe]] of the scene";
        return Err(FigureError::Empty(why));
    }
    let mut sheet = Sheet::new(&stored.title, "phase portraits of the probes");
    let height = if cells.len() == 1 { 560.0 } else { 400.0 };
    let mut rest = cells.into_iter().peekable();
    while rest.peek().is_some() {
        sheet = sheet.row(height, rest.by_ref().take(2).collect());
    }
    Ok(sheet)
}

/// The frequency above which no line of a chart comes within so many decades of its largest.
const SEEN: f64 = 4.5;

/// The largest line of a chart, as a decimal logarithm.
fn most(curves: &[(String, Spectrum)]) -> f64 {
    let lines = curves.iter().flat_map(|c| &c.1.amplitude[1..]);
    lines.fold(f64::MIN_POSITIVE, |m, a| m.max(*a)).log10()
}

/// Up to which frequency there is something to see.
fn end_of(curves: &[(String, Spectrum)]) -> f64 {
    let most = most(curves);
    let of = |c: &(String, Spectrum)| {
        let last = c.1.amplitude.iter().rposition(|a| a.log10() > most - SEEN);
        last.map_or(0.0, |k| c.1.frequency[k])
    };
    curves.iter().map(of).fold(0.0, f64::max)
}

/// A spectrum in decades, up to a frequency.
fn spectrum(label: (&str, &str), curves: Vec<(String, Spectrum)>, end: f64) -> Cell<'static> {
    let most = most(&curves);
    let shown = |s: &Spectrum| -> Vec<Point> {
        let lines = s.frequency.iter().zip(&s.amplitude).skip(1);
        let lines = lines.filter(|(f, a)| **f <= end && a.log10() >= most - DECADES);
        lines.map(|(f, a)| (*f, a.log10())).collect()
    };
    let lines: Vec<(String, Vec<Point>)> =
        curves.into_iter().map(|(name, s)| (name, shown(&s))).collect();
    let all = lines.iter().flat_map(|l| &l.1);
    let low = all.map(|p| p.1).fold(most, f64::min).floor();
    let y = Axis::decades(label.1, low..(most + 0.1).max(low + 1.0));
    let mut chart = Chart::new(Axis::linear(label.0, 0.0..end), y);
    let mut entries = vec![];
    draw(&mut chart, lines, &mut entries);
    Cell::from(chart).legend(entries)
}

/// Amplitudes over frequency: of forces, and of what probes saw; without probes of the contact displacements.
pub(super) fn spectra<'s>(stored: &'s Stored, options: &Options) -> Result<Sheet<'s>, FigureError> {
    let Some(even) = Even::among(&stored.t, options.periodic) else {
        return Err(FigureError::Empty(
            "a spectrum needs eight stored states that stand evenly in time",
        ));
    };
    let mut all: Vec<(&'static str, Vec<Curve>)> = vec![];
    for of in &stored.forces {
        let curve = |(c, name): (usize, String)| (name, of.values.column(c).to_vec());
        all.push((name_of(of), of.components_that_act().into_iter().map(curve).collect()));
    }
    for quantity in Quantity::ALL {
        all.push((quantity.name(), curves(stored, quantity)));
    }
    if stored.probes.is_empty() && stored.facing() > 0 {
        let most = (0..stored.facing()).max_by(|&a, &b| {
            let size = |i: usize| stored.pressure.column(i).iter().copied().fold(0.0, f64::max);
            // the first of those that never touch
            size(a).total_cmp(&size(b)).then(b.cmp(&a))
        });
        let point = most.unwrap_or(0);
        let rows = 0..stored.t.len();
        let motion = rows.map(|r| stored.contact_displacement(r, point)).collect();
        let name = format!("node {}", stored.contact_name(point));
        all.push(("contact displacement", vec![(name, motion)]));
    }
    let known = |(label, curves): (&'static str, Vec<Curve>)| {
        let of = |(name, x): Curve| Some((name, even.spectrum(&x)?));
        let curves: Vec<(String, Spectrum)> = curves.into_iter().filter_map(of).collect();
        let moves = |c: &(String, Spectrum)| c.1.amplitude[1..].iter().any(|a| *a > 0.0);
        (label, curves.into_iter().filter(moves).collect::<Vec<_>>())
    };
    let all: Vec<_> = all.into_iter().map(known).filter(|(_, c)| !c.is_empty()).collect();
    if all.is_empty() {
        return Err(FigureError::Empty("nothing moves, and has a spectrum"));
    }
    let last = all.len() - 1;
    let highest = all.iter().flat_map(|(_, c)| c).filter_map(|c| c.1.frequency.last());
    let highest = highest.fold(0.0f64, |m, f| m.max(*f));
    let end = (1.1 * all.iter().map(|(_, c)| end_of(c)).fold(0.0, f64::max)).min(highest);
    let cell = |(k, (label, curves))| {
        let words = if k == last { "frequency (cycles over time)" } else { "" };
        spectrum((words, label), curves, end)
    };
    let cells = all.into_iter().enumerate().map(cell).collect();
    Ok(stacked(stored, "amplitude spectra", cells))
}
