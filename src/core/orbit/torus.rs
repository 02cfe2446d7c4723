//! Motions of two frequencies: closed curves that the period map of the loads carries into themselves, followed from where a pair of multipliers leaves the unit circle.
//!
//! ```text
//! F(x(s)) = x(s + 2πρ)        0 ≤ s < 2π
//! ```
//!
//! with the map `F` over a period of the loads and the rotation number `ρ`. The curve is the trigonometric polynomial through its values `x_j` at `2K + 1` even phases `s_j`,
//! which `R(ρ)` carries to `s_j + 2πρ`:
//!
//! ```text
//! F(x_j, ω) − Σ_l R_jl(ρ) x_l = 0        2K + 1 states
//! Σ_j ẋ̂_j · (x_j − x̂_j) = 0            the phase is that of a curve x̂ before
//! |c₁|² = a² ,  or  ω = ω̂               c₁ its first coefficient
//! ```
//!
//! for the unknowns `(x_j, ρ, ω)`, by Newton's method with the exact derivatives of all motions. At the bifurcation the system with `ω` given is singular, that with the size `a`
//! is not. Source: Schilder, Osinga, Vogt 2005 (SIAM J. Appl. Dyn. Syst. 4); rotation numbers `p/q` have no curve, and Newton's method says so.

use std::f64::consts::TAU;

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::attractor::{Look, STATES};
use super::chain::Propagator;
use super::condition::{angle, null_vector};
use super::period_map::integrate_with;
use super::section::later;
use super::shooting::{Closure, image, jacobian};
use super::{OrbitError, tolerate};
use crate::continuation::{dot, norm};
use crate::fem::largest;
use crate::records::CurveOf;

/// Most steps of Newton's method.
const STEPS: usize = 12;
/// A curve is carried into itself to this, over the size of its states.
const CLOSED: f64 = 1e-11;
/// A correction may be so many times as large as the curve.
const REACH: f64 = 2.0;

/// How far beside a curve a state is taken, over its size, to see whether it attracts; the period from which on, and up to which, it is looked at.
const BESIDE: f64 = 1e-3;
const PERIODS: (usize, usize) = (20, 200);
/// The distance of a state changes around the curve: means of its logarithm over so many periods are compared, and what they tell is known to this.
const MEAN: usize = 40;
const SEEN: f64 = 2e-4;

/// What is given of a curve beside its phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Given {
    /// `a`, the size of its first coefficient, as a frame vector.
    Size(f64),
    /// `ω`, the circular frequency of the loads.
    Frequency(f64),
}

/// A closed curve that the map of a period of the loads carries into itself.
#[derive(Debug, Clone)]
pub struct Torus {
    /// Circular frequency of the loads.
    pub omega: f64,
    /// Rotation number: turns around the curve in a period of the loads.
    pub rho: f64,
    /// Frame vectors at even phases: an odd number of them.
    pub states: Vec<Vec<f64>>,
}

/// `D(s) = (1 + 2 Σ cos ks)/N` of a trigonometric polynomial through `N = 2K + 1` values, and `D′`.
fn kernel(harmonics: usize, s: f64) -> (f64, f64) {
    let count = (2 * harmonics + 1) as f64;
    let (mut value, mut slope) = (1.0, 0.0);
    for k in 1..=harmonics {
        let (sin, cos) = (k as f64 * s).sin_cos();
        value += 2.0 * cos;
        slope -= 2.0 * k as f64 * sin;
    }
    (value / count, slope / count)
}

