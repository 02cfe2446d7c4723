//! Whether bodies that meet stay where it was decided what meets what: how far surfaces slide over each other, how far parts turn.
//!
//! ```text
//! s_i = |(1 − n_i n_iᵀ)(u_i − Σ_j P_ij u_m,j)| / h_i      a slave's node along its master, over the length of its sides
//! θ = I⁻¹ Σ_n r_n × u_n,   I = Σ_n (|r_n|² 1 − r_n r_nᵀ)   a part as a whole: least squares over its nodes, from their centre
//! ```
//!
//! Both are taken to be small: pairs are joined on the undeformed meshes, and rotations are linear.

use nalgebra::{Matrix3, Vector3};

use crate::fem::pair::Meeting;
use crate::fem::{Body, Csr};
use crate::mesh::Mesh;
use crate::mesh::point::{minus, norm};

/// Rows over the displacements of a mesh that tell how far its parts stray.
#[derive(Debug, Clone, Default)]
pub struct Excursions {
    /// Slave and master of each pair of surfaces.
    pub pairs: Vec<[String; 2]>,
    /// Parts that turn; none where there is but one.
    pub parts: Vec<String>,
    /// Components of a rotation: one in the plane, three in space.
    pub turns: usize,
    dim: usize,
    /// `(1 − nnᵀ)(u_i − Σ P u_m) / h`, a row a component.
    slide: Csr,
    /// The pair of each node of a slave.
    pair_of: Vec<usize>,
    /// `θ`, a row a component.
    rotation: Csr,
}

/// How far the parts of a body have strayed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Strayed {
    /// The largest `s_i` of each pair.
    pub sliding: Vec<f64>,
    /// Components of the first part's `θ`, then of the next.
    pub rotation: Vec<f64>,
}

impl Excursions {
    /// Of the pairs of a body and its parts: which of these each node belongs to.
    pub fn new(body: &Body, (of_node, names): (&[usize], &[String])) -> Excursions {
        let (mesh, dofs) = (&body.mesh, body.nodal_dofs());
        let meetings: Vec<&Meeting> =
            dofs.facing.iter().filter_map(|f| f.meeting.as_deref()).collect();
        if meetings.is_empty() {
            return Excursions::default();
        }
        let dim = mesh.dim();
        let (mut slide, mut pair_of) = (vec![], vec![]);
        let nodal = |n: usize, c: usize, w: f64| dofs.terms(n, c).map(move |(j, t)| (j, w * t));
        for (k, meeting) in meetings.iter().enumerate() {
            let sizes = lengths(mesh, &meeting.pair.slave);
            for against in &meeting.nodes {
                let n = &against.normal;
                for (row, c) in (0..dim).flat_map(|row| (0..dim).map(move |c| (row, c))) {
                    let one = if row == c { 1.0 } else { 0.0 };
                    let along = (one - n[row] * n[c]) / sizes[&against.node];
                    let row = dim * pair_of.len() + row;
                    let master = against.masters.iter().map(|(j, p)| (*j, -along * p));
                    for (node, w) in std::iter::once((against.node, along)).chain(master) {
                        slide.extend(nodal(node, c, w).map(|(j, w)| (row, j, w)));
                    }
                }
                pair_of.push(k);
            }
        }
        let turns = if dim == 3 { 3 } else { 1 };
        let mut rotation = vec![];
        let parts = if names.len() > 1 { names.to_vec() } else { vec![] };
        for part in 0..parts.len() {
            let of_part = |n: &usize| of_node[*n] == part;
            let nodes: Vec<usize> = (0..mesh.n_nodes()).filter(of_part).collect();
            for (node, turn) in rotations(mesh, &nodes) {
                for (row, c) in (0..turns).flat_map(|row| (0..dim).map(move |c| (row, c))) {
                    // in the plane about the third axis
                    let w = turn[(if dim == 3 { row } else { 2 }, c)];
                    let row = turns * part + row;
                    rotation.extend(nodal(node, c, w).map(|(j, w)| (row, j, w)));
                }
            }
        }
        let n = dofs.n();
        Excursions {
            rotation: Csr::from_triplets(turns * parts.len(), n, rotation),
            parts,
            pairs: meetings.iter().map(|m| [m.pair.slave.clone(), m.pair.master.clone()]).collect(),
            turns,
            dim,
            slide: Csr::from_triplets(dim * pair_of.len(), n, slide),
            pair_of,
        }
    }

