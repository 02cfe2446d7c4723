//! `[damping]`

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, count_from_one};
use super::pair;
use super::{Amplitude, Issue, Scene};

/// `C = αM + βK`, or ratios of all modes: exactly one of `rayleigh`, `ratio`, `ratios`, `modal`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Damping {
    /// `[α, β]`: β is a time, α a frequency.
    #[schemars(extend("examples" = [[0.0, 1e-3]]))]
    #[serde(default, deserialize_with = "pair::array")]
    pub rayleigh: Option<[f64; 2]>,
    /// Ratio at one mode (stiffness proportional, α = 0).
    pub ratio: Option<f64>,
    /// The mode of `ratio`, from 1.
    #[schemars(extend("default" = 1), range(min = 1))]
    pub mode: Option<usize>,
    /// Ratios at two modes: `[[mode, ξ], [mode, ξ]]`.
    #[schemars(extend("examples" = [[[1, 0.01], [3, 0.01]]]))]
    #[serde(default, deserialize_with = "pair::pairs")]
    pub ratios: Option<[(usize, f64); 2]>,
    /// One ratio for all modes of the open body, or a list from the lowest on, none for the others: `C = Σ 2ξ_kω_k (Mφ_k)(Mφ_k)ᵀ`, in contact too.
    #[schemars(extend("examples" = [0.005, [0.01, 0.02]]))]
    pub modal: Option<Amplitude>,
}

impl Scene {
    pub(super) fn check_damping(&self) -> Check {
        let Some(d) = &self.damping else { return Ok(()) };
        let given =
            [d.rayleigh.is_some(), d.ratio.is_some(), d.ratios.is_some(), d.modal.is_some()];
        if given.iter().filter(|&&g| g).count() != 1 {
            return Err(Issue::new(
                "damping",
                "give exactly one of rayleigh, ratio, ratios, modal",
                "rayleigh = [0.0, 1e-3], or ratio = 0.01 with mode = 1, or ratios = [[1, 0.01], [3, 0.01]], or modal = 0.005",
            ));
        }
        let non_negative = |key: &str, v: f64| {
            if v.is_finite() && v >= 0.0 {
                return Ok(());
            }
            Err(Issue::new(key, format!("must not be negative, is {v}"), "give numbers ≥ 0"))
        };
        if let Some(r) = d.rayleigh {
            r.iter().try_for_each(|&v| non_negative("damping.rayleigh", v))?;
        }
        if let Some(r) = d.ratio {
            non_negative("damping.ratio", r)?;
        } else if d.mode.is_some() {
            return Err(Issue::new(
                "damping.mode",
                "goes with `ratio` only",
                "remove it or give ratio",
            ));
        }
        if let Some(m) = d.mode {
            count_from_one("damping.mode", m)?;
        }
        match &d.modal {
            Some(Amplitude::Scalar(r)) => non_negative("damping.modal", *r)?,
            Some(Amplitude::Vector(all)) => {
                all.iter().try_for_each(|&r| non_negative("damping.modal", r))?;
            }
            None => {}
        }
        if let Some([(m1, r1), (m2, r2)]) = d.ratios {
            for (m, r) in [(m1, r1), (m2, r2)] {
                count_from_one("damping.ratios", m)?;
                non_negative("damping.ratios", r)?;
            }
            if m1 == m2 {
                return Err(Issue::new(
                    "damping.ratios",
                    "names one mode twice",
                    "give two different modes",
                ));
            }
        }
        Ok(())
    }
}
