//! The viscous nonlinear mode behind `orbit --viscous` and `backbone --viscous`: its arguments and its words.

use std::path::Path;

use clap::Args;
use serde_json::{Value, json};

use signorini::continuation::Go;
use signorini::families::statement::Judged;
use signorini::families::viscous::Viscosity;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::{ErrorStatement, PointRecord, Variation};
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::{StoredFamily, WriterOptions, write_statement};

use super::progress::Bar;
use super::{CliError, Global, plain};

/// What a viscous orbit is.
pub(crate) const MEANING: &str = "periodic motion of the Kelvin-Voigt body C = beta K, kept going by -alpha M; converges with the mesh; the conservative limit is not claimed";

/// What a conservative orbit is.
pub(crate) const CONSERVATIVE: &str = "orbits of the discrete system, exact for this mesh; under refinement they have no limit (--viscous ones have)";

/// Above so many displacements a viscous orbit wants a reduced body.
const WORTH_REDUCING: usize = 700;

/// Options of the viscous nonlinear mode.
#[derive(Debug, Clone, Args)]
pub struct Arguments {
    /// The viscous nonlinear mode: the body C = beta K, kept going by -alpha M with alpha unknown; converges with the mesh
    #[arg(long)]
    pub viscous: bool,
    /// Viscous: beta, a time [default: that of the scene's [orbit], or what the mesh resolves]
    #[arg(long, value_name = "BETA", allow_negative_numbers = true, requires = "viscous")]
    pub beta: Option<f64>,
}

impl Arguments {
    /// The viscosity, if it is asked for.
    pub fn viscosity(
        &self,
        scene: &Scene,
        body: &Propagator,
    ) -> Result<Option<Viscosity>, CliError> {
        if !self.viscous {
            return Ok(None);
        }
        with_beta(scene, body, self.beta).map(Some)
    }
}

/// The viscosity of a scene, or another one.
pub(crate) fn with_beta(
    scene: &Scene,
    body: &Propagator,
    beta: Option<f64>,
) -> Result<Viscosity, CliError> {
    if let Some(beta) = beta.filter(|b| !(b.is_finite() && *b > 0.0)) {
        return Err(CliError::Input(format!("--beta {}: give a positive time", plain(beta))));
    }
    Ok(Viscosity::of_scene(scene, body, beta)?)
}

/// Compute the error statement of a family, with a progress bar, and add it to its file. Interrupted: the family stays without it.
pub fn state(
    global: &Global,
    judged: &Judged,
    path: &Path,
    options: &WriterOptions,
) -> Result<Option<ErrorStatement>, CliError> {
    let bar = Bar::new(global, judged.scene);
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
        write_statement(path, &options.outputs, statement)?;
    }
    Ok(statement)
}

/// An error statement in lines.
pub(crate) fn statement_text(statement: &ErrorStatement) -> Vec<String> {
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
        lines.push(format!(
            "{}: {} ({}){missing}",
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

/// The range of some shares.
fn percent(shares: &[f64]) -> String {
    let known = || shares.iter().copied().filter(|x| x.is_finite());
    match (known().reduce(f64::min), known().reduce(f64::max)) {
        (Some(low), Some(high)) => format!("{:+.2} to {:+.2} %", 100.0 * low, 100.0 * high),
        _ => "not known".into(),
    }
}

/// An error statement as a JSON object.
pub(crate) fn statement_json(statement: &ErrorStatement) -> Value {
    let variation = |v: &Variation| {
        json!({"changed": v.changed.name(), "what": v.text, "energy": v.energy, "relative": statement.relative(v),
            "shift_of_omega": statement.shift(v)})
    };
    let variations: Vec<Value> = statement.variations.iter().map(variation).collect();
    json!({"omega": statement.omega, "energy": statement.energy, "slope": statement.slope, "variations": variations,
        "observed_order": statement.order()})
}

/// How the orbits of a viscosity close.
pub fn closure(v: &Viscosity) -> Closure {
    Closure::Viscous(v.pin)
}

/// Warn of what is to be said of a viscosity on its mesh.
pub(crate) fn warn(global: &Global, v: &Viscosity, n_o: usize, reduced: bool) {
    if let Some(n) = v.elements.filter(|_| v.is_unresolved()) {
        let number = |x: f64| significant(x, 4);
        global.caller.warn(&format!(
            "beta = {} asks for fronts of sharpness sqrt(L/(c beta)) = {}, and the mesh has n = {} elements over the length of \
             the body: above n/2 = {} (better n/4 = {}) orbits are those of the mesh; give beta >= {}, or refine it",
            number(v.pin.beta),
            number(v.pin.sharpness()),
            number(n),
            number(0.5 * n),
            number(0.25 * n),
            number(v.pin.beta_of(0.5 * n))
        ));
    }
    if n_o > WORTH_REDUCING && !reduced {
        global.caller.warn(&format!(
            "{n_o} displacements move by themselves: [reduction] with cutoff = {} keeps what this viscosity leaves, for a small part of \
             the time",
            significant(v.pin.cutoff(), 3)
        ));
    }
}

/// The orbits of a viscous family to look near.
pub(crate) fn orbits_of(path: &Path, problem: &Problem) -> Result<Vec<PointRecord>, CliError> {
    let refuse = |why: &str| Err(CliError::Input(format!("{}: {why}", path.display())));
    let mut stored = StoredFamily::read(path)?;
    let mut points = std::mem::take(&mut stored.points);
    points.retain(|p| p.orbit.is_some());
    if points.iter().all(|p| p.orbit.as_ref().is_none_or(|o| o.viscous.is_none())) {
        return refuse(
            "no viscous orbits are in it; give a file of `signorini backbone --viscous`",
        );
    }
    let n = problem.system.body.nodal_dofs().n_columns();
    if points.iter().any(|p| p.orbit.as_ref().is_some_and(|o| o.u0.len() != n)) {
        return refuse("its body has other displacements than this scene");
    }
    stored.points = points;
    stored.count_along_directions(&problem.system.body);
    Ok(stored.points)
}
