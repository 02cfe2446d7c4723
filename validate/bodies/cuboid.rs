//! Boxes of solid elements of every kind.

use std::collections::BTreeMap;

use signorini::fem::shape;
use signorini::mesh::{Block, ElementKind, Facet, Family, Mesh, Point};

/// The corners of a tetrahedron in a cube: along the axes in this order.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// A box `[0, size]` of so many cells along the axes, each one hexahedron, two prisms along z or six tetrahedra; inner nodes moved by `skew` of a cell, those of its
/// faces within them. Groups `xmin`, `xmax`, `ymin`, …
pub fn cuboid(kind: ElementKind, size: Point, cells: [usize; 3], skew: f64) -> Mesh {
    let [nx, ny, nz] = cells;
    let corner = |[i, j, k]: [usize; 3]| (i * (ny + 1) + j) * (nz + 1) + k;
    let mut nodes: Vec<Point> = vec![];
    for i in 0..=nx {
        for j in 0..=ny {
            for k in 0..=nz {
                let at = [i, j, k];
                let s: Point = std::array::from_fn(|c| at[c] as f64 / cells[c] as f64);
                nodes.push(std::array::from_fn(|c| {
                    let inner = at[c] > 0 && at[c] < cells[c];
                    let [a, b, d] = [[7.0, 5.0, 3.0], [4.0, 9.0, 6.0], [8.0, 2.0, 5.0]][c];
                    let wave = (a * s[0] + b * s[1] + d * s[2] + 0.3).sin();
                    let moved = if inner { skew * wave / cells[c] as f64 } else { 0.0 };
                    size[c] * (s[c] + moved)
                }));
            }
        }
    }
    let linear = kind.linear();
    let mut of_cells: Vec<Vec<usize>> = vec![];
    for (i, j, k) in (0..nx * ny * nz).map(|c| (c / (ny * nz), c / nz % ny, c % nz)) {
        let at = |d: [usize; 3]| corner([i + d[0], j + d[1], k + d[2]]);
        let square = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let upright = |around: &[usize]| -> Vec<usize> {
            let of = |k: usize| around.iter().map(move |&c| [square[c][0], square[c][1], k]);
            [0, 1].into_iter().flat_map(of).map(at).collect()
        };
        match kind.family() {
            Family::Cube => of_cells.push(upright(&[0, 1, 2, 3])),
            Family::Prism => of_cells.extend([upright(&[0, 1, 2]), upright(&[0, 2, 3])]),
            Family::Simplex => {}
        }
        if kind.family() != Family::Simplex {
            continue;
        }
        for path in PATHS {
            let mut place = [0; 3];
            let mut own = vec![at(place)];
            for axis in path {
                place[axis] = 1;
                own.push(at(place));
            }
            // odd paths are left-handed
            if [[0, 2, 1], [1, 0, 2], [2, 1, 0]].contains(&path) {
                own.swap(1, 2);
            }
            of_cells.push(own);
        }
    }
    // other nodes between the corners that know them
    let mut known: BTreeMap<Vec<usize>, usize> = (0..nodes.len()).map(|n| (vec![n], n)).collect();
    let mut connectivity = vec![];
    for own in &of_cells {
        for &local in shape::places(kind) {
            let weights = shape::values(linear, local);
            let of: Vec<(usize, f64)> =
                own.iter().copied().zip(weights).filter(|w| w.1 != 0.0).collect();
            let mut key: Vec<usize> = of.iter().map(|w| w.0).collect();
            key.sort_unstable();
            let node = *known.entry(key).or_insert_with(|| {
                let place = |c: usize| of.iter().map(|(n, w)| w * nodes[*n][c]).sum();
                nodes.push(std::array::from_fn(place));
                nodes.len() - 1
            });
            connectivity.push(node);
        }
    }
    let mut groups: BTreeMap<String, Vec<Facet>> = BTreeMap::new();
    for (element, own) in connectivity.chunks_exact(kind.nodes()).enumerate() {
        for side in 0..kind.sides() {
            for (axis, name) in ["x", "y", "z"].iter().enumerate() {
                for (end, at) in [("min", 0.0), ("max", size[axis])] {
                    let on = |l: &usize| (nodes[own[*l]][axis] - at).abs() < 1e-12 * size[axis];
                    if kind.side(side).iter().all(on) {
                        let facet = Facet { block: 0, element, side };
                        groups.entry(format!("{name}{end}")).or_default().push(facet);
                    }
                }
            }
        }
    }
    let block = Block { kind, region: 0, connectivity, congruent: false };
    Mesh::new(3, nodes, vec![block], groups)
}
