//! Summaries and pictures: plain data in, no solver known.

pub mod export;
pub mod families;
pub mod figure;
pub mod pictures;
pub mod precision;
pub mod summary;
