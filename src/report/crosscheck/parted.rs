//! Which points of a sequential continuation belong together, so that a line may be drawn through them.

use super::tally::median;

/// A step of the frequency longer than this many usual ones is a gap.
const GAP: f64 = 1.5;
/// A change of the energy by more than this factor between neighbours is a jump, unless the curve is that steep.
const JUMP: f64 = 1.25;
/// Steps of a steep curve differ by less than this factor.
const ALIKE: f64 = 2.0;

/// Points of a sequential continuation in pieces that belong together.
pub(in crate::report) fn parted(points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let steps: Vec<f64> = points.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let usual = median(steps.iter().map(|s| s.abs()));
    // a curve that turns round has steps of every length
    let turns = steps.iter().any(|s| *s > 0.0) && steps.iter().any(|s| *s < 0.0);
    let apart = |k: usize| !turns && steps[k].abs() > GAP * usual;
    let change = |k: usize| (points[k + 1].1 / points[k].1).ln();
    let steep = |k: usize| {
        let neighbours = [k.checked_sub(1), Some(k + 1)].into_iter().flatten();
        let mut shared = neighbours.filter(|&n| n < steps.len() && !apart(n)).peekable();
        let alike = |n: usize| {
            let ratio = change(n) / change(k);
            ratio > 1.0 / ALIKE && ratio < ALIKE
        };
        shared.peek().is_some() && shared.all(alike)
    };
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![];
    for (k, &point) in points.iter().enumerate() {
        let joined = k > 0 && {
            let step = k - 1;
            !apart(step) && (change(step).abs() <= JUMP.ln() || steep(step))
        };
        match pieces.last_mut() {
            Some(piece) if joined => piece.push(point),
            _ => pieces.push(vec![point]),
        }
    }
    pieces
}

/// A piece of one point is a dash as long as a piece of the line.
pub(in crate::report) fn dash(piece: Vec<(f64, f64)>, width: f64) -> Vec<(f64, f64)> {
    match piece[..] {
        [(x, y)] => vec![(x - 0.5 * width, y), (x + 0.5 * width, y)],
        _ => piece,
    }
}

/// Length of such a dash, of the length of the axis.
pub(in crate::report) const DASH: f64 = 0.006;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_part_at_gaps_and_jumps_but_not_where_they_are_steep() {
        let lengths = |energies: &[f64]| -> Vec<usize> {
            let points: Vec<_> =
                energies.iter().enumerate().map(|(k, e)| (1.0 + 0.1 * k as f64, *e)).collect();
            parted(&points).iter().map(Vec::len).collect()
        };
        assert_eq!(lengths(&[1.0, 1.1, 1.2, 2.4, 2.5, 1.5]), [3, 2, 1]);
        assert_eq!(lengths(&[1.0, 1.3, 1.7, 2.3, 3.1]), [5]);
        let gap = [(1.0, 1.0), (1.1, 1.0), (1.2, 1.0), (1.4, 1.0), (1.5, 1.0)];
        assert_eq!(parted(&gap).iter().map(Vec::len).collect::<Vec<_>>(), [3, 2]);
    }
}
