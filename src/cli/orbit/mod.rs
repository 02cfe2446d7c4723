//! `signorini orbit`

mod all;
mod near_return;
mod sensitivity;
mod words;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde_json::Value;

use signorini::contact::State;
use signorini::event::{self, Options, RunError};
use signorini::families::single::{limit_cycle, search};
use signorini::families::start;
use signorini::orbit::search::Verdict;
use signorini::orbit::{Closure, Orbit, Pin, Propagator, branch, displaced, period_map};
use signorini::problem::{Notes, Problem};
use signorini::records::Status;
use signorini::report::summary;
use signorini::scenario::Scene;
use signorini::store::{Kept, Writer, WriterOptions};

use super::family::{self, Output};
use super::seen::seen;
use super::{Answer, CliError, Global, load, viscous};
use all::all;
use near_return::{Return, near_return};
use sensitivity::{Sensitivities, sensitivities};
use words::{failure_json, orbit_json, orbit_text, spent_json};

/// Arguments of `orbit`.
#[derive(Debug, Args)]
#[command(
    after_help = "The guess is the scene's initial state; without one, the first mode of the open body beyond grazing.\n\
    A body on a surface that moves (contact.surface) has no guess but its own motion: its limit cycle, whose period is found with it.\n\n\
    Example:\n  signorini orbit scenarios/half-plate-orbit.toml --omega 1.8 -o orbit.h5\n  signorini orbit scenarios/half-plate-orbit.toml --omega 1.8 --all\n  signorini orbit scenarios/half-plate-orbit.toml --omega 1.8 --viscous -o mode.h5\n  signorini orbit scenarios/cracked-beam-mode.toml --viscous --displacement -0.1 -o crack.h5\n  signorini orbit scenarios/squeal-belt.toml -o cycle.h5\n  signorini orbit scenarios/bar-forced.toml --sensitivity contact.gap,load[0].amplitude,omega\n  signorini plot orbit.h5"
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// Circular frequency [default: that of the scene]
    #[arg(long, value_name = "W", conflicts_with = "period", allow_negative_numbers = true)]
    omega: Option<f64>,
    /// Period instead
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    period: Option<f64>,
    /// All different orbits that a set of starts leads to
    #[arg(long)]
    all: bool,
    /// With --all: number of amplitudes of the first mode to start from
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1000))]
    amplitudes: u32,
    /// With --all: largest of these amplitudes, over grazing
    #[arg(long, default_value_t = 4.0, value_name = "A", allow_negative_numbers = true)]
    largest: f64,
    /// Start from the first mode of the open body at this amplitude over grazing (negative: away from the obstacle), in place of the
    /// scene's initial state
    #[arg(long, value_name = "A", allow_negative_numbers = true, conflicts_with = "near_return")]
    amplitude: Option<f64>,
    /// Viscous: the orbit whose pinned mode moves the contact by so much at t = 0 (a length; negative: away from what it meets), its frequency found with it: bodies that touch without a gap,
    /// whose orbits of all sizes have one frequency
    #[arg(
        long,
        value_name = "U",
        allow_negative_numbers = true,
        requires = "viscous",
        conflicts_with_all = ["amplitude", "near_return"]
    )]
    displacement: Option<f64>,
    /// Start from the best near-return of a stored trajectory: after --periods of the loads where there are such; after the period that is given; else the best of all, which
    /// gives the period
    #[arg(long, value_name = "RUN.h5")]
    near_return: Option<PathBuf>,
    /// Periods of the loads in one of the orbit: more than one for a subharmonic orbit
    #[arg(long, default_value_t = 1, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=64))]
    periods: u32,
    /// How the orbit changes with numbers of the scene, by their keys: contact.gap,load[0].amplitude,damping.rayleigh[1]; with omega, and with beta of a viscous one
    #[arg(long, value_name = "KEY", value_delimiter = ',', conflicts_with = "all", value_parser = family::key)]
    sensitivity: Vec<String>,
    /// Shoot over the whole period with a phase condition, even where half of it would do
    #[arg(long)]
    full: bool,
    #[command(flatten)]
    viscous: viscous::Arguments,
    #[command(flatten)]
    output: Output,
}

