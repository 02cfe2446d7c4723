//! Linear triangles and tetrahedra in slender bodies: their strain is constant, so that a few of them through the thickness do not bend.
//!
//! From the middle of every side of the boundary a ray goes through the body along the inward normal. Its length is the thickness there, and
//! `∫ ds / extent` the number of elements through it, the extent that of the element which the ray crosses, along the ray.

use std::collections::BTreeMap;

use super::{ElementKind, Mesh, Point};

/// Four elements through the thickness leave 7 to 12 % in the frequency of a cantilever, two of them 26 to 44 %; less than this number are too few.
const ENOUGH: f64 = 3.5;
/// A thickness is one of a slender body below this part of its largest extent.
const SLENDER: f64 = 0.25;
/// Least cosine between a ray and the outward normal where it leaves: walls that are not parallel make no thickness.
const PARALLEL: f64 = 0.9;
/// Part of the boundary that has to be slender.
const PART: f64 = 0.25;
/// At most so many rays, and crossed elements of each.
const RAYS: usize = 4000;
const CROSSED: usize = 1000;

/// Too few linear elements through the thickness of a slender body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiff {
    /// Kind of the elements.
    pub kind: ElementKind,
    /// How many there are through the thickness, on the average over what is slender.
    pub layers: f64,
}

impl std::fmt::Display for Stiff {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:.1} linear {} through the thickness of a slender body: far too stiff in bending (frequencies by tens of per cent); take elements of second order (Mesh.ElementOrder = 2 in Gmsh), or compare with a finer mesh",
            self.layers,
            if self.kind == ElementKind::Tet4 { "tetrahedra" } else { "triangles" }
        )
    }
}

/// Whether a mesh bends badly, and why.
pub fn stiff_in_bending(mesh: &Mesh) -> Option<Stiff> {
    let kind = if mesh.dim() == 3 { ElementKind::Tet4 } else { ElementKind::Tri3 };
    // other elements beside them bear the bending
    if mesh.elements().any(|e| e.kind != kind) {
        return None;
    }
    let cells: Vec<&[usize]> = mesh.elements().map(|e| e.nodes).collect();
    let rays = Rays::new(mesh, cells)?;
    let limit = SLENDER * mesh.size().into_iter().fold(0.0, f64::max);
    let (mut all, mut thin, mut layers) = (0.0, 0.0, 0.0);
    for &(cell, side) in rays.boundary.iter().step_by(rays.boundary.len().div_ceil(RAYS).max(1)) {
        let Some(ray) = rays.through(cell, side) else { continue };
        let Ray { area, length, count, cosine } = ray;
        all += area;
        if length <= limit && count < ENOUGH && cosine >= PARALLEL {
            thin += area;
            layers += area * count;
        }
    }
    (thin > PART * all).then(|| Stiff { kind, layers: layers / thin })
}

/// A ray through the body.
struct Ray {
    /// Of the side where it begins.
    area: f64,
    /// Through the body.
    length: f64,
    /// Elements along it.
    count: f64,
    /// Between it and the outward normal at its end.
    cosine: f64,
}

/// Linear simplices, their neighbours, and their sides on the boundary: side `k` is opposite to corner `k`.
struct Rays<'m> {
    mesh: &'m Mesh,
    cells: Vec<&'m [usize]>,
    /// The cells of a side, by its nodes.
    sides: BTreeMap<Vec<usize>, Vec<usize>>,
    boundary: Vec<(usize, usize)>,
}

