//! What all phases share at the contact: the directions on which they differ, and the operators of each phase on them.
//!
//! In the mass matrix `M₀` of the open phase let `B R⁻¹ = M₀ L` be its directions made orthonormal, `LᵀM₀L = I`: with the modes `Φ` of the open phase `Q = ΦᵀM₀L` and
//! `L = ΦQ`. A phase needs of a displacement `u_O` only `y₁ = LᵀM₀u_O = Qᵀq`, and in the acceleration form `y₂ = LᵀK₀u_O = QᵀΩ²q` too.
//!
//! What rubs has components of its own behind these, its displacement among the projections and its force among the terms ([`super::rubbing`]).

use std::borrow::Cow;
use std::cell::{OnceCell, RefCell};
use std::rc::Rc;

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::HbmError;
use super::rub::{self, Rub};
use super::series::{Basis, Polynomial, Series};
use crate::contact::lcp::UNITS;
use crate::contact::{Added, Drive, Monitor, MonitorKind, Phase, States, System};
use crate::continuation::dot;
use crate::fem::{Csr, Loads};
use crate::flow::cache::Cache;

/// What is projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// `A*ᵀ(M A* ü_O + C A* u̇_O + K(A*u_O + d*) − f)`: the seed's eq. 7.
    Force,
    /// `ü_O + M_α⁻¹(C_α u̇_O + K_α u_O − f_α)`.
    Acceleration,
}

impl Form {
    /// The form in which a body's equations are projected: with springs of the obstacle, which do not touch the inertia, both are one; the second projection knows neither dampers
    /// nor what rubs.
    pub(super) fn of(self, system: &System) -> Form {
        let is_plain = system.dampers.is_none() && system.tangents().is_none();
        if system.contact_has_inertia() || !is_plain { Form::Force } else { self }
    }
}

/// One phase on the reduced directions: `n = P y + V ẏ + A ÿ − s − Σ_j (c_j cos + …)` with `V = αA + βP`.
#[derive(Debug)]
pub struct PhaseOperator {
    /// Acting on `y = (y₁, y₂)` of the contact's directions.
    pub p: Mat<f64>,
    /// `(α, β)`, zero where the phase adds nothing that damps.
    pub damping: (f64, f64),
    /// Acting on `d²y/dt²`.
    pub a: Option<Mat<f64>>,
    /// Constant part.
    pub s: Vec<f64>,
    /// Parts of the harmonic loads: amplitude of each load.
    pub loads: Vec<Vec<f64>>,
    /// The monitors of the phase.
    pub monitors: Vec<Monitor>,
    /// A column a monitor, over `y₁`.
    pub gradients: Mat<f64>,
    /// Monitors at `u_O = 0`.
    pub offsets: Vec<f64>,
    /// What harmonic loads on `u_C` add to them.
    pub drives: Vec<Drive>,
    /// What the unit of length makes of each: a length, or a pressure.
    pub units: Vec<f64>,
}

impl PhaseOperator {
    /// Whether it acts on `dy/dt`.
    pub(crate) fn is_damped(&self) -> bool {
        self.damping != (0.0, 0.0)
    }

    /// What it takes of the memory.
    fn bytes(&self) -> usize {
        let of = |m: &Mat<f64>| 8 * m.nrows() * m.ncols();
        let all = [Some(&self.p), self.a.as_ref(), Some(&self.gradients)];
        all.into_iter().flatten().map(of).sum()
    }

    /// The part of monitor `k` that does not depend on the motion, in the function of this index (constant, `cos θ`, `sin θ`, …).
    pub(crate) fn monitor_constant(&self, k: usize, function: usize, loads: &Loads) -> f64 {
        let driven = |of_phase: &dyn Fn(f64) -> f64| -> f64 {
            let drives = self.drives.iter();
            let part = |d: &Drive| {
                let load = &loads.harmonics[d.index];
                load.size() * d.monitor[k] * of_phase(load.angle())
            };
            drives.map(part).sum()
        };
        // cos(θ + φ) = cos φ cos θ − sin φ sin θ
        match function {
            0 => self.offsets[k],
            1 => driven(&f64::cos),
            2 => driven(&|phase| -phase.sin()),
            _ => 0.0,
        }
    }
}

/// Bytes of the phases that are kept: fine meshes visit hundreds of them.
const BUDGET: usize = 1 << 30;

