//! Lyapunov exponents as plain data, with what is known of their errors.

/// The exponents of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct LyapunovRecord {
    /// The period over which tangents are carried.
    pub period: f64,
    /// Of each period, of each direction: the logarithm of its growth.
    pub growths: Vec<Vec<f64>>,
    /// The exponents, over time, the largest first; minus infinity for directions of which nothing is left behind a period.
    pub exponents: Vec<f64>,
    /// Their standard errors, of the means of blocks of periods so long that they hang together no more.
    pub errors: Vec<f64>,
    /// The largest standard error that blocks of any length give: no plateau is known beyond.
    pub bounds: Vec<f64>,
    /// `−⟨tr M⁻¹C⟩`: what the sum of all is.
    pub divergence: f64,
    /// Whether these are all.
    pub all: bool,
}

/// Growth in a period, over that of the first direction, below which a direction is rounding.
const LOST: f64 = 1e-13;

/// Blocks that a standard error is made of, at least.
const BLOCKS: usize = 16;

impl LyapunovRecord {
    /// Of the growths of all periods, and of the shrinking of volumes in each.
    pub(crate) fn of(
        period: f64,
        growths: Vec<Vec<f64>>,
        shrinking: &[f64],
        all: bool,
    ) -> LyapunovRecord {
        let count = growths.len() as f64;
        let width = growths.first().map_or(0, Vec::len);
        let mean = |k: usize| growths.iter().map(|g| g[k]).sum::<f64>() / (count * period);
        // what is left of a direction that switches annihilate is rounding
        let is_lost = |k: usize| {
            let lost = growths.iter().filter(|g| g[k] - g[0] < LOST.ln()).count();
            2 * lost > growths.len()
        };
        let value = |k: usize| if is_lost(k) { f64::NEG_INFINITY } else { mean(k) };
        let mut order: Vec<(usize, f64)> = (0..width).map(|k| (k, value(k))).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        let exponents: Vec<f64> = order.iter().map(|o| o.1).collect();
        let growths: Vec<Vec<f64>> =
            growths.iter().map(|g| order.iter().map(|o| g[o.0]).collect()).collect();
        let (mut errors, mut bounds) = (vec![], vec![]);
        for (k, x) in exponents.iter().enumerate() {
            let own: Vec<f64> = growths.iter().map(|g| g[k] / period).collect();
            let all = if x.is_finite() { standard_errors(&own) } else { vec![] };
            errors.push(all.last().copied().unwrap_or(f64::NAN));
            bounds.push(all.iter().copied().fold(f64::NAN, f64::max));
        }
        let divergence = shrinking.iter().sum::<f64>() / (count * period);
        LyapunovRecord { period, growths, exponents, errors, bounds, divergence, all }
    }

    /// Kaplan and Yorke's dimension, if so many exponents are known that their sum is below zero.
    pub fn dimension(&self) -> Option<f64> {
        let mut sum = 0.0;
        for (k, &x) in self.exponents.iter().enumerate() {
            let x = if self.is_zero(k) { 0.0 } else { x };
            if sum + x < 0.0 {
                return Some(if k == 0 { 0.0 } else { k as f64 + sum / x.abs() });
            }
            sum += x;
        }
        None
    }

    /// Whether an exponent is zero within its errors, as one of every motion that nothing drives.
    fn is_zero(&self, k: usize) -> bool {
        let (x, error) = (self.exponents[k].abs(), self.bounds[k]);
        x * self.period <= STILL || x <= ERRORS * error && x * self.period <= CHAOTIC
    }

    /// The sum of all, if these are all and all are numbers.
    pub fn sum(&self) -> Option<f64> {
        let sum: f64 = self.exponents.iter().sum();
        (self.all && sum.is_finite()).then_some(sum)
    }

    /// What the largest exponent says, in a word: `chaotic`, `regular`, or `open` where its error leaves both.
    pub fn verdict(&self) -> &'static str {
        let (Some(&x), Some(&error)) = (self.exponents.first(), self.bounds.first()) else {
            return "open";
        };
        let a_period = x * self.period;
        match () {
            () if a_period > CHAOTIC && x > ERRORS * error => "chaotic",
            () if a_period.abs() <= STILL || x < -ERRORS * error => "regular",
            () => "open",
        }
    }
}

/// A motion is chaotic if its exponent is above this a period, and above so many standard errors; regular if it is not above this.
const CHAOTIC: f64 = 0.01;
const ERRORS: f64 = 4.0;
const STILL: f64 = 1e-3;

/// The mean of some values that do not know of each other, and its standard error.
pub(crate) fn mean_with_error(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}

/// Standard errors of the mean by blocks of 1, 2, 4, … values, as long as there are enough of them.
fn standard_errors(values: &[f64]) -> Vec<f64> {
    let mut all = vec![];
    let mut length = 1;
    while values.len() / length >= BLOCKS {
        let means: Vec<f64> =
            values.chunks_exact(length).map(|b| b.iter().sum::<f64>() / length as f64).collect();
        all.push(mean_with_error(&means).1);
        length *= 2;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lozi's map `(1 − 1.7|x| + y, 0.5 x)`: tangents and triangular factors by hand, the literature's exponents.
    #[test]
    fn growths_of_a_map_give_its_exponents() {
        let (mut x, mut y) = (0.1f64, 0.1f64);
        let mut q = [[1.0, 0.0], [0.0, 1.0]];
        let mut growths = vec![];
        for step in 0..101_000 {
            let slope = -1.7 * x.signum();
            // columns of X Q
            let apply = |c: [f64; 2]| [slope * c[0] + c[1], 0.5 * c[0]];
            let (a, b) = (apply([q[0][0], q[1][0]]), apply([q[0][1], q[1][1]]));
            let first = a[0].hypot(a[1]);
            let a = a.map(|v| v / first);
            let along = a[0] * b[0] + a[1] * b[1];
            let b = [b[0] - along * a[0], b[1] - along * a[1]];
            let second = b[0].hypot(b[1]);
            q = [[a[0], b[0] / second], [a[1], b[1] / second]];
            (x, y) = (1.0 - 1.7 * x.abs() + y, 0.5 * x);
            if step >= 1000 {
                growths.push(vec![first.ln(), second.ln()]);
            }
        }
        let shrinking = vec![0.5f64.ln(); growths.len()];
        let found = LyapunovRecord::of(1.0, growths, &shrinking, true);
        let [a, b] = [found.exponents[0], found.exponents[1]];
        assert!((a - 0.4711).abs() < 4.0 * found.errors[0] && found.errors[0] < 2e-3, "{a}");
        // a sum of 100,000 terms is known to so many times their rounding
        assert!((a + b - found.divergence).abs() < 1e5 * f64::EPSILON, "{b}");
        assert!((b + 1.1643).abs() < 6e-3, "{b}");
        assert_eq!(found.verdict(), "chaotic");
        assert!((found.dimension().unwrap_or(0.0) - (1.0 + a / -b)).abs() < 1e-12);
    }

    #[test]
    fn errors_of_blocks_see_what_hangs_together() {
        // every value eight times: single values know eight times too many
        let values: Vec<f64> =
            (0..1024).map(|k: u32| f64::from((k / 8).wrapping_mul(2_654_435_761) >> 16)).collect();
        let all = standard_errors(&values);
        assert!(all[3] > 2.5 * all[0], "{all:?}");
        assert_eq!(all.len(), 7);
        assert!(standard_errors(&values[..15]).is_empty());
    }
}
