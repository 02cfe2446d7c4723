//! What holds a body: the forces of its supports and springs; and the momenta that forces change.
//!
//! ```text
//! R = w · (M ü + C u̇ + K u − f),    w: the unit motion of what a support holds, along an axis
//! F = Σ k w u + F₀                   of a spring that acts on w u
//! P = ∫ ρ u̇                          of each part of a body
//! ```
//!
//! with the mass of the mesh, of all nodes: `R` is the force of the support on the body, and the loads on held displacements go straight into it. Where the contact has no inertia,
//! its points move for `R` and `P` as in the open phase, `ü_C = A_∅ ü_O`: so does the mass `A_∅ᵀMA_∅` of such a method. They hang on held neighbours, too: mass and weight of the contact
//! act on `w + A_h w`, with the contact displacements `A_h w = −K_CC⁻¹K_Ch w` that follow a support (where they follow statically; those of the paper's stresses do not, and `Ṗ` is the sum of
//! the forces on a part but for what an element between a support and a contact node leaves out).

use std::collections::HashSet;

use nalgebra::DMatrix;

use super::phase::Phase;
use crate::fem::{Body, Csr, Fix, Held, Loads};
use crate::mesh::Point;

/// Supports, springs and parts of a body, as rows over the displacements of its mesh.
#[derive(Debug, Clone, Default)]
pub struct Bearings {
    /// Groups that supports hold.
    pub supports: Vec<String>,
    /// Springs.
    pub springs: Vec<String>,
    /// Components of a force.
    pub dim: usize,
    /// `w` over the components of all nodes, a row for each support and axis.
    held: Csr,
    /// `w K` and `w M`
    stiffness: Csr,
    mass: Csr,
    /// `A_h w` over `u`, a row for each support and axis: where contact displacements have no inertia, and follow statically.
    following: Csr,
    /// `C = αM + βK`
    damping: (f64, f64),
    /// `Σ k w`
    pull: Csr,
    /// `F₀`
    preload: Vec<f64>,
    /// The share of each spring's force that goes straight into supports.
    pinned: Csr,
    /// `P` of each part and axis; no rows of a body of one part.
    momentum: Csr,
    /// The masses of the components of all nodes, of the same rows.
    masses: Csr,
}

/// More contact displacements are not asked how they follow supports.
const MOST_FOLLOWERS: usize = 3000;
/// Forces on contact displacements below this part of their terms are none.
const STATIC: f64 = 1e-9;

/// A spring.
#[derive(Debug, Clone, Default)]
pub struct Pull {
    /// Its ends.
    pub name: String,
    /// `Σ k w` over `u`
    pub row: Vec<(usize, f64)>,
    /// `F₀`
    pub preload: f64,
    /// `w` over the components of all nodes, held ones included; none of one at every node of a group.
    pub nodal: Vec<f64>,
}

/// Forces of supports and of springs, and momenta.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Borne {
    /// Components of the first support, then of the next; not numbers without accelerations.
    pub supports: Vec<f64>,
    /// One a spring.
    pub springs: Vec<f64>,
    /// Components of the first part, then of the next.
    pub momentum: Vec<f64>,
}

/// `y += c A x`
fn add(a: &Csr, c: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().enumerate().for_each(|(i, y)| *y += c * a.row_dot(i, x));
}

