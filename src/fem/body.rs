//! The assembled body: `M ü + C u̇ + K u = f + contact`, prescribed displacements eliminated.

use super::FemError;
use super::dofs::DofMap;
use super::eigen;
use super::element::{self, Material};
use super::sparse::Csr;
use crate::mesh::Mesh;

/// An elastic body by its matrices over `u = (u_O, u_C)`.
#[derive(Debug, Clone)]
pub struct Body {
    /// Nodes and elements.
    pub mesh: Mesh,
    /// Numbering of `u`.
    pub dofs: DofMap,
    /// Elastic constants.
    pub material: Material,
    /// Mass matrix `M`.
    pub mass: Csr,
    /// Stiffness matrix `K`.
    pub stiffness: Csr,
    /// Frequencies of matrices that were given and not assembled: the lowest and a bound of all.
    pub given: Option<(f64, f64)>,
}

impl Body {
    /// Assemble; `lumped` puts the row sums of the mass on the diagonal.
    pub fn assemble(mesh: Mesh, dofs: DofMap, material: Material, lumped: bool) -> Body {
        let (mut mass, mut stiffness) = (vec![], vec![]);
        let dim = mesh.dim;
        // uniform meshes have one element matrix; any other mesh would compute each
        let corners = |e: usize| -> Vec<[f64; 2]> {
            mesh.element(e).iter().map(|&n| mesh.nodes[n]).collect()
        };
        let matrices = element::matrices(&material, &corners(0));
        let n = matrices.n;
        let mut row_sum = vec![0.0; n];
        for a in 0..n {
            row_sum[a] = (0..n).map(|b| matrices.mass[n * a + b]).sum();
        }
        for e in 0..mesh.n_elements() {
            let nodes = mesh.element(e);
            let place: Vec<_> = (0..n).map(|a| dofs.of(nodes[a / dim], a % dim)).collect();
            for a in 0..n {
                let Some((i, si)) = place[a] else { continue };
                if lumped {
                    mass.push((i, i, row_sum[a]));
                }
                for b in 0..n {
                    let Some((j, sj)) = place[b] else { continue };
                    stiffness.push((i, j, si * sj * matrices.stiffness[n * a + b]));
                    if !lumped {
                        mass.push((i, j, si * sj * matrices.mass[n * a + b]));
                    }
                }
            }
        }
        let n = dofs.n();
        Body {
            mass: Csr::from_triplets(n, n, mass),
            stiffness: Csr::from_triplets(n, n, stiffness),
            mesh,
            dofs,
            material,
            given: None,
        }
    }

    /// A body of given matrices. Its mesh is a row of points, one a displacement, that files and pictures can name.
    pub fn from_matrices(
        mass: &Csr,
        stiffness: &Csr,
        contact: &[usize],
        length: f64,
    ) -> Result<Body, FemError> {
        let n = mass.n_rows();
        let modes = eigen::all(stiffness, mass, 1e-300)?;
        let highest = modes.omega.iter().fold(0.0f64, |m, w| m.max(*w));
        let lowest = modes.omega.first().copied().unwrap_or(0.0);
        if lowest <= 1e-7 * highest {
            return Err(FemError::NotPositiveDefinite { what: "stiffness matrix" });
        }
        let dofs = DofMap::of_rows(n, contact);
        let place = |i: usize| dofs.row(i);
        let permuted = |a: &Csr| {
            Csr::from_triplets(
                n,
                n,
                a.triplets().map(|(i, j, v)| (place(i), place(j), v)).collect(),
            )
        };
        Ok(Body {
            mass: permuted(mass),
            stiffness: permuted(stiffness),
            mesh: Mesh::bar(length, n),
            material: Material::Bar { young: 1.0, density: 1.0, area: 1.0 },
            given: Some((lowest, (1.0 + 1e-9) * highest)),
            dofs,
        })
    }

    /// Mass that belongs to each node (row sums over all shape functions).
    pub fn nodal_mass(&self) -> Vec<f64> {
        let mut mass = vec![0.0; self.mesh.n_nodes()];
        for e in 0..self.mesh.n_elements() {
            let nodes = self.mesh.element(e);
            let x: Vec<_> = nodes.iter().map(|&n| self.mesh.nodes[n]).collect();
            let measure = match x.len() {
                2 => x[1][0] - x[0][0],
                _ => (x[2][0] - x[0][0]) * (x[2][1] - x[0][1]),
            };
            let share = self.material.mass_density() * measure / nodes.len() as f64;
            nodes.iter().for_each(|&n| mass[n] += share);
        }
        mass
    }

    /// The mass matrix of one displacement component over all nodes, prescribed ones included.
    pub fn scalar_mass(&self) -> Csr {
        let (mesh, dim) = (&self.mesh, self.mesh.dim);
        let lumped = self.mass.as_diagonal().is_some();
        let mut entries = vec![];
        for e in 0..mesh.n_elements() {
            let nodes = mesh.element(e);
            let x: Vec<_> = nodes.iter().map(|&n| mesh.nodes[n]).collect();
            let matrices = element::matrices(&self.material, &x);
            for (a, &i) in nodes.iter().enumerate() {
                for (b, &j) in nodes.iter().enumerate() {
                    let v = matrices.mass[matrices.n * dim * a + dim * b];
                    entries.push((i, if lumped { i } else { j }, v));
                }
            }
        }
        Csr::from_triplets(mesh.n_nodes(), mesh.n_nodes(), entries)
    }

