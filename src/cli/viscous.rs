//! The viscous nonlinear mode behind `orbit --viscous` and `backbone --viscous`: its arguments and its words.

use std::path::Path;

use clap::Args;

use signorini::families::viscous::Viscosity;
use signorini::orbit::{Closure, Propagator};
use signorini::problem::Problem;
use signorini::records::PointRecord;
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::StoredFamily;

use super::{CliError, Global, plain};

/// What a viscous orbit is.
pub(crate) const MEANING: &str = "periodic motion of the Kelvin-Voigt body C = beta K, kept going by -alpha M; converges with the mesh; the conservative limit is not claimed";

/// What a conservative orbit is.
pub(crate) const CONSERVATIVE: &str = "orbits of the discrete system, exact for this mesh; under refinement they have no limit (--viscous ones have)";

/// What displacements and energies count from, where a body is preloaded.
pub(crate) const AROUND: &str = "displacements and energies from the equilibrium under the constant loads, energies with their work";

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

/// How the orbits of a viscosity close.
pub fn closure(v: &Viscosity) -> Closure {
    Closure::Viscous(v.pin)
}

/// Warn of what is to be said of a viscosity on its mesh.
pub(crate) fn warn(global: &Global, v: &Viscosity) {
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
