//! Sequences of active sets, and a body with the modes of its phases; motions through them are in [`super::walk`], tangents in [`super::tangent`]
//! (theory §8).
//!
//! The phases are `α_0, …, α_m`, the switching times `t_1 < … < t_m` are free. Inside a phase the state is known in closed form in
//! the phase's modes, `x(t) = φ_α(t; t_j, x_j)`, and its tangent is the homogeneous flow. A change of a switching time acts as
//! `δu̇ = (ü⁻ − ü⁺) δt_j` from that switch on. With `δt_j = −∇h_j δu / ḣ_j` this is the saltation matrix
//!
//! ```text
//! S_j = I + [0; ü⁺ − ü⁻] [∇h_j, 0] / ḣ_j
//! ```
//!
//! which diverges at grazing; with `t_j` as unknowns and `h_j = 0` as equations everything stays smooth.
//!
//! States are written in the *frame*: `z = (Ω q, q̇)` with the modal coordinates of the open phase (`z = (Ω (q − q°), q̇)` with those of the phase of the equilibrium, where motions
//! are told around one), so that `½‖z‖²` is the energy of a motion that stays in it and all unknowns are of one kind.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use faer::{Mat, MatRef};
use nalgebra::Complex;

use super::drift::Drift;
use crate::contact::{ContactError, Rayleigh, State, States, System};
use crate::fem::dense::product;
use crate::fem::{FemError, largest};
use crate::flow::cache::Cache;
use crate::flow::spectrum::{Spectra, Spectrum};

/// Above this size orbits are shot without the modes of the phases, where that is possible.
pub const LARGE: usize = 800;

/// The sequence of active sets: `sets[j]` holds between event `j − 1` and event `j`; `points[j]` is the contact point of which a
/// monitor reaches zero at event `j` (the first one where several switch at one time).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Chain {
    /// Active sets, one more than events.
    pub sets: Vec<States>,
    /// Contact point of each event.
    pub points: Vec<usize>,
    /// Points that each event strikes, of a motion whose velocities jump (else empty).
    pub struck: Vec<Vec<usize>>,
}

impl Chain {
    /// Number of events.
    pub fn events(&self) -> usize {
        self.points.len()
    }

    /// Event `j` ends a phase that the same point began.
    pub fn is_pair(&self, j: usize) -> bool {
        j > 0 && self.points[j] == self.points[j - 1] && self.sets[j - 1] == self.sets[j + 1]
    }
}

/// A jump of velocities in modal coordinates.
#[derive(Debug)]
pub(super) struct Jump {
    columns: Mat<f64>,
    rows: Mat<f64>,
}

impl Jump {
    /// `V ← V − C (N V)`
    pub fn act(&self, v: MatRef<f64>) -> Mat<f64> {
        let impulse = product(self.rows.as_ref(), v);
        v - product(self.columns.as_ref(), impulse.as_ref())
    }
}

/// From the modes of one active set to those of another.
type Transforms = Cache<(States, States), Rc<Mat<f64>>>;

/// Bytes of the transforms that are kept.
const BUDGET: usize = 256 << 20;

/// Bodies so small that the transforms of a whole period are among them go from phase to phase by one product, larger ones by two.
const BY_TRANSFORM: usize = 200;

/// A slip below this part of the largest velocity is none, where Newton's method has found the velocities.
const RESTS: f64 = 1e-9;

/// So many columns, over the displacements, pay for a transform that is used again.
const PAYS: f64 = 0.3;

/// What was done for orbits: counted, because times depend on the machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Spent {
    /// Motions over a period, or a part of one.
    pub motions: u64,
    /// Derivatives of the period map: columns carried along a motion.
    pub derivatives: u64,
}

impl std::ops::Add for Spent {
    type Output = Spent;
    fn add(self, other: Spent) -> Spent {
        Spent {
            motions: self.motions + other.motions,
            derivatives: self.derivatives + other.derivatives,
        }
    }
}

/// `T B`, without a product where the columns have one entry each: those of unit vectors behind the phase that they are modes of.
fn applied(t: &Mat<f64>, b: MatRef<f64>) -> Mat<f64> {
    let single = |c: usize| {
        let mut entries = b.col(c).iter().enumerate().filter(|e| *e.1 != 0.0);
        let first = entries.next().map_or((0, 0.0), |(i, x)| (i, *x));
        entries.next().is_none().then_some(first)
    };
    match (0..b.ncols()).map(single).collect::<Option<Vec<_>>>() {
        Some(entries) => Mat::from_fn(t.nrows(), b.ncols(), |i, c| {
            let (row, x) = entries[c];
            t[(i, row)] * x
        }),
        None => product(t.as_ref(), b),
    }
}

