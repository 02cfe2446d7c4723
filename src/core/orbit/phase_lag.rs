//! Phase resonance: the displacement lags a quarter of a period behind the loads, and the frequency is steered there.
//!
//! Of loads `Re(f̂ e^{iωt})` and the first harmonic `û` of the displacements over a period,
//!
//! ```text
//! p = f̂ᴴ û ,   û = (2/T) ∫ u e^{−iωt} dt ,   W = −π Im p
//! ```
//!
//! `W` is the work of the loads, and `−arg p` the lag of the displacement that they work on. At a lag of `π/2` elastic and inertial forces need nothing of the loads: these
//! make up for what damping takes, and the body moves about as it would without both. As in a laboratory a loop finds the frequency: once a period
//!
//! ```text
//! e = arg p + π/2 ,   s ← s + k_i e ,   ω ← s + k_p e
//! ```
//!
//! and the phase of the loads goes on continuously.

use std::convert::Infallible;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Complex;

use super::attractor::{Look, STATES};
use super::chain::Propagator;
use super::period_map::integrate_with;
use super::{OrbitError, tolerate};
use crate::contact::System;
use crate::continuation::Go;
use crate::event::{Observer, Sample, Switch};

/// Of three points of Gauss on (0, 1): places and weights.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 5.0 / 18.0),
    (0.5, 4.0 / 9.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];
/// A body whose modes are not damped is steered as if they were, by so much of their frequency.
const UNDAMPED: f64 = 0.02;

/// What is seen of a period of the loads.
#[derive(Debug, Clone)]
pub struct Period {
    /// `p`
    pub power: Complex<f64>,
    /// Largest displacement of a contact point.
    pub amplitude: f64,
    /// Largest force of all contact points together.
    pub force: f64,
    /// Largest energy.
    pub energy: f64,
    /// Largest kinetic energy.
    pub kinetic: f64,
    /// The frame vector at its end.
    pub z: Vec<f64>,
}

/// A displacement along the loads: `f̂ᴴu` and `f̂ᴴu̇` at a time.
#[derive(Debug, Clone, Copy)]
struct Knot {
    t: f64,
    x: Complex<f64>,
    v: Complex<f64>,
}

/// Takes the first harmonic of the displacement along the loads, and looks at the contact.
struct LockIn<'a> {
    look: Look<'a>,
    /// `f̂`
    force: Vec<Complex<f64>>,
    omega: f64,
    last: Option<Knot>,
    /// Velocities may jump where the next state is.
    switched: bool,
    /// `∫ f̂ᴴu e^{−iωt} dt`
    sum: Complex<f64>,
}

impl LockIn<'_> {
    /// The integral from one state to the next: between them the cubic through displacements and velocities.
    fn pass(&mut self, a: Knot, mut b: Knot) {
        let h = b.t - a.t;
        if h <= 0.0 {
            return;
        }
        let slope = (b.x - a.x) / h;
        if self.switched {
            // what it was before the switch is not told: a parabola
            b.v = slope * 2.0 - a.v;
        }
        let bend = a.v + b.v - slope * 2.0;
        for (s, weight) in GAUSS {
            let x = a.x + (a.v + (slope * 3.0 - a.v * 2.0 - b.v + bend * s) * s) * (h * s);
            self.sum += x * Complex::from_polar(h * weight, -self.omega * (a.t + h * s));
        }
    }
}

impl Observer for LockIn<'_> {
    type Error = Infallible;

    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        self.look.sample(s)?;
        let [u, v, _] = s.at_rest(&self.look.body.system.loads);
        let along = |x: &[f64]| self.force.iter().zip(x).map(|(f, x)| f.conj() * *x).sum();
        let knot = Knot { t: s.t, x: along(&u), v: along(&v) };
        if let Some(last) = self.last {
            self.pass(last, knot);
        }
        (self.last, self.switched) = (Some(knot), false);
        Ok(())
    }

    fn switch(&mut self, switch: &Switch) -> Result<(), Infallible> {
        self.switched = true;
        self.look.switch(switch)
    }

    fn looks_behind_switches(&self) -> usize {
        self.look.looks_behind_switches()
    }

    fn progress(&mut self, _: f64) -> Result<Go, Infallible> {
        Ok(if self.look.body.is_stopped() { Go::Break(()) } else { Go::Continue(()) })
    }
}

/// `f̂` of the harmonic loads of a body, over all displacements.
pub(super) fn loads(system: &System) -> Vec<Complex<f64>> {
    let mut all = vec![Complex::default(); system.n()];
    for load in system.loads.harmonics.iter().filter(|load| !load.damps) {
        let turn = Complex::from_polar(load.size(), load.angle());
        all.iter_mut().zip(&load.force).for_each(|(all, f)| *all += turn * *f);
    }
    all
}

/// What is seen of the largest values of an orbit is that of so many times as many states.
const FINE: usize = 8;

