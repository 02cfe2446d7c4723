//! Pictures of periodic orbits: a family over the frequency, or a damped nonlinear mode over its amplitude (`backbone`), Floquet multipliers (`multipliers`), the phase
//! portrait of the contact nodes (`portrait`), the largest forces (`forces`) and what probes see (`probes`); and the table of a family as CSV.

mod axis;
mod branches;
mod damped;
mod errors;
mod frequency;
mod head;
mod look;
mod multipliers;
mod portrait;
mod special;
mod sweep;
mod table;
mod watched;
mod words;

use std::path::Path;

use super::crosscheck::crosscheck;
use super::figure::{Drawing, FigureError, Sheet};
use crate::records::{CheckRow, OrbitRecord};
use crate::store::{Stored, StoredFamily, beside};
use frequency::{backbone, family_multipliers};
use multipliers::orbit_multipliers;
use portrait::portrait;

pub use axis::Axis;
pub(in crate::report) use branches::is_viscous;
pub(super) use branches::{branches, of_branch, pieces, runs};
pub(super) use errors::{draw_errors, error_entries, reached};
pub use table::csv;
pub use watched::highest;
pub(super) use words::kind;

/// Values that differ by more than this factor need a logarithmic axis.
pub(super) const LOGARITHMIC: f64 = 50.0;

/// What a picture is drawn from.
#[derive(Clone, Copy)]
enum Source<'s> {
    Orbit(&'s Stored, &'s OrbitRecord),
    Family(&'s StoredFamily, Option<Axis>),
    Check(&'s StoredFamily, &'s [CheckRow]),
}

/// A picture's name and how it is drawn.
type Picture = (&'static str, fn(Source) -> Result<Sheet<'static>, FigureError>);

const OF_ORBIT: [Picture; 2] = [
    ("portrait", |s| match s {
        Source::Orbit(stored, _) => portrait(stored),
        _ => Err(FigureError::Empty("a family has no portrait")),
    }),
    ("multipliers", multipliers),
];

const OF_FAMILY: [Picture; 7] = [
    ("backbone", |s| match s {
        Source::Family(family, axis) => backbone(family, axis),
        _ => Err(FigureError::Empty("this is no backbone")),
    }),
    ("sweep", |s| match s {
        Source::Family(family, axis) => sweep::peaks(family, axis),
        _ => Err(NO_SWEEP),
    }),
    ("bifurcation", |s| match s {
        Source::Family(family, _) => sweep::bifurcation(family),
        _ => Err(NO_SWEEP),
    }),
    ("waterfall", |s| match s {
        Source::Family(family, _) => sweep::waterfall(family),
        _ => Err(NO_SWEEP),
    }),
    ("forces", |s| match s {
        Source::Family(family, _) => watched::forces(family),
        _ => Err(NO_FAMILY),
    }),
    ("probes", |s| match s {
        Source::Family(family, _) => watched::probes(family),
        _ => Err(NO_FAMILY),
    }),
    ("multipliers", multipliers),
];

const NO_FAMILY: FigureError = FigureError::Empty("this is no family");
const NO_SWEEP: FigureError = FigureError::Empty("this is no sweep");

const OF_CHECK: [Picture; 2] = [
    ("crosscheck", |s| match s {
        Source::Check(family, rows) => crosscheck(family, rows),
        _ => Err(FigureError::Empty("there is no cross-check")),
    }),
    ("multipliers", multipliers),
];

/// Names of the pictures of an orbit, beside those of a run.
pub(crate) fn orbit_names() -> Vec<&'static str> {
    OF_ORBIT.iter().map(|p| p.0).collect()
}

/// Names of the pictures of a family.
pub(crate) fn family_names() -> Vec<&'static str> {
    OF_FAMILY.iter().map(|p| p.0).collect()
}

/// Names of the pictures of a cross-check.
pub(crate) fn check_names() -> Vec<&'static str> {
    OF_CHECK.iter().map(|p| p.0).collect()
}

/// Draw the named pictures of an orbit (all that make sense if `only` is empty) to be written as `STEM-NAME.svg` and `.png`.
pub(crate) fn pictures_of_orbit(
    stored: &Stored,
    orbit: &OrbitRecord,
    stem: &Path,
    only: &[String],
) -> Result<Vec<Drawing<'static>>, FigureError> {
    draw(&OF_ORBIT, Source::Orbit(stored, orbit), stem, only).map(|(drawn, _)| drawn)
}

/// Draw the named pictures of a family, likewise, the backbone on both axes or on one; without any orbit there is nothing to draw.
pub fn pictures_of_family(
    family: &StoredFamily,
    axis: Option<Axis>,
    stem: &Path,
    only: &[String],
) -> Result<Vec<Drawing<'static>>, FigureError> {
    something(draw(&OF_FAMILY, Source::Family(family, axis), stem, only)?)
}

/// Draw the named pictures of a cross-check, likewise.
pub(crate) fn pictures_of_check(
    family: &StoredFamily,
    rows: &[CheckRow],
    stem: &Path,
    only: &[String],
) -> Result<Vec<Drawing<'static>>, FigureError> {
    something(draw(&OF_CHECK, Source::Check(family, rows), stem, only)?)
}

/// What was drawn, and why the first picture that is not there was left out.
type Drawings = (Vec<Drawing<'static>>, Option<FigureError>);

/// A file of which nothing can be drawn says why.
fn something((drawn, reason): Drawings) -> Result<Vec<Drawing<'static>>, FigureError> {
    match reason {
        Some(reason) if drawn.is_empty() => Err(reason),
        _ => Ok(drawn),
    }
}

fn draw(
    pictures: &[Picture],
    source: Source,
    stem: &Path,
    only: &[String],
) -> Result<Drawings, FigureError> {
    let (mut drawn, mut reason) = (vec![], None);
    for (name, picture) in pictures {
        if !only.is_empty() && !only.iter().any(|o| o == name) {
            continue;
        }
        let sheet = match picture(source) {
            Ok(sheet) => sheet,
            Err(e @ FigureError::Empty(_)) if only.is_empty() => {
                reason = reason.or(Some(e));
                continue;
            }
            Err(e) => return Err(e),
        };
        drawn.push(Drawing { stem: beside(stem, &format!("-{name}")), sheet });
    }
    Ok((drawn, reason))
}

fn multipliers(source: Source) -> Result<Sheet<'static>, FigureError> {
    match source {
        Source::Orbit(stored, orbit) => orbit_multipliers(stored, orbit),
        Source::Family(family, _) | Source::Check(family, _) => family_multipliers(family),
    }
}
