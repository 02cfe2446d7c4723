//! Work vectors of one thread.

use crate::fem::SolveScratch;

/// Work vectors of one thread.
#[derive(Debug)]
pub struct Scratch {
    /// Full displacement of the last evaluation.
    pub u: Vec<f64>,
    /// Full velocity (where it was needed).
    pub v: Vec<f64>,
    pub(super) b: Vec<f64>,
    pub(super) x: Vec<f64>,
    pub(super) pair: [Vec<f64>; 2],
    pub(super) mu: nalgebra::DVector<f64>,
    pub(super) solve: SolveScratch,
}

impl Scratch {
    /// For `n` displacements, `n_c` of them at the contact, and what solves with the mass.
    pub(super) fn new(n: usize, n_c: usize, solve: SolveScratch) -> Scratch {
        let zero = || vec![0.0; n];
        let mu = nalgebra::DVector::zeros(n_c);
        Scratch { u: zero(), v: zero(), b: zero(), x: zero(), pair: [vec![], vec![]], mu, solve }
    }
}
