//! How many terms a window of a length needs, and what the rest can add.

use std::collections::HashMap;
use std::rc::Rc;

use super::nodes::Nodes;
use crate::contact::Rayleigh;

/// Lengths of windows come in steps of `2^(1/32)`, so that the terms of each are counted once.
const STEPS: f64 = 32.0;
/// The shortest of them, in steps; a shorter window takes its terms.
const SHORTEST: i32 = -10 * 32;
/// Times of the window at which damped functions are looked at.
const LOOKS: usize = 6;

/// Terms below this, relative to the function, are left out at `R = t ω_max`: rounding errors of the recurrence grow with `R`.
fn smallest(r: f64) -> f64 {
    1e-14f64.max(2e-16 * (1.0 + r / 30.0))
}

/// `J_0(x) … J_m(x)`, `m` large enough that all further ones are below 1e-18: Miller's backward
/// recurrence, normalised by `J₀ + 2 Σ J_2k = 1`.
pub(super) fn bessel(x: f64) -> Vec<f64> {
    if x == 0.0 {
        return vec![1.0];
    }
    let top = (x + 16.0 * x.cbrt() + 48.0) as usize;
    let mut j = vec![0.0; top + 2];
    j[top] = 1e-300;
    for m in (1..=top).rev() {
        j[m - 1] = 2.0 * m as f64 / x * j[m] - j[m + 1];
        if j[m - 1].abs() > 1e200 {
            j[m - 1..].iter_mut().for_each(|v| *v *= 1e-250);
        }
    }
    let norm = j[0] + 2.0 * j.iter().skip(2).step_by(2).sum::<f64>();
    j.iter_mut().for_each(|v| *v /= norm);
    while j.len() > 1 && j[j.len() - 1].abs() < 1e-18 {
        j.pop();
    }
    j
}

/// The terms of windows up to a length `t`, and bounds `|f − f_N|` on the spectrum over the whole window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Length {
    /// `N`
    pub terms: usize,
    /// Of `g′`, of `g`.
    pub rate: f64,
    pub g: f64,
    /// Of `G` and of every `p`; of every `p′`.
    pub p: f64,
    pub dp: f64,
    /// Earlier than this the bounds are too large.
    early: f64,
}

/// What is left out of the sums falls at least with this power of the time: with a higher one, as `J_m(θx) ≤ θ^q J_m(x)` for all `q ≤ √(m² − x²)`.
const POWER: i32 = 4;

impl Length {
    /// Undamped, the coefficients are Bessel functions, `cos t√s = J₀(R) + 2Σ(−1)^k J_2k(R) T_k`, which grow with time where they are small; those of
    /// integrals are integrals of them.
    fn undamped(t: f64, r: f64) -> Length {
        let j = bessel(r);
        let even: Vec<f64> = j.iter().step_by(2).map(|j| 2.0 * j.abs()).collect();
        let last = even.iter().rposition(|&j| j > smallest(r)).unwrap_or(0);
        // beyond the turning point
        let terms = (last + 1).max((0.5 * r).ceil() as usize).max(2);
        let rest = 2.0 * even.iter().skip(terms).sum::<f64>();
        Length { terms, rate: rest, g: t * rest, p: 0.5 * t * t * rest, dp: t * rest, early: t }
    }

    /// The share of the bounds that is left at the time `tau`.
    pub fn share(&self, tau: f64) -> f64 {
        (tau / self.early).min(1.0).powi(POWER)
    }

    /// Damped, the functions themselves are looked at, at some times of the window, with many nodes.
    fn damped(t: f64, r: f64, omega: f64, damping: Rayleigh) -> Length {
        let excess = 7.0 * (damping.beta * omega * r).max(0.0).sqrt();
        let many = (0.5 * r + 8.0 * r.cbrt() + 40.0 + excess) as usize;
        let nodes = Nodes::new(many, omega, Some(damping));
        // g′ and g at every look
        let mut looks: [Vec<Vec<f64>>; 2] = Default::default();
        let mut sizes = [0.0f64; 2];
        for k in 1..=LOOKS {
            let f = nodes.functions(t * k as f64 / LOOKS as f64);
            for (i, f) in [&f.rate, &f.g].into_iter().enumerate() {
                sizes[i] = f.iter().fold(sizes[i], |m, x| m.max(x.abs()));
                looks[i].push(nodes.coefficients(f));
            }
        }
        let mut terms = 2;
        for (looks, size) in looks.iter().zip(sizes) {
            for c in looks {
                let last = c.iter().rposition(|c| c.abs() > smallest(r) * size).unwrap_or(0);
                terms = terms.max(last + 1);
            }
        }
        let rest = |i: usize| {
            let of_look = |c: &Vec<f64>| 2.0 * c.iter().skip(terms).map(|c| c.abs()).sum::<f64>();
            looks[i].iter().map(of_look).fold(0.0, f64::max)
        };
        let [rate, g] = [0, 1].map(rest);
        Length { terms, rate, g, p: t * g, dp: t * rate, early: t / LOOKS as f64 }
    }
}

/// The lengths that have been asked for, of one body.
#[derive(Debug)]
pub(super) struct Lengths {
    omega: f64,
    damping: Option<Rayleigh>,
    known: HashMap<i32, Length>,
    nodes: HashMap<usize, Rc<Nodes>>,
}

impl Lengths {
    pub fn new(omega: f64, damping: Option<Rayleigh>) -> Lengths {
        Lengths { omega, damping, known: HashMap::new(), nodes: HashMap::new() }
    }

    /// The next length of the ladder below `r`, for those who may choose; `steps` of them make an octave.
    pub fn below(r: f64, steps: f64) -> f64 {
        ((r.log2() * steps).floor() / steps).exp2()
    }

