//! The largest magnitude of a vector.

/// `max_i |x_i|`, zero of no numbers; what is none is left out.
pub(crate) fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}
