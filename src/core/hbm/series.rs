//! Fourier series, and the roots of trigonometric polynomials.

use crate::flow::{Bernstein, Enclosure};

/// A polynomial that changes by less than so many units of rounding error of its size over an interval is flat there.
const FLAT: f64 = 4.0;

/// Which functions a series is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// `1, cos θ, cos 2θ, …` on half a period: reversible motions.
    Cosine,
    /// `1, cos θ, sin θ, cos 2θ, sin 2θ, …` on a whole period.
    Full,
}

/// A basis function: harmonic, and whether it is the sine.
pub type Function = (usize, bool);

impl Basis {
    /// Number of functions up to harmonic `n_h`.
    pub fn len(self, n_h: usize) -> usize {
        if self == Basis::Cosine { n_h + 1 } else { 2 * n_h + 1 }
    }

    /// The functions in their order.
    pub fn functions(self, n_h: usize) -> Vec<Function> {
        (0..self.len(n_h))
            .map(|i| match self {
                Basis::Cosine => (i, false),
                Basis::Full => (i.div_ceil(2), i > 0 && i % 2 == 0),
            })
            .collect()
    }

    /// Places of the cosine and, if there is one, of the sine of a harmonic.
    pub fn places(self, k: usize) -> (usize, Option<usize>) {
        match (self, k) {
            (Basis::Cosine, _) | (_, 0) => (k, None),
            (Basis::Full, _) => (2 * k - 1, Some(2 * k)),
        }
    }

    /// End of the interval on which the balance is made.
    pub fn end(self) -> f64 {
        if self == Basis::Cosine { std::f64::consts::PI } else { std::f64::consts::TAU }
    }

    /// Coefficients of the derivative by `θ` of those of a scalar function of the full basis.
    pub fn derivative(self, of: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; of.len()];
        for k in 1..=of.len() / 2 {
            let (cos, sin) = (2 * k - 1, 2 * k);
            all[cos] = k as f64 * of[sin];
            all[sin] = -(k as f64) * of[cos];
        }
        all
    }

    /// Norm of a function squared, over the interval of the basis.
    pub fn weight(self, (k, _): Function) -> f64 {
        let half = 0.5 * self.end();
        if k == 0 { 2.0 * half } else { half }
    }

    /// Values of the functions at `θ`.
    pub fn values(self, n_h: usize, theta: f64, out: &mut Vec<f64>) {
        out.clear();
        out.push(1.0);
        for k in 1..=n_h {
            let (sin, cos) = (k as f64 * theta).sin_cos();
            out.push(cos);
            if self == Basis::Full {
                out.push(sin);
            }
        }
    }
}

/// A vector-valued series: one row a function, one column a component.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The functions.
    pub basis: Basis,
    /// Highest harmonic `N_h`.
    pub n_h: usize,
    /// Number of components.
    pub n: usize,
    /// Coefficients, function by function.
    pub a: Vec<f64>,
}

impl Series {
    /// The zero series.
    pub fn zeros(basis: Basis, n_h: usize, n: usize) -> Series {
        Series { basis, n_h, n, a: vec![0.0; basis.len(n_h) * n] }
    }

    /// Coefficients of function `i`.
    pub fn of(&self, i: usize) -> &[f64] {
        &self.a[i * self.n..(i + 1) * self.n]
    }

