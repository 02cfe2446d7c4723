//! SciPy as a peer.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use signorini::contact::ActiveSet;
use signorini::report::precision::Point;
use signorini::store::write_problem;

use super::bench::Bench;
use crate::cli::CliError;

/// SciPy on the same matrices.
pub(super) fn scipy(bench: &Bench) -> Result<Vec<Point>, CliError> {
    let system = &bench.problem.system;
    let file = std::env::temp_dir().join(format!("signorini-peer-{}.h5", std::process::id()));
    let start = system
        .select(0.0, &bench.problem.initial.u, &ActiveSet::open(system.n_contact()))
        .map_err(|e| CliError::Numerics(e.to_string()))?;
    write_problem(&file, bench.problem, &start.set, bench.options.until)?;
    let answer = ask(&file, bench.repeats)?;
    answer.lines().map(|l| point(bench, l)).collect()
}

/// What the program answers to a problem, a line a solution; the file is removed.
fn ask(file: &Path, repeats: u32) -> Result<String, CliError> {
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
        .arg(include_str!("../../../validate/peers/scipy_peer.py"))
        .arg(file)
        .arg(repeats.to_string())
        .output();
    // a temporary file that cannot be removed is no reason to fail
    let _ = std::fs::remove_file(file);
    let output = output.map_err(|e| CliError::Other(format!("{}: {e}", python.display())))?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let last = text.lines().last().unwrap_or("no message");
        let advice = "install its requirements: pip install -r validate/peers/requirements.txt";
        return Err(CliError::Other(format!("the SciPy peer failed: {last}; {advice}")));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The solution that a line tells of.
fn point(bench: &Bench, line: &str) -> Result<Point, CliError> {
    let v: Value = serde_json::from_str(line)
        .map_err(|e| CliError::Other(format!("the SciPy peer answered {line}: {e}")))?;
    let numbers = |v: &Value| -> Vec<f64> {
        v.as_array().map_or(vec![], |a| a.iter().filter_map(Value::as_f64).collect())
    };
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
}
