//! `signorini backbone`

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use serde_json::json;

use signorini::continuation::{Go, Options};
use signorini::orbit::Propagator;
use signorini::orbit::branch::{self, Sequential, Start};
use signorini::orbit::search::{Effort, find};
use signorini::scenario::{Issue, Scene};
use signorini::store::{PointRecord, StoredFamily};

use super::balance::{self, Method};
use super::family::{self, Ended, Job, Output};
use super::{CliError, Global, load};

/// Arguments of `backbone`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini backbone scenarios/half-plate-orbit.toml -o backbone.h5\n  signorini backbone scenarios/half-plate-orbit.toml --follow arclength --omega 1.8 --points 200 -o branch.h5\n  signorini backbone scenarios/half-plate-orbit.toml -o backbone.h5 --resume\n  signorini plot backbone.h5"
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// How a family is followed
    #[arg(long, value_enum, default_value_t = Follow::Sequential)]
    follow: Follow,
    /// Frequencies to cover [default: range of the scene's [orbit]]
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH")]
    range: Option<Vec<f64>>,
    /// Step in frequency (sequential), or first step of arclength
    #[arg(long, default_value_t = 0.005)]
    step: f64,
    /// Arclength and natural: the frequency of the orbit to start from [default: that of the scene's [orbit]]
    #[arg(long, value_name = "W")]
    omega: Option<f64>,
    /// Arclength and natural: most points a branch
    #[arg(long, default_value_t = 400, value_parser = family::at_least_one)]
    points: usize,
    /// Arclength: locate changes of stability within a step
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

/// Ways to follow a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Follow {
    /// One orbit at each frequency of a grid, from the last ones; steps over internal resonances and says so
    Sequential,
    /// Pseudo-arclength through folds, grazings and changes of the switch sequence, in both directions
    Arclength,
    /// In steps of frequency, up to the first fold, in both directions
    Natural,
}