/// A body with the modes of its phases, ready to carry states and tangents through chains.
#[derive(Debug)]
pub struct Propagator {
    /// Operators.
    pub system: System,
    /// Modes of the phases met so far.
    pub spectra: Rc<Spectra>,
    /// Modes of the phase that the frame is of: the open one, or that of the equilibrium.
    pub home: Rc<Spectrum>,
    /// `Ω`: its frequencies (those of rigid motions replaced by the body's unit of frequency).
    pub scale: Vec<f64>,
    /// The unit of frame vectors: [`crate::flow::spectrum::Eigenbasis::root_of_energy`].
    pub unit: f64,
    pub(super) home_set: States,
    /// `q°`: the equilibrium in these modes; zero where motions are told around none.
    pub(super) at_rest: Vec<f64>,
    /// Directions along which the body could be anywhere.
    pub(super) drift: Drift,
    /// Set from elsewhere: the search for an orbit ends with [`super::OrbitError::Stopped`].
    pub stop: Option<Arc<AtomicBool>>,
    transforms: RefCell<Transforms>,
    /// Motions and derivatives so far.
    spent: Cell<Spent>,
}

impl Propagator {
    /// Modes of the open phase of a body; of that of its equilibrium, where motions are told around one.
    pub fn new(system: System) -> Result<Propagator, FemError> {
        let spectra = Rc::new(Spectra::default());
        let home_set = match system.rest() {
            Some(rest) => rest.set.clone(),
            None => States::open(system.n_contact()),
        };
        let home = spectra.of_set(&system, &home_set)?;
        let (scale, unit) = (home.scale(), home.root_of_energy(&system));
        let n = system.n_o();
        let mut at_rest = vec![0.0; 2 * n];
        if let Some(rest) = system.rest() {
            let state: Vec<f64> = rest.u.iter().copied().chain(vec![0.0; n]).collect();
            home.to_modes(&state, &mut at_rest);
        }
        at_rest.truncate(n);
        let transforms = RefCell::new(Cache::new(BUDGET));
        // where nothing has mass along obstacles, what is remembered would move along
        let drift = match system.tangents() {
            Some(_) if !system.creeps() => Drift::of(&system, &home),
            _ => Drift::default(),
        };
        Ok(Propagator {
            system,
            spectra,
            home,
            scale,
            unit,
            home_set,
            at_rest,
            drift,
            stop: None,
            transforms,
            spent: Cell::default(),
        })
    }

    /// Change the damping; the modes stay.
    pub fn set_damping(&mut self, damping: Option<Rayleigh>) -> Result<(), FemError> {
        if self.system.damping != damping {
            self.system.damping = damping;
            self.home = self.spectra.of_set(&self.system, &self.home_set)?;
        }
        Ok(())
    }

    /// What was done so far with this body.
    pub fn spent(&self) -> Spent {
        self.spent.get()
    }

    pub(super) fn count(&self, more: impl FnOnce(&mut Spent)) {
        let mut spent = self.spent.get();
        more(&mut spent);
        self.spent.set(spent);
    }

    /// Whether the search is asked to end.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Number of displacements `u_O`.
    pub fn n(&self) -> usize {
        self.system.n_o()
    }

    /// Too large for the modes of every phase, and of the kind that needs none: undamped, under constant loads, velocities that do not jump.
    pub fn is_large(&self) -> bool {
        let system = &self.system;
        let needs_none = system.is_conservative() && system.impact().is_none();
        self.n() > LARGE && needs_none && system.units.highest.is_finite()
    }

    /// The jump of velocities at event `j` of a chain, in the modes of the set behind it: `V ← V − C (N V)`.
    pub(super) fn blow(&self, chain: &Chain, j: usize) -> Result<Option<Jump>, FemError> {
        let struck = chain.struck.get(j).filter(|s| !s.is_empty());
        let (Some(struck), Some(law)) = (struck, self.system.impact()) else { return Ok(None) };
        let singular = || FemError::Singular { what: "impulses of an impact" };
        let map = law.blow(struck, &chain.sets[j]).ok_or_else(singular)?;
        let to = self.spectra.of_set(&self.system, &chain.sets[j + 1])?;
        let n = self.n();
        let columns = Mat::from_fn(n, struck.len(), |i, c| map.columns[c][i]);
        let columns = product(to.inverse.as_ref(), columns.as_ref());
        let rows = Mat::from_fn(struck.len(), n, |i, k| {
            map.rows[i].iter().map(|&(d, v)| v * to.shapes[(d, k)]).sum()
        });
        Ok(Some(Jump { columns, rows }))
    }

