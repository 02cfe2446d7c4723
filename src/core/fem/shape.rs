//! Shape functions and quadrature by the family and the basis of an element.
//!
//! Local coordinates: `ξ ∈ [−1, 1]` of a bar, `(ξ, η) ∈ [−1, 1]²` of a quadrilateral, the triangle `ξ, η ≥ 0`, `ξ + η ≤ 1`; `[−1, 1]³` of a hexahedron, the
//! tetrahedron `ξ, η, ζ ≥ 0`, `ξ + η + ζ ≤ 1`, of a prism the triangle in `ξ, η` and `ζ ∈ [−1, 1]`. Nodes stand in the order of Gmsh (see [`ElementKind`]).

use std::sync::OnceLock;

use crate::mesh::{Basis, ElementKind, Family};

/// A place in local coordinates: zero along those that a kind does not have.
pub type Local = [f64; 3];

/// Gauss–Legendre points of the 2-point rule on [−1, 1] (weights 1).
pub(crate) const GAUSS2: [f64; 2] = [-0.577_350_269_189_625_8, 0.577_350_269_189_625_8];
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
    let all: &[Local] = match (kind.family(), kind.dim()) {
        (Family::Cube, 1) => &[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        (Family::Cube, 2) => &SQUARE,
        (Family::Cube, _) => &CUBE,
        (Family::Simplex, 2) => &TRIANGLE,
        (Family::Simplex, _) => &TETRAHEDRON,
        (Family::Prism, _) => &PRISM,
    };
    &all[..kind.nodes()]
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

/// Nodes of the 18-node prism.
static PRISM: [Local; 18] = [
    [0.0, 0.0, -1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, -1.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [0.5, 0.0, -1.0],
    [0.0, 0.5, -1.0],
    [0.0, 0.0, 0.0],
    [0.5, 0.5, -1.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.5, 0.0, 1.0],
    [0.0, 0.5, 1.0],
    [0.5, 0.5, 1.0],
    [0.5, 0.0, 0.0],
    [0.0, 0.5, 0.0],
    [0.5, 0.5, 0.0],
];

/// The middle of an element.
pub fn centre(kind: ElementKind) -> Local {
    match (kind.family(), kind.dim()) {
        (Family::Cube, _) => [0.0; 3],
        (Family::Simplex, 2) | (Family::Prism, _) => [1.0 / 3.0, 1.0 / 3.0, 0.0],
        (Family::Simplex, _) => [0.25; 3],
    }
}

/// How far a place lies outside of an element, in local coordinates.
pub fn outside(kind: ElementKind, at: Local) -> f64 {
    // axes of its simplex, then those of its cube
    let (simplex, cube) = at[..kind.dim()].split_at(of_simplex(kind));
    let beyond = simplex.iter().fold(simplex.iter().sum::<f64>() - 1.0, |m, x| m.max(-x));
    cube.iter().fold(beyond, |m, x| m.max(x.abs() - 1.0)).max(0.0)
}

/// How many of its local coordinates are those of a simplex.
fn of_simplex(kind: ElementKind) -> usize {
    match kind.family() {
        Family::Cube => 0,
        Family::Simplex => kind.dim(),
        Family::Prism => 2,
    }
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
    let dim = kind.dim();
    let own = places(kind).iter();
    let along_all = |of: fn(f64, f64) -> (f64, f64)| {
        let factor = move |p: &Local, c: usize| match c < dim {
            true => along(c, of(p[c], at[c])),
            false => (1.0, [0.0; 3]),
        };
        move |p: &Local| product([0, 1, 2].map(|c| factor(p, c)))
    };
    match (kind.family(), kind.basis()) {
        (Family::Cube, Basis::Linear) => own.map(along_all(linear)).collect(),
        (Family::Cube, Basis::Quadratic) => own.map(along_all(quadratic)).collect(),
        (Family::Cube, Basis::Serendipity) => own.map(|p| serendipity(dim, p, at)).collect(),
        (Family::Simplex, Basis::Linear) => barycentric(dim, at),
        (Family::Simplex, _) => {
            let area = barycentric(dim, at);
            own.map(|p| on_simplex(&area, p)).collect()
        }
        (Family::Prism, basis) => {
            let area = barycentric(2, at);
            own.map(|p| prism(basis, &area, p, at[2])).collect()
        }
    }
}

/// The quadratic of a simplex that is one at `p`: `L (2L − 1)` of a corner, `4 L M` of the middle of an edge, `L` and `M` the coordinates of its ends.
fn on_simplex(area: &[Function], p: &Local) -> Function {
    let own = |k: usize| share(area.len() - 1, p, k);
    let corner = (0..area.len()).find(|&k| own(k) > 0.75);
    let first = corner.or_else(|| (0..area.len()).find(|&k| own(k) > 0.25)).unwrap_or(0);
    let (l, g) = area[first];
    match (first + 1..area.len()).find(|&k| own(k) > 0.25) {
        Some(second) => {
            let (m, h) = area[second];
            (4.0 * l * m, std::array::from_fn(|c| 4.0 * (l * h[c] + m * g[c])))
        }
        None => (l * (2.0 * l - 1.0), g.map(|g| (4.0 * l - 1.0) * g)),
    }
}

/// One of the area or volume coordinates of a place.
fn share(dim: usize, at: &Local, k: usize) -> f64 {
    if k == 0 { 1.0 - at[..dim].iter().sum::<f64>() } else { at[k - 1] }
}

/// The function of a prism that is one at `p`: products of those of its triangle and those along it. With nodes on edges only, of a corner
/// `½ L (1 + aζ)(2L − 2 + aζ)`, of an upright edge `L (1 − ζ²)`, of the others as before but linear along the prism.
fn prism(basis: Basis, area: &[Function], p: &Local, zeta: f64) -> Function {
    let corner = (0..3).find(|&k| share(2, p, k) == 1.0);
    let of = |(value, slope): (f64, f64)| along(2, (value, slope));
    match (basis, corner) {
        (Basis::Linear, Some(k)) => product([area[k], of(linear(p[2], zeta))]),
        (Basis::Serendipity, Some(k)) if p[2] == 0.0 => {
            product([area[k], of(quadratic(0.0, zeta))])
        }
        (Basis::Serendipity, Some(k)) => {
            let (l, g) = area[k];
            let rest = (2.0 * l - 2.0 + p[2] * zeta, [2.0 * g[0], 2.0 * g[1], p[2]]);
            product([area[k], of(linear(p[2], zeta)), rest])
        }
        (Basis::Serendipity, None) => product([on_simplex(area, p), of(linear(p[2], zeta))]),
        _ => product([on_simplex(area, p), of(quadratic(p[2], zeta))]),
    }
}

/// Area or volume coordinates of a simplex: the first is what the others leave of one.
fn barycentric(dim: usize, at: Local) -> Vec<Function> {
    let of = |c: usize| along(c, (at[c], 1.0));
    let down = std::array::from_fn(|c| if c < dim { -1.0 } else { 0.0 });
    std::iter::once((share(dim, &at, 0), down)).chain((0..dim).map(of)).collect()
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
/// tetrahedron, 1 of a prism). `radial` asks for one order more: the integrand carries the radius.
pub fn rule(kind: ElementKind, integrand: Integrand, radial: bool) -> Vec<(Local, f64)> {
    let gauss2 = GAUSS2.map(|x| (x, 1.0));
    let is_linear = kind.basis() == Basis::Linear;
    let is_stiffness = integrand == Integrand::Stiffness;
    match (kind.family(), kind.dim()) {
        (Family::Cube, dim) => match is_linear && (dim < 3 || is_stiffness) {
            true => tensor(dim, &gauss2),
            false => tensor(dim, &GAUSS3),
        },
        (Family::Simplex, 2) => triangle(match (is_linear, is_stiffness, radial) {
            (true, true, false) => 1,
            (true, true, true) | (true, false, false) | (false, true, false) => 2,
            _ => 4,
        }),
        (Family::Simplex, _) => match (is_linear, is_stiffness) {
            (true, true) => simplex(3, &[(0.25, 1.0)]),
            (true, false) | (false, true) => simplex(3, &TETRAHEDRON2),
            (false, false) => tetrahedron5(),
        },
        (Family::Prism, _) => match is_linear && is_stiffness {
            true => times(&triangle(2), &gauss2),
            false => times(&triangle(4), &GAUSS3),
        },
    }
}

/// A point of a rule, with the shape functions there and their gradients in local coordinates.
#[derive(Debug)]
pub(super) struct Tabulated {
    pub local: Local,
    pub weight: f64,
    pub values: Vec<f64>,
    pub gradients: Vec<Local>,
}

impl Tabulated {
    pub fn new(kind: ElementKind, (local, weight): (Local, f64)) -> Tabulated {
        let (values, gradients) = functions(kind, local).into_iter().unzip();
        Tabulated { local, weight, values, gradients }
    }
}

/// The points of [`rule`]: the same in all elements of a kind, made when the first of them is met.
pub(super) fn tabulated(
    kind: ElementKind,
    integrand: Integrand,
    radial: bool,
) -> &'static [Tabulated] {
    type OfKind = [[OnceLock<Vec<Tabulated>>; 2]; 2];
    static ALL: [OfKind; ElementKind::ALL.len()] =
        [const { [const { [const { OnceLock::new() }; 2] }; 2] }; ElementKind::ALL.len()];
    let is_mass = usize::from(integrand == Integrand::Mass);
    ALL[kind as usize][is_mass][usize::from(radial)].get_or_init(|| {
        let rule = rule(kind, integrand, radial).into_iter();
        rule.map(|point| Tabulated::new(kind, point)).collect()
    })
}

/// Simpson's rule along each axis, its points in the order of the nodes of an element that has one at each.
pub(super) fn simpson(kind: ElementKind) -> Vec<(Local, f64)> {
    let along = |x: f64| if x == 0.0 { 4.0 / 3.0 } else { 1.0 / 3.0 };
    let of = |at: &Local| (*at, at[..kind.dim()].iter().map(|x| along(*x)).product());
    places(kind).iter().map(of).collect()
}

/// A rule of this degree on the triangle.
fn triangle(degree: usize) -> Vec<(Local, f64)> {
    match degree {
        1 => simplex(2, &[(1.0 / 3.0, 1.0)]),
        2 => simplex(2, &[(1.0 / 6.0, 1.0 / 3.0)]),
        _ => simplex(2, &DEGREE4),
    }
}

/// A rule on the triangle times one on `[−1, 1]`.
fn times(triangle: &[(Local, f64)], line: &[(f64, f64)]) -> Vec<(Local, f64)> {
    let of = |&([x, y, _], w): &(Local, f64)| line.iter().map(move |&(z, v)| ([x, y, z], w * v));
    triangle.iter().flat_map(of).collect()
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
pub(crate) fn side_rule(kind: ElementKind, side: usize) -> Vec<SidePoint> {
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
    if let Some(face) = kind.face(side) {
        let of = |(s, weight)| point((functions(face, s), functions(face.linear(), s)), weight);
        return rule(face, Integrand::Mass, false).into_iter().map(of).collect();
    }
    if nodes.len() == 1 {
        let end = vec![(1.0, [0.0; 3])];
        return vec![point((end.clone(), end), 1.0)];
    }
    let of = |s: f64, weight: f64| point((on_line(nodes.len(), s), on_line(2, s)), weight);
    match nodes.len() {
        2 => GAUSS2.iter().map(|&s| of(s, 1.0)).collect(),
        _ => GAUSS3.iter().map(|&(s, w)| of(s, w)).collect(),
    }
}

/// Functions of a line by its ends, and its middle where it has one.
fn on_line(nodes: usize, s: f64) -> Vec<Function> {
    match nodes {
        2 => [-1.0, 1.0].map(|a| along(0, linear(a, s))).to_vec(),
        _ => [-1.0, 1.0, 0.0].map(|a| along(0, quadratic(a, s))).to_vec(),
    }
}

/// Shape functions of the nodes of a side, which is a line or a face, at a place in its own coordinates, and their derivatives along these.
pub(crate) fn on_side(kind: ElementKind, side: usize, at: [f64; 2]) -> Vec<(f64, [f64; 2])> {
    let of = match kind.face(side) {
        Some(face) => functions(face, [at[0], at[1], 0.0]),
        None => on_line(kind.side(side).len(), at[0]),
    };
    of.into_iter().map(|(value, [a, b, _])| (value, [a, b])).collect()
}

/// Nodes and weights of the Gauss–Legendre rule with `n` points on `[−1, 1]`: roots of `P_n` by Newton's method.
pub(crate) fn gauss(n: usize) -> Vec<(f64, f64)> {
    let count = n as f64;
    // P_n and its derivative
    let legendre = |x: f64| {
        let (mut before, mut p) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
        }
        (p, count * (x * p - before) / (x * x - 1.0))
    };
    let root = |k: usize| {
        let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (count + 0.5)).cos();
        for _ in 0..8 {
            let (p, slope) = legendre(x);
            x -= p / slope;
        }
        let slope = legendre(x).1;
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(root).collect()
}

/// The weights of a uniform pressure on a side over its nodes, as shares of its area: of flat straight-sided sides the nodal forces of a unit pressure.
pub fn side_shares(kind: ElementKind, side: usize) -> Vec<f64> {
    let rule = side_rule(kind, side);
    let total: f64 = rule.iter().map(|p| p.weight).sum();
    let share = |k: usize| rule.iter().map(|p| p.weight * p.values[k]).sum::<f64>() / total;
    (0..kind.side(side).len()).map(share).collect()
}

/// Whether a uniform pressure on a side pushes all of its nodes: not on sides of second order without a node in the middle.
pub fn bears(kind: ElementKind, side: usize) -> bool {
    side_shares(kind, side).iter().all(|share| *share > 1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_of_gauss_integrate_powers() {
        for n in 2..9usize {
            for power in 0..2 * n {
                let sum: f64 = gauss(n).iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14, "{n} {power}");
            }
        }
    }

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
        // a prism: x^a y^b over the triangle, z^c over [−1, 1]
        for (kind, integrand, degrees) in [
            (ElementKind::Prism6, Integrand::Stiffness, [2, 3]),
            (ElementKind::Prism6, Integrand::Mass, [4, 5]),
            (ElementKind::Prism15, Integrand::Stiffness, [4, 5]),
            (ElementKind::Prism18, Integrand::Mass, [4, 5]),
        ] {
            let rule = rule(kind, integrand, false);
            for p in powers(3, 5).filter(|p| p[0] + p[1] <= degrees[0] && p[2] <= degrees[1]) {
                let along = if p[2] % 2 == 0 { 2.0 / (p[2] + 1) as f64 } else { 0.0 };
                let exact = factorial(p[0]) * factorial(p[1]) / factorial(p[0] + p[1] + 2) * along;
                assert!((integral(&rule, p) - exact).abs() < 1e-15, "{kind:?} {p:?}");
            }
            assert!(rule.iter().all(|(at, w)| *w > 0.0 && outside(kind, *at) == 0.0));
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
            (ElementKind::Prism6, vec![1.0 / 3.0; 3]),
            (ElementKind::Prism18, vec![0.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]),
        ] {
            let found = side_shares(kind, 1);
            assert_eq!(found.len(), expected.len());
            assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-15), "{kind:?}");
        }
        assert!((side_shares(ElementKind::Hex27, 5)[8] - 4.0 / 9.0).abs() < 1e-15);
        assert!((side_shares(ElementKind::Prism18, 3)[8] - 4.0 / 9.0).abs() < 1e-15);
        assert_eq!(side_shares(ElementKind::Prism6, 4).len(), 4);
    }
}
