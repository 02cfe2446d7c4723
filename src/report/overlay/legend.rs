//! The legend of an overlay.

use std::collections::BTreeSet;

use plotters::prelude::RGBColor;

use super::scene::{Look, Scene, is_response};
use crate::records::Branch;
use crate::report::families::{Axis, error_entries, of_branch};
use crate::report::figure::{Area, Entry, FigureError, INK, Mark, legend_above, legend_columns};
use crate::store::StoredFamily;

/// The row of a file.
struct OfFile {
    /// What stands before its ratios.
    lead: String,
    /// The ratios of its curves.
    ratios: Vec<(String, RGBColor, Mark)>,
}

/// Names in the legend.
pub(super) struct Names {
    /// Of each file of responses.
    responses: Vec<OfFile>,
    checked: String,
    series: String,
    harmonics: Vec<(String, RGBColor)>,
    thin: String,
}

impl Names {
    pub fn new(scene: &Scene) -> Self {
        let harmonic =
            |n: &f64| (format!("N_h = {n}"), scene.colour(Look::Backbone(Some(*n as usize), true)));
        let of_thin = scene.branches.iter().filter(|b| matches!(b.2, Look::ThinResponse(..)));
        let used: BTreeSet<usize> = of_thin
            .filter_map(|(f, b, _)| f.branches.get(*b).and_then(Branch::harmonics))
            .collect();
        let used: Vec<String> = used.iter().map(usize::to_string).collect();
        let used =
            if used.is_empty() { String::new() } else { format!(", N_h = {}", used.join(", ")) };
        Names {
            responses: responses(scene),
            checked: of_files("orbits in time", scene, |look| *look == Look::Checked),
            series: of_files("series that were checked", scene, |look| *look == Look::Checked),
            harmonics: scene.harmonics.iter().map(harmonic).collect(),
            thin: format!("harmonic balance{used}"),
        }
    }

    /// Draw what belongs together in rows of its own; what is left of the sheet.
    pub fn draw<'b>(&self, sheet: Area<'b>, scene: &Scene) -> Result<Area<'b>, FigureError> {
        let mut sheet = sheet;
        for OfFile { lead, ratios } in &self.responses {
            let mut entries: Vec<Entry> = vec![(lead, INK, Mark::Nothing)];
            entries.extend(ratios.iter().map(|(n, colour, mark)| (n.as_str(), *colour, *mark)));
            if self.responses.len() == 1 {
                entries.extend(self.response(scene));
            }
            sheet = legend_above(sheet, &entries)?;
        }
        if self.responses.len() > 1 {
            sheet = legend_above(sheet, &self.response(scene))?;
        }
        let sheet = legend_above(sheet, &self.free(scene))?;
        let sheet = legend_columns(sheet, &curves(scene))?;
        legend_above(sheet, &errors(scene))
    }

    /// What the lines and marks of forced responses mean.
    fn response<'n>(&'n self, scene: &Scene) -> Vec<Entry<'n>> {
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
        for (stable, name, mark) in
            [(true, "stable", Mark::Line), (false, "unstable", Mark::Dashes)]
        {
            if of(stable) {
                entries.push((name, INK, mark));
            }
        }
        if scene.branches.iter().any(|(f, _, look)| is_response(look) && !scene.ridge(f).is_empty())
        {
            entries.push(("ridge", INK, Mark::Diamond));
        }
        if scene.any(|look| matches!(look, Look::ThinResponse(..))) {
            entries.push((&self.thin, INK, Mark::Thin));
        }
        entries
    }

    /// Orbits that were checked, and backbones of one kind.
    fn free<'n>(&'n self, scene: &Scene) -> Vec<Entry<'n>> {
        let mut entries: Vec<Entry> = vec![];
        if scene.any(|look| *look == Look::Checked) {
            entries.push((&self.checked, scene.colour(Look::Checked), Mark::Dot));
        }
        if !scene.checked_series().is_empty() {
            match scene.axis {
                Axis::Energy => entries.push((&self.series, INK, Mark::Circle)),
                Axis::Amplitude => entries.push((NO_AMPLITUDE, INK, Mark::Nothing)),
            }
        }
        if scene.any(|look| matches!(look, Look::Backbone(..))) {
            entries.push(("backbone by harmonic balance:", INK, Mark::Nothing));
            let harmonics = self.harmonics.iter();
            entries.extend(harmonics.map(|(n, colour)| (n.as_str(), *colour, Mark::Line)));
        }
        entries
    }
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
fn curves<'n>(scene: &'n Scene) -> Vec<Entry<'n>> {
    scene.curves.iter().map(|c| (c.name.as_str(), c.colour, Mark::Bearing(c.mark))).collect()
}

/// What is stated about the energies.
fn errors(scene: &Scene) -> Vec<Entry<'static>> {
    let stated = scene.curves.iter().map(|c| (c.family, c.colour)).collect::<Vec<_>>();
    if scene.axis == Axis::Energy { error_entries(&stated) } else { vec![] }
}
