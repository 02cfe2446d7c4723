//! The command line: the only place that prints, parses arguments and picks exit codes.
//!
//! Exit codes: 0 done; 2 bad input; 3 the numerics failed; 1 anything else.

mod backbone;
mod balance;
mod compare;
mod crosscheck;
mod doublings;
mod error;
mod export;
mod family;
mod inspect;
mod inspect_mesh;
mod interrupt;
mod load;
mod modes;
mod orbit;
mod plot;
mod precision;
mod progress;
mod ratios;
mod resources;
mod response;
mod run;
mod validate;
mod viscous;

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
    /// Start even what seems too large for this machine's memory or disk, or for a lifetime
    #[arg(long, global = true)]
    pub force_large: bool,
}

impl Global {
    /// Print an object in JSON mode, a text otherwise.
    fn print(
        &self,
        json: impl FnOnce() -> serde_json::Value,
        text: impl FnOnce() -> String,
    ) -> Result<(), CliError> {
        if self.json {
            print(&format!("{}\n", json()))
        } else if !self.quiet {
            // a terminal obeys control characters, and titles come from files
            let is_text = |c: &char| !c.is_control() || matches!(c, '\n' | '\t');
            print(&text().chars().filter(is_text).collect::<String>())
        } else {
            Ok(())
        }
    }
}

/// Write to standard output. Who closed it wants no more; a disk that is full is an error like any other.
fn print(text: &str) -> Result<(), CliError> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CliError::Other(format!("writing to standard output: {e}")))
        }
        _ => Ok(()),
    }
}

/// What a scene is called in a summary. A terminal obeys control characters: they are left out.
fn title(scene: &signorini::scenario::Scene) -> String {
    scene.name().chars().filter(|c| !c.is_control()).collect()
}

/// A number as one writes it: no row of three hundred zeros.
fn plain(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        size if (1e-4..1e9).contains(&size) => x.to_string(),
        _ => format!("{x:e}"),
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
    /// Contact methods, meshes and parameters side by side: errors, pressures, energies, times; orbits; viscous modes
    Compare(compare::Arguments),
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
    if cli.global.force_large {
        resources::force();
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
        Command::Compare(a) => compare::run(a, &cli.global),
        Command::Validate(a) => validate::run(a, &cli.global),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => e.report(cli.global.json),
    }
}
