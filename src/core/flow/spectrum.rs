//! The eigenbasis of one active set (theory §6); the motion of its modes is in [`super::motion`].
//!
//! In the eigenbasis of `(K_α, M_α)` a phase decouples, `q̈ + 2c q̇ + ω² q = F₀ + Σ_j F_j cos(Ω_j t + φ_j)` with `2c = α + βω²`, and each
//! coordinate is known at every time to rounding error: under- and over-damped, constant and harmonic loads
//! through resonance, rigid motions (`ω = 0`). The basis does not depend on the frequencies of the loads.

use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::ops::{Deref, Range};
use std::rc::Rc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use nalgebra::{Complex, DMatrix};

use super::cache::Cache;
use super::coupled::{Operators, Rows};
use super::defect::{Defect, dot, product, transposed};
use super::drives::Drives;
use super::motion;
use super::oscillator::Oscillator;
use super::sliding::{Coupled, SlidingMotion};
use crate::contact::{
    Creep, Drive, Lost, Monitor, Phase, PointState, Rayleigh, Slider, States, System,
};
use crate::fem::{Csr, FemError, Harmonic, Loads, Pivots, along, dense, eigen, largest};

/// The eigenbasis of one active set with its loads, and its modes under the damping of the time when they were asked for.
#[derive(Debug)]
pub struct Spectrum {
    /// The modes, lowest first.
    pub modes: Vec<Oscillator>,
    damping: Option<Rayleigh>,
    basis: Rc<Eigenbasis>,
    /// Undamped, without rigid motions.
    pub(super) is_undamped: bool,
    /// The complex modes, where the natural ones do not decouple the phase.
    pub(super) coupling: Option<Coupled>,
    /// `F₀` of each mode, with what damping makes of displacements that stick to a moving surface.
    pub(super) steady_force: Vec<f64>,
}

/// A complex mode of a phase, `u_O = Re(φ e^{λt})`.
#[derive(Debug, Clone)]
pub struct ComplexMode {
    /// `λ`: its growth rate and circular frequency.
    pub lambda: Complex<f64>,
    /// `φ`, over `u_O`.
    pub shape: Vec<Complex<f64>>,
}

/// What does not depend on the damping: `α M + β K` has the same modes whatever `α` and `β`.
#[derive(Debug)]
pub struct Eigenbasis {
    /// Natural frequencies, lowest first.
    omega: Vec<f64>,
    /// `Φ`: `u_O = Φ q`.
    pub shapes: Mat<f64>,
    /// `ΦᵀM_α`: `q = ΦᵀM_α u_O`.
    pub inverse: Mat<f64>,
    /// `F₀` of each mode.
    pub constant: Vec<f64>,
    /// Modal forces of each harmonic load.
    pub harmonics: Vec<Vec<f64>>,
    /// The states of the contact points.
    pub(super) states: States,
    /// The monitors of the phase.
    pub monitors: Vec<Monitor>,
    /// `r = ∇h Φ`, one row a monitor.
    pub rows: DMatrix<f64>,
    /// The same of velocities, of phases that know any.
    pub velocity_rows: Option<DMatrix<f64>>,
    /// What friction holds.
    pub(super) stuck: Stuck,
    /// Displacements without mass along obstacles.
    creep: Vec<Creep>,
    /// Monitors at `u_O = 0`.
    pub offsets: Vec<f64>,
    /// What harmonic loads on `u_C` add to the monitors, at the frequencies of the time when this was made.
    drives: Vec<Drive>,
    /// What the natural modes do not make diagonal.
    mixing: Option<Mixing>,
    /// The body's unit of frequency.
    unit: f64,
    /// How far these modes are from being the phase's.
    pub(super) defect: Defect,
}

/// What friction holds in a phase, in its coordinates: the last ones are displacements that stick, `u = Φ q_m + Ψ q_s`, `Ψ` static shapes. What nothing holds comes first.
#[derive(Debug)]
pub(super) struct Stuck {
    /// Their velocities `V`, those of the obstacle's surface.
    pub velocities: Vec<f64>,
    /// `ΦᵀMΨ`, over the coordinates that move.
    pub inertia: Mat<f64>,
    /// `ΦᵀMΨ V`
    pub drag: Vec<f64>,
    /// `VᵀΨᵀMΨ V` and `VᵀΨᵀKΨ V`
    pub squares: [f64; 2],
    /// Leading coordinates that are rigid motions; none in phases that know no friction.
    pub rigid: usize,
    /// Forces of the harmonic loads on all coordinates, what sticks included: their work.
    pub loads: Vec<Vec<f64>>,
}

/// Matrices that natural modes need not make diagonal.
#[derive(Debug, Default)]
struct Mixing {
    /// `ΦᵀK₀Φ` of the body without springs, which damps, where that is not `Λ`.
    structure: Option<Mat<f64>>,
    /// Of forces without a potential `ΦᵀK_αΦ`, and what of it, and of the constant force, has none.
    forces: Option<Forces>,
    /// `ΦᵀWᵀWΦ` of dampers.
    dampers: Option<Mat<f64>>,
}

