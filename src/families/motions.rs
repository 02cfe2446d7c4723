//! The motions of a stored family over their periods, point by point: what one looks at.

use std::collections::HashMap;
use std::convert::Infallible;

use ndarray::Array2;

use super::FamilyError;
use crate::contact::{Rayleigh, State};
use crate::event::{self, Energies, Observer, Options, RunError, Sample};
use crate::fem::Body;
use crate::hbm::HbmError;
use crate::hbm::check::{Candidate, Rubbing};
use crate::orbit::{OrbitError, Propagator, period_map};
use crate::problem::Problem;
use crate::records::{PointRecord, Solver};
use crate::scenario::Scene;
use crate::store::{Stored, StoredFamily, StoredMoving, StoredSwings};

/// The motions of a family, whose bodies (one for each damping ratio) are set up as they are needed.
pub struct Motions<'s> {
    scene: &'s Scene,
    /// The body without a motion.
    rest: Stored,
    family: StoredFamily,
    /// By the damping ratio in percent, as bits.
    bodies: HashMap<Option<u64>, Propagator>,
    set_up: SetUp<'s>,
}

/// How the problem of a scene is set up.
pub type SetUp<'s> = &'s dyn Fn(&Scene) -> Result<Problem, String>;

/// Why there is no motion.
#[derive(Debug, thiserror::Error)]
pub enum NoMotion {
    /// The body cannot be set up: its files are gone, or are others.
    #[error("{0}")]
    Body(String),
    /// This point has none.
    #[error(transparent)]
    Point(#[from] FamilyError),
}

impl From<OrbitError> for NoMotion {
    fn from(e: OrbitError) -> Self {
        NoMotion::Point(e.into())
    }
}

impl From<HbmError> for NoMotion {
    fn from(e: HbmError) -> Self {
        NoMotion::Point(e.into())
    }
}

/// Stored states as they come.
struct Rows<'b> {
    body: &'b Body,
    t: Vec<f64>,
    u: Vec<f64>,
    v: Vec<f64>,
    active: Vec<u8>,
    pressure: Vec<f64>,
    energy: [Vec<f64>; 5],
}

impl Observer for Rows<'_> {
    type Error = Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        let of_mesh = |x| self.body.nodal_dofs().along_axes(&self.body.nodal(x));
        self.t.push(s.t);
        self.u.extend(of_mesh(s.u));
        self.v.extend(of_mesh(s.v));
        self.active.extend(s.active.codes());
        self.pressure.extend(s.pressure);
        let [kinetic, elastic, external, dissipated, ..] = Energies::numbers(s.energies);
        let row = [kinetic, elastic, external, dissipated, s.jumps];
        self.energy.iter_mut().zip(row).for_each(|(column, x)| column.push(x));
        Ok(())
    }
}

impl<'b> Rows<'b> {
    fn new(body: &'b Body) -> Rows<'b> {
        let energy = [const { vec![] }; 5];
        Rows { body, t: vec![], u: vec![], v: vec![], active: vec![], pressure: vec![], energy }
    }

    /// As a motion of `stored`, which is the body at rest.
    fn stored(self, mut stored: Stored) -> Stored {
        let rows = self.t.len();
        let table = |x: Vec<f64>| {
            let columns = x.len() / rows.max(1);
            Array2::from_shape_vec((rows, columns), x).unwrap_or_default()
        };
        let n_c = self.active.len() / rows.max(1);
        stored.set_states(table(self.u), table(self.v));
        stored.pressure = table(self.pressure);
        stored.active = Array2::from_shape_vec((rows, n_c), self.active).unwrap_or_default();
        stored.t = self.t;
        stored.energy = self.energy.into();
        stored
    }
}

impl<'s> Motions<'s> {
    /// Of a family that was computed from `scene`; `rest` is the body of its file.
    pub fn new(
        family: StoredFamily,
        rest: Stored,
        scene: &'s Scene,
        set_up: SetUp<'s>,
    ) -> Motions<'s> {
        Motions { scene, rest, family, bodies: HashMap::new(), set_up }
    }

    /// The body without a motion.
    pub fn rest(&self) -> &Stored {
        &self.rest
    }

    /// The family.
    pub fn family(&self) -> &StoredFamily {
        &self.family
    }

    /// The motion of point `k` over its period in about so many states; none where it has no orbit and no series.
    pub fn of(&mut self, k: usize, states: usize) -> Result<Option<Stored>, NoMotion> {
        let point = self.family.points[k].clone();
        let by_series = self.family.outline().solver == Solver::HarmonicBalance;
        let percent = self.family.branches.get(point.branch).and_then(|b| b.percent());
        let mut rest = self.rest.clone();
        let body = self.body(percent)?;
        body.system.loads_mut().set_frequency(point.omega);
        rest.swings = StoredSwings::of(&body.system);
        rest.moving = StoredMoving::of(&body.system);
        match (&point.orbit, &point.series) {
            (_, Some(_)) if by_series => along_series(body, &point, states),
            (Some(_), _) => along_orbit(body, &point, states),
            (None, Some(_)) => along_series(body, &point, states),
            (None, None) => return Ok(None),
        }
        .map(|rows| Some(rows.stored(rest)))
    }

