//! The semi-discrete body of the nodal boundary method: everything that does not depend on the phase.
//!
//! Any admissible acceleration of phase α satisfies `n_C` homogeneous linear conditions `R_α a = 0`: `a_C,i = 0` for a
//! node in contact, `(N_C a_C + N_O a_O)_i = 0` for a free one. All phases choose their rows from the same `2 n_C`
//! vectors, so with one factorisation of `M` and the Gram matrix `Γ = R M⁻¹ Rᵀ` of these vectors
//!
//! ```text
//! M_α ü_O = A*ᵀ b   ⇔   ü = M⁻¹ b − M⁻¹ R_αᵀ (R_α M⁻¹ R_αᵀ)⁻¹ R_α M⁻¹ b
//! ```
//!
//! is the M-orthogonal projection of the unconstrained acceleration, and a new phase costs one Cholesky
//! factorisation of an `n_C × n_C` block of Γ, whatever the size of the body (theory §4).

use nalgebra::DMatrix;

use super::ContactError;
use super::active::ActiveSet;
use super::boundary::{self, BoundaryOperator};
use super::lcp::{self, LcpSolution, PMatrix};
use crate::fem::{Body, Csr, Loads, SolveScratch, SpdFactor};
use crate::mesh::Edge;

/// Rayleigh damping `C = α M + β K`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rayleigh {
    /// Mass-proportional part.
    pub alpha: f64,
    /// Stiffness-proportional part.
    pub beta: f64,
}

/// The contact edge as a scene names it.
#[derive(Debug, Clone)]
pub struct ContactEdge {
    /// Which edge.
    pub edge: Edge,
    /// Gap at each contact node.
    pub gap: Vec<f64>,
    /// Whether `G` is lumped.
    pub lumped: bool,
}

/// How `M⁻¹ Rᵀ μ` is formed.
#[derive(Debug)]
pub(super) enum Correction {
    /// Columns of `M⁻¹ Rᵀ` kept (as rows).
    Stored(Csr),
    /// A second solve with `M`.
    Solve,
}

/// A body in contact by the nodal boundary method.
#[derive(Debug)]
pub struct System {
    /// Matrices over `u = (u_O, u_C)`.
    pub body: Body,
    /// `N_C`, `n_C × n_C`.
    pub n_c: DMatrix<f64>,
    /// `N_O`, `n_C × n_O`.
    pub n_o: Csr,
    /// Gap at each contact node.
    pub gap: Vec<f64>,
    /// Area of each contact node (force = pressure × area).
    pub area: Vec<f64>,
    /// Damping, if any.
    pub damping: Option<Rayleigh>,
    /// Loads.
    pub loads: Loads,
    /// How `N_C` is known to be a P-matrix.
    pub p_matrix: PMatrix,
    pub(super) n_c_diagonal: bool,
    pub(super) mass_factor: SpdFactor,
    pub(super) rows: Csr,
    pub(super) gram: DMatrix<f64>,
    pub(super) correction: Correction,
    n_o_sums: Vec<f64>,
    n_c_sums: Vec<f64>,
}

/// Columns of `M⁻¹Rᵀ` are kept while they hold at most this many numbers.
const STORE_LIMIT: usize = 2_000_000;

impl System {
    /// Build the operators; `contact` absent gives a linear body (`n_C = 0`).
    pub fn new(body: Body, contact: Option<&ContactEdge>) -> Result<System, ContactError> {
        let operator = match contact {
            Some(c) => boundary::assemble(&body, c.edge, c.lumped),
            None => BoundaryOperator {
                n_c: DMatrix::zeros(0, 0),
                n_o: Csr::from_triplets(0, body.dofs.n_o, vec![]),
                area: vec![],
            },
        };
        System::with_operator(body, operator, contact.map_or(vec![], |c| c.gap.clone()))
    }

    /// The same with a boundary operator that is given.
    pub fn with_operator(
        body: Body,
        operator: BoundaryOperator,
        gap: Vec<f64>,
    ) -> Result<System, ContactError> {
        let BoundaryOperator { n_c, n_o, area } = operator;
        let size = area.len();
        let p_matrix = lcp::p_matrix(&n_c, &area);
        if let PMatrix::NotShown { index } = p_matrix {
            let node = body.dofs.contact_nodes[index];
            return Err(ContactError::NotPMatrix { node, at: body.mesh.nodes[node] });
        }
        let mass_factor = SpdFactor::new(&body.mass, "mass matrix")?;
        let n_c_diagonal = (0..size).all(|i| (0..size).all(|j| i == j || n_c[(i, j)] == 0.0));

        // rows 0..n_C: node in contact; rows n_C..2n_C: node free, scaled to the order of one
        let mut entries = vec![];
        for i in 0..size {
            entries.push((i, body.dofs.n_o + i, 1.0));
            let scale = 1.0 / n_c[(i, i)];
            entries.extend(n_o.row(i).map(|(j, v)| (size + i, j, scale * v)));
            entries.extend((0..size).map(|j| (size + i, body.dofs.n_o + j, scale * n_c[(i, j)])));
        }
        let n = body.dofs.n();
        let rows = Csr::from_triplets(2 * size, n, entries);
        let mut gram = DMatrix::<f64>::zeros(2 * size, 2 * size);
        let keep = matches!(mass_factor, SpdFactor::Diagonal(_)) || 2 * size * n <= STORE_LIMIT;
        let mut columns = vec![];
        let mut scratch = mass_factor.scratch();
        let mut x = vec![0.0; n];
        for k in 0..2 * size {
            x.fill(0.0);
            rows.row(k).for_each(|(j, v)| x[j] = v);
            mass_factor.solve(&mut x, &mut scratch);
            for l in 0..2 * size {
                gram[(l, k)] = rows.row_dot(l, &x);
            }
            if keep {
                let entries = x.iter().enumerate().filter(|(_, v)| **v != 0.0);
                columns.extend(entries.map(|(j, &v)| (k, j, v)));
            }
        }
        let correction = if keep {
            Correction::Stored(Csr::from_triplets(2 * size, n, columns))
        } else {
            Correction::Solve
        };
        Ok(System {
            gap,
            damping: None,
            loads: Loads::default(),
            p_matrix,
            n_c_diagonal,
            mass_factor,
            rows,
            gram,
            correction,
            n_o_sums: n_o.abs_row_sums(),
            n_c_sums: (0..size).map(|i| n_c.row(i).iter().map(|x| x.abs()).sum()).collect(),
            body,
            n_c,
            n_o,
            area,
        })
    }

