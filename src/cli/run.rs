//! `signorini run`

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde_json::Value;

use signorini::continuation::Go;
use signorini::event::{
    Checkpoint, Grazing, Observer, Outcome, Report, Resumed, RunError, Sample, Switch,
};
use signorini::orbit::lyapunov::Asked;
use signorini::problem::Problem;
use signorini::records::{Status, fingerprint};
use signorini::report::summary;
use signorini::scenario::Scene;
use signorini::simulate::{SimulateError, go_on, run_table, simulate};
use signorini::store::{Background, Kept, StoreError, Stored, Writer};

use super::caller::Caller;
use super::progress::Bar;
use super::seen::seen;
use super::task::{Files, Task, Work};
use super::{Answer, CliError, Global, load, lyapunov, resources};

/// Arguments of `run`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini run scenarios/plate.toml -o plate.h5\n  signorini run scenarios/plate.toml --json | jq .switches\n  signorini run scenarios/plate.toml -o plate.h5 --resume\n  signorini run scenarios/driven-stop.toml --lyapunov 2 -o stop.h5"
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// Where to write the results [default: the scene's name with .h5, in this folder]
    #[arg(short, long, value_name = "OUT.h5")]
    output: Option<PathBuf>,
    /// Overwrite an existing file of signorini's
    #[arg(long)]
    force: bool,
    /// Go on with an interrupted run from its last flushed state
    #[arg(long)]
    resume: bool,
    /// Compare every stored contact solution with enumeration and an interior-point method
    #[arg(long)]
    verify_lcp: bool,
    #[command(flatten)]
    lyapunov: lyapunov::Arguments,
}

/// The writer with a progress bar beside it; a signal ends the run where its file is whole.
struct Progress {
    writer: Background,
    bar: Option<Bar>,
    until: f64,
    caller: Caller,
    /// Whether the answer lists the switches.
    lists: bool,
}

impl Observer for Progress {
    type Error = StoreError;
    fn sample(&mut self, s: &Sample) -> Result<(), StoreError> {
        self.writer.sample(s)
    }
    fn switch(&mut self, s: &Switch) -> Result<(), StoreError> {
        self.writer.switch(s)
    }
    fn grazing(&mut self, g: &Grazing) -> Result<(), StoreError> {
        self.writer.grazing(g)
    }
    fn takes_events(&self) -> bool {
        !self.lists
    }
    fn progress(&mut self, t: f64) -> Result<Go, StoreError> {
        if let Some(bar) = &self.bar {
            bar.set(t / self.until, String::new());
        }
        let go = self.writer.progress(t)?;
        Ok(if self.caller.signal().is_some() { Go::Break(()) } else { go })
    }
    fn sees_contact_alone(&self) -> bool {
        self.writer.sees_contact_alone()
    }
    fn takes_accelerations(&self) -> bool {
        self.writer.takes_accelerations()
    }
    fn keeps_checkpoints(&self) -> bool {
        self.writer.keeps_checkpoints()
    }
    fn phase(&mut self, checkpoint: Checkpoint) {
        self.writer.phase(checkpoint);
    }
}

/// What is asked for, checked.
pub(crate) struct Request {
    problem: Problem,
    until: f64,
    /// Exponents that are wanted besides.
    exponents: Option<Asked>,
    /// Fingerprint of what is integrated; 0 where it is not gone on with.
    id: u64,
    /// The file holds it all.
    is_whole: bool,
}

impl Task for Arguments {
    type Plan = Request;
    /// The report, what there is to say of it, and the time from which an interrupted run was gone on with; none: there was nothing to do.
    type Found = Option<(Report, Value, Option<f64>)>;

    fn files(&self) -> Files<'_> {
        Files { scene: &self.scene, read: vec![], force: self.force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        run_table(scene)?;
        Ok(self.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}.h5", scene.stem()))))
    }

    fn plan(&self, work: &mut Work) -> Result<Request, CliError> {
        let (scene, output) = (&work.scene, &work.path);
        let (_, until) = run_table(scene)?;
        let problem = load::of_scene(scene)?;
        if self.verify_lcp && problem.system.creeps() {
            let text = "--verify-lcp: where displacements along the obstacle have no mass (tangent = \"massless\"), what sticks is part of the contact problem, which enumeration and interior points do not know here: leave it out";
            return Err(CliError::Input(text.into()));
        }
        let exponents = self.lyapunov.asked(scene, &problem)?;
        // a file that is read at once and thrown away is not gone on with
        let id = if work.options.is_scratch { 0 } else { fingerprint(scene, &problem) };
        let stands = work.resume && output.exists() && !Writer::is_interrupted(output);
        let is_whole = stands && is_whole(scene, id, output)?;
        if stands && !is_whole {
            // cut off before its first checkpoint: there is nothing to lose
            work.options.outputs = work.options.outputs.with_force(true);
        }
        Ok(Request { problem, until, exponents, id, is_whole })
    }

