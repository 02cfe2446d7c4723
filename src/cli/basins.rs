//! `signorini basins`: from which states a forced body comes to which of its attractors.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::{Value, json};

use signorini::families::basins::{self, Plane};
use signorini::problem::{Problem, mode_shapes};
use signorini::records::{Basins, Fate, Share, Starts, StateAxis, Status, fingerprint};
use signorini::report::summary::significant;
use signorini::scenario::{Issue, Scene};
use signorini::store::{Head, StoredBasins, read_basins, write_basins};

use super::family::{self, Output};
use super::progress::Bar;
use super::ratios::one_ratio;
use super::task::{Files, Task, Work, check_same};
use super::whole::{Kept, Whole, begun, inspected, of_scene, said};
use super::{Answer, CliError, Global, load};

/// How often it is shown how far the command is.
const SHOWN: Duration = Duration::from_millis(100);
/// Most cells along an axis, and most states that are drawn.
const MOST: (usize, usize) = (2000, 4_000_000);
/// Largest coordinate of a state.
const LARGEST: f64 = 1e6;

/// Arguments of `basins`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini basins scenarios/half-plate-response.toml --ratio 0.01 --omega 1.72 --size 20 -o basins.h5\n  signorini basins scenarios/half-plate-response.toml --ratio 0.01 --omega 1.72 --plane q1=-2,2 v1=-2,2 q2=0.5 --size 20 -o slice.h5\n  signorini basins scenarios/half-plate-response.toml --ratio 0.01 --omega 1.72 --plane q1=-2,2 v1=-2,2 q2=-1,1 --samples 500 -o share.h5\n  signorini plot basins.h5\n\nqK is the amplitude of mode K of the open body, 1 where the first contact point grazes; vK its velocity over its frequency, in the same unit. With [initial] equilibrium = true both are told around the equilibrium, by the modes of its phase, 1 where the first point opens or closes."
)]
pub struct Arguments {
    /// The scene (TOML): damping and harmonic loads of one frequency
    scene: PathBuf,
    /// Coordinates of the states with their ranges, or with one value for all; of modes that are not named they are zero
    #[arg(long, num_args = 1.., value_name = "AXIS=LOW,HIGH", default_values = ["q1=-3,3", "v1=-3,3"])]
    plane: Vec<String>,
    /// Cells along each of two axes: a motion from the middle of each
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = family::at_least_one)]
    size: usize,
    /// In place of cells so many states, drawn uniformly: along any number of axes, for the shares of the basins
    #[arg(long, value_name = "N", value_parser = family::at_least_one, conflicts_with = "size")]
    samples: Option<usize>,
    /// Seed of the states that are drawn
    #[arg(long, default_value_t = 1, requires = "samples")]
    seed: u64,
    /// Circular frequency of the loads [default: that of [orbit], or of the load]
    #[arg(long, allow_negative_numbers = true)]
    omega: Option<f64>,
    /// Damping ratio [default: that of [orbit] where it has one, or the scene's own damping]
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true)]
    ratio: Option<f64>,
    /// Go on with an unfinished file
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    output: Output,
}

/// What is asked for, checked.
pub struct Request {
    problem: Problem,
    fingerprint: u64,
    plane: Plane,
    /// What is known already.
    basins: Basins,
    is_whole: bool,
}

/// `q1=-3,3`, `v2=0.5`
fn axis(text: &str) -> Result<StateAxis, CliError> {
    let refuse = || {
        let help = "give the amplitude of a mode, or its velocity, and its range: q1=-3,3 v1=-3,3; or one value for all states: q2=0.5";
        CliError::Input(format!("--plane {text}: {help}"))
    };
    let (name, ends) = text.split_once('=').ok_or_else(refuse)?;
    let (kind, mode) = name.trim().split_at_checked(1).ok_or_else(refuse)?;
    let mode: usize = mode.parse().ok().filter(|m| *m > 0).ok_or_else(refuse)?;
    let number = |s: &str| s.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let ends: Option<Vec<f64>> = ends.split(',').map(number).collect();
    if ends.iter().flatten().any(|x| x.abs() > LARGEST) {
        let text =
            format!("--plane {text}: give numbers up to {LARGEST}; 1 is where contact begins");
        return Err(CliError::Input(text));
    }
    let range = match ends.as_deref() {
        Some(&[low, high]) if low < high => (low, high),
        Some(&[one]) => (one, one),
        _ => return Err(refuse()),
    };
    match kind {
        "q" | "v" => Ok(StateAxis { mode, is_velocity: kind == "v", range }),
        _ => Err(refuse()),
    }
}

