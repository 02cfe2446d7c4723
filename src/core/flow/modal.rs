//! Exact flow by the modes of each active set (theory §6).
//!
//! Every modal coordinate is known at every time ([`super::spectrum`]). Each monitor is a sum of known exponentials, so its fourth derivative is bounded by
//! `Σ_k |r_k| B_k`, and its cubic Hermite interpolant on `[a, b]` is a rigorous enclosure: `|h − H| ≤ max|h⁗| (b−a)⁴/384`,
//! `|h′ − H′| ≤ max|h⁗| (b−a)³ √3/216`. The length of a window follows the content of the motion, not the highest frequency.
//!
//! Phases are kept by active set.

use std::cell::RefCell;
use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::drives::Drives;
use super::motion::Motion;
use super::rubbing;
use super::spectrum::{Spectra, Spectrum};
use super::values::Values;
use super::{Bernstein, Counters, Enclosure, Flow, FlowError, Layout};
use crate::contact::{Phase, System};

/// The flow; see the module's text.
pub struct Modal<'a> {
    system: &'a System,
    layout: Layout,
    spectra: Rc<Spectra>,
    /// Eigensolutions that were there before this flow.
    given: u64,
    phase: Option<Rc<Spectrum>>,
    motion: Motion,
    drives: Drives,
    t0: f64,
    t1: f64,
    end: Vec<f64>,
    end_known: bool,
    /// A time up to the start of the window, with what a state has behind displacements and velocities: the integrals there.
    known: (f64, Vec<f64>),
    /// The latest time for which they were asked, likewise.
    latest: RefCell<(f64, Vec<f64>)>,
    /// Bounds of the size and of the fourth derivative of each monitor in the window, and whether they hold
    /// for the whole phase.
    sizes: Vec<f64>,
    fourth: Vec<f64>,
    steady: bool,
    /// Monitor values and slopes.
    values: Values<(DVector<f64>, DVector<f64>)>,
    counters: Counters,
    failure: Option<FlowError>,
}

impl<'a> Modal<'a> {
    /// A flow without any phase yet.
    pub fn new(system: &'a System) -> Self {
        Self::sharing(system, Rc::default())
    }

    /// A flow that uses, and adds to, the spectra of others.
    pub(crate) fn sharing(system: &'a System, spectra: Rc<Spectra>) -> Self {
        let layout = Layout::new(system);
        Modal {
            system,
            layout,
            given: spectra.computed(),
            spectra,
            phase: None,
            motion: Motion::default(),
            drives: Drives::default(),
            t0: 0.0,
            t1: 0.0,
            end: vec![0.0; layout.len()],
            end_known: true,
            known: (0.0, vec![]),
            latest: RefCell::default(),
            sizes: vec![],
            fourth: vec![],
            steady: false,
            values: Values::default(),
            counters: Counters::default(),
            failure: None,
        }
    }

    fn modal(&self) -> Option<&Spectrum> {
        self.phase.as_deref()
    }

    /// Modal displacements and velocities at `t`.
    fn modes_at(&self, phase: &Spectrum, t: f64) -> (DVector<f64>, DVector<f64>) {
        let n = phase.modes.len();
        let (mut q, mut v) = (DVector::zeros(n), DVector::zeros(n));
        self.motion.at(phase, t, q.as_mut_slice(), v.as_mut_slice());
        (q, v)
    }

    /// Velocities of all modes and the monitors at some times, a column each.
    fn values_at(&self, phase: &Spectrum, times: &[f64]) -> [DMatrix<f64>; 2] {
        let (n, m) = (phase.modes.len(), times.len());
        let (mut q, mut v) = (DMatrix::zeros(n, m), DMatrix::zeros(n, m));
        self.motion.at_times(phase, times, q.as_mut_slice(), v.as_mut_slice());
        let mut h = &phase.rows * q;
        if let Some(rows) = &phase.velocity_rows {
            h += rows * &v;
        }
        let columns = h.as_mut_slice().chunks_exact_mut(phase.offsets.len().max(1));
        times.iter().zip(columns).for_each(|(t, h)| self.add_affine(phase, *t, h));
        [v, h]
    }

