//! Summaries and pictures: plain data in, no solver known.

pub mod bands;
pub mod basins;
pub mod comparison;
pub mod crosscheck;
pub mod curve;
pub mod diagram;
mod edge;
pub mod export;
pub mod families;
pub mod figure;
pub mod margins;
pub mod overlay;
pub mod page;
pub mod phase_resonance;
pub mod pictures;
pub mod plane;
pub mod precision;
pub mod spectrum;
pub mod study;
pub mod summary;
mod surface;
pub mod tori;
pub mod trust;
