//! Kinds of element: one row each of what it is, here and in the files of other programs. Its shape functions and its quadrature follow from its family and
//! its basis ([`crate::fem::shape`]).
//!
//! Nodes stand in the order of Gmsh: corners first (counter-clockwise in the plane; of a solid those of one face, then the opposite ones), then the middles of the
//! edges, of the faces, of the volume. A side of an element in the plane is a line, its ends first; a side of a solid is a face, an element of the plane by
//! itself, whose corners go round counter-clockwise seen from outside.

/// Kinds of element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ElementKind {
    /// Two nodes on a line.
    Bar2,
    /// Three corners of a triangle.
    Tri3,
    /// A triangle with nodes in the middle of its sides.
    Tri6,
    /// Four corners of a quadrilateral.
    Quad4,
    /// A quadrilateral with nodes in the middle of its sides.
    Quad8,
    /// The same with a node at its centre.
    Quad9,
    /// Four corners of a tetrahedron.
    Tet4,
    /// A tetrahedron with nodes in the middle of its edges.
    Tet10,
    /// Eight corners of a hexahedron.
    Hex8,
    /// A hexahedron with nodes in the middle of its edges.
    Hex20,
    /// The same with nodes in the middle of its faces and at its centre.
    Hex27,
    /// Six corners of a prism: a triangle at either end.
    Prism6,
    /// A prism with nodes in the middle of its edges.
    Prism15,
    /// The same with nodes in the middle of its quadrilaterals.
    Prism18,
}

/// What an element is in its local coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// `[−1, 1]^dim`: a bar, a quadrilateral, a hexahedron.
    Cube,
    /// `ξ_c ≥ 0`, `Σ ξ_c ≤ 1`: a triangle, a tetrahedron.
    Simplex,
    /// A triangle times `[−1, 1]`.
    Prism,
}

/// What the shape functions of a family span.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// One function a corner.
    Linear,
    /// Quadratic along the edges, with nodes on corners and edges only.
    Serendipity,
    /// All of second order: of a simplex the quadratic polynomials, of a cube their products, of a prism those of its triangle times those along it.
    Quadratic,
}

/// What a kind of element is.
#[derive(Debug)]
struct Row {
    kind: ElementKind,
    name: &'static str,
    family: Family,
    basis: Basis,
    dim: usize,
    nodes: usize,
    corners: usize,
    /// Local nodes: of the end of a bar; of a line its ends, then its middle; of a face those of the plane element that it is, in its order.
    sides: &'static [&'static [usize]],
    /// Pairs of nodes whose exchange turns the element inside out and back.
    mirror: &'static [(usize, usize)],
    /// Number and name in Gmsh.
    gmsh: (usize, &'static str),
    /// Number in VTK.
    vtk: u8,
    /// Number and name in XDMF.
    xdmf: (i64, &'static str),
    /// The local node that stands at each place in VTK and XDMF; empty: as they are.
    order: &'static [usize],
    /// Of plane elements: the triangles and quadrilaterals of which they are drawn.
    pieces: &'static [&'static [usize]],
}

