//! One smooth phase: `u_C = A_α u_O + d_α`, accelerations, monitors (theory §3–5).
//!
//! In contact `u_C = g`; free `u_C,f = −N_ff⁻¹ (N_f,O u_O + N_f,c g_c)`. The monitors are the gaps `w_i` of free nodes and the
//! pressures `p_i` of nodes in contact, affine in `u_O`, all ≥ 0 while the phase is valid.
//!
//! *Held* nodes are the exceptional case of theory §5 where neither side of the switching surface can be entered: the node
//! stays on `w_i = p_i = 0` and the acceleration is Filippov's convex combination
//! `ü = ü_c + Σ θ_i (ü_f,i − ü_c)` with `θ` such that `p̈_i = 0`. Its monitors are `θ_i` and `1 − θ_i`.

use nalgebra::{DMatrix, DVector, Dyn};

use super::ContactError;
use super::active::ActiveSet;
use super::nbm::{Correction, Scratch, System};
use crate::fem::Csr;

/// What a monitor watches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MonitorKind {
    /// Gap of a free node.
    Gap,
    /// Pressure of a node in contact.
    Pressure,
    /// `θ` of a held node: at zero it goes into contact.
    HeldToContact,
    /// `1 − θ` of a held node: at zero it is released.
    HeldToFree,
}

/// One switching function of a phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Monitor {
    /// Contact node (index in `u_C`).
    pub node: usize,
    /// What is watched.
    pub kind: MonitorKind,
}

#[derive(Debug)]
enum FreeBlock {
    Diagonal(Vec<f64>),
    Lu(nalgebra::LU<f64, Dyn, Dyn>),
}

/// The projection onto the accelerations that one active set admits.
#[derive(Debug)]
struct Projection {
    rows: Vec<usize>,
    schur: Option<nalgebra::Cholesky<f64, Dyn>>,
}

impl Projection {
    fn new(system: &System, set: &ActiveSet) -> Result<Self, ContactError> {
        let size = system.n_contact();
        let rows: Vec<usize> =
            (0..size).map(|i| if set.is_active(i) { i } else { size + i }).collect();
        if size == 0 {
            return Ok(Projection { rows, schur: None });
        }
        let block = DMatrix::from_fn(size, size, |a, b| system.gram[(rows[a], rows[b])]);
        let schur = block.cholesky().ok_or(ContactError::SingularPhase { set: set.clone() })?;
        Ok(Projection { rows, schur: Some(schur) })
    }

    /// `x ← x − M⁻¹ R_αᵀ (R_α M⁻¹ R_αᵀ)⁻¹ R_α x`, with `b = M x` at hand.
    fn apply(&self, system: &System, s: &mut Scratch, x: &mut [f64]) {
        let Some(schur) = &self.schur else { return };
        for (mu, &k) in s.mu.iter_mut().zip(&self.rows) {
            *mu = system.rows.row_dot(k, x);
        }
        schur.solve_mut(&mut s.mu);
        match &system.correction {
            Correction::Stored(columns) => {
                for (&mu, &k) in s.mu.iter().zip(&self.rows) {
                    columns.row(k).for_each(|(j, v)| x[j] -= mu * v);
                }
            }
            Correction::Solve => {
                x.copy_from_slice(&s.b);
                for (&mu, &k) in s.mu.iter().zip(&self.rows) {
                    system.rows.row(k).for_each(|(j, v)| x[j] -= mu * v);
                }
                system.mass_factor.solve(x, &mut s.solve);
            }
        }
    }
}

/// A phase: an active set and what follows from it.
#[derive(Debug)]
pub struct Phase {
    /// The active set (held nodes count as in contact).
    pub set: ActiveSet,
    /// Nodes held on the switching surface (none but in exceptional cases).
    pub held: Vec<usize>,
    /// The monitors of the phase.
    pub monitors: Vec<Monitor>,
    free: Vec<usize>,
    closed: Vec<usize>,
    free_block: FreeBlock,
    projection: Projection,
    released: Vec<Projection>,
}

impl Phase {
    /// The phase of an active set.
    pub fn new(system: &System, set: ActiveSet) -> Result<Phase, ContactError> {
        Phase::with_held(system, set, vec![])
    }