/// A force along a rigid motion below this share of the largest is a rounding error.
const PUSHED: f64 = 1e-13;

/// Entries of `ΦᵀWᵀWΦ` beside the diagonal, over the largest on it, that are rounding errors of modal damping in its own modes.
const BESIDE: f64 = 1e-13;

#[derive(Debug)]
struct Forces {
    stiffness: Mat<f64>,
    /// Of friction nothing: its work is counted apart.
    skew: Option<(Mat<f64>, Vec<f64>)>,
}

impl Mixing {
    /// Of a phase where there is any.
    fn of(phase: &Phase, shapes: &Mat<f64>, omega: &[f64], moving: usize) -> Option<Mixing> {
        let projected = |a: &Csr| -> Mat<f64> {
            let mut columns = Mat::<f64>::zeros(shapes.nrows(), shapes.ncols());
            (0..shapes.ncols())
                .for_each(|j| a.mul(shapes.col_as_slice(j), columns.col_as_slice_mut(j)));
            dense::product(shapes.transpose(), columns.as_ref())
        };
        let mut mixing = Mixing { dampers: phase.dampers_among(shapes), ..Mixing::default() };
        if let Some(slips) = phase.slip_stiffness() {
            let mut stiffness = projected(&slips);
            for (j, w) in omega.iter().enumerate() {
                // rigid motions change no pressure
                if j < moving && *w == 0.0 {
                    (0..omega.len()).for_each(|i| stiffness[(i, j)] = 0.0);
                }
                stiffness[(j, j)] += w * w;
            }
            mixing.forces = Some(Forces { stiffness, skew: None });
        }
        if let Some(structure) = phase.damping_stiffness() {
            let mut structure = projected(&structure);
            // where all that slips has no mass it damps as it is stiff, rigid motions nothing
            let rigid = omega[..moving].iter().take_while(|w| phase.creeps() && **w == 0.0).count();
            (0..rigid).for_each(|j| structure.col_as_slice_mut(j).fill(0.0));
            mixing.structure = Some(structure);
        }
        if mixing.forces.is_none() {
            mixing.forces = phase.lost().map(|Lost { matrix, constant }| Forces {
                stiffness: projected(&phase.matrices().0),
                skew: Some((projected(&matrix), transposed(shapes, &constant))),
            });
        }
        let any = mixing.structure.is_some() || mixing.forces.is_some() || mixing.dampers.is_some();
        any.then_some(mixing)
    }

    /// Whether it couples the first `moving` coordinates under stiffness-proportional damping, or without.
    fn couples(&self, beta: f64, moving: usize) -> bool {
        let beside = |d: &Mat<f64>| {
            let largest = (0..moving).fold(0.0f64, |m, i| m.max(d[(i, i)]));
            let is_beside = |i: usize, j: usize| i != j && d[(i, j)].abs() > BESIDE * largest;
            (0..moving).any(|j| (0..moving).any(|i| is_beside(i, j)))
        };
        self.forces.is_some()
            || beta != 0.0 && self.structure.is_some()
            || self.dampers.as_ref().is_some_and(beside)
    }

    /// Of the coordinates; what sticks, the last ones, moves by itself, and what damps it pushes with the steady forces.
    fn operators(&self, omega: &[f64], moving: usize, (alpha, beta): (f64, f64)) -> Operators {
        let n = omega.len();
        let diagonal = |i: usize, j: usize, x: f64| if i == j { x } else { 0.0 };
        let structure = |i: usize, j: usize| match &self.structure {
            Some(structure) => structure[(i, j)],
            None => diagonal(i, j, omega[i] * omega[i]),
        };
        let dampers = |i: usize, j: usize| self.dampers.as_ref().map_or(0.0, |d| d[(i, j)]);
        let damping = |i: usize, j: usize| match (i < moving) == (j < moving) {
            true => diagonal(i, j, alpha) + beta * structure(i, j) + dampers(i, j),
            false => 0.0,
        };
        Operators {
            stiffness: match &self.forces {
                Some(f) => f.stiffness.clone(),
                None => Mat::from_fn(n, n, |i, j| diagonal(i, j, omega[i] * omega[i])),
            },
            damping: Mat::from_fn(n, n, damping),
            skew: self.forces.as_ref().and_then(|f| f.skew.clone()),
        }
    }
}

impl Deref for Spectrum {
    type Target = Eigenbasis;

    fn deref(&self) -> &Eigenbasis {
        &self.basis
    }
}

/// The complex modes of a phase with `Im λ ≥ 0`, those that grow fastest first.
pub fn complex_modes(system: &System, phase: &Phase) -> Result<Vec<ComplexMode>, FemError> {
    Ok(Spectrum::new(system, phase)?.complex_modes())
}

