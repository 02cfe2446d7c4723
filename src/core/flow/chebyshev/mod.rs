//! Exact flow without eigenvectors, for large meshes (theory §7): any Rayleigh damping, constant and harmonic loads.
//!
//! From the state at the start of a window, with `S = M_α⁻¹K_α`, `2δ = α + βS`, `b = M_α⁻¹A*ᵀF` for loads `Re(z e^{iωt})F`, and `a₀` the acceleration
//! there without these and without damping,
//!
//! ```text
//! g″ + 2δg′ + sg = 0, g(0) = 0, g′(0) = 1      G = ∫g,  p = ∫₀ᵗ g(t − x) e^{iωx} dx
//! u(t) = u₀ + g(S) v₀ + G(S) a₀ + Re[z p(S)] b
//! v(t) =     g′(S) v₀ + g(S) a₀ + Re[z p′(S)] b
//! ```
//!
//! All are entire functions of `S`: exact resonance, rigid motions and overdamping are no exceptions, and no static solution is needed. They
//! are summed by Chebyshev polynomials (`nodes`); the vectors `T_k(S̃)v₀`, `T_k(S̃)a₀`, `T_k(S̃)b` do not depend on `t` (the last not even on the
//! window), so each monitor is a sum over pseudo-modes, known at every time without further products, whose cubic Hermite
//! interpolant is a rigorous enclosure (`monitors`).

mod drive;
mod length;
mod monitors;
mod nodes;
mod powers;
mod propagate;
mod series;
mod zoned;

pub use propagate::Tangent;
pub use zoned::Zoned;

use std::cell::RefCell;
use std::rc::Rc;

use super::drives::Drives;
use super::values::Values;
use super::{Counters, Enclosure, Flow, FlowError, Layout};
use crate::contact::{Phase, Recurrence, Scratch, System};
use crate::fem::Harmonic;
use drive::Pattern;
use length::{Length, Lengths, rounding};
use monitors::Sums;
use nodes::Nodes;
use powers::Powers;
use series::{Rows, Series, Share, add_up, extend};

/// Length of the first window of a phase, shortest and longest, and of the longest of all, in `R = t ω_max`: switches come in avalanches, and what
/// lies behind the next one is thrown away.
const FIRST: (f64, f64) = (1.0, 8.0);
const LONGEST: f64 = 480.0;
/// Memory for the vectors of a window, in numbers.
const MEMORY: usize = 120_000_000;

/// The flow; see the module's text.
pub struct Chebyshev<'a> {
    system: &'a System,
    layout: Layout,
    scratch: Scratch,
    omega: f64,
    recurrence: Recurrence,
    lengths: Lengths,
    /// Distance of the last two switches, in `R`, and the start of the phase.
    distance: f64,
    begun: Option<f64>,
    /// No window of the phase has been made; the length of the next otherwise.
    length: Option<f64>,
    /// Bounds of `‖∇h‖_{M⁻¹}` of the phase's monitors; what harmonic loads on `u_C` add to them.
    gradients: Vec<f64>,
    drives: Drives,
    /// The loads of the phase by their shapes, `A*ᵀF`, and `‖b‖_M`.
    patterns: Vec<Pattern>,
    forces: Vec<Vec<f64>>,
    sizes: Vec<f64>,
    t0: f64,
    t1: f64,
    start: Vec<f64>,
    /// State at the end of the window, once it has been asked for.
    end: Vec<f64>,
    end_known: bool,
    a0: Vec<f64>,
    /// No velocity at all.
    at_rest: Vec<f64>,
    v: Series,
    a: Series,
    /// Terms of the window, and what they leave out.
    needs: Option<Length>,
    h0: Vec<f64>,
    /// What is left out of the sums of each monitor, and of its rate.
    rest: Vec<(f64, f64)>,
    /// What the windows of the phase have left out of displacements and velocities, or rounded, in the norm of `M`; the start of the phase.
    left_out: (f64, f64),
    phase_start: f64,
    /// The same of the present window, by its bounds and by rounding.
    leaves_out: [(f64, f64); 2],
    sums: Option<RefCell<Sums>>,
    powers: Option<Powers>,
    /// Monitor values and slopes.
    values: Values<(Vec<f64>, Vec<f64>)>,
    counters: Counters,
}

impl<'a> Chebyshev<'a> {
    /// A flow for a body whose natural modes decouple it, under constant and harmonic loads (the caller sees to that).
    pub fn new(system: &'a System) -> Self {
        Chebyshev::with(system, Recurrence::new(system))
    }

