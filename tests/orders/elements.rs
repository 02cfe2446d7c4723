//! A manufactured displacement `u*`, zero on the whole boundary, and the body force `f = −∇·σ(u*)` that makes it a solution: the error falls as `h^{p+1}` in
//! L² and as `h^p` in the norm of the energy. Only `K` is the program's: the load vector, the shape functions (inverted matrices of monomials), the
//! quadrature (Gauss by Newton's method, collapsed on simplices) and both norms are computed here. Stress that is recovered at the nodes gains an order over the mean
//! of the elements around, and its distance from that of the elements is the error in the norm of the energy.

use signorini::fem::recovery::{self, Recovery};
use signorini::fem::stress::{Stress, at_nodes};
use signorini::fem::{Body, DofMap, Held, MassForm, Material, Shape, SpdFactor, StressState};
use signorini::mesh::{Element, ElementKind, Family, Mesh, Point};

use super::slope;
use crate::common::cuboid::cuboid;
use crate::common::rectangle::rectangle;

const YOUNG: f64 = 2.0;
const POISSON: f64 = 0.3;

/// Nodes and weights of Gauss and Legendre on [0, 1]: the roots of `P_n` by Newton's method.
fn gauss(n: usize) -> Vec<(f64, f64)> {
    let legendre = |x: f64| {
        let (mut before, mut p) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
        }
        (p, n as f64 * (before - x * p) / (1.0 - x * x))
    };
    (0..n)
        .map(|k| {
            let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
            for _ in 0..20 {
                let (p, dp) = legendre(x);
                x -= p / dp;
            }
            let dp = legendre(x).1;
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * dp * dp))
        })
        .collect()
}

/// Points and weights on the unit cube, or by collapsing it on the unit simplex or the prism over the unit triangle.
fn rule(dim: usize, family: Family, n: usize) -> Vec<(Point, f64)> {
    let line = gauss(n);
    let mut all = vec![];
    for &(x, a) in &line {
        for &(y, b) in &line {
            for &(z, c) in if dim == 3 { &line[..] } else { &[(0.0, 1.0)][..] } {
                all.push(match (family, dim) {
                    (Family::Cube, _) => ([x, y, z], a * b * c),
                    (Family::Prism, _) | (Family::Simplex, 2) => {
                        ([x, y * (1.0 - x), z], a * b * c * (1.0 - x))
                    }
                    (Family::Simplex, _) => {
                        let (p, q) = (1.0 - x, 1.0 - y);
                        ([x, y * p, z * p * q], a * b * c * p * p * q)
                    }
                });
            }
        }
    }
    all
}

/// Exponents of the monomials that an element has: total degree at most `p`, each at most `p`, or (eight and twenty nodes) each at most two and together at
/// most two where they are not one; of prisms those of a triangle times those along it, with fifteen nodes the squares along it of first degree across.
fn monomials(kind: ElementKind) -> (i32, Vec<[i32; 3]>) {
    let quadratic = !matches!(
        kind,
        ElementKind::Tri3
            | ElementKind::Quad4
            | ElementKind::Tet4
            | ElementKind::Hex8
            | ElementKind::Prism6
    );
    let p = if quadratic { 2 } else { 1 };
    let top = if kind.dim() == 3 { p } else { 0 };
    let serendipity =
        matches!(kind, ElementKind::Quad8 | ElementKind::Hex20 | ElementKind::Prism15);
    let mut all = vec![];
    for a in 0..=p {
        for b in 0..=p {
            for c in 0..=top {
                let e = [a, b, c];
                let above: i32 = e.iter().filter(|k| **k > 1).sum();
                let has = match (kind.family(), serendipity) {
                    (Family::Simplex, _) => a + b + c <= p,
                    (Family::Prism, true) if c == 2 => a + b <= 1,
                    (Family::Prism, _) => a + b <= p,
                    (Family::Cube, true) => above <= 2,
                    (Family::Cube, false) => true,
                };
                if has {
                    all.push(e);
                }
            }
        }
    }
    assert_eq!(all.len(), kind.nodes(), "{kind:?}");
    (p, all)
}

fn monomial(e: [i32; 3], x: Point) -> f64 {
    (0..3).map(|c| x[c].powi(e[c])).product()
}

fn slope_of_monomial(e: [i32; 3], x: Point) -> Point {
    std::array::from_fn(|d| {
        let mut down = e;
        down[d] -= 1;
        if e[d] == 0 { 0.0 } else { f64::from(e[d]) * monomial(down, x) }
    })
}

/// `u*_c = a_c Π sin(πx) · (1 + s·x)`, its gradient and its second derivatives by hand: products of functions of one coordinate.
struct Exact {
    dim: usize,
}