/// A period of loads of frequency `omega` from the frame vector `z`; none where the motion could not be followed.
pub fn period(body: &mut Propagator, z: &[f64], omega: f64) -> Result<Option<Period>, OrbitError> {
    seen(body, z, omega, STATES)
}

/// The same by so many states, and by parabolas through them.
fn seen(
    body: &mut Propagator,
    z: &[f64],
    omega: f64,
    states: usize,
) -> Result<Option<Period>, OrbitError> {
    body.system.loads_mut().set_frequency(omega);
    let body = &*body;
    let until = TAU / omega;
    let mut lock_in = LockIn {
        look: Look::new(body, until, states),
        force: loads(&body.system),
        omega,
        last: None,
        switched: false,
        sum: Complex::default(),
    };
    let passage = integrate_with(body, &body.state(z), until, states, &mut lock_in);
    let Some(passage) = tolerate(passage)? else { return Ok(None) };
    let LockIn { look, sum, .. } = lock_in;
    let [force, energy, kinetic] = look.sums();
    Ok(Some(Period {
        power: sum * (2.0 / until),
        amplitude: look.amplitude(),
        force,
        energy,
        kinetic,
        z: body.frame(&passage.report.last),
    }))
}

/// How far the lag of a displacement is from a quarter turn, of which `p` is known.
pub(super) fn error_of(power: Complex<f64>) -> f64 {
    let e = power.arg() + FRAC_PI_2;
    if e > PI { e - TAU } else { e }
}

impl Period {
    /// How far the lag is from a quarter turn: `e`.
    pub fn error(&self) -> f64 {
        error_of(self.power)
    }

    /// The lag, in radians.
    pub fn lag(&self) -> f64 {
        FRAC_PI_2 - self.error()
    }

    /// `W`
    pub fn work(&self) -> f64 {
        -PI * self.power.im
    }

    /// Look again, by more states, at the largest values of a period from `z` of the frequency `omega`.
    pub fn refine(
        &mut self,
        body: &mut Propagator,
        z: &[f64],
        omega: f64,
    ) -> Result<(), OrbitError> {
        if let Some(fine) = seen(body, z, omega, FINE * STATES)? {
            let Period { amplitude, force, energy, kinetic, .. } = fine;
            (self.amplitude, self.force) = (amplitude, force);
            (self.energy, self.kinetic) = (energy, kinetic);
        }
        Ok(())
    }

    /// As an instrument reads it that is off: by a relative error in what it tells, and by an angle in the lag.
    pub fn read(mut self, [power, lag, amplitude, force]: [f64; 4]) -> Period {
        self.power *= Complex::from_polar(1.0 + power, lag);
        self.amplitude *= 1.0 + amplitude;
        self.force *= 1.0 + force;
        self
    }
}

/// Gains of a loop, of frequency over radians of lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// `k_p`
    pub proportional: f64,
    /// `k_i`, a period.
    pub integral: f64,
}

impl Gains {
    /// For a body that vibrates about as its mode next to a frequency does, whose decay rate is `α`. With `ε = αT/2`, by how much it decays in a period,
    ///
    /// ```text
    /// k_p = 2α/(1 + 4ε) ,   k_i = (1 − e^{−2ε}) k_p
    /// ```
    ///
    /// A lag settles by `ε` a period, and changes by `2/α` with the frequency, by less where the body touches. In periods, an error and its sum then follow about
    /// `λ² + 5ελ + 8ε² = 0`: as fast as the body itself, with little overshoot.
    pub fn of(body: &Propagator, omega: f64) -> Gains {
        let away = |w: f64| (w - omega).abs();
        let modes = body.home.modes.iter();
        let mode = modes.min_by(|a, b| away(a.omega).total_cmp(&away(b.omega)));
        let decay = mode.map(|m| 2.0 * m.c).filter(|decay| *decay > 0.0);
        let decay = decay.unwrap_or(UNDAMPED * omega);
        let in_period = PI * decay / omega;
        let proportional = 2.0 * decay / (1.0 + 4.0 * in_period);
        Gains { proportional, integral: -proportional * (-2.0 * in_period).exp_m1() }
    }

    /// `ε` of the body that they are for.
    pub fn decay(self) -> f64 {
        -0.5 * (-(self.integral / self.proportional).min(0.99)).ln_1p()
    }
}

/// A loop that steers a frequency.
#[derive(Debug, Clone, Copy)]
pub struct Steering {
    gains: Gains,
    /// `s`
    sum: f64,
    /// `ω`
    pub omega: f64,
}

impl Steering {
    /// From a frequency on.
    pub fn new(omega: f64, gains: Gains) -> Steering {
        Steering { gains, sum: omega, omega }
    }

    /// The frequency of the next period.
    pub fn steer(&mut self, e: f64) {
        self.sum += self.gains.integral * e;
        self.omega = self.sum + self.gains.proportional * e;
    }
}
