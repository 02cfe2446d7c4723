//! Matrices of an element: `M_e = ∫ ρ PᵀP`, `K_e = ∫ Bᵀ D B` (theory §1), for every kind of element and every state.
//!
//! Shape functions and rules are those of [`super::shape`], `D` and the measure of a volume those of [`super::law`].

use std::borrow::Cow;

use nalgebra::{Dyn, MatrixXx6, OMatrix, U6};

use super::law::Material;
use super::shape::{self, Integrand, Local, Tabulated};
use crate::mesh::point::{aligned, cross, dot};
use crate::mesh::{ElementKind, Point};

/// Strain over the displacements of an element: six rows, in the order of [`super::law`].
pub(crate) type StrainRows = OMatrix<f64, U6, Dyn>;

/// How mass is spread over the displacements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MassForm {
    /// `∫ ρ PᵀP`.
    #[default]
    Consistent,
    /// A diagonal: row sums; of quadrilaterals and hexahedra with a node at their centre Simpson's rule, whose points are the nodes. Other elements of second order have nodes
    /// without mass, or with a negative one.
    Lumped,
    /// The diagonal of the consistent mass, scaled to the mass of the element (Hinton, Rock, Zienkiewicz, Earthquake Eng. Struct. Dyn. 4, 1976): positive for every
    /// element.
    ScaledDiagonal,
}

/// Dense element matrices, row-major, displacement components interleaved node by node.
#[derive(Debug, Clone)]
pub struct ElementMatrices {
    /// Mass.
    pub mass: Vec<f64>,
    /// Stiffness.
    pub stiffness: Vec<f64>,
    /// Number of displacements of the element.
    pub n: usize,
}

/// An element in its place.
#[derive(Debug, Clone, Copy)]
pub struct Shape<'a> {
    /// Kind.
    pub kind: ElementKind,
    /// Places of its nodes.
    pub x: &'a [Point],
}

/// A point of quadrature on a side of an element.
#[derive(Debug, Clone, PartialEq)]
pub struct OnSide {
    /// Place.
    pub place: Point,
    /// Share of the side's length, or area (1 for the end of a bar).
    pub area: f64,
    /// Outward unit normal.
    pub normal: Point,
    /// Shape functions of the nodes of the side.
    pub values: Vec<f64>,
    /// Local coordinates in the element.
    pub local: Local,
}

/// A place of an element: shape functions there, their gradients in space.
struct Station<'t> {
    values: Cow<'t, [f64]>,
    gradients: Vec<Point>,
    /// Local over global measure.
    det: f64,
    radius: f64,
}

/// `Σ w_k x_k`
pub(super) fn weighted<'p>(
    weights: impl Iterator<Item = f64>,
    x: impl Iterator<Item = &'p Point>,
) -> Point {
    let add = |s: Point, (w, p): (f64, &Point)| std::array::from_fn(|c| s[c] + w * p[c]);
    weights.zip(x).fold([0.0; 3], add)
}

/// Strain of a displacement times a function of this gradient, over that displacement.
pub(super) fn strain_of(gradient: &Point, dim: usize) -> StrainRows {
    let (values, gradients) = (Cow::Owned(vec![0.0]), vec![*gradient]);
    Station { values, gradients, det: 1.0, radius: 1.0 }.strain(dim, false)
}

