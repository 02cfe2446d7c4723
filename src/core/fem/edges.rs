//! What linear triangles and tetrahedra lack: the functions `N_ab = 4 λ_a λ_b` of their edges, which make elements of second order of them.
//!
//! ```text
//! H b = r,   r_ab = ω² ∫ρ N_ab u − ∫(∇N_ab)ᵀσ(u),   H = ∫(∇N)ᵀD∇N          bᵀr: what they take off the energy of `u`
//! ```
//!
//! in closed form, with `∫λ_iλ_j = V d!/(d+2)! (1 + δ_ij)`. A few steps of conjugate gradients, with the blocks of the edges before them, find a part of it, never more.

use std::collections::HashMap;

use nalgebra::{Matrix3, Matrix6, Matrix6x3, Vector3, Vector6};

use super::body::Body;
use super::element::Shape;
use super::law::Material;
use crate::mesh::{ElementKind, Point};

/// Steps that are taken.
const STEPS: usize = 3;

/// A linear simplex.
struct Cell {
    nodes: Vec<usize>,
    /// Strain of a displacement times `λ_a`, over that displacement: `B` of `∇λ_a`.
    rows: Vec<Matrix6x3<f64>>,
    stiffness: Matrix6<f64>,
    volume: f64,
    density: f64,
    /// Its edges: their ends in it, their numbers in the body.
    edges: Vec<([usize; 2], usize)>,
}

/// `B` of a gradient, in the order of [`super::law`].
fn strain(shape: &Shape, gradient: &Point) -> Matrix6x3<f64> {
    let dim = shape.kind.dim();
    let rows = super::element::strain_of(gradient, dim);
    Matrix6x3::from_fn(|i, c| if c < dim { rows[(i, c)] } else { 0.0 })
}

impl Cell {
    fn new(kind: ElementKind, nodes: &[usize], x: &[Point], material: &Material) -> Cell {
        let shape = Shape { kind, x };
        Cell {
            nodes: nodes.to_vec(),
            rows: shape.gradients().iter().map(|g| strain(&shape, g)).collect(),
            stiffness: material.stiffness(),
            volume: shape.volume(material),
            density: material.density,
            edges: vec![],
        }
    }

    /// `V d!/(d+2)!`
    fn second(&self) -> f64 {
        let corners = self.rows.len() as f64;
        self.volume / (corners * (corners + 1.0))
    }

    /// The stress of displacements of its nodes, and twice their energy.
    fn stress(&self, u: &[Vector3<f64>]) -> (Vector6<f64>, f64) {
        let strain: Vector6<f64> = self.rows.iter().zip(u).map(|(b, u)| b * u).sum();
        let stress = self.stiffness * strain;
        (stress, self.volume * strain.dot(&stress))
    }

    /// `r` of displacements of its nodes, edge by edge.
    fn residual(&self, u: &[Vector3<f64>], omega: f64) -> Vec<Vector3<f64>> {
        let corners = self.rows.len() as f64;
        let (stress, _) = self.stress(u);
        let sum: Vector3<f64> = u.iter().sum();
        let inertia = 4.0 * self.density * omega * omega * self.second() / (corners + 2.0);
        let of = |&([a, b], _): &([usize; 2], usize)| {
            let pull = (self.rows[a] + self.rows[b]).tr_mul(&stress);
            inertia * (sum + u[a] + u[b]) - 4.0 * self.volume / corners * pull
        };
        self.edges.iter().map(of).collect()
    }

    /// `H b` of its edges: the strain is `Σ_i λ_i S_i`.
    fn product(&self, b: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut s = vec![Vector6::zeros(); self.rows.len()];
        for (([i, j], _), b) in self.edges.iter().zip(b) {
            s[*i] += 4.0 * self.rows[*j] * b;
            s[*j] += 4.0 * self.rows[*i] * b;
        }
        let sum: Vector6<f64> = s.iter().sum();
        let stress: Vec<Vector6<f64>> =
            s.iter().map(|s| self.second() * (self.stiffness * (sum + s))).collect();
        let of = |&([i, j], _): &([usize; 2], usize)| {
            4.0 * (self.rows[j].tr_mul(&stress[i]) + self.rows[i].tr_mul(&stress[j]))
        };
        self.edges.iter().map(of).collect()
    }

