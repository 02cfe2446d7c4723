//! `signorini backbone`

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use serde_json::json;

use signorini::continuation::{Go, Options};
use signorini::orbit::Propagator;
use signorini::orbit::branch::{self, Sequential, Start};
use signorini::orbit::search::{Effort, find};
use signorini::records::{
    Branch, BranchEnd, Direction, EndReason, FamilyKind, Grid, PointKind, PointMethod, PointRecord,
    Walk, fingerprint,
};
use signorini::scenario::{Issue, Scene};
use signorini::store::{FamilyPlan, StoredFamily};

use super::balance::{self, Method};
use super::family::{self, Job, Known, Legs, Opened, Output};
use super::progress::Bar;
use super::{CliError, Global, interrupt, load, plain};

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
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", allow_hyphen_values = true)]
    range: Option<Vec<f64>>,
    /// Sequential: step in frequency [default: a four-hundredth of the highest frequency, rounded]; arclength and natural: first step,
    /// relative [default: 0.005]
    #[arg(long, value_name = "STEP", allow_negative_numbers = true)]
    step: Option<f64>,
    /// Arclength and natural: the frequency of the orbit to start from [default: that of the scene's [orbit]]
    #[arg(long, value_name = "W")]
    omega: Option<f64>,
    /// Arclength and natural: most points a branch
    #[arg(long, default_value_t = 400, value_parser = family::at_least_one)]
    points: usize,
    /// Arclength: locate changes of stability within a step
    #[arg(long)]
    locate: bool,
    /// Go on with an unfinished file, or widen the range of a finished one; everything else must be as it was
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

impl Arguments {
    /// The step: of frequency on a grid, where the default is a round share of the frequency itself; of arclength otherwise.
    fn step(&self, range: (f64, f64)) -> Result<f64, CliError> {
        let refuse = |why: String| Err(CliError::Input(why));
        if self.follow != Follow::Sequential {
            let step = self.step.unwrap_or(0.005);
            return match (1e-6..=1.0).contains(&step) {
                true => Ok(step),
                false => refuse(format!(
                    "--step {}: give a number from 1e-6 to 1, the first step of arclength (a relative change)",
                    plain(step)
                )),
            };
        }
        let step = self.step.unwrap_or_else(|| family::round_number(range.1 / 400.0));
        if !(step > 0.0 && step.is_finite()) {
            return refuse(format!("--step {}: give a positive number", plain(step)));
        }
        if (range.1 - range.0) / step > 1e6 {
            return refuse(format!(
                "--step {}: more than a million frequencies between {} and {}; give at least {}",
                plain(step),
                plain(range.0),
                plain(range.1),
                plain(1e-6 * (range.1 - range.0))
            ));
        }
        Ok(step)
    }

    /// How points follow one another.
    fn walk(&self, scene: &Scene, range: (f64, f64)) -> Result<Walk, CliError> {
        let step = self.step(range)?;
        if self.follow == Follow::Sequential {
            return Ok(Walk::Grid(Grid { origin: range.0, step }));
        }
        let start = family::omega(scene, self.omega, None)?;
        if !(range.0..=range.1).contains(&start) {
            let message = format!(
                "the orbit to start from, at omega = {start}, is outside of the range {} to {}",
                range.0, range.1
            );
            return Err(CliError::Input(format!("{message}; give --omega or --range")));
        }
        let natural = self.follow == Follow::Natural;
        Ok(Walk::Branch { start, step, locate: self.locate, natural })
    }

    fn branches(&self, harmonics: &[usize]) -> Vec<Branch> {
        let hbm = self.balance.method == Method::Hbm;
        match self.follow {
            Follow::Sequential if hbm => balance::branches(harmonics),
            Follow::Sequential => vec![Branch::Sequential],
            _ if hbm => harmonics
                .iter()
                .flat_map(|&harmonics| {
                    let along = |d| Branch::Series { harmonics, direction: Some(d) };
                    Direction::BOTH.map(along)
                })
                .collect(),
            _ => Direction::BOTH.map(Branch::Along).to_vec(),
        }
    }
}

