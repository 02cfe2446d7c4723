//! `signorini tori`: motions of two frequencies, from where an orbit loses its stability to one.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use signorini::families::start::{check_with_mass, given};
use signorini::families::tori::{self, SIZE};
use signorini::problem::Problem;
use signorini::records::{Status, Tori, TorusRow, fingerprint};
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::{Head, StoredTori, read_tori, write_tori};

use super::family::{self, Output};
use super::progress::Bar;
use super::ratios::changed_ratio;
use super::task::{Files, Task, Work, check_same};
use super::whole::{Kept, Whole, begun, inspected, of_scene, said};
use super::{Answer, CliError, Global, load};

/// Most curves.
const MOST: usize = 100_000;
/// Without a range curves are followed to frequencies that are so many times higher or lower.
const AWAY: f64 = 1.2;

/// Arguments of `tori`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini response scene.toml --method shooting -o response.h5     (special points: torus)\n  signorini tori scene.toml --omega 2.9209 -o tori.h5\n  signorini plot tori.h5\n\nAt the beginnings of the periods of the loads a motion of two frequencies lies on a closed curve, F(x(s)) = x(s + 2 pi rho). A small curve around the orbit, then larger ones; each with its frequency, rotation number, and whether it attracts."
)]
pub struct Arguments {
    /// The scene (TOML): damping and harmonic loads of one frequency
    scene: PathBuf,
    /// Circular frequency of an orbit next to the point at which a pair of its multipliers leaves the unit circle
    #[arg(long, allow_negative_numbers = true)]
    omega: f64,
    /// Curves that are followed
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = family::at_least_one)]
    curves: usize,
    /// Size of the first curve, and first step: norm of its first coefficient, a square root of energy [default: a hundredth of the unit of states]
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    size: Option<f64>,
    /// Frequencies that curves are followed in [default: those within a fifth of --omega]
    #[arg(long, value_name = "LOW,HIGH")]
    range: Option<String>,
    /// Damping ratio [default: that of [orbit] where it has one, or the scene's own damping]
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true)]
    ratio: Option<f64>,
    /// Go on with an unfinished file
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    output: Output,
}

/// `LOW,HIGH` around a frequency.
fn range(text: &str, omega: f64) -> Result<[f64; 2], CliError> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[low, high]) if low <= omega && omega <= high && low > 0.0 => Ok([low, high]),
        _ => Err(CliError::Input(format!(
            "--range {text}: give two frequencies with --omega between them: 2.9,3.1"
        ))),
    }
}

/// What is asked for, checked.
pub struct Request {
    problem: Problem,
    fingerprint: u64,
    /// What is known already.
    found: Tori,
    is_whole: bool,
}

impl Task for Arguments {
    type Plan = Request;
    type Found = Tori;