impl Spectrum {
    /// The eigensolution of a phase without held nodes.
    pub fn new(system: &System, phase: &Phase) -> Result<Self, FemError> {
        Self::damped(Rc::new(Eigenbasis::new(system, phase)?), system.damping)
    }

    /// The modes of a basis under a damping.
    fn damped(basis: Rc<Eigenbasis>, damping: Option<Rayleigh>) -> Result<Self, FemError> {
        let (alpha, beta) = damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
        let frozen = basis.stuck.velocities.len();
        let moving = basis.omega.len() - frozen;
        let mut steady_force = basis.constant.clone();
        steady_force.iter_mut().zip(&basis.stuck.drag).for_each(|(f, d)| *f -= alpha * d);
        let mixing = basis.mixing.as_ref();
        let dampers = mixing.and_then(|m| m.dampers.as_ref());
        let structure = mixing.and_then(|m| m.structure.as_ref());
        // what sticks to a moving surface moves what damps
        for (damps, c) in [(dampers, 1.0), (structure, beta)] {
            let Some(damps) = damps else { continue };
            for (s, v) in basis.stuck.velocities.iter().enumerate() {
                (0..moving).for_each(|i| steady_force[i] -= c * damps[(i, moving + s)] * v);
            }
        }
        let coupling = match &basis.mixing {
            Some(mixing) if mixing.couples(beta, moving) => {
                let scale = basis.scale();
                let operators = mixing.operators(&basis.omega, moving, (alpha, beta));
                let forces: Vec<&[f64]> = [&steady_force]
                    .into_iter()
                    .chain(&basis.harmonics)
                    .map(Vec::as_slice)
                    .collect();
                let slips = mixing.forces.as_ref().is_some_and(|f| f.skew.is_none());
                let apart = operators.leave_apart((basis.stuck.rigid, moving), alpha);
                let outer = (if apart { basis.stuck.rigid } else { 0 }, frozen);
                // rigid motions among the others are eigenvalues that vanish: what pushes one for good has no steady response
                let free = basis.omega[..moving].iter().take_while(|w| **w == 0.0).count();
                let pushed = largest(&steady_force[..free]) > PUSHED * largest(&steady_force);
                if outer.0 < free && (pushed || slips && free > 0) {
                    return Err(FemError::Dependent { size: basis.omega.len() });
                }
                let rows = basis.all_rows();
                let coupled = Coupled::new(operators, &scale, outer, alpha, rows, &forces)?;
                if slips && coupled.is_singular() {
                    return Err(FemError::Dependent { size: basis.omega.len() });
                }
                Some(coupled)
            }
            _ => None,
        };
        // what sticks keeps its velocity
        let by_dampers = |k: usize| dampers.map_or(0.0, |d| d[(k, k)]);
        let rate = |k: usize, omega: f64| match k < moving {
            true => alpha + beta * omega * omega + by_dampers(k),
            false => 0.0,
        };
        let mode = |(k, &omega): (usize, &f64)| Oscillator { omega, c: 0.5 * rate(k, omega) };
        let modes: Vec<Oscillator> = basis.omega.iter().enumerate().map(mode).collect();
        let is_undamped = modes.iter().all(|m| m.c == 0.0 && m.omega > 0.0);
        Ok(Spectrum { modes, damping, basis, is_undamped, coupling, steady_force })
    }

    /// Where springs of sliders begin to stick on the way into the phase, `z` is set so that their force is at its limit: of the first `k` columns, displacements, and of
    /// states with the limits, of perturbations without.
    pub(crate) fn remember(
        &self,
        system: &System,
        before: &States,
        (x, k): (&mut Mat<f64>, usize),
        is_state: bool,
    ) {
        for (memory, sigma, s) in self.begin_to_stick(system, before) {
            let slider = &system.sliders()[s];
            let stiffness = slider.elastic.map_or(1.0, |e| e.stiffness);
            let of_mode = |q: usize| {
                let shape = self.shapes.col_as_slice(q);
                slider.along(shape) - shape[memory]
            };
            let row: Vec<f64> = (0..self.shapes.ncols()).map(of_mode).collect();
            let limit = if is_state { sigma * slider.limit / stiffness } else { 0.0 };
            for c in 0..k {
                let change = dot(&row, x.col_as_slice(c)) - limit;
                let unit = self.inverse.col_as_slice(memory);
                x.col_as_slice_mut(c).iter_mut().zip(unit).for_each(|(x, u)| *x += change * u);
            }
        }
    }

    /// Displacements without mass along obstacles that do not stick in the phase `before` and, on the way into this one, begin to; at the end of a motion (`before` is this phase) all that
    /// do not stick: `z` is where they are.
    fn anchored<'a>(&'a self, before: &'a Spectrum) -> impl Iterator<Item = &'a Creep> {
        let is_end = before.states == self.states;
        let begins = move |c: &&Creep| is_end || self.states.at(c.point) == PointState::Stick;
        before.creep.iter().filter(|c| !c.sticks).filter(begins)
    }

