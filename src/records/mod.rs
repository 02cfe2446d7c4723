//! Results of families of orbits as plain data: what every solver hands out and every file keeps.
//!
//! A family has a [`FamilyKind`] (method, walk, problem) and branches ([`Branch`]); a branch has points ([`PointRecord`]) and an end
//! ([`BranchEnd`]); a point is of some kind ([`PointKind`]), and has an orbit in time ([`OrbitRecord`]), a Fourier series ([`SeriesRecord`]), the verdict of a cross-check
//! ([`CheckRow`]), and the place from which a continuation goes on ([`PlaceRecord`]), or lacks some of them. Numbers are in the scene's
//! units. In JSON they stand by their bits. What files call by names is an enum here, and its name is made and read in one place.
//!
//! Nothing here knows how a result was computed or where it is written.

pub(crate) mod bits;
mod branch;
mod check;
mod comparison;
mod fingerprint;
mod kind;
mod orbit;
mod point;
mod ridge;
mod series;
mod special;
mod statement;
mod status;
mod study;

pub use branch::{Branch, Direction};
pub use check::{CheckRow, VerdictKind};
pub use comparison::{Compared, Comparison, Orders, Quantity, Row, limit, richardson};
pub use fingerprint::fingerprint;
pub use kind::{BranchEnd, EndReason, FamilyKind, Grid, Outline, PointMethod, Solver, Walk, Way};
pub use orbit::{OrbitRecord, ViscousRecord};
pub use point::{PlaceRecord, PointRecord};
pub use ridge::{Peak, crest, peaks};
pub use series::{SeriesRecord, place_of_function};
pub use special::{Bifurcation, GapReason, Outside, PointKind, StabilityChange};
pub use statement::{Changed, ErrorStatement, Variation};
pub use status::Status;
pub use study::{Points, StudyTable};
