//! `(K − σM)⁻¹ B` of a large body by its lowest modes, and moments of all others: one factorisation for all `σ`.
//!
//! With the modes `i ≤ m` of `Kφ = λMφ`, `ΦᵀMΦ = I`,
//!
//! ```text
//! (K − σM)⁻¹B = Σ_{i≤m} φ_i φ_iᵀB/(λ_i − σ) + Σ_{j<J} σʲ X_j + E,     X₀ = K⁻¹(B − MΦΦᵀB),   X_{j+1} = K⁻¹M X_j
//!
//! ‖E‖ ≤ (|σ|/λ_{m+1})ᴶ λ_{m+1}/|λ_{m+1} − σ| ‖X₀‖
//! ```
//!
//! in the norm of `K`, column by column. How many modes there are below `λ_{m+1}` tells the inertia of `K − λM` (Sylvester).

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par, c64};

use super::FemError;
use super::eigen;
use super::factor::SpdFactor;
use super::sparse::Csr;

/// `J`
const MOMENTS: usize = 16;

/// `(|σ|/λ_{m+1})ᴶ` at the largest `σ`.
const PRECISION: f64 = 1e-12;

/// Modes are kept of up to so many displacements each.
const FEWEST: usize = 16;

/// The modes and moments of some forces.
#[derive(Debug)]
pub struct Moments {
    /// `λ_i`, `Φ`
    modes: (Vec<f64>, Mat<f64>),
    /// `ΦᵀB`
    shares: Mat<f64>,
    /// `X_j`
    moments: Vec<Mat<f64>>,
    /// All modes below this are known.
    next: f64,
}

impl Moments {
    /// Of the columns of `B`, for `|σ|` up to `top`; `unit` is a frequency of the order of the lowest. None where there would be too many modes, or where some that there are were not found.
    pub fn new(
        (k, m): (&Csr, &Csr),
        columns: &Mat<f64>,
        top: f64,
        unit: f64,
    ) -> Result<Option<Moments>, FemError> {
        let (n, count) = (k.n_rows(), columns.ncols());
        let next = top / PRECISION.powf(1.0 / MOMENTS as f64);
        let below = eigen::count_below(k, m, next)?;
        if below > n / FEWEST {
            return Ok(None);
        }
        let found = eigen::lowest(k, m, below, unit)?;
        if found.omega.iter().any(|w| w * w > next) {
            return Ok(None);
        }
        let phi = Mat::from_fn(n, below, |i, j| found.shapes[j][i]);
        let lambda = found.omega.iter().map(|w| w * w).collect();
        let times_mass = |x: &Mat<f64>| {
            let mut product = Mat::zeros(n, x.ncols());
            for c in 0..x.ncols() {
                m.mul(x.col_as_slice(c), product.col_as_slice_mut(c));
            }
            product
        };
        let m_phi = times_mass(&phi);
        let shares = phi.transpose() * columns;
        let factor = SpdFactor::new(k, "stiffness matrix of the open phase")?;
        let mut scratch = factor.scratch_of(count);
        let mut solved = |right: &Mat<f64>| {
            let mut flat: Vec<f64> =
                (0..count).flat_map(|c| right.col_as_slice(c).iter().copied()).collect();
            factor.solve(&mut flat, &mut scratch);
            let x = Mat::from_fn(n, count, |i, c| flat[n * c + i]);
            // nothing of the modes
            let of_modes = m_phi.transpose() * &x;
            x - &phi * of_modes
        };
        let mut moments = vec![solved(&(columns - &m_phi * &shares))];
        while moments.len() < MOMENTS {
            let right = times_mass(&moments[moments.len() - 1]);
            moments.push(solved(&right));
        }
        Ok(Some(Moments { modes: (lambda, phi), shares, moments, next }))
    }

    /// Bytes that they take for so many forces on so many displacements.
    pub fn bytes(displacements: usize, forces: usize) -> usize {
        MOMENTS.saturating_mul(displacements).saturating_mul(forces).saturating_mul(8)
    }