impl Bearings {
    /// Of a body of elements with its supports, damping in proportion to its mass and stiffness, and parts: which of how many each node belongs to.
    pub fn new(
        body: &Body,
        held: &[Held],
        damping: (f64, f64),
        parts: (&[usize], usize),
    ) -> Bearings {
        let (mesh, dofs, dim) = (&body.mesh, &body.dofs, body.mesh.dim());
        let mut supports: Vec<String> = vec![];
        for h in held {
            if !supports.contains(&h.group) {
                supports.push(h.group.clone());
            }
        }
        // what two supports hold is borne by the first
        let mut borne: HashSet<(usize, usize)> = HashSet::new();
        let mut entries = vec![];
        for (k, group) in supports.iter().enumerate() {
            let holds = |d: &Point| {
                held.iter().filter(|h| h.group == *group).any(|h| match h.fix {
                    Fix::Axis(axis) => d[axis].abs() > 0.7,
                    Fix::Normal => true,
                })
            };
            for node in mesh.group_nodes(group) {
                for (slot, (d, free)) in dofs.directions(node).enumerate() {
                    if free.is_some() || !holds(&d) || !borne.insert((node, slot)) {
                        continue;
                    }
                    for (axis, c) in (0..dim).flat_map(|a| (0..dim).map(move |c| (a, c))) {
                        entries.push((dim * k + axis, dim * node + c, d[axis] * d[c]));
                    }
                }
            }
        }
        Bearings::over(body, supports, entries, damping).with_parts(body, parts)
    }

    /// Of given matrices: supports by their names, each with the nodes of the rows that it holds along one direction.
    pub fn of_rows(
        body: &Body,
        supports: Vec<(String, Vec<usize>)>,
        damping: (f64, f64),
    ) -> Bearings {
        let (names, nodes): (Vec<String>, Vec<Vec<usize>>) = supports.into_iter().unzip();
        let of = |(k, nodes): (usize, &Vec<usize>)| {
            nodes.iter().map(move |node| (k, *node, 1.0)).collect::<Vec<_>>()
        };
        let entries = nodes.iter().enumerate().flat_map(of).collect();
        Bearings::over(body, names, entries, damping)
    }

    /// Of supports with `w` over the components of all nodes, as entries.
    fn over(
        body: &Body,
        supports: Vec<String>,
        entries: Vec<(usize, usize, f64)>,
        damping: (f64, f64),
    ) -> Bearings {
        let (n, dim) = (body.dofs.n(), body.mesh.dim());
        let shape = (dim * supports.len(), dim * body.mesh.n_nodes());
        let held = Csr::from_triplets(shape.0, shape.1, entries);
        let [stiffness, mass] = body.rows_of_fields(&held);
        let momentum = Csr::from_triplets(0, n, vec![]);
        let pull = Csr::from_triplets(0, n, vec![]);
        Bearings {
            supports,
            dim,
            following: Csr::from_triplets(shape.0, n, vec![]),
            held,
            stiffness,
            mass,
            damping,
            pull,
            momentum,
            ..Bearings::default()
        }
    }

    /// Momenta of the parts, where there are several.
    fn with_parts(self, body: &Body, (of_node, count): (&[usize], usize)) -> Bearings {
        let (dofs, dim) = (&body.dofs, self.dim);
        if count < 2 {
            return self;
        }
        let masses = body.nodal_mass();
        let (mut entries, mut of_nodes) = (vec![], vec![]);
        for (part, axis) in (0..count).flat_map(|p| (0..dim).map(move |c| (p, c))) {
            let along = |values: &dyn Fn(usize) -> f64| -> Vec<f64> {
                let of = |(node, part_of): (usize, &usize)| {
                    let value = if *part_of == part { values(node) } else { 0.0 };
                    (0..dim).map(move |c| if c == axis { value } else { 0.0 }).collect::<Vec<_>>()
                };
                of_node.iter().enumerate().flat_map(of).collect()
            };
            let nodal = along(&|n| masses[n]);
            let mut row = dofs.gather_forces(&nodal);
            let nonzero = nodal.into_iter().enumerate().filter(|e| e.1 != 0.0);
            of_nodes.extend(nonzero.map(|(j, v)| (dim * part + axis, j, v)));
            let field = dofs.gather(&along(&|_| 1.0));
            for element in body.discrete.iter().filter(|e| e.mass != 0.0) {
                let moved = element.mass * element.along(&field);
                element.row.iter().for_each(|&(j, w)| row[j] += w * moved);
            }
            let nonzero = row.into_iter().enumerate().filter(|e| e.1 != 0.0);
            entries.extend(nonzero.map(|(j, v)| (dim * part + axis, j, v)));
        }
        let momentum = Csr::from_triplets(dim * count, dofs.n(), entries);
        let masses = Csr::from_triplets(dim * count, dim * masses.len(), of_nodes);
        Bearings { momentum, masses, ..self }
    }

