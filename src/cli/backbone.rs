//! `signorini backbone`

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use signorini::contact::phase_modes;
use signorini::contact::{State, States};
use signorini::continuation::Options;
use signorini::families::bar;
use signorini::families::conservative;
use signorini::families::follow::{self, BranchTask, Take};
use signorini::families::sequence::{self, Stretch};
use signorini::families::viscous::Viscosity;
use signorini::families::{self, Asked, Known, start};
use signorini::hbm::amplitudes::Amplitudes;
use signorini::hbm::damped::DampedMode;
use signorini::orbit::along::Start;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::{
    Branch, BranchEnd, Direction, FamilyKind, Grid, PointMethod, PointRecord, Walk, fingerprint,
};
use signorini::report::summary::significant;
use signorini::scenario::{Issue, Scene};
use signorini::store::FamilyPlan;

use super::balance::{self, Choice};
use super::damped;
use super::family::{self, Carried, Job, Output};
use super::task::{Files, Task, Work};
use super::{Answer, CliError, Global, load, plain, viscous};

/// Arguments of `backbone`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini backbone scenarios/half-plate-orbit.toml -o backbone.h5\n  signorini backbone scenarios/half-plate-orbit.toml --follow arclength --omega 1.8 --points 200 -o branch.h5\n  signorini backbone scenarios/half-plate-orbit.toml --viscous --step 0.02 -o viscous.h5\n  signorini backbone scenarios/brake-reuss.toml --method hbm --amplitudes 1e-7,2e-4 -o damped.h5\n  signorini backbone scenarios/half-plate-orbit.toml -o backbone.h5 --resume\n  signorini plot backbone.h5"
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
    /// relative [default: 0.005]; amplitudes: decades between two [default: 0.1]
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
    viscous: viscous::Arguments,
    /// Viscous: leave out the error statement (the same orbits with another viscosity, mesh, contact discretisation, number of modes)
    #[arg(long, requires = "viscous")]
    quick: bool,
    /// Look for a conservative orbit near each orbit of a viscous family, once; most have none
    #[arg(long, value_name = "VISCOUS.h5", conflicts_with_all = ["viscous", "follow", "range", "step", "omega"])]
    conservative_from: Option<PathBuf>,
    /// Bodies with friction: the damped nonlinear mode at amplitudes (largest displacements of the mode), with --method hbm
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", conflicts_with_all = ["viscous", "follow", "range", "omega", "locate", "conservative_from"])]
    amplitudes: Option<Vec<f64>>,
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

    /// Decades from amplitude to amplitude.
    fn decades(&self) -> Result<f64, CliError> {
        let step = self.step.unwrap_or(0.1);
        match (1e-4..=1.0).contains(&step) {
            true => Ok(step),
            false => Err(CliError::Input(format!(
                "--step {}: give 0.0001 to 1, the decades from one amplitude to the next",
                plain(step)
            ))),
        }
    }

    /// How points follow one another.
    fn walk(&self, scene: &Scene, range: (f64, f64)) -> Result<Walk, CliError> {
        if self.conservative_from.is_some() {
            return Ok(Walk::Given);
        }
        if self.amplitudes.is_some() {
            let (low, high) = range;
            return Ok(Walk::Amplitudes { low, high, step: self.decades()? });
        }
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

    /// What is asked for of a scene, if it makes sense.
    fn request(&self, scene: &Scene, problem: Problem) -> Result<Request, CliError> {
        let near = match &self.conservative_from {
            Some(path) => viscous::orbits_of(path, &problem)?,
            None => vec![],
        };
        let range = match &near[..] {
            [] if self.amplitudes.is_some() => self.amplitudes()?,
            [] => family::range(scene, self.range.as_deref())?,
            points => {
                let omega = || points.iter().map(|p| p.omega);
                (omega().fold(f64::INFINITY, f64::min), omega().fold(0.0, f64::max))
            }
        };
        let choice = self.balance.choice(scene)?;
        let damped = match self.amplitudes.is_some() {
            true => Some(damped::mode(scene, &problem, &choice)?),
            false => None,
        };
        if choice.is_balance() && !near.is_empty() {
            let message = "--conservative-from is by shooting: leave --method hbm out";
            return Err(CliError::Input(message.into()));
        }
        if choice.is_balance() && self.viscous.viscous {
            self.balance.check_viscous().map_err(CliError::Input)?;
        }
        let on_grid = self.follow == Follow::Sequential && !self.viscous.viscous;
        choice.bar(scene, &problem.system, on_grid && near.is_empty())?;
        let viscosity = self.viscosity(scene, &problem)?;
        let walk = self.walk(scene, range)?;
        let points = match (walk, near.len()) {
            (Walk::Amplitudes { .. }, _) => choice.harmonics.len() * walk.amplitudes().len(),
            (_, 0) => self.points,
            (_, near) => near,
        };
        let scene = scene.clone();
        Ok(Request { scene, problem, range, choice, walk, points, viscosity, near, damped })
    }

    /// The amplitudes asked for.
    fn amplitudes(&self) -> Result<(f64, f64), CliError> {
        match self.amplitudes.as_deref() {
            Some(&[a, b]) if a > 0.0 && b > a && b.is_finite() => Ok((a, b)),
            _ => Err(CliError::Input(
                "--amplitudes: give two displacements, the lower one first: --amplitudes 1e-3,1"
                    .into(),
            )),
        }
    }

    /// Whether orbits are shot by the modes of every phase, whatever the size of the body.
    fn needs_modes(&self, problem: &Problem) -> bool {
        let shoots = self.balance.method == balance::Method::Shooting;
        shoots && (self.viscous.viscous || !problem.system.is_conservative())
    }

    /// The viscosity, if a viscous family is asked for.
    fn viscosity(&self, scene: &Scene, problem: &Problem) -> Result<Option<Viscosity>, CliError> {
        if !self.viscous.viscous {
            return Ok(None);
        }
        let body = family::propagator(problem.system.clone())?;
        self.viscous.viscosity(scene, &body)
    }
}

