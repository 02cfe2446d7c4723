//! Switches along a series.

use super::series::Basis;
use crate::contact::PointState;

/// A switch along a series.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// Where.
    pub theta: f64,
    /// Contact point.
    pub point: usize,
    /// Its state before.
    pub from: PointState,
    /// Its state after.
    pub to: PointState,
}

/// Where the phases between the switches of a series begin and end.
pub(super) fn spans(crossings: &[Crossing], basis: Basis) -> impl Iterator<Item = (f64, f64)> {
    let ends = crossings.iter().map(|c| c.theta);
    std::iter::once(0.0).chain(ends.clone()).zip(ends.chain([basis.end()]))
}

/// Most switches of one node a harmonic.
pub(super) const SWITCHES: usize = 8;
