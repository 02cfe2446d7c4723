//! `signorini response`

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use signorini::continuation::Options;
use signorini::families::doubling::{self, Doubling};
use signorini::families::follow::{self, BranchTask, Take};
use signorini::families::sequence::{self, Stretch};
use signorini::families::sweep::{self, Sweep};
use signorini::families::through::{self, Seed};
use signorini::families::{Asked, FamilyError, Known, start};
use signorini::orbit::along::Start;
use signorini::orbit::settle::ladder;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::{
    Branch, BranchEnd, Direction, EndReason, FamilyKind, Grid, PointRecord, Walk, fingerprint,
};
use signorini::scenario::Scene;
use signorini::store::{FamilyPlan, StoredFamily};

use super::balance::{self, Choice};
use super::doublings;
use super::family::{self, Carried, Job, Output};
use super::ratios::with_ratios;
use super::task::{Files, Task, Work};
use super::{Answer, CliError, load, plain};

/// Arguments of `response`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini response scenarios/half-plate-response.toml -o response.h5\n  signorini response scenarios/half-plate-response.toml --ratios 0.01,0.05 --range 1.4,1.9 -o two.h5\n  signorini response scenarios/half-plate-response.toml --doublings two.h5 -o doubled.h5\n  signorini response scenarios/valve.toml --sweep both -o sweep.h5\n  signorini response scenarios/valve.toml --through sweep.h5 -o branches.h5\n  signorini plot response.h5\n  signorini plot sweep.h5 branches.h5 --axis amplitude"
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
    /// Largest step of arclength (relative change of the state); the steps in frequency of harmonic balance, and of bodies with friction, follow it in proportion (at
    /// 0.05: a four-hundredth of the highest frequency, rounded)
    #[arg(long, default_value_t = 0.05, allow_negative_numbers = true)]
    step: f64,
    /// Most points a branch
    #[arg(long, default_value_t = 2000, value_parser = family::at_least_one)]
    points: usize,
    /// Locate changes of stability within a step
    #[arg(long)]
    locate: bool,
    /// Follow the orbits of twice the period from the period doublings of a response of this scene, a file of this command (--locate there tells
    /// where they begin)
    #[arg(long, value_name = "RESPONSE.h5", conflicts_with = "ratios")]
    doublings: Option<PathBuf>,
    /// Follow the branches through the orbits that sweeps of this scene met, a file of --sweep: orbits of several periods, isolas, and the unstable orbits
    /// between
    #[arg(long, value_name = "SWEEP.h5", conflicts_with_all = ["ratios", "doublings", "sweep"])]
    through: Option<PathBuf>,
    /// What the body does while the frequency goes up, down, or up and then down again: it settles at each frequency from where it was, whatever it
    /// settles to (orbits of several periods, quasi-periodic motions, chaos); changes are closed in on
    #[arg(long, value_enum, value_name = "WAY", conflicts_with_all = ["doublings", "locate"])]
    sweep: Option<Way>,
    /// Sweeps: so many periods of the loads at each frequency, without waiting until the body has settled
    #[arg(long, requires = "sweep", value_name = "N", value_parser = family::at_least_one)]
    dwell: Option<usize>,
    /// Reduced bodies: leave out the error statement (orbits of the first branch with twice as many modes)
    #[arg(long)]
    quick: bool,
    /// Go on with an unfinished file, or to a higher end of the range of a finished one; everything else must be as it was
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    balance: balance::Arguments,
    #[command(flatten)]
    output: Output,
}

/// Which way a sweep goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Way {
    /// To higher frequencies
    Up,
    /// To lower frequencies
    Down,
    /// Both, each from rest
    Both,
}

impl Way {
    fn directions(self) -> &'static [Direction] {
        match self {
            Way::Up => &[Direction::Up],
            Way::Down => &[Direction::Down],
            Way::Both => &[Direction::Up, Direction::Down],
        }
    }
}

