//! Shape functions and quadrature, once per kind of element.
//!
//! Local coordinates: `ξ ∈ [−1, 1]` of a bar, `(ξ, η) ∈ [−1, 1]²` of a quadrilateral, the triangle `ξ, η ≥ 0`, `ξ + η ≤ 1`; `[−1, 1]³` of a hexahedron, the
//! tetrahedron `ξ, η, ζ ≥ 0`, `ξ + η + ζ ≤ 1`. Nodes stand in the order of Gmsh (see [`ElementKind`]).

use crate::mesh::ElementKind;

/// A place in local coordinates: zero along those that a kind does not have.
pub type Local = [f64; 3];

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
        ElementKind::Bar2 => &[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        ElementKind::Tri3 | ElementKind::Tri6 => &TRIANGLE[..kind.nodes()],
        ElementKind::Quad4 | ElementKind::Quad8 | ElementKind::Quad9 => &SQUARE[..kind.nodes()],
        ElementKind::Tet4 | ElementKind::Tet10 => &TETRAHEDRON[..kind.nodes()],
        ElementKind::Hex8 | ElementKind::Hex20 | ElementKind::Hex27 => &CUBE[..kind.nodes()],
    }
}

/// Nodes of the six-node triangle.
static TRIANGLE: [Local; 6] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.5, 0.0, 0.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.0],
];

/// Nodes of the nine-node square.
static SQUARE: [Local; 9] = [
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 0.0, 0.0],
];

/// Nodes of the ten-node tetrahedron.
static TETRAHEDRON: [Local; 10] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.5, 0.0, 0.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.0],
    [0.0, 0.0, 0.5],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
];

/// The corners that the edges of a tetrahedron join, in the order of its other nodes.
const TETRAHEDRON_EDGES: [(usize, usize); 6] = [(0, 1), (1, 2), (2, 0), (0, 3), (2, 3), (1, 3)];

