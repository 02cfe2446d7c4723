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
use super::coupled::{CoupledMotion, Coupling, Operators, dot};
use super::drives::Drives;
use super::motion;
use super::oscillator::Oscillator;
use crate::contact::{Drive, Lost, Monitor, Phase, Rayleigh, States, System};
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
    /// The complex modes, where the natural ones do not decouple the phase.
    pub(super) coupling: Option<Coupling>,
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
    /// The monitors of the phase.
    pub monitors: Vec<Monitor>,
    /// `r = ∇h Φ`, one row a monitor.
    pub rows: DMatrix<f64>,
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

/// What rounding has left of an eigensolution (theory §12, H4), estimated along some vectors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Defect {
    /// `‖KΦ − MΦΛ‖` in the norm of `M⁻¹`.
    pub residual: f64,
    /// `‖ΦᵀMΦ − I‖`
    pub orthogonality: f64,
}

impl Defect {
    /// Of `(K, M)` with the modes `Φ`, `inverse` is `ΦᵀM`. Of a vector `z` of random signs `‖Az‖²` is `‖A‖²` (Frobenius) on the average: the largest of
    /// some, twice.
    fn of(k: &Csr, omega: &[f64], shapes: &Mat<f64>, inverse: &Mat<f64>) -> Defect {
        /// Vectors that are tried.
        const PROBES: u64 = 4;
        let n = omega.len();
        let mut defect = Defect { residual: 0.0, orthogonality: 0.0 };
        let mut bits = 0x9e37_79b9_7f4a_7c15u64;
        let norm = |x: &[f64]| 2.0 * dot(x, x).sqrt();
        for _ in 0..PROBES {
            let mut sign = || {
                // xorshift
                bits ^= bits << 13;
                bits ^= bits >> 7;
                bits ^= bits << 17;
                if bits >> 40 & 1 == 0 { 1.0 } else { -1.0 }
            };
            let z: Vec<f64> = (0..n).map(|_| sign()).collect();
            // Φz and ΦΛz; what ΦᵀM makes of both
            let scaled: Vec<f64> = z.iter().zip(omega).map(|(z, w)| z * w * w).collect();
            let (mut x, mut back) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
            product(shapes, &[z.clone(), scaled].concat(), &mut x);
            product(inverse, &x, &mut back);
            let rest: Vec<f64> = back.iter().zip(&z).map(|(b, z)| b - z).collect();
            defect.orthogonality = defect.orthogonality.max(norm(&rest));
            let mut kx = vec![0.0; n];
            k.mul(&x[..n], &mut kx);
            let projected = transposed(shapes, &kx);
            let rest: Vec<f64> = projected.iter().zip(&back[n..]).map(|(p, b)| p - b).collect();
            defect.residual = defect.residual.max(norm(&rest));
        }
        defect
    }
}

/// Matrices that natural modes do not make diagonal.
#[derive(Debug)]
struct Mixing {
    /// `ΦᵀK₀Φ` of the body without springs, which damps.
    structure: Mat<f64>,
    /// Of forces without a potential `ΦᵀK_αΦ`, and what of it, and of the constant force, has none.
    forces: Option<Forces>,
}

#[derive(Debug)]
struct Forces {
    stiffness: Mat<f64>,
    skew: (Mat<f64>, Vec<f64>),
}

impl Mixing {
    /// Of a phase where there is any.
    fn of(phase: &Phase, shapes: &Mat<f64>) -> Option<Mixing> {
        let projected = |a: &Csr| -> Mat<f64> {
            let n = shapes.ncols();
            let mut product = Mat::<f64>::zeros(n, n);
            let columns: Vec<Vec<f64>> = (0..n)
                .map(|j| {
                    let mut y = vec![0.0; n];
                    a.mul(shapes.col_as_slice(j), &mut y);
                    y
                })
                .collect();
            let columns = Mat::from_fn(n, n, |i, j| columns[j][i]);
            let left = shapes.transpose();
            matmul(product.as_mut(), Accum::Replace, left, columns.as_ref(), 1.0, Par::Seq);
            product
        };
        let structure = phase.damping_stiffness()?;
        let forces = phase.lost().map(|Lost { matrix, constant }| Forces {
            stiffness: projected(&phase.matrices().0),
            skew: (projected(&matrix), transposed(shapes, &constant)),
        });
        Some(Mixing { structure: projected(&structure), forces })
    }

    fn operators(&self, omega: &[f64], (alpha, beta): (f64, f64)) -> Operators {
        let n = omega.len();
        let diagonal = |i: usize, j: usize, x: f64| if i == j { x } else { 0.0 };
        let damping = |i: usize, j: usize| diagonal(i, j, alpha) + beta * self.structure[(i, j)];
        Operators {
            stiffness: match &self.forces {
                Some(f) => f.stiffness.clone(),
                None => Mat::from_fn(n, n, |i, j| diagonal(i, j, omega[i] * omega[i])),
            },
            damping: Mat::from_fn(n, n, damping),
            skew: self.forces.as_ref().map(|f| f.skew.clone()),
        }
    }
}