impl Arguments {
    /// Refuse what makes no sense; the rules of the file, where one is written.
    fn rules(
        &self,
        global: &Global,
        scene: &Scene,
        path: &Path,
    ) -> Result<WriterOptions, CliError> {
        let near: Vec<&Path> = self.near_return.iter().map(|p| p.as_path()).collect();
        let mut options = WriterOptions::default();
        if !self.all {
            options = self.output.rules(global, scene, path, false, &near)?;
        } else if self.output.output.is_some() || self.amplitude.is_some() {
            let message = "--all writes no file and has its own starts: leave out -o and --amplitude, then shoot the orbit you want \
                           with --amplitude or [initial]";
            return Err(CliError::Input(message.into()));
        }
        if let Some((_, twice)) = self
            .sensitivity
            .iter()
            .enumerate()
            .find(|(k, key)| self.sensitivity[..*k].contains(key))
        {
            return Err(CliError::Input(format!("--sensitivity: {twice} stands there twice")));
        }
        let other = [
            ("--all", self.all),
            ("--full", self.full),
            ("--near-return", self.near_return.is_some()),
        ];
        if let Some((name, _)) = other.iter().find(|(_, given)| *given && self.viscous.viscous) {
            let message = format!(
                "{name} does not go with --viscous: there is one viscous orbit at a frequency outside internal resonances, shot over the whole period"
            );
            return Err(CliError::Input(message));
        }
        if self.amplitude.is_some_and(|a| !is_amplitude(a.abs())) {
            let message =
                "--amplitude: give a finite number that is not zero, in multiples of grazing";
            return Err(CliError::Input(message.into()));
        }
        if self.displacement.is_some_and(|u| !is_amplitude(u.abs())) {
            let message = "--displacement: give a finite length that is not zero";
            return Err(CliError::Input(message.into()));
        }
        if !(is_amplitude(self.largest) && self.largest > 1.0) {
            let message =
                "--largest: give a number above 1: the amplitudes go from grazing up to it";
            return Err(CliError::Input(message.into()));
        }
        Ok(options)
    }

    /// What closes the orbit, and its frequency, which only that of a limit cycle need not have; a near-return becomes the initial state.
    fn target(
        &self,
        scene: &Scene,
        problem: &mut Problem,
    ) -> Result<(Closure, Option<f64>), CliError> {
        let mut near_period = None;
        if let Some(file) = &self.near_return {
            family::check_full(scene, "a near-return")?;
            let wanted = self.wanted(scene, problem)?;
            let (period, state) = near_return(file, scene, &problem.system, wanted)?;
            // the frequency of a forced orbit is that of the loads
            if !matches!(wanted, Return::Forced { .. }) {
                near_period = Some(period);
            }
            problem.initial = state;
        }
        // the kind of a viscous orbit is known when its modes are
        let mut closure = match self.viscous.viscous {
            true => Closure::Autonomous,
            false => start::closure(scene, problem)?,
        };
        if self.periods > 1 {
            if !closure.is_forced() {
                let text = "--periods counts periods of the loads: add a [[load]] with omega, or give --omega and --period alone";
                return Err(CliError::Input(text.into()));
            }
            closure = Closure::Forced(self.periods as usize);
        }
        if self.full && closure == Closure::Reversible {
            closure = Closure::Autonomous;
        }
        let period = self.period.or(near_period.filter(|_| self.omega.is_none()));
        if closure == Closure::Limit {
            if self.all || self.amplitude.is_some() {
                let text = "--all and --amplitude go with orbits of a given frequency: the limit cycle of a body on a surface that moves finds its own, from [initial] or --near-return";
                return Err(CliError::Input(text.into()));
            }
            if self.omega.or(period).is_none() {
                return Ok((closure, None));
            }
        }
        if self.displacement.is_some() {
            // found with the orbit
            return Ok((closure, self.omega.or(period.map(|t| std::f64::consts::TAU / t))));
        }
        let omega = family::omega(scene, self.omega, period)?;
        family::check_frequency(problem, omega)?;
        Ok((closure, Some(omega)))
    }

