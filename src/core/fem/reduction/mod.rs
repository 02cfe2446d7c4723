//! Reduction of `u_O`, never of `u_C`: `u_O = T y`, by what the body whose interface is held does ([`fixed`]) or by what the open body does ([`free`]).
//!
//! The complementarity problem is untouched. (With `u_C` among the boundary coordinates, as in the method of Craig and Bampton, the jumps of `u̇_C` drag the
//! velocity of the interior along: another law of impact, off by 1.6 % whatever the number of modes.) Displacements along obstacles with friction are coordinates of `y`.

mod fixed;
mod free;

use faer::{Mat, Side};

use super::FemError;
use super::dense::product;
use super::dofs::DofMap;
use super::eigen::Modes;
use super::sparse::Csr;

/// What the interface does in the modes that are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interface {
    /// Displacements that the contact conditions touch are held.
    Fixed,
    /// They are as free as those of the open body.
    Free,
}

/// How many modes are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kept {
    /// So many.
    Modes(usize),
    /// All below a circular frequency.
    Below(f64),
}

/// The basis `T`, and the way back.
#[derive(Debug, Clone, PartialEq)]
pub struct Reduction {
    /// `T`, `n_O × n_y`.
    basis: Mat<f64>,
    /// `D`, `n_O × n_y`: `y = Dᵀ u_O` for a `u_O` in the range of `T`, its projection in the elastic energy for any other.
    dual: Mat<f64>,
    /// Numbering of the full body.
    pub dofs: DofMap,
    /// Which modes.
    pub interface: Interface,
    /// Displacements of `u_O` that are coordinates, the first ones of `y` in this order.
    pub coordinates: Vec<usize>,
    /// Number of modes.
    pub modes: usize,
    /// Frequency of the first mode that was left out; none if all were kept.
    pub cutoff: Option<f64>,
}

/// Singular values of the static shapes below this, over the largest, are rounding errors.
const DEPENDENT: f64 = 1e-6;

impl Reduction {
    /// Number of coordinates `y`.
    pub fn n_y(&self) -> usize {
        self.basis.ncols()
    }

    /// Which coordinate a displacement of `u_O` is.
    pub fn place(&self, displacement: usize) -> Option<usize> {
        self.coordinates.iter().position(|i| *i == displacement)
    }

    /// The same span with these displacements as its first coordinates: with `B` their rows in `T` and `Z` a basis of what leaves them at rest,
    /// `T ← T [B⁺, Z]`, `D ← D [Bᵀ, Z]`.
    pub fn with_coordinates(self, displacements: &[usize]) -> Result<Reduction, FemError> {
        let (n, m) = (displacements.len(), self.n_y());
        if n == 0 {
            return Ok(self);
        }
        let singular =
            || FemError::Singular { what: "displacements along the obstacle of a reduced body" };
        if n > m {
            return Err(singular());
        }
        let rows = Mat::from_fn(m, n, |j, i| self.basis[(displacements[i], j)]);
        // Bᵀ = Q R
        let qr = rows.qr();
        let (q, r) = (qr.compute_Q(), qr.thin_R());
        let largest = (0..n).fold(0.0f64, |s, i| s.max(r[(i, i)].abs()));
        if (0..n).any(|i| r[(i, i)].abs() <= DEPENDENT * largest) {
            return Err(singular());
        }
        // B⁺ = Q₁ R⁻ᵀ
        let mut inverse = Mat::<f64>::identity(n, n);
        r.transpose().solve_lower_triangular_in_place(inverse.as_mut());
        let right = product(q.get(.., ..n), inverse.as_ref());
        let join = |first: &Mat<f64>| {
            Mat::from_fn(m, m, |i, j| if j < n { first[(i, j)] } else { q[(i, j)] })
        };
        Ok(Reduction {
            basis: product(self.basis.as_ref(), join(&right).as_ref()),
            dual: product(self.dual.as_ref(), join(&rows).as_ref()),
            coordinates: displacements.to_vec(),
            ..self
        })
    }

    /// `u_O = T y`
    pub fn expand(&self, y: &[f64]) -> Vec<f64> {
        let columns = (0..self.n_y()).filter(|&c| y[c] != 0.0);
        let mut u = vec![0.0; self.basis.nrows()];
        for c in columns {
            u.iter_mut().zip(self.basis.col_as_slice(c)).for_each(|(u, t)| *u += t * y[c]);
        }
        u
    }

    /// `y` of a `u_O`.
    pub fn project(&self, u: &[f64]) -> Vec<f64> {
        transposed(&self.dual, u)
    }

    /// `(Tᵀ f_O, f_C)` of a load.
    pub fn load(&self, f: &[f64]) -> Vec<f64> {
        let (f_o, f_c) = f.split_at(self.basis.nrows());
        transposed(&self.basis, f_o).into_iter().chain(f_c.iter().copied()).collect()
    }

    /// `N T` of an operator on `u_O`.
    pub fn operator(&self, a: &Csr) -> Csr {
        let product = self.times(a);
        let n_y = self.n_y();
        let entries = (0..a.n_rows()).flat_map(|i| (0..n_y).map(move |c| (i, c)));
        let entries = entries.map(|(i, c)| (i, c, product[(i, c)])).filter(|e| e.2 != 0.0);
        Csr::from_triplets(a.n_rows(), n_y, entries.collect())
    }