    /// What monitors have beside modes: constants, and drives at `t`.
    fn add_affine(&self, phase: &Spectrum, t: f64, h: &mut [f64]) {
        h.iter_mut().zip(&phase.offsets).for_each(|(h, c)| *h += c);
        if !self.drives.is_empty() {
            h.iter_mut().enumerate().for_each(|(i, h)| *h += self.drives.at(i, t, 0));
        }
    }

    /// The state `(u_O, u̇_O)` at `t`.
    fn write_state(&self, phase: &Spectrum, t: f64, y: &mut [f64]) {
        let n = self.layout.n_o;
        let (q, v) = self.modes_at(phase, t);
        // both at once: the shapes are read once
        let both: Vec<f64> = q.iter().chain(v.iter()).copied().collect();
        phase.state_of_modes(&both, &mut y[..2 * n]);
    }

    /// Monitor values at `t`, where the modes are at `(q, q̇)`.
    fn monitors_of(
        &self,
        phase: &Spectrum,
        t: f64,
        (q, v): (&DVector<f64>, &DVector<f64>),
    ) -> DVector<f64> {
        let mut h = &phase.rows * q;
        if let Some(rows) = &phase.velocity_rows {
            h += rows * v;
        }
        self.add_affine(phase, t, h.as_mut_slice());
        h
    }

    /// Monitor values and slopes at `t`.
    fn monitors_at(&self, phase: &Spectrum, t: f64) -> (DVector<f64>, DVector<f64>) {
        let (q, v) = self.modes_at(phase, t);
        let h = self.monitors_of(phase, t, (&q, &v));
        let mut rate = &phase.rows * &v;
        if let Some(rows) = &phase.velocity_rows {
            let mut a = DVector::zeros(q.len());
            self.motion.acceleration(phase, t, q.as_slice(), v.as_slice(), a.as_mut_slice());
            rate += rows * a;
        }
        if !self.drives.is_empty() {
            rate.iter_mut().enumerate().for_each(|(i, r)| *r += self.drives.at(i, t, 1));
        }
        (h, rate)
    }

    /// The longest window whose enclosures are tight against the size of the monitors.
    fn window_length(&mut self, phase: &Spectrum, t_limit: f64) -> f64 {
        // what grows is bounded over the time in which it grows by e
        let t_limit = t_limit.min(self.t0 + 1.0 / phase.growth());
        let rest = t_limit - self.t0;
        let count = phase.offsets.len();
        if count == 0 {
            return rest;
        }
        if !(self.steady && self.fourth.len() == count) {
            self.bound_monitors(phase, t_limit);
        }
        let mut length = rest;
        for (size, fourth) in self.sizes.iter().zip(&self.fourth) {
            if *fourth > 0.0 {
                length = length.min((384.0 * 0.002 * size / fourth).powf(0.25));
            }
        }
        // damped motions get calmer: bounds are renewed at every window
        length.max(64.0 * f64::EPSILON * self.t0.abs())
    }

    /// Size and fourth derivative of every monitor from the start of the window on.
    fn bound_monitors(&mut self, phase: &Spectrum, t_limit: f64) {
        [self.sizes, self.fourth] = self.motion.monitor_bounds(phase, self.t0, t_limit);
        if !self.drives.is_empty() {
            for i in 0..phase.offsets.len() {
                let (size, fourth) = self.drives.bounds(i);
                self.sizes[i] += size;
                self.fourth[i] += fourth;
            }
        }
        self.steady = self.motion.is_steady(phase);
    }

    /// Add to the integrals of a state what happens from `a` to `b`: work of harmonic loads and dissipation mode by mode, what friction does.
    fn integrate_powers(&self, phase: &Spectrum, (a, b): (f64, f64), y: &mut [f64]) {
        let Layout { work, dissipated, rubbed, .. } = self.layout;
        if let Some(i) = work {
            y[i] += self.drives.work(a, b);
        }
        if rubbed.is_some() && phase.sums_powers() {
            let at = |times: &[f64]| self.values_at(phase, times);
            rubbing::integrate((self.system, phase, &self.layout), (a, b), at, y);
        } else if work.is_some() || dissipated.is_some() {
            let sums = self.motion.all_powers(phase, (a, b));
            let places = [work, dissipated].into_iter().zip(sums);
            places.for_each(|(place, x)| place.into_iter().for_each(|i| y[i] += x));
        }
    }