    /// Length of `u_O`.
    pub fn n_o(&self) -> usize {
        self.body.dofs.n_o
    }

    /// Number of contact nodes.
    pub fn n_contact(&self) -> usize {
        self.gap.len()
    }

    /// Length of `u`.
    pub fn n(&self) -> usize {
        self.body.dofs.n()
    }

    /// The unit of length: the largest gap in magnitude, or the body's size where that is smaller or all gaps
    /// vanish.
    pub fn length_unit(&self) -> f64 {
        let gap = self.gap.iter().fold(0.0f64, |m, g| m.max(g.abs()));
        let [lx, ly] = self.body.mesh.size();
        let size = lx.max(ly);
        if gap > 0.0 { gap.min(size) } else { size }
    }

    /// Size of the terms that make up the pressure at contact node `i` when displacements are of
    /// the order of `u`: rounding errors of pressures are judged against it.
    pub fn pressure_scale(&self, i: usize, u: f64) -> f64 {
        self.n_o_sums[i] * u + self.n_c_sums[i] * u.max(self.gap[i].abs())
    }

    /// Size of the terms of `∇p_i · x` for `x` of the order of `size` (a velocity, an acceleration).
    pub fn pressure_rate_scale(&self, i: usize, size: f64) -> f64 {
        self.n_o_sums[i] * size
    }

    /// Bounds of `‖∇h_i‖_{M⁻¹}` for the gap and for the pressure of contact node `i`, in whatever phase: the Gram matrix's
    /// own diagonal, of which a phase only subtracts.
    pub fn monitor_gradient_bounds(&self, i: usize) -> [f64; 2] {
        let k = self.n_contact() + i;
        let pressure = self.n_c[(i, i)].abs();
        [self.gram[(i, i)].max(0.0).sqrt(), pressure * self.gram[(k, k)].max(0.0).sqrt()]
    }

    /// The right-hand side `q = −(N_C g + N_O u_O)` of the complementarity problem and its scale.
    pub fn lcp_data(&self, u_o: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let size = self.n_contact();
        let u = u_o.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let n_c_gap = |i: usize| (0..size).map(|j| self.n_c[(i, j)] * self.gap[j]).sum::<f64>();
        let q = (0..size).map(|i| -(n_c_gap(i) + self.n_o.row_dot(i, u_o))).collect();
        let scale = (0..size).map(|i| self.pressure_scale(i, u)).collect();
        (q, scale)
    }

    /// Solve `0 ≤ w ⟂ N_C w + q ≥ 0` for the gaps at `u_O`, warm from `start`.
    pub fn solve_lcp(&self, u_o: &[f64], start: &ActiveSet) -> Result<LcpSolution, ContactError> {
        let (q, scale) = self.lcp_data(u_o);
        Ok(lcp::solve(&self.n_c, &q, &scale, start.flags())?)
    }

    /// Kinetic energy `½ vᵀ M v` of a full velocity.
    pub fn kinetic(&self, v: &[f64]) -> f64 {
        0.5 * self.body.mass.quadratic(v)
    }

    /// Elastic energy `½ uᵀ K u` of a full displacement.
    pub fn elastic(&self, u: &[f64]) -> f64 {
        0.5 * self.body.stiffness.quadratic(u)
    }

    /// Dissipated power `vᵀ C v`.
    pub fn dissipation(&self, v: &[f64]) -> f64 {
        let Some(Rayleigh { alpha, beta }) = self.damping else { return 0.0 };
        let mut power = 0.0;
        if alpha > 0.0 {
            power += alpha * self.body.mass.quadratic(v);
        }
        if beta > 0.0 {
            power += beta * self.body.stiffness.quadratic(v);
        }
        power
    }

    /// Work vectors for the phases of this body.
    pub fn scratch(&self) -> Scratch {
        let n = self.n();
        Scratch {
            u: vec![0.0; n],
            v: vec![0.0; n],
            b: vec![0.0; n],
            x: vec![0.0; n],
            pair: [vec![], vec![]],
            mu: nalgebra::DVector::zeros(self.n_contact()),
            solve: self.mass_factor.scratch(),
        }
    }
}

/// Work vectors of one thread.
#[derive(Debug)]
pub struct Scratch {
    /// Full displacement of the last evaluation.
    pub u: Vec<f64>,
    /// Full velocity (where it was needed).
    pub v: Vec<f64>,
    pub(super) b: Vec<f64>,
    pub(super) x: Vec<f64>,
    pub(super) pair: [Vec<f64>; 2],
    pub(super) mu: nalgebra::DVector<f64>,
    pub(super) solve: SolveScratch,
}
