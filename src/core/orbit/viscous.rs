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
use super::pin::{FEEDBACK, FIRST, Pin};
use super::search::{Effort, Verdict, find};
use super::shooting::Closure;

/// Amplitudes of the pinned mode over grazing to start from at any frequency.
const AMPLITUDES: [f64; 6] = [1.1, 1.4, 1.7, 2.1, 2.6, 3.2];

/// Amplitudes over grazing, and `α/ω_k`, just above the frequency of the pinned mode.
const NEAR_GRAZING: [(f64, f64); 6] =
    [(1.1, 0.032), (1.3, 0.032), (1.5, 0.032), (1.1, 0.063), (1.3, 0.063), (1.5, 0.063)];

impl Pin {
    /// Unknowns `(z, α)` to start from at the frequency `omega`: the pinned mode, at rest on the side away from the obstacle.
    pub fn guesses(&self, body: &Propagator, omega: f64) -> Vec<Vec<f64>> {
        let ratio = omega / self.omega;
        let near = ratio < 0.5 * (1.0 + FIRST) + 0.01;
        let expected = 1.3 * self.growth(omega);
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
/// `Γ_k = φ_kᵀ G 1`, of several contacts `Σ |Γ_k|`: pressures on opposite sides would cancel; none if the body can move rigidly. Around an equilibrium the first one.
pub fn pinned_mode(body: &Propagator) -> Option<usize> {
    let system = &body.system;
    let open = system.open_phase();
    let n = body.n();
    let share = |k: usize| {
        let shape: Vec<f64> = (0..n).map(|i| body.home.shapes[(i, k)]).collect();
        let mut full = vec![0.0; system.n()];
        open.expand(&shape, &mut full);
        let groups = system.constraints.iter().map(|c| c.group + 1).max().unwrap_or(0);
        let mut moved = vec![0.0; groups];
        full[n..].iter().zip(&system.constraints).for_each(|(u, c)| moved[c.group] += c.area * u);
        let moved: f64 = moved.iter().map(|m: &f64| m.abs()).sum();
        (moved / body.home.modes[k].omega).powi(2)
    };
    if body.home.modes.iter().any(|m| m.omega == 0.0) {
        return None;
    }
    if system.rest().is_some() {
        return Some(0);
    }
    let shares: Vec<f64> = (0..n).map(share).collect();
    (0..n).max_by(|&a, &b| shares[a].total_cmp(&shares[b]).then(b.cmp(&a)))
}

/// Sharpness of the fronts that every start leads to, and by how much one step may raise it.
const SMOOTH: (f64, f64) = (7.0, 1.43);

/// The orbit at a frequency along a path of falling viscosities: fronts of sharpness 7 first, where the basin of the linear mode is widest. None
/// if there is no orbit at some viscosity of the path.
pub fn by_viscosity(
    body: &mut Propagator,
    pin: Pin,
    omega: f64,
    effort: &Effort,
) -> Result<Option<Verdict>, OrbitError> {
    let last = pin.sharpness();
    let mut sharpness = last.min(SMOOTH.0);
    let at = |sharpness: f64| match sharpness == last {
        true => pin,
        false => Pin { beta: pin.beta_of(sharpness), ..pin },
    };
    let mut found = None;
    for guess in pin.guesses(body, omega) {
        let verdict = find(body, Closure::Viscous(at(sharpness)), &guess, omega, effort)?;
        if verdict.orbit().is_some() {
            found = Some(verdict);
            break;
        }
    }
    while let Some(orbit) = found.as_ref().and_then(Verdict::orbit) {
        let z = orbit.z.clone();
        if sharpness >= last {
            return Ok(found);
        }
        sharpness = last.min(SMOOTH.1 * sharpness);
        found = Some(find(body, Closure::Viscous(at(sharpness)), &z, omega, effort)?);
    }
    Ok(None)
}
