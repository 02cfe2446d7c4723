//! A body whose balance can be solved at a frequency: what families of solutions need of it.

use super::dynamic::Dynamic;
use super::interface::{Form, Interface};
use super::newton::Settings;
use super::receptance::Receptance;
use super::reduction::Reduction;
use super::series::Series;
use super::solution::Solution;
use super::{HbmError, modes, response};
use crate::contact::System;
use crate::records::GapReason;

/// A body of any size. Its solutions are series of coordinates of its own: those of all modes of the open phase ([`Reduction`]), or the projections on the interface
/// ([`Dynamic`]).
pub trait Balanced {
    /// The contact.
    fn interface(&self) -> &Interface;

    /// Set the frequency of the harmonic loads.
    fn set_frequency(&mut self, omega: f64);

    /// Number of components of a series.
    fn components(&self) -> usize;

    /// Square of the lowest frequency that is not a rigid motion's.
    fn stiffness_unit(&self) -> f64;

    /// Size that makes an interface term a number of the order of one: that of a mode that moves a contact point by the unit of length.
    fn force_unit(&self) -> f64;

    /// Whether the open body can move rigidly.
    fn is_free(&self) -> bool {
        false
    }

    /// One harmonic: the first mode of the open body at `amplitude` times grazing, at the far point at `t = 0`.
    fn mode_start(&self, amplitude: f64) -> Option<Series>;

    /// The solution at a frequency from a guess.
    fn solve(
        &self,
        guess: &Series,
        omega: f64,
        settings: &Settings,
    ) -> Result<Result<Solution, GapReason>, HbmError>;

    /// What the open body answers at the interface.
    fn receptance(&self, n_h: usize, omega: f64) -> Result<Receptance, HbmError>;

    /// The series of interface terms `n`.
    fn series_of(&self, n: &Series, omega: f64) -> Result<Series, HbmError>;

    /// `u_O` of a solution.
    fn displacements(&self, s: &Solution) -> Result<Series, HbmError>;
}

/// Above this number of displacements the open body is known by its dynamic stiffness, not by its modes, unless its modes are what its damping is made of.
const LARGE: usize = 1000;

/// Dampers over more rows, over the displacements, are those of all modes.
const FEW: f64 = 0.1;

/// A body, prepared in the way that suits its size.
pub fn prepare(system: System, form: Form) -> Result<Box<dyn Balanced>, HbmError> {
    let dampers = system.dampers.as_ref().map_or(0, |d| d.rows().n_rows());
    let is_sparse = dampers as f64 <= FEW * system.n_o() as f64;
    Ok(match system.n_o() > LARGE && is_sparse {
        true => Box::new(Dynamic::new(system, form)?),
        false => Box::new(Reduction::new(system, form)?),
    })
}

impl Balanced for Reduction {
    fn interface(&self) -> &Interface {
        self
    }

    fn set_frequency(&mut self, omega: f64) {
        Interface::set_frequency(self, omega);
    }

    fn components(&self) -> usize {
        self.n()
    }

    fn stiffness_unit(&self) -> f64 {
        Reduction::stiffness_unit(self)
    }

    fn force_unit(&self) -> f64 {
        Reduction::force_unit(self)
    }

    fn is_free(&self) -> bool {
        Reduction::is_free(self)
    }

    fn mode_start(&self, amplitude: f64) -> Option<Series> {
        response::mode_start(self, amplitude)
    }

    fn solve(
        &self,
        guess: &Series,
        omega: f64,
        settings: &Settings,
    ) -> Result<Result<Solution, GapReason>, HbmError> {
        modes::solve(self, guess, omega, settings)
    }

    fn receptance(&self, n_h: usize, omega: f64) -> Result<Receptance, HbmError> {
        Ok(modes::Linear::new(self, n_h, omega).receptance)
    }

    fn series_of(&self, n: &Series, omega: f64) -> Result<Series, HbmError> {
        Ok(modes::Linear::new(self, n.n_h, omega).solve(self, n))
    }

    fn displacements(&self, s: &Solution) -> Result<Series, HbmError> {
        let mut u = Series::zeros(s.q.basis, s.q.n_h, self.n());
        let rest = vec![0.0; self.n()];
        for i in 0..s.q.basis.len(s.q.n_h) {
            u.of_mut(i).copy_from_slice(&self.state(s.q.of(i), &rest, 1.0).u);
        }
        Ok(u)
    }
}
