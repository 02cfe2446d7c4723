//! `signorini orbit`

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde_json::{Value, json};

use signorini::contact::State;
use signorini::event::{self, Options, RunError};
use signorini::families::start;
use signorini::orbit::search::{Effort, Verdict, find};
use signorini::orbit::{Closure, Orbit, Propagator, branch, period_map};
use signorini::records::Status;
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::{self, Writer, WriterOptions};

use super::family::{self, Output};
use super::progress::Bar;
use super::{CliError, Global, load};

/// Arguments of `orbit`.
#[derive(Debug, Args)]
#[command(
    after_help = "The guess is the scene's initial state; without one, the first mode of the open body beyond grazing.\n\n\
    Example:\n  signorini orbit scenarios/half-plate-orbit.toml --omega 1.8 -o orbit.h5\n  signorini orbit scenarios/half-plate-orbit.toml --omega 1.8 --all\n  signorini plot orbit.h5"
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// Circular frequency [default: that of the scene]
    #[arg(long, value_name = "W", conflicts_with = "period", allow_negative_numbers = true)]
    omega: Option<f64>,
    /// Period instead
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    period: Option<f64>,
    /// All different orbits that a set of starts leads to
    #[arg(long)]
    all: bool,
    /// With --all: number of amplitudes of the first mode to start from
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1000))]
    amplitudes: u32,
    /// With --all: largest of these amplitudes, over grazing
    #[arg(long, default_value_t = 4.0, value_name = "A", allow_negative_numbers = true)]
    largest: f64,
    /// Start from the first mode of the open body at this amplitude over grazing (negative: away from the obstacle), in place of the
    /// scene's initial state
    #[arg(long, value_name = "A", allow_negative_numbers = true, conflicts_with = "near_return")]
    amplitude: Option<f64>,
    /// Start from the best near-return of a stored trajectory (which also gives the period, unless one is given)
    #[arg(long, value_name = "RUN.h5")]
    near_return: Option<PathBuf>,
    /// Shoot over the whole period with a phase condition, even where half of it would do
    #[arg(long)]
    full: bool,
    #[command(flatten)]
    output: Output,
}

