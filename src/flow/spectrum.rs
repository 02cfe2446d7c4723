//! The eigenbasis of one active set (theory §6); the motion of its modes is in [`super::motion`].
//!
//! In the eigenbasis of `(K_α, M_α)` a phase decouples, `q̈ + 2c q̇ + ω² q = F₀ + Σ_j F_j cos(Ω_j t + φ_j)` with `2c = α + βω²`, and each
//! coordinate is known at every time to rounding error: under- and over-damped, constant and harmonic loads
//! through resonance, rigid motions (`ω = 0`). The basis does not depend on the frequencies of the loads.

use std::cell::{Cell, RefCell};
use std::ops::Deref;
use std::rc::Rc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::DMatrix;

use super::cache::Cache;
use super::drives::Drives;
use super::oscillator::Oscillator;
use crate::contact::{ActiveSet, Drive, Phase, Rayleigh, System};
use crate::fem::{Csr, FemError, Loads, eigen};

/// The eigenbasis of one active set with its loads, and its modes under the damping of the time when they were asked for.
#[derive(Debug)]
pub struct Spectrum {
    /// The modes, lowest first.
    pub modes: Vec<Oscillator>,
    damping: Option<Rayleigh>,
    basis: Rc<Eigenbasis>,
    /// Undamped, without rigid motions.
    pub(super) is_undamped: bool,
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
    /// `r = ∇h Φ`, one row a monitor (in the order of the contact nodes).
    pub rows: DMatrix<f64>,
    /// Monitors at `u_O = 0`.
    pub offsets: Vec<f64>,
    /// What harmonic loads on `u_C` add to the monitors, at the frequencies of the time when this was made.
    drives: Vec<Drive>,
}

impl Deref for Spectrum {
    type Target = Eigenbasis;

    fn deref(&self) -> &Eigenbasis {
        &self.basis
    }
}

impl Spectrum {
    /// The eigensolution of a phase without held nodes.
    pub fn new(system: &System, phase: &Phase) -> Result<Self, FemError> {
        Ok(Self::damped(Rc::new(Eigenbasis::new(system, phase)?), system.damping))
    }

    /// The modes of a basis under a damping.
    fn damped(basis: Rc<Eigenbasis>, damping: Option<Rayleigh>) -> Self {
        let (alpha, beta) = damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
        let mode = |&omega: &f64| Oscillator { omega, c: 0.5 * (alpha + beta * omega * omega) };
        let modes: Vec<Oscillator> = basis.omega.iter().map(mode).collect();
        let is_undamped = modes.iter().all(|m| m.c == 0.0 && m.omega > 0.0);
        Spectrum { modes, damping, basis, is_undamped }
    }
}

impl Eigenbasis {
    fn new(system: &System, phase: &Phase) -> Result<Self, FemError> {
        let (k, m) = phase.matrices();
        let n = system.n_o();
        let all = eigen::all(&k, &m, system.units.frequency)?;
        let shapes = Mat::from_fn(n, n, |i, j| all.shapes[j][i]);
        let inverse = times_mass(&shapes, &m);
        // modal forces: φᵀ A*ᵀ f
        let projected = |f: &[f64]| -> Vec<f64> {
            all.shapes.iter().map(|x| x.iter().zip(f).map(|(a, b)| a * b).sum()).collect()
        };
        let constant = projected(&phase.constant_force());
        let harmonics =
            system.loads.harmonics.iter().map(|h| projected(&phase.reduce(&h.force))).collect();
        let count = phase.monitors.len();
        let mut rows = DMatrix::<f64>::zeros(count, n);
        for (j, shape) in all.shapes.iter().enumerate() {
            let h = phase.monitor_gradient_at(shape);
            rows.column_mut(j).iter_mut().zip(&h).for_each(|(x, y)| *x = *y);
        }
        let offsets = phase.monitor_offsets();
        let drives = phase.drives().to_vec();
        Ok(Eigenbasis {
            drives,
            omega: all.omega,
            shapes,
            inverse,
            constant,
            harmonics,
            rows,
            offsets,
        })
    }

    /// What harmonic loads on `u_C` add to the monitors, at their present frequencies.
    pub fn drives(&self, loads: &Loads) -> Drives {
        let mut drives = self.drives.clone();
        drives.iter_mut().for_each(|d| d.load = loads.harmonics[d.index].clone());
        Drives(drives)
    }

    /// Values of all monitors at modal displacements `q`, without drives.
    pub fn monitors(&self, q: &[f64]) -> Vec<f64> {
        let mut h = self.offsets.clone();
        for (k, q) in q.iter().enumerate() {
            h.iter_mut().zip(self.rows.column(k).iter()).for_each(|(h, r)| *h += r * q);
        }
        h
    }

    /// `q = ΦᵀM_α u`, `q̇ = ΦᵀM_α v`: `x` and the result hold displacements, then velocities.
    pub fn to_modes(&self, x: &[f64], q: &mut [f64]) {
        product(&self.inverse, x, q);
    }

    /// `u = Φ q`, `v = Φ q̇`, likewise.
    pub fn from_modes(&self, q: &[f64], x: &mut [f64]) {
        product(&self.shapes, q, x);
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

/// `Y = A X` for the two columns of `X`, one after the other in memory.
fn product(a: &Mat<f64>, x: &[f64], y: &mut [f64]) {
    let n = a.ncols();
    let x = MatRef::from_column_major_slice(x, n, 2);
    let y = MatMut::from_column_major_slice_mut(y, a.nrows(), 2);
    matmul(y, Accum::Replace, a.as_ref(), x, 1.0, Par::Seq);
}

/// Bytes of the eigenbases that are kept: fine meshes visit hundreds of phases.
const BUDGET: usize = 512 << 20;

/// The spectra of the phases of one body, computed when they are first asked for; the least recently used go when there are too many.
#[derive(Debug)]
pub struct Spectra {
    known: RefCell<Cache<ActiveSet, Rc<Spectrum>>>,
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
        if let Some(known) = self.known(system, &phase.set) {
            return Ok(known);
        }
        let new = Rc::new(Spectrum::new(system, phase)?);
        self.computed.set(self.computed.get() + 1);
        let bytes = 16 * new.shapes.nrows() * new.shapes.ncols();
        self.known.borrow_mut().insert(phase.set.clone(), new.clone(), bytes);
        Ok(new)
    }

    /// What is known of an active set, under the present damping.
    fn known(&self, system: &System, set: &ActiveSet) -> Option<Rc<Spectrum>> {
        let mut known = self.known.borrow_mut();
        let spectrum = known.get_mut(set)?;
        if spectrum.damping != system.damping {
            *spectrum = Rc::new(Spectrum::damped(spectrum.basis.clone(), system.damping));
        }
        Some(spectrum.clone())
    }

    /// The spectrum of an active set.
    pub fn of_set(&self, system: &System, set: &ActiveSet) -> Result<Rc<Spectrum>, FemError> {
        if let Some(known) = self.known(system, set) {
            return Ok(known);
        }
        self.of(system, &system.phase(set))
    }

    /// Number of eigensolutions so far.
    pub fn computed(&self) -> u64 {
        self.computed.get()
    }
}
