//! Dynamic stiffness of the open body in its natural modes, one harmonic: `D_k = Ω² − k²ω² + ikω ΦᵀCΦ`.
//!
//! Diagonal where damping is a combination of mass and stiffness; a full matrix where the modes do not decouple it (structural damping beside
//! Nitsche's terms). A pair `a cos kθ + b sin kθ` is the complex number `a − ib`.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, c64};

use super::receptance::weighted;
use crate::flow::spectrum::Spectrum;

/// `D_k`.
#[derive(Debug)]
pub(super) enum Impedance {
    /// Mode by mode: `ω_i² − k²ω²` and `kω · 2c_i`.
    Modes(Vec<c64>),
    /// The whole matrix, and its factors.
    Full(Mat<c64>, PartialPivLu<c64>),
}

impl Impedance {
    /// At rest, with some motions held by a spring.
    pub fn at_rest(open: &Spectrum, (held, spring): (&[usize], f64)) -> Impedance {
        let mut rest = Impedance::new(open, 0.0);
        rest.add(|i| c64::new(if held.contains(&i) { spring } else { 0.0 }, 0.0));
        rest
    }

    /// With more on the diagonal.
    pub fn add(&mut self, more: impl Fn(usize) -> c64) {
        match self {
            Impedance::Modes(d) => d.iter_mut().enumerate().for_each(|(i, d)| *d += more(i)),
            Impedance::Full(d, lu) => {
                (0..d.nrows()).for_each(|i| d[(i, i)] += more(i));
                *lu = d.partial_piv_lu();
            }
        }
    }

    /// At `kω`.
    pub fn new(open: &Spectrum, kw: f64) -> Impedance {
        // no force moves what is but remembered
        let frozen = open.frozen();
        let stiffness = |i: usize| match (frozen.contains(&i), open.modes[i].omega) {
            (true, _) => 1.0,
            (false, w) => (w - kw) * (w + kw),
        };
        let n = open.modes.len();
        match open.damping_matrix() {
            None => {
                let of = |i: usize| c64::new(stiffness(i), 2.0 * open.modes[i].c * kw);
                Impedance::Modes((0..n).map(of).collect())
            }
            Some(c) => {
                let own = |i: usize, j: usize| if i == j { stiffness(i) } else { 0.0 };
                let d = Mat::from_fn(n, n, |i, j| c64::new(own(i, j), kw * c[(i, j)]));
                let lu = d.partial_piv_lu();
                Impedance::Full(d, lu)
            }
        }
    }

    /// How near mode `i` is to resonance: `|D_ii|` over the size of its terms.
    pub(crate) fn nearness(&self, i: usize, size: f64) -> f64 {
        let d = match self {
            Impedance::Modes(d) => d[i],
            Impedance::Full(d, _) => d[(i, i)],
        };
        // a rigid motion has no stiffness at k = 0: the whole system must be solved
        if size > 0.0 { d.norm() / size } else { 0.0 }
    }

    /// `D x`
    pub fn multiply(&self, x: &mut [c64]) {
        match self {
            Impedance::Modes(d) => x.iter_mut().zip(d).for_each(|(x, d)| *x = d * *x),
            Impedance::Full(d, _) => {
                let y = d * Mat::from_fn(x.len(), 1, |i, _| x[i]);
                x.copy_from_slice(y.col_as_slice(0));
            }
        }
    }

    /// `D⁻¹ x`
    pub(crate) fn divide(&self, x: &mut [c64]) {
        match self {
            Impedance::Modes(d) => x.iter_mut().zip(d).for_each(|(x, d)| *x /= d),
            Impedance::Full(_, lu) => {
                let y = lu.solve(Mat::from_fn(x.len(), 1, |i, _| x[i]));
                x.copy_from_slice(y.col_as_slice(0));
            }
        }
    }

    /// `D⁻¹ Q`
    fn answers(&self, q: &Mat<f64>) -> Mat<c64> {
        let entry = |i: usize, j: usize| c64::new(q[(i, j)], 0.0);
        match self {
            Impedance::Modes(d) => Mat::from_fn(q.nrows(), q.ncols(), |i, j| entry(i, j) / d[i]),
            Impedance::Full(_, lu) => lu.solve(Mat::from_fn(q.nrows(), q.ncols(), entry)),
        }
    }

    /// `QᵀD⁻¹Q`: real and imaginary part.
    pub fn receptance(&self, q: &Mat<f64>) -> [Mat<f64>; 2] {
        match self {
            Impedance::Modes(d) => {
                let part =
                    |of: fn(c64) -> f64| -> Vec<f64> { d.iter().map(|d| of(d.inv())).collect() };
                [weighted(q.as_ref(), &part(|z| z.re)), weighted(q.as_ref(), &part(|z| z.im))]
            }
            Impedance::Full(..) => {
                let x = self.answers(q);
                let part = |of: fn(c64) -> f64| {
                    let x = Mat::from_fn(x.nrows(), x.ncols(), |i, j| of(x[(i, j)]));
                    q.transpose() * x
                };
                [part(|z| z.re), part(|z| z.im)]
            }
        }
    }

    /// `rᵀD⁻¹Q`
    pub(crate) fn row_of_answers(&self, row: &[f64], q: &Mat<f64>) -> Vec<c64> {
        let of = |answer: &dyn Fn(usize, usize) -> c64| -> Vec<c64> {
            let seen: Vec<usize> = (0..row.len()).filter(|i| row[*i] != 0.0).collect();
            let sum = |c: usize| seen.iter().map(|&i| answer(i, c) * row[i]).sum();
            (0..q.ncols()).map(sum).collect()
        };
        match self {
            Impedance::Modes(d) => of(&|i, c| c64::new(q[(i, c)], 0.0) / d[i]),
            Impedance::Full(..) => {
                let x = self.answers(q);
                of(&|i, c| x[(i, c)])
            }
        }
    }

    /// Entries of `D` as `(row, column, value)`.
    pub fn entries(&self) -> Vec<(usize, usize, c64)> {
        match self {
            Impedance::Modes(d) => d.iter().enumerate().map(|(i, d)| (i, i, *d)).collect(),
            Impedance::Full(d, _) => {
                let n = d.nrows();
                (0..n)
                    .flat_map(|i| (0..n).map(move |j| (i, j)))
                    .map(|(i, j)| (i, j, d[(i, j)]))
                    .collect()
            }
        }
    }
}