impl Arguments {
    /// The axes and the states.
    fn states(&self) -> Result<(Vec<StateAxis>, Starts), CliError> {
        let axes = self.plane.iter().map(|text| axis(text)).collect::<Result<Vec<_>, _>>()?;
        for (k, axis) in axes.iter().enumerate() {
            if axes[..k].iter().any(|other| other.name() == axis.name()) {
                return Err(CliError::Input(format!("--plane: {} is given twice", axis.name())));
            }
        }
        let free = axes.iter().filter(|a| !a.is_fixed()).count();
        let input = |text: String| Err(CliError::Input(text));
        let (most, most_drawn) = MOST;
        match self.samples {
            None if free != 2 => input(format!(
                "--plane: {free} with a range; give two for a plane of cells, or --samples N for states that are drawn"
            )),
            None if self.size > most => input(format!("--size {}: give at most {most}", self.size)),
            Some(n) if n > most_drawn => input(format!("--samples {n}: give at most {most_drawn}")),
            Some(_) if free == 0 => input("--plane has no axis with a range".into()),
            None => Ok((axes, Starts::Grid(self.size))),
            Some(count) => Ok((axes, Starts::Drawn { count, seed: self.seed })),
        }
    }
}

impl Task for Arguments {
    type Plan = Request;
    type Found = Basins;

    fn files(&self) -> Files<'_> {
        let read = vec![];
        Files { scene: &self.scene, read, force: self.output.force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "basins"))
    }

    fn plan(&self, work: &mut Work) -> Result<Request, CliError> {
        let (axes, starts) = self.states()?;
        let (_, scene) = one_ratio(&work.scene, self.ratio)?;
        work.scene = scene;
        let problem = load::warned(&work.scene, work.global)?;
        let problem = family::reduce_if_large(work.global, &mut work.scene, problem)?;
        let scene = &work.scene;
        family::check_forced(scene, &problem, "basins are those of a body under a harmonic load")?;
        if scene.rubs() {
            let help = "leave the friction out, or see what the body does from one state after the other: signorini run";
            let message =
                "holds families of orbits: each position of rest is an attractor of its own";
            return Err(scene.error(Issue::new(scene.friction_key(), message, help)).into());
        }
        let omega = family::omega(scene, self.omega, None)?;
        family::check_frequency(&problem, omega)?;
        let system = &problem.system;
        family::check_settles(scene, system, "")?;
        let modes: Vec<usize> = axes.iter().map(|a| a.mode).collect();
        let shapes = mode_shapes(system, &modes);
        let (around, shapes) = shapes.map_err(|e| CliError::Input(format!("--plane: {e}")))?;
        let count = Basins::count(starts);
        let asked = Basins {
            omega,
            axes,
            starts,
            fates: vec![None; count],
            maps: vec![0; count],
            attractors: vec![],
        };
        let fingerprint = fingerprint(scene, &problem);
        let of = (scene, fingerprint);
        let (basins, is_whole) =
            begun((work, self.resume), asked, |asked| earlier(&work.path, of, asked))?;
        Ok(Request {
            fingerprint,
            plane: Plane { around, axes: basins.axes.clone(), shapes },
            basins,
            is_whole,
            problem,
        })
    }

    fn carry_out(&self, work: &Work, plan: &mut Request) -> Result<Basins, CliError> {
        if plan.is_whole {
            return Ok(plan.basins.clone());
        }
        let global = work.global;
        let system = &plan.problem.system;
        let at = basins::coordinates(&plan.basins.axes, plan.basins.starts);
        let options = work.options_again();
        let write = |basins: &Basins, status: &Status| {
            let what = (&work.scene, system, plan.fingerprint);
            write_basins(&work.path, what, &options, (basins, &at), status)
        };
        let mut found = plan.basins.clone();
        let mut kept = Kept::begin(work, &write, &found)?;
        let bar = Bar::new(global, &work.scene);
        let mut shown = Instant::now();
        let mut take = |basins: &Basins| {
            // to count the states after each of them would take longer than some motions
            if let Some(bar) = bar.as_ref().filter(|_| shown.elapsed() >= SHOWN) {
                shown = Instant::now();
                let (told, count) = (basins.told(), basins.fates.len());
                let text = format!("{told} of {count}, {} attractors", basins.attractors.len());
                bar.set(told as f64 / count as f64, text);
            }
            kept.step(basins)
        };
        let ends_now = || global.caller.signal().is_some();
        let told = (&mut take as basins::Take, &ends_now as &(dyn Fn() -> bool + Sync));
        let result = basins::find(system, &plan.plane, &mut found, told);
        bar.iter().for_each(Bar::clear);
        let (told, count) = (found.told(), found.fates.len());
        let is_whole = result.map(|()| told == count);
        if matches!(is_whole, Ok(true)) {
            found.sort();
        }
        kept.end(found, is_whole, &format!("{told} of {count} states are told"))
    }

    fn say(&self, work: &Work, _: &Request, found: Basins) -> Result<Answer, CliError> {
        Ok(said(work, &found))
    }
}

