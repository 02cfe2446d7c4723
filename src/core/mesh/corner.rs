//! The corners of elements: which way they go round, and how far from regular they are.

use super::{ElementKind, Family, Point};

/// Of each corner of a hexahedron those at the other ends of its edges, so that the edges form a right-handed system.
const HEXAHEDRON: [[usize; 3]; 8] =
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]];
/// The same of a tetrahedron.
const TETRAHEDRON: [[usize; 3]; 4] = [[1, 2, 3], [2, 0, 3], [0, 1, 3], [0, 2, 1]];
/// The same of a prism.
const PRISM: [[usize; 3]; 6] = [[1, 2, 3], [2, 0, 4], [0, 1, 5], [5, 4, 0], [3, 5, 1], [4, 3, 2]];

/// The area or volume that the unit vectors along the edges of a corner span, with the sign of the Jacobian there: 1 where they are orthogonal.
pub fn span(kind: ElementKind, corners: &[Point], k: usize) -> f64 {
    let n = kind.corners();
    let towards = |e: usize| {
        let d: Point = std::array::from_fn(|c| corners[e][c] - corners[k][c]);
        let length = d[0].hypot(d[1]).hypot(d[2]);
        d.map(|x| x / length)
    };
    if kind.dim() == 2 {
        let (a, b) = (towards((k + 1) % n), towards((k + n - 1) % n));
        return a[0] * b[1] - a[1] * b[0];
    }
    let ends = match kind.family() {
        Family::Simplex => TETRAHEDRON[k],
        Family::Cube => HEXAHEDRON[k],
        Family::Prism => PRISM[k],
    };
    let [a, b, c] = ends.map(towards);
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// The least [`span`] of a cell's corners over that of the regular cell: 1 at best, not positive where it is folded.
pub fn quality(kind: ElementKind, corners: &[Point]) -> f64 {
    let regular = match (kind.family(), kind.dim()) {
        (Family::Cube, _) => 1.0,
        (Family::Simplex, 2) | (Family::Prism, _) => 0.75f64.sqrt(),
        (Family::Simplex, _) => 0.5f64.sqrt(),
    };
    let all = (0..kind.corners()).map(|k| span(kind, corners, k));
    all.fold(f64::INFINITY, f64::min) / regular
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_cells_have_quality_one_and_turn_with_their_nodes() {
        let root = |x: f64| x.sqrt();
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, root(0.75), 0.0]];
        let tetrahedron =
            [triangle[0], triangle[1], triangle[2], [0.5, root(1.0 / 12.0), root(2.0 / 3.0)]];
        let cube: Vec<Point> = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .iter()
            .map(|&(x, y)| [x, y, 0.0])
            .chain([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| [x, y, 1.0]))
            .collect();
        let prism: Vec<Point> =
            [0.0, 1.0].iter().flat_map(|&z| triangle.map(|[x, y, _]| [x, y, z])).collect();
        for (kind, x) in [
            (ElementKind::Prism6, &prism[..]),
            (ElementKind::Tri3, &triangle[..]),
            (ElementKind::Quad4, &cube[..4]),
            (ElementKind::Tet4, &tetrahedron),
            (ElementKind::Hex8, &cube),
        ] {
            assert!((quality(kind, x) - 1.0).abs() < 1e-15, "{kind:?}");
            let mut nodes: Vec<usize> = (0..x.len()).collect();
            kind.turn_round(&mut nodes);
            let turned: Vec<Point> = nodes.iter().map(|&n| x[n]).collect();
            assert!((0..x.len()).all(|k| span(kind, &turned, k) < -0.7), "{kind:?}");
        }
    }
}