    /// The same of the displacements that a recurrence moves: the others stay where they are.
    fn with(system: &'a System, recurrence: Recurrence) -> Self {
        let layout = Layout::new(system);
        let n = layout.len();
        let omega = system.units.highest;
        Chebyshev {
            system,
            layout,
            scratch: system.scratch(),
            omega,
            recurrence,
            lengths: Lengths::new(omega, system.damping),
            distance: FIRST.1,
            begun: None,
            length: None,
            gradients: vec![],
            drives: Drives::default(),
            patterns: vec![],
            forces: vec![],
            sizes: vec![],
            t0: 0.0,
            t1: 0.0,
            start: vec![0.0; n],
            end: vec![0.0; n],
            end_known: true,
            a0: vec![0.0; layout.n_o],
            at_rest: vec![0.0; layout.n_o],
            v: Series::default(),
            a: Series::default(),
            needs: None,
            h0: vec![],
            rest: vec![],
            left_out: (0.0, 0.0),
            phase_start: 0.0,
            leaves_out: [(0.0, 0.0); 2],
            sums: None,
            powers: None,
            values: Values::default(),
            counters: Counters::default(),
        }
    }

    /// The harmonic loads of each shape.
    fn loads(&self) -> Vec<Vec<&'a Harmonic>> {
        let all = &self.system.loads.harmonics;
        let of_shape = |p: &Pattern| p.loads.iter().map(|&k| &all[k]).collect();
        self.patterns.iter().map(of_shape).collect()
    }

    /// `‖x‖_M` of what a recurrence began with.
    fn size(&self, series: &Series) -> f64 {
        let square = self.system.mass_quadratic(self.recurrence.rows(), &series.terms(1)[0]);
        square.max(0.0).sqrt()
    }

    /// Go on in the same phase from elsewhere, displacements that do not move included.
    fn go_on(&mut self, t: f64, y: &[f64]) {
        self.start.copy_from_slice(y);
        self.end.copy_from_slice(y);
        (self.t0, self.t1) = (t, t);
        self.end_known = true;
    }

    /// The acceleration at the start of the window, without velocities.
    fn accelerate(&mut self, phase: &Phase) {
        let u0 = &self.start[..self.layout.n_o];
        if self.recurrence.rows().len() == u0.len() {
            phase.acceleration(self.t0, u0, &self.at_rest, &mut self.scratch, &mut self.a0);
        } else {
            let (scratch, a0) = (&mut self.scratch, &mut self.a0);
            self.recurrence.acceleration(phase, self.t0, u0, scratch, a0);
        }
        self.counters.products += 1;
    }

    /// End and terms of the next window.
    fn window_ahead(&mut self, t_limit: f64) -> (f64, Length) {
        let rest = t_limit - self.t0;
        let (shortest, longest) = FIRST;
        let mut r = self.length.unwrap_or_else(|| {
            // twice the last distance: most phases are over by then
            Lengths::below((2.0 * self.distance).clamp(shortest, longest), 2.0)
        });
        let vectors = (2 + self.patterns.len()) * self.layout.n_o;
        loop {
            let length = r / self.omega;
            let t = if length * 1.01 >= rest { t_limit } else { self.t0 + length };
            let needs = self.lengths.of(t - self.t0);
            if needs.terms * vectors <= MEMORY || r <= longest {
                self.length = Some((2.0 * r).min(LONGEST));
                return (t, needs);
            }
            r *= 0.5;
        }
    }

    /// All recurrences of the window, its sums and their errors.
    fn sum_up(&mut self, phase: &Phase, needs: &Length) {
        self.needs = Some(*needs);
        let terms = needs.terms;
        let n = self.layout.n_o;
        let moving = self.recurrence.rows();
        self.v.begin(&self.start[n..2 * n], moving.clone(), phase);
        self.a.begin(&self.a0, moving, phase);
        let rows = Rows { phase, forces: &self.forces, n_o: n };
        let (recurrence, scratch) = (&self.recurrence, &mut self.scratch);
        let both = [&mut self.v, &mut self.a];
        self.counters.products += extend(both, terms, recurrence, &rows, scratch);
        for p in &mut self.patterns {
            let one = [&mut p.series];
            self.counters.products += extend(one, terms, recurrence, &rows, scratch);
        }
        let (of_v, of_a) = (self.size(&self.v), self.size(&self.a));
        let load: f64 = self
            .patterns
            .iter()
            .zip(&self.sizes)
            .map(|(p, b)| {
                b * p.loads.iter().map(|&k| self.system.loads.harmonics[k].size()).sum::<f64>()
            })
            .sum();
        let value = needs.g * of_v + needs.p * (of_a + load);
        let rate = needs.rate * of_v + needs.g * of_a + needs.dp * load;
        self.rest = self.gradients.iter().map(|g| (g * value, g * rate)).collect();
        // errors of the recurrence grow with its length
        let t = self.t1 - self.t0;
        let rounding = rounding(t * self.omega);
        let by_loads = of_a + load;
        let rounded = (t * of_v + 0.5 * t * t * by_loads, of_v + t * by_loads);
        self.leaves_out = [(value, rate), (rounding * rounded.0, rounding * rounded.1)];
        let nodes = self.lengths.nodes(terms);
        let weights = self.series().map(|s| nodes.spread(s.moments(terms))).collect();
        self.sums = Some(RefCell::new(Sums::new(nodes, weights, self.t1 - self.t0)));
        self.powers = self.layout.dissipated.map(|_| {
            let nodes = self.lengths.nodes(2 * terms - 1);
            let vectors: Vec<&[Vec<f64>]> = [&self.v, &self.a]
                .into_iter()
                .chain(self.patterns.iter().map(|p| &p.series))
                .map(|s| s.terms(terms))
                .collect();
            Powers::new(self.system, nodes, &vectors)
        });
    }

    /// What the phase has left out up to the end of the window.
    fn left_out(&self) -> (f64, f64) {
        let Some(needs) = self.needs else { return self.left_out };
        let share = needs.share(self.t1 - self.t0);
        let [(u, v), rounded] = self.leaves_out;
        (self.left_out.0 + share * u + rounded.0, self.left_out.1 + share * v + rounded.1)
    }

    fn series(&self) -> impl Iterator<Item = &Series> {
        [&self.v, &self.a].into_iter().chain(self.patterns.iter().map(|p| &p.series))
    }

    /// The functions of displacement and velocity that go with `v₀`, `a₀` and each `b`, at the nodes.
    fn functions(&self, nodes: &Nodes, tau: f64) -> [Vec<Vec<f64>>; 2] {
        let f = nodes.functions(tau);
        let (mut u, mut v) = (vec![f.g.clone(), f.integral], vec![f.rate, f.g]);
        for loads in self.loads() {
            let [p, rate] = drive::responses(nodes, &loads, self.t0, tau);
            u.push(p);
            v.push(rate);
        }
        [u, v]
    }

    fn write_state(&self, t: f64, y: &mut [f64]) {
        let rows = self.recurrence.rows();
        self.layout.copy(&rows, &self.start, y);
        let Some(sums) = self.sums.as_ref().map(|s| s.borrow()) else { return };
        let nodes = &sums.nodes;
        let [u, v] = self.functions(nodes, t - self.t0);
        let n = self.layout.n_o;
        let (of_u, rest) = y.split_at_mut(n);
        let of_v = &mut rest[..n];
        of_v[rows.clone()].fill(0.0);
        let functions = u.iter().zip(&v);
        let share =
            |(series, (u, v)): (_, (&Vec<f64>, &Vec<f64>))| Share::new(series, nodes, [u, v]);
        let shares: Vec<Share> = self.series().zip(functions).map(share).collect();
        add_up(&shares, rows, of_u, of_v);
        let span = (self.t0, t - self.t0);
        if let Some(i) = self.layout.work {
            let first = self.h0.len();
            let harmonic = powers::work(nodes, &sums.weights, first, &self.loads(), span);
            y[i] += harmonic + self.drives.work(self.t0, t);
        }
        if let (Some(i), Some(powers)) = (self.layout.dissipated, &self.powers) {
            y[i] += powers.dissipated(&self.loads(), span);
        }
    }

    fn monitors_at(&self, t: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut h, mut rate) = (self.h0.clone(), vec![0.0; self.h0.len()]);
        if let Some(sums) = self.sums.as_ref().map(|s| s.borrow()) {
            let [u, v] = self.functions(&sums.nodes, t - self.t0);
            sums.along(&u, &mut h);
            sums.along(&v, &mut rate);
        }
        if !self.drives.is_empty() {
            for i in 0..h.len() {
                h[i] += self.drives.at(i, t, 0);
                rate[i] += self.drives.at(i, t, 1);
            }
        }
        (h, rate)
    }
}

