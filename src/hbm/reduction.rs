//! The directions on which phases differ, and the operators of each phase on them.

use std::cell::RefCell;
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::rc::Rc;

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::HbmError;
use super::series::Basis;
use crate::contact::State;
use crate::contact::{ActiveSet, Drive, Rayleigh, System};
use crate::fem::{Csr, Loads};
use crate::flow::spectrum::{Spectra, Spectrum};

/// What is projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// `A*ᵀ(M A* ü_O + C A* u̇_O + K(A*u_O + d*) − f)`: the seed's eq. 7.
    Force,
    /// `ü_O + M_α⁻¹(C_α u̇_O + K_α u_O − f_α)`.
    Acceleration,
}

/// One phase on the reduced directions: `n = P y + V ẏ + A ÿ − s − Σ_j (c_j cos + …)`.
#[derive(Debug)]
pub struct PhaseOperator {
    /// `r × r_in`, acting on `y`.
    pub p: Mat<f64>,
    /// Acting on `dy/dt`.
    pub v: Option<Mat<f64>>,
    /// Acting on `d²y/dt²`.
    pub a: Option<Mat<f64>>,
    /// Constant part.
    pub s: Vec<f64>,
    /// Parts of the harmonic loads: amplitude of each load.
    pub loads: Vec<Vec<f64>>,
    /// Monitors: one row a contact node, on `y`.
    pub rows: Mat<f64>,
    /// Monitors at `u_O = 0`.
    pub offsets: Vec<f64>,
    /// What harmonic loads on `u_C` add to them.
    pub drives: Vec<Drive>,
}

impl PhaseOperator {
    /// The part of a monitor that does not depend on the motion, in the function of this index (constant, `cos θ`, `sin θ`, …).
    pub fn monitor_constant(&self, contact: usize, function: usize, loads: &Loads) -> f64 {
        let driven = |of_phase: &dyn Fn(f64) -> f64| -> f64 {
            let drives = self.drives.iter();
            let part = |d: &Drive| {
                let load = &loads.harmonics[d.index];
                load.size() * d.monitor[contact] * of_phase(load.angle())
            };
            drives.map(part).sum()
        };
        // cos(θ + φ) = cos φ cos θ − sin φ sin θ
        match function {
            0 => self.offsets[contact],
            1 => driven(&f64::cos),
            2 => driven(&|phase| -phase.sin()),
            _ => 0.0,
        }
    }
}

/// A body prepared for harmonic balance.
pub struct Reduction {
    /// Operators.
    pub system: System,
    /// Modes of the open phase.
    pub open: Rc<Spectrum>,
    spectra: Spectra,
    /// Force or acceleration form.
    pub form: Form,
    /// Cosine series or full.
    pub basis: Basis,
    /// `Q`, `n × r`.
    pub q: Mat<f64>,
    /// `Q̂`, `n × r_in`.
    pub q_in: Mat<f64>,
    lifted: Mat<f64>,
    mass: Csr,
    stiffness: Csr,
    phases: RefCell<HashMap<ActiveSet, Rc<PhaseOperator>>>,
}

/// Directions shorter than this, over the longest, are rounding errors.
const RANK: f64 = 1e-10;

/// An orthonormal basis of the columns.
fn orthonormal(columns: &Mat<f64>) -> Mat<f64> {
    let n = columns.nrows();
    let mut basis: Vec<Vec<f64>> = vec![];
    for c in 0..columns.ncols() {
        let mut x = columns.col_as_slice(c).to_vec();
        let first = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        for _ in 0..2 {
            for b in &basis {
                let d: f64 = b.iter().zip(&x).map(|(b, x)| b * x).sum();
                x.iter_mut().zip(b).for_each(|(x, b)| *x -= d * b);
            }
        }
        let rest = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        if rest > RANK * first {
            x.iter_mut().for_each(|x| *x /= rest);
            basis.push(x);
        }
    }
    Mat::from_fn(n, basis.len(), |i, j| basis[j][i])
}

/// `Bᵀ A B` for a sparse `A`.
fn congruence(a: &Csr, b: &Mat<f64>) -> Mat<f64> {
    let mut ab = Mat::<f64>::zeros(b.nrows(), b.ncols());
    for c in 0..b.ncols() {
        let mut y = vec![0.0; b.nrows()];
        a.mul(b.col_as_slice(c), &mut y);
        y.iter().enumerate().for_each(|(i, y)| ab[(i, c)] = *y);
    }
    b.transpose() * ab
}

