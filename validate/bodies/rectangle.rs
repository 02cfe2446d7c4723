//! Rectangles of elements of every kind, and meshes as files of Gmsh.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use signorini::mesh::{Block, ElementKind, Facet, Mesh, Point};

/// A rectangle `[x0, x1] × [0, h]` of `nx × ny` cells, each one quadrilateral or two triangles; inner nodes moved by `skew` of a cell.
pub fn rectangle(
    kind: ElementKind,
    x: [f64; 2],
    h: f64,
    (nx, ny): (usize, usize),
    skew: f64,
) -> Mesh {
    // a grid of twice as many points: corners, middles, centres; those that no cell has are left out
    let place = |i: usize, j: usize| {
        let inner = i > 0 && j > 0 && i < 2 * nx && j < 2 * ny;
        let (s, t) = (i as f64 / (2 * nx) as f64, j as f64 / (2 * ny) as f64);
        let wave =
            |a: f64, b: f64| if inner { skew * (a * s * 7.0 + b * t * 5.0).sin() } else { 0.0 };
        let (dx, dy) = ((x[1] - x[0]) / nx as f64, h / ny as f64);
        [x[0] + (x[1] - x[0]) * s + dx * wave(1.0, 2.0), h * t + dy * wave(3.0, 1.0), 0.0]
    };
    let corner = |i: usize, j: usize| place(2 * i, 2 * j);
    // straight sides: middles between the corners
    let between = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
    let point = |i: usize, j: usize| match (i % 2, j % 2) {
        (0, 0) => place(i, j),
        (1, 0) => between(corner(i / 2, j / 2), corner(i / 2 + 1, j / 2)),
        (0, _) => between(corner(i / 2, j / 2), corner(i / 2, j / 2 + 1)),
        // on the diagonal of a cell: middle of a triangle's side; of a quadrilateral the middle of its corners
        _ => match kind {
            ElementKind::Tri6 => between(corner(i / 2, j / 2), corner(i / 2 + 1, j / 2 + 1)),
            _ => {
                let low = between(corner(i / 2, j / 2), corner(i / 2 + 1, j / 2));
                between(low, between(corner(i / 2, j / 2 + 1), corner(i / 2 + 1, j / 2 + 1)))
            }
        },
    };
    let mut number: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let mut nodes = vec![];
    let mut of = |at: (usize, usize)| {
        *number.entry(at).or_insert_with(|| {
            nodes.push(point(at.0, at.1));
            nodes.len() - 1
        })
    };
    let mut connectivity = vec![];
    let mut groups: BTreeMap<String, Vec<Facet>> = BTreeMap::new();
    for i in 0..nx {
        for j in 0..ny {
            let at = |a: usize, b: usize| (2 * i + a, 2 * j + b);
            let cells: Vec<Vec<(usize, usize)>> = match kind {
                ElementKind::Tri3 => {
                    vec![vec![at(0, 0), at(2, 0), at(2, 2)], vec![at(0, 0), at(2, 2), at(0, 2)]]
                }
                ElementKind::Tri6 => vec![
                    vec![at(0, 0), at(2, 0), at(2, 2), at(1, 0), at(2, 1), at(1, 1)],
                    vec![at(0, 0), at(2, 2), at(0, 2), at(1, 1), at(1, 2), at(0, 1)],
                ],
                _ => {
                    let all = [
                        at(0, 0),
                        at(2, 0),
                        at(2, 2),
                        at(0, 2),
                        at(1, 0),
                        at(2, 1),
                        at(1, 2),
                        at(0, 1),
                        at(1, 1),
                    ];
                    vec![all[..kind.nodes()].to_vec()]
                }
            };
            for cell in cells {
                let element = connectivity.len() / kind.nodes();
                for side in 0..kind.sides() {
                    let ends: Vec<(usize, usize)> =
                        kind.side(side).iter().map(|&l| cell[l]).collect();
                    for (name, on) in [
                        ("left", ends.iter().all(|p| p.0 == 0)),
                        ("right", ends.iter().all(|p| p.0 == 2 * nx)),
                        ("bottom", ends.iter().all(|p| p.1 == 0)),
                        ("top", ends.iter().all(|p| p.1 == 2 * ny)),
                    ] {
                        if on {
                            let facet = Facet { block: 0, element, side };
                            groups.entry(name.into()).or_default().push(facet);
                        }
                    }
                }
                connectivity.extend(cell.into_iter().map(&mut of));
            }
        }
    }
    let block = Block { kind, region: 0, connectivity, congruent: false };
    Mesh::new(2, nodes, vec![block], groups)
}

/// Names of groups of sides, of rectangles and boxes.
const GROUPS: [&str; 10] =
    ["left", "right", "bottom", "top", "xmin", "xmax", "ymin", "ymax", "zmin", "zmax"];

/// A mesh in Gmsh's format 2.2, all cells in the group `body`, its groups of sides by name; `region` numbers the group of a cell by its centre.
pub fn msh(mesh: &Mesh, region: impl Fn(Point) -> usize) -> String {
    let names: Vec<&str> = GROUPS.into_iter().filter(|n| !mesh.group(n).is_empty()).collect();
    let of_sides = mesh.dim() - 1;
    let mut out = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n");
    let _ = writeln!(out, "{}", names.len() + 1);
    for (k, name) in names.iter().enumerate() {
        let _ = writeln!(out, "{of_sides} {} \"{name}\"", k + 1);
    }
    let head = format!("{} 10 \"body\"\n$EndPhysicalNames\n$Nodes", mesh.dim());
    let _ = writeln!(out, "{head}\n{}", mesh.n_nodes());
    for (n, [x, y, z]) in mesh.nodes().iter().enumerate() {
        let _ = writeln!(out, "{} {x:?} {y:?} {z:?}", n + 1);
    }
    let mut lines = vec![];
    for (k, name) in names.iter().enumerate() {
        for &facet in mesh.group(name) {
            let element = mesh.element(facet);
            let own = element.kind.side(facet.side).iter().map(|&l| element.nodes[l]);
            let own: Vec<usize> = own.collect();
            let of_line = if own.len() == 2 { 1 } else { 8 };
            let number = element.kind.face(facet.side).map_or(of_line, |face| face.gmsh().0);
            lines.push((number, k + 1, own));
        }
    }
    for e in mesh.elements() {
        let corners = &e.nodes[..e.kind.corners()];
        let mean = |c: usize| {
            corners.iter().map(|&n| mesh.nodes()[n][c]).sum::<f64>() / corners.len() as f64
        };
        lines.push((e.kind.gmsh().0, 10 + region([mean(0), mean(1), mean(2)]), e.nodes.to_vec()));
    }
    let _ = writeln!(out, "$EndNodes\n$Elements\n{}", lines.len());
    for (k, (number, group, nodes)) in lines.iter().enumerate() {
        let nodes: Vec<String> = nodes.iter().map(|n| (n + 1).to_string()).collect();
        let _ = writeln!(out, "{} {number} 2 {group} 1 {}", k + 1, nodes.join(" "));
    }
    out.push_str("$EndElements\n");
    out
}