impl Shape<'_> {
    fn at(&self, local: Local) -> Station<'static> {
        let point = Tabulated::new(self.kind, (local, 1.0));
        self.station(point.values.into(), &point.gradients)
    }

    /// The points of a rule with their weights.
    fn stations(
        &self,
        integrand: Integrand,
        radial: bool,
    ) -> impl Iterator<Item = (f64, Station<'static>)> {
        let points = shape::tabulated(self.kind, integrand, radial).iter();
        points.map(|p| (p.weight, self.station(Cow::Borrowed(&p.values), &p.gradients)))
    }

    /// From the shape functions at a place and their gradients in local coordinates.
    fn station<'t>(&self, values: Cow<'t, [f64]>, of: &[Local]) -> Station<'t> {
        let radius = values.iter().zip(self.x).map(|(v, p)| v * p[0]).sum();
        // rows of the Jacobian: tangents along the local coordinates; the axes where there are none
        let dim = self.kind.dim();
        let axis = |r: usize| -> Point { std::array::from_fn(|c| f64::from(u8::from(c == r))) };
        let j: [Point; 3] = std::array::from_fn(|r| match r < dim {
            true => weighted(of.iter().map(|g| g[r]), self.x.iter()),
            false => axis(r),
        });
        // columns of its inverse, times the determinant
        let columns = [cross(&j[1], &j[2]), cross(&j[2], &j[0]), cross(&j[0], &j[1])];
        let det = dot(&j[0], &columns[0]);
        let gradient = |g: &Local| -> Point {
            std::array::from_fn(|c| (0..dim).map(|r| columns[r][c] * g[r]).sum::<f64>() / det)
        };
        Station { gradients: of.iter().map(gradient).collect(), values, det, radius }
    }

    /// Gradients of the shape functions at its centre.
    pub(crate) fn gradients(&self) -> Vec<Point> {
        self.at(shape::centre(self.kind)).gradients
    }

    /// Determinant of the Jacobian at a place: not positive where the element is inverted.
    pub fn determinant(&self, local: Local) -> f64 {
        self.at(local).det
    }

    /// Its volume: of a plane body area times thickness, of a ring with `2πr`.
    pub fn volume(&self, material: &Material) -> f64 {
        let part = |(weight, s): (f64, Station)| weight * s.det * material.measure(s.radius);
        self.stations(Integrand::Mass, material.is_radial()).map(part).sum()
    }

    /// Mass and stiffness.
    pub fn matrices(&self, material: &Material, form: MassForm) -> ElementMatrices {
        let (nodes, dim) = (self.kind.nodes(), self.kind.dim());
        let n = dim * nodes;
        let (mut mass, mut stiffness) = (vec![0.0; n * n], vec![0.0; n * n]);
        let d = material.stiffness();
        let radial = material.is_radial();
        for (weight, s) in self.stations(Integrand::Stiffness, radial) {
            let b = s.strain(dim, radial);
            let volume = weight * s.det * material.measure(s.radius);
            let stress: MatrixXx6<f64> = b.transpose() * d;
            let k = stress * &b * volume;
            stiffness.iter_mut().zip(k.iter()).for_each(|(a, k)| *a += k);
        }
        for (weight, s) in self.stations(Integrand::Mass, radial) {
            let volume = weight * s.det * material.measure(s.radius);
            for a in 0..nodes {
                for b in 0..nodes {
                    let m = material.density * volume * s.values[a] * s.values[b];
                    for c in 0..dim {
                        mass[n * (dim * a + c) + dim * b + c] += m;
                    }
                }
            }
        }
        if let Some(of_nodes) = self.diagonal_mass(material, form, &mass) {
            mass.fill(0.0);
            (0..n).for_each(|k| mass[(n + 1) * k] = of_nodes[k / dim]);
        }
        ElementMatrices { mass, stiffness, n }
    }

    /// The masses of the nodes, where these have masses of their own.
    fn diagonal_mass(
        &self,
        material: &Material,
        form: MassForm,
        consistent: &[f64],
    ) -> Option<Vec<f64>> {
        let (nodes, dim) = (self.kind.nodes(), self.kind.dim());
        let n = dim * nodes;
        let row_sum = |a: usize| consistent[n * dim * a..n * (dim * a + 1)].iter().sum::<f64>();
        match form {
            MassForm::Consistent => None,
            MassForm::Lumped => match self.kind {
                ElementKind::Quad9 | ElementKind::Hex27 => {
                    let rule = shape::simpson(self.kind).into_iter();
                    let at = |(local, weight): (Local, f64)| {
                        let s = self.at(local);
                        material.density * weight * s.det * material.measure(s.radius)
                    };
                    Some(rule.map(at).collect())
                }
                _ => Some((0..nodes).map(row_sum).collect()),
            },
            MassForm::ScaledDiagonal => {
                let own = |a: usize| consistent[(n + 1) * dim * a];
                let scale = (0..nodes).map(row_sum).sum::<f64>() / (0..nodes).map(own).sum::<f64>();
                Some((0..nodes).map(|a| scale * own(a)).collect())
            }
        }
    }

    /// The stress at a place as six rows, in the order of [`super::law`], over the displacements of the element.
    pub fn stress_rows(&self, material: &Material, local: Local) -> StrainRows {
        let s = self.at(local);
        material.stiffness() * s.strain(self.kind.dim(), material.is_radial())
    }

    /// Elastic energies of displacements, twice: as they are, and what modes `1 − ξ_c²` inside the element would take off, `rᵀH⁻¹r` with `r = ∫GᵀDε`, `H = ∫GᵀDG`,
    /// `G = (det J₀/det J) J₀⁻ᵀ∇(1 − ξ_c²)` (Wilson's incompatible modes, in the form of Taylor, Beresford and Wilson).
    pub fn energy_and_relief(&self, material: &Material, u: &[f64]) -> [f64; 2] {
        let dim = self.kind.dim();
        let centre = self.at(shape::centre(self.kind));
        let axes = self.axes();
        let d = material.stiffness();
        let u = nalgebra::DVector::from_column_slice(u);
        let (mut r, mut h) =
            (nalgebra::DVector::zeros(dim * dim), nalgebra::DMatrix::zeros(dim * dim, dim * dim));
        let mut energy = 0.0;
        for point in shape::tabulated(self.kind, Integrand::Stiffness, false) {
            let (local, weight) = (point.local, point.weight);
            let s = self.station(Cow::Borrowed(&point.values), &point.gradients);
            let volume = weight * s.det * material.measure(s.radius);
            let strain = s.strain(dim, false) * &u;
            let scaled = centre.det / s.det;
            let gradients = (0..dim).map(|c| axes[c].map(|x| -2.0 * local[c] * scaled * x));
            let g = Station { values: vec![0.0; dim].into(), gradients: gradients.collect(), ..s }
                .strain(dim, false);
            let stress = d * strain;
            energy += volume * strain.dot(&stress);
            r += g.transpose() * stress * volume;
            h += g.transpose() * (d * &g) * volume;
        }
        let relief = h.cholesky().map_or(0.0, |h| r.dot(&h.solve(&r)));
        [energy, relief]
    }

    /// Points of quadrature on a side.
    pub fn side(&self, side: usize) -> Vec<OnSide> {
        let nodes = self.kind.side(side);
        let x = || nodes.iter().map(|&n| &self.x[n]);
        let middle = self.place(shape::centre(self.kind));
        let point = |p: shape::SidePoint| {
            let place = weighted(p.values.iter().copied(), x());
            let along = |c: usize| weighted(p.slopes.iter().map(|s| s[c]), x());
            let across = match self.kind.dim() {
                1 => [1.0, 0.0, 0.0],
                2 => cross(&along(0), &[0.0, 0.0, 1.0]),
                _ => cross(&along(0), &along(1)),
            };
            // exact along an axis
            let size = across[0].hypot(across[1]).hypot(across[2]);
            // away from the middle of the element
            let away = std::array::from_fn(|c| place[c] - middle[c]);
            let sign = dot(&across, &away).signum();
            OnSide {
                place,
                area: p.weight * size,
                normal: aligned(across.map(|n| n / size * sign)),
                values: p.values,
                local: p.local,
            }
        };
        shape::side_rule(self.kind, side).into_iter().map(point).collect()
    }

    /// `∂x/∂ξ_d` at the middle, along each local coordinate.
    pub(super) fn edges(&self) -> [Point; 3] {
        let slopes = shape::gradients(self.kind, shape::centre(self.kind));
        std::array::from_fn(|d| weighted(slopes.iter().map(|g| g[d]), self.x.iter()))
    }

    /// `∂ξ_d/∂x` there, from the gradients of the shape functions, `ξ = Σ φ_a ξ_a`; nothing along those that the kind does not have.
    pub(super) fn axes(&self) -> [Point; 3] {
        let gradients = self.at(shape::centre(self.kind)).gradients;
        let corners = shape::places(self.kind);
        std::array::from_fn(|d| weighted(corners.iter().map(|l| l[d]), gradients.iter()))
    }

    pub(crate) fn place(&self, local: Local) -> Point {
        weighted(shape::values(self.kind, local).into_iter(), self.x.iter())
    }

    /// The stress `mᵀσn` on a face with normal `n` in the direction `m`, as a row over the displacements of the element.
    pub(crate) fn traction_row(
        &self,
        material: &Material,
        local: Local,
        (m, n): (Point, Point),
    ) -> Vec<f64> {
        let rows = self.stress_rows(material, local);
        let both = |a: usize, b: usize| m[a] * n[b] + m[b] * n[a];
        let weights = [m[0] * n[0], m[1] * n[1], m[2] * n[2], both(0, 1), both(1, 2), both(2, 0)];
        let column = |j: usize| (0..6).map(|i| weights[i] * rows[(i, j)]).sum();
        (0..rows.ncols()).map(column).collect()
    }
}

