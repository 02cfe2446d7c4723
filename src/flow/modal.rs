//! Exact flow by the modes of each active set (theory §6).
//!
//! In the eigenbasis of `(K_α, M_α)` a phase decouples, `q̈ + 2c q̇ + ω² q = F₀ + Σ_j F_j cos(Ω_j t + φ_j)` with `2c = α + βω²`, and each
//! coordinate is known at every time to rounding error: under- and over-damped, constant and harmonic loads
//! through resonance, rigid motions (`ω = 0`). Each monitor is a sum of known exponentials, so its fourth derivative is bounded by
//! `Σ_k |r_k| B_k`, and its cubic Hermite interpolant on `[a, b]` is a rigorous enclosure: `|h − H| ≤ max|h⁗| (b−a)⁴/384`,
//! `|h′ − H′| ≤ max|h⁗| (b−a)³ √3/216`. The length of a window follows the content of the motion, not the highest frequency.
//!
//! Phases are kept by active set.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::{Complex, DMatrix, DVector};

use super::trigonometry::sin_cos;
use super::{Bernstein, Counters, Enclosure, Flow, FlowError, Layout};
use crate::contact::{ActiveSet, Nbm, Phase};
use crate::fem::{FemError, eigen};

/// A harmonic load this near to a natural frequency, `|ω² − Ω² + 2icΩ|` over the larger square, is
/// treated by the response from rest, which has no small denominator.
const RESONANCE: f64 = 1e-2;

/// What one mode does in time: the solution basis of `q̈ + 2c q̇ + ω² q = 0`.
#[derive(Debug, Clone, Copy)]
struct Oscillator {
    omega: f64,
    c: f64,
}

/// `S` (unit initial velocity), `S′`, and `C = S′ + 2cS` (unit initial displacement).
#[derive(Debug, Clone, Copy)]
struct Basis {
    s: f64,
    ds: f64,
    c: f64,
}

impl Oscillator {
    /// `ω² − c²`: positive if the mode oscillates.
    fn discriminant(&self) -> f64 {
        (self.omega - self.c) * (self.omega + self.c)
    }

    fn basis(&self, t: f64) -> Basis {
        let Oscillator { omega, c } = *self;
        let d = self.discriminant();
        let x = d * t * t;
        let (s, ds) = if x.abs() < 1e-4 {
            // sin(√x)/√x and cos √x, for both signs of x, truncated below rounding
            let sinc = 1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0));
            let cos = 1.0 - x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0));
            let decay = (-c * t).exp();
            (decay * t * sinc, decay * (cos - c * t * sinc))
        } else if d > 0.0 {
            let w = d.sqrt();
            let (sin, cos) = (w * t).sin_cos();
            let decay = if c == 0.0 { 1.0 } else { (-c * t).exp() };
            (decay * sin / w, decay * (cos - c * sin / w))
        } else {
            let w = (-d).sqrt();
            // the slow rate without cancellation
            let (slow, fast) = (-omega * omega / (c + w), -(c + w));
            let (a, b) = ((slow * t).exp(), (fast * t).exp());
            ((a - b) / (2.0 * w), (slow * a - fast * b) / (2.0 * w))
        };
        Basis { s, ds, c: ds + 2.0 * c * s }
    }

    /// Response from rest to a unit constant force, and its rate (for `ω = 0`; else the static
    /// displacement serves).
    fn rigid_response(&self, t: f64) -> (f64, f64) {
        let s = self.basis(t).s;
        let x = 2.0 * self.c * t;
        let z = if x < 1e-3 {
            0.5 * t * t * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))
        } else {
            (t - s) / (2.0 * self.c)
        };
        (z, s)
    }

    /// The roots `λ±` of the characteristic equation.
    fn roots(&self) -> [Complex<f64>; 2] {
        let d = self.discriminant();
        if d >= 0.0 {
            let w = d.sqrt();
            [Complex::new(-self.c, w), Complex::new(-self.c, -w)]
        } else {
            let w = (-d).sqrt();
            let slow = -self.omega * self.omega / (self.c + w);
            [Complex::new(slow, 0.0), Complex::new(-self.c - w, 0.0)]
        }
    }

    /// Response from rest to `e^{iΩt}` and its rate: the divided difference of `e^{st}` at `iΩ, λ+, λ−`.
    fn response_from_rest(&self, omega: f64, t: f64) -> [Complex<f64>; 2] {
        let force = Complex::new(0.0, omega);
        let [near, far] = self.roots();
        let s = difference(near, far, t);
        let e = (difference(force, near, t) - s) / (force - far);
        [e, force * e + s]
    }
}