/// `Aᵀ x`
fn transposed(a: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    (0..a.ncols()).map(|j| dot(a.col_as_slice(j), x)).collect()
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
        Self::damped(Rc::new(Eigenbasis::new(system, phase)?), system.damping)
    }

    /// The modes of a basis under a damping.
    fn damped(basis: Rc<Eigenbasis>, damping: Option<Rayleigh>) -> Result<Self, FemError> {
        let (alpha, beta) = damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
        let coupling = match &basis.mixing {
            Some(mixing) if beta != 0.0 || mixing.forces.is_some() => {
                let scale = basis.scale();
                let operators = mixing.operators(&basis.omega, (alpha, beta));
                let forces: Vec<&[f64]> = [&basis.constant]
                    .into_iter()
                    .chain(&basis.harmonics)
                    .map(Vec::as_slice)
                    .collect();
                Some(Coupling::new(operators, &scale, &basis.rows, &forces)?)
            }
            _ => None,
        };
        let mode = |&omega: &f64| Oscillator { omega, c: 0.5 * (alpha + beta * omega * omega) };
        let modes: Vec<Oscillator> = basis.omega.iter().map(mode).collect();
        let is_undamped = modes.iter().all(|m| m.c == 0.0 && m.omega > 0.0);
        Ok(Spectrum { modes, damping, basis, is_undamped, coupling })
    }

    /// The homogeneous flow over `tau` of columns `[Q | V]`, `k` of each, under the damping `C + αM`.
    pub fn carry(&self, b: &mut Mat<f64>, k: usize, tau: f64, alpha: f64) -> Result<(), FemError> {
        if let Some(coupling) = &self.coupling {
            let shifted = match alpha {
                0.0 => None,
                alpha => Some(coupling.shifted(alpha, &self.scale(), &self.rows)?),
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
            return coupling.row_carried(r, tau);
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
        let response = CoupledMotion::steady(coupling, &motion::angles(loads, 0.0));
        Some(response.unwrap_or_else(|| vec![f64::NAN; 2 * self.modes.len()]))
    }

    /// `ΦᵀCΦ`, where it is not diagonal.
    pub fn damping_matrix(&self) -> Option<&Mat<f64>> {
        self.coupling.as_ref().map(Coupling::damping)
    }

    /// `β` of the damping.
    pub(super) fn stiffness_damping(&self) -> f64 {
        self.damping.map_or(0.0, |d| d.beta)
    }

    /// Whether the modes by themselves are the motions of the phase.
    pub fn is_decoupled(&self) -> bool {
        self.coupling.is_none()
    }
}

impl Eigenbasis {
    fn new(system: &System, phase: &Phase) -> Result<Self, FemError> {
        let (k, m) = phase.matrices();
        let n = system.n_o();
        // forces without a potential have no natural modes: those of the body without them serve
        let symmetric = if phase.is_symmetric() { k } else { phase.open_stiffness() };
        let all = eigen::all(&symmetric, &m, system.units.frequency)?;
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
        let still = vec![0.0; n];
        for (j, shape) in all.shapes.iter().enumerate() {
            let h = phase.monitor_gradient_at(shape, &still);
            rows.column_mut(j).iter_mut().zip(&h).for_each(|(x, y)| *x = *y);
        }
        let offsets = phase.monitor_offsets();
        let drives = phase.drives();
        let mixing = Mixing::of(phase, &shapes);
        let defect = Defect::of(&symmetric, &all.omega, &shapes, &inverse);
        Ok(Eigenbasis {
            defect,
            mixing,
            unit: system.units.frequency,
            drives,
            omega: all.omega,
            shapes,
            inverse,
            constant,
            harmonics,
            monitors: phase.monitors.clone(),
            rows,
            offsets,
        })
    }

    /// Natural frequencies, the body's unit in place of zero.
    pub fn scale(&self) -> Vec<f64> {
        self.omega.iter().map(|&w| if w > 0.0 { w } else { self.unit }).collect()
    }

    /// What harmonic loads on `u_C` add to the monitors, at their present frequencies.
    pub(crate) fn drives(&self, loads: &Loads) -> Drives {
        let mut drives = self.drives.clone();
        drives.iter_mut().for_each(|d| d.load = loads.harmonics[d.index].clone());
        Drives(drives)
    }

    /// Values of all monitors at modal displacements `q`, without drives.
    pub(crate) fn monitor_values(&self, q: &[f64]) -> Vec<f64> {
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
