//! Discrete elements: springs and masses along a combination `w u` of displacements, of the energies `½ k (w u)²` and `½ m (w u̇)²`.
//!
//! `w` is the displacement of a node along a direction, the mean of a group, or the difference of two such ends.

use super::sparse::Csr;

/// A spring, a mass, or both, along `w u`.
#[derive(Debug, Clone, PartialEq)]
pub struct Discrete {
    /// `w`: entries over the displacements, each once.
    pub row: Vec<(usize, f64)>,
    /// `k`
    pub stiffness: f64,
    /// `m`
    pub mass: f64,
}

/// `w x` of a row.
pub(crate) fn along(row: &[(usize, f64)], x: &[f64]) -> f64 {
    row.iter().map(|&(j, w)| w * x[j]).sum()
}

impl Discrete {
    /// `w x`
    pub fn along(&self, x: &[f64]) -> f64 {
        along(&self.row, x)
    }
}

/// A matrix with `c w wᵀ` of every element added, `c` its stiffness or its mass; elements that have none change nothing.
pub fn with_elements(a: Csr, elements: &[Discrete], of: fn(&Discrete) -> f64) -> Csr {
    let mut entries: Vec<(usize, usize, f64)> = vec![];
    for element in elements.iter().filter(|e| of(e) != 0.0) {
        let (c, row) = (of(element), &element.row);
        entries.extend(
            row.iter().flat_map(|&(i, v)| row.iter().map(move |&(j, w)| (i, j, c * v * w))),
        );
    }
    match entries.is_empty() {
        true => a,
        false => Csr::from_triplets(a.n_rows(), a.n_cols(), a.triplets().chain(entries).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energies_are_those_of_the_elements() {
        let a = Csr::from_triplets(3, 3, (0..3).map(|i| (i, i, 2.0)).collect());
        let spring = Discrete { row: vec![(0, 1.0), (2, -0.5)], stiffness: 3.0, mass: 0.25 };
        let x = [0.7, -1.0, 0.4];
        let along = 0.7 - 0.5 * 0.4;
        assert_eq!(spring.along(&x), along);
        let own = a.quadratic(&x);
        let elements = [spring];
        let k = with_elements(a.clone(), &elements, |e| e.stiffness);
        assert!((k.quadratic(&x) - own - 3.0 * along * along).abs() < 1e-15);
        let m = with_elements(a, &elements, |e| e.mass);
        assert!((m.quadratic(&x) - own - 0.25 * along * along).abs() < 1e-15);
    }
}
