//! Points of families of orbits as plain data: what every solver hands out.
//!
//! A point ([`PointRecord`]) is of some kind ([`PointKind`]), and has an orbit in time ([`OrbitRecord`]), a Fourier series ([`SeriesRecord`]), the verdict of a
//! cross-check ([`CheckRow`]), and the place from which a continuation goes on ([`PlaceRecord`]), or lacks some of them. Numbers are in the scene's units. In JSON
//! they stand by their [`bits`].

mod attractor;
mod bands;
mod basins;
#[doc(hidden)]
pub mod bits;
mod check;
mod curve;
mod diagram;
mod extremes;
mod lyapunov;
mod orbit;
mod phase_resonance;
mod point;
mod ridge;
mod sensitivity;
mod series;
mod special;
mod tori;

pub(crate) use attractor::largest;
pub use attractor::{AttractorKind, AttractorRecord};
pub use bands::{BandRow, Bands, Deviation, Heights};
pub use basins::{AttractorFound, Basins, Fate, Share, Starts, StateAxis};
pub use check::{CheckRow, VerdictKind};
pub use curve::{Curve, CurveOf, CurvePoint, CurvePointKind, Curves};
pub use diagram::{Diagram, DiagramRow};
pub use extremes::ExtremesRecord;
pub use lyapunov::LyapunovRecord;
pub(crate) use lyapunov::mean_with_error;
pub use orbit::{FrictionRecord, OrbitRecord, ViscousRecord};
pub use phase_resonance::{PhaseResonance, Reading, Resonance, ResonanceRow, Test};
pub use point::{PlaceRecord, PointRecord};
pub(crate) use ridge::crest;
pub use ridge::{Peak, peaks, summits};
pub use sensitivity::{PeakRecord, SensitivityRecord};
pub use series::{SeriesRecord, place_of_function};
pub use special::{Bifurcation, GapReason, GrazingRecord, PointKind, StabilityChange};
pub use tori::{Tori, TorusRow};