/// What is asked for, checked.
pub(crate) struct Request {
    scene: Scene,
    problem: Problem,
    range: (f64, f64),
    choice: Choice,
    walk: Walk,
    /// Most points a branch.
    points: usize,
    /// Of the viscous nonlinear mode.
    viscosity: Option<Viscosity>,
    /// Viscous orbits that conservative ones are looked for near.
    near: Vec<PointRecord>,
    /// Number of the damped nonlinear mode, from 0.
    damped: Option<usize>,
}

/// What is computed by itself: one or several branches.
enum Piece {
    /// Orbits on a grid.
    OrbitsOnGrid(Stretch),
    /// Solutions of harmonic balance on a grid, a branch for each number of harmonics.
    SeriesOnGrid(Stretch),
    /// Orbits near those of a viscous family.
    OrbitsNear,
    /// Orbits along the family.
    OrbitsAlong(Direction),
    /// Solutions of harmonic balance along the family, with a number of harmonics.
    SeriesAlong(usize, Direction),
    /// A damped nonlinear mode from amplitude to amplitude, with a number of harmonics.
    Damped(usize),
}

impl Request {
    /// Refuse what the body of the scene cannot do; how its orbits close.
    fn closure(&self) -> Result<Closure, CliError> {
        if self.damped.is_some() {
            return Ok(Closure::FORCED);
        }
        let (low, high) = self.range;
        [low, high].into_iter().try_for_each(|w| family::check_frequency(&self.problem, w))?;
        let closure = self.kind()?;
        if self.walk == Walk::Given && closure != Closure::Reversible {
            let message =
                "conservative orbits are looked for at rest, without damping and harmonic loads";
            return Err(CliError::Input(message.into()));
        }
        if self.walk.grid().is_none() && closure == Closure::Autonomous {
            let help = "leave [initial] out, or give a state at rest: the orbit of `signorini orbit` starts at rest where it can";
            let message = "families by arclength start from a state at rest";
            return Err(self.scene.error(Issue::new("initial", message, help)).into());
        }
        Ok(closure)
    }

    /// How the orbits close.
    fn kind(&self) -> Result<Closure, CliError> {
        match &self.viscosity {
            Some(v) => Ok(viscous::closure(v)),
            None => Ok(start::closure(&self.scene, &self.problem)?),
        }
    }

    fn method(&self) -> PointMethod {
        if let Some(mode) = self.damped {
            return PointMethod::DampedMode { mode: mode + 1 };
        }
        let Some(Viscosity { pin, .. }) = &self.viscosity else { return self.choice.method() };
        let (beta, mode) = (pin.beta, pin.mode + 1);
        match self.choice.is_balance() {
            true => PointMethod::ViscousBalance { beta, mode, shot: self.choice.is_shot() },
            false => PointMethod::Viscous { beta, mode },
        }
    }

    fn plan(&self) -> FamilyPlan {
        FamilyPlan {
            identity: FamilyKind {
                method: self.method(),
                walk: self.walk,
                problem: fingerprint(&self.scene, &self.problem)
                    ^ match &self.near[..] {
                        [] => 0,
                        points => conservative::fingerprint(points),
                    },
            },
            range: [self.range.0, self.range.1],
            branches: self.branches(),
            harmonics: self.choice.most_harmonics(),
        }
    }

