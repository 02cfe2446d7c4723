//! Polynomials on an interval in Bernstein form: ranges, restrictions, derivatives.
//!
//! The coefficients bound the polynomial from below and above, and a restriction to a smaller interval (de
//! Casteljau) tightens the bound: what the certified search for switches needs. All operations are convex combinations.

/// Largest degree.
pub(crate) const MAX_DEGREE: usize = 8;

/// `Σ c_i C(n,i) θ^i (1−θ)^(n−i)`, `θ ∈ [0, 1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bernstein {
    degree: usize,
    c: [f64; MAX_DEGREE + 1],
}

impl Bernstein {
    /// A constant.
    pub fn constant(value: f64) -> Self {
        let mut c = [0.0; MAX_DEGREE + 1];
        c[0] = value;
        Bernstein { degree: 0, c }
    }

    /// From its coefficients.
    pub fn new(coefficients: &[f64]) -> Self {
        let mut c = [0.0; MAX_DEGREE + 1];
        c[..coefficients.len()].copy_from_slice(coefficients);
        Bernstein { degree: coefficients.len() - 1, c }
    }

    /// The nested form `F₀ + θ(F₁ + (1−θ)(F₂ + θ(F₃ + …)))` of Runge–Kutta dense outputs.
    pub(crate) fn from_nested(f: &[f64]) -> Self {
        let last = f.len() - 1;
        let mut p = Bernstein::constant(f[last]);
        for k in (0..last).rev() {
            p = if k % 2 == 0 { p.times_theta() } else { p.times_one_minus_theta() };
            p.add_constant(f[k]);
        }
        p
    }

    /// Coefficients.
    pub fn coefficients(&self) -> &[f64] {
        &self.c[..=self.degree]
    }

    fn times_theta(&self) -> Self {
        let n = self.degree + 1;
        let mut c = [0.0; MAX_DEGREE + 1];
        for i in 1..=n {
            c[i] = self.c[i - 1] * i as f64 / n as f64;
        }
        Bernstein { degree: n, c }
    }

    fn times_one_minus_theta(&self) -> Self {
        let n = self.degree + 1;
        let mut c = [0.0; MAX_DEGREE + 1];
        for (i, c) in c.iter_mut().enumerate().take(n) {
            *c = self.c[i] * (n - i) as f64 / n as f64;
        }
        Bernstein { degree: n, c }
    }

    /// Add a constant.
    pub(crate) fn add_constant(&mut self, x: f64) {
        self.c[..=self.degree].iter_mut().for_each(|c| *c += x);
    }

    /// The same polynomial in the form of a higher degree.
    fn elevate(&self, degree: usize) -> Self {
        let mut p = *self;
        while p.degree < degree {
            let n = p.degree + 1;
            let mut c = [0.0; MAX_DEGREE + 1];
            for (i, c) in c.iter_mut().enumerate().take(n + 1) {
                let share = i as f64 / n as f64;
                let left = if i > 0 { p.c[i - 1] } else { 0.0 };
                let right = if i < n { p.c[i] } else { 0.0 };
                *c = share * left + (1.0 - share) * right;
            }
            p = Bernstein { degree: n, c };
        }
        p
    }

    /// The sum of two polynomials.
    pub fn plus(&self, other: &Bernstein) -> Self {
        let degree = self.degree.max(other.degree);
        let (mut p, q) = (self.elevate(degree), other.elevate(degree));
        p.c.iter_mut().zip(&q.c).for_each(|(p, q)| *p += q);
        p
    }

    /// Value at `θ`.
    pub fn at(&self, theta: f64) -> f64 {
        let mut c = self.c;
        for level in (1..=self.degree).rev() {
            for i in 0..level {
                c[i] += theta * (c[i + 1] - c[i]);
            }
        }
        c[0]
    }

