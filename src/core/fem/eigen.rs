//! Lowest eigenpairs of `K φ = ω² M φ`: dense for small bodies, Lanczos for large ones.

use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::{Mat, Side};

use super::FemError;
use super::factor::SpdFactor;
use super::simplicial::ldl_pivots;
use super::sparse::Csr;

/// Above this size the dense solution gives way to Lanczos.
const DENSE_LIMIT: usize = 700;

/// Frequencies below this, over the body's unit, are those of rigid motions.
const RIGID: f64 = 1e-6;

/// Natural frequencies and mass-normalised shapes, lowest first.
#[derive(Debug, Clone)]
pub struct Modes {
    /// Circular frequencies ω (0 for rigid motions).
    pub omega: Vec<f64>,
    /// Shapes, `φᵀ M φ = 1`.
    pub shapes: Vec<Vec<f64>>,
}

/// The `count` lowest modes. `omega_unit` is any frequency of the order of the lowest elastic one;
/// it only sets the shift that makes unsupported bodies solvable.
pub fn lowest(k: &Csr, m: &Csr, count: usize, omega_unit: f64) -> Result<Modes, FemError> {
    let count = count.min(k.n_rows());
    let mut modes = if k.n_rows() <= DENSE_LIMIT {
        dense(k, m, count)?
    } else {
        lanczos(k, m, count, omega_unit)?
    };
    flatten_rigid(&mut modes, omega_unit);
    Ok(modes)
}

/// All modes, densely.
pub fn all(k: &Csr, m: &Csr, omega_unit: f64) -> Result<Modes, FemError> {
    let mut modes = dense(k, m, k.n_rows())?;
    settle_rigid(&mut modes, k, m, omega_unit)?;
    Ok(modes)
}

/// How many eigenvalues `ω²` lie below a number: the negative pivots of `K − ω²M` (Sylvester's law of inertia).
pub fn count_below(k: &Csr, m: &Csr, square: f64) -> Result<usize, FemError> {
    let what = FemError::Singular { what: "shifted stiffness matrix" };
    let shifted = Csr::combination(1.0, k, -square, m);
    let pivots = ldl_pivots(&shifted, LdltRegularization::default()).ok_or(what)?;
    Ok(pivots.iter().filter(|p| p.1 < 0.0).count())
}

/// A dense eigensolution knows `ω²` to some `ε ω_max²` and the shapes of rigid motions only to the rounding errors of the stiffest modes: under a constant force a mode that is
/// all but rigid would move about a static response of `1/ω²`, all digits of which are rounding. Two steps of inverse iteration, whose own errors lie along these very shapes, bring rigid shapes to
/// full accuracy, and then they carry no force but the rounding of `Kφ`. All others are made orthogonal to them.
fn settle_rigid(modes: &mut Modes, k: &Csr, m: &Csr, omega_unit: f64) -> Result<(), FemError> {
    let highest = modes.omega.last().copied().unwrap_or(0.0);
    let noise = 64.0 * f64::EPSILON * highest * highest;
    let limit = noise.max((RIGID * omega_unit).powi(2));
    let count = modes.omega.iter().take_while(|w| **w * **w < limit).count();
    if count == 0 {
        return Ok(());
    }
    let n = k.n_rows();
    let shift = (1e-4 * omega_unit * omega_unit).max(noise);
    let factor = SpdFactor::new(&Csr::combination(1.0, k, shift, m), "shifted stiffness matrix")?;
    let mut scratch = factor.scratch();
    let mut mx = vec![0.0; n];
    let mut refined = modes.shapes[..count].to_vec();
    for j in 0..count {
        for _ in 0..2 {
            m.mul(&refined[j], &mut mx);
            factor.solve(&mut mx, &mut scratch);
            refined[j].copy_from_slice(&mx);
            normalise(&mut refined, j, j, m);
        }
    }
    let carries_no_force = |x: &Vec<f64>| {
        let sizes = k.triplets().map(|(i, j, v)| (x[i] * v * x[j]).abs()).sum::<f64>();
        k.quadratic(x).abs() <= 4.0 * f64::EPSILON * sizes
    };
    let is_below = |w: &f64| *w < RIGID * omega_unit;
    let all_below = modes.omega[..count].iter().all(is_below);
    // soft, and not free: as the eigensolution has it
    if !all_below && !refined.iter().all(carries_no_force) {
        flatten_rigid(modes, omega_unit);
        return Ok(());
    }
    modes.omega[..count].fill(0.0);
    modes.shapes.splice(..count, refined);
    for j in count..modes.shapes.len() {
        normalise(&mut modes.shapes, j, count, m);
    }
    Ok(())
}

