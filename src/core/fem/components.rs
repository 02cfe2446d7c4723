//! A matrix that falls apart: its graph is not connected.
//!
//! The consistent mass `M = M_s ⊗ I` does not couple displacements along different axes, and where they are held at the same nodes the parts are equal, too. One factor serves
//! all of them, and all vectors are solved for side by side: `L` is read once for up to six of them.

use std::ops::Range;

use pulp::Arch;

use super::simplicial::Lower;
use super::sparse::Csr;
use super::stencil::SAME;

/// Equal parts that are solved for together at the most; vectors at once.
const PARTS: usize = 3;
const VECTORS: usize = 2;

/// The factors of all parts.
#[derive(Debug)]
pub struct Components {
    n: usize,
    /// Rows that are coupled to no other, with the reciprocal of their entry.
    single: Vec<(usize, f64)>,
    equal: Vec<Equal>,
    arch: Arch,
}

/// Equal parts: their factor, and the row of the matrix of each row of it.
#[derive(Debug)]
struct Equal {
    lower: Lower,
    rows: Vec<Vec<usize>>,
}

/// The rows of each part, in their order.
fn parts(a: &Csr) -> Vec<Vec<usize>> {
    let n = a.n_rows();
    let mut part_of = vec![None; n];
    let mut parts: Vec<Vec<usize>> = vec![];
    let mut next = vec![];
    for first in 0..n {
        if part_of[first].is_some() {
            continue;
        }
        let mut rows = vec![];
        next.push(first);
        part_of[first] = Some(parts.len());
        while let Some(i) = next.pop() {
            rows.push(i);
            for (j, _) in a.row(i) {
                if part_of[j].is_none() {
                    part_of[j] = Some(parts.len());
                    next.push(j);
                }
            }
        }
        parts.push(rows);
    }
    parts
}

/// Equal but for sums of the same elements in another order.
fn is_equal(a: &Csr, b: &Csr) -> bool {
    let of_row = |i: usize| {
        let size = a.entry(i, i).map_or(0.0, |d| d.abs());
        let close =
            |(x, y): ((usize, f64), (usize, f64))| x.0 == y.0 && (x.1 - y.1).abs() <= SAME * size;
        a.row(i).count() == b.row(i).count() && a.row(i).zip(b.row(i)).all(close)
    };
    a.n_rows() == b.n_rows() && (0..a.n_rows()).all(of_row)
}

impl Components {
    /// None where the matrix does not fall apart; nothing in it where it is not positive definite. `nodes`: parts are compared in the order of these numbers.
    pub fn new(a: &Csr, nodes: &[usize]) -> Option<Option<Components>> {
        let mut parts = parts(a);
        if parts.len() < 2 {
            return None;
        }
        let mut single = vec![];
        let mut place = vec![usize::MAX; a.n_rows()];
        let mut different: Vec<(Csr, Vec<Vec<usize>>)> = vec![];
        for rows in &mut parts {
            if let [i] = rows[..] {
                single.push((i, 1.0 / a.entry(i, i).copied().unwrap_or(0.0)));
                continue;
            }
            rows.sort_unstable_by_key(|i| (nodes[*i], *i));
            let matrix = a.among_by(rows, &mut place);
            let alike = different.iter_mut().find(|d| d.1.len() < PARTS && is_equal(&d.0, &matrix));
            match alike {
                Some((_, all)) => all.push(rows.clone()),
                None => different.push((matrix, vec![rows.clone()])),
            }
        }
        let factorised = |(matrix, parts): (Csr, Vec<Vec<usize>>)| {
            let lower = Lower::new(&matrix)?;
            let of_part = |rows: Vec<usize>| lower.order.iter().map(|k| rows[*k]).collect();
            Some(Equal { rows: parts.into_iter().map(of_part).collect(), lower })
        };
        let equal = different.into_iter().map(factorised).collect::<Option<Vec<Equal>>>();
        let is_positive = single.iter().all(|(_, d)| d.is_finite() && *d > 0.0);
        let arch = Arch::new();
        let whole = |equal| Components { n: a.n_rows(), single, equal, arch };
        Some(equal.filter(|_| is_positive).map(whole))
    }

    /// Numbers that [`Components::solve`] needs room for.
    pub fn room(&self) -> usize {
        let of = |e: &Equal| VECTORS * e.rows.len() * e.lower.n();
        self.equal.iter().map(of).max().unwrap_or(0)
    }

    /// `x ← A⁻¹ x`, vectors one after the other.
    pub fn solve(&self, x: &mut [f64], room: &mut [f64]) {
        for x in x.chunks_mut(VECTORS * self.n) {
            for vector in x.chunks_exact_mut(self.n) {
                self.single.iter().for_each(|&(i, d)| vector[i] *= d);
            }
            let vectors = 0..x.len() / self.n;
            for equal in &self.equal {
                let room = &mut room[..equal.lower.n() * equal.rows.len() * vectors.len()];
                match equal.rows.len() * vectors.len() {
                    1 => self.lanes::<1>(equal, vectors.clone(), x, room),
                    2 => self.lanes::<2>(equal, vectors.clone(), x, room),
                    3 => self.lanes::<3>(equal, vectors.clone(), x, room),
                    4 => self.lanes::<4>(equal, vectors.clone(), x, room),
                    _ => self.lanes::<6>(equal, vectors.clone(), x, room),
                }
            }
        }
    }

