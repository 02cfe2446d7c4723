//! Harmonic balance of the viscous nonlinear mode: the acceleration form with `α` unknown, pinned to a mode.
//!
//! In the acceleration form the feedback `−αM_α` is `−α` times the identity in *every* phase, so that `α` never enters the interface terms: it is one more
//! column, and the phase condition one more row,
//!
//! ```text
//! R(q, α) = D(α) q + Q N(Q̂ᵀq) − f = 0,     p(q) = Σ_k k r·b_k = 0   (φ_jᵀM u̇(0) = 0),     ∂R/∂α = −ω dq/dθ
//! ```
//!
//! At fixed `α` the Jacobian is singular at a solution (`J dq/dθ = 0`), but `D` is not, because it is damped: Newton's system is condensed on the interface and
//! `α`,
//!
//! ```text
//! [ I + N′Ĝ     N′ Q̂ᵀD⁻¹R_α ] [δn]   [ −N′ Q̂ᵀD⁻¹R    ]
//! [ pᵀD⁻¹Q      pᵀD⁻¹R_α    ] [δα] = [ p(q) − pᵀD⁻¹R ],     δq = −D⁻¹(R + Q δn + R_α δα)
//! ```

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::balance::{Balance, Quadrature};
use super::modes::{Linear, project_in, residual};
use super::newton::{Settings, conclude};
use super::rubbing::Along;
use super::series::{Basis, Series};
use super::solution::Ended;
use super::{Balanced, Form, HbmError, Reduction, Solution};
use crate::contact::{State, System};
use crate::continuation::{dot, norm};
use crate::orbit::Pin;
use crate::records::GapReason;

/// A body prepared for the harmonic balance of its viscous nonlinear mode.
pub struct Viscous {
    reduction: Reduction,
    /// What it is pinned to.
    pub pin: Pin,
    /// `φ_jᵀM` of the mode that it is pinned to, in modal coordinates of the open body.
    row: Vec<f64>,
    /// Where it is told around, and the pinned mode as far as the first switch, in the same coordinates; none where that mode does not move the contact.
    start: Option<[Vec<f64>; 2]>,
}

/// A converged series with its feedback.
#[derive(Debug, Clone)]
pub struct Fed {
    /// The series.
    pub solution: Solution,
    /// `α`
    pub alpha: f64,
}

/// Amplitudes of the pinned mode over the one that is expected at a frequency.
const AMPLITUDES: [f64; 4] = [1.3, 1.0, 1.6, 1.15];

/// Amplitudes around an equilibrium, over the first switch: joints that open soften, and how much is not known.
const AROUND: [f64; 7] = [1.3, 1.0, 1.6, 1.15, 2.1, 2.8, 3.6];

/// Numbers of harmonics on the way up.
const RUNGS: [usize; 4] = [3, 7, 15, 31];

/// Size of the terms of the residual that move.
fn moving(reduction: &Reduction, q: &Series, n: &Series) -> f64 {
    let of = |x: &Series| norm(&x.a[x.n..]);
    of(n).max(reduction.stiffness_unit() * of(q)).max(f64::MIN_POSITIVE)
}

/// The equations along a series.
struct Evaluated {
    linear: Linear,
    balance: Balance,
    r: Series,
    size: f64,
}

impl Viscous {
    /// The body of a system without damping.
    pub fn new(mut system: System, pin: Pin) -> Result<Viscous, HbmError> {
        system.damping = Some(pin.damping(0.0));
        let reduction = Reduction::new(system, Form::Acceleration)?;
        let n = reduction.n();
        let system = &reduction.system;
        let Some(rest) = system.rest() else {
            let unit = |size: f64| (0..n).map(|i| if i == pin.mode { size } else { 0.0 }).collect();
            let grazing = super::response::grazing_of_mode(&reduction, pin.mode);
            let start = grazing.map(|grazing| [vec![0.0; n], unit(grazing)]);
            return Ok(Viscous { pin, row: unit(1.0), start, reduction });
        };
        let home = reduction.spectra.of_set(system, &rest.set)?;
        let shape = home.shapes.col_as_slice(pin.mode);
        let far = rest.first_switch(system, shape);
        let start = far.map(|far| {
            let first: Vec<f64> = shape.iter().map(|x| far * x).collect();
            [reduction.modal(&rest.u), reduction.modal(&first)]
        });
        let of = |i: usize| {
            let open = reduction.open.shapes.col_as_slice(i);
            (0..n).map(|j| home.inverse[(pin.mode, j)] * open[j]).sum()
        };
        let row = (0..n).map(of).collect();
        Ok(Viscous { pin, row, start, reduction })
    }

    /// The body with the feedback that was set last.
    pub fn reduction(&self) -> &Reduction {
        &self.reduction
    }

