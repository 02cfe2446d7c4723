//! The body at the values of a number that the equations depend on, its states told in one frame.
//!
//! Frame vectors are written in the modes of a body, and these change with the number: they turn, cross, take other signs. Along a curve over the number states are written in the
//! frame of one of its values. With the modes `Φ°` and frequencies `Ω°` of that one,
//!
//! ```text
//! z = C y ,   C = diag(Ω Φ⁻¹Φ° Ω°⁻¹, Φ⁻¹Φ°)
//! ```
//!
//! and the derivative of a map is `C⁻¹ X C`.

use faer::{Mat, MatRef};

use super::OrbitError;
use super::chain::Propagator;
use super::section::Section;
use crate::contact::{State, System};
use crate::fem::dense::product;

/// What makes the system at a value.
pub type Make<'a> = dyn FnMut(f64) -> Result<System, OrbitError> + 'a;

/// Bodies that are kept: those of a point of a curve and of its differences.
const KEPT: usize = 4;

/// The bodies, the ones of the last values kept.
pub struct Bodies<'a> {
    make: &'a mut Make<'a>,
    /// The body whose frame states are written in, at the origin of time.
    pub frame: Propagator,
    periods: usize,
    section: f64,
    kept: Vec<Valued>,
}

/// The body at a value.
pub(super) struct Valued {
    value: f64,
    /// From the section on.
    pub body: Propagator,
    /// The section.
    pub section: Section,
    /// `Φ⁻¹Φ°` and its inverse, if modes differ.
    modes: Option<[Mat<f64>; 2]>,
    /// Of the frame: `Ω°`.
    scale: Vec<f64>,
}

impl<'a> Bodies<'a> {
    /// In the frame of the body at a value, for orbits of so many periods of the loads.
    pub fn new(
        make: &'a mut Make<'a>,
        value: f64,
        periods: usize,
    ) -> Result<Bodies<'a>, OrbitError> {
        let frame = Propagator::new(make(value)?)?;
        Ok(Bodies { make, frame, periods, section: 0.0, kept: vec![] })
    }

    /// The instant of the loads at which states are taken, in their periods.
    pub(super) fn section(&self) -> f64 {
        self.section
    }

    /// Take states at another instant of the loads.
    pub(super) fn set_section(&mut self, at: f64) {
        self.section = at;
        self.kept.clear();
    }

    /// The body at a value.
    pub(super) fn at(&mut self, value: f64) -> Result<&mut Valued, OrbitError> {
        match self.kept.iter().position(|v| v.value.to_bits() == value.to_bits()) {
            Some(k) => self.kept[..=k].rotate_right(1),
            None => {
                let new = self.valued(value)?;
                self.kept.truncate(KEPT - 1);
                self.kept.insert(0, new);
            }
        }
        Ok(&mut self.kept[0])
    }

    /// The body itself at a value.
    pub fn body(&mut self, value: f64) -> Result<&mut Propagator, OrbitError> {
        Ok(&mut self.at(value)?.body)
    }

    fn valued(&mut self, value: f64) -> Result<Valued, OrbitError> {
        let system = (self.make)(value)?;
        let n = |s: &System| [s.n_o(), s.n(), s.n_contact()];
        if n(&system) != n(&self.frame.system) {
            return Err(OrbitError::Value(value, "the body has other displacements".into()));
        }
        let mut body = Propagator::new(system)?;
        let (here, there) = (&body.home, &self.frame.home);
        let modes = match here.shapes == there.shapes {
            true => None,
            false => Some([
                product(here.inverse.as_ref(), there.shapes.as_ref()),
                product(there.inverse.as_ref(), here.shapes.as_ref()),
            ]),
        };
        let mut section = Section::new(&body, self.periods);
        section.set(&mut body, self.section);
        Ok(Valued { value, body, section, modes, scale: self.frame.scale.clone() })
    }

    /// The frame vector in the body's own frame.
    pub fn in_body(&mut self, value: f64, y: &[f64]) -> Result<Vec<f64>, OrbitError> {
        let state = self.frame.state(y);
        Ok(self.at(value)?.body.frame(&state))
    }

    /// The way back.
    pub fn out_of_body(&mut self, value: f64, z: &[f64]) -> Result<Vec<f64>, OrbitError> {
        let state = self.at(value)?.body.state(z);
        Ok(self.frame.frame(&state))
    }
}

impl Valued {
    fn is_same(&self) -> bool {
        self.modes.is_none() && self.body.scale == self.scale
    }

    /// All displacements and velocities of a state at the origin of time.
    pub fn full(&mut self, state: &State, omega: f64) -> Result<[Vec<f64>; 2], OrbitError> {
        let at = self.section.at();
        self.section.set(&mut self.body, 0.0);
        self.body.system.loads_mut().set_frequency(omega);
        let full = state.full(&self.body.system);
        self.section.set(&mut self.body, at);
        Ok(full?.into())
    }

    /// `C⁻¹ R` of rows, the first of which are those of states.
    pub fn rows_out_of_body(&self, r: &Mat<f64>) -> Mat<f64> {
        if self.is_same() {
            return r.clone();
        }
        let n = self.body.n();
        let mut all = r.clone();
        let place = |k: usize| if k < n { 1.0 / self.body.scale[k] } else { 1.0 };
        let scaled = Mat::from_fn(2 * n, r.ncols(), |i, k| place(i) * r[(i, k)]);
        for half in 0..2 {
            let part = scaled.subrows(half * n, n);
            let part = self.turned(1, part);
            for k in 0..r.ncols() {
                for i in 0..n {
                    let scale = if half == 0 { self.scale[i] } else { 1.0 };
                    all[(half * n + i, k)] = scale * part[(i, k)];
                }
            }
        }
        all
    }

    /// `X C` of columns, the first of which are those of states.
    pub fn columns_in_body(&self, x: &Mat<f64>) -> Mat<f64> {
        if self.is_same() {
            return x.clone();
        }
        let n = self.body.n();
        // of C the columns of displacements and of velocities
        let identity = Mat::<f64>::identity(n, n);
        let turn = self.turned(0, identity.as_ref());
        let mut all = x.clone();
        for half in 0..2 {
            let scale = |i: usize, s: &[f64]| if half == 0 { s[i] } else { 1.0 };
            let c = Mat::from_fn(n, n, |i, k| {
                scale(i, &self.body.scale) * turn[(i, k)] / scale(k, &self.scale)
            });
            let part = product(x.subcols(half * n, n), c.as_ref());
            all.subcols_mut(half * n, n).copy_from(&part);
        }
        all
    }

    fn turned(&self, which: usize, b: MatRef<f64>) -> Mat<f64> {
        self.modes.as_ref().map_or_else(|| b.to_owned(), |m| product(m[which].as_ref(), b))
    }
}
