//! The command line: the only place that prints, parses arguments and picks exit codes.
//!
//! Exit codes: 0 done; 2 bad input; 3 the numerics failed; 1 anything else.

mod backbone;
mod balance;
mod crosscheck;
mod error;
mod export;
mod family;
mod inspect;
mod load;
mod modes;
mod orbit;
mod plot;
mod precision;
mod response;
mod run;
mod validate;

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

pub use error::CliError;

/// Reference simulator for elastic bodies that touch a rigid obstacle: event-driven integration of the
/// nodal boundary equations.
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    after_help = "Example:\n  signorini run scenarios/plate.toml -o plate.h5\n  signorini plot plate.h5"
)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Command,
}

/// Options of every command.
#[derive(Debug, Clone, Args)]
pub struct Global {
    /// Print one JSON object on standard output and nothing else there
    #[arg(long, global = true)]
    pub json: bool,
    /// No progress, no summary
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Number of threads (all cores by default); results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
}

impl Global {
    /// Print an object in JSON mode, a text otherwise.
    fn print(&self, json: impl FnOnce() -> serde_json::Value, text: impl FnOnce() -> String) {
        if self.json {
            println!("{}", json());
        } else if !self.quiet {
            print!("{}", text());
        }
    }
}

/// The folder of an output must exist.
fn check_folder(output: &std::path::Path) -> Result<(), CliError> {
    match output.parent().filter(|f| !f.as_os_str().is_empty() && !f.is_dir()) {
        None => Ok(()),
        Some(folder) => {
            Err(CliError::Input(format!("{}: no such folder; create it first", folder.display())))
        }
    }
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
    /// Harmonic-balance results against the equations in time: is each point a true motion?
    Crosscheck(crosscheck::Arguments),
    /// Pictures (SVG and PNG) of what a file holds
    Plot(plot::Arguments),
    /// Results for ParaView (VTU/XDMF) or a spreadsheet (CSV)
    Export(export::Arguments),
    /// What is in a file, in words
    Inspect(inspect::Arguments),
    /// Speed against error: integrators × tolerances on a scene, table and picture
    Precision(precision::Arguments),
    /// Closed-form and published cases: measured error beside the accepted one
    Validate(validate::Arguments),
}

/// Parse, run, report.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(n) = cli.global.threads {
        // fails only if called twice
        let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n)).build_global();
    }
    let result = match &cli.command {
        Command::Run(a) => run::run(a, &cli.global),
        Command::Modes(a) => modes::run(a, &cli.global),
        Command::Orbit(a) => orbit::run(a, &cli.global),
        Command::Backbone(a) => backbone::run(a, &cli.global),
        Command::Response(a) => response::run(a, &cli.global),
        Command::Crosscheck(a) => crosscheck::run(a, &cli.global),
        Command::Plot(a) => plot::run(a, &cli.global),
        Command::Export(a) => export::run(a, &cli.global),
        Command::Inspect(a) => inspect::run(a, &cli.global),
        Command::Precision(a) => precision::run(a, &cli.global),
        Command::Validate(a) => validate::run(a, &cli.global),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => e.report(cli.global.json),
    }
}
