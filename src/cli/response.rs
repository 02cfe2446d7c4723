//! `signorini response`

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use signorini::continuation::{Go, Options};
use signorini::orbit::branch::Start;
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::scenario::{Issue, Scene};
use signorini::store::{PointRecord, StoredFamily};

use super::backbone::summary;
use super::balance::{self, Method};
use super::family::{self, Ended, Job, Output};
use super::{CliError, Global, load};

/// Arguments of `response`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini response scenarios/half-plate-response.toml -o response.h5\n  signorini response scenarios/half-plate-response.toml --ratios 0.01,0.05 --range 1.4,1.9 -o two.h5\n  signorini plot response.h5"
)]
pub struct Arguments {
    /// The scene (TOML): damping and harmonic loads of one frequency
    scene: PathBuf,
    /// Damping ratios [default: ratios of [orbit], or the scene's own]
    #[arg(long, value_delimiter = ',', value_name = "RATIOS")]
    ratios: Option<Vec<f64>>,
    /// Frequencies to cover [default: range of the scene's [orbit]]
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH")]
    range: Option<Vec<f64>>,
    /// Largest step of arclength (relative change of the state); a tenth of it is the step in frequency of harmonic balance
    #[arg(long, default_value_t = 0.05)]
    step: f64,
    /// Most points a branch
    #[arg(long, default_value_t = 2000, value_parser = family::at_least_one)]
    points: usize,
    /// Locate changes of stability within a step
    #[arg(long)]
    locate: bool,
    /// Go on with an unfinished file
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    balance: balance::Arguments,
    #[command(flatten)]
    output: Output,
}

/// Stable and unstable branches of the forced response, one for each damping ratio.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let start = Instant::now();
    let scene = Scene::read(&arguments.scene)?;
    let path = arguments.output.path(&scene, "response");
    family::check(&path, &arguments.output, arguments.resume)?;
    if !(arguments.step >= 1e-4 && arguments.step <= 1.0) {
        return Err(CliError::Input(format!(
            "--step {}: give a number from 1e-4 to 1",
            arguments.step
        )));
    }
    let range = family::range(&scene, arguments.range.as_deref())?;
    let scenes = with_ratios(&scene, arguments.ratios.as_deref())?;
    let problem = load::of_scene(&scenes[0].1)?;
    if family::closure(&scene, &problem)? != Closure::Forced {
        let help = "add a [[load]] with omega, for example kind = \"mode\", mode = 1, peak = 3.0, omega = 1.5";
        return Err(scene
            .error(Issue::new("load", "a forced response needs a harmonic load", help))
            .into());
    }
    let hbm = arguments.balance.method == Method::Hbm;
    arguments.balance.check_method()?;
    let harmonics = arguments.balance.list(&scene)?;
    if hbm && (arguments.resume || arguments.balance.aft.is_some()) {
        return Err(CliError::Input(
            "--resume and --aft do not go with a response by harmonic balance".into(),
        ));
    }
    let mut names: Vec<String> = scenes.iter().map(|(name, _)| name.clone()).collect();
    let cases: Vec<(usize, usize)> = match hbm {
        true => (0..scenes.len())
            .flat_map(|s| harmonics.iter().flat_map(move |&n| [(s, n), (s, n)]))
            .collect(),
        false => (0..scenes.len()).map(|s| (s, 0)).collect(),
    };
    let kind =
        if hbm { format!("hbm response, {}", arguments.balance.kind()) } else { "response".into() };
    if hbm {
        // the seed's sequential continuation, once to higher and once to lower frequencies
        let way = |k: usize| if k.is_multiple_of(2) { "up" } else { "down" };
        names = cases
            .iter()
            .enumerate()
            .map(|(k, &(s, n))| format!("{}, N_h = {n}, {}", names[s], way(k)))
            .collect();
    }
    let mut sink = family::open(
        &path,
        &scene,
        &problem.nbm,
        arguments.output.force,
        arguments.resume,
        (&kind, &names, if hbm { harmonics.iter().copied().max().unwrap_or(0) } else { 0 }),
    )?;
    let known = sink.known.take();
    let resumed = known.as_ref().map_or(0, |k| k.points.len());
    let known = &known;
    let scenes = &scenes;
    let jobs: Vec<Job> = cases
        .iter()
        .enumerate()
        .map(|(index, &(s, n_h))| -> Job {
            let scene = &scenes[s].1;
            if hbm {
                let mut grid = family::grid(range, 0.1 * arguments.step);
                if index % 2 == 1 {
                    grid.reverse();
                }
                let choice =
                    balance::Arguments { harmonics: Some(vec![n_h]), ..arguments.balance.clone() };
                return Box::new(move |take| {
                    let ended = balance::sequence(&choice, scene, &grid, None, take)?;
                    Ok(Ended { branch: index, ..ended })
                });
            }
            Box::new(move |take| one(arguments, scene, range, index, known.as_ref(), take))
        })
        .collect();
    let bar = family::bar(global, &scene, 1000);
    let result = family::run_jobs(&jobs, sink, &problem.nbm, range, bar.as_ref());
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    let (ended, writer) = result?;
    writer.finish("complete")?;
    let stored = StoredFamily::read(&path)?;
    summary(global, &scene, &stored, &ended, &path, resumed, start.elapsed().as_secs_f64());
    let failed: Vec<&Ended> = ended.iter().filter(|e| !e.complete).collect();
    match failed.first() {
        None => Ok(()),
        Some(e) => Err(CliError::Reported(format!(
            "{}: {}; everything up to there is in {}",
            stored.branches[e.branch],
            e.text,
            path.display()
        ))),
    }
}

