//! Elements: the two-node bar and the four-node quadrilateral in plane stress.
//!
//! `M_e = ∫ ρ PᵀP`, `K_e = ∫ Bᵀ D B`, with `D = E/(1−ν²) [[1,ν,0],[ν,1,0],[0,0,(1−ν)/2]]` in plane
//! stress (theory §1). Integrals per thickness `h` or cross-section `A` carry that factor.

use nalgebra::{SMatrix, SVector};

/// Elastic constants with the geometry that is not in the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Material {
    /// Bar: Young's modulus, density, cross-section.
    Bar {
        /// E
        young: f64,
        /// ρ
        density: f64,
        /// A
        area: f64,
    },
    /// Plate in plane stress.
    Plate {
        /// E
        young: f64,
        /// ν
        poisson: f64,
        /// ρ
        density: f64,
        /// h
        thickness: f64,
    },
}

impl Material {
    /// Speed of longitudinal waves: √(E/ρ), in a plate √(E/((1−ν²)ρ)).
    pub fn wave_speed(&self) -> f64 {
        let (Material::Bar { density, .. } | Material::Plate { density, .. }) = self;
        (self.axial_stiffness() / density).sqrt()
    }

    /// `E′`, stress over strain across a wide face: E, in a plate E/(1−ν²).
    pub fn axial_stiffness(&self) -> f64 {
        match *self {
            Material::Bar { young, .. } => young,
            Material::Plate { young, poisson, .. } => young / (1.0 - poisson * poisson),
        }
    }

    /// Mass per unit of mesh measure (length of a bar, area of a plate).
    pub fn mass_density(&self) -> f64 {
        match *self {
            Material::Bar { density, area, .. } => density * area,
            Material::Plate { density, thickness, .. } => density * thickness,
        }
    }

    /// What turns the boundary measure of the mesh (a point, a length) into an area.
    pub fn boundary_factor(&self) -> f64 {
        match *self {
            Material::Bar { area, .. } => area,
            Material::Plate { thickness, .. } => thickness,
        }
    }

    pub(super) fn plane_stress(young: f64, nu: f64) -> SMatrix<f64, 3, 3> {
        let c = young / (1.0 - nu * nu);
        SMatrix::<f64, 3, 3>::new(
            c,
            c * nu,
            0.0, //
            c * nu,
            c,
            0.0, //
            0.0,
            0.0,
            c * (1.0 - nu) / 2.0,
        )
    }
}

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

/// Shape functions of the quadrilateral at `(ξ, η) ∈ [−1, 1]²`.
pub fn q4_shape(xi: f64, eta: f64) -> [f64; 4] {
    [
        (1.0 - xi) * (1.0 - eta) / 4.0,
        (1.0 + xi) * (1.0 - eta) / 4.0,
        (1.0 + xi) * (1.0 + eta) / 4.0,
        (1.0 - xi) * (1.0 + eta) / 4.0,
    ]
}

/// Local corner coordinates of the quadrilateral.
pub const Q4_CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Gradients of the shape functions and the Jacobian determinant.
pub(super) fn q4_gradient(x: &[[f64; 2]; 4], xi: f64, eta: f64) -> ([[f64; 2]; 4], f64) {
    let local: [[f64; 2]; 4] = std::array::from_fn(|a| {
        let [ca, cb] = Q4_CORNERS[a];
        [ca * (1.0 + cb * eta) / 4.0, cb * (1.0 + ca * xi) / 4.0]
    });
    let mut j = [[0.0; 2]; 2];
    for a in 0..4 {
        for r in 0..2 {
            for c in 0..2 {
                j[r][c] += local[a][r] * x[a][c];
            }
        }
    }
    let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
    let gradient = std::array::from_fn(|a| {
        let [gx, ge] = local[a];
        [(j[1][1] * gx - j[0][1] * ge) / det, (-j[1][0] * gx + j[0][0] * ge) / det]
    });
    (gradient, det)
}

/// Strain `(ε_xx, ε_yy, γ_xy)` from the eight displacements.
pub(super) fn q4_strain(gradient: &[[f64; 2]; 4]) -> SMatrix<f64, 3, 8> {
    let mut b = SMatrix::<f64, 3, 8>::zeros();
    for (a, g) in gradient.iter().enumerate() {
        b[(0, 2 * a)] = g[0];
        b[(1, 2 * a + 1)] = g[1];
        b[(2, 2 * a)] = g[1];
        b[(2, 2 * a + 1)] = g[0];
    }
    b
}