    /// The phase of an active set with nodes held on the switching surface.
    pub fn with_held(
        system: &System,
        mut set: ActiveSet,
        held: Vec<usize>,
    ) -> Result<Phase, ContactError> {
        held.iter().for_each(|&i| set.set(i, true));
        let (free, closed) = (set.free_nodes(), set.closed_nodes());
        let free_block = if system.n_c_diagonal {
            FreeBlock::Diagonal(free.iter().map(|&i| 1.0 / system.n_c[(i, i)]).collect())
        } else {
            let block = |a: usize, b: usize| system.n_c[(free[a], free[b])];
            FreeBlock::Lu(DMatrix::from_fn(free.len(), free.len(), block).lu())
        };
        let projection = Projection::new(system, &set)?;
        let released: Result<Vec<_>, _> =
            held.iter().map(|&i| Projection::new(system, &set.with(i, false))).collect();
        let mut monitors = vec![];
        for node in 0..system.n_contact() {
            let mut push = |kind| monitors.push(Monitor { node, kind });
            match (held.contains(&node), set.is_active(node)) {
                (true, _) => {
                    push(MonitorKind::HeldToContact);
                    push(MonitorKind::HeldToFree);
                }
                (false, true) => push(MonitorKind::Pressure),
                (false, false) => push(MonitorKind::Gap),
            }
        }
        let released = released?;
        Ok(Phase { set, held, monitors, free, closed, free_block, projection, released })
    }

    /// `x ← N_ff⁻¹ x` over the free nodes.
    fn solve_free(&self, x: &mut DVector<f64>) {
        match &self.free_block {
            FreeBlock::Diagonal(inverse) => {
                x.iter_mut().zip(inverse).for_each(|(x, d)| *x *= d);
            }
            FreeBlock::Lu(lu) if !x.is_empty() => {
                lu.solve_mut(x);
            }
            FreeBlock::Lu(_) => {}
        }
    }

    /// From `stress = N_O x` to the displacement `A x` (homogeneous) or `A x + d` of the free nodes.
    fn free_displacement(&self, system: &System, stress: &[f64], with_gap: bool) -> DVector<f64> {
        let mut x = DVector::from_iterator(self.free.len(), self.free.iter().map(|&i| -stress[i]));
        if with_gap && !system.n_c_diagonal {
            for (x, &i) in x.iter_mut().zip(&self.free) {
                *x -= self.closed.iter().map(|&c| system.n_c[(i, c)] * system.gap[c]).sum::<f64>();
            }
        }
        self.solve_free(&mut x);
        x
    }

    /// `u = A* u_O + d*`.
    pub fn expand_displacement(&self, system: &System, u_o: &[f64], u: &mut [f64]) {
        self.expand(system, u_o, u, true);
    }

    /// `v = A* v_O`.
    pub fn expand_velocity(&self, system: &System, v_o: &[f64], v: &mut [f64]) {
        self.expand(system, v_o, v, false);
    }

    fn expand(&self, system: &System, x_o: &[f64], x: &mut [f64], with_gap: bool) {
        let n_o = system.n_o();
        x[..n_o].copy_from_slice(x_o);
        for &i in &self.closed {
            x[n_o + i] = if with_gap { system.gap[i] } else { 0.0 };
        }
        if system.n_c_diagonal {
            for &i in &self.free {
                x[n_o + i] = -system.n_o.row_dot(i, x_o) / system.n_c[(i, i)];
            }
            return;
        }
        let stress: Vec<f64> =
            (0..system.n_contact()).map(|i| system.n_o.row_dot(i, x_o)).collect();
        let free = self.free_displacement(system, &stress, with_gap);
        self.free.iter().zip(free.iter()).for_each(|(&i, &v)| x[n_o + i] = v);
    }

