//! A motion through a given sequence of active sets, its tangent, and the switch conditions as equations (theory §8).
//!
//! The phases are `α_0, …, α_m`, the switching times `t_1 < … < t_m` are free. Inside a phase the state is known in closed form in
//! the phase's modes, `x(t) = φ_α(t; t_j, x_j)`, and its tangent is the homogeneous flow. A change of a switching time acts as
//! `δu̇ = (ü⁻ − ü⁺) δt_j` from that switch on. With `δt_j = −∇h_j δu / ḣ_j` this is the saltation matrix
//!
//! ```text
//! S_j = I + [0; ü⁺ − ü⁻] [∇h_j, 0] / ḣ_j
//! ```
//!
//! which diverges at grazing; with `t_j` as unknowns and `h_j = 0` as equations everything stays smooth. A phase that is entered and
//! left by one and the same node has the spurious solution of length zero; there the equation is the divided difference
//! `(h(t_{j+1}) − h(t_j)) / (t_{j+1} − t_j) = ∫₀¹ ḣ(t_j + s τ) ds = 0`.
//!
//! States are written in the *frame*: `z = (Ω q, q̇)` with the modal coordinates of the open phase, so that `½‖z‖²` is the energy of
//! a motion without contact and all unknowns are of one kind.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use nalgebra::Complex;

use super::saltation;
use crate::contact::State;
use crate::contact::{ActiveSet, System};
use crate::fem::FemError;
use crate::flow::drives::Drives;
use crate::flow::spectrum::{GAUSS10, Motion, Spectra, Spectrum};

/// Above this size orbits are shot without the modes of the phases.
const LARGE: usize = 800;

/// The sequence of active sets: `sets[j]` holds between event `j − 1` and event `j`; `nodes[j]` is the contact node whose monitor
/// reaches zero at event `j` (the first one where several switch at one time).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chain {
    /// Active sets, one more than events.
    pub sets: Vec<ActiveSet>,
    /// Contact node of each event.
    pub nodes: Vec<usize>,
}

impl Chain {
    /// Number of events.
    pub fn events(&self) -> usize {
        self.nodes.len()
    }

    /// Event `j` ends a phase that the same node began.
    pub fn is_pair(&self, j: usize) -> bool {
        j > 0 && self.nodes[j] == self.nodes[j - 1] && self.sets[j - 1] == self.sets[j + 1]
    }
}

/// From the modes of one active set to those of another.
type Transforms = HashMap<(ActiveSet, ActiveSet), Rc<Mat<f64>>>;

/// A body with the modes of its phases, ready to carry states and tangents through chains.
#[derive(Debug)]
pub struct Propagator {
    /// Operators.
    pub system: System,
    /// Modes of the phases met so far.
    pub spectra: Rc<Spectra>,
    /// Modes of the open phase.
    pub open: Rc<Spectrum>,
    /// `Ω`: its frequencies (those of rigid motions replaced by the body's unit of frequency).
    pub scale: Vec<f64>,
    open_set: ActiveSet,
    transforms: RefCell<Transforms>,
}