/// Follow a family of orbits.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let start = Instant::now();
    let scene = Scene::read(&arguments.scene)?;
    let path = arguments.output.path(&scene, "backbone");
    let options = arguments.output.rules(&scene, &path, arguments.resume, &[])?;
    let range = family::range(&scene, arguments.range.as_deref())?;
    arguments.balance.check_method()?;
    let harmonics = arguments.balance.list(&scene)?;
    arguments.balance.settings()?;
    let walk = arguments.walk(&scene, range)?;
    let problem = load::of_scene(&scene)?;
    [range.0, range.1].into_iter().try_for_each(|w| family::check_frequency(&problem, w))?;
    let closure = family::closure(&scene, &problem)?;
    if arguments.follow != Follow::Sequential && closure == signorini::orbit::Closure::Autonomous {
        let help = "leave [initial] out, or give a state at rest: the orbit of `signorini orbit` starts at rest where it can";
        let issue = Issue::new("initial", "families by arclength start from a state at rest", help);
        return Err(scene.error(issue).into());
    }
    let hbm = arguments.balance.method == Method::Hbm;
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
            branches: arguments.branches(&harmonics),
            harmonics: if hbm { harmonics.iter().copied().max().unwrap_or(0) } else { 0 },
        },
        points: arguments.points,
        unknowns: (!hbm).then(|| closure.unknowns(problem.system.n_o())),
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
            let jobs = jobs(arguments, &scene, (walk, range), &harmonics, &known);
            let bar = Bar::new(global, &scene);
            let result = family::run_jobs(&jobs, *writer, &problem.system, range, bar.as_ref());
            if let Some(bar) = &bar {
                bar.clear();
            }
            let ends = result?;
            (StoredFamily::read(&path)?, ends, known.len())
        }
    };
    let wall = start.elapsed().as_secs_f64();
    summary(global, &scene, &stored, &ends, &path, resumed, wall)?;
    if stored.points.iter().all(|p| p.orbit.is_none()) {
        return Err(CliError::Reported("no orbit was found; give a better [initial] guess, or look with `signorini orbit --all`".into()));
    }
    Ok(())
}

/// The branches, each as a job.
fn jobs<'a>(
    arguments: &'a Arguments,
    scene: &'a Scene,
    (walk, range): (Walk, (f64, f64)),
    harmonics: &'a [usize],
    known: &'a Known,
) -> Vec<Job<'a>> {
    let hbm = arguments.balance.method == Method::Hbm;
    match walk {
        Walk::Grid(grid) if hbm => vec![Box::new(move |take| {
            let all = known.all();
            balance::sequence(&arguments.balance, scene, (grid, range, false), &all, take)
        })],
        Walk::Grid(grid) => vec![Box::new(move |take| sequence(scene, grid, range, known, take))],
        Walk::Branch { start, step, .. } => {
            let options = options(arguments, range, step);
            let count = if hbm { 2 * harmonics.len() } else { 2 };
            let job = |index: usize| -> Job {
                let direction = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
                let options = options.clone();
                match hbm.then(|| harmonics[index / 2]) {
                    Some(n_h) => Box::new(move |take| {
                        let (options, from) = (options.clone(), (n_h, start, direction));
                        let place = (index, known);
                        balance::arclength(&arguments.balance, scene, from, options, place, take)
                    }),
                    None => Box::new(move |take| {
                        arclength(scene, start, options.clone(), (direction, index), known, take)
                    }),
                }
            };
            (0..count).map(job).collect()
        }
        _ => vec![],
    }
}

