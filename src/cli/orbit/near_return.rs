//! A guess from a stored trajectory.

use std::path::Path;

use signorini::contact::{State, System};
use signorini::scenario::Scene;
use signorini::store::Stored;

use crate::cli::CliError;

/// Two states are at least this share of the whole time apart.
const APART: f64 = 0.1;

/// Numbers of the two stored states, far enough apart in time, that are nearest to each other; `unit` scales velocities.
fn nearest(stored: &Stored, unit: f64) -> Option<(usize, usize)> {
    let rows = stored.t.len();
    let states: Vec<_> = (0..rows).map(|row| stored.state(row)).collect();
    let square =
        |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum() };
    let distance = |a: usize, b: usize| {
        let (a, b) = (&states[a], &states[b]);
        square(&a.0, &b.0) + square(&a.1, &b.1) / (unit * unit)
    };
    let last = stored.t.last().copied().unwrap_or(0.0);
    let mut best: Option<(f64, usize, usize)> = None;
    for a in 0..rows {
        for b in a + 1..rows {
            if stored.t[b] - stored.t[a] < APART * last {
                continue;
            }
            let d = distance(a, b);
            if best.is_none_or(|(least, ..)| d < least) {
                best = Some((d, a, b));
            }
        }
    }
    best.map(|(_, a, b)| (a, b))
}

/// The best near-return: its period and first state.
pub(super) fn near_return(
    path: &Path,
    scene: &Scene,
    system: &System,
) -> Result<(f64, State), CliError> {
    let stored = Stored::read(path)?;
    let n = system.n();
    if stored.whole()?.n_displacements() != n || stored.nodes.nrows() != system.body.mesh.n_nodes()
    {
        return Err(CliError::Input(format!(
            "{} was not made with the mesh of {}",
            path.display(),
            scene.stem()
        )));
    }
    let (a, b) = nearest(&stored, system.body.frequency_unit())
        .ok_or_else(|| CliError::Input(format!("{} holds too few states", path.display())))?;
    let (mut u, mut v) = stored.state(a);
    u.truncate(system.n_o());
    v.truncate(system.n_o());
    Ok((stored.t[b] - stored.t[a], State { u, v }))
}
