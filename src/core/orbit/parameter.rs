//! A number that the equations depend on, and what it changes of a phase at a fixed state.
//!
//! Nothing of a phase is differentiated by itself: a parameter comes as the systems at `p + s_k h`, and any quantity `f` of a phase that both know has
//!
//! ```text
//! ∂f/∂p = Σ_k w_k f(p + s_k h)        s = −2, −1, 1, 2,   w = (1, −8, 8, −1)/12h
//! ```
//!
//! up to `h⁴/30 ∂⁵f/∂p⁵`: exact for loads, gaps, stiffnesses and masses, which are polynomials of low degree in what they are made of. Motions are not compared: their
//! derivative is an integral over the phase ([`super::tangent`]).

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use faer::Mat;

use crate::contact::{Phase, Rayleigh, Slider, States, System};

/// What a parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A number of the equations alone.
    Operators,
    /// The circular frequency of the orbit, and of its loads.
    Frequency,
    /// The viscosity `β` of a viscous orbit.
    Viscosity,
}

/// The system at a value of the parameter beside the one that is looked at.
#[derive(Debug)]
pub struct Neighbour {
    /// `s_k h`
    pub offset: f64,
    /// `w_k`
    pub weight: f64,
    /// The operators there.
    pub system: System,
}

/// Phases of an active set in all neighbours.
type Phases = Rc<Vec<Phase>>;

/// A parameter.
#[derive(Debug)]
pub struct Parameter {
    /// What it is.
    pub kind: Kind,
    /// Its value.
    pub value: f64,
    /// The systems beside.
    neighbours: Vec<Neighbour>,
    phases: RefCell<HashMap<States, Phases>>,
    /// What stretches of a motion add to a column, by their ends.
    sources: RefCell<HashMap<[u64; 2], Rc<Mat<f64>>>>,
}

/// Step of differences of operators, over the number: what is left out, `h⁴`, and what rounding makes of `1/h` are both some 1e-13.
pub const STEP: f64 = 1.0 / 2048.0;
/// The same of the frequency: a load turns by `ωt` in a period, and `(ωt h)⁴/30` is left out.
const FREQUENCY_STEP: f64 = 1.0 / 4096.0;

/// Where a difference takes its values, in steps, and the weights over the step.
#[derive(Debug, Clone, Copy)]
pub enum Stencil {
    /// On both sides.
    Central,
    /// At larger values only, or at smaller ones.
    OneSided(f64),
}

impl Stencil {
    /// Offsets and weights of a step.
    pub fn points(self, step: f64) -> Vec<(f64, f64)> {
        match self {
            Stencil::Central => {
                let all = [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)];
                all.map(|(s, w)| (s * step, w / (12.0 * step))).to_vec()
            }
            Stencil::OneSided(side) => {
                let all = [(0.0, -25.0), (1.0, 48.0), (2.0, -36.0), (3.0, 16.0), (4.0, -3.0)];
                let step = side * step;
                all.map(|(s, w)| (s * step, w / (12.0 * step))).to_vec()
            }
        }
    }
}

impl Parameter {
    /// Of the systems beside.
    pub fn new(kind: Kind, value: f64, neighbours: Vec<Neighbour>) -> Parameter {
        Parameter {
            kind,
            value,
            neighbours,
            phases: RefCell::default(),
            sources: RefCell::default(),
        }
    }

    /// The circular frequency of an orbit of a system, and of its loads.
    pub fn frequency(system: &System, omega: f64) -> Parameter {
        Parameter::of_orbit(Kind::Frequency, system, omega, FREQUENCY_STEP * omega)
    }

    /// The viscosity of a viscous orbit of a system.
    pub fn viscosity(system: &System, beta: f64) -> Parameter {
        Parameter::of_orbit(Kind::Viscosity, system, beta, STEP * beta)
    }

    fn of_orbit(kind: Kind, system: &System, value: f64, step: f64) -> Parameter {
        let beside = |(offset, weight)| Neighbour { offset, weight, system: system.clone() };
        let points = Stencil::Central.points(step).into_iter();
        Parameter::new(kind, value, points.map(beside).collect())
    }

    /// The systems beside.
    pub fn neighbours(&self) -> &[Neighbour] {
        &self.neighbours
    }

    /// The neighbours under the damping and at the load frequency of an orbit: of viscous ones the damping belongs to the orbit.
    pub(super) fn adapt(&mut self, damping: Option<Option<Rayleigh>>, omega: f64) {
        self.phases.get_mut().clear();
        self.sources.get_mut().clear();
        for n in &mut self.neighbours {
            if let Some(damping) = damping {
                let more = if self.kind == Kind::Viscosity { n.offset } else { 0.0 };
                n.system.damping = damping.map(|d| Rayleigh { beta: d.beta + more, ..d });
            }
            let more = if self.kind == Kind::Frequency { n.offset } else { 0.0 };
            n.system.loads_mut().set_frequency(omega + more);
        }
    }

    fn phases(&self, set: &States) -> Phases {
        if let Some(known) = self.phases.borrow().get(set) {
            return Rc::clone(known);
        }
        let new: Phases = Rc::new(self.neighbours.iter().map(|n| n.system.phase(set)).collect());
        self.phases.borrow_mut().insert(set.clone(), Rc::clone(&new));
        new
    }

