//! Title and legend of a family's picture.

use std::collections::BTreeSet;

use plotters::prelude::RGBColor;

use super::branches::{branch_names, branches, colour, is_sequential};
use super::look::Look;
use super::special::{Special, bifurcation};
use crate::report::figure::{Entry, INK, Legend, Mark, Sheet, entry};
use crate::store::StoredFamily;

/// What stands above a family's picture besides what its branches and points say.
pub(super) struct Head {
    /// What is shown.
    pub(super) what: String,
    pub(super) look: Look,
    /// Entries of the legend behind those of the points.
    pub(super) extra: Vec<Entry>,
    /// Entries in a row of their own.
    pub(super) below: Vec<Entry>,
}

/// A sheet with title and legend of a family's picture.
pub(super) fn family_head(family: &StoredFamily, head: Head) -> Sheet<'static> {
    let look = head.look;
    let (prefix, names) = branch_names(family);
    // one branch has its name in the title
    let what = match &names[..] {
        [name] => format!("{} ({name})", head.what),
        _ => head.what,
    };
    let mut entries = stability_entries(family, look);
    entries.extend(special_entries(family, look));
    if family.points.iter().any(|p| p.orbit.is_none()) {
        entries.push(entry("no orbit found", ink(family), Mark::Tick));
    }
    entries.extend(head.extra);
    Sheet::new(&family.title, &what)
        .legend(Legend::Rows(branch_entries(family, &prefix, &names)))
        .legend(Legend::Rows(entries))
        .legend(Legend::Rows(head.below))
}

/// Several branches with their colours, behind what their names have in common.
fn branch_entries(family: &StoredFamily, prefix: &str, names: &[String]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = vec![];
    if names.len() > 1 {
        if !prefix.is_empty() {
            entries.push(entry(format!("{prefix}:"), INK, Mark::Nothing));
        }
        let mark = if is_sequential(family) { Mark::Dot } else { Mark::Line };
        let named = branches(family).into_iter().zip(names);
        entries.extend(named.map(|(b, name)| entry(name, colour(family, b), mark)));
    }
    entries
}

/// Colour of what belongs to no branch in particular.
pub(super) fn ink(family: &StoredFamily) -> RGBColor {
    match branches(family)[..] {
        [only] => colour(family, only),
        _ => INK,
    }
}

/// Stable and unstable, as far as they occur.
fn stability_entries(family: &StoredFamily, look: Look) -> Vec<Entry> {
    let any = |stable: bool| {
        family.points.iter().filter_map(|p| p.orbit.as_ref()).any(|o| o.stable == Some(stable))
    };
    let [yes, no] = match is_sequential(family) {
        true => [Mark::Dot, Mark::Ring],
        false => [Mark::Line, Mark::Dashes],
    };
    let names = [(true, "stable", yes), (false, "unstable", no)].into_iter();
    let shown = names.filter(|(stable, ..)| look == Look::Full && any(*stable));
    shown.map(|(_, name, mark)| entry(name, ink(family), mark)).collect()
}

/// The names of the bifurcations that are marked.
fn bifurcations(family: &StoredFamily, look: Look) -> String {
    let marked = family.points.iter().filter(|p| look.marked(p) == Some(Special::Bifurcation));
    let kinds: BTreeSet<_> = marked.filter_map(|p| bifurcation(&p.special)).collect();
    kinds.into_iter().collect::<Vec<_>>().join(", ")
}

/// Special points, as far as they occur.
fn special_entries(family: &StoredFamily, look: Look) -> Vec<Entry> {
    let kinds = bifurcations(family, look);
    let has = |kind: Special| family.points.iter().any(|p| look.marked(p) == Some(kind));
    let names = [
        (Special::Fold, "fold"),
        (Special::Border, "change of switch sequence"),
        (Special::Bifurcation, &*kinds),
    ];
    let shown = names.into_iter().filter(|(kind, _)| has(*kind));
    shown.map(|(kind, name)| entry(name, INK, kind.mark())).collect()
}