impl Reduction {
    /// Square of the lowest frequency that is not a rigid motion's: the unit of modal stiffness.
    pub fn stiffness_unit(&self) -> f64 {
        let elastic = self.open.modes.iter().map(|m| m.omega).find(|w| *w > 0.0);
        elastic.unwrap_or(self.system.units.frequency).powi(2)
    }

    /// Whether the open body can move rigidly.
    pub fn is_free(&self) -> bool {
        self.open.modes.iter().any(|m| m.omega == 0.0)
    }

    /// Find the directions; the series is a cosine series for an undamped body without harmonic loads.
    pub fn new(system: System, form: Form) -> Result<Reduction, HbmError> {
        let mut frequencies = system.loads.harmonics.iter().map(|h| h.omega);
        if let Some(first) = frequencies.next()
            && let Some(other) = frequencies.find(|w| *w != first)
        {
            return Err(HbmError::Frequencies(first, other));
        }
        let n_c = system.n_contact();
        let open_set = ActiveSet::open(n_c);
        let spectra = Spectra::default();
        let open = spectra.of_set(&system, &open_set)?;
        let n = system.n_o();
        let (stiffness, mass) = system.open_phase().matrices();
        let directions = system.directions();
        let mut columns = Mat::<f64>::zeros(n, directions.len());
        for (c, column) in directions.iter().enumerate() {
            column.iter().for_each(|&(i, v)| columns[(i, c)] = v);
        }
        let modal = open.shapes.transpose() * &columns;
        let q = orthonormal(&modal);
        let q_in = match form {
            Form::Force => q.clone(),
            Form::Acceleration => {
                let r = q.ncols();
                let both = Mat::from_fn(n, 2 * r, |i, j| {
                    let w = open.modes[i].omega;
                    if j < r { q[(i, j)] } else { w * w * q[(i, j - r)] }
                });
                orthonormal(&both)
            }
        };
        let lifted = &open.shapes * &q;
        let full = system.damping.is_some() || !system.loads.harmonics.is_empty();
        let basis = if full { Basis::Full } else { Basis::Cosine };
        let phases = RefCell::default();
        Ok(Reduction {
            system,
            open,
            spectra,
            form,
            basis,
            q,
            q_in,
            lifted,
            mass,
            stiffness,
            phases,
        })
    }

    /// Number of modes.
    pub fn n(&self) -> usize {
        self.open.modes.len()
    }

    /// Set the frequency of the harmonic loads.
    pub fn set_frequency(&mut self, omega: f64) {
        self.system.loads_mut().set_frequency(omega);
    }

    /// Change the damping. Phases that are known stand: `β` must be what it was, and in the acceleration form `α` is not in them.
    pub(super) fn set_damping(&mut self, damping: Rayleigh) -> Result<(), HbmError> {
        debug_assert!(self.form == Form::Acceleration);
        debug_assert!(self.system.damping.is_some_and(|d| d.beta == damping.beta));
        self.system.damping = Some(damping);
        let open = ActiveSet::open(self.system.n_contact());
        self.open = self.spectra.of_set(&self.system, &open)?;
        Ok(())
    }

    /// A phase on the reduced directions.
    pub fn phase(&self, set: &ActiveSet) -> Result<Rc<PhaseOperator>, HbmError> {
        if let Some(known) = self.phases.borrow().get(set) {
            return Ok(known.clone());
        }
        let new = Rc::new(self.build(set)?);
        self.phases.borrow_mut().insert(set.clone(), new.clone());
        Ok(new)
    }

