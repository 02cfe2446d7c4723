//! Fields between the nodes of a mesh: by the shape functions of the element that a point lies in.

use nalgebra::{Matrix3, Vector3};

use super::shape::{self, Local};
use crate::mesh::{ElementKind, Mesh, Point, bounds};

/// The nodes of the element that a point lies in, with their weights.
pub type Cell = Vec<(usize, f64)>;

/// An element: its kind and its nodes.
pub type Cells = [(ElementKind, Vec<usize>)];

/// How far, in local coordinates, a point may lie outside: straight sides cut off what is curved.
const OUTSIDE: f64 = 0.2;

/// How far into one of its own elements a node is looked up: surfaces that touch, and the lips of cracks, have nodes at one place.
const INWARDS: f64 = 1e-6;

/// Where the nodes of a mesh lie among the elements of another one of the same body; none if the two cover different regions.
pub fn cells(mesh: &Mesh, nodes: &[Point], elements: &Cells) -> Option<Vec<Cell>> {
    let mut inside = mesh.nodes().to_vec();
    for element in mesh.elements() {
        let share = INWARDS / element.nodes.len() as f64;
        for &n in element.nodes {
            let own = mesh.nodes()[n];
            let towards = |c: usize| -> f64 {
                element.nodes.iter().map(|&m| mesh.nodes()[m][c] - own[c]).sum()
            };
            inside[n] = std::array::from_fn(|c| own[c] + share * towards(c));
        }
    }
    cells_at(mesh.nodes(), &inside, nodes, elements)
}

/// Where points lie among elements, each in the one that has its second place.
fn cells_at(
    points: &[Point],
    inside: &[Point],
    nodes: &[Point],
    elements: &Cells,
) -> Option<Vec<Cell>> {
    let (a, b) = (bounds(points), bounds(nodes));
    let size = (0..3).fold(0.0f64, |m, c| m.max(a[1][c] - a[0][c]));
    let near = |k: usize| (0..3).all(|c| (a[k][c] - b[k][c]).abs() <= 1e-9 * size);
    if !near(0) || !near(1) {
        return None;
    }
    let boxes: Vec<[Point; 2]> =
        elements.iter().map(|(_, e)| bounds(e.iter().map(|&n| &nodes[n]))).collect();
    let cell = |(p, near): (&Point, &Point)| -> Option<Cell> {
        let is_in = |[low, high]: &[Point; 2]| {
            let slack = OUTSIDE * (0..3).fold(1e-9 * size, |m, c| m.max(high[c] - low[c]));
            (0..3).all(|c| near[c] >= low[c] - slack && near[c] <= high[c] + slack)
        };
        let of_element = |k: usize| elements[k].1.iter().map(|&n| nodes[n]).collect::<Vec<Point>>();
        let mut best: Option<(f64, usize)> = None;
        for k in (0..elements.len()).filter(|&k| is_in(&boxes[k])) {
            let kind = elements[k].0;
            let Some(local) = local_of(kind, &of_element(k), near) else { continue };
            let off = shape::outside(kind, local);
            if best.is_none_or(|(least, _)| off < least) {
                best = Some((off, k));
            }
            if off <= 1e-9 {
                break;
            }
        }
        let (_, k) = best.filter(|(off, _)| *off <= OUTSIDE)?;
        let (kind, own) = &elements[k];
        let local = local_of(*kind, &of_element(k), p)?;
        Some(own.iter().copied().zip(shape::values(*kind, local)).collect())
    };
    points.iter().zip(inside).map(cell).collect()
}

/// An element that a place lies in.
#[derive(Debug, Clone)]
pub struct Inside {
    /// Which one.
    pub element: usize,
    /// The place in it.
    pub local: Local,
    /// Its nodes, with their weights there.
    pub weights: Cell,
}

