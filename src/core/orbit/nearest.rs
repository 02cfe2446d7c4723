//! The conservative orbit nearest to a guess that need not be near: Levenberg and Marquardt on the half-period map.
//!
//! `min ‖u̇_O(T/2)‖²` over `u_O(0)` at rest. Where no orbit is near it ends at a least defect, which says nothing about an orbit.

use std::f64::consts::TAU;

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;

use super::OrbitError;
use super::chain::Propagator;
use super::search::{Verdict, judge};
use super::shooting::{Closure, image, jacobian};

/// Most steps.
const ITERATIONS: usize = 40;

/// The residual, over the size of the state, that counts as an orbit.
const TOLERANCE: f64 = 1e-11;

/// Damping over the size of the Jacobian: first, least, largest.
const DAMPING: (f64, f64, f64) = (1e-3, 1e-12, 1e3);

/// The orbit of frequency `omega` nearest to the frame vector `z` (displacements only), with its credentials; or the least defect.
pub fn nearest(body: &mut Propagator, z: &[f64], omega: f64) -> Result<Verdict, OrbitError> {
    let (closure, period) = (Closure::Reversible, TAU / omega);
    let mut z = z.to_vec();
    let mut at = match image(body, closure, &z, period) {
        Ok(at) => at,
        Err(e @ (OrbitError::Incomplete(_) | OrbitError::Held { .. })) => {
            let (residual, singular_value) = (f64::INFINITY, f64::NAN);
            return Ok(Verdict::NotFound { residual, singular_value, reason: Some(e.to_string()) });
        }
        Err(e) => return Err(e),
    };
    let mut damping = DAMPING.0;
    let mut iterations = 0;
    while at.size > 1e-14 && iterations < ITERATIONS && damping < DAMPING.2 {
        let j = jacobian(body, closure, &at, false)?;
        let n = j.nrows();
        let scale = j.norm_l2() / (n as f64).sqrt();
        let mut improved = false;
        while damping < DAMPING.2 {
            let lambda = damping * scale;
            let a = Mat::from_fn(2 * n, n, |i, k| match i.checked_sub(n) {
                None => j[(i, k)],
                Some(i) => lambda * f64::from(u8::from(i == k)),
            });
            let b = Mat::from_fn(2 * n, 1, |i, _| if i < n { -at.r[i] } else { 0.0 });
            let step = a.qr().solve_lstsq(b);
            let trial: Vec<f64> = (0..n).map(|i| z[i] + step[(i, 0)]).collect();
            match image(body, closure, &trial, period) {
                Ok(there) if there.size < at.size => {
                    // at the tolerance, go on only while it is worth it
                    let ended = there.size <= TOLERANCE && there.size > 0.1 * at.size;
                    improved = !ended && there.size < (1.0 - 1e-4) * at.size;
                    (z, at) = (trial, there);
                    damping = (0.2 * damping).max(DAMPING.1);
                    break;
                }
                _ => damping *= 5.0,
            }
        }
        iterations += 1;
        if !improved {
            break;
        }
    }
    if at.size <= TOLERANCE {
        return judge(body, closure, &z, omega, iterations, true);
    }
    Ok(Verdict::NotFound { residual: at.size, singular_value: f64::NAN, reason: None })
}
