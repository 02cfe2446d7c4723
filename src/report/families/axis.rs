//! What the picture of a family shows over the frequency.

use super::branches::is_viscous;
use crate::records::OrbitRecord;
use crate::store::StoredFamily;

/// A quantity over the frequency.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Axis {
    /// Energy.
    #[default]
    Energy,
    /// Largest contact displacement.
    Amplitude,
}

impl Axis {
    /// Its name in a title.
    pub(in crate::report) fn name(self) -> &'static str {
        match self {
            Axis::Energy => "energy",
            Axis::Amplitude => "amplitude",
        }
    }

    /// The name of the axis: the energy of viscous orbits is that at `t = 0`.
    pub(in crate::report) fn label(self, families: &[&StoredFamily]) -> &'static str {
        let viscous = families.iter().filter(|f| is_viscous(f)).count();
        match (self, viscous) {
            (Axis::Amplitude, _) => "largest contact displacement",
            (Axis::Energy, 0) => "largest energy H",
            (Axis::Energy, n) if n == families.len() => "energy H at t = 0",
            (Axis::Energy, _) => "energy H: the largest, of viscous motions that at t = 0",
        }
    }

    /// Its value.
    pub(in crate::report) fn of(self, orbit: &OrbitRecord) -> f64 {
        match self {
            Axis::Energy => orbit.energy,
            Axis::Amplitude => orbit.amplitude,
        }
    }
}