impl Exact {
    /// `g`, `g′`, `g″` of the factor of component `c` along axis `d`: `sin(πx)(1 + κx)`.
    fn factor(&self, c: usize, d: usize, x: f64) -> [f64; 3] {
        let kappa = [[0.4, -0.3, 0.2], [-0.2, 0.5, 0.3], [0.3, 0.1, -0.4]][c][d];
        let pi = std::f64::consts::PI;
        let ((s, k), w) = ((pi * x).sin_cos(), 1.0 + kappa * x);
        [s * w, pi * k * w + kappa * s, 2.0 * kappa * pi * k - pi * pi * s * w]
    }

    /// `∂^e u_c`.
    fn derivative(&self, c: usize, e: [usize; 3], x: Point) -> f64 {
        let amplitude = [1.0, 0.7, -0.8][c];
        amplitude * (0..self.dim).map(|d| self.factor(c, d, x[d])[e[d]]).product::<f64>()
    }

    fn gradient(&self, x: Point) -> [Point; 3] {
        std::array::from_fn(|c| {
            std::array::from_fn(|d| match c < self.dim && d < self.dim {
                true => self.derivative(c, std::array::from_fn(|k| usize::from(k == d)), x),
                false => 0.0,
            })
        })
    }

    /// `f = −(λ + μ) ∇(∇·u) − μ Δu`.
    fn force(&self, x: Point) -> Point {
        let (lambda, mu) = lame(self.dim);
        let second = |c: usize, a: usize, b: usize| {
            let e = std::array::from_fn(|k| usize::from(k == a) + usize::from(k == b));
            self.derivative(c, e, x)
        };
        std::array::from_fn(|c| match c < self.dim {
            true => {
                (0..self.dim).map(|d| -(lambda + mu) * second(d, c, d) - mu * second(c, d, d)).sum()
            }
            false => 0.0,
        })
    }
}

/// Lamé's constants; in plane stress `λ` is `2λμ/(λ + 2μ)`.
fn lame(dim: usize) -> (f64, f64) {
    let mu = YOUNG / (2.0 * (1.0 + POISSON));
    let lambda = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    (if dim == 2 { 2.0 * lambda * mu / (lambda + 2.0 * mu) } else { lambda }, mu)
}

/// `σ : ε` of a gradient.
fn energy_density(dim: usize, g: &[Point; 3]) -> f64 {
    let (lambda, mu) = lame(dim);
    let trace: f64 = (0..dim).map(|c| g[c][c]).sum();
    let pairs = (0..dim).flat_map(|a| (0..dim).map(move |b| (a, b)));
    let square: f64 = pairs.map(|(a, b)| (0.5 * (g[a][b] + g[b][a])).powi(2)).sum();
    lambda * trace * trace + 2.0 * mu * square
}

/// An affine element: from the unit square, cube or simplex by its corner and its edges; shape functions as coefficients of monomials.
struct Affine {
    corner: Point,
    edges: Vec<Point>,
    /// Rows of the inverse of the edges.
    inverse: nalgebra::DMatrix<f64>,
    volume: f64,
    coefficients: nalgebra::DMatrix<f64>,
}

impl Affine {
    fn new(kind: ElementKind, nodes: &[Point]) -> Affine {
        let dim = kind.dim();
        // the corners that follow the first along the axes
        let along: &[usize] = match (kind.family(), dim) {
            (Family::Simplex, 2) => &[1, 2],
            (Family::Simplex | Family::Prism, _) => &[1, 2, 3],
            (Family::Cube, 2) => &[1, 3],
            (Family::Cube, _) => &[1, 3, 4],
        };
        let corner = nodes[0];
        let edges: Vec<Point> =
            along.iter().map(|&k| std::array::from_fn(|c| nodes[k][c] - corner[c])).collect();
        let jacobian = nalgebra::DMatrix::from_fn(dim, dim, |i, j| edges[j][i]);
        let volume = jacobian.determinant();
        assert!(volume > 0.0);
        let inverse = jacobian.try_inverse().unwrap();
        let (_, exponents) = monomials(kind);
        let mut own = Affine { corner, edges, inverse, volume, coefficients: Default::default() };
        let places: Vec<Point> = nodes.iter().map(|p| own.local(p)).collect();
        let n = exponents.len();
        let at_nodes = nalgebra::DMatrix::from_fn(n, n, |i, j| monomial(exponents[j], places[i]));
        own.coefficients = at_nodes.try_inverse().unwrap();
        own
    }