/// One orbit, or all that can be found.
pub fn run(arguments: &Arguments, global: &Global) -> Result<(), CliError> {
    let begun = Instant::now();
    let scene = Scene::read(&arguments.scene)?;
    let path = arguments.output.path(&scene, "orbit");
    let near: Vec<&std::path::Path> = arguments.near_return.iter().map(|p| p.as_path()).collect();
    let mut options = WriterOptions::default();
    if !arguments.all {
        options = arguments.output.rules(&scene, &path, false, &near)?;
    } else if arguments.output.output.is_some() || arguments.amplitude.is_some() {
        let message = "--all writes no file and has its own starts: leave out -o and --amplitude, then shoot the orbit you want \
                       with --amplitude or [initial]";
        return Err(CliError::Input(message.into()));
    }
    if arguments.amplitude.is_some_and(|a| !is_amplitude(a.abs())) {
        let message = "--amplitude: give a finite number that is not zero, in multiples of grazing";
        return Err(CliError::Input(message.into()));
    }
    if !(is_amplitude(arguments.largest) && arguments.largest > 1.0) {
        let message = "--largest: give a number above 1: the amplitudes go from grazing up to it";
        return Err(CliError::Input(message.into()));
    }
    let mut problem = load::of_scene(&scene)?;
    let mut near_period = None;
    if let Some(file) = &arguments.near_return {
        let (period, state) = near_return(file, &scene, &problem.system)?;
        near_period = Some(period);
        problem.initial = state;
    }
    let mut closure = start::closure(&scene, &problem)?;
    if arguments.full && closure == Closure::Reversible {
        closure = Closure::Autonomous;
    }
    let period = arguments.period.or(near_period.filter(|_| arguments.omega.is_none()));
    let omega = family::omega(&scene, arguments.omega, period)?;
    family::check_frequency(&problem, omega)?;
    let initial = problem.initial.clone();
    let mut body = family::propagator(problem.system)?;
    body.system.loads_mut().set_frequency(omega);
    if arguments.all {
        let own = start::guesses(&scene, &initial, &body, closure);
        return all(arguments, global, &scene, &mut body, (closure, omega), own, begun);
    }
    let mut guesses = start::guesses(&scene, &initial, &body, closure);
    if arguments.near_return.is_some() {
        let unknowns = closure.unknowns(body.n());
        guesses = vec![body.frame(&initial)[..unknowns].to_vec()];
    }
    if let Some(amplitude) = arguments.amplitude {
        let mut guess = branch::mode_guess(&body, 1, amplitude).ok_or_else(|| {
            CliError::Input("--amplitude: the first mode never reaches the obstacle".into())
        })?;
        guess.resize(closure.unknowns(body.n()), 0.0);
        guesses = vec![guess];
    }
    let mut verdict: Option<Verdict> = None;
    for guess in &guesses {
        let effort = Effort { rescue: guesses.len() == 1, ..Effort::default() };
        let found = find(&mut body, closure, guess, omega, &effort)?;
        if found.orbit().is_some() {
            verdict = Some(found);
            break;
        }
    }
    let verdict = match verdict {
        Some(found) => found,
        // the search for the cause, from the first guess
        None => find(&mut body, closure, &guesses[0], omega, &Effort::default())?,
    };
    let Verdict::Orbit(orbit) = &verdict else {
        global.print(|| failure_json(&verdict, omega), String::new)?;
        let advice = "try another frequency, another [initial] guess, or --all";
        return Err(CliError::Reported(format!(
            "no orbit at omega = {omega}: {verdict}\n  {advice}"
        )));
    };
    write(&path, &options, &scene, &body, orbit)?;
    let wall = begun.elapsed().as_secs_f64();
    global.print(
        || {
            let mut json = orbit_json(&body, orbit);
            json["wall_s"] = wall.into();
            json["output"] = path.display().to_string().into();
            json
        },
        || {
            let title = super::title(&scene);
            let plot = format!("signorini plot {}", path.display());
            format!(
                "{title}\n{}  {:<14}{wall:.3} s\n  {:<14}{} (pictures: {plot})\n",
                orbit_text(orbit),
                "time",
                "written to",
                path.display()
            )
        },
    )
}

/// Amplitudes that a motion can have, over grazing.
fn is_amplitude(a: f64) -> bool {
    a > 0.0 && a <= 1e6
}

fn failure_json(verdict: &Verdict, omega: f64) -> Value {
    let mut json = json!({
        "status": "failed", "converged": false, "omega": omega, "verdict": verdict.word(), "message": verdict.to_string(),
    });
    match verdict {
        Verdict::Fold { omega, energy, switches, singular_value } => {
            json["fold"] = json!({"omega": omega, "energy": energy, "switches": switches, "singular_value": singular_value});
        }
        Verdict::Grazing { omega, what } => json["grazing"] = json!({"omega": omega, "what": what}),
        Verdict::NotFound { residual, .. } => json["residual"] = json!(residual),
        _ => {}
    }
    json
}

fn orbit_json(body: &Propagator, o: &Orbit) -> Value {
    let switches: Vec<Value> = o
        .switches
        .iter()
        .map(|s| json!({"t": s.t, "node": s.node, "kind": s.kind.name(), "energy_jump": s.energy_jump}))
        .collect();
    let stability = o.stability.as_ref();
    json!({
        "converged": true, "admissible": o.is_admissible(), "period": o.period, "omega": o.omega(), "energy": o.energy,
        "amplitude": o.amplitude, "residual": o.residual, "newton_iterations": o.iterations, "switches": switches,
        "contact_time": o.contact_time, "penetration": o.penetration, "tension": o.tension, "energy_balance": o.balance,
        "grazing_distance": o.grazing, "n_o": body.n(),
        "multipliers": stability.map(|s| s.multipliers.iter().map(|m| [m.0, m.1]).collect::<Vec<_>>()),
        "trivial_multipliers": stability.map(|s| s.trivial), "largest_multiplier": stability.map(|s| s.largest),
        "stable": stability.map(|s| s.is_stable()), "stability_lost_by": stability.and_then(|s| s.lost_by()),
        "u0": o.state.u, "v0": o.state.v,
    })
}

