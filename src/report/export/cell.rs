//! How other programs call the kinds of element, and in which order they count the nodes.

use crate::mesh::ElementKind;

/// An element in the words of VTK and XDMF.
#[derive(Debug)]
pub(super) struct CellType {
    /// VTK's number.
    pub vtk: u8,
    /// XDMF's number.
    pub xdmf: i64,
    /// XDMF's name.
    pub name: &'static str,
    /// The local node that stands at each place; empty: as they are.
    order: &'static [usize],
}

/// The last two edges of a tetrahedron change places.
const TETRAHEDRON: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
/// Edges around the bottom, around the top, upright; faces −x, +x, −y, +y, −z, +z.
const HEXAHEDRON: [usize; 27] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25,
    26,
];

impl CellType {
    pub fn of(kind: ElementKind) -> CellType {
        let cell = |vtk, xdmf, name, order| CellType { vtk, xdmf, name, order };
        match kind {
            ElementKind::Bar2 => cell(3, 2, "Polyline\" NodesPerElement=\"2", &[]),
            ElementKind::Tri3 => cell(5, 4, "Triangle", &[]),
            ElementKind::Tri6 => cell(22, 36, "Triangle_6", &[]),
            ElementKind::Quad4 => cell(9, 5, "Quadrilateral", &[]),
            ElementKind::Quad8 => cell(23, 37, "Quadrilateral_8", &[]),
            ElementKind::Quad9 => cell(28, 35, "Quadrilateral_9", &[]),
            ElementKind::Tet4 => cell(10, 6, "Tetrahedron", &[]),
            ElementKind::Tet10 => cell(24, 38, "Tetrahedron_10", &TETRAHEDRON),
            ElementKind::Hex8 => cell(12, 9, "Hexahedron", &[]),
            ElementKind::Hex20 => cell(25, 48, "Hexahedron_20", &HEXAHEDRON),
            ElementKind::Hex27 => cell(29, 50, "Hexahedron_27", &HEXAHEDRON),
        }
    }

    /// The nodes of an element in the order of these programs.
    pub fn ordered(&self, nodes: &[usize]) -> Vec<i64> {
        let place = |k: usize| nodes[self.order.get(k).copied().unwrap_or(k)] as i64;
        (0..nodes.len()).map(place).collect()
    }
}
