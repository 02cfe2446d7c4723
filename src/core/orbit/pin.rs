//! What a viscous nonlinear mode is pinned to, and the scales of its family (theory §10).
//!
//! Where starts and weights are numbers, these were fitted on the half plate of the paper: guesses, which Newton's method corrects.

use super::OrbitError;
use super::chain::Propagator;
use crate::contact::Rayleigh;

/// What a viscous orbit is pinned to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pin {
    /// Viscosity `β` of `C = βK`, a time.
    pub beta: f64,
    /// The mode of the open body whose velocity vanishes at `t = 0`, from 0.
    pub mode: usize,
    /// Its circular frequency.
    pub omega: f64,
}

/// Feedback beyond so many times the frequency of the pinned mode is none.
const MOST_FEEDBACK: f64 = 3.0;

/// `α/ω_k` to start from at any frequency.
pub(super) const FEEDBACK: f64 = 0.063;

/// `ω/ω_k` where orbits just beyond grazing are found on every mesh.
pub const FIRST: f64 = 1.014;

impl Pin {
    /// The mode `mode` (from 0), with the viscosity `beta`.
    pub fn new(body: &Propagator, mode: usize, beta: f64) -> Pin {
        Pin { beta, mode, omega: body.home.modes[mode].omega }
    }

    /// `L/c`: the time of a wave over the body, a quarter period of the pinned mode.
    pub fn travel_time(&self) -> f64 {
        0.25 * std::f64::consts::TAU / self.omega
    }

    /// `√(L/(cβ))`, the sharpness of a wave front over the body: what it is has to be resolved by the mesh.
    pub fn sharpness(&self) -> f64 {
        (self.travel_time() / self.beta).sqrt()
    }

    /// `β` of a sharpness.
    pub fn beta_of(&self, sharpness: f64) -> f64 {
        self.travel_time() / (sharpness * sharpness)
    }

    /// Above `3.5 √(c/(Lβ))`, in frequency, nothing is left of a motion (to 1e-4 of its energy).
    pub fn cutoff(&self) -> f64 {
        3.5 / (self.travel_time() * self.beta).sqrt()
    }

    /// `C = βK − αM`.
    pub fn damping(&self, alpha: f64) -> Rayleigh {
        Rayleigh { alpha: -alpha, beta: self.beta }
    }

    /// Refuse a feedback that could not be one.
    pub(super) fn check(&self, alpha: f64) -> Result<(), OrbitError> {
        let most = MOST_FEEDBACK * self.omega;
        match self.is_feedback(alpha) {
            true => Ok(()),
            false => Err(OrbitError::Feedback { alpha, most }),
        }
    }

    /// Whether a feedback could be one.
    pub(crate) fn is_feedback(&self, alpha: f64) -> bool {
        alpha.abs() <= MOST_FEEDBACK * self.omega
    }

    /// `α` to start from where none is known.
    pub fn feedback(&self) -> f64 {
        FEEDBACK * self.omega
    }

    /// The amplitude of the family at a frequency over that near grazing, roughly.
    pub fn growth(&self, omega: f64) -> f64 {
        1.0 + 3.2 * (omega / self.omega - FIRST).max(0.0)
    }

    /// Weights of `α` and `ω` in the arclength of a family.
    pub fn weights(&self) -> [f64; 2] {
        [FEEDBACK, 0.032].map(|share| (share * self.omega).powi(-2))
    }

    /// Unknowns `(z, α)` of a state whose feedback is not known.
    pub fn unknowns(&self, mut z: Vec<f64>) -> Vec<f64> {
        z.push(self.feedback());
        z
    }
}