    /// The state at `t = 0` of a series, from which its orbit is shot.
    pub fn state(&self, of: &Fed) -> Result<State, HbmError> {
        let u = self.reduction.displacements(&of.solution)?;
        Ok(of.solution.state(&u, 0.0, 0))
    }

    /// Give the body a feedback.
    pub(crate) fn set_feedback(&mut self, alpha: f64) -> Result<(), HbmError> {
        self.reduction.set_damping(self.pin.damping(alpha))
    }

    /// A series of `n_h` harmonics to start from: the pinned mode at the amplitude that is expected at `omega`, times `factor`.
    pub fn start(&self, n_h: usize, omega: f64, factor: f64) -> Option<Series> {
        let [rest, first] = self.start.as_ref()?;
        let amplitude = -factor * self.pin.growth(omega);
        let mut q = Series::zeros(Basis::Full, n_h, self.reduction.n());
        q.of_mut(0).copy_from_slice(rest);
        q.of_mut(1).iter_mut().zip(first).for_each(|(q, x)| *q = amplitude * x);
        Some(q)
    }

    /// The solution with `n_h` harmonics: from the linear mode at once, or up a ladder of harmonics.
    pub fn from_mode(
        &mut self,
        n_h: usize,
        omega: f64,
        settings: &Settings,
    ) -> Result<Result<Fed, GapReason>, HbmError> {
        let alpha = self.pin.feedback();
        let rungs: Vec<usize> = RUNGS.into_iter().filter(|k| *k < n_h).chain([n_h]).collect();
        let mut last = Err(GapReason::NoStart);
        let amplitudes: &[f64] = match self.reduction.system.rest() {
            Some(_) => &AROUND,
            None => &AMPLITUDES,
        };
        for first in [n_h, rungs[0]] {
            for &factor in amplitudes {
                let Some(start) = self.start(first, omega, factor) else { return Ok(last) };
                last = self.solve(&start, alpha, omega, settings)?;
                for rung in rungs.iter().filter(|k| **k > first) {
                    let Ok(below) = &last else { break };
                    let (q, alpha) = (below.solution.q.with_harmonics(*rung), below.alpha);
                    last = self.solve(&q, alpha, omega, settings)?;
                }
                if last.is_ok() {
                    return Ok(last);
                }
            }
        }
        Ok(last)
    }

    /// The solution at a frequency from a guess.
    pub fn solve(
        &mut self,
        guess: &Series,
        alpha: f64,
        omega: f64,
        settings: &Settings,
    ) -> Result<Result<Fed, GapReason>, HbmError> {
        let (mut q, mut alpha) = (guess.clone(), alpha);
        let mut at = self.evaluate(&q, alpha, omega, settings.quadrature)?;
        let mut iterations = 0;
        while iterations < settings.iterations && at.size > 1e-15 && at.size.is_finite() {
            let (step, by_alpha) = self.step(&q, omega, &at);
            if !by_alpha.is_finite() || step.iter().any(|s| !s.is_finite()) {
                break;
            }
            iterations += 1;
            let mut best = None;
            let mut lambda = 1.0;
            while lambda > 1e-3 {
                let mut trial = q.clone();
                trial.a.iter_mut().zip(&step).for_each(|(q, s)| *q += lambda * s);
                let fed = alpha + lambda * by_alpha;
                if self.pin.is_feedback(fed)
                    && let Ok(there) = self.evaluate(&trial, fed, omega, settings.quadrature)
                    && there.size < (1.0 - 0.1 * lambda) * at.size
                {
                    best = Some((trial, fed, there));
                    break;
                }
                lambda *= 0.5;
            }
            let Some((next, fed, there)) = best else { break };
            let ended = there.size <= settings.tolerance && there.size > 0.1 * at.size;
            (q, alpha, at) = (next, fed, there);
            if ended {
                break;
            }
        }
        let Evaluated { balance, size, .. } = at;
        self.set_feedback(alpha)?;
        let y = project_in(&self.reduction, &q);
        let ended = Ended { omega, q, y, n: balance.n.clone(), residual: size, iterations };
        let found = conclude(&self.reduction, ended, balance, settings)?;
        Ok(found.map(|solution| Fed { solution, alpha }))
    }

    fn evaluate(
        &mut self,
        q: &Series,
        alpha: f64,
        omega: f64,
        quadrature: Quadrature,
    ) -> Result<Evaluated, HbmError> {
        self.set_feedback(alpha)?;
        let linear = Linear::new(&self.reduction, q.n_h, omega);
        let y = project_in(&self.reduction, q);
        let at = Along { interface: &self.reduction, y: &y, n: None, omega };
        let balance = Balance::new(&at, quadrature)?;
        let (r, size) = residual(&self.reduction, &linear, q, &balance.n);
        let size = match self.reduction.system.rest() {
            // a body at rest is no solution
            Some(_) => norm(&r.a) / moving(&self.reduction, q, &balance.n),
            None => size,
        };
        Ok(Evaluated { linear, balance, r, size })
    }

