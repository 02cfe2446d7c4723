//! Sines, cosines and exponentials of many arguments at once, in loops that the compiler turns into vector instructions.
//!
//! Reduction by a two-part π/2 (Cody and Waite) and the polynomials of fdlibm on [−π/4, π/4]: absolute error below
//! 2·10⁻¹⁶ for `|x| ≤ 10⁶`; larger arguments go to the standard library.

/// π/2 to 33 bits, and the rest of it.
const HALF_PI: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
/// Adding this rounds to an integer, which then stands in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// Beyond this the reduction is no longer exact.
const LARGEST: f64 = 1e6;

/// `sin[i], cos[i] ← sin x[i], cos x[i]`.
pub fn sin_cos(x: &[f64], sin: &mut [f64], cos: &mut [f64]) {
    if x.iter().any(|x| x.abs() > LARGEST || x.is_nan()) {
        for ((x, s), c) in x.iter().zip(sin).zip(cos) {
            (*s, *c) = x.sin_cos();
        }
        return;
    }
    for ((&x, sin), cos) in x.iter().zip(sin.iter_mut()).zip(cos.iter_mut()) {
        let rounded = x * std::f64::consts::FRAC_2_PI + ROUND;
        let quadrant = rounded.to_bits();
        let k = rounded - ROUND;
        let r = (x - k * HALF_PI[0]) - k * HALF_PI[1];
        let z = r * r;
        let s = -1.666_666_666_666_663_2e-1
            + z * (8.333_333_333_322_49e-3
                + z * (-1.984_126_982_985_795e-4
                    + z * (2.755_731_370_707_006_8e-6
                        + z * (-2.505_076_025_340_686_4e-8 + z * 1.589_690_995_211_55e-10))));
        let c = 4.166_666_666_666_66e-2
            + z * (-1.388_888_888_887_411e-3
                + z * (2.480_158_728_947_673e-5
                    + z * (-2.755_731_435_139_066_3e-7
                        + z * (2.087_572_321_298_175e-9 + z * -1.135_964_755_778_819_5e-11))));
        let s = r + r * z * s;
        let c = 1.0 - 0.5 * z + z * z * c;
        // odd quadrants exchange the two; signs by the second bit
        let odd = 0u64.wrapping_sub(quadrant & 1);
        let (sb, cb) = (s.to_bits(), c.to_bits());
        let sine = (sb & !odd) | (cb & odd);
        let cosine = (cb & !odd) | (sb & odd);
        *sin = f64::from_bits(sine ^ ((quadrant & 2) << 62));
        *cos = f64::from_bits(cosine ^ (((quadrant + 1) & 2) << 62));
    }
}

/// log 2 to 32 bits, and the rest of it.
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// Powers of `e` beyond these are zero (they would be denormal), or go to the standard library.
const SMALLEST: f64 = -700.0;

/// `y[i] ← e^{x[i]}`, to the last bit or so; zero below [`SMALLEST`].
///
/// `e^x = 2^k e^r` with `|r| ≤ ln 2/2`, and Taylor's polynomial of order 13, which leaves out 4·10⁻¹⁸.
pub fn exponentials(x: &[f64], y: &mut [f64]) {
    if x.iter().any(|x| *x > 700.0 || x.is_nan()) {
        x.iter().zip(y).for_each(|(x, y)| *y = if *x < SMALLEST { 0.0 } else { x.exp() });
        return;
    }
    for (&x, y) in x.iter().zip(y.iter_mut()) {
        let within = x.max(SMALLEST);
        let rounded = within * std::f64::consts::LOG2_E + ROUND;
        let k = rounded - ROUND;
        let r = (within - k * LN_2[0]) - k * LN_2[1];
        let p = 1.0 / 6_227_020_800.0;
        let p = 1.0 / 479_001_600.0 + r * p;
        let p = 1.0 / 39_916_800.0 + r * p;
        let p = 1.0 / 3_628_800.0 + r * p;
        let p = 1.0 / 362_880.0 + r * p;
        let p = 1.0 / 40_320.0 + r * p;
        let p = 1.0 / 5_040.0 + r * p;
        let p = 1.0 / 720.0 + r * p;
        let p = 1.0 / 120.0 + r * p;
        let p = 1.0 / 24.0 + r * p;
        let p = 1.0 / 6.0 + r * p;
        let p = 0.5 + r * p;
        let p = 1.0 + (r + r * r * p);
        // the integer in the low bits, moved to the exponent
        let power = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
        *y = if x < SMALLEST { 0.0 } else { p * power };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_agree_with_the_standard_library() {
        let x: Vec<f64> = (-200_000..200_000)
            .map(|k| f64::from(k) * 3.4e-3 + 1e-9 * f64::from(k % 1000))
            .chain([0.0, -0.0, 1e-300, -1e-9, 700.0, -700.0, -701.0, -1e9, f64::NEG_INFINITY])
            .chain([0.5, -0.5].map(|k| k * std::f64::consts::LN_2))
            .collect();
        let mut y = vec![0.0; x.len()];
        exponentials(&x, &mut y);
        for (x, y) in x.iter().zip(&y) {
            let exact = if *x < SMALLEST { 0.0 } else { x.exp() };
            assert!((y - exact).abs() <= 3.4e-16 * exact, "{x}: {y} {exact}");
        }
        let mut y = [0.0; 3];
        exponentials(&[0.0, -0.0, -1.0], &mut y);
        assert_eq!(y[..2], [1.0, 1.0]);
        exponentials(&[710.0, f64::NAN, -1e3], &mut y);
        assert!(y[0] == f64::exp(710.0) && y[1].is_nan() && y[2] == 0.0);
    }

    #[test]
    fn agrees_with_the_standard_library() {
        let x: Vec<f64> = (-200_000..200_000)
            .map(|k| f64::from(k) * 0.37 + 1e-7 * f64::from(k % 1000))
            .chain([0.0, -0.0, 1e-300, 1e6, -1e6, std::f64::consts::FRAC_PI_4, 1e-9])
            .collect();
        let (mut s, mut c) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        sin_cos(&x, &mut s, &mut c);
        for ((x, s), c) in x.iter().zip(&s).zip(&c) {
            let (es, ec) = x.sin_cos();
            assert!((s - es).abs() < 2.3e-16 && (c - ec).abs() < 2.3e-16, "{x}: {s} {es} {c} {ec}");
        }
        let (mut s, mut c) = ([0.0; 2], [0.0; 2]);
        sin_cos(&[1e9, 2.0], &mut s, &mut c);
        assert_eq!((s[0], c[1]), (1e9f64.sin(), 2f64.cos()));
    }
}
