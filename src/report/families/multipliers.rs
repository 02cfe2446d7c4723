//! Floquet multipliers of an orbit in the complex plane.

use std::ops::Range;

use plotters::prelude::RGBColor;

use crate::records::OrbitRecord;
use crate::report::figure::{
    Axis, Cell, Chart, FigureError, INK, LINES, Legend, Mark, Sheet, entry, range,
};
use crate::store::Stored;

/// Multipliers further out than this are outside the unit circle.
const OUTSIDE: f64 = 1e-6;
/// Beyond this modulus the neighbourhood of the circle has a panel of its own.
const FAR: f64 = 3.0;

fn modulus([re, im]: [f64; 2]) -> f64 {
    re.hypot(im)
}

/// The largest modulus apart from the multipliers that belong to the family; NaN: not computed.
pub(super) fn largest_multiplier(o: &OrbitRecord) -> f64 {
    o.largest_multiplier().unwrap_or(f64::NAN)
}

/// Multipliers of one kind.
struct Group {
    name: String,
    members: Vec<[f64; 2]>,
    colour: RGBColor,
    mark: Mark,
}

/// Multipliers by where they lie.
fn groups(orbit: &OrbitRecord) -> [Group; 3] {
    let (trivial, others) = orbit.multipliers.split_at(orbit.trivial.min(orbit.multipliers.len()));
    let (outside, inside): (Vec<_>, Vec<_>) =
        others.iter().copied().partition(|&m| modulus(m) > 1.0 + OUTSIDE);
    let group = |what: &str, members: Vec<[f64; 2]>, colour, mark| Group {
        name: format!("{what}: {}", members.len()),
        members,
        colour,
        mark,
    };
    [
        group("on or within the unit circle", inside, LINES[0], Mark::Dot),
        group("outside", outside, LINES[1], Mark::Dot),
        group("of the family", trivial.to_vec(), INK, Mark::Cross),
    ]
}

/// The complex plane with the unit circle.
fn plane(
    (x, y): (Range<f64>, Range<f64>),
    labels: (&str, &str),
    groups: &[Group],
) -> Cell<'static> {
    let mut chart = Chart::new(Axis::linear(labels.0, x), Axis::linear(labels.1, y)).equal();
    // beyond every frame
    const FAR_AWAY: f64 = 1e9;
    for ends in [[(-FAR_AWAY, 0.0), (FAR_AWAY, 0.0)], [(0.0, -FAR_AWAY), (0.0, FAR_AWAY)]] {
        chart.line(ends.to_vec(), RGBColor(170, 170, 176), 1.0);
    }
    let turn = |k: i32| (f64::from(k) / 360.0 * std::f64::consts::TAU).sin_cos();
    chart.line((0..=360).map(|k| (turn(k).1, turn(k).0)).collect(), INK, 1.0);
    for group in groups {
        chart.marks(group.members.iter().map(|m| (m[0], m[1])), group.mark, group.colour);
    }
    chart.into()
}

/// Floquet multipliers in the complex plane.
pub(super) fn orbit_multipliers(
    stored: &Stored,
    orbit: &OrbitRecord,
) -> Result<Sheet<'static>, FigureError> {
    if orbit.multipliers.is_empty() {
        return Err(FigureError::Empty("no multipliers were computed"));
    }
    let groups = groups(orbit);
    let farthest = orbit.multipliers.iter().map(|&m| modulus(m)).fold(1.0, f64::max);
    let far = farthest > FAR;
    let bounds = |c: usize| range(orbit.multipliers.iter().map(|m| m[c]).chain([-1.1, 1.1]));
    let all = (bounds(0), bounds(1));
    let length = |r: &Range<f64>| r.end - r.start;
    let tall = (660.0 * length(&all.1) / length(&all.0)).clamp(330.0, 760.0) as u32;
    let what = match orbit.stable {
        _ if orbit.viscous.is_some() => "multipliers of the self-excited system",
        Some(true) => "Floquet multipliers, stable",
        Some(false) => "Floquet multipliers, unstable",
        None => "Floquet multipliers",
    };
    let present = groups.iter().filter(|g| !g.members.is_empty());
    let entries = present.map(|g| entry(&g.name, g.colour, g.mark)).collect();
    let sheet = Sheet::new(&stored.title, what).legend(Legend::Rows(entries));
    Ok(match far {
        true => {
            let near = (-1.3..1.3, -1.3..1.3);
            let left = plane(all, ("Re μ (all)", "Im μ"), &groups);
            let right = plane(near, ("Re μ (near the unit circle)", "Im μ"), &groups);
            sheet.row(508.0, vec![left, right])
        }
        false => {
            let plane = plane(all, ("Re μ", "Im μ"), &groups);
            sheet.wide(770.0).strip(f64::from(tall) + 52.0, vec![plane])
        }
    })
}