    /// Acceleration `ü_O` at `(t, u_O, v_O)`: `M_α ü_O + C_α u̇_O + K_α u_O = A*ᵀ f − A*ᵀ K d*`.
    ///
    /// Leaves the full displacement in `s.u` and, where damping or a harmonic load needs it, the full velocity in `s.v`.
    pub fn acceleration(
        &self,
        system: &System,
        t: f64,
        u_o: &[f64],
        v_o: &[f64],
        s: &mut Scratch,
        a_o: &mut [f64],
    ) {
        if self.held.is_empty() {
            self.free_acceleration(system, t, u_o, v_o, s);
            let mut x = std::mem::take(&mut s.x);
            self.projection.apply(system, s, &mut x);
            self.finish(system, v_o, &x, a_o);
            s.x = x;
        } else {
            self.held_acceleration(system, t, u_o, v_o, s, a_o);
        }
    }

    /// `y = M_α⁻¹ K_α x` for two homogeneous vectors at once: matrix and factor are read once.
    pub fn stiffness_products(
        &self,
        system: &System,
        x_o: [&[f64]; 2],
        s: &mut Scratch,
        y_o: [&mut [f64]; 2],
    ) {
        let n = system.n();
        let [mut v, mut b] = std::mem::take(&mut s.pair);
        v.resize(2 * n, 0.0);
        b.resize(2 * n, 0.0);
        self.expand_velocity(system, x_o[0], &mut v[..n]);
        self.expand_velocity(system, x_o[1], &mut v[n..]);
        system.body.stiffness.mul_pair(&v, &mut b);
        // the correction by a second solve starts from the product itself
        let again = matches!(system.correction, Correction::Solve);
        if again {
            v.copy_from_slice(&b);
        }
        system.mass_factor.solve(&mut b, &mut s.solve);
        for (k, y_o) in y_o.into_iter().enumerate() {
            let part = k * n..(k + 1) * n;
            if again {
                s.b.copy_from_slice(&v[part.clone()]);
            }
            let x = &mut b[part];
            self.projection.apply(system, s, x);
            y_o.copy_from_slice(&x[..y_o.len()]);
        }
        s.pair = [v, b];
    }

    /// `x = M⁻¹ b`, `b = f − K (u + β v)`.
    fn free_acceleration(
        &self,
        system: &System,
        t: f64,
        u_o: &[f64],
        v_o: &[f64],
        s: &mut Scratch,
    ) {
        self.expand_displacement(system, u_o, &mut s.u);
        if system.loads.is_none() {
            s.b.fill(0.0);
        } else {
            system.loads.at(t, &mut s.b);
        }
        if system.damping.is_some() || !system.loads.harmonics.is_empty() {
            self.expand_velocity(system, v_o, &mut s.v);
        }
        match system.damping {
            Some(d) if d.beta > 0.0 => {
                for ((x, u), v) in s.x.iter_mut().zip(&s.u).zip(&s.v) {
                    *x = u + d.beta * v;
                }
                system.body.stiffness.mul_sub(&s.x, &mut s.b);
            }
            _ => system.body.stiffness.mul_sub(&s.u, &mut s.b),
        }
        s.x.copy_from_slice(&s.b);
        system.mass_factor.solve(&mut s.x, &mut s.solve);
    }

    /// The mass-proportional damping stays inside the admissible space: `P M⁻¹ (α M v) = α v`.
    fn finish(&self, system: &System, v_o: &[f64], x: &[f64], a_o: &mut [f64]) {
        a_o.copy_from_slice(&x[..a_o.len()]);
        if let Some(d) = system.damping.filter(|d| d.alpha > 0.0) {
            a_o.iter_mut().zip(v_o).for_each(|(a, v)| *a -= d.alpha * v);
        }
    }

    fn held_acceleration(
        &self,
        system: &System,
        t: f64,
        u_o: &[f64],
        v_o: &[f64],
        s: &mut Scratch,
        a_o: &mut [f64],
    ) {
        let (theta, accelerations) = self.held_weights(system, t, u_o, v_o, s);
        a_o.copy_from_slice(&accelerations[0]);
        for (&theta, released) in theta.iter().zip(&accelerations[1..]) {
            for ((a, r), c) in a_o.iter_mut().zip(released).zip(&accelerations[0]) {
                *a += theta * (r - c);
            }
        }
    }