    /// Coefficients of function `i`, to be changed.
    pub fn of_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.a[i * self.n..(i + 1) * self.n]
    }

    /// Coefficients of component `c`, function by function.
    pub fn component(&self, c: usize) -> Vec<f64> {
        self.a.iter().skip(c).step_by(self.n).copied().collect()
    }

    /// The same series with another number of harmonics.
    pub fn with_harmonics(&self, n_h: usize) -> Series {
        let mut other = Series::zeros(self.basis, n_h, self.n);
        let shared = self.a.len().min(other.a.len());
        other.a[..shared].copy_from_slice(&self.a[..shared]);
        other
    }

    /// Value and derivative by `θ`.
    pub fn at(&self, theta: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut x, mut dx) = (vec![0.0; self.n], vec![0.0; self.n]);
        for (i, (k, is_sine)) in self.basis.functions(self.n_h).into_iter().enumerate() {
            let (sin, cos) = (k as f64 * theta).sin_cos();
            let (f, df) = if is_sine { (sin, k as f64 * cos) } else { (cos, -(k as f64) * sin) };
            for ((x, dx), c) in x.iter_mut().zip(&mut dx).zip(self.of(i)) {
                *x += f * c;
                *dx += df * c;
            }
        }
        (x, dx)
    }

    /// Second derivative by `θ`.
    pub fn second(&self, theta: f64, out: &mut [f64]) {
        out.fill(0.0);
        for (i, (k, is_sine)) in self.basis.functions(self.n_h).into_iter().enumerate() {
            let k = k as f64;
            let (sin, cos) = (k * theta).sin_cos();
            let f = -k * k * if is_sine { sin } else { cos };
            out.iter_mut().zip(self.of(i)).for_each(|(x, c)| *x += f * c);
        }
    }
}

/// A scalar trigonometric polynomial: coefficients of the functions of a basis.
#[derive(Debug, Clone)]
pub struct Polynomial {
    cos: Vec<f64>,
    sin: Vec<f64>,
    fourth: f64,
    /// Sum of the coefficients' magnitudes.
    pub size: f64,
}

impl Polynomial {
    /// From coefficients in the order of a basis.
    pub fn new(basis: Basis, n_h: usize, coefficients: &[f64]) -> Polynomial {
        let (mut cos, mut sin) = (vec![0.0; n_h + 1], vec![0.0; n_h + 1]);
        for ((k, is_sine), c) in basis.functions(n_h).into_iter().zip(coefficients) {
            if is_sine { sin[k] = *c } else { cos[k] = *c }
        }
        Polynomial::of_harmonics(cos, sin)
    }

    fn of_harmonics(cos: Vec<f64>, sin: Vec<f64>) -> Polynomial {
        let n_h = cos.len() - 1;
        let amplitude = |k: usize| cos[k].hypot(sin[k]);
        let fourth = (1..=n_h).map(|k| (k as f64).powi(4) * amplitude(k)).sum();
        let size = (0..=n_h).map(amplitude).sum();
        Polynomial { cos, sin, fourth, size }
    }

    /// Highest harmonic.
    pub fn harmonics(&self) -> usize {
        self.cos.len() - 1
    }

    /// `c + factor f`
    pub fn affine(&self, factor: f64, c: f64) -> Polynomial {
        let scaled = |x: &[f64]| -> Vec<f64> { x.iter().map(|x| factor * x).collect() };
        let mut cos = scaled(&self.cos);
        cos[0] += c;
        Polynomial::of_harmonics(cos, scaled(&self.sin))
    }

    /// `f′`
    pub fn derivative(&self) -> Polynomial {
        let times = |sign: f64, x: &[f64]| -> Vec<f64> {
            x.iter().enumerate().map(|(k, x)| sign * k as f64 * x).collect()
        };
        Polynomial::of_harmonics(times(1.0, &self.sin), times(-1.0, &self.cos))
    }

    /// Value and derivative, by the recurrence of `e^{ikθ}`.
    pub fn at(&self, theta: f64) -> (f64, f64) {
        let (s1, c1) = theta.sin_cos();
        let (mut c, mut s) = (1.0, 0.0);
        let (mut value, mut slope) = (0.0, 0.0);
        for k in 0..self.cos.len() {
            value += self.cos[k] * c + self.sin[k] * s;
            slope += k as f64 * (self.sin[k] * c - self.cos[k] * s);
            (c, s) = (c * c1 - s * s1, s * c1 + c * s1);
        }
        (value, slope)
    }

    /// The first `θ` in `(a, b]` at which the polynomial falls below `−slack`, then polished to its root. A tangency before it that stays undecided
    /// when nothing is left to halve is counted.
    pub fn first_crossing(&self, a: f64, b: f64, slack: f64, undecided: &mut usize) -> Option<f64> {
        self.first_below(a, b, slack, undecided).map(|t| self.polish(t))
    }

