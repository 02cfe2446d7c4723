//! Adaptive explicit Runge–Kutta flow with dense output.
//!
//! Error norm: largest component over `u_O` and over `u̇_O`, each against `rtol` times the largest root mean square
//! seen so far plus `atol` times the problem's unit (length; length × frequency): independent of units and of turning
//! points, and no node's error is averaged away.
//! Step control: proportional-integral (Gustafsson), as in Hairer's codes.

use super::bernstein::{Bernstein, Nested};
use super::drives::Drives;
use super::held;
use super::tableau::Tableau;
use super::{Counters, Enclosure, Flow, FlowError, Layout};
use crate::contact::{Phase, Scratch, System};
use crate::fem::largest;

/// Tolerances of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Relative.
    pub rtol: f64,
    /// Absolute, in units of the problem.
    pub atol: f64,
}

const SAFETY: f64 = 0.9;
const MIN_FACTOR: f64 = 0.333;
const MAX_FACTOR: f64 = 6.0;
/// Largest number of halvings of a step before it counts as failed.
const SMALLEST: f64 = 8.0 * f64::EPSILON;

/// The flow; see the module's text.
#[derive(Debug)]
pub struct RungeKutta<'a> {
    system: &'a System,
    tableau: &'static Tableau,
    tolerances: Tolerances,
    layout: Layout,
    scratch: Scratch,
    counters: Counters,
    t0: f64,
    t1: f64,
    y0: Vec<f64>,
    y1: Vec<f64>,
    stage: Vec<f64>,
    k: Vec<Vec<f64>>,
    dense: Nested,
    monitors: Vec<Bernstein>,
    drives: Drives,
    /// Largest root mean square of `u_O` and `u̇_O` so far.
    largest: [f64; 2],
    h_next: f64,
    last_error: f64,
    h_fastest: f64,
}

impl<'a> RungeKutta<'a> {
    /// A flow with a tableau.
    pub fn new(system: &'a System, tableau: &'static Tableau, tolerances: Tolerances) -> Self {
        let layout = Layout::new(system);
        let n = layout.len();
        let h_fastest = 1.0 / system.units.highest.min(system.body.frequency_bound());
        RungeKutta {
            system,
            tableau,
            tolerances,
            layout,
            scratch: system.scratch(),
            counters: Counters::default(),
            t0: 0.0,
            t1: 0.0,
            y0: vec![0.0; n],
            y1: vec![0.0; n],
            stage: vec![0.0; n],
            k: vec![vec![0.0; n]; tableau.all_stages()],
            dense: Nested { f: vec![vec![0.0; n]; tableau.nested()] },
            monitors: vec![],
            drives: Drives::default(),
            largest: [0.0; 2],
            h_next: 0.1 * h_fastest,
            last_error: 1e-4,
            h_fastest,
        }
    }

    /// `k_index ← f(t, stage)`.
    fn rhs(&mut self, phase: &Phase, t: f64, index: usize) {
        let n = self.layout.n_o;
        let (u, v) = (&self.stage[..n], &self.stage[n..2 * n]);
        let k = &mut self.k[index];
        k[..n].copy_from_slice(v);
        phase.acceleration(t, u, v, &mut self.scratch, &mut k[n..2 * n]);
        if let Some(i) = self.layout.work {
            k[i] = self.system.loads.driven_power(t, &self.scratch.v);
        }
        if let Some(i) = self.layout.dissipated {
            k[i] = phase.dissipation(v, &mut self.scratch);
            // dampers stand in damped bodies alone; what follows is in the scratch now
            if let Some(work) = self.layout.work {
                k[work] += self.system.loads.stretched_power(t, &self.scratch.v);
            }
        }
        if let Some(rubbed) = self.layout.rubbed {
            k[rubbed.all()].fill(0.0);
            phase.rubbing_rates(t, (u, v), |point, rates| rubbed.add(k, point, &rates, 1.0));
        }
        self.counters.rhs_evaluations += 1;
    }

    /// `stage ← y₀ + h Σ a_j k_j`.
    fn combine(&mut self, h: f64, weights: &[f64]) {
        self.stage.copy_from_slice(&self.y0);
        for (k, &a) in self.k.iter().zip(weights) {
            if a != 0.0 {
                let ha = h * a;
                self.stage.iter_mut().zip(k).for_each(|(s, k)| *s += ha * k);
            }
        }
    }