    /// The block of an edge in `H`.
    fn block(&self, [i, j]: [usize; 2]) -> Matrix3<f64> {
        let (a, b) = (&self.rows[i], &self.rows[j]);
        let of = |x: &Matrix6x3<f64>| x.tr_mul(&(self.stiffness * x));
        16.0 * self.second() * (of(&(a + b)) + of(a) + of(b))
    }
}

/// A body of linear simplices with the functions of its edges.
pub struct Edges {
    cells: Vec<Cell>,
    dim: usize,
    /// The inverses of their blocks, over the directions that are free: along one that both ends are held in an edge is held, too.
    inverse: Vec<Matrix3<f64>>,
}

impl Edges {
    /// Of a body all of whose elements are such, none of revolution.
    pub fn new(body: &Body) -> Edges {
        let (mesh, dim) = (&body.mesh, body.mesh.dim());
        let mut numbers: HashMap<[usize; 2], usize> = HashMap::new();
        let mut cells: Vec<Cell> = vec![];
        for e in mesh.elements() {
            let x = mesh.corners(e);
            let mut cell = Cell::new(e.kind, e.nodes, &x, &body.materials()[e.region]);
            for (i, j) in (0..=dim).flat_map(|j| (0..j).map(move |i| (i, j))) {
                let mut ends = [e.nodes[i], e.nodes[j]];
                ends.sort_unstable();
                let next = numbers.len();
                cell.edges.push(([i, j], *numbers.entry(ends).or_insert(next)));
            }
            cells.push(cell);
        }
        let mut blocks = vec![Matrix3::zeros(); numbers.len()];
        for cell in &cells {
            cell.edges.iter().for_each(|(ends, k)| blocks[*k] += cell.block(*ends));
        }
        let dofs = body.nodal_dofs();
        let mut inverse = vec![Matrix3::zeros(); numbers.len()];
        for (ends, k) in numbers {
            let is_free = |c: &usize| ends.iter().any(|n| dofs.column(*n, *c).is_some());
            let free: Vec<usize> = (0..dim).filter(is_free).collect();
            let own = nalgebra::DMatrix::from_fn(free.len(), free.len(), |i, j| {
                blocks[k][(free[i], free[j])]
            });
            let Some(own) = own.cholesky().map(|c| c.inverse()) else { continue };
            for (i, j) in (0..free.len()).flat_map(|i| (0..free.len()).map(move |j| (i, j))) {
                inverse[k][(free[i], free[j])] = own[(i, j)];
            }
        }
        Edges { cells, dim, inverse }
    }

    /// Twice the energy of a nodal field (components interleaved) that swings at a frequency, and what the edges take off it.
    pub fn relief(&self, field: &[f64], omega: f64) -> [f64; 2] {
        let dim = self.dim;
        let at =
            |n: &usize| Vector3::from_fn(|c, _| if c < dim { field[dim * n + c] } else { 0.0 });
        let mut r = vec![Vector3::zeros(); self.inverse.len()];
        let mut energy = 0.0;
        for cell in &self.cells {
            let u: Vec<Vector3<f64>> = cell.nodes.iter().map(at).collect();
            energy += cell.stress(&u).1;
            let own = cell.residual(&u, omega);
            cell.edges.iter().zip(own).for_each(|((_, k), own)| r[*k] += own);
        }
        [energy, self.solved(r)]
    }

