//! A state carried through a chain of phases in closed form, and the conditions at its switches as equations (theory §8).
//!
//! A phase that is entered and left by one and the same node has the spurious solution of length zero; there the equation is the divided
//! difference `(h(t_{j+1}) − h(t_j)) / (t_{j+1} − t_j) = ∫₀¹ ḣ(t_j + s τ) ds = 0`.

use std::rc::Rc;

use faer::Mat;
use nalgebra::{Complex, DMatrix};

use super::chain::{Chain, Jump, Propagator};
use super::parameter::Parameter;
use crate::contact::{Phase, PointState, State, States, System, leading};
use crate::continuation::dot;
use crate::fem::dense::product;
use crate::fem::{FemError, Loads};
use crate::flow::drives::Drives;
use crate::flow::motion::Motion;
use crate::flow::oscillator::GAUSS10;
use crate::flow::spectrum::Spectrum;

impl Propagator {
    /// The rate of the frame vector at `t = 0` in the first phase of a chain.
    pub fn rate(&self, z: &[f64], chain: &Chain) -> Result<Vec<f64>, FemError> {
        let still = Chain { sets: vec![chain.sets[0].clone()], points: vec![], struck: vec![] };
        Ok(self.walk(&still, z, &[], 0.0)?.rate_end)
    }

    /// The state carried through a chain, from the frame vector `z` at `t = 0` to `end`.
    pub fn walk(
        &self,
        chain: &Chain,
        z: &[f64],
        times: &[f64],
        end: f64,
    ) -> Result<Walk, FemError> {
        self.through(chain, z, &[], (times, end))
    }

    /// The phases of a chain that begin with states from elsewhere, each to its end: `states`, one a phase. The walk does not hang together where these
    /// are of no motion, and its tangent is the product of the flows of the phases, with the saltation between them.
    pub(crate) fn walk_beside(
        &self,
        chain: &Chain,
        states: &[State],
        times: &[f64],
        end: f64,
    ) -> Result<Walk, FemError> {
        self.through(chain, &self.frame(&states[0]), states, (times, end))
    }

