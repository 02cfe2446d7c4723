//! `signorini diagram`: what a forced body settles to while a number of its scene goes up, or down.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use signorini::families::{diagram, parameters};
use signorini::problem::Problem;
use signorini::records::{Diagram, DiagramRow, Status, fingerprint};
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::{Head, StoredDiagram, read_diagram, write_diagram};

use super::curve::over;
use super::family::{self, Output};
use super::progress::Bar;
use super::ratios::changed_ratio;
use super::task::{Files, Task, Work, check_same};
use super::whole::{Kept, Whole, begun, inspected, of_scene, said};
use super::{Answer, CliError, Global, load};

/// Most steps of a walk.
const MOST: usize = 100_000;

/// Arguments of `diagram`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini diagram scenarios/driven-stop.toml --omega 1.42 --over contact.gap=0,0.04 --steps 100 -o gap.h5\n  signorini diagram scenarios/driven-stop.toml --omega 1.42 --over load[0].amplitude=0.05,0.15 --way both -o load.h5\n  signorini plot gap.h5\n\nOver the frequency: signorini response SCENE --sweep both."
)]
pub struct Arguments {
    /// The scene (TOML): damping and harmonic loads of one frequency
    scene: PathBuf,
    /// The number of the scene that changes, and its range: load[0].amplitude=0.5,2
    #[arg(long, value_name = "KEY=LOW,HIGH")]
    over: String,
    /// Steps from one end of the range to the other; changes between two values are closed in on
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = family::at_least_one)]
    steps: usize,
    /// Which way the number goes: the body settles at each value from where it was at the one before
    #[arg(long, value_enum, default_value_t = Way::Up, value_name = "WAY")]
    way: Way,
    /// So many periods of the loads at each value, without waiting until the body has settled
    #[arg(long, value_name = "N", value_parser = family::at_least_one)]
    dwell: Option<usize>,
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

/// Which way the number goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Way {
    /// To higher values
    Up,
    /// To lower values
    Down,
    /// Both, each from the scene's own state, or from rest
    Both,
}

impl Way {
    /// Whether it goes down, walk by walk.
    fn falls(self) -> &'static [bool] {
        match self {
            Way::Up => &[false],
            Way::Down => &[true],
            Way::Both => &[false, true],
        }
    }
}

/// What is asked for, checked.
pub struct Request {
    problem: Problem,
    fingerprint: u64,
    /// What is known already.
    diagram: Diagram,
    is_whole: bool,
}

impl Task for Arguments {
    type Plan = Request;
    type Found = Diagram;

    fn files(&self) -> Files<'_> {
        let read = vec![];
        Files { scene: &self.scene, read, force: self.output.force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "diagram"))
    }

    fn plan(&self, work: &mut Work) -> Result<Request, CliError> {
        if self.steps > MOST {
            return Err(CliError::Input(format!("--steps {}: give at most {MOST}", self.steps)));
        }
        let (key, (low, high)) = over(&self.over)?;
        work.scene = changed_ratio(&work.scene, self.ratio, &key)?;
        let problem = load::warned(&work.scene, work.global)?;
        let problem = family::reduce_if_large(work.global, &mut work.scene, problem)?;
        let scene = &work.scene;
        family::check_forced(scene, &problem, "a diagram is that of a body under a harmonic load")?;
        let omega = family::omega(scene, self.omega, None)?;
        family::check_frequency(&problem, omega)?;
        let ends = parameters::at_ends(scene, &key, (low, high))?;
        if self.dwell.is_none() {
            family::check_settle_at(scene, &key, (low, high), &ends)?;
        }
        let asked = Diagram {
            key,
            range: [low, high],
            steps: self.steps,
            omega,
            dwell: self.dwell,
            rows: vec![],
        };
        let fingerprint = fingerprint(scene, &problem);
        let of = (scene, fingerprint);
        let (diagram, is_whole) =
            begun((work, self.resume), asked, |asked| earlier(&work.path, of, asked, self.way))?;
        Ok(Request { problem, fingerprint, diagram, is_whole })
    }

    fn carry_out(&self, work: &Work, plan: &mut Request) -> Result<Diagram, CliError> {
        if plan.is_whole {
            return Ok(plan.diagram.clone());
        }
        let (global, options) = (work.global, work.options_again());
        let write = |found: &Diagram, status: &Status| {
            let what = (&work.scene, &plan.problem.system, plan.fingerprint);
            write_diagram(&work.path, what, &options, found, status)
        };
        let mut found = plan.diagram.clone();
        let mut kept = Kept::begin(work, &write, &found)?;
        let bar = Bar::new(global, &work.scene);
        let walks = self.way.falls();
        let mut take = |found: &Diagram| {
            if let (Some(bar), Some(row)) = (&bar, found.rows.last()) {
                let [low, high] = found.range;
                let up = (row.value - low) / (high - low);
                let done = f64::from(u8::from(row.falls && walks.len() > 1));
                let share = if row.falls { 1.0 - up } else { up };
                let text = format!("{} = {:.4}: {}", found.key, row.value, row.seen.kind);
                bar.set((done + share) / walks.len() as f64, text);
            }
            kept.step(found)
        };
        let go = diagram::follow((&work.scene, &plan.problem), &mut found, walks, &mut take);
        bar.iter().for_each(Bar::clear);
        let told = format!("{} rows are", found.rows.len());
        kept.end(found, go.map(|go| go.is_continue()), &told)
    }

    fn say(&self, work: &Work, _: &Request, found: Diagram) -> Result<Answer, CliError> {
        Ok(said(work, &found))
    }
}

