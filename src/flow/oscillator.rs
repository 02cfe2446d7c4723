//! One mode in time: `q̈ + 2c q̇ + ω² q = F`, under- and over-damped, rigid, through resonance.

use nalgebra::Complex;

use super::exponential::difference;

/// Positive nodes and weights of the 10-point Gauss–Legendre rule on [−1, 1].
pub const GAUSS10: [(f64, f64); 5] = [
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

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
        self.basis_of(t, sin, cos)
    }

    /// The basis at `t`, where sine and cosine of `√(ω² − c²) t` are at hand (of modes that oscillate).
    pub(super) fn basis_of(&self, t: f64, sin: f64, cos: f64) -> Basis {
        let c = self.c;
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
            let decay = if c == 0.0 { 1.0 } else { decay(-c * t) };
            (decay * sin / w, decay * (cos - c * sin / w))
        } else {
            let w = (-d).sqrt();
            let [upper, lower] = self.rates();
            let (a, b) = (decay(upper * t), decay(lower * t));
            ((a - b) / (2.0 * w), (upper * a - lower * b) / (2.0 * w))
        };
        Basis { s, ds, c: ds + 2.0 * c * s }
    }

    /// `∂S/∂c` and `∂S′/∂c` at `t`; then `∂C/∂c = ∂S′/∂c + 2S + 2c ∂S/∂c`.
    ///
    /// With `d = ω² − c²`, `S = e^{−ct} f(d)` where `f = sin(√d t)/√d`, and `∂d/∂c = −2c`.
    pub fn basis_by_damping(&self, t: f64) -> (f64, f64) {
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

    /// Response from rest to a unit constant force, and its rate (for `ω = 0`; else the static
    /// displacement serves).
    pub(super) fn rigid_response(&self, t: f64) -> (f64, f64) {
        let s = self.basis(t).s;
        let x = 2.0 * self.c * t;
        let z = if x.abs() < 1e-3 {
            0.5 * t * t * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))
        } else {
            (t - s) / (2.0 * self.c)
        };
        (z, s)
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

    /// Response from rest to `e^{iΩt}` and its rate: the divided difference of `e^{st}` at `iΩ, λ+, λ−`.
    pub(super) fn response_from_rest(&self, omega: f64, t: f64) -> [Complex<f64>; 2] {
        let force = Complex::new(0.0, omega);
        let [near, far] = self.roots();
        let s = difference(near, far, t);
        let e = (difference(force, near, t) - s) / (force - far);
        [e, force * e + s]
    }
}

/// `e^x`; what would be a denormal number is zero, and costs nothing.
fn decay(x: f64) -> f64 {
    if x < -700.0 { 0.0 } else { x.exp() }
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
}
