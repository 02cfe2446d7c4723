//! Amplitude spectra of what is stored over time.
//!
//! ```text
//! A(f_k) = 2 |Σ_n w_n x_n e^{−2πi kn/N}| / Σ_n w_n,   f_k = k / (N Δt),   w_n = sin²(πn/N)
//! ```
//!
//! Hann's window: a harmonic of amplitude `a` between two lines shows at least `.85 a`. Of one period of an orbit no window is needed: `w_n = 1`, and the lines are its harmonics.
//! The stored states that stand evenly in time are taken; those of switches stand between them.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// A spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Frequencies, cycles over time.
    pub frequency: Vec<f64>,
    /// Amplitudes.
    pub amplitude: Vec<f64>,
}

/// Stored states that stand evenly in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Even {
    rows: Vec<usize>,
    step: f64,
    periodic: bool,
}

/// Fewest states that have a spectrum.
const FEWEST: usize = 8;
/// Deviation from even times, over the step.
const UNEVEN: f64 = 1e-6;

impl Even {
    /// Among increasing times; `periodic`: they span one period, whose end is its beginning. None where none stand evenly.
    pub fn among(t: &[f64], periodic: bool) -> Option<Even> {
        let (first, last) = (*t.first()?, *t.last()?);
        // switches only divide steps: a whole one is the longest
        let longest = t.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        let count = ((last - first) / longest).round();
        let step = (last - first) / count;
        let mut rows = vec![];
        let mut row = 0;
        for k in 0..=count as usize {
            let wanted = first + k as f64 * step;
            while row < t.len() && t[row] < wanted - UNEVEN * step {
                row += 1;
            }
            if row == t.len() || t[row] > wanted + UNEVEN * step {
                return None;
            }
            rows.push(row);
        }
        // the end of the last step belongs to the next one
        rows.pop();
        (rows.len() >= FEWEST).then_some(Even { rows, step, periodic })
    }

    /// The spectrum of values at all stored states; none where some are not known.
    pub fn spectrum(&self, values: &[f64]) -> Option<Spectrum> {
        let n = self.rows.len();
        let window = |k: usize| match self.periodic {
            true => 1.0,
            false => (std::f64::consts::PI * k as f64 / n as f64).sin().powi(2),
        };
        let whole: f64 = (0..n).map(window).sum();
        // the mean is line 0, and does not leak into the others
        let mean =
            self.rows.iter().enumerate().map(|(k, r)| window(k) * values[*r]).sum::<f64>() / whole;
        let mut x: Vec<Complex<f64>> = self
            .rows
            .iter()
            .enumerate()
            .map(|(k, r)| Complex::new(window(k) * (values[*r] - mean), 0.0))
            .collect();
        if x.iter().any(|x| !x.re.is_finite()) {
            return None;
        }
        FftPlanner::new().plan_fft_forward(n).process(&mut x);
        let lines = 0..=n / 2;
        Some(Spectrum {
            frequency: lines.clone().map(|k| k as f64 / (n as f64 * self.step)).collect(),
            amplitude: lines
                .map(|k| if k == 0 { mean.abs() } else { 2.0 * x[k].norm() / whole })
                .collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the sum itself, on times between which switches stand.
    #[test]
    fn lines_are_those_of_the_sum_and_of_harmonics() {
        let (n, step) = (240, 0.05);
        let mut t: Vec<f64> = (0..=n).map(|k| k as f64 * step).collect();
        t.extend([0.333, 4.2871, 4.2872]);
        t.sort_by(f64::total_cmp);
        let omega = std::f64::consts::TAU / (n as f64 * step);
        let x =
            |t: f64| 0.3 + 2.0 * (7.0 * omega * t + 0.4).cos() + 0.01 * (31.0 * omega * t).sin();
        let values: Vec<f64> = t.iter().map(|t| x(*t)).collect();
        let even = Even::among(&t, true).unwrap();
        let s = even.spectrum(&values).unwrap();
        for (k, a) in s.amplitude.iter().enumerate() {
            let wanted = match k {
                0 => 0.3,
                7 => 2.0,
                31 => 0.01,
                _ => 0.0,
            };
            assert!((a - wanted).abs() < 1e-12, "{k}: {a}");
            assert!((s.frequency[k] - k as f64 * omega / std::f64::consts::TAU).abs() < 1e-14);
        }
        // with the window the sum of a line between two others
        let x = |t: f64| (7.5 * omega * t).cos();
        let values: Vec<f64> = t.iter().map(|t| x(*t)).collect();
        let s = Even::among(&t, false).unwrap().spectrum(&values).unwrap();
        let largest = s.amplitude.iter().copied().fold(0.0, f64::max);
        assert!((0.84..0.86).contains(&largest), "{largest}");
        let slow = |k: usize| {
            let w = |m: usize| (std::f64::consts::PI * m as f64 / n as f64).sin().powi(2);
            let whole: f64 = (0..n).map(w).sum();
            let mean = (0..n).map(|m| w(m) * x(m as f64 * step)).sum::<f64>() / whole;
            let angle = |m: usize| std::f64::consts::TAU * (k * m) as f64 / n as f64;
            let part = |of: fn(f64) -> f64| {
                (0..n).map(|m| w(m) * (x(m as f64 * step) - mean) * of(angle(m))).sum::<f64>()
            };
            2.0 * part(f64::cos).hypot(part(f64::sin)) / whole
        };
        for k in [1, 7, 8, 40, 119] {
            assert!((s.amplitude[k] - slow(k)).abs() < 1e-12);
        }
        // times that stand nowhere evenly
        let t: Vec<f64> = (0..40).map(|k| (k as f64).powi(2)).collect();
        assert_eq!(Even::among(&t, false), None);
    }
}
