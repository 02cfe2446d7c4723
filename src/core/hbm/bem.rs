//! Harmonic balance of a uniform bar by boundary elements: the continuum in the frequency domain (Lu and Legrand, Nonlinear Dyn. 107, 2022, 227).
//!
//! A bar of length `L`, wave speed `c` and stiffness `EA`, held at one end, answers a force `p_k cos kωt` at the other exactly,
//!
//! ```text
//! u_k = tan(κ_k L) / (κ_k EA) p_k,     κ_k = kω/c     (k = 0: L/EA)
//! ```
//!
//! and the contact conditions `p ≤ 0 ⟂ u ≤ g` are one equation, weighted by cosines at `n_d m` instants a period,
//!
//! ```text
//! Σ_i [ p(t_i) + max(0, ρ(u(t_i) − g) − p(t_i)) ] cos jωt_i = 0,     j = 0 … m
//! ```
//!
//! No mesh, but the answer depends on `ρ`, and convergence in `m` is erratic: `tan κ_k L` has poles near every frequency.

use std::f64::consts::{PI, TAU};

use faer::Mat;
use faer::linalg::solvers::Solve;

use crate::contact::System;
use crate::continuation::norm;
use crate::fem::{Material, StressState, largest};

/// A bar and how its contact is weighted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarBalance {
    /// `L`
    pub length: f64,
    /// `c`
    pub speed: f64,
    /// `EA`
    pub stiffness: f64,
    /// `g`
    pub gap: f64,
    /// `ρ` over `EA/L`.
    pub rho: f64,
    /// `n_d`: instants a period and harmonic.
    pub density: usize,
}

/// A solution: `u(L, t) = Σ u_k cos kωt`, at `t = 0` in mid-contact.
#[derive(Debug, Clone, PartialEq)]
pub struct BarSeries {
    /// `ω`
    pub omega: f64,
    /// `u_k`
    pub u: Vec<f64>,
    /// `p_k`, positive in tension.
    pub p: Vec<f64>,
    /// Largest weighted residual over the largest `p_k`.
    pub residual: f64,
    /// Newton steps.
    pub iterations: usize,
}

/// No solution.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoBarSeries {
    /// `κ_k L` is an odd multiple of `π/2`.
    #[error("harmonic {0} is at a resonance of the bar: its answer has no bound")]
    Resonance(usize),
    /// Newton's method came to a motion that does not touch: the bar at rest.
    #[error("the bar at rest")]
    AtRest,
    /// Newton's method did not converge.
    #[error("not converged: residual {residual:.1e} after {iterations} steps")]
    NotConverged {
        /// Over the largest `p_k`.
        residual: f64,
        /// Steps.
        iterations: usize,
    },
}

/// `|cos κL|` below this is a resonance.
const RESONANCE: f64 = 1e-9;
/// Most Newton steps, and the residual that ends them.
const ITERATIONS: usize = 60;
const TOLERANCE: f64 = 1e-13;

impl BarBalance {
    /// The bar of a system, with the parameters of the source; none if it is no uniform bar that is held and has a contact.
    pub fn of(system: &System) -> Option<BarBalance> {
        let &[Material { young, state: StressState::Uniaxial { area }, .. }] =
            system.body.materials()
        else {
            return None;
        };
        let gap = system.constraints.first()?.gap;
        let held = system.body.rigid_motions(false).is_empty();
        held.then_some(BarBalance {
            length: system.body.mesh.length(),
            speed: system.body.wave_speed()?,
            stiffness: young * area,
            gap,
            rho: 4.0,
            density: 20,
        })
    }

    /// The coefficients of the first nonsmooth mode in closed form, for `3 < cT/L < 4`: a start.
    pub fn closed_form(&self, omega: f64, m: usize) -> Option<Vec<f64>> {
        let t = TAU / omega * self.speed / self.length;
        if !(t > 3.0 && t < 4.0) {
            return None;
        }
        let alpha = self.gap / (2.0 * (t - 3.0));
        let contact = 4.0 - t;
        let mean = self.gap - 2.0 * alpha * (t - 2.0).powi(2) / t;
        let of = |k: usize| {
            let k = k as f64;
            2.0 * alpha * t / (PI * k).powi(2) * ((PI * k * contact / t).cos() - (PI * k).cos())
        };
        Some(std::iter::once(mean).chain((1..=m).map(of)).collect())
    }

    /// `E = EA/(2L) (g/(cT/L − 3))²` of this mode: all of it elastic, where the bar is at rest.
    pub fn closed_form_energy(&self, omega: f64) -> Option<f64> {
        let t = TAU / omega * self.speed / self.length;
        let strain = self.gap / (t - 3.0);
        (self.gap > 0.0 && t > 3.0 && t < 4.0)
            .then(|| 0.5 * self.stiffness / self.length * strain * strain)
    }

