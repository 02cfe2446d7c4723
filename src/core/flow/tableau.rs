//! Coefficients of an embedded explicit Runge–Kutta method with dense output.

/// An explicit method with `s` stages `k_0 … k_{s−1}`, then `k_s = f(t₁, y₁)` (the first stage of the next
/// step), then extra stages for the dense output.
///
/// The dense output is Hairer's nested form (see [`super::bernstein::Nested`])
/// `y₀ + θ(F₁ + (1−θ)(F₂ + θ(F₃ + (1−θ)(F₄ + …))))` with
/// `F₁ = y₁ − y₀`, `F₂ = h k₀ − F₁`, `F₃ = F₁ − h k_s − F₂`, and `F₄… = h Σ d_j k_j`.
#[derive(Debug)]
pub struct Tableau {
    /// Name in a scene.
    pub name: &'static str,
    /// Order of the method.
    pub order: u32,
    /// Exponent β of the proportional-integral step control.
    pub damping: f64,
    /// Nodes.
    pub c: &'static [f64],
    /// Stage weights (strictly lower triangle).
    pub a: &'static [&'static [f64]],
    /// Weights of the step.
    pub b: &'static [f64],
    /// Error estimate over `k_0 … k_s`.
    pub error: &'static [f64],
    /// Second, lower-order estimate that tempers the first (DOP853).
    pub error_low: Option<&'static [f64]>,
    /// Nodes of the extra stages.
    pub extra_c: &'static [f64],
    /// Weights of the extra stages.
    pub extra_a: &'static [&'static [f64]],
    /// Rows `d` of the dense output over all stages.
    pub dense: &'static [&'static [f64]],
}

impl Tableau {
    /// Number of stages without `k_s`.
    pub(crate) fn stages(&self) -> usize {
        self.b.len()
    }

    /// Number of all stages.
    pub(crate) fn all_stages(&self) -> usize {
        self.b.len() + 1 + self.extra_c.len()
    }

    /// Number of nested coefficients `F₀, F₁, …`.
    pub fn nested(&self) -> usize {
        4 + self.dense.len()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{dop853::DOP853, dopri5::DOPRI5};

    /// Quadrature conditions `Σ b c^q = 1/(q+1)`, row sums, and error weights that cancel.
    #[test]
    fn order_conditions_hold() {
        for t in [&DOPRI5, &DOP853] {
            for (a, c) in t.a.iter().zip(t.c) {
                assert!((a.iter().sum::<f64>() - c).abs() < 1e-13);
            }
            for (a, c) in t.extra_a.iter().zip(t.extra_c) {
                assert!((a.iter().sum::<f64>() - c).abs() < 1e-13);
            }
            for q in 0..t.order {
                let sum: f64 = t.b.iter().zip(t.c).map(|(b, c)| b * c.powi(q as i32)).sum();
                assert!((sum - 1.0 / f64::from(q + 1)).abs() < 1e-13, "{} {q}", t.name);
            }
            assert!(t.error.iter().sum::<f64>().abs() < 1e-13);
            assert!(t.error_low.is_none_or(|e| e.iter().sum::<f64>().abs() < 1e-13));
        }
    }
}
