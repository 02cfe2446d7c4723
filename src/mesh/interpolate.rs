//! Fields between the nodes of a bar or a rectangle, along the axes: linear on two-node elements, bilinear on four-node ones.

use super::Point;

/// The nodes of the element that a point lies in, with their weights.
pub type Cell = Vec<(usize, f64)>;

/// Least and largest coordinates.
fn bounds<'p>(points: impl Iterator<Item = &'p Point>) -> [Point; 2] {
    points.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], p| {
        [std::array::from_fn(|c| low[c].min(p[c])), std::array::from_fn(|c| high[c].max(p[c]))]
    })
}

/// Where points lie among elements of `dim` dimensions; none if the points and the nodes cover different regions.
pub fn cells(
    points: &[Point],
    nodes: &[Point],
    elements: &[Vec<usize>],
    dim: usize,
) -> Option<Vec<Cell>> {
    let (a, b) = (bounds(points.iter()), bounds(nodes.iter()));
    let size = (0..dim).fold(0.0f64, |m, c| m.max(a[1][c] - a[0][c]));
    let slack = 1e-9 * size;
    let near = |k: usize| (0..dim).all(|c| (a[k][c] - b[k][c]).abs() <= slack);
    if !near(0) || !near(1) {
        return None;
    }
    let boxes: Vec<[Point; 2]> =
        elements.iter().map(|e| bounds(e.iter().map(|&n| &nodes[n]))).collect();
    let cell = |p: &Point| -> Option<Cell> {
        let inside = |[low, high]: &[Point; 2]| {
            (0..dim).all(|c| p[c] >= low[c] - slack && p[c] <= high[c] + slack)
        };
        let k = boxes.iter().position(inside)?;
        let [low, high] = boxes[k];
        let weight = |n: usize| -> f64 {
            let share = |c: usize| 1.0 - (p[c] - nodes[n][c]).abs() / (high[c] - low[c]);
            (0..dim).map(share).product()
        };
        Some(elements[k].iter().map(|&n| (n, weight(n))).collect())
    };
    points.iter().map(cell).collect()
}

/// A field of `dim` components a node at points among the elements.
pub fn at_cells(field: &[f64], cells: &[Cell], dim: usize) -> Vec<f64> {
    let at = |cell: &Cell, c: usize| cell.iter().map(|(n, w)| w * field[dim * n + c]).sum::<f64>();
    cells.iter().flat_map(|cell| (0..dim).map(move |c| at(cell, c))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::structured::{bar, rectangle};
    use super::*;

    #[test]
    fn bilinear_fields_are_their_own_interpolation() {
        let elements = |m: &super::super::Mesh| -> Vec<Vec<usize>> {
            m.elements().map(|e| e.nodes.to_vec()).collect()
        };
        let (coarse, fine) = (rectangle(2.0, 1.0, 3, 2), rectangle(2.0, 1.0, 7, 5));
        let f = |p: &Point| 1.0 + 2.0 * p[0] - p[1] + 0.5 * p[0] * p[1];
        let field: Vec<f64> = coarse.nodes().iter().flat_map(|p| [f(p), -f(p)]).collect();
        let found = cells(fine.nodes(), coarse.nodes(), &elements(&coarse), 2).unwrap_or_default();
        let values = at_cells(&field, &found, 2);
        for (k, p) in fine.nodes().iter().enumerate() {
            assert!((values[2 * k] - f(p)).abs() < 1e-14 && values[2 * k + 1] == -values[2 * k]);
        }
        let other = rectangle(2.0, 1.1, 3, 2);
        assert!(cells(other.nodes(), coarse.nodes(), &elements(&coarse), 2).is_none());
        let (short, long) = (bar(1.0, 3), bar(1.1, 4));
        assert!(cells(short.nodes(), long.nodes(), &elements(&long), 1).is_none());
    }
}