    /// Write the integrals at `t`, going on from the last time asked for.
    fn write_integrals(&self, phase: &Spectrum, t: f64, y: &mut [f64]) {
        let tail = 2 * self.layout.n_o;
        if self.layout.len() == tail {
            return;
        }
        let mut latest = self.latest.borrow_mut();
        if latest.0 > t {
            // the end of the window was asked for before the samples
            latest.clone_from(&self.known);
        }
        y[tail..].copy_from_slice(&latest.1);
        self.integrate_powers(phase, (latest.0, t), y);
        latest.0 = t;
        latest.1.copy_from_slice(&y[tail..]);
    }

    /// Set the end of the window; state, work and dissipation there are computed when they are asked for.
    fn set_end(&mut self, t: f64) {
        self.t1 = t;
        self.end_known = false;
    }

    /// Compute what [`Self::set_end`] put off.
    fn complete_end(&mut self) {
        let Some(phase) = self.phase.clone().filter(|_| !self.end_known) else { return };
        let mut end = std::mem::take(&mut self.end);
        self.write_state(&phase, self.t1, &mut end);
        self.write_integrals(&phase, self.t1, &mut end);
        self.end = end;
        self.end_known = true;
    }
}

impl Flow for Modal<'_> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        (self.t0, self.t1) = (t, t);
        self.end.copy_from_slice(y);
        self.end_known = true;
        self.known = (t, y[2 * self.layout.n_o..].to_vec());
        self.latest.get_mut().clone_from(&self.known);
        self.values.clear();
        self.failure = None;
        self.steady = false;
        let Ok(modal) = self.spectra.of(self.system, phase) else {
            self.failure = Some(FlowError::NoModes { t });
            return;
        };
        self.drives = modal.drives(&self.system.loads);
        self.counters.factorisations = self.spectra.computed() - self.given;
        let n = self.layout.n_o;
        let mut both = vec![0.0; 2 * n];
        modal.to_modes(&y[..2 * n], &mut both);
        self.motion = Motion::new(&modal, &self.system.loads, t, &both[..n], &both[n..]);
        self.phase = Some(modal);
    }

    fn advance(&mut self, _: &Phase, t_limit: f64) -> Result<(), FlowError> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let Some(modal) = self.phase.clone() else { return Err(FlowError::NoModes { t: self.t1 }) };
        self.t0 = self.t1;
        self.known.clone_from(self.latest.get_mut());
        self.values.keep(self.t0);
        let length = self.window_length(&modal, t_limit);
        let rest = t_limit - self.t0;
        let t = if length * 1.01 >= rest { t_limit } else { self.t0 + length };
        if t <= self.t0 {
            return Err(FlowError::StepTooSmall { t: self.t0, h: length });
        }
        self.set_end(t);
        if self.motion.q.iter().chain(&self.motion.v).any(|x| !x.is_finite()) {
            return Err(FlowError::NotFinite { t: self.t0 });
        }
        self.counters.steps += 1;
        Ok(())
    }

    fn cut(&mut self, _: &Phase, t: f64) {
        self.set_end(t);
    }

    fn window(&self) -> (f64, f64) {
        (self.t0, self.t1)
    }

    fn end_state(&mut self) -> &[f64] {
        self.complete_end();
        &self.end
    }

    fn state(&self, t: f64, y: &mut [f64]) {
        if t == self.t1 && self.end_known {
            y.copy_from_slice(&self.end);
        } else if let Some(phase) = self.modal() {
            self.write_state(phase, t, y);
            self.write_integrals(phase, t, y);
        }
    }

    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        let Some(phase) = self.modal() else {
            return Enclosure {
                polynomial: Bernstein::constant(f64::NAN),
                error: 0.0,
                slope_error: 0.0,
            };
        };
        let at = |t: f64| self.values.at(t, || self.monitors_at(phase, t));
        let ends = |x: Rc<(DVector<f64>, DVector<f64>)>| (x.0[index], x.1[index]);
        Enclosure::hermite(ends(at(a)), ends(at(b)), b - a, self.fourth[index])
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn name(&self) -> &'static str {
        "modal"
    }

    // theory §12, H1
    fn is_exact(&self) -> bool {
        true
    }

    fn deviations(&self) -> Vec<f64> {
        self.modal().map_or(vec![], |phase| self.motion.deviations(phase, self.t1))
    }
}
