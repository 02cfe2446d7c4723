//! Corners of a body in the plane that point inwards: stresses there grow without limit under refinement, and errors fall slower than anywhere else.

use std::collections::BTreeMap;

use super::{Mesh, Point};

/// Interior angles beyond this, in degrees, are inward corners, and no facets of a smooth curve.
const INWARDS: f64 = 200.0;

/// The nodes of inward corners, tips of cracks included; none of bodies in space.
pub fn reentrant(mesh: &Mesh) -> Vec<usize> {
    if mesh.dim() != 2 {
        return vec![];
    }
    let mut angle: BTreeMap<usize, f64> = BTreeMap::new();
    let mut sides: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    for e in mesh.elements() {
        let corners = &e.nodes[..e.kind.corners()];
        let count = corners.len();
        for k in 0..count {
            let [before, own, next] =
                [corners[(k + count - 1) % count], corners[k], corners[(k + 1) % count]];
            let away = |n: usize| -> Point {
                std::array::from_fn(|c| mesh.nodes()[n][c] - mesh.nodes()[own][c])
            };
            let (a, b) = (away(next), away(before));
            let (cross, dot) = (a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
            *angle.entry(own).or_insert(0.0) += cross.atan2(dot).to_degrees().abs();
            *sides.entry([own.min(next), own.max(next)]).or_insert(0) += 1;
        }
    }
    let mut found: Vec<usize> =
        sides.iter().filter(|(_, count)| **count == 1).flat_map(|(s, _)| *s).collect();
    found.sort_unstable();
    found.dedup();
    found.retain(|n| angle[n] > INWARDS);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, ElementKind, structured};

    #[test]
    fn an_l_has_one_and_a_plate_none() {
        let plate = structured::rectangle(2.0, 2.0, 4, 4);
        assert!(reentrant(&plate).is_empty());
        let whole: Vec<&[usize]> = plate.elements().map(|e| e.nodes).collect();
        let is_cut = |e: &&&[usize]| {
            e.iter().all(|&n| plate.nodes()[n][0] > 0.9 && plate.nodes()[n][1] > 0.9)
        };
        let connectivity = whole.iter().filter(|e| !is_cut(e)).flat_map(|e| e.to_vec()).collect();
        let block = Block { kind: ElementKind::Quad4, region: 0, connectivity, congruent: false };
        let l = Mesh::new(2, plate.nodes().to_vec(), vec![block], BTreeMap::new());
        let found = reentrant(&l);
        assert_eq!(found.len(), 1);
        assert_eq!(l.nodes()[found[0]][..2], [1.0, 1.0]);
    }
}
