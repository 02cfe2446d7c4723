//! Linear elasticity apart from elements: what a material does in the state of the body.
//!
//! Strains and stresses stand as `(xx, yy, zz, xy, yz, zx)`, shear strain as `γ`. In plane stress `σ_zz = 0`, in plane strain `ε_zz = 0`; in an axisymmetric
//! body `x` is the radius and `y` the axis, and `zz` is along the circumference. Without a third axis nothing shears in its planes.

use nalgebra::Matrix6;

/// What the body is in the space that its mesh does not show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StressState {
    /// A bar of cross-section `A`: `σ_xx` alone.
    Uniaxial {
        /// A
        area: f64,
    },
    /// A plate of thickness `h` in its plane.
    PlaneStress {
        /// h
        thickness: f64,
    },
    /// A slice of thickness `h` of a body that is long across its plane.
    PlaneStrain {
        /// h
        thickness: f64,
    },
    /// A body of revolution, whole: volumes carry `2πr`.
    Axisymmetric,
    /// A body in space.
    Solid,
}

/// An isotropic, linearly elastic material in a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// E
    pub young: f64,
    /// ν
    pub poisson: f64,
    /// ρ
    pub density: f64,
    /// The state of the body.
    pub state: StressState,
}

impl Material {
    /// The material of a bar.
    pub fn bar(young: f64, density: f64, area: f64) -> Material {
        Material { young, poisson: 0.0, density, state: StressState::Uniaxial { area } }
    }

    /// The material of a plate in plane stress.
    pub fn plate(young: f64, poisson: f64, density: f64, thickness: f64) -> Material {
        Material { young, poisson, density, state: StressState::PlaneStress { thickness } }
    }

    /// `E′`, stress over strain across a wide face: E of a bar, E/(1−ν²) of a plate, E(1−ν)/((1+ν)(1−2ν)) where no direction yields.
    pub(crate) fn axial_stiffness(&self) -> f64 {
        let (e, nu) = (self.young, self.poisson);
        match self.state {
            StressState::Uniaxial { .. } => e,
            StressState::PlaneStress { .. } => e / (1.0 - nu * nu),
            StressState::PlaneStrain { .. } | StressState::Axisymmetric | StressState::Solid => {
                e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
            }
        }
    }

    /// Speed of longitudinal waves, `√(E′/ρ)`.
    pub fn wave_speed(&self) -> f64 {
        (self.axial_stiffness() / self.density).sqrt()
    }

    /// What turns the measure of the mesh at a radius (a length, an area; on its boundary a point, a length) into a volume (an area).
    pub fn measure(&self, radius: f64) -> f64 {
        match self.state {
            StressState::Uniaxial { area } => area,
            StressState::PlaneStress { thickness } | StressState::PlaneStrain { thickness } => {
                thickness
            }
            StressState::Axisymmetric => std::f64::consts::TAU * radius,
            StressState::Solid => 1.0,
        }
    }

    /// Whether volumes depend on the radius.
    pub(crate) fn is_radial(&self) -> bool {
        self.state == StressState::Axisymmetric
    }

    /// `D` of `σ = D ε`.
    pub fn stiffness(&self) -> Matrix6<f64> {
        let (e, nu) = (self.young, self.poisson);
        let shear = e / (2.0 * (1.0 + nu));
        let mut d = Matrix6::zeros();
        match self.state {
            StressState::Uniaxial { .. } => d[(0, 0)] = e,
            StressState::PlaneStress { .. } => {
                let c = e / (1.0 - nu * nu);
                (d[(0, 0)], d[(1, 1)]) = (c, c);
                (d[(0, 1)], d[(1, 0)]) = (c * nu, c * nu);
                d[(3, 3)] = c * (1.0 - nu) / 2.0;
            }
            StressState::PlaneStrain { .. } | StressState::Axisymmetric | StressState::Solid => {
                let lame = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
                for a in 0..3 {
                    for b in 0..3 {
                        d[(a, b)] = lame + if a == b { 2.0 * shear } else { 0.0 };
                    }
                }
                let planes = if self.state == StressState::Solid { 3..6 } else { 3..4 };
                planes.for_each(|k| d[(k, k)] = shear);
            }
        }
        d
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    #[test]
    fn hookes_law_holds_in_every_state() {
        let (e, nu) = (3.0, 0.3);
        let of = |state| Material { young: e, poisson: nu, density: 1.0, state };
        // ε_xx = (σ_xx − ν(σ_yy + σ_zz))/E, and so on, from the stresses that come out
        for state in [
            StressState::PlaneStress { thickness: 0.1 },
            StressState::PlaneStrain { thickness: 0.1 },
            StressState::Axisymmetric,
            StressState::Solid,
        ] {
            let is_plane = !matches!(state, StressState::Axisymmetric | StressState::Solid);
            let zz = if is_plane { 0.0 } else { -0.4 };
            let strain = Vector6::new(0.3, -0.2, zz, 0.5, 0.7, -0.6);
            let s = of(state).stiffness() * strain;
            let hooke = |a: f64, b: f64, c: f64| (a - nu * (b + c)) / e;
            assert!((hooke(s[0], s[1], s[2]) - strain[0]).abs() < 1e-15);
            assert!((hooke(s[1], s[0], s[2]) - strain[1]).abs() < 1e-15);
            match state {
                StressState::PlaneStress { .. } => assert_eq!(s[2], 0.0),
                _ => assert!((hooke(s[2], s[0], s[1]) - zz).abs() < 1e-15),
            }
            let sheared = if state == StressState::Solid { 3..6 } else { 3..4 };
            for k in 3..6 {
                let strain = if sheared.contains(&k) { strain[k] } else { 0.0 };
                assert!((s[k] * 2.0 * (1.0 + nu) / e - strain).abs() < 1e-15);
            }
        }
        assert_eq!(Material::bar(e, 1.0, 2.0).stiffness()[(0, 0)], e);
        // the stiffness across a wide face is that of the law
        for state in [
            StressState::PlaneStress { thickness: 1.0 },
            StressState::PlaneStrain { thickness: 1.0 },
        ] {
            let m = of(state);
            assert!((m.stiffness()[(0, 0)] - m.axial_stiffness()).abs() < 1e-14);
        }
    }
}
