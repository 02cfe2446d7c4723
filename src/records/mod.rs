//! Results of families of orbits as plain data: what every file keeps.
//!
//! A family has a [`FamilyKind`] (method, walk, problem) and branches ([`Branch`]); a branch has points ([`PointRecord`]) and an end
//! ([`BranchEnd`]). What a point is comes from the numerics ([`signorini_core::records`]). What files call by names is an enum here, and its name is made and read in
//! one place.
//!
//! Nothing here knows how a result was computed or where it is written.

mod branch;
mod comparison;
mod fingerprint;
mod kind;
mod statement;
mod status;
mod study;
mod trust;

pub use branch::{Branch, Direction};
pub use comparison::{Compared, Comparison, Orders, Quantity, Row, limit};
pub use fingerprint::fingerprint;
pub(crate) use kind::{BranchEnd, EndReason, Outline, Solver, Way};
pub use kind::{FamilyKind, Grid, PointMethod, Walk};
pub use signorini_core::records::*;
pub use statement::{Changed, ErrorStatement, Variation};
pub(crate) use status::Status;
pub use study::Points;
pub(crate) use study::StudyTable;
pub use trust::{Beside, Figure, Relief, Replaced, Trust};
