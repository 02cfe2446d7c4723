//! Matrices of an element: `M_e = ∫ ρ PᵀP`, `K_e = ∫ Bᵀ D B` (theory §1), for every kind of element and every state.
//!
//! Shape functions and rules are those of [`super::shape`], `D` and the measure of a volume those of [`super::law`].

use nalgebra::{Dyn, MatrixXx4, OMatrix, U4};

use super::law::Material;
use super::shape::{self, Integrand, Local};
use crate::mesh::ElementKind;

/// Strain over the displacements of an element: four rows.
type StrainRows = OMatrix<f64, U4, Dyn>;

/// Dense element matrices, row-major, displacement components interleaved node by node.
#[derive(Debug, Clone)]
pub struct ElementMatrices {
    /// Consistent mass.
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
    pub x: &'a [[f64; 2]],
}

/// A point of quadrature on a side of an element.
#[derive(Debug, Clone, PartialEq)]
pub struct OnSide {
    /// Place.
    pub place: [f64; 2],
    /// Share of the side's length (1 for the end of a bar).
    pub length: f64,
    /// Outward unit normal.
    pub normal: [f64; 2],
    /// Shape functions of the nodes of the side.
    pub values: Vec<f64>,
    /// Local coordinates in the element.
    pub local: Local,
}

/// A place of an element: shape functions there, their gradients in space.
struct Station {
    values: Vec<f64>,
    gradients: Vec<[f64; 2]>,
    /// Local over global measure.
    det: f64,
    radius: f64,
}

impl Shape<'_> {
    fn at(&self, local: Local) -> Station {
        let values = shape::values(self.kind, local);
        let of = shape::gradients(self.kind, local);
        let radius = values.iter().zip(self.x).map(|(v, p)| v * p[0]).sum();
        let mut j = [[0.0; 2]; 2];
        for (g, p) in of.iter().zip(self.x) {
            for r in 0..2 {
                for c in 0..2 {
                    j[r][c] += g[r] * p[c];
                }
            }
        }
        if self.kind.dim() == 1 {
            let gradients = of.iter().map(|g| [g[0] / j[0][0], 0.0]).collect();
            return Station { values, gradients, det: j[0][0], radius };
        }
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let gradient = |&[gx, ge]: &[f64; 2]| {
            [(j[1][1] * gx - j[0][1] * ge) / det, (-j[1][0] * gx + j[0][0] * ge) / det]
        };
        Station { gradients: of.iter().map(gradient).collect(), values, det, radius }
    }

    /// Determinant of the Jacobian at a place: not positive where the element is inverted.
    pub fn determinant(&self, local: Local) -> f64 {
        self.at(local).det
    }

    /// Its volume: of a plane body area times thickness, of a ring with `2πr`.
    pub fn volume(&self, material: &Material) -> f64 {
        let part = |(local, weight): (Local, f64)| {
            let s = self.at(local);
            weight * s.det * material.measure(s.radius)
        };
        let rule = shape::rule(self.kind, Integrand::Mass, material.is_radial());
        rule.into_iter().map(part).sum()
    }

    /// Mass and stiffness.
    pub fn matrices(&self, material: &Material) -> ElementMatrices {
        let (nodes, dim) = (self.kind.nodes(), self.kind.dim());
        let n = dim * nodes;
        let (mut mass, mut stiffness) = (vec![0.0; n * n], vec![0.0; n * n]);
        let d = material.stiffness();
        let radial = material.is_radial();
        for (local, weight) in shape::rule(self.kind, Integrand::Stiffness, radial) {
            let s = self.at(local);
            let b = s.strain(dim, radial);
            let volume = weight * s.det * material.measure(s.radius);
            let stress: MatrixXx4<f64> = b.transpose() * d;
            let k = stress * &b * volume;
            stiffness.iter_mut().zip(k.iter()).for_each(|(a, k)| *a += k);
        }
        for (local, weight) in shape::rule(self.kind, Integrand::Mass, radial) {
            let s = self.at(local);
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
        ElementMatrices { mass, stiffness, n }
    }

    /// The stress at a place as four rows `(xx, yy, zz, xy)` over the displacements of the element.
    pub fn stress_rows(&self, material: &Material, local: Local) -> StrainRows {
        let s = self.at(local);
        material.stiffness() * s.strain(self.kind.dim(), material.is_radial())
    }

    /// Points of quadrature on a side.
    pub fn side(&self, side: usize) -> Vec<OnSide> {
        let nodes = self.kind.side(side);
        let middle = self.place(shape::centre(self.kind));
        let point = |p: shape::SidePoint| {
            let sum = |weights: &[f64], c: usize| -> f64 {
                nodes.iter().zip(weights).map(|(&n, w)| w * self.x[n][c]).sum()
            };
            let place = [sum(&p.values, 0), sum(&p.values, 1)];
            let along = [sum(&p.slopes, 0), sum(&p.slopes, 1)];
            let length = along[0].hypot(along[1]);
            let across = match nodes.len() {
                1 => [1.0, 0.0],
                _ => [along[1] / length, -along[0] / length],
            };
            // away from the middle of the element
            let outward = across[0] * (place[0] - middle[0]) + across[1] * (place[1] - middle[1]);
            let stretch = if nodes.len() == 1 { 1.0 } else { length };
            OnSide {
                place,
                length: p.weight * stretch,
                normal: across.map(|n| n * outward.signum()),
                values: p.values,
                local: p.local,
            }
        };
        shape::side_rule(self.kind, side).into_iter().map(point).collect()
    }

    fn place(&self, local: Local) -> [f64; 2] {
        let values = shape::values(self.kind, local);
        [0, 1].map(|c| values.iter().zip(self.x).map(|(v, p)| v * p[c]).sum())
    }

    /// The stress `mᵀσn` on a face with normal `n` in the direction `m`, as a row over the displacements of the element.
    pub fn traction_row(
        &self,
        material: &Material,
        local: Local,
        (m, n): ([f64; 2], [f64; 2]),
    ) -> Vec<f64> {
        let rows = self.stress_rows(material, local);
        let weights = [m[0] * n[0], m[1] * n[1], 0.0, m[0] * n[1] + m[1] * n[0]];
        let column = |j: usize| (0..4).map(|i| weights[i] * rows[(i, j)]).sum();
        (0..rows.ncols()).map(column).collect()
    }
}