    /// What windows up to the time `t` need.
    pub fn of(&mut self, t: f64) -> Length {
        let step = ((t * self.omega).log2() * STEPS - 1e-9).ceil() as i32;
        let step = step.max(SHORTEST);
        let (omega, damping) = (self.omega, self.damping);
        *self.known.entry(step).or_insert_with(|| {
            let r = (f64::from(step) / STEPS).exp2();
            match damping {
                Some(d) if d.alpha != 0.0 || d.beta != 0.0 => {
                    Length::damped(r / omega, r, omega, d)
                }
                _ => Length::undamped(r / omega, r),
            }
        })
    }

    /// So many nodes.
    pub fn nodes(&mut self, count: usize) -> Rc<Nodes> {
        let (omega, damping) = (self.omega, self.damping);
        let new = || Rc::new(Nodes::new(count, omega, damping));
        self.nodes.entry(count).or_insert_with(new).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_functions_are_those_of_the_tables() {
        // Abramowitz and Stegun, tables 9.1 and 9.4
        let j = bessel(5.0);
        assert!((j[0] + 0.177_596_771_314_338_3).abs() < 1e-15);
        assert!((j[1] + 0.327_579_137_591_465_2).abs() < 1e-15);
        assert!((j[10] - 1.467_802_647_310_474e-3).abs() < 1e-16);
        assert!((bessel(100.0)[0] - 0.019_985_850_304_223_12).abs() < 1e-14);
        assert!((bessel(1e-9)[1] - 0.5e-9).abs() < 1e-24);
    }

    /// The sums are the functions anywhere on the spectrum and in the window, to the error that is promised: undamped, lightly, critically and
    /// strongly damped, long and short windows.
    #[test]
    fn sums_are_the_functions() {
        let omega = 3.0;
        let dampings = [(0.0, 0.0), (0.3, 0.0), (0.0, 0.05), (0.1, 0.7), (0.0, 4.0), (6.0, 0.0)];
        for (alpha, beta) in dampings {
            let mut lengths = Lengths::new(omega, Some(Rayleigh { alpha, beta }));
            for r in [1e-3, 0.3, 1.0, 8.0, 40.0, 150.0] {
                let length = lengths.of(r / omega);
                let nodes = lengths.nodes(length.terms);
                for part in [1.0, 0.73, 0.04] {
                    let t = part * r / omega;
                    let f = nodes.functions(t);
                    let load = 0.4;
                    let p = nodes.responses(load, t);
                    let split = |of: &dyn Fn(&[nalgebra::Complex<f64>; 2]) -> f64| {
                        p.iter().map(of).collect::<Vec<f64>>()
                    };
                    let p = [split(&|p| p[0].re), split(&|p| p[1].im)];
                    let sums =
                        [&f.rate, &f.g, &f.integral, &p[0], &p[1]].map(|f| nodes.coefficients(f));
                    let bounds = [length.rate, length.g, length.p, length.p, length.dp];
                    let sizes = [1.0, t, 0.5 * t * t, 0.5 * t * t, t];
                    for w in [1e-4, 0.02, 0.5, 1.7, 2.5, 2.9999] {
                        // by themselves: one node there
                        let mode = crate::flow::oscillator::Oscillator {
                            omega: w,
                            c: 0.5 * (alpha + beta * w * w),
                        };
                        let (b, whole) = (mode.basis(t), mode.response_from_rest(0.0, t)[0].re);
                        let p = mode.response_from_rest(load, t);
                        let exact = [b.ds, b.s, whole, p[0].re, p[1].im];
                        let theta = (2.0 * (w / omega) * (w / omega) - 1.0f64).acos();
                        for i in 0..5 {
                            let sum: f64 = sums[i]
                                .iter()
                                .enumerate()
                                .map(|(k, c)| c * (k as f64 * theta).cos())
                                .sum();
                            let rounding = 1e-14 * (1.0 + r) * sizes[i];
                            let e = (sum - exact[i]).abs();
                            assert!(
                                e <= 2.0 * bounds[i] * length.share(t) + rounding,
                                "{alpha} {beta} R {r} at {part}, function {i} at {w}: {e:.1e} of {:.1e} + {rounding:.1e}",
                                bounds[i]
                            );
                        }
                    }
                }
            }
        }
    }

    /// The number of terms is what independent prototypes measured (to 1e-14, load at ω_max/50).
    #[test]
    fn terms_are_as_many_as_measured_elsewhere() {
        let table = [
            (1.0, [8, 8, 9, 12, 14, 22, 55]),
            (8.0, [16, 16, 17, 24, 28, 51, 146]),
            (40.0, [39, 39, 41, 54, 64, 113, 320]),
            (100.0, [75, 75, 78, 98, 114, 190, 507]),
            (480.0, [280, 281, 287, 333, 367, 524, 1183]),
        ];
        for (r, expected) in table {
            for (x, expected) in [0.0, 0.01, 0.1, 1.0, 2.0, 10.0, 100.0].into_iter().zip(expected) {
                let omega = 50.0;
                let damping = Rayleigh { alpha: 0.0, beta: x / omega };
                let length = match x == 0.0 {
                    true => Length::undamped(r / omega, r),
                    false => Length::damped(r / omega, r, omega, damping),
                };
                // times looked at differ, which shows where decay is fastest
                let more = if x < 50.0 { 1.05 } else { 1.08 };
                let most = more * f64::from(expected) + 1.0;
                assert!(length.terms as f64 <= most, "R {r}, βω {x}: {} {expected}", length.terms);
            }
        }
    }
}
