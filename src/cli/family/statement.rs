//! The error statement of a family: computed behind it, written into its file, said.

use serde_json::{Value, json};

use signorini::continuation::Go;
use signorini::families::statement::Judged;
use signorini::orbit::Closure;
use signorini::problem::Problem;
use signorini::records::{Changed, ErrorStatement, Variation};
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::write_statement;

use super::jobs::Carried;
use crate::cli::CliError;
use crate::cli::progress::Bar;
use crate::cli::task::Work;

/// Compute the error statement of a family where it is missing or of fewer points, with a progress bar, and add it to its file; of one branch, where others are of other bodies. Interrupted: the family stays without it.
pub(crate) fn state(
    work: &Work,
    (scene, problem): (&Scene, &Problem),
    (closure, branch): (Closure, Option<usize>),
    carried: &mut Carried,
) -> Result<(), CliError> {
    let is_fresh = carried.stored.points.len() > carried.resumed;
    if !is_fresh && carried.stored.statement.is_some() {
        return Ok(());
    }
    let (global, path) = (work.global, &work.path);
    let bar = Bar::new(global, scene);
    let judged = Judged { scene, problem, closure, branch, points: &carried.stored.points };
    let statement = judged.statement(|share, what| {
        if let Some(bar) = &bar {
            bar.set(share, format!("error statement: {what}"));
        }
        match global.caller.signal() {
            None => Go::Continue(()),
            Some(_) => Go::Break(()),
        }
    });
    if let Some(bar) = &bar {
        bar.clear();
    }
    let statement = statement?;
    if let Some(signal) = global.caller.signal() {
        let text = format!(
            "interrupted; the family is whole in {}, without its error statement: the same command with --resume computes it",
            path.display()
        );
        return Err(CliError::Interrupted(signal, text));
    }
    if let Some(statement) = &statement {
        write_statement(path, &work.options.outputs, statement)?;
    }
    carried.stored.statement = statement;
    Ok(())
}

/// An error statement in lines.
pub(super) fn statement_text(statement: &ErrorStatement) -> Vec<String> {
    let omega = &statement.omega;
    let first = omega.first().copied().unwrap_or(f64::NAN);
    let last = omega.last().copied().unwrap_or(f64::NAN);
    let mut lines = vec![format!(
        "the same orbits at {} frequencies, {} to {}, with one thing changed: energy (and frequency at given energy)",
        omega.len(),
        significant(first, 4),
        significant(last, 4)
    )];
    for v in &statement.variations {
        let missing = v.energy.iter().filter(|e| e.is_nan()).count();
        let missing = if missing > 0 { format!("; no orbit at {missing}") } else { String::new() };
        // like one over their number at worst
        let rest = match v.changed {
            Changed::MoreModes => "; what all modes change is at most about twice that",
            _ => "",
        };
        lines.push(format!(
            "{}: {} ({}){missing}{rest}",
            v.text,
            percent(&statement.relative(v)),
            percent(&statement.shift(v))
        ));
    }
    let orders: Vec<f64> = statement.order().into_iter().filter(|p| p.is_finite()).collect();
    if let (Some(low), Some(high)) =
        (orders.iter().copied().reduce(f64::min), orders.iter().copied().reduce(f64::max))
    {
        lines.push(format!(
            "observed order of convergence with the mesh {low:.1} to {high:.1}, at the {} frequencies where the differences have one sign",
            orders.len()
        ));
    }
    lines
}

/// The range of some shares in percent: with two decimals, or as many as show two digits.
fn percent(shares: &[f64]) -> String {
    let known = || shares.iter().map(|x| 100.0 * x).filter(|x| x.is_finite());
    let (Some(low), Some(high)) = (known().reduce(f64::min), known().reduce(f64::max)) else {
        return "not known".into();
    };
    let largest = low.abs().max(high.abs()).clamp(1e-12, 1.0);
    let decimals = (1.0 - largest.log10().floor()).max(2.0) as usize;
    format!("{low:+.decimals$} to {high:+.decimals$} %")
}

/// An error statement as a JSON object.
pub(super) fn statement_json(statement: &ErrorStatement) -> Value {
    let variation = |v: &Variation| {
        json!({"changed": v.changed.name(), "what": v.text, "energy": v.energy, "relative": statement.relative(v),
            "shift_of_omega": statement.shift(v)})
    };
    let variations: Vec<Value> = statement.variations.iter().map(variation).collect();
    json!({"omega": statement.omega, "energy": statement.energy, "slope": statement.slope, "variations": variations,
        "observed_order": statement.order()})
}
