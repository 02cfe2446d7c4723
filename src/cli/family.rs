//! What `orbit`, `backbone` and `response` share: how a scene closes, its frequency and guess, and branches computed side by side
//! into one file.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc;

use clap::Args;
use rayon::prelude::*;

use signorini::contact::System;
use signorini::continuation::{Go, Options, Stop};
use signorini::orbit::branch::{self, Start};
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::{
    Branch, BranchEnd, Direction, EndReason, Grid, PlaceRecord, PointKind, PointRecord, Walk,
};
use signorini::scenario::{Issue, Scene};
use signorini::store::{FamilyPlan, FamilyWriter, Outputs, StoredFamily, WriterOptions};

use super::progress::Bar;
use super::{CliError, interrupt, plain};

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
    pub fn rules(
        &self,
        scene: &Scene,
        path: &Path,
        resume: bool,
        more: &[&Path],
    ) -> Result<WriterOptions, CliError> {
        writer_options(scene, path, self.force, resume, more)
    }
}

/// How the file `path` of a command is written that reads a scene, the files that it names, and `more`.
pub fn writer_options(
    scene: &Scene,
    path: &Path,
    force: bool,
    resume: bool,
    more: &[&Path],
) -> Result<WriterOptions, CliError> {
    let outputs = Outputs::new(force)
        .reads(scene.source.file.clone())
        .reads_all(scene.files())
        .reads_all(more.iter().map(|p| p.to_path_buf()));
    outputs.with_force(force || resume).check(path)?;
    let command: Vec<String> = std::env::args().collect();
    Ok(WriterOptions { outputs, command: command.join(" ") })
}

/// A number of points.
pub fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse::<usize>().ok().filter(|n| *n > 0).ok_or_else(|| "give a whole number from 1".into())
}