    /// The bound of `‖E‖/‖X₀‖`.
    pub fn error(&self, sigma: c64) -> f64 {
        let next = self.next;
        (sigma.norm() / next).powi(MOMENTS as i32) * next / (c64::new(next, 0.0) - sigma).norm()
    }

    /// `CᵀΦ`, and `CᵀX_j`, of columns `C` that are not zero on these rows alone.
    pub fn among(&self, rows: &[usize], values: &Mat<f64>) -> (Mat<f64>, Vec<Mat<f64>>) {
        let of = |x: &Mat<f64>| {
            values.transpose() * Mat::from_fn(rows.len(), x.ncols(), |i, c| x[(rows[i], c)])
        };
        (of(&self.modes.1), self.moments.iter().map(of).collect())
    }

    /// `Cᵀ (K − σM)⁻¹ B` from what [`Moments::among`] gave.
    pub fn between(&self, sigma: c64, (phi, moments): &(Mat<f64>, Vec<Mat<f64>>)) -> Mat<c64> {
        let (rows, count) = (phi.nrows(), self.shares.ncols());
        let (mut re, mut im) = self.by_modes(sigma, |weights| {
            phi * Mat::from_fn(weights.len(), count, |i, c| weights[i] * self.shares[(i, c)])
        });
        let mut power = c64::new(1.0, 0.0);
        for moment in moments {
            for c in 0..count {
                let parts = re.col_as_slice_mut(c).iter_mut().zip(im.col_as_slice_mut(c));
                for ((re, im), x) in parts.zip(moment.col_as_slice(c)) {
                    *re += x * power.re;
                    *im += x * power.im;
                }
            }
            power *= sigma;
        }
        Mat::from_fn(rows, count, |i, c| c64::new(re[(i, c)], im[(i, c)]))
    }

    /// A sum over modes with the weights `1/(λ − σ)`, real and imaginary part.
    fn by_modes(&self, sigma: c64, of: impl Fn(&[f64]) -> Mat<f64>) -> (Mat<f64>, Mat<f64>) {
        let weights: Vec<c64> =
            self.modes.0.iter().map(|l| (c64::new(*l, 0.0) - sigma).inv()).collect();
        let part = |of: fn(&c64) -> f64| -> Vec<f64> { weights.iter().map(of).collect() };
        (of(&part(|w| w.re)), of(&part(|w| w.im)))
    }

