//! Bifurcation diagrams as plain data: what a forced body settles to while a number of its scene goes up, or down.

use super::{AttractorRecord, PointKind};

/// What a body does at a value.
#[derive(Debug, Clone, PartialEq)]
pub struct DiagramRow {
    /// The number of the scene.
    pub value: f64,
    /// Whether the number goes down there.
    pub falls: bool,
    /// What changed since the row before it: the start, a jump, another kind of motion.
    pub special: PointKind,
    /// What is seen of it.
    pub seen: AttractorRecord,
    /// A state of it at phase zero of the loads, in the frame of the body at the scene's own value.
    pub x: Vec<f64>,
    /// Whether a later run may go on from there: a value of the grid, not one between.
    pub goes_on: bool,
}

/// A bifurcation diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagram {
    /// Key of the number.
    pub key: String,
    /// Its range.
    pub range: [f64; 2],
    /// Steps from one end of the range to the other.
    pub steps: usize,
    /// Circular frequency of the loads.
    pub omega: f64,
    /// Periods at each value; none: until the body has settled.
    pub dwell: Option<usize>,
    /// Row after row in the order of the walks: those that go up first.
    pub rows: Vec<DiagramRow>,
}

/// So many steps from one end of a range to the other.
pub(super) fn evenly([low, high]: [f64; 2], steps: usize) -> Vec<f64> {
    let at = |k: usize| match k {
        0 => low,
        k if k == steps => high,
        k => low + (high - low) * k as f64 / steps as f64,
    };
    (0..=steps).map(at).collect()
}

impl Diagram {
    /// The values of a walk, in its order.
    pub fn values(&self, falls: bool) -> Vec<f64> {
        let mut all = evenly(self.range, self.steps);
        if falls {
            all.reverse();
        }
        all
    }

    /// The rows of a walk.
    pub fn walk(&self, falls: bool) -> impl Iterator<Item = &DiagramRow> {
        self.rows.iter().filter(move |row| row.falls == falls)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_go_from_end_to_end() {
        let range = [0.1, 0.7];
        let diagram =
            Diagram { key: String::new(), range, steps: 3, omega: 1.0, dwell: None, rows: vec![] };
        let up = diagram.values(false);
        assert_eq!((up[0], up[3], up.len()), (0.1, 0.7, 4));
        let mut down = diagram.values(true);
        down.reverse();
        assert_eq!(up, down);
    }
}