    /// A chain from the frame vector `z` on; phases of which the state is `given` begin there.
    fn through(
        &self,
        chain: &Chain,
        z: &[f64],
        given: &[State],
        (times, end): (&[f64], f64),
    ) -> Result<Walk, FemError> {
        let n = self.n();
        let mut x = Mat::zeros(n, 2);
        for (i, s) in self.scale.iter().enumerate() {
            x[(i, 0)] = z[i] / s + self.at_rest[i];
            x[(i, 1)] = if z.len() > n { z[n + i] } else { 0.0 };
        }
        // what springs remember does not drift
        self.home.frozen().for_each(|i| x[(i, 1)] = 0.0);
        let mut place = &self.home_set;
        let mut links: Vec<Link> = vec![];
        let mut events = vec![];
        for (j, set) in chain.sets.iter().enumerate() {
            if let Some(passed) = self.passed(place, set, x.as_ref())? {
                x = passed;
            }
            let blow = if j > 0 { self.blow(chain, j - 1)? } else { None };
            let mut slowed = vec![];
            if let Some(blow) = &blow {
                let after = blow.act(x.subcols(1, 1));
                slowed = (0..n).map(|i| x[(i, 1)] - after[(i, 0)]).collect();
                x.subcols_mut(1, 1).copy_from(&after);
            }
            let spectrum = self.spectra.of_set(&self.system, set)?;
            let modal = |state: &State| {
                let both: Vec<f64> = state.u.iter().chain(&state.v).copied().collect();
                let mut modal = vec![0.0; 2 * n];
                spectrum.to_modes(&both, &mut modal);
                Mat::from_fn(n, 2, |i, c| modal[c * n + i])
            };
            if let Some(state) = given.get(j) {
                x = modal(state);
            }
            // both sides of a switch are seen from one state
            let end_given = given.get(j + 1).map(modal);
            spectrum.remember(&self.system, place, (&mut x, 1), true);
            if spectrum.creeps() {
                if let Some(previous) = links.last() {
                    slowed = spectrum.slides(&previous.spectrum, x.col_as_slice(1));
                    spectrum.anchor(&previous.spectrum, (&mut x, 1), true);
                }
                spectrum.ride(&mut x, 1..2, true);
            }
            let (a, b) = (
                if j == 0 { 0.0 } else { times[j - 1] },
                if j < times.len() { times[j] } else { end },
            );
            let mut link = Link::new(&self.system, spectrum, (a, b), &x);
            if let Some(x) = end_given {
                link.end_at(&x);
            }
            if let Some(previous) = links.last() {
                // ü⁻ − ü⁺ in the modes of the new phase
                let mut before = Mat::from_fn(n, 1, |i, _| previous.a1[i]);
                if let Some(passed) = self.passed(place, set, before.as_ref())? {
                    before = passed;
                }
                if let Some(blow) = &blow {
                    before = blow.act(before.as_ref());
                }
                let jump = (0..n).map(|i| before[(i, 0)] - link.a0[i]).collect();
                let bound = self.system.frequency_bound();
                events.push(Event { slowed, blow, ..previous.event(chain, j - 1, jump, bound) });
            }
            x = Mat::from_fn(n, 2, |i, c| if c == 0 { link.q1[i] } else { link.v1[i] });
            links.push(link);
            place = set;
        }
        let l = &links[links.len() - 1];
        let mut last = Mat::from_fn(n, 3, |i, c| [l.q1[i], l.v1[i], l.a1[i]][c]);
        // displacements and their rates, then velocities and theirs
        let (mut of_end, mut of_rate) = ([0, 1], [1, 2]);
        if l.spectrum.creeps() {
            let columns = [&l.q1, &l.v1, &l.v1, &l.a1];
            last = Mat::from_fn(n, 4, |i, c| columns[c][i]);
            (of_end, of_rate) = ([0, 2], [1, 3]);
            let mut rates = last.subcols(1, 1).to_owned();
            l.spectrum.anchor(&l.spectrum, (&mut last, 1), true);
            l.spectrum.anchor(&l.spectrum, (&mut rates, 1), false);
            last.col_as_slice_mut(1).copy_from_slice(rates.col_as_slice(0));
        }
        if let Some(passed) = self.passed(place, &self.home_set, last.as_ref())? {
            last = passed;
        }
        let frame = |[u, v]: [usize; 2], rest: &[f64]| -> Vec<f64> {
            let from = |i: usize| rest.get(i).copied().unwrap_or(0.0);
            let up = (0..n).map(|i| self.scale[i] * (last[(i, u)] - from(i)));
            up.chain((0..n).map(|i| last[(i, v)])).collect()
        };
        let (z_end, rate_end) = (frame(of_end, &self.at_rest), frame(of_rate, &[]));
        Ok(Walk { links, events, z_end, rate_end })
    }
}

/// Phase that the fastest mode and the fastest load go through together in a panel: ten Gauss–Legendre nodes integrate `e^{ix}` over 6 to 4·10⁻¹⁵.
const PANEL: f64 = 6.0;

/// What damping has made smaller by `e⁻³⁷` is gone.
const GONE: f64 = 37.0;

/// Step of central differences by the frequency of the loads, relative.
const RETUNE: f64 = 1e-6;

/// A state carried through a chain.
#[derive(Debug)]
pub struct Walk {
    /// One link a phase.
    pub links: Vec<Link>,
    /// One event a switch.
    pub events: Vec<Event>,
    /// Frame vector at the end.
    pub z_end: Vec<f64>,
    /// Its rate.
    pub rate_end: Vec<f64>,
}

impl Walk {
    /// `∮ u̇ᵀMu̇ dt`
    pub(crate) fn squared_speed(&self) -> f64 {
        self.links.iter().map(Link::squared_speed).sum()
    }

    /// `u_O` at a time of the walk.
    pub fn displacement(&self, t: f64) -> Vec<f64> {
        self.state(t).map_or(vec![], |(_, u, _)| u)
    }

    /// The phase of a time of the walk, `u_O` and `u̇_O` there; at a switch those before it.
    pub fn state(&self, t: f64) -> Option<(usize, Vec<f64>, Vec<f64>)> {
        let inside = self.links.iter().position(|l| t <= l.span.1);
        let k = inside.or(self.links.len().checked_sub(1))?;
        let (u, v) = self.links[k].state(t);
        Some((k, u, v))
    }
}

