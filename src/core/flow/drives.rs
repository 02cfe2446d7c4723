//! What harmonic loads on `u_C` itself add to the monitors of a phase, `Σ_j c_j cos(ω_j t + φ_j)`, in closed form; and what measured histories add to those of points that
//! stick, `Σ_j c_j s_j(t)`.

use super::Enclosure;
use crate::contact::{Drive, MeasuredDrive, Phase};

/// The drives of one phase.
#[derive(Debug, Clone, Default)]
pub struct Drives {
    harmonic: Vec<Drive>,
    measured: Vec<MeasuredDrive>,
}

impl Drives {
    /// Those of a phase.
    pub fn of(phase: &Phase) -> Drives {
        Drives { harmonic: phase.drives(), measured: phase.measured_drives() }
    }

    /// Harmonic ones alone.
    pub(super) fn harmonic(drives: Vec<Drive>) -> Drives {
        Drives { harmonic: drives, measured: vec![] }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.harmonic.is_empty() && self.measured.is_empty()
    }

    /// What they add to a monitor at `t`, or to its derivative of this order (1 or 2).
    pub fn at(&self, index: usize, t: f64, order: u32) -> f64 {
        let harmonic = self.harmonic.iter().map(|d| d.load.factor(t, order) * d.monitor[index]);
        let measured = self.measured.iter().map(|d| d.load.factor(t, order) * d.monitor[index]);
        harmonic.chain(measured).sum()
    }

    /// `∂/∂ω` of what they add to a monitor at a fixed time `t`.
    pub(crate) fn by_frequency(&self, index: usize, t: f64) -> f64 {
        self.harmonic.iter().map(|d| d.load.factor_by_frequency(t) * d.monitor[index]).sum()
    }

    /// Amplitude of all harmonic ones in a monitor, and a bound of the fourth derivative.
    pub fn bounds(&self, index: usize) -> (f64, f64) {
        let size = |d: &Drive| d.load.size() * d.monitor[index].abs();
        let fourth = self.harmonic.iter().map(|d| size(d) * d.load.omega.powi(4)).sum();
        (self.harmonic.iter().map(size).sum(), fourth)
    }

    /// Enclosure of what they add to a monitor on `[a, b]`.
    pub fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure {
        let end = |t: f64| (self.at(index, t, 0), self.at(index, t, 1));
        let mut enclosure = Enclosure::hermite(end(a), end(b), b - a, self.bounds(index).1);
        // what a cubic misses of a spline is the deflection of a beam, clamped at both ends, under the jumps of its third derivative
        let jumps = |d: &MeasuredDrive| d.monitor[index].abs() * d.load.history.jumps(a, b);
        let jumps: f64 = self.measured.iter().map(jumps).sum();
        enclosure.error += jumps * (b - a).powi(3) / 192.0;
        enclosure.slope_error += jumps * (b - a).powi(3) / 32.0;
        enclosure
    }

    /// Work of all harmonic loads that pressures bear along `ḋ`, from `a` to `b`: `Σ_ij c_iᵀf_j ∫ d/dt cos(ω_i t + φ_i) cos(ω_j t + φ_j) dt`, where `forces` are those on
    /// `u_C`.
    pub fn work(&self, a: f64, b: f64) -> f64 {
        let mut sum = 0.0;
        for x in &self.harmonic {
            for y in self.harmonic.iter().filter(|y| !y.load.damps) {
                let n_o = y.load.force.len() - x.displacement.len();
                let force = &y.load.force[n_o..];
                let dot: f64 = x.displacement.iter().zip(force).map(|(d, f)| d * f).sum();
                let (w, v) = (x.load.omega, y.load.omega);
                let (p, q) = (x.load.angle(), y.load.angle());
                let dot = x.load.size() * y.load.size() * dot;
                // −ω sin(ωt + p) cos(vt + q) = −ω/2 [sin((ω+v)t + p+q) + sin((ω−v)t + p−q)]
                let integral = |rate: f64, phase: f64| {
                    let half = 0.5 * rate * (b - a);
                    let sinc = if half.abs() < 1e-8 { 1.0 } else { half.sin() / half };
                    (0.5 * rate * (a + b) + phase).sin() * sinc * (b - a)
                };
                sum -= 0.5 * w * dot * (integral(w + v, p + q) + integral(w - v, p - q));
            }
        }
        sum
    }
}