const ROWS: [Row; 14] = {
    use Basis::{Linear, Quadratic, Serendipity};
    use ElementKind::*;
    use Family::{Cube, Prism, Simplex};
    const fn row(
        kind: ElementKind,
        name: &'static str,
        (family, basis): (Family, Basis),
        [dim, nodes, corners]: [usize; 3],
        sides: &'static [&'static [usize]],
    ) -> Row {
        Row {
            kind,
            name,
            family,
            basis,
            dim,
            nodes,
            corners,
            sides,
            mirror: &[],
            gmsh: (0, ""),
            vtk: 0,
            xdmf: (0, ""),
            order: &[],
            pieces: &[],
        }
    }
    [
        Row {
            mirror: &[(0, 1)],
            gmsh: (1, "line of 2 nodes"),
            vtk: 3,
            xdmf: (2, "Polyline\" NodesPerElement=\"2"),
            ..row(Bar2, "bar", (Cube, Linear), [1, 2, 2], &ENDS)
        },
        Row {
            mirror: &[(1, 2)],
            gmsh: (2, "triangle of 3 nodes"),
            vtk: 5,
            xdmf: (4, "Triangle"),
            pieces: &[&[0, 1, 2]],
            ..row(Tri3, "T3", (Simplex, Linear), [2, 3, 3], &TRIANGLE)
        },
        Row {
            mirror: &[(1, 2), (3, 5)],
            gmsh: (9, "triangle of 6 nodes"),
            vtk: 22,
            xdmf: (36, "Triangle_6"),
            pieces: &[&[0, 3, 5], &[3, 1, 4], &[5, 4, 2], &[3, 4, 5]],
            ..row(Tri6, "T6", (Simplex, Quadratic), [2, 6, 3], &TRIANGLE_2)
        },
        Row {
            mirror: &[(1, 3)],
            gmsh: (3, "quadrilateral of 4 nodes"),
            vtk: 9,
            xdmf: (5, "Quadrilateral"),
            pieces: &[&[0, 1, 2, 3]],
            ..row(Quad4, "Q4", (Cube, Linear), [2, 4, 4], &SQUARE)
        },
        Row {
            mirror: &[(1, 3), (4, 7), (5, 6)],
            gmsh: (16, "quadrilateral of 8 nodes"),
            vtk: 23,
            xdmf: (37, "Quadrilateral_8"),
            pieces: &[&[0, 4, 7], &[4, 1, 5], &[5, 2, 6], &[6, 3, 7], &[4, 5, 6, 7]],
            ..row(Quad8, "Q8", (Cube, Serendipity), [2, 8, 4], &SQUARE_2)
        },
        Row {
            mirror: &[(1, 3), (4, 7), (5, 6)],
            gmsh: (10, "quadrilateral of 9 nodes"),
            vtk: 28,
            xdmf: (35, "Quadrilateral_9"),
            pieces: &[&[0, 4, 8, 7], &[4, 1, 5, 8], &[8, 5, 2, 6], &[7, 8, 6, 3]],
            ..row(Quad9, "Q9", (Cube, Quadratic), [2, 9, 4], &SQUARE_2)
        },
        Row {
            mirror: &[(1, 2)],
            gmsh: (4, "tetrahedron of 4 nodes"),
            vtk: 10,
            xdmf: (6, "Tetrahedron"),
            ..row(Tet4, "Tet4", (Simplex, Linear), [3, 4, 4], &TETRAHEDRON)
        },
        Row {
            mirror: &[(1, 2), (4, 6), (8, 9)],
            gmsh: (11, "tetrahedron of 10 nodes"),
            vtk: 24,
            xdmf: (38, "Tetrahedron_10"),
            // the last two edges change places
            order: &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
            ..row(Tet10, "Tet10", (Simplex, Quadratic), [3, 10, 4], &TETRAHEDRON_2)
        },
        Row {
            mirror: HEXAHEDRON_MIRROR.split_at(4).0,
            gmsh: (5, "hexahedron of 8 nodes"),
            vtk: 12,
            xdmf: (9, "Hexahedron"),
            ..row(Hex8, "Hex8", (Cube, Linear), [3, 8, 8], &HEXAHEDRON_1)
        },
        Row {
            mirror: HEXAHEDRON_MIRROR.split_at(8).0,
            gmsh: (17, "hexahedron of 20 nodes"),
            vtk: 25,
            xdmf: (48, "Hexahedron_20"),
            order: HEXAHEDRON_ORDER.split_at(20).0,
            ..row(Hex20, "Hex20", (Cube, Serendipity), [3, 20, 8], &HEXAHEDRON_2)
        },
        Row {
            mirror: &HEXAHEDRON_MIRROR,
            gmsh: (12, "hexahedron of 27 nodes"),
            vtk: 29,
            xdmf: (50, "Hexahedron_27"),
            order: &HEXAHEDRON_ORDER,
            ..row(Hex27, "Hex27", (Cube, Quadratic), [3, 27, 8], &HEXAHEDRON_3)
        },
        Row {
            mirror: PRISM_MIRROR.split_at(2).0,
            gmsh: (6, "prism of 6 nodes"),
            vtk: 13,
            xdmf: (8, "Wedge"),
            ..row(Prism6, "Prism6", (Prism, Linear), [3, 6, 6], &PRISM_1)
        },
        Row {
            mirror: PRISM_MIRROR.split_at(5).0,
            gmsh: (18, "prism of 15 nodes"),
            vtk: 26,
            xdmf: (40, "Wedge_15"),
            order: PRISM_ORDER.split_at(15).0,
            ..row(Prism15, "Prism15", (Prism, Serendipity), [3, 15, 6], &PRISM_2)
        },
        Row {
            mirror: &PRISM_MIRROR,
            gmsh: (13, "prism of 18 nodes"),
            vtk: 32,
            xdmf: (41, "Wedge_18"),
            order: &PRISM_ORDER,
            ..row(Prism18, "Prism18", (Prism, Quadratic), [3, 18, 6], &PRISM_3)
        },
    ]
};

