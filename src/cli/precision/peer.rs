//! Other programs on the same matrices.

use std::path::{Path, PathBuf};
use std::process::Command;

use clap::ValueEnum;
use serde_json::Value;

use signorini::contact::States;
use signorini::report::precision::Point;
use signorini::store::{write_problem, write_problem_flat};

use super::bench::Bench;
use crate::cli::CliError;

/// Other programs.
#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
pub(super) enum Peer {
    /// SciPy's solve_ivp (RK45 and DOP853) with events; needs Python with validate/peers/requirements.txt
    /// (the interpreter is SIGNORINI_PYTHON, .venv/bin/python or python3)
    Scipy,
    /// SUNDIALS (CVODE's Adams method, ARKODE's explicit Runge–Kutta methods) with root finding; needs the program that `make peers` builds
    /// (SIGNORINI_SUNDIALS or target/peers/sundials_peer)
    Sundials,
    /// diffsol (Tsitouras' method of order 5) with root finding; needs the program that `make peers` builds (SIGNORINI_DIFFSOL or
    /// target/peers/diffsol_peer)
    Diffsol,
    /// GetFEM, a finite element library with a contact of its own, on the same mesh and data: frequencies, time of contact, impulse; needs its Python interface
    /// (Debian: python3-getfem, python3-scipy; the interpreter is SIGNORINI_GETFEM or the distribution's)
    Getfem,
    /// CalculiX with its own massless contact, explicit steps, on the same mesh and data (bodies in space, a consistent mass, one plane); needs ccx
    /// (Debian: calculix-ccx; the program is SIGNORINI_CALCULIX or ccx) and Python
    Calculix,
}

/// Peers that have the mesh and the data, not the matrices.
pub(super) const OF_MESHES: [Peer; 2] = [Peer::Getfem, Peer::Calculix];

/// A program that is named by the environment, or where `make peers` puts it.
fn built(variable: &str, place: &str) -> Command {
    Command::new(std::env::var_os(variable).map_or_else(|| place.into(), PathBuf::from))
}

/// A script for the Python that SIGNORINI_PYTHON names, that of the folder, or that of the system.
fn python(script: &str) -> Command {
    let local = PathBuf::from(".venv/bin/python");
    let python = match std::env::var_os("SIGNORINI_PYTHON") {
        Some(p) => PathBuf::from(p),
        None if local.exists() => local,
        None => PathBuf::from("python3"),
    };
    let mut command = Command::new(python);
    command.arg("-c").arg(script);
    command
}

impl Peer {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Peer::Scipy => "scipy",
            Peer::Sundials => "sundials",
            Peer::Diffsol => "diffsol",
            Peer::Getfem => "getfem",
            Peer::Calculix => "calculix",
        }
    }

    /// What to do where it is not there.
    fn advice(self) -> &'static str {
        match self {
            Peer::Scipy => {
                "install its requirements: pip install -r validate/peers/requirements.txt"
            }
            Peer::Sundials => "build it: make peers (or give the program by SIGNORINI_SUNDIALS)",
            Peer::Diffsol => "build it: make peers (or give the program by SIGNORINI_DIFFSOL)",
            Peer::Getfem => {
                "install its Python interface (Debian: apt-get install python3-getfem python3-scipy) or name an interpreter that has it by SIGNORINI_GETFEM"
            }
            Peer::Calculix => {
                "install it (Debian: apt-get install calculix-ccx) or give the program by SIGNORINI_CALCULIX"
            }
        }
    }

    /// Its program, for a problem in a file.
    fn command(self, file: &Path, repeats: u32) -> Command {
        let mut command = match self {
            Peer::Scipy => python(include_str!("../../../validate/peers/scipy_peer.py")),
            Peer::Calculix => python(include_str!("../../../validate/peers/calculix_peer.py")),
            Peer::Sundials => built("SIGNORINI_SUNDIALS", "target/peers/sundials_peer"),
            Peer::Diffsol => built("SIGNORINI_DIFFSOL", "target/peers/diffsol_peer"),
            Peer::Getfem => {
                // the distribution's packages are seen by the distribution's interpreter alone
                let own = Path::new("/usr/bin/python3");
                let place = if own.exists() { own } else { Path::new("python3") };
                let python = std::env::var_os("SIGNORINI_GETFEM");
                let mut command = Command::new(python.map_or_else(|| place.into(), PathBuf::from));
                command.arg("-c").arg(include_str!("../../../validate/peers/getfem_peer.py"));
                command
            }
        };
        command.env("OMP_NUM_THREADS", "1").env("OPENBLAS_NUM_THREADS", "1");
        command.arg(file).arg(repeats.to_string());
        command
    }

    /// Its solutions of the equations, of a peer that solves those.
    pub fn solve(self, bench: &Bench) -> Result<Vec<Point>, CliError> {
        let system = &bench.problem.system;
        let file = std::env::temp_dir().join(format!("signorini-peer-{}", std::process::id()));
        let start = system
            .select(0.0, &bench.problem.initial.u, &States::open(system.n_contact()))
            .map_err(|e| CliError::Numerics(e.to_string()))?;
        match self {
            Peer::Scipy => write_problem(&file, bench.problem, &start.set, bench.options.until)?,
            _ => {
                write_problem_flat(&file, bench.problem, &start.set, bench.options.until)?;
            }
        }
        let answer = self.ask(&file, bench.repeats)?;
        answer.lines().map(|l| self.point(bench, l)).collect()
    }

    /// What the program answers to a problem, a line a solution; the file is removed.
    pub(super) fn ask(self, file: &Path, repeats: u32) -> Result<String, CliError> {
        let mut command = self.command(file, repeats);
        let output = command.output();
        // a temporary file that cannot be removed is no reason to fail
        let _ = std::fs::remove_file(file);
        let output = output.map_err(|e| {
            let program = command.get_program().to_string_lossy();
            CliError::Other(format!("{program}: {e}; {}", self.advice()))
        })?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            let last = text.lines().last().unwrap_or("no message");
            let (name, advice) = (self.name(), self.advice());
            return Err(CliError::Other(format!("the peer {name} failed: {last}; {advice}")));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }

    /// The solution that a line tells of.
    fn point(self, bench: &Bench, line: &str) -> Result<Point, CliError> {
        let v: Value = serde_json::from_str(line).map_err(|e| {
            CliError::Other(format!("the peer {} answered {line}: {e}", self.name()))
        })?;
        let numbers = |v: &Value| -> Vec<f64> {
            v.as_array().map_or(vec![], |a| a.iter().filter_map(Value::as_f64).collect())
        };
        let times = numbers(&v["switches"]);
        Ok(Point {
            method: format!("{} {}", self.name(), v["method"].as_str().unwrap_or("?")),
            rtol: v["rtol"].as_f64(),
            error: Some(bench.error(&bench.state(&numbers(&v["u"]), &numbers(&v["v"])))),
            switch_error: bench.switch_error(&times),
            switches: times.len(),
            wall_s: v["wall_s"].as_f64().unwrap_or(f64::NAN),
            work: v["nfev"].as_u64().unwrap_or(0),
        })
    }
}
