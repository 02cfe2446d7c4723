//! What `orbit`, `backbone` and `response` share: how a scene closes, its frequency and guess, and branches computed side by side
//! into one file.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use signorini::contact::Nbm;
use signorini::continuation::{Go, Options, Stop};
use signorini::orbit::branch::{self, Start};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::scenario::{Issue, Scene};
use signorini::store::{FamilyWriter, PointRecord, StoredFamily, Writer, WriterOptions};

use super::{CliError, Global};

/// Where results go.
#[derive(Debug, Clone, Args)]
pub struct Output {
    /// Where to write the results [default: the scene's name with the command's, in this folder]
    #[arg(short, long, value_name = "OUT.h5")]
    pub output: Option<PathBuf>,
    /// Overwrite an existing file
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
}

/// A number of points.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse::<usize>().ok().filter(|n| *n > 0).ok_or_else(|| "give a whole number from 1".into())
}

/// How periodic motions of a scene close.
pub fn closure(scene: &Scene, problem: &Problem) -> Result<Closure, CliError> {
    let nbm = &problem.nbm;
    let fail = |key: &str, message: &str, help: &str| {
        Err(scene.error(Issue::new(key, message, help)).into())
    };
    if nbm.n_contact() == 0 {
        return fail(
            "contact",
            "is missing: orbits are those of a body in contact",
            "add [contact]",
        );
    }
    let mut frequencies = nbm.loads.harmonics.iter().map(|h| h.omega);
    if let Some(first) = frequencies.next() {
        if frequencies.any(|w| w != first) {
            return fail(
                "load",
                "harmonic loads of different frequencies have no common period",
                "give all loads one omega",
            );
        }
        return Ok(Closure::Forced);
    }
    if nbm.damping.is_some() {
        return fail(
            "damping",
            "without a harmonic load a damped body has no periodic motion but rest",
            "remove [damping] for a backbone, or add a [[load]] with omega",
        );
    }
    let moving = problem.initial.v.iter().any(|v| *v != 0.0);
    Ok(if moving { Closure::Autonomous } else { Closure::Reversible })
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
            let text: Vec<String> = list.iter().map(f64::to_string).collect();
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

/// Guesses at an orbit: the scene's initial state, or the first mode of the open body beyond grazing.
pub fn guesses(
    scene: &Scene,
    problem_initial: &signorini::problem::State,
    body: &Propagator,
    closure: Closure,
) -> Vec<Vec<f64>> {
    let s = &scene.initial;
    let given =
        s.mode.is_some() || s.file.is_some() || s.displacement.is_some() || s.velocity.is_some();
    let unknowns = closure.unknowns(body.n());
    let mut list = vec![];
    if given {
        list.push(body.frame(problem_initial)[..unknowns].to_vec());
    } else if closure == Closure::Forced {
        list.push(body.linear_response());
        list.push(vec![0.0; unknowns]);
    } else {
        for amplitude in [-1.1, -1.2, -1.05, -1.4, -1.7, -2.2, -3.0] {
            let guess = branch::mode_guess(body, 1, amplitude);
            list.extend(guess.map(|mut z| {
                z.resize(unknowns, 0.0);
                z
            }));
        }
    }
    list
}

/// A body ready for shooting.
pub fn propagator(nbm: Nbm) -> Result<Propagator, CliError> {
    Propagator::new(nbm).map_err(|e| CliError::Numerics(e.to_string()))
}

/// A bar for long work, with what it is about.
pub fn bar(global: &Global, scene: &Scene, length: u64) -> Option<ProgressBar> {
    let style = "{prefix} [{bar:30}] {percent:>3} %  {elapsed} elapsed, {eta} left  {msg}";
    let style =
        ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
    (!global.quiet).then(|| {
        let bar = ProgressBar::new(length).with_style(style.progress_chars("=> "));
        bar.enable_steady_tick(Duration::from_millis(200));
        bar.with_prefix(scene.stem())
    })
}

/// What a branch says at its end.
pub struct Ended {
    /// Number of the branch.
    pub branch: usize,
    /// In words.
    pub text: String,
    /// Whether it did what it was asked to do.
    pub complete: bool,
}

/// A branch to compute: it hands its points on.
pub type Job<'a> =
    Box<dyn Fn(&mut dyn FnMut(PointRecord) -> Go) -> Result<Ended, CliError> + Send + Sync + 'a>;

/// The file of a family, new or gone on with.
pub struct Sink {
    /// The writer.
    pub writer: FamilyWriter,
    /// What an earlier run left.
    pub known: Option<StoredFamily>,
}

/// Open the file of a family. A resumed file must be of the same scene and kind.
pub fn open(
    path: &Path,
    scene: &Scene,
    nbm: &Nbm,
    force: bool,
    resume: bool,
    (kind, names, harmonics): (&str, &[String], usize),
) -> Result<Sink, CliError> {
    let command: Vec<String> = std::env::args().collect();
    let options = WriterOptions { force, command: command.join(" ") };
    if !resume || !path.exists() {
        let writer = FamilyWriter::create(path, scene, nbm, &options, kind, names, harmonics)?;
        return Ok(Sink { writer, known: None });
    }
    let mut known = StoredFamily::recover(path)?;
    let differs = |what: &str| {
        Err(CliError::Input(format!(
            "{} was made {what}; give the same command again, or another -o",
            path.display()
        )))
    };
    if known.scene != scene.source.text {
        return differs("from another scene");
    }
    if known.kind != kind || known.branches != names {
        return differs("with other options");
    }
    known.harmonics = harmonics;
    // special points inside a step that was not finished come again
    let mut last_place: HashMap<usize, usize> = HashMap::new();
    for (k, p) in known.points.iter().enumerate() {
        if p.place.is_some() || p.special.starts_with("gap") || p.special == "end of range" {
            last_place.insert(p.branch, k);
        }
    }
    let mut k = 0;
    known.points.retain(|p| {
        let keep = last_place.get(&p.branch).is_some_and(|last| k <= *last);
        k += 1;
        keep
    });
    let writer = FamilyWriter::resume(path, scene, nbm, &options, kind, &known)?;
    Ok(Sink { writer, known: Some(known) })
}

/// Compute branches side by side; every point is written as soon as it is there.
pub fn run_jobs(
    jobs: &[Job],
    sink: Sink,
    nbm: &Nbm,
    (low, high): (f64, f64),
    bar: Option<&ProgressBar>,
) -> Result<(Vec<Ended>, FamilyWriter), CliError> {
    let mut writer = sink.writer;
    let (sender, receiver) = mpsc::sync_channel::<PointRecord>(64);
    let (ended, failure) = std::thread::scope(|scope| {
        let workers = scope.spawn(move || {
            let run = |(branch, job): (usize, &Job)| {
                let sender = sender.clone();
                let mut take = |mut point: PointRecord| {
                    // a single job may hold several branches of its own
                    if jobs.len() > 1 {
                        point.branch = branch;
                    }
                    match sender.send(point) {
                        Ok(()) => Go::Continue(()),
                        Err(_) => Go::Break(()),
                    }
                };
                job(&mut take)
            };
            jobs.par_iter().enumerate().map(run).collect::<Vec<_>>()
        });
        let mut failure = None;
        let mut progress = vec![0.0f64; jobs.len()];
        let mut count = 0;
        for point in &receiver {
            if let Err(e) = writer.push(&point, nbm) {
                failure = Some(e);
                break;
            }
            count += 1;
            if let Some(bar) = bar {
                let share = ((point.omega - low) / (high - low)).clamp(0.0, 1.0);
                let of = point.branch.min(progress.len() - 1);
                progress[of] = progress[of].max(share);
                let mean = progress.iter().sum::<f64>() / progress.len() as f64;
                bar.set_position((mean * bar.length().unwrap_or(1) as f64) as u64);
                bar.set_message(format!("{count} points, omega = {:.4}", point.omega));
            }
        }
        drop(receiver);
        let ended = workers.join().unwrap_or_else(|_| vec![]);
        (ended, failure)
    });
    if let Some(e) = failure {
        return Err(e.into());
    }
    let ended: Result<Vec<Ended>, CliError> = if ended.len() == jobs.len() {
        ended.into_iter().collect()
    } else {
        Err(CliError::Other("a branch ended abnormally; what it found is in the file".into()))
    };
    match ended {
        Ok(ended) => Ok((ended, writer)),
        Err(e) => {
            // the reason of the failure matters more than a failure to record it
            let _ = writer.finish(&format!("failed: {}", e.text()));
            Err(e)
        }
    }
}

/// Follow one branch by arclength: from where an earlier run stood, or from what `start` finds (or why it finds nothing). With
/// `points_suffice` a branch is complete when it has as many points as were asked for.
pub fn follow_branch(
    body: &mut Propagator,
    closure: Closure,
    mut options: Options,
    (index, stored, points_suffice): (usize, Option<&StoredFamily>, bool),
    start: impl FnOnce(&mut Propagator) -> Result<Result<Start, String>, CliError>,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Ended, CliError> {
    let earlier: Vec<&PointRecord> =
        stored.map_or(vec![], |s| s.points.iter().filter(|p| p.branch == index).collect());
    let ended = |text: String, complete: bool| Ok(Ended { branch: index, text, complete });
    if earlier.iter().any(|p| p.special == "end of range") {
        return ended("end of the range (earlier run)".into(), true);
    }
    let from = match earlier.iter().rev().find_map(|p| p.place.as_ref()) {
        Some(place) => Start::Place(branch::place_of(place)),
        None => match start(body)? {
            Ok(start) => start,
            Err(why) => return ended(why, false),
        },
    };
    options.points = options.points.saturating_sub(earlier.len());
    if options.points == 0 {
        return ended("number of points reached (earlier run)".into(), true);
    }
    let stop = branch::arclength(body, closure, from, &options, take)
        .map_err(|e| CliError::Numerics(e.to_string()))?;
    match stop {
        None => ended("the first tangent could not be computed".into(), false),
        Some(stop) => {
            let complete = stop == Stop::Range || (points_suffice && stop == Stop::Points);
            ended(stop.to_string(), complete)
        }
    }
}

/// The frequencies of a sequential continuation.
pub fn grid((low, high): (f64, f64), step: f64) -> Vec<f64> {
    let steps = ((high - low) / step + 1e-9).floor() as usize;
    (0..=steps).map(|k| low + k as f64 * step).collect()
}

/// Refuse what could only fail later.
pub fn check(path: &Path, output: &Output, resume: bool) -> Result<(), CliError> {
    Writer::check(path, output.force || resume).map_err(CliError::from)
}
