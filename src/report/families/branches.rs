//! The branches of a family: their points, names and colours, and the pieces that may be drawn as lines.

use std::collections::BTreeSet;

use plotters::prelude::RGBColor;

use super::special::is_critical;
use crate::records::{Branch, OrbitRecord, PointRecord, Solver, Way};
use crate::report::figure::{LINES, viridis};
use crate::store::StoredFamily;

/// One orbit after the other at given frequencies: neighbours need not belong together.
pub(super) fn is_sequential(family: &StoredFamily) -> bool {
    family.outline().is_point_by_point()
}

/// The viscous nonlinear mode: its multipliers are those of the self-excited system, not of the body.
pub(in crate::report) fn is_viscous(family: &StoredFamily) -> bool {
    let of_kind = family.identity.method.viscosity().is_some();
    let has_feedback = |p: &PointRecord| p.orbit.as_ref().is_some_and(|o| o.viscous.is_some());
    let outline = family.outline();
    let fed = || outline.way != Way::Amplitudes && family.points.iter().any(has_feedback);
    of_kind || outline.solver == Solver::Viscous || fed()
}

/// The points of a branch in their order; points of different branches are interleaved in the file.
pub(in crate::report) fn of_branch(
    family: &StoredFamily,
    branch: usize,
) -> impl Iterator<Item = &PointRecord> {
    family.points.iter().filter(move |p| p.branch == branch)
}

pub(in crate::report) fn branches(family: &StoredFamily) -> Vec<usize> {
    family.points.iter().map(|p| p.branch).collect::<BTreeSet<_>>().into_iter().collect()
}

/// Colour of a branch: more of them than line colours are a scale.
pub(super) fn colour(family: &StoredFamily, branch: usize) -> RGBColor {
    let last = branches(family).last().copied().unwrap_or(0);
    match last < LINES.len() {
        true => LINES[branch],
        false => viridis(0.92 * branch as f64 / last as f64),
    }
}

/// Names of the branches without what they have in common at the start, and that.
pub(super) fn branch_names(family: &StoredFamily) -> (String, Vec<String>) {
    let all = branches(family);
    let name = |b: &usize| {
        family.branches.get(*b).map_or_else(|| format!("branch {}", b + 1), Branch::to_string)
    };
    let names: Vec<String> = all.iter().map(name).collect();
    let [first, rest @ ..] = &names[..] else { return (String::new(), names) };
    if rest.is_empty() {
        return (String::new(), names);
    }
    let common = first
        .char_indices()
        .map(|(i, c)| i + c.len_utf8())
        .take_while(|&i| rest.iter().all(|n| n.get(..i) == first.get(..i)))
        .last()
        .unwrap_or(0);
    // what stands before a comma, or a word before a number
    let cut = match first[..common].rfind(", ") {
        Some(comma) => comma + 2,
        None => first[..common].rfind(' ').map_or(0, |space| space + 1),
    };
    let begins = |n: &String| n[cut..].starts_with(|c: char| c.is_ascii_digit());
    if !first[..cut].ends_with(", ") && !names.iter().all(begins) {
        return (String::new(), names);
    }
    let prefix = first[..cut].trim_end_matches([' ', ',', '=']).to_owned();
    (prefix, names.iter().map(|n| n[cut..].to_owned()).collect())
}

/// A quantity of an orbit, if it has it.
pub(in crate::report) type Value<'v> = &'v dyn Fn(&OrbitRecord) -> Option<f64>;

/// A branch in runs of neighbours that belong together, whatever their stability; an orbit alone is a run of one.
pub(in crate::report) fn runs(
    family: &StoredFamily,
    branch: usize,
    value: Value,
) -> Vec<Vec<(f64, f64)>> {
    let mut runs: Vec<Vec<(f64, f64)>> = vec![];
    let mut goes_on = false;
    for p in of_branch(family, branch) {
        let here = p.orbit.as_ref().and_then(value).map(|y| (p.omega, y));
        match (here, runs.last_mut()) {
            (Some(point), Some(run)) if goes_on && !parted(family, p) => run.push(point),
            (Some(point), _) => runs.push(vec![point]),
            _ => {}
        }
        goes_on = here.is_some();
    }
    runs
}

/// Whether a point does not belong together with the one before it: the orbits of a cross-check were found one by one.
fn parted(family: &StoredFamily, p: &PointRecord) -> bool {
    family.outline().solver == Solver::Check
        || (is_sequential(family) && p.special.is_another_motion())
}

/// A piece of a branch of one stability; that of a viscous family is not known.
pub(in crate::report) struct Piece {
    pub(in crate::report) stable: Option<bool>,
    pub(in crate::report) points: Vec<(f64, f64)>,
}

/// A branch in pieces that may be drawn as lines.
pub(in crate::report) fn pieces(family: &StoredFamily, branch: usize, value: Value) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = vec![];
    let viscous = is_viscous(family);
    let mut before: Option<(&PointRecord, f64)> = None;
    let mut goes_on = false;
    for p in of_branch(family, branch) {
        let here = p.orbit.as_ref().and_then(value).map(|y| (p, y));
        if let (Some((a, y_a)), Some((b, y_b)), false) = (before, here, parted(family, p)) {
            let stability =
                |p: &PointRecord| p.orbit.as_ref().and_then(|o| o.stable).filter(|_| !viscous);
            // at a point of stability its neighbour decides
            let stable = match (is_critical(a), is_critical(b)) {
                (true, false) => stability(b),
                (false, true) => stability(a),
                _ => stability(a).zip(stability(b)).map(|(a, b)| a && b),
            };
            match pieces.last_mut() {
                Some(last) if goes_on && last.stable == stable => last.points.push((b.omega, y_b)),
                _ => {
                    pieces.push(Piece { stable, points: vec![(a.omega, y_a), (b.omega, y_b)] });
                }
            }
            goes_on = true;
        } else {
            goes_on = false;
        }
        before = here;
    }
    pieces
}