/// Make shape `j` orthogonal to the first `others` and of unit norm, in the mass.
fn normalise(shapes: &mut [Vec<f64>], j: usize, others: usize, m: &Csr) {
    let (before, rest) = shapes.split_at_mut(j);
    let x = &mut rest[0];
    let mut mx = vec![0.0; x.len()];
    m.mul(x, &mut mx);
    for other in &before[..others] {
        let c: f64 = other.iter().zip(&mx).map(|(a, b)| a * b).sum();
        x.iter_mut().zip(other).for_each(|(x, o)| *x -= c * o);
    }
    let norm = m.quadratic(x).sqrt();
    x.iter_mut().for_each(|x| *x /= norm);
}

/// Frequencies that are rounding errors belong to rigid motions.
fn flatten_rigid(modes: &mut Modes, omega_unit: f64) {
    let rounding = RIGID * omega_unit;
    modes.omega.iter_mut().filter(|w| **w < rounding).for_each(|w| *w = 0.0);
}

/// `M = LLᵀ`, then the symmetric problem `L⁻¹KL⁻ᵀ`.
fn dense(k: &Csr, m: &Csr, count: usize) -> Result<Modes, FemError> {
    let n = k.n_rows();
    let full = |a: &Csr| {
        let mut d = Mat::<f64>::zeros(n, n);
        a.triplets().for_each(|(i, j, v)| d[(i, j)] = v);
        d
    };
    let failed = |_| FemError::NotPositiveDefinite { what: "mass matrix" };
    let l = full(m).llt(Side::Lower).map_err(failed)?;
    let l = l.L();
    let mut a = full(k);
    l.solve_lower_triangular_in_place(a.as_mut());
    let mut a = a.transpose().to_owned();
    l.solve_lower_triangular_in_place(a.as_mut());
    // the library's divide and conquer loses digits where entries are far from one: steel in SI units, residuals of 1e-3
    let size = (0..n).fold(0.0f64, |m, i| m.max(a[(i, i)].abs()));
    let unit = if size > 0.0 { size.log2().round().exp2() } else { 1.0 };
    (0..n).for_each(|j| a.col_as_slice_mut(j).iter_mut().for_each(|x| *x /= unit));
    let eigen = a
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| FemError::Eigen { size: n, wanted: count })?;
    let mut vectors = eigen.U().to_owned();
    l.transpose().solve_upper_triangular_in_place(vectors.as_mut());
    let values = eigen.S().column_vector();
    Ok(Modes {
        omega: (0..count).map(|j| (unit * values[j].max(0.0)).sqrt()).collect(),
        shapes: (0..count).map(|j| (0..n).map(|i| vectors[(i, j)]).collect()).collect(),
    })
}