impl<'m> Rays<'m> {
    /// None without such elements.
    fn new(mesh: &'m Mesh, cells: Vec<&'m [usize]>) -> Option<Rays<'m>> {
        if cells.is_empty() {
            return None;
        }
        let mut sides: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
        for (c, nodes) in cells.iter().enumerate() {
            for k in 0..nodes.len() {
                sides.entry(opposite(nodes, k)).or_default().push(c);
            }
        }
        let all = cells.iter().enumerate().flat_map(|(c, n)| (0..n.len()).map(move |k| (c, k)));
        let boundary = all.filter(|&(c, k)| sides[&opposite(cells[c], k)].len() == 1).collect();
        Some(Rays { mesh, cells, sides, boundary })
    }

    /// Gradients of the barycentric coordinates of a cell, and its volume.
    fn gradients(&self, cell: usize) -> Option<(Vec<Point>, f64)> {
        let x: Vec<Point> = self.cells[cell].iter().map(|&n| self.mesh.nodes()[n]).collect();
        let of = |k: usize| difference(x[k], x[0]);
        match x.len() {
            3 => {
                let (a, b) = (of(1), of(2));
                let twice = a[0] * b[1] - a[1] * b[0];
                let first = [b[1] / twice, -b[0] / twice, 0.0];
                let second = [-a[1] / twice, a[0] / twice, 0.0];
                (twice != 0.0).then(|| (with_first(vec![first, second]), 0.5 * twice.abs()))
            }
            4 => {
                let (a, b, c) = (of(1), of(2), of(3));
                let six = dot(a, cross(b, c));
                let all = [cross(b, c), cross(c, a), cross(a, b)].map(|n| n.map(|x| x / six));
                (six != 0.0).then(|| (with_first(all.to_vec()), six.abs() / 6.0))
            }
            _ => None,
        }
    }

    /// The ray from the middle of a side of the boundary.
    fn through(&self, start: usize, side: usize) -> Option<Ray> {
        let (gradients, volume) = self.gradients(start)?;
        let steep = dot(gradients[side], gradients[side]).sqrt();
        let along = gradients[side].map(|x| x / steep);
        let corners = opposite(self.cells[start], side);
        let area = corners.len() as f64 * volume * steep;
        let mut at = [0.0; 3];
        for &n in &corners {
            for c in 0..3 {
                at[c] += self.mesh.nodes()[n][c] / corners.len() as f64;
            }
        }
        let (mut cell, mut entry) = (start, Some(corners));
        let (mut length, mut count) = (0.0, 0.0);
        for _ in 0..CROSSED {
            let nodes = self.cells[cell];
            let (gradients, _) = self.gradients(cell)?;
            // λ_k is 1 at corner k
            let leaves = |k: usize| {
                let rate = dot(gradients[k], along);
                let value = 1.0 + dot(gradients[k], difference(at, self.mesh.nodes()[nodes[k]]));
                let is_entry = entry.as_ref().is_some_and(|e| *e == opposite(nodes, k));
                (rate < 0.0 && !is_entry).then(|| ((-value / rate).max(0.0), k))
            };
            let (step, k) =
                (0..nodes.len()).filter_map(leaves).min_by(|a, b| a.0.total_cmp(&b.0))?;
            let places = nodes.iter().map(|&n| dot(self.mesh.nodes()[n], along));
            let (low, high) =
                places.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            length += step;
            count += step / (high - low);
            at = std::array::from_fn(|c| at[c] + step * along[c]);
            let out = opposite(nodes, k);
            match self.sides[&out].iter().find(|c| **c != cell) {
                Some(&next) => (cell, entry) = (next, Some(out)),
                None => {
                    let steep = dot(gradients[k], gradients[k]).sqrt();
                    let cosine = -dot(gradients[k], along) / steep;
                    return Some(Ray { area, length, count, cosine });
                }
            }
        }
        None
    }
}

/// The nodes of the side opposite to a corner, in ascending order.
fn opposite(nodes: &[usize], k: usize) -> Vec<usize> {
    let mut side: Vec<usize> = nodes.to_vec();
    side.remove(k);
    side.sort_unstable();
    side
}

/// The first gradient: all of them have the sum zero.
fn with_first(mut others: Vec<Point>) -> Vec<Point> {
    let first = std::array::from_fn(|c| -others.iter().map(|g| g[c]).sum::<f64>());
    others.insert(0, first);
    others
}

fn difference(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, structured};

    /// Rectangles of a plate, each in two triangles.
    fn triangles(size: [f64; 2], cells: [usize; 2]) -> Mesh {
        let plate = structured::rectangle(size[0], size[1], cells[0], cells[1]);
        let split = |e: &[usize]| [[e[0], e[1], e[2]], [e[0], e[2], e[3]]].concat();
        let connectivity = plate.elements().flat_map(|e| split(e.nodes)).collect();
        let block = Block { kind: ElementKind::Tri3, region: 0, connectivity, congruent: false };
        Mesh::new(2, plate.nodes().to_vec(), vec![block], BTreeMap::new())
    }

    #[test]
    fn few_triangles_through_a_slender_plate_are_noticed() {
        for (size, cells, wanted) in [
            ([10.0, 1.0], [20, 2], Some(2.0)),
            // long elements bend no better
            ([10.0, 1.0], [5, 3], Some(3.0)),
            ([1.0, 10.0], [1, 10], Some(1.0)),
            ([10.0, 1.0], [40, 4], None),
            // not slender
            ([2.0, 1.0], [4, 2], None),
        ] {
            let found = stiff_in_bending(&triangles(size, cells));
            match (found, wanted) {
                (None, None) => {}
                (Some(s), Some(layers)) => assert!((s.layers - layers).abs() < 1e-9, "{s:?}"),
                _ => panic!("{size:?} {cells:?}: {found:?}"),
            }
        }
        assert_eq!(stiff_in_bending(&structured::rectangle(10.0, 1.0, 20, 2)), None);
    }
}
