//! `[orbit]`: periodic orbits and families of them.

use schemars::JsonSchema;
use serde::Deserialize;

use super::number::{Check, positive};
use super::pair;
use super::{Issue, Scene};

/// `[orbit]`
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// Circular frequency of the orbit.
    pub omega: Option<f64>,
    /// Or: its period.
    pub period: Option<f64>,
    /// Harmonics of harmonic balance.
    #[schemars(range(min = 1))]
    pub harmonics: Option<usize>,
    /// Circular frequencies of a family, from and to.
    #[schemars(extend("examples" = [[1.586, 2.08]]))]
    #[serde(default, deserialize_with = "pair::array")]
    pub range: Option<[f64; 2]>,
    /// Viscous nonlinear modes: `β` of `C = βK − αM`, a time, or `"auto"`: `(L/c)/min(10, n/2)²`, with a quarter period of the pinned mode `L/c` and the `n` elements that a pressure wave meets in that time.
    pub beta: Option<Beta>,
    /// Viscous nonlinear modes: the mode of the open body that it is pinned to, from 1; by default the one that uniform pressures on the contacts move most.
    pub mode: Option<usize>,
    /// Damping ratios of `response`, in place of the scene's own.
    pub ratios: Option<Vec<f64>>,
}

/// `[orbit] beta`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "give a number (a time), or \"auto\"")]
pub enum Beta {
    /// A time.
    Number(f64),
    /// What the mesh resolves.
    Word(Auto),
}

/// The word of [`Beta`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Auto {
    /// `"auto"`
    Auto,
}

impl Scene {
    pub(super) fn check_orbit(&self) -> Check {
        let Some(o) = &self.orbit else { return Ok(()) };
        if o.omega.is_some() && o.period.is_some() {
            return Err(Issue::new(
                "orbit.period",
                "stands beside omega",
                "give omega or period, not both",
            ));
        }
        if let Some(w) = o.omega {
            positive("orbit.omega", w)?;
        }
        if let Some(t) = o.period {
            positive("orbit.period", t)?;
        }
        if let Some([a, b]) = o.range {
            positive("orbit.range", a)?;
            positive("orbit.range", b)?;
            if a >= b {
                return Err(Issue::new(
                    "orbit.range",
                    format!("[{a}, {b}] is empty"),
                    "give the lower frequency first",
                ));
            }
        }
        if let Some(Beta::Number(beta)) = o.beta {
            positive("orbit.beta", beta)?;
        }
        if o.mode == Some(0) {
            return Err(Issue::new("orbit.mode", "modes count from 1", "mode = 1"));
        }
        if o.harmonics == Some(0) {
            return Err(Issue::new("orbit.harmonics", "needs at least one", "harmonics = 15"));
        }
        if let Some(ratios) = &o.ratios {
            if ratios.is_empty() {
                return Err(Issue::new("orbit.ratios", "is empty", "ratios = [0.01, 0.02]"));
            }
            ratios.iter().try_for_each(|&r| positive("orbit.ratios", r))?;
            if self.damping.as_ref().is_none_or(|d| d.ratio.is_none()) {
                return Err(Issue::new(
                    "orbit.ratios",
                    "stands in place of the ratio in [damping], and there is none",
                    "[damping] with ratio = 0.02 and mode = 1",
                ));
            }
        }
        Ok(())
    }
}
