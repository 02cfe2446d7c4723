//! The pictures of a stored run: contact, states and loops of friction, forces, probes, spectra, sections, energy, gap map, deformed shapes.

mod contact;
mod forces;
mod friction;
mod gap;
mod ledger;
mod patches;
mod plate;
mod probes;
mod scaled;
mod section;
mod shapes;
mod solid;
mod states;
mod time;
mod wall;

use std::path::Path;

use super::figure::{Drawing, FigureError, Sheet};
use crate::store::{Stored, beside};
use contact::contact;
use forces::forces;
use friction::friction;
use gap::gap_map;
use ledger::energy;
use probes::{portraits, probes, spectra};
use section::section;
pub use shapes::frames;
use shapes::shapes;
use states::states;
pub(super) use wall::boundary;

/// A picture's name and how it is drawn.
struct Picture {
    name: &'static str,
    /// For which runs it is drawn unasked.
    unasked: fn(&Stored) -> bool,
    draw: for<'s> fn(&'s Stored, &Options) -> Result<Sheet<'s>, FigureError>,
}

/// Its axis is the line of the contact nodes, where that is no face.
fn is_line(stored: &Stored) -> bool {
    !stored.is_solid()
}

fn has_probes(stored: &Stored) -> bool {
    !stored.probes.is_empty()
}

const PICTURES: [Picture; 11] = [
    Picture { name: "contact", unasked: |_| true, draw: contact },
    Picture { name: "states", unasked: |_| true, draw: states },
    Picture { name: "friction", unasked: |_| true, draw: friction },
    Picture { name: "forces", unasked: |_| true, draw: forces },
    Picture { name: "probes", unasked: has_probes, draw: probes },
    Picture { name: "portraits", unasked: has_probes, draw: portraits },
    Picture { name: "spectra", unasked: has_probes, draw: spectra },
    Picture { name: "section", unasked: |_| false, draw: section },
    Picture { name: "energy", unasked: |_| true, draw: energy },
    Picture { name: "gap", unasked: is_line, draw: gap_map },
    Picture { name: "shapes", unasked: |_| true, draw: shapes },
];

/// What a user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Times of the deformed shapes, as fractions of the stored time.
    pub fractions: Vec<f64>,
    /// The stored states are one period of an orbit.
    pub periodic: bool,
    /// Mesh nodes whose contact is drawn; none: up to twelve, those of the largest pressures first.
    pub nodes: Vec<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            fractions: (0..8).map(|k| f64::from(k) / 7.0).collect(),
            nodes: vec![],
            periodic: false,
        }
    }
}

/// Names of the pictures.
pub fn names() -> Vec<&'static str> {
    PICTURES.iter().map(|p| p.name).collect()
}

/// Draw the named pictures (all that make sense if `only` is empty), to be written as `STEM-NAME.svg` and `.png`.
pub(crate) fn draw_all<'s>(
    stored: &'s Stored,
    stem: &Path,
    only: &[String],
    options: &Options,
) -> Result<Vec<Drawing<'s>>, FigureError> {
    let mut drawn = vec![];
    for picture in &PICTURES {
        let is_asked_for = only.iter().any(|o| o == picture.name)
            || (only.is_empty() && (picture.unasked)(stored));
        if !is_asked_for {
            continue;
        }
        let sheet = match (picture.draw)(stored, options) {
            Ok(sheet) => sheet,
            Err(FigureError::Empty(_)) if only.is_empty() => continue,
            Err(e) => return Err(e),
        };
        drawn.push(Drawing { stem: beside(stem, &format!("-{}", picture.name)), sheet });
    }
    Ok(drawn)
}