/// Shift-inverted Lanczos in the M inner product with full reorthogonalisation.
fn lanczos(k: &Csr, m: &Csr, count: usize, omega_unit: f64) -> Result<Modes, FemError> {
    let n = k.n_rows();
    let shift = 0.01 * omega_unit * omega_unit;
    let factor = SpdFactor::new(&Csr::combination(1.0, k, shift, m), "shifted stiffness matrix")?;
    let mut scratch = factor.scratch();
    let limit = n.min(20 * count + 200);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();

    // deterministic start that no symmetry of the mesh is orthogonal to
    let mut q: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64 * 0.754_877_666).fract()).collect();
    let mut mq = vec![0.0; n];
    m.mul(&q, &mut mq);
    let norm = dot(&q, &mq).sqrt();
    q.iter_mut().chain(&mut mq).for_each(|x| *x /= norm);

    let (mut basis, mut m_basis): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (vec![], vec![]);
    let (mut alpha, mut beta): (Vec<f64>, Vec<f64>) = (vec![], vec![]);
    let mut next_check = count + 10;
    loop {
        let mut w = mq.clone();
        basis.push(q);
        m_basis.push(mq);
        factor.solve(&mut w, &mut scratch);
        alpha.push(dot(&w, &m_basis[m_basis.len() - 1]));
        for _ in 0..2 {
            for (b, mb) in basis.iter().zip(&m_basis) {
                let c = dot(&w, mb);
                w.iter_mut().zip(b).for_each(|(w, b)| *w -= c * b);
            }
        }
        let mut mw = vec![0.0; n];
        m.mul(&w, &mut mw);
        let norm = dot(&w, &mw).max(0.0).sqrt();
        let steps = alpha.len();
        let done = steps >= limit || norm <= 1e-300;
        if steps >= next_check || done {
            // each check costs an eigensolution of the small problem
            next_check = steps + (steps / 8).max(10);
            let mut t = nalgebra::DMatrix::<f64>::zeros(steps, steps);
            for i in 0..steps {
                t[(i, i)] = alpha[i];
                if i + 1 < steps {
                    t[(i, i + 1)] = beta[i];
                    t[(i + 1, i)] = beta[i];
                }
            }
            let eigen = t.symmetric_eigen();
            let mut order: Vec<usize> = (0..steps).collect();
            order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
            let wanted = &order[..count];
            let residual = |j: &usize| {
                norm * eigen.eigenvectors[(steps - 1, *j)].abs() / eigen.eigenvalues[*j].abs()
            };
            if wanted.iter().map(residual).fold(0.0, f64::max) < 1e-13 {
                let shape = |&j: &usize| {
                    let mut x = vec![0.0; n];
                    for (b, &c) in basis.iter().zip(eigen.eigenvectors.column(j).iter()) {
                        x.iter_mut().zip(b).for_each(|(x, b)| *x += c * b);
                    }
                    x
                };
                let omega = |&j: &usize| (1.0 / eigen.eigenvalues[j] - shift).max(0.0).sqrt();
                return Ok(Modes {
                    omega: wanted.iter().map(omega).collect(),
                    shapes: wanted.iter().map(shape).collect(),
                });
            }
        }
        if done {
            return Err(FemError::Eigen { size: n, wanted: count });
        }
        beta.push(norm);
        w.iter_mut().chain(&mut mw).for_each(|x| *x /= norm);
        (q, mq) = (w, mw);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Body, DofMap, MassForm, Material};

    #[test]
    fn negative_pivots_count_modes() {
        // λ_j = 2 − 2 cos(jπ/(n + 1))
        let n = 60;
        let all = (0..n).flat_map(|i| (i.max(1) - 1..(i + 2).min(n)).map(move |j| (i, j)));
        let entries = all.map(|(i, j)| (i, j, if i == j { 2.0 } else { -1.0 })).collect();
        let k = Csr::from_triplets(n, n, entries);
        let m = Csr::from_triplets(n, n, (0..n).map(|i| (i, i, 1.0)).collect());
        let of = |j: f64| 2.0 - 2.0 * (j * std::f64::consts::PI / (n as f64 + 1.0)).cos();
        for below in [0usize, 1, 17, 59, 60] {
            assert_eq!(count_below(&k, &m, of(below as f64 + 0.5)).unwrap(), below);
        }
    }
    use crate::fem::{Facing, Held};
    use crate::mesh::structured;

    #[test]
    fn bar_has_the_exact_discrete_frequencies() {
        // consistent mass, fixed–free, closed form of the uniform mesh
        let n = 40;
        let mesh = structured::bar(1.0, n);
        let dofs = DofMap::new(&mesh, &[Held::along("left", 0)], &[]).unwrap();
        let material = Material::bar(1.0, 1.0, 1.0);
        let b = Body::assemble(mesh, dofs, &[material], MassForm::Consistent);
        let modes = lowest(&b.stiffness, &b.mass, 5, 1.0).unwrap();
        for (j, w) in modes.omega.iter().enumerate() {
            let c = ((2 * j + 1) as f64 * std::f64::consts::PI / (2 * n) as f64).cos();
            let exact = n as f64 * (6.0 * (1.0 - c) / (2.0 + c)).sqrt();
            assert!((w / exact - 1.0).abs() < 1e-11, "{w} {exact}");
        }
    }

    /// Modes must not depend on units: `ω → sω` when `K → s²K`.
    #[test]
    fn modes_of_steel_in_si_units_are_as_accurate_as_any() {
        let mesh = structured::rectangle(1.0, 0.3, 20, 6);
        let dofs = DofMap::new(
            &mesh,
            &[Held::along("left", 0), Held::along("bottom", 1)],
            &[Facing::surface("right")],
        )
        .unwrap();
        let material = Material::plate(1.0, 0.3, 1.0, 1.0);
        let b = Body::assemble(mesh, dofs, &[material], MassForm::Consistent);
        let n = b.stiffness.n_rows();
        for (k, m) in [(1.0, 1.0), (2.1e11, 7.8e3 * 4e-2), (1e-9, 1e4), (1e14, 1e-9)] {
            let zero = Csr::from_triplets(n, n, vec![]);
            let stiffness = Csr::combination(k, &b.stiffness, 0.0, &zero);
            let mass = Csr::combination(m, &b.mass, 0.0, &zero);
            let modes = all(&stiffness, &mass, (k / m).sqrt()).unwrap();
            let (mut kx, mut mx) = (vec![0.0; n], vec![0.0; n]);
            for (w, x) in modes.omega.iter().zip(&modes.shapes) {
                stiffness.mul(x, &mut kx);
                mass.mul(x, &mut mx);
                let size = kx.iter().fold(0.0f64, |s, x| s.max(x.abs()));
                let off = kx.iter().zip(&mx).fold(0.0f64, |s, (k, m)| s.max((k - w * w * m).abs()));
                assert!(off < 1e-10 * size, "{k:e} {m:e}: {off:e} of {size:e}");
            }
        }
    }

    /// A fine bar that is held nowhere: one rigid motion, of equal displacements; and one on a spring whose frequency is below what the eigensolution resolves is none.
    #[test]
    fn rigid_motions_of_fine_meshes_are_rigid() {
        let n = 400;
        let mesh = structured::bar(10.0, n);
        let dofs = DofMap::new(&mesh, &[], &[]).unwrap();
        let material = Material::bar(900.0, 1.0, 1.0);
        let b = Body::assemble(mesh, dofs, &[material], MassForm::Consistent);
        let unit = std::f64::consts::FRAC_PI_2 * 3.0;
        let modes = all(&b.stiffness, &b.mass, unit).unwrap();
        assert!(modes.omega[0] == 0.0 && modes.omega[1] > 1.0, "{:?}", &modes.omega[..2]);
        let (first, rest) = modes.shapes[0].split_first().unwrap();
        assert!(rest.iter().all(|x| (x / first - 1.0).abs() < 1e-12));
        let size = b.stiffness.n_rows();
        let spring = Csr::from_triplets(size, size, vec![(0, 0, 1e-6)]);
        let held = Csr::combination(1.0, &b.stiffness, 1.0, &spring);
        let modes = all(&held, &b.mass, unit).unwrap();
        // ω² = k/(ρL)
        assert!((modes.omega[0] / 1e-7f64.sqrt() - 1.0).abs() < 1e-2, "{:e}", modes.omega[0]);
    }

    #[test]
    fn lanczos_agrees_with_dense_and_finds_rigid_motions() {
        let mesh = structured::rectangle(1.0, 0.4, 12, 6);
        let dofs =
            DofMap::new(&mesh, &[Held::along("bottom", 1)], &[Facing::surface("right")]).unwrap();
        let material = Material::plate(1.0, 0.3, 1.0, 1.0);
        let b = Body::assemble(mesh, dofs, &[material], MassForm::Consistent);
        let a = dense(&b.stiffness, &b.mass, 6).unwrap();
        let l = lanczos(&b.stiffness, &b.mass, 6, 1.6).unwrap();
        for j in 0..6 {
            assert!((a.omega[j] - l.omega[j]).abs() < 1e-7 + 1e-11 * a.omega[j]);
            let mut mx = vec![0.0; a.shapes[j].len()];
            b.mass.mul(&a.shapes[j], &mut mx);
            let overlap: f64 = mx.iter().zip(&l.shapes[j]).map(|(a, b)| a * b).sum();
            assert!((overlap.abs() - 1.0).abs() < 1e-10, "mode {j}: {overlap}");
        }
    }
}