impl Arguments {
    /// What is asked for of a scene, if it makes sense.
    fn request(&self, scene: &Scene) -> Result<Request, CliError> {
        if !(self.step >= 1e-4 && self.step <= 1.0) {
            return Err(CliError::Input(format!(
                "--step {}: give a number from 1e-4 to 1",
                plain(self.step)
            )));
        }
        let range = family::range(scene, self.range.as_deref())?;
        let simple = self.doublings.as_deref().or(self.through.as_deref());
        let simple = simple.map(StoredFamily::read).transpose()?;
        let mut scenes = match &simple {
            None => with_ratios(scene, "--ratios", self.ratios.as_deref())?,
            Some(simple) => doublings::scenes(simple, scene)?,
        };
        if self.through.is_some() {
            // both directions of a sweep are of one body
            scenes.dedup_by(|a, b| a.0 == b.0);
        }
        let (points, step, locate) = (self.points, self.step, self.locate);
        let choice = self.balance.choice(scene)?;
        if choice.is_bem() {
            let text = "--method bem: backbones of a bar without loads; give --method hbm";
            return Err(CliError::Input(text.into()));
        }
        if choice.is_balance() && self.balance.aft.is_some() {
            return Err(CliError::Input(
                "--aft does not go with a response by harmonic balance".into(),
            ));
        }
        if choice.is_balance() && self.sweep.is_some() {
            return Err(CliError::Input(
                "--sweep goes with motions in time: leave --method out".into(),
            ));
        }
        let walk = match choice.is_balance() {
            _ if self.sweep.is_some() => Walk::Sweep { grid: self.grid(range), dwell: self.dwell },
            true => Walk::Response(self.grid(range)),
            // friction holds families of orbits at each frequency: there is no one branch to follow
            false if scene.rubs() => Walk::Response(self.grid(range)),
            false => Walk::Upwards { start: range.0, step, locate },
        };
        let options =
            Options { range, step: (0.2 * step, 1e-9, step), points, locate, natural: false };
        if choice.is_balance() && simple.is_some() {
            return Err(CliError::Input("--doublings and --through go with shooting only".into()));
        }
        let is_stepped = !choice.is_balance() && matches!(walk, Walk::Response(_));
        if is_stepped && (simple.is_some() || locate) {
            let text = "--doublings, --through and --locate follow a branch by arclength: with friction the response goes from frequency to frequency, --step gives their distance";
            return Err(CliError::Input(text.into()));
        }
        let sweeps = self.sweep.map_or(&[][..], Way::directions);
        Ok(Request {
            scenes,
            simple,
            doublings: None,
            seeds: vec![],
            sweeps,
            choice,
            walk,
            options,
        })
    }

    /// Frequencies of harmonic balance, and of bodies with friction: a tenth of the step, over the scale of the frequency.
    fn grid(&self, range: (f64, f64)) -> Grid {
        // 0.005 at frequencies of the order of one
        let step = family::round_number(range.1 / 400.0) * (self.step / 0.05);
        Grid { origin: range.0, step }
    }
}

/// What is asked for, checked.
pub(crate) struct Request {
    /// The scene with each damping ratio in percent.
    scenes: Vec<(Option<f64>, Scene)>,
    /// The response whose period doublings are asked for.
    simple: Option<StoredFamily>,
    /// Where orbits of twice the period begin, each with the number of its scene; none: the responses themselves.
    doublings: Option<Vec<(usize, Doubling)>>,
    /// Orbits of sweeps through which branches are asked for.
    seeds: Vec<Seed>,
    /// Directions of sweeps, if such are asked for.
    sweeps: &'static [Direction],
    choice: Choice,
    walk: Walk,
    options: Options,
}

/// What is computed by itself: of the scene with a number.
struct Piece {
    scene: usize,
    what: What,
}

/// A branch, or two.
enum What {
    /// The response, to higher frequencies.
    Orbits,
    /// Orbits of twice the period.
    Doubled(Doubling),
    /// What the body settles to.
    Sweep(Direction),
    /// Series with a number of harmonics, first to higher and then to lower frequencies.
    Series(usize),
}

impl Request {
    /// Refuse what the body of the scene cannot do.
    fn check(&self, scene: &Scene, problem: &Problem) -> Result<(), CliError> {
        let (low, high) = self.options.range;
        [low, high].into_iter().try_for_each(|w| family::check_frequency(problem, w))?;
        family::check_forced(scene, problem, family::OF_RESPONSE)?;
        if matches!(self.walk, Walk::Sweep { dwell: None, .. }) {
            family::check_settles(scene, &problem.system, "")?;
        }
        if self.choice.is_balance() {
            start::check_sought(scene, &problem.system, start::Sought::Series)?;
        }
        Ok(())
    }

    /// What there is to compute, in the order of the branches.
    fn pieces(&self) -> Vec<Piece> {
        if let Some(doublings) = &self.doublings {
            let piece = |(scene, d): &(usize, Doubling)| Piece {
                scene: *scene,
                what: What::Doubled(d.clone()),
            };
            return doublings.iter().map(piece).collect();
        }
        let each = |scene: usize| -> Vec<Piece> {
            let piece = |what| Piece { scene, what };
            match (self.sweeps, self.choice.is_balance()) {
                ([], false) => vec![piece(What::Orbits)],
                ([], true) => {
                    self.choice.harmonics.iter().map(|n_h| piece(What::Series(*n_h))).collect()
                }
                (sweeps, _) => sweeps.iter().map(|d| piece(What::Sweep(*d))).collect(),
            }
        };
        (0..self.scenes.len()).flat_map(each).collect()
    }

