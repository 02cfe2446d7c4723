//! A stored state as a file keeps it.

use super::kept::Kept;
use super::watched;
use crate::contact::{Borne, States, Strayed};
use crate::event::{Energies, Sample};

/// A stored state as a file keeps it.
pub(super) struct Row {
    pub t: f64,
    pub u: Vec<f64>,
    pub v: Vec<f64>,
    pub active: States,
    pub pressure: Vec<f64>,
    pub traction: Vec<f64>,
    pub slide: Vec<f64>,
    pub forces: [Vec<f64>; 2],
    pub borne: Borne,
    pub strayed: Strayed,
    pub probes: Vec<Vec<f64>>,
    energies: Option<Energies>,
    pub jumps: f64,
}

impl Row {
    pub fn of(kept: &Kept, s: &Sample) -> Row {
        Row {
            t: s.t,
            u: kept.row(s.u),
            v: kept.row(s.v),
            active: s.active.clone(),
            pressure: s.pressure.to_vec(),
            traction: s.traction.to_vec(),
            slide: kept.slides(s.u),
            forces: kept.watch.resultants.of(s.pressure, s.traction, s.u),
            borne: kept.borne(s),
            strayed: kept.excursions.of(&kept.watch.body, s.u),
            probes: watched::values(kept, s),
            energies: s.energies,
            jumps: s.jumps,
        }
    }

    /// Kinetic, elastic, external, dissipated, friction, belt.
    pub fn energy(&self, k: usize) -> f64 {
        Energies::numbers(self.energies)[k]
    }

    /// Whether what is stored in single precision fits in.
    pub(crate) fn is_single(&self) -> bool {
        let of_points = self.pressure.iter().chain(&self.traction).chain(&self.slide);
        let mut all = self.u.iter().chain(&self.v).chain(of_points);
        all.all(|x| x.abs() <= f64::from(f32::MAX))
    }
}