    /// Natural unit of circular frequency: wave speed over the body's length, times π/2.
    pub fn frequency_unit(&self) -> f64 {
        if let Some((lowest, _)) = self.given {
            return lowest;
        }
        let [lx, ly] = self.mesh.size();
        std::f64::consts::FRAC_PI_2 * self.material.wave_speed() / lx.max(ly)
    }

    /// Upper bound of the natural frequencies of the body and of all its phases: the largest natural
    /// frequency of an element by itself (Irons; supports and contact conditions only take motions away).
    pub fn frequency_bound(&self) -> f64 {
        if let Some((_, bound)) = self.given {
            return bound;
        }
        let x: Vec<_> = self.mesh.element(0).iter().map(|&n| self.mesh.nodes[n]).collect();
        let e = element::matrices(&self.material, &x);
        let n = e.n;
        let lumped = self.mass.as_diagonal().is_some();
        let mass = nalgebra::DMatrix::from_fn(n, n, |a, b| match (lumped, a == b) {
            (true, true) => (0..n).map(|c| e.mass[n * a + c]).sum(),
            (true, false) => 0.0,
            (false, _) => e.mass[n * a + b],
        });
        let stiffness = nalgebra::DMatrix::from_row_slice(n, n, &e.stiffness);
        // an element's consistent mass is positive definite
        let Some(l) = mass.cholesky().map(|c| c.l()) else { return f64::INFINITY };
        let half = l.solve_lower_triangular(&stiffness).map(|m| m.transpose());
        let reduced = half.and_then(|m| l.solve_lower_triangular(&m));
        let largest = reduced.map_or(f64::INFINITY, |m| m.symmetric_eigen().eigenvalues.max());
        (1.0 + 1e-9) * largest.max(0.0).sqrt()
    }

    /// Rigid motions that the supports leave, as nodal fields; `held_contact` counts the contact
    /// displacements as prescribed too.
    pub fn rigid_motions(&self, held_contact: bool) -> Vec<Vec<f64>> {
        // given matrices are held, or were refused
        if self.given.is_some() {
            return vec![];
        }
        let (mesh, dofs, dim) = (&self.mesh, &self.dofs, self.mesh.dim);
        let [lx, ly] = mesh.size();
        let scale = lx.max(ly);
        let motion = |k: usize, p: [f64; 2], c: usize| match (k, c) {
            (0, 0) | (1, 1) => 1.0,
            (2, 0) => -(p[1] - ly / 2.0) / scale,
            (2, 1) => (p[0] - lx / 2.0) / scale,
            _ => 0.0,
        };
        let n_motions = if dim == 1 { 1 } else { 3 };
        let mut gram = nalgebra::DMatrix::<f64>::zeros(n_motions, n_motions);
        let mut held = 0.0f64;
        for (n, &p) in mesh.nodes.iter().enumerate() {
            for c in 0..dim {
                let prescribed = match dofs.of(n, c) {
                    None => true,
                    Some((i, _)) => held_contact && i >= dofs.n_o,
                };
                if prescribed {
                    held += 1.0;
                    for a in 0..n_motions {
                        for b in 0..n_motions {
                            gram[(a, b)] += motion(a, p, c) * motion(b, p, c);
                        }
                    }
                }
            }
        }
        let eigen = gram.symmetric_eigen();
        (0..n_motions)
            .filter(|&k| eigen.eigenvalues[k] <= 1e-10 * held.max(1.0))
            .map(|k| {
                let v = eigen.eigenvectors.column(k);
                let field = |n: usize, c: usize| {
                    (0..n_motions).map(|a| v[a] * motion(a, mesh.nodes[n], c)).sum::<f64>()
                };
                (0..mesh.n_nodes()).flat_map(|n| (0..dim).map(move |c| field(n, c))).collect()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Edge;

    const PLATE: Material =
        Material::Plate { young: 1.0, poisson: 0.3, density: 1.0, thickness: 1.0 };

    fn plate(fixed: &[(Edge, usize)], lumped: bool) -> Body {
        let mesh = Mesh::rectangle(2.0, 1.0, 6, 4);
        let dofs = DofMap::new(&mesh, fixed, Some(Edge::Right));
        Body::assemble(mesh, dofs, PLATE, lumped)
    }

    #[test]
    fn rigid_motions_are_found_and_carry_no_force() {
        let free = plate(&[], false);
        assert_eq!(free.rigid_motions(false).len(), 3);
        for r in free.rigid_motions(false) {
            let u = free.dofs.gather(&r);
            let mut f = vec![0.0; u.len()];
            free.stiffness.mul(&u, &mut f);
            assert!(f.iter().all(|f| f.abs() < 1e-13));
        }
        assert_eq!(free.rigid_motions(true).len(), 1); // sliding along the obstacle
        assert_eq!(plate(&[(Edge::Bottom, 1)], false).rigid_motions(false).len(), 1);
        assert_eq!(plate(&[(Edge::Bottom, 1)], false).rigid_motions(true).len(), 0);
        assert_eq!(plate(&[(Edge::Left, 0)], false).rigid_motions(false).len(), 1);
        assert_eq!(plate(&[(Edge::Left, 0), (Edge::Left, 1)], false).rigid_motions(false).len(), 0);
    }

    #[test]
    fn mass_adds_up_lumped_and_consistent() {
        for lumped in [false, true] {
            let b = plate(&[], lumped);
            let ones = vec![1.0; b.dofs.n()];
            assert!((b.mass.quadratic(&ones) - 2.0 * 2.0).abs() < 1e-13);
        }
        assert!((plate(&[], false).nodal_mass().iter().sum::<f64>() - 2.0).abs() < 1e-13);
    }
}