/// The scene once for each damping ratio.
pub fn with_ratios(scene: &Scene, given: Option<&[f64]>) -> Result<Vec<(String, Scene)>, CliError> {
    let of_scene = scene.orbit.as_ref().and_then(|o| o.ratios.as_deref());
    let Some(list) = given.or(of_scene) else {
        return Ok(vec![("forced response".into(), scene.clone())]);
    };
    if let Some(bad) = list.iter().find(|r| !(r.is_finite() && **r > 0.0)) {
        return Err(CliError::Input(format!(
            "--ratios: {bad} is not a damping ratio; give positive numbers"
        )));
    }
    let with = |&ratio: &f64| {
        let mut scene = scene.clone();
        match &mut scene.damping {
            Some(d) if d.ratio.is_some() => d.ratio = Some(ratio),
            _ => {
                let help = "[damping] with ratio = 0.02 and mode = 1";
                let issue = Issue::new(
                    "damping",
                    "several ratios stand in place of one, and there is none",
                    help,
                );
                return Err(CliError::from(scene.error(issue)));
            }
        }
        Ok((format!("damping ratio {} %", 100.0 * ratio), scene))
    };
    list.iter().map(with).collect()
}

fn options(arguments: &Arguments, range: (f64, f64), points: usize) -> Options {
    let step = (0.2 * arguments.step, 1e-9, arguments.step);
    Options { range, step, points, locate: arguments.locate, natural: false }
}

fn one(
    arguments: &Arguments,
    scene: &Scene,
    range: (f64, f64),
    index: usize,
    stored: Option<&StoredFamily>,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Ended, CliError> {
    let problem = load::of_scene(scene)?;
    let mut body = family::propagator(problem.nbm)?;
    let options = options(arguments, range, arguments.points);
    let start = |body: &mut Propagator| {
        body.nbm.loads.set_frequency(range.0);
        let guess = body.linear_response();
        let verdict = find(body, Closure::Forced, &guess, range.0, &Effort::default())
            .map_err(|e| CliError::Numerics(e.to_string()))?;
        Ok(match verdict.orbit() {
            Some(orbit) => Ok(Start::Orbit(Box::new(orbit.clone()), 1.0)),
            None => Err(format!("no orbit at omega = {}: {verdict}", range.0)),
        })
    };
    let place = (index, stored, false);
    family::follow_branch(&mut body, Closure::Forced, options, place, start, take)
}
