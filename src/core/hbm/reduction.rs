//! A body prepared for harmonic balance by all modes of its open phase.

use std::ops::{Deref, DerefMut};
use std::rc::Rc;

use faer::Mat;

use super::HbmError;
use super::interface::{Directions, Form, Interface};
use crate::contact::{Rayleigh, State, States, System};
use crate::flow::spectrum::{Spectra, Spectrum};

/// A body whose series are those of the modes `q` of its open phase.
pub struct Reduction {
    interface: Interface,
    /// Modes of the open phase.
    pub open: Rc<Spectrum>,
    pub(super) spectra: Spectra,
    /// Of the interface terms.
    force_unit: f64,
    /// `Q`, `n × r`.
    pub q: Mat<f64>,
    /// `Q̂ = [Q]` (force form) or `[Q, Ω²Q]` (acceleration form), `n × r_in`.
    pub q_in: Mat<f64>,
}

impl Deref for Reduction {
    type Target = Interface;

    fn deref(&self) -> &Interface {
        &self.interface
    }
}

impl DerefMut for Reduction {
    fn deref_mut(&mut self) -> &mut Interface {
        &mut self.interface
    }
}

impl Reduction {
    /// Square of the lowest frequency that is not a rigid motion's: the unit of modal stiffness.
    pub(crate) fn stiffness_unit(&self) -> f64 {
        let elastic = self.open.modes.iter().map(|m| m.omega).find(|w| *w > 0.0);
        elastic.unwrap_or(self.system.units.frequency).powi(2)
    }

    /// Size that makes an interface term a number of the order of one: the lowest frequency times the root of the unit of energy, [`crate::flow::spectrum::Eigenbasis::root_of_energy`].
    pub(crate) fn force_unit(&self) -> f64 {
        self.force_unit
    }

    /// The modes that are rigid motions.
    pub(super) fn rigid(&self) -> impl Iterator<Item = usize> {
        (0..self.open.frozen().start).filter(|i| self.open.modes[*i].omega == 0.0)
    }

    /// Whether the open body can move rigidly.
    pub fn is_free(&self) -> bool {
        self.rigid().next().is_some()
    }

    /// Solve for the modes, and find the directions.
    pub fn new(system: System, form: Form) -> Result<Reduction, HbmError> {
        super::check_frequencies(&system)?;
        let form = form.of(&system);
        let spectra = Spectra::default();
        let open = spectra.of_set(&system, &States::open(system.n_contact()))?;
        let n = system.n_o();
        let directions = Directions::new(&system, |column| {
            let of_mode = |j: usize| column.iter().map(|&(i, v)| open.shapes[(i, j)] * v).sum();
            let modal: Vec<f64> = (0..n).map(of_mode).collect();
            (modal.clone(), modal)
        });
        let r = directions.pairs.len();
        let q = Mat::from_fn(n, r, |i, c| directions.pairs[c].0[i]);
        let q_in = match form {
            Form::Force => q.clone(),
            Form::Acceleration => Mat::from_fn(n, 2 * r, |i, j| {
                let w = open.modes[i].omega;
                if j < r { q[(i, j)] } else { w * w * q[(i, j - r)] }
            }),
        };
        let lifted = &open.shapes * directions.lifted();
        let interface = Interface::new(system, form, lifted, directions);
        let energy_root = open.root_of_energy(&interface.system);
        let mut new = Reduction { interface, open, spectra, force_unit: 0.0, q, q_in };
        new.force_unit = new.stiffness_unit().sqrt() * energy_root;
        Ok(new)
    }

    /// Number of modes.
    pub fn n(&self) -> usize {
        self.open.modes.len()
    }

    /// Change the damping. Phases that are known stand: `β` must be what it was, and in the acceleration form `α` is not in them.
    pub(super) fn set_damping(&mut self, damping: Rayleigh) -> Result<(), HbmError> {
        debug_assert!(self.form == Form::Acceleration || self.system.contact_has_inertia());
        debug_assert!(self.system.damping.is_some_and(|d| d.beta == damping.beta));
        self.system.damping = Some(damping);
        let open = States::open(self.system.n_contact());
        self.open = self.spectra.of_set(&self.system, &open)?;
        Ok(())
    }

    /// `x = (u_O, u̇_O)` of modal displacements and their rates by `θ`.
    pub fn state(&self, q: &[f64], dq: &[f64], omega: f64) -> State {
        let n = self.n();
        let both: Vec<f64> = q.iter().copied().chain(dq.iter().map(|d| omega * d)).collect();
        let mut x = vec![0.0; 2 * n];
        self.open.state_of_modes(&both, &mut x);
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
}
