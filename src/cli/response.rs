//! `signorini response`

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use signorini::continuation::{Go, Options};
use signorini::orbit::branch::Start;
use signorini::orbit::search::{Effort, find};
use signorini::orbit::{Closure, Propagator};
use signorini::records::{
    Branch, BranchEnd, Direction, FamilyKind, Grid, PointRecord, Walk, fingerprint,
};
use signorini::scenario::{Issue, Scene};
use signorini::store::{FamilyPlan, StoredFamily};

use super::backbone::summary;
use super::balance::{self, Method};
use super::family::{self, Job, Known, Opened, Output};
use super::progress::Bar;
use super::{CliError, Global, interrupt, load, plain};

/// Arguments of `response`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini response scenarios/half-plate-response.toml -o response.h5\n  signorini response scenarios/half-plate-response.toml --ratios 0.01,0.05 --range 1.4,1.9 -o two.h5\n  signorini plot response.h5"
)]
pub struct Arguments {
    /// The scene (TOML): damping and harmonic loads of one frequency
    scene: PathBuf,
    /// Damping ratios [default: ratios of [orbit], or the scene's own]
    #[arg(long, value_delimiter = ',', value_name = "RATIOS", allow_hyphen_values = true)]
    ratios: Option<Vec<f64>>,
    /// Frequencies to cover [default: range of the scene's [orbit]]
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", allow_hyphen_values = true)]
    range: Option<Vec<f64>>,
    /// Largest step of arclength (relative change of the state); the steps in frequency of harmonic balance follow it in proportion (at
    /// 0.05: a four-hundredth of the highest frequency, rounded)
    #[arg(long, default_value_t = 0.05, allow_negative_numbers = true)]
    step: f64,
    /// Most points a branch
    #[arg(long, default_value_t = 2000, value_parser = family::at_least_one)]
    points: usize,
    /// Locate changes of stability within a step
    #[arg(long)]
    locate: bool,
    /// Go on with an unfinished file, or to a higher end of the range of a finished one; everything else must be as it was
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
    let options = arguments.output.rules(&scene, &path, arguments.resume, &[])?;
    if !(arguments.step >= 1e-4 && arguments.step <= 1.0) {
        return Err(CliError::Input(format!(
            "--step {}: give a number from 1e-4 to 1",
            plain(arguments.step)
        )));
    }
    let range = family::range(&scene, arguments.range.as_deref())?;
    let scenes = with_ratios(&scene, arguments.ratios.as_deref())?;
    let problem = load::of_scene(&scenes[0].1)?;
    [range.0, range.1].into_iter().try_for_each(|w| family::check_frequency(&problem, w))?;
    if family::closure(&scene, &problem)? != Closure::Forced {
        let help = "add a [[load]] with omega, for example kind = \"mode\", mode = 1, peak = 3.0, omega = 1.5";
        return Err(scene
            .error(Issue::new("load", "a forced response needs a harmonic load", help))
            .into());
    }
    let hbm = arguments.balance.method == Method::Hbm;
    arguments.balance.check_method()?;
    let harmonics = arguments.balance.list(&scene)?;
    if hbm && arguments.balance.aft.is_some() {
        return Err(CliError::Input(
            "--aft does not go with a response by harmonic balance".into(),
        ));
    }
    let cases: Vec<(usize, usize)> = match hbm {
        true => (0..scenes.len())
            .flat_map(|s| harmonics.iter().flat_map(move |&n| [(s, n), (s, n)]))
            .collect(),
        false => (0..scenes.len()).map(|s| (s, 0)).collect(),
    };
    let branches: Vec<Branch> = cases
        .iter()
        .zip(Direction::BOTH.into_iter().cycle())
        .map(|(&(s, n_h), direction)| Branch::Response {
            percent: scenes[s].0,
            // sequential continuation, once to higher and once to lower frequencies
            series: hbm.then_some((n_h, direction)),
        })
        .collect();
    let walk = match hbm {
        true => Walk::Response(arguments.grid(range)),
        false => Walk::Upwards { start: range.0, step: arguments.step, locate: arguments.locate },
    };
    let asked = family::Asked {
        path: &path,
        scene: &scene,
        system: &problem.system,
        plan: FamilyPlan {
            identity: FamilyKind {
                method: arguments.balance.method(),
                walk,
                problem: fingerprint(&problem),
            },
            range: [range.0, range.1],
            branches,
            harmonics: if hbm { harmonics.iter().copied().max().unwrap_or(0) } else { 0 },
        },
        points: arguments.points,
        unknowns: (!hbm).then(|| Closure::Forced.unknowns(problem.system.n_o())),
        options,
    };
    let (stored, ends, resumed) = match family::open(&asked, arguments.resume)? {
        Opened::Whole(stored) => {
            let (ends, resumed) = (stored.ends.clone(), stored.points.len());
            (*stored, ends, resumed)
        }
        Opened::Writing(writer, known) => {
            interrupt::watch();
            // a grid that was widened counts from where it began
            let walk = writer.plan().identity.walk;
            let (known, scenes) = (&known, &scenes);
            let job = |(index, &(s, n_h)): (usize, &(usize, usize))| -> Job {
                let scene = &scenes[s].1;
                match walk.grid() {
                    Some(grid) => {
                        let choice = balance::Arguments {
                            harmonics: Some(vec![n_h]),
                            ..arguments.balance.clone()
                        };
                        Box::new(move |take| {
                            // the one branch of this job
                            let of_job = |p: &PointRecord| PointRecord { branch: 0, ..p.clone() };
                            let earlier: Vec<PointRecord> =
                                known.branch(index).into_iter().map(of_job).collect();
                            let earlier: Vec<&PointRecord> = earlier.iter().collect();
                            let way = (grid, range, index % 2 == 1);
                            let end = balance::sequence(&choice, scene, way, &earlier, take)?;
                            Ok(BranchEnd { branch: index, ..end })
                        })
                    }
                    None => Box::new(move |take| one(arguments, scene, range, index, known, take)),
                }
            };
            let jobs: Vec<Job> = cases.iter().enumerate().map(job).collect();
            let bar = Bar::new(global, &scene);
            let result = family::run_jobs(&jobs, *writer, &problem.system, range, bar.as_ref());
            if let Some(bar) = &bar {
                bar.clear();
            }
            let ends = result?;
            (StoredFamily::read(&path)?, ends, known.len())
        }
    };
    summary(global, &scene, &stored, &ends, &path, resumed, start.elapsed().as_secs_f64())?;
    match ends.iter().find(|e| !e.complete) {
        None => Ok(()),
        Some(e) => Err(CliError::Reported(format!(
            "{}: {}; everything up to there is in {}",
            stored.branches[e.branch],
            e.text,
            path.display()
        ))),
    }
}

