//! A body prepared for harmonic balance by all modes of its open phase.

use std::ops::{Deref, DerefMut};
use std::rc::Rc;

use faer::Mat;

use super::HbmError;
use super::interface::{Form, Interface};
use crate::contact::{ActiveSet, Rayleigh, State, System};
use crate::flow::spectrum::{Spectra, Spectrum};

/// A body whose series are those of the modes `q` of its open phase.
pub struct Reduction {
    interface: Interface,
    /// Modes of the open phase.
    pub open: Rc<Spectrum>,
    spectra: Spectra,
    /// `Q`, `n × r`.
    pub q: Mat<f64>,
    /// `Q̂ = [Q]` (force form) or `[Q, Ω²Q]` (acceleration form), `n × r_in`.
    pub q_in: Mat<f64>,
}

impl Deref for Reduction {
    type Target = Interface;

    fn deref(&self) -> &Interface {
        &self.interface
    }
}

impl DerefMut for Reduction {
    fn deref_mut(&mut self) -> &mut Interface {
        &mut self.interface
    }
}

/// Directions shorter than this, over the longest, are rounding errors.
const RANK: f64 = 1e-10;

/// An orthonormal basis of the columns.
fn orthonormal(columns: &Mat<f64>) -> Mat<f64> {
    let n = columns.nrows();
    let mut basis: Vec<Vec<f64>> = vec![];
    for c in 0..columns.ncols() {
        let mut x = columns.col_as_slice(c).to_vec();
        let first = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        for _ in 0..2 {
            for b in &basis {
                let d: f64 = b.iter().zip(&x).map(|(b, x)| b * x).sum();
                x.iter_mut().zip(b).for_each(|(x, b)| *x -= d * b);
            }
        }
        let rest = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        if rest > RANK * first {
            x.iter_mut().for_each(|x| *x /= rest);
            basis.push(x);
        }
    }
    Mat::from_fn(n, basis.len(), |i, j| basis[j][i])
}

impl Reduction {
    /// Square of the lowest frequency that is not a rigid motion's: the unit of modal stiffness.
    pub fn stiffness_unit(&self) -> f64 {
        let elastic = self.open.modes.iter().map(|m| m.omega).find(|w| *w > 0.0);
        elastic.unwrap_or(self.system.units.frequency).powi(2)
    }

    /// Whether the open body can move rigidly.
    pub fn is_free(&self) -> bool {
        self.open.modes.iter().any(|m| m.omega == 0.0)
    }

    /// Solve for the modes, and find the directions.
    pub fn new(system: System, form: Form) -> Result<Reduction, HbmError> {
        super::check_frequencies(&system)?;
        let spectra = Spectra::default();
        let open = spectra.of_set(&system, &ActiveSet::open(system.n_contact()))?;
        let n = system.n_o();
        let directions = system.directions();
        let mut columns = Mat::<f64>::zeros(n, directions.len());
        for (c, column) in directions.iter().enumerate() {
            column.iter().for_each(|&(i, v)| columns[(i, c)] = v);
        }
        let q = orthonormal(&(open.shapes.transpose() * &columns));
        let r = q.ncols();
        let q_in = match form {
            Form::Force => q.clone(),
            Form::Acceleration => Mat::from_fn(n, 2 * r, |i, j| {
                let w = open.modes[i].omega;
                if j < r { q[(i, j)] } else { w * w * q[(i, j - r)] }
            }),
        };
        let interface = Interface::new(system, form, &open.shapes * &q);
        Ok(Reduction { interface, open, spectra, q, q_in })
    }

    /// Number of modes.
    pub fn n(&self) -> usize {
        self.open.modes.len()
    }

    /// Change the damping. Phases that are known stand: `β` must be what it was, and in the acceleration form `α` is not in them.
    pub(super) fn set_damping(&mut self, damping: Rayleigh) -> Result<(), HbmError> {
        debug_assert!(self.form == Form::Acceleration);
        debug_assert!(self.system.damping.is_some_and(|d| d.beta == damping.beta));
        self.system.damping = Some(damping);
        let open = ActiveSet::open(self.system.n_contact());
        self.open = self.spectra.of_set(&self.system, &open)?;
        Ok(())
    }

    /// `x = (u_O, u̇_O)` of modal displacements and their rates by `θ`.
    pub fn state(&self, q: &[f64], dq: &[f64], omega: f64) -> State {
        let n = self.n();
        let both: Vec<f64> = q.iter().copied().chain(dq.iter().map(|d| omega * d)).collect();
        let mut x = vec![0.0; 2 * n];
        self.open.from_modes(&both, &mut x);
        State { v: x.split_off(n), u: x }
    }

    /// Modal coordinates of displacements `u_O`.
    pub fn modal(&self, u: &[f64]) -> Vec<f64> {
        let n = self.n();
        let mut both = vec![0.0; 2 * n];
        both[..n].copy_from_slice(u);
        let mut q = vec![0.0; 2 * n];
        self.open.to_modes(&both, &mut q);
        q.truncate(n);
        q
    }
}