    /// Components of all rotations.
    pub fn rotations(&self) -> usize {
        self.rotation.n_rows()
    }

    /// At displacements of the body, reduced or not.
    pub fn of(&self, body: &Body, u: &[f64]) -> Strayed {
        if self.pairs.is_empty() {
            return Strayed::default();
        }
        let u = body.nodal(u);
        let mut sliding = vec![0.0f64; self.pairs.len()];
        for (k, &pair) in self.pair_of.iter().enumerate() {
            let along = |c: usize| self.slide.row_dot(self.dim * k + c, &u);
            let size = (0..self.dim).map(along).fold(0.0, f64::hypot);
            sliding[pair] = sliding[pair].max(size);
        }
        let mut rotation = vec![0.0; self.rotations()];
        self.rotation.mul(&u, &mut rotation);
        Strayed { sliding, rotation }
    }
}

/// The length of the longest side at each node of a group.
fn lengths(mesh: &Mesh, group: &str) -> std::collections::BTreeMap<usize, f64> {
    let mut all = std::collections::BTreeMap::new();
    for facet in mesh.group(group) {
        let nodes = mesh.side_nodes(*facet);
        let x = |n: usize| mesh.nodes()[n];
        let pairs = nodes.iter().flat_map(|&a| nodes.iter().map(move |&b| (a, b)));
        let longest = pairs.map(|(a, b)| norm(&minus(&x(a), &x(b)))).fold(0.0, f64::max);
        for n in nodes {
            let own = all.entry(n).or_insert(0.0f64);
            *own = own.max(longest);
        }
    }
    all
}

/// `I⁻¹ [r_n]×` of each node: what its displacement adds to the rotation of all of them.
fn rotations(mesh: &Mesh, nodes: &[usize]) -> Vec<(usize, Matrix3<f64>)> {
    let count = nodes.len().max(1) as f64;
    let place = |n: usize| Vector3::from_column_slice(&mesh.nodes()[n]);
    let centre: Vector3<f64> = nodes.iter().map(|&n| place(n)).sum::<Vector3<f64>>() / count;
    let arms: Vec<Vector3<f64>> = nodes.iter().map(|&n| place(n) - centre).collect();
    let of = |r: &Vector3<f64>| Matrix3::identity() * r.norm_squared() - r * r.transpose();
    let inertia: Matrix3<f64> = arms.iter().map(of).sum();
    // nodes on one line do not tell how they turn about it
    let inverse = inertia.pseudo_inverse(1e-12 * inertia.norm()).unwrap_or_default();
    let turn = |r: &Vector3<f64>| inverse * r.cross_matrix();
    nodes.iter().copied().zip(arms.iter().map(turn)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::structured;

    /// What turns about an axis is told as this turn, of bodies thin and thick.
    #[test]
    fn turns_are_told_as_they_are() {
        for (height, n) in [(1.0, 3), (1e-3, 1)] {
            let mesh = structured::rectangle(2.0, height, 5, n);
            let nodes: Vec<usize> = (0..mesh.n_nodes()).collect();
            let theta = Vector3::new(0.3, -0.2, 0.7);
            let told: Vector3<f64> = rotations(&mesh, &nodes)
                .iter()
                .map(|(node, of)| {
                    of * theta.cross(&Vector3::from_column_slice(&mesh.nodes()[*node]))
                })
                .sum();
            // r × (θ × r) summed is I θ: the nodes of a plane know all three
            assert!((told - theta).norm() < 1e-9, "{height}: {told}");
        }
    }
}
