//! Coordinates `ŷ` of a vector `y` in which the values of some rows, `e y`, are coordinates by themselves: each takes the place of one entry of `y`, its pivot.
//!
//! ```text
//! ŷ_p = e y / e_p,      y = T ŷ
//! ```

use nalgebra::DMatrix;

use super::sparse::Csr;

/// The pivots, `T` and its inverse.
#[derive(Debug)]
pub struct Pivots {
    /// The entry whose place each row takes.
    pub pivots: Vec<usize>,
    /// `e_p` of each row: its value is `e_p ŷ_p`.
    pub scale: Vec<f64>,
    /// `T` and `T⁻¹`; none where every row is one entry, and `ŷ = y`.
    change: Option<[Csr; 2]>,
}

/// What is left of a row that others make, over its size.
const DEPENDENT: f64 = 1e-10;

impl Pivots {
    /// For rows of `n` entries, none of which follows from the others; else none.
    pub fn of(n: usize, rows: &[&[(usize, f64)]]) -> Option<Pivots> {
        let mut columns: Vec<usize> = rows.iter().flat_map(|r| r.iter().map(|e| e.0)).collect();
        columns.sort_unstable();
        columns.dedup();
        let place = |j: usize| columns.binary_search(&j).unwrap_or(0);
        let mut dense = DMatrix::<f64>::zeros(rows.len(), columns.len());
        for (i, row) in rows.iter().enumerate() {
            row.iter().for_each(|&(j, w)| dense[(i, place(j))] = w);
        }
        // Gauß: each row takes its largest entry that is left
        let mut left = dense.clone();
        let mut taken: Vec<usize> = vec![];
        for i in 0..rows.len() {
            let (pivot, largest) = (0..columns.len())
                .map(|c| (c, left[(i, c)].abs()))
                .fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
            if largest <= DEPENDENT * dense.row(i).amax() {
                return None;
            }
            taken.push(pivot);
            for k in i + 1..rows.len() {
                let factor = left[(k, pivot)] / left[(i, pivot)];
                if factor != 0.0 {
                    for c in 0..columns.len() {
                        let x = left[(i, c)];
                        left[(k, c)] -= factor * x;
                    }
                    left[(k, pivot)] = 0.0;
                }
            }
        }
        let pivots: Vec<usize> = taken.iter().map(|&c| columns[c]).collect();
        let scale: Vec<f64> = (0..rows.len())
            .map(|i| match dense[(i, taken[i])] {
                // another row has eliminated it
                0.0 => 1.0,
                w => w,
            })
            .collect();
        if rows.iter().all(|r| r.len() == 1) {
            return Some(Pivots { pivots, scale, change: None });
        }
        let inverse =
            DMatrix::from_fn(rows.len(), rows.len(), |i, k| dense[(i, taken[k])]).try_inverse()?;
        let is_pivot = |j: &usize| pivots.contains(j);
        // y_S = E_S⁻¹ (diag(scale) ŷ_S − E_F y_F)
        let mut forth: Vec<(usize, usize, f64)> =
            (0..n).filter(|j| !is_pivot(j)).map(|j| (j, j, 1.0)).collect();
        let mut back = forth.clone();
        for (i, row) in rows.iter().enumerate() {
            for (k, &p) in pivots.iter().enumerate() {
                forth.push((p, pivots[i], inverse[(k, i)] * scale[i]));
                let of_free = row.iter().filter(|e| !is_pivot(&e.0));
                forth.extend(of_free.map(|&(j, w)| (p, j, -inverse[(k, i)] * w)));
            }
            back.extend(row.iter().map(|&(j, w)| (pivots[i], j, w / scale[i])));
        }
        let whole = |entries: Vec<(usize, usize, f64)>| {
            Csr::from_triplets(n, n, entries.into_iter().filter(|e| e.2 != 0.0).collect())
        };
        Some(Pivots { pivots, scale, change: Some([whole(forth), whole(back)]) })
    }

    /// `TᵀAT`; none where `T` is the identity.
    pub fn congruence(&self, a: &Csr) -> Option<Csr> {
        self.change.as_ref().map(|[t, _]| a.congruence(t))
    }

    /// The coordinates that are no pivots.
    pub fn others(&self, n: usize) -> Vec<usize> {
        (0..n).filter(|i| !self.pivots.contains(i)).collect()
    }

    /// `y = T ŷ`, in place.
    pub fn forth(&self, y: &mut [f64]) {
        let Some([t, _]) = &self.change else { return };
        let x = y.to_vec();
        t.mul(&x, y);
    }

    /// `Tᵀf`, in place: a force on `ŷ`.
    pub fn onto(&self, f: &mut [f64]) {
        let Some([t, _]) = &self.change else { return };
        let x = f.to_vec();
        f.fill(0.0);
        t.triplets().for_each(|(i, j, v)| f[j] += v * x[i]);
    }

    /// `rT⁻¹` of a row `r` over `ŷ`, in place: a row over `y`.
    pub fn over(&self, r: &mut [f64]) {
        let Some([_, back]) = &self.change else { return };
        let x = r.to_vec();
        r.fill(0.0);
        back.triplets().for_each(|(i, j, v)| r[j] += v * x[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_coordinates() {
        let rows: [&[(usize, f64)]; 3] =
            [&[(0, 1.0), (2, -1.0)], &[(2, 1.0), (4, -1.0), (5, 0.25)], &[(3, -1.0)]];
        let p = Pivots::of(6, &rows).unwrap();
        let hat: Vec<f64> = (0..6).map(|k| (0.7 * f64::from(k) + 0.3).sin()).collect();
        let mut y = hat.clone();
        p.forth(&mut y);
        for (i, row) in rows.iter().enumerate() {
            let value: f64 = row.iter().map(|&(j, w)| w * y[j]).sum();
            assert!((value - p.scale[i] * hat[p.pivots[i]]).abs() < 1e-14);
        }
        // T⁻¹ and Tᵀ
        let mut r = vec![1.0, -0.4, 0.2, 0.9, 0.1, -1.3];
        let along = |r: &[f64], x: &[f64]| r.iter().zip(x).map(|(r, x)| r * x).sum::<f64>();
        let value = along(&r, &hat);
        let mut f = r.clone();
        p.over(&mut r);
        assert!((along(&r, &y) - value).abs() < 1e-14);
        let work = along(&f, &y);
        p.onto(&mut f);
        assert!((along(&f, &hat) - work).abs() < 1e-14);
    }

    #[test]
    fn rows_that_follow_from_others_have_no_place() {
        let rows: [&[(usize, f64)]; 3] =
            [&[(0, 1.0), (1, -1.0)], &[(1, 1.0), (2, -1.0)], &[(0, 1.0), (2, -1.0)]];
        assert!(Pivots::of(3, &rows).is_none());
        assert!(Pivots::of(3, &rows[..2]).is_some());
    }
}