/// `A B`, on one thread: results must not depend on how many there are.
pub(super) fn product(a: MatRef<f64>, b: MatRef<f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(c.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

impl Propagator {
    /// Modes of the open phase of a body.
    pub fn new(system: System) -> Result<Propagator, FemError> {
        let spectra = Rc::new(Spectra::default());
        let open_set = ActiveSet::open(system.n_contact());
        let open = spectra.of_set(&system, &open_set)?;
        let unit = system.units.frequency;
        let scale = open.modes.iter().map(|m| if m.omega > 0.0 { m.omega } else { unit }).collect();
        let transforms = RefCell::default();
        Ok(Propagator { system, spectra, open, scale, open_set, transforms })
    }

    /// Number of displacements `u_O`.
    pub fn n(&self) -> usize {
        self.system.n_o()
    }

    /// Too large for the modes of every phase, and of the kind that needs none: undamped, under constant loads.
    pub fn is_large(&self) -> bool {
        self.n() > LARGE && self.system.is_conservative()
    }

    /// From modal coordinates of one set to those of another: `Φ_bᵀ M_b Φ_a`; none if they are the same.
    fn transform(
        &self,
        from: &ActiveSet,
        to: &ActiveSet,
    ) -> Result<Option<Rc<Mat<f64>>>, FemError> {
        if from == to {
            return Ok(None);
        }
        let key = (from.clone(), to.clone());
        if let Some(known) = self.transforms.borrow().get(&key) {
            return Ok(Some(known.clone()));
        }
        let a = self.spectra.of_set(&self.system, from)?;
        let b = self.spectra.of_set(&self.system, to)?;
        let new = Rc::new(product(b.inverse.as_ref(), a.shapes.as_ref()));
        self.transforms.borrow_mut().insert(key, new.clone());
        Ok(Some(new))
    }

    /// `x = (u_O, u̇_O)` of a frame vector `z` (length `2n`, or `n` for a state at rest).
    pub fn state(&self, z: &[f64]) -> State {
        let n = self.n();
        let mut q = vec![0.0; 2 * n];
        q[..z.len()].copy_from_slice(z);
        q[..n].iter_mut().zip(&self.scale).for_each(|(q, s)| *q /= s);
        let mut x = vec![0.0; 2 * n];
        self.open.from_modes(&q, &mut x);
        State { v: x.split_off(n), u: x }
    }

    /// The frame vector of a state.
    pub fn frame(&self, x: &State) -> Vec<f64> {
        let n = self.n();
        let both: Vec<f64> = x.u.iter().chain(&x.v).copied().collect();
        let mut z = vec![0.0; 2 * n];
        self.open.to_modes(&both, &mut z);
        z[..n].iter_mut().zip(&self.scale).for_each(|(q, s)| *q *= s);
        z
    }

    /// The frame vector at `t = 0` of the linear response of the open body to its harmonic and constant loads.
    pub fn linear_response(&self) -> Vec<f64> {
        let n = self.n();
        let mut z = vec![0.0; 2 * n];
        for (k, m) in self.open.modes.iter().enumerate() {
            let (mut q, mut v) = (0.0, 0.0);
            if m.omega > 0.0 {
                q += self.open.constant[k] / (m.omega * m.omega);
            }
            for (load, forces) in self.system.loads.harmonics.iter().zip(&self.open.harmonics) {
                let w = load.omega;
                let stiffness = Complex::new((m.omega - w) * (m.omega + w), 2.0 * m.c * w);
                let response = Complex::from_polar(forces[k], load.phase) / stiffness;
                q += response.re;
                v -= w * response.im;
            }
            (z[k], z[n + k]) = (self.scale[k] * q, v);
        }
        z
    }

    /// The rate of the frame vector at `t = 0` in the first phase of a chain.
    pub fn rate(&self, z: &[f64], chain: &Chain) -> Result<Vec<f64>, FemError> {
        let still = Chain { sets: vec![chain.sets[0].clone()], nodes: vec![] };
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
        let n = self.n();
        let mut x = Mat::zeros(n, 2);
        for (i, s) in self.scale.iter().enumerate() {
            x[(i, 0)] = z[i] / s;
            x[(i, 1)] = if z.len() > n { z[n + i] } else { 0.0 };
        }
        let mut place = &self.open_set;
        let mut links: Vec<Link> = vec![];
        let mut events = vec![];
        for (j, set) in chain.sets.iter().enumerate() {
            if let Some(t) = self.transform(place, set)? {
                x = product(t.as_ref().as_ref(), x.as_ref());
            }
            let spectrum = self.spectra.of_set(&self.system, set)?;
            let (a, b) = (
                if j == 0 { 0.0 } else { times[j - 1] },
                if j < times.len() { times[j] } else { end },
            );
            let link = Link::new(&self.system, spectrum, (a, b), &x);
            if let Some(previous) = links.last() {
                // ü⁻ − ü⁺ in the modes of the new phase
                let mut before = Mat::from_fn(n, 1, |i, _| previous.a1[i]);
                if let Some(t) = self.transform(place, set)? {
                    before = product(t.as_ref().as_ref(), before.as_ref());
                }
                let jump = (0..n).map(|i| before[(i, 0)] - link.a0[i]).collect();
                events.push(previous.event(chain, j - 1, jump, self.system.body.frequency_bound()));
            }
            x = Mat::from_fn(n, 2, |i, c| if c == 0 { link.q1[i] } else { link.v1[i] });
            links.push(link);
            place = set;
        }
        let mut last = Mat::from_fn(n, 3, |i, c| {
            let l = &links[links.len() - 1];
            [l.q1[i], l.v1[i], l.a1[i]][c]
        });
        if let Some(t) = self.transform(place, &self.open_set)? {
            last = product(t.as_ref().as_ref(), last.as_ref());
        }
        let frame = |u: usize, v: usize| -> Vec<f64> {
            let up = (0..n).map(|i| self.scale[i] * last[(i, u)]);
            up.chain((0..n).map(|i| last[(i, v)])).collect()
        };
        let (z_end, rate_end) = (frame(0, 1), frame(1, 2));
        Ok(Walk { links, events, z_end, rate_end })
    }

    /// Carry the columns of `start` (frame vectors, `2n` rows, or `n` for displacements only) along a walk.
    ///
    /// With `Switches::Saltation` the result is the derivative of the event-driven map. With `Switches::Free` one column a
    /// switching time is added at the right.
    pub fn tangent(
        &self,
        chain: &Chain,
        walk: &Walk,
        start: MatRef<f64>,
        switches: Switches,
    ) -> Result<Tangent, FemError> {
        let (n, given, m) = (self.n(), start.ncols(), chain.events());
        let free = switches == Switches::Free;
        let k = given + if free { m } else { 0 };
        // [Q | V] in the modes of the present phase
        let mut b = Mat::<f64>::zeros(n, 2 * k);
        for c in 0..given {
            for i in 0..n {
                b[(i, c)] = start[(i, c)] / self.scale[i];
                if start.nrows() > n {
                    b[(i, k + c)] = start[(n + i, c)];
                }
            }
        }
        let mut equations = Mat::<f64>::zeros(if free { m } else { 0 }, k);
        let mut place = &self.open_set;
        for (j, set) in chain.sets.iter().enumerate() {
            if let Some(t) = self.transform(place, set)? {
                b = product(t.as_ref().as_ref(), b.as_ref());
            }
            place = set;
            if j > 0 && free {
                let column = k + given + j - 1;
                for (i, &jump) in walk.events[j - 1].jump.iter().enumerate() {
                    b[(i, column)] += jump;
                }
            }
            let link = &walk.links[j];
            let event = walk.events.get(j);
            if let Some(e) = event.filter(|e| free && e.from_start) {
                e.row(&mut equations, j, &b, k);
            }
            link.carry(&mut b, k);
            let Some(e) = event else { continue };
            if free {
                if !e.from_start {
                    e.row(&mut equations, j, &b, k);
                }
                equations[(j, given + j)] += e.by_time;
                if j > 0 {
                    equations[(j, given + j - 1)] += e.by_last_time;
                }
            } else {
                let gradient = link.row(chain.nodes[j]);
                let slopes: Vec<f64> = (0..k).map(|c| dot(&gradient, b.col_as_slice(c))).collect();
                let next = &chain.sets[j + 1];
                if let Some(t) = self.transform(place, next)? {
                    b = product(t.as_ref().as_ref(), b.as_ref());
                }
                place = next;
                for (c, &slope) in slopes.iter().enumerate() {
                    saltation::pass(&e.jump, e.rate, slope, b.col_as_slice_mut(k + c));
                }
            }
        }
        if let Some(t) = self.transform(place, &self.open_set)? {
            b = product(t.as_ref().as_ref(), b.as_ref());
        }
        let end = Mat::from_fn(2 * n, k, |i, c| {
            if i < n { self.scale[i] * b[(i, c)] } else { b[(i - n, k + c)] }
        });
        Ok(Tangent { end, equations })
    }
}

/// How a tangent passes a switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Switches {
    /// The switch follows the state.
    Saltation,
    /// Switching times are variables of their own.
    Free,
}

/// Columns at the end of a chain, and the rows of the switch equations.
#[derive(Debug)]
pub struct Tangent {
    /// `2n × k`, frame vectors.
    pub end: Mat<f64>,
    /// `m × k`.
    pub equations: Mat<f64>,
}

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
    /// `u_O` at a time of the walk.
    pub fn displacement(&self, t: f64) -> Vec<f64> {
        let inside = self.links.iter().find(|l| t <= l.span.1);
        inside.or(self.links.last()).map_or(vec![], |l| l.displacement(t))
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
    q1: Vec<f64>,
    v1: Vec<f64>,
    a0: Vec<f64>,
    a1: Vec<f64>,
    h0: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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
        let mut h0 = spectrum.monitors(q0);
        h0.iter_mut().enumerate().for_each(|(i, h)| *h += drives.at(i, span.0, 0));
        Link { spectrum, motion, drives, span, q1, v1, a0, a1, h0 }
    }

    /// `∇h Φ` of a contact node's monitor in this phase.
    fn row(&self, node: usize) -> Vec<f64> {
        self.spectrum.rows.row(node).iter().copied().collect()
    }

    /// Monitor of a contact node and its rate at any time of the phase.
    pub fn monitor(&self, node: usize, t: f64) -> (f64, f64) {
        let n = self.spectrum.modes.len();
        let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
        self.motion.at(&self.spectrum, t, &mut q, &mut v);
        let r = self.row(node);
        let h = dot(&r, &q) + self.spectrum.offsets[node] + self.drives.at(node, t, 0);
        (h, dot(&r, &v) + self.drives.at(node, t, 1))
    }

    fn displacement(&self, t: f64) -> Vec<f64> {
        let n = self.spectrum.modes.len();
        let (mut both, mut v) = (vec![0.0; 2 * n], vec![0.0; n]);
        self.motion.at(&self.spectrum, t, &mut both[..n], &mut v);
        let mut x = vec![0.0; 2 * n];
        self.spectrum.from_modes(&both, &mut x);
        x.truncate(n);
        x
    }

    /// Carry tangent columns over the phase: the homogeneous flow of every mode.
    fn carry(&self, b: &mut Mat<f64>, k: usize) {
        let tau = self.span.1 - self.span.0;
        let basis: Vec<[f64; 4]> = self
            .spectrum
            .modes
            .iter()
            .map(|m| {
                let x = m.basis(tau);
                [x.c, x.s, -m.omega * m.omega * x.s, x.ds]
            })
            .collect();
        let (left, right) = b.as_mut().split_at_col_mut(k);
        for (q, v) in left.col_iter_mut().zip(right.col_iter_mut()) {
            for ((q, v), [c, s, ws, ds]) in q.iter_mut().zip(v.iter_mut()).zip(&basis) {
                (*q, *v) = (c * *q + s * *v, ws * *q + ds * *v);
            }
        }
    }

    /// The switch at the end of the phase.
    fn event(&self, chain: &Chain, j: usize, jump: Vec<f64>, frequency_bound: f64) -> Event {
        let node = chain.nodes[j];
        let r = self.row(node);
        let t = self.span.1;
        let h = dot(&r, &self.q1) + self.spectrum.offsets[node] + self.drives.at(node, t, 0);
        let rate = dot(&r, &self.v1) + self.drives.at(node, t, 1);
        let plain = Event {
            h,
            rate,
            equation: h,
            jump,
            from_start: false,
            by_u: r,
            by_v: vec![],
            by_time: rate,
            by_last_time: 0.0,
        };
        if chain.is_pair(j) { self.divided(plain, node, frequency_bound) } else { plain }
    }

    /// The divided difference of the monitor over the phase in place of its end value.
    fn divided(&self, plain: Event, node: usize, frequency_bound: f64) -> Event {
        let tau = self.span.1 - self.span.0;
        let modes = &self.spectrum.modes;
        let n = modes.len();
        let r = plain.by_u;
        let (mut by_u, mut by_v) = (vec![0.0; n], vec![0.0; n]);
        if frequency_bound * tau.abs() > 2.0 {
            for (i, m) in modes.iter().enumerate() {
                let x = m.basis(tau);
                (by_u[i], by_v[i]) = (r[i] * (x.c - 1.0) / tau, r[i] * x.s / tau);
            }
            let d = (plain.h - self.h0[node]) / tau;
            let start_rate = self.monitor(node, self.span.0).1;
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
                d += w * (dot(&r, &v) + self.drives.at(node, t, 1));
                let second = dot(&r, &a) + self.drives.at(node, t, 2);
                by_time += w * s * second;
                by_last_time += w * (1.0 - s) * second;
                for (i, m) in modes.iter().enumerate() {
                    let x = m.basis(s * tau);
                    by_u[i] -= w * r[i] * m.omega * m.omega * x.s;
                    by_v[i] += w * r[i] * x.ds;
                }
            }
        }
        Event { equation: d, from_start: true, by_u, by_v, by_time, by_last_time, ..plain }
    }
}

/// A switch of a walk: the monitor, its equation and the equation's derivatives.
#[derive(Debug)]
pub struct Event {
    /// Monitor at the switch.
    pub h: f64,
    /// Its rate before the switch.
    pub rate: f64,
    /// What must vanish: `h`, or its divided difference over the phase.
    pub equation: f64,
    /// `ü⁻ − ü⁺` in the modes of the next phase.
    jump: Vec<f64>,
    /// Whether `by_u`, `by_v` act on the state at the start of the phase (else at its end).
    from_start: bool,
    by_u: Vec<f64>,
    by_v: Vec<f64>,
    by_time: f64,
    by_last_time: f64,
}

impl Event {
    fn row(&self, equations: &mut Mat<f64>, j: usize, b: &Mat<f64>, k: usize) {
        for c in 0..k {
            let of_v =
                if self.by_v.is_empty() { 0.0 } else { dot(&self.by_v, b.col_as_slice(k + c)) };
            equations[(j, c)] = dot(&self.by_u, b.col_as_slice(c)) + of_v;
        }
    }
}
