//! What moves as given: the displacements that supports hold, `Σ_j w_j s_j(t)`.
//!
//! Their forces on the other displacements are loads. The energies of the whole body have their part, too:
//!
//! ```text
//! ½ uᵀKu + Σ_j s_j (K_fp w_j)ᵀu + ½ Σ_ij s_i s_j w_iᵀK_pp w_j
//! ½ vᵀMv + Σ_j ṡ_j (M_fp w_j)ᵀv + ½ Σ_ij ṡ_i ṡ_j w_iᵀM_pp w_j
//! ```

use super::body::Body;
use super::load::Course;
use super::reduction::Reduction;

/// A field of held displacements and what it does in time.
#[derive(Debug, Clone, PartialEq)]
struct Motion {
    course: Course,
    /// Over the nodes of the mesh.
    field: Vec<f64>,
    /// `K_fp w` over `u`.
    stiffness: Vec<f64>,
    /// `M_fp w` over `u`.
    mass: Vec<f64>,
}

/// All that moves as given.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Carried {
    motions: Vec<Motion>,
    /// `w_iᵀ K_pp w_j` and `w_iᵀ M_pp w_j`, row by row up to the diagonal.
    among: [Vec<f64>; 2],
}

impl Carried {
    /// Whether nothing moves.
    pub fn is_empty(&self) -> bool {
        self.motions.is_empty()
    }

    /// Add `w s(t)`; `forces` are `K_fp w` and `M_fp w`.
    pub fn push(&mut self, body: &Body, field: Vec<f64>, forces: [Vec<f64>; 2], course: &Course) {
        let [stiffness, mass] = forces;
        self.motions.push(Motion { course: course.clone(), field, stiffness, mass });
        if let Some(last) = self.motions.last() {
            let of = body.products_of_field(&last.field);
            for (among, product) in self.among.iter_mut().zip(of) {
                let dot = |m: &Motion| m.field.iter().zip(&product).map(|(w, p)| w * p).sum();
                among.extend(self.motions.iter().map(dot).collect::<Vec<f64>>());
            }
        }
    }

    /// Give all harmonic motions one frequency.
    pub fn set_frequency(&mut self, frequency: f64) {
        for m in &mut self.motions {
            if let Course::Harmonic { omega, .. } = &mut m.course {
                *omega = frequency;
            }
        }
    }

    /// Count time from another instant of all harmonic motions.
    pub(super) fn turn(&mut self, angle: f64) {
        for m in &mut self.motions {
            if let Course::Harmonic { phase, .. } = &mut m.course {
                *phase += angle;
            }
        }
    }

    /// The same over the coordinates of a reduction.
    pub fn reduced(&self, reduction: &Reduction) -> Carried {
        let of = |m: &Motion| Motion {
            stiffness: reduction.load(&m.stiffness),
            mass: reduction.load(&m.mass),
            ..m.clone()
        };
        Carried { motions: self.motions.iter().map(of).collect(), among: self.among.clone() }
    }

    /// Add the nodal field at a time, or its derivative of this order.
    pub fn add_field(&self, t: f64, order: u32, field: &mut [f64]) {
        for m in &self.motions {
            let s = m.course.at(t, order);
            field.iter_mut().zip(&m.field).for_each(|(x, w)| *x += s * w);
        }
    }

    /// What it adds to the elastic energy `½ uᵀKu`.
    pub fn elastic(&self, t: f64, u: &[f64]) -> f64 {
        self.quadratic(0, t, u)
    }

    /// What it adds to the kinetic energy `½ vᵀMv`.
    pub fn kinetic(&self, t: f64, v: &[f64]) -> f64 {
        self.quadratic(1, t, v)
    }

    /// What it adds to both.
    pub fn energy(&self, t: f64, u: &[f64], v: &[f64]) -> f64 {
        self.elastic(t, u) + self.kinetic(t, v)
    }

    /// With `K` and `s` of `u`, or `M` and `ṡ` of `u̇`.
    fn quadratic(&self, order: usize, t: f64, x: &[f64]) -> f64 {
        let s: Vec<f64> = self.motions.iter().map(|m| m.course.at(t, order as u32)).collect();
        let mut sum = 0.0;
        for (i, m) in self.motions.iter().enumerate() {
            let force = if order == 0 { &m.stiffness } else { &m.mass };
            let row = &self.among[order][i * (i + 1) / 2..];
            let before: f64 = (0..i).map(|j| s[j] * row[j]).sum();
            let along: f64 = force.iter().zip(x).map(|(f, x)| f * x).sum();
            sum += s[i] * (along + before + 0.5 * s[i] * row[i]);
        }
        sum
    }
}
