//! A guess from a stored trajectory: a state that it comes back to.

use std::path::Path;

use signorini::contact::{State, System};
use signorini::scenario::Scene;
use signorini::store::Stored;

use crate::cli::{CliError, plain};

/// Two states are at least this share of the whole time apart, where no period is given.
const APART: f64 = 0.1;
/// Most differences of numbers that a search may take: half a minute.
const MOST: f64 = 3e10;

/// What is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Return {
    /// Whatever comes back best.
    Best,
    /// After this time.
    After(f64),
    /// After this time, from a multiple of a period of the loads, where they are at the beginning of it.
    Forced {
        /// Period of the loads.
        load: f64,
        /// Periods of the loads until it comes back.
        count: usize,
    },
}

/// A stored trajectory in the coordinates of a body.
struct Trajectory {
    t: Vec<f64>,
    /// `u_O` and `u̇_O`.
    states: Vec<State>,
    /// Frequency that makes velocities displacements.
    unit: f64,
}

impl Trajectory {
    /// Square of the distance of two states, or more than `most` of it.
    fn square(&self, a: &State, b: &State, most: f64) -> f64 {
        let part = |a: &[f64], b: &[f64], unit: f64, most: f64| {
            let mut sum = 0.0;
            for (x, y) in a.chunks(64).zip(b.chunks(64)) {
                sum += x.iter().zip(y).map(|(x, y)| ((x - y) / unit).powi(2)).sum::<f64>();
                if sum > most {
                    break;
                }
            }
            sum
        };
        let of_u = part(&a.u, &b.u, 1.0, most);
        of_u + if of_u > most { 0.0 } else { part(&a.v, &b.v, self.unit, most - of_u) }
    }

    /// The state at a time within the trajectory: cubic in the displacements, linear in the velocities.
    fn at(&self, t: f64) -> State {
        let b = self.t.partition_point(|x| *x < t).clamp(1, self.t.len() - 1);
        let (a, h) = (b - 1, self.t[b] - self.t[b - 1]);
        if h <= 0.0 {
            return self.states[b].clone();
        }
        let s = ((t - self.t[a]) / h).clamp(0.0, 1.0);
        let (from, to) = (&self.states[a], &self.states[b]);
        let (p, q) = (s * s * (3.0 - 2.0 * s), s * (1.0 - s));
        let of_u = |i: usize| {
            (1.0 - p) * from.u[i] + p * to.u[i] + h * q * ((1.0 - s) * from.v[i] - s * to.v[i])
        };
        let of_v = |i: usize| (1.0 - s) * from.v[i] + s * to.v[i];
        let n = from.u.len();
        State { u: (0..n).map(of_u).collect(), v: (0..n).map(of_v).collect() }
    }

    /// The nearest pair, any two of which `apart` are. Norms part most of them: `|‖a‖ − ‖b‖| ≤ ‖a − b‖`. None: it takes too long; with its time and state.
    fn best(&self) -> Result<Option<(f64, State)>, f64> {
        let last = self.t.last().copied().unwrap_or(0.0);
        let zero = State { u: vec![0.0; self.size()], v: vec![0.0; self.size()] };
        let norm = |s: &State| self.square(s, &zero, f64::INFINITY).sqrt();
        let norms: Vec<f64> = self.states.iter().map(norm).collect();
        let mut order: Vec<usize> = (0..self.t.len()).collect();
        order.sort_by(|&a, &b| norms[a].total_cmp(&norms[b]));
        let mut best: Option<(f64, usize, usize)> = None;
        let mut spent = 0.0;
        for (k, &a) in order.iter().enumerate() {
            for &b in &order[k + 1..] {
                let least = best.map_or(f64::INFINITY, |b| b.0);
                if (norms[b] - norms[a]).powi(2) > least {
                    break;
                }
                if (self.t[b] - self.t[a]).abs() < APART * last {
                    continue;
                }
                spent += 2.0 * self.size() as f64;
                if spent > MOST {
                    return Err(spent);
                }
                let d = self.square(&self.states[a], &self.states[b], least);
                // the order of equals is that of the file
                let pair = (a.min(b), a.max(b));
                if best.is_none_or(|(least, x, y)| (d, pair) < (least, (x, y))) {
                    best = Some((d, pair.0, pair.1));
                }
            }
        }
        Ok(best.map(|(_, a, b)| (self.t[b] - self.t[a], self.states[a].clone())))
    }

    fn size(&self) -> usize {
        self.states.first().map_or(0, |s| s.u.len())
    }

    /// The state among those at `from` that comes back best after `period`; of equals the latest.
    fn after(&self, period: f64, from: impl Iterator<Item = f64>) -> Option<(f64, State)> {
        let mut best: Option<(f64, State)> = None;
        for t in from {
            let (a, b) = (self.at(t), self.at(t + period));
            let least = best.as_ref().map_or(f64::INFINITY, |b| b.0);
            let d = self.square(&a, &b, least);
            if d <= least {
                best = Some((d, a));
            }
        }
        best.map(|(_, state)| (period, state))
    }
}

/// The best near-return: its period and first state.
pub(super) fn near_return(
    path: &Path,
    scene: &Scene,
    system: &System,
    wanted: Return,
) -> Result<(f64, State), CliError> {
    let refuse = |why: String| CliError::Input(format!("--near-return {}: {why}", path.display()));
    let stored = Stored::read(path)?;
    let dofs = system.body.nodal_dofs();
    let n = dofs.n_columns();
    if stored.whole()?.n_displacements() != n || stored.nodes.nrows() != system.body.mesh.n_nodes()
    {
        return Err(refuse(format!("it was not made with the mesh of {}", scene.stem())));
    }
    // files have displacements along the axes
    let of = |x: Vec<f64>| {
        let mut x = dofs.from_axes(&x);
        x.truncate(system.n_o());
        x
    };
    let state = |row: usize| {
        let (u, v) = stored.state(row);
        State { u: of(u), v: of(v) }
    };
    let states: Vec<State> = (0..stored.t.len()).map(state).collect();
    let trajectory =
        Trajectory { t: stored.t.to_vec(), states, unit: system.body.frequency_unit() };
    let last = stored.t.last().copied().unwrap_or(0.0);
    let found = match wanted {
        _ if trajectory.t.len() < 2 => None,
        Return::Best => trajectory.best().map_err(|_| {
            let rows = trajectory.t.len();
            let advice = "give --period or --omega, or a run with fewer samples";
            refuse(format!("its {rows} states cannot all be compared in reasonable time; {advice}"))
        })?,
        Return::After(period) => {
            let rows = trajectory.t.iter().copied().filter(|t| t + period <= last);
            trajectory.after(period, rows)
        }
        Return::Forced { load, count } => {
            let period = load * count as f64;
            let most = ((last - period) / load * (1.0 + 1e-12)).floor();
            let starts = (0..=most.max(-1.0) as i64).map(|k| k as f64 * load);
            trajectory.after(period, starts)
        }
    };
    found.ok_or_else(|| {
        let what = match wanted {
            Return::Best => "too few states".to_owned(),
            Return::After(period) => format!("no states {} apart", plain(period)),
            Return::Forced { load, count } => {
                format!("less than {count} × {} (the period of the loads)", plain(load))
            }
        };
        refuse(format!("it holds {what}"))
    })
}
