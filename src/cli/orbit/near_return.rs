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
    if stored.u.ncols() != n || stored.nodes.nrows() != system.body.mesh.n_nodes() {
        return Err(CliError::Input(format!(
            "{} was not made with the mesh of {}",
            path.display(),
            scene.stem()
        )));
    }
    let (a, b) = nearest(&stored, system.body.frequency_unit())
        .ok_or_else(|| CliError::Input(format!("{} holds too few states", path.display())))?;
    let n_o = system.n_o();
    let state = |x: &ndarray::Array2<f64>| x.row(a).iter().take(n_o).copied().collect();
    Ok((stored.t[b] - stored.t[a], State { u: state(&stored.u), v: state(&stored.v) }))
}
