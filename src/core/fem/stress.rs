//! Stress from displacements: `σ = D B u` at the centre of an element.
//!
//! `B` are the gradients of the shape functions there and `D` the elastic constants of the stiffness `K_e = ∫ Bᵀ D B`
//! (see [`super::element`]): plane stress in a plate, Young's modulus in a bar. The centre is where the stress of these
//! elements is most accurate (second order in the mesh size; at the nodes it is of first order, and jumps).

use nalgebra::{Matrix6xX, Vector6};

use super::element::Shape;
use super::law::Material;
use super::shape;
use crate::mesh::Point;

/// Stress of a body, positive in tension. A bar has `xx` only, a body in the plane no `yz` and `zx`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stress {
    /// `σ_xx`
    pub xx: f64,
    /// `σ_yy`
    pub yy: f64,
    /// `σ_zz`: of a plane body across the plane or along the circumference, zero in plane stress.
    pub zz: f64,
    /// `σ_xy`
    pub xy: f64,
    /// `σ_yz`
    pub yz: f64,
    /// `σ_zx`
    pub zx: f64,
}

impl Stress {
    /// Von Mises' equivalent stress `√(½((σ_xx − σ_yy)² + (σ_yy − σ_zz)² + (σ_zz − σ_xx)²) + 3 (σ_xy² + σ_yz² + σ_zx²))`.
    pub fn von_mises(&self) -> f64 {
        let (a, b, c) = (self.xx - self.yy, self.yy - self.zz, self.zz - self.xx);
        let shear = self.xy * self.xy + self.yz * self.yz + self.zx * self.zx;
        ((a * a + b * b + c * c) / 2.0 + 3.0 * shear).sqrt()
    }

    /// `(σ_xx, σ_yy, σ_zz, σ_xy, σ_yz, σ_zx)`
    pub fn vector(&self) -> Vector6<f64> {
        let Stress { xx, yy, zz, xy, yz, zx } = *self;
        Vector6::new(xx, yy, zz, xy, yz, zx)
    }

    /// `Σ w σ`
    pub fn sum(parts: impl IntoIterator<Item = (f64, Stress)>) -> Stress {
        let add = |sum: Vector6<f64>, (w, s): (f64, Stress)| sum + s.vector() * w;
        Stress::of_vector(parts.into_iter().fold(Vector6::zeros(), add))
    }

    /// From its components in the order of [`Stress::vector`].
    pub fn of_vector(components: Vector6<f64>) -> Stress {
        let [xx, yy, zz, xy, yz, zx] = components.into();
        Stress { xx, yy, zz, xy, yz, zx }
    }

    /// At a place of an element whose nodes have the displacements `u`.
    pub fn at(material: &Material, element: Shape, local: shape::Local, u: &[Point]) -> Stress {
        StressRows::new(material, element, local).of(u)
    }

    /// The tensor row by row, `xx xy xz yx yy yz zx zy zz`.
    pub fn tensor(&self) -> [f64; 9] {
        let Stress { xx, yy, zz, xy, yz, zx } = *self;
        [xx, xy, zx, xy, yy, yz, zx, yz, zz]
    }
}

/// `D B` at the centre of an element: what makes stress of the displacements of its nodes.
#[derive(Debug)]
pub struct AtCentre(StressRows);

impl AtCentre {
    /// That of an element.
    pub fn new(material: &Material, element: Shape) -> AtCentre {
        AtCentre(StressRows::new(material, element, shape::centre(element.kind)))
    }

    /// Stress where the nodes have the displacements `u`.
    pub fn of(&self, u: &[Point]) -> Stress {
        self.0.of(u)
    }
}

/// Stress at the centre of an element whose nodes have the displacements `u`.
pub fn at_centre(material: &Material, element: Shape, u: &[Point]) -> Stress {
    AtCentre::new(material, element).of(u)
}

/// Stress at each of its nodes.
pub fn at_nodes(material: &Material, element: Shape, u: &[Point]) -> Vec<Stress> {
    let at = |local: &shape::Local| Stress::at(material, element, *local, u);
    shape::places(element.kind).iter().map(at).collect()
}

/// `D B` at a place of an element.
#[derive(Debug)]
struct StressRows {
    dim: usize,
    rows: Matrix6xX<f64>,
}

