//! The command line: the only place that prints, parses arguments and picks exit codes.
//!
//! Exit codes: 0 done; 2 bad input; 3 the numerics failed; 1 anything else. A command gives back an [`Answer`]: [`main`] prints it, and
//! [`call`] hands it to a program that uses the commands as functions.

mod answer;
mod backbone;
mod balance;
mod bands;
mod basins;
mod benchmark;
mod caller;
mod compare;
mod crosscheck;
mod curve;
mod damped;
mod diagram;
mod doublings;
mod error;
mod export;
mod family;
mod inspect;
mod inspect_matrix;
mod inspect_mesh;
mod inspect_scene;
mod interrupt;
mod load;
mod lyapunov;
mod manual;
mod modes;
mod new;
mod one_picture;
mod orbit;
mod phase_resonance;
mod plot;
mod precision;
mod progress;
mod ratios;
mod reduce;
mod resources;
mod response;
mod run;
mod schema;
mod seen;
mod study;
mod task;
mod tori;
mod trust;
mod validate;
mod view;
mod viscous;
mod whole;
mod wrap;

use std::ffi::OsString;
use std::process::ExitCode;
use std::sync::Arc;

use clap::{CommandFactory, Parser, Subcommand};

use crate::scenario::Scene;

pub use answer::{Answer, Global};
use answer::{Said, plain, title};
use caller::Caller;
pub use caller::Desk;
pub use error::CliError;
use error::print;

/// Reference simulator for elastic bodies that touch a rigid obstacle: event-driven integration of the
/// nodal boundary equations.
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    after_help = "Example:\n  signorini run scenarios/plate.toml -o plate.h5\n  signorini plot plate.h5\n\nWhich command and which method: docs/which.md. What the words of summaries mean: docs/words.md."
)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Integrate a scene; write the trajectory, the switches and the energy ledger
    Run(run::Arguments),
    /// Natural frequencies of the open body and of the closed body
    Modes(modes::Arguments),
    /// Periodic orbits at one frequency by shooting, with Floquet multipliers
    Orbit(orbit::Arguments),
    /// A family of periodic orbits by continuation
    Backbone(backbone::Arguments),
    /// Forced response over a range of frequencies, for one or several damping ratios
    Response(response::Arguments),
    /// Folds, doublings, Neimark–Sacker points, grazings and peaks of a response over a number of its scene
    Curve(curve::Arguments),
    /// Basins of attraction: from which states of a plane the body comes to which attractor, and how large their shares are
    Basins(basins::Arguments),
    /// A bifurcation diagram: what a forced body settles to while a number of its scene goes up, or down
    Diagram(diagram::Arguments),
    /// A laboratory's test of phase resonance: the frequency is steered until the displacement lags a quarter of a period, value by value of a load
    PhaseResonance(phase_resonance::Arguments),
    /// Motions of two frequencies: closed curves of the period map, from where an orbit loses its stability to one
    Tori(tori::Arguments),
    /// How far a family moves with numbers of its scene that are known to a standard deviation only: bands around backbones and responses
    Bands(bands::Arguments),
    /// Harmonic-balance results against the equations in time: is each point a true motion?
    Crosscheck(crosscheck::Arguments),
    /// Pictures (SVG, PNG, PDF) of what a file holds
    Plot(plot::Arguments),
    /// One page of HTML that plays what files hold, in any browser
    View(view::Arguments),
    /// Results for ParaView (VTU/XDMF) or a spreadsheet (CSV)
    Export(export::Arguments),
    /// The matrices of a scene, reduced as it says, for other programs (HDF5, MATLAB, NumPy)
    Reduce(reduce::Arguments),
    /// What is in a file, in words
    Inspect(inspect::Arguments),
    /// Speed against error: integrators × tolerances on a scene, table and picture
    Precision(precision::Arguments),
    /// How far the mesh may be trusted: the same scene on a finer one, and with the other discretisation of the contact
    Trust(trust::Arguments),
    /// Contact methods, meshes and parameters side by side: errors, pressures, energies, times; orbits; viscous modes
    Compare(compare::Arguments),
    /// Many independent runs over parameters, meshes and methods: here in parallel, or as a job array of Slurm
    Study(study::Arguments),
    /// Closed-form and published cases: measured error beside the accepted one
    Validate(validate::Arguments),
    /// Problems with numbers that other codes can be held against as well: ours, and theirs, beside the references
    Benchmark(benchmark::Arguments),
    /// A commented scene to begin with
    New(new::Arguments),
    /// The keys of scenes and studies, as JSON Schema for editors
    Schema(schema::Arguments),
    /// Completions of a shell
    Completions(manual::Completions),
    /// Manual pages
    Man(manual::Manual),
}

/// Carry out a command.
fn execute(cli: &Cli) -> Result<Answer, CliError> {
    match cli.global.threads {
        None => dispatch(cli),
        Some(n) => on_threads(usize::from(n), cli.global.caller.desk.is_none(), || dispatch(cli))?,
    }
}

