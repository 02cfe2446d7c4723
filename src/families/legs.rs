//! What is left to do on a grid of frequencies.

use crate::records::{Grid, PointRecord};

/// What is left to do on a grid: onwards from the last point that is known, and back from the first (a range that was widened).
#[derive(Debug, Clone, PartialEq)]
pub struct Legs {
    grid: Grid,
    sign: i64,
    /// Places on the branch, in the order of the walk.
    pub onwards: Vec<i64>,
    /// Places before the first one that is known, nearest first.
    pub back: Vec<i64>,
}

impl Legs {
    /// The legs of a branch that is walked upwards, or downwards (its places are then the falling numbers of the grid). `known` are
    /// its points in the order of the walk.
    pub fn new(grid: Grid, range: (f64, f64), downwards: bool, known: &[&PointRecord]) -> Legs {
        let sign = if downwards { -1 } else { 1 };
        let mut wanted: Vec<i64> = grid.within(range).map(|k| sign * k).collect();
        wanted.sort_unstable();
        let (first, last) = (known.first().map(|p| p.index), known.last().map(|p| p.index));
        let onwards = wanted.iter().copied().filter(|k| last.is_none_or(|l| *k > l)).collect();
        let back = wanted.iter().rev().copied().filter(|k| first.is_some_and(|f| *k < f)).collect();
        Legs { grid, sign, onwards, back }
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.onwards.is_empty() && self.back.is_empty()
    }

    /// Frequencies of places.
    pub fn frequencies(&self, places: &[i64]) -> Vec<f64> {
        places.iter().map(|k| self.grid.at(self.sign * k)).collect()
    }

    /// Both legs that are not empty, each with what is known before it, in the order of that walk.
    pub fn each<'p>(&self, known: &[&'p PointRecord]) -> Vec<(&[i64], Vec<&'p PointRecord>)> {
        let forth = known.to_vec();
        let back = known.iter().rev().copied().collect();
        [(&self.onwards[..], forth), (&self.back[..], back)]
            .into_iter()
            .filter(|(places, _)| !places.is_empty())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wider_range_goes_on_at_both_ends() {
        let grid = Grid { origin: 1.8, step: 0.01 };
        let at = |index: i64| PointRecord { index, ..PointRecord::default() };
        let (a, b) = (at(0), at(1));
        let legs = Legs::new(grid, (1.78, 1.83), false, &[&a, &b]);
        assert_eq!((&legs.onwards[..], &legs.back[..]), (&[2, 3][..], &[-1, -2][..]));
        let known = [&a, &b];
        let each = legs.each(&known);
        assert_eq!(each[1].1.iter().map(|p| p.index).collect::<Vec<_>>(), [1, 0]);
        // downwards the places are the falling numbers of the grid
        let legs = Legs::new(grid, (1.78, 1.83), true, &[]);
        assert_eq!((legs.onwards.first(), legs.back.len()), (Some(&-3), 0));
        assert_eq!(legs.frequencies(&[-3]), [grid.at(3)]);
    }
}