    fn carry_out(&self, work: &Work, plan: &mut Request) -> Result<Self::Found, CliError> {
        let Work { global, scene, path: output, .. } = work;
        let Request { problem, until, exponents, id, is_whole } = &*plan;
        if *is_whole {
            if exponents.is_some() {
                let text = format!(
                    "{} is complete, and exponents begin where a run ends: give --force for both anew",
                    output.display()
                );
                return Err(CliError::Input(text));
            }
            Writer::tidy(output);
            return Ok(None);
        }
        resources::check_run(global, scene, problem, *until, output)?;
        global.caller.watch();
        let system = &problem.system;
        let (mut writer, resumed) = match work.resume && Writer::is_interrupted(output) {
            true => {
                let how = (*id, global.json);
                let (writer, resumed) = Writer::resume(output, scene, system, &work.options, how)?;
                (writer, Some(resumed))
            }
            false => {
                let kept = Kept::of_run(scene, system);
                (Writer::create(output, scene, (system, kept), &work.options)?, None)
            }
        };
        writer.keep_checkpoints(*id)?;
        let from = resumed.as_ref().map(|r| r.checkpoint.t);
        let (writer, bar) = (Background::new(writer), Bar::new(global, scene));
        let (caller, lists) = (global.caller.clone(), global.json);
        let progress = Progress { writer, bar, until: *until, caller, lists };
        let how = (progress, work.begun());
        let what = (problem, self.verify_lcp, exponents.as_ref());
        let (report, object) = integrate(global, scene, what, resumed, how)?;
        if let (Some(asked), Some(signal)) = (exponents, global.caller.signal())
            && report.outcome.is_complete()
        {
            let done = object["lyapunov"]["periods"].as_u64().unwrap_or(0);
            let text = format!(
                "interrupted; the run is whole in {}, its exponents are those of {done} of {} periods",
                output.display(),
                asked.periods
            );
            return Err(CliError::Interrupted(signal, text));
        }
        if let (Outcome::Interrupted { t }, Some(signal)) =
            (&report.outcome, global.caller.signal())
        {
            let text = format!(
                "interrupted at t = {} of {}; everything up to there is in {}: go on with the same command and --resume",
                summary::significant(*t, 7),
                summary::significant(*until, 7),
                output.display()
            );
            return Err(CliError::Interrupted(signal, text));
        }
        Ok(Some((report, object, from)))
    }

    fn say(&self, work: &Work, plan: &Request, found: Self::Found) -> Result<Answer, CliError> {
        let Some((report, object, from)) = found else {
            return Ok(nothing_left(&work.path, work.global));
        };
        let problem = &plan.problem;
        let answer = answer(work, problem, (&report, &object), from);
        Ok(match report.outcome.is_complete() {
            true => answer,
            false => {
                answer.failed(ended_early(&report, problem.system.impact().is_some(), &work.path))
            }
        })
    }
}

/// Integrate from the start or from where an earlier run was interrupted, and end the file with how that went: the report, and what there is to say
/// of it as an object.
fn integrate(
    global: &Global,
    scene: &Scene,
    (problem, verify, exponents): (&Problem, bool, Option<&Asked>),
    resumed: Option<Resumed>,
    (mut progress, begun): (Progress, Instant),
) -> Result<(Report, Value), CliError> {
    let result = match resumed {
        None => simulate(scene, problem, verify, &mut progress),
        Some(resumed) => go_on(scene, problem, verify, resumed, &mut progress),
    };
    if let Some(bar) = &progress.bar {
        bar.clear();
    }
    let at = progress.writer.at().to_owned();
    let report = match result {
        Ok(report) => report,
        Err(SimulateError::Run(RunError::Observer(e))) => {
            let kept = "everything up to the last flush is in";
            let text = format!("{e}\n  {kept} {}", at.display());
            return Err(match CliError::from(e) {
                CliError::Input(_) => CliError::Input(text),
                _ => CliError::Other(text),
            });
        }
        Err(e) => {
            let text = e.to_string();
            // the reason of the failure matters more than a failure to record it
            let _ = progress.writer.end().map(|w| w.finish(&Status::Failed(text.clone())));
            return Err(match e {
                SimulateError::Scene(e) => e.into(),
                SimulateError::Run(_) => CliError::Numerics(text),
            });
        }
    };
    let wall = begun.elapsed().as_secs_f64();
    let mut object = summary::run_json(scene, (&problem.system, &problem.notes), &report, wall);
    let status = match report.outcome {
        Outcome::EndTime => Status::Complete,
        Outcome::Interrupted { .. } => Status::Interrupted,
        _ => Status::Failed(report.outcome.to_string()),
    };
    let mut writer = progress.writer.end()?;
    // the run stands whatever becomes of its exponents
    let mut found = Ok(None);
    // an interrupted run is not over
    if status != Status::Interrupted {
        for (name, value) in seen(&mut writer, &problem.system)? {
            object[name] = value;
        }
        let excursions = writer.excursions()?;
        if let Some(warnings) = object["warnings"].as_array_mut() {
            warnings.extend(summary::too_far(&excursions).into_iter().map(Value::from));
        }
        object["excursions"] = serde_json::to_value(excursions).unwrap_or_default();
        if let Some(asked) = exponents.filter(|_| report.outcome.is_complete()) {
            found = lyapunov::found(global, scene, &problem.system, &report.last, asked);
            if let Ok(Some(found)) = &found {
                object["lyapunov"] = lyapunov::to_json(found);
                writer.lyapunov(found)?;
            }
        }
        writer.report(&object)?;
        if let Some(rubbed) = &report.rubbed {
            writer.friction(&problem.system, rubbed)?;
        }
    }
    writer.finish(&status)?;
    found.map(|_| (report, object))
}