    /// The branches of a piece.
    fn branches(&self, piece: &Piece) -> Vec<Branch> {
        let percent = self.scenes[piece.scene].0;
        match &piece.what {
            What::Orbits => vec![Branch::Response { percent, series: None }],
            What::Doubled(d) => vec![Branch::Doubled { percent, omega: short(d.omega) }],
            What::Sweep(direction) => vec![Branch::Sweep { percent, direction: *direction }],
            What::Series(n_h) => Direction::BOTH
                .map(|d| Branch::Response { percent, series: Some((*n_h, d)) })
                .into(),
        }
    }

    fn plan(&self, problem: &Problem) -> FamilyPlan {
        let scene = &self.scenes[0].1;
        let (low, high) = self.options.range;
        FamilyPlan {
            identity: FamilyKind {
                method: self.choice.method(),
                walk: self.walk,
                problem: fingerprint(scene, problem),
            },
            range: [low, high],
            branches: match self.seeds.is_empty() {
                true => self.pieces().iter().flat_map(|p| self.branches(p)).collect(),
                false => through::branches(&self.seeds),
            },
            harmonics: self.choice.most_harmonics(),
        }
    }

    /// Compute what is missing of the branches through orbits of sweeps.
    fn follow_seeds(&self, known: &Known, take: Take) -> Result<Vec<BranchEnd>, CliError> {
        let mut ends = vec![];
        for (percent, scene) in &self.scenes {
            let of_scene = |s: &&Seed| s.percent == *percent;
            let seeds: Vec<Seed> = self.seeds.iter().filter(of_scene).cloned().collect();
            let before = self.seeds.iter().take_while(|s| !of_scene(s)).count();
            let mut body = family::propagator(load::of_scene(scene)?.system)?;
            let what = (2 * before, known, &self.options);
            ends.extend(through::follow(&mut body, &seeds, what, take)?);
        }
        Ok(ends)
    }

    /// Compute what is missing of a piece, the first of whose branches has the number `index`, on `grid` where it goes by one.
    fn compute(
        &self,
        (index, piece): (usize, &Piece),
        grid: Option<Grid>,
        known: &Known,
        take: Take,
    ) -> Result<Vec<BranchEnd>, CliError> {
        let scene = &self.scenes[piece.scene].1;
        let range = self.options.range;
        let task = BranchTask { index, known, options: &self.options, points_suffice: false };
        let shooting = || -> Result<_, CliError> {
            let problem = load::of_scene(scene)?;
            let body = family::propagator(problem.system)?;
            let given = start::given(scene, &problem.initial, &body);
            Ok((body, given))
        };
        Ok(vec![match (&piece.what, self.walk, grid) {
            (What::Doubled(doubling), ..) => {
                let (mut body, _) = shooting()?;
                let start = |body: &mut Propagator| doubling::start(body, doubling);
                follow::orbits(&mut body, Closure::Forced(2), task, start, take)?
            }
            (What::Sweep(direction), Walk::Sweep { dwell, .. }, Some(grid)) => {
                let (mut body, given) = shooting()?;
                let plan = Sweep { grid, range, direction: *direction, dwell };
                let rest = vec![0.0; 2 * body.n()];
                let first = given.first().unwrap_or(&rest);
                let end = sweep::sweep(&mut body, &plan, first, &known.branch(index), take)?;
                BranchEnd { branch: index, ..end }
            }
            (What::Orbits, _, Some(grid)) => {
                let (mut body, given) = shooting()?;
                let stretch = Stretch { grid, range, downwards: false };
                let known = known.branch(index);
                let end = sequence::response(&mut body, &given, stretch, &known, take)?;
                BranchEnd { branch: index, ..end }
            }
            (What::Series(n_h), _, Some(grid)) => {
                return self.series((index, *n_h), scene, grid, known, take);
            }
            _ => {
                let (mut body, given) = shooting()?;
                let start = |body: &mut Propagator| first_orbit(body, &given, range.0);
                follow::response(&mut body, task, start, take)?
            }
        }])
    }

    /// Series with `n_h` harmonics to higher frequencies, and then to lower ones: where the second walk loses its branch, it knows the first.
    fn series(
        &self,
        (index, n_h): (usize, usize),
        scene: &Scene,
        grid: Grid,
        known: &Known,
        take: Take,
    ) -> Result<Vec<BranchEnd>, CliError> {
        let mut body = self.choice.body(scene)?;
        let what = (&[n_h][..], &self.choice.settings);
        let (mut ends, mut aside) = (vec![], vec![]);
        for (k, direction) in Direction::BOTH.into_iter().enumerate() {
            let range = self.options.range;
            let stretch = Stretch { grid, range, downwards: direction == Direction::Down };
            // the one branch of this walk
            let of_walk = |p: &PointRecord| PointRecord { branch: 0, ..p.clone() };
            let earlier: Vec<PointRecord> =
                known.branch(index + k).into_iter().map(of_walk).collect();
            let mut found = earlier.clone();
            let earlier: Vec<&PointRecord> = earlier.iter().collect();
            let mut watched = |point: PointRecord| {
                found.push(point.clone());
                take(PointRecord { branch: k, ..point })
            };
            let end = sequence::series(&mut body, what, stretch, (&earlier, &aside), &mut watched)?;
            ends.push(BranchEnd { branch: index + k, ..end });
            if ends[k].reason == EndReason::Interrupted {
                break;
            }
            aside = found;
        }
        Ok(ends)
    }
}

