//! `signorini phase-resonance`: a laboratory's test of phase resonance on a body of the scene.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Map, Value, json};

use signorini::families::{parameters, phase_resonance};
use signorini::orbit::phase_lag::Gains;
use signorini::problem::{Problem, mode_shapes};
use signorini::records::{PhaseResonance, Resonance, ResonanceRow, Status, Test, fingerprint};
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::{Head, StoredResonance, read_resonance, write_resonance};

use super::curve::over;
use super::family::{self, Output};
use super::progress::Bar;
use super::ratios::changed_ratio;
use super::task::{Files, Task, Work, check_same};
use super::whole::{Kept, Whole, begun, inspected, of_scene, said};
use super::{Answer, CliError, Global, load};

/// Most steps, and most periods that are averaged over.
const MOST: (usize, usize) = (100_000, 1_000_000);
/// Periods that are averaged over where readings are off, at least, and how many windows.
const AVERAGE: (usize, usize) = (200, 10);

/// Arguments of `phase-resonance`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini phase-resonance scenarios/half-plate-response.toml --ratio 0.01 --over load[0].peak=0.5,3 -o test.h5\n  signorini phase-resonance scenarios/half-plate-response.toml --ratio 0.01 --over load[0].peak=0.5,3 --noise 0.01 --seed 7 -o measured.h5\n  signorini plot test.h5\n\nAt each value the frequency of the loads is steered, once a period, to where the displacement that they work on lags a quarter of a period behind: e = lag error, s += KI e, omega = s + KP e. Damping ratio: W/(4 pi K), W the work of the loads in a period, K the largest kinetic energy.\n\nWith --sensitivity the point at which the loop rests is made exact by Newton's method on orbits, and differentiated at phase resonance."
)]
pub struct Arguments {
    /// The scene (TOML): damping and harmonic loads of one frequency
    scene: PathBuf,
    /// The number of the scene that changes, mostly the size of a load, and its range: load[0].amplitude=0.05,0.5
    #[arg(long, value_name = "KEY=LOW,HIGH")]
    over: String,
    /// Steps from one end of the range to the other
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = family::at_least_one)]
    steps: usize,
    /// Circular frequency to begin with [default: that of mode 1 of the body at rest]
    #[arg(long, allow_negative_numbers = true)]
    omega: Option<f64>,
    /// Gains of the loop, of frequency over radians: the proportional one, and that of the sum [default: from the decay of the mode next to the first frequency]
    #[arg(
        long,
        value_name = "KP,KI",
        value_delimiter = ',',
        num_args = 1,
        allow_negative_numbers = true
    )]
    gains: Vec<f64>,
    /// The loop is at rest where the lag is as near as this to a quarter turn, in radians
    #[arg(long, value_name = "RADIANS", default_value_t = 1e-6, allow_negative_numbers = true)]
    tolerance: f64,
    /// Standard deviation of what each period's readings are off by: relative, and of the lag in radians
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, allow_negative_numbers = true)]
    noise: f64,
    /// Periods that are averaged over at each value once the loop is at rest [default: with --noise 200, or 30 times as many as the body takes to settle; else 1]
    #[arg(long, value_name = "N", value_parser = family::at_least_one)]
    average: Option<usize>,
    /// Seed of the noise
    #[arg(long, default_value_t = 1, requires = "noise")]
    seed: u64,
    /// Damping ratio [default: that of [orbit] where it has one, or the scene's own damping]
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true)]
    ratio: Option<f64>,
    /// How frequency, amplitude and work at phase resonance change with numbers of the scene, by their keys, exactly: contact.gap,damping.ratio,load[0].amplitude
    #[arg(long, value_name = "KEY", value_delimiter = ',', conflicts_with = "noise", value_parser = family::key)]
    sensitivity: Vec<String>,
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
    /// What is known already.
    found: PhaseResonance,
    is_whole: bool,
}

impl Arguments {
    /// Refuse numbers out of their ranges.
    fn check(&self) -> Result<(), CliError> {
        let input = |text: String| Err(CliError::Input(text));
        let (most_steps, most_periods) = MOST;
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if self.steps > most_steps {
            return input(format!("--steps {}: give at most {most_steps}", self.steps));
        }
        if let Some(n) = self.average.filter(|n| *n > most_periods) {
            return input(format!("--average {n}: give at most {most_periods}"));
        }
        if !(self.gains.is_empty()
            || self.gains.len() == 2 && self.gains.iter().all(|x| positive(*x)))
        {
            return input("--gains: give two positive numbers, for example 0.1,0.02".into());
        }
        if !(1e-12..=0.1).contains(&self.tolerance) {
            return input(format!("--tolerance {}: give 1e-12 to 0.1", self.tolerance));
        }
        if !(0.0..=0.2).contains(&self.noise) {
            return input(format!("--noise {}: give 0 to 0.2", self.noise));
        }
        match self.omega {
            Some(w) if !positive(w) => input(format!("--omega {w}: give a positive frequency")),
            _ => Ok(()),
        }
    }
}