/// The divided difference `(e^{at} − e^{bt})/(a − b)`, exact for `a = b`.
fn difference(a: Complex<f64>, b: Complex<f64>, t: f64) -> Complex<f64> {
    let x = (a - b) * (0.5 * t);
    let sinhc = if x.norm() < 1e-2 {
        let y = x * x;
        Complex::new(1.0, 0.0)
            + y / 6.0 * (Complex::new(1.0, 0.0) + y / 20.0 * (Complex::new(1.0, 0.0) + y / 42.0))
    } else {
        x.sinh() / x
    };
    ((a + b) * (0.5 * t)).exp() * sinhc * t
}

/// One harmonic load on one mode.
#[derive(Debug, Clone, Copy)]
enum Forcing {
    /// Steady response `Re(P e^{iΩt})`.
    Steady(Complex<f64>),
    /// Force `F`: near resonance.
    FromRest(f64),
}

/// A harmonic load on all modes: `Ω`, `φ`, and for each mode `F_k` and how it is treated.
type ModalLoad = (f64, f64, Vec<(f64, Forcing)>);

/// The eigenbasis of one active set with its loads.
#[derive(Debug)]
struct ModalPhase {
    modes: Vec<Oscillator>,
    /// `Φ`: `u_O = Φ q`.
    shapes: Mat<f64>,
    /// `ΦᵀM_α`: `q = ΦᵀM_α u_O`.
    inverse: Mat<f64>,
    /// `F₀` of each mode.
    constant: Vec<f64>,
    /// Harmonic loads.
    harmonics: Vec<ModalLoad>,
    /// `r = ∇h Φ`, one row a monitor.
    rows: DMatrix<f64>,
    /// Monitors at `u_O = 0`.
    offsets: Vec<f64>,
    /// Undamped, under constant loads, without rigid motions.
    is_plain: bool,
}

impl ModalPhase {
    fn new(nbm: &Nbm, phase: &Phase) -> Result<Self, FemError> {
        let (k, m) = phase.matrices(nbm);
        let n = nbm.n_o();
        let all = eigen::all(&k, &m, nbm.body.frequency_unit())?;
        let (alpha, beta) = nbm.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
        let modes: Vec<Oscillator> = all
            .omega
            .iter()
            .map(|&omega| Oscillator { omega, c: 0.5 * (alpha + beta * omega * omega) })
            .collect();
        let shapes = Mat::from_fn(n, n, |i, j| all.shapes[j][i]);
        let mut inverse = Mat::<f64>::zeros(n, n);
        let mut column = vec![0.0; n];
        for (j, shape) in all.shapes.iter().enumerate() {
            m.mul(shape, &mut column);
            column.iter().enumerate().for_each(|(i, &x)| inverse[(j, i)] = x);
        }
        // modal forces: φᵀ A*ᵀ f
        let mut full = vec![0.0; nbm.n()];
        let mut projected = |f: &[f64]| -> Vec<f64> {
            all.shapes
                .iter()
                .map(|shape| {
                    phase.expand_velocity(nbm, shape, &mut full);
                    full.iter().zip(f).map(|(a, b)| a * b).sum()
                })
                .collect()
        };
        let zero = vec![0.0; n];
        let mut d = vec![0.0; nbm.n()];
        phase.expand_displacement(nbm, &zero, &mut d);
        let mut force = nbm.loads.constant.clone().unwrap_or_else(|| vec![0.0; nbm.n()]);
        nbm.body.stiffness.mul_sub(&d, &mut force);
        let constant = projected(&force);
        let harmonics = nbm
            .loads
            .harmonics
            .iter()
            .map(|load| {
                let treat = |(mode, f): (&Oscillator, f64)| {
                    let w = load.omega;
                    let (o, c) = (mode.omega, mode.c);
                    let denominator = Complex::new((o - w) * (o + w), 2.0 * c * w);
                    let near = denominator.norm() < RESONANCE * o.max(w).powi(2);
                    let forcing = if near {
                        Forcing::FromRest(f)
                    } else {
                        Forcing::Steady(Complex::new(f, 0.0) / denominator)
                    };
                    (f, forcing)
                };
                let forces = projected(&load.force);
                (load.omega, load.phase, modes.iter().zip(forces).map(treat).collect())
            })
            .collect();
        let count = phase.monitors.len();
        let mut rows = DMatrix::<f64>::zeros(count, n);
        for (j, shape) in all.shapes.iter().enumerate() {
            let h = phase.monitor_rates_at(nbm, shape);
            rows.column_mut(j).iter_mut().zip(&h).for_each(|(x, y)| *x = *y);
        }
        let offsets = phase.monitor_values_at(nbm, &zero);
        let is_plain =
            nbm.loads.harmonics.is_empty() && modes.iter().all(|m| m.c == 0.0 && m.omega > 0.0);
        Ok(ModalPhase { is_plain, modes, shapes, inverse, constant, harmonics, rows, offsets })
    }
}