    /// `row · Φ` of a displacement without mass.
    fn creep_row(&self, creep: &Creep) -> Vec<f64> {
        let of_mode = |q: usize| along(&creep.row, self.shapes.col_as_slice(q));
        (0..self.shapes.ncols()).map(of_mode).collect()
    }

    /// Set `z` of those: of the first `k` columns, displacements, of states with the constant parts, of perturbations without.
    pub(crate) fn anchor(&self, before: &Spectrum, (x, k): (&mut Mat<f64>, usize), is_state: bool) {
        for creep in self.anchored(before) {
            let row = self.creep_row(creep);
            let unit = self.inverse.col_as_slice(creep.memory);
            for c in 0..k {
                let own = x.col_as_slice(c);
                let now: f64 =
                    (0..row.len()).map(|q| self.shapes[(creep.memory, q)] * own[q]).sum();
                let constant = if is_state { creep.constant } else { 0.0 };
                let change = dot(&row, own) + constant - now;
                x.col_as_slice_mut(c).iter_mut().zip(unit).for_each(|(x, u)| *x += change * u);
            }
        }
    }

    /// By how much faster than where they will stick those are that begin to: `u̇⁻ − u̇⁺` of their `z`; nothing where none does.
    pub(crate) fn slides(&self, before: &Spectrum, v: &[f64]) -> Vec<f64> {
        let mut all = vec![];
        for creep in self.anchored(before) {
            all.resize(v.len(), 0.0);
            let rate = dot(&self.creep_row(creep), v) - creep.surface;
            let unit = self.inverse.col_as_slice(creep.memory);
            all.iter_mut().zip(unit).for_each(|(x, u)| *x += rate * u);
        }
        all
    }

    /// Whether displacements along obstacles have no mass.
    pub(crate) fn creeps(&self) -> bool {
        !self.creep.is_empty()
    }

    /// Give what only remembers its velocity, that of the surface where it sticks, in some columns, velocities: of states, or of perturbations, which have none. The body keeps its own.
    pub(crate) fn ride(&self, x: &mut Mat<f64>, columns: Range<usize>, is_state: bool) {
        for creep in &self.creep {
            let velocity = if is_state && creep.sticks { creep.surface } else { 0.0 };
            let unit = self.inverse.col_as_slice(creep.memory);
            for c in columns.clone() {
                let own = x.col_as_slice(c);
                let now: f64 =
                    (0..own.len()).map(|q| self.shapes[(creep.memory, q)] * own[q]).sum();
                let change = velocity - now;
                x.col_as_slice_mut(c).iter_mut().zip(unit).for_each(|(x, u)| *x += change * u);
            }
        }
    }

    /// The springs of sliders that slip before the phase and stick in it: the displacement that remembers, the direction of the slip, the slider.
    pub(crate) fn begin_to_stick(
        &self,
        system: &System,
        before: &States,
    ) -> Vec<(usize, f64, usize)> {
        let first = system.facing().len();
        let of_slider = |(s, slider): (usize, &Slider)| {
            let (elastic, point) = (slider.elastic?, first + s);
            let sigma = before.at(point).slip()?;
            let sticks = self.states.at(point) == PointState::Stick;
            sticks.then_some((elastic.memory, sigma, s))
        };
        system.sliders().iter().enumerate().filter_map(of_slider).collect()
    }

    /// `tr M_α⁻¹C_α`: the sum of the damping rates of all coordinates that move.
    pub(crate) fn trace_of_damping(&self) -> f64 {
        match &self.coupling {
            Some(coupling) => (0..self.frozen().start).map(|k| coupling.damping()[(k, k)]).sum(),
            None => self.modes.iter().map(|m| 2.0 * m.c).sum(),
        }
    }

    /// Of every free motion of the phase how fast it is, the modulus of its complex rate, and how fast it dies.
    pub(crate) fn rates(&self) -> Vec<(f64, f64)> {
        let own = |l: Complex<f64>| (l.norm(), -l.re);
        match &self.coupling {
            Some(coupling) => coupling.modes().lambda().iter().copied().map(own).collect(),
            None => self.modes.iter().flat_map(|m| m.roots()).map(own).collect(),
        }
    }

    /// Coordinates that never move in the phase, its last ones.
    pub(crate) fn frozen(&self) -> Range<usize> {
        let n = self.omega.len();
        n - self.stuck.velocities.len()..n
    }

    /// Columns `[Q | V]` on the way into the phase: what sticks has no velocity of its own, `δq̇ ← δq̇ + ΦᵀMΨ δq̇_s`, `δq̇_s ← 0`. The impulse that stops a point acts on all
    /// others through their inertia.
    pub(crate) fn hold(&self, b: &mut Mat<f64>, k: usize) {
        let inertia = &self.stuck.inertia;
        let moving = inertia.nrows();
        for c in k..2 * k {
            let (free, held) = b.col_as_slice_mut(c).split_at_mut(moving);
            for (s, v) in held.iter_mut().enumerate().filter(|_| inertia.ncols() > 0) {
                free.iter_mut().zip(inertia.col_as_slice(s)).for_each(|(f, m)| *f += m * *v);
                *v = 0.0;
            }
        }
    }

