//! How many terms a window of a length needs, and what the rest can add.

use std::collections::HashMap;
use std::rc::Rc;

use super::nodes::Nodes;
use crate::contact::Rayleigh;

/// Lengths of windows come in steps of `2^(1/32)`, so that the terms of each are counted once.
const STEPS: f64 = 32.0;
/// The shortest of them, in steps; a shorter window takes its terms.
const SHORTEST: i32 = -10 * 32;
/// Times of the window at which damped functions are looked at, for how many terms they want.
const LOOKS: usize = 6;

/// Terms below this, relative to the function, are left out at `R = t ω_max`: rounding errors of the recurrence grow with `R`.
fn smallest(r: f64) -> f64 {
    1e-14f64.max(rounding(r))
}

/// Rounding errors of the recurrence, relative: measured.
pub(super) fn rounding(r: f64) -> f64 {
    2e-16 * (1.0 + r / 30.0)
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
    /// How the bounds fall off towards the start of the window.
    early: Early,
}

/// What is left of the bounds at earlier times.
#[derive(Debug, Clone, Copy)]
enum Early {
    /// They fall at least with [`POWER`] of the time over that of the window.
    Power(f64),
    /// The shares at the window's length over `2^j`.
    Octaves(f64, [f64; OCTAVES]),
}

/// Shorter times than this many halvings of a window take the bounds of the last.
const OCTAVES: usize = 8;

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
        Length {
            terms,
            rate: rest,
            g: t * rest,
            p: 0.5 * t * t * rest,
            dp: t * rest,
            early: Early::Power(t),
        }
    }

    /// The share of the bounds that is left at the time `tau`.
    pub fn share(&self, tau: f64) -> f64 {
        match self.early {
            Early::Power(t) => (tau / t).min(1.0).powi(POWER),
            Early::Octaves(t, shares) => {
                let octave = (t / tau).log2().floor().max(0.0) as usize;
                shares[octave.min(OCTAVES - 1)]
            }
        }
    }

    /// Damped, the functions themselves are looked at, at some times of the window, with many nodes: so many terms are wanted. What these leave out is
    /// bounded at all times ([`left_out`], theory §12, H2).
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
        let [rate, g] = left_out(terms, t, omega, damping);
        let mut shares = [1.0; OCTAVES];
        for j in 1..OCTAVES {
            let [r, q] = left_out(terms, t * 0.5f64.powi(j as i32), omega, damping);
            shares[j] = (r / rate).max(q / g).min(shares[j - 1]);
        }
        Length { terms, rate, g, p: t * g, dp: t * rate, early: Early::Octaves(t, shares) }
    }
}