    /// Equal parts of some vectors, all of them side by side.
    fn lanes<const N: usize>(
        &self,
        equal: &Equal,
        vectors: Range<usize>,
        x: &mut [f64],
        room: &mut [f64],
    ) {
        let (room, _) = room.as_chunks_mut::<N>();
        let lanes = || vectors.clone().flat_map(|v| equal.rows.iter().map(move |r| (v, r)));
        for (lane, (v, rows)) in lanes().enumerate() {
            let x = &x[v * self.n..(v + 1) * self.n];
            room.iter_mut().zip(rows).for_each(|(r, i)| r[lane] = x[*i]);
        }
        equal.lower.solve(self.arch, room);
        for (lane, (v, rows)) in lanes().enumerate() {
            let x = &mut x[v * self.n..(v + 1) * self.n];
            room.iter().zip(rows).for_each(|(r, i)| x[*i] = r[lane]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `M_s ⊗ I` on a grid, of which the last nodes are held along the last axis where `held` says so; the first displacements of some nodes come last.
    fn mass(axes: usize, sides: [usize; 2], held: usize) -> (Csr, Vec<usize>) {
        let count = sides[0] * sides[1];
        let mut place = vec![vec![None; axes]; count];
        let mut nodes = vec![];
        for is_last in [false, true] {
            for (k, place) in place.iter_mut().enumerate() {
                for (c, place) in place.iter_mut().enumerate() {
                    let is_held = c + 1 == axes && k + held >= count;
                    if !is_held && is_last == (c == 0 && k % sides[1] == 3) {
                        *place = Some(nodes.len());
                        nodes.push(k);
                    }
                }
            }
        }
        let at = |k: usize| [k / sides[1], k % sides[1]];
        let mut entries = vec![];
        for (k, l) in (0..count).flat_map(|k| (0..count).map(move |l| (k, l))) {
            let d = [0, 1].map(|c| at(k)[c].abs_diff(at(l)[c]));
            if d[0] > 1 || d[1] > 1 {
                continue;
            }
            let v = [4.0, 1.0][d[0]] * [4.0, 1.0][d[1]] * (1.0 + 0.1 * ((k * l) as f64).sin());
            for c in 0..axes {
                entries.extend(place[k][c].zip(place[l][c]).map(|(i, j)| (i, j, v)));
            }
        }
        (Csr::from_triplets(nodes.len(), nodes.len(), entries), nodes)
    }

    #[test]
    fn parts_are_solved_for_side_by_side() {
        for (axes, held, kinds) in [(1, 0, 0), (2, 0, 1), (3, 0, 1), (2, 5, 2), (3, 5, 2)] {
            let (a, nodes) = mass(axes, [9, 13], held);
            let n = a.n_rows();
            let Some(found) = Components::new(&a, &nodes) else {
                assert_eq!(kinds, 0);
                continue;
            };
            let factor = found.unwrap();
            assert_eq!(factor.equal.len(), kinds);
            let mut room = vec![0.0; factor.room()];
            for columns in [1, 2, 5] {
                let exact: Vec<f64> = (0..n * columns).map(|i| (0.3 * i as f64).sin()).collect();
                let mut x = vec![0.0; n * columns];
                for (x, e) in x.chunks_exact_mut(n).zip(exact.chunks_exact(n)) {
                    a.mul(e, x);
                }
                factor.solve(&mut x, &mut room);
                let worst = x.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-13, "{axes} {held} {columns}: {worst}");
            }
        }
    }

    #[test]
    fn what_is_not_positive_definite_is_an_error() {
        let coupled = [(0, 0, 1.0), (0, 2, 2.0), (2, 0, 2.0), (2, 2, 1.0)];
        let with =
            |d: f64| Csr::from_triplets(3, 3, coupled.into_iter().chain([(1, 1, d)]).collect());
        let found = |d: f64| Components::new(&with(d), &[0, 0, 1]).unwrap();
        assert!(found(1.0).is_none());
        let apart = [(0, 0, 3.0), (0, 2, 2.0), (2, 0, 2.0), (2, 2, 3.0)];
        let with =
            |d: f64| Csr::from_triplets(3, 3, apart.into_iter().chain([(1, 1, d)]).collect());
        let found = |d: f64| Components::new(&with(d), &[0, 0, 1]).unwrap();
        assert!(found(1.0).is_some());
        assert!(found(0.0).is_none() && found(-1.0).is_none());
    }
}
