//! The legend of an overlay.

use std::collections::BTreeSet;

use plotters::prelude::RGBColor;

use super::scene::{Look, Scene, is_response};
use crate::records::Branch;
use crate::report::families::{Axis, error_entries, of_branch};
use crate::report::figure::{Area, Entry, FigureError, INK, Mark, legend_above, legend_columns};

/// Names in the legend.
pub(super) struct Names {
    ratios: Vec<(String, RGBColor, Mark)>,
    harmonics: Vec<(String, RGBColor)>,
    thin: String,
}

impl Names {
    pub fn new(scene: &Scene) -> Self {
        let full = scene.any(|look| matches!(look, Look::Response(_)));
        let mark = if full { Mark::Line } else { Mark::Thin };
        let ratio = |r: &f64| (format!("{r} %"), scene.colour(Look::Response(Some(*r))), mark);
        let harmonic =
            |n: &f64| (format!("N_h = {n}"), scene.colour(Look::Backbone(Some(*n as usize), true)));
        let of_thin = scene.branches.iter().filter(|b| matches!(b.2, Look::ThinResponse(_)));
        let used: BTreeSet<usize> = of_thin
            .filter_map(|(f, b, _)| f.branches.get(*b).and_then(Branch::harmonics))
            .collect();
        let used: Vec<String> = used.iter().map(usize::to_string).collect();
        let used =
            if used.is_empty() { String::new() } else { format!(", N_h = {}", used.join(", ")) };
        Names {
            ratios: scene.ratios.iter().map(ratio).collect(),
            harmonics: scene.harmonics.iter().map(harmonic).collect(),
            thin: format!("harmonic balance{used}"),
        }
    }

    /// Draw what belongs together in rows of its own; what is left of the sheet.
    pub fn draw<'b>(&self, sheet: Area<'b>, scene: &Scene) -> Result<Area<'b>, FigureError> {
        let sheet = legend_above(sheet, &self.response(scene))?;
        let sheet = legend_above(sheet, &self.free(scene))?;
        let sheet = legend_columns(sheet, &curves(scene))?;
        legend_above(sheet, &errors(scene))
    }

    /// Forced responses.
    fn response<'n>(&'n self, scene: &Scene) -> Vec<Entry<'n>> {
        let mut entries: Vec<Entry> = vec![];
        if !scene.any(is_response) {
            return entries;
        }
        let lead = match self.ratios.is_empty() {
            true => "forced response:",
            false => "forced response, damping ratio ξ:",
        };
        entries.push((lead, INK, Mark::Nothing));
        entries.extend(self.ratios.iter().map(|(n, colour, mark)| (n.as_str(), *colour, *mark)));
        let of = |stable: bool| {
            scene.branches.iter().any(|(f, b, look)| {
                matches!(look, Look::Response(_))
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
        if scene.any(|look| matches!(look, Look::ThinResponse(_))) {
            entries.push((&self.thin, INK, Mark::Thin));
        }
        entries
    }

    /// Orbits that were checked, and backbones of one kind.
    fn free<'n>(&'n self, scene: &Scene) -> Vec<Entry<'n>> {
        let mut entries: Vec<Entry> = vec![];
        if scene.any(|look| *look == Look::Checked) {
            entries.push(("orbits in time", scene.colour(Look::Checked), Mark::Dot));
        }
        if scene.any(|look| matches!(look, Look::Backbone(..))) {
            entries.push(("backbone by harmonic balance:", INK, Mark::Nothing));
            let harmonics = self.harmonics.iter();
            entries.extend(harmonics.map(|(n, colour)| (n.as_str(), *colour, Mark::Line)));
        }
        entries
    }
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