    fn build(&self, set: &ActiveSet) -> Result<PhaseOperator, HbmError> {
        let system = &self.system;
        let phase = system.phase(set);
        let (k, m) = phase.matrices();
        let s_m = congruence(&Csr::combination(1.0, &m, -1.0, &self.mass), &self.lifted);
        let s_k = congruence(&Csr::combination(1.0, &k, -1.0, &self.stiffness), &self.lifted);
        let r = self.q.ncols();
        // A*ᵀ x on the reduced directions, less that of the open phase
        let open = system.open_phase();
        let difference = |a: Vec<f64>, b: Vec<f64>| -> Vec<f64> {
            let x: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
            let on = |c| self.lifted.col_as_slice(c).iter().zip(&x).map(|(a, b)| a * b).sum();
            (0..r).map(on).collect()
        };
        let s = difference(phase.constant_force(), open.constant_force());
        let loads: Vec<Vec<f64>> = system
            .loads
            .harmonics
            .iter()
            .map(|h| difference(phase.reduce(&h.force), open.reduce(&h.force)))
            .collect();
        let (alpha, beta) = system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
        let rows_modal: Vec<Vec<f64>> = (0..system.n_o())
            .map(|j| {
                let shape: Vec<f64> = (0..system.n_o()).map(|i| self.open.shapes[(i, j)]).collect();
                phase.monitor_gradient_at(&shape)
            })
            .collect();
        let rows = Mat::from_fn(system.n_contact(), self.q_in.ncols(), |i, c| {
            (0..self.n()).map(|j| rows_modal[j][i] * self.q_in[(j, c)]).sum()
        });
        let offsets = phase.monitor_offsets();
        let drives = phase.drives().to_vec();
        match self.form {
            Form::Force => {
                let damped = system.damping.is_some();
                let v = damped
                    .then(|| Mat::from_fn(r, r, |i, j| alpha * s_m[(i, j)] + beta * s_k[(i, j)]));
                Ok(PhaseOperator { p: s_k, v, a: Some(s_m), s, loads, rows, offsets, drives })
            }
            Form::Acceleration => {
                // M_α⁻¹ = I − Q T Qᵀ,  T = (I + S)⁻¹ S
                let identity = Mat::<f64>::identity(r, r);
                let t = (&identity + &s_m).partial_piv_lu().solve(&s_m);
                if (0..r).any(|i| !t[(i, i)].is_finite()) {
                    return Err(HbmError::Singular);
                }
                let keep = &identity - &t;
                // QᵀΩ² and Qᵀ on y = Q̂ᵀ q
                let n = self.n();
                let square =
                    Mat::from_fn(r, n, |c, i| self.open.modes[i].omega.powi(2) * self.q[(i, c)]);
                let of_square = &square * &self.q_in;
                let of_q = self.q.transpose() * &self.q_in;
                let p = &keep * &s_k * &of_q - &t * &of_square;
                let v = (beta > 0.0).then(|| Mat::from_fn(r, p.ncols(), |i, j| beta * p[(i, j)]));
                // (I − T)(−Δf) + T Qᵀ f₀, written as −s
                let lift = |difference: &[f64], of_open: &[f64]| -> Vec<f64> {
                    let column = |x: &[f64]| Mat::from_fn(x.len(), 1, |i, _| x[i]);
                    let x = &keep * column(difference);
                    let f0 = self.q.transpose() * column(of_open);
                    let y = &t * f0;
                    (0..r).map(|i| x[(i, 0)] - y[(i, 0)]).collect()
                };
                let s = lift(&s, &self.open.constant);
                let loads =
                    loads.iter().zip(&self.open.harmonics).map(|(d, f0)| lift(d, f0)).collect();
                Ok(PhaseOperator { p, v, a: None, s, loads, rows, offsets, drives })
            }
        }
    }

    /// `x = (u_O, u̇_O)` of modal displacements and their rates by `θ`.
    pub fn state(&self, q: &[f64], dq: &[f64], omega: f64) -> State {
        let n = self.n();
        let both: Vec<f64> = q.iter().copied().chain(dq.iter().map(|d| omega * d)).collect();
        let mut x = vec![0.0; 2 * n];
        self.open.from_modes(&both, &mut x);
        State { v: x.split_off(n), u: x }
    }

    /// Modal coordinates of displacements `u_O`.
    pub fn modal(&self, u: &[f64]) -> Vec<f64> {
        let n = self.n();
        let mut both = vec![0.0; 2 * n];
        both[..n].copy_from_slice(u);
        let mut q = vec![0.0; 2 * n];
        self.open.to_modes(&both, &mut q);
        q.truncate(n);
        q
    }

    /// Period of a frequency.
    pub fn period(omega: f64) -> f64 {
        TAU / omega
    }
}