    fn branches(&self) -> Vec<Branch> {
        let along = |piece: Piece| match piece {
            Piece::OrbitsOnGrid(_) | Piece::OrbitsNear => vec![Branch::Sequential],
            Piece::SeriesOnGrid(_) => self.choice.sequential_branches(),
            Piece::OrbitsAlong(direction) => vec![Branch::Along(direction)],
            Piece::SeriesAlong(harmonics, direction) => {
                vec![Branch::Series { harmonics, direction: Some(direction) }]
            }
            Piece::Damped(harmonics) => vec![Branch::Series { harmonics, direction: None }],
        };
        self.pieces(self.walk).into_iter().flat_map(along).collect()
    }

    /// The pieces, in the order of their branches.
    fn pieces(&self, walk: Walk) -> Vec<Piece> {
        let balance = self.choice.is_balance();
        match walk.grid() {
            _ if walk == Walk::Given => vec![Piece::OrbitsNear],
            _ if self.damped.is_some() => {
                self.choice.harmonics.iter().map(|n_h| Piece::Damped(*n_h)).collect()
            }
            Some(grid) => {
                let stretch = Stretch { grid, range: self.range, downwards: false };
                vec![match balance {
                    true => Piece::SeriesOnGrid(stretch),
                    false => Piece::OrbitsOnGrid(stretch),
                }]
            }
            None if balance => {
                let both = |&n_h: &usize| Direction::BOTH.map(|d| Piece::SeriesAlong(n_h, d));
                self.choice.harmonics.iter().flat_map(both).collect()
            }
            None => Direction::BOTH.map(Piece::OrbitsAlong).into(),
        }
    }

    /// Compute what is missing of a piece, the first of whose branches has the number `index`.
    fn compute(
        &self,
        (index, piece): (usize, &Piece),
        known: &Known,
        take: Take,
    ) -> Result<BranchEnd, CliError> {
        let Choice { harmonics, settings, .. } = &self.choice;
        let (omega, options) = self.options();
        let task = BranchTask { index, known, options: &options, points_suffice: true };
        Ok(match piece {
            Piece::OrbitsOnGrid(stretch) => {
                let (mut body, closure, initial) = self.shooting()?;
                let known = known.branch(0);
                let guesses = |body: &Propagator, omega: f64| {
                    start::guesses(&self.scene, &initial, body, closure, omega)
                };
                sequence::orbits(&mut body, closure, &guesses, *stretch, &known, take)?
            }
            Piece::OrbitsNear => {
                let (mut body, ..) = self.shooting()?;
                conservative::orbits(&mut body, &self.near, &known.branch(0), take)?
            }
            Piece::SeriesOnGrid(stretch) => {
                let what = (&harmonics[..], settings);
                let system = &self.problem.system;
                if let Some(bar) = self.choice.bar(&self.scene, system, true)? {
                    let series = bar::series((&bar, system), what.0, *stretch, &known.all(), take);
                    return Ok(series?);
                }
                if let Some(Viscosity { pin, .. }) = &self.viscosity {
                    let mut body = self.choice.viscous_body(&self.problem, *pin)?;
                    return Ok(sequence::viscous_series(
                        &mut body,
                        what,
                        *stretch,
                        &known.all(),
                        take,
                    )?);
                }
                let mut body = self.choice.body(&self.scene)?;
                sequence::series(&mut body, what, *stretch, (&known.all(), &[]), take)?
            }
            Piece::OrbitsAlong(direction) => {
                let (mut body, closure, initial) = self.shooting()?;
                let guesses = start::guesses(&self.scene, &initial, &body, closure, omega);
                let start = |body: &mut Propagator| {
                    let orbit = follow::first_orbit(body, closure, &guesses, omega)?;
                    Ok(Ok(Start::Orbit(Box::new(orbit), direction.sign())))
                };
                follow::orbits(&mut body, closure, task, start, take)?
            }
            Piece::Damped(n_h) => {
                let grid = self.walk.amplitudes();
                let system = self.problem.system.clone();
                let mode = DampedMode::new(system, self.damped.unwrap_or_default())?;
                let plan = Amplitudes { grid: &grid, n_h: *n_h, settings };
                let known = known.branch(index);
                let end = families::damped::series(&mode, &plan, &known, take)?;
                BranchEnd { branch: index, ..end }
            }
            Piece::SeriesAlong(n_h, direction) => {
                let what = (*n_h, omega, direction.sign());
                if let Some(Viscosity { pin, .. }) = &self.viscosity {
                    let mut body = self.choice.viscous_body(&self.problem, *pin)?;
                    return Ok(follow::viscous_series(&mut body, what, task, take)?);
                }
                let mut body = self.choice.body(&self.scene)?;
                follow::series(&mut body, what, task, take)?
            }
        })
    }