/// One phase of a walk.
#[derive(Debug)]
pub struct Link {
    spectrum: Rc<Spectrum>,
    motion: Motion,
    drives: Drives,
    /// Start and end.
    pub span: (f64, f64),
    q0: Vec<f64>,
    v0: Vec<f64>,
    q1: Vec<f64>,
    v1: Vec<f64>,
    a0: Vec<f64>,
    a1: Vec<f64>,
}

impl Link {
    fn new(system: &System, spectrum: Rc<Spectrum>, span: (f64, f64), x: &Mat<f64>) -> Link {
        let n = spectrum.modes.len();
        let (q0, v0) = (x.col_as_slice(0), x.col_as_slice(1));
        let motion = Motion::new(&spectrum, &system.loads, span.0, q0, v0);
        let [mut q1, mut v1, mut a0, mut a1] = [0; 4].map(|_| vec![0.0; n]);
        motion.acceleration(&spectrum, span.0, q0, v0, &mut a0);
        motion.at(&spectrum, span.1, &mut q1, &mut v1);
        motion.acceleration(&spectrum, span.1, &q1, &v1, &mut a1);
        let drives = spectrum.drives(&system.loads);
        let (q0, v0) = (q0.to_vec(), v0.to_vec());
        Link { spectrum, motion, drives, span, q0, v0, q1, v1, a0, a1 }
    }

    /// Let the phase end at another state than the motion from its start comes to.
    fn end_at(&mut self, x: &Mat<f64>) {
        self.q1.copy_from_slice(x.col_as_slice(0));
        self.v1.copy_from_slice(x.col_as_slice(1));
        self.motion.acceleration(&self.spectrum, self.span.1, &self.q1, &self.v1, &mut self.a1);
    }

    /// Which monitor of the phase it is through which a point leaves to the state `to`.
    pub(crate) fn leading(&self, point: usize, to: PointState) -> usize {
        // every contact point has one
        leading(&self.spectrum.monitors, point, to).unwrap_or(0)
    }

    /// Where the modes are at a time of the phase: `q`, `q̇`, and `q̈` where a monitor knows velocities.
    fn modes_at(&self, t: f64) -> [Vec<f64>; 3] {
        let n = self.spectrum.modes.len();
        let [mut q, mut v, mut a] = [0; 3].map(|_| vec![0.0; n]);
        self.motion.at(&self.spectrum, t, &mut q, &mut v);
        if self.spectrum.velocity_rows.is_some() {
            self.motion.acceleration(&self.spectrum, t, &q, &v, &mut a);
        }
        [q, v, a]
    }

    /// Monitor `k` and its rate where the modes are at `(q, q̇, q̈)`.
    fn monitor_of(&self, k: usize, t: f64, [q, v, a]: [&[f64]; 3]) -> (f64, f64) {
        let [r, rho] = self.spectrum.row(k);
        let h = dot(&r, q) + dot(&rho, v) + self.spectrum.offsets[k] + self.drives.at(k, t, 0);
        (h, dot(&r, v) + dot(&rho, a) + self.drives.at(k, t, 1))
    }

    /// Monitor `k` and its rate at any time of the phase.
    pub fn monitor(&self, k: usize, t: f64) -> (f64, f64) {
        let [q, v, a] = self.modes_at(t);
        self.monitor_of(k, t, [&q, &v, &a])
    }

    /// The rates of all monitors at any time of the phase.
    pub(super) fn monitor_rates(&self, t: f64) -> Vec<f64> {
        let [_, v, a] = self.modes_at(t);
        let mut rates: Vec<f64> =
            (0..self.spectrum.offsets.len()).map(|k| self.drives.at(k, t, 1)).collect();
        let mut add = |rows: &DMatrix<f64>, x: &[f64]| {
            for (k, x) in x.iter().enumerate() {
                rates.iter_mut().zip(rows.column(k).iter()).for_each(|(h, r)| *h += r * x);
            }
        };
        add(&self.spectrum.rows, &v);
        self.spectrum.velocity_rows.iter().for_each(|rows| add(rows, &a));
        rates
    }

