//! What rubs at a body, as its series see it: a component of the projections and of the terms each.

use super::play::Jenkins;
use crate::contact::System;

/// What rubs.
#[derive(Debug)]
pub(super) struct Rub {
    /// Contact point.
    pub point: usize,
    /// Its component `c`: `W = s y_c`, `n_c = s F`.
    pub component: usize,
    /// `s = √(w M⁻¹ wᵀ)`, which makes forces of unit components move the body alike.
    pub scale: f64,
    pub law: Law,
}

/// How it does.
#[derive(Debug)]
pub(super) enum Law {
    /// `memory` is the entry of `u_O` that is `z`.
    Elastic { spring: Jenkins, memory: usize },
    /// `P = factor` times the pressure, and `V`.
    Rigid { factor: f64, surface: f64 },
}

/// All that rubs; `component` makes one of the row of a displacement, and says `s`. Springs over one row share it.
pub(super) fn all(
    system: &System,
    mut component: impl FnMut(&[(usize, f64)]) -> (usize, f64),
) -> Vec<Rub> {
    let Some(tangents) = system.tangents() else { return vec![] };
    // rows of springs with what was made of them
    let mut rows: Vec<&[(usize, f64)]> = vec![];
    let mut places: Vec<(usize, f64)> = vec![];
    let mut all = vec![];
    for (point, tangent) in tangents.iter().enumerate() {
        let Some(tangent) = tangent else { continue };
        let (law, (component, scale)) = match Jenkins::of(system, point) {
            None => {
                let factor = system.limit_over_pressure(point);
                (Law::Rigid { factor, surface: tangent.surface }, component(&tangent.row))
            }
            Some((spring, memory)) => {
                let row = &tangent.row[..];
                let earlier = rows.iter().position(|r| *r == row);
                let place = earlier.map_or_else(|| component(row), |k| places[k]);
                if earlier.is_none() {
                    rows.push(row);
                    places.push(place);
                }
                (Law::Elastic { spring, memory }, place)
            }
        };
        all.push(Rub { point, component, scale, law });
    }
    all
}

impl Rub {
    /// Whether its force is an unknown: no displacement tells it.
    pub fn is_unknown(&self) -> bool {
        matches!(self.law, Law::Rigid { .. })
    }
}