    /// `(K − σM)⁻¹ B s` of several `σ` and `s`: a column each.
    pub fn solutions(&self, wanted: &[(c64, Vec<c64>)]) -> Mat<c64> {
        let (count, all) = (self.shares.ncols(), wanted.len());
        // real and imaginary parts side by side
        let split = |of: &dyn Fn(usize) -> Vec<c64>, rows: usize| {
            let columns: Vec<Vec<c64>> = (0..all).map(of).collect();
            Mat::from_fn(rows, 2 * all, |i, c| match c < all {
                true => columns[c][i].re,
                false => columns[c - all][i].im,
            })
        };
        let of_modes = split(
            &|w| {
                let (sigma, share) = &wanted[w];
                let of_mode = |(i, l): (usize, &f64)| {
                    let force: c64 = (0..count).map(|c| share[c] * self.shares[(i, c)]).sum();
                    force / (c64::new(*l, 0.0) - sigma)
                };
                self.modes.0.iter().enumerate().map(of_mode).collect()
            },
            self.modes.0.len(),
        );
        let mut sum = &self.modes.1 * of_modes;
        let mut powers = vec![c64::new(1.0, 0.0); all];
        for moment in &self.moments {
            let weighted = split(&|w| wanted[w].1.iter().map(|s| s * powers[w]).collect(), count);
            matmul(sum.as_mut(), Accum::Add, moment, weighted.as_ref(), 1.0, Par::Seq);
            powers.iter_mut().zip(wanted).for_each(|(p, (sigma, _))| *p *= sigma);
        }
        Mat::from_fn(sum.nrows(), all, |i, w| c64::new(sum[(i, w)], sum[(i, all + w)]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::dynamic::DynamicStiffness;
    use super::*;

    /// A chain of springs between walls, masses that grow along it.
    fn chain(n: usize) -> [Csr; 2] {
        let all = (0..n).flat_map(|i| (i.saturating_sub(1)..(i + 2).min(n)).map(move |j| (i, j)));
        let entries = all.map(|(i, j)| (i, j, if i == j { 2.0 } else { -1.0 })).collect();
        let mass = (0..n).map(|i| (i, i, 1.0 + i as f64 / n as f64)).collect();
        [Csr::from_triplets(n, n, entries), Csr::from_triplets(n, n, mass)]
    }

    /// Beside factorisations at each `σ`: inside the bound and inside 1e-11, for real and complex `σ`, from zero to the highest.
    #[test]
    fn it_is_the_inverse() {
        let [k, m] = chain(900);
        let (rows, n) = (vec![7, 200, 899], 900);
        let values = Mat::from_fn(3, 2, |i, c| 1.0 + (i + 2 * c) as f64);
        let mut columns = Mat::zeros(n, 2);
        rows.iter().enumerate().for_each(|(i, &row)| {
            (0..2).for_each(|c| columns[(row, c)] = values[(i, c)]);
        });
        let lowest = eigen::lowest(&k, &m, 4, 0.01).unwrap().omega;
        let top = (3.0 * lowest[3]).powi(2);
        let own = Moments::new((&k, &m), &columns, top, 0.01).unwrap().unwrap();
        let among = own.among(&rows, &values);
        let direct = DynamicStiffness::new((&k, &m), None, None).unwrap();
        for (omega, damping) in [
            (0.0, (0.0, 0.0)),
            (1.2 * lowest[0], (0.0, 0.0)),
            (2.7 * lowest[3], (1e-3, 0.5)),
            (3.0 * lowest[3], (0.0, 0.0)),
        ] {
            let (alpha, beta) = damping;
            let factor = c64::new(1.0, omega * beta);
            let sigma = c64::new(omega * omega, -omega * alpha) / factor;
            let right = Mat::from_fn(n, 2, |i, c| c64::new(columns[(i, c)], 0.0));
            let exact = direct.factor(omega, damping).unwrap().solve(right.as_ref()).unwrap();
            assert!(own.error(sigma) < 2e-12, "{}", own.error(sigma));
            let size = |of: &dyn Fn(usize, usize) -> f64| {
                (0..n)
                    .flat_map(|i| (0..2).map(move |c| (i, c)))
                    .map(|(i, c)| of(i, c))
                    .fold(0.0, f64::max)
            };
            let share = [
                vec![c64::new(1.0, 0.0), c64::new(0.0, 0.0)],
                vec![c64::new(0.0, 0.0), c64::new(1.0, 0.0)],
            ];
            let found = own.solutions(&share.map(|s| (sigma, s)));
            let largest = size(&|i, c| exact[(i, c)].norm());
            let error = size(&|i, c| (found[(i, c)] / factor - exact[(i, c)]).norm());
            assert!(error < 1e-11 * largest, "{omega}: {}", error / largest);
            let between = own.between(sigma, &among);
            for (a, b) in (0..2).flat_map(|a| (0..2).map(move |b| (a, b))) {
                let whole: c64 = (0..3).map(|i| exact[(rows[i], b)] * values[(i, a)]).sum();
                let of = between[(a, b)] / factor;
                assert!((of - whole).norm() < 1e-10 * whole.norm(), "{omega} {a} {b}");
            }
        }
    }

    #[test]
    fn too_many_modes_are_none() {
        let [k, m] = chain(100);
        let columns = Mat::from_fn(100, 1, |i, _| if i == 99 { 1.0 } else { 0.0 });
        assert!(Moments::new((&k, &m), &columns, 1.0, 0.01).unwrap().is_none());
    }
}