/// Follow a family of orbits.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let start = Instant::now();
    let scene = Scene::read(&arguments.scene)?;
    let path = arguments.output.path(&scene, "backbone");
    family::check(&path, &arguments.output, arguments.resume)?;
    let range = family::range(&scene, arguments.range.as_deref())?;
    if !(arguments.step >= 1e-6 && arguments.step.is_finite()) {
        return Err(CliError::Input(format!("--step {}: give a number from 1e-6", arguments.step)));
    }
    if arguments.follow == Follow::Sequential && (range.1 - range.0) / arguments.step > 1e6 {
        let message = format!(
            "--step {}: more than a million frequencies between {} and {}",
            arguments.step, range.0, range.1
        );
        return Err(CliError::Input(message));
    }
    let problem = load::of_scene(&scene)?;
    let closure = family::closure(&scene, &problem)?;
    let sequential = arguments.follow == Follow::Sequential;
    if !sequential {
        if closure == signorini::orbit::Closure::Autonomous {
            let help = "leave [initial] out, or give a state at rest: the orbit of `signorini orbit` starts at rest where it can";
            let issue =
                Issue::new("initial", "families by arclength start from a state at rest", help);
            return Err(scene.error(issue).into());
        }
        let omega = family::omega(&scene, arguments.omega, None)?;
        if !(range.0..=range.1).contains(&omega) {
            let message = format!(
                "the orbit to start from, at omega = {omega}, is outside of the range {} to {}",
                range.0, range.1
            );
            return Err(CliError::Input(format!("{message}; give --omega or --range")));
        }
    }
    let hbm = arguments.balance.method == Method::Hbm;
    arguments.balance.check_method()?;
    let harmonics = arguments.balance.list(&scene)?;
    arguments.balance.settings()?;
    if hbm && arguments.resume && !sequential {
        return Err(CliError::Input(
            "--resume goes with shooting, or with sequential harmonic balance".into(),
        ));
    }
    let names: Vec<String> = match arguments.follow {
        Follow::Sequential if hbm => balance::names(&harmonics),
        _ if hbm => harmonics
            .iter()
            .flat_map(|n| [format!("N_h = {n}, up"), format!("N_h = {n}, down")])
            .collect(),
        Follow::Sequential => vec!["shooting, sequential".into()],
        _ => {
            vec!["shooting, to higher frequencies".into(), "shooting, to lower frequencies".into()]
        }
    };
    let follow = format!("{:?}", arguments.follow).to_lowercase();
    let kind = match hbm {
        true => format!("hbm {follow}, {}, step {}", arguments.balance.kind(), arguments.step),
        false => format!("shooting {follow}, step {}", arguments.step),
    };
    let from = arguments.omega.map_or(String::new(), |w| format!(", from {w}"));
    let kind = format!("{kind}{from}");
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
    let jobs: Vec<Job> = if hbm && sequential {
        let (known, scene, grid) = (&known, &scene, family::grid(range, arguments.step));
        vec![Box::new(move |take| {
            balance::sequence(&arguments.balance, scene, &grid, known.as_ref(), take)
        })]
    } else if hbm {
        let omega = family::omega(&scene, arguments.omega, None)?;
        let scene = &scene;
        let options = options(arguments, range, arguments.points);
        let job = |index: usize| -> Job {
            let (n_h, direction) =
                (harmonics[index / 2], if index.is_multiple_of(2) { 1.0 } else { -1.0 });
            let options = options.clone();
            Box::new(move |take| {
                balance::arclength(
                    &arguments.balance,
                    scene,
                    n_h,
                    (omega, direction),
                    &options,
                    index,
                    take,
                )
            })
        };
        (0..2 * harmonics.len()).map(job).collect()
    } else if sequential {
        let known = &known;
        let scene = &scene;
        vec![Box::new(move |take| sequence(arguments, scene, range, known.as_ref(), take))]
    } else {
        let omega = family::omega(&scene, arguments.omega, None)?;
        let (scene, known) = (&scene, &known);
        let job = |direction: f64, index: usize| -> Job {
            Box::new(move |take| {
                arclength(arguments, scene, range, omega, (direction, index), known.as_ref(), take)
            })
        };
        vec![job(1.0, 0), job(-1.0, 1)]
    };
    let bar = family::bar(global, &scene, 1000);
    let result = family::run_jobs(&jobs, sink, &problem.nbm, range, bar.as_ref());
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    let (ended, writer) = result?;
    writer.finish("complete")?;
    let stored = StoredFamily::read(&path)?;
    let wall = start.elapsed().as_secs_f64();
    summary(global, &scene, &stored, &ended, &path, resumed, wall);
    if stored.points.iter().all(|p| p.orbit.is_none()) {
        return Err(CliError::Reported("no orbit was found; give a better [initial] guess, or look with `signorini orbit --all`".into()));
    }
    Ok(())
}

/// The text and JSON of a family.
pub fn summary(
    global: &Global,
    scene: &Scene,
    stored: &StoredFamily,
    ended: &[Ended],
    path: &std::path::Path,
    resumed: usize,
    wall: f64,
) {
    let orbits = stored.points.iter().filter(|p| p.orbit.is_some()).count();
    let gaps = stored.points.iter().filter(|p| p.special.starts_with("gap")).count();
    let specials: Vec<&PointRecord> = stored
        .points
        .iter()
        .filter(|p| {
            !["regular", "start", "end of range"].contains(&p.special.as_str())
                && !p.special.starts_with("gap")
        })
        .collect();
    let stable = stored
        .points
        .iter()
        .filter(|p| p.orbit.as_ref().is_some_and(|o| o.stable == Some(true)))
        .count();
    global.print(
        || {
            let points: Vec<_> = stored
                .points
                .iter()
                .map(|p| {
                    let o = p.orbit.as_ref();
                    json!({
                        "omega": p.omega, "branch": p.branch, "special": p.special, "converged": o.is_some(),
                        "energy": o.map(|o| o.energy), "amplitude": o.map(|o| o.amplitude), "residual": o.map(|o| o.residual),
                        "switches": o.map(|o| o.switches.len()), "stable": o.and_then(|o| o.stable),
                    })
                })
                .collect();
            let stops: Vec<_> =
                ended.iter().map(|e| json!({"branch": e.branch, "stop": e.text, "complete": e.complete})).collect();
            json!({"points": points, "branches": stored.branches, "stops": stops, "resumed": resumed, "wall_s": wall,
                "output": path.display().to_string()})
        },
        || {
            let title = if scene.title.is_empty() { scene.stem() } else { scene.title.clone() };
            let mut out = format!("{title}\n");
            let mut line = |label: &str, text: String| out.push_str(&format!("  {label:<14}{text}\n"));
            let before = if resumed > 0 { format!(" ({resumed} points of an earlier run)") } else { String::new() };
            line("points", format!("{} orbits, {stable} of them stable, {gaps} gaps{before}", orbits));
            for e in ended {
                let name = if ended.len() == 1 { String::new() } else { format!("{}: ", stored.branches[e.branch]) };
                line(if e.branch == 0 { "branches" } else { "" }, format!("{name}{}", e.text));
            }
            let most = 30;
            for (k, p) in specials.iter().take(most).enumerate() {
                let energy = p.orbit.as_ref().map_or(String::new(), |o| format!(", energy {:.6}", o.energy));
                line(if k == 0 { "on the way" } else { "" }, format!("omega = {:.8}{energy}: {}", p.omega, p.special));
            }
            if specials.len() > most {
                line("", format!("… and {} more; all are in the file", specials.len() - most));
            }
            line("time", format!("{wall:.1} s"));
            line("written to", format!("{} (pictures: signorini plot {})", path.display(), path.display()));
            out
        },
    );
}

