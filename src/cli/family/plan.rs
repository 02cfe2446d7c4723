//! What is asked for: from arguments and a scene to values that are checked.

use std::path::{Path, PathBuf};

use clap::Args;

use signorini::contact::System;
use signorini::families::start;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::{Issue, Scene};
use signorini::store::{Outputs, WriterOptions};

use crate::cli::{CliError, Global, load, plain};

/// Where results go.
#[derive(Debug, Clone, Args)]
pub struct Output {
    /// Where to write the results [default: the scene's name with the command's, in this folder]
    #[arg(short, long, value_name = "OUT.h5")]
    pub output: Option<PathBuf>,
    /// Overwrite an existing file of signorini's
    #[arg(long)]
    pub force: bool,
}

impl Output {
    /// The path, by default `SCENE-COMMAND.h5`.
    pub fn path(&self, scene: &Scene, command: &str) -> PathBuf {
        self.output
            .clone()
            .unwrap_or_else(|| PathBuf::from(format!("{}-{command}.h5", scene.stem())))
    }

    /// The rules for what this command writes; refused at once where `path` cannot be written.
    pub(crate) fn rules(
        &self,
        global: &Global,
        scene: &Scene,
        path: &Path,
        resume: bool,
        more: &[&Path],
    ) -> Result<WriterOptions, CliError> {
        writer_options(global, scene, path, (self.force, resume), more)
    }
}

/// How the file `path` of a command is written that reads a scene, the files that it names, and `more`.
pub(crate) fn writer_options(
    global: &Global,
    scene: &Scene,
    path: &Path,
    (force, resume): (bool, bool),
    more: &[&Path],
) -> Result<WriterOptions, CliError> {
    let outputs = Outputs::new(force)
        .reads(scene.source.file.clone())
        .reads_all(scene.files())
        .reads_all(more.iter().map(|p| p.to_path_buf()));
    outputs.with_force(force || resume).check(path)?;
    let (command, is_scratch) = (global.caller.command(), global.caller.is_scratch);
    Ok(WriterOptions { outputs, command, is_scratch })
}

/// Refuse what is not in the coordinates of a reduced body.
pub(crate) fn check_full(scene: &Scene, what: &str) -> Result<(), CliError> {
    if scene.reduction.is_none() {
        return Ok(());
    }
    let help = "leave [reduction] out of the scene";
    let message = format!("{what} needs all displacements of the body");
    Err(scene.error(Issue::new("reduction", message, help)).into())
}

/// The problem of a scene whose body may have too many displacements for the modes of every phase: where the scene says nothing of it, the body is reduced. The
/// scene that stands in the files of the command says so.
pub(crate) fn reduce_if_large(
    global: &Global,
    scene: &mut Scene,
    problem: Problem,
) -> Result<Problem, CliError> {
    let Some((reduced, text)) = start::reduced_if_large(scene, &problem.system)? else {
        return Ok(problem);
    };
    global.caller.warn(&text);
    *scene = reduced;
    load::of_scene(scene)
}

/// What a forced response needs.
pub(crate) const OF_RESPONSE: &str = "a forced response needs a harmonic load";

/// Refuse a scene whose motions no harmonic load keeps going; `message` says what needs one.
pub(crate) fn check_forced(
    scene: &Scene,
    problem: &Problem,
    message: &str,
) -> Result<(), CliError> {
    if start::closure(scene, problem)? == Closure::FORCED {
        return Ok(());
    }
    let help =
        "add a [[load]] with omega, for example kind = \"mode\", mode = 1, peak = 3.0, omega = 1.5";
    Err(scene.error(Issue::new("load", message, help)).into())
}

/// Refuse a body from which nothing takes energy: it settles to nothing. `at`: where, for a number of the scene that changes.
pub(crate) fn check_settles(scene: &Scene, system: &System, at: &str) -> Result<(), CliError> {
    if system.dissipates() {
        return Ok(());
    }
    let (message, help) = match &scene.damping {
        None => (
            "is missing: a body settles by what it loses",
            "[damping] with ratio = 0.02 and mode = 1",
        ),
        Some(_) => ("is zero: a body settles by what it loses", "give a positive damping"),
    };
    Err(scene.error(Issue::new("damping", format!("{message}{at}"), help)).into())
}

