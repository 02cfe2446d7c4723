//! Floquet multipliers of an orbit in the complex plane.

use std::ops::Range;

use plotters::prelude::RGBColor;

use crate::records::OrbitRecord;
use crate::report::figure::{
    self, Area, Drawn, Entry, FigureError, INK, LINES, Mark, draw_line, equal_panel, legend, line,
    px, range, symbols, title,
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
    let moduli = o.multipliers.iter().skip(o.trivial).map(|&m| modulus(m));
    moduli.fold(f64::NAN, f64::max)
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

/// A panel of the complex plane with the unit circle.
fn plane(
    area: &Area,
    (x, y): (Range<f64>, Range<f64>),
    labels: (&str, &str),
    groups: &[Group],
) -> Drawn {
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
    for group in groups {
        let shown = group.members.iter().map(|m| (m[0], m[1]));
        let shown = shown.filter(|(re, im)| x.contains(re) && y.contains(im));
        symbols(&chart, shown, group.mark, group.colour)?;
    }
    Ok(())
}

/// Floquet multipliers in the complex plane.
pub(super) fn orbit_multipliers(
    stored: &Stored,
    orbit: &OrbitRecord,
) -> Result<String, FigureError> {
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
    figure::svg(if far { (980, 560) } else { (770, tall + 104) }, |root| {
        let what = match orbit.stable {
            _ if orbit.viscous.is_some() => "multipliers of the self-excited system",
            Some(true) => "Floquet multipliers, stable",
            Some(false) => "Floquet multipliers, unstable",
            None => "Floquet multipliers",
        };
        title(root, &stored.title, what)?;
        let (_, sheet) = root.split_vertically(px(32.0));
        let (strip, sheet) = sheet.split_vertically(px(20.0));
        let present = groups.iter().filter(|g| !g.members.is_empty());
        let entries: Vec<Entry> = present.map(|g| (g.name.as_str(), g.colour, g.mark)).collect();
        legend(&strip, &entries)?;
        if far {
            let (left, right) = sheet.split_horizontally(px(490.0));
            plane(&left, all, ("Re μ (all)", "Im μ"), &groups)?;
            let near = (-1.3..1.3, -1.3..1.3);
            plane(&right, near, ("Re μ (near the unit circle)", "Im μ"), &groups)
        } else {
            plane(&sheet, all, ("Re μ", "Im μ"), &groups)
        }
    })
}