/// Nodes of the 27-node cube.
static CUBE: [Local; 27] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [0.0, -1.0, -1.0],
    [-1.0, 0.0, -1.0],
    [-1.0, -1.0, 0.0],
    [1.0, 0.0, -1.0],
    [1.0, -1.0, 0.0],
    [0.0, 1.0, -1.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [0.0, -1.0, 1.0],
    [-1.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [0.0, 0.0, -1.0],
    [0.0, -1.0, 0.0],
    [-1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, 0.0],
];

/// The middle of an element.
pub fn centre(kind: ElementKind) -> Local {
    match kind {
        ElementKind::Tri3 | ElementKind::Tri6 => [1.0 / 3.0, 1.0 / 3.0, 0.0],
        ElementKind::Tet4 | ElementKind::Tet10 => [0.25; 3],
        _ => [0.0; 3],
    }
}

/// How far a place lies outside of an element, in local coordinates.
pub fn outside(kind: ElementKind, at: Local) -> f64 {
    let own = &at[..kind.dim()];
    match kind.is_simplex() {
        true => own.iter().fold(own.iter().sum::<f64>() - 1.0, |m, x| m.max(-x)),
        false => own.iter().fold(0.0, |m, x| f64::max(m, x.abs() - 1.0)),
    }
    .max(0.0)
}

/// A function of the local coordinates at a place: value and gradient.
type Function = (f64, Local);

/// The product of functions.
fn product<const N: usize>(factors: [Function; N]) -> Function {
    let value = factors.iter().map(|f| f.0).product();
    let gradient = std::array::from_fn(|c| {
        let without =
            |k: usize| -> f64 { (0..N).filter(|j| *j != k).map(|j| factors[j].0).product::<f64>() };
        (0..N).filter(|&k| factors[k].1[c] != 0.0).map(|k| factors[k].1[c] * without(k)).sum()
    });
    (value, gradient)
}

/// A function of one coordinate.
fn along(axis: usize, (value, slope): (f64, f64)) -> Function {
    let mut gradient = [0.0; 3];
    gradient[axis] = slope;
    (value, gradient)
}

/// The linear function on −1, 1 that is one at `at`, and its derivative.
fn linear(at: f64, x: f64) -> (f64, f64) {
    (0.5 * (1.0 + at * x), 0.5 * at)
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
pub fn gradients(kind: ElementKind, at: Local) -> Vec<Local> {
    functions(kind, at).into_iter().map(|f| f.1).collect()
}

/// Value and local gradient of each shape function.
fn functions(kind: ElementKind, at: Local) -> Vec<Function> {
    let own = places(kind).iter();
    match kind {
        ElementKind::Bar2 => own.map(|p| along(0, linear(p[0], at[0]))).collect(),
        ElementKind::Tri3 | ElementKind::Tet4 => barycentric(kind.dim(), at),
        ElementKind::Tri6 | ElementKind::Tet10 => {
            let simplex = barycentric(kind.dim(), at);
            let corner = |&(l, g): &Function| (l * (2.0 * l - 1.0), g.map(|g| (4.0 * l - 1.0) * g));
            let middle = |&(a, b): &(usize, usize)| {
                let ((l, g), (m, h)) = (simplex[a], simplex[b]);
                (4.0 * l * m, std::array::from_fn(|c| 4.0 * (l * h[c] + m * g[c])))
            };
            let edges: &[_] = match kind {
                ElementKind::Tri6 => &TETRAHEDRON_EDGES[..3],
                _ => &TETRAHEDRON_EDGES,
            };
            simplex.iter().map(corner).chain(edges.iter().map(middle)).collect()
        }
        ElementKind::Quad4 => {
            own.map(|p| product([0, 1].map(|c| along(c, linear(p[c], at[c]))))).collect()
        }
        ElementKind::Quad9 => {
            own.map(|p| product([0, 1].map(|c| along(c, quadratic(p[c], at[c]))))).collect()
        }
        ElementKind::Hex8 => {
            own.map(|p| product([0, 1, 2].map(|c| along(c, linear(p[c], at[c]))))).collect()
        }
        ElementKind::Hex27 => {
            own.map(|p| product([0, 1, 2].map(|c| along(c, quadratic(p[c], at[c]))))).collect()
        }
        ElementKind::Quad8 | ElementKind::Hex20 => {
            own.map(|p| serendipity(kind.dim(), p, at)).collect()
        }
    }
}

/// Area or volume coordinates of a simplex: the first is what the others leave of one.
fn barycentric(dim: usize, at: Local) -> Vec<Function> {
    let of = |c: usize| along(c, (at[c], 1.0));
    let rest = 1.0 - at[..dim].iter().sum::<f64>();
    let down = std::array::from_fn(|c| if c < dim { -1.0 } else { 0.0 });
    std::iter::once((rest, down)).chain((0..dim).map(of)).collect()
}

/// Functions of elements whose nodes are corners and middles of edges. Of a corner `p`: the linear one times `p·ξ − (dim − 1)`; of a middle: a bubble
/// along its edge, linear across.
fn serendipity(dim: usize, p: &Local, at: Local) -> Function {
    let of = |c: usize| match p[c] {
        _ if c >= dim => (1.0, [0.0; 3]),
        0.0 => along(c, quadratic(0.0, at[c])),
        a => along(c, linear(a, at[c])),
    };
    let own = [of(0), of(1), of(2)];
    if p[..dim].contains(&0.0) {
        return product(own);
    }
    let rest = (0..dim).map(|c| p[c] * at[c]).sum::<f64>() - (dim - 1) as f64;
    product([own[0], own[1], own[2], (rest, *p)])
}

/// Points and weights (the weights add up to the measure of the element in local coordinates: 2 of a bar, 4 of a square, 8 of a cube, ½ of a triangle, ⅙ of a
/// tetrahedron). `radial` asks for one order more: the integrand carries the radius.
pub fn rule(kind: ElementKind, integrand: Integrand, radial: bool) -> Vec<(Local, f64)> {
    let gauss2 = GAUSS2.map(|x| (x, 1.0));
    match (kind, integrand) {
        (ElementKind::Bar2, _) => tensor(1, &gauss2),
        (ElementKind::Tri3, Integrand::Stiffness) if !radial => simplex(2, &[(1.0 / 3.0, 1.0)]),
        (ElementKind::Tri3, Integrand::Mass) if radial => simplex(2, &DEGREE4),
        (ElementKind::Tri3, _) => simplex(2, &[(1.0 / 6.0, 1.0 / 3.0)]),
        (ElementKind::Tri6, Integrand::Stiffness) if !radial => {
            simplex(2, &[(1.0 / 6.0, 1.0 / 3.0)])
        }
        (ElementKind::Tri6, _) => simplex(2, &DEGREE4),
        (ElementKind::Quad4, _) => tensor(2, &gauss2),
        (ElementKind::Quad8 | ElementKind::Quad9, _) => tensor(2, &GAUSS3),
        (ElementKind::Tet4, Integrand::Stiffness) => simplex(3, &[(0.25, 1.0)]),
        (ElementKind::Tet4, Integrand::Mass) | (ElementKind::Tet10, Integrand::Stiffness) => {
            simplex(3, &TETRAHEDRON2)
        }
        (ElementKind::Tet10, Integrand::Mass) => tetrahedron5(),
        (ElementKind::Hex8, Integrand::Stiffness) => tensor(3, &gauss2),
        (ElementKind::Hex8, Integrand::Mass) => tensor(3, &GAUSS3),
        (ElementKind::Hex20 | ElementKind::Hex27, _) => tensor(3, &GAUSS3),
    }
}

/// A rule on `[−1, 1]` along each of `dim` axes; the last runs fastest.
fn tensor(dim: usize, rule: &[(f64, f64)]) -> Vec<(Local, f64)> {
    let mut all = vec![([0.0; 3], 1.0)];
    for axis in 0..dim {
        let of = |&(at, weight): &(Local, f64)| {
            rule.iter().map(move |&(x, w)| {
                let mut at = at;
                at[axis] = x;
                (at, weight * w)
            })
        };
        all = all.iter().flat_map(of).collect();
    }
    all
}

/// Symmetric orbits of the rule of degree 4 on the triangle: coordinate and weight of each of three points.
const DEGREE4: [(f64, f64); 2] = [
    (0.445_948_490_915_964_9, 0.223_381_589_678_011_47),
    (0.091_576_213_509_770_74, 0.109_951_743_655_321_87),
];

/// The four points of degree 2 on the tetrahedron: `(5 − √5)/20`.
const TETRAHEDRON2: [(f64, f64); 1] = [(0.138_196_601_125_010_5, 0.25)];

/// Points with the barycentric coordinates `(a, …, a, 1 − dim·a)` in all orders, each orbit with the weight of one of its points over the measure.
fn simplex(dim: usize, orbits: &[(f64, f64)]) -> Vec<(Local, f64)> {
    let measure = if dim == 2 { 0.5 } else { 1.0 / 6.0 };
    let of = |&(a, w): &(f64, f64)| -> Vec<(Local, f64)> {
        let rest = 1.0 - dim as f64 * a;
        let base: Local = std::array::from_fn(|c| if c < dim { a } else { 0.0 });
        let point = |k: Option<usize>| {
            let mut at = base;
            k.into_iter().for_each(|k| at[k] = rest);
            (at, measure * w)
        };
        match (rest - a).abs() < 1e-12 {
            true => vec![point(None)],
            false => std::iter::once(None).chain((0..dim).map(Some)).map(point).collect(),
        }
    };
    orbits.iter().flat_map(of).collect()
}

/// The 14 points of degree 5 on the tetrahedron, all weights positive (Walkington 2000, Quadrature on simplices of arbitrary dimension): two orbits
/// of four, one of the six points `(b, b, ½ − b, ½ − b)`.
fn tetrahedron5() -> Vec<(Local, f64)> {
    const FOUR: [(f64, f64); 2] = [
        (0.310_885_919_263_300_6, 0.112_687_925_718_015_84),
        (0.092_735_250_310_891_23, 0.073_493_043_116_361_95),
    ];
    const SIX: (f64, f64) = (0.045_503_704_125_649_65, 0.042_546_020_777_081_466);
    let (b, w) = SIX;
    let mut all = simplex(3, &FOUR);
    for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
        let of = |k: usize| if k == i || k == j { b } else { 0.5 - b };
        all.push(([of(1), of(2), of(3)], w / 6.0));
    }
    all
}

/// A point of quadrature on a side.
#[derive(Debug, Clone, PartialEq)]
pub struct SidePoint {
    /// Local coordinates in the element.
    pub local: Local,
    /// Weight in the side's own coordinates.
    pub weight: f64,
    /// Shape functions of the nodes of the side.
    pub values: Vec<f64>,
    /// Their derivatives along the side's own coordinates, one of a line, two of a face.
    pub slopes: Vec<[f64; 2]>,
}

/// The rule of a side. Of a line two points of Gauss, three where it has three nodes; of a face that of its kind, so that products of its functions are
/// exact; the end of a bar is one point.
pub fn side_rule(kind: ElementKind, side: usize) -> Vec<SidePoint> {
    let nodes = kind.side(side);
    let at = |k: usize| places(kind)[nodes[k]];
    let slopes = |of: &[Function]| of.iter().map(|f| [f.1[0], f.1[1]]).collect();
    // sides are straight and flat in local coordinates: their corners tell where a point lies
    let point = |(of, corners): (Vec<Function>, Vec<Function>), weight: f64| SidePoint {
        local: std::array::from_fn(|c| {
            corners.iter().enumerate().map(|(k, f)| f.0 * at(k)[c]).sum()
        }),
        weight,
        slopes: slopes(&of),
        values: of.into_iter().map(|f| f.0).collect(),
    };
    if let Some(face) = kind.face() {
        let corners = if face.is_simplex() { ElementKind::Tri3 } else { ElementKind::Quad4 };
        let of = |(s, weight)| point((functions(face, s), functions(corners, s)), weight);
        return rule(face, Integrand::Mass, false).into_iter().map(of).collect();
    }
    if nodes.len() == 1 {
        let end = vec![(1.0, [0.0; 3])];
        return vec![point((end.clone(), end), 1.0)];
    }
    let ends = |s: f64| [-1.0, 1.0].map(|a| along(0, linear(a, s))).to_vec();
    let of_line = |s: f64| match nodes.len() {
        2 => ends(s),
        _ => [-1.0, 1.0, 0.0].map(|a| along(0, quadratic(a, s))).to_vec(),
    };
    let of = |s: f64, weight: f64| point((of_line(s), ends(s)), weight);
    match nodes.len() {
        2 => GAUSS2.iter().map(|&s| of(s, 1.0)).collect(),
        _ => GAUSS3.iter().map(|&(s, w)| of(s, w)).collect(),
    }
}

/// The weights of a uniform pressure on a side over its nodes, as shares of its area: of flat straight-sided sides the nodal forces of a unit pressure.
pub fn side_shares(kind: ElementKind, side: usize) -> Vec<f64> {
    let rule = side_rule(kind, side);
    let total: f64 = rule.iter().map(|p| p.weight).sum();
    let share = |k: usize| rule.iter().map(|p| p.weight * p.values[k]).sum::<f64>() / total;
    (0..kind.side(side).len()).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_function_is_one_at_its_own_node_and_all_add_up_to_one() {
        for kind in ElementKind::ALL {
            assert_eq!(places(kind).len(), kind.nodes());
            for (k, &p) in places(kind).iter().enumerate() {
                assert!(outside(kind, p) < 1e-15, "{kind:?} {k}");
                for (j, v) in values(kind, p).into_iter().enumerate() {
                    assert!((v - f64::from(u8::from(j == k))).abs() < 1e-15, "{kind:?} {j} {k}");
                }
            }
            let p: Local =
                std::array::from_fn(|c| if c < kind.dim() { [0.21, 0.34, 0.17][c] } else { 0.0 });
            assert!((values(kind, p).iter().sum::<f64>() - 1.0).abs() < 1e-15);
            for c in 0..kind.dim() {
                let step = |s: f64| std::array::from_fn(|d| p[d] + if c == d { s } else { 0.0 });
                let (a, b) = (values(kind, step(1e-6)), values(kind, step(-1e-6)));
                for (k, g) in gradients(kind, p).into_iter().enumerate() {
                    assert!((g[c] - (a[k] - b[k]) / 2e-6).abs() < 1e-9, "{kind:?} {k}");
                }
            }
        }
        assert!((outside(ElementKind::Tet4, [0.5, 0.4, 0.3]) - 0.2).abs() < 1e-15);
        assert!((outside(ElementKind::Hex8, [0.5, -1.4, 0.3]) - 0.4).abs() < 1e-15);
    }

    #[test]
    fn rules_are_exact_to_their_degree() {
        // ∫ x^a y^b z^c over the simplex is a! b! c!/(a + b + c + dim)!
        let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
        let integral = |rule: &[(Local, f64)], powers: [usize; 3]| -> f64 {
            let of = |at: &Local| -> f64 { (0..3).map(|c| at[c].powi(powers[c] as i32)).product() };
            rule.iter().map(|(at, w)| w * of(at)).sum()
        };
        let powers = |dim: usize, most: usize| {
            let all = (0..(most + 1).pow(3))
                .map(move |k| [k % (most + 1), k / (most + 1) % (most + 1), k / (most + 1).pow(2)]);
            all.filter(move |p| p[dim..].iter().all(|p| *p == 0))
        };
        let mut rules = vec![];
        for (kind, integrand, radial, degree) in [
            (ElementKind::Tri3, Integrand::Stiffness, false, 1),
            (ElementKind::Tri3, Integrand::Mass, false, 2),
            (ElementKind::Tri6, Integrand::Stiffness, false, 2),
            (ElementKind::Tri6, Integrand::Mass, false, 4),
            (ElementKind::Tri3, Integrand::Mass, true, 4),
            (ElementKind::Tet4, Integrand::Stiffness, false, 1),
            (ElementKind::Tet4, Integrand::Mass, false, 2),
            (ElementKind::Tet10, Integrand::Stiffness, false, 2),
            (ElementKind::Tet10, Integrand::Mass, false, 5),
        ] {
            let dim = kind.dim();
            let rule = rule(kind, integrand, radial);
            for p in powers(dim, degree).filter(|p| p.iter().sum::<usize>() <= degree) {
                let exact = p.iter().map(|&p| factorial(p)).product::<f64>()
                    / factorial(p.iter().sum::<usize>() + dim);
                assert!((integral(&rule, p) - exact).abs() < 1e-15, "{kind:?} {p:?}");
            }
            rules.push(rule);
        }
        // no point outside, no weight that is not positive
        for (at, w) in rules.iter().flatten() {
            assert!(*w > 0.0 && outside(ElementKind::Tet4, *at) == 0.0);
        }
        for (kind, degree) in [
            (ElementKind::Quad4, 3),
            (ElementKind::Quad9, 5),
            (ElementKind::Hex8, 5),
            (ElementKind::Hex27, 5),
        ] {
            let rule = rule(kind, Integrand::Mass, false);
            let of = |n: usize| if n.is_multiple_of(2) { 2.0 / (n + 1) as f64 } else { 0.0 };
            for p in powers(kind.dim(), degree) {
                let exact: f64 = p[..kind.dim()].iter().map(|&p| of(p)).product();
                assert!((integral(&rule, p) - exact).abs() < 1e-14, "{kind:?} {p:?}");
            }
        }
    }

    #[test]
    fn sides_see_the_functions_of_their_nodes() {
        for kind in ElementKind::ALL {
            for side in 0..kind.sides() {
                for point in side_rule(kind, side) {
                    let all = values(kind, point.local);
                    for (k, v) in all.iter().enumerate() {
                        let own = kind.side(side).iter().position(|&n| n == k);
                        let expected = own.map_or(0.0, |i| point.values[i]);
                        assert!((v - expected).abs() < 1e-15, "{kind:?} {side} {k}");
                    }
                    for c in 0..2 {
                        assert!(point.slopes.iter().map(|s| s[c]).sum::<f64>().abs() < 1e-15);
                    }
                }
            }
        }
    }

    /// Nodal forces of a uniform pressure: none at the corners of six-node triangles, tensile at those of eight-node squares.
    #[test]
    fn a_uniform_pressure_has_the_nodal_forces_of_the_book() {
        for (kind, expected) in [
            (ElementKind::Quad8, vec![1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0]),
            (ElementKind::Tet4, vec![1.0 / 3.0; 3]),
            (ElementKind::Tet10, vec![0.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]),
            (ElementKind::Hex8, vec![0.25; 4]),
            (ElementKind::Hex20, [[-1.0 / 12.0; 4], [1.0 / 3.0; 4]].concat()),
        ] {
            let found = side_shares(kind, 1);
            assert_eq!(found.len(), expected.len());
            assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-15), "{kind:?}");
        }
        assert!((side_shares(ElementKind::Hex27, 5)[8] - 4.0 / 9.0).abs() < 1e-15);
    }
}