    /// The homogeneous flow over `tau` of columns `[Q | V]`, `k` of each, under the damping `C + αM`.
    pub fn carry(&self, b: &mut Mat<f64>, k: usize, tau: f64, alpha: f64) -> Result<(), FemError> {
        if let Some(coupling) = &self.coupling {
            let shifted = match alpha {
                0.0 => None,
                alpha => Some(coupling.shifted(alpha, &self.scale(), self.all_rows())?),
            };
            shifted.as_ref().unwrap_or(coupling).carry(b, k, tau);
            return Ok(());
        }
        let of_mode = |m: &Oscillator| {
            let m = Oscillator { c: m.c + 0.5 * alpha, ..*m };
            let x = m.basis(tau);
            [x.c, x.s, -m.omega * m.omega * x.s, x.ds]
        };
        let basis: Vec<[f64; 4]> = self.modes.iter().map(of_mode).collect();
        let (left, right) = b.as_mut().split_at_col_mut(k);
        for (q, v) in left.col_iter_mut().zip(right.col_iter_mut()) {
            for ((q, v), [c, s, ws, ds]) in q.iter_mut().zip(v.iter_mut()).zip(&basis) {
                (*q, *v) = (c * *q + s * *v, ws * *q + ds * *v);
            }
        }
        Ok(())
    }

    /// `r q(τ)` by `q` and by `q̇` at the start, then `r q̇(τ)` likewise, of a row `r`.
    pub(crate) fn row_carried(&self, r: &[f64], tau: f64) -> [Vec<f64>; 4] {
        if let Some(coupling) = &self.coupling {
            return coupling.modes().row_carried(r, tau);
        }
        let mut all = [0; 4].map(|_| Vec::with_capacity(r.len()));
        for (m, r) in self.modes.iter().zip(r) {
            let x = m.basis(tau);
            let parts = [x.c, x.s, -m.omega * m.omega * x.s, x.ds];
            all.iter_mut().zip(parts).for_each(|(a, p)| a.push(r * p));
        }
        all
    }

    /// The steady response to the constant and the harmonic loads at `t = 0`, where natural modes do not decouple the phase: `q`, then `q̇`.
    pub(crate) fn coupled_response(&self, loads: &Loads) -> Option<Vec<f64>> {
        let coupling = self.coupling.as_ref()?;
        let n = self.modes.len();
        let still = vec![0.0; n];
        let motion = SlidingMotion::new(coupling, &still, &still, &motion::angles(loads, 0.0));
        Some(motion.map_or_else(|| vec![f64::NAN; 2 * n], |m| m.response(coupling)))
    }

    /// `ΦᵀCΦ`, where it is not diagonal.
    pub fn damping_matrix(&self) -> Option<&Mat<f64>> {
        self.coupling.as_ref().map(Coupled::damping)
    }