    fn local(&self, p: &Point) -> Point {
        std::array::from_fn(|d| match d < self.edges.len() {
            true => {
                (0..self.edges.len()).map(|c| self.inverse[(d, c)] * (p[c] - self.corner[c])).sum()
            }
            false => 0.0,
        })
    }

    fn place(&self, local: Point) -> Point {
        std::array::from_fn(|c| {
            self.corner[c] + self.edges.iter().zip(local).map(|(e, s)| e[c] * s).sum::<f64>()
        })
    }

    /// Shape functions and their gradients in space, from those at the same place of the unit cell.
    fn in_space(&self, local: &[(f64, Point)]) -> Vec<(f64, Point)> {
        let dim = self.edges.len();
        let of = |(value, here): &(f64, Point)| {
            let space = std::array::from_fn(|c| match c < dim {
                true => (0..dim).map(|d| here[d] * self.inverse[(d, c)]).sum(),
                false => 0.0,
            });
            (*value, space)
        };
        local.iter().map(of).collect()
    }

    /// Shape functions and their gradients on the unit cell.
    fn shapes(&self, exponents: &[[i32; 3]], local: Point) -> Vec<(f64, Point)> {
        let values: Vec<f64> = exponents.iter().map(|e| monomial(*e, local)).collect();
        let slopes: Vec<Point> = exponents.iter().map(|e| slope_of_monomial(*e, local)).collect();
        (0..exponents.len())
            .map(|i| {
                let weigh = |of: &dyn Fn(usize) -> f64| -> f64 {
                    (0..exponents.len()).map(|k| self.coefficients[(k, i)] * of(k)).sum()
                };
                (weigh(&|k| values[k]), std::array::from_fn(|d| weigh(&|k| slopes[k][d])))
            })
            .collect()
    }
}

/// `σ = λ tr ε + 2μ ε` in the components of the space.
fn hooke(dim: usize, g: &[Point; 3]) -> Vec<f64> {
    let (lambda, mu) = lame(dim);
    let trace: f64 = (0..dim).map(|c| g[c][c]).sum();
    let pairs = (0..dim).flat_map(|a| (a..dim).map(move |b| (a, b)));
    let of = |(a, b): (usize, usize)| {
        mu * (g[a][b] + g[b][a]) + if a == b { lambda * trace } else { 0.0 }
    };
    pairs.map(of).collect()
}

/// The same components of what the program says.
fn components(dim: usize, s: &Stress) -> Vec<f64> {
    let t = s.tensor();
    (0..dim).flat_map(|a| (a..dim).map(move |b| t[3 * a + b])).collect()
}

/// The root of the mean square over the nodes of the distance from the exact stress, over that of the exact stress: of the mean of the elements around, of the recovered
/// stress, of the latter at the boundary alone; and the estimated error in the norm of the energy.
fn nodal_stress(body: &Body, material: &Material, u: &[f64]) -> ([f64; 3], f64) {
    let (mesh, dim) = (&body.mesh, body.mesh.dim());
    let exact = Exact { dim };
    let elements: Vec<Element> = mesh.elements().collect();
    let of_node =
        |n: usize| -> Point { std::array::from_fn(|c| if c < dim { u[dim * n + c] } else { 0.0 }) };
    let displaced = |e: &Element| -> Vec<Point> { e.nodes.iter().map(|&n| of_node(n)).collect() };
    let (mut sums, mut counts) = (vec![vec![]; mesh.n_nodes()], vec![0.0; mesh.n_nodes()]);
    for e in &elements {
        let x = mesh.corners(*e);
        let stress = at_nodes(material, Shape { kind: e.kind, x: &x }, &displaced(e));
        for (&n, s) in e.nodes.iter().zip(stress) {
            sums[n].push((1.0, s));
            counts[n] += 1.0;
        }
    }
    let mean = |(parts, count): (Vec<(f64, Stress)>, f64)| {
        Stress::sum(parts.into_iter().map(|(w, s)| (w / count, s)))
    };
    let averaged: Vec<Stress> = sums.into_iter().zip(counts).map(mean).collect();
    let recovered = Recovery::new(mesh.nodes(), &elements).all();
    assert!(recovered.iter().map(|n| n.node).eq(0..mesh.n_nodes()));
    let recovered: Vec<Stress> = recovered
        .iter()
        .map(|n| n.stress(material, (&mesh.nodes()[n.node], dim), of_node))
        .collect();
    let (mut off, mut size) = ([0.0; 3], [0.0; 3]);
    for (n, p) in mesh.nodes().iter().enumerate() {
        let wanted = hooke(dim, &exact.gradient(*p));
        let at_boundary = p[..dim].iter().any(|x| *x < 1e-9 || *x > 1.0 - 1e-9);
        for (k, s) in [&averaged, &recovered, &recovered].into_iter().enumerate() {
            if k == 2 && !at_boundary {
                continue;
            }
            let found = components(dim, &s[n]);
            off[k] += found.iter().zip(&wanted).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            size[k] += wanted.iter().map(|b| b * b).sum::<f64>();
        }
    }
    let estimate = elements.iter().fold([0.0; 2], |sum, e| {
        let x = mesh.corners(*e);
        let nodal: Vec<Stress> = e.nodes.iter().map(|&n| recovered[n]).collect();
        let shape = Shape { kind: e.kind, x: &x };
        let [a, b] = recovery::energies(material, shape, (&displaced(e), &nodal));
        [sum[0] + a, sum[1] + b]
    });
    let relative = |k: usize| f64::sqrt(off[k] / size[k]);
    ([0, 1, 2].map(relative), (estimate[0] / estimate[1]).sqrt())
}