/// Bounds of `|f − f_N|` on the spectrum `[0, ω²]`, of `g′` and of `g`, at every time up to `t`.
///
/// A function that is entire in `s` and not above `m` on the ellipse with the foci `0` and `ω²` and the semiaxes `½ω² cosh η`, `½ω² sinh η` has
/// coefficients `|c_k| ≤ 2m e^{−kη}` (Bernstein), so `|f − f_N| ≤ 2 Σ_{k≥N} |c_k| ≤ 4m e^{−Nη}/(1 − e^{−η})` for every `η`. On the ellipse no root of
/// `λ² + (α + βs)λ + s = 0` lies right of the one at its left end `s = −σ`, `σ = ω² sinh²(η/2)`,
///
/// ```text
/// Re λ ≤ x,   x (x + α) = σ (1 + βx)
/// ```
///
/// For with `λ = x + iy` and `z = −s = λ(λ + α)/(1 + βλ)` it is `|z| + Re z ≥ 2σ`: times `|1 + βλ|²`, with one root by itself and squared, the difference of both sides is a
/// polynomial in `y²` without a constant, whose coefficients are not negative (the first is `((1 + βx)x − (x + α))² + 4βx(x + α)²`). So `|s| + |s − ω²| ≥ |z| + Re z + ω² ≥ 2σ + ω² =
/// ω² cosh η`: `s` is not inside. What feeds, `α = −κ`, is `e^{κt}` times what `κ` and `β/(1 + κβ)` damp at `(1 + κβ)s`. With `r = ½(λ₊ − λ₋)`, `δ = −½(λ₊ + λ₋)`
///
/// ```text
/// |g| ≤ t e^{xt},     |g′| = |½(e^{λ₊t} + e^{λ₋t}) − δg| ≤ e^{xt} (1 + |δ| min(t, 1/|r|))
/// ```
///
/// where `r² = δ² − s`: `|δ/r| ≤ √2` unless `½|δ|² ≤ |s| ≤ 2|δ|²`, and there `|δ| ≤ √(2|s|)`, `|s| ≤ ω² cosh²(η/2)`. All of it grows with `t`.
fn left_out(terms: usize, t: f64, omega: f64, damping: Rayleigh) -> [f64; 2] {
    let Rayleigh { alpha, beta } = damping;
    if !(alpha.is_finite() && beta >= 0.0) {
        return [f64::INFINITY; 2];
    }
    let fed = (-alpha).max(0.0);
    let stiffer = 1.0 + fed * beta;
    let slope = beta / stiffer;
    let mut least = [f64::INFINITY; 2];
    // any η will do
    for j in 0..160 {
        let eta = 0.02 * 1.04f64.powi(j);
        let sigma = stiffer * omega * omega * (0.5 * eta).sinh().powi(2);
        let d = slope * sigma - alpha.abs();
        let root = (d * d + 4.0 * sigma).sqrt();
        let x = fed + if d > 0.0 { 0.5 * (d + root) } else { 2.0 * sigma / (root - d) };
        let c = (0.5 * eta).cosh();
        let delta =
            (0.5 * (alpha.abs() + beta * omega * omega * c * c)).min(f64::sqrt(2.0) * omega * c);
        let of_rate = 1.0 + f64::sqrt(2.0).max(delta * t);
        let size = 4.0 * (x * t - terms as f64 * eta).exp() / -(-eta).exp_m1();
        least = [least[0].min(of_rate * size), least[1].min(t * size)];
    }
    least
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

    /// What `N` terms leave out of damped and of fed functions is bounded at every time of the window, here at some four hundred of them, for the `N` that is taken
    /// and for fewer; and the bound is of the size of what is left out.
    #[test]
    fn what_is_left_out_is_bounded_at_every_time_of_a_window() {
        let omega = 3.0;
        let dampings = [
            (0.3, 0.0),
            (0.0, 0.05),
            (0.1, 0.7),
            (0.0, 4.0),
            (6.0, 0.0),
            (-0.2, 0.03),
            (-0.05, 0.5),
        ];
        let mut worst = [0.0f64; 2];
        for (alpha, beta) in dampings {
            let damping = Rayleigh { alpha, beta };
            for r in [1.0f64, 8.0, 40.0] {
                let whole = Length::damped(r / omega, r, omega, damping);
                let excess = 7.0 * (beta * omega * r).max(0.0).sqrt();
                let nodes = Nodes::new(
                    (0.5 * r + 8.0 * r.cbrt() + 60.0 + excess) as usize,
                    omega,
                    Some(damping),
                );
                let looks: Vec<(f64, [Vec<f64>; 2])> = (1..=420)
                    .map(|k| {
                        let t = r / omega * f64::from(k) / 420.0;
                        let f = nodes.functions(t);
                        (t, [nodes.coefficients(&f.rate), nodes.coefficients(&f.g)])
                    })
                    .collect();
                let left =
                    |c: &[f64], n: usize| 2.0 * c.iter().skip(n).map(|c| c.abs()).sum::<f64>();
                for n in [whole.terms, whole.terms * 3 / 4, whole.terms / 2] {
                    let bounds = left_out(n, r / omega, omega, damping);
                    let mut most = [0.0f64; 2];
                    for (t, c) in &looks {
                        for i in 0..2 {
                            let e = left(&c[i], n);
                            let size = [1.0, *t][i] * (-alpha * t).exp().max(1.0);
                            // of the coefficients themselves
                            let rounding = 4e-16 * nodes.len() as f64 * size;
                            let of_length = [whole.rate, whole.g][i] * whole.share(*t);
                            let bound = if n == whole.terms { of_length } else { bounds[i] };
                            assert!(
                                e <= bound + rounding,
                                "{alpha} {beta}, R {r}, {n} terms at {t}: {e:.1e} {bound:.1e}"
                            );
                            most[i] = most[i].max(e);
                        }
                    }
                    for i in 0..2 {
                        if most[i] > 1e-11 {
                            worst[i] = worst[i].max(bounds[i] / most[i]);
                        }
                    }
                }
                println!(
                    "{alpha} {beta}, R {r}: {} terms, {:.1e} and {:.1e}",
                    whole.terms, whole.rate, whole.g
                );
            }
        }
        println!("at most {:.0} and {:.0} times what is left out", worst[0], worst[1]);
        assert!(worst[0] < 1e4 && worst[1] < 1e4, "{worst:?}");
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
