//! From forces to accelerations: `M_α ü_O = A*ᵀ b`.
//!
//! *Projected* (the paper's mass): `M_α = A*ᵀMA*` jumps at switches. Any admissible acceleration of phase α satisfies `n_C` homogeneous linear
//! conditions `R_α a = 0`: `a_C,i = 0` for a point in contact, `(N_C a_C + N_O a_O)_i = 0` for a free one. All phases choose their rows from the same
//! `2 n_C` vectors, so with one factorisation of `M` and the Gram matrix `Γ = R M⁻¹ Rᵀ` of these vectors
//!
//! ```text
//! M_α ü_O = A*ᵀ b   ⇔   ü = M⁻¹ b − M⁻¹ R_αᵀ (R_α M⁻¹ R_αᵀ)⁻¹ R_α M⁻¹ b
//! ```
//!
//! is the M-orthogonal projection of the unconstrained acceleration, and a new phase costs one Cholesky factorisation of an `n_C × n_C` block of Γ,
//! whatever the size of the body (theory §4).
//!
//! *Constant*: `M_α = M_0` in every phase, factorised once; a new phase costs nothing.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector};

use super::ContactError;
use super::condensed::Condensed;
use super::conditions::Conditions;
use super::coupling::Coupling;
use super::expansion::{Expansion, Solved};
use super::gram::{Schur, gram, gram_and_columns};
use super::lcp::Side;
use super::reactions::Holds;
use super::scratch::Scratch;
use super::states::States;
use crate::fem::{Body, Csr, DofMap, SolveScratch, SpdFactor};

/// Columns of `M⁻¹Rᵀ` are kept while they have at most this many entries.
const STORE_LIMIT: usize = 2_000_000;

/// The mass of a body in contact.
#[derive(Debug)]
pub(super) enum Inertia {
    Projected(Box<Projector>),
    Constant(Arc<ConstantMass>),
}

/// What the projections of all phases share: the factor of the body's own `M`, the rows, their Gram matrix.
#[derive(Debug)]
pub(super) struct Projector {
    factor: SpdFactor,
    rows: Csr,
    pub gram: Coupling,
    /// Columns of `M⁻¹Rᵀ` (as rows); none: a second solve with `M` instead.
    columns: Option<Csr>,
}

/// `M_0` over `u_O`.
#[derive(Debug)]
pub(super) enum ConstantMass {
    /// As a matrix.
    Formed {
        /// `[M_0, 0; 0, 0]` over `u`.
        mass: Csr,
        /// Of `M_0`.
        factor: SpdFactor,
        /// `N_O M_0⁻¹ N_Oᵀ`.
        gram: DMatrix<f64>,
        /// `A*_∅`, of a condensed one.
        open: Option<Csr>,
    },
    /// The condensed one of a body whose own mass is a diagonal.
    Condensed {
        /// It.
        mass: Box<Condensed>,
        /// `N_O M_0⁻¹ N_Oᵀ`, where somebody asks for it.
        gram: OnceLock<DMatrix<f64>>,
    },
}

impl Projector {
    pub fn new(body: &Body, conditions: &Conditions) -> Result<Projector, ContactError> {
        Projector::storing(body, conditions, STORE_LIMIT)
    }

    /// The same with another limit of what is kept.
    pub(crate) fn storing(
        body: &Body,
        conditions: &Conditions,
        limit: usize,
    ) -> Result<Projector, ContactError> {
        let (size, n_o) = (conditions.count(), conditions.n_o.n_cols());
        let factor = SpdFactor::of_mass(&body.mass, &body.dofs)?;
        // rows 0..n_C: point in contact; rows n_C..2n_C: point free, scaled to the order of one
        let mut entries = vec![];
        for i in 0..size {
            entries.push((i, n_o + i, 1.0));
            let scale = 1.0 / conditions.n_c[(i, i)];
            entries.extend(conditions.n_o.row(i).map(|(j, v)| (size + i, j, scale * v)));
            entries.extend(conditions.n_c.row(i).map(|(j, v)| (size + i, n_o + j, scale * v)));
        }
        let n = body.dofs.n();
        let rows = Csr::from_triplets(2 * size, n, entries);
        if let (SpdFactor::Diagonal(inverse), true) = (&factor, limit > 0) {
            let columns = rows.triplets().map(|(i, j, v)| (i, j, v * inverse[j])).collect();
            let columns = Csr::from_triplets(2 * size, n, columns);
            let gram = columns.product(&rows.transposed()).into();
            return Ok(Projector { factor, rows, gram, columns: Some(columns) });
        }
        let (gram, columns) = gram_and_columns(&factor, &rows, limit);
        Ok(Projector { factor, rows, gram: gram.into(), columns })
    }