/// The elements that a place lies in; where it lies in none, the one that it is nearest to by a hair.
pub fn elements_at(place: &Point, nodes: &[Point], elements: &Cells) -> Vec<Inside> {
    let mut found: Vec<(f64, Inside)> = vec![];
    for (element, (kind, own)) in elements.iter().enumerate() {
        let x: Vec<Point> = own.iter().map(|&n| nodes[n]).collect();
        let [low, high] = bounds(&x);
        let size = (0..3).fold(0.0f64, |m, c| m.max(high[c] - low[c]));
        if (0..3).any(|c| place[c] < low[c] - EDGE * size || place[c] > high[c] + EDGE * size) {
            continue;
        }
        let Some(local) = local_of(*kind, &x, place) else { continue };
        let off = shape::outside(*kind, local);
        if off <= EDGE {
            let weights = own.iter().copied().zip(shape::values(*kind, local)).collect();
            found.push((off, Inside { element, local, weights }));
        }
    }
    // curved sides are cut off by straight ones: what lies inside some element lies on no edge of another
    let inside = found.iter().any(|(off, _)| *off <= WITHIN);
    found.into_iter().filter(|(off, _)| !inside || *off <= WITHIN).map(|(_, of)| of).collect()
}

/// Whether surfaces that touch, or the lips of a crack, meet where these elements do. Neighbours share the nodes of their side, which have all of the weight.
pub fn is_between_surfaces(found: &[Inside]) -> bool {
    let Some(first) = found.first() else { return false };
    let is_own = |n: usize| first.weights.iter().any(|(own, _)| *own == n);
    let elsewhere = |of: &Inside| -> f64 {
        of.weights.iter().filter(|(n, _)| !is_own(*n)).map(|(_, w)| w.abs()).sum()
    };
    found.iter().any(|of| elsewhere(of) > APART)
}

/// A share of an interpolation that comes from nodes which the element of a place does not have: beyond it the two are not neighbours.
const APART: f64 = 0.01;

/// How far outside, in local coordinates, a place that somebody wrote down may lie.
const EDGE: f64 = 1e-3;
/// What is inside but for rounding.
const WITHIN: f64 = 1e-9;

/// Local coordinates of a place, by Newton's method; none where it does not come to rest.
fn local_of(kind: ElementKind, x: &[Point], p: &Point) -> Option<Local> {
    let dim = kind.dim();
    let mut local = shape::centre(kind);
    for _ in 0..20 {
        let (values, gradients) = (shape::values(kind, local), shape::gradients(kind, local));
        // axes that the element does not fill stay
        let mut j = Matrix3::<f64>::identity();
        let mut rest = Vector3::zeros();
        for c in 0..dim {
            rest[c] = p[c] - values.iter().zip(x).map(|(v, x)| v * x[c]).sum::<f64>();
            for d in 0..dim {
                j[(c, d)] = gradients.iter().zip(x).map(|(g, x)| g[d] * x[c]).sum();
            }
        }
        let step = j.lu().solve(&rest)?;
        local = std::array::from_fn(|c| local[c] + step[c]);
        let size = step.amax();
        if size >= 1e3 || size.is_nan() {
            return None;
        }
        if size < 1e-13 {
            return Some(local);
        }
    }
    None
}