impl Station {
    /// `(ε_xx, ε_yy, ε_zz, γ_xy)` over the displacements; along the circumference `u_r/r`, on the axis its limit `∂u_r/∂r`.
    fn strain(&self, dim: usize, radial: bool) -> StrainRows {
        let mut b = StrainRows::zeros(dim * self.values.len());
        for (a, (g, v)) in self.gradients.iter().zip(&self.values).enumerate() {
            b[(0, dim * a)] = g[0];
            if dim == 1 {
                continue;
            }
            b[(1, 2 * a + 1)] = g[1];
            b[(3, 2 * a)] = g[1];
            b[(3, 2 * a + 1)] = g[0];
            if radial {
                b[(2, 2 * a)] = if self.radius > 0.0 { v / self.radius } else { g[0] };
            }
        }
        b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::law::StressState;

    fn material(state: StressState) -> Material {
        Material { young: 3.0, poisson: 0.3, density: 2.0, state }
    }

    /// A distorted element with straight sides: its nodes by the map of its corners.
    fn distorted(kind: ElementKind) -> Vec<[f64; 2]> {
        let corners: &[[f64; 2]] = match kind.corners() {
            3 => &[[0.3, 0.1], [1.4, 0.0], [0.5, 1.1]],
            _ => &[[0.2, 0.1], [1.3, 0.0], [1.5, 0.9], [0.1, 1.2]],
        };
        let linear = if corners.len() == 3 { ElementKind::Tri3 } else { ElementKind::Quad4 };
        let place = |&local: &Local| {
            let v = shape::values(linear, local);
            [0, 1].map(|c| v.iter().zip(corners).map(|(v, p)| v * p[c]).sum())
        };
        shape::places(kind).iter().map(place).collect()
    }

    fn area(x: &[[f64; 2]], corners: usize) -> f64 {
        let cross = |a: usize| {
            let (p, q) = (x[a], x[(a + 1) % corners]);
            p[0] * q[1] - q[0] * p[1]
        };
        0.5 * (0..corners).map(cross).sum::<f64>()
    }

    #[test]
    fn rigid_motions_carry_no_force_and_the_mass_is_that_of_the_volume() {
        for kind in ElementKind::PLANE {
            let x = distorted(kind);
            for state in [
                StressState::PlaneStress { thickness: 0.5 },
                StressState::PlaneStrain { thickness: 0.5 },
            ] {
                let e = Shape { kind, x: &x }.matrices(&material(state));
                let total: f64 = e.mass.iter().sum();
                assert!(
                    (total - 2.0 * 2.0 * 0.5 * area(&x, kind.corners())).abs() < 1e-13,
                    "{kind:?}"
                );
                for motion in
                    [|_: [f64; 2]| [1.0, 0.0], |_| [0.0, 1.0], |p: [f64; 2]| [-p[1], p[0]]]
                {
                    let u: Vec<f64> = x.iter().flat_map(|&p| motion(p)).collect();
                    for i in 0..e.n {
                        let f: f64 = (0..e.n).map(|j| e.stiffness[e.n * i + j] * u[j]).sum();
                        assert!(f.abs() < 1e-12, "{kind:?}: {f}");
                    }
                }
            }
        }
    }

    /// A linear field has the stress of Hooke's law everywhere in every element: the patch test.
    #[test]
    fn a_linear_field_has_one_stress_in_every_element() {
        let (a, b, c, d) = (1e-2, -3e-2, 2e-2, 5e-2);
        for kind in ElementKind::PLANE {
            let x = distorted(kind);
            for state in [
                StressState::PlaneStress { thickness: 0.5 },
                StressState::PlaneStrain { thickness: 0.5 },
            ] {
                let m = material(state);
                let strain = nalgebra::Vector4::new(a, d, 0.0, b + c);
                let expected = m.stiffness() * strain;
                let u: Vec<f64> = x
                    .iter()
                    .flat_map(|p| [0.7 + a * p[0] + b * p[1], c * p[0] + d * p[1] - 0.1])
                    .collect();
                let u = nalgebra::DVector::from_vec(u);
                for &local in shape::places(kind).iter().chain([&[0.2, 0.3]]) {
                    let s = Shape { kind, x: &x }.stress_rows(&m, local) * &u;
                    assert!((s - expected).norm() < 1e-14, "{kind:?}");
                    // on an oblique face
                    let (t, n) = ([0.6, 0.8], [0.8, -0.6]);
                    let row = Shape { kind, x: &x }.traction_row(&m, local, (t, n));
                    let found: f64 = row.iter().zip(u.iter()).map(|(a, b)| a * b).sum();
                    let e = &expected;
                    let exact = 0.6 * (0.8 * e[0] - 0.6 * e[3]) + 0.8 * (0.8 * e[3] - 0.6 * e[1]);
                    assert!((found - exact).abs() < 1e-14);
                }
            }
        }
    }

    /// A body of revolution: a motion along the axis carries no force; the mass is that of the ring (Pappus); a uniform expansion has `ε_θθ = ε_rr`.
    #[test]
    fn rings_have_their_mass_and_their_hoop_strain() {
        for kind in ElementKind::PLANE {
            let x = distorted(kind);
            let e = Shape { kind, x: &x }.matrices(&material(StressState::Axisymmetric));
            let along: Vec<f64> = x.iter().flat_map(|_| [0.0, 1.0]).collect();
            for i in 0..e.n {
                let f: f64 = (0..e.n).map(|j| e.stiffness[e.n * i + j] * along[j]).sum();
                assert!(f.abs() < 1e-11, "{kind:?}: {f}");
            }
            // moment of the area about the axis, by triangles of its corners
            let third = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
                let t = [p, q, r];
                area(&t, 3) * (p[0] + q[0] + r[0]) / 3.0
            };
            let moment: f64 = (1..kind.corners() - 1).map(|k| third(x[0], x[k], x[k + 1])).sum();
            let total: f64 = (0..x.len())
                .flat_map(|a| (0..x.len()).map(move |b| (a, b)))
                .map(|(a, b)| e.mass[e.n * (2 * a + 1) + 2 * b + 1])
                .sum();
            let exact = 2.0 * std::f64::consts::TAU * moment;
            assert!((total - exact).abs() < 1e-12 * exact, "{kind:?}: {total} {exact}");
            let u: Vec<f64> = x.iter().flat_map(|p| [0.01 * p[0], 0.0]).collect();
            let s = Shape { kind, x: &x }
                .stress_rows(&material(StressState::Axisymmetric), [0.2, 0.3])
                * nalgebra::DVector::from_vec(u);
            assert!((s[0] - s[2]).abs() < 1e-14 && s[0] > 0.0);
        }
        // on the axis u_r/r has a limit
        let x = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let rows = Shape { kind: ElementKind::Tri3, x: &x }
            .stress_rows(&material(StressState::Axisymmetric), [0.0, 0.0]);
        assert!(rows.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn normals_of_sides_point_outwards_and_close() {
        for kind in ElementKind::PLANE {
            let x = distorted(kind);
            let shape = Shape { kind, x: &x };
            let points: Vec<OnSide> = (0..kind.sides()).flat_map(|s| shape.side(s)).collect();
            // ∮ n ds = 0, ∮ x·n ds = 2 A
            let flux =
                |f: &dyn Fn(&OnSide) -> f64| points.iter().map(|p| p.length * f(p)).sum::<f64>();
            assert!(flux(&|p| p.normal[0]).abs() < 1e-14 && flux(&|p| p.normal[1]).abs() < 1e-14);
            let twice = flux(&|p| p.place[0] * p.normal[0] + p.place[1] * p.normal[1]);
            assert!((twice - 2.0 * area(&x, kind.corners())).abs() < 2e-14, "{kind:?}");
        }
        let bar = Shape { kind: ElementKind::Bar2, x: &[[0.0, 0.0], [0.5, 0.0]] };
        let ends = [0, 1].map(|s| bar.side(s)[0].clone());
        assert_eq!(ends.clone().map(|e| e.normal[0]), [-1.0, 1.0]);
        assert_eq!(ends.map(|e| (e.length, e.values)), [(1.0, vec![1.0]), (1.0, vec![1.0])]);
    }

    #[test]
    fn a_bar_is_a_spring_between_two_masses() {
        let x = [[0.25, 0.0], [0.75, 0.0]];
        let e = Shape { kind: ElementKind::Bar2, x: &x }.matrices(&Material::bar(3.0, 2.0, 7.0));
        let (k, m) = (3.0 * 7.0 / 0.5, 2.0 * 7.0 * 0.5 / 6.0);
        for (found, exact) in e.stiffness.iter().zip([k, -k, -k, k]) {
            assert!((found - exact).abs() < 1e-13);
        }
        for (found, exact) in e.mass.iter().zip([2.0 * m, m, m, 2.0 * m]) {
            assert!((found - exact).abs() < 1e-14);
        }
    }
}