    /// A body for shooting, how its orbits close, and the scene's initial state.
    fn shooting(&self) -> Result<(Propagator, Closure, State), CliError> {
        let closure = self.kind()?;
        let Problem { system, initial, .. } = self.problem.clone();
        Ok((family::propagator(system)?, closure, initial))
    }

    /// Frequency of the first orbit, and how a branch is followed from there.
    fn options(&self) -> (f64, Options) {
        let (omega, step, locate, natural) = match self.walk {
            Walk::Branch { start, step, locate, natural } => (start, step, locate, natural),
            _ => (self.range.0, 0.0, false, false),
        };
        let step = (step, 1e-8, 0.05f64.max(step));
        let (range, points) = (self.range, self.points);
        (omega, Options { range, step, points, locate, natural })
    }
}

/// A gap only stiffens a body: the family of its lowest mode begins at its natural frequency and goes up.
fn warn_below_first_mode(
    global: &Global,
    problem: &Problem,
    range: (f64, f64),
) -> Result<(), CliError> {
    let system = &problem.system;
    if system.facing().iter().any(|c| c.gap <= 0.0) || range.0 <= 0.0 {
        return Ok(());
    }
    let open = system.phase(&States::open(system.n_contact()));
    let modes = phase_modes(system, &open, 1).map_err(|e| CliError::Numerics(e.to_string()))?;
    if let Some(first) = modes.omega.first().filter(|w| range.0 < 0.999 * **w) {
        let (low, first) = (significant(range.0, 6), significant(*first, 6));
        global.caller.warn(&format!(
            "the range begins at omega = {low}, below the lowest natural frequency {first} of the open body: the family of the lowest mode begins there and goes up, and nothing of it lies below (--range {first},… saves the time)"
        ));
    }
    Ok(())
}

impl Task for Arguments {
    type Plan = (Request, Closure);
    type Found = Carried;

    fn files(&self) -> Files<'_> {
        let read = self.conservative_from.iter().map(|p| p.as_path()).collect();
        Files { scene: &self.scene, read, force: self.output.force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "backbone"))
    }

    fn plan(&self, work: &mut Work) -> Result<Self::Plan, CliError> {
        let mut problem = load::warned(&work.scene, work.global)?;
        if self.needs_modes(&problem) {
            problem = family::reduce_if_large(work.global, &mut work.scene, problem)?;
        }
        let request = self.request(&work.scene, problem)?;
        let closure = request.closure()?;
        let Request { viscosity, near, problem, range, .. } = &request;
        if let Some(viscosity) = viscosity {
            viscous::warn(work.global, viscosity);
        } else if near.is_empty() && matches!(closure, Closure::Reversible | Closure::Autonomous) {
            warn_below_first_mode(work.global, problem, *range)?;
        }
        Ok((request, closure))
    }

    fn carry_out(&self, work: &Work, plan: &mut Self::Plan) -> Result<Carried, CliError> {
        let (request, closure) = &*plan;
        let system = &request.problem.system;
        let shooting = !request.choice.is_balance();
        let asked = Asked {
            path: &work.path,
            scene: &work.scene,
            system,
            plan: request.plan(),
            points: request.points,
            unknowns: shooting.then(|| closure.sizes(system.n_o())),
            options: work.options.clone(),
        };
        let mut carried =
            family::carry_out(work.global, &asked, work.resume, |writer, known, bar| {
                // a grid that was widened counts from where it began
                let pieces = request.pieces(writer.plan().identity.walk);
                let job =
                    |piece| Job::new(1, move |take| Ok(vec![request.compute(piece, known, take)?]));
                let jobs: Vec<Job> = pieces.iter().enumerate().map(job).collect();
                family::run_jobs(work.global, &jobs, writer, system, request.range, bar)
            })?;
        if request.viscosity.is_some() && shooting && !self.quick {
            family::state(work, (&work.scene, &request.problem), (*closure, None), &mut carried)?;
        }
        Ok(carried)
    }

    fn say(&self, work: &Work, plan: &Self::Plan, carried: Carried) -> Result<Answer, CliError> {
        let answer = family::answer(work, &carried);
        // near viscous orbits there need not be any
        let is_empty = carried.stored.points.iter().all(|p| p.orbit.is_none());
        let advice = match plan.0.viscosity {
            // one viscous orbit at a frequency
            Some(_) => "no orbit was found; give another --range, a smaller --beta or a finer mesh",
            None => {
                "no orbit was found; give a better [initial] guess, or look with `signorini orbit --all`"
            }
        };
        Ok(if plan.0.near.is_empty() && is_empty { answer.failed(advice) } else { answer })
    }
}