    /// `∂R/∂α = −ω dq/dθ`
    pub(super) fn by_alpha(q: &Series, omega: f64) -> Series {
        let mut x = Series::zeros(q.basis, q.n_h, q.n);
        for k in 1..=q.n_h {
            let rate = k as f64 * omega;
            let (cos, sin) = (2 * k - 1, 2 * k);
            x.of_mut(cos).iter_mut().zip(q.of(sin)).for_each(|(x, b)| *x = -rate * b);
            x.of_mut(sin).iter_mut().zip(q.of(cos)).for_each(|(x, a)| *x = rate * a);
        }
        x
    }

    /// `p(q) = Σ_k k r·b_k`
    pub(super) fn phase(&self, q: &Series) -> f64 {
        (1..=q.n_h).map(|k| k as f64 * dot(&self.row, q.of(2 * k))).sum()
    }

    /// `[I + N′Ĝ, N′Q̂ᵀw; pᵀD⁻¹Q, pᵀw]` and `w = D⁻¹R_α`, along a series.
    pub(super) fn bordered(
        &self,
        linear: &Linear,
        balance: &Balance,
        q: &Series,
        omega: f64,
    ) -> (Mat<f64>, Series) {
        let reduction = &self.reduction;
        let mut w = Self::by_alpha(q, omega);
        linear.divide(&mut w);
        let border = self.through(balance, &w);
        let core = linear.receptance.jacobian(&balance.derivative);
        let size = core.nrows();
        let mut a = Mat::<f64>::zeros(size + 1, size + 1);
        a.submatrix_mut(0, 0, size, size).copy_from(&core);
        for i in 0..size {
            a[(i, size)] = border[(i, 0)];
        }
        // pᵀ D⁻¹ Q, column by column
        let rank = reduction.q.ncols();
        for k in 1..=q.n_h {
            for (c, (cos, sin)) in linear.sines_of(k, &self.row, reduction).into_iter().enumerate()
            {
                a[(size, (2 * k - 1) * rank + c)] = k as f64 * cos;
                a[(size, 2 * k * rank + c)] = k as f64 * sin;
            }
        }
        a[(size, size)] = self.phase(&w);
        (a, w)
    }

    /// `N′ Q̂ᵀ x`
    fn through(&self, balance: &Balance, x: &Series) -> Mat<f64> {
        let x = project_in(&self.reduction, x);
        &balance.derivative * Mat::from_fn(x.a.len(), 1, |i, _| x.a[i])
    }

    /// The Newton step `(δq, δα)`.
    fn step(&self, q: &Series, omega: f64, at: &Evaluated) -> (Vec<f64>, f64) {
        let Evaluated { linear, balance, r, .. } = at;
        let reduction = &self.reduction;
        let mut of_r = r.clone();
        linear.divide(&mut of_r);
        let right = self.through(balance, &of_r);
        let (a, of_alpha) = self.bordered(linear, balance, q, omega);
        let (size, rank) = (a.nrows() - 1, reduction.q.ncols());
        let rhs = Mat::from_fn(size + 1, 1, |i, _| match i == size {
            true => self.phase(q) - self.phase(&of_r),
            false => -right[(i, 0)],
        });
        let solution = a.partial_piv_lu().solve(rhs);
        let by_alpha = solution[(size, 0)];
        // −D⁻¹(R + Q δn + R_α δα)
        let mut x = r.clone();
        for i in 0..q.basis.len(q.n_h) {
            for c in 0..rank {
                let dn = solution[(i * rank + c, 0)];
                let q = reduction.q.col_as_slice(c);
                x.of_mut(i).iter_mut().zip(q).for_each(|(x, q)| *x += q * dn);
            }
        }
        linear.divide(&mut x);
        let step = x.a.iter().zip(&of_alpha.a).map(|(x, a)| -x - a * by_alpha).collect();
        (step, by_alpha)
    }

    /// Residual `(R, p)` at `(q, α)`, and its derivative in a direction: for tests.
    pub fn directional(
        &mut self,
        (q, alpha): (&Series, f64),
        (direction, by_alpha): (&Series, f64),
        omega: f64,
    ) -> Result<(Vec<f64>, Vec<f64>), HbmError> {
        self.set_feedback(alpha)?;
        let (mut r, mut change) = super::modes::directional(
            &self.reduction,
            q,
            direction,
            omega,
            Quadrature::EventResolved,
        )?;
        let more = Self::by_alpha(q, omega);
        change.iter_mut().zip(&more.a).for_each(|(c, m)| *c += by_alpha * m);
        r.push(self.phase(q));
        change.push(self.phase(direction));
        Ok((r, change))
    }
}
