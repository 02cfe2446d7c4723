//! The eigenbasis of one active set, and the motion of its modes in closed form (theory §6).
//!
//! In the eigenbasis of `(K_α, M_α)` a phase decouples, `q̈ + 2c q̇ + ω² q = F₀ + Σ_j F_j cos(Ω_j t + φ_j)` with `2c = α + βω²`, and each
//! coordinate is known at every time to rounding error: under- and over-damped, constant and harmonic loads
//! through resonance, rigid motions (`ω = 0`). The basis does not depend on the frequencies of the loads.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::{Complex, DMatrix};

use super::drives::Drives;
use super::trigonometry::sin_cos;
use crate::contact::{ActiveSet, Drive, Phase, System};
use crate::fem::{FemError, Harmonic, Loads, eigen};

/// Positive nodes and weights of the 10-point Gauss–Legendre rule on [−1, 1].
pub const GAUSS10: [(f64, f64); 5] = [
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

/// A harmonic load this near to a natural frequency, `|ω² − Ω² + 2icΩ|` over the larger square, is
/// treated by the response from rest, which has no small denominator.
const RESONANCE: f64 = 1e-2;

/// What one mode does in time: the solution basis of `q̈ + 2c q̇ + ω² q = 0`.
#[derive(Debug, Clone, Copy)]
pub struct Oscillator {
    /// Undamped circular frequency.
    pub omega: f64,
    /// Half the damping rate.
    pub c: f64,
}

/// `S` (unit initial velocity), `S′`, and `C = S′ + 2cS` (unit initial displacement).
#[derive(Debug, Clone, Copy)]
pub struct Basis {
    /// `S`
    pub s: f64,
    /// `S′`
    pub ds: f64,
    /// `C`
    pub c: f64,
}

impl Oscillator {
    /// `ω² − c²`: positive if the mode oscillates.
    pub fn discriminant(&self) -> f64 {
        (self.omega - self.c) * (self.omega + self.c)
    }

    /// The basis at `t`.
    pub fn basis(&self, t: f64) -> Basis {
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
pub(super) enum Forcing {
    /// Steady response `Re(P e^{iΩt})`.
    Steady(Complex<f64>),
    /// Force `F`: near resonance.
    FromRest(f64),
}

/// A harmonic load on all modes: `Ω`, `φ`, and for each mode `F_k` and how it is treated.
pub(super) type ModalLoad = (f64, f64, Vec<(f64, Forcing)>);

/// The eigenbasis of one active set with its loads.
#[derive(Debug)]
pub struct Spectrum {
    /// The modes, lowest first.
    pub modes: Vec<Oscillator>,
    /// `Φ`: `u_O = Φ q`.
    pub shapes: Mat<f64>,
    /// `ΦᵀM_α`: `q = ΦᵀM_α u_O`.
    pub inverse: Mat<f64>,
    /// `F₀` of each mode.
    pub constant: Vec<f64>,
    /// Modal forces of each harmonic load.
    pub harmonics: Vec<Vec<f64>>,
    /// `r = ∇h Φ`, one row a monitor (in the order of the contact nodes).
    pub rows: DMatrix<f64>,
    /// Monitors at `u_O = 0`.
    pub offsets: Vec<f64>,
    /// What harmonic loads on `u_C` add to the monitors, at the frequencies of the time when this was made.
    drives: Vec<Drive>,
    /// Undamped, without rigid motions.
    is_undamped: bool,
}

impl Spectrum {
    /// The eigensolution of a phase without held nodes.
    pub fn new(system: &System, phase: &Phase) -> Result<Self, FemError> {
        let (k, m) = phase.matrices();
        let n = system.n_o();
        let all = eigen::all(&k, &m, system.units.frequency)?;
        let (alpha, beta) = system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
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
        let projected = |f: &[f64]| -> Vec<f64> {
            all.shapes.iter().map(|x| x.iter().zip(f).map(|(a, b)| a * b).sum()).collect()
        };
        let constant = projected(&phase.constant_force());
        let harmonics =
            system.loads.harmonics.iter().map(|h| projected(&phase.reduce(&h.force))).collect();
        let count = phase.monitors.len();
        let mut rows = DMatrix::<f64>::zeros(count, n);
        for (j, shape) in all.shapes.iter().enumerate() {
            let h = phase.monitor_gradient_at(shape);
            rows.column_mut(j).iter_mut().zip(&h).for_each(|(x, y)| *x = *y);
        }
        let offsets = phase.monitor_offsets();
        let is_undamped = modes.iter().all(|m| m.c == 0.0 && m.omega > 0.0);
        let drives = phase.drives().to_vec();
        Ok(Spectrum {
            drives,
            is_undamped,
            modes,
            shapes,
            inverse,
            constant,
            harmonics,
            rows,
            offsets,
        })
    }

    /// How each mode answers the harmonic loads at their present frequencies.
    fn excitation(&self, loads: &Loads) -> Vec<ModalLoad> {
        let of_load = |(load, forces): (&Harmonic, &Vec<f64>)| {
            let treat = |(mode, &f): (&Oscillator, &f64)| {
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
            (load.omega, load.phase, self.modes.iter().zip(forces).map(treat).collect())
        };
        loads.harmonics.iter().zip(&self.harmonics).map(of_load).collect()
    }

    /// What harmonic loads on `u_C` add to the monitors, at their present frequencies.
    pub fn drives(&self, loads: &Loads) -> Drives {
        let mut drives = self.drives.clone();
        drives.iter_mut().for_each(|d| d.load = loads.harmonics[d.index].clone());
        Drives(drives)
    }

    /// Values of all monitors at modal displacements `q`, without drives.
    pub fn monitors(&self, q: &[f64]) -> Vec<f64> {
        let mut h = self.offsets.clone();
        for (k, q) in q.iter().enumerate() {
            h.iter_mut().zip(self.rows.column(k).iter()).for_each(|(h, r)| *h += r * q);
        }
        h
    }

    /// `q = ΦᵀM_α u`, `q̇ = ΦᵀM_α v`: `x` and the result hold displacements, then velocities.
    pub fn to_modes(&self, x: &[f64], q: &mut [f64]) {
        product(&self.inverse, x, q);
    }

    /// `u = Φ q`, `v = Φ q̇`, likewise.
    pub fn from_modes(&self, q: &[f64], x: &mut [f64]) {
        product(&self.shapes, q, x);
    }
}

/// `Y = A X` for the two columns of `X`, one after the other in memory.
fn product(a: &Mat<f64>, x: &[f64], y: &mut [f64]) {
    let n = a.ncols();
    let x = MatRef::from_column_major_slice(x, n, 2);
    let y = MatMut::from_column_major_slice_mut(y, a.nrows(), 2);
    matmul(y, Accum::Replace, a.as_ref(), x, 1.0, Par::Seq);
}

/// The spectra of the phases of one body, computed when they are first asked for.
#[derive(Debug, Default)]
pub struct Spectra {
    known: RefCell<HashMap<ActiveSet, Rc<Spectrum>>>,
    computed: Cell<u64>,
}

impl Spectra {
    /// The spectrum of a phase.
    pub fn of(&self, system: &System, phase: &Phase) -> Result<Rc<Spectrum>, FemError> {
        if let Some(known) = self.known.borrow().get(&phase.set) {
            return Ok(known.clone());
        }
        let new = Rc::new(Spectrum::new(system, phase)?);
        self.computed.set(self.computed.get() + 1);
        self.known.borrow_mut().insert(phase.set.clone(), new.clone());
        Ok(new)
    }

    /// The spectrum of an active set.
    pub fn of_set(&self, system: &System, set: &ActiveSet) -> Result<Rc<Spectrum>, FemError> {
        if let Some(known) = self.known.borrow().get(set) {
            return Ok(known.clone());
        }
        self.of(system, &system.phase(set))
    }

    /// Number of eigensolutions so far.
    pub fn computed(&self) -> u64 {
        self.computed.get()
    }
}

/// The motion of every mode since the start of the present phase.
#[derive(Debug, Default)]
pub struct Motion {
    /// Start of the phase.
    pub(super) start: f64,
    pub(super) loads: Vec<ModalLoad>,
    /// Homogeneous part at the start: displacement and velocity.
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
}

impl Motion {
    /// The motion that starts at `(q, q̇)`: what the particular solutions have at the start is taken out.
    pub fn new(phase: &Spectrum, loads: &Loads, start: f64, q: &[f64], v: &[f64]) -> Motion {
        let loads = phase.excitation(loads);
        let mut motion = Motion { start, loads, q: q.to_vec(), v: v.to_vec() };
        for (k, mode) in phase.modes.iter().enumerate() {
            if mode.omega > 0.0 {
                motion.q[k] -= phase.constant[k] / (mode.omega * mode.omega);
            }
            for (w, phi, forces) in &motion.loads {
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
    pub fn mode(&self, phase: &Spectrum, k: usize, t: f64) -> (f64, f64) {
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
        for (w, phi, forces) in &self.loads {
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

    /// Displacements and velocities of all modes at `t`.
    pub fn at(&self, phase: &Spectrum, t: f64, q: &mut [f64], v: &mut [f64]) {
        if !(phase.is_undamped && self.loads.is_empty()) {
            for k in 0..q.len() {
                (q[k], v[k]) = self.mode(phase, k, t);
            }
            return;
        }
        // every mode is an undamped oscillation about a static displacement
        let n = phase.modes.len();
        let tau = t - self.start;
        let angle: Vec<f64> = phase.modes.iter().map(|m| m.omega * tau).collect();
        let (mut sin, mut cos) = (vec![0.0; n], vec![0.0; n]);
        sin_cos(&angle, &mut sin, &mut cos);
        for k in 0..n {
            let w = phase.modes[k].omega;
            let (a, b) = (self.q[k], self.v[k]);
            q[k] = a * cos[k] + b / w * sin[k] + phase.constant[k] / (w * w);
            v[k] = b * cos[k] - a * w * sin[k];
        }
    }

    /// Accelerations of all modes at `t`, where they are at `(q, q̇)`: `F − 2c q̇ − ω² q`.
    pub fn acceleration(&self, phase: &Spectrum, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) {
        for (k, m) in phase.modes.iter().enumerate() {
            a[k] = phase.constant[k] - 2.0 * m.c * v[k] - m.omega * m.omega * q[k];
            for (w, phi, forces) in &self.loads {
                a[k] += forces[k].0 * (w * t + phi).cos();
            }
        }
    }

    /// The free part of `q̇` after `a`, `Re(c e^{s (t − a)})`, for modes that oscillate under steady responses.
    pub(super) fn oscillation(&self, phase: &Spectrum, k: usize, a: f64, h: f64) -> Option<Term> {
        let mode = &phase.modes[k];
        let d = mode.discriminant();
        let steady = |h: &ModalLoad| matches!(h.2[k].1, Forcing::Steady(_));
        if d <= 0.01 * mode.omega * mode.omega || !self.loads.iter().all(steady) {
            return None;
        }
        let [s, _] = mode.roots();
        let amplitude = Complex::new(self.q[k], -(self.v[k] + mode.c * self.q[k]) / d.sqrt());
        Some(Term { c: amplitude * s * (s * (a - self.start)).exp(), s, growth: (s * h).exp() })
    }

    /// Bounds of `|q|` and `|q⁗|` of the changing part of mode `k` from `t` to `end`.
    pub(super) fn bounds(&self, phase: &Spectrum, k: usize, t: f64, end: f64) -> (f64, f64) {
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
        for (w, _, forces) in &self.loads {
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
pub(super) struct Term {
    pub c: Complex<f64>,
    pub s: Complex<f64>,
    pub growth: Complex<f64>,
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
pub(super) fn powers_in_closed_form(
    free: &Term,
    loads: &[ModalLoad],
    k: usize,
    turns: &[Term],
    h: f64,
) -> [f64; 2] {
    let steady = |j: usize| match loads[j].2[k].1 {
        Forcing::Steady(p) => Term { c: turns[j].c * p * turns[j].s, ..turns[j] },
        Forcing::FromRest(_) => Term { c: Complex::new(0.0, 0.0), ..turns[j] },
    };
    let force = |j: usize| Term { c: turns[j].c * loads[j].2[k].0, ..turns[j] };
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