    /// All stages of a step of size `h`; `k_0` is in place. Leaves `y₁` and `k_s = f(t₁, y₁)`.
    fn step(&mut self, phase: &Phase, h: f64) {
        let tableau = self.tableau;
        let s = tableau.stages();
        for i in 1..s {
            self.combine(h, tableau.a[i]);
            self.rhs(phase, self.t0 + tableau.c[i] * h, i);
        }
        self.combine(h, tableau.b);
        self.rhs(phase, self.t0 + h, s);
        std::mem::swap(&mut self.y1, &mut self.stage);
    }

    /// Extra stages, nested coefficients, monitors.
    fn finish(&mut self, phase: &Phase, h: f64) {
        let tableau = self.tableau;
        let s = tableau.stages();
        for (i, (a, c)) in tableau.extra_a.iter().zip(tableau.extra_c).enumerate() {
            self.combine(h, a);
            self.rhs(phase, self.t0 + c * h, s + 1 + i);
        }
        let f = &mut self.dense.f;
        for j in 0..self.y0.len() {
            let difference = self.y1[j] - self.y0[j];
            let slope = h * self.k[0][j] - difference;
            f[0][j] = self.y0[j];
            f[1][j] = difference;
            f[2][j] = slope;
            f[3][j] = difference - h * self.k[s][j] - slope;
        }
        for (row, f) in tableau.dense.iter().zip(&mut f[4..]) {
            f.fill(0.0);
            for (k, &d) in self.k.iter().zip(*row) {
                if d != 0.0 {
                    f.iter_mut().zip(k).for_each(|(f, k)| *f += h * d * k);
                }
            }
        }
        self.enclose_monitors(phase);
    }

    /// Every monitor is affine in `(u_O, u̇_O)`: apply it to the coefficients of the dense output.
    fn enclose_monitors(&mut self, phase: &Phase) {
        let n = self.layout.n_o;
        let m = phase.monitors.len();
        let mut rows = vec![vec![0.0; m]; self.dense.f.len()];
        for (k, (f, row)) in self.dense.f.iter().zip(&mut rows).enumerate() {
            if k == 0 {
                phase.monitor_undriven(&f[..n], &f[n..2 * n], row);
            } else {
                phase.monitor_gradient(&f[..n], &f[n..2 * n], row);
            }
        }
        self.monitors.clear();
        let mut nested = vec![0.0; rows.len()];
        for i in 0..m {
            nested.iter_mut().zip(&rows).for_each(|(x, row)| *x = row[i]);
            self.monitors.push(Bernstein::from_nested(&nested));
        }
        if !phase.held.is_empty() {
            let (window, dense) = ((self.t0, self.t1), &self.dense);
            let layout = self.layout;
            let weights =
                held::enclose(phase, layout, window, &mut self.scratch, |s, y| dense.at(s, y));
            weights.into_iter().for_each(|(index, weight)| self.monitors[index] = weight);
        }
    }

    fn root_mean_squares(&self, y: &[f64]) -> [f64; 2] {
        let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
        [rms(self.layout.u(y)), rms(self.layout.v(y))]
    }

    fn note_size(&mut self, size: [f64; 2]) {
        self.largest = [self.largest[0].max(size[0]), self.largest[1].max(size[1])];
    }

    /// The error of the step just made over the tolerance.
    fn error(&mut self, h: f64, size: [f64; 2]) -> f64 {
        let n = self.layout.n_o;
        let unit = self.system.units.length;
        let units = [unit, unit * self.system.units.frequency];
        let scale = |b: usize| {
            self.tolerances.atol * units[b] + self.tolerances.rtol * self.largest[b].max(size[b])
        };
        let scales = [scale(0), scale(1)];
        let error = &mut self.stage;
        let k = &self.k;
        let mut norm_squared = |weights: &[f64]| {
            error[..2 * n].fill(0.0);
            for (k, &w) in k.iter().zip(weights) {
                if w != 0.0 {
                    error[..2 * n].iter_mut().zip(k).for_each(|(e, k)| *e += w * k);
                }
            }
            let [u, v] = [largest(&error[..n]) / scales[0], largest(&error[n..2 * n]) / scales[1]];
            (u * u).max(v * v)
        };
        let high = norm_squared(self.tableau.error);
        match self.tableau.error_low {
            None => h * high.sqrt(),
            Some(_) if high == 0.0 => 0.0,
            Some(low) => h * high / (high + 0.01 * norm_squared(low)).sqrt(),
        }
    }
}