/// The same at both ends of the range of a number.
pub(crate) fn check_settle_at(
    scene: &Scene,
    key: &str,
    (low, high): (f64, f64),
    [at_low, at_high]: &[System; 2],
) -> Result<(), CliError> {
    let at = |value: f64| format!(" (--over: {key} = {value})");
    check_settles(scene, at_low, &at(low))?;
    check_settles(scene, at_high, &at(high))
}

/// A key among others, blanks around it aside.
pub(crate) fn key(text: &str) -> Result<String, String> {
    match text.trim() {
        "" => Err("give a key between commas: contact.gap,load[0].amplitude".into()),
        key => Ok(key.to_owned()),
    }
}

/// A number of points.
pub(crate) fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse::<usize>().ok().filter(|n| *n > 0).ok_or_else(|| "give a whole number from 1".into())
}

/// The number with one digit, 1, 2 or 5, that is nearest to a positive one.
pub(crate) fn round_number(x: f64) -> f64 {
    let decade = 10f64.powf(x.log10().floor());
    let off = |n: &f64| (n * decade / x).ln().abs();
    let nearest = [1.0, 2.0, 5.0, 10.0].into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    let n = nearest.unwrap_or(1.0);
    // decimal, so that a grid of it prints as it was meant
    format!("{n}e{}", decade.log10().round()).parse().unwrap_or(n * decade)
}

/// Most natural periods in one period of an orbit.
const MOST_NATURAL_PERIODS: f64 = 1e3;

/// Periods of motions over the shortest natural one: below, nothing moves at such a frequency.
const HIGHEST: f64 = 10.0;

/// Refuse a frequency at which one period would take for ever, or that is far above all that the body can do.
pub(crate) fn check_frequency(problem: &Problem, omega: f64) -> Result<(), CliError> {
    let system = &problem.system;
    let (unit, bound) = (system.body.frequency_unit(), system.frequency_bound());
    if unit / omega > MOST_NATURAL_PERIODS {
        return Err(CliError::Input(format!(
            "omega = {}: one period would hold {} natural periods of the body; give at least {}",
            plain(omega),
            plain((unit / omega).round()),
            plain(unit / MOST_NATURAL_PERIODS)
        )));
    }
    if omega > HIGHEST * bound {
        return Err(CliError::Input(format!(
            "omega = {}: all natural frequencies of the body are below {}; give at most {}",
            plain(omega),
            plain(bound),
            plain(HIGHEST * bound)
        )));
    }
    Ok(())
}

/// The frequency: from the command line, `[orbit]`, or the load.
pub fn omega(scene: &Scene, omega: Option<f64>, period: Option<f64>) -> Result<f64, CliError> {
    let positive = |name: &str, x: f64| match x.is_finite() && x > 0.0 {
        true => Ok(x),
        false => Err(CliError::Input(format!("--{name} {x}: give a positive number"))),
    };
    match (omega, period) {
        (Some(w), _) => return positive("omega", w),
        (_, Some(t)) => return positive("period", t).map(|t| std::f64::consts::TAU / t),
        _ => {}
    }
    let orbit = scene.orbit.as_ref();
    let of_orbit = orbit.and_then(|o| o.omega.or(o.period.map(|t| std::f64::consts::TAU / t)));
    of_orbit.or(scene.period().map(|t| std::f64::consts::TAU / t)).ok_or_else(|| {
        let help = "[orbit] with omega = 1.8 or period = 3.4, or --omega on the command line";
        scene.error(Issue::new("orbit.omega", "is missing", help)).into()
    })
}

/// The range of frequencies.
pub fn range(scene: &Scene, given: Option<&[f64]>) -> Result<(f64, f64), CliError> {
    match given {
        Some(&[a, b]) if a > 0.0 && b > a && b.is_finite() => return Ok((a, b)),
        Some(list) => {
            let text: Vec<String> = list.iter().map(|x| plain(*x)).collect();
            let text = text.join(",");
            return Err(CliError::Input(format!(
                "--range {text}: give two frequencies, the lower one first: --range 1.6,2.0"
            )));
        }
        None => {}
    }
    let range = scene.orbit.as_ref().and_then(|o| o.range);
    range.map(|[a, b]| (a, b)).ok_or_else(|| {
        let help = "[orbit] with range = [1.6, 2.0], or --range 1.6,2.0 on the command line";
        scene.error(Issue::new("orbit.range", "is missing", help)).into()
    })
}

/// A body ready for shooting.
pub(crate) fn propagator(system: System) -> Result<Propagator, CliError> {
    Propagator::new(system).map_err(|e| CliError::Numerics(e.to_string()))
}