    /// `∇h δx` of monitor `k` for columns `[Q | V]`, `columns` of each.
    pub(super) fn slopes(&self, k: usize, b: &Mat<f64>, columns: usize) -> Vec<f64> {
        let [r, rho] = self.spectrum.row(k);
        let of = |c| dot(&r, b.col_as_slice(c)) + dot(&rho, b.col_as_slice(columns + c));
        (0..columns).map(of).collect()
    }

    /// Columns of perturbations on the way into the phase from another: [`Spectrum::remember`].
    pub(super) fn remember(&self, system: &System, before: &States, b: &mut Mat<f64>, k: usize) {
        self.spectrum.remember(system, before, (b, k), false);
    }

    /// Columns of perturbations on the way into the phase from another, or, from itself, at the end of a motion: [`Spectrum::anchor`].
    pub(super) fn anchor(&self, before: &Link, b: &mut Mat<f64>, k: usize) {
        self.spectrum.anchor(&before.spectrum, (b, k), false);
    }

    /// Columns on the way into the phase: [`Spectrum::hold`]; what only remembers has no velocity.
    pub(super) fn hold(&self, b: &mut Mat<f64>, k: usize) {
        self.spectrum.ride(b, k..2 * k, false);
        self.spectrum.hold(b, k);
    }

    /// The contact point of each monitor of the phase, and the state that it leads to.
    pub(super) fn leads(&self) -> impl Iterator<Item = (usize, PointState)> {
        self.spectrum.monitors.iter().map(|m| (m.point, m.to))
    }

    /// `u_O` and `u̇_O` at a time of the phase.
    pub(super) fn state(&self, t: f64) -> (Vec<f64>, Vec<f64>) {
        let n = self.spectrum.modes.len();
        let mut modal = vec![0.0; 2 * n];
        let (q, v) = modal.split_at_mut(n);
        self.motion.at(&self.spectrum, t, q, v);
        let mut x = vec![0.0; 2 * n];
        self.spectrum.state_of_modes(&modal, &mut x);
        let v = x.split_off(n);
        (x, v)
    }

    /// `∫ f̂ᴴu e^{−iωt} dt` over the phase, of all displacements `u` with what contact displacements are counted from.
    pub(super) fn harmonic(
        &self,
        system: &System,
        phase: &Phase,
        (force, omega): (&[Complex<f64>], f64),
    ) -> Complex<f64> {
        let mut sum = Complex::default();
        let mut full = vec![0.0; system.n()];
        for (left, h) in self.panels() {
            for (x, weight) in GAUSS10.into_iter().flat_map(|(x, w)| [(-x, w), (x, w)]) {
                let t = left + 0.5 * h * (1.0 + x);
                phase.expand_displacement(t, &self.state(t).0, &mut full);
                system.loads.carried.add_contact(t, 0, &mut full);
                let along: Complex<f64> = force.iter().zip(&full).map(|(f, u)| f.conj() * *u).sum();
                sum += along * Complex::from_polar(0.5 * h * weight, -omega * t);
            }
        }
        sum
    }

    /// Carry tangent columns over the phase: the homogeneous flow of every mode, under the damping `C + αM`.
    pub(super) fn carry(&self, b: &mut Mat<f64>, k: usize, alpha: f64) -> Result<(), FemError> {
        self.spectrum.carry(b, k, self.span.1 - self.span.0, alpha)
    }

    /// Add to a tangent column what the phase itself gives to `∂/∂α` of a body that is fed by `−αM u̇`.
    pub(super) fn feed(&self, b: &mut Mat<f64>, k: usize, column: usize) {
        let (q, v) = self.motion.by_mass_damping(&self.spectrum, self.span.1);
        b.col_as_slice_mut(column).iter_mut().zip(&q).for_each(|(b, q)| *b -= q);
        b.col_as_slice_mut(k + column).iter_mut().zip(&v).for_each(|(b, v)| *b -= v);
    }

