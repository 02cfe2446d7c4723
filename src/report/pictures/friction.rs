//! The picture `friction`: loops of force over displacement, and what friction took where.

use super::Options;
use crate::report::edge::Edge;
use crate::report::figure::{
    Axis, Cell, Chart, Entry, FigureError, LINES, Mark, Point, Sheet, entry, range, series_colour,
};
use crate::store::{Stored, StoredFriction};

/// At most so many points have loops where nobody chooses.
const LOOPS: usize = 6;

/// The points whose loops are drawn: those that are asked for, or those at which friction took most, in their order.
fn shown(stored: &Stored, rubbed: &StoredFriction, options: &Options) -> Vec<usize> {
    let all = 0..stored.gap.len();
    if !options.nodes.is_empty() {
        return all.filter(|i| options.nodes.contains(&stored.contact_nodes[*i])).collect();
    }
    let taken = |i: usize| rubbed.work.get(i).copied().unwrap_or(0.0);
    let mut by_work: Vec<usize> = all.collect();
    by_work.sort_by(|a, b| taken(*b).total_cmp(&taken(*a)));
    by_work.truncate(LOOPS);
    by_work.sort_unstable();
    by_work
}

/// The force that a point exerts along its tangent, over its displacement.
fn looped(stored: &Stored, rubbed: &StoredFriction, i: usize) -> Vec<Point> {
    let Some(slide) = &rubbed.slide else { return vec![] };
    let area = stored.contact_area.get(i).copied().filter(|a| a.is_finite()).unwrap_or(1.0);
    (0..stored.t.len()).map(|r| (slide[(r, i)], -area * rubbed.traction[(r, i)])).collect()
}

/// A quantity of the contact points along the edge, or of sliders one after the other.
fn along(stored: &Stored, values: &[f64], name: &str) -> Chart {
    let edge = Edge::of(stored);
    let by_place = edge.fronts.len() > 1;
    let of_place = |&i: &usize| (edge.position[i], values[i]);
    let parts: Vec<Vec<Point>> = match by_place {
        true => edge.parts().iter().map(|part| part.iter().map(of_place).collect()).collect(),
        false => vec![values.iter().enumerate().map(|(i, v)| (i as f64, *v)).collect()],
    };
    let points = || parts.iter().flatten();
    let label = if by_place { edge.label() } else { "point".into() };
    let x = range(points().map(|p| p.0));
    let y = range(points().map(|p| p.1).chain([0.0]));
    let mut chart = Chart::new(Axis::linear(label, x), Axis::linear(name, y));
    match stored.is_solid() {
        // points of a face are in no order
        true => chart.marks(points().copied(), Mark::Dot, LINES[0]),
        false => parts.iter().for_each(|part| chart.series(part, Mark::Dot, LINES[0])),
    }
    chart
}

/// Loops of force over displacement, slip paths, work.
pub(super) fn friction<'s>(
    stored: &'s Stored,
    options: &Options,
) -> Result<Sheet<'s>, FigureError> {
    let Some(rubbed) = stored.rubbed.as_ref().filter(|r| r.slide.is_some()) else {
        return Err(FigureError::Empty("friction loops are drawn of runs with friction"));
    };
    let loops: Vec<(usize, Vec<Point>)> = shown(stored, rubbed, options)
        .into_iter()
        .map(|i| (i, looped(stored, rubbed, i)))
        .collect();
    let all = || loops.iter().flat_map(|l| &l.1);
    let axis = |name: &str, of: fn(&Point) -> f64| Axis::linear(name, range(all().map(of)));
    let x = axis("displacement along the tangent", |p| p.0);
    let mut chart = Chart::new(x, axis("force of friction", |p| p.1));
    let mut entries: Vec<Entry> = vec![];
    for (k, (i, points)) in loops.into_iter().enumerate() {
        chart.line(points, series_colour(k), 1.6);
        entries.push(entry(stored.contact_name(i), series_colour(k), Mark::Line));
    }
    let sheet =
        Sheet::new(&stored.title, "friction").row(400.0, vec![Cell::from(chart).legend(entries)]);
    if rubbed.work.len() < 2 {
        return Ok(sheet);
    }
    let cells = [(&rubbed.path, "slip path"), (&rubbed.work, "work taken by friction")];
    Ok(sheet.row(260.0, cells.map(|(v, name)| along(stored, v, name).into()).into()))
}