/// Gauss–Legendre points of the 2-point rule on [−1, 1] (weights 1).
pub const GAUSS2: [f64; 2] = [-0.577_350_269_189_625_8, 0.577_350_269_189_625_8];

/// Mass and stiffness of an element with corners `x`.
pub fn matrices(material: &Material, x: &[[f64; 2]]) -> ElementMatrices {
    match *material {
        Material::Bar { young, density, area } => {
            let h = x[1][0] - x[0][0];
            let (m, k) = (density * area * h / 6.0, young * area / h);
            ElementMatrices {
                mass: vec![2.0 * m, m, m, 2.0 * m],
                stiffness: vec![k, -k, -k, k],
                n: 2,
            }
        }
        Material::Plate { young, poisson, density, thickness } => {
            let x: [[f64; 2]; 4] = std::array::from_fn(|a| x[a]);
            let d = Material::plane_stress(young, poisson);
            let mut mass = SMatrix::<f64, 8, 8>::zeros();
            let mut stiffness = SMatrix::<f64, 8, 8>::zeros();
            for xi in GAUSS2 {
                for eta in GAUSS2 {
                    let p = q4_shape(xi, eta);
                    let (gradient, det) = q4_gradient(&x, xi, eta);
                    let b = q4_strain(&gradient);
                    stiffness += b.transpose() * d * b * (det * thickness);
                    for a in 0..4 {
                        for c in 0..4 {
                            let m = density * thickness * det * p[a] * p[c];
                            mass[(2 * a, 2 * c)] += m;
                            mass[(2 * a + 1, 2 * c + 1)] += m;
                        }
                    }
                }
            }
            // both are symmetric: transposing changes rounding at most
            ElementMatrices {
                mass: mass.as_slice().to_vec(),
                stiffness: stiffness.as_slice().to_vec(),
                n: 8,
            }
        }
    }
}

/// The normal stress `σ_n = nᵀσn` on a side with normal along `axis`, at a local point, as a row
/// over the element's displacements.
pub fn normal_stress_row(
    material: &Material,
    x: &[[f64; 2]],
    local: [f64; 2],
    axis: usize,
) -> Vec<f64> {
    match *material {
        Material::Bar { young, .. } => {
            let h = x[1][0] - x[0][0];
            vec![-young / h, young / h]
        }
        Material::Plate { young, poisson, .. } => {
            let x: [[f64; 2]; 4] = std::array::from_fn(|a| x[a]);
            let (gradient, _) = q4_gradient(&x, local[0], local[1]);
            let stress = Material::plane_stress(young, poisson) * q4_strain(&gradient);
            let row: SVector<f64, 8> = stress.row(axis).transpose();
            row.as_slice().to_vec()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLATE: Material =
        Material::Plate { young: 3.0, poisson: 0.3, density: 2.0, thickness: 0.5 };

    #[test]
    fn distorted_quadrilateral_passes_the_patch_test() {
        let x = [[0.0, 0.1], [1.1, 0.0], [1.3, 0.9], [-0.1, 1.2]];
        let e = matrices(&PLATE, &x);
        let total: f64 = e.mass.iter().sum();
        let area = 0.5
            * (0..4)
                .map(|a| x[a][0] * x[(a + 1) % 4][1] - x[(a + 1) % 4][0] * x[a][1])
                .sum::<f64>();
        assert!((total - 2.0 * 2.0 * 0.5 * area).abs() < 1e-13);
        // rigid motions carry no force
        for motion in [|_: [f64; 2]| [1.0, 0.0], |_| [0.0, 1.0], |p: [f64; 2]| [-p[1], p[0]]] {
            let u: Vec<f64> = x.iter().flat_map(|&p| motion(p)).collect();
            for i in 0..8 {
                let f: f64 = (0..8).map(|j| e.stiffness[8 * i + j] * u[j]).sum();
                assert!(f.abs() < 1e-13, "{f}");
            }
        }
        // uniform strain gives uniform stress
        let u: Vec<f64> = x.iter().flat_map(|p| [1e-2 * p[0], 0.0]).collect();
        let row = normal_stress_row(&PLATE, &x, [0.3, -0.7], 0);
        let s: f64 = row.iter().zip(&u).map(|(a, b)| a * b).sum();
        assert!((s - 3.0 / (1.0 - 0.09) * 1e-2).abs() < 1e-14);
    }
}