    /// Where contact displacements have no inertia: as in the open phase. Those that hand on their mass (the method may spread it anew) do so to supports, too.
    pub fn without_contact_mass(self, body: &Body, open: &Phase, hands_on: bool) -> Bearings {
        let following = match hands_on {
            true => self.followers(body, open),
            false => self.following.clone(),
        };
        // what contact displacements that follow a support bring
        let mut entries: Vec<(usize, usize, f64)> = self.mass.triplets().collect();
        for (k, i, x) in following.triplets() {
            entries.extend(body.mass.row(i).map(|(j, m)| (k, j, x * m)));
        }
        let mass = Csr::from_triplets(self.mass.n_rows(), self.mass.n_cols(), entries);
        let reduce = |row: &[f64]| open.reduce(row);
        let moved = |rows: &Csr| {
            let of_row = |k: usize| {
                let mut row = vec![0.0; rows.n_cols()];
                rows.row(k).for_each(|(j, v)| row[j] = v);
                let row = reduce(&row).into_iter().enumerate();
                row.filter(|e| e.1 != 0.0).map(move |(j, v)| (k, j, v)).collect::<Vec<_>>()
            };
            let entries = (0..rows.n_rows()).flat_map(of_row).collect();
            Csr::from_triplets(rows.n_rows(), rows.n_cols(), entries)
        };
        let (mass, momentum) = (moved(&mass), moved(&self.momentum));
        Bearings { mass, momentum, following, ..self }
    }

    /// `−K_CC⁻¹ K_Ch w`, as rows over `u`, where the open phase lets contact displacements follow others so.
    fn followers(&self, body: &Body, open: &Phase) -> Csr {
        let (n_o, n) = (body.dofs.n_o, body.dofs.n());
        let none = || Csr::from_triplets(self.stiffness.n_rows(), n, vec![]);
        let next: Vec<(usize, usize, f64)> =
            self.stiffness.triplets().filter(|(_, j, _)| (n_o..n).contains(j)).collect();
        if next.is_empty() || n - n_o > MOST_FOLLOWERS || body.stiffness.n_rows() != n {
            return none();
        }
        // a motion that nothing singles out
        let x_o: Vec<f64> = (0..n_o).map(|i| (i as f64 + 0.5).sin()).collect();
        let mut x = vec![0.0; n];
        open.expand(&x_o, &mut x);
        let is_static = (n_o..n).all(|i| {
            let size: f64 = body.stiffness.row(i).map(|(j, k)| (k * x[j]).abs()).sum();
            body.stiffness.row_dot(i, &x).abs() <= STATIC * size
        });
        let k_cc = DMatrix::from_fn(n - n_o, n - n_o, |i, j| {
            body.stiffness.entry(n_o + i, n_o + j).copied().unwrap_or(0.0)
        });
        let Some(k_cc) = k_cc.cholesky().filter(|_| is_static) else { return none() };
        let mut sides = DMatrix::zeros(n - n_o, self.stiffness.n_rows());
        next.iter().for_each(|&(k, j, v)| sides[(j - n_o, k)] -= v);
        let found = k_cc.solve(&sides);
        let entries = (0..found.ncols()).flat_map(|k| (0..n - n_o).map(move |i| (k, i)));
        let entries = entries.map(|(k, i)| (k, n_o + i, found[(i, k)])).filter(|e| e.2 != 0.0);
        Csr::from_triplets(self.stiffness.n_rows(), n, entries.collect())
    }

    /// Whether there is nothing to tell.
    pub fn is_empty(&self) -> bool {
        self.supports.is_empty() && self.springs.is_empty() && self.momentum.n_rows() == 0
    }