/// `Y = A X` for the two columns of `X`, one after the other in memory.
fn product(a: &Mat<f64>, x: &[f64], y: &mut [f64]) {
    let n = a.ncols();
    let x = MatRef::from_column_major_slice(x, n, 2);
    let y = MatMut::from_column_major_slice_mut(y, a.nrows(), 2);
    matmul(y, Accum::Replace, a.as_ref(), x, 1.0, Par::Seq);
}

/// The motion of every mode since the start of the present phase.
#[derive(Debug, Default)]
struct Motion {
    /// Start of the phase.
    start: f64,
    /// Homogeneous part at the start: displacement and velocity.
    q: Vec<f64>,
    v: Vec<f64>,
}

impl Motion {
    /// Take out what the particular solutions have at the start.
    fn new(phase: &ModalPhase, start: f64, q: &[f64], v: &[f64]) -> Motion {
        let mut motion = Motion { start, q: q.to_vec(), v: v.to_vec() };
        for (k, mode) in phase.modes.iter().enumerate() {
            if mode.omega > 0.0 {
                motion.q[k] -= phase.constant[k] / (mode.omega * mode.omega);
            }
            for (w, phi, forces) in &phase.harmonics {
                if let Forcing::Steady(p) = forces[k].1 {
                    let e = p * Complex::from_polar(1.0, w * start + phi);
                    motion.q[k] -= e.re;
                    motion.v[k] -= (e * Complex::new(0.0, *w)).re;
                }
            }
        }
        motion
    }

    /// Displacement and velocity of mode `k` at `t`.
    fn mode(&self, phase: &ModalPhase, k: usize, t: f64) -> (f64, f64) {
        let mode = &phase.modes[k];
        let tau = t - self.start;
        let basis = mode.basis(tau);
        let mut q = self.q[k] * basis.c + self.v[k] * basis.s;
        let mut v = -self.q[k] * mode.omega * mode.omega * basis.s + self.v[k] * basis.ds;
        let f = phase.constant[k];
        if f != 0.0 {
            if mode.omega > 0.0 {
                q += f / (mode.omega * mode.omega);
            } else {
                let (z, dz) = mode.rigid_response(tau);
                q += f * z;
                v += f * dz;
            }
        }
        for (w, phi, forces) in &phase.harmonics {
            match forces[k].1 {
                Forcing::Steady(p) => {
                    let e = p * Complex::from_polar(1.0, w * t + phi);
                    q += e.re;
                    v += (e * Complex::new(0.0, *w)).re;
                }
                Forcing::FromRest(f) => {
                    let turn = Complex::from_polar(f, w * self.start + phi);
                    let [e, de] = mode.response_from_rest(*w, tau);
                    q += (turn * e).re;
                    v += (turn * de).re;
                }
            }
        }
        (q, v)
    }

    /// The free part of `q̇` after `a`, `Re(c e^{s (t − a)})`, for modes that oscillate under steady responses.
    fn oscillation(&self, phase: &ModalPhase, k: usize, a: f64, h: f64) -> Option<Term> {
        let mode = &phase.modes[k];
        let d = mode.discriminant();
        let steady = |h: &ModalLoad| matches!(h.2[k].1, Forcing::Steady(_));
        if d <= 0.01 * mode.omega * mode.omega || !phase.harmonics.iter().all(steady) {
            return None;
        }
        let [s, _] = mode.roots();
        let amplitude = Complex::new(self.q[k], -(self.v[k] + mode.c * self.q[k]) / d.sqrt());
        Some(Term { c: amplitude * s * (s * (a - self.start)).exp(), s, growth: (s * h).exp() })
    }