    /// `R diag(T, 1)` of rows over `u = (u_O, u_C)`.
    pub fn rows(&self, r: &Csr) -> Csr {
        let (n_o, n_y) = (self.basis.nrows(), self.n_y());
        let of_o = r.triplets().filter(|e| e.1 < n_o).collect();
        let of_o = self.operator(&Csr::from_triplets(r.n_rows(), n_o, of_o));
        let of_c = r.triplets().filter(|e| e.1 >= n_o).map(|(i, j, v)| (i, n_y + j - n_o, v));
        let n = n_y + r.n_cols() - n_o;
        Csr::from_triplets(r.n_rows(), n, of_o.triplets().chain(of_c).collect())
    }

    /// `diag(T, 1)ᵀ A diag(T, 1)` of a symmetric matrix over `u = (u_O, u_C)`.
    pub(crate) fn congruence(&self, a: &Csr) -> Csr {
        let (n_o, n_y) = (self.basis.nrows(), self.n_y());
        let n_c = a.n_rows() - n_o;
        let rows = |from: usize, to: usize| {
            let entries = a.triplets().filter(|e| (from..to).contains(&e.0) && e.1 < n_o);
            Csr::from_triplets(to - from, n_o, entries.map(|(i, j, v)| (i - from, j, v)).collect())
        };
        let right = self.times(&rows(0, n_o));
        let of_o = product(self.basis.transpose(), right.as_ref());
        let of_c = self.times(&rows(n_o, n_o + n_c));
        let mut entries = vec![];
        for i in 0..n_y {
            // symmetric to the last digit
            entries.extend((0..n_y).map(|j| (i, j, 0.5 * (of_o[(i, j)] + of_o[(j, i)]))));
            for c in 0..n_c {
                let v = of_c[(c, i)];
                if v != 0.0 {
                    entries.extend([(i, n_y + c, v), (n_y + c, i, v)]);
                }
            }
        }
        let contact = a.triplets().filter(|e| e.0 >= n_o && e.1 >= n_o);
        entries.extend(contact.map(|(i, j, v)| (n_y + i - n_o, n_y + j - n_o, v)));
        Csr::from_triplets(n_y + n_c, n_y + n_c, entries)
    }

    /// `A T`
    fn times(&self, a: &Csr) -> Mat<f64> {
        let mut product = Mat::zeros(a.n_rows(), self.n_y());
        for c in 0..self.n_y() {
            a.mul(self.basis.col_as_slice(c), product.col_as_slice_mut(c));
        }
        product
    }
}

fn transposed(a: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    let dot = |c: usize| a.col_as_slice(c).iter().zip(x).map(|(a, x)| a * x).sum();
    (0..a.ncols()).map(dot).collect()
}

/// The modes that are kept of the `n` that `lowest` gives so many as are asked for of, and the frequency of the first one that is not.
fn kept(
    n: usize,
    kept: Kept,
    mut lowest: impl FnMut(usize) -> Result<Modes, FemError>,
) -> Result<(Modes, Option<f64>), FemError> {
    let mut wanted = match kept {
        Kept::Modes(count) => (count + 1).min(n),
        Kept::Below(_) => 60.min(n),
    };
    loop {
        let mut modes = lowest(wanted)?;
        let count = match kept {
            Kept::Modes(count) => count,
            Kept::Below(cutoff) => modes.omega.iter().take_while(|w| **w <= cutoff).count(),
        };
        if count < modes.omega.len() || wanted == n {
            let next = modes.omega.get(count).copied();
            modes.omega.truncate(count);
            modes.shapes.truncate(count);
            return Ok((modes, next));
        }
        wanted = (2 * wanted).min(n);
    }
}

/// The modes, and what the static shapes add to them, orthonormal in `K`.
fn independent(
    k: &Csr,
    modes: Vec<Vec<f64>>,
    statics: Vec<Vec<f64>>,
) -> Result<Vec<Vec<f64>>, FemError> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut kx = vec![0.0; k.n_rows()];
    let largest = statics.iter().map(|x| k.quadratic(x)).fold(0.0, f64::max).sqrt();
    if largest == 0.0 {
        return Ok(modes);
    }
    let mut rest = vec![];
    for mut x in statics {
        x.iter_mut().for_each(|x| *x /= largest);
        for _ in 0..2 {
            k.mul(&x, &mut kx);
            for mode in &modes {
                let c = dot(mode, &kx);
                x.iter_mut().zip(mode).for_each(|(x, m)| *x -= c * m);
            }
        }
        rest.push(x);
    }
    let size = rest.len();
    let mut gram = Mat::zeros(size, size);
    for j in 0..size {
        k.mul(&rest[j], &mut kx);
        (0..size).for_each(|i| gram[(i, j)] = dot(&rest[i], &kx));
    }
    let eigen =
        gram.self_adjoint_eigen(Side::Lower).map_err(|_| FemError::Eigen { size, wanted: size })?;
    let mut all = modes;
    for j in 0..size {
        let value = eigen.S()[j];
        if value <= DEPENDENT * DEPENDENT {
            continue;
        }
        let mut x = vec![0.0; k.n_rows()];
        for (i, r) in rest.iter().enumerate() {
            let c = eigen.U()[(i, j)] / value.sqrt();
            x.iter_mut().zip(r).for_each(|(x, r)| *x += c * r);
        }
        all.push(x);
    }
    Ok(all)
}