/// The ends of a bar.
const ENDS: [&[usize]; 2] = [&[0], &[1]];
/// The sides of a triangle, counter-clockwise.
const TRIANGLE: [&[usize]; 3] = [&[0, 1], &[1, 2], &[2, 0]];
const TRIANGLE_2: [&[usize]; 3] = [&[0, 1, 3], &[1, 2, 4], &[2, 0, 5]];
/// Bottom, right, top and left of a quadrilateral, along the increasing coordinate.
const SQUARE: [&[usize]; 4] = [&[0, 1], &[1, 2], &[3, 2], &[0, 3]];
const SQUARE_2: [&[usize]; 4] = [&[0, 1, 4], &[1, 2, 5], &[3, 2, 6], &[0, 3, 7]];
/// The faces of a tetrahedron.
const TETRAHEDRON: [&[usize]; 4] = [&[0, 2, 1], &[0, 1, 3], &[0, 3, 2], &[1, 2, 3]];
const TETRAHEDRON_2: [&[usize]; 4] =
    [&[0, 2, 1, 6, 5, 4], &[0, 1, 3, 4, 9, 7], &[0, 3, 2, 7, 8, 6], &[1, 2, 3, 5, 8, 9]];
/// The faces of a hexahedron: corners, middles of their edges, their centre.
const HEXAHEDRON: [&[usize]; 6] = [
    &[0, 3, 2, 1, 9, 13, 11, 8, 20],
    &[0, 1, 5, 4, 8, 12, 16, 10, 21],
    &[0, 4, 7, 3, 10, 17, 15, 9, 22],
    &[1, 2, 6, 5, 11, 14, 18, 12, 23],
    &[2, 3, 7, 6, 13, 15, 19, 14, 24],
    &[4, 5, 6, 7, 16, 18, 19, 17, 25],
];
/// The ends of a prism and its three quadrilaterals.
const PRISM: [&[usize]; 5] = [
    &[0, 2, 1, 7, 9, 6],
    &[3, 4, 5, 12, 14, 13],
    &[0, 1, 4, 3, 6, 10, 12, 8, 15],
    &[0, 3, 5, 2, 8, 13, 11, 7, 16],
    &[1, 2, 5, 4, 9, 11, 14, 10, 17],
];
/// The first so many nodes of each triangle, and of each quadrilateral.
const fn faces<const N: usize>(
    of: [&'static [usize]; N],
    [three, four]: [usize; 2],
) -> [&'static [usize]; N] {
    let mut all: [&[usize]; N] = [&[]; N];
    let mut k = 0;
    while k < N {
        let n = if of[k].len() == 6 { three } else { four };
        all[k] = of[k].split_at(n).0;
        k += 1;
    }
    all
}
const HEXAHEDRON_1: [&[usize]; 6] = faces(HEXAHEDRON, [3, 4]);
const HEXAHEDRON_2: [&[usize]; 6] = faces(HEXAHEDRON, [6, 8]);
const HEXAHEDRON_3: [&[usize]; 6] = faces(HEXAHEDRON, [6, 9]);
const PRISM_1: [&[usize]; 5] = faces(PRISM, [3, 4]);
const PRISM_2: [&[usize]; 5] = faces(PRISM, [6, 8]);
const PRISM_3: [&[usize]; 5] = faces(PRISM, [6, 9]);
/// Opposite nodes of a hexahedron, bottom and top.
const HEXAHEDRON_MIRROR: [(usize, usize); 9] =
    [(0, 4), (1, 5), (2, 6), (3, 7), (8, 16), (9, 17), (11, 18), (13, 19), (20, 25)];
/// Two edges of the triangles of a prism.
const PRISM_MIRROR: [(usize, usize); 6] = [(1, 2), (4, 5), (6, 7), (10, 11), (12, 13), (15, 16)];
/// Edges around the bottom, around the top, upright; faces −x, +x, −y, +y, −z, +z.
const HEXAHEDRON_ORDER: [usize; 27] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25,
    26,
];
/// Edges around the bottom, around the top, upright; quadrilaterals around.
const PRISM_ORDER: [usize; 18] = [0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16];

impl ElementKind {
    /// All kinds.
    pub const ALL: [ElementKind; ROWS.len()] = {
        let mut all = [ElementKind::Bar2; ROWS.len()];
        let mut k = 0;
        while k < ROWS.len() {
            all[k] = ROWS[k].kind;
            k += 1;
        }
        all
    };

