//! One mode in time: `q̈ + 2c q̇ + ω² q = F`, under- and over-damped, rigid, through resonance.

use nalgebra::Complex;

use super::exponential::{Term, power};

/// Positive nodes and weights of the 10-point Gauss–Legendre rule on [−1, 1].
pub(crate) const GAUSS10: [(f64, f64); 5] = [
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
        let (sin, cos) = (self.discriminant().max(0.0).sqrt() * t).sin_cos();
        self.basis_of(t, (sin, cos, decay(-self.c * t)))
    }

    /// The basis at `t`, where sine and cosine of `√(ω² − c²) t` and `e^{−ct}` are at hand (of modes that oscillate).
    pub(super) fn basis_of(&self, t: f64, (sin, cos, decayed): (f64, f64, f64)) -> Basis {
        let c = self.c;
        let d = self.discriminant();
        let x = d * t * t;
        let (s, ds) = if x.abs() < 1e-4 {
            // sin(√x)/√x and cos √x, for both signs of x, truncated below rounding
            let sinc = 1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0));
            let cos = 1.0 - x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0));
            (decayed * t * sinc, decayed * (cos - c * t * sinc))
        } else if d > 0.0 {
            let w = d.sqrt();
            (decayed * sin / w, decayed * (cos - c * sin / w))
        } else {
            // the slow rate by itself: the difference of both loses nothing
            let [upper, lower] = self.rates();
            let grown = decay(upper * t);
            let s = -grown * ((lower - upper) * t).exp_m1() / (upper - lower);
            return Basis { s, ds: decay(lower * t) + upper * s, c: grown - upper * s };
        };
        Basis { s, ds, c: ds + 2.0 * c * s }
    }

    /// `∂S/∂c` and `∂S′/∂c` at `t`; then `∂C/∂c = ∂S′/∂c + 2S + 2c ∂S/∂c`.
    ///
    /// With `d = ω² − c²`, `S = e^{−ct} f(d)` where `f = sin(√d t)/√d`, and `∂d/∂c = −2c`.
    pub(crate) fn basis_by_damping(&self, t: f64) -> (f64, f64) {
        let c = self.c;
        let d = self.discriminant();
        let x = d * t * t;
        let Basis { s, ds, .. } = self.basis(t);
        // e^{−ct} cos(√d t), and e^{−ct} ∂f/∂d
        let cos = ds + c * s;
        let by_d = if x.abs() < 0.5 {
            // Σ_k (−1)^k k x^{k−1}/(2k+1)!, k ≥ 1
            let mut sum = 0.0;
            let mut factor = -1.0 / 6.0;
            for k in 1..12 {
                let k = f64::from(k);
                sum += k * factor;
                factor *= -x / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
            }
            (-c * t).exp() * t.powi(3) * sum
        } else {
            (t * cos - s) / (2.0 * d)
        };
        let by_c = -t * s - 2.0 * c * by_d;
        (by_c, -t * cos + c * t * s - s - c * by_c)
    }

    /// Both real rates of a mode that does not oscillate, the upper one first, without cancellation.
    fn rates(&self) -> [f64; 2] {
        let w = (-self.discriminant()).sqrt();
        let large = -(self.c + w.copysign(self.c));
        let small = self.omega * self.omega / large;
        if self.c >= 0.0 { [small, large] } else { [large, small] }
    }

    /// The roots `λ±` of the characteristic equation.
    pub(super) fn roots(&self) -> [Complex<f64>; 2] {
        let d = self.discriminant();
        if d >= 0.0 {
            let w = d.sqrt();
            [Complex::new(-self.c, w), Complex::new(-self.c, -w)]
        } else {
            self.rates().map(|rate| Complex::new(rate, 0.0))
        }
    }

    /// Response from rest to `e^{iΩt}`, `p = ∫₀ᵗ S(t − x) e^{iΩx} dx`, and its rate `iΩp + S`; `Ω = 0`: a constant force.
    ///
    /// `p = e^{iΩt} [E(λ₊ − iΩ) − E(λ₋ − iΩ)]/(λ₊ − λ₋)` with `E(μ) = (e^{μt} − 1)/μ`: rigid motions and exact resonance are no exceptions. Where
    /// the roots are near each other, the integral itself.
    pub(super) fn response_from_rest(&self, omega: f64, t: f64) -> [Complex<f64>; 2] {
        let force = Complex::new(0.0, omega);
        let [near, far] = self.roots();
        let p = if ((near - far) * t).norm() < 0.5 {
            self.folded(omega, t)
        } else {
            let turn = Complex::from_polar(1.0, omega * t);
            turn * (grown(near - force, t) - grown(far - force, t)) / (near - far)
        };
        [p, force * p + self.basis(t).s]
    }

    /// `∫₀ᵗ S(τ) e^{iΩ(t − τ)} dτ` by Gauss–Legendre.
    fn folded(&self, omega: f64, t: f64) -> Complex<f64> {
        let panels = (0.5 * t * (omega + self.c.abs())).ceil().max(1.0);
        let h = t / panels;
        let mut sum = Complex::default();
        for j in 0..panels as usize {
            let middle = (j as f64 + 0.5) * h;
            for (x, weight) in GAUSS10 {
                for tau in [middle - 0.5 * h * x, middle + 0.5 * h * x] {
                    let s = 0.5 * h * weight * self.basis(tau).s;
                    sum += Complex::from_polar(s, omega * (t - tau));
                }
            }
        }
        sum
    }

    /// The free motion from `(q, q̇)` as a sum of two `Re(c e^{s(t − a)})` from `a` on, where the roots are well apart.
    pub(super) fn free(&self, (q, v): (f64, f64), a: f64, h: f64) -> Option<[Term; 2]> {
        let d = self.discriminant();
        if !self.is_apart() {
            return None;
        }
        let term = |c: Complex<f64>, s: Complex<f64>| Term {
            c: c * power(s * a),
            s,
            growth: power(s * h),
        };
        let [s, r] = self.roots();
        if d > 0.0 {
            let amplitude = Complex::new(q, -(v + self.c * q) / d.sqrt());
            return Some([term(amplitude, s), Term::default()]);
        }
        // q = c₁ e^{st} + c₂ e^{rt}, both real
        let between = s - r;
        Some([term((v - r * q) / between, s), term((s * q - v) / between, r)])
    }

    /// Whether the roots are far enough from each other for sums of their exponentials.
    fn is_apart(&self) -> bool {
        self.omega > 0.0 && self.discriminant().abs() > 0.01 * self.omega * self.omega
    }

    /// A bound of the derivative of the order `order` of the free motion from `(q, q̇)`, from `from` to `until` (theory §12, H2).
    pub(super) fn free_bound(
        &self,
        (q, v): (f64, f64),
        order: i32,
        (from, until): (f64, f64),
    ) -> f64 {
        let Oscillator { omega, c } = *self;
        // what decays is largest at the start, what is fed at the end
        let largest = |rate: f64| decay(rate * if rate > 0.0 { until } else { from });
        let d = self.discriminant();
        let [s, r] = self.roots();
        if self.is_apart() && d > 0.0 {
            return q.hypot((v + c * q) / d.sqrt()) * omega.powi(order) * largest(-c);
        }
        if self.is_apart() {
            let (s, r) = (s.re, r.re);
            let parts = [((v - r * q) / (s - r), s), ((s * q - v) / (s - r), r)];
            return parts.iter().map(|&(z, x)| z.abs() * x.abs().powi(order) * largest(x)).sum();
        }
        if omega == 0.0 {
            // v (1 − e^{−2ct})/(2c): derivatives fall off
            let (v, grown) = (v.abs(), largest(-2.0 * c));
            return match order {
                0 => q.abs() + v * until * grown.max(1.0),
                _ => v * (2.0 * c).abs().powi(order - 1) * grown,
            };
        }
        // nearly critical: x = |q| + |q̇|/ω falls at least like 2 (1 + 1.2cτ) e^{−slow τ} and never exceeds twice its first value; derivatives by
        // the equation of motion, |q̈| ≤ ω²|q| + 2c|q̇| …
        let (q, v) = (q.abs(), v.abs());
        if c < 0.0 {
            // fed: time runs backwards in the bound
            let rate = -c + (-d).max(0.0).sqrt();
            let x = 2.0 * (q + v / omega) * (1.0 - 1.2 * c * until) * (rate * until).exp();
            return x * (omega - 2.0 * c).powi(order);
        }
        let slow = if d > 0.0 { c } else { omega * omega / (c + (-d).sqrt()) };
        let decay = (2.0 * (1.0 + 1.2 * c * from) * (-slow * from).exp()).min(2.0);
        (q + v / omega) * decay * (2.0 * c + omega).powi(order)
    }

    /// The same for the response from rest to `f e^{iΩt}`, until `until` (theory §12, H2).
    ///
    /// `p = ∫₀ᵗ S(x) e^{iΩ(t−x)} dx`, so `p⁗ = S‴ + iΩS″ − Ω²S′ − iΩ³S + Ω⁴p` and likewise in every order, and `|p| ≤ ∫|S| ≤ min(t max|S|, ½t² max|S′|)`: with
    /// what grows where `c < 0`.
    pub(super) fn rest_bound(&self, omega: f64, f: f64, until: f64, order: i32) -> f64 {
        let s = |k: i32| self.free_bound((0.0, 1.0), k, (0.0, until));
        let size = until * s(0).min(0.5 * until * s(1));
        f.abs() * (0..order).fold(size, |bound, k| omega * bound + s(k))
    }

    /// The steady response `P` to `e^{iΩt}`, where it has no small denominator.
    pub(super) fn steady(&self, omega: f64) -> Option<Complex<f64>> {
        let (o, w) = (self.omega, omega);
        let denominator = Complex::new((o - w) * (o + w), 2.0 * self.c * w);
        let near = denominator.norm() < RESONANCE * o.max(w).powi(2);
        (!near).then(|| Complex::new(1.0, 0.0) / denominator)
    }
}

