//! The summary of a run, for people and for programs.

mod json;
mod promises;
mod text;

use crate::contact::{OMITTED_INERTIA, System, relief};
use crate::event::Report;
use crate::mesh::reentrant::reentrant;
use crate::mesh::slender::stiff_in_bending;
use crate::mesh::{Family, Mesh};
use crate::problem::Notes;
use crate::records::Relief;
use crate::scenario::{LoadKind, Scene};
use crate::store::ExcursionRecord;

pub(crate) use json::run_json;
pub use text::kinds_of_switches;
pub(crate) use text::{run_text, seen_text};

/// A number with so many significant digits, plain where that is readable.
pub(crate) fn significant(x: f64, digits: usize) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let exponent = x.abs().log10().floor() as i32;
    if (-4..7).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        return format!("{x:.decimals$}");
    }
    format!("{x:.*e}", digits - 1)
}

/// A number of things.
pub fn plural(n: usize, word: &str, plural: &str) -> String {
    format!("{n} {}", if n == 1 { word } else { plural })
}

/// The jumps at switches belong to the method, but a motion that they feed is not that of the body.
fn energy_warning(system: &System, report: &Report) -> Option<String> {
    if report.energy_drift > DRIFT && system.omits_inertia() {
        return Some(format!(
            "the energy drifts by {} inside a phase: {OMITTED_INERTIA}",
            significant(report.energy_drift, 2)
        ));
    }
    if report.energy_drift > DRIFT {
        return Some(format!(
            "the energy drifts by {} inside a phase: frequencies so far apart (materials, cells of very different size) that digits are lost, or a \
             tolerance too wide",
            significant(report.energy_drift, 2)
        ));
    }
    let brought = report.energy_start + report.energy_external.max(0.0);
    (report.energy_jumps > 0.1 * brought && report.energy_jumps > 0.0).then(|| {
        format!(
            "the jumps at switches have added {} to an energy of {}: on this mesh the method feeds the motion; refine it, \
             or damp it",
            significant(report.energy_jumps, 3),
            significant(brought, 3)
        )
    })
}

/// Elements that are too stiff for the body, with what is known of the error.
pub fn mesh_warning(system: &System) -> Option<String> {
    let mesh = &system.body.mesh;
    let modes = relief(system).unwrap_or_default();
    let bends_badly = || stiff_in_bending(mesh).map(|stiff| stiff.to_string());
    // bodies that are too large to be asked for their modes
    if modes.is_empty() {
        return bends_badly();
    }
    let of = |(k, (omega, share)): (usize, (f64, f64))| (k + 1, Relief { omega, share }.excess());
    let all = modes.into_iter().enumerate().map(of);
    let (mode, excess) = all.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|w| w.1 > TOO_STIFF)?;
    let kind = mesh.elements().next()?.kind;
    let excess = significant(100.0 * excess, 2);
    let (by, what) = match kind.family() {
        Family::Simplex => ("at least", "quadratic functions of their edges"),
        _ => ("about", "incompatible modes"),
    };
    let because = bends_badly().map_or(String::new(), |text| format!(" There are {text}."));
    Some(format!(
        "these {} are too stiff: mode {mode} by {by} {excess} % in frequency (what {what} take off its stiffness); take elements of second order, or a finer mesh. \"signorini trust\" tells what else moves.{because}",
        kind.name()
    ))
}

/// Corners of the body that point inwards, in words.
pub fn inward_corners(mesh: &Mesh) -> Option<String> {
    let found = reentrant(mesh);
    let at = mesh.nodes().get(*found.first()?)?;
    let (count, [x, y, _]) = (plural(found.len(), "corner points", "corners point"), at);
    Some(format!(
        "{count} inwards (the first at ({x}, {y})): stresses there grow without limit under refinement, and errors fall slowly; probe stresses elsewhere"
    ))
}

/// Error of a frequency that is warned about.
const TOO_STIFF: f64 = 0.02;

/// What of the scene has no effect, or another one than its words.
fn warnings(scene: &Scene, notes: &Notes, report: &Report) -> Vec<String> {
    let mut warnings = notes.warnings.clone();
    // tolerances are those of Runge–Kutta methods
    if report.counters.rhs_evaluations == 0 {
        let given = ["rtol", "atol"].into_iter().filter(|key| scene.gives("run", key));
        warnings.extend(given.map(|key| {
            format!("run.{key} has no effect: no Runge–Kutta method took part, and the others have no tolerance")
        }));
    }
    warnings.extend(blows(scene));
    warnings
}

/// Supports that stand elsewhere than the body begins: it is struck at the start.
fn blows(scene: &Scene) -> Vec<String> {
    let initial = &scene.initial;
    let begins = initial.mode.is_some()
        || initial.displacement.is_some()
        || initial.file.is_some()
        || initial.equilibrium;
    let bases = scene.loads.iter().enumerate().filter(|(_, l)| l.kind == LoadKind::Base && !begins);
    let strikes = bases
        .filter(|(_, l)| l.table.is_none() && l.omega.map_or(1.0, |_| l.phase.cos()).abs() > 1e-9);
    strikes
        .map(|(i, l)| {
            let what = match l.group() {
                // of bodies from matrices all of them
                "" => "what the supports hold".to_owned(),
                group => format!("\"{group}\""),
            };
            format!(
                "load[{i}]: {what} stands at {} of its amplitude at t = 0 and the body at rest does not: the run begins with a blow; phase = -1.5708 begins where the body is, a table from rest, or give [initial]",
                significant(l.omega.map_or(1.0, |_| l.phase.cos()), 3)
            )
        })
        .collect()
}

/// Surfaces that slid, and parts that turned, farther than small displacements go.
pub(crate) fn too_far(excursions: &[ExcursionRecord]) -> Vec<String> {
    let of = |e: &ExcursionRecord| {
        let (largest, t) = (significant(e.largest, 3), significant(e.t, 6));
        match &e.of[..] {
            [slave, master] if e.largest > MOST_SLIDING => Some(format!(
                "\"{slave}\" slides over \"{master}\" by up to {largest} of its sides (at t = {t}): what meets what is decided once, on the undeformed meshes. Smaller displacements, or longer sides"
            )),
            [part] if e.largest > MOST_ROTATION => Some(format!(
                "\"{part}\" turns by up to {largest} (at t = {t}): rotations are taken for small, and the error is of the order of their square"
            )),
            _ => None,
        }
    };
    excursions.iter().filter_map(of).collect()
}

/// Sliding over the length of a slave's sides beyond which a pair meets other sides than it was joined to.
const MOST_SLIDING: f64 = 1.0;

/// Rotation beyond which it is not small.
const MOST_ROTATION: f64 = 0.1;

/// Relative drift of the energy inside a phase that is warned about.
const DRIFT: f64 = 1e-6;

/// Above this many contact points the jump of the mass is not computed for the sake of the summary.
const RATIO_LIMIT: usize = 200;

/// `μ` of the paper's mass, where it is worth its cost.
fn mass_ratio(system: &System) -> Option<f64> {
    let jumps =
        !system.promise().conserves_energy && (1..=RATIO_LIMIT).contains(&system.n_contact());
    jumps.then(|| system.mass_ratio().ok()).flatten()
}
