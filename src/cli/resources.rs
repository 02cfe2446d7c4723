//! What a command would need, held against what the machine has, before anything starts; unless the user knows better (`--force-large`), which the scene of the command says.

use std::path::Path;

use signorini::contact::March;
use signorini::fem::Finer;
use signorini::problem::Problem;
use signorini::scenario::{Body, BodyKind, MassKind, Scene};
use signorini::store::{Kept, in_bytes, room};

use super::{CliError, Global, plain};

/// Memory that this process may still take, in bytes; none where it cannot be told.
fn memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let kilobytes = |line: &str| line.split_whitespace().nth(1)?.parse::<u64>().ok();
    let free = text.lines().find(|l| l.starts_with("MemAvailable:")).and_then(kilobytes)? << 10;
    #[cfg(unix)]
    {
        let limit = rustix::process::getrlimit(rustix::process::Resource::As).current;
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let taken = status.lines().find(|l| l.starts_with("VmSize:")).and_then(kilobytes);
        let taken = taken.unwrap_or(0) << 10;
        Some(limit.map_or(free, |limit| free.min(limit.saturating_sub(taken))))
    }
    #[cfg(not(unix))]
    Some(free)
}

/// Refuse `needed` bytes of memory that are not there; `what` says what for and what to change.
fn check_memory(scene: &Scene, needed: f64, what: &str) -> Result<(), CliError> {
    match memory() {
        Some(there) if !scene.unlimited && needed > there as f64 => Err(CliError::Input(format!(
            "{what}: about {} of memory are needed, and {} are there (--force-large tries all the same)",
            in_bytes(needed as u64),
            in_bytes(there)
        ))),
        _ => Ok(()),
    }
}

/// Memory that a body takes while it is assembled and factorised.
pub(crate) fn check_body(scene: &Scene) -> Result<(), CliError> {
    scene.bodies().into_iter().try_for_each(|(key, body)| check_one(scene, &key, body))
}

fn check_one(scene: &Scene, key: &str, b: &Body) -> Result<(), CliError> {
    if b.kind == BodyKind::Matrices {
        return Ok(());
    }
    // elements of half the size, or the nodes of second order
    let finer = match (scene.finer, scene.dim()) {
        (Finer::No, _) => 1.0,
        (Finer::Raised, _) => 7.0,
        (Finer::Halved, dim) => f64::from(1 << dim),
    };
    if let Some(name) = &b.file {
        // some fifty bytes of text a node or element, some fifty times as many of matrices
        let folder = scene.source.file.parent().unwrap_or("".as_ref());
        let bytes = std::fs::metadata(folder.join(name)).map_or(0, |m| m.len());
        let what = format!("{key}.file = {}: {} of mesh", name.display(), in_bytes(bytes));
        return check_memory(scene, 50.0 * finer * bytes as f64, &what);
    }
    let count = |x: &usize| *x as f64;
    let elements: f64 = finer * b.elements.iter().map(count).product::<f64>();
    let (per_element, per_node) = match b.kind {
        BodyKind::Bar => (4.0, 1.0),
        _ => (64.0, 2.0),
    };
    // entries are collected as triplets, sorted, merged; then factors of K and M with their fill
    let matrices = if b.mass == MassKind::Consistent { 2.0 } else { 1.2 };
    let triplets = 24.0 * per_element * matrices * elements;
    let unknowns = per_node * elements;
    let factors = 8.0 * unknowns * (9.0 * per_node + 8.0 * unknowns.max(2.0).log2());
    check_memory(
        scene,
        triplets + factors,
        &format!(
            "{key}.elements = {:?}: {} unknowns; take fewer elements",
            b.elements,
            plain(unknowns)
        ),
    )
}

/// Memory of Newton's method on so many interface terms and projections: the derivative of this iterate and of the next, and the system with its factors.
pub(crate) fn check_balance(
    scene: &Scene,
    harmonics: usize,
    (terms, projections): (usize, usize),
) -> Result<(), CliError> {
    let (terms, projections) = (terms as f64, projections as f64);
    let what = format!(
        "--harmonics {harmonics}: {} interface terms; take fewer harmonics or fewer contact nodes",
        plain(terms)
    );
    check_memory(scene, 8.0 * terms * (2.0 * projections + 3.0 * terms), &what)
}

/// Most natural periods of a run.
const MOST_PERIODS: f64 = 1e8;
/// Files larger than this are announced.
const LARGE_FILE: f64 = 1e9;

/// Most steps of a scheme that goes by steps.
const MOST_STEPS: f64 = 1e10;

/// Length of a run.
pub(crate) fn check_time(scene: &Scene, problem: &Problem, until: f64) -> Result<(), CliError> {
    let system = &problem.system;
    let periods = until * system.body.frequency_unit() / std::f64::consts::TAU;
    if periods > MOST_PERIODS && !scene.unlimited {
        return Err(CliError::Input(format!(
            "[run] until = {}: {} natural periods of the body, at {} shortest periods each; take a shorter time (--force-large runs it all the same)",
            plain(until),
            plain(periods.round()),
            plain((system.frequency_bound() / system.body.frequency_unit()).round())
        )));
    }
    if let Some(March::Steps(stepping)) = system.impact().and_then(|law| law.march) {
        let steps = until / stepping.step;
        if steps > MOST_STEPS && !scene.unlimited {
            return Err(CliError::Input(format!(
                "[contact] step = {}: {} steps; take longer ones (--force-large runs it all the same)",
                plain(stepping.step),
                plain(steps.round())
            )));
        }
    }
    Ok(())
}

/// Steps and file size of a run.
pub(crate) fn check_run(
    global: &Global,
    scene: &Scene,
    problem: &Problem,
    until: f64,
    output: &Path,
) -> Result<(), CliError> {
    if scene.unlimited {
        return Ok(());
    }
    check_time(scene, problem, until)?;
    let system = &problem.system;
    let samples = scene.run.as_ref().map_or(0, |r| r.samples) as f64;
    // compression takes at most about half of what is random to the last digit
    let kept = Kept::of_run(scene, system);
    let row = (kept.bytes() + 9 * system.n_contact() + 8 * 7) as f64;
    let size = samples * row;
    if let Some(there) = room(output).filter(|there| 0.5 * size > *there as f64) {
        return Err(CliError::Other(format!(
            "{}: {} states of {} displacements take about {}, and the disk has {}; take fewer [run] samples{} (--force-large runs it all the same)",
            output.display(),
            plain(samples),
            kept.len(),
            in_bytes(size as u64),
            in_bytes(there),
            if kept.len() < system.n() { "" } else { ", or store = \"contact\"" }
        )));
    }
    if size > LARGE_FILE {
        global.caller.warn(&format!(
            "{} will take up to {} ({} stored states)",
            output.display(),
            in_bytes(size as u64),
            plain(samples)
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What one command is allowed says nothing of another in the same process.
    #[test]
    fn one_command_may_be_large_and_the_next_not() {
        let text = "[body]\nkind = 'plate'\nsize = [1.0, 1.0]\nelements = [7000, 7000]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n";
        let scene = Scene::parse(text, "large.toml".as_ref()).unwrap_or_else(|e| panic!("{e}"));
        let mut allowed = scene.clone();
        allowed.unlimited = true;
        if memory().is_some() {
            assert!(check_body(&scene).is_err());
        }
        assert!(check_body(&allowed).is_ok());
        assert!(allowed.with(&[]).is_ok_and(|s| check_body(&s).is_ok()));
    }
}