    fn body(&mut self, percent: Option<f64>) -> Result<&mut Propagator, NoMotion> {
        let key = percent.map(f64::to_bits);
        if !self.bodies.contains_key(&key) {
            let mut scene = self.scene.clone();
            if let (Some(percent), Some(damping)) = (percent, &mut scene.damping) {
                damping.ratio = Some(percent / 100.0);
            }
            let problem = (self.set_up)(&scene).map_err(NoMotion::Body)?;
            // what springs of sliders remember is behind the displacements that a family's file knows of
            let all = problem.system.body.nodal_dofs().n_columns();
            let seen = all - problem.system.n_remembered();
            if ![all, seen].contains(&self.rest.n_displacements()) {
                let text = "the scene of the file now leads to another body: a file that it names has changed";
                return Err(NoMotion::Body(text.into()));
            }
            let body = Propagator::new(problem.system).map_err(OrbitError::from)?;
            self.bodies.insert(key, body);
        }
        self.bodies.get_mut(&key).ok_or_else(|| NoMotion::Body("no body".into()))
    }
}

/// An orbit, integrated from its state.
fn along_orbit<'b>(
    body: &'b mut Propagator,
    point: &PointRecord,
    states: usize,
) -> Result<Rows<'b>, NoMotion> {
    let orbit = point.orbit.clone().unwrap_or_default();
    if let Some(v) = &orbit.viscous {
        // C = βK − αM
        let damping = Rayleigh { alpha: -v.alpha, beta: v.beta };
        body.set_damping(Some(damping)).map_err(OrbitError::from)?;
    }
    let body = &*body;
    let own = &body.system.body;
    let part = |x: &[f64]| {
        let directions = own.nodal_dofs().from_axes(x);
        own.coordinates(&directions[..own.nodal_dofs().n_o]).into_owned()
    };
    let start = State { u: part(&orbit.u0), v: part(&orbit.v0) };
    let options = Options { until: orbit.period, samples: states, switch_limit: 40.0 };
    let mut rows = Rows::new(own);
    let done = event::run(&body.system, &start, &options, &mut period_map::flow(body), &mut rows);
    match done {
        Ok(_) => Ok(rows),
        Err(RunError::Contact(e)) => Err(OrbitError::from(e).into()),
        Err(RunError::Observer(never)) => match never {},
    }
}

/// A series, with the contact that the complementarity problem gives at each time.
fn along_series<'b>(
    body: &'b mut Propagator,
    point: &PointRecord,
    states: usize,
) -> Result<Rows<'b>, NoMotion> {
    let body = &*body;
    let system = &body.system;
    let series = point.series.clone();
    let candidate = Candidate {
        omega: point.omega,
        coefficients: series.map(|s| s.coefficients).unwrap_or_default(),
        alpha: None,
    };
    let rubbing = Rubbing::new(system, &candidate)?;
    let mut rows = Rows::new(&system.body);
    let mut present = crate::contact::States::open(system.n_contact());
    let period = std::f64::consts::TAU / point.omega;
    for k in 0..=states {
        let t = period * k as f64 / states as f64;
        let [mut u_o, v_o, _] = candidate.at(system.n_o(), t);
        present = system.select(t, &u_o, &present).map_err(OrbitError::from)?.set;
        rubbing.settle(system, point.omega * t, (&mut u_o, &v_o), &mut present);
        let phase = system.phase(&present);
        let (mut u, mut v) = (vec![0.0; system.n()], vec![0.0; system.n()]);
        phase.expand_displacement(t, &u_o, &mut u);
        phase.expand_velocity(t, &v_o, &mut v);
        let mut pressure = vec![0.0; system.n_contact()];
        phase.pressures(t, &u_o, &mut pressure);
        let rubs = if system.tangents().is_some() { system.n_contact() } else { 0 };
        let mut traction = vec![0.0; rubs];
        if rubs > 0 {
            phase.tractions(t, (&u_o, &v_o), &mut traction);
        }
        let (kinetic, elastic) = (system.kinetic(t, &v), system.elastic(t, &u));
        let energies = Energies { kinetic, elastic, ..Energies::default() };
        let sample = Sample {
            t,
            u: &u,
            v: &v,
            a: &[],
            active: &present,
            pressure: &pressure,
            traction: &traction,
            energies: Some(energies),
            jumps: 0.0,
        };
        match rows.sample(&sample) {
            Ok(()) => {}
            Err(never) => match never {},
        }
    }
    Ok(rows)
}