    /// `α` and `β` of the damping.
    pub(super) fn rayleigh(&self) -> (f64, f64) {
        self.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta))
    }

    /// `vᵀΦᵀCΦ v` of velocities in the coordinates of the phase, those of what sticks included.
    pub(super) fn dissipation(&self, v: &[f64]) -> f64 {
        let ((alpha, beta), stuck) = (self.rayleigh(), &self.stuck);
        let moving = self.omega.len() - stuck.velocities.len();
        let [mass, stiffness] = stuck.squares;
        let by_mass = dot(&v[..moving], &v[..moving]) + 2.0 * dot(&stuck.drag, v) + mass;
        let along =
            |d: &Mat<f64>| -> f64 { (0..v.len()).map(|j| v[j] * dot(d.col_as_slice(j), v)).sum() };
        let mixing = self.mixing.as_ref();
        let by_stiffness = match mixing.and_then(|m| m.structure.as_ref()) {
            Some(structure) => along(structure),
            None => {
                let own = self.omega[..moving].iter().zip(v).map(|(w, v)| (w * v).powi(2));
                own.sum::<f64>() + stiffness
            }
        };
        let dampers = mixing.and_then(|m| m.dampers.as_ref()).map_or(0.0, along);
        alpha * by_mass + beta * by_stiffness + dampers
    }

    /// `β` of the damping.
    pub(super) fn stiffness_damping(&self) -> f64 {
        self.rayleigh().1
    }

    /// The largest rate at which a mode of a coupled phase grows; zero where none does.
    pub(super) fn growth(&self) -> f64 {
        let of_modes = self.coupling.iter().flat_map(|c| c.modes().lambda());
        of_modes.fold(0.0, |m, l| m.max(l.re))
    }

    /// [`complex_modes`]
    fn complex_modes(&self) -> Vec<ComplexMode> {
        let n = self.modes.len();
        let whole = |q: &[Complex<f64>]| -> Vec<Complex<f64>> {
            let of = |i: usize| q.iter().enumerate().map(|(k, q)| q * self.shapes[(i, k)]).sum();
            (0..n).map(of).collect()
        };
        let mut all: Vec<ComplexMode> = match &self.coupling {
            Some(coupled) => coupled
                .complex_modes()
                .into_iter()
                .map(|(lambda, q)| ComplexMode { lambda, shape: whole(&q) })
                .collect(),
            None => self.natural_modes(),
        };
        all.sort_by(|a, b| {
            let key = |m: &ComplexMode| (-m.lambda.re, m.lambda.im);
            key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
        });
        all
    }

    /// Those of modes that damping does not couple; of what moves.
    fn natural_modes(&self) -> Vec<ComplexMode> {
        let moving = self.modes.len() - self.stuck.velocities.len();
        let mut all = vec![];
        for (k, m) in self.modes.iter().enumerate().take(moving).filter(|(_, m)| m.omega > 0.0) {
            let shape: Vec<_> =
                self.shapes.col_as_slice(k).iter().map(|x| Complex::from(*x)).collect();
            let root = Complex::from(m.c * m.c - m.omega * m.omega).sqrt();
            let sides = [root - m.c, -root - m.c];
            let kept = sides.into_iter().filter(|l| l.im > 0.0 || root.im == 0.0);
            all.extend(kept.map(|lambda| ComplexMode { lambda, shape: shape.clone() }));
        }
        all
    }

    /// Whether work and dissipation are summed over points in time: friction takes energy, a moving surface brings it, or rigid motions stand beside coupled modes.
    pub(super) fn sums_powers(&self) -> bool {
        let slips = (0..self.states.len()).any(|i| self.states.at(i).slip().is_some());
        let stands_beside = self.coupling.as_ref().is_some_and(|c| c.has_rigid());
        slips || stands_beside || self.stuck.velocities.iter().any(|v| *v != 0.0)
    }

    /// Whether the modes by themselves are the motions of the phase.
    pub fn is_decoupled(&self) -> bool {
        self.coupling.is_none()
    }
}

impl Eigenbasis {
    fn new(system: &System, phase: &Phase) -> Result<Self, FemError> {
        let (_, m) = phase.matrices();
        let n = system.n_o();
        // forces without a potential have no natural modes: those of the body without them serve
        let symmetric = phase.symmetric_stiffness();
        let held = phase.stuck();
        let moving = n - held.len();
        let Shapes { omega, shapes, inverse } = match held.is_empty() {
            true => Shapes::natural(&symmetric, &m, system.units.frequency)?,
            false => {
                let rows: Vec<&[(usize, f64)]> = held.iter().map(|h| h.0).collect();
                let of_rows = Pivots::of(n, &rows).ok_or(FemError::Singular {
                    what: "matrix of what sticks: a slider there follows from others",
                })?;
                Shapes::beside(&of_rows, &symmetric, &m, system.units.frequency)?
            }
        };
        // modal forces: φᵀ A*ᵀ f, none on what sticks
        let projected = |f: &[f64]| -> Vec<f64> {
            let mut force = transposed(&shapes, f);
            force[moving..].fill(0.0);
            force
        };
        let constant = projected(&phase.constant_force());
        let count_loads = 0..system.loads.harmonics.len();
        let harmonics = count_loads.map(|k| projected(&phase.harmonic_force(k))).collect();
        let stuck = Stuck::of(system, phase, (&shapes, &omega), (&symmetric, &m));
        let count = phase.monitors.len();
        let mut rows = DMatrix::<f64>::zeros(count, n);
        let still = vec![0.0; n];
        let mut velocity_rows = phase.knows_velocities().then(|| rows.clone());
        for j in 0..n {
            let shape = shapes.col_as_slice(j);
            rows.column_mut(j).copy_from_slice(&phase.monitor_gradient_at(shape, &still));
            if let Some(rows) = &mut velocity_rows {
                rows.column_mut(j).copy_from_slice(&phase.monitor_gradient_at(&still, shape));
            }
        }
        let offsets = phase.monitor_offsets();
        let drives = phase.drives();
        let mixing = Mixing::of(phase, &shapes, &omega, moving);
        let defect = Defect::of(&symmetric, &omega, (&shapes, &inverse), moving);
        Ok(Eigenbasis {
            defect,
            velocity_rows,
            stuck,
            creep: phase.creep(),
            mixing,
            unit: system.units.frequency,
            drives,
            omega,
            shapes,
            inverse,
            constant,
            harmonics,
            states: phase.set.clone(),
            monitors: phase.monitors.clone(),
            rows,
            offsets,
        })
    }

