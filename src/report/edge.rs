//! The contact nodes in their order along the edge: where they lie, how they move, which of them are drawn and in which
//! colours.

use plotters::prelude::RGBColor;

use super::figure::{Area, Drawn, LINES, colour_bar, viridis};
use crate::store::Stored;

/// At most this many nodes are drawn where nobody chooses.
const SHOWN: usize = 12;

/// The contact nodes of a stored motion, at least one.
pub(super) struct Edge<'s> {
    stored: &'s Stored,
    /// Coordinate along the edge.
    pub position: Vec<f64>,
    /// Its name.
    pub axis: &'static str,
    /// Of the outward normal.
    sign: f64,
}

impl<'s> Edge<'s> {
    pub fn of(stored: &'s Stored) -> Self {
        let axis = if stored.contact_normal.ends_with('y') { 0 } else { 1 };
        let position = (0..stored.gap.len()).map(|i| stored.contact_place(i)[axis]).collect();
        let sign = if stored.contact_normal.starts_with('-') { -1.0 } else { 1.0 };
        Edge { stored, position, axis: ["x", "y"][axis], sign }
    }

    /// From the first to the last node.
    pub fn span(&self) -> std::ops::Range<f64> {
        self.position[0]..self.position[self.position.len() - 1]
    }

    /// Contact displacement along the outward normal, and its velocity.
    pub fn motion(&self, row: usize, i: usize) -> (f64, f64) {
        let first = self.stored.v.ncols() - self.stored.gap.len();
        let velocity = self.sign * self.stored.v[(row, first + i)];
        (self.stored.contact_displacement(row, i), velocity)
    }

    /// All nodes, or as many evenly along the edge as a picture bears.
    pub fn some(&self) -> Vec<usize> {
        let n_c = self.position.len();
        match n_c <= SHOWN {
            true => (0..n_c).collect(),
            false => (0..SHOWN).map(|k| k * (n_c - 1) / (SHOWN - 1)).collect(),
        }
    }

    /// Colour of a node.
    pub fn colour(&self, i: usize) -> RGBColor {
        let span = self.span();
        match self.position.len() {
            1 => LINES[0],
            _ => viridis(0.92 * (self.position[i] - span.start) / (span.end - span.start)),
        }
    }

    /// The common gap, where all nodes have the same.
    pub fn even_gap(&self) -> Option<f64> {
        let gap = &self.stored.gap;
        gap.first().copied().filter(|first| gap.iter().all(|g| g == first))
    }

    /// A sheet with room for the bar of the nodes' colours at its right end, where there are several.
    pub fn beside_bar<'b>(&self, sheet: Area<'b>, at: i32) -> (Area<'b>, Option<Area<'b>>) {
        match self.position.len() {
            1 => (sheet, None),
            _ => {
                let (main, bar) = sheet.split_horizontally(at);
                (main, Some(bar))
            }
        }
    }

    /// That bar.
    pub fn bar(&self, area: Option<&Area>) -> Drawn {
        let Some(area) = area else { return Ok(()) };
        colour_bar(area, self.span(), &format!("node {}", self.axis), |s| viridis(0.92 * s))
    }
}