/// What is measured of a mesh.
#[derive(Debug)]
struct Errors {
    /// In L², over the norm of `u*`.
    l2: f64,
    /// In the norm of the energy, over that of `u*`.
    energy: f64,
    /// Of the stress at nodes, see [`nodal_stress`].
    stress: [f64; 3],
    /// The estimate of the error in the norm of the energy, over it.
    effectivity: f64,
}

fn errors(kind: ElementKind, mesh: Mesh) -> Errors {
    let dim = kind.dim();
    let exact = Exact { dim };
    let groups: &[&str] = match dim {
        2 => &["left", "right", "bottom", "top"],
        _ => &["xmin", "xmax", "ymin", "ymax", "zmin", "zmax"],
    };
    let held: Vec<Held> = groups.iter().flat_map(|g| (0..dim).map(|c| Held::along(g, c))).collect();
    let dofs = DofMap::new(&mesh, &held, &[]).unwrap();
    let material = match dim {
        2 => Material::plate(YOUNG, POISSON, 1.0, 1.0),
        _ => Material { young: YOUNG, poisson: POISSON, density: 1.0, state: StressState::Solid },
    };
    let body = Body::assemble(mesh, dofs, &[material], MassForm::Consistent);
    let (_, exponents) = monomials(kind);
    let points = rule(dim, kind.family(), 4);
    let cells: Vec<(Vec<usize>, Affine)> = body
        .mesh
        .elements()
        .map(|e| {
            let places: Vec<Point> = e.nodes.iter().map(|&n| body.mesh.nodes()[n]).collect();
            (e.nodes.to_vec(), Affine::new(kind, &places))
        })
        .collect();
    // cells of one kind have the same nodes on the unit cell
    let first = &cells[0].1;
    let shapes: Vec<Vec<(f64, Point)>> =
        points.iter().map(|(local, _)| first.shapes(&exponents, *local)).collect();
    let same = |c: &Affine| (&c.coefficients - &first.coefficients).amax() < 1e-9;
    assert!(cells.iter().all(|(_, c)| same(c)));
    let mut force = vec![0.0; dim * body.mesh.n_nodes()];
    for (nodes, cell) in &cells {
        for (&(local, weight), shapes) in points.iter().zip(&shapes) {
            let f = exact.force(cell.place(local));
            for (&node, (value, _)) in nodes.iter().zip(cell.in_space(shapes)) {
                for c in 0..dim {
                    force[dim * node + c] += weight * cell.volume * value * f[c];
                }
            }
        }
    }
    let mut u = body.dofs.gather_forces(&force);
    let factor = SpdFactor::new(&body.stiffness, "stiffness").unwrap();
    factor.solve(&mut u, &mut factor.scratch());
    let u = body.dofs.scatter(&u);
    // distances and sizes
    let (mut l2, mut energy) = ([0.0; 2], [0.0; 2]);
    for (nodes, cell) in &cells {
        for (&(local, weight), shapes) in points.iter().zip(&shapes) {
            let x = cell.place(local);
            let (mut value, mut gradient) = ([0.0; 3], [[0.0; 3]; 3]);
            for (&node, (shape, slope)) in nodes.iter().zip(cell.in_space(shapes)) {
                for c in 0..dim {
                    let of_node = u[dim * node + c];
                    value[c] += of_node * shape;
                    (0..dim).for_each(|d| gradient[c][d] += of_node * slope[d]);
                }
            }
            let wanted = exact.gradient(x);
            let weight = weight * cell.volume;
            for c in 0..dim {
                let u = exact.derivative(c, [0; 3], x);
                l2[0] += weight * (value[c] - u).powi(2);
                l2[1] += weight * u * u;
                (0..dim).for_each(|d| gradient[c][d] -= wanted[c][d]);
            }
            energy[0] += weight * energy_density(dim, &gradient);
            energy[1] += weight * energy_density(dim, &wanted);
        }
    }
    let (stress, estimate) = nodal_stress(&body, &material, &u);
    let (l2, energy) = ((l2[0] / l2[1]).sqrt(), (energy[0] / energy[1]).sqrt());
    Errors { l2, energy, stress, effectivity: estimate / energy }
}