    /// `u_k / p_k`
    fn answers(&self, omega: f64, m: usize) -> Result<Vec<f64>, NoBarSeries> {
        let answer = |k: usize| {
            let kappa = k as f64 * omega / self.speed;
            let angle = kappa * self.length;
            match k {
                0 => Ok(self.length / self.stiffness),
                _ if angle.cos().abs() < RESONANCE => Err(NoBarSeries::Resonance(k)),
                _ => Ok(angle.tan() / (kappa * self.stiffness)),
            }
        };
        (0..=m).map(answer).collect()
    }

    /// Newton's method from coefficients `u_k`.
    pub fn solve(&self, omega: f64, guess: &[f64]) -> Result<BarSeries, NoBarSeries> {
        let m = guess.len() - 1;
        let answers = self.answers(omega, m)?;
        let rho = self.rho * self.stiffness / self.length;
        let instants = self.density * m.max(1);
        let cosines = Mat::from_fn(instants, m + 1, |i, k| {
            (TAU * ((i * k) % instants) as f64 / instants as f64).cos()
        });
        let mut p: Vec<f64> = guess.iter().zip(&answers).map(|(u, a)| u / a).collect();
        let mut residual = f64::INFINITY;
        for iterations in 0..=ITERATIONS {
            let column = |x: &dyn Fn(usize) -> f64| Mat::from_fn(m + 1, 1, |k, _| x(k));
            let force = &cosines * column(&|k| p[k]);
            let moved = &cosines * column(&|k| answers[k] * p[k]);
            let excess = |i: usize| rho * (moved[(i, 0)] - self.gap) - force[(i, 0)];
            let touching: Vec<bool> = (0..instants).map(|i| excess(i) > 0.0).collect();
            let balance = Mat::from_fn(instants, 1, |i, _| force[(i, 0)] + excess(i).max(0.0));
            let share = 1.0 / instants as f64;
            let r = cosines.transpose() * balance * faer::Scale(share);
            let size = norm(&p).max(f64::MIN_POSITIVE);
            residual = (0..=m).map(|j| r[(j, 0)].abs()).fold(0.0, f64::max) / size;
            let largest = largest(&p);
            if largest <= TOLERANCE * self.gap.abs() * self.stiffness / self.length {
                return Err(NoBarSeries::AtRest);
            }
            if residual <= TOLERANCE {
                if !touching.contains(&true) {
                    return Err(NoBarSeries::AtRest);
                }
                let u = p.iter().zip(&answers).map(|(p, a)| p * a).collect();
                return Ok(BarSeries { omega, u, p, residual, iterations });
            }
            let slopes = Mat::from_fn(instants, m + 1, |i, k| {
                cosines[(i, k)] * if touching[i] { rho * answers[k] } else { 1.0 }
            });
            let jacobian = cosines.transpose() * slopes * faer::Scale(share);
            let step = jacobian.partial_piv_lu().solve(&r);
            p.iter_mut().enumerate().for_each(|(k, p)| *p -= step[(k, 0)]);
            if p.iter().any(|p| !p.is_finite()) {
                return Err(NoBarSeries::NotConverged { residual, iterations });
            }
        }
        Err(NoBarSeries::NotConverged { residual, iterations: ITERATIONS })
    }

    /// Kinetic and elastic energy of a solution at `t`.
    pub fn energies(&self, s: &BarSeries, t: f64) -> [f64; 2] {
        let (l, ea) = (self.length, self.stiffness);
        let kappa = |k: usize| k as f64 * s.omega / self.speed;
        // ∫ cos ax cos bx and ∫ sin ax sin bx over the bar
        let sinc = |x: f64| if x == 0.0 { l } else { (x * l).sin() / x };
        let products = |a: f64, b: f64| {
            let (less, more) = (sinc(a - b), sinc(a + b));
            [0.5 * (less + more), 0.5 * (less - more)]
        };
        let shape = |k: usize| s.p[k] / (ea * (kappa(k) * l).cos());
        let (mut kinetic, mut elastic) = (0.0, 0.0);
        for j in 0..s.p.len() {
            for k in 0..s.p.len() {
                let (of_j, of_k) = (j as f64 * s.omega * t, k as f64 * s.omega * t);
                let [cosines, sines] = products(kappa(j), kappa(k));
                let both = ea * shape(j) * shape(k);
                // u̇ = −c Σ shape sin κx sin kωt, and ρA c² = EA
                elastic += 0.5 * both * cosines * of_j.cos() * of_k.cos();
                kinetic += 0.5 * both * sines * of_j.sin() * of_k.sin();
            }
        }
        [kinetic, elastic]
    }

    /// Largest penetration and largest tension over a period: the conditions are weighted, not met.
    pub fn violations(&self, s: &BarSeries) -> [f64; 2] {
        let at = |x: &[f64], t: f64| -> f64 {
            x.iter().enumerate().map(|(k, x)| x * (k as f64 * t).cos()).sum()
        };
        let mut worst = [0.0f64; 2];
        let instants = 40 * s.u.len();
        for i in 0..instants {
            let t = TAU * i as f64 / instants as f64;
            worst[0] = worst[0].max(at(&s.u, t) - self.gap);
            worst[1] = worst[1].max(at(&s.p, t));
        }
        worst
    }
}
