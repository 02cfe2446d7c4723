//! A measured history as a function of time: the natural cubic spline through its points, twice continuously differentiable.

/// A cubic spline `s(t)` through `(t_i, y_i)` with `s″ = 0` at both ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    t: Vec<f64>,
    y: Vec<f64>,
    /// `s″(t_i)`
    second: Vec<f64>,
}

impl Spline {
    /// Through points of strictly growing times, at least two.
    pub fn new(t: Vec<f64>, y: Vec<f64>) -> Spline {
        let n = t.len();
        let h = |i: usize| t[i + 1] - t[i];
        let slope = |i: usize| (y[i + 1] - y[i]) / h(i);
        // h_{i−1} s″_{i−1} + 2 (h_{i−1} + h_i) s″_i + h_i s″_{i+1} = 6 (slope_i − slope_{i−1}), by elimination from above
        let (mut diagonal, mut rest) = (vec![1.0; n], vec![0.0; n]);
        for i in 1..n.saturating_sub(1) {
            let share = if i > 1 { h(i - 1) / diagonal[i - 1] } else { 0.0 };
            diagonal[i] = 2.0 * (h(i - 1) + h(i)) - share * h(i - 1);
            rest[i] = 6.0 * (slope(i) - slope(i - 1)) - share * rest[i - 1];
        }
        let mut second = vec![0.0; n];
        for i in (1..n.saturating_sub(1)).rev() {
            second[i] = (rest[i] - h(i) * second[i + 1]) / diagonal[i];
        }
        Spline { t, y, second }
    }

    /// The times of the points.
    pub fn times(&self) -> &[f64] {
        &self.t
    }

    /// The values at the points.
    pub fn values(&self) -> &[f64] {
        &self.y
    }

    /// First and last time.
    pub fn range(&self) -> (f64, f64) {
        (self.t[0], self.t[self.t.len() - 1])
    }

    /// The straight lines between the points.
    pub fn straight(&self, t: f64) -> f64 {
        let i = self.t.partition_point(|x| *x <= t).clamp(1, self.t.len() - 1) - 1;
        let share = (t - self.t[i]) / (self.t[i + 1] - self.t[i]);
        self.y[i] + share * (self.y[i + 1] - self.y[i])
    }

    /// Sizes of the jumps of `s‴` inside `(a, b)`, together.
    pub(crate) fn jumps(&self, a: f64, b: f64) -> f64 {
        let third = |i: usize| (self.second[i + 1] - self.second[i]) / (self.t[i + 1] - self.t[i]);
        let first = self.t.partition_point(|t| *t <= a).max(1);
        let last = self.t.partition_point(|t| *t < b).min(self.t.len() - 1);
        (first..last).map(|i| (third(i) - third(i - 1)).abs()).sum()
    }

    /// `s(t)`, or its derivative of order 1 or 2; beyond the ends the outermost cubics go on.
    pub fn at(&self, t: f64, order: u32) -> f64 {
        let i = self.t.partition_point(|x| *x <= t).clamp(1, self.t.len() - 1) - 1;
        let h = self.t[i + 1] - self.t[i];
        let (a, b) = ((self.t[i + 1] - t) / h, (t - self.t[i]) / h);
        let (m, n) = (self.second[i], self.second[i + 1]);
        match order {
            0 => {
                a * self.y[i]
                    + b * self.y[i + 1]
                    + h * h / 6.0 * ((a * a * a - a) * m + (b * b * b - b) * n)
            }
            1 => {
                (self.y[i + 1] - self.y[i]) / h
                    + h / 6.0 * ((1.0 - 3.0 * a * a) * m + (3.0 * b * b - 1.0) * n)
            }
            _ => a * m + b * n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_through_its_points_with_two_continuous_derivatives() {
        let t = vec![0.0, 0.3, 0.5, 1.1, 1.2, 2.0];
        let y = vec![1.0, -0.4, 0.2, 2.0, 1.5, 0.0];
        let s = Spline::new(t.clone(), y.clone());
        for (t, y) in t.iter().zip(&y) {
            assert!((s.at(*t, 0) - y).abs() < 1e-14);
        }
        for t in &t[1..5] {
            for order in 0..3 {
                let (before, after) = (s.at(t - 1e-12, order), s.at(*t, order));
                assert!((before - after).abs() < 1e-9, "order {order} at {t}");
            }
        }
        assert_eq!((s.at(0.0, 2), s.at(2.0, 2)), (0.0, 0.0));
        // derivatives are those of the values
        for t in [0.1, 0.45, 0.9, 1.15, 1.7] {
            let h = 1e-5;
            let slope = (s.at(t + h, 0) - s.at(t - h, 0)) / (2.0 * h);
            let bend = (s.at(t + h, 1) - s.at(t - h, 1)) / (2.0 * h);
            assert!((slope - s.at(t, 1)).abs() < 1e-7 && (bend - s.at(t, 2)).abs() < 1e-6);
        }
    }

    /// A spline is no further from its cubic Hermite interpolant on an interval than the jumps inside say, nor its slope.
    #[test]
    fn jumps_bound_what_an_interpolant_misses() {
        let t: Vec<f64> = (0..30).map(|k| k as f64 + 0.3 * (k as f64).sin()).collect();
        let y = (0..30).map(|k| (2.3 * k as f64).sin()).collect();
        let s = Spline::new(t, y);
        for k in 0..200 {
            let (a, length) = (0.13 * k as f64, 0.05 + 0.011 * k as f64);
            let bound = s.jumps(a, a + length);
            for j in 0..=50 {
                let x = j as f64 / 50.0;
                let of = |p: [f64; 4]| p.iter().rev().fold(0.0, |sum, c| sum * x + c);
                let (f, g) = (s.at(a, 0), s.at(a + length, 0));
                let (df, dg) = (length * s.at(a, 1), length * s.at(a + length, 1));
                let (second, third) = (3.0 * (g - f) - 2.0 * df - dg, 2.0 * (f - g) + df + dg);
                let off = s.at(a + x * length, 0) - of([f, df, second, third]);
                let slope =
                    length * s.at(a + x * length, 1) - of([df, 2.0 * second, 3.0 * third, 0.0]);
                let rounding = 1e-12;
                assert!(off.abs() <= bound * length.powi(3) / 192.0 + rounding, "{k} {j}: {off:e}");
                assert!(
                    slope.abs() <= bound * length.powi(3) / 32.0 + rounding,
                    "{k} {j}: {slope:e}"
                );
            }
        }
    }

    /// A sine sampled finely: the error of a spline falls with the fourth power of the step, of a natural one inside the range.
    #[test]
    fn follows_a_smooth_function() {
        let at = |n: usize| {
            let t: Vec<f64> =
                (0..=n).map(|i| std::f64::consts::TAU * i as f64 / n as f64).collect();
            let y = t.iter().map(|t| t.sin()).collect();
            let s = Spline::new(t, y);
            (0..100)
                .map(|k| 0.0629 * k as f64)
                .map(|t| (s.at(t, 0) - t.sin()).abs())
                .fold(0.0, f64::max)
        };
        let (coarse, fine) = (at(20), at(40));
        assert!(coarse < 1e-4 && fine < coarse / 12.0, "{coarse} {fine}");
    }
}
