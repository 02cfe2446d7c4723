//! Kinds of element: their nodes, corners and sides.
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
}

/// What a kind of element is.
struct Facts {
    name: &'static str,
    nodes: usize,
    corners: usize,
    dim: usize,
    sides: &'static [&'static [usize]],
    /// Of sides that are faces.
    face: Option<ElementKind>,
    /// Pairs of nodes whose exchange turns the element inside out and back.
    mirror: &'static [(usize, usize)],
}

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
const HEXAHEDRON: [[usize; 9]; 6] = [
    [0, 3, 2, 1, 9, 13, 11, 8, 20],
    [0, 1, 5, 4, 8, 12, 16, 10, 21],
    [0, 4, 7, 3, 10, 17, 15, 9, 22],
    [1, 2, 6, 5, 11, 14, 18, 12, 23],
    [2, 3, 7, 6, 13, 15, 19, 14, 24],
    [4, 5, 6, 7, 16, 18, 19, 17, 25],
];
/// The first so many nodes of each face of a hexahedron.
const fn faces(n: usize) -> [&'static [usize]; 6] {
    let mut all: [&[usize]; 6] = [&[]; 6];
    let mut k = 0;
    while k < 6 {
        all[k] = HEXAHEDRON[k].split_at(n).0;
        k += 1;
    }
    all
}
const HEXAHEDRON_1: [&[usize]; 6] = faces(4);
const HEXAHEDRON_2: [&[usize]; 6] = faces(8);
const HEXAHEDRON_3: [&[usize]; 6] = faces(9);

impl ElementKind {
    /// All kinds.
    pub const ALL: [ElementKind; 11] = [
        ElementKind::Bar2,
        ElementKind::Tri3,
        ElementKind::Tri6,
        ElementKind::Quad4,
        ElementKind::Quad8,
        ElementKind::Quad9,
        ElementKind::Tet4,
        ElementKind::Tet10,
        ElementKind::Hex8,
        ElementKind::Hex20,
        ElementKind::Hex27,
    ];

    fn facts(self) -> Facts {
        let of = |name, nodes, corners, dim, sides| Facts {
            name,
            nodes,
            corners,
            dim,
            sides,
            face: None,
            mirror: &[],
        };
        match self {
            ElementKind::Bar2 => of("bar", 2, 2, 1, &ENDS),
            ElementKind::Tri3 => Facts { mirror: &[(1, 2)], ..of("T3", 3, 3, 2, &TRIANGLE) },
            ElementKind::Tri6 => {
                Facts { mirror: &[(1, 2), (3, 5)], ..of("T6", 6, 3, 2, &TRIANGLE_2) }
            }
            ElementKind::Quad4 => Facts { mirror: &[(1, 3)], ..of("Q4", 4, 4, 2, &SQUARE) },
            ElementKind::Quad8 => {
                Facts { mirror: &[(1, 3), (4, 7), (5, 6)], ..of("Q8", 8, 4, 2, &SQUARE_2) }
            }
            ElementKind::Quad9 => {
                Facts { mirror: &[(1, 3), (4, 7), (5, 6)], ..of("Q9", 9, 4, 2, &SQUARE_2) }
            }
            ElementKind::Tet4 => Facts {
                face: Some(ElementKind::Tri3),
                mirror: &[(1, 2)],
                ..of("Tet4", 4, 4, 3, &TETRAHEDRON)
            },
            ElementKind::Tet10 => Facts {
                face: Some(ElementKind::Tri6),
                mirror: &[(1, 2), (4, 6), (8, 9)],
                ..of("Tet10", 10, 4, 3, &TETRAHEDRON_2)
            },
            ElementKind::Hex8 => Facts {
                face: Some(ElementKind::Quad4),
                mirror: HEXAHEDRON_MIRROR.split_at(4).0,
                ..of("Hex8", 8, 8, 3, &HEXAHEDRON_1)
            },
            ElementKind::Hex20 => Facts {
                face: Some(ElementKind::Quad8),
                mirror: HEXAHEDRON_MIRROR.split_at(8).0,
                ..of("Hex20", 20, 8, 3, &HEXAHEDRON_2)
            },
            ElementKind::Hex27 => Facts {
                face: Some(ElementKind::Quad9),
                mirror: &HEXAHEDRON_MIRROR,
                ..of("Hex27", 27, 8, 3, &HEXAHEDRON_3)
            },
        }
    }

    /// The kind that fills so many dimensions (a body on a line: 1) with so many nodes.
    pub fn of_nodes(dim: usize, nodes: usize) -> Option<ElementKind> {
        ElementKind::ALL.into_iter().find(|k| k.dim() == dim && k.nodes() == nodes)
    }

    /// Short name: triangles, quadrilaterals, tetrahedra and hexahedra by their number of nodes.
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        self.facts().nodes
    }

    /// Number of corners: the first nodes.
    pub fn corners(self) -> usize {
        self.facts().corners
    }

    /// Number of sides.
    pub fn sides(self) -> usize {
        self.facts().sides.len()
    }

    /// Space that it fills: 1, 2 or 3.
    pub fn dim(self) -> usize {
        self.facts().dim
    }

    /// Triangles and tetrahedra.
    pub fn is_simplex(self) -> bool {
        self.corners() == self.dim() + 1 && self.dim() > 1
    }

    /// Second order: nodes besides its corners.
    pub fn is_quadratic(self) -> bool {
        self.nodes() > self.corners()
    }

    /// Local nodes of a side: the end of a bar; the ends of a line, then its middle; the nodes of a face in the order of its kind.
    pub fn side(self, side: usize) -> &'static [usize] {
        self.facts().sides[side]
    }

    /// The element of the plane that each face of a solid is.
    pub fn face(self) -> Option<ElementKind> {
        self.facts().face
    }

    /// How many of the nodes of a side are its ends or corners.
    pub fn side_corners(self) -> usize {
        self.face().map_or(self.dim(), ElementKind::corners)
    }

    /// Exchange the nodes so that an element that is inside out is not.
    pub fn turn_round(self, nodes: &mut [usize]) {
        self.facts().mirror.iter().for_each(|&(a, b)| nodes.swap(a, b));
    }
}

/// Opposite nodes of a hexahedron, bottom and top.
const HEXAHEDRON_MIRROR: [(usize, usize); 9] =
    [(0, 4), (1, 5), (2, 6), (3, 7), (8, 16), (9, 17), (11, 18), (13, 19), (20, 25)];