/// A frequency as it stands in a name: nine digits.
fn short(omega: f64) -> f64 {
    format!("{omega:.8e}").parse().unwrap_or(omega)
}

/// The first orbit: from the scene's own state if it has one, the linear response, or what the body settles to.
pub(super) fn first_orbit(
    body: &mut Propagator,
    given: &[Vec<f64>],
    omega: f64,
) -> Result<Result<Start, String>, FamilyError> {
    Ok(match ladder(body, given, omega)? {
        Ok(orbit) => Ok(Start::Orbit(orbit, 1.0)),
        Err(why) => Err(format!("no orbit at omega = {omega}: {why}")),
    })
}

impl Task for Arguments {
    type Plan = (Request, Problem);
    type Found = Carried;

    fn files(&self) -> Files<'_> {
        let Output { force, .. } = self.output;
        Files { scene: &self.scene, read: vec![], force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "response"))
    }

    fn plan(&self, work: &mut Work) -> Result<Self::Plan, CliError> {
        let mut problem = load::warned(&work.scene, work.global)?;
        let by_series = self.balance.method == balance::Method::Hbm;
        if !by_series {
            problem = family::reduce_if_large(work.global, &mut work.scene, problem)?;
        }
        let mut request = self.request(&work.scene)?;
        if request.scenes[0].0.is_some() {
            problem = load::of_scene(&request.scenes[0].1)?;
        }
        request.check(&work.scene, &problem)?;
        if self.through.is_some() {
            let sweep = request.simple.take();
            request.seeds = match sweep {
                Some(sweep) => doublings::of_sweep(&sweep, &request.scenes[0].1, &problem)?,
                None => vec![],
            };
        }
        request.doublings = match request.simple.take() {
            Some(simple) => Some(doublings::of_response(&simple, &request.scenes[0].1, &problem)?),
            None => None,
        };
        Ok((request, problem))
    }

    fn carry_out(&self, work: &Work, plan: &mut Self::Plan) -> Result<Carried, CliError> {
        let (request, problem) = &*plan;
        let shooting = !request.choice.is_balance();
        let asked = Asked {
            path: &work.path,
            scene: &work.scene,
            system: &problem.system,
            plan: request.plan(problem),
            points: self.points,
            unknowns: shooting.then(|| Closure::FORCED.sizes(problem.system.n_o())),
            options: work.options.clone(),
        };
        let mut carried =
            family::carry_out(work.global, &asked, work.resume, |writer, known, bar| {
                // a grid that was widened counts from where it began
                let grid = writer.plan().identity.walk.grid();
                let pieces = request.pieces();
                let mut first = 0;
                let job = |piece| {
                    let (index, count) = (first, request.branches(piece).len());
                    first += count;
                    Job::new(count, move |take| request.compute((index, piece), grid, known, take))
                };
                let jobs: Vec<Job> = match request.seeds.is_empty() {
                    true => pieces.iter().map(job).collect(),
                    // a branch ends where it meets an earlier one: one after the other
                    false => vec![Job::new(2 * request.seeds.len(), |take| {
                        request.follow_seeds(known, take)
                    })],
                };
                let range = request.options.range;
                family::run_jobs(work.global, &jobs, writer, &problem.system, range, bar)
            })?;
        let is_plain =
            request.sweeps.is_empty() && request.seeds.is_empty() && request.doublings.is_none();
        if shooting && is_plain && work.scene.reduction.is_some() && !self.quick {
            let scene = &request.scenes[0].1;
            family::state(work, (scene, problem), (Closure::FORCED, Some(0)), &mut carried)?;
        }
        Ok(carried)
    }

    fn say(&self, work: &Work, _: &Self::Plan, carried: Carried) -> Result<Answer, CliError> {
        let answer = family::answer(work, &carried);
        Ok(match carried.ends.iter().find(|e| !e.complete) {
            None => answer,
            Some(e) => answer.failed(format!(
                "{}: {}; everything up to there is in {}",
                carried.stored.branches[e.branch],
                e.text,
                work.path.display()
            )),
        })
    }
}
