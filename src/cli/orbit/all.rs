//! `--all`: the different orbits that a set of starts leads to.

use std::fmt::Write as _;
use std::time::Instant;

use serde_json::{Value, json};

use signorini::orbit::search::Effort;
use signorini::orbit::{Closure, Orbit, Propagator, census};
use signorini::report::summary::significant;
use signorini::scenario::Scene;

use super::Arguments;
use super::words::{orbit_json, spent_json};
use crate::cli::progress::Bar;
use crate::cli::{Answer, CliError, Global};

/// Find and print them; `own` are guesses of the scene, which come first.
pub(super) fn all(
    arguments: &Arguments,
    global: &Global,
    scene: &Scene,
    body: &mut Propagator,
    (closure, omega): (Closure, f64),
    own: Vec<Vec<f64>>,
    begun: Instant,
) -> Result<Answer, CliError> {
    let mut starts = census::starts(body, arguments.largest, arguments.amplitudes as usize);
    starts.iter_mut().for_each(|z| z.resize(closure.unknowns(body.n()), 0.0));
    // the scene's own state comes first
    starts.splice(0..0, own);
    let bar = Bar::new(global, scene);
    let found = census::all(body, closure, &starts, omega, &Effort::default(), |k, count| {
        if let Some(bar) = &bar {
            bar.set(k as f64 / count as f64, format!("{k} of {count} starts"));
        }
    });
    if let Some(bar) = &bar {
        bar.clear();
    }
    let census::Found { orbits: found, starts, spent } = found?;
    let wall = begun.elapsed().as_secs_f64();
    let answer = global.answer(
        || {
            let orbits: Vec<Value> = found.iter().map(|o| orbit_json(body, o)).collect();
            json!({
                "omega": omega, "starts": starts, "orbits": orbits, "spent": spent_json(spent), "wall_s": wall
            })
        },
        || {
            let head = format!(
                "{} at omega = {omega} from {starts} starts ({wall:.1} s); others may exist",
                match found.len() {
                    1 => "1 orbit".to_owned(),
                    n => format!("{n} different orbits"),
                }
            );
            format!("{head}\n{}", table(&found))
        },
    );
    Ok(match found.is_empty() {
        true => answer.failed(format!("no orbit found at omega = {omega}")),
        false => answer,
    })
}

/// A line an orbit.
fn table(found: &[Orbit]) -> String {
    let mut out = format!(
        "  {:>14} {:>9} {:>13} {:>10} {:>10}  {}\n",
        "energy", "switches", "contact time", "residual", "grazing", "stability"
    );
    for o in found {
        let stable = match &o.stability {
            None => "not computed".to_owned(),
            Some(s) if s.is_stable() => "stable".to_owned(),
            Some(s) => format!("unstable, {}", significant(s.largest, 5)),
        };
        let _ = writeln!(
            out,
            "  {:>14} {:>9} {:>13} {:>10.1e} {:>10.1e}  {stable}",
            significant(o.energy, 9),
            o.switches.len(),
            significant(o.contact_time, 7),
            o.residual,
            o.grazing
        );
    }
    out
}