    /// Bounds of `|q|` and `|q⁗|` of the changing part of mode `k` from `t` to `end`.
    fn bounds(&self, phase: &ModalPhase, k: usize, t: f64, end: f64) -> (f64, f64) {
        let mode = &phase.modes[k];
        let Oscillator { omega, c } = *mode;
        let (tau, tau_end) = (t - self.start, end - self.start);
        let d = mode.discriminant();
        let (q, v) = (self.q[k].abs(), self.v[k].abs());
        let (mut size, mut fourth) = if omega == 0.0 {
            // v₀ (1 − e^{−2ct})/(2c): derivatives fall off
            let decay = (-2.0 * c * tau).exp();
            (q + v * tau_end, v * (2.0 * c).powi(3) * decay)
        } else if d > 0.25 * omega * omega {
            let w = d.sqrt();
            let amplitude = self.q[k].hypot((self.v[k] + c * self.q[k]) / w);
            let amplitude = if c > 0.0 { amplitude * (-c * tau).exp() } else { amplitude };
            (amplitude, amplitude * omega.powi(4))
        } else {
            // strongly damped: x = |q| + |q̇|/ω falls at least like 2 (1 + 1.2cτ) e^{−slow τ} and never exceeds
            // twice its first value; derivatives by the equation of motion, |q̈| ≤ ω²|q| + 2c|q̇| …
            let slow = if d > 0.0 { c } else { omega * omega / (c + (-d).sqrt()) };
            let decay = (2.0 * (1.0 + 1.2 * c * tau) * (-slow * tau).exp()).min(2.0);
            let x = (q + v / omega) * decay;
            let rate = 2.0 * c + omega;
            (x, x * rate.powi(4))
        };
        if phase.constant[k] != 0.0 && omega == 0.0 {
            let f = phase.constant[k].abs();
            size += 0.5 * f * tau_end * tau_end;
            fourth += f * (2.0 * c).powi(2);
        }
        for (w, _, forces) in &phase.harmonics {
            let (s, b) = match forces[k].1 {
                Forcing::Steady(p) => (p.norm(), p.norm() * w.powi(4)),
                Forcing::FromRest(f) => {
                    let f = f.abs();
                    let wd = d.abs().sqrt().max(1e-3 * omega);
                    let s = f * tau_end * (0.5 * tau_end).min(1.0 / wd);
                    let sum = w.powi(3) + w * w * omega + w * omega * omega + omega.powi(3);
                    (s, w.powi(4) * s + 2.0 * f * sum / wd)
                }
            };
            size += s;
            fourth += b;
        }
        (size, fourth)
    }
}

/// One exponential `c e^{s (t − a)}` with its growth `e^{s (b − a)}` over the interval.
#[derive(Debug, Clone, Copy)]
struct Term {
    c: Complex<f64>,
    s: Complex<f64>,
    growth: Complex<f64>,
}

/// `∫ Re(x) Re(y)` over an interval of length `h`: two exponentials, integrated exactly.
fn product_integral(x: &Term, y: &Term, h: f64) -> f64 {
    let integral = |s: Complex<f64>, growth: Complex<f64>| {
        let z = s * h;
        if z.norm_sqr() > 0.04 {
            return (growth - 1.0) / s;
        }
        // (e^z − 1)/z without cancellation
        let mut sum = Complex::new(1.0, 0.0);
        for n in (2..=11).rev() {
            sum = sum * z / f64::from(n) + 1.0;
        }
        sum * h
    };
    let plain = x.c * y.c * integral(x.s + y.s, x.growth * y.growth);
    let mixed = x.c * y.c.conj() * integral(x.s + y.s.conj(), x.growth * y.growth.conj());
    0.5 * (plain + mixed).re
}