    /// The same polynomial seen from `[a, b] ⊂ [0, 1]`.
    pub(crate) fn restrict(&self, a: f64, b: f64) -> Self {
        if (a, b) == (0.0, 1.0) {
            return *self;
        }
        let mut p = *self;
        let n = self.degree;
        if b < 1.0 {
            // left part of the subdivision at b: c_i ← i-th element of the left edge of the triangle
            let mut row = p.c;
            for level in 0..=n {
                p.c[level] = row[0];
                for i in 0..n - level {
                    row[i] += b * (row[i + 1] - row[i]);
                }
            }
        }
        if a > 0.0 {
            let s = if b > 0.0 { a / b } else { 0.0 };
            let mut row = p.c;
            for level in 0..=n {
                p.c[n - level] = row[n - level];
                for i in 0..n - level {
                    row[i] += s * (row[i + 1] - row[i]);
                }
            }
        }
        p
    }

    /// Derivative with respect to `θ`.
    pub fn derivative(&self) -> Self {
        if self.degree == 0 {
            return Bernstein::constant(0.0);
        }
        let mut c = [0.0; MAX_DEGREE + 1];
        for i in 0..self.degree {
            c[i] = self.degree as f64 * (self.c[i + 1] - self.c[i]);
        }
        Bernstein { degree: self.degree - 1, c }
    }

    /// Lower bound on `[0, 1]`; not a number if a coefficient is none (of which nothing is proved).
    pub fn min(&self) -> f64 {
        let least = |m: f64, &x: &f64| if x < m || x.is_nan() { x } else { m };
        self.coefficients().iter().fold(f64::INFINITY, least)
    }

    /// Upper bound on `[0, 1]`; not a number if a coefficient is none.
    pub fn max(&self) -> f64 {
        let largest = |m: f64, &x: &f64| if x > m || x.is_nan() { x } else { m };
        self.coefficients().iter().fold(f64::NEG_INFINITY, largest)
    }
}

/// A vector-valued dense output in nested form: `F₀, F₁, …`, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Nested {
    /// `F₀, F₁, …`
    pub f: Vec<Vec<f64>>,
}

impl Nested {
    /// `y ← y(θ)`.
    pub fn at(&self, theta: f64, y: &mut [f64]) {
        let last = self.f.len() - 1;
        y.copy_from_slice(&self.f[last]);
        for k in (0..last).rev() {
            let s = if k % 2 == 0 { theta } else { 1.0 - theta };
            for (y, f) in y.iter_mut().zip(&self.f[k]) {
                *y = f + s * *y;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_of_what_is_no_number_are_none() {
        for k in 0..4 {
            let mut f = [1.0, 2.0, 3.0, 4.0];
            f[k] = f64::NAN;
            let p = Bernstein::new(&f);
            assert!(p.min().is_nan() && p.max().is_nan(), "{k}");
        }
        assert!(Bernstein::constant(f64::NAN).min().is_nan());
    }

    #[test]
    fn nested_form_restriction_and_derivative_agree() {
        let f = [0.3, -1.0, 2.0, 0.5, -0.7, 1.1, 0.2, -0.4];
        let p = Bernstein::from_nested(&f);
        let nested = Nested { f: f.iter().map(|&x| vec![x]).collect() };
        let part = p.restrict(0.2, 0.7);
        for k in 0..=20 {
            let s = k as f64 / 20.0;
            let mut y = [0.0];
            nested.at(s, &mut y);
            assert!((p.at(s) - y[0]).abs() < 1e-14);
            assert!((part.at(s) - p.at(0.2 + 0.5 * s)).abs() < 1e-14);
            let e = 1e-6;
            if k > 0 && k < 20 {
                let d = (p.at(s + e) - p.at(s - e)) / (2.0 * e);
                assert!((p.derivative().at(s) - d).abs() < 1e-8);
            }
            assert!(part.min() <= part.at(s) + 1e-15 && part.at(s) <= part.max() + 1e-15);
        }
        assert_eq!(p.restrict(0.0, 1.0), p);
    }
}
