//! The pictures of a stored run: contact, states and loops of friction, forces, probes, spectra, energy, gap map, deformed shapes.

mod contact;
mod forces;
mod friction;
mod gap;
mod ledger;
mod patches;
mod plate;
mod probes;
mod scaled;
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
pub use shapes::frames;
use shapes::shapes;
use states::states;
pub(super) use wall::boundary;

/// A picture's name and how it is drawn.
struct Picture {
    name: &'static str,
    /// Its axis is the line of the contact nodes: of a body in space, whose contact is a face, drawn only when it is asked for.
    along_edge: bool,
    /// Drawn only when it is asked for, where no probes are.
    of_probes: bool,
    draw: for<'s> fn(&'s Stored, &Options) -> Result<Sheet<'s>, FigureError>,
}

const PICTURES: [Picture; 10] = [
    Picture { name: "contact", along_edge: false, of_probes: false, draw: contact },
    Picture { name: "states", along_edge: false, of_probes: false, draw: states },
    Picture { name: "friction", along_edge: false, of_probes: false, draw: friction },
    Picture { name: "forces", along_edge: false, of_probes: false, draw: forces },
    Picture { name: "probes", along_edge: false, of_probes: true, draw: probes },
    Picture { name: "portraits", along_edge: false, of_probes: true, draw: portraits },
    Picture { name: "spectra", along_edge: false, of_probes: true, draw: spectra },
    Picture { name: "energy", along_edge: false, of_probes: false, draw: energy },
    Picture { name: "gap", along_edge: true, of_probes: false, draw: gap_map },
    Picture { name: "shapes", along_edge: false, of_probes: false, draw: shapes },
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
        let is_asked_for = only.iter().any(|o| o == picture.name);
        let is_off = (picture.along_edge && stored.is_solid())
            || (picture.of_probes && stored.probes.is_empty());
        if !is_asked_for && (!only.is_empty() || is_off) {
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