    /// Which near-return is looked for: that of the loads, of the period that is given, or the best of all.
    fn wanted(&self, scene: &Scene, problem: &Problem) -> Result<Return, CliError> {
        let omega = || family::omega(scene, self.omega, self.period);
        if start::closure(scene, problem)?.is_forced() {
            let count = self.periods as usize;
            return Ok(Return::Forced { load: std::f64::consts::TAU / omega()?, count });
        }
        Ok(match self.omega.or(self.period) {
            Some(_) => Return::After(std::f64::consts::TAU / omega()?),
            None => Return::Best,
        })
    }

    /// The guesses that are shot from; `own` are those of the scene.
    fn guesses(
        &self,
        own: Vec<Vec<f64>>,
        initial: &State,
        body: &Propagator,
        closure: Closure,
    ) -> Result<Vec<Vec<f64>>, CliError> {
        let unknowns = closure.unknowns(body.n());
        if let Some(amplitude) = self.amplitude {
            let mode = if let Closure::Viscous(pin) = closure { pin.mode + 1 } else { 1 };
            let mut guess = branch::mode_guess(body, mode, amplitude).ok_or_else(|| {
                CliError::Input(format!("--amplitude: mode {mode} never reaches the obstacle"))
            })?;
            if let Closure::Viscous(pin) = closure {
                guess.resize(2 * body.n(), 0.0);
                guess = pin.unknowns(guess);
            }
            guess.resize(unknowns, 0.0);
            return Ok(vec![guess]);
        }
        match self.near_return.is_some() {
            true => Ok(vec![body.frame(initial)[..unknowns].to_vec()]),
            false => Ok(own),
        }
    }
}

/// The viscous orbit at a displacement.
fn at_displacement(
    body: &mut Propagator,
    pin: Pin,
    size: f64,
    omega: Option<f64>,
) -> Result<Verdict, CliError> {
    let near = omega.or_else(|| displaced::bilinear(body, pin)).unwrap_or(pin.omega);
    let reason = format!(
        "none at the displacement {size} with a frequency near {near:.6}; give --omega near that of the orbit, or another [orbit] mode"
    );
    Ok(match displaced::at_displacement(body, pin, size, near)? {
        Some(Verdict::Orbit(orbit)) => Verdict::Orbit(orbit),
        Some(why) => Verdict::not_found(format!("{reason} ({why})")),
        None => Verdict::not_found(reason),
    })
}