/// A body in contact, as its harmonic balance sees the contact.
pub struct Interface {
    /// Operators.
    pub system: System,
    /// Force or acceleration form.
    pub form: Form,
    /// Cosine series or full.
    pub basis: Basis,
    /// What rubs.
    pub(super) rubs: Vec<Rub>,
    /// Number of components of a series.
    rank: usize,
    /// `L`, a column a direction of the contact.
    lifted: Mat<f64>,
    /// Displacements that the contact conditions look at.
    near: Vec<usize>,
    /// What phases add to the open one, where that is told without their matrices.
    added: Option<Added>,
    /// `K₀` and `M₀`, where they are asked for.
    open: OnceCell<(Csr, Csr)>,
    /// `Lᵀf` of the constant force, and of each harmonic load, on the open phase.
    pub(super) forces: (Vec<f64>, Vec<Vec<f64>>),
    phases: RefCell<Cache<States, Rc<PhaseOperator>>>,
}

/// Directions shorter than this, over their length before they were made orthogonal to others, are rounding errors.
const RANK: f64 = 1e-10;

/// Of pairs `(b, M⁻¹b)` a basis `(b, x)` of their span with `b_iᵀx_j = δ_ij` (Gram and Schmidt, twice).
fn orthonormal(pairs: impl Iterator<Item = (Vec<f64>, Vec<f64>)>) -> Vec<(Vec<f64>, Vec<f64>)> {
    let mut basis: Vec<(Vec<f64>, Vec<f64>)> = vec![];
    for (mut b, mut x) in pairs {
        let first = dot(&b, &x).sqrt();
        for _ in 0..2 {
            for (of_b, of_x) in &basis {
                let d = dot(of_b, &x);
                b.iter_mut().zip(of_b).for_each(|(b, o)| *b -= d * o);
                x.iter_mut().zip(of_x).for_each(|(x, o)| *x -= d * o);
            }
        }
        let rest = dot(&b, &x).max(0.0).sqrt();
        if rest > RANK * first {
            b.iter_mut().for_each(|b| *b /= rest);
            x.iter_mut().for_each(|x| *x /= rest);
            basis.push((b, x));
        }
    }
    basis
}

/// The directions `(b, M₀⁻¹b)` of all components of a series.
pub(super) struct Directions {
    pub pairs: Vec<(Vec<f64>, Vec<f64>)>,
    /// So many are those of the contact, orthonormal; the others are those of what rubs.
    pub contact: usize,
    pub rubs: Vec<Rub>,
}

impl Directions {
    /// `pair` makes `(b, M₀⁻¹b)` of the entries of `b`, or both in coordinates in which the mass is one.
    pub fn new(
        system: &System,
        mut pair: impl FnMut(&[(usize, f64)]) -> (Vec<f64>, Vec<f64>),
    ) -> Directions {
        let mut pairs = orthonormal(system.directions().iter().map(|column| pair(column)));
        let contact = pairs.len();
        let rubs = rub::all(system, |row| {
            let (mut b, mut x) = pair(row);
            let scale = dot(&b, &x).sqrt();
            b.iter_mut().chain(&mut x).for_each(|b| *b /= scale);
            pairs.push((b, x));
            (pairs.len() - 1, scale)
        });
        Directions { pairs, contact, rubs }
    }

    /// `L` of the contact, made of the second of each pair.
    pub fn lifted(&self) -> Mat<f64> {
        let n = self.pairs.first().map_or(0, |(_, x)| x.len());
        Mat::from_fn(n, self.contact, |i, c| self.pairs[c].1[i])
    }
}

/// `Bᵀ A B` for a sparse `A` of few rows.
fn congruence(a: &Csr, b: &Mat<f64>) -> Mat<f64> {
    let rows: Vec<usize> = (0..a.n_rows()).filter(|&i| a.row(i).next().is_some()).collect();
    let ab = Mat::from_fn(rows.len(), b.ncols(), |i, c| a.row_dot(rows[i], b.col_as_slice(c)));
    let of_rows = Mat::from_fn(b.ncols(), rows.len(), |c, i| b[(rows[i], c)]);
    of_rows * ab
}

/// `Lᵀ x`
fn onto(lifted: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    (0..lifted.ncols()).map(|c| dot(lifted.col_as_slice(c), x)).collect()
}