impl Task for Arguments {
    type Plan = Request;
    type Found = PhaseResonance;

    fn files(&self) -> Files<'_> {
        let read = vec![];
        Files { scene: &self.scene, read, force: self.output.force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "phase-resonance"))
    }

    fn plan(&self, work: &mut Work) -> Result<Request, CliError> {
        self.check()?;
        let (key, range) = over(&self.over)?;
        work.scene = changed_ratio(&work.scene, self.ratio, &key)?;
        let problem = load::warned(&work.scene, work.global)?;
        let problem = family::reduce_if_large(work.global, &mut work.scene, problem)?;
        let scene = &work.scene;
        family::check_forced(
            scene,
            &problem,
            "a test of phase resonance is that of a body under a harmonic load",
        )?;
        let ends = parameters::at_ends(scene, &key, range)?;
        family::check_settle_at(scene, &key, range, &ends)?;
        let mut by = self.sensitivity.clone();
        by.sort();
        by.dedup();
        if !by.is_empty() {
            let [low, _] = &ends;
            parameters::beside_frequency(&scene.with_number(&key, range.0)?, low, &by)?;
        }
        let omega = match self.omega {
            Some(omega) => omega,
            None => {
                let shapes = mode_shapes(&problem.system, &[1]);
                let (_, shapes) =
                    shapes.map_err(|e| CliError::Input(format!("{e}: give --omega")))?;
                shapes[0].omega
            }
        };
        let gains = match self.gains[..] {
            [proportional, integral] => Gains { proportional, integral },
            _ => Gains::of(&family::propagator(problem.system.clone())?, omega),
        };
        let test = Test {
            key,
            range: [range.0, range.1],
            steps: self.steps,
            omega,
            gains: [gains.proportional, gains.integral],
            tolerance: self.tolerance,
            noise: self.noise,
            average: self.average.unwrap_or(match self.noise > 0.0 {
                true => AVERAGE.0.max(AVERAGE.1 * phase_resonance::window(gains)),
                false => 1,
            }),
            seed: self.seed,
            by,
        };
        let fingerprint = fingerprint(scene, &problem);
        let asked = PhaseResonance { test, rows: vec![] };
        let of = (scene, fingerprint);
        let (found, is_whole) =
            begun((work, self.resume), asked, |asked| earlier(&work.path, of, asked))?;
        Ok(Request { problem, fingerprint, found, is_whole })
    }

    fn carry_out(&self, work: &Work, plan: &mut Request) -> Result<PhaseResonance, CliError> {
        if plan.is_whole {
            return Ok(plan.found.clone());
        }
        let (global, options) = (work.global, work.options_again());
        let write = |found: &PhaseResonance, status: &Status| {
            let what = (&work.scene, &plan.problem.system, plan.fingerprint);
            write_resonance(&work.path, what, &options, found, status)
        };
        let mut found = plan.found.clone();
        let mut kept = Kept::begin(work, &write, &found)?;
        let bar = Bar::new(global, &work.scene);
        let mut take = |found: &PhaseResonance| {
            if let (Some(bar), Some(row)) = (&bar, found.rows.last()) {
                let share = found.rows.len() as f64 / (found.test.steps + 1) as f64;
                let text =
                    format!("{} = {:.4}: omega = {:.5}", found.test.key, row.value, row.omega.mean);
                bar.set(share, text);
            }
            kept.step(found)
        };
        let what = (&work.scene, &plan.problem);
        let ends_now = || global.caller.signal().is_some();
        let go = phase_resonance::follow(what, &mut found, (&mut take, &ends_now));
        bar.iter().for_each(Bar::clear);
        let told = format!("{} rows are", found.rows.len());
        kept.end(found, go.map(|go| go.is_continue()), &told)
    }

    fn say(&self, work: &Work, _: &Request, found: PhaseResonance) -> Result<Answer, CliError> {
        Ok(said(work, &found))
    }
}

/// What an earlier run of the same command left.
fn earlier(
    path: &Path,
    of: (&Scene, u64),
    PhaseResonance { test: asked, .. }: &PhaseResonance,
) -> Result<(Head, PhaseResonance), CliError> {
    let stored = read_resonance(path)?;
    let test = &stored.found.test;
    let of_scene = of_scene((&stored.head, stored.problem), of);
    let own = [
        ("another --over", test.key == asked.key && test.range == asked.range),
        ("another --steps", test.steps == asked.steps),
        ("another --omega", test.omega == asked.omega),
        ("other --gains", test.gains == asked.gains),
        ("another --tolerance", test.tolerance == asked.tolerance),
        ("another --average", test.average == asked.average),
        ("another --noise or --seed", (test.noise, test.seed) == (asked.noise, asked.seed)),
        ("another --sensitivity", test.by == asked.by),
    ];
    check_same(path, &[&of_scene[..], &own].concat())?;
    Ok((stored.head, stored.found))
}