impl Arguments {
    /// Frequencies of harmonic balance: a tenth of the step, over the scale of the frequency.
    fn grid(&self, range: (f64, f64)) -> Grid {
        // 0.005 at frequencies of the order of one
        let step = family::round_number(range.1 / 400.0) * (self.step / 0.05);
        Grid { origin: range.0, step }
    }
}

/// The scene once for each damping ratio, with the ratio in percent.
pub fn with_ratios(
    scene: &Scene,
    given: Option<&[f64]>,
) -> Result<Vec<(Option<f64>, Scene)>, CliError> {
    let of_scene = scene.orbit.as_ref().and_then(|o| o.ratios.as_deref());
    let Some(list) = given.or(of_scene) else {
        return Ok(vec![(None, scene.clone())]);
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
        Ok((Some(100.0 * ratio), scene))
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
    known: &Known,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<BranchEnd, CliError> {
    let problem = load::of_scene(scene)?;
    let mut body = family::propagator(problem.system)?;
    let options = options(arguments, range, arguments.points);
    let start = |body: &mut Propagator| {
        body.system.loads.set_frequency(range.0);
        let guess = body.linear_response();
        let verdict = find(body, Closure::Forced, &guess, range.0, &Effort::default())
            .map_err(|e| CliError::Numerics(e.to_string()))?;
        Ok(match verdict.orbit() {
            Some(orbit) => Ok(Start::Orbit(Box::new(orbit.clone()), 1.0)),
            None => Err(format!("no orbit at omega = {}: {verdict}", range.0)),
        })
    };
    let place = (index, known, false);
    family::follow_branch(&mut body, Closure::Forced, options, place, start, take)
}