/// Do something on so many threads: those of the process where they are not made yet and it is the only command (`alone`), else of a pool of its own, which what the
/// process did before or does beside has no say in.
fn on_threads<T: Send>(n: usize, alone: bool, f: impl FnOnce() -> T + Send) -> Result<T, CliError> {
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(n);
    if alone && pool().build_global().is_ok() {
        return Ok(f());
    }
    let failed = |e: rayon::ThreadPoolBuildError| CliError::Other(format!("--threads {n}: {e}"));
    Ok(pool().build().map_err(failed)?.install(f))
}

fn dispatch(cli: &Cli) -> Result<Answer, CliError> {
    let global = &cli.global;
    match &cli.command {
        Command::Run(a) => task::run(a, global),
        Command::Modes(a) => modes::run(a, global),
        Command::Orbit(a) => orbit::run(a, global),
        Command::Backbone(a) => task::run(a, global),
        Command::Response(a) => task::run(a, global),
        Command::Curve(a) => task::run(a, global),
        Command::Basins(a) => task::run(a, global),
        Command::Diagram(a) => task::run(a, global),
        Command::PhaseResonance(a) => task::run(a, global),
        Command::Tori(a) => task::run(a, global),
        Command::Bands(a) => task::run(a, global),
        Command::Crosscheck(a) => task::run(a, global),
        Command::Plot(a) => plot::run(a, global),
        Command::View(a) => view::run(a, global),
        Command::Export(a) => export::run(a, global),
        Command::Reduce(a) => reduce::run(a, global),
        Command::Inspect(a) => inspect::run(a, global),
        Command::Precision(a) => precision::run(a, global),
        Command::Trust(a) => trust::run(a, global),
        Command::Compare(a) => task::run(a, global),
        Command::Study(a) => study::run(a, global),
        Command::Validate(a) => validate::run(a, global),
        Command::Benchmark(a) => benchmark::run(a, global, &within),
        Command::New(a) => new::run(a, global),
        Command::Schema(a) => Ok(schema::run(a)),
        Command::Completions(a) => Ok(manual::completions(a, Cli::command())),
        Command::Man(a) => manual::manual(a, Cli::command(), global),
    }
}

/// Parse the arguments of this process, run, print, report.
pub fn main() -> ExitCode {
    main_with(std::env::args_os()).into()
}

/// The same with other arguments, the first of which is the program's name; the exit code.
pub fn main_with(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(e) => {
            // help and version are no errors
            let _ = e.print();
            return u8::try_from(e.exit_code()).unwrap_or(2);
        }
    };
    let json = cli.global.json;
    let answer = match execute(&cli) {
        Ok(answer) => answer,
        Err(e) => return e.report(json),
    };
    let printed = match answer.said {
        Said::Object(value) => print(&format!("{value}\n")),
        Said::Text(text) => print(&text),
    };
    match (printed, answer.failure) {
        (Err(e), _) => e.report(json),
        (Ok(()), None) => 0,
        (Ok(()), Some(why)) => {
            eprintln!("signorini: {why}");
            3
        }
    }
}

/// A command that a program calls as a function.
#[derive(Debug, Clone, Default)]
pub struct Call {
    /// As at the terminal, without the program's name.
    pub arguments: Vec<String>,
    /// The scene in place of the file that the arguments name.
    pub scene: Option<Scene>,
    /// The results are read at once and thrown away: they are not compressed.
    pub is_scratch: bool,
}

/// Carry out a call; `desk` is shared with the caller meanwhile. Nothing is printed.
pub fn call(call: Call, desk: Arc<Desk>) -> Result<Answer, CliError> {
    let mut cli = parsed(&call.arguments)?;
    let Call { scene, is_scratch, .. } = call;
    let command = cli.global.caller.command.take();
    cli.global.caller = Caller { scene, is_scratch, command, desk: Some(desk) };
    execute(&cli)
}

/// A command that does not come from the terminal, with itself as text for the record.
fn parsed(arguments: &[String]) -> Result<Cli, CliError> {
    let words = [&["signorini".to_owned()], arguments].concat();
    let mut cli = Cli::try_parse_from(&words)
        .map_err(|e| CliError::Input(e.to_string().trim_end().to_owned()))?;
    cli.global.caller.command = Some(words.join(" "));
    Ok(cli)
}

/// A command within another: it answers with its object, and says nothing else.
fn within(arguments: &[String]) -> Result<serde_json::Value, CliError> {
    let mut cli = parsed(arguments)?;
    (cli.global.json, cli.global.quiet) = (true, true);
    execute(&cli).map(Answer::object)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A process that calls several commands, one after the other or beside each other, has the threads that it asks each for.
    #[test]
    fn every_call_has_its_threads() {
        let counted = |n| on_threads(n, false, rayon::current_num_threads).ok();
        assert_eq!([1, 3, 2].map(counted), [Some(1), Some(3), Some(2)]);
        let inner = || on_threads(2, false, rayon::current_num_threads).ok();
        assert_eq!(on_threads(1, false, inner).ok().flatten(), Some(2));
    }
}
