//! How far a family moves with numbers of its scene that are known to a deviation only, as plain data.

/// A number of the scene that is not known exactly.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// Its key.
    pub key: String,
    /// The number.
    pub value: f64,
    /// Its standard deviation `σ`.
    pub sigma: f64,
}

/// What a family is looked at by: largest contact displacement, energy.
pub type Heights = [f64; 2];

/// An orbit of a family with its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct BandRow {
    /// Its branch.
    pub branch: usize,
    /// Its place there.
    pub index: i64,
    /// Circular frequency.
    pub omega: f64,
    /// `A`: largest contact displacement, and energy.
    pub heights: Heights,
    /// `A_ω`, along the branch.
    pub along: Heights,
    /// `A_q` at the frequency of the orbit, of each number.
    pub by: Vec<Heights>,
    /// Why there are no derivatives; else empty.
    pub note: String,
}

impl BandRow {
    /// Where there are no derivatives, and why not.
    pub fn without(
        (branch, index): (usize, i64),
        (omega, heights): (f64, Heights),
        numbers: usize,
        note: String,
    ) -> BandRow {
        let none = [f64::NAN; 2];
        BandRow { branch, index, omega, heights, along: none, by: vec![none; numbers], note }
    }
}

/// A family with what it is known to: to first order in deviations that are independent and normal,
///
/// ```text
/// σ_A² = Σ (A_q σ_q)²      at the frequency of the orbit
/// ```
///
/// At a fold `A_q` and `A_ω` are both without bound. The curve as a whole moves across itself, and that stays finite: in units `W`, `H` of frequency and height
///
/// ```text
/// (Δω/W, ΔA/H) = σ_A/H · (−s, 1)/(1 + s²) ,   s = A_ω W/H
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Bands {
    /// The numbers.
    pub deviations: Vec<Deviation>,
    /// The orbits of the family, branch by branch in the order of the walk.
    pub rows: Vec<BandRow>,
}

impl Bands {
    /// `σ_A` of a row.
    pub fn sigma(&self, row: &BandRow) -> Heights {
        let of = |k: usize| {
            let parts = row.by.iter().zip(&self.deviations).map(|(by, d)| by[k] * d.sigma);
            parts.map(|x| x * x).sum::<f64>().sqrt()
        };
        [of(0), of(1)]
    }

    /// What a number has of `σ_A²` of the largest contact displacement.
    pub fn share(&self, row: &BandRow, number: usize) -> f64 {
        let [sigma, _] = self.sigma(row);
        (row.by[number][0] * self.deviations[number].sigma / sigma).powi(2)
    }

    /// Where the curve is moved to across itself by one deviation, in units of frequency and height.
    pub fn across(&self, row: &BandRow, height: usize, [unit, of_height]: [f64; 2]) -> (f64, f64) {
        let s = row.along[height] * unit / of_height;
        let d = self.sigma(row)[height] / (1.0 + s * s);
        // far beyond any slope that is drawn the curve stands upright
        (-s * d * unit / of_height, d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bands(by: Vec<Heights>, along: Heights) -> Bands {
        let number = |key: &str, sigma| Deviation { key: key.into(), value: 1.0, sigma };
        let (omega, heights, note) = (1.0, [2.0, 3.0], String::new());
        let row = BandRow { branch: 0, index: 0, omega, heights, along, by, note };
        Bands { deviations: vec![number("a", 0.1), number("b", 0.2)], rows: vec![row] }
    }

    #[test]
    fn independent_deviations_add_their_squares() {
        let all = bands(vec![[3.0, 0.0], [2.0, 1.0]], [0.0; 2]);
        let row = &all.rows[0];
        assert!((all.sigma(row)[0] - 0.5).abs() < 1e-15 && (all.sigma(row)[1] - 0.2).abs() < 1e-15);
        assert!((all.share(row, 0) - 0.36).abs() < 1e-14);
        assert!((all.share(row, 1) - 0.64).abs() < 1e-14);
    }

    /// The circle ω² + A² = r² where it stands upright nearly: a deviation of the radius moves it along the radius.
    #[test]
    fn a_curve_moves_across_itself() {
        let (sin, cos) = 1e-6f64.sin_cos();
        // A = √(r² − ω²): A_r = r/A, A_ω = −ω/A
        let all = bands(vec![[1.0 / sin, 0.0], [0.0, 0.0]], [-cos / sin, 0.0]);
        let (x, y) = all.across(&all.rows[0], 0, [1.0, 1.0]);
        assert!((x - 0.1 * cos).abs() < 1e-12 && (y - 0.1 * sin).abs() < 1e-12, "{x} {y}");
    }
}