/// The number with one digit, 1, 2 or 5, that is nearest to a positive one.
pub fn round_number(x: f64) -> f64 {
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
pub fn check_frequency(problem: &Problem, omega: f64) -> Result<(), CliError> {
    let body = &problem.system.body;
    let (unit, bound) = (body.frequency_unit(), body.frequency_bound());
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

/// How periodic motions of a scene close.
pub fn closure(scene: &Scene, problem: &Problem) -> Result<Closure, CliError> {
    let system = &problem.system;
    let fail = |key: &str, message: &str, help: &str| {
        Err(scene.error(Issue::new(key, message, help)).into())
    };
    if system.n_contact() == 0 {
        return fail(
            "contact",
            "is missing: orbits are those of a body in contact",
            "add [contact]",
        );
    }
    let mut frequencies = system.loads.harmonics.iter().map(|h| h.omega);
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
    if system.damping.is_some() {
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
pub fn propagator(system: System) -> Result<Propagator, CliError> {
    Propagator::new(system).map_err(|e| CliError::Numerics(e.to_string()))
}

/// A branch to compute: it hands its points on.
pub type Job<'a> = Box<
    dyn Fn(&mut dyn FnMut(PointRecord) -> Go) -> Result<BranchEnd, CliError> + Send + Sync + 'a,
>;

/// The end of a branch.
pub fn ended(
    branch: usize,
    reason: EndReason,
    text: impl Into<String>,
    complete: bool,
) -> BranchEnd {
    BranchEnd { branch, reason, text: text.into(), complete }
}

/// What a family is asked for.
pub struct Asked<'a> {
    /// Where it is written.
    pub path: &'a Path,
    /// The scene.
    pub scene: &'a Scene,
    /// Operators.
    pub system: &'a System,
    /// Its kind, range and branches.
    pub plan: FamilyPlan,
    /// Most points of a branch that is followed by arclength.
    pub points: usize,
    /// Unknowns of an orbit, where orbits are shot.
    pub unknowns: Option<usize>,
    /// How files are written.
    pub options: WriterOptions,
}

/// What an earlier run left.
#[derive(Default)]
pub struct Known {
    points: Vec<PointRecord>,
    ends: Vec<BranchEnd>,
}

impl Known {
    /// The points of a branch, in the order of the walk.
    pub fn branch(&self, branch: usize) -> Vec<&PointRecord> {
        let mut points: Vec<&PointRecord> =
            self.points.iter().filter(|p| p.branch == branch).collect();
        points.sort_by_key(|p| p.index);
        points
    }

    /// All points, in the order of the walk.
    pub fn all(&self) -> Vec<&PointRecord> {
        let mut points: Vec<&PointRecord> = self.points.iter().collect();
        points.sort_by_key(|p| (p.index, p.branch));
        points
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    fn end(&self, branch: usize) -> Option<&BranchEnd> {
        self.ends.iter().find(|e| e.branch == branch)
    }
}

/// The file of a family.
pub enum Opened {
    /// There is something to do: the writer, and what is there already.
    Writing(Box<FamilyWriter>, Known),
    /// Everything that is asked for is in the file, which stays untouched.
    Whole(Box<StoredFamily>),
}

/// Open the file of a family: a new one, or one to go on with (`resume`). What is there must be of the same scene and kind, and its
/// range must lie within the one that is asked for.
pub fn open(asked: &Asked, resume: bool) -> Result<Opened, CliError> {
    let Asked { path, scene, system, plan, options, .. } = asked;
    if !resume && StoredFamily::is_unfinished(path) && !options.outputs.is_forced() {
        return Err(CliError::Input(format!(
            "{} was begun by an earlier run that did not end: go on with --resume, or start anew with --force",
            path.display()
        )));
    }
    if !resume || !StoredFamily::is_begun(path) {
        let writer = FamilyWriter::create(path, scene, system, options, plan)?;
        return Ok(Opened::Writing(Box::new(writer), Known::default()));
    }
    // an input, or a file of someone else, is no family to go on with
    options.outputs.with_force(true).check(path)?;
    let (mut stored, warning) = StoredFamily::recover(path)?;
    if let Some(text) = warning {
        eprintln!("signorini: WARNING: {text}");
    }
    let plan = continued(asked, &stored)?;
    if let Some(what) = stored.misfit(system, asked.unknowns) {
        return Err(CliError::Input(format!("{}: {what}", path.display())));
    }
    let whole = stored.status == "complete" && stored.range == plan.range;
    let count = stored.points.len();
    let ends = std::mem::take(&mut stored.ends);
    let (points, ends) = standing(asked, &plan, std::mem::take(&mut stored.points), ends);
    let known = Known { points, ends };
    if whole && known.len() == count && nothing_left(asked, &plan, &known) {
        return Ok(Opened::Whole(Box::new(StoredFamily::read(path)?)));
    }
    let writer = FamilyWriter::resume(path, scene, system, options, &plan, &known.points)?;
    Ok(Opened::Writing(Box::new(writer), known))
}

/// The plan of a family that is gone on with, or why it cannot be.
fn continued(asked: &Asked, stored: &StoredFamily) -> Result<FamilyPlan, CliError> {
    let plan = &asked.plan;
    let refuse = |why: String| {
        Err(CliError::Input(format!(
            "{} cannot be gone on with: {why}; give the same command again, or another -o",
            asked.path.display()
        )))
    };
    if stored.scene != asked.scene.source.text {
        return refuse("it was made from another scene".into());
    }
    let Some(identity) = &stored.identity else {
        return refuse("it is of an earlier version of signorini".into());
    };
    if let Some(difference) = identity.difference(&plan.identity) {
        return refuse(format!("it was made with other options: {difference}"));
    }
    if stored.branches != plan.branches {
        let names =
            |all: &[Branch]| all.iter().map(Branch::to_string).collect::<Vec<_>>().join("; ");
        let (a, b) = (names(&stored.branches), names(&plan.branches));
        return refuse(format!("it was made with other options: its branches are {a}; not {b}"));
    }
    let ([low, high], [from, to]) = (plan.range, stored.range);
    let rounding = 1e-9 * high;
    if from < low - rounding || to > high + rounding {
        return refuse(format!("it covers {from} to {to}, and {low} to {high} is less"));
    }
    // the grid counts from where it began
    Ok(FamilyPlan { identity: identity.clone(), ..plan.clone() })
}

/// Of an earlier run's points those that stand: whole steps without a hole.
fn standing(
    asked: &Asked,
    plan: &FamilyPlan,
    mut points: Vec<PointRecord>,
    ends: Vec<BranchEnd>,
) -> (Vec<PointRecord>, Vec<BranchEnd>) {
    let branches = 0..plan.branches.len();
    match plan.identity.walk {
        // all harmonics of a frequency belong together: the ladder begins anew at each
        Walk::Grid(_) | Walk::Response(_) => {
            let at_once = matches!(plan.identity.walk, Walk::Grid(_));
            let mut kept: Vec<BTreeSet<i64>> = branches
                .clone()
                .map(|b| points.iter().filter(|p| p.branch == b).map(|p| p.index).collect())
                .collect();
            if at_once {
                let mut all = kept.iter().skip(1).fold(kept[0].clone(), |a, b| &a & b);
                all = without_holes(&all);
                kept.iter_mut().for_each(|k| k.clone_from(&all));
            } else {
                kept.iter_mut().for_each(|k| *k = without_holes(k));
            }
            points.retain(|p| kept.get(p.branch).is_some_and(|k| k.contains(&p.index)));
            (points, ends)
        }
        Walk::Branch { .. } | Walk::Upwards { .. } => {
            let mut stay = vec![];
            for branch in branches {
                let mut own: Vec<PointRecord> =
                    points.iter().filter(|p| p.branch == branch).cloned().collect();
                own.sort_by_key(|p| p.index);
                let end = ends.iter().find(|e| e.branch == branch).filter(|e| match e.reason {
                    EndReason::Range => own.last().is_some_and(|p| {
                        plan.range.iter().any(|bound| (p.omega - bound).abs() <= 1e-9 * bound)
                    }),
                    EndReason::Points => count_of(&own) >= asked.points,
                    EndReason::Stuck => true,
                    EndReason::Interrupted => false,
                });
                if end.is_none() {
                    // special points of a step that was not finished come again, and so does the end of a narrower range
                    let last = own.iter().rposition(|p| p.place.is_some());
                    own.truncate(last.map_or(0, |k| k + 1));
                }
                stay.push((own, end.cloned()));
            }
            let ends = stay.iter().filter_map(|(_, end)| end.clone()).collect();
            (stay.into_iter().flat_map(|(own, _)| own).collect(), ends)
        }
        Walk::Given => (points, ends),
    }
}

/// The longest run of successive numbers that holds the first one (they are counted from 0).
fn without_holes(all: &BTreeSet<i64>) -> BTreeSet<i64> {
    let Some(first) = all.iter().min_by_key(|k| k.abs()).copied() else { return BTreeSet::new() };
    let up = (first..).take_while(|k| all.contains(k));
    let down = (1..).map(|d| first - d).take_while(|k| all.contains(k));
    up.chain(down).collect()
}

/// Points of a branch as `--points` counts them: the start is none.
fn count_of(points: &[PointRecord]) -> usize {
    points.iter().filter(|p| p.special != PointKind::Start).count()
}

fn nothing_left(asked: &Asked, plan: &FamilyPlan, known: &Known) -> bool {
    let range = (plan.range[0], plan.range[1]);
    (0..plan.branches.len()).all(|branch| match plan.identity.walk {
        Walk::Grid(grid) => Legs::new(grid, range, false, &known.branch(branch)).is_empty(),
        Walk::Response(grid) => {
            let downwards = plan.branches[branch].direction() == Some(Direction::Down);
            Legs::new(grid, range, downwards, &known.branch(branch)).is_empty()
        }
        Walk::Branch { .. } | Walk::Upwards { .. } => known.end(branch).is_some(),
        Walk::Given => known.len() == asked.points,
    })
}

/// What is left to do on a grid: onwards from the last point that is known, and back from the first (a range that was widened).
#[derive(Debug, Clone, PartialEq)]
pub struct Legs {
    grid: Grid,
    sign: i64,
    /// Places on the branch, in the order of the walk.
    pub onwards: Vec<i64>,
    /// Places before the first one that is known, nearest first.
    pub back: Vec<i64>,
}

impl Legs {
    /// The legs of a branch that is walked upwards, or downwards (its places are then the falling numbers of the grid).
    pub fn new(grid: Grid, range: (f64, f64), downwards: bool, known: &[&PointRecord]) -> Legs {
        let sign = if downwards { -1 } else { 1 };
        let mut wanted: Vec<i64> = grid.within(range).map(|k| sign * k).collect();
        wanted.sort_unstable();
        let (first, last) = (known.first().map(|p| p.index), known.last().map(|p| p.index));
        let onwards = wanted.iter().copied().filter(|k| last.is_none_or(|l| *k > l)).collect();
        let back = wanted.iter().rev().copied().filter(|k| first.is_some_and(|f| *k < f)).collect();
        Legs { grid, sign, onwards, back }
    }

    fn is_empty(&self) -> bool {
        self.onwards.is_empty() && self.back.is_empty()
    }

    /// Frequencies of places.
    pub fn frequencies(&self, places: &[i64]) -> Vec<f64> {
        places.iter().map(|k| self.grid.at(self.sign * k)).collect()
    }

    /// Both legs that are not empty, each with what is known before it, in the order of that walk.
    pub fn each<'p>(&self, known: &[&'p PointRecord]) -> Vec<(&[i64], Vec<&'p PointRecord>)> {
        let forth = known.to_vec();
        let back = known.iter().rev().copied().collect();
        [(&self.onwards[..], forth), (&self.back[..], back)]
            .into_iter()
            .filter(|(places, _)| !places.is_empty())
            .collect()
    }
}

/// Compute branches side by side; every point is written as soon as it is there. At the end the file has its status.
pub fn run_jobs(
    jobs: &[Job],
    writer: FamilyWriter,
    system: &System,
    (low, high): (f64, f64),
    bar: Option<&Bar>,
) -> Result<Vec<BranchEnd>, CliError> {
    let mut writer = writer;
    let (sender, receiver) = mpsc::sync_channel::<PointRecord>(64);
    let (ends, failure) = std::thread::scope(|scope| {
        let workers = scope.spawn(move || {
            let run = |(branch, job): (usize, &Job)| {
                let sender = sender.clone();
                let mut take = |mut point: PointRecord| {
                    // a single job may hold several branches of its own
                    if jobs.len() > 1 {
                        point.branch = branch;
                    }
                    match sender.send(point) {
                        Ok(()) if interrupt::signal().is_none() => Go::Continue(()),
                        _ => Go::Break(()),
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
            if let Err(e) = writer.push(&point, system) {
                failure = Some(e);
                break;
            }
            count += 1;
            if let Some(bar) = bar {
                let share = ((point.omega - low) / (high - low)).clamp(0.0, 1.0);
                let of = point.branch.min(progress.len() - 1);
                progress[of] = progress[of].max(share);
                let mean = progress.iter().sum::<f64>() / progress.len() as f64;
                bar.set(mean, format!("{count} points, omega = {:.4}", point.omega));
            }
        }
        drop(receiver);
        let ends = workers.join().unwrap_or_else(|_| vec![]);
        (ends, failure)
    });
    let path = writer.path().to_owned();
    if let Some(e) = failure {
        // what was written before stays; the journal holds it too
        let text = format!("{e}\n  {} points are kept: go on with --resume", writer.count());
        return Err(match CliError::from(e) {
            CliError::Input(_) => CliError::Input(text),
            _ => CliError::Other(text),
        });
    }
    let ends: Result<Vec<BranchEnd>, CliError> = if ends.len() == jobs.len() {
        ends.into_iter().collect()
    } else {
        Err(CliError::Other("a branch ended abnormally; what it found is in the file".into()))
    };
    match (ends, interrupt::signal()) {
        (Ok(ends), Some(signal)) => {
            let count = writer.count();
            writer.finish("interrupted", &ends, system)?;
            let text = format!(
                "interrupted; {count} points are in {}: go on with the same command and --resume",
                path.display()
            );
            Err(CliError::Interrupted(signal, text))
        }
        (Ok(ends), None) => {
            writer.finish("complete", &ends, system)?;
            Ok(ends)
        }
        (Err(e), _) => {
            // the reason of the failure matters more than a failure to record it
            let _ = writer.finish(&format!("failed: {}", e.text()), &[], system);
            Err(e)
        }
    }
}

/// Follow one branch by arclength: from where an earlier run stood, or from what `start` finds (or why it finds nothing). With
/// `points_suffice` a branch is complete when it has as many points as were asked for.
pub fn follow_branch(
    body: &mut Propagator,
    closure: Closure,
    options: Options,
    (index, known, points_suffice): (usize, &Known, bool),
    start: impl FnOnce(&mut Propagator) -> Result<Result<Start, String>, CliError>,
    take: &mut dyn FnMut(PointRecord) -> Go,
) -> Result<BranchEnd, CliError> {
    go_on(index, known, options, points_suffice, take, |place, options, take| {
        let from = match place {
            Some(place) => Start::Place(branch::place_of(place)),
            None => match start(body)? {
                Ok(start) => start,
                Err(why) => return Ok(Err(why)),
            },
        };
        let stop = branch::arclength(body, closure, from, options, take)
            .map_err(|e| CliError::Numerics(e.to_string()))?;
        Ok(stop.ok_or_else(|| "the first tangent could not be computed".into()))
    })
}

/// Why a branch was not followed at all, in words, or how following it ended.
pub type Followed = Result<Result<Stop, String>, CliError>;

/// Go on along a branch: `follow` starts from the last place that is known (or from nothing) and hands its points on.
pub fn go_on(
    index: usize,
    known: &Known,
    mut options: Options,
    points_suffice: bool,
    take: &mut dyn FnMut(PointRecord) -> Go,
    follow: impl FnOnce(Option<&PlaceRecord>, &Options, &mut dyn FnMut(PointRecord) -> Go) -> Followed,
) -> Result<BranchEnd, CliError> {
    if let Some(end) = known.end(index) {
        return Ok(end.clone());
    }
    let earlier = known.branch(index);
    let regular = earlier.iter().filter(|p| p.special != PointKind::Start).count();
    options.points = options.points.saturating_sub(regular);
    if options.points == 0 {
        let text = "number of points reached (earlier run)";
        return Ok(ended(index, EndReason::Points, text, points_suffice));
    }
    let mut next = earlier.last().map_or(0, |p| p.index + 1);
    let mut numbered = |mut point: PointRecord| {
        point.index = next;
        next += 1;
        take(point)
    };
    let place = earlier.iter().rev().find_map(|p| p.place.as_ref());
    Ok(match follow(place, &options, &mut numbered)? {
        Err(why) => ended(index, EndReason::Stuck, why, false),
        Ok(stop) => {
            let reason = match stop {
                Stop::Range => EndReason::Range,
                Stop::Points => EndReason::Points,
                Stop::Interrupted => EndReason::Interrupted,
                Stop::Step { .. } | Stop::DeadEnd { .. } => EndReason::Stuck,
            };
            let complete = stop == Stop::Range || (points_suffice && stop == Stop::Points);
            ended(index, reason, stop.to_string(), complete)
        }
    })
}
