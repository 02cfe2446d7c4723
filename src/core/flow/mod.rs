//! The flow of one smooth phase.
//!
//! A [`Flow`] carries the extended state `y = (u_O, u̇_O, W, D)`: displacements, velocities and, where the scene has
//! them, the work of harmonic loads and the dissipated energy. It advances window by window; inside a window
//! it knows the state at every time and encloses every monitor between bounds.

#[doc(hidden)]
pub mod auto;
pub(crate) mod bernstein;
pub(crate) mod cache;
pub(crate) mod chebyshev;
pub(crate) mod choice;
pub(crate) mod coupled;
mod defect;
pub mod dop853;
pub mod dopri5;
pub(crate) mod drives;
mod eigenpairs;
mod exponential;
mod held;
pub(crate) mod modal;
pub(crate) mod motion;
pub(crate) mod oscillator;
mod rubbing;
pub(crate) mod runge_kutta;
pub(crate) mod sliding;
pub(crate) mod spectrum;
#[doc(hidden)]
pub mod tableau;
pub(crate) mod trigonometry;
mod values;

pub use bernstein::Bernstein;
pub use chebyshev::{Chebyshev, Tangent, Zoned};
pub use choice::{Choice, exact};
pub use modal::Modal;
pub use runge_kutta::{RungeKutta, Tolerances};
pub use spectrum::{ComplexMode, complex_modes};

use std::ops::Range;

use crate::contact::{Phase, RubbingRates, System};
use thiserror::Error;

/// A monitor on `[a, b]`: a polynomial, and how far the monitor may be from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosure {
    /// Approximation over `[a, b]`, argument scaled to `[0, 1]`.
    pub polynomial: Bernstein,
    /// `|h − polynomial| ≤ error`, and no error at both ends.
    pub error: f64,
    /// `|h′ − polynomial′| ≤ slope_error`, derivatives with respect to the scaled argument.
    pub slope_error: f64,
}

impl Enclosure {
    /// The cubic Hermite interpolant of `(value, slope)` at both ends of an interval, where the fourth derivative is
    /// known not to exceed `fourth` (theory §12, H2): `|h − H| ≤ fourth·length⁴/384`, `|h′ − H′| ≤ fourth·length³·√3/216`.
    pub(crate) fn hermite(a: (f64, f64), b: (f64, f64), length: f64, fourth: f64) -> Enclosure {
        let ((ha, da), (hb, db)) = (a, b);
        let third = length / 3.0;
        let polynomial = Bernstein::new(&[ha, ha + third * da, hb - third * db, hb]);
        let scale = fourth * length.powi(4);
        Enclosure { polynomial, error: scale / 384.0, slope_error: scale * 3f64.sqrt() / 216.0 }
    }

    /// The enclosure of a sum on the same interval.
    pub fn plus(&self, other: &Enclosure) -> Enclosure {
        Enclosure {
            polynomial: self.polynomial.plus(&other.polynomial),
            error: self.error + other.error,
            slope_error: self.slope_error + other.slope_error,
        }
    }
}

/// Work done, for cost tests and reports.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counters {
    /// Evaluations of the right-hand side.
    pub rhs_evaluations: u64,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Products with `M_α⁻¹K_α` (Chebyshev).
    pub products: u64,
    /// Rows of the body's matrices that evaluations and products read, times vectors.
    pub rows: u64,
    /// Eigensolutions of phases.
    pub factorisations: u64,
}

impl std::ops::Add for Counters {
    type Output = Counters;
    fn add(self, other: Counters) -> Counters {
        Counters {
            rhs_evaluations: self.rhs_evaluations + other.rhs_evaluations,
            steps: self.steps + other.steps,
            rejected: self.rejected + other.rejected,
            products: self.products + other.products,
            rows: self.rows + other.rows,
            factorisations: self.factorisations + other.factorisations,
        }
    }
}

/// A smooth phase could not be continued.
#[derive(Debug, Error, Clone, Copy, PartialEq)]
pub enum FlowError {
    /// The step fell below the time resolution.
    #[error("the step size fell to {h:.3e} at t = {t:.9}")]
    StepTooSmall {
        /// Time.
        t: f64,
        /// Step.
        h: f64,
    },
    /// The modes of the phase could not be computed.
    #[error("the modes of the phase that starts at t = {t:.9} could not be computed")]
    NoModes {
        /// Time.
        t: f64,
    },
    /// No bound of the natural frequencies is known for the contact method on this body.
    #[error(
        "no bound of the natural frequencies is known here, which chebyshev needs; use auto, modal or dop853"
    )]
    NoBound,
    /// The state is no longer finite.
    #[error("the state is not finite after t = {t:.9}")]
    NotFinite {
        /// Time.
        t: f64,
    },
}

/// Layout of the extended state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Length of `u_O`.
    pub n_o: usize,
    /// Position of the work of loads that change in time.
    pub work: Option<usize>,
    /// Position of the dissipated energy.
    pub dissipated: Option<usize>,
    /// What friction does.
    pub rubbed: Option<FrictionPlaces>,
}

/// Places of the integrals of friction: the work of moving surfaces, then of each contact point what friction took and how far it slipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrictionPlaces {
    first: usize,
    points: usize,
}

impl FrictionPlaces {
    /// All places.
    pub fn all(&self) -> Range<usize> {
        self.first..self.first + 1 + 2 * self.points
    }