    /// Add to a tangent column what the phase itself gives to `∂/∂ω`, the frequency of all harmonic loads: central differences of the closed form, from
    /// the same start.
    pub(super) fn retune(&self, loads: &Loads, b: &mut Mat<f64>, k: usize, column: usize) {
        let Some(omega) = loads.harmonics.first().map(|h| h.omega) else { return };
        let h = RETUNE * omega;
        let end = |shift: f64| {
            let mut loads = loads.clone();
            loads.set_frequency(omega + shift);
            let motion = Motion::new(&self.spectrum, &loads, self.span.0, &self.q0, &self.v0);
            let mut x = vec![0.0; 2 * self.q0.len()];
            let (q, v) = x.split_at_mut(self.q0.len());
            motion.at(&self.spectrum, self.span.1, q, v);
            x
        };
        let (up, down) = (end(h), end(-h));
        let change: Vec<f64> = up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * h)).collect();
        let (of_q, of_v) = change.split_at(self.q0.len());
        b.col_as_slice_mut(column).iter_mut().zip(of_q).for_each(|(b, x)| *b += x);
        b.col_as_slice_mut(k + column).iter_mut().zip(of_v).for_each(|(b, x)| *b += x);
    }

    /// `∂h/∂ω` of monitor `k` at the end of the phase, at a fixed state: what the loads on `u_C` give.
    pub(super) fn monitor_by_frequency(&self, k: usize) -> f64 {
        self.drives.by_frequency(k, self.span.1)
    }

    /// Add to the last tangent column what the phase itself gives to `∂/∂p`: of a motion that starts where it starts,
    ///
    /// ```text
    /// δ(t₁) = ∫ Φ(t₁ − t) (0, ΦᵀM_α ∂ü_O/∂p (t, u_O(t), u̇_O(t))) dt
    /// ```
    ///
    /// with the homogeneous flow `Φ`, by Gauss–Legendre panels that are short against the fastest mode: the error is that of rounding.
    pub(super) fn vary(
        &self,
        p: &Parameter,
        set: &States,
        b: &mut Mat<f64>,
        k: usize,
    ) -> Result<(), FemError> {
        let source = p.source(self.span, || self.source(p, set))?;
        for (column, of) in [(k - 1, 0), (2 * k - 1, 1)] {
            let added = source.col_as_slice(of).iter();
            b.col_as_slice_mut(column).iter_mut().zip(added).for_each(|(b, x)| *b += x);
        }
        Ok(())
    }

    /// The integral of [`Self::vary`]: displacements, velocities.
    fn source(&self, p: &Parameter, set: &States) -> Result<Mat<f64>, FemError> {
        let spectrum = &self.spectrum;
        let n = spectrum.modes.len();
        let mut sum = Mat::zeros(n, 2);
        for (left, h) in self.panels() {
            let middle = left + 0.5 * h;
            let nodes = GAUSS10.iter().flat_map(|&(x, w)| [(-x, w), (x, w)]);
            let (times, weights): (Vec<f64>, Vec<f64>) =
                nodes.map(|(x, w)| (middle + 0.5 * h * x, 0.5 * h * w)).unzip();
            let m = times.len();
            let [mut q, mut v] = [0; 2].map(|_| vec![0.0; m * n]);
            self.motion.at_times(spectrum, &times, &mut q, &mut v);
            let modal = Mat::from_fn(n, 2 * m, |i, c| match c < m {
                true => q[c * n + i],
                false => v[(c - m) * n + i],
            });
            let states = product(spectrum.shapes.as_ref(), modal.as_ref());
            let columns = |from: usize| -> Vec<f64> {
                (from..from + m).flat_map(|c| states.col_as_slice(c)).copied().collect()
            };
            let change = p.accelerations(set, &times, [&columns(0), &columns(m)]);
            let change = Mat::from_fn(n, m, |i, c| change[c * n + i]);
            let change = product(spectrum.inverse.as_ref(), change.as_ref());
            for c in 0..m {
                let mut x = Mat::zeros(n, 2);
                for i in 0..n {
                    x[(i, 1)] = weights[c] * change[(i, c)];
                }
                spectrum.carry(&mut x, 1, self.span.1 - times[c], 0.0)?;
                sum += &x;
            }
        }
        Ok(sum)
    }

    /// Count the last tangent column from where the phase holds displacements, which moves with a parameter (`sign = −1`), or from where it was counted before: what is held does not
    /// swing about it.
    pub(super) fn count_from_holds(
        &self,
        p: &Parameter,
        set: &States,
        b: &mut Mat<f64>,
        k: usize,
        sign: f64,
    ) {
        for (j, by) in p.holds(set) {
            let unit = self.spectrum.inverse.col_as_slice(j).iter();
            let column = b.col_as_slice_mut(k - 1).iter_mut();
            column.zip(unit).for_each(|(b, x)| *b += sign * by * x);
        }
    }

    /// Panels of the phase, start and width, in which the fastest that the motion still does and the fastest that the flow to the end still knows go through no more than
    /// [`PANEL`] together: what damping takes away is a matter of the beginning, and of the end.
    fn panels(&self) -> Vec<(f64, f64)> {
        let (start, end) = self.span;
        let rates = self.spectrum.rates();
        // the fastest of what is left after a time
        let fastest = |after: f64| {
            let left = rates.iter().filter(|(_, decay)| decay * after < GONE);
            left.map(|r| r.0).fold(self.motion.load_rate(), f64::max)
        };
        let mut all = vec![];
        let mut x = start;
        while x < end || all.is_empty() {
            let done = fastest(x - start);
            let turned = |h: f64| h * (done + fastest((end - x - h).max(0.0)));
            let mut h = end - x;
            while turned(h) > PANEL {
                h *= 0.7;
            }
            all.push((x, h));
            // what is left over is rounding
            x = if end - x - h <= 1e-14 * end.abs() { end } else { x + h };
        }
        all
    }

    /// `∂h/∂p` of monitor `k` at the end of the phase, at a fixed state.
    pub(super) fn monitor_by(&self, p: &Parameter, set: &States, k: usize) -> f64 {
        let (u, v) = self.state(self.span.1);
        p.monitor(set, k, self.span.1, [&u, &v])
    }

    /// Add to the last tangent column what a parameter changes of a state on the way from this phase into the next: the blow of an impact, and what springs remember that begin
    /// to stick at the limits of their sliders.
    pub(super) fn pass_on(
        &self,
        p: &Parameter,
        (before, struck): (&States, &[usize]),
        next: &Link,
        system: &System,
        b: &mut Mat<f64>,
        k: usize,
    ) {
        let mut add = |column: usize, change: &[f64]| {
            let change = Mat::from_fn(change.len(), 1, |i, _| change[i]);
            let modal = product(next.spectrum.inverse.as_ref(), change.as_ref());
            let modal = modal.col_as_slice(0).iter();
            b.col_as_slice_mut(column).iter_mut().zip(modal).for_each(|(b, x)| *b += x);
        };
        if !struck.is_empty() {
            let (_, v) = self.state(self.span.1);
            add(2 * k - 1, &p.impulse(before, struck, &v));
        }
        let sticking = next.spectrum.begin_to_stick(system, before);
        if !sticking.is_empty() {
            let elongations = p.elongations(before);
            let mut change = vec![0.0; next.spectrum.modes.len()];
            for (memory, sigma, slider) in sticking {
                change[memory] -= sigma * elongations[slider];
            }
            add(k - 1, &change);
        }
    }

    fn squared_speed(&self) -> f64 {
        self.motion.squared_speed(&self.spectrum, self.span.0, self.span.1)
    }

    /// The switch at the end of the phase.
    fn event(&self, chain: &Chain, j: usize, jump: Vec<f64>, frequency_bound: f64) -> Event {
        let point = chain.points[j];
        let monitor = self.leading(point, chain.sets[j + 1].at(point));
        let [by_u, by_v] = self.spectrum.row(monitor);
        let at = [&self.q1[..], &self.v1, &self.a1];
        let (h, rate) = self.monitor_of(monitor, self.span.1, at);
        let plain = Event {
            monitor,
            h,
            rate,
            equation: h,
            jump,
            from_start: false,
            slowed: vec![],
            blow: None,
            by_u,
            by_v,
            by_time: rate,
            by_last_time: 0.0,
        };
        // a rate of velocities is no difference of them: switching times of friction are no unknowns
        let rubs = self.spectrum.velocity_rows.is_some() || !self.spectrum.frozen().is_empty();
        let is_divided = chain.is_pair(j) && !rubs;
        if is_divided { self.divided(plain, frequency_bound) } else { plain }
    }

    /// The divided difference of the monitor over the phase in place of its end value.
    fn divided(&self, plain: Event, frequency_bound: f64) -> Event {
        let tau = self.span.1 - self.span.0;
        let n = self.spectrum.modes.len();
        let k = plain.monitor;
        let r = plain.by_u;
        let (mut by_u, mut by_v) = (vec![0.0; n], vec![0.0; n]);
        if frequency_bound * tau.abs() > 2.0 {
            let [of_q, of_v, ..] = self.spectrum.row_carried(&r, tau);
            for i in 0..n {
                (by_u[i], by_v[i]) = ((of_q[i] - r[i]) / tau, of_v[i] / tau);
            }
            // from the state itself: to evaluate the motion at its start would round it
            let offset = self.spectrum.offsets[k];
            let start = self.q0.iter().zip(&r).fold(offset, |h, (q, r)| h + r * q)
                + self.drives.at(k, self.span.0, 0);
            let start_rate = self.monitor(k, self.span.0).1;
            let d = (plain.h - start) / tau;
            return Event {
                equation: d,
                from_start: true,
                by_u,
                by_v,
                by_time: (plain.rate - d) / tau,
                by_last_time: (d - start_rate) / tau,
                ..plain
            };
        }
        // short against every mode: the mean of the rate by quadrature
        let (mut d, mut by_time, mut by_last_time) = (0.0, 0.0, 0.0);
        let [mut q, mut v, mut a] = [0; 3].map(|_| vec![0.0; n]);
        for (x, weight) in GAUSS10 {
            for s in [0.5 * (1.0 - x), 0.5 * (1.0 + x)] {
                let (t, w) = (self.span.0 + s * tau, 0.5 * weight);
                self.motion.at(&self.spectrum, t, &mut q, &mut v);
                self.motion.acceleration(&self.spectrum, t, &q, &v, &mut a);
                d += w * (dot(&r, &v) + self.drives.at(k, t, 1));
                let second = dot(&r, &a) + self.drives.at(k, t, 2);
                by_time += w * s * second;
                by_last_time += w * (1.0 - s) * second;
                let [_, _, of_q, of_v] = self.spectrum.row_carried(&r, s * tau);
                for i in 0..n {
                    by_u[i] += w * of_q[i];
                    by_v[i] += w * of_v[i];
                }
            }
        }
        Event { equation: d, from_start: true, by_u, by_v, by_time, by_last_time, ..plain }
    }
}