    /// Components of all momenta.
    pub fn momenta(&self) -> usize {
        self.momentum.n_rows()
    }

    /// What of a load on the components of all nodes goes into supports: their components, and no momenta.
    pub fn share(&self, nodal: &[f64]) -> Vec<f64> {
        let mut share = vec![0.0; self.held.n_rows() + self.momenta()];
        self.held.mul(nodal, &mut share);
        share
    }

    /// The same of a load on all mass, which contact displacements without inertia hand on.
    pub fn share_of_weight(&self, body: &Body, nodal: &[f64]) -> Vec<f64> {
        let mut share = self.share(nodal);
        let force = body.dofs.gather_forces(nodal);
        let handed = share.iter_mut().take(self.following.n_rows()).enumerate();
        handed.for_each(|(k, share)| *share += self.following.row_dot(k, &force));
        share
    }

    /// What a motion `w s` of supports brings, by the derivative of `s` that it follows: `−(K w s + C w ṡ + M w s̈)` into supports, and the momentum of what moves with them.
    pub fn shares_of_motion(&self, body: &Body, field: &[f64]) -> [Vec<f64>; 3] {
        let [k, m] = body.products_of_field(field).map(|product| self.share(&product));
        let (alpha, beta) = self.damping;
        let of = |x: f64, y: f64| -> Vec<f64> {
            k.iter().zip(&m).map(|(k, m)| -(x * k + y * m)).collect()
        };
        let mut by_rate = of(beta, alpha);
        self.masses.mul(field, &mut by_rate[self.held.n_rows()..]);
        [of(1.0, 0.0), by_rate, of(0.0, 1.0)]
    }

    /// Springs.
    pub fn pull(&mut self, springs: Vec<Pull>) {
        let n = self.pull.n_cols();
        let (mut entries, mut into_supports) = (vec![], vec![]);
        let mut share = vec![0.0; self.held.n_rows()];
        for (k, spring) in springs.into_iter().enumerate() {
            entries.extend(spring.row.into_iter().map(|(j, v)| (k, j, v)));
            if !spring.nodal.is_empty() {
                self.held.mul(&spring.nodal, &mut share);
                let of_supports = share.iter().enumerate().filter(|e| *e.1 != 0.0);
                into_supports.extend(of_supports.map(|(i, w)| (i, k, *w)));
            }
            self.springs.push(spring.name);
            self.preload.push(spring.preload);
        }
        let count = self.springs.len();
        self.pull = Csr::from_triplets(count, n, entries);
        self.pinned = Csr::from_triplets(share.len(), count, into_supports);
    }

    /// Of displacements, velocities and accelerations (none: not known) of a body, reduced or not, under its loads at a time.
    pub fn of(&self, body: &Body, (loads, t): (&Loads, f64), [u, v, a]: [&[f64]; 3]) -> Borne {
        if self.is_empty() {
            return Borne::default();
        }
        let [u, v] = [body.nodal(u), body.nodal(v)];
        let mut springs = self.preload.clone();
        add(&self.pull, 1.0, &u, &mut springs);
        let rows = self.held.n_rows();
        let mut given = vec![0.0; rows + self.momenta()];
        loads.borne.iter().for_each(|borne| borne.at(t, &mut given));
        let mut momentum = given.split_off(rows);
        add(&self.momentum, 1.0, &v, &mut momentum);
        if a.is_empty() || rows == 0 {
            return Borne { supports: vec![f64::NAN; rows], springs, momentum };
        }
        let (a, (alpha, beta)) = (body.nodal(a), self.damping);
        let mut supports: Vec<f64> = given.iter().map(|f| -f).collect();
        add(&self.stiffness, 1.0, &u, &mut supports);
        add(&self.stiffness, beta, &v, &mut supports);
        add(&self.mass, alpha, &v, &mut supports);
        add(&self.mass, 1.0, &a, &mut supports);
        add(&self.pinned, 1.0, &springs, &mut supports);
        Borne { supports, springs, momentum }
    }
}
