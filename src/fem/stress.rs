//! Stress from displacements: `σ = D B u` at the centre of an element.
//!
//! `B` are the gradients of the shape functions there and `D` the elastic constants of the stiffness `K_e = ∫ Bᵀ D B`
//! (see [`super::element`]): plane stress in a plate, Young's modulus in a bar. The centre is where the stress of these
//! elements is most accurate (second order in the mesh size; at the nodes it is of first order, and jumps).

use super::element::{Material, q4_gradient, q4_strain};
use crate::scenario;
use nalgebra::SVector;

/// Stress in the plane, positive in tension. A bar has `xx` only.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stress {
    /// `σ_xx`
    pub xx: f64,
    /// `σ_yy`
    pub yy: f64,
    /// `σ_xy`
    pub xy: f64,
}

impl Stress {
    /// Von Mises' equivalent stress `√(σ_xx² − σ_xx σ_yy + σ_yy² + 3 σ_xy²)`, with `σ_zz = 0`.
    pub fn von_mises(&self) -> f64 {
        // half the sum of squares: no cancellation, so never the root of a negative number
        let (a, b, c) = (self.xx - self.yy, self.xx, self.yy);
        ((a * a + b * b + c * c) / 2.0 + 3.0 * self.xy * self.xy).sqrt()
    }

    /// The tensor row by row, `xx xy xz yx yy yz zx zy zz`.
    pub fn tensor(&self) -> [f64; 9] {
        [self.xx, self.xy, 0.0, self.xy, self.yy, 0.0, 0.0, 0.0, 0.0]
    }
}

/// The elastic constants that a scene names; a body of given matrices has none.
pub fn material(body: &scenario::Body) -> Option<Material> {
    let (young, density) = (body.young?, body.density?);
    match body.kind {
        scenario::BodyKind::Bar => {
            Some(Material::Bar { young, density, area: body.area.unwrap_or(1.0) })
        }
        scenario::BodyKind::Plate => Some(Material::Plate {
            young,
            poisson: body.poisson.unwrap_or(0.0),
            density,
            thickness: body.thickness.unwrap_or(1.0),
        }),
        scenario::BodyKind::Matrices => None,
    }
}

/// Stress at the centre of an element with corners `x` (two of a bar, four of a plate) and displacements `u` of these.
pub fn at_centre(material: &Material, x: &[[f64; 2]], u: &[[f64; 2]]) -> Stress {
    match *material {
        Material::Bar { young, .. } => {
            let xx = young * (u[1][0] - u[0][0]) / (x[1][0] - x[0][0]);
            Stress { xx, ..Stress::default() }
        }
        Material::Plate { young, poisson, .. } => {
            let x: [[f64; 2]; 4] = std::array::from_fn(|a| x[a]);
            let (gradient, _) = q4_gradient(&x, 0.0, 0.0);
            let u = SVector::<f64, 8>::from_fn(|i, _| u[i / 2][i % 2]);
            let s = Material::plane_stress(young, poisson) * (q4_strain(&gradient) * u);
            Stress { xx: s[0], yy: s[1], xy: s[2] }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NU: f64 = 0.3;
    const E: f64 = 3.0;
    const PLATE: Material = Material::Plate { young: E, poisson: NU, density: 2.0, thickness: 0.5 };

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
        };
        for x in [
            [[0.0, 0.0], [0.5, 0.0], [0.5, 0.2], [0.0, 0.2]],
            [[0.0, 0.1], [1.1, 0.0], [1.3, 0.9], [-0.1, 1.2]],
        ] {
            let u = x.map(|p| [0.7 + a * p[0] + b * p[1], c * p[0] + d * p[1] - 0.1]);
            close(at_centre(&PLATE, &x, &u), expected);
        }
        // uniaxial: the equivalent stress is the stress; pure shear: √3 times
        assert_eq!(Stress { xx: 2.0, ..Stress::default() }.von_mises(), 2.0);
        let shear = Stress { xy: -2.0, ..Stress::default() };
        assert!((shear.von_mises() - 12f64.sqrt()).abs() < 1e-15);
        let t = expected.tensor();
        assert_eq!((t[0], t[1], t[3], t[4], t[8]), {
            let Stress { xx, yy, xy } = expected;
            (xx, xy, xy, yy, 0.0)
        });
    }

    #[test]
    fn a_rotation_is_free_of_stress_and_a_bar_obeys_hooke() {
        let x = [[0.0, 0.1], [1.1, 0.0], [1.3, 0.9], [-0.1, 1.2]];
        close(at_centre(&PLATE, &x, &x.map(|p| [-p[1], p[0]])), Stress::default());
        let bar = Material::Bar { young: E, density: 1.0, area: 7.0 };
        let (x, e) = ([[0.25, 0.0], [0.75, 0.0]], -0.02);
        let stress = at_centre(&bar, &x, &x.map(|p| [1.0 + e * p[0], 0.0]));
        close(stress, Stress { xx: E * e, ..Stress::default() });
    }
}
