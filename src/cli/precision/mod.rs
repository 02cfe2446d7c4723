//! `signorini precision`

mod bench;
mod elsewhere;
mod peer;

use std::path::PathBuf;

use clap::Args;
use indicatif::ProgressBar;
use serde_json::json;

use signorini::event::Options;
use signorini::flow::{Flow, Tolerances};
use signorini::problem::Problem;
use signorini::report::figure::{self, Drawing};
use signorini::report::precision::{Point, Study};
use signorini::scenario::{Integrator, Issue, Scene};
use signorini::simulate::by_name;
use signorini::simulate::run_table;
use signorini::store::{Outputs, beside, replace};

use super::{Answer, CliError, Global, load};
use bench::Bench;
use peer::{OF_MESHES, Peer};

/// Arguments of `precision`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini precision scenarios/plate.toml\n  signorini precision scenarios/plate-half.toml --peer scipy --peer sundials -o half-plate-precision"
)]
pub struct Arguments {
    /// The scene (TOML); its own integrator and tolerances are left aside
    scene: PathBuf,
    /// Beginning of the names of the CSV, SVG, PNG and PDF [default: the scene's name with -precision]
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Overwrite an existing table of signorini's (its pictures are drawn anew in any case)
    #[arg(long)]
    force: bool,
    /// How often each solution is timed (the median counts)
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Solve the same matrices with another program in the same run (can be given more than once); getfem, calculix: the same mesh and data
    #[arg(long, value_enum)]
    peer: Vec<Peer>,
    /// Leave out the Runge–Kutta steppers: the exact flows and the peers alone
    #[arg(long, requires = "peer")]
    peers_only: bool,
}

/// Above this size the reference is the Chebyshev flow.
const MODAL_LIMIT: usize = 1500;

/// Tolerances of the steppers.
const LADDERS: [(Integrator, &[f64]); 2] = [
    (Integrator::Dopri5, &[1e-4, 1e-6, 1e-8, 1e-10]),
    (Integrator::Dop853, &[1e-4, 1e-6, 1e-8, 1e-10, 1e-12]),
];
/// Tolerances of the exact flows.
const TIGHT: Tolerances = Tolerances { rtol: 1e-13, atol: 1e-16 };

/// Which flows take a scene.
#[derive(Clone, Copy)]
struct Able {
    /// Small enough for the modal flow.
    by_modes: bool,
    /// Of the kind that the Chebyshev flow takes.
    without_modes: bool,
    /// Undamped, with conditions at nodes, under constant loads that do not act on contact displacements, without sliders and obstacles behind, as peers want it.
    is_for_peers: bool,
}

impl Able {
    fn of(scene: &Scene, problem: &Problem) -> Result<Self, CliError> {
        let system = &problem.system;
        let is_static = scene.run.as_ref().is_some_and(|r| r.quasistatic);
        if is_static || system.impact().is_some_and(|law| law.march.is_some()) {
            let text =
                "this scene goes through time in its own way: there are no integrators to compare";
            return Err(CliError::Input(text.into()));
        }
        if let Some(i) = scene.loads.iter().position(|l| l.table.is_some()) {
            let message =
                "is a measured history: no exact flow takes it, and there is no reference";
            let help = "take a load with omega; \"signorini run\" holds the tolerance of its Runge-Kutta method (rtol)";
            return Err(scene.error(Issue::new(format!("load[{i}].table"), message, help)).into());
        }
        let without_modes = system.is_entire();
        let rubs = system.tangents();
        let of_contact = system.loads.constant.iter().flat_map(|f| &f[system.n_o()..]);
        // others know the conditions of nodes, in front of them alone
        let is_plain = !system.promise().yields
            && system.impact().is_none()
            && system.gaps().len() == system.conditions().facing();
        let is_for_peers = match rubs {
            _ if !is_plain || system.creeps() || of_contact.into_iter().any(|f| *f != 0.0) => false,
            None => system.is_conservative() && without_modes,
            Some(_) => {
                !(system.is_damped() || system.loads.is_driven() || !system.sliders().is_empty())
            }
        };
        let by_modes = system.n_o() <= MODAL_LIMIT;
        if !by_modes && !without_modes {
            return Err(CliError::Input(format!(
                "{} unknowns are too many for the modal reference, and the Chebyshev flow does not take this body; use a smaller mesh",
                system.n_o()
            )));
        }
        Ok(Able { by_modes, without_modes, is_for_peers })
    }

    /// The flow that all others are compared with.
    fn reference(self) -> Integrator {
        if self.by_modes { Integrator::Modal } else { Integrator::Chebyshev }
    }

    /// What the errors refer to, in words.
    fn name(self) -> String {
        match (self.by_modes, self.without_modes) {
            (true, true) => "the modal flow, its own against chebyshev".into(),
            _ => format!("the {} flow", self.reference().name()),
        }
    }