impl Torus {
    /// A small curve of a size around an orbit of one period of the loads whose pair of multipliers is near the unit circle; none where it has no pair.
    pub fn around(
        body: &mut Propagator,
        z: &[f64],
        omega: f64,
        (size, harmonics): (f64, usize),
    ) -> Result<Option<Torus>, OrbitError> {
        body.system.loads_mut().set_frequency(omega);
        let at = image(body, Closure::FORCED, z, TAU / omega)?;
        let x_less_one = jacobian(body, Closure::FORCED, &at, false)?;
        let Some(theta) = angle(&x_less_one)? else { return Ok(None) };
        // X v = e^{iθ} v: x + Re (a v e^{is})
        let v = null_vector(&CurveOf::Torus.matrix(&x_less_one, theta))?;
        let (re, im) = v.split_at(z.len());
        let length = norm(&v);
        let count = 2 * harmonics + 1;
        let state = |j: usize| {
            let (sin, cos) = (TAU * j as f64 / count as f64).sin_cos();
            let off = re.iter().zip(im).map(|(re, im)| size * (re * cos - im * sin) / length);
            z.iter().zip(off).map(|(z, off)| z + off).collect()
        };
        Ok(Some(Torus { omega, rho: theta / TAU, states: (0..count).map(state).collect() }))
    }

    /// `K`
    pub fn harmonics(&self) -> usize {
        self.states.len() / 2
    }

    /// The phase of a state.
    fn phase(&self, j: usize) -> f64 {
        TAU * j as f64 / self.states.len() as f64
    }

    /// Its mean, and twice the mean of `x e^{−iks}`: real and imaginary part.
    fn coefficient(&self, k: usize) -> [Vec<f64>; 2] {
        let n = self.states[0].len();
        let mut c = [vec![0.0; n], vec![0.0; n]];
        let weight = if k == 0 { 1.0 } else { 2.0 } / self.states.len() as f64;
        for (j, x) in self.states.iter().enumerate() {
            let (sin, cos) = (k as f64 * self.phase(j)).sin_cos();
            for (i, x) in x.iter().enumerate() {
                c[0][i] += weight * cos * x;
                c[1][i] -= weight * sin * x;
            }
        }
        c
    }

    fn size_of(&self, k: usize) -> f64 {
        let [re, im] = self.coefficient(k);
        norm(&re).hypot(norm(&im))
    }

    /// `a = |c₁|`
    pub fn size(&self) -> f64 {
        self.size_of(1)
    }

    /// The larger one of its last two coefficients over the first: what the polynomial leaves out.
    pub fn tail(&self) -> f64 {
        let k = self.harmonics();
        self.size_of(k).max(self.size_of(k.saturating_sub(1))) / self.size()
    }

    /// The state at any phase, and its derivative by the phase.
    pub fn at(&self, s: f64) -> [Vec<f64>; 2] {
        let n = self.states[0].len();
        let mut all = [vec![0.0; n], vec![0.0; n]];
        for (j, x) in self.states.iter().enumerate() {
            let (value, slope) = kernel(self.harmonics(), s - self.phase(j));
            for (i, x) in x.iter().enumerate() {
                all[0][i] += value * x;
                all[1][i] += slope * x;
            }
        }
        all
    }

    /// The same curve by another number of harmonics.
    pub fn with_harmonics(&self, harmonics: usize) -> Torus {
        let count = 2 * harmonics + 1;
        let states = (0..count).map(|j| self.at(TAU * j as f64 / count as f64)[0].clone());
        Torus { states: states.collect(), ..self.clone() }
    }

    /// A guess at a curve of another size: as far from its middle in proportion.
    pub fn grown(&self, size: f64) -> Torus {
        let [middle, _] = self.coefficient(0);
        let by = size / self.size();
        let state = |x: &Vec<f64>| x.iter().zip(&middle).map(|(x, m)| m + by * (x - m)).collect();
        Torus { states: self.states.iter().map(state).collect(), ..self.clone() }
    }

    /// The curve near this one that the map carries into itself; none where Newton's method finds none.
    pub fn corrected(
        &self,
        body: &mut Propagator,
        given: Given,
    ) -> Result<Option<Torus>, OrbitError> {
        tolerate(self.newton(body, given)).map(Option::flatten)
    }

