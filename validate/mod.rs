//! Validation: cases with references that this program did not produce.
//!
//! Each case is a folder with a scene and its code; the code holds the reference (a closed form, cited) and the
//! accepted errors, and uses the public library only.

#[path = "bodies/cuboid.rs"]
mod cuboid;
#[path = "bodies/rectangle.rs"]
mod rectangle;

#[path = "bodies/case.rs"]
mod bodies;

#[path = "bar/case.rs"]
mod bar;
#[path = "bar-orbits/case.rs"]
mod bar_orbits;
#[path = "bouncing-bar/case.rs"]
mod bouncing_bar;
#[path = "constant-inertia/case.rs"]
mod constant_inertia;
#[path = "forced/case.rs"]
mod forced;
#[path = "friction/case.rs"]
mod friction;
#[path = "hard/case.rs"]
mod hard;
#[path = "harmonic-balance/case.rs"]
mod harmonic_balance;
#[path = "impact/case.rs"]
mod impact;
#[path = "methods/case.rs"]
mod methods;
#[path = "oscillator/case.rs"]
mod oscillator;
#[path = "oscillator-orbits/case.rs"]
mod oscillator_orbits;
#[path = "refinement/case.rs"]
mod refinement;
#[path = "response/case.rs"]
mod response;
#[path = "ridge/case.rs"]
mod ridge;
#[path = "stop/case.rs"]
mod stop;
#[path = "strip/case.rs"]
mod strip;
#[path = "zero-gap-bar/case.rs"]
mod zero_gap_bar;

use std::convert::Infallible;
use std::path::Path;

use signorini::continuation::{Go, Options};
use signorini::event::{Observer, Report, Sample};
use signorini::orbit::along::{Start, arclength};
use signorini::orbit::search::{Effort as Search, find};
use signorini::orbit::{Closure, OrbitError, Propagator};
use signorini::problem::Problem;
use signorini::records::PointRecord;
use signorini::scenario::Scene;
use signorini::simulate::simulate;

/// A measured number beside the accepted one.
#[derive(Debug, Clone)]
pub struct Check {
    /// What is measured.
    pub what: String,
    /// The number.
    pub measured: f64,
    /// Lower and upper bound.
    pub accepted: (f64, f64),
}

impl Check {
    /// The number must not exceed a bound.
    pub fn at_most(what: impl Into<String>, measured: f64, bound: f64) -> Check {
        Check { what: what.into(), measured, accepted: (f64::NEG_INFINITY, bound) }
    }

    /// The number must lie within a relative distance of a value.
    pub fn near(what: impl Into<String>, measured: f64, value: f64, relative: f64) -> Check {
        let distance = relative * value.abs();
        Check { what: what.into(), measured, accepted: (value - distance, value + distance) }
    }

    /// The number must be at least a bound.
    pub fn at_least(what: impl Into<String>, measured: f64, bound: f64) -> Check {
        Check { what: what.into(), measured, accepted: (bound, f64::INFINITY) }
    }

    /// Whether it is accepted (a number that is none is not).
    pub fn passes(&self) -> bool {
        self.accepted.0 <= self.measured && self.measured <= self.accepted.1
    }
}

/// What a case may ask for.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Leave out the finest meshes.
    pub short: bool,
}

type Outcome = Result<Vec<Check>, String>;

/// A validation case.
pub struct Case {
    /// Name on the command line: the folder's.
    pub name: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// Where the reference comes from.
    pub source: &'static str,
    /// Left out unless it is named: it takes long.
    pub only_by_name: bool,
    /// Measure.
    pub run: fn(Effort) -> Outcome,
}

/// All cases.
pub static CASES: [Case; 20] = [
    bar::CASE,
    strip::CASE,
    oscillator::CASE,
    zero_gap_bar::CASE,
    constant_inertia::CASE,
    methods::CASE,
    bouncing_bar::CASE,
    impact::CASE,
    stop::CASE,
    friction::CASE,
    bodies::CASE,
    hard::CASE,
    hard::MILLION,
    bar_orbits::CASE,
    oscillator_orbits::CASE,
    harmonic_balance::CASE,
    forced::CASE,
    response::CASE,
    refinement::CASE,
    ridge::CASE,
];

/// A scene of a case with another number of elements.
fn scene(text: &str, elements: Option<&[usize]>) -> Result<Scene, String> {
    let mut scene =
        Scene::parse(text, Path::new("validate/scene.toml")).map_err(|e| e.to_string())?;
    if let Some(elements) = elements {
        scene.body.elements = elements.to_vec();
    }
    Ok(scene)
}

/// Follow the forced response of a body from the linear one at `low` up to 2.1, as long as `go` says.
fn forced_response(
    body: &mut Propagator,
    low: f64,
    mut go: impl FnMut(&PointRecord) -> Go,
) -> Result<Vec<PointRecord>, String> {
    let text = |e: OrbitError| e.to_string();
    body.system.loads_mut().set_frequency(low);
    let guess = body.linear_response();
    let verdict = find(body, Closure::FORCED, &guess, low, &Search::default()).map_err(text)?;
    let orbit = verdict.orbit().ok_or_else(|| verdict.to_string())?.clone();
    let options = Options {
        range: (low, 2.1),
        step: (0.01, 1e-9, 0.05),
        points: 2000,
        locate: false,
        natural: false,
    };
    let mut points = vec![];
    arclength(body, Closure::FORCED, Start::Orbit(Box::new(orbit), 1.0), &options, |p| {
        points.push(p);
        points.last().map_or(Go::Continue(()), &mut go)
    })
    .map_err(text)?;
    Ok(points)
}

/// Stored states of a run.
#[derive(Debug, Default)]
struct Trajectory {
    t: Vec<f64>,
    u: Vec<Vec<f64>>,
    pressure: Vec<Vec<f64>>,
}

impl Trajectory {
    /// The stored state nearest to a time.
    fn at(&self, t: f64) -> &[f64] {
        let distance = |r: usize| (self.t[r] - t).abs();
        let nearest = (0..self.t.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(&[], |r| &self.u[r])
    }
}

impl Observer for Trajectory {
    type Error = Infallible;
    fn sample(&mut self, s: &Sample) -> Result<(), Infallible> {
        self.t.push(s.t);
        self.u.push(s.u.to_vec());
        self.pressure.push(s.pressure.to_vec());
        Ok(())
    }
}

/// Run a scene to its end.
fn integrate(scene: &Scene) -> Result<(Problem, Report, Trajectory), String> {
    let problem = Problem::new(scene, None).map_err(|e| e.to_string())?;
    let mut trajectory = Trajectory::default();
    let report = simulate(scene, &problem, false, &mut trajectory).map_err(|e| e.to_string())?;
    if !report.outcome.is_complete() {
        return Err(report.outcome.to_string());
    }
    Ok((problem, report, trajectory))
}

/// Nodal displacement along x at a stored state.
fn nodal_x(problem: &Problem, u: &[f64], node: usize) -> f64 {
    problem.system.body.dofs.terms(node, 0).map(|(i, c)| c * u[i]).sum()
}

/// `log₂` of the ratio of two errors: the order of convergence for halved elements.
fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}