    /// Weights `θ` of the held nodes, and the accelerations with all of them in contact and with
    /// each one released.
    fn held_weights(
        &self,
        system: &System,
        t: f64,
        u_o: &[f64],
        v_o: &[f64],
        s: &mut Scratch,
    ) -> (Vec<f64>, Vec<Vec<f64>>) {
        self.free_acceleration(system, t, u_o, v_o, s);
        let unconstrained = s.x.clone();
        let mut accelerations = vec![];
        let mut rates = vec![];
        for projection in std::iter::once(&self.projection).chain(&self.released) {
            let mut x = unconstrained.clone();
            projection.apply(system, s, &mut x);
            let mut a = vec![0.0; system.n_o()];
            self.finish(system, v_o, &x, &mut a);
            let rate = self.monitor_rates_at(system, &a);
            rates.push(self.held.iter().map(|&i| self.pressure_rate(&rate, i)).collect::<Vec<_>>());
            accelerations.push(a);
        }
        let k = self.held.len();
        let matrix = DMatrix::from_fn(k, k, |i, j| rates[1 + j][i] - rates[0][i]);
        let rhs = DVector::from_iterator(k, rates[0].iter().map(|r| -r));
        // where the sides do not differ there is no motion on the surface: not a number, which the flow reports
        let theta = matrix.lu().solve(&rhs).unwrap_or_else(|| DVector::from_element(k, f64::NAN));
        (theta.as_slice().to_vec(), accelerations)
    }

    /// In the list of rates the entry of `HeldToContact` carries the rate of the node's pressure.
    fn pressure_rate(&self, rates: &[f64], node: usize) -> f64 {
        let position = self.monitors.iter().position(|m| m.node == node);
        position.map_or(0.0, |k| rates[k])
    }

    /// The weights `θ` of the held nodes at a state.
    pub fn held_theta(
        &self,
        system: &System,
        t: f64,
        u_o: &[f64],
        v_o: &[f64],
        s: &mut Scratch,
    ) -> Vec<f64> {
        if self.held.is_empty() { vec![] } else { self.held_weights(system, t, u_o, v_o, s).0 }
    }

    /// Values of the gap and pressure monitors at `u_O` (for held nodes: the pressure).
    pub fn monitor_values(&self, system: &System, u_o: &[f64], h: &mut [f64]) {
        self.monitors_from(system, u_o, h, true);
    }

    /// Linear part of the monitors: `∇h · x` for `x = u̇_O`, `ü_O`, or a coefficient of an interpolant.
    pub fn monitor_rates(&self, system: &System, x_o: &[f64], h: &mut [f64]) {
        self.monitors_from(system, x_o, h, false);
    }

    fn monitors_from(&self, system: &System, x_o: &[f64], h: &mut [f64], with_gap: bool) {
        let stress: Vec<f64> =
            (0..system.n_contact()).map(|i| system.n_o.row_dot(i, x_o)).collect();
        let free = self.free_displacement(system, &stress, with_gap);
        let gap = |i: usize| if with_gap { system.gap[i] } else { 0.0 };
        let mut next_free = free.iter();
        for (h, m) in h.iter_mut().zip(&self.monitors) {
            let i = m.node;
            *h = match m.kind {
                MonitorKind::Gap => gap(i) - next_free.next().copied().unwrap_or(0.0),
                _ if system.n_c_diagonal => -stress[i] - system.n_c[(i, i)] * gap(i),
                _ => {
                    let from_free: f64 = self
                        .free
                        .iter()
                        .zip(free.iter())
                        .map(|(&j, u)| system.n_c[(i, j)] * u)
                        .sum();
                    let from_closed: f64 =
                        self.closed.iter().map(|&j| system.n_c[(i, j)] * gap(j)).sum();
                    -stress[i] - from_free - from_closed
                }
            };
        }
    }

    /// [`Phase::monitor_values`] as a new vector.
    pub fn monitor_values_at(&self, system: &System, u_o: &[f64]) -> Vec<f64> {
        let mut h = vec![0.0; self.monitors.len()];
        self.monitor_values(system, u_o, &mut h);
        h
    }

    /// [`Phase::monitor_rates`] as a new vector.
    pub fn monitor_rates_at(&self, system: &System, x_o: &[f64]) -> Vec<f64> {
        let mut h = vec![0.0; self.monitors.len()];
        self.monitor_rates(system, x_o, &mut h);
        h
    }