fn numerics(e: signorini::orbit::OrbitError) -> CliError {
    CliError::Numerics(e.to_string())
}

fn options(arguments: &Arguments, range: (f64, f64), points: usize) -> Options {
    Options {
        range,
        step: (arguments.step, 1e-8, 0.05f64.max(arguments.step)),
        points,
        locate: arguments.locate,
        natural: arguments.follow == Follow::Natural,
    }
}

fn sequence(
    arguments: &Arguments,
    scene: &Scene,
    (low, high): (f64, f64),
    stored: Option<&StoredFamily>,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Ended, CliError> {
    let problem = load::of_scene(scene)?;
    let closure = family::closure(scene, &problem)?;
    let initial = problem.initial.clone();
    let mut body = family::propagator(problem.nbm)?;
    let grid = family::grid((low, high), arguments.step);
    let first = family::guesses(scene, &initial, &body, closure);
    let done = stored.map_or(0, |s| s.points.len());
    let known = stored.map_or(vec![], |s| {
        let places = s.points.iter().filter_map(|p| p.place.as_ref());
        places.map(|p| (p.x[p.x.len() - 1], p.x[..p.x.len() - 1].to_vec())).collect()
    });
    let plan = Sequential { grid: &grid[done.min(grid.len())..], effort: Effort::default(), first };
    let mut interrupted = false;
    branch::sequential(&mut body, closure, &plan, known, |point, _| {
        let go = take(point);
        interrupted = go.is_break();
        go
    })
    .map_err(numerics)?;
    let text = if interrupted {
        "interrupted".into()
    } else {
        format!("{} frequencies from {low} to {high}", grid.len())
    };
    Ok(Ended { branch: 0, text, complete: !interrupted })
}

fn arclength(
    arguments: &Arguments,
    scene: &Scene,
    range: (f64, f64),
    omega: f64,
    (direction, index): (f64, usize),
    stored: Option<&StoredFamily>,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<Ended, CliError> {
    let problem = load::of_scene(scene)?;
    let closure = family::closure(scene, &problem)?;
    let initial = problem.initial.clone();
    let mut body = family::propagator(problem.nbm)?;
    let options = options(arguments, range, arguments.points);
    let start = |body: &mut Propagator| {
        for guess in family::guesses(scene, &initial, body, closure) {
            let verdict =
                find(body, closure, &guess, omega, &Effort::default()).map_err(numerics)?;
            if let Some(orbit) = verdict.orbit() {
                return Ok(Ok(Start::Orbit(Box::new(orbit.clone()), direction)));
            }
        }
        Err(CliError::Numerics(format!(
            "no orbit to start from at omega = {omega}; look for one with `signorini orbit --all`"
        )))
    };
    family::follow_branch(&mut body, closure, options, (index, stored, true), start, take)
}