/// Strain over displacements of which gradients are those sums, at a radius where values are these.
pub(super) fn of_gradients(
    gradients: Vec<Point>,
    (values, radius): (Vec<f64>, f64),
    (dim, material): (usize, &Material),
) -> StrainRows {
    Station { values: values.into(), gradients, det: 1.0, radius }.strain(dim, material.is_radial())
}

impl Station<'_> {
    /// Strain over the displacements; of a ring along the circumference `u_r/r`, on the axis its limit `∂u_r/∂r`.
    fn strain(&self, dim: usize, radial: bool) -> StrainRows {
        let mut b = StrainRows::zeros(dim * self.values.len());
        for (a, (g, v)) in self.gradients.iter().zip(self.values.iter()).enumerate() {
            let first = dim * a;
            for c in 0..dim {
                b[(c, first + c)] = g[c];
            }
            // shear in each plane of two axes
            for (row, (p, q)) in [(3, (0, 1)), (4, (1, 2)), (5, (2, 0))] {
                if p.max(q) < dim {
                    b[(row, first + p)] = g[q];
                    b[(row, first + q)] = g[p];
                }
            }
            if radial {
                b[(2, first)] = if self.radius > 0.0 { v / self.radius } else { g[0] };
            }
        }
        b
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DVector, Vector6};

    use super::*;
    use crate::fem::law::StressState;

    fn material(state: StressState) -> Material {
        Material { young: 3.0, poisson: 0.3, density: 2.0, state }
    }

    /// The states of a body of so many dimensions, but for the ring.
    fn states(dim: usize) -> Vec<StressState> {
        match dim {
            2 => vec![
                StressState::PlaneStress { thickness: 0.5 },
                StressState::PlaneStrain { thickness: 0.5 },
            ],
            _ => vec![StressState::Solid],
        }
    }

    fn kinds(dim: usize) -> impl Iterator<Item = ElementKind> {
        ElementKind::ALL.into_iter().filter(move |k| k.dim() == dim)
    }

    fn of_plane_and_space() -> impl Iterator<Item = ElementKind> {
        kinds(2).chain(kinds(3))
    }

    /// A distorted element with straight edges: its nodes by the map of its corners.
    fn distorted(kind: ElementKind) -> Vec<Point> {
        let (linear, corners): (_, &[Point]) = match (kind.corners(), kind.dim()) {
            (3, _) => (ElementKind::Tri3, &[[0.3, 0.1, 0.0], [1.4, 0.0, 0.0], [0.5, 1.1, 0.0]]),
            (4, 2) => (
                ElementKind::Quad4,
                &[[0.2, 0.1, 0.0], [1.3, 0.0, 0.0], [1.5, 0.9, 0.0], [0.1, 1.2, 0.0]],
            ),
            (4, _) => (
                ElementKind::Tet4,
                &[[0.3, 0.1, 0.2], [1.4, 0.0, 0.1], [0.5, 1.1, 0.0], [0.6, 0.3, 1.2]],
            ),
            (6, _) => (
                ElementKind::Prism6,
                &[
                    [0.2, 0.1, 0.0],
                    [1.3, 0.0, 0.1],
                    [0.1, 1.2, 0.05],
                    [0.1, 0.0, 1.1],
                    [1.2, 0.2, 1.0],
                    [0.0, 1.0, 1.3],
                ],
            ),
            _ => (
                ElementKind::Hex8,
                &[
                    [0.2, 0.1, 0.0],
                    [1.3, 0.0, 0.1],
                    [1.5, 0.9, -0.1],
                    [0.1, 1.2, 0.05],
                    [0.1, 0.0, 1.1],
                    [1.2, 0.2, 1.0],
                    [1.3, 1.1, 0.9],
                    [0.0, 1.0, 1.3],
                ],
            ),
        };
        let place =
            |&local: &Local| weighted(shape::values(linear, local).into_iter(), corners.iter());
        shape::places(kind).iter().map(place).collect()
    }

    /// The volume that the sides enclose, `⅓ ∮ x·n`, or the area `½ ∮ x·n`.
    fn enclosed(kind: ElementKind, x: &[Point]) -> f64 {
        let sides = (0..kind.sides()).flat_map(|s| Shape { kind, x }.side(s));
        sides.map(|p| p.area * dot(&p.place, &p.normal)).sum::<f64>() / kind.dim() as f64
    }

    fn nodal(kind: ElementKind, x: &[Point], field: impl Fn(&Point) -> Point) -> DVector<f64> {
        let all = x.iter().flat_map(|p| field(p).into_iter().take(kind.dim()));
        DVector::from_vec(all.collect())
    }

    #[test]
    fn rigid_motions_carry_no_force_and_the_mass_is_that_of_the_volume() {
        for kind in of_plane_and_space() {
            let (x, dim) = (distorted(kind), kind.dim());
            for state in states(dim) {
                let m = material(state);
                let e = Shape { kind, x: &x }.matrices(&m, MassForm::Consistent);
                let volume = m.measure(1.0) * enclosed(kind, &x);
                let total: f64 = e.mass.iter().sum();
                assert!((total - dim as f64 * 2.0 * volume).abs() < 1e-13, "{kind:?}");
                assert!((Shape { kind, x: &x }.volume(&m) - volume).abs() < 1e-14, "{kind:?}");
                let turn: fn(&Point) -> Point = match dim {
                    2 => |p| [-p[1], p[0], 0.0],
                    _ => |p| [0.3 * p[2] - p[1], p[0] - 0.7 * p[2], 0.7 * p[1] - 0.3 * p[0]],
                };
                let stiffness = nalgebra::DMatrix::from_row_slice(e.n, e.n, &e.stiffness);
                for motion in [|_: &Point| [0.4, -1.0, 0.7], turn] {
                    let force = &stiffness * nodal(kind, &x, motion);
                    assert!(force.amax() < 1e-12, "{kind:?}: {}", force.amax());
                }
            }
        }
    }

    /// A linear field has the stress of Hooke's law everywhere in every element: the patch test.
    #[test]
    fn a_linear_field_has_one_stress_in_every_element() {
        let g = [[1e-2, -3e-2, 4e-2], [2e-2, 5e-2, -1e-2], [-2e-2, 3e-2, 6e-2]];
        for kind in of_plane_and_space() {
            let (x, dim) = (distorted(kind), kind.dim());
            let grad = |a: usize, b: usize| if a.max(b) < dim { g[a][b] } else { 0.0 };
            let both = |a, b| grad(a, b) + grad(b, a);
            let strain = Vector6::new(
                grad(0, 0),
                grad(1, 1),
                grad(2, 2),
                both(0, 1),
                both(1, 2),
                both(2, 0),
            );
            let field = |p: &Point| -> Point {
                std::array::from_fn(|a| 0.7 + (0..dim).map(|b| grad(a, b) * p[b]).sum::<f64>())
            };
            for state in states(dim) {
                let m = material(state);
                let expected = m.stiffness() * strain;
                let u = nodal(kind, &x, field);
                for &local in shape::places(kind).iter().chain([&[0.2, 0.3, 0.1]]) {
                    let s = Shape { kind, x: &x }.stress_rows(&m, local) * &u;
                    assert!((s - expected).norm() < 1e-13, "{kind:?}");
                    // on an oblique face
                    let (t, n) = match dim {
                        2 => ([0.6, 0.8, 0.0], [0.8, -0.6, 0.0]),
                        _ => ([0.48, 0.64, 0.6], [0.64, -0.6, 0.48]),
                    };
                    let row = Shape { kind, x: &x }.traction_row(&m, local, (t, n));
                    let found: f64 = row.iter().zip(u.iter()).map(|(a, b)| a * b).sum();
                    let e = &expected;
                    let tensor = [[e[0], e[3], e[5]], [e[3], e[1], e[4]], [e[5], e[4], e[2]]];
                    let exact: f64 =
                        (0..9).map(|k| t[k / 3] * tensor[k / 3][k % 3] * n[k % 3]).sum();
                    assert!((found - exact).abs() < 1e-13);
                }
            }
        }
    }

    /// A body of revolution: a motion along the axis carries no force; the mass is that of the ring (Pappus); a uniform expansion has `ε_θθ = ε_rr`.
    #[test]
    fn rings_have_their_mass_and_their_hoop_strain() {
        for kind in kinds(2) {
            let x = distorted(kind);
            let e = Shape { kind, x: &x }
                .matrices(&material(StressState::Axisymmetric), MassForm::Consistent);
            let stiffness = nalgebra::DMatrix::from_row_slice(e.n, e.n, &e.stiffness);
            let force = stiffness * nodal(kind, &x, |_| [0.0, 1.0, 0.0]);
            assert!(force.amax() < 1e-11, "{kind:?}: {}", force.amax());
            // moment of the area about the axis, by triangles of its corners
            let third = |p: Point, q: Point, r: Point| {
                enclosed(ElementKind::Tri3, &[p, q, r]) * (p[0] + q[0] + r[0]) / 3.0
            };
            let moment: f64 = (1..kind.corners() - 1).map(|k| third(x[0], x[k], x[k + 1])).sum();
            let total: f64 = (0..x.len())
                .flat_map(|a| (0..x.len()).map(move |b| (a, b)))
                .map(|(a, b)| e.mass[e.n * (2 * a + 1) + 2 * b + 1])
                .sum();
            let exact = 2.0 * std::f64::consts::TAU * moment;
            assert!((total - exact).abs() < 1e-12 * exact, "{kind:?}: {total} {exact}");
            let s = Shape { kind, x: &x }
                .stress_rows(&material(StressState::Axisymmetric), [0.2, 0.3, 0.0])
                * nodal(kind, &x, |p| [0.01 * p[0], 0.0, 0.0]);
            assert!((s[0] - s[2]).abs() < 1e-14 && s[0] > 0.0);
        }
        // on the axis u_r/r has a limit
        let x = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let rows = Shape { kind: ElementKind::Tri3, x: &x }
            .stress_rows(&material(StressState::Axisymmetric), [0.0; 3]);
        assert!(rows.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn normals_of_sides_point_outwards_and_close() {
        for kind in of_plane_and_space() {
            let x = distorted(kind);
            let shape = Shape { kind, x: &x };
            let points: Vec<OnSide> = (0..kind.sides()).flat_map(|s| shape.side(s)).collect();
            // ∮ n ds = 0, and what the sides enclose is what the Jacobian says
            for c in 0..3 {
                let flux: f64 = points.iter().map(|p| p.area * p.normal[c]).sum();
                assert!(flux.abs() < 1e-14, "{kind:?}: {flux}");
            }
            let rule = shape::rule(kind, Integrand::Mass, false);
            let measure: f64 = rule.iter().map(|(at, w)| w * shape.determinant(*at)).sum();
            assert!((enclosed(kind, &x) - measure).abs() < 2e-14, "{kind:?}");
        }
        let bar = Shape { kind: ElementKind::Bar2, x: &[[0.0; 3], [0.5, 0.0, 0.0]] };
        let ends = [0, 1].map(|s| bar.side(s)[0].clone());
        assert_eq!(ends.clone().map(|e| e.normal[0]), [-1.0, 1.0]);
        assert_eq!(ends.map(|e| (e.area, e.values)), [(1.0, vec![1.0]), (1.0, vec![1.0])]);
    }

    /// What lies along an axis up to rounding errors does so to the digit: a square that was turned by a right angle and moved; what is oblique stays.
    #[test]
    fn normals_along_axes_are_exact() {
        let (sine, cosine) = std::f64::consts::FRAC_PI_2.sin_cos();
        let turned =
            |x: f64, y: f64| [0.3 + cosine * x - sine * y, 0.7 + sine * x + cosine * y, 0.0];
        let x = [turned(0.0, 0.0), turned(0.1, 0.0), turned(0.1, 0.1), turned(0.0, 0.1)];
        let shape = Shape { kind: ElementKind::Quad4, x: &x };
        for side in 0..4 {
            let normals = shape.side(side).into_iter().map(|p| p.normal);
            assert!(normals.flatten().all(|n| n == 0.0 || n.abs() == 1.0));
        }
        let oblique = [1.0, 1e-9, 0.0];
        assert_eq!(aligned(oblique), oblique);
    }

    /// Faces turn outwards by the order of their nodes alone, and a mirrored element is mirrored back.
    #[test]
    fn faces_of_solids_go_round_counter_clockwise_from_outside() {
        for kind in kinds(3) {
            let x = distorted(kind);
            let middle = Shape { kind, x: &x }.place(shape::centre(kind));
            for side in 0..kind.sides() {
                let [a, b, c] = [0, 1, 2].map(|k| x[kind.side(side)[k]]);
                let minus =
                    |p: &Point, q: &Point| -> Point { std::array::from_fn(|c| p[c] - q[c]) };
                let normal = cross(&minus(&b, &a), &minus(&c, &b));
                assert!(dot(&normal, &minus(&a, &middle)) > 0.0, "{kind:?} {side}");
                // nodes behind the corners lie where the face's own kind has them
                let Some(face) = kind.face(side) else { continue };
                let linear = face.linear();
                let nodes = kind.side(side);
                for (&n, &at) in nodes.iter().zip(shape::places(face)) {
                    let corners = nodes[..face.corners()].iter().map(|&l| &x[l]);
                    let place = weighted(shape::values(linear, at).into_iter(), corners);
                    assert!((0..3).all(|c| (place[c] - x[n][c]).abs() < 1e-15), "{kind:?} {side}");
                }
            }
            let mut nodes: Vec<usize> = (0..kind.nodes()).collect();
            kind.turn_round(&mut nodes);
            let mirrored: Vec<Point> = nodes.iter().map(|&n| x[n]).collect();
            let det = |x: &[Point]| Shape { kind, x }.determinant(shape::centre(kind));
            assert!((det(&mirrored) + det(&x)).abs() < 1e-14, "{kind:?}");
        }
    }

    #[test]
    fn a_bar_is_a_spring_between_two_masses() {
        let x = [[0.25, 0.0, 0.0], [0.75, 0.0, 0.0]];
        let e = Shape { kind: ElementKind::Bar2, x: &x }
            .matrices(&Material::bar(3.0, 2.0, 7.0), MassForm::Consistent);
        let (k, m) = (3.0 * 7.0 / 0.5, 2.0 * 7.0 * 0.5 / 6.0);
        for (found, exact) in e.stiffness.iter().zip([k, -k, -k, k]) {
            assert!((found - exact).abs() < 1e-13);
        }
        for (found, exact) in e.mass.iter().zip([2.0 * m, m, m, 2.0 * m]) {
            assert!((found - exact).abs() < 1e-14);
        }
    }
}
