//! `signorini curve`: where folds, doublings, Neimark–Sacker points, grazings and peaks of a response lie over a number of the scene.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use signorini::continuation::Go;
use signorini::families::curves::{self, Asked, Start};
use signorini::families::start;
use signorini::problem::Problem;
use signorini::records::{Curve, CurveOf, Curves, Status};
use signorini::report::summary::significant;
use signorini::scenario::{Issue, Scene};
use signorini::store::{StoredCurves, StoredFamily, read_curves, write_curves};

use super::doublings;
use super::family::{self, Output};
use super::progress::Bar;
use super::ratios::one_ratio;
use super::response::first_orbit;
use super::task::{Files, Task, Work};
use super::whole::{Whole, inspected, said};
use super::{Answer, CliError, Global, load, plain};

/// Arguments of `curve`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini curve scenarios/half-plate-response.toml --of fold --over load[0].peak=2,4 -o folds.h5\n  signorini curve scenarios/half-plate-response.toml --of peak --over contact.gap=0.9,1.1 -o peaks.h5\n  signorini plot folds.h5\n\nOf doublings of orbits of several periods: signorini response SCENE --through SWEEP.h5 --locate -o branches.h5, then --response branches.h5."
)]
pub struct Arguments {
    /// The scene (TOML): damping and harmonic loads of one frequency
    scene: PathBuf,
    /// What is followed
    #[arg(long, value_enum, value_name = "WHAT")]
    of: Of,
    /// The number of the scene over which, and its range: load[0].amplitude=0.5,2. The curves begin at its value in the scene
    #[arg(long, value_name = "KEY=LOW,HIGH")]
    over: String,
    /// Frequencies to cover [default: range of the scene's [orbit]]
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", allow_hyphen_values = true)]
    range: Option<Vec<f64>>,
    /// Where they begin: a file of `response` of this scene, --locate there for doublings and Neimark–Sacker points [default: a response that is followed first]
    #[arg(long, value_name = "RESPONSE.h5")]
    response: Option<PathBuf>,
    /// Damping ratio [default: that of [orbit] where it has one, or the scene's own damping]
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true)]
    ratio: Option<f64>,
    /// Largest step of arclength (relative change of the state, the frequency and the number)
    #[arg(long, default_value_t = 0.05, allow_negative_numbers = true)]
    step: f64,
    /// Most points on either side of a start
    #[arg(long, default_value_t = 500, value_parser = family::at_least_one)]
    points: usize,
    #[command(flatten)]
    output: Output,
}

/// What is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Of {
    /// Folds: where the response turns back
    Fold,
    /// Period doublings
    Doubling,
    /// Neimark–Sacker points, where a motion of two frequencies begins
    Torus,
    /// Grazings: where a contact point begins or ends to touch
    Grazing,
    /// Peaks of the amplitude: the ridge
    Peak,
}

impl From<Of> for CurveOf {
    fn from(of: Of) -> CurveOf {
        match of {
            Of::Fold => CurveOf::Fold,
            Of::Doubling => CurveOf::Doubling,
            Of::Torus => CurveOf::Torus,
            Of::Grazing => CurveOf::Grazing,
            Of::Peak => CurveOf::Peak,
        }
    }
}

/// What is asked for, checked.
pub struct Request {
    key: String,
    range: (f64, f64),
    frequencies: (f64, f64),
    problem: Problem,
    /// The response in which curves begin, with the damping ratio in percent of the branches that count.
    stored: Option<(Option<f64>, StoredFamily)>,
}

/// `KEY=LOW,HIGH`
pub(super) fn over(text: &str) -> Result<(String, (f64, f64)), CliError> {
    let refuse = || {
        let help =
            "give a key of the scene and its range, the lower end first: load[0].amplitude=0.5,2";
        CliError::Input(format!("--over {text}: {help}"))
    };
    let (key, range) = text.split_once('=').ok_or_else(refuse)?;
    let number = |s: &str| s.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let ends: Option<Vec<f64>> = range.split(',').map(number).collect();
    match ends.as_deref() {
        Some(&[low, high]) if low < high => Ok((key.trim().to_owned(), (low, high))),
        _ => Err(refuse()),
    }
}