    /// What a stretch of the one motion that is looked at adds to a column: computed once.
    pub(super) fn source<E>(
        &self,
        span: (f64, f64),
        compute: impl FnOnce() -> Result<Mat<f64>, E>,
    ) -> Result<Rc<Mat<f64>>, E> {
        let key = [span.0.to_bits(), span.1.to_bits()];
        if let Some(known) = self.sources.borrow().get(&key) {
            return Ok(Rc::clone(known));
        }
        let new = Rc::new(compute()?);
        self.sources.borrow_mut().insert(key, Rc::clone(&new));
        Ok(new)
    }

    /// `∂f/∂p` of several numbers of a phase.
    pub(super) fn differences(
        &self,
        set: &States,
        f: impl Fn(&System, &Phase) -> Vec<f64>,
    ) -> Vec<f64> {
        let phases = self.phases(set);
        let mut sum = vec![];
        for (n, phase) in self.neighbours.iter().zip(phases.iter()) {
            let values = f(&n.system, phase);
            sum.resize(values.len(), 0.0);
            sum.iter_mut().zip(&values).for_each(|(s, x)| *s += n.weight * x);
        }
        sum
    }

    /// `∂ü_O/∂p` at some states of a phase, one behind the other: times, `u_O` and `u̇_O`.
    pub(super) fn accelerations(
        &self,
        set: &States,
        times: &[f64],
        [u, v]: [&[f64]; 2],
    ) -> Vec<f64> {
        self.differences(set, |system, phase| accelerations(system, phase, times, [u, v]))
    }

    /// `∂h/∂p` of a monitor of a phase at a fixed state.
    pub(super) fn monitor(&self, set: &States, k: usize, t: f64, [u, v]: [&[f64]; 2]) -> f64 {
        let of = |_: &System, phase: &Phase| vec![phase.monitor_values(t, u, v)[k]];
        self.differences(set, of)[0]
    }

    /// `∂/∂p` of where displacements are held that rest on an obstacle.
    pub(super) fn holds(&self, set: &States) -> Vec<(usize, f64)> {
        if self.neighbours.iter().all(|n| n.system.impact().is_none()) {
            return vec![];
        }
        let rows = self.phases(set).first().map_or(vec![], Phase::held_displacements);
        let places = |_: &System, phase: &Phase| phase.held_places().iter().map(|h| h.1).collect();
        rows.into_iter().zip(self.differences(set, places)).collect()
    }

    /// Whether the surfaces that points of a phase stick to move at another speed: what a tangent does not know.
    pub(super) fn moves_surfaces(&self, set: &States) -> bool {
        let speeds = |phase: &Phase| -> Vec<f64> { phase.stuck().iter().map(|s| s.1).collect() };
        let phases = self.phases(set);
        phases.windows(2).any(|two| speeds(&two[0]) != speeds(&two[1]))
    }

    /// `∂/∂p` of what springs of sliders are elongated by at their limits.
    pub(super) fn elongations(&self, set: &States) -> Vec<f64> {
        self.differences(set, |system, _| {
            let of = |s: &Slider| s.elastic.map_or(0.0, |e| s.limit / e.stiffness);
            system.sliders().iter().map(of).collect()
        })
    }

    /// `∂u̇⁺/∂p` behind an impact from velocities before it.
    pub(super) fn impulse(&self, before: &States, struck: &[usize], v: &[f64]) -> Vec<f64> {
        self.differences(before, |system, _| {
            let mut change = vec![0.0; v.len()];
            let Some(map) = system.impact().and_then(|law| law.blow(struck, before)) else {
                return change;
            };
            for (column, row) in map.columns.iter().zip(&map.rows) {
                let along: f64 = row.iter().map(|&(j, x)| x * v[j]).sum();
                change.iter_mut().zip(column).for_each(|(c, x)| *c -= x * along);
            }
            change
        })
    }

    /// How far a narrower difference of the accelerations is from the wider one, over its size: large where the parameter does not enter smoothly.
    pub(super) fn roughness(&self, set: &States, t: f64, [u, v]: [&[f64]; 2]) -> f64 {
        let phases = self.phases(set);
        let at = |k: usize| accelerations(&self.neighbours[k].system, &phases[k], &[t], [u, v]);
        let wide = self.accelerations(set, &[t], [u, v]);
        // the two nearest values: on either side, or this one and the next
        let [a, b] = if self.neighbours.len() == 4 { [1, 2] } else { [0, 1] };
        let span = self.neighbours[b].offset - self.neighbours[a].offset;
        let (low, high) = (at(a), at(b));
        let (mut apart, mut size) = (0.0, 0.0);
        for i in 0..u.len() {
            apart += ((high[i] - low[i]) / span - wide[i]).powi(2);
            // what rounding makes of a difference
            size += wide[i].powi(2) + (1e-9 * high[i] / span).powi(2);
        }
        (apart / f64::max(size, f64::MIN_POSITIVE)).sqrt()
    }
}

/// `ü_O` at some states of a phase, one behind the other. What an impact law holds is where it is held, whatever the state says: of a neighbour somewhere else.
fn accelerations(system: &System, phase: &Phase, times: &[f64], [u, v]: [&[f64]; 2]) -> Vec<f64> {
    let n = u.len() / times.len().max(1);
    let held = match system.impact() {
        Some(_) => phase.held_places(),
        None => vec![],
    };
    let mut scratch = system.scratch();
    let (mut u, mut all) = (u.to_vec(), vec![0.0; u.len()]);
    for (k, a) in all.chunks_exact_mut(n.max(1)).enumerate() {
        let of = k * n..(k + 1) * n;
        let there = &mut u[of.clone()];
        held.iter().for_each(|&(j, x)| there[j] = x);
        phase.acceleration(times[k], there, &v[of], &mut scratch, a);
    }
    all
}
