//! `signorini precision`

use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use clap::{Args, ValueEnum};
use indicatif::ProgressBar;
use serde_json::{Value, json};

use signorini::contact::ActiveSet;
use signorini::event::{self, Options, Report, Silent};
use signorini::flow::{Flow, Tolerances};
use signorini::problem::Problem;
use signorini::report::figure::{self, Drawing};
use signorini::report::precision::{Point, Study};
use signorini::scenario::Integrator;
use signorini::simulate::by_name;
use signorini::simulate::run_table;
use signorini::store::{Outputs, beside, replace, write_problem};

use super::{CliError, Global, load};

/// Arguments of `precision`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini precision scenarios/plate.toml\n  signorini precision scenarios/plate-half.toml --peer scipy -o half-plate-precision"
)]
pub struct Arguments {
    /// The scene (TOML); its own integrator and tolerances are left aside
    scene: PathBuf,
    /// Beginning of the names of the CSV, SVG and PNG [default: the scene's name with -precision]
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Overwrite an existing table of signorini's (its pictures are drawn anew in any case)
    #[arg(long)]
    force: bool,
    /// How often each solution is timed (the median counts)
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Solve the same matrices with another program in the same run
    #[arg(long, value_enum)]
    peer: Option<Peer>,
}

/// Other programs.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Peer {
    /// SciPy's solve_ivp (RK45 and DOP853) with events; needs Python with validate/peers/requirements.txt
    /// (the interpreter is SIGNORINI_PYTHON, .venv/bin/python or python3)
    Scipy,
}

/// Above this size the reference is the Chebyshev flow.
const MODAL_LIMIT: usize = 1500;

struct Bench<'a> {
    problem: &'a Problem,
    options: Options,
    repeats: u32,
    reference: Vec<f64>,
    times: Vec<f64>,
    omega: f64,
}

impl Bench<'_> {
    fn state(&self, u: &[f64], v: &[f64]) -> Vec<f64> {
        u.iter().copied().chain(v.iter().map(|v| v / self.omega)).collect()
    }

    fn integrate(&self, flow: &mut dyn Flow) -> Result<Report, CliError> {
        let report = event::run(
            &self.problem.system,
            &self.problem.initial,
            &self.options,
            flow,
            &mut Silent,
        )
        .map_err(|e| CliError::Numerics(e.to_string()))?;
        match report.outcome.is_complete() {
            true => Ok(report),
            false => Err(CliError::Numerics(report.outcome.to_string())),
        }
    }

    fn error(&self, state: &[f64]) -> f64 {
        let square = |x: f64| x * x;
        let distance: f64 = state.iter().zip(&self.reference).map(|(a, b)| square(a - b)).sum();
        (distance / self.reference.iter().map(|&b| square(b)).sum::<f64>()).sqrt()
    }

    fn switch_error(&self, times: &[f64]) -> Option<f64> {
        let same = times.len() == self.times.len();
        let distance = times.iter().zip(&self.times).map(|(a, b)| (a - b).abs());
        same.then(|| distance.fold(0.0, f64::max) / self.options.until)
    }

    /// Time a flow made anew for each repeat, or (`warm`) one that keeps what it knows.
    fn point(
        &self,
        name: &str,
        rtol: Option<f64>,
        warm: bool,
        make: &dyn Fn() -> Box<dyn Flow + 'static>,
    ) -> Result<Point, CliError>
    where
        Self: Sized,
    {
        let mut walls = vec![];
        let mut flow = make();
        let mut before = 0;
        let mut report = None;
        if warm {
            self.integrate(flow.as_mut())?;
        }
        for _ in 0..self.repeats {
            if !warm {
                flow = make();
            }
            let counters = flow.counters();
            before = counters.rhs_evaluations + counters.products;
            let start = Instant::now();
            report = Some(self.integrate(flow.as_mut())?);
            walls.push(start.elapsed().as_secs_f64());
        }
        walls.sort_by(f64::total_cmp);
        let report = report.ok_or_else(|| CliError::Other("no repeat was run".into()))?;
        let times: Vec<f64> = report.switches.iter().map(|s| s.t).collect();
        Ok(Point {
            method: name.to_owned(),
            rtol,
            error: Some(self.error(&self.state(&report.last.u, &report.last.v))),
            switch_error: self.switch_error(&times),
            switches: times.len(),
            wall_s: walls[walls.len() / 2],
            work: report.counters.rhs_evaluations + report.counters.products - before,
        })
    }
}

