//! Displacements of given matrices that count along other directions than those of their files.
//!
//! ```text
//! u = Σ_a b_a u'_a,   b_a·b_b = δ_ab,   K'_ab = b_aᵀ K b_b
//! ```
//!
//! over the rows of one node: a displacement that counts the other way has `b = −1`; before an oblique obstacle `b` are its direction `n` and what is
//! perpendicular to it. In the plane `(n, t)` turn counter-clockwise; in space they are columns of the reflection that takes the axis nearest to `n` to it (Householder).

/// Rows of a node, and what each of them is.
#[derive(Debug, Clone, PartialEq)]
pub struct Turned {
    /// Rows in the files, by their axes.
    rows: Vec<usize>,
    /// `b_a`, one a row, over the axes of the rows.
    basis: Vec<Vec<f64>>,
    /// Which of them is `n`.
    normal: usize,
}

impl Turned {
    /// A displacement that counts the other way.
    pub(super) fn flip(row: usize) -> Turned {
        Turned { rows: vec![row], basis: vec![vec![-1.0]], normal: 0 }
    }

    /// Rows of one node, with the components of a unit vector along their axes, none of them zero, two at least.
    pub(super) fn towards(rows: Vec<usize>, n: &[f64]) -> Turned {
        let nearest = |best: usize, i: usize| if n[i].abs() > n[best].abs() { i } else { best };
        let k = (0..n.len()).fold(0, nearest);
        let basis = match n {
            [x, y] => {
                let (along, across) = (vec![*x, *y], vec![-y, *x]);
                if k == 0 { vec![along, across] } else { vec![across, along] }
            }
            _ => {
                // v = e_k − n; 1 − n_k without cancellation
                let rest: f64 = (0..n.len()).filter(|i| *i != k).map(|i| n[i] * n[i]).sum();
                let from_axis = if n[k] > 0.0 { rest / (1.0 + n[k]) } else { 1.0 - n[k] };
                let v = |i: usize| if i == k { from_axis } else { -n[i] };
                let size: f64 = (0..n.len()).map(|i| v(i) * v(i)).sum();
                let entry =
                    |a: usize, i: usize| f64::from(u8::from(a == i)) - 2.0 * v(a) * v(i) / size;
                (0..n.len()).map(|a| (0..n.len()).map(|i| entry(a, i)).collect()).collect()
            }
        };
        Turned { rows, basis, normal: k }
    }

    /// It as text, for files: its rows, and the vectors that they count along.
    pub(crate) fn text(&self) -> String {
        format!("{:?} {:?}", self.rows, self.basis)
    }

    /// Whether it turns no axis, but its sense alone.
    pub fn is_flip(&self) -> bool {
        self.rows.len() == 1
    }

    /// The row that counts along `n`.
    pub(super) fn normal_row(&self) -> usize {
        self.rows[self.normal]
    }

    /// The rows of a pair that count across `n`.
    pub(super) fn across(&self) -> impl Iterator<Item = usize> + '_ {
        self.rows.iter().copied().filter(|row| *row != self.normal_row())
    }

    /// Its rows in the files.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// What stands behind the node in the name of a row; nothing where its axis stands there.
    pub(super) fn suffix(&self, row: usize) -> Option<&'static str> {
        let place = self.rows.iter().position(|r| *r == row).filter(|_| !self.is_flip())?;
        let across = self.across().position(|r| r == row);
        Some(match across {
            None => "n",
            Some(_) if self.rows.len() == 2 => "t",
            Some(_) => ["t1", "t2"][place - usize::from(place > self.normal)],
        })
    }

    /// What counts in a row now of a field over the rows of the files: `u'_a = Σ_i b_ai u_i`.
    pub(super) fn component(&self, row: usize, field: impl Fn(usize) -> f64) -> f64 {
        let a = self.rows.iter().position(|r| *r == row);
        let of = |b: &Vec<f64>| self.rows.iter().zip(b).map(|(i, b)| b * field(*i)).sum();
        a.map_or(0.0, |a| of(&self.basis[a]))
    }

    /// The displacement of a row of the files over what counts now: `u_i = Σ_a b_ai u'_a`.
    pub fn terms(&self, row: usize) -> Option<impl Iterator<Item = (usize, f64)> + '_> {
        let i = self.rows.iter().position(|r| *r == row)?;
        Some(self.rows.iter().zip(&self.basis).map(move |(a, b)| (*a, b[i])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions near axes, far from them and against them: bases are orthonormal to rounding, the nearest row points there, and names say which.
    #[test]
    fn bases_are_orthonormal_and_point_to_the_obstacle() {
        let all: [&[f64]; 7] = [
            &[0.6, 0.8],
            &[-0.8, 0.6],
            &[1.0, 1e-9],
            &[2.0, -3.0, 6.0],
            &[-2.0, -3.0, -6.0],
            &[1.0, 1e-9, -1e-8],
            &[-1.0, 1e-9, -1e-8],
        ];
        for given in all {
            let size = given.iter().map(|x| x * x).sum::<f64>().sqrt();
            let n: Vec<f64> = given.iter().map(|x| x / size).collect();
            let turned = Turned::towards((4..4 + n.len()).collect(), &n);
            let b = &turned.basis;
            for (a, c) in (0..n.len()).flat_map(|a| (0..n.len()).map(move |c| (a, c))) {
                let product: f64 = b[a].iter().zip(&b[c]).map(|(x, y)| x * y).sum();
                assert!((product - f64::from(u8::from(a == c))).abs() < 4e-16, "{given:?} {b:?}");
            }
            let own = &b[turned.normal_row() - 4];
            assert!(own.iter().zip(&n).all(|(b, n)| (b - n).abs() < 3e-16), "{given:?} {own:?}");
            assert_eq!(turned.suffix(turned.normal_row()), Some("n"));
            let others: Vec<_> = turned.across().filter_map(|row| turned.suffix(row)).collect();
            assert_eq!(others, if n.len() == 2 { vec!["t"] } else { vec!["t1", "t2"] });
        }
        // (n, t) turns counter-clockwise, whichever row is nearer
        for n in [[0.8, 0.6], [0.6, 0.8], [-0.6, -0.8]] {
            let turned = Turned::towards(vec![0, 1], &n);
            let across = &turned.basis[1 - turned.normal];
            assert_eq!(across, &vec![-n[1], n[0]]);
        }
    }
}
