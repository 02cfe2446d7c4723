//! Numbering of the displacements: prescribed ones leave, `u = (u_O, u_C)`.
//!
//! `u_C` are displacements of contact nodes along the *outward normal*; on a left or bottom edge
//! that is minus the nodal displacement, so a sign goes with each number. Tangential displacements of contact
//! nodes belong to `u_O`: no friction.

use crate::mesh::{Edge, Mesh};

/// From nodes and components to the entries of `u`.
#[derive(Debug, Clone, PartialEq)]
pub struct DofMap {
    /// Components per node.
    pub dim: usize,
    /// Length of `u_O`.
    pub n_o: usize,
    /// Length of `u_C`.
    pub n_c: usize,
    /// Mesh nodes at the contact, in the order of `u_C` where these are their displacements.
    pub contact_nodes: Vec<usize>,
    /// Component of the contact normal.
    pub contact_axis: usize,
    /// +1, or −1 where the outward normal points against the axis.
    pub contact_sign: f64,
    index: Vec<Option<usize>>,
    /// Of given matrices: place in `u` of each row.
    rows: Vec<usize>,
}

impl DofMap {
    /// Number the displacements; `fixed` lists `(edge, component)`.
    pub fn new(mesh: &Mesh, fixed: &[(Edge, usize)], contact: Option<Edge>) -> DofMap {
        let dim = mesh.dim();
        let mut prescribed = vec![false; dim * mesh.n_nodes()];
        for &(edge, component) in fixed {
            for n in mesh.group_nodes(edge.name()) {
                prescribed[dim * n + component] = true;
            }
        }
        let contact_axis = contact.map_or(0, Edge::axis);
        let mut contact_nodes = contact.map_or(vec![], |e| mesh.group_nodes(e.name()));
        contact_nodes.retain(|&n| !prescribed[dim * n + contact_axis]);
        let mut index = vec![None; dim * mesh.n_nodes()];
        let in_contact: std::collections::HashSet<usize> =
            contact_nodes.iter().map(|&n| dim * n + contact_axis).collect();
        let mut n_o = 0;
        for d in 0..index.len() {
            if !prescribed[d] && !in_contact.contains(&d) {
                index[d] = Some(n_o);
                n_o += 1;
            }
        }
        for (i, &n) in contact_nodes.iter().enumerate() {
            index[dim * n + contact_axis] = Some(n_o + i);
        }
        DofMap {
            dim,
            n_o,
            n_c: contact_nodes.len(),
            contact_nodes,
            contact_axis,
            contact_sign: contact.map_or(1.0, Edge::sign),
            index,
            rows: vec![],
        }
    }

    /// The displacements of given matrices: node `i + 1` of a row of points carries row `i`; node 0 is fixed.
    pub fn of_rows(n: usize, contact: &[usize]) -> DofMap {
        let mut index = vec![None; n + 1];
        let mut n_o = 0;
        for i in (0..n).filter(|i| !contact.contains(i)) {
            index[i + 1] = Some(n_o);
            n_o += 1;
        }
        for (k, &i) in contact.iter().enumerate() {
            index[i + 1] = Some(n_o + k);
        }
        DofMap {
            dim: 1,
            n_o,
            n_c: contact.len(),
            contact_nodes: contact.iter().map(|i| i + 1).collect(),
            contact_axis: 0,
            contact_sign: 1.0,
            rows: index[1..].iter().flatten().copied().collect(),
            index,
        }
    }

    /// The numbering of a body whose contact displacements move by themselves: the obstacle acts on points of the edge, not on `u_C`.
    pub fn beside(mesh: &Mesh, fixed: &[(Edge, usize)], edge: Edge) -> DofMap {
        let all = DofMap::new(mesh, fixed, None);
        let (axis, sign) = (edge.axis(), edge.sign());
        let mut contact_nodes = mesh.group_nodes(edge.name());
        contact_nodes.retain(|&n| all.of(n, axis).is_some());
        DofMap { contact_nodes, contact_axis: axis, contact_sign: sign, ..all }
    }

    /// The same with `n_c` contact displacements of points that are no nodes.
    pub fn with_points(self, n_c: usize) -> DofMap {
        DofMap { n_c, ..self }
    }

    /// The same contact with `n_o` coordinates in place of `u_O`: no node has a number any more.
    pub fn of_coordinates(&self, n_o: usize) -> DofMap {
        DofMap { n_o, index: vec![None; self.index.len()], ..self.clone() }
    }

    /// Place in `u` of a row of given matrices.
    pub fn row(&self, row: usize) -> usize {
        self.rows.get(row).copied().unwrap_or(row)
    }

    /// Length of `u`.
    pub fn n(&self) -> usize {
        self.n_o + self.n_c
    }

    /// Index in `u` of a nodal displacement, with the sign that turns one into the other.
    pub fn of(&self, node: usize, component: usize) -> Option<(usize, f64)> {
        let i = self.index[self.dim * node + component]?;
        Some((i, if i >= self.n_o { self.contact_sign } else { 1.0 }))
    }

    /// `u` from a nodal field (components interleaved).
    pub fn gather(&self, nodal: &[f64]) -> Vec<f64> {
        let mut u = vec![0.0; self.n()];
        for n in 0..nodal.len() / self.dim {
            for c in 0..self.dim {
                if let Some((i, sign)) = self.of(n, c) {
                    u[i] = sign * nodal[self.dim * n + c];
                }
            }
        }
        u
    }

    /// Nodal displacements from `u`, prescribed ones zero.
    pub fn scatter(&self, u: &[f64]) -> Vec<f64> {
        let mut nodal = vec![0.0; self.index.len()];
        for n in 0..nodal.len() / self.dim {
            for c in 0..self.dim {
                if let Some((i, sign)) = self.of(n, c) {
                    nodal[self.dim * n + c] = sign * u[i];
                }
            }
        }
        nodal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::structured;

    #[test]
    fn contact_displacements_come_last_and_point_outwards() {
        let mesh = structured::rectangle(1.0, 1.0, 2, 2);
        let d = DofMap::new(&mesh, &[(Edge::Right, 0), (Edge::Bottom, 1)], Some(Edge::Left));
        assert_eq!((d.n_o, d.n_c), (3 + 6, 3));
        let (i, sign) = d.of(mesh.group_nodes("left")[1], 0).unwrap();
        assert_eq!((i, sign), (d.n_o + 1, -1.0));
        let nodal: Vec<f64> = (0..18).map(|k| k as f64).collect();
        let u = d.gather(&nodal);
        let back = d.scatter(&u);
        for (k, v) in back.iter().enumerate() {
            assert!(*v == nodal[k] || d.of(k / 2, k % 2).is_none());
        }
    }

    #[test]
    fn corner_held_in_the_normal_direction_is_no_contact_node() {
        let mesh = structured::rectangle(1.0, 1.0, 2, 2);
        let d = DofMap::new(&mesh, &[(Edge::Bottom, 0)], Some(Edge::Right));
        assert_eq!(d.n_c, 2);
    }
}
