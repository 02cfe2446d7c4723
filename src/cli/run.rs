//! `signorini run`

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use signorini::event::{Grazing, Observer, Outcome, Sample, Switch};
use signorini::report::summary;
use signorini::scenario::Scene;
use signorini::simulate::{SimulateError, run_table, simulate};
use signorini::store::{StoreError, Writer, WriterOptions};

use super::{CliError, Global, load};

/// Arguments of `run`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini run scenarios/plate.toml -o plate.h5\n  signorini run scenarios/plate.toml --json | jq .switches"
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// Where to write the results [default: the scene's name with .h5, in this folder]
    #[arg(short, long, value_name = "OUT.h5")]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
    /// Compare every stored contact solution with enumeration and an interior-point method
    #[arg(long)]
    verify_lcp: bool,
}

/// The writer with a progress bar beside it.
struct Progress {
    writer: Writer,
    bar: Option<ProgressBar>,
    until: f64,
}

const TICKS: f64 = 1000.0;

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
    fn progress(&mut self, t: f64) -> Result<(), StoreError> {
        if let Some(bar) = &self.bar {
            bar.set_position((TICKS * t / self.until) as u64);
        }
        self.writer.progress(t)
    }
}

fn progress_bar(scene: &Scene) -> ProgressBar {
    let style = "{msg} [{bar:30}] {percent:>3} %  {elapsed} elapsed, {eta} left";
    let style =
        ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(TICKS as u64).with_style(style.progress_chars("=> "));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar.with_message(scene.stem())
}

/// Integrate and store.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let start = Instant::now();
    let scene = Scene::read(&arguments.scene)?;
    let (_, until) = run_table(&scene)?;
    let output =
        arguments.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}.h5", scene.stem())));
    let same = |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if same(&output, &arguments.scene) {
        return Err(CliError::Input(format!("-o {} is the scene itself", output.display())));
    }
    Writer::check(&output, arguments.force)?;
    let problem = load::of_scene(&scene)?;
    let command: Vec<String> = std::env::args().collect();
    let options = WriterOptions { force: arguments.force, command: command.join(" ") };
    let writer = Writer::create(&output, &scene, &problem.nbm, &options)?;
    // indicatif draws on standard error, and only on a terminal
    let bar = (!global.quiet).then(|| progress_bar(&scene));
    let mut observer = Progress { writer, bar, until };
    let result = simulate(&scene, &problem, arguments.verify_lcp, &mut observer);
    if let Some(bar) = &observer.bar {
        bar.finish_and_clear();
    }
    let report = match result {
        Ok(report) => report,
        Err(e) => {
            let text = e.to_string();
            // the reason of the failure matters more than a failure to record it
            let _ = observer.writer.finish(&format!("failed: {text}"));
            return Err(match e {
                SimulateError::Scene(e) => e.into(),
                SimulateError::Run(signorini::event::RunError::Observer(e)) => {
                    CliError::Other(format!("writing {}: {e}", output.display()))
                }
                SimulateError::Run(_) => CliError::Numerics(text),
            });
        }
    };
    let status = match report.outcome.is_complete() {
        true => "complete".to_owned(),
        false => format!("failed: {}", report.outcome),
    };
    observer.writer.finish(&status)?;
    let wall = start.elapsed().as_secs_f64();
    global.print(
        || {
            let mut json = summary::run_json(&scene, &problem.nbm, &report, wall);
            json["output"] = output.display().to_string().into();
            json
        },
        || {
            let title = if scene.title.is_empty() { scene.stem() } else { scene.title.clone() };
            let text = summary::run_text(&scene, &problem.nbm, &report, wall);
            let plot = format!("signorini plot {}", output.display());
            format!(
                "{title}\n{text}  {:<14}{} (pictures: {plot})\n",
                "written to",
                output.display()
            )
        },
    );
    if report.outcome.is_complete() {
        return Ok(());
    }
    let advice = match report.outcome {
        Outcome::Accumulation { .. } => {
            "\n  a node that opens and closes without end has, as a rule, no equilibrium in either state: loads at the \
             contact edge on a coarse mesh do that. Refine the mesh towards the edge, or move the load off it"
        }
        Outcome::Flow(_) => "\n  try the integrator \"modal\", or a larger rtol",
        _ => "",
    };
    Err(CliError::Reported(format!(
        "{}; everything up to t = {} is in {}{advice}",
        report.outcome,
        summary::significant(report.t_end, 10),
        output.display()
    )))
}