impl Interface {
    /// The interface of a body whose directions of the contact are `lifted` (`L`); the series is a cosine series for an undamped body without friction and harmonic loads.
    pub(super) fn new(
        system: System,
        form: Form,
        lifted: Mat<f64>,
        directions: Directions,
    ) -> Interface {
        let open = system.open_phase();
        let constant = onto(&lifted, &open.constant_force());
        let loads = system.loads.harmonics.iter();
        let harmonics = loads.map(|h| onto(&lifted, &open.reduce(&h.force))).collect();
        let takes = system.is_damped() || system.tangents().is_some();
        let full = takes || !system.loads.harmonics.is_empty();
        let basis = if full { Basis::Full } else { Basis::Cosine };
        let phases = RefCell::new(Cache::new(BUDGET));
        let mut near: Vec<usize> = system.directions().iter().flatten().map(|e| e.0).collect();
        near.sort_unstable();
        near.dedup();
        let added = Added::new(&system, &lifted);
        let forces = (constant, harmonics);
        let (rank, rubs) = (directions.pairs.len(), directions.rubs);
        Interface {
            system,
            form,
            basis,
            rubs,
            rank,
            lifted,
            near,
            added,
            open: OnceCell::new(),
            forces,
            phases,
        }
    }

    /// Whether anything rubs.
    pub(super) fn rubs(&self) -> bool {
        !self.rubs.is_empty()
    }

    /// Whether the force of something that rubs is an unknown.
    pub(super) fn has_unknown_forces(&self) -> bool {
        self.rubs.iter().any(Rub::is_unknown)
    }

    /// Number of components of a series, `r`: directions of the contact, and of what rubs.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Number of projections of a displacement: `r` in the force form, `2r` in the acceleration form.
    pub fn rank_in(&self) -> usize {
        self.rank() * if self.form == Form::Force { 1 } else { 2 }
    }

