//! Shape functions and quadrature, once per kind of element.
//!
//! Local coordinates: `ξ ∈ [−1, 1]` of a bar, `(ξ, η) ∈ [−1, 1]²` of a quadrilateral, the triangle `ξ, η ≥ 0`, `ξ + η ≤ 1`. Nodes stand in the order of Gmsh:
//! corners counter-clockwise, then the middles of the sides, then the centre.

use crate::mesh::ElementKind;

/// A place in local coordinates.
pub type Local = [f64; 2];

/// Gauss–Legendre points of the 2-point rule on [−1, 1] (weights 1).
pub const GAUSS2: [f64; 2] = [-0.577_350_269_189_625_8, 0.577_350_269_189_625_8];
/// The 3-point rule.
const GAUSS3: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// What is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrand {
    /// Products of gradients.
    Stiffness,
    /// Products of shape functions.
    Mass,
}

/// Local coordinates of the nodes.
pub fn places(kind: ElementKind) -> &'static [Local] {
    match kind {
        ElementKind::Bar2 => &[[-1.0, 0.0], [1.0, 0.0]],
        ElementKind::Tri3 => &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        ElementKind::Tri6 => {
            &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]]
        }
        ElementKind::Quad4 => &SQUARE[..4],
        ElementKind::Quad8 => &SQUARE[..8],
        ElementKind::Quad9 => &SQUARE,
    }
}

