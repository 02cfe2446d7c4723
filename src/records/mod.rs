//! Results of families of orbits as plain data: what every solver hands out and every file keeps.
//!
//! A family has a [`FamilyKind`] (method, walk, problem) and branches; a branch has points ([`PointRecord`]) and an end
//! ([`BranchEnd`]); a point has an orbit in time ([`OrbitRecord`]), a Fourier series ([`SeriesRecord`]), the verdict of a cross-check
//! ([`CheckRow`]), and the place from which a continuation goes on ([`PlaceRecord`]), or lacks some of them. Numbers are in the scene's
//! units. In JSON they stand by their bits.
//!
//! Nothing here knows how a result was computed or where it is written.

pub(crate) mod bits;
mod check;
mod kind;
mod orbit;
mod point;
mod series;

pub use check::CheckRow;
pub use kind::{BranchEnd, EndReason, FamilyKind, Grid, PointMethod, Walk, fingerprint};
pub use orbit::OrbitRecord;
pub use point::{PlaceRecord, PointRecord};
pub use series::{SeriesRecord, place_of_function};