    /// Rounding error of each monitor when displacements are of the order of `u`.
    pub fn monitor_rounding(&self, system: &System, u: f64) -> Vec<f64> {
        let rounding = |m: &Monitor| {
            let pressure = super::lcp::UNITS * system.pressure_scale(m.node, u);
            match m.kind {
                MonitorKind::Gap => pressure / system.n_c[(m.node, m.node)],
                MonitorKind::Pressure => pressure,
                _ => 1e-12,
            }
        };
        self.monitors.iter().map(rounding).collect()
    }

    /// Pressures at the contact nodes: exactly zero where free.
    pub fn pressures(&self, system: &System, u_o: &[f64], p: &mut [f64]) {
        let h = self.monitor_values_at(system, u_o);
        p.fill(0.0);
        for (h, m) in h.iter().zip(&self.monitors) {
            if m.kind == MonitorKind::Pressure {
                p[m.node] = *h;
            }
        }
    }

    /// `K_α = A*ᵀ K A*` and `M_α = A*ᵀ M A*` as sparse matrices (for modes and exact flows; the
    /// event-driven Runge–Kutta methods never form them).
    pub fn matrices(&self, system: &System) -> (Csr, Csr) {
        let a = self.a_star(system);
        (congruence(&a, &system.body.stiffness), congruence(&a, &system.body.mass))
    }

    /// `A* = [I; A_α]`, sparse.
    pub fn a_star(&self, system: &System) -> Csr {
        let n_o = system.n_o();
        let mut entries: Vec<(usize, usize, f64)> = (0..n_o).map(|i| (i, i, 1.0)).collect();
        if system.n_c_diagonal {
            for &i in &self.free {
                let scale = -1.0 / system.n_c[(i, i)];
                entries.extend(system.n_o.row(i).map(|(j, v)| (n_o + i, j, scale * v)));
            }
        } else {
            let mut columns: Vec<usize> =
                self.free.iter().flat_map(|&i| system.n_o.row(i).map(|(j, _)| j)).collect();
            columns.sort_unstable();
            columns.dedup();
            let mut stress = DMatrix::<f64>::zeros(system.n_contact(), columns.len());
            for &i in &self.free {
                for (j, v) in system.n_o.row(i) {
                    if let Ok(k) = columns.binary_search(&j) {
                        stress[(i, k)] = v;
                    }
                }
            }
            for (k, &j) in columns.iter().enumerate() {
                let free = self.free_displacement(system, stress.column(k).as_slice(), false);
                let rows = self.free.iter().zip(free.iter());
                entries.extend(rows.map(|(&i, &v)| (n_o + i, j, v)));
            }
        }
        Csr::from_triplets(system.n(), n_o, entries)
    }
}