/// What an earlier run of the same command left.
fn earlier(path: &Path, of: (&Scene, u64), asked: &Basins) -> Result<(Head, Basins), CliError> {
    let stored = read_basins(path)?;
    let b = &stored.basins;
    let of_scene = of_scene((&stored.head, stored.problem), of);
    let own = [
        ("another --omega", b.omega == asked.omega),
        ("another --plane", b.axes == asked.axes),
        ("other states (--size, --samples, --seed)", b.starts == asked.starts),
    ];
    check_same(path, &[&of_scene[..], &own].concat())?;
    Ok((stored.head, stored.basins))
}

/// What a file of basins holds.
pub(super) fn inspect(file: &Path, scene: bool, global: &Global) -> Result<Answer, CliError> {
    let StoredBasins { head, basins, .. } = read_basins(file)?;
    Ok(inspected(global, scene, head, &basins))
}

fn share_to_json(s: Share) -> Value {
    json!({
        "count": s.count,
        "share": s.share,
        "error": s.error,
        "interval": [s.interval.0, s.interval.1],
    })
}

impl Whole for Basins {
    fn to_json(&self) -> Value {
        let axis = |a: &StateAxis| json!({"name": a.name(), "range": [a.range.0, a.range.1]});
        let attractor = |k: usize| {
            let seen = &self.attractors[k].seen;
            let mut json = share_to_json(self.share(Fate::Attractor(k)));
            json["kind"] = seen.kind.word().into();
            json["period_number"] = seen.kind.periods().into();
            json["lyapunov"] = seen.exponent.into();
            json["lyapunov_error"] = seen.exponent_error.into();
            json["rotation_number"] = self.attractors[k].rotation.map(|r| r.0).into();
            json["rotation_error"] = self.attractors[k].rotation.map(|r| r.1).into();
            json["amplitude"] = seen.amplitude().into();
            json["force"] = seen.force.into();
            json["energy"] = seen.energy.into();
            json
        };
        let others = Fate::OTHERS.map(|fate| (fate.to_string(), share_to_json(self.share(fate))));
        let (size, seed) = match self.starts {
            Starts::Grid(n) => (Some(n), None),
            Starts::Drawn { seed, .. } => (None, Some(seed)),
        };
        json!({
            "omega": self.omega,
            "axes": self.axes.iter().map(axis).collect::<Vec<_>>(),
            "size": size,
            "seed": seed,
            "states": self.fates.len(),
            "told": self.told(),
            "maps": self.maps.iter().sum::<usize>(),
            "attractors": (0..self.attractors.len()).map(attractor).collect::<Vec<_>>(),
            "others": others.into_iter().collect::<serde_json::Map<_, _>>(),
        })
    }

    fn to_text(&self) -> String {
        let mut out = String::new();
        let count = self.fates.len();
        let axes = |fixed: bool| -> Vec<String> {
            let of = self.axes.iter().filter(|a| a.is_fixed() == fixed);
            let text = |a: &StateAxis| match fixed {
                true => format!("{} = {}", a.name(), a.range.0),
                false => format!("{} from {} to {}", a.name(), a.range.0, a.range.1),
            };
            of.map(text).collect()
        };
        let kind = match self.starts {
            Starts::Grid(n) => format!("{n} x {n}"),
            Starts::Drawn { count, seed } => format!("{count} drawn (seed {seed})"),
        };
        let all = [axes(false), axes(true)].concat().join(", ");
        let _ = writeln!(out, "  {:<14}{kind}: {all}; omega = {}", "states", self.omega);
        if self.told() < count {
            let _ = writeln!(out, "  {:<14}{} of {count}", "told", self.told());
        }
        let share = |s: Share| {
            format!(
                "{:.3} ± {:.3} (95 %: {:.3} to {:.3}), {} states",
                s.share, s.error, s.interval.0, s.interval.1, s.count
            )
        };
        for (k, a) in self.attractors.iter().enumerate() {
            let (seen, name) = (&a.seen, format!("attractor {k}"));
            let _ = writeln!(
                out,
                "  {name:<14}{}: {}; amplitude {}, force {}",
                seen.kind,
                share(self.share(Fate::Attractor(k))),
                significant(seen.amplitude(), 6),
                significant(seen.force, 6),
            );
            if let Some((rho, error)) = a.rotation {
                let _ = writeln!(out, "  {:<14}rotation number {rho:.7} ± {error:.0e}", "");
            }
        }
        for fate in Fate::OTHERS {
            let s = self.share(fate);
            match fate {
                _ if s.count == 0 => {}
                Fate::Inside => {
                    let _ = writeln!(out, "  {:<14}{} states, left out", "inside", s.count);
                }
                _ => {
                    let _ = writeln!(out, "  {:<14}{}", fate.to_string(), share(s));
                }
            }
        }
        let told = self.told().max(1);
        let maps = self.maps.iter().sum::<usize>() as f64 / told as f64;
        let _ = writeln!(out, "  {:<14}{maps:.1} a state", "periods");
        out
    }
}