    fn files(&self) -> Files<'_> {
        let read = vec![];
        Files { scene: &self.scene, read, force: self.output.force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "tori"))
    }

    fn plan(&self, work: &mut Work) -> Result<Request, CliError> {
        let input = |text: String| Err(CliError::Input(text));
        let omega = self.omega;
        if !(omega.is_finite() && omega > 0.0) {
            return input(format!("--omega {omega}: give a positive frequency"));
        }
        if self.curves > MOST {
            return input(format!("--curves {}: give at most {MOST}", self.curves));
        }
        if let Some(size) = self.size.filter(|a| !(a.is_finite() && *a > 0.0)) {
            return input(format!("--size {size}: give a positive size"));
        }
        let range = match &self.range {
            Some(text) => range(text, omega)?,
            None => [omega / AWAY, omega * AWAY],
        };
        work.scene = changed_ratio(&work.scene, self.ratio, "")?;
        let problem = load::warned(&work.scene, work.global)?;
        let problem = family::reduce_if_large(work.global, &mut work.scene, problem)?;
        let scene = &work.scene;
        let what = "a motion of two frequencies has that of a harmonic load, and one of its own";
        family::check_forced(scene, &problem, what)?;
        let by = "curves of two frequencies know no states that remember";
        check_with_mass(scene, &problem.system, by)?;
        family::check_settles(scene, &problem.system, "")?;
        family::check_frequency(&problem, omega)?;
        let unit = family::propagator(problem.system.clone())?.unit;
        let size = self.size.unwrap_or(SIZE * unit);
        let fingerprint = fingerprint(scene, &problem);
        let asked = Tori {
            start: omega,
            range,
            count: self.curves,
            size,
            rows: vec![],
            end: String::new(),
        };
        let of = (scene, fingerprint);
        let (found, is_whole) =
            begun((work, self.resume), asked, |asked| earlier(&work.path, of, asked))?;
        Ok(Request { problem, fingerprint, found, is_whole })
    }

    fn carry_out(&self, work: &Work, plan: &mut Request) -> Result<Tori, CliError> {
        if plan.is_whole {
            return Ok(plan.found.clone());
        }
        let (global, options) = (work.global, work.options_again());
        let write = |found: &Tori, status: &Status| {
            let what = (&work.scene, &plan.problem.system, plan.fingerprint);
            write_tori(&work.path, what, &options, found, status)
        };
        let mut found = plan.found.clone();
        let mut kept = Kept::begin(work, &write, &found)?;
        let bar = Bar::new(global, &work.scene);
        let mut take = |found: &Tori| {
            if let (Some(bar), Some(row)) = (&bar, found.rows.last()) {
                let share = found.rows.len() as f64 / found.count as f64;
                bar.set(share, format!("omega = {:.6}, rho = {:.6}", row.omega, row.rho));
            }
            kept.step(found)
        };
        let ends_now = || global.caller.signal().is_some();
        let body = family::propagator(plan.problem.system.clone())?;
        let guesses = given(&work.scene, &plan.problem.initial, &body);
        let system = &plan.problem.system;
        let go = tori::follow(system, &guesses, &mut found, (&mut take, &ends_now));
        bar.iter().for_each(Bar::clear);
        let told = format!("{} curves are", found.rows.len());
        kept.end(found, go.map(|go| go.is_continue()), &told)
    }

    fn say(&self, work: &Work, _: &Request, found: Tori) -> Result<Answer, CliError> {
        let answer = said(work, &found);
        Ok(if found.rows.is_empty() { answer.failed(found.end) } else { answer })
    }
}

/// What an earlier run of the same command left.
fn earlier(path: &Path, of: (&Scene, u64), asked: &Tori) -> Result<(Head, Tori), CliError> {
    let stored = read_tori(path)?;
    let tori = &stored.tori;
    let of_scene = of_scene((&stored.head, stored.problem), of);
    let own = [
        ("another --omega", tori.start == asked.start),
        ("another --curves", tori.count == asked.count),
        ("another --size", tori.size == asked.size),
        ("another --range", tori.range == asked.range),
    ];
    check_same(path, &[&of_scene[..], &own].concat())?;
    Ok((stored.head, stored.tori))
}

/// What a file of tori holds.
pub(super) fn inspect(file: &Path, scene: bool, global: &Global) -> Result<Answer, CliError> {
    let StoredTori { head, tori, .. } = read_tori(file)?;
    Ok(inspected(global, scene, head, &tori))
}

impl Whole for Tori {
    fn to_json(&self) -> Value {
        let of =
            |f: &dyn Fn(&TorusRow) -> Value| -> Vec<Value> { self.rows.iter().map(f).collect() };
        json!({
            "start": self.start,
            "range": self.range,
            "first_size": self.size,
            "omega": of(&|row| json!(row.omega)),
            "rotation_number": of(&|row| json!(row.rho)),
            "size": of(&|row| json!(row.size)),
            "tail": of(&|row| json!(row.tail)),
            "harmonics": of(&|row| json!(row.states.len() / 2)),
            "attraction": of(&|row| json!(row.attraction)),
            "amplitude": of(&|row| json!(row.amplitude)),
            "force": of(&|row| json!(row.force)),
            "end": self.end,
        })
    }

    fn to_text(&self) -> String {
        let mut out = String::new();
        let attract = self.rows.iter().filter(|row| row.attracts()).count();
        let _ = writeln!(
            out,
            "  {:<14}{} from the orbit at omega = {}; {attract} attract",
            "curves",
            self.rows.len(),
            significant(self.start, 7)
        );
        let mut row = |name: &str, row: Option<&TorusRow>| {
            let Some(row) = row else { return };
            let _ = writeln!(
                out,
                "  {name:<14}omega {}, rotation number {}, largest displacement {} ({} harmonics, tail {:.0e})",
                significant(row.omega, 9),
                significant(row.rho, 8),
                significant(row.amplitude, 6),
                row.states.len() / 2,
                row.tail
            );
        };
        row("first", self.rows.first());
        row("last", self.rows.last().filter(|_| self.rows.len() > 1));
        let _ = writeln!(out, "  {:<14}{}", "end", self.end);
        out
    }
}