/// `(e^{μt} − 1)/μ`, `t` for `μ = 0`.
fn grown(mu: Complex<f64>, t: f64) -> Complex<f64> {
    let z = mu * t;
    if z == Complex::default() {
        return Complex::new(t, 0.0);
    }
    let (sin, cos) = z.im.sin_cos();
    let half = (0.5 * z.im).sin();
    Complex::new(z.re.exp_m1() * cos - 2.0 * half * half, decay(z.re) * sin) / mu
}

/// `e^x`; what would be a denormal number is zero, and costs nothing.
fn decay(x: f64) -> f64 {
    match x {
        // undamped modes ask at every step
        0.0 => 1.0,
        x if x < -700.0 => 0.0,
        x => x.exp(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Under-, over- and critically damped, fed, with many time constants: against differences of the closed form.
    #[test]
    fn derivatives_by_damping_are_those_of_the_basis() {
        for (omega, c) in [
            (1.5, -0.05),
            (1.5, 0.2),
            (1.5, 1.5),
            (1.5, 1.501),
            (1.5, 4.0),
            (0.3, -0.4),
            (40.0, 90.0),
        ] {
            for t in [0.01, 0.3, 2.0] {
                let h = 1e-5 * omega;
                let at = |c: f64| Oscillator { omega, c }.basis(t);
                let (up, down) = (at(c + h), at(c - h));
                let (s, ds) = Oscillator { omega, c }.basis_by_damping(t);
                let scale = t * at(c).s.abs() + 1e-9;
                assert!(((up.s - down.s) / (2.0 * h) - s).abs() < 1e-6 * scale, "{omega} {c} {t}");
                let scale = at(c).s.abs() + t * at(c).ds.abs() + 1e-9;
                assert!(
                    ((up.ds - down.ds) / (2.0 * h) - ds).abs() < 1e-6 * scale,
                    "{omega} {c} {t}"
                );
            }
        }
    }

    /// Derivatives 0 … 4 from the first two, by `x″ = f − 2cx′ − ω²x`; `f` and its derivatives are those of `size e^{iΩt}`.
    fn derivatives(
        mode: &Oscillator,
        first: [Complex<f64>; 2],
        force: Complex<f64>,
        load: f64,
    ) -> [f64; 5] {
        let mut x = vec![first[0], first[1]];
        for k in 0..3u32 {
            let f = force * Complex::new(0.0, load).powu(k);
            let k = k as usize;
            x.push(f - x[k + 1] * (2.0 * mode.c) - x[k] * (mode.omega * mode.omega));
        }
        [0, 1, 2, 3, 4].map(|k| x[k].norm())
    }

    /// Bounds of free and of forced motions against a dense sampling of the motions: random modes of both signs of `c`, rigid, critical, overdamped; every
    /// bound holds, and none is idle.
    #[test]
    fn bounds_hold_for_damped_and_for_fed_modes() {
        let mut state = 7u64;
        let mut random = |a: f64, b: f64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            a + (b - a) * (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut fed = 0;
        for trial in 0..1500 {
            let omega = match trial % 5 {
                0 => 0.0,
                _ => 10f64.powf(random(-1.0, 1.0)),
            };
            let share = match trial % 3 {
                0 => random(-0.3, 0.3),
                1 => random(-1.0, 1.0).signum() * (1.0 + random(-1e-6, 1e-6)),
                _ => random(-3.0, 3.0),
            };
            let mode = Oscillator { omega, c: share * if omega > 0.0 { omega } else { 1.0 } };
            // fed modes grow by no more than e⁴⁰
            let until = random(0.1, 6.0) / (omega + mode.c.abs()).max(1e-3);
            let from = random(0.0, 1.0) * until;
            let load = 10f64.powf(random(-1.0, 1.0)) * omega.max(0.5);
            let (q, v) = (random(-1.0, 1.0), random(-1.0, 1.0) * omega.max(1.0));
            fed += usize::from(mode.c < 0.0);
            let free = [0, 1, 2, 3, 4].map(|k| mode.free_bound((q, v), k, (from, until)));
            let of_rest = |load: f64| [0, 4].map(|order| mode.rest_bound(load, 1.3, until, order));
            let [size, fourth] = of_rest(load);
            let constant = of_rest(0.0);
            for j in 0..=400 {
                let part = j as f64 / 400.0;
                let t = from + part * (until - from);
                let b = mode.basis(t);
                let x = q * b.c + v * b.s;
                let rate = v * b.ds - q * omega * omega * b.s;
                let first = [x, rate].map(Complex::from);
                let most = derivatives(&mode, first, Complex::default(), 0.0);
                for (k, (most, bound)) in most.iter().zip(free).enumerate() {
                    let what = format!("free {mode:?}, order {k} at {t} in {from} … {until}");
                    assert!(*most <= bound * (1.0 + 1e-9) + 1e-12, "{what}: {most} {bound}");
                }
                let t = part * until;
                let turn = Complex::from_polar(1.3, load * t);
                let first = mode.response_from_rest(load, t).map(|p| p * 1.3);
                let most = derivatives(&mode, first, turn, load);
                let what = format!("forced {mode:?}, {load} at {t} until {until}");
                let [at_rest, after] = mode.response_from_rest(0.0, t).map(|p| p * 1.3);
                let steady = derivatives(&mode, [at_rest, after], Complex::from(1.3), 0.0);
                for (most, bound) in [
                    (most[0], size),
                    (most[4], fourth),
                    (steady[0], constant[0]),
                    (steady[4], constant[1]),
                ] {
                    let rounding = 1e-10 * (1.3 * load * load + 1.3 * omega * omega);
                    assert!(most <= bound * (1.0 + 1e-9) + rounding, "{what}: {most} {bound}");
                }
            }
        }
        assert!(fed > 500, "{fed}");
    }
}