impl Flow for RungeKutta<'_> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        (self.t0, self.t1) = (t, t);
        self.y1.copy_from_slice(y);
        self.stage.copy_from_slice(y);
        self.drives = Drives::of(phase);
        let s = self.tableau.stages();
        self.rhs(phase, t, s);
        let size = self.root_mean_squares(y);
        self.note_size(size);
    }

    fn memory(&self) -> Vec<f64> {
        vec![self.largest[0], self.largest[1], self.h_next, self.last_error]
    }

    fn recall(&mut self, memory: &[f64]) {
        if let &[u, v, h_next, last_error] = memory {
            (self.largest, self.h_next, self.last_error) = ([u, v], h_next, last_error);
        }
    }

    fn advance(&mut self, phase: &Phase, t_limit: f64) -> Result<(), FlowError> {
        let s = self.tableau.stages();
        self.t0 = self.t1;
        std::mem::swap(&mut self.y0, &mut self.y1);
        self.k.swap(0, s);
        let exponent = 1.0 / f64::from(self.tableau.order) - 0.75 * self.tableau.damping;
        let smallest = SMALLEST * self.t0.abs().max(self.h_fastest);
        let mut rejected = false;
        loop {
            let rest = t_limit - self.t0;
            // stretch to the limit rather than leave a sliver
            let last = self.h_next * 1.01 >= rest;
            let h = if last { rest } else { self.h_next };
            self.step(phase, h);
            let size = self.root_mean_squares(&self.y1);
            let finite = size[0].is_finite() && size[1].is_finite();
            let error = if finite { self.error(h, size) } else { f64::NAN };
            if error <= 1.0 {
                self.t1 = if last { t_limit } else { self.t0 + h };
                let factor = SAFETY
                    * error.max(1e-12).powf(-exponent)
                    * self.last_error.powf(self.tableau.damping);
                let most = if rejected { 1.0 } else { MAX_FACTOR };
                let h_new = h * factor.clamp(MIN_FACTOR, most);
                // a step shortened by the limit says nothing about the next one
                self.h_next = if last { self.h_next.max(h_new) } else { h_new };
                self.last_error = error.max(1e-4);
                self.note_size(size);
                self.counters.steps += 1;
                self.finish(phase, h);
                return Ok(());
            }
            rejected = true;
            self.counters.rejected += 1;
            let factor = SAFETY * error.powf(-exponent);
            // an error that is not a number shrinks the step as much as is allowed
            self.h_next = h * if factor.is_finite() { factor.clamp(0.1, 1.0) } else { 0.1 };
            if self.h_next < smallest {
                return Err(if error.is_finite() {
                    FlowError::StepTooSmall { t: self.t0, h: self.h_next }
                } else {
                    FlowError::NotFinite { t: self.t0 }
                });
            }
        }
    }

    fn cut(&mut self, phase: &Phase, t: f64) {
        let h = t - self.t0;
        self.t1 = t;
        self.step(phase, h);
        self.finish(phase, h);
    }

    fn window(&self) -> (f64, f64) {
        (self.t0, self.t1)
    }

    fn end_state(&mut self) -> &[f64] {
        &self.y1
    }

    fn state(&self, t: f64, y: &mut [f64]) {
        if t == self.t1 {
            y.copy_from_slice(&self.y1);
        } else {
            self.dense.at((t - self.t0) / (self.t1 - self.t0), y);
        }
    }

    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        let h = self.t1 - self.t0;
        let theta = |t: f64| ((t - self.t0) / h).clamp(0.0, 1.0);
        let polynomial = self.monitors[index].restrict(theta(a), theta(b));
        let undriven = Enclosure { polynomial, error: 0.0, slope_error: 0.0 };
        if self.drives.is_empty() {
            undriven
        } else {
            undriven.plus(&self.drives.enclose(index, a, b))
        }
    }

    fn counters(&self) -> Counters {
        let rows = self.counters.rhs_evaluations * self.layout.n_o as u64;
        Counters { rows, ..self.counters }
    }

    fn name(&self) -> &'static str {
        self.tableau.name
    }
}