    /// Add rates over a time.
    pub(crate) fn add(&self, y: &mut [f64], point: usize, rates: &RubbingRates, h: f64) {
        y[self.first] += h * rates.belt;
        y[self.first + 1 + 2 * point] += h * rates.work;
        y[self.first + 2 + 2 * point] += h * rates.path;
    }

    /// Work of moving surfaces on the body.
    pub fn belt(&self, y: &[f64]) -> f64 {
        y[self.first]
    }

    /// Of each contact point: what friction took, how far it slipped.
    pub fn of_points<'y>(&self, y: &'y [f64]) -> impl Iterator<Item = (f64, f64)> + use<'y> {
        let (first, points) = (self.first, self.points);
        (0..points).map(move |i| (y[first + 1 + 2 * i], y[first + 2 + 2 * i]))
    }
}

impl Layout {
    /// The layout that a body with its loads and damping needs.
    pub fn new(system: &System) -> Layout {
        let n_o = system.n_o();
        let work = system.loads.is_driven().then_some(2 * n_o);
        let rubs = system.tangents().is_some();
        let loses = system.is_damped() || !(system.has_potential() || rubs);
        let dissipated = loses.then(|| 2 * n_o + usize::from(work.is_some()));
        let first = 2 * n_o + usize::from(work.is_some()) + usize::from(loses);
        let rubbed = rubs.then(|| FrictionPlaces { first, points: system.n_contact() });
        Layout { n_o, work, dissipated, rubbed }
    }

    /// Length of `y`.
    pub fn len(&self) -> usize {
        let integrals = [self.work, self.dissipated].iter().flatten().count();
        2 * self.n_o + integrals + self.rubbed.map_or(0, |r| r.all().len())
    }

    /// Whether there is no state at all.
    pub fn is_empty(&self) -> bool {
        self.n_o == 0
    }

    /// Copy what some displacements do, and the integrals.
    pub fn copy(&self, rows: &Range<usize>, from: &[f64], to: &mut [f64]) {
        let of_v = self.n_o + rows.start..self.n_o + rows.end;
        for part in [rows.clone(), of_v, 2 * self.n_o..self.len()] {
            to[part.clone()].copy_from_slice(&from[part]);
        }
    }

    /// `u_O` of a state.
    pub fn u<'a>(&self, y: &'a [f64]) -> &'a [f64] {
        &y[..self.n_o]
    }

    /// `u̇_O` of a state.
    pub fn v<'a>(&self, y: &'a [f64]) -> &'a [f64] {
        &y[self.n_o..2 * self.n_o]
    }
}

/// The flow of a smooth phase, window by window.
pub trait Flow {
    /// Start (or go on after a switch) at `(t, y)` in a phase.
    fn begin(&mut self, phase: &Phase, t: f64, y: &[f64]);
    /// Compute the next window from the end of the last one, at most to `t_limit`.
    fn advance(&mut self, phase: &Phase, t_limit: f64) -> Result<(), FlowError>;
    /// Shorten the window to end at `t`, with the full accuracy of the method there.
    fn cut(&mut self, phase: &Phase, t: f64);
    /// The window.
    fn window(&self) -> (f64, f64);
    /// State at the end of the window.
    fn end_state(&mut self) -> &[f64];
    /// State at a time in the window.
    fn state(&self, t: f64, y: &mut [f64]);
    /// Displacements of `u_O` around the contact that a state at this time of the window is one of, where the flow follows the others in longer
    /// steps only; none where states are those of the whole body.
    fn near(&self, _t: f64) -> Option<Range<usize>> {
        None
    }
    /// Make the state at the end of the window one of the whole body, at a price.
    fn complete(&mut self, _phase: &Phase) {}
    /// Whether the flow wants to begin anew at the end of the window, in the same phase: a place from which a run can go on later.
    fn is_anchor(&self) -> bool {
        false
    }
    /// Enclosure of the `index`-th monitor of the phase on `[a, b]` inside the window.
    fn enclose(&self, index: usize, a: f64, b: f64) -> Enclosure;
    /// Work done so far.
    fn counters(&self) -> Counters;
    /// Name in a scene.
    fn name(&self) -> &'static str;
    /// Whether states and enclosures are those of the equations themselves, to rounding error, and not of an
    /// approximation (theory §12, H1).
    fn is_exact(&self) -> bool {
        false
    }
    /// How far each monitor of an exact flow may be, at the end of the window, from that of the equations themselves which start in the state of the phase's
    /// start: what the errors of modes and of truncated sums add up to (theory §12, H4). Empty where no phase has begun.
    fn deviations(&self) -> Vec<f64> {
        vec![]
    }
    /// What a reader of the summary should know of the choices that were made.
    fn note(&self) -> Option<String> {
        None
    }
    /// What it has learnt and will use in this phase and those to come (a step size), where it has just begun a phase: for a run that goes on later.
    fn memory(&self) -> Vec<f64> {
        vec![]
    }
    /// Take over what another flow of the same kind had learnt, once both have begun the same phase, or others have.
    fn recall(&mut self, _memory: &[f64]) {}
    /// Begin the phase that another flow of the same kind had begun, with what it had learnt by then.
    fn resume(&mut self, phase: &Phase, (t, y): (f64, &[f64]), memory: &[f64]) {
        self.begin(phase, t, y);
        self.recall(memory);
    }
}