    /// The gradients of the monitors over displacements and velocities.
    pub(super) fn all_rows(&self) -> Rows<'_> {
        (&self.rows, self.velocity_rows.as_ref())
    }

    /// Natural frequencies, the body's unit in place of zero.
    pub fn scale(&self) -> Vec<f64> {
        self.omega.iter().map(|&w| if w > 0.0 { w } else { self.unit }).collect()
    }

    /// What harmonic loads on `u_C` add to the monitors, at their present frequencies.
    pub(crate) fn drives(&self, loads: &Loads) -> Drives {
        let mut drives = self.drives.clone();
        drives.iter_mut().for_each(|d| d.load = loads.harmonics[d.index].clone());
        Drives::harmonic(drives)
    }

    /// `∇h Φ` of one monitor: over displacements, and over velocities, if it knows any.
    pub(crate) fn row(&self, monitor: usize) -> [Vec<f64>; 2] {
        let of = |m: &DMatrix<f64>| m.row(monitor).iter().copied().collect();
        [of(&self.rows), self.velocity_rows.as_ref().map_or(vec![], of)]
    }

    /// `q = ΦᵀM_α u`, `q̇ = ΦᵀM_α v`: `x` and the result hold displacements, then velocities.
    pub fn to_modes(&self, x: &[f64], q: &mut [f64]) {
        product(&self.inverse, x, q);
    }

    /// The root of twice the unit of energy: the least `ω_k q_k` of a mode of the open body that moves a contact point by the unit of length. Modal
    /// coordinates have a root of a mass in them, which the units of the system do not know.
    pub(crate) fn root_of_energy(&self, system: &System) -> f64 {
        let of_mode = |(k, w): (usize, f64)| {
            w * system.units.length / system.reach(self.shapes.col_as_slice(k))
        };
        self.scale().into_iter().enumerate().map(of_mode).fold(f64::INFINITY, f64::min)
    }

    /// `u = Φ q`, `v = Φ q̇`, likewise.
    pub(crate) fn state_of_modes(&self, q: &[f64], x: &mut [f64]) {
        product(&self.shapes, q, x);
    }
}

/// Coordinates of a phase: frequencies, `Φ`, and its inverse.
struct Shapes {
    omega: Vec<f64>,
    shapes: Mat<f64>,
    inverse: Mat<f64>,
}

impl Shapes {
    /// Natural modes.
    fn natural(k: &Csr, m: &Csr, unit: f64) -> Result<Shapes, FemError> {
        let n = m.n_rows();
        let all = eigen::all(k, m, unit)?;
        let shapes = Mat::from_fn(n, n, |i, j| all.shapes[j][i]);
        Ok(Shapes { inverse: times_mass(&shapes, m), omega: all.omega, shapes })
    }

    /// Natural modes of the displacements that move, then `Ψ = [−K_ff⁻¹K_fs; I]` of what sticks, all of these in units of the rows that hold it.
    fn beside(held: &Pivots, k: &Csr, m: &Csr, unit: f64) -> Result<Shapes, FemError> {
        let [k, m] = &[k, m].map(|a| held.congruence(a).map_or(Cow::Borrowed(a), Cow::Owned));
        let (n, sticks) = (m.n_rows(), &held.pivots);
        let free = held.others(n);
        let moving = free.len();
        let (k_ff, m_ff) = (k.among(&free), m.among(&free));
        let own = Shapes::natural(&k_ff, &m_ff, unit)?;
        let mut shapes = Mat::<f64>::zeros(n, n);
        let mut inverse = Mat::<f64>::zeros(n, n);
        for q in 0..moving {
            for (p, &i) in free.iter().enumerate() {
                shapes[(i, q)] = own.shapes[(p, q)];
                inverse[(q, i)] = own.inverse[(q, p)];
            }
        }
        for (s, &j) in sticks.iter().enumerate() {
            let column: Vec<f64> =
                free.iter().map(|&i| k.entry(i, j).copied().unwrap_or(0.0)).collect();
            // a rigid motion of what moves leaves what sticks without force
            let along = transposed(&own.shapes, &column);
            let weight = |q: usize| match own.omega[q] {
                w if w > 0.0 => along[q] / (w * w),
                _ => 0.0,
            };
            shapes[(j, moving + s)] = 1.0;
            inverse[(moving + s, j)] = 1.0;
            for q in 0..moving {
                let c = weight(q);
                inverse[(q, j)] = c;
                for (p, &i) in free.iter().enumerate() {
                    shapes[(i, moving + s)] -= c * own.shapes[(p, q)];
                }
            }
        }
        for (s, scale) in held.scale.iter().enumerate() {
            shapes.col_as_slice_mut(moving + s).iter_mut().for_each(|x| *x /= scale);
            (0..n).for_each(|j| inverse[(moving + s, j)] *= scale);
        }
        (0..n).for_each(|q| held.forth(shapes.col_as_slice_mut(q)));
        let mut row = vec![0.0; n];
        for q in 0..n {
            row.iter_mut().enumerate().for_each(|(j, x)| *x = inverse[(q, j)]);
            held.over(&mut row);
            row.iter().enumerate().for_each(|(j, x)| inverse[(q, j)] = *x);
        }
        let mut omega = own.omega;
        omega.resize(n, 0.0);
        Ok(Shapes { omega, shapes, inverse })
    }
}

