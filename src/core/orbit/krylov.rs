//! Newton–Krylov shooting for large bodies: tangent products instead of matrices.
//!
//! A perturbation of `u_O(0)` is carried over the half period by the Chebyshev form of the homogeneous flow in every phase and by
//! saltation at every switch; `∂R/∂z · d` costs about as much as the motion itself, and no phase needs modes. The linear systems are solved by
//! GMRES, preconditioned by the half-period map of the open body, which is diagonal in the frame: `∂(q̇ + …) = −sin(ω_i T/2)`.

use crate::contact::{Phase, State, leading};
use crate::flow::Tangent;

use super::OrbitError;
use super::chain::Propagator;
use super::period_map::{Kept, Passage, integrate_with};
use super::saltation;
use crate::continuation::norm;

/// A switch with the state at it.
struct Jump {
    phase: Phase,
    t: f64,
    /// Monitor of the switching node in that phase.
    monitor: usize,
    rate: f64,
    /// `ü⁻ − ü⁺`
    jump: Vec<f64>,
}

/// The tangent of the half-period map along one motion.
pub struct HalfPeriod<'a> {
    body: &'a Propagator,
    jumps: Vec<Jump>,
    last: Phase,
    end: f64,
}

/// Integrate over half a period, and prepare the tangent.
pub fn half_period<'a>(
    body: &'a Propagator,
    z: &[f64],
    end: f64,
) -> Result<(Passage, HalfPeriod<'a>), OrbitError> {
    let system = &body.system;
    let mut kept = Kept::new(body);
    let passage = integrate_with(body, &body.state(z), end, 0, &mut kept)?;
    let mut scratch = system.scratch();
    let n = body.n();
    let mut jumps = vec![];
    let mut acceleration = |phase: &Phase, t: f64, x: &State| {
        let mut a = vec![0.0; n];
        phase.acceleration(t, &x.u, &x.v, &mut scratch, &mut a);
        a
    };
    for s in &passage.report.switches {
        let Some(x) = kept.at(s.t) else { continue };
        let (before, after) = (system.phase(&s.before), system.phase(&s.after));
        let (a, b) = (acceleration(&before, s.t, x), acceleration(&after, s.t, x));
        let jump = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        let monitor = leading(&before.monitors, s.point, s.to()).unwrap_or(0);
        let rate = before.monitor_rates(s.t, &x.v, &[])[monitor];
        jumps.push(Jump { phase: before, t: s.t, monitor, rate, jump });
    }
    let last = system.phase(&passage.report.active);
    Ok((passage, HalfPeriod { body, jumps, last, end }))
}

impl HalfPeriod<'_> {
    /// `∂q̇(T/2)/∂z · d`, frame vectors of length `n`.
    pub fn product(&self, d: &[f64], tangent: &mut Tangent) -> Vec<f64> {
        let body = self.body;
        let State { u: mut du, v: mut dv } = body.state(d);
        let mut t = 0.0;
        for j in &self.jumps {
            if j.t > t {
                tangent.carry(&j.phase, j.t - t, (&mut du, &mut dv));
                t = j.t;
            }
            let slope = j.phase.monitor_gradient_at(&du, &[])[j.monitor];
            saltation::pass(&j.jump, j.rate, slope, &mut dv);
        }
        if self.end > t {
            tangent.carry(&self.last, self.end - t, (&mut du, &mut dv));
        }
        body.frame(&State { u: du, v: dv })[d.len()..].to_vec()
    }

    /// The Newton step `−J⁻¹ r` to a relative accuracy, with the number of products; GMRES without restart.
    pub fn step(&self, r: &[f64], accuracy: f64, most: usize) -> (Vec<f64>, usize) {
        let n = r.len();
        let mut tangent = Tangent::new(&self.body.system);
        // −sin(ω T/2), kept away from zero at resonances
        let modes = self.body.home.modes.iter();
        let diagonal: Vec<f64> = modes
            .map(|m| {
                let s = -(m.omega * self.end).sin();
                if s.abs() < 0.1 { 0.1f64.copysign(s) } else { s }
            })
            .collect();
        let size = norm(r);
        let mut basis: Vec<Vec<f64>> = vec![r.iter().map(|x| -x / size).collect()];
        let mut triangle: Vec<Vec<f64>> = vec![];
        let mut rotations: Vec<(f64, f64)> = vec![];
        let mut g = vec![size];
        // what is asked to stop takes the step that it has: the next integration says so
        while basis.len() <= most.min(n) && !(basis.len() > 1 && self.body.is_stopped()) {
            let k = basis.len() - 1;
            let x: Vec<f64> = basis[k].iter().zip(&diagonal).map(|(b, d)| b / d).collect();
            let mut w = self.product(&x, &mut tangent);
            let mut column = vec![0.0; k + 2];
            for _ in 0..2 {
                for (i, b) in basis.iter().enumerate() {
                    let c: f64 = b.iter().zip(&w).map(|(b, w)| b * w).sum();
                    column[i] += c;
                    w.iter_mut().zip(b).for_each(|(w, b)| *w -= c * b);
                }
            }
            column[k + 1] = norm(&w);
            for (i, &(c, s)) in rotations.iter().enumerate() {
                (column[i], column[i + 1]) =
                    (c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]);
            }
            let length = column[k].hypot(column[k + 1]);
            let (c, s) = (column[k] / length, column[k + 1] / length);
            column[k] = length;
            let last = g[k];
            g[k] = c * last;
            g.push(-s * last);
            rotations.push((c, s));
            let next = column[k + 1];
            column.truncate(k + 1);
            triangle.push(column);
            if g[k + 1].abs() <= accuracy * size || next <= 1e-14 * size {
                break;
            }
            let length = norm(&w);
            basis.push(w.iter().map(|w| w / length).collect());
        }
        let m = triangle.len();
        let mut y = vec![0.0; m];
        for i in (0..m).rev() {
            let sum: f64 = (i + 1..m).map(|j| triangle[j][i] * y[j]).sum();
            y[i] = (g[i] - sum) / triangle[i][i];
        }
        let mut step = vec![0.0; n];
        for (y, b) in y.iter().zip(&basis) {
            step.iter_mut().zip(b).for_each(|(s, b)| *s += y * b);
        }
        step.iter_mut().zip(&diagonal).for_each(|(s, d)| *s /= d);
        (step, m)
    }
}
