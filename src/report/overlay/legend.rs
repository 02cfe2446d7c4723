//! The legend of an overlay.

use std::collections::BTreeSet;

use super::scene::{Look, Scene, is_response};
use crate::records::{Branch, Way};
use crate::report::families::{Axis, error_entries, of_branch};
use crate::report::figure::{Entry, INK, Legend, Mark, entry};
use crate::store::StoredFamily;

/// The row of a file.
struct OfFile {
    /// What stands before its ratios.
    lead: String,
    /// The ratios of its curves.
    ratios: Vec<Entry>,
}

/// What belongs together in rows of its own.
pub(super) fn legends(scene: &Scene) -> Vec<Legend> {
    let files = responses(scene);
    let alone = files.len() == 1;
    let mut legends = vec![];
    for OfFile { lead, ratios } in files {
        let mut entries: Vec<Entry> = vec![entry(lead, INK, Mark::Nothing)];
        entries.extend(ratios);
        if alone {
            entries.extend(response(scene));
        }
        legends.push(Legend::Rows(entries));
    }
    if legends.len() > 1 {
        legends.push(Legend::Rows(response(scene)));
    }
    legends.extend([
        Legend::Rows(free(scene)),
        Legend::Columns(curves(scene)),
        Legend::Rows(errors(scene)),
    ]);
    legends
}

/// What the lines and marks of forced responses mean.
fn response(scene: &Scene) -> Vec<Entry> {
    let mut entries: Vec<Entry> = vec![];
    if !scene.any(is_response) {
        return entries;
    }
    let of = |stable: bool| {
        scene.branches.iter().any(|(f, b, look)| {
            matches!(look, Look::Response(..))
                && of_branch(f, *b)
                    .filter_map(|p| p.orbit.as_ref())
                    .any(|o| o.stable == Some(stable))
        })
    };
    for (stable, name, mark) in [(true, "stable", Mark::Line), (false, "unstable", Mark::Dashes)] {
        if of(stable) {
            entries.push(entry(name, INK, mark));
        }
    }
    if scene.branches.iter().any(|(f, _, look)| is_response(look) && !scene.ridge(f).is_empty()) {
        entries.push(entry("ridge", INK, Mark::Diamond));
    }
    if scene.any(|look| matches!(look, Look::ThinResponse(..))) {
        let thin = scene.branches.iter().filter(|b| matches!(b.2, Look::ThinResponse(..)));
        let used: BTreeSet<usize> =
            thin.filter_map(|(f, b, _)| f.branches.get(*b).and_then(Branch::harmonics)).collect();
        let used: Vec<String> = used.iter().map(usize::to_string).collect();
        let used =
            if used.is_empty() { String::new() } else { format!(", N_h = {}", used.join(", ")) };
        entries.push(entry(format!("harmonic balance{used}"), INK, Mark::Thin));
    }
    entries
}

/// Orbits that were checked, and backbones of one kind.
fn free(scene: &Scene) -> Vec<Entry> {
    let mut entries: Vec<Entry> = vec![];
    let of_checked = |name: &str| of_files(name, scene, |look| *look == Look::Checked);
    if scene.any(|look| *look == Look::Checked) {
        let name = of_checked("orbits in time");
        entries.push(entry(name, scene.colour(Look::Checked), Mark::Dot));
    }
    if !scene.checked_series().is_empty() {
        entries.push(match scene.axis {
            Axis::Energy => entry(of_checked("series that were checked"), INK, Mark::Circle),
            Axis::Amplitude => entry(NO_AMPLITUDE, INK, Mark::Nothing),
        });
    }
    if scene.any(|look| matches!(look, Look::Backbone(..))) {
        entries.push(entry("backbone by harmonic balance:", INK, Mark::Nothing));
        entries.extend(scene.harmonics.iter().map(|n| {
            let colour = scene.colour(Look::Backbone(Some(*n as usize), true));
            entry(format!("N_h = {n}"), colour, Mark::Line)
        }));
    }
    entries
}

/// Why the series of a cross-check are not drawn.
const NO_AMPLITUDE: &str = "(series that were checked: their amplitudes are not stored)";

fn stem(family: &StoredFamily) -> String {
    family.path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// A name with the files that it stands for.
fn of_files(name: &str, scene: &Scene, wanted: fn(&Look) -> bool) -> String {
    let of_look = scene.branches.iter().filter(|(_, _, look)| wanted(look));
    let mut files: Vec<String> = of_look.map(|(f, _, _)| stem(f)).collect();
    files.dedup();
    match files.iter().all(String::is_empty) {
        true => name.to_owned(),
        false => format!("{name} ({})", files.join(", ")),
    }
}

/// What stands before the ratios of each file, and these with their colours. Where each kind of response comes from one file, one row for all.
fn responses(scene: &Scene) -> Vec<OfFile> {
    let named = |r: Option<f64>| r.map(|r| format!("{r} %"));
    let several = scene.files() > 1;
    let full = scene.any(|look| matches!(look, Look::Response(..)));
    let mut rows: Vec<OfFile> = vec![];
    let mut last: Option<*const StoredFamily> = None;
    if !several && scene.any(is_response) {
        let mark = if full { Mark::Line } else { Mark::Thin };
        let entry = |r: &f64| (format!("{r} %"), scene.colour(Look::Response(Some(*r), 0)), mark);
        let lead = match scene.ratios.is_empty() {
            true => "forced response:",
            false => "forced response, damping ratio ξ:",
        };
        let ratios = scene.ratios.iter().map(entry).collect();
        return vec![OfFile { lead: lead.to_owned(), ratios }];
    }
    for (family, _, look) in &scene.branches {
        let (ratio, mark, what) = match look {
            Look::Response(ratio, _) if family.outline().way == Way::Sweep => {
                (ratio, Mark::Line, "sweep")
            }
            Look::Response(ratio, _) => (ratio, Mark::Line, "forced response"),
            Look::ThinResponse(ratio, _) => (ratio, Mark::Thin, "harmonic balance"),
            _ => continue,
        };
        if last != Some(std::ptr::from_ref(*family)) {
            last = Some(std::ptr::from_ref(*family));
            rows.push(OfFile { lead: format!("{}, {what}:", stem(family)), ratios: vec![] });
        }
        let name = named(*ratio).unwrap_or_else(|| "response".into());
        if let Some(row) = rows.last_mut()
            && !row.ratios.iter().any(|(known, ..)| *known == name)
        {
            row.ratios.push((name, scene.colour(*look), mark));
        }
    }
    rows
}

/// Curves that have a name of their own.
fn curves(scene: &Scene) -> Vec<Entry> {
    scene.curves.iter().map(|c| entry(&c.name, c.colour, Mark::Bearing(c.mark))).collect()
}

/// What is stated about the energies.
fn errors(scene: &Scene) -> Vec<Entry> {
    let stated = scene.curves.iter().map(|c| (c.family, c.colour)).collect::<Vec<_>>();
    if scene.axis == Axis::Energy { error_entries(&stated) } else { vec![] }
}