impl Stuck {
    fn of(
        system: &System,
        phase: &Phase,
        (shapes, omega): (&Mat<f64>, &[f64]),
        (k, m): (&Csr, &Csr),
    ) -> Stuck {
        if !phase.rubs() {
            return Stuck {
                velocities: vec![],
                inertia: Mat::new(),
                drag: vec![],
                squares: [0.0; 2],
                rigid: 0,
                loads: vec![],
            };
        }
        let n = omega.len();
        let velocities: Vec<f64> = phase.stuck().iter().map(|h| h.1).collect();
        let moving = n - velocities.len();
        let mut carried = vec![0.0; n];
        for (s, v) in velocities.iter().enumerate() {
            let shape = shapes.col_as_slice(moving + s);
            carried.iter_mut().zip(shape).for_each(|(c, x)| *c += v * x);
        }
        // what only remembers has no inertia of the body's
        let mut heavy = carried.clone();
        phase.remembers().into_iter().for_each(|z| heavy[z] = 0.0);
        let mut pulled = vec![0.0; n];
        m.mul(&heavy, &mut pulled);
        let mut inertia = Mat::zeros(moving, velocities.len());
        let mut drag = vec![0.0; n];
        let mut column = vec![0.0; n];
        for (s, v) in velocities.iter().enumerate() {
            m.mul(shapes.col_as_slice(moving + s), &mut column);
            let along = &transposed(shapes, &column)[..moving];
            inertia.col_as_slice_mut(s).copy_from_slice(along);
            drag.iter_mut().zip(along).for_each(|(d, a)| *d += v * a);
        }
        let of_load = |h: &Harmonic| transposed(shapes, &phase.reduce(&h.force));
        Stuck {
            squares: [dot(&heavy, &pulled), k.quadratic(&carried)],
            rigid: omega[..moving].iter().take_while(|w| **w == 0.0).count(),
            loads: system.loads.harmonics.iter().map(of_load).collect(),
            velocities,
            inertia,
            drag,
        }
    }
}

/// `ΦᵀM`; a mass that is full (of a reduced body) is multiplied as such.
fn times_mass(shapes: &Mat<f64>, m: &Csr) -> Mat<f64> {
    let n = m.n_rows();
    let mut inverse = Mat::<f64>::zeros(n, n);
    if m.n_entries() > n * n / 8 {
        let mut full = Mat::<f64>::zeros(n, n);
        m.triplets().for_each(|(i, j, v)| full[(i, j)] = v);
        let (left, right) = (shapes.transpose(), full.as_ref());
        matmul(inverse.as_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
        return inverse;
    }
    let mut column = vec![0.0; n];
    for j in 0..n {
        m.mul(shapes.col_as_slice(j), &mut column);
        column.iter().enumerate().for_each(|(i, &x)| inverse[(j, i)] = x);
    }
    inverse
}

/// Bytes of the eigenbases that are kept: fine meshes visit hundreds of phases.
const BUDGET: usize = 512 << 20;

/// The spectra of the phases of one body, computed when they are first asked for; the least recently used go when there are too many.
#[derive(Debug)]
pub struct Spectra {
    known: RefCell<Cache<States, Rc<Spectrum>>>,
    computed: Cell<u64>,
}

impl Default for Spectra {
    fn default() -> Self {
        Spectra { known: RefCell::new(Cache::new(BUDGET)), computed: Cell::new(0) }
    }
}

impl Spectra {
    /// The spectrum of a phase.
    pub fn of(&self, system: &System, phase: &Phase) -> Result<Rc<Spectrum>, FemError> {
        if let Some(known) = self.known(system, &phase.set)? {
            return Ok(known);
        }
        let new = Rc::new(Spectrum::new(system, phase)?);
        self.computed.set(self.computed.get() + 1);
        let matrices = if new.is_decoupled() { 2 } else { 12 };
        let bytes = 8 * matrices * new.shapes.nrows() * new.shapes.ncols();
        self.known.borrow_mut().insert(phase.set.clone(), new.clone(), bytes);
        Ok(new)
    }

    /// What is known of an active set, under the present damping.
    fn known(&self, system: &System, set: &States) -> Result<Option<Rc<Spectrum>>, FemError> {
        let mut known = self.known.borrow_mut();
        let Some(spectrum) = known.get_mut(set) else { return Ok(None) };
        if spectrum.damping != system.damping {
            *spectrum = Rc::new(Spectrum::damped(spectrum.basis.clone(), system.damping)?);
        }
        Ok(Some(spectrum.clone()))
    }

    /// The spectrum of an active set.
    pub(crate) fn of_set(&self, system: &System, set: &States) -> Result<Rc<Spectrum>, FemError> {
        if let Some(known) = self.known(system, set)? {
            return Ok(known);
        }
        self.of(system, &system.phase(set))
    }

    /// Number of eigensolutions so far.
    pub fn computed(&self) -> u64 {
        self.computed.get()
    }
}
