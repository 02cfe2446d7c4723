//! The picture `forces`: what contact groups, supports and springs bear over time.

use super::Options;
use super::time::{draw, over_time};
use crate::report::figure::{Cell, Entry, FigureError, Mark, SHADE, Sheet, entry, range};
use crate::store::{Stored, StoredForces};

/// A chart a kind of force.
pub(super) fn forces<'s>(stored: &'s Stored, _: &Options) -> Result<Sheet<'s>, FigureError> {
    let acts = |f: &&StoredForces| !f.components_that_act().is_empty();
    let known: Vec<&StoredForces> = stored.forces.iter().filter(acts).collect();
    if known.is_empty() {
        return Err(FigureError::Empty("no forces are stored"));
    }
    let height = if known.len() < 3 { 280.0 } else { 230.0 };
    let sheet = Sheet::new(&stored.title, "forces");
    let last = known.len() - 1;
    Ok(known
        .iter()
        .enumerate()
        .fold(sheet, |sheet, (k, of)| sheet.row(height, vec![chart(stored, of, (k, last))])))
}

/// What forces of a kind are called.
pub(super) fn name_of(forces: &StoredForces) -> &'static str {
    match forces.kind {
        "contact" => "force of contact",
        "support" => "force of supports",
        _ => "force of springs",
    }
}

/// Components over time.
fn chart(stored: &Stored, forces: &StoredForces, (place, last): (usize, usize)) -> Cell<'static> {
    let column = |c: usize| forces.values.column(c).to_vec();
    let shown = forces.components_that_act();
    let y = range(shown.iter().flat_map(|(c, _)| column(*c)).chain([0.0]));
    let labels = (if place == last { "time" } else { "" }, name_of(forces));
    let mut chart = over_time(stored, y, labels);
    let shade = entry("in contact", SHADE, Mark::Patch);
    let mut entries: Vec<Entry> = vec![shade];
    entries.truncate(if place == 0 { stored.facing().min(1) } else { 0 });
    let curve = |(c, name)| (name, stored.t.iter().copied().zip(column(c)).collect());
    draw(&mut chart, shown.into_iter().map(curve).collect(), &mut entries);
    Cell::from(chart).legend(entries)
}