/// What a file of a test holds.
pub(super) fn inspect(file: &Path, scene: bool, global: &Global) -> Result<Answer, CliError> {
    let StoredResonance { head, found, .. } = read_resonance(file)?;
    Ok(inspected(global, scene, head, &found))
}

impl Whole for PhaseResonance {
    fn to_json(&self) -> Value {
        let Test { key, range, steps, omega, gains, tolerance, noise, average, seed, by } =
            &self.test;
        let of = |f: &dyn Fn(&ResonanceRow) -> Value| -> Vec<Value> {
            self.rows.iter().map(f).collect()
        };
        let mut json = json!({
            "key": key,
            "range": range,
            "steps": steps,
            "start": omega,
            "gains": gains,
            "tolerance": tolerance,
            "noise": noise,
            "average": average,
            "seed": seed,
            "value": of(&|row| json!(row.value)),
            "locked": of(&|row| json!(row.is_locked)),
            "periods": of(&|row| json!(row.periods)),
            "energy": of(&|row| json!(row.energy)),
            "kinetic": of(&|row| json!(row.kinetic)),
            "damping": of(&|row| json!(row.damping())),
            "note": of(&|row| json!(row.note)),
        });
        for (k, name) in ResonanceRow::READINGS.into_iter().enumerate() {
            json[name] = of(&|row| json!(row.readings()[k].mean)).into();
            json[format!("{name}_error")] = of(&|row| json!(row.readings()[k].error)).into();
        }
        if !by.is_empty() {
            let of_key = |(k, key): (usize, &String)| {
                let mut all = Map::new();
                for (number, name) in Resonance::NAMES.into_iter().enumerate() {
                    let at =
                        |row: &ResonanceRow| json!(row.by.get(k).map(|by| by.numbers()[number]));
                    all.insert(name.into(), of(&at).into());
                }
                (key.clone(), Value::Object(all))
            };
            json["sensitivity"] = Value::Object(by.iter().enumerate().map(of_key).collect());
        }
        json
    }

    fn to_text(&self) -> String {
        let mut out = String::new();
        let test = &self.test;
        let [low, high] = test.range.map(|x| significant(x, 6));
        let locked: Vec<&ResonanceRow> = self.rows.iter().filter(|row| row.is_locked).collect();
        let _ = writeln!(
            out,
            "  {:<14}{} from {low} to {high}, {} rows",
            "values",
            test.key,
            self.rows.len()
        );
        let [proportional, integral] = test.gains.map(|x| significant(x, 3));
        let _ = writeln!(
            out,
            "  {:<14}begun at omega = {}, gains {proportional}, {integral}",
            "loop",
            significant(test.omega, 6)
        );
        if test.noise > 0.0 {
            let _ = writeln!(
                out,
                "  {:<14}off by {}; means of {} periods (seed {})",
                "readings", test.noise, test.average, test.seed
            );
        }
        if let (Some(first), Some(last)) = (locked.first(), locked.last()) {
            let periods = locked.iter().map(|row| row.periods).sum::<usize>() / locked.len();
            let _ = writeln!(
                out,
                "  {:<14}{} of {}, after {periods} periods in the mean",
                "at rest",
                locked.len(),
                self.rows.len()
            );
            let mut row = |name: &str, row: &ResonanceRow| {
                let _ = writeln!(
                    out,
                    "  {name:<14}{} = {}: omega {}{}, amplitude {}{}, damping ratio {}",
                    test.key,
                    significant(row.value, 6),
                    significant(row.omega.mean, 7),
                    plus_minus(row.omega.error),
                    significant(row.amplitude.mean, 6),
                    plus_minus(row.amplitude.error),
                    significant(row.damping(), 4)
                );
            };
            row("first", first);
            row("last", last);
            if !test.by.is_empty() {
                let head = Resonance::NAMES.map(|name| format!("{name:>15}")).concat();
                let _ = writeln!(out, "  {:<14}derivatives at the last{head}", "sensitivity");
            }
            for (key, by) in test.by.iter().zip(&last.by) {
                let cells = by.numbers().map(|x| format!("{:>15}", significant(x, 7))).concat();
                let _ = writeln!(out, "  {:<14}{key:<23}{cells}", "");
            }
        }
        for row in locked.iter().filter(|row| !row.note.is_empty()) {
            let value = significant(row.value, 6);
            let _ = writeln!(out, "  {:<14}{} = {value}: {}", "note", test.key, row.note);
        }
        for row in self.rows.iter().filter(|row| !row.is_locked) {
            let value = significant(row.value, 6);
            let _ = writeln!(out, "  {:<14}{} = {value}: {}", "lost", test.key, row.note);
        }
        out
    }
}

/// Behind a number its error, if there is one.
fn plus_minus(error: f64) -> String {
    if error > 0.0 { format!(" ± {}", significant(error, 2)) } else { String::new() }
}
