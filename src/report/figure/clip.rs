//! Lines and areas end at the frame of a panel.

use std::ops::Range;

/// Where a panel ends: the ranges of its axes.
pub type Frame = (Range<f64>, Range<f64>);

/// The parts of a line within a frame: the panel would draw what is outside along its edges.
pub(crate) fn clipped(points: &[(f64, f64)], frame: &Frame) -> Vec<Vec<(f64, f64)>> {
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

/// The part of an area within a frame (Sutherland and Hodgman): one edge of the frame after the other cuts it.
pub(crate) fn clipped_area(outline: Vec<(f64, f64)>, (x, y): &Frame) -> Vec<(f64, f64)> {
    let edges =
        [(true, x.start, 1.0), (true, x.end, -1.0), (false, y.start, 1.0), (false, y.end, -1.0)];
    edges.into_iter().fold(outline, |outline, (across, edge, sign)| {
        let depth = |p: (f64, f64)| sign * (if across { p.0 } else { p.1 } - edge);
        let mut cut = vec![];
        for (k, &b) in outline.iter().enumerate() {
            let a = outline[(k + outline.len() - 1) % outline.len()];
            let (of_a, of_b) = (depth(a), depth(b));
            if (of_a < 0.0) != (of_b < 0.0) {
                let s = of_a / (of_a - of_b);
                cut.push((a.0 + s * (b.0 - a.0), a.1 + s * (b.1 - a.1)));
            }
            if of_b >= 0.0 {
                cut.push(b);
            }
        }
        cut
    })
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

    #[test]
    fn areas_end_at_the_frame() {
        let frame = (0.0..1.0, 0.0..1.0);
        let triangle = vec![(0.5, -1.0), (1.5, 0.0), (0.5, 1.0)];
        let area = |p: &[(f64, f64)]| -> f64 {
            let next = p.iter().cycle().skip(1);
            p.iter().zip(next).map(|(a, b)| 0.5 * (a.0 * b.1 - b.0 * a.1)).sum()
        };
        assert!((area(&clipped_area(triangle.clone(), &frame)) - 0.375).abs() < 1e-12);
        assert!(clipped_area(triangle, &(2.0..3.0, 0.0..1.0)).is_empty());
    }
}