/// Nodes of the nine-node square.
static SQUARE: [Local; 9] = [
    [-1.0, -1.0],
    [1.0, -1.0],
    [1.0, 1.0],
    [-1.0, 1.0],
    [0.0, -1.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [-1.0, 0.0],
    [0.0, 0.0],
];

/// The middle of an element.
pub fn centre(kind: ElementKind) -> Local {
    match kind {
        ElementKind::Tri3 | ElementKind::Tri6 => [1.0 / 3.0; 2],
        _ => [0.0; 2],
    }
}

/// The quadratic on −1, 0, 1 that is one at `at`, and its derivative.
fn quadratic(at: f64, x: f64) -> (f64, f64) {
    match at {
        0.0 => (1.0 - x * x, -2.0 * x),
        _ => (0.5 * x * (x + at), x + 0.5 * at),
    }
}

/// Shape functions at a place.
pub fn values(kind: ElementKind, at: Local) -> Vec<f64> {
    functions(kind, at).into_iter().map(|f| f.0).collect()
}

/// Gradients of the shape functions in local coordinates.
pub fn gradients(kind: ElementKind, at: Local) -> Vec<[f64; 2]> {
    functions(kind, at).into_iter().map(|f| f.1).collect()
}

/// Value and local gradient of each shape function.
fn functions(kind: ElementKind, [x, y]: Local) -> Vec<(f64, [f64; 2])> {
    let bilinear = |[a, b]: Local| {
        let value = (1.0 + a * x) * (1.0 + b * y) / 4.0;
        (value, [a * (1.0 + b * y) / 4.0, b * (1.0 + a * x) / 4.0])
    };
    // area coordinates of a triangle and their gradients
    let area = [(1.0 - x - y, [-1.0, -1.0]), (x, [1.0, 0.0]), (y, [0.0, 1.0])];
    match kind {
        ElementKind::Bar2 => vec![((1.0 - x) / 2.0, [-0.5, 0.0]), ((1.0 + x) / 2.0, [0.5, 0.0])],
        ElementKind::Tri3 => area.to_vec(),
        ElementKind::Tri6 => {
            let corner =
                |(l, g): (f64, [f64; 2])| (l * (2.0 * l - 1.0), g.map(|g| (4.0 * l - 1.0) * g));
            let middle = |a: usize, b: usize| {
                let ((l, g), (m, h)) = (area[a], area[b]);
                (4.0 * l * m, [0, 1].map(|c| 4.0 * (l * h[c] + m * g[c])))
            };
            let middles = [middle(0, 1), middle(1, 2), middle(2, 0)];
            area.map(corner).into_iter().chain(middles).collect()
        }
        ElementKind::Quad4 => SQUARE[..4].iter().map(|&p| bilinear(p)).collect(),
        ElementKind::Quad8 => {
            let corner = |&[a, b]: &Local| {
                let (v, g) = bilinear([a, b]);
                let rest = a * x + b * y - 1.0;
                (v * rest, [g[0] * rest + v * a, g[1] * rest + v * b])
            };
            // along the side a bubble, across it linear
            let middle = |&[a, b]: &Local| match a == 0.0 {
                true => {
                    let (bubble, across) = (1.0 - x * x, 0.5 * (1.0 + b * y));
                    (bubble * across, [-2.0 * x * across, 0.5 * b * bubble])
                }
                false => {
                    let (bubble, across) = (1.0 - y * y, 0.5 * (1.0 + a * x));
                    (bubble * across, [0.5 * a * bubble, -2.0 * y * across])
                }
            };
            let corners = SQUARE[..4].iter().map(corner);
            corners.chain(SQUARE[4..8].iter().map(middle)).collect()
        }
        ElementKind::Quad9 => {
            let product = |&[a, b]: &Local| {
                let ((f, df), (g, dg)) = (quadratic(a, x), quadratic(b, y));
                (f * g, [df * g, f * dg])
            };
            SQUARE.iter().map(product).collect()
        }
    }
}

/// Points and weights (the weights of a square add up to 4, of a triangle to ½, of a bar to 2). `radial` asks for one order more: the integrand carries the
/// radius.
pub fn rule(kind: ElementKind, integrand: Integrand, radial: bool) -> Vec<(Local, f64)> {
    let square2 = || GAUSS2.iter().flat_map(|&x| GAUSS2.map(|y| ([x, y], 1.0))).collect();
    let square3 = || {
        let of = |&(x, v): &(f64, f64)| GAUSS3.map(|(y, w)| ([x, y], v * w));
        GAUSS3.iter().flat_map(of).collect()
    };
    match (kind, integrand) {
        (ElementKind::Bar2, _) => GAUSS2.iter().map(|&x| ([x, 0.0], 1.0)).collect(),
        (ElementKind::Tri3, Integrand::Stiffness) if !radial => triangle(&[(1.0 / 3.0, 1.0)]),
        (ElementKind::Tri3, Integrand::Mass) if radial => triangle(&DEGREE4),
        (ElementKind::Tri3, _) => triangle(&[(1.0 / 6.0, 1.0 / 3.0)]),
        (ElementKind::Tri6, Integrand::Stiffness) if !radial => triangle(&[(1.0 / 6.0, 1.0 / 3.0)]),
        (ElementKind::Tri6, _) => triangle(&DEGREE4),
        (ElementKind::Quad4, _) => square2(),
        (ElementKind::Quad8 | ElementKind::Quad9, _) => square3(),
    }
}

/// Symmetric orbits of the rule of degree 4 on the triangle: coordinate and weight of each of three points.
const DEGREE4: [(f64, f64); 2] = [
    (0.445_948_490_915_964_9, 0.223_381_589_678_011_47),
    (0.091_576_213_509_770_74, 0.109_951_743_655_321_87),
];

/// Points `(a, a, 1 − 2a)` in area coordinates, each orbit with the weight of one of its points over the area.
fn triangle(orbits: &[(f64, f64)]) -> Vec<(Local, f64)> {
    let of = |&(a, w): &(f64, f64)| -> Vec<(Local, f64)> {
        let rest = 1.0 - 2.0 * a;
        match (rest - a).abs() < 1e-12 {
            true => vec![([a, a], 0.5 * w)],
            false => [[a, a], [rest, a], [a, rest]].map(|p| (p, 0.5 * w)).to_vec(),
        }
    };
    orbits.iter().flat_map(of).collect()
}

/// A point of quadrature on a side: place along it from its first to its last corner in `[−1, 1]`, weight, shape functions of the nodes of the side
/// with their derivatives along it.
#[derive(Debug, Clone, PartialEq)]
pub struct SidePoint {
    /// Local coordinates in the element.
    pub local: Local,
    /// Weight on `[−1, 1]`.
    pub weight: f64,
    /// Shape functions of the nodes of the side: its ends, then its middle.
    pub values: Vec<f64>,
    /// Their derivatives along the side.
    pub slopes: Vec<f64>,
}

/// Two points of Gauss on a side with two nodes, three on one with three; the end of a bar is one point.
pub fn side_rule(kind: ElementKind, side: usize) -> Vec<SidePoint> {
    let nodes = kind.side(side);
    let at = |k: usize| places(kind)[nodes[k]];
    if nodes.len() == 1 {
        let point = SidePoint { local: at(0), weight: 1.0, values: vec![1.0], slopes: vec![0.0] };
        return vec![point];
    }
    // of its ends, and of its middle where there is one
    let functions = |s: f64| -> Vec<(f64, f64)> {
        match nodes.len() {
            2 => vec![((1.0 - s) / 2.0, -0.5), ((1.0 + s) / 2.0, 0.5)],
            _ => [-1.0, 1.0, 0.0].map(|a| quadratic(a, s)).to_vec(),
        }
    };
    // sides are straight in local coordinates
    let point = |s: f64, weight: f64| {
        let (values, slopes) = functions(s).into_iter().unzip();
        let local = [0, 1].map(|c| 0.5 * ((1.0 - s) * at(0)[c] + (1.0 + s) * at(1)[c]));
        SidePoint { local, weight, values, slopes }
    };
    match nodes.len() {
        2 => GAUSS2.iter().map(|&s| point(s, 1.0)).collect(),
        _ => GAUSS3.iter().map(|&(s, w)| point(s, w)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [ElementKind; 6] = [
        ElementKind::Bar2,
        ElementKind::Tri3,
        ElementKind::Tri6,
        ElementKind::Quad4,
        ElementKind::Quad8,
        ElementKind::Quad9,
    ];

    #[test]
    fn each_function_is_one_at_its_own_node_and_all_add_up_to_one() {
        for kind in ALL {
            assert_eq!(places(kind).len(), kind.nodes());
            for (k, &p) in places(kind).iter().enumerate() {
                for (j, v) in values(kind, p).into_iter().enumerate() {
                    assert!((v - f64::from(u8::from(j == k))).abs() < 1e-15, "{kind:?} {j} {k}");
                }
            }
            let p = [0.21, 0.34];
            assert!((values(kind, p).iter().sum::<f64>() - 1.0).abs() < 1e-15);
            for c in 0..2 {
                let step = |s: f64| [0, 1].map(|d| p[d] + if c == d { s } else { 0.0 });
                let (a, b) = (values(kind, step(1e-6)), values(kind, step(-1e-6)));
                for (k, g) in gradients(kind, p).into_iter().enumerate() {
                    assert!((g[c] - (a[k] - b[k]) / 2e-6).abs() < 1e-9, "{kind:?} {k}");
                }
            }
        }
    }

    #[test]
    fn rules_are_exact_to_their_degree() {
        // ∫ x^a y^b over the triangle is a! b!/(a + b + 2)!
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        let integral = |rule: &[(Local, f64)], a: u32, b: u32| -> f64 {
            rule.iter().map(|([x, y], w)| w * x.powi(a as i32) * y.powi(b as i32)).sum()
        };
        for (kind, integrand, radial, degree) in [
            (ElementKind::Tri3, Integrand::Stiffness, false, 1),
            (ElementKind::Tri3, Integrand::Mass, false, 2),
            (ElementKind::Tri6, Integrand::Stiffness, false, 2),
            (ElementKind::Tri6, Integrand::Mass, false, 4),
            (ElementKind::Tri3, Integrand::Mass, true, 4),
        ] {
            let rule = rule(kind, integrand, radial);
            for a in 0..=degree {
                for b in 0..=degree - a {
                    let exact = factorial(a) * factorial(b) / factorial(a + b + 2);
                    assert!((integral(&rule, a, b) - exact).abs() < 1e-15, "{kind:?} {a} {b}");
                }
            }
        }
        for (kind, degree) in [(ElementKind::Quad4, 3), (ElementKind::Quad9, 5)] {
            let rule = rule(kind, Integrand::Mass, false);
            for a in 0..=degree {
                for b in 0..=degree {
                    let of =
                        |n: u32| if n.is_multiple_of(2) { 2.0 / f64::from(n + 1) } else { 0.0 };
                    assert!((integral(&rule, a, b) - of(a) * of(b)).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn sides_see_the_functions_of_their_nodes() {
        for kind in ALL {
            for side in 0..kind.sides() {
                for point in side_rule(kind, side) {
                    let all = values(kind, point.local);
                    for (k, v) in all.iter().enumerate() {
                        let own = kind.side(side).iter().position(|&n| n == k);
                        let expected = own.map_or(0.0, |i| point.values[i]);
                        assert!((v - expected).abs() < 1e-15, "{kind:?} {side} {k}");
                    }
                    assert!(point.slopes.iter().sum::<f64>().abs() < 1e-15);
                }
            }
        }
    }
}