    /// The reciprocal masses, with the columns `M⁻¹Rᵀ`, where the mass is a diagonal.
    pub fn diagonal(&self) -> Option<(&[f64], &Csr)> {
        match (&self.factor, &self.columns) {
            (SpdFactor::Diagonal(inverse), Some(columns)) => Some((inverse, columns)),
            _ => None,
        }
    }

    /// Displacements that the rows know.
    pub fn support(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self.rows.triplets().map(|e| e.1).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

impl ConstantMass {
    /// Of the matrix itself over the displacements of `dofs` that move by themselves; `open` is `A*_∅` where it is the condensed one.
    pub fn formed(
        reduced: Csr,
        dofs: &DofMap,
        conditions: &Conditions,
        open: Option<Csr>,
    ) -> Result<ConstantMass, ContactError> {
        let (size, n_o) = (conditions.count(), reduced.n_rows());
        let factor = SpdFactor::of_mass(&reduced, dofs)?;
        let gram = gram(&factor, &conditions.n_o);
        let n = n_o + size;
        let mass = Csr::from_triplets(n, n, reduced.triplets().collect());
        Ok(ConstantMass::Formed { mass, factor, gram, open })
    }

    /// `[M_0, 0; 0, 0]` over `u`.
    pub fn matrix(&self, body: &Body) -> &Csr {
        match self {
            ConstantMass::Formed { mass, .. } => mass,
            ConstantMass::Condensed { mass, .. } => mass.formed(body),
        }
    }

    /// `N_O M_0⁻¹ N_Oᵀ`.
    pub fn gram(&self, conditions: &Conditions) -> &DMatrix<f64> {
        match self {
            ConstantMass::Formed { gram, .. } => gram,
            ConstantMass::Condensed { mass, gram } => {
                gram.get_or_init(|| mass.gram(&conditions.n_o))
            }
        }
    }

    pub fn scratch(&self) -> SolveScratch {
        match self {
            ConstantMass::Formed { factor, .. } => factor.scratch(),
            ConstantMass::Condensed { mass, .. } => mass.scratch(),
        }
    }

    /// `x ← M_0⁻¹ x`; one vector, or two one after the other.
    pub fn solve(&self, x: &mut [f64], scratch: &mut SolveScratch) {
        match self {
            ConstantMass::Formed { factor, .. } => factor.solve(x, scratch),
            ConstantMass::Condensed { mass, .. } => mass.solve(x, scratch),
        }
    }

    /// What forces on `u_C` add to those on `u_O` in the open phase, `A_∅ᵀ f_C`, of a condensed mass.
    pub(crate) fn push_open(&self, f_c: &[f64], mut add: impl FnMut(usize, f64)) {
        match self {
            ConstantMass::Condensed { mass, .. } => mass.push(f_c, add),
            ConstantMass::Formed { open: Some(open), mass, .. } => {
                let first = mass.n_rows() - f_c.len();
                for (i, f) in f_c.iter().enumerate() {
                    open.row(first + i).for_each(|(j, v)| add(j, v * f));
                }
            }
            ConstantMass::Formed { open: None, .. } => {}
        }
    }

    /// Bounds of `‖∇h‖_{M⁻¹}` of the monitors of a phase.
    fn gradient_bounds(&self, solved: &Solved, set: &States) -> Vec<f64> {
        let conditions = &solved.conditions;
        let points = 0..conditions.len();
        if conditions.n_c.is_sparse()
            && let Some(known) = conditions.follow_bounds()
        {
            let norms = match self {
                ConstantMass::Condensed { mass, .. } => mass.row_norms(&conditions.n_o),
                ConstantMass::Formed { gram, .. } => {
                    gram.diagonal().iter().map(|g| g.max(0.0).sqrt()).collect()
                }
            };
            let [gap, pressure] = known.follow(&conditions.n_c, norms);
            let of = |k: usize| if set.touches(k) { &pressure } else { &gap };
            return points.map(|k| of(k)[conditions.points[k].0]).collect();
        }
        let l = solved.over_stress();
        let mut is_free = vec![false; conditions.count()];
        solved.free.iter().for_each(|&d| is_free[d] = true);
        // a gap behind an obstacle that a displacement touches does not change
        let of = |k: usize| match conditions.points[k].0 {
            d if !set.touches(k) && !is_free[d] => 0.0,
            d => row_norm(&l, d, self.gram(conditions)),
        };
        points.map(of).collect()
    }
}

impl Inertia {
    /// `M*` over `u`: the kinetic energy is `½ u̇ᵀM*u̇`.
    pub fn mass<'a>(&'a self, body: &'a Body) -> &'a Csr {
        match self {
            Inertia::Projected(_) => &body.mass,
            Inertia::Constant(c) => c.matrix(body),
        }
    }

    /// `xᵀM*x` of a full vector that is at rest but for some displacements of `u_O` and what follows them.
    pub fn quadratic(&self, body: &Body, rows: Range<usize>, x: &[f64]) -> f64 {
        let n_o = body.dofs.n_o;
        match self {
            Inertia::Constant(c) => match &**c {
                ConstantMass::Condensed { mass, .. } => mass.quadratic(rows, x),
                ConstantMass::Formed { mass, .. } => mass.quadratic_of(rows, x),
            },
            _ if rows.len() == n_o => self.mass(body).quadratic(x),
            _ => {
                let mass = self.mass(body);
                mass.quadratic_of(rows, x) + mass.quadratic_of(n_o..x.len(), x)
            }
        }
    }

    /// `y = M* x`
    pub fn mul(&self, body: &Body, x: &[f64], y: &mut [f64]) {
        match self {
            Inertia::Constant(c) => match &**c {
                ConstantMass::Condensed { mass, .. } => mass.mul(x, y),
                ConstantMass::Formed { mass, .. } => mass.mul(x, y),
            },
            _ => self.mass(body).mul(x, y),
        }
    }

    pub fn scratch(&self) -> SolveScratch {
        match self {
            Inertia::Projected(p) => p.factor.scratch(),
            Inertia::Constant(c) => c.scratch(),
        }
    }
}

/// A bound of `√(l_iᵀ G l_i)` for a row of `L`, as sharp as rounding: what is far away, and next to nothing, counts by its size alone.
fn row_norm(l: &DMatrix<f64>, i: usize, gram: &DMatrix<f64>) -> f64 {
    const FAR: f64 = 1e-14;
    let size = |k: usize| l[(i, k)].abs() * gram[(k, k)].max(0.0).sqrt();
    let largest = (0..gram.nrows()).map(size).fold(0.0, f64::max);
    let (near, far): (Vec<usize>, Vec<usize>) =
        (0..gram.nrows()).partition(|&k| size(k) > FAR * largest);
    let of_row =
        |&j: &usize| near.iter().map(|&k| l[(i, k)] * gram[(k, j)]).sum::<f64>() * l[(i, j)];
    let square: f64 = near.iter().map(of_row).sum();
    square.max(0.0).sqrt() + far.into_iter().map(size).sum::<f64>()
}

/// The inertia of one phase.
#[derive(Debug)]
pub(super) struct PhaseInertia {
    pub shared: Arc<Inertia>,
    /// Rows of the conditions that the set chooses, of a projected mass.
    rows: Vec<usize>,
    /// `R_α M⁻¹ R_αᵀ`, factorised when a force first asks for an acceleration.
    schur: OnceLock<Option<Schur>>,
    /// What reactions hold.
    holds: Option<Holds>,
}

impl PhaseInertia {
    /// Of a phase in which contact displacements follow from conditions.
    pub fn new(shared: &Arc<Inertia>, conditions: &Conditions, set: &States) -> PhaseInertia {
        let size = conditions.count();
        let places = conditions.places(set);
        let row = |d: usize| if places[d] == Side::Free { size + d } else { d };
        let rows = match &**shared {
            Inertia::Projected(_) => (0..size).map(row).collect(),
            Inertia::Constant(_) => vec![],
        };
        PhaseInertia { shared: shared.clone(), rows, schur: OnceLock::new(), holds: None }
    }

    /// Of a phase in which reactions hold some displacements, if any.
    pub(crate) fn holding(shared: &Arc<Inertia>, holds: Option<Holds>) -> PhaseInertia {
        PhaseInertia { shared: shared.clone(), rows: vec![], schur: OnceLock::new(), holds }
    }

    /// What reactions hold.
    pub fn holds(&self) -> Option<&Holds> {
        self.holds.as_ref()
    }

    /// Rows of the conditions that the set chooses.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// `μ = (R_α M⁻¹ R_αᵀ)⁻¹ R_α x`; false where the reduced mass is singular.
    pub fn multipliers(&self, p: &Projector, x: &[f64], mu: &mut DVector<f64>) -> bool {
        let rows = &self.rows;
        let Some(schur) = self.schur.get_or_init(|| Schur::of(&p.gram, rows)) else { return false };
        for (mu, &k) in mu.iter_mut().zip(rows) {
            *mu = p.rows.row_dot(k, x);
        }
        schur.solve(mu);
        true
    }

    /// `x ← x − M⁻¹ R_αᵀ (R_α M⁻¹ R_αᵀ)⁻¹ R_α x`, with `b = M x` at hand. Not numbers where the reduced mass is singular.
    fn project(
        &self,
        p: &Projector,
        b: &[f64],
        mu: &mut DVector<f64>,
        x: &mut [f64],
        solve: &mut SolveScratch,
    ) {
        if !self.multipliers(p, x, mu) {
            return x.fill(f64::NAN);
        }
        let rows = &self.rows;
        if rows.is_empty() {
            return;
        }
        match &p.columns {
            Some(columns) => {
                for (&mu, &k) in mu.iter().zip(rows) {
                    columns.row(k).for_each(|(j, v)| x[j] -= mu * v);
                }
            }
            None => {
                x.copy_from_slice(b);
                for (&mu, &k) in mu.iter().zip(rows) {
                    p.rows.row(k).for_each(|(j, v)| x[j] -= mu * v);
                }
                p.factor.solve(x, solve);
            }
        }
    }

    /// `a_O = M_α⁻¹ A*ᵀ b` for the force `s.b`.
    pub(crate) fn accelerate(&self, expansion: &Expansion, s: &mut Scratch, a_o: &mut [f64]) {
        match &*self.shared {
            Inertia::Projected(p) => {
                s.x.copy_from_slice(&s.b);
                p.factor.solve(&mut s.x, &mut s.solve);
                self.project(p, &s.b, &mut s.mu, &mut s.x, &mut s.solve);
                a_o.copy_from_slice(&s.x[..a_o.len()]);
            }
            Inertia::Constant(c) => {
                expansion.reduce(&mut s.b);
                a_o.copy_from_slice(&s.b[..a_o.len()]);
                c.solve(a_o, &mut s.solve);
            }
        }
        self.hold(a_o);
    }

    fn hold(&self, a: &mut [f64]) {
        if let Some(holds) = &self.holds {
            holds.stop(a);
        }
    }

    /// The same for one force or two, one after the other in `b`, with room for as many numbers in `room`; matrix and factor are read once.
    pub(crate) fn accelerate_all<const N: usize>(
        &self,
        expansion: &Expansion,
        b: &mut [f64],
        room: &mut [f64],
        s: &mut Scratch,
        y_o: [&mut [f64]; N],
    ) {
        let n = b.len() / N;
        match &*self.shared {
            Inertia::Projected(p) => {
                // the correction by a second solve starts from the force itself
                if p.columns.is_none() {
                    room.copy_from_slice(b);
                }
                p.factor.solve(b, &mut s.solve);
                for (k, y_o) in y_o.into_iter().enumerate() {
                    let part = k * n..(k + 1) * n;
                    self.project(
                        p,
                        &room[part.clone()],
                        &mut s.mu,
                        &mut b[part.clone()],
                        &mut s.solve,
                    );
                    y_o.copy_from_slice(&b[part][..y_o.len()]);
                    self.hold(y_o);
                }
            }
            Inertia::Constant(c) => {
                let n_o = y_o[0].len();
                // the right-hand sides side by side
                for k in 0..N {
                    expansion.reduce(&mut b[k * n..(k + 1) * n]);
                    b.copy_within(k * n..k * n + n_o, k * n_o);
                }
                c.solve(&mut b[..N * n_o], &mut s.solve);
                for (k, y_o) in y_o.into_iter().enumerate() {
                    y_o.copy_from_slice(&b[k * n_o..(k + 1) * n_o]);
                    self.hold(y_o);
                }
            }
        }
    }

    /// `M_α` where contact displacements follow.
    pub fn matrix(&self, body: &Body, a_star: &Csr) -> Csr {
        match &*self.shared {
            Inertia::Projected(_) => body.mass.congruence(a_star),
            Inertia::Constant(c) => c.matrix(body).leading(body.dofs.n_o),
        }
    }

    /// Bounds of `‖∇h_i‖_{M⁻¹}` for all contact points: gap of a free one, pressure of one in contact. None known where contact displacements have inertia.
    pub(crate) fn gradient_bounds(&self, expansion: &Expansion, set: &States) -> Vec<f64> {
        let Some(solved) = expansion.solved() else {
            return vec![f64::INFINITY; set.len()];
        };
        let size = solved.conditions.len();
        match &*self.shared {
            // the Gram matrix's own diagonal, of which a phase only subtracts
            Inertia::Projected(p) => (0..size)
                .map(|k| {
                    let (d, count) = (solved.conditions.points[k].0, solved.conditions.count());
                    let norm = |row: usize| p.gram[(row, row)].max(0.0).sqrt();
                    match set.touches(k) {
                        false => norm(d),
                        true => solved.conditions.stiffness(k).abs() * norm(count + d),
                    }
                })
                .collect(),
            Inertia::Constant(c) => c.gradient_bounds(solved, set),
        }
    }
}