impl Task for Arguments {
    type Plan = Request;
    type Found = Curves;

    fn files(&self) -> Files<'_> {
        let read = self.response.iter().map(PathBuf::as_path).collect();
        Files { scene: &self.scene, read, force: self.output.force, resume: false }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "curve"))
    }

    fn plan(&self, work: &mut Work) -> Result<Request, CliError> {
        if !(self.step >= 1e-3 && self.step <= 1.0) {
            let text = format!("--step {}: give a number from 1e-3 to 1", plain(self.step));
            return Err(CliError::Input(text));
        }
        let (key, range) = over(&self.over)?;
        let (percent, scene) = one_ratio(&work.scene, self.ratio)?;
        work.scene = scene;
        let problem = load::warned(&work.scene, work.global)?;
        let problem = family::reduce_if_large(work.global, &mut work.scene, problem)?;
        let scene = &work.scene;
        let frequencies = family::range(scene, self.range.as_deref())?;
        curves::value(scene, &key, range)?;
        family::check_forced(scene, &problem, family::OF_RESPONSE)?;
        if scene.rubs() {
            let help =
                "leave the friction out, or follow the response at several values: signorini study";
            let message =
                "friction holds families of orbits: there is no one branch with folds of its own";
            return Err(scene.error(Issue::new("contact.friction", message, help)).into());
        }
        if self.of == Of::Grazing && problem.system.impact().is_some() {
            let help = "leave restitution out, or follow folds, doublings or peaks";
            let message = "grazings of bodies whose velocities jump are not followed";
            return Err(scene.error(Issue::new("contact.restitution", message, help)).into());
        }
        let stored = match &self.response {
            None => None,
            Some(file) => {
                let mut stored = StoredFamily::read(file)?;
                doublings::check(&stored, &work.scene)?;
                if stored.branches.iter().all(|b| b.percent() != percent) {
                    let text =
                        "it has no branch of this damping ratio; give one of its own with --ratio";
                    return Err(CliError::Input(format!("{}: {text}", file.display())));
                }
                stored.count_along_directions(&problem.system.body);
                Some((percent, stored))
            }
        };
        Ok(Request { key, range, frequencies, problem, stored })
    }

    fn carry_out(&self, work: &Work, plan: &mut Request) -> Result<Curves, CliError> {
        let (global, scene) = (work.global, &work.scene);
        let of = CurveOf::from(self.of);
        global.caller.watch();
        let go = || match global.caller.signal() {
            Some(_) => Go::Break(()),
            None => Go::Continue(()),
        };
        let bar = Bar::new(global, scene);
        let system = &plan.problem.system;
        let starts: Vec<Start> = match &plan.stored {
            Some((percent, stored)) => {
                let branches = stored.branches.iter().enumerate();
                let branches = branches.filter(|(_, b)| b.percent() == *percent);
                let all = branches.map(|(k, branch)| (branch, stored.branch(k)));
                curves::of_family(system, of, all)
            }
            None => {
                let mut body = family::propagator(system.clone())?;
                let given = start::given(scene, &plan.problem.initial, &body);
                let (low, high) = plan.frequencies;
                let first = |body: &mut _| first_orbit(body, &given, low);
                curves::of_response(&mut body, (of, plan.frequencies, self.step), first, |omega| {
                    let share = (omega - low) / (high - low);
                    let text = format!("response, omega = {omega:.4}");
                    bar.iter().for_each(|bar| bar.set(0.2 * share, text.clone()));
                    go()
                })?
            }
        };
        let asked = Asked {
            scene,
            of,
            key: &plan.key,
            range: plan.range,
            frequencies: plan.frequencies,
            step: self.step,
            points: self.points,
        };
        let found = curves::follow(&asked, &starts, |k, point| {
            let share = 0.2 + 0.8 * k as f64 / starts.len() as f64;
            let text = format!("{} = {:.4}, omega = {:.4}", plan.key, point.value, point.omega);
            bar.iter().for_each(|bar| bar.set(share, text.clone()));
            go()
        })?;
        bar.iter().for_each(Bar::clear);
        let signal = global.caller.signal();
        let status = if signal.is_some() { Status::Interrupted } else { Status::Complete };
        write_curves(&work.path, scene, system, &work.options, &found, &status)?;
        match signal {
            Some(signal) => Err(CliError::Interrupted(
                signal,
                format!("interrupted; what was found is in {}", work.path.display()),
            )),
            None => Ok(found),
        }
    }

    fn say(&self, work: &Work, plan: &Request, found: Curves) -> Result<Answer, CliError> {
        let answer = said(work, &found);
        Ok(match (found.all.is_empty(), found.lost.is_empty()) {
            // what some starts led to stands beside what others did not
            (false, _) => answer,
            (true, false) => answer.failed(found.lost.join("; ")),
            (true, true) => answer.failed(format!(
                "the response has no {} between omega = {} and {}; give another --range, or --response",
                found.of.word(),
                plan.frequencies.0,
                plan.frequencies.1
            )),
        })
    }
}

