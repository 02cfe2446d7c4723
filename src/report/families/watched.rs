//! Forces and what probes see over the frequency, a chart each: the largest of a period in magnitude.

use super::frequency::{Bars, Quantity, has_orbits};
use super::head::{Head, family_head};
use super::look::Look;
use super::sweep;
use crate::records::{ExtremesRecord, OrbitRecord, Way};
use crate::report::figure::{Cell, FigureError, Sheet};
use crate::store::{StoredFamily, StoredWatched};

/// Below this part of the largest of its kind a component is rounding.
const ROUNDING: f64 = 1e-9;
/// So many charts have a picture's height each.
const HIGH: usize = 2;

/// The largest in magnitude.
fn height(e: &ExtremesRecord, i: usize) -> f64 {
    match (e.largest.get(i), e.least.get(i)) {
        (Some(largest), Some(least)) => largest.abs().max(least.abs()),
        _ => f64::NAN,
    }
}

/// What stands before the name: `force`, or `force_x`; and the name.
fn parts(watched: &StoredWatched) -> (&str, &str) {
    watched.label.split_once('[').unwrap_or((&watched.label, ""))
}

/// Which of the numbers are shown of a force: as a whole, where there are components.
fn is_shown(family: &StoredFamily, watched: &StoredWatched) -> bool {
    let (own, name) = parts(watched);
    let whole = own.split('_').next().unwrap_or(own);
    let is_other = |w: &&StoredWatched| w.kind == watched.kind && parts(w) == (whole, name);
    own == whole || !family.watched.iter().any(|w| is_other(&w))
}

/// What stands out of a family: each force and quantity with its largest magnitude over all points, and the frequency there; not what is rounding.
pub fn highest(family: &StoredFamily) -> Vec<(&str, f64, f64)> {
    let of = |i: usize| {
        let all = family.points.iter().filter_map(|p| Some((height(p.extremes()?, i), p.omega)));
        all.filter(|h| h.0.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let shown = acting(family, &|w| w.kind == "probe" || is_shown(family, w));
    let told = |i: usize| of(i).map(|(x, omega)| (&family.watched[i].label[..], x, omega));
    shown.into_iter().filter_map(told).collect()
}

/// Those of the numbers that are more than rounding beside others of their quantity.
fn acting(family: &StoredFamily, is_of_it: &dyn Fn(&StoredWatched) -> bool) -> Vec<usize> {
    let largest = |i: usize| {
        let all = family.points.iter().filter_map(|p| Some(height(p.extremes()?, i)));
        all.filter(|x| x.is_finite()).fold(0.0, f64::max)
    };
    let all: Vec<(usize, f64)> = (0..family.watched.len())
        .filter(|i| is_of_it(&family.watched[*i]))
        .map(|i| (i, largest(i)))
        .collect();
    let quantity = |i: usize| {
        let own = parts(&family.watched[i]).0;
        own.split('_').next().unwrap_or(own)
    };
    let of_kind = |i: usize| {
        let alike = all.iter().filter(|(j, _)| quantity(*j) == quantity(i));
        alike.fold(0.0, |m: f64, (_, x)| m.max(*x))
    };
    all.iter().filter(|(i, x)| *x > ROUNDING * of_kind(*i)).map(|(i, _)| *i).collect()
}

/// The forces over the frequency.
pub(super) fn forces(family: &StoredFamily) -> Result<Sheet<'static>, FigureError> {
    let is_force = |w: &StoredWatched| w.kind != "probe" && is_shown(family, w);
    picture(family, "largest forces", &is_force)
}

/// What probes see over the frequency.
pub(super) fn probes(family: &StoredFamily) -> Result<Sheet<'static>, FigureError> {
    picture(family, "what probes see", &|w| w.kind == "probe")
}

fn picture(
    family: &StoredFamily,
    what: &str,
    is_of_it: &dyn Fn(&StoredWatched) -> bool,
) -> Result<Sheet<'static>, FigureError> {
    let shown = acting(family, is_of_it);
    if shown.is_empty() {
        return Err(FigureError::Empty(
            "nothing of the kind was watched: the scene has none, or the file is of an earlier version",
        ));
    }
    let is_sweep = family.outline().way == Way::Sweep;
    let mut sheet = if is_sweep {
        let of =
            |i: usize| move |s: &sweep::Swept| s.0.extremes().map_or(f64::NAN, |e| height(e, i));
        let all: Vec<_> = shown.iter().map(|i| of(*i)).collect();
        let all: Vec<sweep::Height> = all.iter().map(|of| of as sweep::Height).collect();
        sweep::sheet(family, what, &all)
    } else {
        has_orbits(family)?;
        let what = what.to_owned();
        family_head(family, Head { what, look: Look::of(family), extra: vec![], below: vec![] })
    };
    for (k, &i) in shown.iter().enumerate() {
        let x_label = if k + 1 == shown.len() { "frequency ω" } else { "" };
        let label = format!("largest |{}|", family.watched[i].label);
        let chart = match is_sweep {
            true => {
                let of = |s: &sweep::Swept| s.0.extremes().map_or(f64::NAN, |e| height(e, i));
                sweep::chart(family, (&label, &of), x_label)
            }
            false => {
                let value = move |o: &OrbitRecord| height(&o.extremes, i);
                let (look, bars) = (Look::of(family), Bars::None);
                Quantity { label, look, value: Box::new(value), bars }.chart(family, x_label)
            }
        };
        let tall = if shown.len() <= HIGH { 355.0 } else { 250.0 };
        let below = if x_label.is_empty() { 0.0 } else { 20.0 };
        sheet = sheet.row(tall + below, vec![Cell::from(chart)]);
    }
    Ok(sheet)
}