impl StressRows {
    fn new(material: &Material, element: Shape, local: shape::Local) -> StressRows {
        StressRows { dim: element.kind.dim(), rows: element.stress_rows(material, local) }
    }

    fn of(&self, u: &[Point]) -> Stress {
        let StressRows { dim, rows } = self;
        let entry = |i: usize| (0..rows.ncols()).map(|j| rows[(i, j)] * u[j / dim][j % dim]).sum();
        let [xx, yy, zz, xy, yz, zx] = [0, 1, 2, 3, 4, 5].map(entry);
        Stress { xx, yy, zz, xy, yz, zx }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ElementKind;

    const NU: f64 = 0.3;
    const E: f64 = 3.0;
    fn plate() -> Material {
        Material::plate(E, NU, 2.0, 0.5)
    }

    fn quad(x: &[Point]) -> Shape<'_> {
        Shape { kind: ElementKind::Quad4, x }
    }

    fn close(a: Stress, b: Stress) {
        for (a, b) in [(a.xx, b.xx), (a.yy, b.yy), (a.xy, b.xy)] {
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
    }

    /// `u = (a x + b y, c x + d y)`: constant stress by Hooke's law, whatever the quadrilateral.
    #[test]
    fn a_linear_field_has_the_stress_of_hookes_law() {
        let (a, b, c, d) = (1e-2, -3e-2, 2e-2, 5e-2);
        let expected = Stress {
            xx: E / (1.0 - NU * NU) * (a + NU * d),
            yy: E / (1.0 - NU * NU) * (d + NU * a),
            xy: E / (2.0 * (1.0 + NU)) * (b + c),
            ..Stress::default()
        };
        for x in [
            [[0.0, 0.0], [0.5, 0.0], [0.5, 0.2], [0.0, 0.2]],
            [[0.0, 0.1], [1.1, 0.0], [1.3, 0.9], [-0.1, 1.2]],
        ] {
            let x = x.map(|[x, y]| [x, y, 0.0]);
            let u = x.map(|p| [0.7 + a * p[0] + b * p[1], c * p[0] + d * p[1] - 0.1, 0.0]);
            close(at_centre(&plate(), quad(&x), &u), expected);
        }
        // uniaxial: the equivalent stress is the stress; pure shear: √3 times
        assert_eq!(Stress { xx: 2.0, ..Stress::default() }.von_mises(), 2.0);
        let shear = Stress { xy: -2.0, ..Stress::default() };
        assert!((shear.von_mises() - 12f64.sqrt()).abs() < 1e-15);
        let t = expected.tensor();
        assert_eq!((t[0], t[1], t[3], t[4], t[8]), {
            let Stress { xx, yy, xy, .. } = expected;
            (xx, xy, xy, yy, 0.0)
        });
    }

    /// At its nodes a linear field has the same stress; a bilinear one that of its gradients there.
    #[test]
    fn nodes_have_the_stress_of_their_gradients() {
        let x = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]].map(|[x, y]| [x, y, 0.0]);
        let u = x.map(|p| [0.1 * p[0] * p[1], 0.0, 0.0]);
        for (p, s) in x.iter().zip(at_nodes(&plate(), quad(&x), &u)) {
            let xx = E / (1.0 - NU * NU) * 0.1 * p[1];
            let xy = E / (2.0 * (1.0 + NU)) * 0.1 * p[0];
            close(s, Stress { xx, yy: NU * xx, xy, ..Stress::default() });
        }
    }

    #[test]
    fn a_rotation_is_free_of_stress_and_a_bar_obeys_hooke() {
        let x = [[0.0, 0.1], [1.1, 0.0], [1.3, 0.9], [-0.1, 1.2]].map(|[x, y]| [x, y, 0.0]);
        close(at_centre(&plate(), quad(&x), &x.map(|p| [-p[1], p[0], 0.0])), Stress::default());
        let bar = Material::bar(E, 1.0, 7.0);
        let (x, e) = ([[0.25, 0.0, 0.0], [0.75, 0.0, 0.0]], -0.02);
        let stress = at_centre(
            &bar,
            Shape { kind: ElementKind::Bar2, x: &x },
            &x.map(|p| [1.0 + e * p[0], 0.0, 0.0]),
        );
        close(stress, Stress { xx: E * e, ..Stress::default() });
    }
}