/// Run the study.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let (scene, problem) = load::problem(&arguments.scene)?;
    let (run, until) = run_table(&scene)?;
    let stem = arguments
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}-precision", scene.stem())));
    let outputs =
        Outputs::new(arguments.force).reads(scene.source.file.clone()).reads_all(scene.files());
    let csv = beside(&stem, ".csv");
    for path in [&csv, &beside(&stem, ".svg"), &beside(&stem, ".png")] {
        outputs.check_derived(path)?;
    }
    // flows borrow the problem for as long as the program runs
    let problem: &'static Problem = Box::leak(Box::new(problem));
    let system = &problem.system;
    let conservative = system.damping.is_none() && system.loads.harmonics.is_empty();
    let options = Options { until, samples: 1, switch_limit: run.switch_limit };
    let mut bench = Bench {
        problem,
        options,
        repeats: arguments.repeats,
        reference: vec![],
        times: vec![],
        omega: system.body.frequency_unit(),
    };
    let by_modes = system.n_o() <= MODAL_LIMIT;
    if !by_modes && !conservative {
        return Err(CliError::Input(format!(
            "{} unknowns with damping or harmonic loads are too many for the modal reference; use a smaller mesh",
            system.n_o()
        )));
    }
    let exact = if by_modes { Integrator::Modal } else { Integrator::Chebyshev };
    let tight = Tolerances { rtol: 1e-13, atol: 1e-16 };
    let make = |integrator, tolerances| by_name(integrator, system, tolerances);
    let bar = if global.quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
    bar.set_message("reference");
    let report = bench.integrate(make(exact, tight).as_mut())?;
    bench.reference = bench.state(&report.last.u, &report.last.v);
    bench.times = report.switches.iter().map(|s| s.t).collect();

    let mut points = vec![];
    let ladders: [(Integrator, &[f64]); 2] = [
        (Integrator::Dopri5, &[1e-4, 1e-6, 1e-8, 1e-10]),
        (Integrator::Dop853, &[1e-4, 1e-6, 1e-8, 1e-10, 1e-12]),
    ];
    for (integrator, ladder) in ladders {
        for &rtol in ladder {
            bar.set_message(format!("{} at {rtol:.0e}", integrator.name()));
            bar.tick();
            let tolerances = Tolerances { rtol, atol: 1e-3 * rtol };
            let flow = || make(integrator, tolerances);
            points.push(bench.point(integrator.name(), Some(rtol), false, &flow)?);
        }
    }
    let mut exact_flows = vec![];
    if by_modes {
        exact_flows.push(("modal, cold", Integrator::Modal, false));
        exact_flows.push(("modal, cached", Integrator::Modal, true));
    }
    if conservative {
        exact_flows.push(("chebyshev", Integrator::Chebyshev, false));
    }
    for (name, integrator, warm) in exact_flows {
        bar.set_message(name);
        bar.tick();
        points.push(bench.point(name, None, warm, &|| make(integrator, tight))?);
    }
    // the reference cannot be its own judge: between the exact flows each is the other's
    let own = if by_modes { "modal" } else { "chebyshev" };
    let other = points.iter().find(|p| by_modes && p.method == "chebyshev");
    let (error, switch_error) = other.map_or((None, None), |p| (p.error, p.switch_error));
    for point in points.iter_mut().filter(|p| p.method.starts_with(own)) {
        (point.error, point.switch_error) = (error, switch_error);
    }
    if let Some(Peer::Scipy) = arguments.peer {
        bar.set_message("SciPy");
        bar.tick();
        if !conservative {
            return Err(CliError::Input(
                "the peer solves undamped scenes under constant loads".into(),
            ));
        }
        points.extend(scipy(&bench)?);
    }
    bar.finish_and_clear();
    let study = Study {
        title: super::title(&scene),
        n_o: system.n_o(),
        reference: match (by_modes, conservative) {
            (true, true) => "the modal flow, its own against chebyshev".into(),
            _ => format!("the {} flow", exact.name()),
        },
        footer: format!("signorini {}, one thread of {}", env!("CARGO_PKG_VERSION"), machine()),
        points,
    };
    let drawing = Drawing { stem, svg: study.picture()? };
    replace(&csv, study.csv().as_bytes())?;
    let pictures = figure::save(&[drawing], &outputs, figure::DPI)?;
    let written: Vec<String> =
        std::iter::once(&csv).chain(&pictures).map(|p| p.display().to_string()).collect();
    global.print(
        || json!({"study": study, "written": written}),
        || format!("{}  written: {}\n", study.text(), written.join(", ")),
    )
}

/// The processor's name.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, n)| n.trim().to_owned())
}

/// SciPy on the same matrices.
fn scipy(bench: &Bench) -> Result<Vec<Point>, CliError> {
    let system = &bench.problem.system;
    let file = std::env::temp_dir().join(format!("signorini-peer-{}.h5", std::process::id()));
    let start = system
        .select(0.0, &bench.problem.initial.u, &ActiveSet::open(system.n_contact()))
        .map_err(|e| CliError::Numerics(e.to_string()))?;
    write_problem(&file, bench.problem, &start.set, bench.options.until)?;
    let local = PathBuf::from(".venv/bin/python");
    let python = match std::env::var_os("SIGNORINI_PYTHON") {
        Some(p) => PathBuf::from(p),
        None if local.exists() => local,
        None => PathBuf::from("python3"),
    };
    let output = Command::new(&python)
        .env("OMP_NUM_THREADS", "1")
        .env("OPENBLAS_NUM_THREADS", "1")
        .arg("-c")
        .arg(include_str!("../../validate/peers/scipy_peer.py"))
        .arg(&file)
        .arg(bench.repeats.to_string())
        .output();
    // a temporary file that cannot be removed is no reason to fail
    let _ = std::fs::remove_file(&file);
    let output = output.map_err(|e| CliError::Other(format!("{}: {e}", python.display())))?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let last = text.lines().last().unwrap_or("no message");
        let advice = "install its requirements: pip install -r validate/peers/requirements.txt";
        return Err(CliError::Other(format!("the SciPy peer failed: {last}; {advice}")));
    }
    let numbers = |v: &Value| -> Vec<f64> {
        v.as_array().map_or(vec![], |a| a.iter().filter_map(Value::as_f64).collect())
    };
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines()
        .map(|l| {
            let v: Value = serde_json::from_str(l)
                .map_err(|e| CliError::Other(format!("the SciPy peer answered {l}: {e}")))?;
            let times = numbers(&v["switches"]);
            Ok(Point {
                method: format!("scipy {}", v["method"].as_str().unwrap_or("?")),
                rtol: v["rtol"].as_f64(),
                error: Some(bench.error(&bench.state(&numbers(&v["u"]), &numbers(&v["v"])))),
                switch_error: bench.switch_error(&times),
                switches: times.len(),
                wall_s: v["wall_s"].as_f64().unwrap_or(f64::NAN),
                work: v["nfev"].as_u64().unwrap_or(0),
            })
        })
        .collect()
}