/// One orbit, or all that can be found.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let begun = Instant::now();
    let mut scene = global.scene(&arguments.scene)?;
    let path = arguments.output.path(&scene, "orbit");
    let options = arguments.rules(global, &scene, &path)?;
    let mut problem = load::warned(&scene, global)?;
    if arguments.viscous.viscous || !problem.system.is_conservative() {
        problem = family::reduce_if_large(global, &mut scene, problem)?;
    }
    let (mut closure, omega) = arguments.target(&scene, &mut problem)?;
    let initial = problem.initial.clone();
    let mut body = family::propagator(problem.system)?;
    body.stop = global.caller.stop();
    if let Some(viscosity) = arguments.viscous.viscosity(&scene, &body)? {
        viscous::warn(global, &viscosity);
        closure = viscous::closure(&viscosity);
    }
    let verdict = match (closure, arguments.displacement, omega) {
        (Closure::Viscous(pin), Some(size), near) => at_displacement(&mut body, pin, size, near)?,
        (_, _, Some(omega)) if closure != Closure::Limit => {
            body.system.loads_mut().set_frequency(omega);
            let own = start::guesses(&scene, &initial, &body, closure, omega);
            if arguments.all {
                return all(arguments, global, &scene, &mut body, (closure, omega), own, begun);
            }
            let guesses = arguments.guesses(own, &initial, &body, closure)?;
            search(&mut body, closure, &guesses, omega)?
        }
        _ => limit_cycle(&mut body, &initial, omega.map(|w| std::f64::consts::TAU / w))?,
    };
    let Verdict::Orbit(orbit) = &verdict else {
        let viscous = arguments.viscous.viscous;
        let answer = global.answer(|| failure_json(&verdict, omega, body.spent()), String::new);
        let advice = match viscous {
            _ if closure == Closure::Limit => {
                "run the scene longer and look what it does; --near-return RUN.h5 starts from a stored run"
            }
            true => {
                "try another frequency or a larger --beta; in the tongue of an internal resonance follow the family: signorini backbone --viscous --follow arclength"
            }
            false => "try another frequency, another [initial] guess, or --all",
        };
        let at = match (arguments.displacement, omega) {
            (None, Some(omega)) => format!(" at omega = {omega}"),
            _ => String::new(),
        };
        return Ok(answer.failed(format!("no orbit{at}: {verdict}\n  {advice}")));
    };
    let mut object = orbit_json(&body, orbit);
    object["spent"] = spent_json(body.spent());
    let by = match arguments.sensitivity.is_empty() {
        true => None,
        false => Some(sensitivities(global, &scene, &mut body, orbit, &arguments.sensitivity)?),
    };
    by.iter().for_each(|by| by.json(&mut object));
    object["wall_s"] = begun.elapsed().as_secs_f64().into();
    let cut_short = write(&path, &options, &scene, (&body, orbit, &mut object), by.as_ref())?;
    let wall = begun.elapsed().as_secs_f64();
    let answer = global.answer(
        || {
            let mut json = object.clone();
            json["wall_s"] = wall.into();
            json["output"] = path.display().to_string().into();
            json
        },
        || {
            let title = super::title(&scene);
            let plot = format!("signorini plot {}", path.display());
            format!(
                "{title}\n{}{}{}  {:<14}{wall:.3} s\n  {:<14}{} (pictures: {plot})\n",
                orbit_text(orbit, scene.is_around_equilibrium()),
                summary::seen_text(&scene, &body.system, &object),
                by.as_ref().map_or(String::new(), |by| by.text(orbit)),
                "time",
                "written to",
                path.display()
            )
        },
    );
    Ok(match cut_short {
        None => answer,
        Some(why) => answer.failed(why),
    })
}

/// Amplitudes that a motion can have, over grazing.
fn is_amplitude(a: f64) -> bool {
    a > 0.0 && a <= 1e6
}

/// The orbit file: a run over one period, and `/orbit`; what that shows besides goes into the object. Why that run ended early, if it did.
fn write(
    path: &Path,
    options: &WriterOptions,
    scene: &Scene,
    (body, orbit, object): (&Propagator, &Orbit, &mut Value),
    by: Option<&Sensitivities>,
) -> Result<Option<String>, CliError> {
    let mut writer = Writer::create(path, scene, (&body.system, Kept::all(&body.system)), options)?;
    let run = Options { until: orbit.period, samples: 400, switch_limit: 40.0 };
    let done =
        event::run(&body.system, &orbit.state, &run, &mut period_map::flow(body), &mut writer);
    let report = match done {
        Ok(report) => report,
        Err(e) => {
            writer.discard();
            return Err(match e {
                RunError::Observer(e) => e.into(),
                RunError::Contact(e) => CliError::Numerics(e.to_string()),
            });
        }
    };
    if let Some(rubbed) = &report.rubbed {
        writer.friction(&body.system, rubbed)?;
    }
    writer.orbit(&branch::record(body, orbit)?, &body.system)?;
    if let Some(by) = by {
        writer.sensitivity(&by.peaks, &by.parameters, &body.system)?;
    }
    for (name, value) in seen(&mut writer, &body.system)? {
        object[name] = value;
    }
    let mut said = summary::run_json(scene, (&body.system, &Notes::default()), &report, 0.0);
    for (name, value) in object.as_object().into_iter().flatten() {
        // the state stands in /orbit, with all displacements along the axes
        if name != "u0" && name != "v0" {
            said[name] = value.clone();
        }
    }
    writer.report(&said)?;
    if report.outcome.is_complete() {
        writer.finish(&Status::Complete)?;
        return Ok(None);
    }
    // the orbit is found and stored; the states along it are not all there
    writer.finish(&Status::Failed(report.outcome.to_string()))?;
    Ok(Some(format!(
        "the orbit was found, but its run over one period ended early ({}); what there is stands in {}",
        report.outcome,
        path.display()
    )))
}