    /// Columns in the modal coordinates of one set in those of another: `Φ_bᵀ M_b Φ_a b`; none if the sets are the same.
    pub(super) fn passed(
        &self,
        from: &States,
        to: &States,
        b: MatRef<f64>,
    ) -> Result<Option<Mat<f64>>, FemError> {
        if from == to {
            return Ok(None);
        }
        // not by what is at hand: a result does not depend on what was computed before
        if self.n() <= BY_TRANSFORM || b.ncols() as f64 >= PAYS * self.n() as f64 {
            return Ok(Some(applied(self.transform(from, to)?.as_ref(), b)));
        }
        let u = product(self.spectra.of_set(&self.system, from)?.shapes.as_ref(), b);
        let to = self.spectra.of_set(&self.system, to)?;
        Ok(Some(product(to.inverse.as_ref(), u.as_ref())))
    }

    /// `Φ_bᵀ M_b Φ_a`.
    fn transform(&self, from: &States, to: &States) -> Result<Rc<Mat<f64>>, FemError> {
        let key = (from.clone(), to.clone());
        if let Some(known) = self.transforms.borrow_mut().get_mut(&key) {
            return Ok(known.clone());
        }
        let a = self.spectra.of_set(&self.system, from)?;
        let b = self.spectra.of_set(&self.system, to)?;
        let new = Rc::new(product(b.inverse.as_ref(), a.shapes.as_ref()));
        let bytes = 8 * new.nrows() * new.ncols();
        self.transforms.borrow_mut().insert(key, new.clone(), bytes);
        Ok(new)
    }

    /// `x = (u_O, u̇_O)` of a frame vector `z` (length `2n`, or `n` for a state at rest).
    pub fn state(&self, z: &[f64]) -> State {
        let n = self.n();
        let mut q = vec![0.0; 2 * n];
        q[..z.len()].copy_from_slice(z);
        let shift = self.scale.iter().zip(&self.at_rest);
        q[..n].iter_mut().zip(shift).for_each(|(q, (s, rest))| *q = *q / s + rest);
        let mut x = vec![0.0; 2 * n];
        self.home.state_of_modes(&q, &mut x);
        State { v: x.split_off(n), u: x }
    }

    /// The frame vector of a state.
    pub fn frame(&self, x: &State) -> Vec<f64> {
        let n = self.n();
        let both: Vec<f64> = x.u.iter().chain(&x.v).copied().collect();
        let mut z = vec![0.0; 2 * n];
        self.home.to_modes(&both, &mut z);
        self.put_into_frame(&mut z);
        z
    }

    /// Modal coordinates and velocities as a frame vector.
    fn put_into_frame(&self, q: &mut [f64]) {
        let shift = self.scale.iter().zip(&self.at_rest);
        q.iter_mut().zip(shift).for_each(|(q, (s, rest))| *q = (*q - rest) * s);
    }

    /// The frame vector with what rests on an obstacle's surface, as far as a solution of equations can tell, resting exactly: points that touch, and move along the surface by less than
    /// [`RESTS`] of the largest velocity. None where nothing does.
    pub fn settled(&self, z: &[f64]) -> Result<Option<Vec<f64>>, ContactError> {
        if self.system.tangents().is_none() {
            return Ok(None);
        }
        let mut x = self.state(z);
        let touching = self.system.select(0.0, &x.u, &self.home_set)?.set;
        let least = RESTS * largest(&x.v);
        let mut rests = false;
        for t in touching.closed_points().into_iter().filter_map(|i| self.system.rigid_tangent(i)) {
            if t.slip_velocity(&x.v).abs() <= least {
                t.settle(&mut x.v);
                rests = true;
            }
        }
        // a spring beyond the limit of its slider, which does not slide on
        for s in self.system.sliders() {
            let trial = s.trial(&x.u).unwrap_or(0.0);
            if trial.abs() > s.limit && trial * s.along(&x.v) <= 0.0 {
                s.settle(&mut x.u);
                rests = true;
            }
        }
        Ok(rests.then(|| self.frame(&x)))
    }

    /// The frame vector at `t = 0` of the linear response in the phase of the frame to its harmonic and constant loads.
    pub fn linear_response(&self) -> Vec<f64> {
        let n = self.n();
        if let Some(mut x) = self.home.coupled_response(&self.system.loads) {
            self.put_into_frame(&mut x);
            return x;
        }
        let mut z = vec![0.0; 2 * n];
        for (k, m) in self.home.modes.iter().enumerate() {
            let (mut q, mut v) = (0.0, 0.0);
            if m.omega > 0.0 {
                q += self.home.constant[k] / (m.omega * m.omega);
            }
            for (load, forces) in self.system.loads.harmonics.iter().zip(&self.home.harmonics) {
                let w = load.omega;
                let stiffness = Complex::new((m.omega - w) * (m.omega + w), 2.0 * m.c * w);
                let response =
                    Complex::from_polar(load.size() * forces[k], load.angle()) / stiffness;
                q += response.re;
                v -= w * response.im;
            }
            (z[k], z[n + k]) = (q, v);
        }
        self.put_into_frame(&mut z);
        z
    }
}