fn stability_text(o: &Orbit) -> String {
    let Some(s) = &o.stability else {
        return format!(
            "not computed above {} displacements",
            signorini::orbit::credentials::MULTIPLIER_LIMIT
        );
    };
    let size = significant(s.largest, 8);
    let trivial =
        if s.trivial > 0 { " besides the two at +1 that every orbit of a family has" } else { "" };
    match s.lost_by() {
        None => format!("stable: all multipliers within the unit circle (largest {size}{trivial})"),
        Some(by) => {
            let [above, below, complex] = s.outside;
            format!(
                "unstable by {by}: largest multiplier {size}{trivial}; outside the unit circle {above} real above +1, {below} real below -1, {complex} complex"
            )
        }
    }
}

fn orbit_text(o: &Orbit) -> String {
    let mut out = String::new();
    let mut line = |label: &str, text: String| {
        let _ = writeln!(out, "  {label:<14}{text}");
    };
    line(
        "orbit",
        format!("omega = {}, period {}", significant(o.omega(), 10), significant(o.period, 10)),
    );
    line(
        "energy",
        format!(
            "{} at most; largest contact displacement {}",
            significant(o.energy, 10),
            significant(o.amplitude, 7)
        ),
    );
    line(
        "residual",
        format!(
            "{:.1e} after a period of the event-driven integrator, {} Newton steps",
            o.residual, o.iterations
        ),
    );
    line(
        "contact",
        format!(
            "{} switches; touches during {} of the period; {:.1e} from grazing",
            o.switches.len(),
            significant(o.contact_time / o.period, 4),
            o.grazing
        ),
    );
    line(
        "admissible",
        format!(
            "penetration {:.1e}, tension {:.1e}, every switch proved",
            o.penetration, o.tension
        ),
    );
    line(
        "balance",
        format!(
            "{:.1e} of the energy is not accounted for; the jumps add up to {:.1e}",
            o.balance,
            o.jumps.abs()
        ),
    );
    line("stability", stability_text(o));
    out
}

/// The orbit file: a run over one period, and `/orbit`.
fn write(
    path: &std::path::Path,
    options: &WriterOptions,
    scene: &Scene,
    body: &Propagator,
    orbit: &Orbit,
) -> Result<(), CliError> {
    let mut writer = Writer::create(path, scene, &body.system, options)?;
    let run = Options { until: orbit.period, samples: 400, switch_limit: 40.0 };
    let done =
        event::run(&body.system, &orbit.state, &run, &mut period_map::flow(body), &mut writer);
    let report = match done {
        Ok(report) => report,
        Err(e) => {
            writer.discard();
            return Err(match e {
                RunError::Observer(e) => e.into(),
                RunError::Contact(e) => CliError::Numerics(e.to_string()),
            });
        }
    };
    writer.orbit(&branch::record(body, orbit)?, &body.system)?;
    if report.outcome.is_complete() {
        return Ok(writer.finish(&Status::Complete)?);
    }
    // the orbit is found and stored; the states along it are not all there
    writer.finish(&Status::Failed(report.outcome.to_string()))?;
    Err(CliError::Reported(format!(
        "the orbit was found, but its run over one period ended early ({}); what there is stands in {}",
        report.outcome,
        path.display()
    )))
}