    /// A point of `[a, b]` at which the polynomial is below `−slack`.
    pub fn below(&self, a: f64, b: f64, slack: f64) -> Option<f64> {
        self.first_below(a, b, slack, &mut 0)
    }

    /// A point right behind the first place at which the polynomial falls below `−slack`: proved by bounds of the fourth derivative on intervals that are halved
    /// where nothing can be said.
    fn first_below(&self, a: f64, b: f64, slack: f64, undecided: &mut usize) -> Option<f64> {
        // |p| ≤ size
        if self.size <= slack {
            return None;
        }
        let width = std::f64::consts::PI / (2.0 * self.cos.len() as f64);
        let parts = ((b - a) / width).ceil().max(1.0);
        let step = (b - a) / parts;
        let mut at_left = self.at(a);
        for j in 0..parts as usize {
            let left = a + j as f64 * step;
            let right = if j + 1 == parts as usize { b } else { left + step };
            let at_right = self.at(right);
            let known = *undecided;
            let ends = (at_left, at_right);
            let found = self.crossing_in(left, right, ends, slack, 0, undecided);
            if found.is_some() {
                return found;
            }
            // neighbours that cannot be told apart are one touch
            *undecided = (*undecided).min(known + 1);
            at_left = at_right;
        }
        None
    }

    fn crossing_in(
        &self,
        a: f64,
        b: f64,
        (at_a, at_b): ((f64, f64), (f64, f64)),
        slack: f64,
        depth: u32,
        undecided: &mut usize,
    ) -> Option<f64> {
        if at_a.0 < -slack {
            return Some(a);
        }
        let e = Enclosure::hermite(at_a, at_b, b - a, self.fourth);
        let polynomial: &Bernstein = &e.polynomial;
        if polynomial.min() - e.error + slack > 0.0 {
            return None;
        }
        // flat to rounding: no halving tells more
        let is_flat =
            polynomial.max() - polynomial.min() + 2.0 * e.error <= FLAT * f64::EPSILON * self.size;
        if depth > 30 || is_flat || !polynomial.min().is_finite() {
            let crossed = (at_b.0 < -slack).then_some(b);
            *undecided += usize::from(crossed.is_none());
            return crossed;
        }
        let middle = 0.5 * (a + b);
        let at_middle = self.at(middle);
        let (left, right) = ((at_a, at_middle), (at_middle, at_b));
        self.crossing_in(a, middle, left, slack, depth + 1, undecided)
            .or_else(|| self.crossing_in(middle, b, right, slack, depth + 1, undecided))
    }

    /// Newton's method from a point just behind the root.
    fn polish(&self, mut t: f64) -> f64 {
        for _ in 0..3 {
            let (h, slope) = self.at(t);
            let step = h / slope;
            if !step.is_finite() || step.abs() > 1e-3 {
                break;
            }
            t -= step;
        }
        t
    }
}

/// Integrals of products of basis functions from 0 to `θ`, from a table of `∫ cos mθ` and `∫ sin mθ`.
#[derive(Debug)]
pub struct Integrals {
    cos: Vec<f64>,
    sin: Vec<f64>,
}

impl Integrals {
    /// The table for products of harmonics up to `n_h`.
    pub fn new(n_h: usize, theta: f64) -> Integrals {
        let (mut cos, mut sin) = (vec![theta], vec![0.0]);
        for m in 1..=2 * n_h {
            let m = m as f64;
            let (s, c) = (m * theta).sin_cos();
            cos.push(s / m);
            sin.push((1.0 - c) / m);
        }
        Integrals { cos, sin }
    }