/// A field of `dim` components a node at points among the elements.
pub fn at_cells(field: &[f64], cells: &[Cell], dim: usize) -> Vec<f64> {
    let at = |cell: &Cell, c: usize| cell.iter().map(|(n, w)| w * field[dim * n + c]).sum::<f64>();
    cells.iter().flat_map(|cell| (0..dim).map(move |c| at(cell, c))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::structured::{bar, rectangle};

    fn elements(m: &Mesh) -> Vec<(ElementKind, Vec<usize>)> {
        m.elements().map(|e| (e.kind, e.nodes.to_vec())).collect()
    }

    #[test]
    fn bilinear_fields_are_their_own_interpolation() {
        let (coarse, fine) = (rectangle(2.0, 1.0, 3, 2), rectangle(2.0, 1.0, 7, 5));
        let f = |p: &Point| 1.0 + 2.0 * p[0] - p[1] + 0.5 * p[0] * p[1];
        let field: Vec<f64> = coarse.nodes().iter().flat_map(|p| [f(p), -f(p)]).collect();
        let found = cells(&fine, coarse.nodes(), &elements(&coarse)).unwrap_or_default();
        let values = at_cells(&field, &found, 2);
        for (k, p) in fine.nodes().iter().enumerate() {
            assert!((values[2 * k] - f(p)).abs() < 1e-14 && values[2 * k + 1] == -values[2 * k]);
        }
        let other = rectangle(2.0, 1.1, 3, 2);
        assert!(cells(&other, coarse.nodes(), &elements(&coarse)).is_none());
        let (short, long) = (bar(1.0, 3), bar(1.1, 4));
        assert!(cells(&short, long.nodes(), &elements(&long)).is_none());
    }

    /// Two plates that touch and move apart: nodes at one place keep to their own side.
    #[test]
    fn surfaces_that_touch_are_told_apart() {
        let both = |nx: usize, ny: usize| {
            let right = rectangle(0.5, 1.0, nx, ny + 1).moved(|[x, y, z]| [x + 1.0, y, z]);
            Mesh::joined(&[("a", rectangle(1.0, 1.0, nx, ny)), ("b", right)], &[0, 1])
        };
        let (coarse, fine) = (both(2, 2), both(5, 4));
        let left = |m: &Mesh, n: usize| m.parts()[n] == 0;
        let f = |m: &Mesh, n: usize| if left(m, n) { m.nodes()[n][0] } else { 7.0 };
        let field: Vec<f64> = (0..coarse.n_nodes()).map(|n| f(&coarse, n)).collect();
        let found = cells(&fine, coarse.nodes(), &elements(&coarse)).unwrap_or_default();
        for (n, v) in at_cells(&field, &found, 1).into_iter().enumerate() {
            assert!((v - f(&fine, n)).abs() < 1e-13, "{n}: {v}");
        }
    }

    /// Linear fields on turned meshes, quadratic ones on triangles of six nodes.
    #[test]
    fn fields_of_the_elements_are_their_own_interpolation() {
        let (sin, cos) = 0.7f64.sin_cos();
        let turn = |[x, y, _]: Point| [cos * x - sin * y, sin * x + cos * y, 0.0];
        let (coarse, fine) = (rectangle(2.0, 1.0, 3, 2), rectangle(2.0, 1.0, 7, 5));
        let (coarse, fine) = (coarse.moved(turn), fine.moved(turn));
        let f = |p: &Point| 1.0 + 2.0 * p[0] - p[1];
        let field: Vec<f64> = coarse.nodes().iter().map(f).collect();
        let found = cells(&fine, coarse.nodes(), &elements(&coarse)).unwrap_or_default();
        for (p, v) in fine.nodes().iter().zip(at_cells(&field, &found, 1)) {
            assert!((v - f(p)).abs() < 1e-13);
        }
        let nodes: Vec<Point> =
            [[0.0, 0.0], [2.0, 0.3], [0.4, 1.1], [1.0, 0.15], [1.2, 0.7], [0.2, 0.55]]
                .map(|[x, y]| [x, y, 0.0])
                .to_vec();
        let g = |p: &Point| p[0] * p[0] - 0.7 * p[0] * p[1] + 2.0 * p[1] * p[1];
        let field: Vec<f64> = nodes.iter().map(g).collect();
        let triangle = [(ElementKind::Tri6, (0..6).collect::<Vec<usize>>())];
        let mut points = nodes[..3].to_vec();
        points.extend([[0.8, 0.4, 0.0], [0.5, 0.6, 0.0]]);
        let found = cells_at(&points, &points, &nodes, &triangle).unwrap_or_default();
        for (p, v) in points.iter().zip(at_cells(&field, &found, 1)) {
            assert!((v - g(p)).abs() < 1e-13, "{v} {}", g(p));
        }
    }
}