impl Flow for Chebyshev<'_> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        (self.t0, self.t1) = (t, t);
        self.layout.copy(&self.recurrence.rows(), y, &mut self.end);
        self.end_known = true;
        if let Some(begun) = self.begun.replace(t) {
            self.distance = (t - begun) * self.omega;
        }
        self.length = None;
        self.needs = None;
        (self.left_out, self.phase_start) = ((0.0, 0.0), t);
        self.gradients = phase.gradient_bounds();
        self.drives = Drives::of(phase);
        let loads = &self.system.loads;
        (self.patterns, self.forces) = drive::patterns(loads, phase, &mut self.scratch);
        self.sizes = self.patterns.iter().map(|p| self.size(&p.series)).collect();
    }

    fn advance(&mut self, phase: &Phase, t_limit: f64) -> Result<(), FlowError> {
        if !self.omega.is_finite() {
            return Err(FlowError::NoBound);
        }
        // where the last window ended without an event, nobody has asked yet
        self.end_state();
        self.left_out = self.left_out();
        self.needs = None;
        self.t0 = self.t1;
        std::mem::swap(&mut self.start, &mut self.end);
        let (t, needs) = self.window_ahead(t_limit);
        if t <= self.t0 {
            return Err(FlowError::StepTooSmall { t: self.t0, h: t - self.t0 });
        }
        self.accelerate(phase);
        // the loads have their own sums
        for p in &self.patterns {
            let factor = |&k: &usize| self.system.loads.harmonics[k].factor(self.t0, 0);
            let factor: f64 = p.loads.iter().map(factor).sum();
            self.a0.iter_mut().zip(&p.series.terms(1)[0]).for_each(|(a, b)| *a -= factor * b);
        }
        self.h0.resize(phase.monitors.len(), 0.0);
        phase.monitor_undriven(&self.start[..self.layout.n_o], &[], &mut self.h0);
        self.cut(phase, t);
        self.sum_up(phase, &needs);
        self.values.clear();
        self.counters.steps += 1;
        // the recurrences carry whatever is not finite to their last terms
        let rows = self.recurrence.rows();
        let (start, n_o) = (&self.start, self.layout.n_o);
        let state = start[rows.clone()].iter().chain(&start[n_o..][rows.clone()]);
        let mut last = state.chain(self.series().flat_map(|s| &s.last()[rows.clone()]));
        match last.any(|x| !x.is_finite()) {
            true => Err(FlowError::NotFinite { t: self.t0 }),
            false => Ok(()),
        }
    }

    fn cut(&mut self, _: &Phase, t: f64) {
        self.t1 = t;
        self.end_known = false;
    }

    fn window(&self) -> (f64, f64) {
        (self.t0, self.t1)
    }

    fn end_state(&mut self) -> &[f64] {
        if !self.end_known {
            let mut end = std::mem::take(&mut self.end);
            self.write_state(self.t1, &mut end);
            self.end = end;
            self.end_known = true;
        }
        &self.end
    }

    fn state(&self, t: f64, y: &mut [f64]) {
        if t == self.t1 && self.end_known {
            self.layout.copy(&self.recurrence.rows(), &self.end, y);
        } else {
            self.write_state(t, y);
        }
    }

    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        let at = |t: f64| self.values.at(t, || self.monitors_at(t));
        let ends = |x: Rc<(Vec<f64>, Vec<f64>)>| (x.0[index], x.1[index]);
        let fourth = self.sums.as_ref().map_or(f64::NAN, |sums| {
            let span = (self.t0, a - self.t0);
            sums.borrow_mut().fourth(self.h0.len(), &self.loads(), span)[index]
        });
        let fourth = fourth + self.drives.bounds(index).1;
        let mut enclosure = Enclosure::hermite(ends(at(a)), ends(at(b)), b - a, fourth);
        let (value, rate) = self.rest[index];
        let share = self.needs.map_or(1.0, |needs| needs.share(b - self.t0));
        enclosure.error += share * value;
        enclosure.slope_error += share * rate * (b - a);
        enclosure
    }

    fn counters(&self) -> Counters {
        let rows = self.counters.products * self.recurrence.rows().len() as u64;
        Counters { rows, ..self.counters }
    }

    fn name(&self) -> &'static str {
        "chebyshev"
    }

    // theory §12, H1
    fn is_exact(&self) -> bool {
        true
    }

    /// What is beside the motion stays so far beside it, but for what its velocity makes of that.
    fn deviations(&self) -> Vec<f64> {
        let (u, v) = self.left_out();
        let time = (self.t1 - self.phase_start).min(1.0 / self.system.units.frequency);
        self.gradients.iter().map(|g| g * (u + time * v)).collect()
    }

    fn memory(&self) -> Vec<f64> {
        vec![self.distance, self.begun.unwrap_or(f64::NAN)]
    }

    fn recall(&mut self, memory: &[f64]) {
        if let &[distance, begun] = memory {
            (self.distance, self.begun) = (distance, Some(begun).filter(|t| !t.is_nan()));
        }
    }
}

#[cfg(test)]
mod tests;