/// A switch of a walk: the monitor, its equation and the equation's derivatives.
#[derive(Debug)]
pub struct Event {
    /// Which monitor of the phase before it reaches zero.
    pub(super) monitor: usize,
    /// Its value at the switch.
    pub h: f64,
    /// Its rate before the switch.
    pub rate: f64,
    /// What must vanish: `h`, or its divided difference over the phase.
    pub equation: f64,
    /// `R ü⁻ − ü⁺` in the modes of the next phase.
    pub(super) jump: Vec<f64>,
    /// `u̇⁻ − u̇⁺` there, and the jump `R` of velocities, if there is one.
    pub(super) slowed: Vec<f64>,
    pub(super) blow: Option<Jump>,
    /// Whether `by_u`, `by_v` act on the state at the start of the phase (else at its end).
    pub(super) from_start: bool,
    by_u: Vec<f64>,
    by_v: Vec<f64>,
    pub(super) by_time: f64,
    pub(super) by_last_time: f64,
}

impl Event {
    pub(super) fn row(&self, equations: &mut Mat<f64>, j: usize, b: &Mat<f64>, k: usize) {
        for c in 0..k {
            let of_v =
                if self.by_v.is_empty() { 0.0 } else { dot(&self.by_v, b.col_as_slice(k + c)) };
            equations[(j, c)] = dot(&self.by_u, b.col_as_slice(c)) + of_v;
        }
    }
}