/// What an earlier run of the same command left.
fn earlier(
    path: &Path,
    of: (&Scene, u64),
    asked: &Diagram,
    way: Way,
) -> Result<(Head, Diagram), CliError> {
    let stored = read_diagram(path)?;
    let d = &stored.diagram;
    let is_of_way = |row: &DiagramRow| way.falls().contains(&row.falls);
    let whole = stored.head.status == Status::Complete;
    let same_way = d.rows.iter().all(is_of_way)
        && (!whole || way.falls().iter().all(|f| d.walk(*f).next().is_some()));
    let of_scene = of_scene((&stored.head, stored.problem), of);
    let own = [
        ("another --omega", d.omega == asked.omega),
        ("another --over", d.key == asked.key && d.range == asked.range),
        ("another --steps", d.steps == asked.steps),
        ("another --dwell", d.dwell == asked.dwell),
        ("another --way", same_way),
    ];
    check_same(path, &[&of_scene[..], &own].concat())?;
    Ok((stored.head, stored.diagram))
}

/// What a file of a diagram holds.
pub(super) fn inspect(file: &Path, scene: bool, global: &Global) -> Result<Answer, CliError> {
    let StoredDiagram { head, diagram, .. } = read_diagram(file)?;
    Ok(inspected(global, scene, head, &diagram))
}

impl Whole for Diagram {
    fn to_json(&self) -> Value {
        let of =
            |f: &dyn Fn(&DiagramRow) -> Value| -> Vec<Value> { self.rows.iter().map(f).collect() };
        json!({
            "key": self.key,
            "range": self.range,
            "omega": self.omega,
            "steps": self.steps,
            "dwell": self.dwell,
            "value": of(&|row| json!(row.value)),
            "direction": of(&|row| json!(if row.falls { -1 } else { 1 })),
            "kind": of(&|row| json!(row.seen.kind.word())),
            "period_number": of(&|row| json!(row.seen.kind.periods())),
            "lyapunov": of(&|row| json!(row.seen.exponent)),
            "lyapunov_error": of(&|row| json!(row.seen.exponent_error)),
            "amplitude": of(&|row| json!(row.seen.amplitude())),
            "force": of(&|row| json!(row.seen.force)),
            "special": of(&|row| json!(row.special.word())),
        })
    }

    fn to_text(&self) -> String {
        let mut out = String::new();
        for falls in [false, true] {
            let rows: Vec<&DiagramRow> = self.walk(falls).collect();
            let (Some(first), Some(last)) = (rows.first(), rows.last()) else { continue };
            let _ = writeln!(
                out,
                "  {:<14}{} from {} to {}, {} rows; omega = {}",
                if falls { "down" } else { "up" },
                self.key,
                significant(first.value, 6),
                significant(last.value, 6),
                rows.len(),
                self.omega
            );
            // stretches of one kind of motion without jumps
            let mut from = 0;
            for to in 1..=rows.len() {
                if to < rows.len() && !rows[to].special.is_another_motion() {
                    continue;
                }
                let (a, b) = (rows[from], rows[to - 1]);
                let jump = if rows[from].special.word() == "jump" { ", behind a jump" } else { "" };
                let _ = writeln!(
                    out,
                    "  {:<14}{} to {}: {}{jump}",
                    "",
                    significant(a.value, 6),
                    significant(b.value, 6),
                    a.seen.kind,
                );
                from = to;
            }
        }
        out
    }
}
