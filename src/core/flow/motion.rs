//! The motion of all modes of a phase in closed form (theory §6): free vibration about static, rigid and harmonic responses, with bounds of its
//! fourth derivative and exact integrals of its powers.

use nalgebra::{Complex, DMatrix};

use super::exponential::{Term, product_integral};
use super::oscillator::{Basis, GAUSS10, Oscillator};
use super::sliding::SlidingMotion;
use super::spectrum::Spectrum;
use super::trigonometry::{exponentials, sin_cos};
use crate::fem::{Harmonic, Loads};

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

/// How each mode answers the harmonic loads at their present frequencies.
fn excitation(phase: &Spectrum, loads: &Loads) -> Vec<ModalLoad> {
    let of_load = |(load, forces): (&Harmonic, &Vec<f64>)| {
        let treat = |(mode, &f): (&Oscillator, &f64)| {
            let f = load.size() * f;
            (f, mode.steady(load.omega).map_or(Forcing::FromRest(f), |p| Forcing::Steady(p * f)))
        };
        (load.omega, load.angle(), phase.modes.iter().zip(forces).map(treat).collect())
    };
    loads.harmonics.iter().zip(&phase.harmonics).map(of_load).collect()
}

/// `Ω`, the angle at `t` and the size of each harmonic load.
pub(super) fn angles(loads: &Loads, t: f64) -> Vec<(f64, f64, f64)> {
    loads.harmonics.iter().map(|h| (h.omega, h.omega * t + h.angle(), h.size())).collect()
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
    /// Of a phase whose modes do not decouple it; `Ω`, angle at the start and size of the loads.
    coupled: Option<SlidingMotion>,
    angles: Vec<(f64, f64, f64)>,
}