    fn newton(&self, body: &mut Propagator, given: Given) -> Result<Option<Torus>, OrbitError> {
        let mut now = self.clone();
        if let Given::Frequency(omega) = given {
            now.omega = omega;
        }
        let scale = self.states.iter().map(|x| norm(x)).fold(body.unit, f64::max);
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let (r, j) = now.system(body, self, given)?;
            let size = largest(&r) / scale;
            if size <= CLOSED {
                return Ok(Some(now));
            }
            // a step that does not help is the last one
            if size > 10.0 * last {
                return Ok(None);
            }
            last = size;
            let right = Mat::from_fn(r.len(), 1, |i, _| -r[i]);
            let step = j.partial_piv_lu().solve(&right);
            let n = self.states[0].len();
            let mut moved = 0.0f64;
            for (k, x) in now.states.iter_mut().enumerate() {
                for (i, x) in x.iter_mut().enumerate() {
                    *x += step[(k * n + i, 0)];
                    moved = moved.max(step[(k * n + i, 0)].abs());
                }
            }
            let rows = r.len();
            now.rho += step[(rows - 2, 0)];
            now.omega += step[(rows - 1, 0)];
            let is_near = moved <= REACH * self.size().max(1e-3 * scale);
            if !(is_near && now.omega > 0.5 * self.omega && now.omega < 2.0 * self.omega) {
                return Ok(None);
            }
        }
        Ok(None)
    }

    /// The largest contact displacement in magnitude, and the largest force, of all motions from its states over a period.
    pub fn seen(&self, body: &mut Propagator) -> Result<(f64, f64), OrbitError> {
        body.system.loads_mut().set_frequency(self.omega);
        let (body, period) = (&*body, TAU / self.omega);
        let (mut amplitude, mut force) = (0.0f64, 0.0f64);
        for x in &self.states {
            let mut look = Look::new(body, period, STATES);
            integrate_with(body, &body.state(x), period, STATES, &mut look)?;
            amplitude = amplitude.max(look.amplitude());
            force = force.max(look.sums()[0]);
        }
        Ok((amplitude, force))
    }

    /// How far a state is from the curve.
    fn away(&self, z: &[f64]) -> f64 {
        let from = |s: f64| {
            let [x, slope] = self.at(s);
            let off: Vec<f64> = z.iter().zip(&x).map(|(z, x)| z - x).collect();
            (norm(&off), dot(&off, &slope) / dot(&slope, &slope))
        };
        let apart = |j: usize| {
            let off = self.states[j].iter().zip(z).map(|(x, z)| (x - z) * (x - z));
            off.sum::<f64>()
        };
        let nearest = (0..self.states.len()).min_by(|&i, &j| apart(i).total_cmp(&apart(j)));
        // from the nearest state on, the foot of the perpendicular
        let mut s = self.phase(nearest.unwrap_or(0));
        (0..6).for_each(|_| s += from(s).1);
        from(s).0
    }

    /// By how much a state beside the curve comes nearer to it in a period, in the long run: below one it attracts. None where that motion could not be followed.
    pub fn attraction(&self, body: &mut Propagator) -> Result<Option<f64>, OrbitError> {
        let size = self.size();
        let [mut z, _] = self.at(0.3);
        // no direction is preferred
        let beside = |i: usize| (1.0 + i as f64).sqrt().fract() - 0.5;
        z.iter_mut().enumerate().for_each(|(i, z)| *z += BESIDE * size * beside(i));
        let (first, all) = PERIODS;
        let mut distances = vec![];
        for _ in 0..all {
            let Some(next) = tolerate(later(body, &z, self.omega, 1.0))? else { return Ok(None) };
            z = next;
            distances.push(self.away(&z).max(f64::MIN_POSITIVE).ln());
        }
        let mean = |from: usize| distances[from..from + MEAN].iter().sum::<f64>() / MEAN as f64;
        let last = all - MEAN;
        let rate = (mean(last) - mean(first)) / (last - first) as f64;
        Ok((rate.abs() > SEEN).then(|| rate.exp()))
    }

    /// Residual and Jacobian, by the states, `ρ`, `ω`.
    fn system(
        &self,
        body: &mut Propagator,
        before: &Torus,
        given: Given,
    ) -> Result<(Vec<f64>, Mat<f64>), OrbitError> {
        let (count, n) = (self.states.len(), self.states[0].len());
        let rows = count * n + 2;
        let (mut r, mut j) = (vec![0.0; rows], Mat::<f64>::zeros(rows, rows));
        body.system.loads_mut().set_frequency(self.omega);
        let period = TAU / self.omega;
        for (row, x) in self.states.iter().enumerate() {
            let at = image(body, Closure::FORCED, x, period)?;
            let by = jacobian(body, Closure::FORCED, &at, true)?;
            let rate = at.rate_end();
            let from = row * n;
            for i in 0..n {
                // r of the shot is F(x) − x
                r[from + i] = at.r[i] + x[i];
                for k in 0..n {
                    j[(from + i, from + k)] = by[(i, k)] + f64::from(u8::from(i == k));
                }
                // the end of the period comes earlier
                j[(from + i, rows - 1)] = by[(i, n)] - period / self.omega * rate[i];
            }
            for (column, x) in self.states.iter().enumerate() {
                let shift = self.phase(row) - self.phase(column) + TAU * self.rho;
                let (value, slope) = kernel(self.harmonics(), shift);
                for i in 0..n {
                    r[from + i] -= value * x[i];
                    j[(from + i, column * n + i)] -= value;
                    j[(from + i, rows - 2)] -= TAU * slope * x[i];
                }
            }
        }
        for (k, (x, old)) in self.states.iter().zip(&before.states).enumerate() {
            let [_, slope] = before.at(before.phase(k));
            for i in 0..n {
                r[rows - 2] += slope[i] * (x[i] - old[i]);
                j[(rows - 2, k * n + i)] = slope[i];
            }
        }
        match given {
            Given::Frequency(omega) => {
                r[rows - 1] = self.omega - omega;
                j[(rows - 1, rows - 1)] = 1.0;
            }
            Given::Size(a) => {
                let [re, im] = self.coefficient(1);
                let size = norm(&re).hypot(norm(&im));
                r[rows - 1] = size - a;
                let weight = 2.0 / count as f64;
                for k in 0..count {
                    let (sin, cos) = self.phase(k).sin_cos();
                    for i in 0..n {
                        j[(rows - 1, k * n + i)] = weight * (re[i] * cos - im[i] * sin) / size;
                    }
                }
            }
        }
        Ok((r, j))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_the_polynomial_through_its_values() {
        let state =
            |s: f64| vec![1.0 + 0.5 * s.cos() - 0.1 * (2.0 * s).sin(), 0.3 * (3.0 * s).cos()];
        let count = 9;
        let states = (0..count).map(|j| state(TAU * f64::from(j) / f64::from(count))).collect();
        let torus = Torus { omega: 1.0, rho: 0.1, states };
        for s in [0.3, 2.0, 5.5] {
            let [x, slope] = torus.at(s);
            let exact = state(s);
            assert!((x[0] - exact[0]).abs() < 1e-14 && (x[1] - exact[1]).abs() < 1e-14);
            let by = (-0.5 * s.sin() - 0.2 * (2.0 * s).cos(), -0.9 * (3.0 * s).sin());
            assert!((slope[0] - by.0).abs() < 1e-13 && (slope[1] - by.1).abs() < 1e-13);
        }
        assert!((torus.size() - 0.5).abs() < 1e-14);
        assert!((torus.tail() - 0.6).abs() < 1e-14);
        let finer = torus.with_harmonics(7);
        assert!((finer.size() - 0.5).abs() < 1e-14 && finer.tail() < 1e-14);
        assert!((torus.grown(0.25).size() - 0.25).abs() < 1e-14);
    }
}