/// The text and JSON of a family.
pub fn summary(
    global: &Global,
    scene: &Scene,
    stored: &StoredFamily,
    ended: &[BranchEnd],
    path: &std::path::Path,
    resumed: usize,
    wall: f64,
) -> Result<(), CliError> {
    let orbits = stored.points.iter().filter(|p| p.orbit.is_some()).count();
    let gaps: Vec<&PointRecord> = stored.points.iter().filter(|p| p.special.is_gap()).collect();
    let jumps = stored.points.iter().filter(|p| p.special == PointKind::Jump).count();
    let specials: Vec<&PointRecord> = stored
        .points
        .iter()
        .filter(|p| {
            use PointKind::{EndOfRange, Gap, Jump, Regular, Start};
            !matches!(p.special, Regular | Start | EndOfRange | Jump | Gap(_))
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
            let names: Vec<String> = stored.branches.iter().map(Branch::to_string).collect();
            let stops: Vec<_> =
                ended.iter().map(|e| json!({"branch": e.branch, "stop": e.text, "complete": e.complete})).collect();
            json!({"points": points, "branches": names, "stops": stops, "resumed": resumed, "wall_s": wall,
                "output": path.display().to_string()})
        },
        || {
            let title = super::title(scene);
            let mut out = format!("{title}\n");
            let mut line = |label: &str, text: String| out.push_str(&format!("  {label:<14}{text}\n"));
            let before = if resumed > 0 { format!(" ({resumed} points of an earlier run)") } else { String::new() };
            let known = stored.points.iter().filter_map(|p| p.orbit.as_ref()).any(|o| o.stable.is_some());
            let stable = if known { format!(", {stable} of them stable") } else { String::new() };
            line("found", format!("{orbits} orbits{stable}{}{before}", on_a_grid(stored, gaps.len(), jumps)));
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
    )
}

/// What a grid of frequencies left open, and what to do about it.
fn on_a_grid(stored: &StoredFamily, gaps: usize, jumps: usize) -> String {
    let Some(Walk::Grid(_)) = stored.identity.as_ref().map(|i| i.walk) else {
        return String::new();
    };
    if gaps + jumps == 0 {
        return String::new();
    }
    let shooting = stored.identity.as_ref().is_some_and(|i| i.method == PointMethod::Shooting);
    let hint = match shooting {
        true => {
            "; the branch folds back there, or another crosses it: --follow arclength goes around"
        }
        false => "; more harmonics, or --follow arclength, may close them",
    };
    format!(", {gaps} frequencies without one, {jumps} jumps to another branch{hint}")
}

fn numerics(e: signorini::orbit::OrbitError) -> CliError {
    CliError::Numerics(e.to_string())
}

fn options(arguments: &Arguments, range: (f64, f64), step: f64) -> Options {
    Options {
        range,
        step: (step, 1e-8, 0.05f64.max(step)),
        points: arguments.points,
        locate: arguments.locate,
        natural: arguments.follow == Follow::Natural,
    }
}

fn sequence(
    scene: &Scene,
    grid: Grid,
    range: (f64, f64),
    known: &Known,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<BranchEnd, CliError> {
    let problem = load::of_scene(scene)?;
    let closure = family::closure(scene, &problem)?;
    let initial = problem.initial.clone();
    let mut body = family::propagator(problem.system)?;
    let first = family::guesses(scene, &initial, &body, closure);
    let earlier = known.branch(0);
    let mut interrupted = false;
    let legs = Legs::new(grid, range, false, &earlier);
    for (places, before) in legs.each(&earlier) {
        let frequencies = legs.frequencies(places);
        let of_place = |x: &[f64]| (x[x.len() - 1], x[..x.len() - 1].to_vec());
        let known = before.iter().filter_map(|p| p.place.as_ref());
        let known = known.filter(|p| !p.x.is_empty()).map(|p| of_place(&p.x)).collect();
        let plan =
            Sequential { grid: &frequencies, effort: Effort::default(), first: first.clone() };
        let mut next = places.iter();
        branch::sequential(&mut body, closure, &plan, known, |point, _| {
            let index = next.next().copied().unwrap_or_default();
            let go = take(PointRecord { index, ..point });
            interrupted = go.is_break();
            go
        })
        .map_err(numerics)?;
        if interrupted {
            return Ok(family::ended(0, EndReason::Interrupted, "interrupted", false));
        }
    }
    let text =
        format!("{} frequencies from {} to {}", grid.within(range).count(), range.0, range.1);
    Ok(family::ended(0, EndReason::Range, text, true))
}

fn arclength(
    scene: &Scene,
    omega: f64,
    options: Options,
    (direction, index): (f64, usize),
    known: &Known,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<BranchEnd, CliError> {
    let problem = load::of_scene(scene)?;
    let closure = family::closure(scene, &problem)?;
    let initial = problem.initial.clone();
    let mut body = family::propagator(problem.system)?;
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
    family::follow_branch(&mut body, closure, options, (index, known, true), start, take)
}