/// `∫ F q̇` and `∫ q̇²` over an interval of length `h`, from the free part of `q̇` at its start.
fn powers_in_closed_form(
    free: &Term,
    phase: &ModalPhase,
    k: usize,
    turns: &[Term],
    h: f64,
) -> [f64; 2] {
    let steady = |j: usize| match phase.harmonics[j].2[k].1 {
        Forcing::Steady(p) => Term { c: turns[j].c * p * turns[j].s, ..turns[j] },
        Forcing::FromRest(_) => Term { c: Complex::new(0.0, 0.0), ..turns[j] },
    };
    let force = |j: usize| Term { c: turns[j].c * phase.harmonics[j].2[k].0, ..turns[j] };
    let mut sums = [0.0, product_integral(free, free, h)];
    for j in 0..turns.len() {
        let x = steady(j);
        sums[1] += 2.0 * product_integral(free, &x, h);
        sums[0] += product_integral(free, &force(j), h);
        for i in 0..turns.len() {
            sums[1] += product_integral(&x, &steady(i), h);
            sums[0] += product_integral(&x, &force(i), h);
        }
    }
    sums
}

/// Monitor values and slopes at one time.
type Values = (f64, Rc<(DVector<f64>, DVector<f64>)>);

/// The flow; see the module's text.
pub struct Modal<'a> {
    nbm: &'a Nbm,
    layout: Layout,
    cache: HashMap<ActiveSet, Rc<ModalPhase>>,
    phase: Option<Rc<ModalPhase>>,
    motion: Motion,
    t0: f64,
    t1: f64,
    end: Vec<f64>,
    end_known: bool,
    /// Work and dissipation at the start of the window.
    integrals: [f64; 2],
    /// The latest time in the window to which the powers were integrated, and their gain.
    integrated: Cell<(f64, [f64; 2])>,
    /// Bounds of the size and of the fourth derivative of each monitor in the window, and whether they hold
    /// for the whole phase.
    sizes: Vec<f64>,
    fourth: Vec<f64>,
    steady: bool,
    values: RefCell<Vec<Values>>,
    /// Angles, sines, cosines.
    work: RefCell<[Vec<f64>; 3]>,
    counters: Counters,
    failure: Option<FlowError>,
}

impl<'a> Modal<'a> {
    /// A flow without any phase yet.
    pub fn new(nbm: &'a Nbm) -> Self {
        let layout = Layout::new(nbm);
        Modal {
            nbm,
            layout,
            cache: HashMap::new(),
            phase: None,
            motion: Motion::default(),
            t0: 0.0,
            t1: 0.0,
            end: vec![0.0; layout.len()],
            end_known: true,
            integrals: [0.0; 2],
            integrated: Cell::new((0.0, [0.0; 2])),
            sizes: vec![],
            fourth: vec![],
            steady: false,
            values: RefCell::new(vec![]),
            work: RefCell::default(),
            counters: Counters::default(),
            failure: None,
        }
    }

    fn modal(&self) -> Option<&ModalPhase> {
        self.phase.as_deref()
    }

    /// Modal displacements and velocities at `t`.
    fn modes_at(&self, phase: &ModalPhase, t: f64) -> (DVector<f64>, DVector<f64>) {
        let n = phase.modes.len();
        let (mut q, mut v) = (DVector::zeros(n), DVector::zeros(n));
        if phase.is_plain {
            self.plain_modes_at(phase, t, q.as_mut_slice(), v.as_mut_slice());
        } else {
            for k in 0..n {
                (q[k], v[k]) = self.motion.mode(phase, k, t);
            }
        }
        (q, v)
    }

    /// The same where every mode is an undamped oscillation about a static displacement.
    fn plain_modes_at(&self, phase: &ModalPhase, t: f64, q: &mut [f64], v: &mut [f64]) {
        let mut work = self.work.borrow_mut();
        let [angle, sin, cos] = &mut *work;
        let n = phase.modes.len();
        [&mut *angle, &mut *sin, &mut *cos].into_iter().for_each(|x| x.resize(n, 0.0));
        let tau = t - self.motion.start;
        angle.iter_mut().zip(&phase.modes).for_each(|(x, m)| *x = m.omega * tau);
        sin_cos(angle, sin, cos);
        for k in 0..n {
            let w = phase.modes[k].omega;
            let (a, b) = (self.motion.q[k], self.motion.v[k]);
            q[k] = a * cos[k] + b / w * sin[k] + phase.constant[k] / (w * w);
            v[k] = b * cos[k] - a * w * sin[k];
        }
    }

