//! The file of a family: a new one, or one to go on with.

use std::path::Path;

use super::{FamilyError, Known};
use crate::contact::System;
use crate::records::{Branch, PlaceRecord, PointRecord, Status};
use crate::scenario::Scene;
use crate::store::{FamilyPlan, FamilyWriter, StoredFamily, WriterOptions};

/// What a family is asked for.
pub struct Asked<'a> {
    /// Where it is written.
    pub path: &'a Path,
    /// The scene.
    pub scene: &'a Scene,
    /// Operators.
    pub system: &'a System,
    /// Its kind, range and branches.
    pub plan: FamilyPlan,
    /// Most points of a branch that is followed by arclength.
    pub points: usize,
    /// Number of unknowns of an orbit, where orbits are shot, and how many of them are its state.
    pub unknowns: Option<(usize, usize)>,
    /// How files are written.
    pub options: WriterOptions,
}

/// The file of a family.
pub enum Opened {
    /// There is something to do: the writer, and what is there already.
    Writing(Box<FamilyWriter>, Known),
    /// Everything that is asked for is in the file, which stays untouched.
    Whole(Box<StoredFamily>),
}

/// Open the file of a family: a new one, or one to go on with (`resume`). What is there must be of the same scene and kind, and its
/// range must lie within the one that is asked for. What is damaged and can be done without is said to `warn`.
pub fn open(asked: &Asked, resume: bool, warn: impl FnOnce(&str)) -> Result<Opened, FamilyError> {
    let Asked { path, scene, system, plan, options, .. } = asked;
    if !resume && StoredFamily::is_unfinished(path) && !options.outputs.is_forced() {
        return Err(FamilyError::Unfinished(path.to_path_buf()));
    }
    if !resume || !StoredFamily::is_begun(path) {
        let writer = FamilyWriter::create(path, scene, system, options, plan)?;
        return Ok(Opened::Writing(Box::new(writer), Known::default()));
    }
    // an input, or a file of someone else, is no family to go on with
    options.outputs.with_force(true).check(path)?;
    let (mut stored, warning) = StoredFamily::recover(path)?;
    if let Some(text) = warning {
        warn(&text);
    }
    let plan = continued(asked, &stored)?;
    if let Some(what) = misfit(&stored, system, asked.unknowns) {
        return Err(FamilyError::Misfit { path: path.to_path_buf(), what });
    }
    stored.count_along_directions(&system.body);
    let whole = stored.status == Status::Complete && stored.range == plan.range;
    let count = stored.points.len();
    let ends = std::mem::take(&mut stored.ends);
    let known = Known::standing(asked, &plan, std::mem::take(&mut stored.points), ends);
    if whole && known.len() == count && known.is_whole(asked, &plan) {
        return Ok(Opened::Whole(Box::new(StoredFamily::read(path)?)));
    }
    let writer = FamilyWriter::resume(path, scene, system, options, &plan, known.points())?;
    Ok(Opened::Writing(Box::new(writer), known))
}

/// The plan of a family that is gone on with, or why it cannot be.
fn continued(asked: &Asked, stored: &StoredFamily) -> Result<FamilyPlan, FamilyError> {
    let plan = &asked.plan;
    let refuse = |why: String| Err(FamilyError::Another { path: asked.path.to_path_buf(), why });
    if stored.scene != asked.scene.source.text {
        return refuse("it was made from another scene".into());
    }
    let identity = &stored.identity;
    if let Some(difference) = identity.difference(&plan.identity) {
        return refuse(format!("it was made with other options: {difference}"));
    }
    if stored.branches != plan.branches {
        let names =
            |all: &[Branch]| all.iter().map(Branch::to_string).collect::<Vec<_>>().join("; ");
        let (a, b) = (names(&stored.branches), names(&plan.branches));
        return refuse(format!("it was made with other options: its branches are {a}; not {b}"));
    }
    let ([low, high], [from, to]) = (plan.range, stored.range);
    let rounding = 1e-9 * high;
    if from < low - rounding || to > high + rounding {
        return refuse(format!("it covers {from} to {to}, and {low} to {high} is less"));
    }
    // the grid counts from where it began
    Ok(FamilyPlan { identity: identity.clone(), ..plan.clone() })
}

/// What does not fit a body, if anything: whoever goes on with the points may index without fear. `unknowns` are those of an orbit,
/// and of its state, where orbits are shot.
fn misfit(
    stored: &StoredFamily,
    system: &System,
    unknowns: Option<(usize, usize)>,
) -> Option<String> {
    let (n, n_o, n_c) = (system.body.nodal_dofs().n_columns(), system.n_o(), system.n_contact());
    let place_fits = |place: &PlaceRecord| {
        let (x, tangent, events) = (&place.x, &place.tangent, place.points.len());
        let numbers = x.iter().chain(tangent).chain([&place.step, &place.orientation]);
        let along = !tangent.is_empty();
        let length = match unknowns {
            None => !x.is_empty(),
            // viscous branches have no charts
            Some((z, _)) if along && !place.sets.is_empty() => {
                x.len() == z + events + 1 && place.sets.len() == events + 1
            }
            Some((z, _)) => x.len() == z + 1,
        };
        length
            && (!along || tangent.len() == x.len())
            && numbers.clone().all(|x| x.is_finite())
            && x[x.len() - 1] > 0.0
            && place.sets.iter().all(|s| s.len() == n_c)
            && place.points.iter().all(|c| *c < n_c)
    };
    let fits = |p: &PointRecord| {
        let orbit = p.orbit.as_ref().is_none_or(|o| o.u0.len() == n && o.v0.len() == n);
        let series =
            p.series.as_ref().is_none_or(|s| s.coefficients.len() == (2 * s.n_h + 1) * n_o);
        // a place that belongs to the point: its frequency, and (shooting: ½‖z‖² is an energy) the size of its motion
        let belongs = |place: &PlaceRecord| {
            let same = place.x.last().is_some_and(|w| (w - p.omega).abs() <= 1e-6 * p.omega.abs());
            let energy = p.orbit.as_ref().map_or(0.0, |o| o.energy.abs());
            let motion = unknowns
                .map_or(0.0, |(_, n)| 0.5 * place.x.iter().take(n).map(|x| x * x).sum::<f64>());
            same && (energy == 0.0 || motion <= 1e6 * energy)
        };
        p.omega.is_finite()
            && p.branch < stored.branches.len()
            && orbit
            && series
            && p.place.as_ref().is_none_or(|place| place_fits(place) && belongs(place))
    };
    let bad = stored.points.iter().position(|p| !fits(p))?;
    Some(format!("damaged: point {bad} does not fit the body"))
}