/// What is wrong with the slopes of an element.
fn check(kind: ElementKind, sizes: &[usize], mesh: impl Fn(usize) -> Mesh) -> Option<String> {
    let (p, _) = monomials(kind);
    let found: Vec<(f64, Errors)> =
        sizes.iter().map(|&n| (1.0 / n as f64, errors(kind, mesh(n)))).collect();
    let of = |pick: fn(&Errors) -> f64| -> f64 {
        slope(&found.iter().map(|(h, e)| (*h, pick(e))).collect::<Vec<_>>())
    };
    let (l2, energy) = (of(|e| e.l2), of(|e| e.energy));
    let stress = [of(|e| e.stress[0]), of(|e| e.stress[1]), of(|e| e.stress[2])];
    let (_, last) = &found[found.len() - 1];
    println!(
        "{kind:?}: L2 {l2:.3}, energy {energy:.3}; errors {:.1e}, {:.1e}; stress {stress:.2?}, errors {:.4?}, effectivity {:.3}",
        last.l2, last.energy, last.stress, last.effectivity
    );
    let order = f64::from(p);
    let good = (l2 - order - 1.0).abs() < 0.1 && (energy - order).abs() < 0.1;
    // recovered stress gains an order, nearly so on the edges of coarse boxes, and its distance is the error
    let gains = stress[1] > order + 0.95 && stress[2] > order + 0.4;
    let tells = last.stress[1] < last.stress[0] && (0.9..1.7).contains(&last.effectivity);
    (!good || !gains || !tells)
        .then(|| format!("{kind:?}: slopes {l2:.3}, {energy:.3}, {stress:.3?}, {last:?}"))
}

#[test]
fn elements_in_the_plane_have_their_order() {
    let of_kind = |kind: ElementKind| {
        let sizes = if kind.nodes() > 4 { [8, 16] } else { [16, 32] };
        check(kind, &sizes, |n| rectangle(kind, [0.0, 1.0], 1.0, (n, n), 0.0))
    };
    let kinds = ElementKind::ALL.into_iter().filter(|k| k.dim() == 2);
    let wrong: Vec<String> = kinds.filter_map(of_kind).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn elements_in_space_have_their_order() {
    let of_kind = |kind: ElementKind| {
        let sizes = if kind.nodes() > 8 { [6, 8] } else { [10, 14] };
        check(kind, &sizes, |n| cuboid(kind, [1.0; 3], [n; 3], 0.0))
    };
    let kinds = ElementKind::ALL.into_iter().filter(|k| k.dim() == 3);
    let wrong: Vec<String> = kinds.filter_map(of_kind).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The measure itself: Gauss's rule is exact to degree `2n − 1`, on simplices as well (`∫ x^a y^b z^c = a! b! c!/(a + b + c + 3)!`).
#[test]
fn quadrature_of_these_tests_is_exact() {
    let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
    for (dim, family) in [
        (2, Family::Cube),
        (3, Family::Cube),
        (2, Family::Simplex),
        (3, Family::Simplex),
        (3, Family::Prism),
    ] {
        let points = rule(dim, family, 4);
        for e in [[0, 0, 0], [2, 1, 0], [3, 2, 0], [1, 1, 3]]
            .into_iter()
            .filter(|e| dim == 3 || e[2] == 0)
        {
            let found: f64 = points.iter().map(|(x, w)| w * monomial(e, *x)).sum();
            let line = |k: i32| 1.0 / f64::from(k + 1);
            let simplex = |e: &[i32], dim: i32| {
                let all: f64 = e.iter().map(|k| factorial(*k)).product();
                all / factorial(e.iter().sum::<i32>() + dim)
            };
            let wanted = match family {
                Family::Simplex => simplex(&e, dim as i32),
                Family::Prism => simplex(&e[..2], 2) * line(e[2]),
                Family::Cube => e.into_iter().map(line).product(),
            };
            assert!(
                (found / wanted - 1.0).abs() < 1e-13,
                "{dim} {family:?} {e:?}: {found} {wanted}"
            );
        }
    }
}