    /// `∫₀^θ f_i f_j dθ`.
    pub fn product(&self, (k, sine_k): Function, (l, sine_l): Function) -> f64 {
        let (c, s) = (|m: usize| self.cos[m], |m: usize| self.sin[m]);
        let odd = |a: usize, b: usize| if a >= b { s(a - b) } else { -s(b - a) };
        match (sine_k, sine_l) {
            (false, false) => 0.5 * (c(k.abs_diff(l)) + c(k + l)),
            (true, true) => 0.5 * (c(k.abs_diff(l)) - c(k + l)),
            (true, false) => 0.5 * (s(k + l) + odd(k, l)),
            (false, true) => 0.5 * (s(k + l) - odd(k, l)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is nothing, or does not leave its bound by more than rounding errors, ends the search: halved to the last digit it would be looked at a billion times.
    #[test]
    fn what_is_flat_ends_the_search() {
        let mut undecided = 0;
        let nothing = Polynomial::new(Basis::Full, 7, &[0.0; 15]);
        assert_eq!(nothing.first_crossing(0.0, 6.0, 0.0, &mut undecided), None);
        assert_eq!(undecided, 0);
        for ripple in [0.0, 1e-19] {
            let mut coefficients = [0.0; 15];
            (coefficients[0], coefficients[9]) = (-1e-3, ripple);
            let flat = Polynomial::new(Basis::Full, 7, &coefficients).affine(1.0, 1.0);
            assert_eq!(flat.first_crossing(0.0, 6.0, -0.999, &mut undecided), None);
            // one for each part that the search begins with
            assert!((1..=31).contains(&undecided), "{ripple}: {undecided}");
            undecided = 0;
        }
    }

    #[test]
    fn integrals_of_products() {
        let functions = Basis::Full.functions(4);
        let theta = 2.3;
        for &f in &functions {
            for &g in &functions {
                let value = |(k, is_sine): Function, t: f64| {
                    let x = k as f64 * t;
                    if is_sine { x.sin() } else { x.cos() }
                };
                let n = 4000;
                let h = theta / f64::from(n);
                let simpson: f64 = (0..=n)
                    .map(|i| {
                        let t = f64::from(i) * h;
                        let w = if i == 0 || i == n {
                            1.0
                        } else if i % 2 == 1 {
                            4.0
                        } else {
                            2.0
                        };
                        w * value(f, t) * value(g, t)
                    })
                    .sum::<f64>()
                    * h
                    / 3.0;
                assert!(
                    (Integrals::new(4, theta).product(f, g) - simpson).abs() < 1e-10,
                    "{f:?} {g:?}"
                );
            }
        }
    }

    #[test]
    fn close_roots_are_not_missed() {
        // cos θ − cos(θ₀) squared, lowered by 1e-12: two crossings 2e-6 apart
        let c0 = 1.1f64.cos();
        // (cos θ − c0)² = ½ + c0² − 2 c0 cos θ + ½ cos 2θ
        let p = Polynomial::new(Basis::Cosine, 2, &[0.5 + c0 * c0 - 1e-12, -2.0 * c0, 0.5]);
        let t = p.first_crossing(0.0, 3.0, 1e-15, &mut 0).unwrap();
        assert!((t - 1.1).abs() < 2e-6, "{t}");
        let q = Polynomial::new(Basis::Cosine, 2, &[0.5 + c0 * c0 + 1e-12, -2.0 * c0, 0.5]);
        assert_eq!(q.first_crossing(0.0, 3.0, 1e-15, &mut 0), None);
    }

    #[test]
    fn what_cannot_be_decided_is_counted() {
        let p = Polynomial::new(Basis::Cosine, 2, &[1.0, f64::NAN, 0.5]);
        let mut undecided = 0;
        assert_eq!(p.first_crossing(0.0, 3.0, 1e-15, &mut undecided), None);
        assert!(undecided > 0);
        // three touches of −slack that rounding cannot tell from crossings: (1 − cos 3θ)/2 − slack, with a hair less slack
        let slack = 1e-3;
        let touching = [0.5 - slack * (1.0 + 1e-13), 0.0, 0.0, -0.5];
        let p = Polynomial::new(Basis::Cosine, 3, &touching);
        let mut undecided = 0;
        let found = p.first_crossing(0.3, 6.0, slack, &mut undecided);
        assert!(found.is_some() || undecided > 0, "{found:?}");
    }
}
