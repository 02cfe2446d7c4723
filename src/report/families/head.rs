//! Title and legend of a family's picture.

use std::collections::BTreeSet;

use plotters::prelude::RGBColor;

use super::branches::{branch_names, branches, colour, is_sequential};
use super::look::Look;
use super::special::{Special, bifurcation};
use crate::report::figure::{Area, Entry, FigureError, INK, Mark, legend_above, px, title};
use crate::store::StoredFamily;

/// What stands above a family's picture besides what its branches and points say.
pub(super) struct Head<'e> {
    /// What is shown.
    pub(super) what: String,
    pub(super) look: Look,
    /// Entries of the legend behind those of the points.
    pub(super) extra: &'e [Entry<'e>],
    /// Entries in a row of their own.
    pub(super) below: &'e [Entry<'e>],
}

/// Title and legend of a family's picture; what is left of the sheet.
pub(super) fn family_head<'b>(
    root: &Area<'b>,
    family: &StoredFamily,
    head: &Head,
) -> Result<Area<'b>, FigureError> {
    let look = head.look;
    let (prefix, names) = branch_names(family);
    // one branch has its name in the title
    let what = match &names[..] {
        [name] => format!("{} ({name})", head.what),
        _ => head.what.clone(),
    };
    title(root, &family.title, &what)?;
    let (_, sheet) = root.split_vertically(px(32.0));
    let lead = if prefix.is_empty() { prefix } else { format!("{prefix}:") };
    let sheet = legend_above(sheet, &branch_entries(family, &lead, &names))?;
    let kinds = bifurcations(family, look);
    let mut entries = stability_entries(family, look);
    entries.extend(special_entries(family, look, &kinds));
    if family.points.iter().any(|p| p.orbit.is_none()) {
        entries.push(("no orbit found", ink(family), Mark::Tick));
    }
    entries.extend_from_slice(head.extra);
    let sheet = legend_above(sheet, &entries)?;
    legend_above(sheet, head.below)
}

/// Several branches with their colours, behind what their names have in common.
fn branch_entries<'n>(family: &StoredFamily, lead: &'n str, names: &'n [String]) -> Vec<Entry<'n>> {
    let mut entries: Vec<Entry> = vec![];
    if names.len() > 1 {
        if !lead.is_empty() {
            entries.push((lead, INK, Mark::Nothing));
        }
        let mark = if is_sequential(family) { Mark::Dot } else { Mark::Line };
        let named = branches(family).into_iter().zip(names);
        entries.extend(named.map(|(b, name)| (name.as_str(), colour(family, b), mark)));
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
fn stability_entries(family: &StoredFamily, look: Look) -> Vec<Entry<'static>> {
    let any = |stable: bool| {
        family.points.iter().filter_map(|p| p.orbit.as_ref()).any(|o| o.stable == Some(stable))
    };
    let [yes, no] = match is_sequential(family) {
        true => [Mark::Dot, Mark::Ring],
        false => [Mark::Line, Mark::Dashes],
    };
    let names = [(true, "stable", yes), (false, "unstable", no)].into_iter();
    let shown = names.filter(|(stable, ..)| look == Look::Full && any(*stable));
    shown.map(|(_, name, mark)| (name, ink(family), mark)).collect()
}

/// The names of the bifurcations that are marked.
fn bifurcations(family: &StoredFamily, look: Look) -> String {
    let marked = family.points.iter().filter(|p| look.marked(p) == Some(Special::Bifurcation));
    let kinds: BTreeSet<_> = marked.filter_map(|p| bifurcation(&p.special)).collect();
    kinds.into_iter().collect::<Vec<_>>().join(", ")
}

/// Special points, as far as they occur.
fn special_entries<'n>(family: &StoredFamily, look: Look, kinds: &'n str) -> Vec<Entry<'n>> {
    let has = |kind: Special| family.points.iter().any(|p| look.marked(p) == Some(kind));
    let names = [
        (Special::Fold, "fold"),
        (Special::Border, "change of switch sequence"),
        (Special::Bifurcation, kinds),
    ];
    let shown = names.into_iter().filter(|(kind, _)| has(*kind));
    shown.map(|(kind, name)| (name, INK, kind.mark())).collect()
}