/// What there is to say of a run; `from`: the time from which an interrupted one was gone on with.
fn answer(
    work: &Work,
    problem: &Problem,
    (report, object): (&Report, &Value),
    from: Option<f64>,
) -> Answer {
    let (scene, output, wall) = (&work.scene, &work.path, work.wall());
    work.global.answer(
        || {
            let mut json = object.clone();
            json["wall_s"] = wall.into();
            json["output"] = output.display().to_string().into();
            if let Some(t) = from {
                json["resumed_from"] = t.into();
            }
            json
        },
        || {
            let title = super::title(scene);
            let about = (&problem.system, &problem.notes);
            let text = summary::run_text(scene, about, (report, object), wall);
            let plot = format!("signorini plot {}", output.display());
            let from = from.map_or(String::new(), |t| {
                let t = summary::significant(t, 7);
                format!("  {:<14}from t = {t} of an interrupted run\n", "gone on")
            });
            let exponents = object.get("lyapunov").map_or(String::new(), lyapunov::to_text);
            format!(
                "{title}\n{text}{exponents}{from}  {:<14}{} (pictures: {plot})\n",
                "written to",
                output.display()
            )
        },
    )
}

/// Why a run did not reach its end time, with advice.
fn ended_early(report: &Report, has_impacts: bool, output: &Path) -> String {
    let advice = match report.outcome {
        Outcome::Accumulation { .. } if has_impacts => {
            "\n  rebounds that die out come to rest within that number: these points are thrown back at the obstacle ever anew. Look at \
             /switches, give another restitution, or a larger run.switch_limit"
        }
        Outcome::Accumulation { .. } => {
            "\n  a node that opens and closes without end has, as a rule, no equilibrium in either state: loads at the \
             contact edge on a coarse mesh do that. Refine the mesh towards the edge, or move the load off it"
        }
        Outcome::Unresolved { .. } => {
            "\n  neither touching nor apart goes on from there under this discretisation: stress = \"reaction\" with inertia = \"constant\", or \
             method = \"mass-redistribution\", always have a continuation without friction; with friction begin with a pressure (initial.equilibrium)"
        }
        Outcome::Rests { .. } => {
            "\n  give a faster contact.surface, or a smaller motion; what was computed until there holds"
        }
        Outcome::Flow(_) => "\n  try another integrator (\"dop853\", \"modal\"), or a larger rtol",
        _ => "",
    };
    format!(
        "{}; everything up to t = {} is in {}{advice}",
        report.outcome,
        summary::significant(report.t_end, 10),
        output.display()
    )
}

/// Whether the run that stands there and cannot be gone on with is whole; if not, it ended before there was anything to go on with.
fn is_whole(scene: &Scene, problem: u64, output: &Path) -> Result<bool, CliError> {
    let stored = Stored::read(output)?;
    let refuse = |why: &str| {
        let text =
            format!("{} cannot be gone on with: {why}; --force starts anew", output.display());
        Err(CliError::Input(text))
    };
    if stored.scene != scene.source.text {
        return refuse("it was made from another scene");
    }
    match stored.status {
        Status::Complete if Writer::problem_of(output) == Some(problem) => Ok(true),
        Status::Complete => refuse(
            "a file that the scene names has changed since, or another version of signorini made it",
        ),
        Status::Interrupted | Status::Running => Ok(false),
        other => refuse(&format!("its status is \"{other}\", and it has no checkpoint")),
    }
}

fn nothing_left(output: &Path, global: &Global) -> Answer {
    global.answer(
        || serde_json::json!({"output": output.display().to_string(), "status": "complete"}),
        || format!("{} is complete: nothing is left to do\n", output.display()),
    )
}
