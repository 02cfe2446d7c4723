//! Harmonic balance beside the orbits that shooting found from it: the picture `crosscheck`, its numbers, its table.

mod convergence;
mod parted;
mod picture;
mod table;
mod tally;

pub use table::csv;
pub use tally::Tally;
pub(crate) use tally::by_harmonics;

pub(super) use parted::{DASH, dash, parted};
pub(super) use picture::crosscheck;
