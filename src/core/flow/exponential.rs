//! Exponentials `c e^{s (t − a)}`: integrals of their products, divided differences, without cancellation.

use nalgebra::Complex;

/// One exponential `c e^{s (t − a)}` with its growth `e^{s (b − a)}` over the interval.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Term {
    pub c: Complex<f64>,
    pub s: Complex<f64>,
    pub growth: Complex<f64>,
}

/// `e^z`; what would be a denormal number is zero.
pub(super) fn power(z: Complex<f64>) -> Complex<f64> {
    if z.re < -700.0 { Complex::default() } else { z.exp() }
}

/// `∫ e^{s t} dt` over an interval of length `h`, where `growth` is `e^{s h}`.
pub(super) fn integral(s: Complex<f64>, growth: Complex<f64>, h: f64) -> Complex<f64> {
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
}

/// `∫ Re(w x) Re(y)` and the like over an interval of length `h`: `½ Re ∫ (plain x y + mixed x ȳ)`.
pub(super) fn pair_integral(
    (plain, mixed): (Complex<f64>, Complex<f64>),
    x: &Term,
    y: &Term,
    h: f64,
) -> f64 {
    let straight = plain * x.c * y.c * integral(x.s + y.s, x.growth * y.growth, h);
    let (c, s, growth) = (y.c.conj(), y.s.conj(), y.growth.conj());
    let crossed = mixed * x.c * c * integral(x.s + s, x.growth * growth, h);
    0.5 * (straight + crossed).re
}

/// `∫ Re(x) Re(y)` over an interval of length `h`.
pub(super) fn product_integral(x: &Term, y: &Term, h: f64) -> f64 {
    let one = Complex::new(1.0, 0.0);
    pair_integral((one, one), x, y, h)
}

/// The divided difference `(e^{at} − e^{bt})/(a − b)`, exact for `a = b`.
pub(super) fn difference(a: Complex<f64>, b: Complex<f64>, t: f64) -> Complex<f64> {
    let x = (a - b) * (0.5 * t);
    if x.re.abs() > 300.0 {
        return (power(a * t) - power(b * t)) / (a - b);
    }
    let sinhc = if x.norm() < 1e-2 {
        let y = x * x;
        Complex::new(1.0, 0.0)
            + y / 6.0 * (Complex::new(1.0, 0.0) + y / 20.0 * (Complex::new(1.0, 0.0) + y / 42.0))
    } else {
        x.sinh() / x
    };
    ((a + b) * (0.5 * t)).exp() * sinhc * t
}