    fn row(self) -> &'static Row {
        static TABLE: [Row; ROWS.len()] = ROWS;
        &TABLE[self as usize]
    }

    /// The kind that fills so many dimensions (a body on a line: 1) with so many nodes.
    pub fn of_nodes(dim: usize, nodes: usize) -> Option<ElementKind> {
        ElementKind::ALL.into_iter().find(|k| k.dim() == dim && k.nodes() == nodes)
    }

    /// Short name: triangles, quadrilaterals, tetrahedra, hexahedra and prisms by their number of nodes.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// What it is in its local coordinates.
    pub fn family(self) -> Family {
        self.row().family
    }

    /// What its shape functions span.
    pub fn basis(self) -> Basis {
        self.row().basis
    }

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        self.row().nodes
    }

    /// Number of corners: the first nodes.
    pub fn corners(self) -> usize {
        self.row().corners
    }

    /// Number of sides.
    pub fn sides(self) -> usize {
        self.row().sides.len()
    }

    /// Space that it fills: 1, 2 or 3.
    pub fn dim(self) -> usize {
        self.row().dim
    }

    /// Degree of the polynomials that its shape functions hold.
    pub fn order(self) -> usize {
        if self.is_quadratic() { 2 } else { 1 }
    }

    /// Second order: nodes besides its corners.
    pub fn is_quadratic(self) -> bool {
        self.basis() != Basis::Linear
    }

    /// The element of first order with the same corners.
    pub fn linear(self) -> ElementKind {
        let own = |k: &ElementKind| (k.family(), k.dim()) == (self.family(), self.dim());
        ElementKind::ALL.into_iter().find(own).unwrap_or(self)
    }

    /// Local nodes of a side: the end of a bar; the ends of a line, then its middle; the nodes of a face in the order of its kind.
    pub fn side(self, side: usize) -> &'static [usize] {
        self.row().sides[side]
    }

    /// The element of the plane that a face of a solid is.
    pub fn face(self, side: usize) -> Option<ElementKind> {
        (self.dim() == 3).then(|| ElementKind::of_nodes(2, self.side(side).len())).flatten()
    }

    /// How many of the nodes of a side are its ends or corners.
    pub(crate) fn side_corners(self, side: usize) -> usize {
        self.face(side).map_or(self.dim(), ElementKind::corners)
    }

    /// Exchange the nodes so that an element that is inside out is not.
    pub(crate) fn turn_round(self, nodes: &mut [usize]) {
        self.row().mirror.iter().for_each(|&(a, b)| nodes.swap(a, b));
    }

    /// Number and name in Gmsh.
    pub fn gmsh(self) -> (usize, &'static str) {
        self.row().gmsh
    }

    /// Number in VTK.
    pub fn vtk(self) -> u8 {
        self.row().vtk
    }

    /// Number and name in XDMF.
    pub fn xdmf(self) -> (i64, &'static str) {
        self.row().xdmf
    }

    /// The nodes of an element in the order of VTK and XDMF.
    pub fn ordered(self, nodes: &[usize]) -> Vec<i64> {
        let order = self.row().order;
        let place = |k: usize| nodes[order.get(k).copied().unwrap_or(k)] as i64;
        (0..nodes.len()).map(place).collect()
    }

    /// The triangles and quadrilaterals of which a plane element is drawn, by its local nodes.
    pub fn pieces(self) -> &'static [&'static [usize]] {
        self.row().pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_stands_in_its_own_row() {
        for (k, kind) in ElementKind::ALL.into_iter().enumerate() {
            assert_eq!(
                (kind as usize, ElementKind::of_nodes(kind.dim(), kind.nodes())),
                (k, Some(kind))
            );
            assert!(kind.gmsh().0 > 0 && kind.vtk() > 0 && kind.xdmf().0 > 0, "{kind:?}");
            assert_eq!(kind.linear().nodes(), kind.corners());
            let mut order = kind.ordered(&(0..kind.nodes()).collect::<Vec<_>>());
            order.sort_unstable();
            assert!(order.iter().enumerate().all(|(k, n)| *n == k as i64), "{kind:?}");
            assert!((0..kind.sides()).all(|s| kind.dim() < 3 || kind.face(s).is_some()));
            assert_eq!(kind.pieces().is_empty(), kind.dim() != 2);
        }
    }
}