impl Motion {
    /// The motion that starts at `(q, q̇)`: what the particular solutions have at the start is taken out.
    pub fn new(phase: &Spectrum, loads: &Loads, start: f64, q: &[f64], v: &[f64]) -> Motion {
        if let Some(coupling) = &phase.coupling {
            let angles = angles(loads, start);
            let coupled = SlidingMotion::new(coupling, q, v, &angles);
            let lost = coupled.is_none();
            // what has no steady response is no number: the flow reports it
            let v = if lost { vec![f64::NAN; v.len()] } else { v.to_vec() };
            return Motion { start, loads: vec![], q: q.to_vec(), v, coupled, angles };
        }
        let loads = excitation(phase, loads);
        let (q, v) = (q.to_vec(), v.to_vec());
        let mut motion = Motion { start, loads, q, v, coupled: None, angles: vec![] };
        for (k, mode) in phase.modes.iter().enumerate() {
            if mode.omega > 0.0 {
                motion.q[k] -= phase.steady_force[k] / (mode.omega * mode.omega);
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

    /// The largest circular frequency of the loads.
    pub(crate) fn load_rate(&self) -> f64 {
        let loads = self.loads.iter().map(|l| l.0).chain(self.angles.iter().map(|a| a.0));
        loads.fold(0.0, f64::max)
    }

    /// `e^{i(Ωt + φ)}` of each harmonic load.
    fn turned(&self, t: f64) -> Vec<Complex<f64>> {
        self.loads.iter().map(|(w, phi, _)| Complex::from_polar(1.0, w * t + phi)).collect()
    }

    /// Displacement and velocity of mode `k` at `t`, with its solution basis and the turned loads there.
    fn mode(
        &self,
        phase: &Spectrum,
        k: usize,
        t: f64,
        basis: &Basis,
        turned: &[Complex<f64>],
    ) -> (f64, f64) {
        let mode = &phase.modes[k];
        let tau = t - self.start;
        let mut q = self.q[k] * basis.c + self.v[k] * basis.s;
        let mut v = -self.q[k] * mode.omega * mode.omega * basis.s + self.v[k] * basis.ds;
        let f = phase.steady_force[k];
        if f != 0.0 {
            if mode.omega > 0.0 {
                q += f / (mode.omega * mode.omega);
            } else {
                let [z, dz] = mode.response_from_rest(0.0, tau);
                q += f * z.re;
                v += f * dz.re;
            }
        }
        for ((w, phi, forces), turned) in self.loads.iter().zip(turned) {
            match forces[k].1 {
                Forcing::Steady(p) => {
                    let e = p * turned;
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
        self.at_times(phase, &[t], q, v);
    }

    /// The same at some times, one behind the other.
    pub fn at_times(&self, phase: &Spectrum, times: &[f64], q: &mut [f64], v: &mut [f64]) {
        if let (Some(coupling), Some(motion)) = (&phase.coupling, &self.coupled) {
            // the shapes are read once
            let taus: Vec<f64> = times.iter().map(|t| t - self.start).collect();
            return motion.at(coupling, &taus, q, v);
        }
        let n = phase.modes.len().max(1);
        let columns = q.chunks_exact_mut(n).zip(v.chunks_exact_mut(n));
        times.iter().zip(columns).for_each(|(t, (q, v))| self.decoupled(phase, *t, q, v));
    }

    /// The same of modes that do not know of each other, at one time.
    fn decoupled(&self, phase: &Spectrum, t: f64, q: &mut [f64], v: &mut [f64]) {
        let n = phase.modes.len();
        let tau = t - self.start;
        let undamped = phase.is_undamped && self.loads.is_empty();
        let angle: Vec<f64> = match undamped {
            true => phase.modes.iter().map(|m| m.omega * tau).collect(),
            false => phase.modes.iter().map(|m| m.discriminant().max(0.0).sqrt() * tau).collect(),
        };
        let (mut sin, mut cos) = (vec![0.0; n], vec![0.0; n]);
        sin_cos(&angle, &mut sin, &mut cos);
        if !undamped {
            let turned = self.turned(t);
            let rates: Vec<f64> = phase.modes.iter().map(|m| -m.c * tau).collect();
            let mut decayed = vec![0.0; n];
            exponentials(&rates, &mut decayed);
            for k in 0..n {
                let basis = phase.modes[k].basis_of(tau, (sin[k], cos[k], decayed[k]));
                (q[k], v[k]) = self.mode(phase, k, t, &basis, &turned);
            }
            return;
        }
        // every mode is an undamped oscillation about a static displacement
        for k in 0..n {
            let w = phase.modes[k].omega;
            let (a, b) = (self.q[k], self.v[k]);
            q[k] = a * cos[k] + b / w * sin[k] + phase.steady_force[k] / (w * w);
            v[k] = b * cos[k] - a * w * sin[k];
        }
    }

    /// Accelerations of all modes at `t`, where they are at `(q, q̇)`: `F − 2c q̇ − ω² q`.
    pub fn acceleration(&self, phase: &Spectrum, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) {
        if let Some(coupling) = &phase.coupling {
            let mut force = phase.steady_force.clone();
            for ((w, angle, size), shape) in self.angles.iter().zip(&phase.harmonics) {
                let c = size * (w * (t - self.start) + angle).cos();
                force.iter_mut().zip(shape).for_each(|(f, s)| *f += c * s);
            }
            return coupling.acceleration(q, v, &force, a);
        }
        for (k, m) in phase.modes.iter().enumerate() {
            a[k] = phase.steady_force[k] - 2.0 * m.c * v[k] - m.omega * m.omega * q[k];
            for (w, phi, forces) in &self.loads {
                a[k] += forces[k].0 * (w * t + phi).cos();
            }
        }
    }

    /// The free part of `q̇` after `a`, a sum of two `Re(c e^{s (t − a)})`, for modes with well separated roots under steady responses.
    fn free(&self, phase: &Spectrum, k: usize, a: f64, h: f64) -> Option<[Term; 2]> {
        let steady = |h: &ModalLoad| matches!(h.2[k].1, Forcing::Steady(_));
        if !self.loads.iter().all(steady) {
            return None;
        }
        let free = phase.modes[k].free((self.q[k], self.v[k]), a - self.start, h)?;
        Some(free.map(|term| Term { c: term.c * term.s, ..term }))
    }

    /// `e^{i(Ωa + φ)}` of each harmonic load, and its growth up to `b`.
    pub(super) fn turns(&self, a: f64, b: f64) -> Vec<Term> {
        let turn = |h: &ModalLoad| Term {
            c: Complex::from_polar(1.0, h.0 * a + h.1),
            s: Complex::new(0.0, h.0),
            growth: Complex::from_polar(1.0, h.0 * (b - a)),
        };
        self.loads.iter().map(turn).collect()
    }

    /// `∫ F q̇` and `∫ q̇²` of mode `k` from `a` to `b`; `turns` are those of the interval.
    pub(super) fn powers(
        &self,
        phase: &Spectrum,
        k: usize,
        turns: &[Term],
        (a, b): (f64, f64),
    ) -> [f64; 2] {
        match self.free(phase, k, a, b - a) {
            Some(free) => powers_in_closed_form(&free, &self.loads, k, turns, b - a),
            None => self.powers_by_quadrature(phase, k, a, b),
        }
    }

    /// The same by Gauss–Legendre, with as many points as the mode's frequency asks for: for modes
    /// that are not a sum of well separated exponentials.
    fn powers_by_quadrature(&self, phase: &Spectrum, k: usize, a: f64, b: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        let mode = &phase.modes[k];
        let load = self.loads.iter().map(|h| h.0).fold(0.0, f64::max);
        let parts = ((b - a) * (mode.omega + load).max(2.0 * mode.c) / 2.0).ceil().max(1.0);
        let h = (b - a) / parts;
        for j in 0..parts as usize {
            let left = a + j as f64 * h;
            for (x, weight) in GAUSS10 {
                for t in [left + 0.5 * h * (1.0 - x), left + 0.5 * h * (1.0 + x)] {
                    let basis = mode.basis(t - self.start);
                    let (_, v) = self.mode(phase, k, t, &basis, &self.turned(t));
                    let harmonics = self.loads.iter();
                    let force: f64 =
                        harmonics.map(|(w, phi, f)| f[k].0 * (w * t + phi).cos()).sum();
                    sums[0] += 0.5 * h * weight * force * v;
                    sums[1] += 0.5 * h * weight * v * v;
                }
            }
        }
        sums
    }

    /// Work of the harmonic loads and dissipation of all modes from `a` to `b`.
    pub(super) fn all_powers(&self, phase: &Spectrum, (a, b): (f64, f64)) -> [f64; 2] {
        if let (Some(coupling), Some(motion)) = (&phase.coupling, &self.coupled) {
            let span = (a - self.start, b - a);
            return motion.inner().powers(coupling.modes(), &self.angles, &phase.harmonics, span);
        }
        let mut sums = [0.0; 2];
        let turns = self.turns(a, b);
        for (k, mode) in phase.modes.iter().enumerate() {
            let part = self.powers(phase, k, &turns, (a, b));
            sums[0] += part[0];
            sums[1] += 2.0 * mode.c * part[1];
        }
        sums
    }

    /// Bounds of the changing part of all monitors, and of their fourth derivatives, from `t` to `end`.
    pub(super) fn monitor_bounds(&self, phase: &Spectrum, t: f64, end: f64) -> [Vec<f64>; 2] {
        if let (Some(coupling), Some(motion)) = (&phase.coupling, &self.coupled) {
            let rows = phase.all_rows();
            return motion.bounds(coupling, rows, t - self.start, end - self.start);
        }
        let count = phase.offsets.len();
        let (mut sizes, mut fourths) = (vec![0.0; count], vec![0.0; count]);
        for k in 0..phase.modes.len() {
            let bound = |order| self.bound(phase, k, (t, end), order);
            let mut add = |rows: &DMatrix<f64>, size: f64, fourth: f64| {
                for (i, r) in rows.column(k).iter().enumerate() {
                    sizes[i] += r.abs() * size;
                    fourths[i] += r.abs() * fourth;
                }
            };
            add(&phase.rows, bound(0), bound(4));
            if let Some(rows) = &phase.velocity_rows {
                add(rows, bound(1), bound(5));
            }
        }
        [sizes, fourths]
    }

    /// How far each monitor may be at `t` from that of the equations that start in the same state (theory §12, H4).
    ///
    /// The sum over the modes obeys the equations up to the force `(KΦ − MΦΛ)(q + βq̇)`, and starts beside the state by `(ΦΦᵀM − I)x`. What starts beside a
    /// mode stays there, a force is answered by `|e_k| ≤ min(t, 1/ω_k) ∫|f_k|`, so that with Cauchy's inequality `|∇h e| ≤ ‖r‖ ‖e(0)‖ + ‖r min(t, 1/ω)‖
    /// (‖ė(0)‖ + ∫‖f‖)`; modes that are fed grow.
    pub(super) fn deviations(&self, phase: &Spectrum, t: f64) -> Vec<f64> {
        let tau = t - self.start;
        let scale = phase.scale();
        let defect = phase.defect;
        if let (Some(coupling), Some(motion)) = (&phase.coupling, &self.coupled) {
            let beta = phase.stiffness_damping();
            return motion.deviations(coupling, phase.all_rows(), (defect, beta), tau);
        }
        let (mut size, mut rate, mut force, mut grown) = (0.0, 0.0, 0.0, 1.0f64);
        for (k, mode) in phase.modes.iter().enumerate() {
            let statics = phase.steady_force[k].abs() / scale[k].powi(2);
            let of_loads = self.loads.iter().map(|l| l.2[k].0.abs()).sum::<f64>();
            let q = self.bound(phase, k, (self.start, t), 0) + statics;
            let v = mode.free_bound((self.q[k], self.v[k]), 1, (0.0, tau)) + tau * of_loads;
            size += q * q;
            rate += v * v;
            force += (phase.steady_force[k].abs() + of_loads).powi(2);
            grown = grown.max((-2.0 * mode.c * tau).exp());
        }
        let (size, rate, force) = (size.sqrt(), rate.sqrt(), force.sqrt());
        let beside = defect.orthogonality * size;
        let pushed = defect.orthogonality * (rate + tau * force)
            + tau * defect.residual * (size + phase.stiffness_damping() * rate);
        let weights: Vec<f64> = scale.iter().map(|w| tau.min(1.0 / w)).collect();
        let of_row = |i: usize| {
            let (mut all, mut slow) = (0.0, 0.0);
            for (r, w) in phase.rows.row(i).iter().zip(&weights) {
                all += r * r;
                slow += (r * w).powi(2);
            }
            // of velocities as of displacements times a frequency
            let of_velocity: f64 = phase
                .velocity_rows
                .as_ref()
                .map_or(0.0, |m| m.row(i).iter().zip(&scale).map(|(r, w)| (r * w).powi(2)).sum());
            let fast = phase.velocity_rows.as_ref().map_or(0.0, |m| m.row(i).norm());
            grown * ((all + of_velocity).sqrt() * beside + (slow.sqrt() + fast) * pushed)
        };
        (0..phase.rows.nrows()).map(of_row).collect()
    }

    /// Whether these bounds hold for the whole phase: amplitudes stay what they are where nothing decays and nothing grows.
    pub(super) fn is_steady(&self, phase: &Spectrum) -> bool {
        if let (Some(coupling), Some(motion)) = (&phase.coupling, &self.coupled) {
            return motion.is_steady(coupling);
        }
        let from_rest = |h: &ModalLoad| h.2.iter().any(|f| matches!(f.1, Forcing::FromRest(_)));
        phase.modes.iter().all(|m| m.c == 0.0 && m.omega > 0.0) && !self.loads.iter().any(from_rest)
    }

    /// `∫ u̇_OᵀM_α u̇_O` from `a` to `b`.
    pub(crate) fn squared_speed(&self, phase: &Spectrum, a: f64, b: f64) -> f64 {
        if let (Some(coupling), Some(motion)) = (&phase.coupling, &self.coupled) {
            return motion.inner().squared_speed(coupling.modes(), (a - self.start, b - a));
        }
        let turns = self.turns(a, b);
        (0..phase.modes.len()).map(|k| self.powers(phase, k, &turns, (a, b))[1]).sum()
    }

    /// `∂q/∂α` and `∂q̇/∂α` of all modes at `t`, for a body with the damping `C = βK + αM` under constant loads (`2c = α + βω²`; the start is held).
    pub(crate) fn by_mass_damping(&self, phase: &Spectrum, t: f64) -> (Vec<f64>, Vec<f64>) {
        let tau = t - self.start;
        if let (Some(coupling), Some(motion)) = (&phase.coupling, &self.coupled) {
            return motion.inner().by_mass_damping(coupling.modes(), tau);
        }
        let of_mode = |(k, m): (usize, &Oscillator)| {
            let (s, ds) = m.basis_by_damping(tau);
            let c = ds + 2.0 * m.basis(tau).s + 2.0 * m.c * s;
            let (q, v) = (self.q[k], self.v[k]);
            (0.5 * (q * c + v * s), 0.5 * (v * ds - q * m.omega * m.omega * s))
        };
        phase.modes.iter().enumerate().map(of_mode).unzip()
    }

    /// A bound of the derivative of the order `order` of the changing part of mode `k` from `t` to `end` (theory §12, H2).
    pub(super) fn bound(
        &self,
        phase: &Spectrum,
        k: usize,
        (t, end): (f64, f64),
        order: i32,
    ) -> f64 {
        let mode = &phase.modes[k];
        let Oscillator { omega, c } = *mode;
        let (tau, tau_end) = (t - self.start, end - self.start);
        let mut bound = mode.free_bound((self.q[k], self.v[k]), order, (tau, tau_end));
        if phase.steady_force[k] != 0.0 && omega == 0.0 {
            let f = phase.steady_force[k].abs();
            // q = F ∫∫e^{−2cx}, q⁗ = F (2c)² e^{−2cτ}: fed, both are largest at the end
            let grown = (-2.0 * c * tau_end).exp().max(1.0);
            bound += f
                * grown
                * match order {
                    0 => 0.5 * tau_end * tau_end,
                    1 => tau_end,
                    _ => (2.0 * c).abs().powi(order - 2),
                };
        }
        for (w, _, forces) in &self.loads {
            bound += match forces[k].1 {
                Forcing::Steady(p) => p.norm() * w.powi(order),
                Forcing::FromRest(f) => mode.rest_bound(*w, f, tau_end, order),
            };
        }
        bound
    }
}

/// `∫ F q̇` and `∫ q̇²` over an interval of length `h`, from the free part of `q̇` at its start.
fn powers_in_closed_form(
    free: &[Term; 2],
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
    let [first, second] = free;
    let mut sums = [0.0, product_integral(first, first, h)];
    let two = second.c != Complex::default();
    if two {
        sums[1] += product_integral(second, second, h) + 2.0 * product_integral(first, second, h);
    }
    for j in 0..turns.len() {
        let (x, f) = (steady(j), force(j));
        for free in [first].into_iter().chain(two.then_some(second)) {
            sums[1] += 2.0 * product_integral(free, &x, h);
            sums[0] += product_integral(free, &f, h);
        }
        for i in 0..turns.len() {
            sums[1] += product_integral(&x, &steady(i), h);
            sums[0] += product_integral(&x, &force(i), h);
        }
    }
    sums
}
