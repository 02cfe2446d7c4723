//! One call from a scene to a report: what `signorini run` does, for library users.

use crate::contact::{State, System};
use crate::event::{self, Observer, Options, Report, Resumed, RunError, Verified};
use crate::flow::dop853::DOP853;
use crate::flow::dopri5::DOPRI5;
use crate::flow::{Chebyshev, Flow, Modal, RungeKutta, Tolerances, Zoned, auto, exact};
use crate::problem::Problem;
use crate::scenario::{Integrator, Issue, Run, Scene, SceneError};
use crate::schemes;

/// The `[run]` table of a scene, or the error that says it is missing.
pub(crate) fn run_table(scene: &Scene) -> Result<(&Run, f64), SceneError> {
    let missing =
        || scene.error(Issue::new("run", "is missing", "add [run] with until = … or periods = …"));
    let run = scene.run.as_ref().ok_or_else(missing)?;
    let until = scene.until().ok_or_else(missing)?;
    Ok((run, until))
}

/// Integrate a problem as its scene's `[run]` table says.
pub fn simulate<O: Observer>(
    scene: &Scene,
    problem: &Problem,
    verify_lcp: bool,
    observer: &mut O,
) -> Result<Report, SimulateError<O::Error>> {
    run(scene, problem, verify_lcp, None, observer)
}

/// Go on with an interrupted run as its scene's `[run]` table says.
pub fn go_on<O: Observer>(
    scene: &Scene,
    problem: &Problem,
    verify_lcp: bool,
    resumed: Resumed,
    observer: &mut O,
) -> Result<Report, SimulateError<O::Error>> {
    run(scene, problem, verify_lcp, Some(resumed), observer)
}

fn run<O: Observer>(
    scene: &Scene,
    problem: &Problem,
    verify_lcp: bool,
    resumed: Option<Resumed>,
    observer: &mut O,
) -> Result<Report, SimulateError<O::Error>> {
    let (run, until) = run_table(scene)?;
    let options = Options { until, samples: run.samples, switch_limit: run.switch_limit };
    let tolerances = Tolerances { rtol: run.rtol, atol: run.atol };
    let (system, initial) = (&problem.system, &problem.initial);
    if run.quasistatic {
        return Ok(schemes::quasistatic::run(system, resumed, &options, observer)?);
    }
    if let Some(report) = schemes::run(system, initial, resumed.clone(), &options, observer)? {
        return Ok(report);
    }
    let around = || around_contact(run.integrator, &problem.system);
    let around = observer.sees_contact_alone().then(around).flatten();
    let mut flow = around.unwrap_or_else(|| by_name(run.integrator, &problem.system, tolerances));
    let (system, flow) = (&problem.system, flow.as_mut());
    if !verify_lcp {
        return carry_out(system, &problem.initial, resumed, &options, flow, observer);
    }
    let mut verified = Verified::new(system, observer);
    let mut report = carry_out(system, &problem.initial, resumed, &options, flow, &mut verified)?;
    report.lcp_check = Some(verified.check);
    Ok(report)
}

fn carry_out<O: Observer>(
    system: &System,
    initial: &State,
    resumed: Option<Resumed>,
    options: &Options,
    flow: &mut dyn Flow,
    observer: &mut O,
) -> Result<Report, SimulateError<O::Error>> {
    Ok(match resumed {
        None => event::run(system, initial, options, flow, observer)?,
        Some(resumed) => event::resume(system, resumed, options, flow, observer)?,
    })
}

/// The flow that a scene asks for.
pub fn by_name<'a>(
    integrator: Integrator,
    system: &'a System,
    tolerances: Tolerances,
) -> Box<dyn Flow + 'a> {
    match integrator {
        Integrator::Dopri5 => Box::new(RungeKutta::new(system, &DOPRI5, tolerances)),
        Integrator::Dop853 => Box::new(RungeKutta::new(system, &DOP853, tolerances)),
        Integrator::Modal => Box::new(exact(Box::new(Modal::new(system)), system)),
        Integrator::Chebyshev => Box::new(exact(Box::new(Chebyshev::new(system)), system)),
        Integrator::Auto => Box::new(auto::auto(system, tolerances)),
    }
}

/// The flow of a body of which nobody wants to see more than the contact: it follows the rest in longer steps, where that costs less.
pub(crate) fn around_contact(
    integrator: Integrator,
    system: &System,
) -> Option<Box<dyn Flow + '_>> {
    let without_modes = match integrator {
        Integrator::Chebyshev => true,
        Integrator::Auto => auto::never_by_modes(system),
        _ => false,
    };
    let flow = without_modes.then(|| Zoned::new(system)).flatten()?;
    Some(Box::new(exact(Box::new(flow), system)))
}

/// A simulation could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError<E> {
    /// The scene does not say what to run.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] RunError<E>),
}