/// `Aᵀ B A` for sparse `A`, `B`.
fn congruence(a: &Csr, b: &Csr) -> Csr {
    let mut entries = vec![];
    for (i, j, v) in b.triplets() {
        for (p, x) in a.row(i) {
            entries.extend(a.row(j).map(|(q, y)| (p, q, x * v * y)));
        }
    }
    Csr::from_triplets(a.n_cols(), a.n_cols(), entries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::nbm::{ContactEdge, Rayleigh};
    use crate::fem::{Body, DofMap, Material, SpdFactor};
    use crate::mesh::{Edge, Mesh};

    fn example(lumped_mass: bool, lumped_boundary: bool) -> System {
        let mesh = Mesh::rectangle(1.0, 0.5, 5, 4);
        let dofs = DofMap::new(&mesh, &[(Edge::Left, 0), (Edge::Left, 1)], Some(Edge::Right));
        let material = Material::Plate { young: 2.0, poisson: 0.3, density: 1.5, thickness: 1.0 };
        let gap: Vec<f64> = dofs.contact_nodes.iter().map(|&n| 0.3 + mesh.nodes[n][1]).collect();
        let body = Body::assemble(mesh, dofs, material, lumped_mass);
        let edge = ContactEdge { edge: Edge::Right, gap, lumped: lumped_boundary };
        System::new(body, Some(&edge)).unwrap()
    }

    fn wave(n: usize, k: f64) -> Vec<f64> {
        (0..n).map(|i| (k * (i as f64 + 0.3)).sin()).collect()
    }

    /// The projection must equal `M_α⁻¹ A*ᵀ (f − K d* − …)` with the matrices formed outright.
    #[test]
    fn acceleration_equals_the_projected_operators() {
        for (lumped_mass, lumped_boundary) in [(false, false), (true, true), (false, true)] {
            let mut system = example(lumped_mass, lumped_boundary);
            system.damping = Some(Rayleigh { alpha: 0.2, beta: 0.05 });
            system.loads.push(wave(system.n(), 0.7), Some(2.0), 0.3);
            for flags in 0..32u32 {
                let set = ActiveSet::new((0..5).map(|i| flags >> i & 1 == 1).collect());
                let phase = Phase::new(&system, set).unwrap();
                let (u, v) = (wave(system.n_o(), 0.9), wave(system.n_o(), 1.7));
                let mut s = system.scratch();
                let mut a = vec![0.0; system.n_o()];
                phase.acceleration(&system, 0.4, &u, &v, &mut s, &mut a);

                let (k, m) = phase.matrices(&system);
                let a_star = phase.a_star(&system);
                let mut d = vec![0.0; system.n()];
                phase.expand_displacement(&system, &vec![0.0; system.n_o()], &mut d);
                let mut f = vec![0.0; system.n()];
                system.loads.at(0.4, &mut f);
                system.body.stiffness.mul_sub(&d, &mut f);
                let mut rhs = vec![0.0; system.n_o()];
                a_star.triplets().for_each(|(i, j, x)| rhs[j] += x * f[i]);
                let w: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u + 0.05 * v).collect();
                k.mul_sub(&w, &mut rhs);
                let damped: Vec<f64> = v.iter().map(|v| 0.2 * v).collect();
                m.mul_sub(&damped, &mut rhs);
                let factor = SpdFactor::new(&m, "M_α").unwrap();
                factor.solve(&mut rhs, &mut factor.scratch());
                let scale = rhs.iter().fold(0.0f64, |s, x| s.max(x.abs()));
                let worst = a.iter().zip(&rhs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-11 * scale, "set {flags:05b}: {worst} of {scale}");
            }
        }
    }

    /// The monitors are the two sides of the complementarity problem.
    #[test]
    fn monitors_solve_the_lcp() {
        for lumped in [false, true] {
            let system = example(false, lumped);
            for k in 1..20 {
                let u: Vec<f64> = wave(system.n_o(), 0.1 * k as f64);
                let solution = system.solve_lcp(&u, &ActiveSet::open(5)).unwrap();
                let phase = Phase::new(&system, ActiveSet::new(solution.active.clone())).unwrap();
                let mut h = vec![0.0; 5];
                phase.monitor_values(&system, &u, &mut h);
                for (h, m) in h.iter().zip(&phase.monitors) {
                    let expected = solution.w[m.node].max(solution.p[m.node]);
                    assert!((h - expected).abs() < 1e-12 * (1.0 + expected) && *h >= 0.0);
                }
                let mut full = vec![0.0; system.n()];
                phase.expand_displacement(&system, &u, &mut full);
                for i in 0..5 {
                    let w = system.gap[i] - full[system.n_o() + i];
                    assert!((w - solution.w[i]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn two_solves_equal_stored_columns() {
        let system = example(false, false);
        let mut other = example(false, false);
        other.correction = Correction::Solve;
        let phase =
            Phase::new(&system, ActiveSet::new(vec![true, false, true, false, false])).unwrap();
        let (u, v) = (wave(system.n_o(), 0.4), wave(system.n_o(), 1.1));
        let mut out = [vec![0.0; system.n_o()], vec![0.0; system.n_o()]];
        phase.acceleration(&system, 0.0, &u, &v, &mut system.scratch(), &mut out[0]);
        phase.acceleration(&other, 0.0, &u, &v, &mut other.scratch(), &mut out[1]);
        let worst = out[0].iter().zip(&out[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-11);
    }
}
