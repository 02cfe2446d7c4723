//! Lines end at the frame of a panel.

use std::ops::Range;

/// The parts of a line within a frame: the panel would draw what is outside along its edges.
pub(super) fn clipped(
    points: &[(f64, f64)],
    frame: &(Range<f64>, Range<f64>),
) -> Vec<Vec<(f64, f64)>> {
    let (x, y) = frame;
    let mut parts: Vec<Vec<(f64, f64)>> = vec![];
    let mut open = false;
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let d = (b.0 - a.0, b.1 - a.1);
        // the part from `low` to `high` of the way lies within all four edges
        let (mut low, mut high) = (0.0f64, 1.0f64);
        for (start, step, edge) in [(a.0, d.0, x), (a.1, d.1, y)] {
            if step == 0.0 {
                if start < edge.start || start > edge.end {
                    high = -1.0;
                }
                continue;
            }
            let (s, t) = ((edge.start - start) / step, (edge.end - start) / step);
            low = low.max(s.min(t));
            high = high.min(s.max(t));
        }
        if low >= high {
            open = false;
            continue;
        }
        let at = |s: f64| (a.0 + s * d.0, a.1 + s * d.1);
        match parts.last_mut() {
            Some(part) if open && low == 0.0 => part.push(at(high)),
            _ => parts.push(vec![at(low), at(high)]),
        }
        open = high == 1.0;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_the_frame() {
        let frame = (0.0..1.0, 0.0..1.0);
        let through =
            clipped(&[(-1.0, 0.5), (0.5, 0.5), (0.5, 2.0), (0.8, 2.0), (0.8, 0.0)], &frame);
        assert_eq!(
            through,
            [vec![(0.0, 0.5), (0.5, 0.5), (0.5, 1.0)], vec![(0.8, 1.0), (0.8, 0.0)]]
        );
        assert!(clipped(&[(-1.0, 2.0), (2.0, 2.0)], &frame).is_empty());
    }
}