    /// `(α, β)`, zero without damping.
    pub(super) fn damping(&self) -> (f64, f64) {
        self.system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta))
    }

    /// Set the frequency of the harmonic loads.
    pub fn set_frequency(&mut self, omega: f64) {
        self.system.loads_mut().set_frequency(omega);
    }

    /// A displacement `u_O` with the projections `y`, as far as the contact conditions look at it: they cannot tell it from any other.
    pub(crate) fn representative(&self, y: &[f64]) -> Vec<f64> {
        let mut u = vec![0.0; self.lifted.nrows()];
        for (c, y) in y[..self.lifted.ncols()].iter().enumerate() {
            let lifted = self.lifted.col_as_slice(c);
            self.near.iter().for_each(|&i| u[i] += y * lifted[i]);
        }
        u
    }

    /// `Lᵀ(K_α − K_∅)L` and `Lᵀ(M_α − M_∅)L`
    fn added(&self, phase: &Phase) -> [Mat<f64>; 2] {
        let lifted = &self.lifted;
        if let Some(added) = self.added.as_ref().and_then(|added| added.of(phase, lifted)) {
            return added;
        }
        let (k, m) = phase.matrices();
        let (k0, m0) = self.open.get_or_init(|| self.system.open_phase().matrices());
        [(&k, k0), (&m, m0)]
            .map(|(a, open)| congruence(&Csr::combination(1.0, a, -1.0, open), lifted))
    }

    /// Monitor `k` of a phase along a series of projections.
    pub(super) fn monitor(&self, phase: &PhaseOperator, k: usize, y: &Series) -> Polynomial {
        Polynomial::new(y.basis, y.n_h, &self.monitor_coefficients(phase, k, y))
    }

    /// The same, as coefficients.
    pub(super) fn monitor_coefficients(
        &self,
        phase: &PhaseOperator,
        k: usize,
        y: &Series,
    ) -> Vec<f64> {
        let of_function = |f: usize| {
            let along = y.of(f).iter().zip(phase.gradients.col_as_slice(k));
            let dot: f64 = along.map(|(y, g)| g * y).sum();
            dot + phase.monitor_constant(k, f, &self.system.loads)
        };
        (0..y.basis.len(y.n_h)).map(of_function).collect()
    }

    /// What a set says of the contact alone: nothing sticks, slides or is a slider.
    pub(super) fn contact_of(&self, set: &States) -> States {
        let facing = self.system.facing().len();
        States::of_contact((0..set.len()).map(|i| i < facing && set.touches(i)))
    }

    /// A phase of the contact on the reduced directions.
    pub fn phase(&self, set: &States) -> Result<Rc<PhaseOperator>, HbmError> {
        // where nothing rubs a set says nothing but the contact
        let set = match self.rubs() {
            true => Cow::Owned(self.contact_of(set)),
            false => Cow::Borrowed(set),
        };
        let set = &*set;
        if let Some(known) = self.phases.borrow_mut().get_mut(set) {
            return Ok(known.clone());
        }
        let new = Rc::new(self.build(set)?);
        self.phases.borrow_mut().insert(set.clone(), new.clone(), new.bytes());
        Ok(new)
    }

    fn build(&self, set: &States) -> Result<PhaseOperator, HbmError> {
        let system = &self.system;
        let phase = system.phase(set);
        let [s_k, s_m] = self.added(&phase);
        let r = self.lifted.ncols();
        // A*ᵀ x on the reduced directions, less that of the open phase
        let open = system.open_phase();
        let difference = |a: Vec<f64>, b: Vec<f64>| -> Vec<f64> {
            // phases differ on few displacements
            let x = a.iter().zip(&b).map(|(a, b)| a - b).enumerate();
            let entries: Vec<(usize, f64)> = x.filter(|(_, x)| *x != 0.0).collect();
            let on = |c: usize| entries.iter().map(|&(i, x)| self.lifted[(i, c)] * x).sum();
            (0..r).map(on).collect()
        };
        let s = difference(phase.constant_force(), open.constant_force());
        let loads: Vec<Vec<f64>> = system
            .loads
            .harmonics
            .iter()
            .map(|h| difference(phase.reduce(&h.force), open.reduce(&h.force)))
            .collect();
        let (alpha, beta) = self.damping();
        // the gradients of all monitors lie among the directions
        let along: Vec<Vec<f64>> =
            (0..r).map(|c| phase.monitor_gradient_at(self.lifted.col_as_slice(c), &[])).collect();
        let gradients = Mat::from_fn(r, phase.monitors.len(), |c, k| along[c][k]);
        let offsets = phase.monitor_offsets();
        let drives = phase.drives();
        let length = system.units.length;
        let of_length = |(m, rounding): (&Monitor, f64)| match m.kind {
            MonitorKind::Pressure => rounding / UNITS,
            _ => length,
        };
        let monitors = phase.monitors.clone();
        let units =
            phase.monitors.iter().zip(phase.monitor_rounding(length, 0.0)).map(of_length).collect();
        let (p, a, damping, s, loads) = match self.form {
            Form::Force => {
                // springs of the obstacle neither damp nor have inertia
                let springs = system.contact_has_inertia();
                let damping = if springs { (0.0, 0.0) } else { (alpha, beta) };
                (s_k, (!springs).then_some(s_m), damping, s, loads)
            }
            Form::Acceleration => {
                // M_α⁻¹ = I − Q T Qᵀ,  T = (I + S)⁻¹ S
                let identity = Mat::<f64>::identity(r, r);
                let t = (&identity + &s_m).partial_piv_lu().solve(&s_m);
                if (0..r).any(|i| !t[(i, i)].is_finite()) {
                    return Err(HbmError::Singular);
                }
                let keep = &identity - &t;
                // M_α⁻¹(K_α u) − M₀⁻¹(K₀ u) on Q: (I − T) S_K y₁ − T y₂
                let mut p = Mat::<f64>::zeros(r, 2 * r);
                p.subcols_mut(0, r).copy_from(&keep * &s_k);
                p.subcols_mut(r, r).copy_from(-&t);
                let damping = (0.0, beta.max(0.0));
                // (I − T)(−Δf) + T Qᵀ f₀, written as −s
                let lift = |difference: &[f64], of_open: &[f64]| -> Vec<f64> {
                    let column = |x: &[f64]| Mat::from_fn(x.len(), 1, |i, _| x[i]);
                    let x = &keep * column(difference);
                    let y = &t * column(of_open);
                    (0..r).map(|i| x[(i, 0)] - y[(i, 0)]).collect()
                };
                let (constant, harmonics) = &self.forces;
                let s = lift(&s, constant);
                let loads = loads.iter().zip(harmonics).map(|(d, f0)| lift(d, f0)).collect();
                (p, None, damping, s, loads)
            }
        };
        Ok(PhaseOperator { p, damping, a, s, loads, monitors, gradients, offsets, drives, units })
    }
}