fn all(
    arguments: &Arguments,
    global: &Global,
    scene: &Scene,
    body: &mut Propagator,
    (closure, omega): (Closure, f64),
    own: Vec<Vec<f64>>,
    begun: Instant,
) -> Result<(), CliError> {
    let mut starts = branch::starts(body, arguments.largest, arguments.amplitudes as usize);
    starts.iter_mut().for_each(|z| z.resize(closure.unknowns(body.n()), 0.0));
    // the scene's own state comes first
    starts.splice(0..0, own);
    let bar = Bar::new(global, scene);
    let count = starts.len();
    let found = branch::all(body, closure, &starts, omega, &Effort::default(), |k| {
        if let Some(bar) = &bar {
            bar.set(k as f64 / count as f64, format!("{k} of {count} starts"));
        }
    });
    if let Some(bar) = &bar {
        bar.clear();
    }
    let found = found?;
    let wall = begun.elapsed().as_secs_f64();
    global.print(
        || {
            let orbits: Vec<Value> = found.iter().map(|o| orbit_json(body, o)).collect();
            json!({"omega": omega, "starts": starts.len(), "orbits": orbits, "wall_s": wall})
        },
        || {
            let mut out = format!(
                "{} different orbits at omega = {omega} from {} starts ({wall:.1} s); others may exist\n  {:>14} {:>9} {:>13} {:>10} {:>10}  {}\n",
                found.len(), starts.len(), "energy", "switches", "contact time", "residual", "grazing", "stability"
            );
            for o in &found {
                let stable = match &o.stability {
                    None => "not computed".to_owned(),
                    Some(s) if s.is_stable() => "stable".to_owned(),
                    Some(s) => format!("unstable, {}", significant(s.largest, 5)),
                };
                let _ = writeln!(
                    out,
                    "  {:>14} {:>9} {:>13} {:>10.1e} {:>10.1e}  {stable}",
                    significant(o.energy, 9), o.switches.len(), significant(o.contact_time, 7), o.residual, o.grazing
                );
            }
            out
        },
    )?;
    if found.is_empty() {
        return Err(CliError::Reported(format!("no orbit found at omega = {omega}")));
    }
    Ok(())
}

/// The pair of stored states, at least a tenth of the time apart, that are nearest to each other: period and first state.
fn near_return(
    path: &std::path::Path,
    scene: &Scene,
    system: &signorini::contact::System,
) -> Result<(f64, State), CliError> {
    let stored = store::Stored::read(path)?;
    let n = system.n();
    if stored.u.ncols() != n || stored.nodes.nrows() != system.body.mesh.n_nodes() {
        return Err(CliError::Input(format!(
            "{} was not made with the mesh of {}",
            path.display(),
            scene.stem()
        )));
    }
    let rows = stored.t.len();
    let unit = system.body.frequency_unit();
    let distance = |a: usize, b: usize| -> f64 {
        let du: f64 =
            stored.u.row(a).iter().zip(stored.u.row(b)).map(|(x, y)| (x - y).powi(2)).sum();
        let dv: f64 =
            stored.v.row(a).iter().zip(stored.v.row(b)).map(|(x, y)| (x - y).powi(2)).sum();
        du + dv / (unit * unit)
    };
    let last = stored.t.last().copied().unwrap_or(0.0);
    let mut best: Option<(f64, usize, usize)> = None;
    for a in 0..rows {
        for b in a + 1..rows {
            if stored.t[b] - stored.t[a] < 0.1 * last {
                continue;
            }
            let d = distance(a, b);
            if best.is_none_or(|(least, ..)| d < least) {
                best = Some((d, a, b));
            }
        }
    }
    let (_, a, b) =
        best.ok_or_else(|| CliError::Input(format!("{} holds too few states", path.display())))?;
    let n_o = system.n_o();
    let state = |x: &ndarray::Array2<f64>| x.row(a).iter().take(n_o).copied().collect();
    Ok((stored.t[b] - stored.t[a], State { u: state(&stored.u), v: state(&stored.v) }))
}
