//! Where a run stands: the state at a time, of the whole body or of what is known of it.

use std::ops::Range;

use crate::contact::Phase;
use crate::fem::largest;
use crate::flow::{Flow, Layout};

/// The present state.
pub(super) struct Present {
    pub layout: Layout,
    /// Time of the state `y`.
    pub t: f64,
    pub y: Vec<f64>,
    /// Displacements of `u_O` of which `y` is a state, if these are not all: the others are of an earlier time.
    pub near: Option<Range<usize>>,
    /// Full displacement and velocity, once [`Present::expand`] was called.
    pub u: Vec<f64>,
    pub v: Vec<f64>,
}

impl Present {
    /// At rest, at time zero.
    pub fn new(layout: Layout, n: usize) -> Present {
        let y = vec![0.0; layout.len()];
        Present { layout, t: 0.0, y, near: None, u: vec![0.0; n], v: vec![0.0; n] }
    }

    pub fn u_o(&self) -> &[f64] {
        self.layout.u(&self.y)
    }

    pub fn v_o(&self) -> &[f64] {
        self.layout.v(&self.y)
    }

    /// Displacements of `u_O` of which the present state is one.
    pub fn known(&self) -> Range<usize> {
        self.near.clone().unwrap_or(0..self.layout.n_o)
    }

    /// The state of a flow at a time in its window becomes the present one.
    pub fn take(&mut self, flow: &dyn Flow, t: f64) {
        self.t = t;
        self.near = flow.near(t);
        flow.state(t, &mut self.y);
    }

    /// The state at the end of the window becomes the present one.
    pub(crate) fn take_end(&mut self, flow: &mut dyn Flow, t: f64) {
        self.t = t;
        let rows = flow.near(t);
        let end = flow.end_state();
        match &rows {
            None => self.y.copy_from_slice(end),
            Some(rows) => self.layout.copy(rows, end, &mut self.y),
        }
        self.near = rows;
    }

    /// Full displacement and velocity in a phase.
    pub fn expand(&mut self, phase: &Phase) {
        let rows = self.known();
        self.u[rows.clone()].copy_from_slice(&self.layout.u(&self.y)[rows.clone()]);
        self.v[rows.clone()].copy_from_slice(&self.layout.v(&self.y)[rows]);
        phase.complete_displacement(self.t, &mut self.u);
        phase.complete_velocity(self.t, &mut self.v);
    }

    /// Whether it is one of numbers.
    pub fn is_finite(&self) -> bool {
        let rows = self.known();
        let integrals = &self.y[2 * self.layout.n_o..];
        let all = self.u_o()[rows.clone()].iter().chain(&self.v_o()[rows]).chain(integrals);
        all.into_iter().all(|x| x.is_finite())
    }

    /// Values of the monitors of a phase.
    pub fn monitors(&self, phase: &Phase) -> Vec<f64> {
        phase.monitor_values(self.t, self.u_o(), self.v_o())
    }

    /// Largest velocity that is known.
    pub(crate) fn largest_v(&self) -> f64 {
        largest(&self.v_o()[self.known()])
    }

    /// Largest displacement that is known.
    pub fn largest_u(&self) -> f64 {
        largest(&self.u_o()[self.known()])
    }
}
