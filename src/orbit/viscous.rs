//! The viscous nonlinear mode: periodic motions of the Kelvin–Voigt body `C = βK` that `−αM u̇` keeps going (extended periodic motions; Krack 2015).
//!
//! ```text
//! M ü + (βK − αM) u̇ + K u = f + contact,      x(T) = x(0),      φ_kᵀ M u̇(0) = 0
//! ```
//!
//! with `α` unknown beside the state. Motions of the undamped discrete body have no limit under refinement of the mesh; these have one, with a
//! pressure without ripple, for a viscosity that the mesh resolves. The mode `k` of the open body that they are pinned to is the one that
//! a uniform pressure on the contact moves most.

use super::OrbitError;
use super::branch::mode_guess;
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

/// Amplitudes of the pinned mode over grazing to start from at any frequency.
const AMPLITUDES: [f64; 6] = [1.1, 1.4, 1.7, 2.1, 2.6, 3.2];

/// Amplitudes over grazing, and `α/ω_k`, just above the frequency of the pinned mode.
const NEAR_GRAZING: [(f64, f64); 6] =
    [(1.1, 0.032), (1.3, 0.032), (1.5, 0.032), (1.1, 0.063), (1.3, 0.063), (1.5, 0.063)];

/// `α/ω_k` to start from at any frequency.
const FEEDBACK: f64 = 0.063;

/// `ω/ω_k` where orbits just beyond grazing are found on every mesh.
pub const FIRST: f64 = 1.014;

impl Pin {
    /// The mode `mode` (from 0), with the viscosity `beta`.
    pub fn new(body: &Propagator, mode: usize, beta: f64) -> Pin {
        Pin { beta, mode, omega: body.open.modes[mode].omega }
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

    /// `C = βK − αM`.
    pub fn damping(&self, alpha: f64) -> Rayleigh {
        Rayleigh { alpha: -alpha, beta: self.beta }
    }

    /// Refuse a feedback that could not be one.
    pub(super) fn check(&self, alpha: f64) -> Result<(), OrbitError> {
        let most = MOST_FEEDBACK * self.omega;
        match alpha.abs() <= most {
            true => Ok(()),
            false => Err(OrbitError::Feedback { alpha, most }),
        }
    }

    /// Unknowns `(z, α)` to start from at the frequency `omega`: the pinned mode, at rest on the side away from the obstacle.
    pub fn guesses(&self, body: &Propagator, omega: f64) -> Vec<Vec<f64>> {
        let ratio = omega / self.omega;
        let near = ratio < 0.5 * (1.0 + FIRST) + 0.01;
        let expected = 1.3 * (1.0 + 3.2 * (ratio - FIRST).max(0.0));
        let anywhere = [expected].into_iter().chain(AMPLITUDES).map(|a| (a, FEEDBACK));
        let close = NEAR_GRAZING.into_iter().filter(|_| near);
        let guess = |(a, alpha): (f64, f64)| {
            let mut z = mode_guess(body, self.mode + 1, -a)?;
            z.resize(2 * body.n(), 0.0);
            z.push(alpha * self.omega);
            Some(z)
        };
        close.chain(anywhere).filter_map(guess).collect()
    }
}

/// The mode of the open body (from 0) that has the largest share `Γ_k²/ω_k²` of the static compliance of the contact under uniform pressure,
/// `Γ_k = φ_kᵀ G 1`; none if the body can move rigidly.
pub fn pinned_mode(body: &Propagator) -> Option<usize> {
    let system = &body.system;
    let open = system.open_phase();
    let n = body.n();
    let share = |k: usize| {
        let shape: Vec<f64> = (0..n).map(|i| body.open.shapes[(i, k)]).collect();
        let mut full = vec![0.0; system.n()];
        open.expand(&shape, &mut full);
        let moved: f64 = full[n..].iter().zip(&system.constraints).map(|(u, c)| c.area * u).sum();
        (moved / body.open.modes[k].omega).powi(2)
    };
    if body.open.modes.iter().any(|m| m.omega == 0.0) {
        return None;
    }
    let shares: Vec<f64> = (0..n).map(share).collect();
    (0..n).max_by(|&a, &b| shares[a].total_cmp(&shares[b]).then(b.cmp(&a)))
}
