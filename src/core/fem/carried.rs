//! What moves as given: the displacements that supports hold, `Σ_j w_j s_j(t)`, and the places from which contact displacements are counted, `u_C + Σ_j q_j s_j(t)`
//! where a gap moves.
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
    /// Over the nodes of the mesh; nothing where contact displacements are counted from it.
    field: Vec<f64>,
    /// `q` over `u_C`; nothing of a support.
    contact: Vec<f64>,
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
        let of = body.products_of_field(&field);
        let contact = vec![];
        self.motions.push(Motion { course: course.clone(), field, contact, stiffness, mass });
        for (among, product) in self.among.iter_mut().zip(of) {
            let dot = |m: &Motion| m.field.iter().zip(&product).map(|(w, p)| w * p).sum();
            among.extend(self.motions.iter().map(dot).collect::<Vec<f64>>());
        }
    }

    /// Count contact displacements, which have no mass, from `q s(t)`; `force` is `K q` over `u`.
    pub fn push_contact(&mut self, q: Vec<f64>, force: Vec<f64>, course: &Course) {
        let mass = vec![0.0; force.len()];
        let n_o = force.len() - q.len();
        // what the others bring forth at q: supports along their fields, contact displacements along theirs
        let along = |m: &Motion| match m.contact.is_empty() {
            true => m.stiffness[n_o..].iter().zip(&q).map(|(k, q)| k * q).sum::<f64>(),
            false => m.contact.iter().zip(&force[n_o..]).map(|(q, k)| q * k).sum(),
        };
        let own: f64 = q.iter().zip(&force[n_o..]).map(|(q, k)| q * k).sum();
        let row: Vec<f64> = self.motions.iter().map(along).chain([own]).collect();
        self.among[1].extend(vec![0.0; row.len()]);
        self.among[0].extend(row);
        let (course, field) = (course.clone(), vec![]);
        self.motions.push(Motion { course, field, contact: q, stiffness: force, mass });
    }

    /// Whether supports move.
    pub fn moves_supports(&self) -> bool {
        self.motions.iter().any(|m| m.contact.is_empty())
    }

    /// Whether contact displacements are counted from places that move.
    pub fn moves_contact(&self) -> bool {
        self.motions.iter().any(|m| !m.contact.is_empty())
    }

    /// Nodal fields of supports that move, with what they do in time.
    pub fn of_supports(&self) -> impl Iterator<Item = (&Course, &[f64])> {
        let moving = self.motions.iter().filter(|m| m.contact.is_empty());
        moving.map(|m| (&m.course, &m.field[..]))
    }

    /// Where contact displacements are counted from, with what it does in time.
    pub fn of_contact(&self) -> impl Iterator<Item = (&Course, &[f64])> {
        let moving = self.motions.iter().filter(|m| !m.contact.is_empty());
        moving.map(|m| (&m.course, &m.contact[..]))
    }

    /// Add to the end of a vector over `u`, its contact displacements, where they are counted from at a time, or its derivative of this order.
    pub fn add_contact(&self, t: f64, order: u32, u: &mut [f64]) {
        for (course, q) in self.of_contact() {
            let (s, n_o) = (course.at(t, order), u.len() - q.len());
            u[n_o..].iter_mut().zip(q).for_each(|(x, q)| *x += s * q);
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

    /// Elastic energy of the places from which contact displacements are counted, at their amplitudes: what energies are sums of.
    pub(crate) fn size_of_contact(&self) -> f64 {
        let own = |(i, m): (usize, &Motion)| match m.contact.is_empty() {
            true => 0.0,
            false => 0.5 * self.among[0][i * (i + 1) / 2 + i],
        };
        self.motions.iter().enumerate().map(own).sum()
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