    /// `bᵀr` after some steps of conjugate gradients.
    fn solved(&self, mut r: Vec<Vector3<f64>>) -> f64 {
        let dot = |x: &[Vector3<f64>], y: &[Vector3<f64>]| -> f64 {
            x.iter().zip(y).map(|(x, y)| x.dot(y)).sum()
        };
        let before = |r: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            self.inverse.iter().zip(r).map(|(m, r)| m * r).collect()
        };
        let mut z = before(&r);
        let (mut p, mut size, mut relief) = (z.clone(), dot(&r, &z), 0.0);
        for _ in 0..STEPS {
            if size <= 0.0 {
                break;
            }
            let q = self.product(&p);
            let step = size / dot(&p, &q);
            relief += step * size;
            r.iter_mut().zip(&q).for_each(|(r, q)| *r -= step * q);
            z = before(&r);
            let next = dot(&r, &z);
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + next / size * *p);
            size = next;
        }
        relief
    }

    fn product(&self, b: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut all = vec![Vector3::zeros(); b.len()];
        for cell in &self.cells {
            let own: Vec<Vector3<f64>> = cell.edges.iter().map(|(_, k)| b[*k]).collect();
            let own = cell.product(&own);
            cell.edges.iter().zip(own).for_each(|((_, k), own)| all[*k] += own);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::fem::element::{ElementMatrices, MassForm};
    use crate::fem::law::StressState;
    use crate::fem::shape;

    /// One element: residual and matrix are those of the element of second order, by quadrature.
    #[test]
    fn edges_are_those_of_the_second_order() {
        use ElementKind::{Tet4, Tet10, Tri3, Tri6};
        let omega = 0.7;
        let corners: [Point; 4] =
            [[0.1, 0.0, 0.2], [1.3, 0.2, 0.1], [0.3, 0.9, -0.2], [0.2, 0.3, 1.1]];
        for (linear, quadratic, material) in [
            (Tri3, Tri6, Material::plate(3.0, 0.3, 2.0, 0.5)),
            (
                Tet4,
                Tet10,
                Material { young: 3.0, poisson: 0.3, density: 2.0, state: StressState::Solid },
            ),
        ] {
            let dim = linear.dim();
            let flat = |p: &Point| [p[0], p[1], if dim == 3 { p[2] } else { 0.0 }];
            let x: Vec<Point> = corners[..=dim].iter().map(flat).collect();
            let places = shape::places(quadratic);
            let ends = |m: usize| -> [usize; 2] {
                let is_middle = |[a, b]: &[usize; 2]| {
                    let off = |c: usize| places[*a][c] + places[*b][c] - 2.0 * places[m][c];
                    (0..dim).all(|c| off(c).abs() < 1e-12)
                };
                let mut pairs = (0..=dim).flat_map(|b| (0..b).map(move |a| [a, b]));
                pairs.find(is_middle).unwrap()
            };
            let middles: Vec<[usize; 2]> = (dim + 1..quadratic.nodes()).map(ends).collect();
            let mean = |[a, b]: &[usize; 2]| std::array::from_fn(|c| 0.5 * (x[*a][c] + x[*b][c]));
            let whole: Vec<Point> = x.iter().copied().chain(middles.iter().map(mean)).collect();
            let mut cell = Cell::new(linear, &(0..=dim).collect::<Vec<_>>(), &x, &material);
            cell.edges = middles.iter().copied().zip(0..).collect();
            let of = Shape { kind: quadratic, x: &whole };
            let ElementMatrices { mass, stiffness, n } =
                of.matrices(&material, MassForm::Consistent);
            let k = DMatrix::from_row_slice(n, n, &stiffness);
            let m = DMatrix::from_row_slice(n, n, &mass);
            let seen = |c: usize, x: f64| if c < dim { x } else { 0.0 };
            let u: Vec<Vector3<f64>> = (0..=dim)
                .map(|a| Vector3::from_fn(|c, _| seen(c, (1.3 * (dim * a + c) as f64).sin())))
                .collect();
            let fine = u.iter().copied().chain(middles.iter().map(|[a, b]| 0.5 * (u[*a] + u[*b])));
            let fine: Vec<f64> = fine.flat_map(|u| (0..dim).map(move |c| u[c])).collect();
            let fine = DVector::from_vec(fine);
            let (_, energy) = cell.stress(&u);
            assert!((fine.dot(&(&k * &fine)) / energy - 1.0).abs() < 1e-12, "{linear:?}");
            let wanted = (&m * omega * omega - &k) * &fine;
            let at = |e: usize, c: usize| dim * (dim + 1 + e) + c;
            for (e, own) in cell.residual(&u, omega).iter().enumerate() {
                (0..dim).for_each(|c| {
                    assert!((own[c] - wanted[at(e, c)]).abs() < 1e-12 * wanted.amax());
                });
            }
            // columns of H, and its blocks
            for (e, c) in (0..middles.len()).flat_map(|e| (0..dim).map(move |c| (e, c))) {
                let mut b = vec![Vector3::zeros(); middles.len()];
                b[e][c] = 1.0;
                let block = cell.block(middles[e]);
                for (f, own) in cell.product(&b).iter().enumerate() {
                    for d in 0..dim {
                        let wanted = k[(at(f, d), at(e, c))];
                        assert!((own[d] - wanted).abs() < 1e-12 * k.amax(), "{linear:?}");
                        assert!(f != e || (block[(d, c)] - wanted).abs() < 1e-12 * k.amax());
                    }
                }
            }
        }
    }
}