    /// The exact flows: name, flow, and whether it is timed with what it knows.
    fn exact(self) -> Vec<(&'static str, Integrator, bool)> {
        let mut flows = vec![];
        if self.by_modes {
            flows.push(("modal, cold", Integrator::Modal, false));
            flows.push(("modal, cached", Integrator::Modal, true));
        }
        if self.without_modes {
            flows.push(("chebyshev", Integrator::Chebyshev, false));
        }
        flows.push(("auto, cold", Integrator::Auto, false));
        flows
    }
}

/// Run the study.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let scene = global.scene(&arguments.scene)?;
    let problem = load::warned(&scene, global)?;
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
    let able = Able::of(&scene, problem)?;
    let mut bench = Bench {
        problem,
        options: Options { until, samples: 1, switch_limit: run.switch_limit },
        repeats: arguments.repeats,
        reference: vec![],
        times: vec![],
        omega: problem.system.body.frequency_unit(),
    };
    let bar = if global.quiet || global.caller.desk.is_some() {
        ProgressBar::hidden()
    } else {
        ProgressBar::new_spinner()
    };
    let mut bodies = vec![];
    for peer in arguments.peer.iter().filter(|p| OF_MESHES.contains(p)) {
        bar.set_message(peer.name());
        bar.tick();
        bodies.push(elsewhere::compare(*peer, &bench)?);
    }
    let points = points(&mut bench, problem, able, arguments, &bar)?;
    bar.finish_and_clear();
    let study = Study {
        title: super::title(&scene),
        n_o: problem.system.n_o(),
        reference: able.name(),
        footer: format!("signorini {}, one thread of {}", env!("CARGO_PKG_VERSION"), machine()),
        points,
        bodies,
    };
    let drawing = Drawing { stem, sheet: study.picture()? };
    replace(&csv, study.csv().as_bytes())?;
    let pictures = figure::save(&[drawing], &outputs, &figure::Output::default())?;
    let written: Vec<String> =
        std::iter::once(&csv).chain(&pictures).map(|p| p.display().to_string()).collect();
    Ok(global.answer(
        || json!({"study": study, "written": written}),
        || format!("{}  written: {}\n", study.text(), written.join(", ")),
    ))
}

/// The reference, the steppers, the exact flows and the peer.
fn points(
    bench: &mut Bench,
    problem: &'static Problem,
    able: Able,
    arguments: &Arguments,
    bar: &ProgressBar,
) -> Result<Vec<Point>, CliError> {
    let make = |integrator, tolerances| -> Box<dyn Flow> {
        by_name(integrator, &problem.system, tolerances)
    };
    bar.set_message("reference");
    let report = bench.integrate(make(able.reference(), TIGHT).as_mut())?;
    bench.reference = bench.state(&report.last.u, &report.last.v);
    bench.times = report.switches.iter().map(|s| s.t).collect();
    let mut points = vec![];
    for (integrator, ladder) in LADDERS.iter().filter(|_| !arguments.peers_only).copied() {
        for &rtol in ladder {
            bar.set_message(format!("{} at {rtol:.0e}", integrator.name()));
            bar.tick();
            let tolerances = Tolerances { rtol, atol: 1e-3 * rtol };
            let flow = || make(integrator, tolerances);
            points.push(bench.point(integrator.name(), Some(rtol), false, &flow)?);
        }
    }
    for (name, integrator, warm) in able.exact() {
        bar.set_message(name);
        bar.tick();
        points.push(bench.point(name, None, warm, &|| make(integrator, TIGHT))?);
    }
    judge_reference(&mut points, able);
    for peer in arguments.peer.iter().filter(|p| !OF_MESHES.contains(p)) {
        bar.set_message(peer.name());
        bar.tick();
        if !able.is_for_peers {
            let text = "peers solve undamped scenes of nbm and mass redistribution, under constant loads that do not act on contact displacements, without sliders and gap_behind";
            return Err(CliError::Input(text.into()));
        }
        if *peer == Peer::Diffsol && problem.system.tangents().is_some() {
            return Err(CliError::Input("the peer diffsol knows no friction".into()));
        }
        points.extend(peer.solve(bench)?);
    }
    Ok(points)
}

/// The reference cannot be its own judge: between the exact flows each is the other's.
fn judge_reference(points: &mut [Point], able: Able) {
    let other = points.iter().find(|p| able.by_modes && p.method == "chebyshev");
    let (error, switch_error) = other.map_or((None, None), |p| (p.error, p.switch_error));
    let own = able.reference().name();
    for point in points.iter_mut().filter(|p| p.method.starts_with(own)) {
        (point.error, point.switch_error) = (error, switch_error);
    }
}

/// The processor's name.
pub(super) fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, n)| n.trim().to_owned())
}
