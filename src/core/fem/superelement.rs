//! Superelements in free-interface form (MacNeal): matrices of motions of modes, and of displacements without mass.
//!
//! With eigenpairs `K Φ = M Φ Ω²`, `ΦᵀMΦ = I`, and forces `λ` on some displacements `u_B` alone,
//!
//! ```text
//! u_B = Φ_B η + R λ,      R = [K⁻¹]_BB − Φ_B Ω⁻² Φ_Bᵀ
//!
//!     ⎡ R⁻¹        −R⁻¹Φ_B       ⎤        ⎡ 0   ⎤
//! K = ⎢                           ⎥,   M = ⎢     ⎥    over (u_B, η)
//!     ⎣ −Φ_BᵀR⁻¹   Ω² + Φ_BᵀR⁻¹Φ_B ⎦        ⎣   I ⎦
//! ```
//!
//! Frequencies of the free body are those of its modes whatever has no mass. Static modes of a superelement of Craig and Bampton are decoupled from its fixed-interface modes in `K`: with its retained
//! displacements simply without mass, an open contact would stand still.

use nalgebra::DMatrix;
use thiserror::Error;

use super::FemError;
use super::eigen;
use super::factor::SpdFactor;
use super::sparse::Csr;

/// The residual flexibility `R` is one when its eigenvalues do not spread further.
const FLEXIBLE: f64 = 1e-6;

/// What there is no such form for.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum SuperelementError {
    /// Of the matrices.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// `R` is rounding: the modes leave nothing of the flexibility.
    #[error(
        "{modes} modes leave no flexibility of their own to the displacements that stay: least over largest {share:.1e}"
    )]
    Stiff {
        /// Modes.
        modes: usize,
        /// Least eigenvalue of `R` over the largest.
        share: f64,
    },
}

/// Mass and stiffness over `(u_B, η)`: the displacements of `rows`, then so many modes.
pub fn free_interface_form(
    mass: &Csr,
    stiffness: &Csr,
    rows: &[usize],
    modes: usize,
) -> Result<[Csr; 2], SuperelementError> {
    let n = mass.n_rows();
    let factor = SpdFactor::new(stiffness, "stiffness matrix")?;
    let all = eigen::all(stiffness, mass, 1e-300)?;
    let modes = modes.min(n);
    let (count, b) = (modes, rows.len());
    let phi = DMatrix::from_fn(b, count, |i, k| all.shapes[k][rows[i]]);
    let square = |k: usize| all.omega[k] * all.omega[k];
    let mut scratch = factor.scratch();
    let mut residual = DMatrix::zeros(b, b);
    for (j, &row) in rows.iter().enumerate() {
        let mut x = vec![0.0; n];
        x[row] = 1.0;
        factor.solve(&mut x, &mut scratch);
        for (i, &of) in rows.iter().enumerate() {
            let of_modes = (0..count).map(|k| phi[(i, k)] * phi[(j, k)] / square(k)).sum::<f64>();
            residual[(i, j)] = x[of] - of_modes;
        }
    }
    let residual = 0.5 * (&residual + residual.transpose());
    let values = residual.clone().symmetric_eigenvalues();
    let (least, largest) = (values.min(), values.max());
    let share = least / largest;
    if b > 0 && (share.is_nan() || share <= FLEXIBLE || largest <= 0.0) {
        return Err(SuperelementError::Stiff { modes, share });
    }
    let failed = FemError::NotPositiveDefinite { what: "residual flexibility" };
    let inverse = residual.cholesky().ok_or(failed)?.inverse();
    let inverse = 0.5 * (&inverse + inverse.transpose());
    let coupling = &inverse * &phi;
    let of_modes = phi.transpose() * &coupling;
    let mut k = DMatrix::zeros(b + count, b + count);
    k.view_mut((0, 0), (b, b)).copy_from(&inverse);
    k.view_mut((0, b), (b, count)).copy_from(&(-&coupling));
    k.view_mut((b, 0), (count, b)).copy_from(&(-coupling.transpose()));
    k.view_mut((b, b), (count, count)).copy_from(&(0.5 * (&of_modes + of_modes.transpose())));
    (0..count).for_each(|j| k[(b + j, b + j)] += square(j));
    let size = b + count;
    let entries = (0..size).flat_map(|i| (0..size).map(move |j| (i, j)));
    let entries = entries.map(|(i, j)| (i, j, k[(i, j)])).filter(|e| e.2 != 0.0).collect();
    let own = (b..size).map(|i| (i, i, 1.0)).collect();
    Ok([Csr::from_triplets(size, size, own), Csr::from_triplets(size, size, entries)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of springs and masses between walls.
    fn chain(n: usize) -> [Csr; 2] {
        let k = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        };
        let all = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let entries = all.map(|(i, j)| (i, j, k(i, j))).filter(|e| e.2 != 0.0).collect();
        let mass = (0..n).map(|i| (i, i, 1.0 + i as f64 / n as f64)).collect();
        [Csr::from_triplets(n, n, mass), Csr::from_triplets(n, n, entries)]
    }

    fn dense(a: &Csr) -> DMatrix<f64> {
        let mut d = DMatrix::zeros(a.n_rows(), a.n_cols());
        a.triplets().for_each(|(i, j, v)| d[(i, j)] = v);
        d
    }

    /// Static displacements under forces on what stays are exact, and free vibration is that of the modes.
    #[test]
    fn statics_and_modes_are_those_of_the_body() {
        let [mass, stiffness] = chain(9);
        let rows = [2, 8];
        let [m, k] = free_interface_form(&mass, &stiffness, &rows, 4).unwrap();
        let (whole, own) =
            (dense(&stiffness).try_inverse().unwrap(), dense(&k).try_inverse().unwrap());
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            let exact = whole[(rows[i], rows[j])];
            assert!((own[(i, j)] - exact).abs() < 1e-12 * exact, "{}", own[(i, j)] - exact);
        }
        // u_B follows statically: K_ηη − K_ηB K_BB⁻¹ K_Bη = Ω²
        let d = dense(&k);
        let (kbb, kbe) = (d.view((0, 0), (2, 2)), d.view((0, 2), (2, 4)));
        let free = d.view((2, 2), (4, 4)) - kbe.transpose() * kbb.try_inverse().unwrap() * kbe;
        let exact = eigen::all(&stiffness, &mass, 1e-300).unwrap();
        for j in 0..4 {
            assert!((free[(j, j)].sqrt() - exact.omega[j]).abs() < 1e-12);
            assert_eq!(m.entry(2 + j, 2 + j), Some(&1.0));
        }
        assert!(m.row(0).next().is_none());
    }

    #[test]
    fn modes_that_leave_no_flexibility_are_too_many() {
        let [mass, stiffness] = chain(6);
        let said = free_interface_form(&mass, &stiffness, &[1, 5], 6).unwrap_err();
        assert!(matches!(said, SuperelementError::Stiff { modes: 6, .. }), "{said}");
        let free =
            Csr::from_triplets(2, 2, vec![(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)]);
        let one = Csr::from_triplets(2, 2, vec![(0, 0, 1.0), (1, 1, 1.0)]);
        assert!(matches!(
            free_interface_form(&one, &free, &[0], 1),
            Err(SuperelementError::Fem(_))
        ));
    }
}