/// What a file of curves holds.
pub(super) fn inspect(file: &Path, scene: bool, global: &Global) -> Result<Answer, CliError> {
    let StoredCurves { head, curves, .. } = read_curves(file)?;
    Ok(inspected(global, scene, head, &curves))
}

impl Whole for Curves {
    fn to_json(&self) -> Value {
        let curve = |c: &Curve| {
            let of = |f: &dyn Fn(&signorini::records::CurvePoint) -> Value| -> Vec<Value> {
                c.points.iter().map(f).collect()
            };
            json!({
                "periods": c.periods,
                "node": c.node,
                "closed": c.closed,
                "ends": c.ends,
                "omega": of(&|p| json!(p.omega)),
                "value": of(&|p| json!(p.value)),
                "theta": of(&|p| json!(p.theta)),
                "special": of(&|p| json!(p.kind.word())),
                "amplitude": of(&|p| json!(p.amplitude)),
                "energy": of(&|p| json!(p.energy)),
                "outside": of(&|p| json!(p.outside)),
            })
        };
        json!({
            "of": self.of.word(),
            "key": self.key,
            "range": self.range,
            "frequencies": self.frequencies,
            "curves": self.all.iter().map(curve).collect::<Vec<_>>(),
            "lost": self.lost,
        })
    }

    fn to_text(&self) -> String {
        let mut out = String::new();
        if self.all.is_empty() {
            let _ = writeln!(out, "  {:<14}none over {}", self.of.word(), self.key);
        }
        for (k, c) in self.all.iter().enumerate() {
            let name = format!("{} {k}", self.of.word());
            let periods =
                if c.periods > 1 { format!(", period {}", c.periods) } else { String::new() };
            let node = c.node.map_or(String::new(), |node| format!(", node {node}"));
            let how = match c.closed {
                true => "closed".to_owned(),
                false => format!("{} … {}", c.ends[0], c.ends[1]),
            };
            let _ = writeln!(out, "  {name:<14}{} points{periods}{node}: {how}", c.points.len());
            for p in c.points.iter().filter(|p| curves::is_special(p)) {
                let _ = writeln!(
                    out,
                    "  {:<14}{:<14}{} = {}, omega = {}",
                    "",
                    p.kind.word(),
                    self.key,
                    significant(p.value, 10),
                    significant(p.omega, 10)
                );
            }
        }
        for lost in &self.lost {
            let _ = writeln!(out, "  {:<14}{lost}", "lost");
        }
        out
    }
}