    /// The state `(u_O, u̇_O)` at `t`.
    fn write_state(&self, phase: &ModalPhase, t: f64, y: &mut [f64]) {
        let n = self.layout.n_o;
        let (q, v) = self.modes_at(phase, t);
        // both at once: the shapes are read once
        let both: Vec<f64> = q.iter().chain(v.iter()).copied().collect();
        product(&phase.shapes, &both, &mut y[..2 * n]);
    }

    /// Monitor values and slopes at `t`, kept for the search in the window.
    fn monitors_at(&self, phase: &ModalPhase, t: f64) -> Rc<(DVector<f64>, DVector<f64>)> {
        let mut values = self.values.borrow_mut();
        if let Some((_, known)) = values.iter().find(|(s, _)| *s == t) {
            return known.clone();
        }
        let (q, v) = self.modes_at(phase, t);
        let mut h = &phase.rows * q;
        h.iter_mut().zip(&phase.offsets).for_each(|(h, c)| *h += c);
        let new = Rc::new((h, &phase.rows * v));
        values.push((t, new.clone()));
        new
    }

    /// The longest window whose enclosures are tight against the size of the monitors.
    fn window_length(&mut self, phase: &ModalPhase, t_limit: f64) -> f64 {
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
    fn bound_monitors(&mut self, phase: &ModalPhase, t_limit: f64) {
        let count = phase.offsets.len();
        (self.sizes, self.fourth) = (vec![0.0; count], vec![0.0; count]);
        for k in 0..phase.modes.len() {
            let (size, fourth) = self.motion.bounds(phase, k, self.t0, t_limit);
            for (i, r) in phase.rows.column(k).iter().enumerate() {
                self.sizes[i] += r.abs() * size;
                self.fourth[i] += r.abs() * fourth;
            }
        }
        // amplitudes stay what they are where nothing decays and nothing grows
        let forced_from_rest =
            |h: &ModalLoad| h.2.iter().any(|f| matches!(f.1, Forcing::FromRest(_)));
        self.steady = phase.modes.iter().all(|m| m.c == 0.0 && m.omega > 0.0)
            && !phase.harmonics.iter().any(forced_from_rest);
    }

    /// Work of harmonic loads and dissipation from `a` to `b`, mode by mode.
    fn integrate_powers(&self, phase: &ModalPhase, a: f64, b: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        if self.layout.work.is_none() && self.layout.dissipated.is_none() {
            return sums;
        }
        // e^{i(Ωa + φ)} of each harmonic load, and its growth over the interval
        let turn = |h: &ModalLoad| Term {
            c: Complex::from_polar(1.0, h.0 * a + h.1),
            s: Complex::new(0.0, h.0),
            growth: Complex::from_polar(1.0, h.0 * (b - a)),
        };
        let turns: Vec<Term> = phase.harmonics.iter().map(turn).collect();
        for (k, mode) in phase.modes.iter().enumerate() {
            let part = match self.motion.oscillation(phase, k, a, b - a) {
                Some(free) => powers_in_closed_form(&free, phase, k, &turns, b - a),
                None => self.powers_by_quadrature(phase, k, a, b),
            };
            sums[0] += part[0];
            sums[1] += 2.0 * mode.c * part[1];
        }
        sums
    }

    /// `∫ F q̇` and `∫ q̇²` by Gauss–Legendre, with as many points as the mode's frequency asks for: for modes
    /// that are not a sum of well separated exponentials.
    fn powers_by_quadrature(&self, phase: &ModalPhase, k: usize, a: f64, b: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        let mode = &phase.modes[k];
        let load = phase.harmonics.iter().map(|h| h.0).fold(0.0, f64::max);
        let parts = ((b - a) * (mode.omega + load).max(2.0 * mode.c) / 2.0).ceil().max(1.0);
        let h = (b - a) / parts;
        for j in 0..parts as usize {
            let left = a + j as f64 * h;
            for (x, weight) in GAUSS10 {
                for t in [left + 0.5 * h * (1.0 - x), left + 0.5 * h * (1.0 + x)] {
                    let (_, v) = self.motion.mode(phase, k, t);
                    let harmonics = phase.harmonics.iter();
                    let force: f64 =
                        harmonics.map(|(w, phi, f)| f[k].0 * (w * t + phi).cos()).sum();
                    sums[0] += 0.5 * h * weight * force * v;
                    sums[1] += 0.5 * h * weight * v * v;
                }
            }
        }
        sums
    }

    /// Gain of work and dissipation from the start of the window to `t`, going on from the last time asked for.
    fn gain(&self, phase: &ModalPhase, t: f64) -> [f64; 2] {
        let (from, known) = match self.integrated.get() {
            (from, known) if self.t0 <= from && from <= t => (from, known),
            // back to the start of the window: the end was asked for before the samples
            _ => (self.t0, [0.0; 2]),
        };
        let more = self.integrate_powers(phase, from, t);
        let gain = [known[0] + more[0], known[1] + more[1]];
        self.integrated.set((t, gain));
        gain
    }

    /// Set the end of the window; the state there is computed when it is asked for.
    fn set_end(&mut self, t: f64) {
        self.t1 = t;
        self.end_known = false;
        let Some(phase) = self.phase.clone() else { return };
        let gain = self.gain(&phase, t);
        let mut end = std::mem::take(&mut self.end);
        self.write_integrals(gain, &mut end);
        self.end = end;
    }

    fn write_integrals(&self, gain: [f64; 2], y: &mut [f64]) {
        if let Some(i) = self.layout.work {
            y[i] = self.integrals[0] + gain[0];
        }
        if let Some(i) = self.layout.dissipated {
            y[i] = self.integrals[1] + gain[1];
        }
    }
}

/// Positive nodes and weights of the 10-point Gauss–Legendre rule on [−1, 1].
const GAUSS10: [(f64, f64); 5] = [
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

impl Flow for Modal<'_> {
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]) {
        (self.t0, self.t1) = (t, t);
        self.end.copy_from_slice(y);
        self.end_known = true;
        self.values.borrow_mut().clear();
        self.failure = None;
        self.steady = false;
        let modal = match self.cache.get(&phase.set) {
            Some(known) => known.clone(),
            None => match ModalPhase::new(self.nbm, phase) {
                Ok(new) => {
                    self.counters.factorisations += 1;
                    let new = Rc::new(new);
                    self.cache.insert(phase.set.clone(), new.clone());
                    new
                }
                Err(_) => {
                    self.failure = Some(FlowError::NoModes { t });
                    return;
                }
            },
        };
        let n = self.layout.n_o;
        let mut both = vec![0.0; 2 * n];
        product(&modal.inverse, &y[..2 * n], &mut both);
        self.motion = Motion::new(&modal, t, &both[..n], &both[n..]);
        self.phase = Some(modal);
    }

    fn advance(&mut self, _: &Phase, t_limit: f64) -> Result<(), FlowError> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let Some(modal) = self.phase.clone() else { return Err(FlowError::NoModes { t: self.t1 }) };
        self.t0 = self.t1;
        let value = |i: Option<usize>| i.map_or(0.0, |i| self.end[i]);
        self.integrals = [value(self.layout.work), value(self.layout.dissipated)];
        self.integrated.set((self.t0, [0.0; 2]));
        let last = self.values.borrow().iter().find(|(t, _)| *t == self.t0).cloned();
        *self.values.borrow_mut() = last.into_iter().collect();
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
        if let (false, Some(phase)) = (self.end_known, self.phase.clone()) {
            let mut end = std::mem::take(&mut self.end);
            self.write_state(&phase, self.t1, &mut end);
            self.end = end;
            self.end_known = true;
        }
        &self.end
    }

    fn state(&self, t: f64, y: &mut [f64]) {
        if t == self.t1 && self.end_known {
            y.copy_from_slice(&self.end);
        } else if let Some(phase) = self.modal() {
            self.write_state(phase, t, y);
            self.write_integrals(self.gain(phase, t), y);
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
        let (at_a, at_b) = (self.monitors_at(phase, a), self.monitors_at(phase, b));
        let ends = |x: &Rc<(DVector<f64>, DVector<f64>)>| (x.0[index], x.1[index]);
        Enclosure::hermite(ends(&at_a), ends(&at_b), b - a, self.fourth[index])
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn name(&self) -> &'static str {
        "modal"
    }

    fn is_exact(&self) -> bool {
        true
    }
}
